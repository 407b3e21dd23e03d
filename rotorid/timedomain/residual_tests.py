"""Tests of the residuals of a fit: are they noise, and is it the same noise everywhere?

A series is one output of one record. Every series is judged by itself: the outputs may have other units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.methods.least_squares_problem import Problem

UNEXPLAINED = 0.05
"""Share of a series' variance in residuals that are not white above which it is not described."""
MISFIT = 4.0
"""χ² per degree of freedom above which stated errors do not explain the residuals."""
FEWEST = 20
"""Samples below which nothing can be said of correlations."""
LAGS = 10
UNEQUAL = 1.5
"""Ratio of the errors of two outputs above which they are called different."""
FEW_UNEXPLAINED = 0.2
"""The same share with too few samples to tell noise from a wrong model."""
LINE = 0.5
"""Share of the residuals' variance in three neighbouring frequencies above which they are no noise."""
HINT = (
    "a local minimum or an unsuitable model; try other starting values, bounds, several starts or multiple "
    "shooting. No intervals are given"
)


@dataclass(frozen=True)
class Correlation:
    """Of residuals with those some samples later.

    Attributes
    ----------
    neighbours
        Of neighbouring samples.
    probability
        Of such correlations up to the tenth neighbour in white residuals (Box and Pierce 1970).
    factor
        How many times too narrow intervals are, about; 1 where the correlations do not widen them.
    """

    neighbours: float
    probability: float
    factor: float

    @property
    def widening(self) -> float:
        """By what intervals are multiplied; 1 where the residuals may be white, or it does not matter."""
        return self.factor if self.probability < 1e-4 and self.factor > 1.2 else 1.0

    def words(self) -> str:
        """A warning, or nothing."""
        if not self.probability < 1e-4:
            return ""
        longer = f": intervals were made {self.widening:.2g} times as wide" if self.widening > 1 else ""
        return (
            "the residuals are not random: those of neighbouring samples are correlated "
            f"({self.neighbours:.2f}, Durbin–Watson {2 - 2 * self.neighbours:.2f}){longer}. Either the noise "
            "is, or the model does not quite describe the record, or this is a local minimum (try several "
            "starts)"
        )


def rounding_only(problem: Problem, r: FloatArray) -> bool:
    """Whether nothing but rounding is left."""
    return bool(np.linalg.norm(r) <= 1e-7 * np.linalg.norm(problem.data))


def correlation(problem: Problem, r: FloatArray) -> Correlation | None:
    """Over all series, each in its own unit; None where there is nothing to say."""
    if len(r) < FEWEST or rounding_only(problem, r):
        return None
    return _correlation([_unit(part) for part in _series(problem, r)])


def misfit(problem: Problem, dof: int, r: FloatArray, loss: str) -> str:
    """Words where the model does not describe the record: intervals would be wrong."""
    if dof <= 0 or rounding_only(problem, r):
        return ""
    if problem.stated:
        ratio = float(r @ r) / dof
        if loss == "linear" and ratio > MISFIT and chance(float(r @ r), dof) < 1e-6:
            return f"residuals are {np.sqrt(ratio):.2g} times as large as the stated errors explain: {HINT}"
        return ""
    for name, data, part in zip(
        problem.series, _series(problem, problem.data), _series(problem, r), strict=True
    ):
        kept = part if loss == "linear" else _without_outliers(part)
        spread = float(np.sum((data - data.mean()) ** 2))
        share = float(kept @ kept) / spread if spread > 0 else 0.0
        left = f"the model leaves {100 * share:.2g} % of the variance of {name}"
        if len(part) < FEWEST:
            if share > FEW_UNEXPLAINED and len(part) > 2:
                return f"{left}, in too few samples to tell whether that is noise; if not, {HINT}"
            continue
        random = _correlation([_unit(kept)]).probability > 1e-6
        if not random and share > UNEXPLAINED:
            return f"{left}, and not as noise: {HINT}"
        if not random and _line(kept) > LINE:
            return f"{left}, most of it at one frequency: {HINT}; state the errors if it is interference"
    return ""


