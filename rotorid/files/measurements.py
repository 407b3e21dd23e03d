"""Measurement tables: amplitudes read in harmonic tests, and natural frequencies with shapes."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rotorid.base import result
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.complex_numbers import polar
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted, listing
from rotorid.base.unit_words import Shown, speed_axis, vibration_unit_words
from rotorid.files import units
from rotorid.files.columns import Column, Table, make_table, read_grid
from rotorid.files.conventions import FULL_TURN
from rotorid.files.modes import read_modes
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.units import Unit, UnitError, UnitReader, one_of

if TYPE_CHECKING:
    from rotorid.identify.amplitudes import AmplitudeErrors, Experiments
    from rotorid.identify.operator_model import HarmonicModel


class ModelFile(Protocol):
    """What a model file says of measurements: its equations, stated errors, outputs that it does not show."""

    @property
    def model(self) -> HarmonicModel: ...  # noqa: D102
    @property
    def errors(self) -> AmplitudeErrors | None: ...  # noqa: D102
    @property
    def unmeasured(self) -> tuple[str, ...]: ...  # noqa: D102


FREQUENCIES = ("frequency", "speed")
"""Stems of the columns that may hold the frequency."""
ENOUGH_REPEATS = 10
"""With fewer repeated readings (beyond the first of each) their scatter is a poor measure of the errors."""
PARTS = ("amplitude", "phase", "re", "im")
DERIVATIVE = {"length": 0, "velocity": 1, "acceleration": 2}
"""How often a displacement is differentiated, by the kind of its unit."""
_SPEED = one_of(units.SPEED)
_FREE = "a free vibration has real amplitudes"
_AMPLITUDE = re.compile(r"(.+)_(?:amplitude|phase|re|im)(?:_.*)?")


def read_measurements(path: str | Path, model: HarmonicModel | ModelFile) -> Experiments:
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
        With all problems of the cells, or else with all contradictions between them.

    Warns
    -----
    TableWarning
        Where an amplitude of the model is nowhere in the table, and where few repeats tell the errors.
    """
    from rotorid.identify.amplitudes import Experiments
    from rotorid.identify.operator_model import HarmonicModel

    errors, unmeasured = None, set[str]()
    if not isinstance(model, HarmonicModel):
        errors, unmeasured = model.errors, {*model.unmeasured}
        model = model.model
    problems = Problems()
    grid = problems.need(read_grid(path, "measurements", problems, first=True))
    if {"mode", "node", "shape"} <= set(grid.header):
        return _free_vibrations(path, model, errors)
    table = problems.need(make_table(grid, _columns(model.signals, model.varying), problems))
    frequencies = _frequencies(table)
    problems.stop()
    signals = _amplitudes(table, model.signals)
    _complain_about_missing(table, model, signals)
    problems.stop()
    names, free = _experiments(table), _free(table, model, signals)
    problems.stop()
    if lost := [name for name in model.outputs if name not in {*signals, *unmeasured}]:
        message = f"{table.source}: the table has no {listing(lost, 'and')}: predicted"
        warnings.warn(message, TableWarning, stacklevel=2)
    for name in model.signals:
        absent = 0.0 if name in model.inputs else np.nan
        signals.setdefault(name, np.full(len(table), complex(absent, absent)))
    varying = {name: table.numbers(name) for name in model.varying}
    axis, shown = _shown(table, signals)
    rows = Experiments(names, frequencies, signals, free, errors, varying=varying, axis=axis, units=shown)
    rows = replace(rows, rounding=_rounding(table, rows, model.outputs))
    return _merged(table, rows, model) if "repeat" in table else rows


