"""Trade-off of residual vibration against total weight of all planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import check_planes
from balancing.correction.best_planes import Criterion, criterion_words
from balancing.data.conventions import Labels
from balancing.data.result_columns import three_figures, weight_rows
from balancing.solvers.conditioning import check_stack
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.regression import gain

if TYPE_CHECKING:
    import pandas as pd

KNEE = 3.0
"""A point is a knee where weight does on average at least so many times as much before it as behind it."""
ROUNDING = 1e-6
"""A weight below this share of the total is what the solver leaves of zero."""


@dataclass(frozen=True, eq=False)
class TradeOff(Answered):
    """The least vibration that a total weight can leave, from no weight to the best correction.

    Attributes
    ----------
    planes
        Names, P.
    totals
        Σ |D_p|, shape (K,), rising from zero.
    weights
        Shape (K, P).
    rms, largest
        Of the predicted readings, shape (K,).
    objective
        What is minimised: rms or largest of the readings times their row weights, shape (K,), falling.
    criterion
        "rms" or "max".
    knee
        Index of the point behind which more weight pays little: where the curve lies farthest below the
        straight line between its ends, both axes counted from end to end as 0 … 1, if weight does on average
        at least `KNEE` times as much before it as behind it. None: no such point.
    labels
        Units and conventions to print in.
    weighted
        Whether the readings count differently.
    """

    planes: tuple[str, ...]
    totals: FloatArray
    weights: ComplexArray
    rms: FloatArray
    largest: FloatArray
    objective: FloatArray
    criterion: Criterion
    knee: int | None
    labels: Labels
    weighted: bool = False

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions."""
        weights = [weight_rows(self.labels, self.planes, own) for own in self.weights]
        return plain(
            {
                "criterion": self.criterion,
                "conventions": self.labels.conventions(),
                "knee": self.knee,
                "points": rows((*self._columns(), Column("weights", weights))),
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per point: total, rms_after, max_after, knee, and mass and angle of each plane.

        The columns of a plane NAME are `NAME_mass` and `NAME_angle_deg`.
        """
        mass, angle = self.labels.weight(self.weights)
        each = [
            Column(f"{plane}_{kind}", values[:, p])
            for p, plane in enumerate(self.planes)
            for kind, values in (("mass", mass), ("angle_deg", angle))
        ]
        knee = Column("knee", np.arange(len(self.totals)) == self.knee)
        return frame((*self._columns(), knee, *each))

    @property
    def answer(self) -> Answer:
        """Where the knee is; then the curve, the knee marked."""
        vibration = self.labels.vibration_in
        gained = self.objective[0] - self.objective[-1]
        share = (self.objective[0] - self.objective) / (gained if gained > 0 else 1.0)
        marks = ["← knee" if k == self.knee else "" for k in range(len(share))]
        shown = (
            *self._columns(),
            Column("of the whole effect", share * (gained > 0), lambda part: f"{100 * part:.0f} %"),
            Column("", marks, str),
        )
        what = criterion_words(self.criterion, weighted=self.weighted)
        head = f"The least {what} that a total weight leaves{f' ({vibration})' if vibration else ''}"
        return Answer(self._words(), tables=(f"{head}\n{text(shown, left=0)}",), more="trade-off")

    def _columns(self) -> tuple[Column, ...]:
        labels, scale = self.labels, self.labels.vibration_scale
        total = "total" + (f", {labels.weight_in}" if labels.weight_in else "")
        return (
            Column("total", self.totals * labels.weight_scale, three_figures, total),
            Column("rms_after", self.rms * scale, three_figures, "rms"),
            Column("max_after", self.largest * scale, three_figures, "largest"),
        )

    def _words(self) -> str:
        if self.knee is None:
            if len(self.totals) == 1:
                return "There is nothing to take away."
            return "There is no clear knee: the last weights pay nearly as well as the first."
        scale, best = self.labels.weight_scale, self.objective[0] - self.objective[-1]
        share = (self.objective[0] - self.objective[self.knee]) / best
        return (
            f"The knee: {three_figures(self.totals[self.knee] * scale)} of "
            f"{three_figures(self.totals[-1] * scale)} {self.labels.weight_in} bring {100 * share:.0f} % of "
            "the effect; more weight pays little."
        )


def trade_off(
    W: ArrayLike,
    Y: ArrayLike,
    planes: Sequence[str],
    *,
    criterion: Criterion = "rms",
    points: int = 15,
    row_weights: ArrayLike | None = None,
    labels: Labels | None = None,
) -> TradeOff:
    """Minimise the residual for total weights Σ |D_p| from zero to that of the best correction.

    Parameters
    ----------
    W, Y
        Stacked influence coefficients (N, P) and vibration (N,).
    planes
        Names, P.
    criterion
        Whether the rms or the largest amplitude is made small.
    points
        Of the curve, at least 3, placed where it is long: each halves, in total weight, the longest piece of
        the curve so far (both axes counted from end to end as 0 … 1).
    row_weights
        How much each reading counts, (N,), ≥ 0; default all alike.
    labels
        Units to print in.

    Raises
    ------
    ValueError
        For too few points, an unknown criterion, NaN, shapes that do not fit.
    UndeterminedError
        For planes that act alike exactly: there is no best correction to end at.

    Notes
    -----
    Each point is a cone program (`balancing.solvers.cone`). The curve is convex.
    """
    from balancing.solvers.cone import problem, solve_cone

    K, y, w = check_stack(W, Y, row_weights)
    if len(planes) != K.shape[1] or len(set(planes)) != K.shape[1]:
        raise ValueError(f"{K.shape[1]} different names of planes are needed; got {list(planes)}")
    if criterion not in ("rms", "max"):
        raise ValueError(f"a trade-off is of 'rms' or of 'max', not of {criterion!r}")
    if points < 3:
        raise ValueError(f"a curve has at least 3 points; got {points}")
    A = w[:, None] * K
    check_planes(A[w > 0], planes)

    def objective(D: ComplexArray) -> float:
        size = np.abs(w * (y + K @ D))
        return float(size.max() if criterion == "max" else np.sqrt(np.mean(size**2)))

    best = solve_cone(problem(K, y, w, minmax=True)).weights if criterion == "max" else -gain(A) @ (w * y)
    found = [(0.0, objective(np.zeros_like(best)), np.zeros_like(best))]
    total = float(np.abs(best).sum())
    if total > 0:
        found.append((total, objective(best), best))
    while 1 < len(found) < points:
        place, budget = _longest([t for t, _, _ in found], [v for _, v, _ in found])
        D = solve_cone(problem(K, y, w, minmax=criterion == "max", budget=budget)).weights
        D = np.where(np.abs(D) > ROUNDING * budget, D, 0.0)
        found.insert(place, (budget, objective(D), D))
    return _result(planes, K, y, found, criterion, labels or Labels(), weighted=bool(np.ptp(w) > 0))


def _longest(totals: list[float], values: list[float]) -> tuple[int, float]:
    """Where to insert a point, and its total: in the middle of the longest piece."""
    across = np.diff(totals) / totals[-1]
    down = np.diff(values) / max(values[0] - values[-1], np.finfo(float).tiny)
    place = int(np.argmax(np.hypot(across, down)))
    return place + 1, (totals[place] + totals[place + 1]) / 2


def _result(
    planes: Sequence[str],
    K: ComplexArray,
    y: ComplexArray,
    found: list[tuple[float, float, ComplexArray]],
    criterion: Criterion,
    labels: Labels,
    *,
    weighted: bool,
) -> TradeOff:
    weights = np.array([D for _, _, D in found])
    totals = np.abs(weights).sum(axis=1)
    values = np.array([v for _, v, _ in found])
    size = np.abs(y + weights @ K.T)
    return TradeOff(
        planes=tuple(planes),
        totals=totals,
        weights=weights,
        rms=np.sqrt(np.mean(size**2, axis=1)),
        largest=size.max(axis=1),
        objective=values,
        criterion=criterion,
        knee=knee(totals, values),
        labels=labels,
        weighted=weighted,
    )


def knee(totals: FloatArray, values: FloatArray) -> int | None:
    """Index of the point farthest below the straight line between the ends of a falling curve (K,).

    Both axes are counted from end to end as 0 … 1. None: on average the curve falls less than `KNEE` times as
    steeply before that point as behind it, or nothing falls.

    Examples
    --------
    >>> knee(np.array([0.0, 1, 2, 10]), np.array([10.0, 4, 3, 2]))
    2
    """
    across, down = totals[-1] - totals[0], values[0] - values[-1]
    if not (across > 0 and down > 0):
        return None
    x, y = (totals - totals[0]) / across, (values - values[-1]) / down
    place = int(np.argmax(1 - x - y))
    # slopes: (1 − y) / x before, y / (1 − x) behind
    clear = (1 - y[place]) * (1 - x[place]) >= KNEE * x[place] * y[place]
    return place if clear and 0 < place < len(x) - 1 else None
