"""Time records: measured outputs and inputs over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import Shown, listing
from rotorid.files.cells import show
from rotorid.files.columns import Column, make_table, read_grid
from rotorid.files.problems import Problems
from rotorid.files.units import TIME, one_of, ratio

if TYPE_CHECKING:
    from rotorid.identify.ode import OdeModel
    from rotorid.identify.records import Record

MISSING = {"nan", "na", "n/a", "#n/a", "null", "none", "-", "--"}
STD = "_std"
"""At the end of the name of a column: standard deviations of the samples of an output."""


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
    from rotorid.identify.records import Record

    taken = {*model.outputs, *model.inputs}
    deviations = {name: name + STD for name in model.outputs if name + STD not in taken}
    problems, needed = Problems(), measured and not allow_missing
    columns = [Column("t", one_of(TIME), ("t_s",)), *(Column(name, ratio) for name in model.inputs)]
    for names, required in ((model.outputs, needed), (deviations.values(), False)):
        more = [name for name in names if name not in model.inputs]
        columns += [Column(name, ratio, (), required, blank=True) for name in more]
    grid = problems.need(read_grid(path, "record", problems, first=True))
    if allow_missing:
        rows = (
            (at, ["" if show(cell).casefold() in MISSING else cell for cell in row]) for at, row in grid.rows
        )
        grid = replace(grid, rows=tuple((at, tuple(row)) for at, row in rows))
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
