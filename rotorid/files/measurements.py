"""Measurements: amplitudes read in harmonic tests, natural frequencies with shapes, and records over time."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, polar
from rotorid.base.choices import did_you_mean
from rotorid.base.text import Shown, listing, speed_axis, vibration_unit_words
from rotorid.files import units
from rotorid.files.cells import Grid, show
from rotorid.files.columns import Column, Table, make_table, read_grid
from rotorid.files.input_problems import Problems, TableWarning
from rotorid.files.instrument_formats import DERIVATIVE, read_responses
from rotorid.files.model import HarmonicFile
from rotorid.files.node_tables import read_modes
from rotorid.files.units import TIME, Unit, UnitError, UnitReader, one_of, ratio, spelt
from rotorid.identify.amplitudes import AmplitudeErrors, Experiments, experiments, real_matrices
from rotorid.identify.ode import OdeModel
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.records import Record

MISSING = {"nan", "na", "n/a", "#n/a", "null", "none", "-", "--"}
STD = "_std"
"""At the end of the name of a column: standard deviations of the samples of an output."""
PARTS = ("amplitude", "phase", "re", "im")
_FREE = "a free vibration has real amplitudes"
_AMPLITUDE = re.compile(r"(.+)_(?:amplitude|phase|re|im)(?:_.*)?")


def read_measurements(path: str | Path, model: HarmonicModel | HarmonicFile) -> Experiments:
    """Read a measurement table.

    Its columns are `experiment` (optional), `frequency_rad_s` (or `_Hz`, or `speed_rpm`) and, for each
    amplitude NAME of the model, either `NAME_amplitude` (peak, with or without a unit) and `NAME_phase_deg`
    (positive = lead), or `NAME_re` and `NAME_im` (without `_im`: real). A blank amplitude was not measured.
    Where inputs are absent or 0 the row is a free vibration: natural frequency and shape. A known quantity
    that changes from row to row has a column NAME (or NAME_rad_s, NAME_Hz, NAME_rpm, which become rad/s).

    Readings of one experiment that a column `repeat` tells apart count as rows of their own.

    A table of modes (`mode`, `node`, `shape`, as `read_modes` reads it), whose nodes are amplitudes of the
    model, holds free vibrations with their errors.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `measurements`, or else the first one.
    model
        Knows the names of the amplitudes; a model file also states errors.

    Returns
    -------
    Experiments
        Frequencies in rad/s; NaN where nothing was measured.

    Raises
    ------
    InputError
        With all problems of the cells, or else with all contradictions between them.

    Warns
    -----
    TableWarning
        Where an amplitude of the model is nowhere in the table.
    """
    errors, unmeasured = None, set[str]()
    if isinstance(model, HarmonicFile):
        errors, unmeasured, model = model.errors, {*model.unmeasured}, model.model
    problems = Problems()
    grid = read_grid(path, "measurements", problems, first=True)
    if {"mode", "node", "shape"} <= {*grid.header}:
        return _free_vibrations(path, model, errors)
    table, rows = _rows(grid, problems, model.signals, model.varying)
    measured = [name for name in model.outputs if name in rows.signals]
    if not measured:
        table.in_header(None, f"measured amplitudes: columns {listing(map(_forms, model.outputs))}")
    for name in model.varying:
        if name not in table:
            table.in_header(name, f"a column {name}: the equations multiply amplitudes by it")
    free = np.full(len(table), not model.has_constant_terms)
    for name in {*model.inputs} & rows.signals.keys():
        free &= rows.signals[name] == 0
    excited = f"0, or an amplitude of {listing(model.inputs)} that excites this row: {_FREE}"
    for name in measured:
        unlike = free & (abs(rows.signals[name].imag) > 0)
        table.complain_where(unlike, _stems(table, name)[-1], excited)
    problems.stop()
    if lacking := {*model.outputs} - {*measured} - unmeasured:
        message = f"{table.grid.source}: the table has no {listing(sorted(lacking), 'and')}: predicted"
        warnings.warn(message, TableWarning, stacklevel=2)
    signals = _unread(model) | {**rows.signals} | {name: table.numbers(name) for name in model.varying}
    data = experiments(model, rows.frequencies, signals, names=rows.names, free=free, errors=errors)
    data = replace(data, axis=rows.axis, units=rows.units)
    return replace(data, rounding=_rounding(table, data, model.outputs))


def read_amplitudes(path: str | Path) -> Experiments:
    """Read displacements at any points: as `read_measurements`, with any names and without a model.

    Velocities and accelerations, known by their units, become displacements. Repeated readings stay apart.
    A UFF file (`.uff`, `.unv`) has frequency responses: displacements under a force of 1 N.
    """
    microns = Shown(vibration_unit_words("um"), 1e6)
    if Path(path).suffix.lower() in (".uff", ".unv"):
        omega, points = read_responses(Path(path))
        free = np.zeros(len(omega), dtype=bool)
        return Experiments(
            tuple(map(str, range(1, len(omega) + 1))),
            omega,
            {**points, "F": np.ones(len(omega), dtype=complex)},
            free,
            axis=speed_axis("frequency", "Hz"),
            units=dict.fromkeys(points, microns),
        )
    problems = Problems()
    grid = read_grid(path, "measurements", problems, first=True)
    names = dict.fromkeys(match[1] for name in grid.header if (match := _AMPLITUDE.fullmatch(name)))
    table, rows = _rows(grid, problems, [*names])
    if not {*names} - {"F"}:
        table.in_header(None, f"amplitudes of points: columns {_forms('X')}")
    signals, shown = {**rows.signals}, {**rows.units}
    for name, z in rows.signals.items():
        size = _stems(table, name)[0]
        bad = (rows.frequencies == 0) | ((name == "F") & ~(abs(z) > 0))
        table.complain_where(bad, size, "a frequency above 0, and a force F that is not 0")
        if not np.nan_to_num(z).any():
            table.as_whole(size, "a number that is not 0 in at least one row")
        if order := DERIVATIVE.get(table.unit(size).kind, 0):
            signals[name] = z / (1j * np.where(bad, 1.0, rows.frequencies)) ** order
            shown[name] = microns
    problems.stop()
    return replace(rows, signals=signals, units=shown)


def measurement_columns(data: Experiments, signals: Sequence[str]) -> dict[str, FloatArray]:
    """The table of some amplitudes as `read_measurements` reads it, frequencies in rad/s."""
    columns = {"frequency_rad_s": data.frequencies, **data.varying}
    for name in signals:
        columns[f"{name}_re"] = data.signals[name].real
        if not data.free.all():
            columns[f"{name}_im"] = data.signals[name].imag
    return columns


def _unread(model: HarmonicModel) -> dict[str, Any]:
    """Signals without readings: no input, unknown outputs."""
    return dict.fromkeys(model.outputs, np.nan) | dict.fromkeys(model.inputs, 0.0)


def _free_vibrations(path: str | Path, model: HarmonicModel, errors: AmplitudeErrors | None) -> Experiments:
    """A table of modes, whose nodes are amplitudes of the model."""
    modes, problems = read_modes(path), Problems()
    names = [*map(str, modes.nodes)]
    for node in {*names} - {*model.outputs}:
        expected = f"an amplitude of the model: {listing(model.outputs)}{did_you_mean(node, model.outputs)}"
        problems.add(expected, path, None, "node", node)
    if model.varying or model.has_constant_terms:
        problems.add(f"a model of amplitudes and parameters only, for {_FREE}", path)
    problems.stop()
    std, covariances = modes.frequency_std, {}
    if errors is None and modes.shape_std is not None:
        variances = (modes.shape_std * modes.shapes) ** 2
        covariances = dict(zip(names, variances[..., None, None] * np.diag([1.0, 0.0]), strict=True))
    data = experiments(
        model,
        modes.frequencies,
        _unread(model) | dict(zip(names, modes.shapes, strict=True)),
        names=[f"mode {i + 1}" for i in range(len(modes.frequencies))],
        free=True,
        errors=errors,
        covariances=covariances,
    )
    return data if std is None or not std.all() else replace(data, frequency_std=std * modes.frequencies)


def _or_model(of: dict[str, Unit]) -> UnitReader:
    """No unit, which is the model's own, or one of these, which becomes SI (and peak)."""

    def read(name: str) -> Unit:
        if unit := {**of, "": Unit("", "model")}.get(spelt(name)):
            return unit
        raise UnitError(f"no unit (the model's own) or one of {listing(of)}, not {name!r}")

    return read


