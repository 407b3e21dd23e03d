"""Unbalance tables and bow tables: what is mounted where on a rotor model, and how its shaft is bent."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.complex_numbers import polar
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.conventions import FULL_TURN
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


def node_at(table: Table, stem: str, index: int, rotor: Rotor | SmallModel) -> int | None:
    """The node in a cell, by number or by the name of a station; None where it is none, which is noted."""
    from rotorid.files.forces import node_number

    if not (name := table.texts(stem)[index]):
        return None
    nodes: Collection[int] = range(1, rotor.n_nodes + 1) if isinstance(rotor, Rotor) else rotor.nodes
    try:
        return node_number(name, nodes, getattr(rotor, "stations", {}))
    except ValueError as error:
        table.complain(index, stem, str(error))
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
    table = problems.need(read_table(path, "unbalance", COLUMNS, problems))
    missing = "one column plane or node, not both: a node or a station"
    where = table.only(("plane", "node"), "plane", missing)
    sizes = {"unbalance", "mass", "radius"}
    present = sizes & set(table.fields)
    if present not in ({"unbalance"}, {"mass", "radius"}) and table.misspelt.isdisjoint(sizes):
        expected = "either a column unbalance_<unit>, or both mass_<unit> and radius_<unit>"
        table.in_header("unbalance_g_mm", expected)
    for stem in present:
        table.must_be(stem, table.numbers(stem) > 0, "a number above 0")
    mass, radius = table.numbers("mass"), table.numbers("radius")
    size = table.numbers("unbalance") if "unbalance" in present else mass * radius
    nodes, vectors = _vectors(table, where, size, rotor)
    problems.stop()
    total: dict[int, complex] = {}
    for node, value in zip(nodes, vectors, strict=True):
        total[node] = total.get(node, 0j) + complex(value)
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
    nodes, vectors = _vectors(table, "node", size, rotor)
    table.once(
        "node", [node or None for node in nodes], "a node that stands in no other row (it stands in row {})"
    )
    if len(nodes) < 3:
        table.as_whole("node", "three nodes or more: any two lie on a straight line")
    problems.stop()
    return dict(zip(nodes, vectors.tolist(), strict=True))


def _vectors(
    table: Table, where: str | None, size: FloatArray, rotor: Rotor | SmallModel
) -> tuple[Sequence[int], ComplexArray]:
    """Nodes of the rows, and sizes with their angles; problems are noted."""
    angle = table.numbers("angle")
    table.must_be("angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees")
    rows = range(len(table)) if where else ()
    return [node_at(table, where or "", index, rotor) or 0 for index in rows], polar(size, angle)
