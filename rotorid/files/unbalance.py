"""Unbalance tables and bow tables: what is mounted where on a rotor model, and how its shaft is bent."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.arrays import FloatArray, polar
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.conventions import FULL_TURN
from rotorid.files.forces import nodes_in
from rotorid.files.problems import Problems
from rotorid.files.units import one_of
from rotorid.reduction import SmallModel

_ANGLE = Column("angle", one_of(units.ANGLE), ("angle_deg",))
COLUMNS = (
    Column("plane", required=False),
    Column("node", required=False),
    Column("mass", one_of(units.MASS), ("mass_g", "mass_kg", "mass_oz"), required=False),
    Column("radius", one_of(units.LENGTH), ("radius_mm", "radius_m", "radius_in"), required=False),
    Column("unbalance", one_of(units.UNBALANCE), ("unbalance_g_mm", "unbalance_kg_m"), required=False),
    _ANGLE,
)
BOW_COLUMNS = (Column("node"), Column("bow", one_of(units.LENGTH), ("bow_um", "bow_mm", "bow_mil")), _ANGLE)


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
    table = problems.need(read_table(path, "unbalance", COLUMNS, problems))
    where = table.only(("plane", "node"), "plane", "one column plane or node, not both: a node or a station")
    sizes = {"unbalance", "mass", "radius"}
    present = sizes & {*table.fields}
    if present not in ({"unbalance"}, {"mass", "radius"}) and table.misspelt.isdisjoint(sizes):
        expected = "either a column unbalance_<unit>, or both mass_<unit> and radius_<unit>"
        table.in_header("unbalance_g_mm", expected)
    for stem in present:
        table.must_be(stem, table.numbers(stem) > 0, "a number above 0")
    product = table.numbers("mass") * table.numbers("radius")
    size = table.numbers("unbalance") if "unbalance" in present else product
    total: dict[int, complex] = {}
    for node, value in _vectors(table, problems.need(where), size, rotor):
        total[node] = total.get(node, 0j) + value
    return total


def read_bow(path: str | Path, rotor: Rotor | SmallModel) -> dict[int, complex]:
    """Read a bow table with the columns `node`, `bow_<unit>` and `angle_deg`, with the rotation.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `bow`, or else the first one.
    rotor
        Knows the nodes and the names of stations; or a small model.

    Returns
    -------
    dict
        Complex deviation from a straight line by node, m; other nodes follow without a force.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    problems = Problems()
    table = problems.need(read_table(path, "bow", BOW_COLUMNS, problems))
    size = table.numbers("bow")
    table.must_be("bow", size >= 0, "a number not below 0")
    if len(table) < 3:
        table.as_whole("node", "three nodes or more: any two lie on a straight line")
    pairs = _vectors(table, "node", size, rotor)
    table.once(
        "node", [node for node, _ in pairs], "a node that stands in no other row (it stands in row {})"
    )
    problems.stop()
    return dict(pairs)


def _vectors(
    table: Table, where: str, size: FloatArray, rotor: Rotor | SmallModel
) -> list[tuple[int, complex]]:
    """Nodes of the rows, and sizes with their angles; raises all problems."""
    angle = table.numbers("angle")
    table.must_be("angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees")
    nodes = nodes_in(table, where, rotor)
    table.problems.stop()
    return list(zip(map(int, nodes), polar(size, angle).tolist(), strict=True))