def read_amplitudes(path: str | Path) -> Experiments:
    """Read displacements at any points: as `read_measurements`, with any names and without a model.

    Velocities and accelerations, known by their units, become displacements. Repeated readings stay apart.
    A UFF file (`.uff`, `.unv`) has frequency responses: displacements under a force of 1 N.
    """
    from rotorid.identify.amplitudes import Experiments

    if Path(path).suffix.lower() in (".uff", ".unv"):
        from rotorid.files.instruments import read_responses

        omega, signals = read_responses(Path(path))
        shown = dict.fromkeys(signals, Shown(vibration_unit_words("um"), 1e6))
        signals["F"], free = np.ones(len(omega), dtype=complex), np.zeros(len(omega), dtype=bool)
        labels = tuple(str(row + 1) for row in range(len(omega)))
        return Experiments(labels, omega, signals, free, axis=speed_axis("frequency", "Hz"), units=shown)
    problems = Problems()
    grid = problems.need(read_grid(path, "measurements", problems, first=True))
    points = tuple(dict.fromkeys(match[1] for name in grid.header if (match := _AMPLITUDE.fullmatch(name))))
    table = problems.need(make_table(grid, _columns(points, ()), problems))
    omega = _frequencies(table)
    if not set(points) - {"F"}:
        table.in_header(None, "amplitudes of points: columns X_amplitude and X_phase_deg, or X_re and X_im")
    problems.stop()
    signals, labels = _amplitudes(table, points), _experiments(table)
    problems.stop()
    axis, shown = _shown(table, signals)
    for name, values in signals.items():
        part = _lead(table, name)
        bad = (omega == 0) | ((name == "F") & (np.isnan(values) | (values == 0)))
        table.complain_where(bad, part, "a frequency above 0, and a force F that is not 0")
        if not np.nan_to_num(values).any():
            table.as_whole(table.fields[part].name, "a number that is not 0 in at least one row")
        if order := DERIVATIVE.get(table.unit(part).kind, 0):
            signals[name] = values / (1j * np.where(bad, 1.0, omega)) ** order
            shown[name] = Shown(vibration_unit_words("um"), 1e6)
    problems.stop()
    return Experiments(labels, omega, signals, np.zeros(len(table), dtype=bool), axis=axis, units=shown)


def measurement_columns(data: Experiments, signals: Sequence[str]) -> tuple[result.Column, ...]:
    """The table of some amplitudes as `read_measurements` reads it, frequencies in rad/s."""
    columns = {"frequency_rad_s": data.frequencies, **data.varying}
    for name in signals:
        columns[f"{name}_re"] = data.signals[name].real
        if not data.free.all():
            columns[f"{name}_im"] = data.signals[name].imag
    return tuple(result.Column(name, values, "{:.6g}".format) for name, values in columns.items())


def _free_vibrations(path: str | Path, model: HarmonicModel, errors: AmplitudeErrors | None) -> Experiments:
    """A table of modes, whose nodes are amplitudes of the model."""
    from rotorid.identify.amplitudes import Experiments

    modes, problems = read_modes(path), Problems()
    nodes, count = [str(node) for node in modes.nodes], len(modes.frequencies)
    for node in set(nodes) - set(model.outputs):
        expected = f"an amplitude of the model: {listing(model.outputs)}{did_you_mean(node, model.outputs)}"
        problems.add(str(path), None, "node", node, expected)
    if model.varying or model.has_constant_terms:
        problems.add(str(path), None, None, None, f"a model of amplitudes and parameters only, for {_FREE}")
    problems.stop()
    signals = {
        name: np.full(count, 0 if name in model.inputs else np.nan, dtype=complex) for name in model.signals
    }
    signals |= dict(zip(nodes, modes.shapes.astype(complex), strict=True))
    covariances, std = {}, modes.frequency_std
    if errors is None and modes.shape_std is not None:
        variances = (modes.shape_std * modes.shapes)[..., None, None] ** 2 * np.diag([1.0, 0.0])
        covariances = dict(zip(nodes, variances, strict=True))
    return Experiments(
        tuple(f"mode {mode}" for mode in range(1, count + 1)),
        modes.frequencies,
        signals,
        np.ones(count, dtype=bool),
        errors,
        covariances,
        frequency_std=std * modes.frequencies if std is not None and std.all() else None,
    )


