"""Placement of the masses: every choice of nodes ranked by frequencies and shapes; the book's rule."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, islice
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import fem
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import AnyArray, FloatArray, IndexArray, whole
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, text
from rotorid.base.text import counted
from rotorid.reduction.masses import (
    Normalisation,
    RowWeights,
    design,
    mac,
    natural_frequencies,
    plane_at_rest,
    solve_many,
)

if TYPE_CHECKING:
    import pandas as pd

MOST = 2_000_000
"""More choices than this are refused."""
CHUNK = 2_000_000
"""Numbers in the largest array of one batch: the memory that the ranking needs does not grow with T."""
ALIKE = 0.9
"""Below this MAC two shapes are not those of one mode."""
CLOSE = 0.02
"""Frequencies that differ by less than this share of them are called a match."""
BADLY = 30.0
"""Condition number above which a fit is called badly conditioned: 1 % in, up to 30 % out."""
SMALL_ERROR, SMALL_LOSS = 1e-3, 1e-2
"""Frequency errors, and values of 1 − MAC, below which choices are equally good for a compromise."""
NAMED = {
    "best_by_frequency": "best by frequency",
    "best_by_mac": "best by MAC",
    "compromise": "compromise",
    "book_rule": "the book's antinodes",
}
"""Choices with a name: keys and words."""
COUNTS = ("considered", "ranked", "unphysical", "undetermined", "at_node")
_TOP = 10
"""Choices of the table, and those whose condition is looked at for a warning."""


@dataclass(frozen=True, eq=False)
class Placement(Answered):
    """Every choice of n nodes for the masses, best frequencies first.

    A choice is ranked where all its masses are positive and its model vibrates in n modes. The rows
    `[:ranked]` are those, by ascending error (of equal errors the higher MAC first); what follows has masses
    that are not positive, then choices that determine no masses; error, MAC and frequencies there are NaN.

    Attributes
    ----------
    nodes
        Node numbers of each choice, ascending, shape (T, n), T = `considered`.
    masses
        kg, shape (T, n); NaN where they are not determined.
    frequencies
        Of the n-mass models, rad/s, shape (T, n).
    error
        Largest |relative frequency error| over the n modes, shape (T,).
    mac
        Smallest MAC over these modes, mode k of the model with mode k of the rotor, shape (T,).
    worst_mode
        The number of the mode with the smallest MAC, shape (T,); 0 where the choice is not ranked.
    condition
        Condition number of each column-scaled regression, shape (T,); inf where it is rank deficient, NaN
        where it cannot be set up.
    ranked, unphysical, undetermined, at_node
        How many choices: ranked; with masses that are not positive; of deficient rank; that cannot be scaled,
        because a mode has a node at the first mass or at all. Together T.
    modes, normalise, rows
        What the regression used: number of modes, scale of the shapes, weights of the rows.
    rotor_frequencies
        The rotor's first n frequencies, rad/s.
    candidates
        Node numbers that could be chosen.
    book
        Row of the choice of `book_nodes`, None where the rule gives none or not among the candidates.
    book_note
        Why there is none, else "".
    warnings
        What a user should know before choosing.
    """

    nodes: NDArray[np.int32]
    masses: FloatArray
    frequencies: FloatArray
    error: FloatArray
    mac: FloatArray
    worst_mode: IndexArray
    condition: FloatArray
    ranked: int
    unphysical: int
    undetermined: int
    at_node: int
    modes: int
    normalise: str
    rows: str
    rotor_frequencies: FloatArray
    candidates: tuple[int, ...]
    book: int | None
    book_note: str
    warnings: tuple[str, ...]

    @property
    def check(self) -> int:
        """How many modes are compared: as many as there are masses."""
        return int(self.nodes.shape[1])

    @property
    def considered(self) -> int:
        """Number of choices T."""
        return len(self.nodes)

    @property
    def best_by_frequency(self) -> int | None:
        """Row of the smallest frequency error; None where no choice is ranked."""
        return 0 if self.ranked else None

    @property
    def best_by_mac(self) -> int | None:
        """Row of the largest smallest MAC (of equals the one of smaller error); None: no choice is ranked."""
        return int(np.argmax(self.mac[: self.ranked])) if self.ranked else None

    @property
    def compromise(self) -> int | None:
        """Row that loses least, as a factor, against both bests; None: no choice is ranked.

        It minimises max(error / smallest error, (1 − MAC) / smallest (1 − MAC)), after errors are raised to
        0.1 % and 1 − MAC to 0.01 at least, below which they are equally good. No choice beats it in both.
        """
        if not self.ranked:
            return None
        error = np.maximum(self.error[: self.ranked], SMALL_ERROR)
        loss = np.maximum(1.0 - self.mac[: self.ranked], SMALL_LOSS)
        return int(np.argmin(np.maximum(error / error.min(), loss / loss.min())))

    @property
    def named(self) -> dict[str, int | None]:
        """Rows of the choices with a name, by the keys of `NAMED`."""
        rows = (self.best_by_frequency, self.best_by_mac, self.compromise, self.book)
        return dict(zip(NAMED, rows, strict=True))

    def traps(self) -> IndexArray:
        """Rows with all checked frequencies within 2 % but a shape unlike the rotor's (MAC below 0.9)."""
        r = self.ranked
        return np.flatnonzero((self.error[:r] <= CLOSE) & (self.mac[:r] < ALIKE))

    def to_frame(self) -> pd.DataFrame:
        """One row per choice, in rank order: nodes, masses, frequencies, error, MAC, condition number."""
        rows = np.arange(self.considered)

        def numbered(name: str, values: AnyArray) -> list[Column]:
            return [Column(name.format(k), column) for k, column in enumerate(values.T, start=1)]

        table = frame(
            (
                Column("rank", np.where(rows < self.ranked, rows + 1.0, np.nan)),
                *numbered("node_{}", self.nodes),
                *numbered("mass_{}_kg", self.masses),
                *numbered("frequency_{}_rad_s", self.frequencies),
                Column("largest_error", self.error),
                Column("smallest_mac", self.mac),
                Column("worst_mode", self.worst_mode),
                Column("condition_number", self.condition),
            )
        )
        return table.astype({"rank": "Int64"})

    def to_dict(self, top: int = 20) -> dict[str, Any]:
        """As JSON types: counts, the `top` ranked choices, the trade-off, the choices with a name."""
        same = ("modes", "check", "normalise", "rows", "candidates", "warnings")
        return plain(
            {name: getattr(self, name) for name in (*COUNTS, *same)}
            | {
                "rotor_frequencies_rad_s": self.rotor_frequencies,
                "choices": [self._choice(i) for i in range(min(top, self.ranked))],
                "frequency_match_with_wrong_shapes": len(self.traps()),
            }
            | {key: None if row is None else self._choice(row) for key, row in self.named.items()}
        )

    def _choice(self, i: int) -> dict[str, Any]:
        return {
            "rank": i + 1 if i < self.ranked else None,
            "nodes": self.nodes[i],
            "masses_kg": self.masses[i],
            "natural_frequencies_rad_s": self.frequencies[i],
            "largest_error": self.error[i],
            "smallest_mac": self.mac[i],
            "worst_mode": self.worst_mode[i] or None,
            "condition_number": self.condition[i],
        }

    @property
    def answer(self) -> Answer:
        """The compromise beside the best by frequency, by MAC and the book's rule; behind it the best ten."""
        asked = f"Of {self.considered} choices of {self.check} of {len(self.candidates)} nodes"
        if (i := self.compromise) is None:
            words = " no choice gives a physical model; use other candidates or more modes."
            return Answer(asked + words, warnings=self.warnings)
        counts = (
            f"Masses from {counted(self.modes, 'mode')}, checked on {counted(self.check, 'mode')}: ranked "
            f"{self.ranked}; with masses that are not positive {self.unphysical}; not determined "
            f"{self.undetermined}; a mode has a node at the first mass {self.at_node}."
        )
        best = min(_TOP, self.ranked)
        return Answer(
            f"{asked} the compromise is {', '.join(map(str, self.nodes[i]))}: frequencies within "
            f"{100 * self.error[i]:.2g} %, MAC {self.mac[i]:.3g}.",
            self._choices({NAMED[key]: row for key, row in self.named.items() if row is not None}),
            self.warnings,
            (self._trap(), *([f"the book's rule: {self.book_note}"] if self.book_note else [])),
            (f"{counts}\n{self._choices({str(k + 1): k for k in range(best)})}",),
            f"the best {best} choices",
        )

    def _choices(self, named: Mapping[str, int]) -> str:
        """Choices as a table."""
        chosen = [*named.values()]
        macs = [f"{self.mac[i]:.4f} ({self.worst_mode[i]})" if i < self.ranked else "" for i in chosen]
        columns = (
            Column("choice", [*named]),
            Column("error", 100 * self.error[chosen], "{:.4f}".format, title="largest error, %"),
            Column("mac", macs, title="MAC (mode)"),
            Column("condition", self.condition[chosen], "{:.3g}".format),
            Column("nodes", [", ".join(map(str, self.nodes[i])) for i in chosen]),
            Column("masses", [", ".join(f"{m:.1f}" for m in self.masses[i]) for i in chosen], title="kg"),
        )
        return text(columns, width=COLUMNS)

    def _trap(self) -> str:
        if self.check == 1:
            return "One mass has no shape to compare, and every place gives its one frequency exactly"
        traps = self.traps()
        first = "".join(
            f", first nodes {', '.join(map(str, self.nodes[i]))} (MAC {self.mac[i]:.2f})" for i in traps[:1]
        )
        return (
            "frequencies alone are a trap, a model can match them and still move unlike the rotor: here "
            f"{traps.size} of the choices match all within {100 * CLOSE:g} % with a MAC below {ALIKE:g}"
            f"{first}"
        )


