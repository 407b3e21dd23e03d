"""Tables for a reduction from measurements: natural frequencies with shapes, and compliances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, Table, read_table
from rotorid.files.problems import Problems
from rotorid.files.unbalance import node_at
from rotorid.files.units import Unit, one_of, ratio
from rotorid.tables.data.repeated_readings import FREQUENCIES

Node = int | str
"""The number of a node; without a rotor also any label."""

COMPLIANCE = {
    name: Unit(name, "compliance", 1.0, divide)
    for name, divide in (("m_per_N", 1.0), ("mm_per_N", 1e3), ("um_per_N", 1e6))
}
RECIPROCAL = 1e-3
"""So far, relative, the two entries of a pair of nodes may differ: rounding, not a contradiction."""
LARGEST_PERCENT = 1000.0
_SAME = 1e-9
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
    files
        What was read.
    critical
        They are critical speeds, and what moves then, not of the rotor at rest.
    """

    nodes: tuple[Node, ...]
    frequencies: FloatArray
    shapes: FloatArray
    frequency_std: FloatArray | None = None
    shape_std: FloatArray | None = None
    files: tuple[Path, ...] = ()
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
        With all problems of the file.
    """
    problems = Problems()
    table = problems.need(read_table(path, "modes", MODE_COLUMNS, problems, first=True))
    expected = "one column frequency_rad_s, frequency_Hz, frequency_rpm, speed_rpm or critical_speed_rpm"
    stem = table.only((*FREQUENCIES, "critical_speed"), "frequency_rad_s", expected)
    nodes = [_node(table, "node", i, rotor) for i in range(len(table))]
    number = table.numbers("mode")
    numbered = (number >= 1) & (number == np.floor(number))
    table.must_be("mode", numbered, "a mode number: 1, 2, …")
    for name in ("frequency_std", "shape_std"):
        stated = table.numbers(name)
        fits = (stated >= 0) & (stated <= LARGEST_PERCENT / 100)
        table.must_be(name, fits, f"a standard deviation from 0 to {LARGEST_PERCENT:g} percent")
    rows: dict[int, list[int]] = {}
    for place in np.flatnonzero(numbered).tolist():
        rows.setdefault(int(number[place]), []).append(place)
    complete = table.complete and bool(numbered.all())
    if stem is not None:
        table.must_be(stem, table.numbers(stem) > 0, "a frequency above 0")
        _complain_about_order(table, stem, rows, complete=complete)
        _complain_about_changes(table, stem, "a frequency", rows, complete=complete)
    if "frequency_std" in table:
        _complain_about_changes(table, "frequency_std", "a standard deviation", rows, complete=complete)
    known = _different(nodes)
    places = _places(table, nodes, rows, complete=complete)
    stem = problems.need(stem)
    problems.stop()
    ordered = sorted(rows)
    first = [rows[mode][0] for mode in ordered]
    index = np.array([[places[mode][node] for mode in ordered] for node in known])
    shapes = table.numbers("shape")[index]
    for mode, still, i in zip(ordered, ~shapes.any(axis=0), first, strict=True):
        if still:
            expected = f"a shape that is not 0 at every node, as that of mode {mode} is"
            table.complain(i, "shape", expected)
    problems.stop()
    return MeasuredModes(
        nodes=known,
        frequencies=table.numbers(stem)[first],
        shapes=shapes,
        frequency_std=table.numbers("frequency_std")[first] if "frequency_std" in table else None,
        shape_std=table.numbers("shape_std")[index] if "shape_std" in table else None,
        files=(Path(path),),
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
        With all problems of the file.
    """
    problems = Problems()
    table = problems.need(read_table(path, "compliance", COMPLIANCE_COLUMNS, problems, first=True))
    ends = ("node", "force_node")
    pairs = [tuple(_node(table, stem, i, rotor) for stem in ends) for i in range(len(table))]
    values = table.numbers("compliance")
    own = np.array([a is not None and a == b for a, b in pairs], dtype=bool)
    expected = "a number above 0: a node moves in the direction of a force on it"
    table.must_be("compliance", ~own | (values > 0), expected)
    known = _different(nodes if nodes is not None else [a for a, _ in pairs] + [b for _, b in pairs])
    first: dict[tuple[Node, Node], int] = {}
    for i, (a, b) in enumerate(pairs):
        if a is None or b is None:
            continue
        for stem, node in (("node", a), ("force_node", b)):
            if node not in known:
                table.complain(i, stem, f"one of the nodes {listing(map(str, known))}")
        first.setdefault((a, b), i)
    given = [None if None in pair else pair for pair in pairs]
    table.once("force_node", given, "another pair of nodes than in row {}")
    for (a, b), i in first.items():
        j = first.get((b, a), i)
        if j < i and abs(values[i] - values[j]) > RECIPROCAL * max(abs(values[i]), abs(values[j])):
            expected = (
                f"{table.shown('compliance', j)} to {100 * RECIPROCAL:g} %, as in row {table.rows[j]}: "
                f"a force at node {a} moves node {b} as much as a force at node {b} moves node {a}"
            )
            table.complain(i, "compliance", expected)
    if table.complete:
        _complain_about_missing_pairs(table, known, first)
    problems.stop()
    alpha = np.empty((len(known), len(known)))
    for p, a in enumerate(known):
        for q, b in enumerate(known[: p + 1]):
            both = [values[first[pair]] for pair in ((a, b), (b, a)) if pair in first]
            alpha[p, q] = alpha[q, p] = np.mean(both)
    _complain_about_indefinite(table, known, alpha)
    problems.stop()
    return known, alpha