def _columns(signals: tuple[str, ...], varying: tuple[str, ...]) -> tuple[Column, ...]:
    def optional(name: str, unit: UnitReader, example: str = "") -> Column:
        return Column(name, unit, (example or name,), required=False, blank=True)

    columns = [optional(name, _row_unit) for name in varying]
    for name in signals:
        size, real, imag = (optional(f"{name}_{part}", _amplitude_unit) for part in ("amplitude", "re", "im"))
        columns += [size, optional(f"{name}_phase", one_of(units.ANGLE), f"{name}_phase_deg"), real, imag]
    return (
        Column("experiment", required=False),
        Column("frequency", _SPEED, ("frequency_rad_s", "frequency_Hz"), required=False),
        Column("speed", _SPEED, ("speed_rpm",), required=False),
        Column("repeat", required=False),
        *columns,
    )


def _amplitude_unit(name: str) -> Unit:
    """No unit (the model's own), or a known one of vibration, which becomes SI and peak."""
    unit = units.vibration(name) if name else Unit("", "model")
    if unit.kind.startswith("label"):
        raise UnitError(f"no unit (the model's own) or one such as mm, um_pp, not {name!r}")
    return unit


def _row_unit(name: str) -> Unit:
    """No unit (the model's own; `re` says the same), or one of speed."""
    if name in ("", "re"):
        return Unit("", "model")
    if name not in units.SPEED:
        raise UnitError(f"a real number in the unit of the model, or rad_s, Hz or rpm, not {name!r}")
    return units.SPEED[name]


def _frequencies(table: Table) -> FloatArray:
    stem = table.only(FREQUENCIES, "frequency_rad_s", "one column frequency_rad_s, frequency_Hz or speed_rpm")
    table.must_be(stem or "", table.numbers(stem or "") >= 0, "a frequency of 0 or more")
    return table.numbers(stem or "")


def _frequency_column(table: Table) -> str:
    return next(stem for stem in FREQUENCIES if stem in table)


def _lead(table: Table, name: str) -> str:
    """The column with the size, or else the real part, of an amplitude."""
    return next(stem for part in ("amplitude", "re") if (stem := f"{name}_{part}") in table)


def _shown(table: Table, signals: Iterable[str]) -> tuple[Shown, dict[str, Shown]]:
    """The axis of the frequencies, and the units of the signals that have one."""
    columns = {f"{name}_{part}": name for name in signals for part in ("amplitude", "re")}
    named = {name: table.unit(stem) for stem, name in columns.items() if stem in table}
    shown = {name: Shown(vibration_unit_words(u.name), u.scale) for name, u in named.items() if u.name}
    stem = _frequency_column(table)
    return speed_axis(stem, table.unit(stem).name), shown


def _amplitudes(table: Table, names: Sequence[str]) -> dict[str, ComplexArray]:
    """Amplitudes that have columns, NaN where a row does not have them; complaints about halves."""
    signals = {}
    for name in names:
        there = [stem for part in PARTS if (stem := f"{name}_{part}") in table]
        if not there:
            continue
        is_polar = there[0] in (f"{name}_amplitude", f"{name}_phase")
        lead, follow = (f"{name}_{part}" for part in (PARTS[:2] if is_polar else PARTS[2:]))
        unit = "_deg" if is_polar else ""
        if not {*there} <= {lead, follow}:
            words = f"{name} as {lead} and {follow}{unit}, or as real and imaginary part, not some of both"
            table.in_header(table.fields[there[-1]].name, words)
        elif lead not in table or (is_polar and follow not in table):
            lost = lead if lead not in table else f"{follow}{unit}"
            table.in_header(lost, f"a column {lost}, as there is {table.fields[there[0]].name}")
        else:
            signals[name] = _amplitude(table, lead, follow, is_polar=is_polar)
    return signals