def _forms(name: str) -> str:
    return f"{name}_amplitude and {name}_phase_deg, or {name}_re and {name}_im, not some of both"


def _stems(table: Table, name: str) -> list[str]:
    """Columns of an amplitude: its size and phase, or real and imaginary part."""
    return [stem for part in PARTS if (stem := f"{name}_{part}") in table]


def _rows(
    grid: Grid, problems: Problems, names: Sequence[str], varying: Sequence[str] = ()
) -> tuple[Table, Experiments]:
    """Amplitudes by name, NaN where a row does not have them, all taken as forced."""
    speed, vibration, angle = one_of(units.SPEED), _or_model(units.VIBRATION), one_of(units.ANGLE)
    readers = dict.fromkeys(varying, _or_model({**units.SPEED, "re": Unit("re", "model")}))
    readers |= {f"{name}_{part}": angle if part == "phase" else vibration for name in names for part in PARTS}
    columns = (
        Column("experiment", required=False),
        Column("repeat", required=False),
        Column("frequency", speed, ("frequency_rad_s", "frequency_Hz"), required=False),
        Column("speed", speed, ("speed_rpm",), required=False),
        *(Column(name, unit, (), required=False, blank=True) for name, unit in readers.items()),
    )
    table = problems.need(make_table(grid, columns, problems))
    expected = "one column frequency_rad_s, frequency_Hz or speed_rpm"
    stem = table.only(("frequency", "speed"), "frequency_rad_s", expected)
    table.complain_where(table.numbers(stem) < 0, stem, "a frequency of 0 or more")
    problems.stop()
    labels = tuple(map(str, range(1, len(table) + 1)))
    if "experiment" in table:
        texts = (table.texts(stem) for stem in ("experiment", "repeat") if stem in table)
        labels = tuple(map(", ".join, zip(*texts, strict=True)))
        expected = "another name than in row {}; repeated readings of one experiment need a column repeat"
        table.once("experiment", labels, expected)
    signals = {name: _amplitude(table, name) for name in names if _stems(table, name)}
    problems.stop()
    shown = {name: table.unit(_stems(table, name)[0]) for name in signals}
    return table, Experiments(
        labels,
        table.numbers(stem),
        signals,
        np.zeros(len(table), dtype=bool),
        axis=speed_axis(stem, table.unit(stem).name),
        units={name: Shown(vibration_unit_words(u.name), u.scale) for name, u in shown.items() if u.name},
    )


