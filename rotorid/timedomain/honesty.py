"""What must be known before the numbers of a fit are used."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotorid.estimate import Estimate
from rotorid.regression import least_squares
from rotorid.search import RCOND
from rotorid.timedomain.path import Path
from rotorid.timedomain.problem import Problem
from rotorid.timedomain.simulate import SimulationError

FloatArray = NDArray[np.float64]

UNEXPLAINED = 0.05
"""Share of the variance in residuals that are not white above which a model does not describe a record."""
MISFIT = 4.0
"""χ² per degree of freedom above which stated errors do not explain the residuals."""
INSENSITIVE = 1e-7
"""Change of the outputs, relative to their size, by a parameter changing by all of itself."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """The estimate, without intervals where these would mislead (not `reliable`), and what was noticed."""

    estimate: Estimate
    reliable: bool
    warnings: tuple[str, ...]
    integration_change: FloatArray | None
    autocorrelation: float | None


def judge(problem: Problem, path: Path, loss: str) -> Judgement:
    """Look at convergence, bounds, rank, sensitivity, integration error and residuals of a fit."""
    found, names = path.estimate, problem.model.parameters
    warnings: list[str] = []
    reliable = path.converged
    if not path.converged:
        warnings.append(f"{path.message}; no intervals are given")
    if path.at_bounds:
        one = len(path.at_bounds) == 1
        warnings.append(
            f"{', '.join(path.at_bounds)} {'stands at its bound' if one else 'stand at their bounds'}: no "
            "standard deviation is given, and those of the others hold it fixed"
        )
    if not found.full_rank:
        warnings.append(found.describe_rank())
    r = found.residuals
    change = None
    try:
        J = problem.jacobian(found.solution)
        weak = _insensitive(problem, J, found)
        if weak:
            warnings.append(f"the record hardly depends on {', '.join(weak)}")
        change = _integration_change(problem, found, J)
    except SimulationError as error:
        warnings.append(f"the model cannot be simulated with the result: {error}")
        reliable = False
    if change is not None:
        warnings += _integration_words(found, change, names)
    lag = _autocorrelation(problem, r)
    misfit = _misfit(problem, found, r, loss)
    if misfit:
        warnings.append(misfit)
        reliable = False
    elif lag is not None and abs(lag) > max(0.2, 3 / np.sqrt(len(r))):
        factor = np.sqrt((1 + lag) / (1 - lag)) if 0 < lag < 1 else 1.0
        longer = f": intervals should be about {factor:.2g} times as wide" if factor > 1.2 else ""
        warnings.append(
            f"residuals of neighbouring samples are correlated ({lag:.2f}, Durbin–Watson "
            f"{2 - 2 * lag:.2f}){longer}"
        )
    if found.errors_stated and not misfit and found.dof > 0 and found.chi_square is not None:
        warnings += _chi_words(found.chi_square, found.dof)
    if not reliable:
        found = replace(found, covariance=None, solution_covariance=None)
    return Judgement(found, reliable, tuple(warnings), change, lag)


def _insensitive(problem: Problem, J: FloatArray, found: Estimate) -> list[str]:
    size = float(np.linalg.norm(problem.data))
    effect = np.linalg.norm(J, axis=0) * np.maximum(np.abs(found.solution), 1e-12)
    weak = (effect < INSENSITIVE * size) & ~np.isnan(found.values) & (found.solution != 0)
    return [name for name, w in zip(problem.model.parameters, weak, strict=True) if w]


def _integration_change(problem: Problem, found: Estimate, J: FloatArray) -> FloatArray | None:
    """Change of the parameters at a tighter tolerance (n,); None where the solution is exact."""
    used = problem.runs[0].method
    if used in ("expm", "none"):
        return None
    r = problem.residual(found.solution)
    if used in ("heun", "rk4"):
        finer = Problem(problem.model, problem.records, "auto")
    else:
        finer = Problem(problem.model, problem.records, problem.integrator, max(problem.rtol / 100, 1e-13))
    exact = finer.evaluate(found.solution)[0]
    return least_squares(J, r - exact, rcond=RCOND).solution


def _integration_words(found: Estimate, change: FloatArray, names: tuple[str, ...]) -> list[str]:
    size = np.abs(change)
    floor = 1e-8 * np.abs(found.solution)
    limit = floor if found.std is None else np.maximum(floor, 0.1 * np.nan_to_num(found.std))
    words = [
        f"{name} by about {c:.2g}" + ("" if found.std is None else f" (standard deviation {s:.2g})")
        for name, c, s, big in zip(
            names, change, found.std if found.std is not None else change, size > limit, strict=True
        )
        if big
    ]
    return [f"a more accurate integration would change {', '.join(words)}"] if words else []


def _series(problem: Problem, r: FloatArray) -> list[FloatArray]:
    return np.split(r, np.cumsum(problem.groups)[:-1])


def _numerical(problem: Problem, r: FloatArray) -> bool:
    """Whether nothing but rounding is left."""
    return bool(np.linalg.norm(r) < 1e-7 * np.linalg.norm(problem.data))


def _autocorrelation(problem: Problem, r: FloatArray) -> float | None:
    """Of neighbouring samples, over all series; None where there is nothing to say."""
    if len(r) < 20 or _numerical(problem, r):
        return None
    pairs = r[1:] * r[:-1]
    pairs[np.cumsum(problem.groups)[:-1] - 1] = 0.0  # last of one series, first of the next
    return float(pairs.sum()) / float(r @ r)


def _misfit(problem: Problem, found: Estimate, r: FloatArray, loss: str) -> str:
    """Words where the model does not describe the record: intervals would be wrong."""
    if loss != "linear" or found.dof <= 0 or _numerical(problem, r):
        return ""
    hint = (
        "a local minimum or an unsuitable model; try other starting values, several starts or multiple "
        "shooting. No intervals are given"
    )
    if problem.stated:
        ratio = float(r @ r) / found.dof
        if ratio > MISFIT and _chance(float(r @ r), found.dof) < 1e-6:
            return f"residuals are {np.sqrt(ratio):.2g} times as large as the stated errors explain: {hint}"
        return ""
    if len(r) < 20:
        return ""
    counts = np.array(problem.groups)
    sums = np.add.reduceat(problem.data, np.append(0, np.cumsum(counts)[:-1]))
    spread = float(problem.data @ problem.data - np.sum(sums**2 / counts))
    share = float(r @ r) / spread if spread > 0 else 0.0
    if share > UNEXPLAINED and _whiteness(problem, r) < 1e-6:
        return f"the model leaves {100 * share:.0f} % of the record's variance, and not as noise: {hint}"
    return ""


def _whiteness(problem: Problem, r: FloatArray) -> float:
    """Probability of such correlations in white residuals (Box and Pierce 1970)."""
    parts = _series(problem, r)
    lags = range(1, 1 + min(10, max(1, min(len(part) for part in parts) // 5)))
    total = float(r @ r)
    q = sum((sum(float(part[k:] @ part[:-k]) for part in parts) / total) ** 2 for k in lags) * len(r)
    return _chance(q, len(lags))


def _chi_words(chi_square: float, dof: int) -> list[str]:
    if _chance(chi_square, dof) < 1e-3:
        ratio = np.sqrt(chi_square / dof)
        return [
            f"residuals are {ratio:.2g} times as large as the stated errors explain: intervals are too "
            "narrow, or the model does not quite describe the record"
        ]
    return []


def _chance(chi_square: float, dof: int) -> float:
    from scipy.special import chdtrc

    return float(chdtrc(dof, chi_square))
