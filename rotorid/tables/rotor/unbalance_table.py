"""Unbalance tables: what is mounted where on a rotor model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from balancing.data.conventions import polar
from fem.model.rotor import Rotor
from rotorid.base.suggestions import did_you_mean
from rotorid.tables.reader import units
from rotorid.tables.reader.columns import Column, must_be, nearest, read_table
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import one_of
from rotorid.tables.runs.stated_conventions import FULL_TURN

COLUMNS = (
    Column("plane", required=False),
    Column("node", required=False),
    Column("mass", one_of(units.MASS), ("mass_g", "mass_kg", "mass_oz"), required=False),
    Column("radius", one_of(units.LENGTH), ("radius_mm", "radius_m", "radius_in"), required=False),
    Column("unbalance", one_of(units.UNBALANCE), ("unbalance_g_mm", "unbalance_kg_m"), required=False),
    Column("angle", one_of(units.ANGLE), ("angle_deg",)),
)


def read_unbalance(path: str | Path, rotor: Rotor) -> dict[int, complex]:
    """Read an unbalance table.

    Its columns are `plane` or `node`; `unbalance_<unit>`, or both `mass_<unit>` and `radius_<unit>`; and
    `angle_deg`, with the rotation.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `unbalance`, or else the first one.
    rotor
        Knows the nodes and the names of stations that a plane may be.

    Returns
    -------
    dict
        Complex unbalance m r e^{iφ} of each node, kg·m; several rows of one node are added.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    problems = Problems()
    table = read_table(path, "unbalance", COLUMNS, problems, first=True)
    if table is None:
        problems.stop()
        raise AssertionError("no table and no problem")
    # A misspelt column has been reported, with a suggestion: that is enough.
    near = {(nearest(str(p.column), COLUMNS) or "").split("_")[0] for p in problems.of(table.source)}
    where = [stem for stem in ("plane", "node") if stem in table]
    if len(where) != 1 and not near & {"plane", "node"}:
        expected = "one column plane or node" + (", not both" if where else ": a node or a station")
        problems.add(table.source, table.header_row, where[-1] if where else "plane", None, expected)
    ways = {"mass", "radius", "unbalance"} & set(table.fields)
    if ways not in ({"unbalance"}, {"mass", "radius"}) and not near & {"mass", "radius", "unbalance"}:
        problems.add(
            table.source,
            table.header_row,
            "unbalance_g_mm",
            None,
            "either a column unbalance_<unit>, or both mass_<unit> and radius_<unit>",
        )
    for stem in ways:
        must_be(table, stem, table.numbers(stem) > 0, "a number above 0", problems)
    angle = table.numbers("angle")
    must_be(table, "angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees", problems)
    nodes = []
    for index, name in enumerate(table.texts(where[0]) if where else ()):
        try:
            nodes.append(rotor.node(name) if name else 0)
        except ValueError:
            expected = f"a node from 1 to {rotor.n_nodes} or a station{did_you_mean(name, rotor.stations)}"
            table.complain(problems, index, where[0], expected)
    problems.stop()
    mass, radius = table.numbers("mass"), table.numbers("radius")
    size = table.numbers("unbalance") if "unbalance" in ways else mass * radius
    total: dict[int, complex] = {}
    for node, value in zip(nodes, polar(size, angle), strict=True):
        total[node] = total.get(node, 0j) + complex(value)
    return total
