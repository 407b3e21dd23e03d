"""Waveforms of several runs with all that is stated about them, and their vectors as a runs table."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from balancing import Labels
from rotorid.base import result
from rotorid.base.arrays import AnyArray, FloatArray, significant
from rotorid.base.result import Column
from rotorid.base.rpm import RPM
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.words import Phase
from rotorid.files import units, value_kinds
from rotorid.files.conventions import PHASES, as_phase
from rotorid.files.grid import Grid
from rotorid.files.instruments import Sampled, read_samples, refusal
from rotorid.files.problems import InputError, Problems, TableWarning
from rotorid.files.settings_keys import Key, Kind, take
from rotorid.files.toml_file import Section, read_toml
from rotorid.files.units import VIBRATION, Unit, spelt
from rotorid.files.value_kinds import ABOVE_ZERO, TEXT, number
from rotorid.waveforms.record import Channel, Edge, SignalPath, TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import Vectors, find_vectors

DERIVATIVE = {"length": 0, "velocity": 1, "acceleration": 2}
SAME_RATE = 1e-3
"""A stated rate may be more exact than that of the file, but not another one."""
DIGITS = 6
_NAMED_UNIT = re.compile(rf"(.+?)(?:_| *[\[(] *)({'|'.join(sorted(VIBRATION, key=len))}) *[\])]?")
_RECORDS = 'files by the names of their runs, such as { BASE = "base.wav" }, or a list of files'


def _unit(section: Section, key: str) -> Unit | None:
    text = section.text(key)
    try:
        return None if text is None else units.vibration(text)
    except units.UnitError as error:
        section.complain(key, str(error))
        return None


def _records(section: Section, key: str) -> dict[str, str] | None:
    """Files by run; those of a list by their names without suffix."""
    value = section.take(key)
    if isinstance(value, list) and all(isinstance(file, str) for file in value):
        stems = [Path(file).stem for file in value]
        if twice := [file for file, stem in zip(value, stems, strict=True) if stems.count(stem) > 1]:
            expected = f"files of different names, which are those of the runs, not {listing(twice, 'and')}"
            section.complain(key, f'{expected}; or [records] with RUN = "FILE"', value=False)
        value = dict(zip(stems, value, strict=True))
    if isinstance(value, dict) and value and all(isinstance(file, str) and file for file in value.values()):
        return value
    section.complain(key, _RECORDS, value=False)
    return None


_UNIT = Kind(_unit, TEXT.schema, "a unit of vibration", "um", cell="name")
_FILES = {"anyOf": [{"type": "object"}, {"type": "array", "items": TEXT.schema}]}
CHANNEL = (
    Key("channel", TEXT, "its name in the records, default that of the sensor; in a WAV file `1`, `2`, …"),
    Key("unit", _UNIT, "unit of its numbers after `scale`, peak values: `um`, `mm_s`, `g`, … or any label"),
    Key("scale", number(), "how much of the unit one number of the record is, default 1", default=1.0),
    Key(
        "high_pass_Hz",
        ABOVE_ZERO,
        "corner of an AC coupling (Butterworth), taken off again",
        {name: units.SPEED[name] for name in ("Hz", "rad_s")},
    ),
    Key("high_pass_order", value_kinds.whole("its order", 1, 10), "its order, default 1", default=1),
    Key("delay_ms", number(0.0), "delay of an anti-alias filter, taken off again", units.TIME),
)
WAVEFORMS = (
    Key("tacho", TEXT, "channel of the tacho"),
    Key("pulses", value_kinds.whole("pulses", 1, 10_000), "pulses a turn, default 1", default=1),
    Key(
        "edge",
        value_kinds.choice(get_args(Edge)),
        'what of the mark is angle 0, default `"leading"`: where it begins, whatever its polarity',
        default="leading",
    ),
    Key("tacho_level", number(), "where an edge is, in numbers of the record; default: half-way"),
    Key("phase", value_kinds.choice(PHASES), "whether phases that are written lead or lag, as in a job"),
    Key("unit", _UNIT, "unit of all channels that state none"),
    Key("amplitude", _UNIT, "unit in which vectors are written, default that of the first channel"),
    Key(
        "orders",
        value_kinds.numbers("orders above 0, such as orders = [1, 2]", "1; 2", above_zero=True),
        "orders, default 1",
    ),
    Key("rate_Hz", ABOVE_ZERO, "samples a second, where the records do not say"),
    Key(
        "speeds_rpm",
        value_kinds.numbers("speeds, such as speeds_rpm = [900, 1200]", "900; 1200", above_zero=True),
        "speeds at which vectors are wanted",
        units.SPEED,
    ),
    Key("records", Kind(_records, _FILES, header="[{}]"), f"{_RECORDS}, relative to this file"),
    Key("channels", value_kinds.named(CHANNEL), "sensors by name, default all channels but the tacho's"),
)


@dataclass(frozen=True, eq=False)
class Waveforms:
    """Records in SI, each with a tacho, and how what is found in them is written.

    Attributes
    ----------
    records
        A run each, of the same sensors.
    tacho
        How turns are marked.
    labels
        Units and phase convention of the vectors.
    orders
        At least one.
    speeds
        rad/s; None: unstated.
    files
        All that were read.
    unstated
        Whether nobody says if phases lead or lag: they lead then.
    """

    records: tuple[WaveformRecord, ...]
    tacho: TachoSettings
    labels: Labels
    orders: tuple[float, ...]
    speeds: tuple[float, ...] | None
    files: tuple[Path, ...]
    unstated: bool


def read_waveforms(files: Sequence[str | Path], stated: Mapping[str, object] | None = None) -> Waveforms:
    """Read records with their settings.

    Parameters
    ----------
    files
        One waveforms file (.toml), or records, each of which is a run named as the file without its suffix.
    stated
        Settings of the command line, by the keys of a waveforms file, of which None says nothing; they count
        instead of those of the file. `sensors` are the names of the channels that are wanted.

    Raises
    ------
    InputError
        With the problems of all files.
    """
    problems, paths = Problems(), [Path(file) for file in files]
    settings = next((path for path in paths if path.suffix.lower() == ".toml"), None)
    data = {} if settings is None else dict(problems.need(read_toml(settings, problems)))
    options: dict[str, Any] = {key: value for key, value in (stated or {}).items() if value is not None}
    if (wanted := options.pop("sensors", None)) is not None:
        channels = data.get("channels")
        given = channels if isinstance(channels, dict) else {}
        options["channels"] = {name: given.get(name, {}) for name in wanted}
    if any(key.startswith("speeds_") for key in options):
        data = {key: value for key, value in data.items() if not key.startswith("speeds_")}
    if settings is None:
        options["records"] = [str(path) for path in paths]
    top = Section("the options" if settings is None else str(settings), data | options, problems)
    if settings is not None and len(paths) > 1:
        top.refuse("one waveforms file alone, whose [records] are files; or records without it")
    values = take(top, WAVEFORMS)
    if values["records"] is None and "records" not in top.refused and not len(problems):
        top.missing("records", "a file for each run")
    problems.stop()
    folder = Path() if settings is None else settings.parent
    read = {run: folder / file for run, file in values["records"].items()}
    records = []
    for run, path in read.items():
        try:
            records.append(_record(run, path, values))
        except InputError as error:
            problems.extend(error.problems)
    problems.stop()
    quantity, speeds = values["amplitude"] or records[0][1][0], values["speeds_rpm"]
    for record, measured in records:
        for sensor, unit in zip(record.sensors, measured, strict=True):
            if unit.kind != quantity.kind and not {unit.kind, quantity.kind} <= DERIVATIVE.keys():
                expected = f"a unit that can become that of the amplitudes, {quantity.name or 'none'}"
                problems.add(record.source, None, sensor.name, unit.name, expected)
    problems.stop()
    return Waveforms(
        tuple(record for record, _ in records),
        TachoSettings(values["pulses"], values["edge"], values["tacho_level"]),
        Labels(quantity.name, quantity.scale, phase=values["phase"] or "lead"),
        values["orders"] or (1.0,),
        None if speeds is None else tuple(speeds.unit.to_si(speed) for speed in speeds.value),
        (*([] if settings is None else [settings]), *read.values()),
        values["phase"] is None,
    )


def _record(run: str, path: Path, values: Mapping[str, Any]) -> tuple[WaveformRecord, list[Unit]]:
    """The record and the unit of each of its sensors; raises InputError."""
    sampled = read_samples(path)
    rate = values["rate_Hz"] or sampled.rate
    if rate is None:
        raise refusal(path, "a rate: a channel t_s of times, --rate, or rate_Hz in a waveforms file")
    if sampled.rate is not None and abs(rate / sampled.rate - 1.0) > SAME_RATE:
        raise refusal(path, f"the rate that the file has, {sampled.rate:.6g} Hz, not {rate:.6g} Hz")
    if values["tacho"] is None:
        expected = "a tacho channel, without which there is no phase: --tacho NAME (tacho in a file); "
        raise refusal(path, f"{expected}the channels are {listing(sampled.channels, 'and')}")
    key, _ = _find(path, sampled, values["tacho"])
    pulses = _samples(path, sampled, key)
    tacho = Channel(key, pulses if sampled.scale == 1.0 else pulses * np.float32(sampled.scale))
    channels = values["channels"] or _all_but(sampled, key)
    sensors, measured = [], []
    for name, channel in channels.items():
        column, in_name = _find(path, sampled, channel["channel"] or name)
        unit = channel["unit"] or in_name or values["unit"] or Unit("", "label ''")
        if in_name is not None and in_name.name != unit.name:
            raise refusal(path, f"the unit {in_name.name} of its name, not {unit.name}", column=column)
        if unit.name.endswith(("_pp", "_rms")) and unit.kind in DERIVATIVE:
            expected = f"the unit of a sample, {unit.name.rpartition('_')[0]}, not {unit.name}"
            raise refusal(path, expected, column=column)
        corner, delay = channel["high_pass_Hz"], channel["delay_ms"]
        signal_path = SignalPath(corner and corner.si, channel["high_pass_order"], delay.si if delay else 0.0)
        factor = channel["scale"] * unit.to_si(sampled.scale)
        samples = _samples(path, sampled, column)
        sensors.append(Channel(name, samples, factor, DERIVATIVE.get(unit.kind), signal_path))
        measured.append(unit)
    if not sensors:
        raise refusal(path, "a channel besides that of the tacho")
    return WaveformRecord(run, str(path), rate, tacho, tuple(sensors)), measured


def _all_but(sampled: Sampled, tacho: str) -> dict[str, dict[str, Any]]:
    """Settings of all channels but the tacho, named without their units where that tells them apart."""
    plain = {key.names[0]: key.default for key in CHANNEL}
    channels: dict[str, dict[str, Any]] = {}
    for name in sampled.channels:
        stem = _parted(name)[0]
        if name != tacho:
            channels[name if stem in channels else stem] = {**plain, "channel": name}
    return channels


def _parted(name: str) -> tuple[str, Unit | None]:
    """A channel's name without the unit in it, and that: `B1X_um`, `B1X [mm/s]`."""
    match = _NAMED_UNIT.fullmatch(spelt(name))
    return (name, None) if match is None else (name[: match.end(1)], VIBRATION[match[2]])


