"""Tables whose rows stand at nodes: unbalance, bow, natural frequencies with mode shapes, compliances."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.arrays import FloatArray, polar
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.input_problems import Problems
from rotorid.files.units import Unit, one_of, ratio
from rotorid.reduction import SmallModel

Node = int | str
"""The number of a node; without a rotor also any label."""
RECIPROCAL = 1e-3
"""So far, relative, the two entries of a pair of nodes may differ: rounding, not a contradiction."""
_SPEED = one_of(units.SPEED)
_PERCENT = one_of({"percent": Unit("percent", "ratio", 1.0, 100.0)})

_ANGLE = Column("angle", one_of(units.ANGLE), ("angle_deg",))

UNBALANCE_COLUMNS = (
    Column("plane"),
    Column("mass", one_of(units.MASS), ("mass_g", "mass_kg", "mass_oz"), required=False),
    Column("radius", one_of(units.LENGTH), ("radius_mm", "radius_m", "radius_in"), required=False),
    Column("unbalance", one_of(units.UNBALANCE), ("unbalance_g_mm", "unbalance_kg_m"), required=False),
    _ANGLE,
)
BOW_COLUMNS = (Column("node"), Column("bow", one_of(units.LENGTH), ("bow_um", "bow_mm", "bow_mil")), _ANGLE)
MODE_COLUMNS = (
    Column("mode", ratio),
    Column("frequency", _SPEED, ("frequency_rad_s", "frequency_Hz"), required=False, blank=True),
    Column("critical_speed", _SPEED, ("critical_speed_rpm",), required=False, blank=True),
    Column("node"),
    Column("shape", ratio),
    *(
        Column(stem, _PERCENT, (f"{stem}_percent",), required=False, blank=stem != "shape_std")
        for stem in ("frequency_std", "shape_std", "damping", "damping_std")
    ),
)
COMPLIANCE_COLUMNS = (
    Column("node"),
    Column("force_node"),
    Column("compliance", one_of(units.COMPLIANCE), ("compliance_m_per_N", "compliance_um_per_N")),
)


def read_unbalance(path: str | Path, rotor: Rotor | SmallModel) -> dict[int, complex]:
    """Read an unbalance table.

    Its columns are `plane` (a node or a station), `unbalance_<unit>`, or both `mass_<unit>` and
    `radius_<unit>`; and `angle_deg`, with the rotation.

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
    table = read_table(path, "unbalance", UNBALANCE_COLUMNS, Problems())
    sizes = {"unbalance", "mass", "radius"}
    present = sizes & {*table.fields}
    if present not in ({"unbalance"}, {"mass", "radius"}) and table.misspelt.isdisjoint(sizes):
        expected = "either a column unbalance_<unit>, or both mass_<unit> and radius_<unit>"
        table.in_header("unbalance_g_mm", expected)
    total: dict[int, complex] = {}
    for node, value in _vectors(table, "plane", present, rotor):
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
    table = read_table(path, "bow", BOW_COLUMNS, problems)
    if len(table) < 3:
        table.as_whole("node", "three nodes or more: any two lie on a straight line")
    pairs = _vectors(table, "node", {"bow"}, rotor)
    table.once("node", (node for node, _ in pairs), "a node that stands in no other row, as in row {}")
    problems.stop()
    return dict(pairs)


def _vectors(
    table: Table, where: str, sizes: Set[str], rotor: Rotor | SmallModel
) -> list[tuple[int, complex]]:
    """Nodes of the rows, and products of sizes with their angles; raises all problems."""
    for stem in sizes:
        table.complain_where(table.numbers(stem) < 0, stem, "a number of 0 or more")
    nodes, size = _nodes(table, where, rotor), np.prod([table.numbers(stem) for stem in sizes], axis=0)
    table.problems.stop()
    return list(zip(map(int, nodes), polar(size, table.numbers("angle")).tolist(), strict=True))


