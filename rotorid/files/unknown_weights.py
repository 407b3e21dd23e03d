"""Trial weights whose mass or place nobody knows: `?` in a weights table.

All `?` of a plane are one weight at one place. The numbers 1 and 0 stand in for its mass and angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from balancing import Relative
from rotorid.base.arrays import ComplexArray
from rotorid.files.cells import Cell, Grid, show
from rotorid.files.columns import Table
from rotorid.files.headings import WEIGHT, read_headings

Unknown = set[tuple[int, str, str]]
"""Row, plane (empty where a column has it) and quantity of each `?`."""


def without_marks(grid: Grid) -> tuple[Grid, Unknown]:
    """A weights table with numbers in place of `?`, and where these stood."""
    columns = [h for h in read_headings(grid.header, weights=True) if h.stem in WEIGHT]
    rows, unknown = list[tuple[int, tuple[Cell, ...]]](), Unknown()
    for number, cells in grid.rows:
        new = list(cells)
        for heading in columns:
            if show(cells[heading.index]) == "?":
                unknown.add((number, heading.sensor, heading.stem))
                new[heading.index] = "1" if heading.stem == "mass" else "0"
        rows.append((number, tuple(new)))
    return replace(grid, rows=tuple(rows)), unknown


def relative_weights(
    table: Table, unknown: Unknown, run_of: Sequence[str], runs: Sequence[str], total: ComplexArray
) -> tuple[ComplexArray, Relative]:
    """Weights (R, P) as multiples of the trial weight of their plane; problems where these are none.

    `run_of` are the runs of the rows of the table, `runs` those of the weights.
    """
    plane_of, unit, sizes = table.texts("plane"), table.unit("mass"), dict[str, float]()
    turned, multiples = any(stem == "angle" for *_, stem in unknown), total.copy()

    def marked(row: int, stem: str) -> bool:
        return not unknown.isdisjoint((table.rows[row], name, stem) for name in ("", plane_of[row]))

    for p, plane in enumerate(dict.fromkeys(plane_of)):
        rows = [row for row, name in enumerate(plane_of) if name == plane]
        stems = [stem for stem in WEIGHT if any(marked(row, stem) for row in rows)]
        alike: dict[tuple[complex, ...], str] = {}
        for row in rows if stems else ():
            for stem in stems:
                if not marked(row, stem):
                    table.complain(row, stem, f"? too: other weights of plane {plane!r} have it")
            weights = total[runs.index(run_of[row])].copy()
            weights[p] *= "angle" not in stems
            first = alike.setdefault(tuple(weights.tolist()), run_of[row])
            if first != run_of[row]:
                words = (
                    f"one run of an unknown weight in plane {plane!r}, which stood in {first!r}: two are not "
                    "determined; the same one read again is a repeat of that run, and of one that was moved "
                    "angles count from its first place"
                )
                table.problems.add(words, table.grid.source, table.rows[row], stems[-1], "?")
        size = next(filter(None, total[:, p].tolist()), 1.0)
        sizes[plane] = np.nan if "mass" in stems else abs(size) * unit.scale
        turn = size / abs(size) if turned and "angle" not in stems else 1.0
        multiples[:, p] /= turn * (unit.to_si(1.0) if "mass" in stems else abs(size))
    return multiples, Relative(turned, sizes, unit.name)