def _find(path: Path, sampled: Sampled, name: str) -> tuple[str, Unit | None]:
    """The channel of this name, with or without its unit, and the unit in the name."""
    parted = {channel: _parted(channel) for channel in sampled.channels}
    alike = [channel for channel, (stem, _) in parted.items() if stem == name]
    chosen = [name] if name in parted else alike
    if len(chosen) != 1:
        hint = did_you_mean(name, [*parted, *(stem for stem, _ in parted.values())])
        expected = f"a channel of this name{hint}; the channels are {listing(alike or parted, 'and')}"
        raise refusal(path, expected, column=name)
    return chosen[0], parted[chosen[0]][1]


def _samples(path: Path, sampled: Sampled, name: str) -> AnyArray:
    """A channel without gaps."""
    samples = sampled.channels[name]
    if samples.dtype.kind == "f" and not (finite := np.isfinite(samples)).all():
        at = int(np.argmin(finite))
        value = "" if np.isnan(samples[at]) else str(samples[at])
        raise refusal(path, "a number in each sample", at + sampled.first_row, name, value)
    return samples.astype(np.int8) if samples.dtype.kind == "b" else samples


def find_each(waveforms: Waveforms) -> tuple[Vectors, ...]:
    """The vectors of each record.

    Raises
    ------
    ValueError
        As `find_vectors`, and for records of which only some tell where a turn begins.
    """
    unit = VIBRATION.get(waveforms.labels.vibration_unit)
    each = tuple(
        find_vectors(
            record,
            waveforms.tacho,
            tuple(int(order) for order in waveforms.orders),
            derivative=None if unit is None else DERIVATIVE[unit.kind],
            speeds=None if waveforms.speeds is None else np.array(waveforms.speeds),
        )
        for record in waveforms.records
    )
    if len(each) > 1 and not all(one.tacho.indexed for one in each):
        raise ValueError(
            f"{waveforms.records[0].source}: the {waveforms.tacho.pulses} pulses of a turn are alike, so "
            "that vectors of different records cannot be compared: give the runs a tacho with one pulse a "
            "turn, or pulses that tell where a turn begins"
        )
    return each