def _nodes(table: Table, stem: str, rotor: Rotor | SmallModel | None) -> list[Node]:
    """Nodes in cells; without a rotor labels too, "" where there is a problem."""
    nodes = []
    for row, name in enumerate(table.texts(stem)):
        try:
            if not (rotor and name):
                nodes.append(int(name) if name.isascii() and name.isdecimal() else name)
            else:
                nodes.append(rotor.node(name))
        except ValueError as error:
            table.complain(row, stem, f"a node of the rotor: {error}")
            nodes.append("")
    return nodes


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """Natural frequencies and mode shapes, as measured or as printed.

    Attributes
    ----------
    nodes
        Where the shapes were read, in the order of the table, length n: numbers of nodes, or labels.
    frequencies
        rad/s, ascending, shape (k,).
    shapes
        Relative amplitudes with their signs, a column per mode, shape (n, k); any scale of each mode.
    frequency_std, shape_std
        Relative standard deviations (0.013 = 1.3 %), shapes (k,) and (n, k); None where none are stated.
    critical
        They are critical speeds, and what moves then, not of the rotor at rest.
    """

    nodes: tuple[Node, ...]
    frequencies: FloatArray
    shapes: FloatArray
    frequency_std: FloatArray | None = None
    shape_std: FloatArray | None = None
    critical: bool = False


def read_modes(path: str | Path, rotor: Rotor | None = None) -> MeasuredModes:
    """Read a table of natural frequencies and mode shapes, a row per mode and node.

    Its columns are `mode` (1, 2, … from the lowest frequency, without a gap), `frequency_rad_s` (or `_Hz`,
    `_rpm`; or `critical_speed_rpm` of modes that were read there, not at rest; it may be blank after the
    first row of a mode), `node`, `shape` (relative amplitude with its sign) and, optionally,
    `frequency_std_percent` and `shape_std_percent`, one standard deviation; `damping_percent` and
    `damping_std_percent` may stand beside them and are not used. Every mode has the same nodes, each once.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `modes`, or else the first one.
    rotor
        Knows the nodes, and the names of stations that a node may be. Without it every name is a label.

    Raises
    ------
    InputError
        With all problems of the cells, or else with all contradictions between them.
    """
    problems = Problems()
    table = read_table(path, "modes", MODE_COLUMNS, problems)
    expected = "one column frequency_rad_s (or _Hz, _rpm) or critical_speed_rpm"
    stem = table.only(("frequency", "critical_speed"), "frequency_rad_s", expected)
    nodes, number, values = _nodes(table, "node", rotor), table.numbers("mode"), table.numbers(stem)
    table.complain_where((number < 1) | (number % 1 > 0), "mode", "a mode number: 1, 2, …")
    table.complain_where(values <= 0, stem, "a frequency above 0")
    for name in ("frequency_std", "shape_std"):
        table.complain_where(table.numbers(name) < 0, name, "a standard deviation of 0 or more")
    problems.stop()
    modes, heads, of = np.unique(number, return_index=True, return_inverse=True)
    first = heads[of] == np.arange(len(table))
    table.complain_where(first & (number != 1 + of), "mode", "modes numbered from 1 without a gap")
    for name in {stem, "frequency_std"} & {*table.fields}:
        cells = table.numbers(name)
        table.complain_where(first & np.isnan(cells), name, "a number in the first row of a mode")
        other = abs(cells - cells[heads][of]) > 1e-9 * cells
        table.complain_where(other, name, "what stands in the first row of the mode, or a blank")
    falling = first & (np.diff(values[heads], prepend=0.0) <= 0)[of]
    expected = "a frequency above that of the mode before: modes are numbered from the lowest"
    table.complain_where(falling, stem, expected)
    table.once(
        "node", zip(of.tolist(), nodes, strict=True), "another node than in row {}: each once in a mode"
    )
    distinct = tuple(dict.fromkeys(nodes))
    at = [distinct.index(node) for node in nodes]

    def by_node(name: str) -> FloatArray:
        array = np.full((len(distinct), len(modes)), np.nan)
        array[at, of] = table.numbers(name)
        return array

    shapes = by_node("shape")
    for lost, head in zip(np.isnan(shapes).T, heads, strict=True):
        if lost.any():
            names = listing((str(distinct[k]) for k in np.flatnonzero(lost)), "and")
            table.complain(head, "mode", f"the same nodes in every mode; it lacks {names}")
    still = first & ~shapes[:, of].any(axis=0)
    table.complain_where(still, "shape", "a shape that is not 0 at every node of its mode")
    problems.stop()
    return MeasuredModes(
        nodes=distinct,
        frequencies=values[heads],
        shapes=shapes,
        frequency_std=table.numbers("frequency_std")[heads] if "frequency_std" in table else None,
        shape_std=by_node("shape_std") if "shape_std" in table else None,
        critical=stem == "critical_speed",
    )


