"""Design of experiments: which frequencies or times to measure, expected deviations, a D-optimal choice.

With guessed parameters and stated errors the information of each candidate is known beforehand:
M_i = J_iᵀ J_i with J_i the derivatives of its readings over their errors. The covariance of the estimate from
a set of them is (Σ M_i)⁻¹. D-optimal: the set with the largest det Σ M_i, the smallest volume of the
confidence ellipsoid; parameters' units do not matter to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, text
from rotorid.base.text import error_figures, percent
from rotorid.regression.linear import least_squares

if TYPE_CHECKING:
    import pandas as pd


WITHOUT_PRIOR = ("the expected deviations are those of the readings alone, without [prior]",)
_WORDS = {"rad/s": ("frequency_rad_s", "frequencies"), "s": ("t_s", "times")}
"""Name of a column of candidates, and of several of them, by their unit."""
RIDGE = 1e-12
"""Added to the scaled information while too few frequencies are chosen to determine everything."""
STARTS = 12
"""Experiments with which the search begins in turn: a single exchange can stop at a local maximum."""


@dataclass(frozen=True, eq=False)
class Design(Answered):
    """Candidate frequencies or times, and the chosen ones.

    Attributes
    ----------
    parameters, guess
        Names and guessed values (n,).
    candidates
        Frequencies, rad/s, or times, s, shape (c,).
    std_alone
        Expected standard deviation of each parameter from each candidate alone, (c, n); infinite where one
        does not determine it.
    chosen
        Indices of the chosen candidates, ascending; several times the same one if repetition was allowed.
    std
        Expected standard deviations from the chosen ones, (n,); infinite where not determined.
    std_all
        The same from all candidates.
    efficiency
        (det M of the chosen / det M of a share of all)^(1/n): information per reading, relative to spreading
        the same number evenly over all candidates; NaN where all do not determine the parameters.
    unit
        Of the candidates, "rad/s" or "s".
    notes
        What the expected deviations leave out.
    """

    parameters: tuple[str, ...]
    guess: FloatArray
    candidates: FloatArray
    std_alone: FloatArray
    chosen: IntArray
    std: FloatArray
    std_all: FloatArray
    efficiency: float
    unit: str = "rad/s"
    notes: tuple[str, ...] = ()

    @property
    def where(self) -> FloatArray:
        """The chosen candidates."""
        return np.asarray(self.candidates[self.chosen])

    @property
    def determined(self) -> bool:
        """Whether the chosen ones determine every parameter."""
        return bool(np.isfinite(self.std).all())

    @property
    def answer(self) -> Answer:
        """The chosen candidates and what they will tell."""
        listed = ", ".join(f"{w:.6g}" for w in self.where)
        said = f"Measure at {listed} {self.unit} ({len(self.chosen)} of {len(self.candidates)} candidates)"
        if np.isfinite(self.efficiency):
            said += f": {self.efficiency:.2f} times the information of as many readings spread evenly"
        std, every = (np.where(np.isfinite(each), each, np.nan) for each in (self.std, self.std_all))
        known = [
            "" if np.isfinite(std) else f"these {_WORDS[self.unit][1]} will not determine it"
            for std in self.std
        ]
        columns = (
            Column("parameter", self.parameters, str),
            Column("guess", self.guess, "{:.6g}".format),
            Column("std", std, error_figures, "± expected"),
            Column("%", std / np.where(self.guess == 0, np.nan, np.abs(self.guess)), percent),
            Column("all", every, error_figures, "± of all"),
            Column("why", known, str, ""),
        )
        return Answer(f"{said}.", text(columns, width=COLUMNS), notes=self.notes)

    def to_frame(self) -> pd.DataFrame:
        """One row per candidate: frequency, how often chosen, expected standard deviations from it alone."""
        counts = np.bincount(self.chosen, minlength=len(self.candidates))
        alone = zip(self.parameters, self.std_alone.T, strict=True)
        return frame(
            (
                Column(_WORDS[self.unit][0], self.candidates),
                Column("chosen", counts),
                *(Column(f"{name}_std", np.where(np.isfinite(std), std, np.nan)) for name, std in alone),
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; None where not determined."""
        suffix = self.unit.replace("/", "_")
        table = zip(self.parameters, self.guess, self.std, self.std_all, self.std_alone.T, strict=True)
        return plain(
            {
                f"{_WORDS[self.unit][1]}_{suffix}": self.where,
                f"candidates_{suffix}": self.candidates,
                "parameters": {
                    name: {"guess": guess, "std": std, "std_all_candidates": every, "std_alone": alone}
                    for name, guess, std, every, alone in table
                },
                "efficiency": self.efficiency,
                "determined": self.determined,
            }
        )


