"""Time records: measured outputs and inputs over time."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base import result
from rotorid.base.text import counted, listing
from rotorid.base.unit_words import Shown
from rotorid.files.cells import Grid
from rotorid.files.columns import Column, make_table, read_grid
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.units import TIME, Unit, UnitError, one_of

if TYPE_CHECKING:
    from rotorid.files.columns import Table
    from rotorid.identify.ode import OdeModel
    from rotorid.identify.records import Record

MISSING = {"nan", "na", "n/a", "#n/a", "null", "none", "-", "--"}
STD = "_std"
"""At the end of the name of a column: standard deviations of the samples of an output."""
GAP = 1.5
"""Times the usual step; a longer one in an otherwise even record is worth a word."""


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

    Warns
    -----
    TableWarning
        Where an evenly sampled record has gaps.
    """
    from rotorid.identify.records import Record

    taken = {*model.outputs, *model.inputs}
    deviations = {name: name + STD for name in model.outputs if name + STD not in taken}
    problems = Problems()
    grid = problems.need(read_grid(Path(path), "record", problems, first=True))
    if allow_missing:
        grid = _blanked(grid, {*model.outputs, *deviations.values()})
    columns = [Column("t", one_of(TIME), ("t_s",))]
    needed = measured and not allow_missing
    columns += [Column(name, _no_unit, (name,), needed, blank=True) for name in model.outputs]
    columns += [Column(name, _no_unit, (name,), False, blank=True) for name in deviations.values()]
    columns += [Column(name, _no_unit, (name,)) for name in model.inputs if name not in model.outputs]
    table = problems.need(make_table(grid, columns, problems))
    clear = not len(problems)  # otherwise a misspelt column would be called missing
    t = table.numbers("t")
    for late in np.flatnonzero(np.diff(t) <= 0) + 1:
        before = f"{table.shown('t', late - 1)} of row {table.rows[late - 1]}"
        table.complain(late, "t", f"a time above {before}: sort the rows; repeated runs are other records")
    outputs = {name: table.numbers(name) for name in model.outputs if name in table}
    if measured:
        _complain_about_outputs(table, list(outputs), model.outputs, allow_missing=allow_missing)
    own = {name: table.numbers(column) for name, column in deviations.items() if column in table}
    if own and sigma is not None:
        table.in_header(deviations[next(iter(own))], "no such column together with --sigma")
    else:
        for name in sorted(own.keys() ^ outputs.keys()) if own and clear else ():
            column, other = (name, name + STD) if name in own else (name + STD, next(iter(own)) + STD)
            table.in_header(
                column, f"a column {column}, as there is {other}: deviations of all outputs or none"
            )
        for name in [name for name in outputs if name in own]:
            sizes, column = own[name], deviations[name]
            wrong = ~np.isnan(outputs[name]) & ~(sizes > 0) & ~(np.isnan(sizes) & ~table.is_blank(column))
            table.complain_where(wrong, column, f"a standard deviation above 0 wherever {name} was measured")
    problems.stop()
    if not allow_missing:
        _warn_of_gaps(table)
    unit = table.unit("t")
    stated = own or None if sigma is None else {k: value for k, value in sigma.items() if k in table}
    axis = Shown(f"time, {'µs' if unit.name == 'us' else unit.name}", unit.scale)
    return Record(t, outputs, {k: table.numbers(k) for k in model.inputs}, stated, str(path), axis)


def record_columns(record: Record) -> tuple[result.Column, ...]:
    """The table as `read_record` reads it: times in s, outputs, their standard deviations, inputs."""
    columns = {"t_s": record.t, **record.outputs}
    for name, std in (record.sigma or {}).items():
        columns[f"{name}{STD}"] = np.broadcast_to(std, record.t.shape)
    columns |= record.inputs
    return tuple(result.Column(name, values, "{:.6g}".format) for name, values in columns.items())


def _no_unit(name: str) -> Unit:
    if name:
        raise UnitError(
            "the name of the model alone, without a unit: values are in the units of the model (and standard "
            f"deviations of an output NAME in a column NAME{STD})"
        )
    return Unit("", "model")


def _blanked(grid: Grid, columns: set[str]) -> Grid:
    """Words for "missing" in these columns become blanks."""
    places = [name in columns for name in grid.header]
    rows = tuple(
        (
            number,
            tuple(
                "" if may and isinstance(cell, str) and cell.strip().casefold() in MISSING else cell
                for may, cell in zip(places, cells, strict=True)
            ),
        )
        for number, cells in grid.rows
    )
    return replace(grid, rows=rows)


def _complain_about_outputs(
    table: Table, names: list[str], outputs: tuple[str, ...], *, allow_missing: bool
) -> None:
    if not names and not len(table.problems):
        table.in_header(None, f"a column for at least one output of the model: {listing(outputs)}")
    for name in names:
        blank = table.is_blank(name)
        if not allow_missing:
            table.complain_where(blank, name, "a number (--allow-missing: blanks were not measured)")
        elif blank.all():
            table.as_whole(name, "a number in at least one row, or no such column")


def _warn_of_gaps(table: Table) -> None:
    """Say where an even record jumps; nothing is filled in."""
    steps = np.diff(table.numbers("t"))
    usual = float(np.median(steps)) if len(steps) > 2 else np.inf
    gaps = np.flatnonzero(steps > GAP * usual)
    if gaps.size and (np.abs(steps - usual) <= 0.01 * usual).mean() >= 0.5:
        message = (
            f"{table.source}: {counted(gaps.size, 'gap')} longer than the usual step of {usual:.4g} s, the "
            f"first of {steps[gaps[0]]:.4g} s after row {table.rows[gaps[0]]}; nothing is filled in"
        )
        warnings.warn(message, TableWarning, stacklevel=3)
