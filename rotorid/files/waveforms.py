"""Waveforms of several runs with all that is stated about them, and their vectors as a runs table."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from balancing import Labels
from rotorid.base import result
from rotorid.base.arrays import AnyArray, FloatArray, significant
from rotorid.base.result import Column
from rotorid.base.rpm import RPM
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.words import Phase
from rotorid.files import units
from rotorid.files.cells import Grid
from rotorid.files.conventions import as_phase
from rotorid.files.instruments import read_samples, refusal
from rotorid.files.problems import InputError, Problems, TableWarning
from rotorid.files.settings import (
    NotNegative,
    Number,
    Positive,
    Settings,
    Text,
    Whole,
    key,
    listed,
    read_settings,
)
from rotorid.files.toml_file import read_toml
from rotorid.files.units import VIBRATION, Unit, spelt
from rotorid.waveforms.record import Channel, Edge, SignalPath, TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import Vectors, find_vectors

DERIVATIVE = {"length": 0, "velocity": 1, "acceleration": 2}
SAME_RATE = 1e-3
"""A stated rate may be more exact than that of the file, but not another one."""
DIGITS = 6
_NAMED_UNIT = re.compile(rf"(.+?)(?:_| *[\[(] *)({'|'.join(sorted(VIBRATION, key=len))}) *[\])]?")
_RECORDS = 'files by the names of their runs, such as { BASE = "base.wav" }, or a list of files'


def _by_stem(value: object) -> object:
    """Files by run; those of a list by their names without suffix."""
    if not isinstance(value, list) or not value or not all(isinstance(file, str) for file in value):
        return value
    stems = [Path(file).stem for file in value]
    if twice := [file for file, stem in zip(value, stems, strict=True) if stems.count(stem) > 1]:
        expected = f"files of different names, which are those of the runs, not {listing(twice, 'and')}"
        raise ValueError(f'{expected}; or [records] with RUN = "FILE"')
    return dict(zip(stems, value, strict=True))


if TYPE_CHECKING:
    Vibration = Unit
else:
    Vibration = Annotated[Text, AfterValidator(units.vibration)]
Records = Annotated[
    Annotated[dict[str, Text], Field(min_length=1)],
    BeforeValidator(_by_stem, json_schema_input_type=dict[str, str] | list[str]),
]


Order = Annotated[Whole, Field(ge=1)]


class ChannelKeys(Settings):
    """A sensor: `[channels.NAME]`."""

    channel: Text | None = key(
        "its name in the records, default that of the sensor; in a WAV file `1`, `2`, …", default=None
    )
    unit: Vibration | None = key(
        "unit of its numbers after `scale`, peak values: `um`, `mm_s`, `g`, … or any label",
        default=None,
        example="um",
    )
    scale: Number = key("how much of the unit one number of the record is, default 1", default=1.0)
    high_pass: Positive | None = key(
        "corner of an AC coupling (Butterworth), taken off again",
        "high_pass_Hz",
        None,
        units={name: units.SPEED[name] for name in ("Hz", "rad_s")},
    )
    high_pass_order: Whole = key("its order, default 1", default=1, ge=1, le=10)
    delay: NotNegative = key(
        "delay of an anti-alias filter, taken off again", "delay_ms", 0.0, units=units.TIME
    )


class WaveformsFile(Settings):
    """A waveforms file."""

    tacho: Text | None = key("channel of the tacho", default=None)
    pulses: Whole = key("pulses a turn, default 1", default=1, ge=1, le=10_000, expected="pulses a turn")
    edge: Edge = key(
        'what of the mark is angle 0, default `"leading"`: where it begins, whatever its polarity',
        default="leading",
    )
    tacho_level: Number | None = key(
        "where an edge is, in numbers of the record; default: half-way", default=None
    )
    phase: Phase | None = key("whether phases that are written lead or lag, as in a job", default=None)
    unit: Vibration | None = key("unit of all channels that state none", default=None, example="um")
    amplitude: Vibration | None = key(
        "unit in which vectors are written, default that of the first channel", default=None, example="um"
    )
    orders: listed(Order) = key("orders, default 1", default=(1,), example="orders = [1, 2]")  # type: ignore[valid-type]
    rate: Positive | None = key("samples a second, where the records do not say", "rate_Hz", None)
    speeds: listed(Positive) | None = key(  # type: ignore[valid-type]
        "speeds at which vectors are wanted",
        "speeds_rpm",
        None,
        units=units.SPEED,
        example="speeds_rpm = [900, 1200]",
    )
    records: Records = key(f"{_RECORDS}, relative to this file", expected=f"a file for each run: {_RECORDS}")
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
    if "speeds_rad_s" in options:
        data = {key: value for key, value in data.items() if not key.startswith("speeds_")}
    if settings is None:
        options["records"] = [str(path) for path in paths]
    source, read = str(settings or "the options"), list[Path]()
    if settings is not None and len(paths) > 1:
        words = "one waveforms file alone, whose [records] are files; or records without it"
        problems.add(source, None, None, None, words)
    file = problems.need(read_settings(WaveformsFile, data | options, source, problems))
    problems.stop()
    records, quantity = list[WaveformRecord](), file.amplitude
    for run, name in file.records.items():
        read.append(path := (settings.parent if settings else Path()) / name)
        try:
            record, measured = _record(run, path, file)
        except InputError as error:
            problems.extend(error.problems)
            continue
        records.append(record)
        quantity = quantity or measured[0]
        for sensor, unit in zip(record.sensors, measured, strict=True):
            if unit.kind != quantity.kind and not {unit.kind, quantity.kind} <= DERIVATIVE.keys():
                expected = f"a unit that can become that of the amplitudes, {quantity.name or 'none'}"
                problems.add(record.source, None, sensor.name, unit.name, expected)
    problems.stop()
    unit = problems.need(quantity)
    return Waveforms(
        tuple(records),
        TachoSettings(file.pulses, file.edge, file.tacho_level),
        Labels(unit.name, unit.scale, phase=file.phase or "lead"),
        file.orders,
        file.speeds,
        (*filter(None, [settings]), *read),
        file.phase is None,
    )


def _record(run: str, path: Path, file: WaveformsFile) -> tuple[WaveformRecord, list[Unit]]:
    """The record and the unit of each of its sensors; raises InputError."""
    sampled = read_samples(path)
    rate = file.rate or sampled.rate
    if rate is None:
        raise refusal(path, "a rate: a channel t_s of times, or rate_Hz in a waveforms file")
    if sampled.rate is not None and abs(rate / sampled.rate - 1.0) > SAME_RATE:
        raise refusal(path, f"the rate that the file has, {sampled.rate:.6g} Hz, not {rate:.6g} Hz")
    stems = Counter(_parted(name)[0] for name in sampled.channels)
    named = {name: name for name in sampled.channels}
    named |= {stem: name for name in sampled.channels if stems[stem := _parted(name)[0]] == 1}
    there = listing(sampled.channels, "and")
    if file.tacho is None:
        expected = "a tacho channel, without which there is no phase: --tacho NAME (tacho in a file)"
        raise refusal(path, f"{expected}; the channels are {there}")

    def channel(name: str) -> tuple[str, AnyArray]:
        """A channel, named with or without its unit, and its samples without gaps."""
        if name not in named:
            hint = did_you_mean(name, named)
            raise refusal(path, f"a channel of this name{hint}; the channels are {there}", column=name)
        samples = sampled.channels[named[name]]
        if samples.dtype.kind == "f" and not (finite := np.isfinite(samples)).all():
            at = int(np.argmin(finite))
            value = "" if np.isnan(samples[at]) else str(samples[at])
            raise refusal(path, "a number in each sample", at + sampled.first_row, named[name], value)
        return named[name], samples.astype(np.int8) if samples.dtype.kind == "b" else samples

    marks, pulses = channel(file.tacho)
    tacho = Channel(marks, pulses if sampled.scale == 1.0 else pulses * np.float32(sampled.scale))
    short = {name: stem for stem, name in named.items() if name != marks}
    channels = file.channels or {stem: ChannelKeys(channel=name) for name, stem in short.items()}
    sensors, measured = [], []
    for name, keys in channels.items():
        column, samples = channel(keys.channel or name)
        in_name = _parted(column)[1]
        unit = keys.unit or in_name or file.unit or Unit("", "label ''")
        if in_name is not None and in_name.name != unit.name:
            raise refusal(path, f"the unit {in_name.name} of its name, not {unit.name}", column=column)
        if unit.name.endswith(("_pp", "_rms")) and unit.kind in DERIVATIVE:
            expected = f"the unit of a sample, {unit.name.rpartition('_')[0]}, not {unit.name}"
            raise refusal(path, expected, column=column)
        factor = keys.scale * unit.to_si(sampled.scale)
        signal_path = SignalPath(keys.high_pass, keys.high_pass_order, keys.delay)
        sensors.append(Channel(name, samples, factor, DERIVATIVE.get(unit.kind), signal_path))
        measured.append(unit)
    if not sensors:
        raise refusal(path, "a channel besides that of the tacho")
    return WaveformRecord(run, str(path), rate, tacho, tuple(sensors)), measured


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
    unit = VIBRATION.get(waveforms.labels.vibration_unit)
    each = tuple(
        find_vectors(
            record,
            waveforms.tacho,
            waveforms.orders,
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
    plain, end = unit.removesuffix("_pp").removesuffix("_rms"), f"_{unit}" if unit else ""
    rms, as_read = int(unit.endswith("_rms")), scale if plain == unit else VIBRATION[plain].scale

    def column(
        name: str, values: Callable[[Vectors], FloatArray], form: str = "", heading: str | None = None
    ) -> Column:
        """Values (P, C), or (P, 1) of all sensors, of each record."""
        wide = [np.broadcast_to(values(one), one.gap.shape).ravel() for one in each]
        return Column(name, significant(np.concatenate(wide), DIGITS), form.format if form else None, heading)

    def order_columns(k: int, order: int) -> tuple[Column, ...]:
        name, about = ("", unit.replace("_", " ")) if order == 1 else (f"order{order}_", f"{order}×")

        def turned(one: Vectors) -> FloatArray:
            size = np.maximum(np.abs(one.vectors[..., k]), 1e-300)
            return np.degrees(np.minimum(one.tangential[..., k] / size, np.pi))

        def vector(part: int) -> Callable[[Vectors], FloatArray]:
            return lambda one: labels.vibration(one.vectors[..., k])[part]

        return (
            column(f"{name}amplitude{end}", vector(0), "{:.4g}", about),
            column(f"{name}phase_deg", vector(1), "{:.1f}°", "phase"),
            column(f"{name}amplitude_std{end}", lambda one: one.radial[..., k] * scale, "{:.2g}", "±"),
            column(f"{name}phase_std_deg", turned, "{:.2g}°", "±"),
        )

    orders = [order_columns(k, order) for k, order in enumerate(each[0].orders)]
    ends = ["end of the record" if near else "" for one in each for near in one.end for _ in one.sensors]
    return (
        Column("run", [one.run for one in each for _ in one.times for _ in one.sensors], str),
        column("time_s", lambda one: one.times[:, None]),
        column("speed_rpm", lambda one: one.speeds[:, None] * RPM, "{:.1f}", "rpm"),
        Column("sensor", [name for one in each for _ in one.times for name in one.sensors], str),
        *chain.from_iterable(orders),
        column(f"overall{end}", lambda one: one.overall[..., rms] * scale, "{:.4g}", "all"),
        column(f"gap_{plain}" if plain else "gap", lambda one: one.gap * as_read, "{:.4g}", "gap"),
        column("turns", lambda one: one.turns[:, None], "{:.0f}"),
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
