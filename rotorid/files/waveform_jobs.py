"""Waveforms of several runs with all that is stated about them, and their vectors as a runs table."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator

from balancing import Labels
from rotorid.base.arrays import AnyArray, significant
from rotorid.base.choices import did_you_mean
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, Phase, listing
from rotorid.files import units
from rotorid.files.cells import Grid
from rotorid.files.input_problems import InputError, Problems, TableWarning, refusal
from rotorid.files.instrument_formats import DERIVATIVE, read_samples
from rotorid.files.settings import (
    Count,
    NotNegative,
    Number,
    Positive,
    Settings,
    Text,
    Whole,
    key,
    listed,
    optional,
    read_settings,
    read_toml,
)
from rotorid.files.units import VIBRATION, Unit, spelt
from rotorid.waveforms.record import Channel, Edge, SignalPath, TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import Vectors, find_vectors

SAME_RATE = 1e-3
"""A stated rate may be more exact than that of the file, but not another one."""
DIGITS = 6
_ROWS = ("times", "speeds", "vectors", "radial", "tangential", "turns", "overall", "gap", "end")
"""Of `Vectors`: what has a row an instant."""
_NAMED_UNIT = re.compile(rf"(.+?)(?:_| *[\[(] *)({'|'.join(sorted(VIBRATION, key=len))}) *[\])]?")
_RECORDS = 'files by the names of their runs, such as { BASE = "base.wav" }'


if TYPE_CHECKING:
    Vibration = Unit
else:
    Vibration = Annotated[Text, AfterValidator(units.vibration)]


class ChannelKeys(Settings):
    """A sensor: `[channels.NAME]`."""

    channel: Text | None = optional(
        "its name in the records, default that of the sensor; in a WAV file `1`, `2`, …"
    )
    unit: Vibration | None = optional(
        "unit of its numbers after `scale`, peak values: `um`, `mm_s`, `g`, … or any label",
        example="um",
    )
    scale: Number = key("how much of the unit one number of the record is, default 1", default=1.0)
    high_pass: Positive | None = optional(
        "corner of an AC coupling (Butterworth), taken off again",
        "high_pass_Hz",
        units={name: units.SPEED[name] for name in ("Hz", "rad_s")},
    )
    high_pass_order: Whole = key("its order, default 1", default=1, ge=1, le=10)
    delay: NotNegative = key(
        "delay of an anti-alias filter, taken off again", "delay_ms", 0.0, units=units.TIME
    )


class WaveformsFile(Settings):
    """A waveforms file."""

    tacho: Text | None = optional("channel of the tacho")
    pulses: Whole = key("pulses a turn, default 1", default=1, ge=1, le=10_000, expected="pulses a turn")
    edge: Edge = key(
        'what of the mark is angle 0, default `"leading"`: where it begins, whatever its polarity',
        default="leading",
    )
    tacho_level: Number | None = optional("where an edge is, in numbers of the record; default: half-way")
    phase: Phase | None = optional("whether phases that are written lead or lag, as in a job")
    unit: Vibration | None = optional("unit of all channels that state none", example="um")
    amplitude: Vibration | None = optional(
        "unit in which vectors are written, default that of the first channel", example="um"
    )
    orders: listed(Count) = key("orders, default 1", default=(1,), example="orders = [1, 2]")  # type: ignore[valid-type]
    rate: Positive | None = optional("samples a second, where the records do not say", "rate_Hz")
    speeds: listed(Positive) | None = optional(  # type: ignore[valid-type]
        "speeds at which vectors are wanted",
        "speeds_rpm",
        units=units.SPEED,
        example="speeds_rpm = [900, 1200]",
    )
    records: dict[str, Text] = key(
        f"{_RECORDS}, relative to this file", expected=f"a file for each run: {_RECORDS}", min_length=1
    )
    channels: dict[str, ChannelKeys] = key(
        "sensors by name, default all channels but the tacho's", default={}
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
    orders: tuple[int, ...]
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
        instead of those of the file.

    Raises
    ------
    InputError
        With the problems of all files.
    """
    problems, paths = Problems(), [*map(Path, files)]
    settings = next((path for path in paths if path.suffix.lower() == ".toml"), None)
    source, folder = str(settings or "the options"), (settings or Path()).parent
    data = {"records": {path.stem: str(path) for path in paths}}
    if settings is not None:
        data = read_toml(settings)
    if len(paths) > (1 if settings else len(data["records"])):
        words = "records of different names, which are those of the runs; or one waveforms file alone"
        problems.add(words, source)
    options = {key: value for key, value in (stated or {}).items() if value is not None}
    if "speeds_rad_s" in options:
        data = {key: value for key, value in data.items() if not key.startswith("speeds_")}
    problems.stop()
    file = read_settings(WaveformsFile, data | options, source)
    records, amplitude = list[WaveformRecord](), file.amplitude
    for run, name in file.records.items():
        try:
            record, amplitude = _record(run, folder / name, file, amplitude)
            records.append(record)
        except InputError as error:
            problems.extend(error.problems)
    problems.stop()
    unit = problems.need(amplitude)
    return Waveforms(
        tuple(records),
        TachoSettings(file.pulses, file.edge, file.tacho_level),
        Labels(unit.name, unit.scale, phase=file.phase or "lead"),
        file.orders,
        file.speeds,
        (*filter(None, [settings]), *(folder / name for name in file.records.values())),
        file.phase is None,
    )


