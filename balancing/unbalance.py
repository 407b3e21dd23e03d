"""Unbalance at any stations from the readings of a single run: Y = W U, so that corrections are −U.

Source: [S] 1.9.1, (28)–(33), extended to more stations than readings. With the singular values
W = Σ u_i s_i v_iᴴ (rows divided by the errors of the readings where these are known) the estimate is
U = Σ f_i v_i (u_iᴴ Y) / s_i:

- f_i = 1 for s_i > 0: least squares where the readings determine every station, else the smallest unbalance
  (|U| least) that causes these readings;
- f_i = s_i² / (s_i² + λ²) ("ridge"): least |Y − W U|² + λ² |U|². λ is given, or such that the readings are
  met as well as their errors allow (discrepancy principle: Σ |r_i|²/σ_i² = 2 N).

U = G Y is linear in the readings: an error e of Y − W U moves it by G e, and U = R U_true without errors,
with the resolution matrix R = G W. Row q of R tells of which stations' unbalance the estimate of station q is
made: where it is that of the unit matrix, the station is determined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import HOPELESS, UndeterminedError
from balancing.conventions import Labels
from balancing.errors import mean_variance
from balancing.influence import Influence
from balancing.regions import real_parts
from balancing.tables import weight_columns
from balancing.trials import Trials, check_names
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.registry import Method, find
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import capital
from rotorid.regression import RCOND

if TYPE_CHECKING:
    import pandas as pd

METHODS: tuple[Method[None], ...] = (
    Method(
        "minimum-norm",
        "least squares where the readings suffice, else the smallest unbalance that explains them",
        None,
    ),
    Method("ridge", "small unbalances where the readings tell little", None),
)
DETERMINED = 0.05
"""Largest distance of a station's row of the resolution matrix from that of the unit matrix."""
LEVEL = 0.99
DRAWS = 400
_RANGE = 1e-10, 1e6  # of λ, relative to the largest singular value
_REASONS = "unbalance elsewhere, wrong coefficients or a nonlinear rotor are likely reasons"
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
        "least-squares", "minimum-norm" or "ridge".
    rank
        Number of independent combinations of the stations that are determined.
    resolution
        R with U = R U_true for readings without errors, shape (Q, Q).
    covariance
        Of (Re U₁, Im U₁, …) from the errors of the readings (and coefficients, if given), shape (2Q, 2Q);
        NaN: unknown. What the readings leave open is not in it.
    chi_square
        Σ |residual|²/σ² with σ of a reading in one direction; None where errors are unknown.
    condition_number
        Largest by smallest singular value of what is determined.
    ridge
        λ relative to the largest singular value; None without.
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
    ridge: float | None
    labels: Labels
    warnings: tuple[str, ...] = ()

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
    def std(self) -> FloatArray:
        """Standard deviation (Q,) in one direction (mean of both); NaN where a station is not determined."""
        variance = np.diag(self.covariance).reshape(-1, 2).mean(axis=1)
        return np.where(self.determined, np.sqrt(variance), np.nan)

    def words(self) -> str:
        """What the readings determine, in one sentence."""
        Q, sure = len(self.stations), self.determined
        if sure.all():
            return (
                f"the readings determine all {Q} stations" if Q > 1 else "the readings determine the station"
            )
        alone = [name for name, one in zip(self.stations, sure, strict=True) if one]
        text = f"the readings determine {self.rank} of {Q} independent combinations of the stations"
        text += f"; determined: {', '.join(alone)}" if alone else "; no station is determined by itself"
        open_ = [q for q in np.argsort(self.own_share) if not sure[q]]
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
        std = self.std * self.labels.weight_scale
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