def _node(table: Table, stem: str, index: int, rotor: Rotor | None) -> Node | None:
    """A node: its number, or a label that is none; None where the cell is no node (and has been reported)."""
    if rotor is not None:
        return node_at(table, stem, index, rotor)
    name = table.texts(stem)[index]
    return int(name) if name.isascii() and name.isdecimal() else name or None


def _different(nodes: Sequence[Node | None]) -> tuple[Node, ...]:
    """Each node once, in the order in which they come."""
    return tuple(dict.fromkeys(node for node in nodes if node is not None))


def _complain_about_order(table: Table, stem: str, rows: dict[int, list[int]], *, complete: bool) -> None:
    """Modes are numbered 1 … k in the order of their frequencies."""
    ordered = sorted(rows)
    lost = [mode for mode in range(1, min(ordered[-1], 1000) + 1) if mode not in rows] if ordered else []
    if lost and complete:
        expected = f"modes numbered from 1 without a gap; there is no mode {listing(map(str, lost))}"
        table.complain(rows[next(mode for mode in ordered if mode > lost[0])][0], "mode", expected)
    omega = table.numbers(stem)
    for low, high in pairwise(ordered):
        i, j = rows[low][0], rows[high][0]
        if omega[j] <= omega[i]:
            expected = (
                f"a frequency above that of mode {low} ({table.shown(stem, i)} in row {table.rows[i]}): "
                "modes are numbered from the lowest frequency"
            )
            table.complain(j, stem, expected)


def _complain_about_changes(
    table: Table, stem: str, what: str, rows: dict[int, list[int]], *, complete: bool
) -> None:
    """What belongs to a mode stands in its first row; further rows repeat it or are blank."""
    values, blank = table.numbers(stem), table.is_blank(stem)
    for mode, (head, *others) in rows.items():
        if blank[head]:
            if complete:
                table.complain(head, stem, f"{what} in the first row of mode {mode}")
            continue
        for i in others:
            if abs(values[i] - values[head]) > _SAME * abs(values[head]):
                shown, row = table.shown(stem, head), table.rows[head]
                table.complain(i, stem, f"{shown} as in row {row}, the same mode, or a blank")


def _places(
    table: Table, nodes: Sequence[Node | None], rows: dict[int, list[int]], *, complete: bool
) -> dict[int, dict[Node, int]]:
    """The row of each node of each mode; complaints about nodes that a mode has twice or not at all."""
    mode_of = {i: mode for mode, members in rows.items() for i in members}
    stands = [
        None if node is None or i not in mode_of else (mode_of[i], node) for i, node in enumerate(nodes)
    ]
    table.once("node", stands, "another node than in row {}: each stands once in a mode")
    place: dict[int, dict[Node, int]] = {mode: {} for mode in rows}
    for i, stand in enumerate(stands):
        if stand is not None:
            place[stand[0]][stand[1]] = i
    if not complete or None in nodes:
        return place
    for mode, mine in place.items():
        lost = [str(node) for node in _different(nodes) if node not in mine]
        if lost:
            expected = f"mode {mode} at node {listing(lost, 'and')} too: every mode needs the same nodes"
            table.problems.add(table.source, table.rows[rows[mode][-1]], "node", None, expected)
    return place


def _complain_about_missing_pairs(
    table: Table, known: tuple[Node, ...], first: dict[tuple[Node, Node], int]
) -> None:
    pairs = [(a, b) for p, a in enumerate(known) for b in known[p:]]
    lost = [f"{a} with {b}" for a, b in pairs if (a, b) not in first and (b, a) not in first]
    if lost and not len(table.problems):
        expected = f"a row for every pair of nodes; missing: {listing(lost, 'and')}"
        table.as_whole(table.fields["compliance"].name, expected)


def _complain_about_indefinite(table: Table, known: tuple[Node, ...], alpha: FloatArray) -> None:
    """Every set of forces works on a shaft on springs: its compliance is positive definite."""
    size = np.sqrt(np.diag(alpha))
    scaled = alpha / np.outer(size, size)
    lowest, vectors = np.linalg.eigh(scaled)
    if lowest[0] > len(known) * np.finfo(float).eps:
        return
    expected = (
        "compliances that are a positive definite matrix, as those of every shaft on springs are: "
        f"the smallest eigenvalue of α_ij / √(α_ii α_jj) is {lowest[0]:.2g}"
    )
    pair = np.unravel_index(np.argmax(np.abs(np.tril(scaled, -1))), alpha.shape)
    if abs(scaled[pair]) >= 1:
        a, b = known[int(pair[1])], known[int(pair[0])]
        expected += f". Between nodes {a} and {b} it is larger than √(α_ii α_jj) allows"
    elif lowest[0] > -RECIPROCAL:
        expected += ". Give more digits, or nodes farther apart"
    else:
        involved = [str(node) for node, x in zip(known, vectors[:, 0], strict=True) if abs(x) > 0.1]
        expected += f". Check those between nodes {listing(involved, 'and')}"
    table.as_whole(table.fields["compliance"].name, expected)