def _amplitude(table: Table, name: str) -> ComplexArray:
    """An amplitude, NaN where a row does not have it."""
    size, *others = _stems(table, name)
    parts = [stem.removeprefix(f"{name}_") for stem in (size, *others)]
    if parts not in (["amplitude", "phase"], ["re", "im"], ["re"]):
        table.in_header(size, f"columns {_forms(name)}")
    first, second, blank = table.numbers(size), np.zeros(len(table)), table.is_blank(size)
    is_polar = parts[0] == "amplitude"
    for other in others[:1]:
        half = table.is_blank(other)
        second = np.where(half, 0.0, table.numbers(other))
        wrong = np.where(blank, ~half, half & ~(is_polar & (first == 0)))
        table.complain_where(wrong, other, f"a number as {size} has (0 for a real amplitude), or both blank")

    if blank.all():
        table.as_whole(size, "a number in at least one row, or no such column")
    if not is_polar:
        return first + 1j * np.where(blank, np.nan, second)
    table.complain_where(first < 0, size, "an amplitude of 0 or more (a real part may be negative)")
    return polar(first, second)


def _rounding(table: Table, rows: Experiments, outputs: Sequence[str]) -> dict[str, FloatArray]:
    """Covariances (n, 2, 2) that the digits of readings give, and under "" variances (n,) of frequencies.

    Frequencies of excitation are set, not read; a shape that is 1 everywhere is the reference of the others.
    Nothing where a cell of a reading is blank, or a natural frequency shows no end of its digits.
    """
    covariances = {}
    for name in outputs:
        z, stems = rows.signals[name], _stems(table, name)
        if any(table.is_blank(stem).any() for stem in stems):
            return {}
        turn, spread = (
            np.ones(len(z), dtype=complex),
            1e-12 * np.maximum(np.nan_to_num(np.abs([z, z])), 1e-12),
        )
        if stems and not (rows.free.all() and (z == 1).all()):
            spread = np.stack([table.steps(stems[0]), table.steps(stems[-1])]) / np.sqrt(12.0)
            if stems[0] == f"{name}_amplitude":
                turn, spread[1] = np.exp(1j * np.angle(z)), spread[1] * abs(z)
        root = real_matrices(turn) * spread.T[:, None]
        covariances[name] = root @ np.swapaxes(root, 1, 2)
    steps = table.steps("frequency" if "frequency" in table else "speed")
    if (rows.free & (steps < 1e-9 * rows.frequencies)).any():  # the root of a rounded number, or such
        return {}
    return {**covariances, "": np.where(rows.free, steps**2 / 12.0, 0.0)}


