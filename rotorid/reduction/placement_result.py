"""All choices of places for the masses beside one another: which match the frequencies, which the shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import fem
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, numbered, text
from rotorid.base.text import counted

if TYPE_CHECKING:
    import pandas as pd


ALIKE = 0.9
"""Below this MAC two shapes are not those of one mode."""

CLOSE = 0.02
"""Frequencies that differ by less than this share of them are called a match."""

BADLY = 30.0
"""Condition number above which a fit is called badly conditioned: 1 % in, up to 30 % out."""

SMALL_ERROR = 1e-3
"""Frequency errors below this count as equally good where a compromise is sought."""

SMALL_LOSS = 1e-2
"""So do values of 1 − MAC below this."""

_TOP = 10
"""Choices of the table."""


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
        Of the n-mass models, their first `check` modes, rad/s, shape (T, check).
    error
        Largest |relative frequency error| over these modes, shape (T,).
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
    modes, check, normalise, rows
        What the regression used: number of modes, modes checked, scale of the shapes, weights of the rows
        ("own" where they were given as an array).
    rotor_frequencies
        The rotor's first `check` frequencies, rad/s.
    candidates
        Node numbers that could be chosen.
    book
        Row of the choice of `book_nodes`, None where the rule gives none or not among the candidates.
    book_note
        Why there is none, else "".
    rotor
        The rotor itself.
    warnings
        What a user should know before choosing.
    """

    nodes: NDArray[np.int32]
    masses: FloatArray
    frequencies: FloatArray
    error: FloatArray
    mac: FloatArray
    worst_mode: NDArray[np.int32]
    condition: FloatArray
    ranked: int
    unphysical: int
    undetermined: int
    at_node: int
    modes: int
    check: int
    normalise: str
    rows: str
    rotor_frequencies: FloatArray
    candidates: tuple[int, ...]
    book: int | None
    book_note: str
    rotor: fem.Rotor
    warnings: tuple[str, ...]

    @property
    def considered(self) -> int:
        """Number of choices T."""
        return len(self.nodes)

    @cached_property
    def pareto(self) -> IndexArray:
        """Rows that no other beats in both error and MAC: the trade-off, by ascending error."""
        mac = self.mac[: self.ranked]
        if not self.ranked:
            return np.empty(0, dtype=np.intp)
        before = np.concatenate(([-np.inf], np.maximum.accumulate(mac)[:-1]))
        return np.flatnonzero(mac > before)

    @property
    def best_by_frequency(self) -> int | None:
        """Row of the smallest frequency error; None where no choice is ranked."""
        return 0 if self.ranked else None

    @property
    def best_by_mac(self) -> int | None:
        """Row of the largest smallest MAC (of equals the one of smaller error); None: no choice is ranked."""
        return int(self.pareto[-1]) if self.ranked else None

    @property
    def compromise(self) -> int | None:
        """Row of the trade-off that loses least, as a factor, against both bests; None: no choice is ranked.

        The row that minimises max(error / smallest error, (1 − MAC) / smallest (1 − MAC)), after errors
        are raised to 0.1 % and 1 − MAC to 0.01 at least, below which they are equally good: the knee of the
        trade-off on logarithmic axes.
        """
        if not self.ranked:
            return None
        front = self.pareto
        error = np.maximum(self.error[front], SMALL_ERROR)
        loss = np.maximum(1.0 - self.mac[front], SMALL_LOSS)
        return int(front[np.argmin(np.maximum(error / error.min(), loss / loss.min()))])

    def traps(self) -> IndexArray:
        """Rows with all checked frequencies within 2 % but a shape unlike the rotor's (MAC below 0.9)."""
        r = self.ranked
        return np.flatnonzero((self.error[:r] <= CLOSE) & (self.mac[:r] < ALIKE))

    def to_frame(self) -> pd.DataFrame:
        """One row per choice, in rank order: nodes, masses, frequencies, error, MAC, condition number."""
        import pandas as pd

        rank = [*range(1, self.ranked + 1)] + [pd.NA] * (self.considered - self.ranked)
        on_front = np.zeros(self.considered, dtype=bool)
        on_front[self.pareto] = True
        table = frame(
            (
                Column("rank", rank),
                *numbered("node_{}", self.nodes),
                *numbered("mass_{}_kg", self.masses),
                *numbered("frequency_{}_rad_s", self.frequencies),
                Column("largest_error", self.error),
                Column("smallest_mac", self.mac),
                Column("worst_mode", self.worst_mode),
                Column("condition_number", self.condition),
                Column("trade_off", on_front),
            )
        )
        return table.astype({"rank": "Int64"})

    def to_dict(self, top: int = 20) -> dict[str, Any]:
        """As JSON types: counts, the `top` ranked choices, the trade-off, the choices with a name."""
        return plain(
            {
                "considered": self.considered,
                "ranked": self.ranked,
                "unphysical": self.unphysical,
                "undetermined": self.undetermined,
                "at_node": self.at_node,
                "modes": self.modes,
                "check": self.check,
                "normalise": self.normalise,
                "rows": self.rows,
                "candidates": self.candidates,
                "rotor_frequencies_rad_s": self.rotor_frequencies,
                "choices": [self._choice(i) for i in range(min(top, self.ranked))],
                "trade_off": [self._choice(i) for i in self.pareto],
                "best_by_frequency": self._choice(self.best_by_frequency),
                "best_by_mac": self._choice(self.best_by_mac),
                "compromise": self._choice(self.compromise),
                "book_rule": self._choice(self.book),
                "frequency_match_with_wrong_shapes": len(self.traps()),
                "warnings": self.warnings,
            }
        )

    def _choice(self, i: int | np.intp | None) -> dict[str, Any] | None:
        if i is None:
            return None
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
        n = self.nodes.shape[1]
        asked = f"Of {self.considered} choices of {n} of {len(self.candidates)} nodes"
        if not self.ranked:
            said = f"{asked} no choice gives a physical model; use other candidates or more modes."
            return Answer(said, warnings=self.warnings)
        i = self.compromise
        assert i is not None
        places = ", ".join(map(str, self.nodes[i]))
        named = {
            "best by frequency": self.best_by_frequency,
            "best by MAC": self.best_by_mac,
            "compromise": i,
            "the book's antinodes": self.book,
        }
        counts = (
            f"Masses from {counted(self.modes, 'mode')}, checked on {counted(self.check, 'mode')}: ranked "
            f"{self.ranked}; with masses that are not positive {self.unphysical}; not determined "
            f"{self.undetermined}; a mode has a node at the first mass {self.at_node}."
        )
        best = self._choices({str(k + 1): k for k in range(min(_TOP, self.ranked))})
        return Answer(
            f"{asked} the compromise is {places}: frequencies within {100 * self.error[i]:.2g} %, "
            f"MAC {self.mac[i]:.3g}.",
            self._choices({words: int(row) for words, row in named.items() if row is not None}),
            self.warnings,
            (self._trap(), *((f"the book's rule: {self.book_note}",) if self.book is None else ())),
            (f"{counts}\n{best}",),
            f"the best {min(_TOP, self.ranked)} choices",
        )

    def _choices(self, named: Mapping[str, int]) -> str:
        """Choices as a table."""
        chosen = [*named.values()]
        macs = [f"{self.mac[i]:.4f} ({self.worst_mode[i]})" if i < self.ranked else "" for i in chosen]
        columns = (
            Column("choice", [*named], str),
            Column("error", 100 * self.error[chosen], "{:.4f}".format, "largest error, %"),
            Column("mac", macs, str, "MAC (mode)"),
            Column("condition", self.condition[chosen], "{:.3g}".format),
            Column("nodes", [", ".join(map(str, self.nodes[i])) for i in chosen], str),
            Column("masses", [", ".join(f"{m:.1f}" for m in self.masses[i]) for i in chosen], str, "kg"),
        )
        return text(columns, width=COLUMNS)

    def _trap(self) -> str:
        if self.nodes.shape[1] == 1:
            return "One mass has no shape to compare, and every place gives its one frequency exactly"
        traps = self.traps()
        said = "frequencies alone are a trap: a model can match them and still move unlike the rotor. "
        if not traps.size:
            return f"{said}Here no choice matches within {100 * CLOSE:g} % with a MAC below {ALIKE:g}"
        i = int(traps[0])
        return (
            f"{said}Here {traps.size} of the choices match all checked frequencies within {100 * CLOSE:g} % "
            f"with a MAC below {ALIKE:g}, first nodes {', '.join(map(str, self.nodes[i]))} (rank "
            f"{i + 1}, MAC {self.mac[i]:.2f} in mode {self.worst_mode[i]}). Choose by both columns"
        )
