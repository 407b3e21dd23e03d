"""Unbalance tables: what is mounted where on a rotor model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.complex_numbers import polar
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.conventions import FULL_TURN
from rotorid.files.problems import Problems
from rotorid.files.units import one_of
from rotorid.reduction import SmallModel

COLUMNS = (
    Column("plane", required=False),
    Column("node", required=False),
    Column("mass", one_of(units.MASS), ("mass_g", "mass_kg", "mass_oz"), required=False),
    Column("radius", one_of(units.LENGTH), ("radius_mm", "radius_m", "radius_in"), required=False),
    Column("unbalance", one_of(units.UNBALANCE), ("unbalance_g_mm", "unbalance_kg_m"), required=False),
    Column("angle", one_of(units.ANGLE), ("angle_deg",)),
)


def node_at(table: Table, stem: str, index: int, rotor: Rotor | SmallModel) -> int | None:
    """The node in a cell, by number or by the name of a station; None where it is none, which is noted."""
    name = table.texts(stem)[index]
    if not name:
        return None
    try:
        return rotor.node(name)
    except ValueError:
        if isinstance(rotor, Rotor):
            expected = f"a node from 1 to {rotor.n_nodes} or a station{did_you_mean(name, rotor.stations)}"
        else:
            expected = f"one of the nodes {listing(map(str, rotor.nodes))}"
        table.complain(index, stem, expected)
        return None


def read_unbalance(path: str | Path, rotor: Rotor | SmallModel) -> dict[int, complex]:
    """Read an unbalance table.

    Its columns are `plane` or `node`; `unbalance_<unit>`, or both `mass_<unit>` and `radius_<unit>`; and
    `angle_deg`, with the rotation.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `unbalance`, or else the first one.
    rotor
        Knows the nodes and the names of stations that a plane may be; or a small model.

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
    table = problems.need(read_table(path, "unbalance", COLUMNS, problems, first=True))
    missing, several = "one column plane or node: a node or a station", "one column plane or node, not both"
    where = table.only(("plane", "node"), "plane", missing, several)
    sizes = {"mass", "radius", "unbalance"}
    ways = sizes & set(table.fields)
    if ways not in ({"unbalance"}, {"mass", "radius"}) and table.misspelt.isdisjoint(sizes):
        expected = "either a column unbalance_<unit>, or both mass_<unit> and radius_<unit>"
        table.in_header("unbalance_g_mm", expected)
    for stem in ways:
        table.must_be(stem, table.numbers(stem) > 0, "a number above 0")
    angle = table.numbers("angle")
    table.must_be("angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees")
    nodes = [node_at(table, where, index, rotor) or 0 for index in range(len(table))] if where else []
    problems.stop()
    mass, radius = table.numbers("mass"), table.numbers("radius")
    size = table.numbers("unbalance") if "unbalance" in ways else mass * radius
    total: dict[int, complex] = {}
    for node, value in zip(nodes, polar(size, angle), strict=True):
        total[node] = total.get(node, 0j) + complex(value)
    return total