def _record(
    run: str, path: Path, file: WaveformsFile, amplitude: Unit | None
) -> tuple[WaveformRecord, Unit | None]:
    """The record and the unit of amplitudes, without one that of its first sensor; raises InputError."""
    sampled = read_samples(path)
    rate = file.rate or sampled.rate
    if rate is None:
        raise refusal(path, "a rate: a channel t_s of times, or rate_Hz in a waveforms file")
    if abs(rate / (sampled.rate or rate) - 1.0) > SAME_RATE:
        raise refusal(path, f"the rate that the file has, {sampled.rate:.6g} Hz, not {rate:.6g} Hz")
    parts = {column: _parted(column) for column in sampled.channels}
    stems = Counter(stem for stem, _ in parts.values())
    short = {stem if stems[stem] == 1 else column: column for column, (stem, _) in parts.items()}
    there = f"; the channels are {listing(parts, 'and')}"

    def channel(name: str) -> tuple[str, AnyArray]:
        """A channel, named with or without its unit, and its samples without gaps."""
        column = short.get(name, name)
        if column not in parts:
            hint = did_you_mean(name, {**short, **parts})
            raise refusal(path, f"a channel of this name{hint}{there}", column=name)
        samples = sampled.channels[column]
        for at in np.flatnonzero(~np.isfinite(samples))[:1]:
            value = "" if np.isnan(samples[at]) else str(samples[at])
            raise refusal(path, "a number in each sample", int(at) + sampled.first_row, column, value)
        return column, samples

    if file.tacho is None:
        expected = "a tacho channel, without which there is no phase: --tacho NAME (tacho in a file)"
        raise refusal(path, expected + there)
    marks, pulses = channel(file.tacho)
    others = {name: ChannelKeys() for name, column in short.items() if column != marks}
    sensors = list[Channel]()
    for name, keys in (file.channels or others).items():
        column, samples = channel(keys.channel or name)
        in_name = parts[column][1]
        unit = keys.unit or in_name or file.unit or Unit("", "label ''")
        amplitude = amplitude or unit
        if in_name and in_name.name != unit.name:
            raise refusal(path, f"the unit {in_name.name} of its name, not {unit.name}", column=column)
        if unit.name.endswith(("_pp", "_rms")) and unit.kind in DERIVATIVE:
            expected = f"the unit of a sample, {unit.name.rpartition('_')[0]}, not {unit.name}"
            raise refusal(path, expected, column=column)
        if unit.kind != amplitude.kind and not {unit.kind, amplitude.kind} <= DERIVATIVE.keys():
            expected = f"a unit that can become that of the amplitudes, {amplitude.name or 'none'}"
            raise refusal(path, expected, None, name, unit.name)
        factor = keys.scale * unit.to_si(sampled.scale)
        signal_path = SignalPath(keys.high_pass, keys.high_pass_order, keys.delay)
        sensors.append(Channel(name, samples, factor, DERIVATIVE.get(unit.kind), signal_path))
    if not sensors:
        raise refusal(path, "a channel besides that of the tacho")
    return (
        WaveformRecord(
            run, str(path), rate, Channel(marks, pulses * np.float32(sampled.scale)), tuple(sensors)
        ),
        amplitude,
    )


def _parted(name: str) -> tuple[str, Unit | None]:
    """A channel's name without the unit in it, and that: `B1X_um`, `B1X [mm/s]`."""
    match = _NAMED_UNIT.fullmatch(spelt(name))
    return (name, None) if match is None else (name[: match.end(1)], VIBRATION[match[2]])


