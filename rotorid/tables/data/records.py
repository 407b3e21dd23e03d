"""Time records: measured outputs and inputs over time."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base import result
from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.base.unit_words import Shown
from rotorid.files.cells import Cell, Grid
from rotorid.files.columns import Column, Table, make_table, read_grid
from rotorid.files.problems import Problems, TableWarning
from rotorid.files.units import TIME, Unit, UnitError, one_of

if TYPE_CHECKING:
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

    problems = Problems()
    grid = problems.need(read_grid(Path(path), "record", problems, first=True))
    _explain_states(grid, model, problems)
    if allow_missing:
        grid = _blank(grid, (*model.outputs, *_deviations(model).values()))
    optional = allow_missing or not measured
    table = problems.need(make_table(grid, _columns(model, allow_missing=optional), problems))
    _complain_about_times(table)
    if measured:
        _complain_about_outputs(table, model, allow_missing=allow_missing)
    _complain_about_deviations(table, model, stated=sigma is not None)
    problems.stop()
    t = table.numbers("t")
    if not allow_missing:
        _warn_of_gaps(table)
    unit = table.fields["t"].unit or TIME["s"]
    return Record(
        t,
        {name: table.numbers(name) for name in model.outputs if name in table},
        {name: table.numbers(name) for name in model.inputs},
        _sigma(table, model, sigma),
        str(path),
        Shown(f"time, {'µs' if unit.name == 'us' else unit.name}", unit.scale),
    )


def record_columns(record: Record) -> tuple[result.Column, ...]:
    """The table as `read_record` reads it: times in s, outputs, their standard deviations, inputs."""
    columns = {"t_s": record.t, **record.outputs}
    for name, std in (record.sigma or {}).items():
        columns[f"{name}{STD}"] = np.broadcast_to(std, record.t.shape)
    columns |= record.inputs
    return tuple(result.Column(name, values, "{:.6g}".format) for name, values in columns.items())


def _columns(model: OdeModel, *, allow_missing: bool) -> tuple[Column, ...]:
    return (
        Column("t", one_of(TIME), ("t_s",)),
        *(Column(name, _no_unit, (name,), not allow_missing, blank=True) for name in model.outputs),
        *(Column(name, _no_unit, (name,), False, blank=True) for name in _deviations(model).values()),
        *(Column(name, _no_unit, (name,)) for name in model.inputs if name not in model.outputs),
    )


def _deviations(model: OdeModel) -> dict[str, str]:
    """Column of the standard deviations of each output, where the model means nothing else by its name."""
    taken = {*model.outputs, *model.inputs}
    return {name: name + STD for name in model.outputs if name + STD not in taken}


def _sigma(
    table: Table, model: OdeModel, sigma: Mapping[str, float] | None
) -> Mapping[str, float | FloatArray] | None:
    """Standard deviations of the record's own columns, or else the given ones."""
    if sigma is not None:
        return {name: value for name, value in sigma.items() if name in table}
    own = {name: table.numbers(column) for name, column in _deviations(model).items() if column in table}
    return own or None


def _no_unit(name: str) -> Unit:
    if name:
        raise UnitError(
            "the name of the model alone, without a unit: values are in the units of the model (and standard "
            f"deviations of an output NAME in a column NAME{STD})"
        )
    return Unit("", "model")


def _explain_states(grid: Grid, model: OdeModel, problems: Problems) -> None:
    """A state that is no output but stands in the record."""
    for name in model.states:
        if name in grid.header and name not in model.outputs:
            expected = f'an output of the model: write {name} = "{name}" into [outputs] of the model file'
            problems.add(grid.source, grid.header_row, name, None, expected)


def _blank(grid: Grid, columns: tuple[str, ...]) -> Grid:
    """Words for "missing" in these columns become blanks."""
    places = {i for i, name in enumerate(grid.header) if name in columns}

    def emptied(cells: tuple[Cell, ...]) -> tuple[Cell, ...]:
        return tuple(
            "" if i in places and isinstance(cell, str) and cell.strip().casefold() in MISSING else cell
            for i, cell in enumerate(cells)
        )

    return replace(grid, rows=tuple((number, emptied(cells)) for number, cells in grid.rows))


def _complain_about_times(table: Table) -> None:
    t = table.numbers("t")
    for i in np.flatnonzero(np.diff(t) <= 0) + 1:
        before, row = table.shown("t", i - 1), table.rows[i - 1]
        if t[i] == t[i - 1]:
            expected = f"each time once, and row {row} has it too; repeated runs are records of their own"
        else:
            expected = f"times that increase, and row {row} has {before}; sort the rows by time"
        table.complain(i, "t", expected)


def _complain_about_outputs(table: Table, model: OdeModel, *, allow_missing: bool) -> None:
    names = [name for name in model.outputs if name in table]
    if not names and not len(table.problems):
        expected = f"a column for at least one output of the model: {listing(model.outputs)}"
        table.in_header(None, expected)
    for name in names:
        blank = table.is_blank(name)
        if not allow_missing:
            table.complain_where(blank, name, "a number (--allow-missing: blanks were not measured)")
        elif blank.all():
            table.as_whole(name, "a number in at least one row, or no such column")


def _complain_about_deviations(table: Table, model: OdeModel, *, stated: bool) -> None:
    """Standard deviations of all outputs or of none, above 0 wherever something was measured."""
    clear = not len(table.problems)  # otherwise a misspelt column would be called missing
    columns = _deviations(model)
    found = [column for column in columns.values() if column in table]
    if found and stated:
        expected = "no such column together with --sigma: leave out one of the two"
        table.in_header(found[0], expected)
        return
    for name in model.outputs if found else ():
        column = columns.get(name, name + STD)
        if column not in found:
            if name in table and clear:
                expected = (
                    f"such a column, as {found[0]} is there: standard deviations of all outputs or none"
                )
                table.in_header(column, expected)
            continue
        if name not in table:
            expected = f"a column {name} beside it, whose standard deviations these are"
            table.in_header(column, expected)
            continue
        sizes = table.numbers(column)
        unreadable = np.isnan(sizes) & ~table.is_blank(column)  # has been reported
        wrong = ~np.isnan(table.numbers(name)) & ~(sizes > 0) & ~unreadable
        table.complain_where(wrong, column, f"a standard deviation above 0 wherever {name} was measured")


def _warn_of_gaps(table: Table) -> None:
    """Say where an even record jumps; nothing is filled in."""
    steps = np.diff(table.numbers("t"))
    if len(steps) < 3:
        return
    usual = float(np.median(steps))
    even = np.abs(steps - usual) <= 0.01 * usual
    gaps = np.flatnonzero(steps > GAP * usual)
    if not gaps.size or even.mean() < 0.5:
        return
    first = int(gaps[0])
    more = f" and {gaps.size - 1} more" if gaps.size > 1 else ""
    message = (
        f"{table.source}: a gap of {steps[first]:.4g} s after row {table.rows[first]}{more}, where the usual "
        f"step is {usual:.4g} s; nothing is filled in"
    )
    warnings.warn(message, TableWarning, stacklevel=3)