def rank_nodes(
    rotor: fem.Rotor,
    n: int = 3,
    modes: int = 2,
    *,
    candidates: Sequence[int | str] | None = None,
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
    plane, remarks = plane_at_rest(rotor, speed)
    given = range(1, rotor.n_nodes + 1) if candidates is None else candidates
    places = tuple(sorted({rotor.node(item) for item in given}))
    if not places or len(places) < len(given):
        raise ValueError(f"candidates must be different nodes, at least one; got {list(given)}")
    n = _number(n, len(places), "the number of masses", f"{len(places)} candidates hold")
    modes = _number(modes, n, "the number of modes", f"{n} masses can use")
    if (total := comb(len(places), n)) > MOST:
        raise ValueError(
            f"{n} of {len(places)} nodes can be chosen in {total} ways, more than {MOST}: give fewer nodes "
            "as candidates, such as every second one, or antinodes of the first modes and those beside them"
        )
    full = fem.critical_speeds(plane, n)
    alpha = fem.compliance(plane, places)
    shapes, omega = full.shapes[np.array(places) - 1], full.frequencies
    how: dict[str, Any] = {"normalise": normalise, "rows": rows}
    every, parts = combinations(range(len(places)), n), []
    size = max(1, CHUNK // (n * n * (modes + 3)))
    while (flat := np.fromiter(chain.from_iterable(islice(every, size)), dtype=np.intp)).size:
        chosen = flat.reshape(-1, n)
        A, U = alpha[chosen[:, :, None], chosen[:, None, :]], shapes[chosen]
        masses, condition = solve_many(*design(A, omega[:modes], U[..., :modes], **how))
        parts.append((chosen, masses, condition, *_compared(A, masses, omega, U)))
    chosen, masses, condition, frequencies, error, agreement, worst = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    # best error first, of equal errors the larger MAC, then the lighter; then masses not positive,
    # then nothing determined
    good, determined = np.isfinite(error), np.isfinite(condition)
    keys = np.where(good, (masses.sum(axis=1), -agreement, error), 0.0)
    # rounded: differences of 1e-10 are float64's, and then the order of the nodes decides
    order = np.lexsort((*np.round(keys, 10), np.where(good, 0, np.where(determined, 1, 2))))
    nodes = np.array(places, dtype=np.int32)[chosen[order]]
    book, note = None, ""
    try:
        antinodes = book_nodes(rotor, n, speed=speed)
        book = next(iter(np.flatnonzero((nodes == antinodes).all(axis=1)).tolist()), None)
        if book is None:
            note = f"its nodes {', '.join(map(str, antinodes))} are not all among the candidates"
    except ValueError as problem:
        note = str(problem)
    result = Placement(
        nodes=nodes,
        masses=masses[order],
        frequencies=frequencies[order],
        error=error[order],
        mac=agreement[order],
        worst_mode=worst[order],
        condition=condition[order],
        ranked=int(good.sum()),
        unphysical=int((determined & ~good).sum()),
        undetermined=int(np.isinf(condition).sum()),
        at_node=int(np.isnan(condition).sum()),
        modes=modes,
        **how,
        rotor_frequencies=omega,
        candidates=places,
        book=book,
        book_note=note,
        warnings=(*remarks, *full.warnings),
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
    upper = n if n % 2 == 0 else (n + 1) // 2
    needed = [upper] if n % 2 == 0 or n == 1 else [upper, upper - 1]
    full = fem.critical_speeds(plane, upper)
    supported = [support.node for support in plane.supports]
    chosen: set[int] = set()
    for mode in needed:
        U = full.shapes[:, mode - 1]
        between = range(min(supported), max(supported) - 1)
        peaks = [i + 1 for i in between if U[i] * U[i - 1] < U[i] ** 2 >= U[i] * U[i + 1]]
        if len(peaks) < mode:
            raise ValueError(
                f"mode {mode} has {counted(len(peaks), 'antinode')} between the outermost supports, the "
                f"book's rule for {n} masses needs {mode}: use a finer mesh, fewer masses, or choose nodes "
                "by rank_nodes"
            )
        chosen.update(sorted(peaks, key=lambda node: -abs(U[node - 1]))[:mode])
    if len(chosen) < n:
        raise ValueError(
            f"two antinodes of modes {needed[1]} and {needed[0]} share a node: use a finer mesh, or "
            "choose nodes by rank_nodes"
        )
    return tuple(sorted(chosen))


def _number(value: int, most: int, name: str, words: str) -> int:
    number = whole(value, name)
    if not 1 <= number <= most:
        raise ValueError(f"{name} is {number}, but {words} 1 … {most}")
    return number


def _compared(
    A: FloatArray, masses: FloatArray, omega: FloatArray, U: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, IndexArray]:
    """Frequencies (t, n), largest error, smallest MAC and its mode (t,) of the n-mass models.

    NaN, and mode 0, where the masses are not all positive or the model does not vibrate in n modes.
    """
    frequencies, each = np.full_like(masses, np.nan), np.full_like(masses, np.nan)
    positive = np.flatnonzero((masses > 0).all(axis=1))  # none with NaN
    frequencies[positive], model = natural_frequencies(A[positive], masses[positive])
    with np.errstate(invalid="ignore"):
        each[positive] = np.diagonal(mac(model, U[positive]), axis1=1, axis2=2)
    vibrates = np.asarray(np.isfinite(frequencies).all(axis=1, keepdims=True))
    # a rotor's mode that does not move these nodes is not in the model: MAC 0
    frequencies, each = np.where(vibrates, (frequencies, np.nan_to_num(each)), np.nan)
    worst = np.where(vibrates.ravel(), each.argmin(axis=1) + 1, 0)
    return frequencies, np.abs(frequencies / omega - 1.0).max(axis=1), each.min(axis=1), worst


def _warnings(result: Placement) -> list[str]:
    top = result.condition[: min(_TOP, result.ranked)]
    if not (bad := int((top > BADLY).sum())):
        return []
    return [
        f"{bad} of the best {len(top)} by frequency are badly conditioned (condition number up to "
        f"{top.max():.3g}): errors of 1 % in compliances and shapes can move their masses by up to that many "
        "percent; use more modes or prefer a choice with a smaller number"
    ]
