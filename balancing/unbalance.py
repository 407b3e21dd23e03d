"""Unbalance at any stations from the readings of a single run: Y = W U, so that corrections are −U.

Source: [S] 1.9.1, (28)–(33), extended to more stations than readings. With the singular values
W = Σ u_i s_i v_iᴴ (rows divided by the errors of the readings where these are known) the estimate is
U = Σ v_i (u_iᴴ Y) / s_i over s_i > 0: least squares where the readings determine every station, else the
smallest unbalance (|U| least) that causes these readings.

U = G Y is linear in the readings: an error e of Y moves it by G e, and U = R U_true without errors, with the
resolution matrix R = G W. Row q of R tells of which stations' unbalance the estimate of station q is made:
where it is that of the unit matrix, the station is determined. The coefficients count as exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import HOPELESS, UndeterminedError, check_stack
from balancing.conventions import Labels
from balancing.influence import Influence
from balancing.printed_readings import weight_columns
from balancing.regions import NORMAL_RADIUS, real_parts
from balancing.trials import Trials, check_names
from balancing.what_if import todays
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import capital, figures, listing
from rotorid.regression import RCOND

if TYPE_CHECKING:
    import pandas as pd

DETERMINED = 0.05
"""Largest distance of a station's row of the resolution matrix from that of the unit matrix."""


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
        "least-squares" or "minimum-norm".
    rank
        Number of independent combinations of the stations that are determined.
    resolution
        R with U = R U_true for readings without errors, shape (Q, Q).
    covariance
        Of (Re U₁, Im U₁, …) from the errors of the readings, shape (2Q, 2Q); NaN: unknown. What the readings
        leave open, and errors of the coefficients, are not in it.
    chi_square
        Σ |residual|²/σ² with σ of a reading in one direction; None where errors are unknown.
    condition_number
        Largest by smallest singular value of what is determined.
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
    covariance: FloatArray
    chi_square: float | None
    condition_number: float
    labels: Labels
    warnings: tuple[str, ...] = ()

    @property
    def own_share(self) -> FloatArray:
        """How much of a station's estimate is its own unbalance, Re R_qq, shape (Q,); 1: all."""
        return np.diag(self.resolution).real

    @property
    def determined(self) -> BoolArray:
        """Whether the readings determine a station (to 5 %), whatever stands elsewhere, shape (Q,)."""
        away = np.linalg.norm(self.resolution - np.eye(len(self.stations)), axis=1)
        return np.asarray(away < DETERMINED)

    @property
    def std(self) -> FloatArray:
        """Standard deviation (Q,) in one direction (mean of both); NaN where a station is not determined."""
        variance = np.diag(self.covariance).reshape(-1, 2).mean(axis=1)
        return np.where(self.determined, np.sqrt(variance), np.nan)

    def words(self) -> str:
        """What the readings determine, in one sentence."""
        Q, sure = len(self.stations), self.determined
        if sure.all():
            return f"the readings determine {f'all {Q} stations' if Q > 1 else 'the station'}"
        others = np.abs(self.resolution - np.diag(np.diag(self.resolution)))
        alone = [name for name, one in zip(self.stations, sure, strict=True) if one]
        open_ = [
            f"{self.stations[q]} (mixed most with {self.stations[int(np.argmax(others[q]))]})"
            for q in np.argsort(self.own_share)
            if not sure[q]
        ]
        return (
            f"the readings determine {self.rank} of {Q} independent combinations of the stations; determined"
            f": {listing(alone, 'and') or 'none by itself'}; not determined: {listing(open_, 'and')}"
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the labels' units and conventions; what is unknown is None."""
        return plain(
            {
                "stations": records(self._columns()),
                "method": self.method,
                "rank": self.rank,
                "condition_number": self.condition_number,
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
        std = self.std * self.labels.weight_scale
        return (
            replace(station, heading="station"),
            replace(size, heading="unbalance", shown="{:.4g}".format),
            unit,
            angle,
            Column("std", std, lambda one: f"± {figures(NORMAL_RADIUS * one, 2)}", title="95 %"),
            Column("own_share", self.own_share, None),
            Column("determined", self.determined, None),
        )

    @property
    def answer(self) -> Answer:
        """What is determined, and the unbalance of each station with its 95 % region."""
        sure = [
            "yes" if alone else f"no ({min(max(100 * share, 0.0), 99.0):.0f} % its own)"
            for alone, share in zip(self.determined, self.own_share, strict=True)
        ]
        assumed = (self.labels.assumed_in_words(),) if self.labels.assumed else ()
        return Answer(
            f"{capital(self.words())} ({self.method}).",
            text((*self._columns(), Column("", sure, title="determined"))),
            assumed + self.warnings,
        )


def estimate_unbalance(
    W: ArrayLike,
    Y: ArrayLike,
    *,
    names: Sequence[str] | None = None,
    errors: ArrayLike | None = None,
    labels: Labels | None = None,
) -> Unbalance:
    """Estimate the unbalance at Q stations from N readings (sensors × speeds) of one run.

    Parameters
    ----------
    W
        Influence coefficients, shape (N, Q), such as `model_influence(…).W.reshape(-1, Q)`.
    Y
        Complex readings, shape (N,).
    names
        Of the stations; default 1 … Q.
    errors
        Drawn errors of the readings, complex, shape (draws, N); rows then count by their variance. Default:
        unknown.
    labels
        Units and conventions to print in; default SI.

    Raises
    ------
    ValueError
        For shapes that do not fit, and NaN.
    UndeterminedError
        Where no station has an effect.
    """
    A, y, _ = check_stack(W, Y)
    N, Q = A.shape
    drawn = np.zeros((0, N)) if errors is None else np.asarray(errors, dtype=complex)
    stations = check_names(names or [str(q) for q in range(1, Q + 1)], "stations")
    if not np.isfinite(drawn.sum()) or drawn.shape[1:] != (N,) or len(stations) != Q:
        raise ValueError(f"{N} errors of each draw must be finite, with {Q} names of stations")
    if not A.any():
        raise UndeterminedError("no station has an effect on any reading: check the coefficients")
    variance = np.mean(np.abs(drawn) ** 2, axis=0) / 2 if drawn.any() else np.ones(N)
    sigma = np.sqrt(np.maximum(variance, 1e-8 * variance.max()))  # none counts infinitely much
    # the columns are not scaled: the norm of stations has a meaning
    left, s, right = np.linalg.svd(A / sigma[:, None], full_matrices=False)
    rank = int(np.count_nonzero(s > RCOND * s[0]))
    left, s, right = left[:, :rank], s[:rank], right[:rank]
    G = (right.conj().T / s) @ left.conj().T / sigma
    U, condition, warnings = G @ y, float(s[0] / s[-1]), list[str]()
    residual, covariance, chi_square = y - A @ U, np.full((2 * Q, 2 * Q), np.nan), None
    if condition > HOPELESS:
        warnings.append(
            f"small errors of the readings become large unbalances (condition number {condition:.2g}): use "
            "fewer stations"
        )
    if len(drawn):
        moved = drawn @ G.T
        covariance = np.atleast_2d(np.cov(real_parts(moved).T))
        chi_square, *others = np.sum(np.abs([residual, *(drawn - moved @ A.T)] / sigma) ** 2, axis=1).tolist()
        if rank < N and chi_square > np.quantile(others, 0.99):
            ratio = np.sqrt(chi_square / np.mean(others))
            warnings.append(
                "the readings differ from what unbalance at these stations causes by "
                f"{ratio:.2g} times their errors: unbalance elsewhere, wrong coefficients or a nonlinear "
                "rotor are likely reasons"
            )
    return Unbalance(
        stations=stations,
        unbalance=U,
        residual=residual,
        method="least-squares" if rank == Q else "minimum-norm",
        rank=rank,
        resolution=G @ A,
        covariance=covariance,
        chi_square=chi_square,
        condition_number=condition,
        labels=labels or Labels(weight_unit="kg_m"),
        warnings=tuple(warnings),
    )


def unbalance_of_run(
    influence: Influence,
    baseline: Trials | ArrayLike | None = None,
) -> Unbalance:
    """Estimate the unbalance at the planes of the coefficients from a baseline run, with its errors.

    Parameters
    ----------
    influence
        Coefficients of any stations, such as `model_influence(…)`; they count as exact.
    baseline
        As in `correct`: runs (what is mounted in them is taken into account), complex amplitudes (S, C) of
        the bare rotor, or nothing where the coefficients have a baseline.

    Raises
    ------
    ValueError
        As `correct` and `estimate_unbalance`.
    """
    today = todays(influence, baseline)
    of = influence.labels
    result = estimate_unbalance(
        today.W.reshape(-1, len(today.planes)),
        today.baseline.ravel(),
        names=today.planes,
        errors=[off.ravel() for y, _ in today.draws() for off in y - today.baseline] or None,
        labels=replace(today.labels, weight_unit=of.weight_unit, weight_scale=of.weight_scale),
    )
    return replace(result, warnings=today.remarks.warnings + result.warnings)