def designed(
    names: tuple[str, ...],
    guess: FloatArray,
    candidates: FloatArray,
    J: FloatArray,
    n: int,
    repeat: bool,
    unit: str,
) -> Design:
    """The D-optimal n of the candidates (c,), from J as `d_optimal` takes it; ValueError for another n."""
    if n < 1 or (n > len(candidates) and not repeat):
        count = len(candidates)
        raise ValueError(f"choose from 1 to {count} of the {count} candidate {_WORDS[unit][1]}, not {n}")
    chosen = d_optimal(J, n, repeat=repeat)
    return Design(
        parameters=names,
        guess=guess,
        candidates=candidates,
        std_alone=np.stack([_expected(J[[i]]) for i in range(len(J))]),
        chosen=chosen,
        std=_expected(J[chosen]),
        std_all=_expected(J),
        efficiency=_efficiency(J, chosen),
        unit=unit,
    )


def d_optimal(J: FloatArray, n: int, *, repeat: bool = False) -> IntArray:
    """Indices (n,), ascending, of the experiments with the largest det Σ J_iᵀ J_i.

    Parameters
    ----------
    J
        Sensitivities over errors, (experiments, rows, parameters).
    n
        How many.
    repeat
        Whether one may be chosen several times.

    Notes
    -----
    Greedy, then exchanges of one experiment for another while the determinant grows (Fedorov), begun with
    each of the STARTS most informative experiments: no proof of the best, but rarely anything else. While too
    few are chosen to determine everything a tiny ridge stands in.
    """
    norms = np.sqrt((J**2).sum(axis=(0, 1)))
    scaled = J / np.where(norms > 0, norms, 1.0)
    M = np.swapaxes(scaled, 1, 2) @ scaled
    ridge = RIDGE * np.eye(J.shape[2])

    def score(rest: FloatArray, taken: list[int]) -> FloatArray:
        """Logarithm of det with each candidate added, −inf where it is not free."""
        values = np.linalg.slogdet(rest + M)[1]
        if not repeat:
            values[taken] = -np.inf
        return np.asarray(values)

    def improve(chosen: list[int]) -> float:
        """Fill up greedily, exchange while it helps; the reached log det."""
        while len(chosen) < n:
            chosen.append(int(np.argmax(score(ridge + M[chosen].sum(axis=0), chosen))))
        reached = -np.inf
        for _ in range(100):
            before = reached
            for k in range(n):
                others = chosen[:k] + chosen[k + 1 :]
                values = score(ridge + M[others].sum(axis=0), others)
                best = int(np.argmax(values))
                if values[best] > values[chosen[k]] + 1e-9:
                    chosen[k] = best
                reached = float(values[chosen[k]])
            if reached <= before + 1e-9:
                break
        return reached

    alone = score(ridge, [])
    firsts = np.argsort(-alone)[:STARTS]
    trials = [[int(first)] for first in firsts]
    reached = [improve(trial) for trial in trials]
    return np.array(sorted(trials[int(np.argmax(reached))]), dtype=np.int64)


def _expected(J: FloatArray) -> FloatArray:
    """Standard deviations from some experiments together; infinite where not determined."""
    rows = J.reshape(-1, J.shape[2])
    estimate = least_squares(rows, np.zeros(len(rows)), sigma=1.0)
    assert estimate.std is not None
    return np.where(np.isnan(estimate.std), np.inf, estimate.std)


def _efficiency(J: FloatArray, chosen: IntArray) -> float:
    def log_det(rows: FloatArray) -> float:
        s = np.linalg.svd(rows.reshape(-1, J.shape[2]) / norms, compute_uv=False)
        good = len(s) == J.shape[2] and s[-1] > 1e-12 * s[0]
        return 2 * float(np.log(s).sum()) if good else -np.inf

    norms = np.sqrt((J**2).sum(axis=(0, 1)))
    norms = np.where(norms > 0, norms, 1.0)
    whole, part = log_det(J), log_det(J[chosen])
    if not np.isfinite(whole):
        return float("nan")
    return float(np.exp((part - whole) / J.shape[2]) * len(J) / len(chosen))
