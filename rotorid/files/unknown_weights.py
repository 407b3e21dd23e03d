"""Trial weights whose mass or place nobody knows: `?` in a weights table.

`?` is one weight at one place of its plane: `2x?` is twice as heavy, `?+90` stands 90° further as the job
counts angles, `?+0` at the same place in another run. The numbers `1` and `0` stand in for it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from balancing import Relative, Trials
from rotorid.base.arrays import ComplexArray
from rotorid.files.cells import Cell, Grid, show
from rotorid.files.columns import Table
from rotorid.files.headings import WEIGHT, read_headings
from rotorid.files.job_models import JobSettings
from rotorid.files.problems import Problems

_MARK = {
    "mass": re.compile(r"(?:([0-9][0-9.,]*)\s*[x×*]\s*)?\?"),
    "angle": re.compile(r"\?\s*([+-]\s*[0-9][0-9.,]*)?"),
}


class Mark(NamedTuple):
    """What is unknown of a weight, and whether it is said how it follows from others."""

    stem: str
    follows: bool


class Marks(dict[tuple[int, str], list[Mark]]):
    """By row of the file and plane, which is empty where a column has it."""


def without_marks(grid: Grid, marks: Marks) -> Grid:
    """The weights table with numbers in place of `?`, which are noted."""
    columns = [h for h in read_headings(grid.header, weights=True) if h.stem in WEIGHT]
    rows = []
    for number, cells in grid.rows:
        new = list[Cell](cells)
        for heading in columns:
            match = _MARK[heading.stem].fullmatch(show(cells[heading.index]))
            if match is not None:
                marks.setdefault((number, heading.sensor), []).append(Mark(heading.stem, bool(match[1])))
                new[heading.index] = (match[1] or "01"[heading.stem == "mass"]).replace(" ", "")
        rows.append((number, tuple(new)))
    return replace(grid, rows=tuple(rows)) if marks else grid


def relative_weights(
    table: Table, marks: Marks, runs_of: Sequence[str], runs: Sequence[str], total: ComplexArray
) -> tuple[ComplexArray, Relative]:
    """Weights (R, P) as multiples of the trial weight of their plane; problems where these are none.

    `runs_of` are the runs of the rows of the table, `runs` those of the weights.
    """
    plane_of, unit = table.texts("plane"), table.unit("mass")
    planes, sizes = [*dict.fromkeys(plane_of)], dict[str, float]()
    each = [
        marks.get((n, plane), marks.get((n, ""), [])) for n, plane in zip(table.rows, plane_of, strict=True)
    ]
    unknown = [{mark.stem for mark in one} for one in each]
    anywhere = any("angle" in one for one in unknown)
    for p, plane in enumerate(planes):
        rows = [k for k, name in enumerate(plane_of) if name == plane]
        of_plane = set().union(*(unknown[k] for k in rows))
        for row, stem in ((k, stem) for k in rows for stem in of_plane - unknown[k]):
            table.complain(row, stem, f"? too, since the other weights of plane {plane!r} have it")
        plain = {runs_of[k]: k for k in rows if each[k] and not any(mark.follows for mark in each[k])}
        for a, b in combinations(plain, 2):
            one, two = (np.delete(total[runs.index(run)], p if "angle" in of_plane else []) for run in (a, b))
            if (one == two).all():
                words = (
                    f"one weight of unknown mass or place in plane {plane!r}, as in run {a!r}: two are not "
                )
                words += (
                    "determined; the same one moved by 90° is ?+90 (stays there: ?+0), twice as heavy 2x?"
                )
                where = table.grid.source, table.rows[plain[b]]
                table.problems.add(words, *where, "angle" if "angle" in of_plane else "mass", "?")
        first = next(filter(None, total[:, p].tolist()), 1.0)
        sizes[plane] = np.nan if "mass" in of_plane else abs(first) * unit.scale
        scale = unit.to_si(1.0) if "mass" in of_plane else abs(first)
        turn = first / abs(first) if anywhere and "angle" not in of_plane else 1.0
        total[:, p] /= scale * turn
    return total, Relative(anywhere, sizes, unit.name)


def refuse(settings: JobSettings, trials: Trials, tables: Collection[str], problems: Problems) -> None:
    """Note what a job states that multiples of a trial weight, or a turned rotor, cannot keep to."""
    if "check" in tables:
        words = "no check run beside unknown trial weights or an index: it is one more run of the runs table"
        settings.complain(problems, "check", f"{words}, with what was mounted")
    for plane in settings.planes.values() if trials.relative else ():
        for field in ("max_weight", "forbidden"):
            if getattr(plane, field):
                plane.complain(problems, field, "no limits of unknown weights: give masses and angles, not ?")
