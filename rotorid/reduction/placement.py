"""Placement of the masses: every choice of nodes ranked by frequencies and shapes; the book's rule."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import chain, combinations, islice
from math import comb

import numpy as np
from numpy.typing import NDArray

import fem
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.checks import whole
from rotorid.base.text import counted
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import Normalisation, RowWeights, design
from rotorid.reduction.equivalent.plane_at_rest import plane_at_rest
from rotorid.reduction.placement_result import ALIKE, BADLY, Placement
from rotorid.regression import RCOND

MOST = 2_000_000
"""More choices than this are refused."""

CHUNK = 2_000_000
"""Numbers in the largest array of one batch: the memory that the ranking needs does not grow with T."""

LOOKED_AT = 10
"""The best fits whose condition is looked at for a warning."""


def rank_nodes(
    rotor: fem.Rotor,
    n: int = 3,
    modes: int = 2,
    *,
    candidates: Sequence[int | str] | None = None,
    check: int | None = None,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
    speed: float | None = None,
) -> Placement:
    """Rank all choices of n nodes for equivalent masses by frequency error, with the MAC beside it.

    For each choice the masses follow from formula (50) ([S] 1.10) over the first modes; the n-mass model's
    own eigenvalues and shapes are then compared with the rotor's. A small error of frequencies alone is a
    trap: quite different masses can have the same frequencies, and shapes that are not the rotor's.

    Parameters
    ----------
    rotor
        On supports; of its plane x at rest, see `reduce`.
    n
        How many masses.
    modes
        How many modes the regression uses, 1 … n.
    candidates
        Node numbers or names of stations to choose from; default all nodes.
    check
        How many of the first modes are compared, 1 … n; default n.
    normalise, rows
        As in `rotorid.reduction.equivalent_masses`. With "first" the first mass is the leftmost one.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.

    Returns
    -------
    Placement
        All choices, best frequencies first. Choices that cannot be set up (a mode has a node at the first
        mass) or that the modes do not determine are counted and never ranked.

    Raises
    ------
    ValueError
        For numbers out of range, candidates that do not exist or repeat, more than two million choices, a
        rotor free to move or with fewer than n modes.

    Notes
    -----
    Batches: column-scaled SVD of B (n k rows) for masses and condition, then `eigh` of √m α √m, whose
    eigenvalues are 1/ω² and whose vectors are √m times the shapes.
    """
    plane, said = plane_at_rest(rotor, speed)
    places = _candidates(rotor, candidates)
    n = _number(n, len(places), "the number of masses", f"{len(places)} candidates hold")
    modes = _number(modes, n, "the number of modes", f"{n} masses can use")
    check = n if check is None else _number(check, n, "the number of modes to check", f"{n} masses have")
    total = comb(len(places), n)
    if total > MOST:
        raise ValueError(
            f"{n} of {len(places)} nodes can be chosen in {total} ways, more than {MOST}: give fewer nodes "
            "as candidates, such as every second one, or antinodes of the first modes and those beside them"
        )
    full = fem.critical_speeds(plane, max(modes, check))
    alpha = fem.compliance(plane, places)
    shapes = full.shapes[np.array(places) - 1]
    omega = full.frequencies
    parts = []
    for tuples in _chunks(len(places), n, max(1, CHUNK // (n * n * (modes + 3)))):
        A = alpha[tuples[:, :, None], tuples[:, None, :]]
        U = shapes[tuples]
        masses, condition = _masses(A, omega[:modes], U[..., :modes], normalise, rows)
        parts.append((tuples, masses, condition, *_compared(A, masses, omega[:check], U[..., :check])))
    tuples, masses, condition, frequencies, error, mac, worst = (
        np.concatenate(p) for p in zip(*parts, strict=True)
    )
    # best error first, of equal errors the larger MAC, then the lighter; then masses not positive,
    # then nothing determined
    known = np.isfinite(masses).all(axis=1)
    good = np.isfinite(error)
    group = np.where(good, 0, np.where(known, 1, 2))
    weight = np.where(good, masses.sum(axis=1), 0.0)
    keys = (weight, -np.where(good, mac, 0.0), np.where(good, error, 0.0))
    # rounded: differences of 1e-10 are float64's, and then the order of the nodes decides
    order = np.lexsort((*np.round(keys, 10), group))
    nodes = np.array(places, dtype=np.int32)[tuples[order]]
    book, note = _book(nodes, plane, n)
    result = Placement(
        nodes=nodes,
        masses=masses[order],
        frequencies=frequencies[order],
        error=error[order],
        mac=mac[order],
        worst_mode=worst[order],
        condition=condition[order],
        ranked=int(good.sum()),
        unphysical=int((known & ~good).sum()),
        undetermined=int(np.isinf(condition).sum()),
        at_node=int(np.isnan(condition).sum()),
        modes=modes,
        check=check,
        normalise=normalise,
        rows=rows if isinstance(rows, str) else "own",
        rotor_frequencies=omega[:check],
        candidates=places,
        book=book,
        book_note=note,
        rotor=rotor,
        warnings=(*said, *full.warnings),
    )
    return dataclasses.replace(result, warnings=(*result.warnings, *_warnings(result)))


def book_nodes(rotor: fem.Rotor, n: int = 3, *, speed: float | None = None) -> tuple[int, ...]:
    """Nodes for n masses by the book's rule, at antinodes of the first modes between the outermost supports.

    [S] task 9.1 puts three masses at the two antinodes of the second mode and the one of the first. The
    antinodes of two neighbouring modes alternate, so an odd n = 2p − 1 takes the p antinodes of mode p and
    the p − 1 of mode p − 1 (n = 1: that of the first mode). An even n takes the n antinodes of mode n, since
    an even number is no sum of two neighbouring ones, and antinodes of other pairs may coincide. The
    generalisation to n ≠ 3 is ours, not the book's.

    Parameters
    ----------
    rotor, speed
        As in `rank_nodes`.
    n
        How many masses.

    Returns
    -------
    Node numbers, ascending. An antinode is a node that is further from the axis than both neighbours, which
    may lie on the other side of it.

    Raises
    ------
    ValueError
        Where a mode has fewer antinodes between the supports than the rule needs, or two of them share a
        node; and for what `rank_nodes` refuses.
    """
    plane, _ = plane_at_rest(rotor, speed)
    n = _number(n, rotor.n_nodes, "the number of masses", f"{rotor.n_nodes} nodes hold")
    return _antinodes(plane, n)


def _antinodes(plane: fem.Rotor, n: int) -> tuple[int, ...]:
    upper = n if n % 2 == 0 else (n + 1) // 2
    needed = [upper] if n % 2 == 0 or n == 1 else [upper, upper - 1]
    full = fem.critical_speeds(plane, upper)
    held = [support.node for support in plane.supports]
    first, last = min(held, default=1), max(held, default=1)
    chosen: list[int] = []
    for mode in needed:
        U = full.shapes[:, mode - 1]
        peaks = [i + 1 for i in range(first, last - 1) if U[i] * U[i - 1] < U[i] ** 2 >= U[i] * U[i + 1]]
        if len(peaks) < mode:
            raise ValueError(
                f"mode {mode} has {counted(len(peaks), 'antinode')} between the outermost supports, the "
                f"book's rule for {n} masses needs {mode}: use a finer mesh, fewer masses, or choose nodes "
                "by rank_nodes"
            )
        chosen += sorted(peaks, key=lambda node: -abs(U[node - 1]))[:mode]
    if len(set(chosen)) < n:
        raise ValueError(
            f"two antinodes of modes {needed[1]} and {needed[0]} share a node: use a finer mesh, or "
            "choose nodes by rank_nodes"
        )
    return tuple(sorted(chosen))


def _book(nodes: NDArray[np.int32], plane: fem.Rotor, n: int) -> tuple[int | None, str]:
    """Row of the book's rule among the choices, or why there is none."""
    try:
        wanted = _antinodes(plane, n)
    except ValueError as problem:
        return None, str(problem)
    found = np.flatnonzero((nodes == wanted).all(axis=1))
    if not found.size:
        return None, f"its nodes {', '.join(map(str, wanted))} are not all among the candidates"
    return int(found[0]), ""


