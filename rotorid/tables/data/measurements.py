"""Measurement tables: amplitudes read in harmonic tests, and natural frequencies with shapes."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base import result
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.complex_numbers import polar
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.base.unit_words import Shown, speed_axis, vibration_unit_words
from rotorid.files import units
from rotorid.files.columns import Column, Table, make_table, read_grid
from rotorid.files.conventions import FULL_TURN
from rotorid.files.model import HarmonicFile
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.units import Unit, UnitError, UnitReader, one_of
from rotorid.tables.data.modes_table import read_modes
from rotorid.tables.data.repeated_readings import FREQUENCIES, merge_repeats

if TYPE_CHECKING:
    from rotorid.identify.amplitudes import AmplitudeErrors, Experiments
    from rotorid.identify.operator_model import HarmonicModel


_SPEED = one_of(units.SPEED)
_FREE = "a free vibration has real amplitudes"
_AMPLITUDE = re.compile(r"(.+)_(?:amplitude|phase|re|im)(?:_.*)?")


def read_measurements(path: str | Path, model: HarmonicModel | HarmonicFile) -> Experiments:
    """Read a measurement table.

    Its columns are `experiment` (optional), `frequency_rad_s` (or `_Hz`, or `speed_rpm`) and, for each
    amplitude NAME of the model, either `NAME_amplitude` (peak, with or without a unit) and `NAME_phase_deg`
    (positive = lead), or `NAME_re` and `NAME_im` (without `_im`: real). A blank amplitude was not measured.
    Where inputs are absent or 0 the row is a free vibration: natural frequency and shape. A known quantity
    that changes from row to row has a column NAME (or NAME_rad_s, NAME_Hz, NAME_rpm, which become rad/s).

    With a column `repeat`, rows of one experiment (or, without names, of one frequency and excitation) are
    readings of the same: their mean counts, and their scatter, pooled over the table, says how large the
    errors are unless the model file states them.

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
        With all problems of the file.

    Warns
    -----
    TableWarning
        Where an amplitude of the model is nowhere in the table, and where few repeats tell the errors.
    """
    from rotorid.identify.amplitudes import Experiments

    file = model if isinstance(model, HarmonicFile) else None
    equations = model.model if isinstance(model, HarmonicFile) else model
    problems = Problems()
    grid = problems.need(read_grid(path, "measurements", problems, first=True))
    if {"mode", "node", "shape"} <= set(grid.header):
        return _free_vibrations(path, equations, file)
    columns = _columns(equations.signals, equations.varying)
    table = problems.need(make_table(grid, columns, problems))
    unclear = len(problems) > 0
    frequency = _frequency(table)
    read = {name: _amplitude(table, name, unclear=unclear) for name in equations.signals}
    if not unclear:
        _complain_about_missing(table, equations, read, file.unmeasured if file else ())
        for name in equations.varying:
            if name not in table:
                expected = f"a column {name}: the equations multiply amplitudes by it"
                near = did_you_mean(name, [*equations.parameters, *equations.known])
                table.in_header(name, expected + near)
    names = _experiments(table)
    problems.stop()
    signals = {name: values for name, values in read.items() if values is not None}
    free = _free(table, equations, signals)
    problems.stop()
    nothing = np.full(len(table), complex(np.nan, np.nan))
    for name in equations.signals:
        if name not in signals:
            signals[name] = np.zeros(len(table), dtype=complex) if name in equations.inputs else nothing
    errors = None if file is None else file.errors
    varying = {name: table.numbers(name) for name in equations.varying}
    axis, shown = _shown(table, signals)
    rows = Experiments(names, frequency, signals, free, errors, varying=varying, axis=axis, units=shown)
    rows = replace(rows, rounding=_rounding(table, rows, equations.outputs))
    if "repeat" in table:
        rows = merge_repeats(table, rows, equations)
    return rows


def _rounding(table: Table, rows: Experiments, outputs: Sequence[str]) -> dict[str, FloatArray]:
    """Covariances (n, 2, 2) that the digits of readings give, and under "" variances (n,) of frequencies.

    Frequencies of excitation are set, not read; a shape that is 1 everywhere is the reference of the others.
    Nothing where a cell of a reading is blank, or a natural frequency shows no end of its digits.
    """
    found: dict[str, FloatArray] = {}
    for name in outputs:
        there = [f"{name}_{part}" for part in ("amplitude", "phase", "re", "im") if f"{name}_{part}" in table]
        if any(table.is_blank(stem).any() for stem in there):
            return {}
        z = rows.signals[name]
        if not there or (rows.free.all() and (z == 1).all()):
            found[name] = (1e-12 * np.maximum(np.nan_to_num(np.abs(z)), 1e-12))[:, None, None] ** 2 * np.eye(
                2
            )
            continue
        first, last = (table.steps(stem) for stem in (there[0], there[-1]))
        polar = there[0] == f"{name}_amplitude"
        u = np.exp(1j * np.angle(z)) if polar else np.ones(len(z))
        turn = np.stack((np.stack((u.real, -u.imag), -1), np.stack((u.imag, u.real), -1)), -2)
        spread = turn * (np.stack((first, last * np.abs(z) if polar else last), -1) / np.sqrt(12.0))[:, None]
        found[name] = spread @ np.swapaxes(spread, 1, 2)
    steps = table.steps(next(stem for stem in FREQUENCIES if stem in table))
    if (rows.free & (steps < 1e-9 * rows.frequencies)).any():  # the root of a rounded number, or such
        return {}
    return {**found, "": np.where(rows.free, steps**2 / 12.0, 0.0)}


def read_amplitudes(path: str | Path, errors: AmplitudeErrors | None) -> Experiments:
    """Read displacements at any points: as `read_measurements`, with any names and without a model.

    Velocities and accelerations, known by their units, become displacements. Repeated readings stay apart.
    A UFF file (`.uff`, `.unv`) has frequency responses: displacements under a force of 1 N.
    """
    from rotorid.identify.amplitudes import Experiments

    if Path(path).suffix.lower() in (".uff", ".unv"):
        from rotorid.tables.data.frequency_responses import read_responses

        return replace(read_responses(Path(path)), errors=errors)
    problems = Problems()
    grid = problems.need(read_grid(path, "measurements", problems, first=True))
    names = tuple(dict.fromkeys(found[1] for name in grid.header if (found := _AMPLITUDE.fullmatch(name))))
    table = problems.need(make_table(grid, _columns(names, ()), problems))
    omega, unclear = _frequency(table), len(problems) > 0
    signals = {name: z for name in names if (z := _amplitude(table, name, unclear=unclear)) is not None}
    if not set(names) - {"F"}:
        table.in_header(None, "amplitudes of points: columns X_amplitude and X_phase_deg, or X_re and X_im")
    labels = _experiments(table)
    problems.stop()
    axis, shown = _shown(table, signals)
    for name, values in signals.items():
        part = next(f"{name}_{part}" for part in ("amplitude", "re") if f"{name}_{part}" in table)
        bad = (omega == 0) | ((name == "F") & (np.isnan(values) | (values == 0)))
        table.complain_where(bad, part, "a frequency above 0, and a force F that is not 0")
        if not np.nan_to_num(values).any():
            table.as_whole(table.fields[part].name, "a number that is not 0 in at least one row")
        order = {"velocity": 1, "acceleration": 2}.get(table.unit(part).kind, 0)
        if order:
            signals[name] = values / (1j * np.where(bad, 1.0, omega)) ** order
            shown[name] = Shown(vibration_unit_words("um"), 1e6)
    problems.stop()
    return Experiments(labels, omega, signals, np.zeros(len(table), bool), errors, axis=axis, units=shown)


def _free_vibrations(path: str | Path, model: HarmonicModel, file: HarmonicFile | None) -> Experiments:
    """A table of modes, whose nodes are amplitudes of the model."""
    from rotorid.identify.amplitudes import Experiments

    modes, problems = read_modes(path), Problems()
    nodes, k = [str(node) for node in modes.nodes], len(modes.frequencies)
    for node in set(nodes) - set(model.outputs):
        expected = f"an amplitude of the model: {listing(model.outputs)}{did_you_mean(node, model.outputs)}"
        problems.add(str(path), None, "node", node, expected)
    if model.varying or model.has_constant_terms:
        problems.add(str(path), None, None, None, f"a model of amplitudes and parameters only, for {_FREE}")
    problems.stop()
    signals = {
        name: np.full(k, 0 if name in model.inputs else np.nan, dtype=complex) for name in model.signals
    }
    signals |= dict(zip(nodes, modes.shapes.astype(complex), strict=True))
    errors, covariances, own = None if file is None else file.errors, {}, modes.frequency_std
    if errors is None and modes.shape_std is not None:
        variances = (modes.shape_std * modes.shapes)[..., None, None] ** 2 * np.diag([1.0, 0.0])
        covariances = dict(zip(nodes, variances, strict=True))
    return Experiments(
        tuple(f"mode {mode}" for mode in range(1, k + 1)),
        modes.frequencies,
        signals,
        np.ones(k, dtype=bool),
        errors,
        covariances,
        frequency_std=own * modes.frequencies if own is not None and own.all() else None,
    )


def measurement_columns(data: Experiments, signals: Sequence[str]) -> tuple[result.Column, ...]:
    """The table of some amplitudes as `read_measurements` reads it, frequencies in rad/s."""
    columns = {"frequency_rad_s": data.frequencies, **data.varying}
    for name in signals:
        columns[f"{name}_re"] = data.signals[name].real
        if not data.free.all():
            columns[f"{name}_im"] = data.signals[name].imag
    return tuple(result.Column(name, values, "{:.6g}".format) for name, values in columns.items())


def _columns(signals: tuple[str, ...], varying: tuple[str, ...]) -> tuple[Column, ...]:
    def own(name: str, unit: UnitReader, example: str = "") -> Column:
        return Column(name, unit, (example or name,), required=False, blank=True)

    columns = [own(name, _row_unit) for name in varying]
    for name in signals:
        size, real, imag = (own(f"{name}_{part}", _amplitude_unit) for part in ("amplitude", "re", "im"))
        columns += [size, own(f"{name}_phase", one_of(units.ANGLE), f"{name}_phase_deg"), real, imag]
    return (
        Column("experiment", required=False),
        Column("frequency", _SPEED, ("frequency_rad_s", "frequency_Hz"), required=False),
        Column("speed", _SPEED, ("speed_rpm",), required=False),
        Column("repeat", required=False),
        *columns,
    )


def _amplitude_unit(name: str) -> Unit:
    """No unit (the model's own), or a known one of vibration, which becomes SI and peak."""
    if not name:
        return Unit("", "model")
    unit = units.vibration(name)
    if unit.kind.startswith("label"):
        raise UnitError(
            f"no unit (amplitudes are in the units of the model) or one such as mm, um_pp, not {name!r}"
        )
    return unit


def _row_unit(name: str) -> Unit:
    """No unit (the model's own; `re` says the same), or one of speed."""
    if name in ("", "re"):
        return Unit("", "model")
    try:
        return _SPEED(name)
    except UnitError:
        raise UnitError(
            f"a real number in the unit of the model, or rad_s, Hz or rpm, not {name!r}"
        ) from None


def _frequency(table: Table) -> FloatArray:
    expected = "one column frequency_rad_s, frequency_Hz or speed_rpm"
    stem = table.only(FREQUENCIES, "frequency_rad_s", expected)
    if stem is None:
        return np.full(len(table), np.nan)
    values = table.numbers(stem)
    table.must_be(stem, values >= 0, "a frequency of 0 or more")
    return values


def _shown(table: Table, signals: Iterable[str]) -> tuple[Shown, dict[str, Shown]]:
    """The axis of the frequencies, and the units of the signals that have one."""
    stem = next(stem for stem in FREQUENCIES if stem in table)
    columns = [(name, table.fields.get(f"{name}_{part}")) for name in signals for part in ("amplitude", "re")]
    own = {name: column.unit for name, column in columns if column and column.unit}
    units = {name: Shown(vibration_unit_words(u.name), u.scale) for name, u in own.items() if u.name}
    unit = table.fields[stem].unit
    return speed_axis(stem, unit.name if unit else "rad_s"), units


def _amplitude(table: Table, name: str, *, unclear: bool) -> ComplexArray | None:
    """One amplitude of the model, NaN where a row does not have it; None if the table has no such column."""
    size, phase, real, imag = (f"{name}_{part}" for part in ("amplitude", "phase", "re", "im"))
    there = [stem for stem in (size, phase, real, imag) if stem in table]
    if not there:
        return None
    way = {size, phase} if size in table or phase in table else {real, imag}
    for stem in there:
        if stem not in way:
            expected = f"{name} either as {size} and {phase}_deg or as {real} and {imag}, not some of both"
            table.in_header(table.fields[stem].name, expected)
            return None
    lead, follow = (size, phase) if size in way else (real, imag)
    if lead not in table or (follow == phase and phase not in table):
        missing, other = (lead, there[0]) if lead not in table else (f"{phase}_deg", lead)
        if not unclear:
            expected = f"a column {missing}, as there is {table.fields[other].name}"
            table.in_header(missing, expected)
        return None
    first, second = table.numbers(lead), table.numbers(follow, missing=0.0)
    blank, no_second = table.is_blank(lead), table.is_blank(follow)
    needs = no_second & ~blank & ~((follow == phase) & (first == 0))
    hint = "a number, as its amplitude is given" if follow == phase else "a number (0 for a real amplitude)"
    table.complain_where(needs, follow, hint)
    if follow in table:
        expected = f"a number, or {follow} blank too where {name} was not measured"
        table.complain_where(blank & ~no_second, lead, expected)
    second = np.where(no_second & ~blank, 0.0, second)
    if lead == size:
        expected = f"an amplitude of 0 or more ({real} may be negative)"
        table.must_be(size, (first >= 0) | blank, expected)
        allowed = (np.abs(second) <= FULL_TURN) | no_second
        table.must_be(phase, allowed, "a phase from -360 to 360 degrees")
        return polar(first, np.where(blank, 0.0, second))
    value = np.empty(len(table), dtype=complex)
    value.real, value.imag = first, second
    value[blank] = complex(np.nan, np.nan)
    return value


def _complain_about_missing(
    table: Table, model: HarmonicModel, read: dict[str, ComplexArray | None], unmeasured: Sequence[str]
) -> None:
    parts = ("amplitude", "phase", "re", "im")
    absent = [name for name in model.outputs if not any(f"{name}_{part}" in table for part in parts)]
    if len(absent) == len(model.outputs):
        forms = listing(
            [f"{name}_amplitude and {name}_phase_deg, or {name}_re and {name}_im" for name in absent]
        )
        table.in_header(None, f"measured amplitudes: columns {forms}")
    elif (lost := [name for name in absent if name not in unmeasured]) and not len(table.problems):
        message = f"{table.source}: the table has no {listing(lost, 'and')}: predicted"
        warnings.warn(message, TableWarning, stacklevel=3)
    for name, values in read.items():
        if values is not None and np.isnan(values).all() and not len(table.problems):
            column = next(f.name for stem, f in table.fields.items() if stem.startswith(f"{name}_"))
            table.as_whole(column, "a number in at least one row, or no such column")


def _experiments(table: Table) -> tuple[str, ...]:
    if "experiment" not in table:
        return tuple(str(i + 1) for i in range(len(table)))
    names = table.texts("experiment")
    if "repeat" not in table:
        repeated = "another name than in row {}; repeated readings of one experiment need a column repeat"
        table.once("experiment", names, repeated)
    return names


def _free(table: Table, model: HarmonicModel, signals: dict[str, ComplexArray]) -> BoolArray:
    """Which rows are free vibrations; complaints about rows without a force that are none."""
    unforced = np.ones(len(table), dtype=bool)
    if model.has_constant_terms:
        return ~unforced
    inputs = [name for name in model.inputs if name in signals]
    for name in inputs:
        unforced &= signals[name] == 0
    for name in model.outputs:
        if name not in signals:
            continue
        for i in np.flatnonzero(unforced & (np.abs(signals[name].imag) > 0)):
            stem = f"{name}_im" if f"{name}_im" in table else f"{name}_phase"
            if len(inputs) == len(model.inputs):
                table.complain(i, stem, f"0: nothing excites this row, and {_FREE}")
                continue
            lost = [name for name in model.inputs if name not in signals]
            expected = f"a column {lost[0]}_re or {lost[0]}_amplitude: nothing excites the rows, and {_FREE}"
            table.in_header(f"{lost[0]}_re", expected)
            return unforced
    return unforced