def vectors_columns(each: Sequence[Vectors], labels: Labels) -> tuple[Column, ...]:
    """A runs table of records of the same sensors and orders, one row an instant and a sensor."""
    unit, scale = labels.vibration_unit, labels.vibration_scale
    plain = unit.removesuffix("_pp").removesuffix("_rms")
    end = f"_{unit}" if unit else ""
    shown = 1 if unit.endswith("_rms") else 0
    counts = [(len(one.times), len(one.sensors)) for one in each]

    def joined(parts: Sequence[FloatArray]) -> FloatArray:
        """Values (P, C), or (P,) of all sensors, of each record, as one column."""
        wide = [np.broadcast_to(part.T, count[::-1]).T for part, count in zip(parts, counts, strict=True)]
        return significant(np.concatenate([part.ravel() for part in wide]), DIGITS)

    columns = [
        Column("run", [one.run for one in each for _ in one.times for _ in one.sensors], str),
        Column("time_s", joined([one.times for one in each])),
        Column("speed_rpm", joined([one.speeds * RPM for one in each]), "{:.1f}".format, "rpm"),
        Column("sensor", [name for one in each for _ in one.times for name in one.sensors], str),
    ]
    for k, order in enumerate(each[0].orders):
        name = "" if order == 1 else f"order{order}_"
        about = unit.replace("_", " ") if order == 1 else f"{order}×"
        vectors = [one.vectors[:, :, k] for one in each]
        amplitude, phase = zip(*(labels.vibration(one) for one in vectors), strict=True)
        turned = [
            np.degrees(np.minimum(one.tangential[:, :, k] / np.maximum(np.abs(z), 1e-300), np.pi))
            for one, z in zip(each, vectors, strict=True)
        ]
        std = joined([one.radial[:, :, k] * scale for one in each])
        columns += [
            Column(f"{name}amplitude{end}", joined(amplitude), "{:.4g}".format, about),
            Column(f"{name}phase_deg", joined(phase), "{:.1f}°".format, "phase"),
            Column(f"{name}amplitude_std{end}", std, "{:.2g}".format, "±"),
            Column(f"{name}phase_std_deg", joined(turned), "{:.2g}°".format, "±"),
        ]
    overall = joined([one.overall[..., shown] * scale for one in each])
    gap = joined([one.gap * (scale if plain == unit else VIBRATION[plain].scale) for one in each])
    ends = ["end of the record" if near else "" for one in each for near in one.end for _ in one.sensors]
    return (
        *columns,
        Column(f"overall{end}", overall, "{:.4g}".format, "all"),
        Column(f"gap_{plain}" if plain else "gap", gap, "{:.4g}".format, "gap"),
        Column("turns", joined([one.turns for one in each]), "{:.0f}".format),
        Column("note", ends),
    )