def _candidates(rotor: fem.Rotor, candidates: Sequence[int | str] | None) -> tuple[int, ...]:
    if candidates is None:
        return tuple(range(1, rotor.n_nodes + 1))
    places = [rotor.node(item) for item in candidates]
    if not places or len(set(places)) < len(places):
        raise ValueError(f"candidates must be different nodes, at least one; got {list(candidates)}")
    return tuple(sorted(places))


def _number(value: int, most: int, name: str, words: str) -> int:
    number = whole(value, name)
    if not 1 <= number <= most:
        raise ValueError(f"{name} is {number}, but {words} 1 … {most}")
    return number


def _chunks(count: int, n: int, size: int) -> Iterator[IndexArray]:
    """All n of `count` places, from 0, ascending, shape (≤ size, n) at a time."""
    every = combinations(range(count), n)
    while True:
        flat = np.fromiter(chain.from_iterable(islice(every, size)), dtype=np.intp)
        if not flat.size:
            return
        yield flat.reshape(-1, n)


def _masses(
    A: FloatArray, omega: FloatArray, U: FloatArray, normalise: Normalisation, rows: RowWeights
) -> tuple[FloatArray, FloatArray]:
    """Masses (t, n) and condition numbers (t,) of (50); NaN masses where they are not determined.

    The condition number is NaN where a shape cannot be scaled, inf where the rank is deficient.
    """
    B, D = design(A, omega, U, normalise=normalise, rows=rows)
    t, n = B.shape[0], B.shape[-1]
    masses, condition = np.full((t, n), np.nan), np.full(t, np.nan)
    usable = np.flatnonzero(np.isfinite(B).all(axis=(1, 2)) & np.isfinite(D).all(axis=1))
    if not usable.size:
        return masses, condition
    B, D = B[usable], D[usable]
    scale = np.linalg.norm(B, axis=1)
    scale[scale == 0] = 1.0
    left, s, right = np.linalg.svd(B / scale[:, None, :], full_matrices=False)
    determined = s[:, -1] > RCOND * s[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        condition[usable] = np.where(determined, s[:, 0] / s[:, -1], np.inf)
    left, s, right = left[determined], s[determined], right[determined]
    projected = (D[determined][:, None, :] @ left)[:, 0] / s
    masses[usable[determined]] = (projected[:, None, :] @ right)[:, 0] / scale[determined]
    return masses, condition


def _compared(
    A: FloatArray, masses: FloatArray, omega: FloatArray, U: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.int32]]:
    """Frequencies (t, check), largest error, smallest MAC and its mode (t,) of the n-mass models.

    NaN, and mode 0, where the masses are not all positive or the model does not vibrate in n modes.
    """
    t, check = len(masses), len(omega)
    frequencies, error, mac = np.full((t, check), np.nan), np.full(t, np.nan), np.full(t, np.nan)
    worst = np.zeros(t, dtype=np.int32)
    positive = np.flatnonzero((masses > 0).all(axis=1))  # False for NaN
    root = np.sqrt(masses[positive])
    lam, V = np.linalg.eigh(root[:, :, None] * A[positive] * root[:, None, :])
    vibrates = lam[:, 0] > 1e-15 * lam[:, -1]
    positive, root = positive[vibrates], root[vibrates]
    lam, V = lam[vibrates, ::-1][:, :check], V[vibrates, :, ::-1][:, :, :check]
    if not positive.size:
        return frequencies, error, mac, worst
    frequencies[positive] = 1.0 / np.sqrt(lam)
    error[positive] = np.abs(frequencies[positive] / omega - 1.0).max(axis=1)
    model, reference = V / root[:, :, None], U[positive]
    size = (model**2).sum(axis=1) * (reference**2).sum(axis=1)
    product = (model * reference).sum(axis=1) ** 2
    # a rotor's mode that does not move these nodes is not in the model: MAC 0
    each = np.divide(product, size, out=np.zeros_like(size), where=size > 0)
    mac[positive] = each.min(axis=1)
    worst[positive] = each.argmin(axis=1) + 1
    return frequencies, error, mac, worst