def unequal(problem: Problem, n_parameters: int, r: FloatArray) -> FloatArray | None:
    """Variance of a residual of each series (g,), where these differ (Bartlett 1937); None where not."""
    parts = _series(problem, r)
    counts = np.array([len(part) for part in parts], dtype=float)
    freedom = counts * (1 - n_parameters / counts.sum())
    if len(parts) < 2 or (freedom < 4).any() or rounding_only(problem, r):
        return None
    variances = np.array([float(part @ part) for part in parts]) / freedom
    if not (variances > 0).all():
        return None
    pooled = float(freedom @ variances / freedom.sum())
    test = freedom.sum() * np.log(pooled) - float(freedom @ np.log(variances))
    k = len(parts) - 1
    test /= 1 + (np.sum(1 / freedom) - 1 / freedom.sum()) / (3 * k)
    if variances.max() < UNEQUAL**2 * variances.min() or chance(float(test), k) > 1e-3:
        return None
    return np.asarray(variances)


def output_errors(problem: Problem, r: FloatArray, n_parameters: int) -> dict[str, float] | None:
    """Standard deviation of each output from its residuals; None where only rounding is left."""
    if rounding_only(problem, r):
        return None
    squares: dict[str, tuple[float, int]] = {}
    outputs = [
        name
        for mask in problem.masks
        for name, count in zip(problem.model.outputs, mask.sum(axis=1), strict=True)
        if count
    ]
    for name, part in zip(outputs, _series(problem, problem.plain(r)), strict=True):
        total, count = squares.get(name, (0.0, 0))
        squares[name] = total + float(part @ part), count + len(part)
    share = 1 - min(n_parameters / len(r), 0.9)
    found = {name: float(np.sqrt(total / (count * share))) for name, (total, count) in squares.items()}
    least = 1e-6 * max(found.values())  # an output that is met exactly would count for everything
    return {name: max(size, least) for name, size in found.items()}


def settled(errors: Mapping[str, float], before: Mapping[str, float]) -> bool:
    """Whether estimated errors have stopped changing."""
    return bool(before) and all(abs(size - before[name]) <= 0.002 * size for name, size in errors.items())


def chance(chi_square: float, dof: int) -> float:
    """Probability of a larger χ²."""
    from scipy.special import chdtrc

    return float(chdtrc(dof, chi_square))


def _series(problem: Problem, r: FloatArray) -> list[FloatArray]:
    return np.split(r, np.cumsum(problem.groups)[:-1])


def _unit(part: FloatArray) -> FloatArray:
    size = float(np.sqrt(np.mean(part**2)))
    return part / size if size > 0 else part


def _correlation(parts: Sequence[FloatArray]) -> Correlation:
    total = sum(float(part @ part) for part in parts)
    lags = range(1, 1 + min(LAGS, max(1, min(len(part) for part in parts) // 5)))
    if total == 0:
        return Correlation(0.0, 1.0, 1.0)
    rho = np.array([sum(float(part[k:] @ part[:-k]) for part in parts) / total for k in lags])
    size = sum(len(part) for part in parts)
    first = float(rho[0])
    # of correlations that fade as fast as the first one says
    factor = float(np.sqrt((1 + first) / (1 - first))) if 0 < first < 1 else 1.0
    return Correlation(first, chance(size * float(rho @ rho), len(rho)), factor)


def _line(part: FloatArray) -> float:
    """Largest share of the variance in three neighbouring frequencies: 1 of a sinusoid left over."""
    power = np.abs(np.fft.rfft(part - part.mean())[1:]) ** 2
    if len(power) < 6 or power.sum() == 0:
        return 0.0
    return float(np.convolve(power, np.ones(3), "same").max() / power.sum())


def _without_outliers(part: FloatArray) -> FloatArray:
    """Residuals cut at three robust standard deviations."""
    limit = 3 * 1.4826 * float(np.median(np.abs(part)))
    return np.clip(part, -limit, limit)
