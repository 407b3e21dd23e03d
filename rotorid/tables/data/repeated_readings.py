"""Repeated readings of one experiment: their mean, and what their scatter says about errors."""

from __future__ import annotations

import warnings
from collections import defaultdict
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.text import counted
from rotorid.files.columns import Table
from rotorid.files.problems import TableWarning

if TYPE_CHECKING:
    from rotorid.identify.amplitudes import AmplitudeErrors, Experiments
    from rotorid.identify.operator_model import HarmonicModel

FREQUENCIES = ("frequency", "speed")
"""Stems of the columns that may hold the frequency."""
ENOUGH_REPEATS = 10
"""With fewer repeated readings (beyond the first of each) their scatter is a poor measure of the errors."""


def merge_repeats(table: Table, rows: Experiments, model: HarmonicModel) -> Experiments:
    """Repeated readings become their mean; without stated errors their scatter gives the errors.

    Parameters
    ----------
    table
        With a column `repeat`.
    rows
        One experiment per row of the table.
    model
        Knows inputs and outputs.

    Returns
    -------
    Experiments
        One per group of repeats, with the covariance of each mean.

    Raises
    ------
    InputError
        Where rows of one experiment differ in more than what was read.
    """
    members = _groups(table, rows, model)
    table.problems.stop()
    own = "experiment" in table
    signals = {}
    for name, z in rows.signals.items():
        means = [z[m][~np.isnan(z[m])] for m in members]
        signals[name] = np.array([np.mean(m) if len(m) else complex(np.nan, np.nan) for m in means])
    merged = replace(
        rows,
        names=tuple(rows.names[m[0]] if own else str(number) for number, m in enumerate(members, start=1)),
        frequencies=np.array([rows.frequencies[m].mean() for m in members]),
        signals=signals,
        free=np.array([rows.free[m].all() for m in members]),
        varying={name: np.array([v[m].mean() for m in members]) for name, v in rows.varying.items()},
        rounding={},
    )
    errors = rows.errors or _scatter(table.source, rows, merged, members, model)
    if errors is None:
        return merged
    known = replace(merged, errors=errors)
    covariances = {}
    for name in model.outputs:
        counts = np.array([max(1, np.count_nonzero(~np.isnan(rows.signals[name][m]))) for m in members])
        covariances[name] = known.covariance(name) / counts[:, None, None]
    return replace(merged, errors=rows.errors, covariances=covariances)


def _groups(table: Table, rows: Experiments, model: HarmonicModel) -> list[list[int]]:
    """Rows that are readings of one experiment."""
    named = "experiment" in table
    found: dict[tuple[object, ...], list[int]] = defaultdict(list)
    for i, name in enumerate(rows.names):
        excitation = [complex(rows.signals[s][i]) for s in model.inputs]
        excitation += [complex(values[i]) for values in rows.varying.values()]
        key = (name,) if named else (float(rows.frequencies[i]), *map(str, excitation))
        found[key].append(i)
    labels = table.texts("repeat")
    of_row = {i: key for key, group in found.items() for i in group}
    readings = [(of_row[i], label) if label else None for i, label in enumerate(labels)]
    table.once("repeat", readings, "another repeat than in row {}, the same reading")
    for group in found.values():
        _complain_about_changes(table, rows, group, model)
    return list(found.values())


def _complain_about_changes(table: Table, rows: Experiments, group: list[int], model: HarmonicModel) -> None:
    head = group[0]
    stem = next(stem for stem in FREQUENCIES if stem in table)
    for i in group[1:]:
        if abs(rows.frequencies[i] - rows.frequencies[head]) > 1e-9 * rows.frequencies[head]:
            expected = f"the frequency of row {table.rows[head]}, the same experiment"
            table.complain(i, stem, expected)
        for name, values in rows.varying.items():
            if values[i] != values[head]:
                table.complain(i, name, f"the value of row {table.rows[head]}, the same experiment")
        for name in model.inputs:
            a, b = rows.signals[name][head], rows.signals[name][i]
            column = next((f"{name}_{p}" for p in ("amplitude", "re") if f"{name}_{p}" in table), None)
            if column is not None and not (a == b or (np.isnan(a) and np.isnan(b))):
                expected = f"the excitation of row {table.rows[head]}: repeats have the same"
                table.complain(i, column, expected)


def _scatter(
    source: str, rows: Experiments, merged: Experiments, members: list[list[int]], model: HarmonicModel
) -> AmplitudeErrors | None:
    """Errors of one reading, relative to its amplitude, pooled over all repeated ones; None without any."""
    from rotorid.identify.amplitudes import AmplitudeErrors

    along = across = 0.0
    dof, dof_across = 0, 0
    for name in model.outputs:
        for k, member in enumerate(members):
            z = rows.signals[name][member]
            z = z[~np.isnan(z)]
            mean = merged.signals[name][k]
            if len(z) < 2 or mean == 0:
                continue
            deviation = z / mean - 1.0
            along += float(np.sum(deviation.real**2))
            dof += len(z) - 1
            if not merged.free[k]:
                across += float(np.sum(deviation.imag**2))
                dof_across += len(z) - 1
    relative = np.sqrt(along / dof) if dof else 0.0
    phase = np.sqrt(across / dof_across) if dof_across else 0.0
    if not (relative or phase):
        return None
    if dof < ENOUGH_REPEATS:
        message = (
            f"{source}: the errors come from {counted(dof, 'repeated reading')} only: intervals "
            "may be far too narrow; repeat more readings or state the errors"
        )
        warnings.warn(message, TableWarning, stacklevel=4)
    return AmplitudeErrors(float(relative), float(phase))