def estimate_unbalance(
    W: ArrayLike,
    Y: ArrayLike,
    *,
    method: str = "minimum-norm",
    names: Sequence[str] | None = None,
    covariance: ArrayLike | None = None,
    ridge: float | None = None,
    labels: Labels | None = None,
) -> Unbalance:
    """Estimate the unbalance at Q stations from N readings (sensors × speeds) of one run.

    Parameters
    ----------
    W
        Influence coefficients, shape (N, Q), such as `model_influence(…).W.reshape(-1, Q)`.
    Y
        Complex readings, shape (N,).
    method
        One of `METHODS`.
    names
        Of the stations; default 1 … Q.
    covariance
        Of (Re Y, Im Y) of each reading, (N, 2, 2); rows then count by their variance. Default: unknown.
    ridge
        λ relative to the largest singular value, for "ridge"; default: by the errors.
    labels
        Units and conventions to print in; default SI.

    Raises
    ------
    ValueError
        For shapes that do not fit, NaN, options of another method, and a ridge without λ or errors.
    UndeterminedError
        Where no station has an effect.
    """
    A, y = np.asarray(W, dtype=complex), np.asarray(Y, dtype=complex)
    if A.ndim != 2 or 0 in A.shape or y.shape != A.shape[:1]:
        raise ValueError(f"coefficients (N, Q) and readings (N,) are needed; got {A.shape} and {y.shape}")
    if not (np.isfinite(A).all() and np.isfinite(y).all()):
        raise ValueError("influence coefficients and readings must be finite; found NaN or infinity")
    if covariance is None:
        return _estimate(
            A, y, method, names, None, lambda _: np.zeros((0, len(y)), dtype=complex), ridge, labels
        )
    C = np.array(covariance, dtype=np.float64)
    if C.shape != (len(y), 2, 2) or not np.isfinite(C).all() or not C.any():
        raise ValueError(
            f"the covariance of the readings must be finite, not all zero, of shape ({len(y)}, 2, 2)"
        )
    values, axes = np.linalg.eigh(C)
    z = np.random.default_rng(0).standard_normal((DRAWS, len(y), 2)) * np.sqrt(np.maximum(values, 0.0))
    e = np.einsum("nij,dnj->dni", axes, z)
    return _estimate(
        A, y, method, names, mean_variance(C), lambda _: e[..., 0] + 1j * e[..., 1], ridge, labels
    )


def unbalance_of_run(
    influence: Influence,
    baseline: Trials | ArrayLike | None = None,
    *,
    method: str = "minimum-norm",
    ridge: float | None = None,
) -> Unbalance:
    """Estimate the unbalance at the planes of the coefficients from a baseline run, with its errors.

    Parameters
    ----------
    influence
        Coefficients of any stations, such as `model_influence(…)`.
    baseline
        As in `correct`: runs (what is mounted in them is taken into account), complex amplitudes (S, C) of
        the bare rotor, or nothing where the coefficients have a baseline.
    method, ridge
        As in `estimate_unbalance`.

    Raises
    ------
    ValueError
        As `correct` and `estimate_unbalance`.
    """
    today = influence if baseline is None else influence.rebased(baseline)
    if not today.has_baseline:
        raise ValueError("there is no vibration to explain: give the readings of a baseline run")
    Q = len(today.planes)
    variance = mean_variance(today.channels()[..., :2, :2]).ravel() if today.known_errors else None
    W, Y = today.W.reshape(-1, Q), today.baseline.ravel()

    def errors(U: ComplexArray) -> ComplexArray:
        drawn = [(y - w @ U).reshape(len(y), -1) for y, w in today.draws(DRAWS)]
        return np.concatenate([np.zeros((0, len(Y)), dtype=complex), *(each - (Y - W @ U) for each in drawn)])

    unit = {"weight_unit": influence.labels.weight_unit, "weight_scale": influence.labels.weight_scale}
    labels = replace(today.labels, **unit)  # type: ignore[arg-type]
    found = _estimate(W, Y, method, today.planes, variance, errors, ridge, labels)
    if variance is not None:  # errors of the coefficients count by the unbalance
        variance = np.mean(np.abs(errors(found.unbalance)) ** 2, axis=0) / 2
        found = _estimate(W, Y, method, today.planes, variance, errors, ridge, labels)
    return replace(found, warnings=today.remarks.warnings + found.warnings)