def read_record(
    path: str | Path,
    model: OdeModel,
    *,
    allow_missing: bool = False,
    sigma: Mapping[str, float] | None = None,
    measured: bool = True,
) -> Record:
    """Read a time record.

    Its columns are `t_s` (or `_ms`, `_us`, `_min`), increasing, and one for each output and each input of the
    model, named exactly as there and in the units of the model. Beside an output `y` there may be `y_std`,
    the standard deviation of each of its samples, in the same unit: for all outputs or for none.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `record`, or else the first one.
    model
        Knows the names.
    allow_missing
        Whether blank cells, NaN and absent columns of outputs mean "not measured". Inputs never may.
    sigma
        Standard deviations of outputs by name, for a record that has none of its own.
    measured
        False: times and inputs are all that is needed.

    Returns
    -------
    Record
        Times in s; NaN where nothing was measured.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    taken = {*model.outputs, *model.inputs}
    deviations = {name: name + STD for name in model.outputs if name + STD not in taken}
    problems, needed = Problems(), measured and not allow_missing
    outputs_alone = [name for name in model.outputs if name not in model.inputs]
    columns = [
        Column("t", one_of(TIME), ("t_s",)),
        *(Column(name, ratio) for name in model.inputs),
        *(Column(name, ratio, (), needed, blank=True) for name in outputs_alone),
        *(Column(name, ratio, (), required=False, blank=True) for name in deviations.values()),
    ]
    grid = read_grid(path, "record", problems, first=True)
    if allow_missing:
        known = [["" if show(c).casefold() in MISSING else c for c in cells] for cells in grid.columns]
        grid = replace(grid, columns=known)
    table = problems.need(make_table(grid, columns, problems))
    clear = not len(problems)  # otherwise a misspelt column would be called missing
    t, outputs = table.numbers("t"), {name: table.numbers(name) for name in model.outputs if name in table}
    for late in np.flatnonzero(np.diff(t) <= 0) + 1:
        before = f"{table.shown('t', late - 1)} of row {table.rows[late - 1]}"
        table.complain(late, "t", f"a time above {before}: sort the rows; repeated runs are other records")
    if measured and clear and not outputs:
        table.in_header(None, f"a column for at least one output of the model: {listing(model.outputs)}")
    for name in outputs if measured else ():
        blank = table.is_blank(name)
        if not allow_missing:
            table.complain_where(blank, name, "a number (--allow-missing: blanks were not measured)")
        elif blank.all():
            table.as_whole(name, "a number in at least one row, or no such column")
    stated = {name: table.numbers(column) for name, column in deviations.items() if column in table}
    if stated and clear and (sigma is not None or stated.keys() != outputs.keys()):
        expected = "standard deviations of all outputs or none, and no such column together with --sigma"
        table.in_header(deviations[next(iter(stated))], expected)
    for name in stated.keys() & outputs.keys():
        wrong = ~np.isnan(outputs[name]) & ((stated[name] <= 0) | table.is_blank(deviations[name]))
        expected = f"a standard deviation above 0 wherever {name} was measured"
        table.complain_where(wrong, deviations[name], expected)
    problems.stop()
    unit = table.unit("t")
    alike = {name: value for name, value in (sigma or {}).items() if name in table}
    axis = Shown(f"time, {'µs' if unit.name == 'us' else unit.name}", unit.scale)
    return Record(
        t, outputs, {k: table.numbers(k) for k in model.inputs}, stated or alike or None, str(path), axis
    )


def record_columns(record: Record) -> dict[str, FloatArray]:
    """The table as `read_record` reads it: times in s, outputs, their standard deviations, inputs."""
    stated = {
        f"{name}{STD}": np.broadcast_to(std, record.t.shape) for name, std in (record.sigma or {}).items()
    }
    return {"t_s": record.t, **record.outputs, **stated, **record.inputs}
