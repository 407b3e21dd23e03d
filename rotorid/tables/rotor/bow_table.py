"""Bow tables: how far a shaft at rest deviates from a straight line."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.complex_numbers import polar
from rotorid.files import units
from rotorid.files.columns import Column, read_table
from rotorid.files.conventions import FULL_TURN
from rotorid.files.problems import Problems
from rotorid.files.units import one_of
from rotorid.reduction import SmallModel
from rotorid.tables.rotor.unbalance_table import node_at

COLUMNS = (
    Column("node"),
    Column("bow", one_of(units.LENGTH), ("bow_um", "bow_mm", "bow_mil")),
    Column("angle", one_of(units.ANGLE), ("angle_deg",)),
)


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
    table = problems.need(read_table(path, "bow", COLUMNS, problems, first=True))
    size, angle = table.numbers("bow"), table.numbers("angle")
    table.must_be("bow", size >= 0, "a number not below 0")
    table.must_be("angle", np.abs(angle) <= FULL_TURN, "an angle from -360 to 360 degrees")
    bow: dict[int, complex] = {}
    for index, value in enumerate(polar(size, angle)):
        node = node_at(table, "node", index, rotor)
        if node in bow:
            table.complain(index, "node", "a node that stands in no other row")
        elif node is not None:
            bow[node] = complex(value)
    problems.stop()
    if len(bow) < 3:
        table.as_whole("node", "three nodes or more: any two lie on a straight line")
        problems.stop()
    return bow