def _estimate(
    A: ComplexArray,
    y: ComplexArray,
    method: str,
    names: Sequence[str] | None,
    variance: FloatArray | None,
    errors: Callable[[ComplexArray], ComplexArray],
    ridge: float | None,
    labels: Labels | None,
) -> Unbalance:
    """With errors (n, N) of Y − W U, drawn for an unbalance."""
    N, Q = A.shape
    stations = check_names(names or [str(q) for q in range(1, Q + 1)], "stations")
    if len(stations) != Q:
        raise ValueError(f"{Q} names of stations are needed; got {len(stations)}")
    find(METHODS, method, "method")
    if method != "ridge" and ridge is not None:
        raise ValueError(f'ridge is an option of the method "ridge", not of {method!r}')
    if ridge is not None and not (np.isfinite(ridge) and ridge > 0):
        raise ValueError(f"ridge must be a finite number > 0, not {ridge}")
    if method == "ridge" and ridge is None and variance is None:
        raise ValueError("a ridge needs its strength, or errors of the readings to choose it by")
    if not A.any():
        raise UndeterminedError("no station has an effect on any reading: check the coefficients")
    # none counts infinitely much
    sigma = np.ones(N) if variance is None else np.sqrt(np.maximum(variance, 1e-8 * variance.max()))
    # the columns are not scaled: the norm of stations has a meaning
    left, s, right = np.linalg.svd(A / sigma[:, None], full_matrices=False)
    rank = int(np.count_nonzero(s > RCOND * s[0]))
    left, s, right = left[:, :rank], s[:rank], right[:rank]
    used = None
    if method == "ridge":
        used = ridge or _by_discrepancy(s, left, y / sigma)
    G = (right.conj().T * (s / (s**2 + ((used or 0.0) * s[0]) ** 2))) @ left.conj().T / sigma
    U = G @ y
    residual = y - A @ U
    drawn = errors(U)
    covariance, chi_square = np.full((2 * Q, 2 * Q), np.nan), None
    warnings: tuple[str, ...] = ()
    if len(drawn):
        covariance = np.atleast_2d(np.cov(real_parts(drawn @ G.T).T))
        chi_square = float(np.sum(np.abs(residual / sigma) ** 2))
        others = np.sum(np.abs((drawn - drawn @ G.T @ A.T) / sigma) ** 2, axis=1)
        usual = float(np.quantile(others, LEVEL))
        if method != "ridge" and rank < N and chi_square > usual:
            ratio = np.sqrt(chi_square / float(np.mean(others)))
            warnings = (
                f"the readings differ from what unbalance at these stations causes by {ratio:.2g} times "
                f"their errors: {_REASONS}",
            )
    if method == "minimum-norm" and s[0] > HOPELESS * s[-1]:
        warnings += (
            f"small errors of the readings become large unbalances (condition number {s[0] / s[-1]:.2g}): "
            'use the method "ridge", or fewer stations',
        )
    if used is not None and ridge is None and used >= 0.99 * _RANGE[1]:
        warnings += ("the readings lie within their errors: they show no unbalance at all",)
    if used is not None and ridge is None and used <= 1.01 * _RANGE[0]:
        warnings += (f"no unbalance at these stations meets the readings within their errors: {_REASONS}",)
    return Unbalance(
        stations=stations,
        unbalance=U,
        residual=residual,
        method="least-squares" if method == "minimum-norm" and rank == Q else method,
        rank=rank,
        resolution=G @ A,
        covariance=covariance,
        chi_square=chi_square,
        condition_number=float(s[0] / s[-1]),
        ridge=used,
        labels=labels or Labels(weight_unit="kg_m"),
        warnings=warnings,
    )


def _by_discrepancy(s: FloatArray, left: ComplexArray, y: ComplexArray) -> float:
    """λ, relative to the largest s, at which Σ |r|² = 2 N (the residual grows with λ)."""
    along = np.abs(left.conj().T @ y) ** 2
    rest = np.sum(np.abs(y) ** 2) - along.sum()
    strengths = np.geomspace(*_RANGE, 4000)
    lost = 1 / (1 + (s / (strengths[:, None] * s[0])) ** 2)
    return float(np.exp(np.interp(2 * len(y), rest + lost**2 @ along, np.log(strengths))))


def _percent(share: float) -> str:
    """Of a station that is not determined: never 100, never below 0."""
    return f"{min(max(100 * share, 0.0), 99.0):.0f}"