def _amplitude(table: Table, lead: str, follow: str, *, is_polar: bool) -> ComplexArray:
    first, second = table.numbers(lead), table.numbers(follow, missing=0.0)
    blank, half = table.is_blank(lead), table.is_blank(follow)
    needs = half & ~blank & ~(is_polar & (first == 0))
    hint = ", as its amplitude is given" if is_polar else " (0 for a real amplitude)"
    table.complain_where(needs, follow, f"a number{hint}")
    if follow in table:
        table.complain_where(
            blank & ~half, lead, f"a number, or {follow} blank too where it was not measured"
        )
    second = np.where(half, 0.0, second)
    if not is_polar:
        return np.asarray(first + 1j * np.where(blank, np.nan, second))
    table.must_be(lead, (first >= 0) | blank, "an amplitude of 0 or more (a real part may be negative)")
    table.must_be(follow, np.abs(second) <= FULL_TURN, "a phase from -360 to 360 degrees")
    return polar(first, second)


def _complain_about_missing(table: Table, model: HarmonicModel, signals: dict[str, ComplexArray]) -> None:
    if not signals.keys() & {*model.outputs} and not len(table.problems):
        forms = [
            f"{name}_amplitude and {name}_phase_deg, or {name}_re and {name}_im" for name in model.outputs
        ]
        table.in_header(None, f"measured amplitudes: columns {listing(forms)}")
    for name, values in signals.items():
        if np.isnan(values).all():
            table.as_whole(_lead(table, name), "a number in at least one row, or no such column")
    for name in model.varying:
        if name not in table:
            near = did_you_mean(name, [*model.parameters, *model.known])
            table.in_header(name, f"a column {name}: the equations multiply amplitudes by it{near}")


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
    unforced = np.full(len(table), not model.has_constant_terms)
    for name in {*model.inputs} & signals.keys():
        unforced &= signals[name] == 0
    lost = [name for name in model.inputs if name not in signals]
    hint = f", or a column {lost[0]}_re or {lost[0]}_amplitude" if lost else ""
    for name in [name for name in model.outputs if name in signals]:
        stem = next(stem for part in ("im", "phase", "re") if (stem := f"{name}_{part}") in table)
        wrong = unforced & (np.abs(signals[name].imag) > 0)
        table.complain_where(wrong, stem, f"0{hint}: nothing excites this row, and {_FREE}")
    return unforced


def _rounding(table: Table, rows: Experiments, outputs: Sequence[str]) -> dict[str, FloatArray]:
    """Covariances (n, 2, 2) that the digits of readings give, and under "" variances (n,) of frequencies.

    Frequencies of excitation are set, not read; a shape that is 1 everywhere is the reference of the others.
    Nothing where a cell of a reading is blank, or a natural frequency shows no end of its digits.
    """
    from rotorid.identify.amplitudes import real_matrices

    covariances: dict[str, FloatArray] = {}
    for name in outputs:
        there = [stem for part in PARTS if (stem := f"{name}_{part}") in table]
        if any(table.is_blank(stem).any() for stem in there):
            return {}
        z = rows.signals[name]
        if not there or (rows.free.all() and (z == 1).all()):
            exact = 1e-12 * np.maximum(np.nan_to_num(np.abs(z)), 1e-12)
            covariances[name] = exact[:, None, None] ** 2 * np.eye(2)
            continue
        along, across = (table.steps(stem) for stem in (there[0], there[-1]))
        is_polar = there[0] == f"{name}_amplitude"
        if is_polar:
            across = across * np.abs(z)
        turn = real_matrices(np.exp(1j * np.angle(z)) if is_polar else np.ones(len(z), dtype=complex))
        spread = turn * (np.stack((along, across), -1) / np.sqrt(12.0))[:, None]
        covariances[name] = spread @ np.swapaxes(spread, 1, 2)
    steps = table.steps(_frequency_column(table))
    if (rows.free & (steps < 1e-9 * rows.frequencies)).any():  # the root of a rounded number, or such
        return {}
    return {**covariances, "": np.where(rows.free, steps**2 / 12.0, 0.0)}


