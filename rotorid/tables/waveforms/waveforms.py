"""Waveforms of several runs with all that is said about them: a settings file, or records and options."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from balancing import Labels
from rotorid.base.arrays import AnyArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files.cells import readable
from rotorid.files.input_file import first_bytes
from rotorid.files.problems import InputError, Problems
from rotorid.files.settings_keys import Said, take
from rotorid.files.toml_file import Section, read_toml
from rotorid.files.units import VIBRATION, Unit, spelt
from rotorid.tables.waveforms.array_files import read_mat, read_npz
from rotorid.tables.waveforms.instrument_files import read_tdms, read_uff, read_wav
from rotorid.tables.waveforms.sampled_file import Sampled, refusal
from rotorid.tables.waveforms.text_samples import read_text
from rotorid.tables.waveforms.waveform_keys import CHANNEL, WAVEFORMS, by_stem
from rotorid.waveforms.record import Channel, Edge, SignalPath, TachoSettings, WaveformRecord

READERS: Mapping[str, Callable[[Path], Sampled]] = {
    ".csv": read_text,
    ".txt": read_text,
    ".wav": read_wav,
    ".mat": read_mat,
    ".npz": read_npz,
    ".uff": read_uff,
    ".unv": read_uff,
    ".tdms": read_tdms,
}
"""By the suffix of a file."""
DERIVATIVE = {"length": 0, "velocity": 1, "acceleration": 2}
SAME_RATE = 1e-3
"""A stated rate may be more exact than that of the file, but not another one."""
_NAMED_UNIT = re.compile(rf"(.+?)(?:_| *[\[(] *)({'|'.join(sorted(VIBRATION, key=len))}) *[\])]?")


@dataclass(frozen=True)
class WaveformWishes:
    """What is said beside the files, and instead of what a settings file says; None: nothing.

    Attributes
    ----------
    tacho, sensors
        Names of channels.
    unit, amplitude
        Of the numbers of all sensors, and that in which vectors are written.
    pulses, edge, phase, orders
        As in a waveforms file.
    rate, speeds
        In Hz, and in rad/s.
    """

    tacho: str | None = None
    sensors: Sequence[str] | None = None
    unit: str | None = None
    amplitude: str | None = None
    pulses: int | None = None
    edge: Edge | None = None
    phase: str | None = None
    orders: Sequence[float] | None = None
    rate: float | None = None
    speeds: Sequence[float] | None = None


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


def read_waveforms(files: Sequence[str | Path], given: WaveformWishes | None = None) -> Waveforms:
    """Read records with their settings.

    Parameters
    ----------
    files
        One waveforms file (.toml), or records, each of which is a run named as the file without its suffix.
    given
        What the command line says.

    Raises
    ------
    InputError
        With the problems of all files.
    """
    problems, paths = Problems(), [Path(file) for file in files]
    settings = next((path for path in paths if path.suffix.lower() == ".toml"), None)
    data = {} if settings is None else dict(problems.need(read_toml(settings, problems)))
    source = "the options" if settings is None else str(settings)
    top = Section(source, _with(data, given or WaveformWishes()), problems)
    if settings is not None and len(paths) > 1:
        top.refuse("one waveforms file alone, whose [records] are files; or records without it")
    said = take(top, WAVEFORMS)
    folder = Path() if settings is None else settings.parent
    runs = said["records"] or by_stem([str(path) for path in paths if path != settings], top, "records")
    if not runs and "records" not in top.refused:
        top.missing("records", "a file for each run")
    problems.stop()
    read = {run: folder / file for run, file in runs.items()}
    records = []
    for run, path in read.items():
        try:
            records.append(_record(run, path, said))
        except InputError as error:
            problems.extend(error.problems)
    problems.stop()
    quantity, speeds = said["amplitude"] or records[0][1][0], said["speeds_rpm"]
    for record, units in records:
        for sensor, unit in zip(record.sensors, units, strict=True):
            if unit.kind != quantity.kind and not {unit.kind, quantity.kind} <= DERIVATIVE.keys():
                expected = f"a unit that can become that of the amplitudes, {quantity.name or 'none'}"
                problems.add(record.source, None, sensor.name, unit.name, expected)
    problems.stop()
    return Waveforms(
        tuple(record for record, _ in records),
        TachoSettings(said["pulses"], said["edge"], said["tacho_level"]),
        Labels(quantity.name, quantity.scale, phase=said["phase"] or "lead"),
        said["orders"] or (1.0,),
        None if speeds is None else tuple(speeds.unit.to_si(speed) for speed in speeds.value),
        (*([] if settings is None else [settings]), *read.values()),
        said["phase"] is None,
    )


def _with(data: dict[str, Any], given: WaveformWishes) -> dict[str, Any]:
    """Settings with what is given in their place."""
    own = {"rate": "rate_Hz", "speeds": "speeds_rad_s", "sensors": "channels"}
    stated = {own.get(name, name): value for name, value in vars(given).items() if value is not None}
    if given.sensors is not None:
        channels = data.get("channels")
        known = channels if isinstance(channels, dict) else {}
        stated["channels"] = {name: known.get(name, {}) for name in given.sensors}
    if given.speeds is not None:
        data = {key: value for key, value in data.items() if not key.startswith("speeds_")}
        stated["speeds_rad_s"] = list(given.speeds)
    if given.orders is not None:
        stated["orders"] = list(given.orders)
    return data | stated


def read_samples(path: Path) -> Sampled:
    """Channels of a file of one of the `READERS`.

    Raises
    ------
    InputError
        For a file that cannot be read.
    """
    try:
        first_bytes(path, 1)
    except (OSError, ValueError) as error:
        raise refusal(path, readable(path, error)) from error
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise refusal(path, f"waveforms in a file {listing(READERS)}")
    return reader(path)


def _record(run: str, path: Path, said: Said) -> tuple[WaveformRecord, list[Unit]]:
    """The record and the unit of each of its sensors; raises InputError."""
    found = read_samples(path)
    rate = said["rate_Hz"] or found.rate
    if rate is None:
        raise refusal(path, "a rate: a channel t_s of times, --rate, or rate_Hz in a waveforms file")
    if found.rate is not None and abs(rate / found.rate - 1.0) > SAME_RATE:
        raise refusal(path, f"the rate that the file has, {found.rate:.6g} Hz, not {rate:.6g} Hz")
    if said["tacho"] is None:
        expected = "a tacho channel, without which there is no phase: --tacho NAME (tacho in a file); "
        raise refusal(path, f"{expected}the channels are {listing(found.channels, 'and')}")
    key, _ = _find(path, found, said["tacho"])
    pulses = _samples(path, found, key)
    tacho = Channel(key, pulses if found.scale == 1.0 else pulses * np.float32(found.scale))
    plain = {each.names[0]: each.default for each in CHANNEL}
    others: dict[str, dict[str, Any]] = {}
    for name in found.channels if not said["channels"] else ():
        stem = _parted(name)[0]
        if name != key:
            others[name if stem in others else stem] = {**plain, "channel": name}
    sensors, units = [], []
    for name, own in (said["channels"] or others).items():
        column, named = _find(path, found, own["channel"] or name)
        unit = own["unit"] or named or said["unit"] or Unit("", "label ''")
        if named is not None and named.name != unit.name:
            raise refusal(path, f"the unit {named.name} of its name, not {unit.name}", column=column)
        if unit.name.endswith(("_pp", "_rms")) and unit.kind in DERIVATIVE:
            expected = f"the unit of a sample, {unit.name.rpartition('_')[0]}, not {unit.name}"
            raise refusal(path, expected, column=column)
        corner, delay = own["high_pass_Hz"], own["delay_ms"]
        signal_path = SignalPath(corner and corner.si, own["high_pass_order"], delay.si if delay else 0.0)
        factor = own["scale"] * unit.to_si(found.scale)
        samples = _samples(path, found, column)
        sensors.append(Channel(name, samples, factor, DERIVATIVE.get(unit.kind), signal_path))
        units.append(unit)
    if not sensors:
        raise refusal(path, "a channel besides that of the tacho")
    return WaveformRecord(run, str(path), rate, tacho, tuple(sensors)), units


def _parted(name: str) -> tuple[str, Unit | None]:
    """A channel's name without the unit in it, and that: `B1X_um`, `B1X [mm/s]`."""
    match = _NAMED_UNIT.fullmatch(spelt(name))
    return (name, None) if match is None else (name[: match.end(1)], VIBRATION[match[2]])


def _find(path: Path, found: Sampled, name: str) -> tuple[str, Unit | None]:
    """The channel of this name, with or without its unit, and the unit in the name."""
    parted = {channel: _parted(channel) for channel in found.channels}
    alike = [channel for channel, (stem, _) in parted.items() if stem == name]
    chosen = [name] if name in parted else alike
    if len(chosen) != 1:
        hint = did_you_mean(name, [*parted, *(stem for stem, _ in parted.values())])
        expected = f"a channel of this name{hint}; the channels are {listing(alike or parted, 'and')}"
        raise refusal(path, expected, column=name)
    return chosen[0], parted[chosen[0]][1]


def _samples(path: Path, found: Sampled, name: str) -> AnyArray:
    """A channel without gaps."""
    samples = found.channels[name]
    if samples.dtype.kind == "f" and not (finite := np.isfinite(samples)).all():
        at = int(np.argmin(finite))
        value = "" if np.isnan(samples[at]) else str(samples[at])
        raise refusal(path, "a number in each sample", at + (found.first_row or 1), name, value)
    return samples.astype(np.int8) if samples.dtype.kind == "b" else samples