def read_compliance(
    path: str | Path, nodes: Sequence[Node] | None = None
) -> tuple[tuple[Node, ...], FloatArray]:
    """Read a table of compliances: deflection at `node` under unit force at `force_node`.

    The third column is `compliance_m_per_N` (or `_mm_per_N`, `_um_per_N`). Of the two entries of a pair of
    nodes one is enough; where both are given they must agree to 0.1 %, and their mean counts.

    Parameters
    ----------
    path
        The file; in a workbook the sheet `compliance`, or else the first one.
    nodes
        The nodes wanted, in this order; by default those of the table as they come.

    Returns
    -------
    The nodes, length n, and the compliances in their order, m/N, symmetric and positive definite, (n, n).

    Raises
    ------
    InputError
        With all problems of the cells, or else with all contradictions between them.
    """
    problems = Problems()
    table = read_table(path, "compliance", COMPLIANCE_COLUMNS, problems)
    ends = {stem: _nodes(table, stem, None) for stem in ("node", "force_node")}
    problems.stop()
    order = tuple(dict.fromkeys([*ends["node"], *ends["force_node"]] if nodes is None else nodes))
    for stem, named in ends.items():
        strange = np.array([node not in order for node in named])
        table.complain_where(strange, stem, f"one of the nodes {listing(map(str, order))}")
    problems.stop()
    values, (p, q) = table.numbers("compliance"), ([*map(order.index, named)] for named in ends.values())
    table.once("force_node", zip(p, q, strict=True), "another pair of nodes than in row {}")
    expected = "a number above 0: a node moves in the direction of a force on it"
    table.complain_where((values <= 0) & (np.array(p) == q), "compliance", expected)
    problems.stop()
    one = np.full((len(order), len(order)), np.nan)
    one[p, q] = values
    one, other = np.where(np.isnan(one), one.T, one), np.where(np.isnan(one.T), one, one.T)
    differs = abs(one - other) > RECIPROCAL * np.maximum(abs(one), abs(other))
    expected = (
        f"that of the same nodes exchanged to {100 * RECIPROCAL:g} %: a force at one of them moves the other "
        "as much as the other way round"
    )
    table.complain_where(differs[p, q], "compliance", expected)
    alpha = (one + other) / 2
    if lost := [f"{order[i]} with {order[j]}" for i, j in np.argwhere(np.triu(np.isnan(alpha)))]:
        table.as_whole("compliance", f"a row for every pair of nodes; missing: {listing(lost, 'and')}")
    problems.stop()
    scale = np.sqrt(np.diag(alpha))
    lowest = np.linalg.eigvalsh(alpha / np.outer(scale, scale))[0]
    if lowest <= len(order) * np.finfo(float).eps:
        expected = (
            "compliances that are a positive definite matrix, as those of every shaft on springs are: the "
            f"smallest eigenvalue of α_ij / √(α_ii α_jj) is {lowest:.2g}. Check them, give more digits, or "
            "nodes farther apart"
        )
        table.as_whole("compliance", expected)
    problems.stop()
    return order, alpha
