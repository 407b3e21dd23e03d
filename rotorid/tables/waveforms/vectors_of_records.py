"""Vectors of records as a runs table, in the units and conventions of a job."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from balancing import Labels
from rotorid.base import result
from rotorid.base.arrays import FloatArray, significant
from rotorid.base.result import Column
from rotorid.base.rpm import RPM
from rotorid.base.text import listing
from rotorid.base.words import Phase
from rotorid.files.cells import Grid
from rotorid.files.conventions import as_phase
from rotorid.files.problems import InputError, Problems, TableWarning
from rotorid.files.units import VIBRATION
from rotorid.tables.waveforms.waveforms import DERIVATIVE, Waveforms, WaveformWishes, read_waveforms
from rotorid.waveforms.vectors import Vectors, find_vectors

DIGITS = 6


def find_each(waveforms: Waveforms) -> tuple[Vectors, ...]:
    """The vectors of each record.

    Raises
    ------
    ValueError
        As `find_vectors`, and for records of which only some tell where a turn begins.
    """
    unit = VIBRATION.get(waveforms.labels.vibration_unit)
    wanted = None if unit is None else DERIVATIVE[unit.kind]
    speeds = None if waveforms.speeds is None else np.array(waveforms.speeds)
    orders = tuple(int(order) for order in waveforms.orders)
    found = tuple(
        find_vectors(record, waveforms.tacho, orders, derivative=wanted, speeds=speeds)
        for record in waveforms.records
    )
    unclear = [each for each in found if not each.tacho.indexed]
    if unclear and len(found) > 1:
        raise ValueError(
            f"{waveforms.records[0].source}: the {waveforms.tacho.pulses} pulses of a turn are alike, so "
            "that vectors of different records cannot be compared: give the runs a tacho with one pulse a "
            "turn, or pulses that tell where a turn begins"
        )
    return found


def vectors_columns(found: Sequence[Vectors], labels: Labels) -> tuple[Column, ...]:
    """A runs table of records, one row an instant and a sensor.

    Parameters
    ----------
    found
        Of the same sensors and orders.
    labels
        Units and phase convention.
    """
    unit, scale = labels.vibration_unit, labels.vibration_scale
    plain = unit.removesuffix("_pp").removesuffix("_rms")
    gap = scale if plain == unit else VIBRATION[plain].scale
    end = f"_{unit}" if unit else ""
    shown = 1 if unit.endswith("_rms") else 0
    sensors = [name for each in found for _ in each.times for name in each.sensors]

    def joined(parts: Sequence[FloatArray]) -> FloatArray:
        return significant(np.concatenate([np.ravel(part) for part in parts]), DIGITS)

    def repeated(parts: Sequence[FloatArray]) -> FloatArray:
        return joined([np.repeat(part, len(each.sensors)) for part, each in zip(parts, found, strict=True)])

    columns = [
        Column("run", [each.run for each in found for _ in each.times for _ in each.sensors], str),
        Column("time_s", repeated([each.times for each in found])),
        Column("speed_rpm", repeated([each.speeds * RPM for each in found]), "{:.1f}".format, "rpm"),
        Column("sensor", sensors, str),
    ]
    for k, order in enumerate(found[0].orders):
        name = "" if order == 1 else f"order{order}_"
        about = unit.replace("_", " ") if order == 1 else f"{order}×"
        vectors = [each.vectors[:, :, k] for each in found]
        amplitude, phase = zip(*(labels.vibration(each) for each in vectors), strict=True)
        std = [each.radial[:, :, k] * scale for each in found]
        turned = [
            np.degrees(np.minimum(each.tangential[:, :, k] / np.maximum(np.abs(z), 1e-300), np.pi))
            for each, z in zip(found, vectors, strict=True)
        ]
        columns += [
            Column(f"{name}amplitude{end}", joined(amplitude), "{:.4g}".format, about),
            Column(f"{name}phase_deg", joined(phase), "{:.1f}°".format, "phase"),
            Column(f"{name}amplitude_std{end}", joined(std), "{:.2g}".format, "±"),
            Column(f"{name}phase_std_deg", joined(turned), "{:.2g}°".format, "±"),
        ]
    return (
        *columns,
        Column(
            f"overall{end}",
            joined([each.overall[..., shown] * scale for each in found]),
            "{:.4g}".format,
            "all",
        ),
        Column(
            f"gap_{plain}" if plain else "gap",
            joined([each.gap * gap for each in found]),
            "{:.4g}".format,
            "gap",
        ),
        Column("turns", repeated([each.turns for each in found]), "{:.0f}".format),
        Column(
            "note",
            [_note(each.end[i]) for each in found for i in range(len(each.times)) for _ in each.sensors],
        ),
    )


def _note(end: np.bool_) -> str:
    return "end of the record" if end else ""


def read_vectors_grid(
    path: Path,
    phase: str | None,
    problems: Problems,
    given: WaveformWishes | None = None,
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
    given
        What is said beside the file.
    moving
        Whether records whose speed changes need no chosen speeds.
    """
    try:
        waveforms = read_waveforms([path], given)
        labels = waveforms.labels if phase is None else replace(waveforms.labels, phase=as_phase(phase))
        found = find_each(waveforms)
        columns = vectors_columns(found, labels)
    except InputError as error:
        problems.extend(error.problems)
        return None
    except ValueError as error:
        problems.add(str(path), None, None, None, f"records with vectors: {error}")
        return None
    swept = [each.run for each in found if not each.steady]
    if swept and waveforms.speeds is None and not moving:
        expected = f"speeds at which {listing(map(repr, swept), 'and')} are read, whose speed is not steady"
        problems.add(str(path), None, "speeds_rpm", None, f"{expected}, such as speeds_rpm = [900, 1200]")
        return None
    for each in found:
        for word in each.warnings:
            warnings.warn(f"{path}: run {each.run!r}: {word}", TableWarning, stacklevel=2)
    cells = (tuple("" if value is None else value for value in row.values()) for row in result.rows(columns))
    header = tuple(column.name for column in columns)
    return Grid(str(path), 1, header, tuple(enumerate(cells, start=2))), labels.phase, waveforms.files
