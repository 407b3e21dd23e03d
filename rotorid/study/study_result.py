"""Results of studies: probabilities to meet the limit, runs needed, coverage; minima where searches end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import counted, figures

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.arrays import FloatArray, IntArray


def interval(k: int, n: int) -> tuple[float, float]:
    """Of a probability at 95 % where k of n samples are so, exact (Clopper and Pearson)."""
    from scipy.special import betaincinv

    low = float(betaincinv(k, n - k + 1, 0.025)) if k else 0.0
    return low, float(betaincinv(k + 1, n - k, 0.975)) if k < n else 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class StudiedMachines(Answered):
    """What became of all drawn machines.

    Attributes
    ----------
    samples, seed, warnings
        How many, what they were drawn with, and what is to be known of the rotor.
    met
        How many meet the limit after so many corrections or fewer, as built first, (K + 1,).
    runs
        Runs of the machine until then, (K + 1,).
    held
        Regions of the first correction that hold the true one, and all, without and with a warning, (2, 2).
    reasons
        Why machines were not balanced, and how many.
    ratios
        How many largest readings over their limit, as built and at last, lie between `EDGES`, (2, 600).
    """

    samples: int
    seed: int
    warnings: tuple[str, ...]
    met: IntArray
    runs: IntArray
    held: IntArray
    reasons: Mapping[str, int]
    ratios: IntArray

    def _columns(self) -> tuple[Column, ...]:
        low, high = zip(*(interval(int(met), self.samples) for met in self.met), strict=True)
        shown = "{:.4f}".format
        return (
            Column("corrections", range(len(self.met)), str),
            Column("runs", self.runs, str),
            Column("met", self.met, str),
            Column("probability", self.met / self.samples, shown),
            Column("low", low, shown, "from"),
            Column("high", high, shown, "to"),
        )

    @property
    def answer(self) -> Answer:
        """The probabilities, and whether the regions of the weights are honest."""
        first, last = (f"{100 * self.met[k] / self.samples:.4g} %" for k in (0, -1))
        most = counted(len(self.met) - 1, "correction")
        after = f" and {last} after at most {most}" if len(self.met) > 1 else ""
        notes = [f"{n} of {self.samples} were not balanced: {why}" for why, n in self.reasons.items()]
        for (good, n), said in zip(self.held.tolist(), ("no warning", "a warning"), strict=True):
            if n:
                low, high = (f"{100 * end:.1f}" for end in interval(good, n))
                notes.append(
                    f"first corrections with {said}: {good} of {n} of the 95 % regions hold the true one "
                    f"({low} to {high} %)"
                )
        drawn = counted(self.samples, "drawn machine")
        head = f"The limit is met by {first} as built{after}, of {drawn}."
        return Answer(head, text(self._columns()), self.warnings, tuple(notes))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; `probability` and `interval` are those after all corrections."""
        return {
            "kind": "balance",
            "samples": self.samples,
            "seed": self.seed,
            "warnings": list(self.warnings),
            "probability": int(self.met[-1]) / self.samples,
            "interval": list(interval(int(self.met[-1]), self.samples)),
            "rows": rows(self._columns()),
            "coverage": {
                said: {"held": held, "corrections": n}
                for said, (held, n) in zip(("silent", "warned"), self.held.tolist(), strict=True)
            },
            "not_balanced": dict(self.reasons),
        }

    def to_frame(self) -> pd.DataFrame:
        """Probabilities by corrections."""
        return frame(self._columns())

    def figure(self) -> Figure:
        """Which share of the machines lies below a ratio to the limit, as built and at last."""
        from rotorid.base.plot_style import on_figure
        from rotorid.study.study_pictures import draw_machines

        return on_figure(lambda ax: draw_machines(ax, self.ratios / self.samples))


@dataclass(frozen=True, eq=False, kw_only=True)
class StudiedStarts(Answered):
    """Minima by their χ² (m,), how many starts end there, and the numbers (m, n) by their names.

    Attributes
    ----------
    samples, seed, warnings, lost
        Starts, what they were drawn with, what was assumed of the data, and how many did not converge.
    """

    samples: int
    seed: int
    warnings: tuple[str, ...]
    lost: int
    chi_square: FloatArray
    found: IntArray
    names: tuple[str, ...]
    ends: FloatArray

    def _columns(self) -> tuple[Column, ...]:
        return (
            Column("minimum", range(1, len(self.found) + 1), str),
            Column("starts", self.found, str),
            Column("share", self.found / self.samples, "{:.3f}".format),
            Column("chi_square", self.chi_square, figures, "χ²"),
            *(Column(name, ends, figures) for name, ends in zip(self.names, self.ends.T, strict=True)),
        )

    @property
    def answer(self) -> Answer:
        """Whether more than one search found the best."""
        if not self.found.size:
            return Answer(f"None of {counted(self.samples, 'start')} converged.")
        alone = self.found[0] == 1
        words = ("a single start found the best minimum: there may be a better one",) if alone else ()
        times = f"{counted(int(self.found[0]), 'start')} of {self.samples} {'ends' if alone else 'end'}"
        head = f"{times} at the best of {counted(len(self.found), 'minimum', 'minima')}"
        notes = (f"{counted(self.lost, 'start')} did not converge",) if self.lost else ()
        return Answer(f"{head}.", text(self._columns(), width=COLUMNS), words, (*notes, *self.warnings))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; `probability` that a start ends at the best minimum."""
        best = int(self.found[0]) if self.found.size else 0
        return {
            "kind": "calibrate",
            "samples": self.samples,
            "seed": self.seed,
            "warnings": list(self.warnings),
            "probability": best / self.samples,
            "interval": list(interval(best, self.samples)),
            "not_converged": self.lost,
            "rows": rows(self._columns()),
        }

    def to_frame(self) -> pd.DataFrame:
        """The minima."""
        return frame(self._columns())
