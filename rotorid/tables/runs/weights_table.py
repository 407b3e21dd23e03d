"""Weights tables: what was mounted in which plane during which run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import ComplexArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.tables.reader import units
from rotorid.tables.reader.columns import Column, Source, read_table
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import Unit, one_of
from rotorid.tables.runs.stated_conventions import FULL_TURN, Conventions

COLUMNS = (
    Column("run"),
    Column("plane"),
    Column(
        "mass", one_of(units.MASS), ("mass_g", "mass_kg", "mass_mg", "mass_oz", "mass_lb"), required=False
    ),
    Column("unbalance", one_of(units.UNBALANCE), ("unbalance_g_mm", "unbalance_oz_in"), required=False),
    Column("angle", one_of(units.ANGLE), ("angle_deg",)),
)


@dataclass(frozen=True, eq=False)
class Weights:
    """Complex weights of each run and plane, kg or kg·m, shape (R, P)."""

    planes: tuple[str, ...]
    weights: ComplexArray
    unit: Unit


def read_weights(
    source: Source, runs: tuple[str, ...] | None, conventions: Conventions, problems: Problems
) -> Weights | None:
    """Read a weights table, or None and problems.

    Parameters
    ----------
    source
        A file, or the cells of a sheet.
    runs
        Names of the runs; None if they could not be read, so that nothing is said about them.
    conventions
        What angles mean.
    problems
        Collects the complaints.
    """
    table = read_table(source, "weights", COLUMNS, problems, may_be_empty=True)
    if table is None:
        return None
    missing = "one column of weights, mass_<unit> or unbalance_<unit>, such as mass_g or unbalance_g_mm"
    several = "one column of weights, mass_<unit> or unbalance_<unit>, not both"
    what = table.only(("mass", "unbalance"), "mass_g", missing, several)
    if what is None:
        return None
    size, angle = table.numbers(what), table.numbers("angle")
    table.must_be(
        what,
        size > 0,
        "a weight above 0 (a run without weights has no row here; what was removed is a weight 180° away)",
    )
    table.must_be("angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees")
    run, plane = table.texts("run"), table.texts("plane")
    planes = tuple(dict.fromkeys(name for name in plane if name))
    values = conventions.labels.weight_from(size, angle)
    run_at = {name: r for r, name in enumerate(runs or ())}
    plane_at = {name: p for p, name in enumerate(planes)}
    total = np.zeros((len(runs or ()), len(planes)), dtype=complex)
    seen: dict[tuple[str, str, complex], int] = {}
    for i in range(len(table)):
        if runs is not None and run[i] and run[i] not in run_at:
            expected = (
                f"a run of the runs table{did_you_mean(run[i], runs)}; its runs are {listing(runs, 'and')}"
            )
            table.complain(i, "run", expected)
            continue
        if not (run[i] and plane[i] and size[i] > 0 and np.isfinite(angle[i])):
            continue
        key = (run[i], plane[i], complex(values[i]))
        if key in seen:
            expected = f"each weight once (row {table.rows[seen[key]]} says the same)"
            table.complain(i, "run", expected)
            continue
        seen[key] = i
        if runs is not None:
            total[run_at[run[i]], plane_at[plane[i]]] += values[i]
    return Weights(planes, total, table.unit(what))