def find_each(waveforms: Waveforms) -> tuple[Vectors, ...]:
    """The vectors of each record.

    Raises
    ------
    ValueError
        As `find_vectors`, and for records of which only some tell where a turn begins.
    """
    derivative = DERIVATIVE.get(units.vibration(waveforms.labels.vibration_unit).kind)
    speeds = None if waveforms.speeds is None else np.array(waveforms.speeds)
    each = tuple(
        find_vectors(record, waveforms.tacho, waveforms.orders, derivative=derivative, speeds=speeds)
        for record in waveforms.records
    )
    if len(each) > 1 and not all(one.tacho.indexed for one in each):
        raise ValueError(
            f"{waveforms.records[0].source}: the {waveforms.tacho.pulses} pulses of a turn are alike, so "
            "that vectors of different records cannot be compared: give the runs a tacho with one pulse a "
            "turn, or pulses that tell where a turn begins"
        )
    return each


def vectors_table(each: Sequence[Vectors], labels: Labels) -> Table:
    """A runs table of records of the same sensors and orders, one row an instant and a sensor."""
    rows: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in each]) for name in _ROWS}
    whole = replace(each[0], **rows)
    runs = np.repeat([one.run for one in each], [len(one.times) for one in each])
    unit, scale = labels.vibration_unit, labels.vibration_scale
    plain, end = unit.removesuffix("_pp").removesuffix("_rms"), f"_{unit}" if unit else ""
    columns: list[tuple[str, ArrayLike, str, str]] = [
        ("run", runs[:, None], "{}", "run"),
        ("time_s", whole.times[:, None], "{}", ""),
        ("speed_rpm", whole.speeds[:, None] * RPM, "{:.1f}", "rpm"),
        ("sensor", whole.sensors, "{}", "sensor"),
    ]
    for k, order in enumerate(whole.orders):
        name, about = ("", unit.replace("_", " ")) if order == 1 else (f"order{order}_", f"{order}×")
        vectors = whole.vectors[..., k]
        amplitudes, phases = labels.vibration(vectors)
        turned = np.minimum(whole.tangential[..., k] / np.maximum(abs(vectors), 1e-300), np.pi)
        columns += [
            (f"{name}amplitude{end}", amplitudes, "{:.4g}", about or "amplitude"),
            (f"{name}phase_deg", phases, "{:.1f}°", "phase"),
            (f"{name}amplitude_std{end}", whole.radial[..., k] * scale, "{:.2g}", "std"),
            (f"{name}phase_std_deg", np.degrees(turned), "{:.2g}°", "std"),
        ]
    overall = whole.overall[..., int(unit.endswith("_rms"))] * scale
    gap = whole.gap * (scale if plain == unit else VIBRATION[plain].scale)
    columns += [
        (f"overall{end}", overall, "{:.4g}", "all"),
        (f"gap_{plain}" if plain else "gap", gap, "{:.4g}", "gap"),
        ("turns", whole.turns[:, None], "{:.0f}", "turns"),
        ("note", np.where(whole.end[:, None], "end of the record", ""), "{}", ""),
    ]
    made = []
    for name, values, form, title in columns:
        cells = np.broadcast_to(values, gap.shape).ravel()
        cells = significant(cells, DIGITS) if cells.dtype.kind == "f" else cells
        made.append(Column(name, cells.tolist(), form.format if title else None, title=title))
    return Table("vectors", tuple(made))


def read_vectors_grid(
    path: Path, phase: Phase | None, stated: Mapping[str, object] | None = None, *, moving: bool = False
) -> tuple[Grid, Phase, tuple[Path, ...]]:
    """The vectors of a waveforms file as cells of a runs table, their phase convention, files that were read.

    What is to be known of the records is a `TableWarning`.

    Parameters
    ----------
    path
        Of the waveforms file, or a record.
    phase
        Convention in which phases are wanted; None: that of the file.
    stated
        As in `read_waveforms`.
    moving
        Whether records whose speed changes need no chosen speeds.

    Raises
    ------
    InputError
        As `read_waveforms`, and for records of which there are no vectors.
    """
    waveforms = read_waveforms([path], stated)
    labels = waveforms.labels if phase is None else replace(waveforms.labels, phase=phase)
    try:
        each = find_each(waveforms)
    except ValueError as error:
        raise refusal(path, f"records with vectors: {error}") from error
    swept = [repr(one.run) for one in each if not one.steady]
    if swept and waveforms.speeds is None and not moving:
        expected = f"speeds at which {listing(swept, 'and')} are read, whose speed is not steady"
        raise refusal(path, f"{expected}, such as speeds_rpm = [900, 1200]", column="speeds_rpm")
    for one in each:
        for word in one.warnings:
            warnings.warn(f"{path}: run {one.run!r}: {word}", TableWarning, stacklevel=2)
    table = vectors_table(each, labels)
    columns = [["" if x is None else x for x in column.values] for column in table.columns]
    grid = Grid(str(path), 1, tuple(table.headings), tuple(range(2, len(columns[0]) + 2)), columns)
    return grid, labels.phase, waveforms.files