def read_vectors_grid(
    path: Path,
    phase: str | None,
    problems: Problems,
    stated: Mapping[str, object] | None = None,
    *,
    moving: bool = False,
) -> tuple[Grid, Phase, tuple[Path, ...]] | None:
    """The vectors of a waveforms file as cells of a runs table, their phase convention, files that were read.

    What is to be known of the records is a `TableWarning`.

    Parameters
    ----------
    path
        Of the waveforms file, or a record.
    phase
        Convention in which phases are wanted; None: that of the file.
    problems
        Collects the complaints; then there is nothing.
    stated
        As in `read_waveforms`.
    moving
        Whether records whose speed changes need no chosen speeds.
    """
    try:
        waveforms = read_waveforms([path], stated)
        labels = waveforms.labels if phase is None else replace(waveforms.labels, phase=as_phase(phase))
        each = find_each(waveforms)
        columns = vectors_columns(each, labels)
    except InputError as error:
        problems.extend(error.problems)
        return None
    except ValueError as error:
        problems.add(str(path), None, None, None, f"records with vectors: {error}")
        return None
    swept = [one.run for one in each if not one.steady]
    if swept and waveforms.speeds is None and not moving:
        expected = f"speeds at which {listing(map(repr, swept), 'and')} are read, whose speed is not steady"
        problems.add(str(path), None, "speeds_rpm", None, f"{expected}, such as speeds_rpm = [900, 1200]")
        return None
    for one in each:
        for word in one.warnings:
            warnings.warn(f"{path}: run {one.run!r}: {word}", TableWarning, stacklevel=2)
    cells = (tuple("" if value is None else value for value in row.values()) for row in result.rows(columns))
    header = tuple(column.name for column in columns)
    return Grid(str(path), 1, header, tuple(enumerate(cells, start=2))), labels.phase, waveforms.files