def _warnings(result: Placement) -> list[str]:
    out = []
    lost = result.undetermined + result.at_node
    if lost:
        out.append(
            f"{lost} of {result.considered} choices give no masses and are not ranked: {result.undetermined} "
            f"are not determined by {counted(result.modes, 'mode')}, in {result.at_node} a mode has a node "
            'at the first mass (normalise="largest" can use these)'
        )
    if not result.ranked:
        return [*out, "no choice gives a physical model: use other candidates, more modes or fewer masses"]
    if result.nodes.shape[1] == 1:
        out.append(
            "one mass has the rotor's first frequency at any node, and one reading any shape: frequency and "
            "MAC say nothing here, and the lightest mass stands first, where the mode is largest"
        )
    top = result.condition[: min(LOOKED_AT, result.ranked)]
    bad = int((top > BADLY).sum())
    if bad:
        out.append(
            f"{bad} of the best {len(top)} by frequency are badly conditioned (condition number up to "
            f"{top.max():.3g}): errors of 1 % in compliances and shapes can move their masses by up to that "
            "many percent; use more modes or prefer a choice with a smaller number"
        )
    if result.mac[0] < ALIKE:
        out.append(
            "the best choice by frequency has a shape that is not the rotor's (MAC "
            f"{result.mac[0]:.2f} in mode {result.worst_mode[0]}): do not choose by frequency alone"
        )
    return out