def _merged(table: Table, rows: Experiments, model: HarmonicModel) -> Experiments:
    """Repeated readings become their mean, with its covariance; unstated errors come from their scatter."""
    groups = _repeats(table, rows, model)
    table.problems.stop()
    named = "experiment" in table
    signals = {
        name: np.array([z[g][~np.isnan(z[g])].mean() if not np.isnan(z[g]).all() else np.nan for g in groups])
        for name, z in rows.signals.items()
    }
    merged = replace(
        rows,
        names=tuple(rows.names[g[0]] if named else str(number) for number, g in enumerate(groups, start=1)),
        frequencies=np.array([rows.frequencies[g].mean() for g in groups]),
        signals=signals,
        free=np.array([rows.free[g].all() for g in groups]),
        varying={name: np.array([v[g].mean() for g in groups]) for name, v in rows.varying.items()},
        rounding={},
    )
    errors = rows.errors or _scatter(table.source, rows, merged, groups, model)
    if errors is None:
        return merged
    single = replace(merged, errors=errors)
    counts = {
        name: np.array([max(1, np.count_nonzero(~np.isnan(rows.signals[name][g]))) for g in groups])
        for name in model.outputs
    }
    covariances = {name: single.covariance(name) / n[:, None, None] for name, n in counts.items()}
    return replace(merged, errors=rows.errors, covariances=covariances)


def _repeats(table: Table, rows: Experiments, model: HarmonicModel) -> list[list[int]]:
    """Rows that are readings of one experiment; complaints where they differ in more than the reading."""
    setting = [
        (
            rows.frequencies[i],
            *(str(rows.signals[name][i]) for name in model.inputs),
            *(v[i] for v in rows.varying.values()),
        )
        for i in range(len(rows))
    ]
    keys = rows.names if "experiment" in table else setting
    groups: dict[object, list[int]] = {}
    for i, key in enumerate(keys):
        head = groups.setdefault(key, [i])
        if i != head[0]:
            head.append(i)
            if setting[i] != setting[head[0]]:
                words = f"the frequency and the excitation of row {table.rows[head[0]]}, the same experiment"
                table.complain(i, _frequency_column(table), words)
    readings = [
        (key, label) if label else None for key, label in zip(keys, table.texts("repeat"), strict=True)
    ]
    table.once("repeat", readings, "another repeat than in row {}, the same reading")
    return list(groups.values())


def _scatter(
    source: str, rows: Experiments, merged: Experiments, groups: list[list[int]], model: HarmonicModel
) -> AmplitudeErrors | None:
    """Errors of one reading, relative to its amplitude, pooled over all repeated ones; None without any."""
    from rotorid.identify.amplitudes import AmplitudeErrors

    squares, dof = np.zeros(2), np.zeros(2)  # along and across
    for name in model.outputs:
        for k, group in enumerate(groups):
            z = rows.signals[name][group]
            z = z[~np.isnan(z)]
            if len(z) < 2 or merged.signals[name][k] == 0:
                continue
            deviation = z / merged.signals[name][k] - 1.0
            counts = np.array([True, not merged.free[k]])
            squares += counts * (np.sum(deviation.real**2), np.sum(deviation.imag**2))
            dof += counts * (len(z) - 1)
    relative, phase = np.sqrt(squares / np.maximum(dof, 1))
    if not (relative or phase):
        return None
    if dof[0] < ENOUGH_REPEATS:
        message = (
            f"{source}: the errors come from {counted(int(dof[0]), 'repeated reading')} only: intervals "
            "may be far too narrow; repeat more readings or state the errors"
        )
        warnings.warn(message, TableWarning, stacklevel=4)
    return AmplitudeErrors(float(relative), float(phase))
