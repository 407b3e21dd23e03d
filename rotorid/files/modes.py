"""Tables of natural frequencies with mode shapes, and of compliances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, read_table
from rotorid.files.forces import nodes_in
from rotorid.files.problems import Problems
from rotorid.files.units import Unit, one_of, ratio

Node = int | str
"""The number of a node; without a rotor also any label."""

COMPLIANCE = {
    name: Unit(name, "compliance", 1.0, divide)
    for name, divide in (("m_per_N", 1.0), ("mm_per_N", 1e3), ("um_per_N", 1e6))
}
RECIPROCAL = 1e-3
"""So far, relative, the two entries of a pair of nodes may differ: rounding, not a contradiction."""
FREQUENCIES = ("frequency", "speed", "critical_speed")
_SPEED = one_of(units.SPEED)
_PERCENT = one_of({"percent": Unit("percent", "ratio", 1.0, 100.0)})

MODE_COLUMNS = (
    Column("mode", ratio),
    Column(
        "frequency", _SPEED, ("frequency_rad_s", "frequency_Hz", "frequency_rpm"), required=False, blank=True
    ),
    Column("speed", _SPEED, ("speed_rpm",), required=False, blank=True),
    Column("critical_speed", _SPEED, ("critical_speed_rpm",), required=False, blank=True),
    Column("node"),
    Column("shape", ratio),
    Column("frequency_std", _PERCENT, ("frequency_std_percent",), required=False, blank=True),
    Column("shape_std", _PERCENT, ("shape_std_percent",), required=False),
    Column("damping", _PERCENT, ("damping_percent",), required=False, blank=True),
    Column("damping_std", _PERCENT, ("damping_std_percent",), required=False, blank=True),
)
COMPLIANCE_COLUMNS = (
    Column("node"),
    Column("force_node"),
    Column("compliance", one_of(COMPLIANCE), ("compliance_m_per_N", "compliance_um_per_N")),
)


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
    `_rpm`, or `speed_rpm`; or `critical_speed_rpm` of modes that were read there, not at rest; it may be
    blank after the first row of a mode), `node`, `shape` (relative amplitude with its sign) and, optionally,
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
    table = problems.need(read_table(path, "modes", MODE_COLUMNS, problems))
    expected = "one column frequency_rad_s, frequency_Hz, frequency_rpm, speed_rpm or critical_speed_rpm"
    stem = problems.need(table.only(FREQUENCIES, "frequency_rad_s", expected))
    nodes, number, values = nodes_in(table, "node", rotor), table.numbers("mode"), table.numbers(stem)
    table.must_be("mode", (number >= 1) & (number == np.floor(number)), "a mode number: 1, 2, …")
    table.must_be(stem, values > 0, "a frequency above 0")
    for name in ("frequency_std", "shape_std"):
        table.must_be(name, table.numbers(name) >= 0, "a standard deviation of 0 or more")
    problems.stop()
    modes, heads, of = np.unique(number, return_index=True, return_inverse=True)
    for i in np.flatnonzero(modes != np.arange(1, len(modes) + 1))[:1]:
        table.complain(heads[i], "mode", f"modes numbered from 1 without a gap; there is no mode {i + 1}")
    for name in {stem, "frequency_std"} & {*table.fields}:
        first = table.numbers(name)[heads][of]
        for head in heads[table.is_blank(name)[heads]]:
            table.complain(head, name, f"a number in the first row of mode {number[head]:g}")
        for row in np.flatnonzero(np.abs(table.numbers(name) - first) > 1e-9 * first):
            head = heads[of[row]]
            expected = f"{table.shown(name, head)} as in row {table.rows[head]}, the same mode, or a blank"
            table.complain(row, name, expected)
    for low in np.flatnonzero(np.diff(values[heads]) <= 0):
        below = f"{table.shown(stem, heads[low])} in row {table.rows[heads[low]]}"
        words = f"a frequency above that of the mode before ({below}): modes are numbered from the lowest"
        table.complain(heads[low + 1], stem, words)
    stands = list(zip(of.tolist(), nodes, strict=True))
    table.once("node", stands, "another node than in row {}: each stands once in a mode")
    distinct, place = tuple(dict.fromkeys(nodes)), {stand: row for row, stand in enumerate(stands)}
    for mode in range(len(modes)):
        if lost := [str(node) for node in distinct if (mode, node) not in place]:
            expected = f"mode {mode + 1} at node {listing(lost, 'and')} too: every mode needs the same nodes"
            problems.add(table.source, table.rows[np.flatnonzero(of == mode)[-1]], "node", None, expected)
    problems.stop()
    index = np.array([[place[mode, node] for mode in range(len(modes))] for node in distinct])
    shapes = table.numbers("shape")[index]
    for head in heads[~shapes.any(axis=0)]:
        table.complain(head, "shape", "a shape that is not 0 at every node of its mode")
    problems.stop()
    return MeasuredModes(
        nodes=distinct,
        frequencies=values[heads],
        shapes=shapes,
        frequency_std=table.numbers("frequency_std")[heads] if "frequency_std" in table else None,
        shape_std=table.numbers("shape_std")[index] if "shape_std" in table else None,
        critical=stem == "critical_speed",
    )


def read_compliance(
    path: str | Path, nodes: Sequence[Node] | None = None, rotor: Rotor | None = None
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
    rotor
        Knows the nodes, and the names of stations that a node may be. Without it every name is a label.

    Returns
    -------
    The nodes, length n, and the compliances in their order, m/N, symmetric and positive definite, (n, n).

    Raises
    ------
    InputError
        With all problems of the cells, or else with all contradictions between them.
    """
    problems = Problems()
    table = problems.need(read_table(path, "compliance", COMPLIANCE_COLUMNS, problems))
    ends = {stem: nodes_in(table, stem, rotor) for stem in ("node", "force_node")}
    problems.stop()
    order = tuple(dict.fromkeys([*ends["node"], *ends["force_node"]] if nodes is None else nodes))
    for stem, named in ends.items():
        strange = np.array([node not in order for node in named])
        table.complain_where(strange, stem, f"one of the nodes {listing(map(str, order))}")
    pairs, values = list(zip(*ends.values(), strict=True)), table.numbers("compliance")
    table.once("force_node", pairs, "another pair of nodes than in row {}")
    moves = [a != b or value > 0 for (a, b), value in zip(pairs, values, strict=True)]
    table.must_be("compliance", moves, "a number above 0: a node moves in the direction of a force on it")
    problems.stop()
    alpha, row_of = np.full((len(order), len(order)), np.nan), {pair: row for row, pair in enumerate(pairs)}
    for row, (a, b) in enumerate(pairs):
        back = row_of.get((b, a), row)
        if back < row and abs(values[row] - values[back]) > RECIPROCAL * max(abs(values[[row, back]])):
            expected = (
                f"{table.shown('compliance', back)} to {100 * RECIPROCAL:g} %, as in row {table.rows[back]}: "
                f"a force at node {a} moves node {b} as much as a force at node {b} moves node {a}"
            )
            table.complain(row, "compliance", expected)
        p, q = order.index(a), order.index(b)
        alpha[p, q] = alpha[q, p] = values[[row, back]].mean()
    lost = [f"{order[p]} with {order[q]}" for p, q in np.argwhere(np.triu(np.isnan(alpha)))]
    name = table.fields["compliance"].name
    if lost:
        table.as_whole(name, f"a row for every pair of nodes; missing: {listing(lost, 'and')}")
    problems.stop()
    scale = np.sqrt(np.diag(alpha))
    lowest = np.linalg.eigvalsh(alpha / np.outer(scale, scale))[0]
    if lowest <= len(order) * np.finfo(float).eps:
        expected = (
            "compliances that are a positive definite matrix, as those of every shaft on springs are: the "
            f"smallest eigenvalue of α_ij / √(α_ii α_jj) is {lowest:.2g}. Check them, give more digits, or "
            "nodes farther apart"
        )
        table.as_whole(name, expected)
    problems.stop()
    return order, alpha
