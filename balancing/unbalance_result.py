"""Unbalance at stations: the result; it is found in `balancing.unbalance`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.data.conventions import Labels
from balancing.data.result_columns import known, weight_columns
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import capital

if TYPE_CHECKING:
    import pandas as pd


DETERMINED = 0.05
"""Largest distance of a station's row of the resolution matrix from that of the unit matrix."""

_NAMED = 3


@dataclass(frozen=True, eq=False)
class Unbalance(Answered):
    """Unbalance at Q stations that explains N readings.

    Attributes
    ----------
    stations
        Names, length Q.
    unbalance
        U, kg·m (or kg, as the coefficients are), angle with the rotation from the mark, shape (Q,).
    residual
        Y − W U, shape (N,).
    method
        "least-squares", "minimum-norm", "ridge" or "modal".
    rank
        Number of independent combinations of the stations (of the modes, for "modal") that are determined.
    resolution
        R with U = R U_true for readings without errors, shape (Q, Q).
    covariance
        Of (Re U₁, Im U₁, …) from the errors of the readings (and coefficients, if given), shape (2Q, 2Q);
        None: unknown. What the readings leave open is not in it.
    chi_square
        Σ |residual|²/σ² with σ of a reading in one direction, its correlations with others allowed for; None
        where errors are unknown.
    condition_number
        Largest by smallest singular value of what is determined.
    ridge
        λ relative to the largest singular value; None without.
    modal
        Modal unbalances φ_jᵀ U, shape (k,); None for other methods.
    labels
        Units and conventions to print in.
    warnings
        What the user should know.
    """

    stations: tuple[str, ...]
    unbalance: ComplexArray
    residual: ComplexArray
    method: str
    rank: int
    resolution: ComplexArray
    covariance: FloatArray | None
    chi_square: float | None
    condition_number: float
    ridge: float | None
    modal: ComplexArray | None
    labels: Labels
    warnings: tuple[str, ...] = ()

    def with_warnings(self, warnings: tuple[str, ...]) -> Unbalance:
        """The same, with warnings and arrays that cannot be changed."""
        for name in ("unbalance", "residual", "resolution", "covariance", "modal"):
            array = getattr(self, name)
            if array is not None:
                array.flags.writeable = False
        return replace(self, warnings=warnings)

    @property
    def corrections(self) -> ComplexArray:
        """Weights that balance it, −U, shape (Q,)."""
        return np.asarray(-self.unbalance)

    @property
    def own_share(self) -> FloatArray:
        """How much of a station's estimate is its own unbalance, Re R_qq, shape (Q,); 1: all."""
        return np.asarray(np.diag(self.resolution).real)

    @property
    def determined(self) -> BoolArray:
        """Whether the readings determine a station (to 5 %), whatever stands elsewhere, shape (Q,)."""
        away = np.linalg.norm(self.resolution - np.eye(len(self.stations)), axis=1)
        return np.asarray(away < DETERMINED)

    @property
    def std(self) -> FloatArray | None:
        """Standard deviation (Q,) in one direction (mean of both); NaN where a station is not determined."""
        if self.covariance is None:
            return None
        variance = np.diag(self.covariance).reshape(-1, 2).mean(axis=1)
        return np.where(self.determined, np.sqrt(np.maximum(variance, 0.0)), np.nan)

    def words(self) -> str:
        """What the readings determine, in one sentence."""
        Q, known = len(self.stations), self.determined
        if self.modal is not None:
            k = len(self.modal)
            modes = "mode 1" if k == 1 else f"modes 1 to {k}"
            return (
                f"the readings determine what excites {modes}; along the rotor the unbalance is shown "
                "as the smallest one that does the same"
            )
        if known.all():
            return (
                f"the readings determine all {Q} stations" if Q > 1 else "the readings determine the station"
            )
        alone = [name for name, sure in zip(self.stations, known, strict=True) if sure]
        text = f"the readings determine {self.rank} of {Q} independent combinations of the stations"
        text += f"; determined: {', '.join(alone)}" if alone else "; no station is determined by itself"
        open_ = [q for q in np.argsort(self.own_share) if not known[q]]
        parts = []
        for q in open_[:_NAMED]:
            row = np.abs(self.resolution[q])
            others = [i for i in np.argsort(-row) if i != q and row[i] > 0.1 * row.max()][:_NAMED]
            mixed = f", mixed with {', '.join(self.stations[i] for i in others)}" if others else ""
            parts.append(f"{self.stations[q]} ({_percent(self.own_share[q])} % its own{mixed})")
        more = f" and {len(open_) - _NAMED} more" if len(open_) > _NAMED else ""
        return f"{text}; not determined: {', '.join(parts)}{more}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the labels' units and conventions; what is unknown is None."""
        return plain(
            {
                "stations": rows(self._columns()),
                "method": self.method,
                "rank": self.rank,
                "condition_number": self.condition_number,
                "ridge": self.ridge,
                "chi_square": self.chi_square,
                "words": self.words(),
                "conventions": self.labels.conventions(),
                "warnings": self.warnings,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per station: unbalance, unit, angle_deg, std (NaN: unknown), own_share, determined."""
        return frame(self._columns())

    def _columns(self) -> tuple[Column, ...]:
        station, size, unit, angle = weight_columns(self.labels, self.stations, self.unbalance)
        std = known(self.std, len(self.stations)) * self.labels.weight_scale
        return (
            replace(station, name="station"),
            replace(size, name="unbalance", shown="{:.5g}".format),
            unit,
            angle,
            Column("std", std, "± {:.3g}".format, "1 std"),
            Column("own_share", self.own_share),
            Column("determined", self.determined),
        )

    @property
    def answer(self) -> Answer:
        """What is determined, and the unbalance of each station with its standard deviation."""
        sure = [
            "yes" if alone else f"no ({_percent(share)} % its own)"
            for alone, share in zip(self.determined, self.own_share, strict=True)
        ]
        assumed = (self.labels.assumed_in_words(),) if self.labels.assumed else ()
        return Answer(
            f"{capital(self.words())} ({self.method}).",
            text((*self._columns(), Column("", sure, str, "determined"))),
            assumed + self.warnings,
        )


def _percent(share: float) -> str:
    """Of a station that is not determined: never 100, never below 0."""
    return f"{min(max(100 * share, 0.0), 99.0):.0f}"
