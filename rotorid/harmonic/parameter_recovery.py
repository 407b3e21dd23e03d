"""From combinations back to the parameters: all real solutions, or why there are several or none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cmp_to_key

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.text import listing
from rotorid.harmonic.parameter_combinations import NAME
from rotorid.harmonic.polynomial_solutions import System, real_solutions
from rotorid.regression import echelon, least_squares, solution

Bounds = Mapping[str, tuple[float, float]]

GAUGE = 0.7318
"""Value given to a parameter that nothing determines while the others are solved for."""
SAME = 1e-6
"""Relative difference below which two solutions are one."""


@dataclass(frozen=True, eq=False)
class Recovery:
    """Parameters recovered from combinations.

    Attributes
    ----------
    solutions
        All real ones, (n,) each; complete, also where `undetermined` says that a value is arbitrary.
    undetermined
        (n,) mask: parameters that the combinations do not fix at all.
    gain
        (n, q): change of the parameters per change of the combinations, at the first solution; NaN rows for
        undetermined ones. None without a solution.
    reasons
        In words, if there are several solutions or none.
    warnings
        What is doubtful.
    """

    solutions: tuple[FloatArray, ...]
    undetermined: BoolArray
    gain: FloatArray | None
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def values(self) -> FloatArray:
        """Parameters with one value in all solutions; NaN for the others."""
        n = len(self.undetermined)
        if not self.solutions:
            return np.full(n, np.nan)
        table = np.array(self.solutions)
        spread = np.ptp(table, axis=0) > SAME * np.max(np.abs(table), axis=0)
        return np.where(spread | self.undetermined, np.nan, table[0])


def undetermined_parameters(system: System) -> tuple[BoolArray, list[int]]:
    """Which parameters the combinations leave open at a general point, and which of them to fix to solve."""
    theta = np.random.default_rng(5).uniform(0.6, 1.7, len(system.names))
    J = system.jacobian(theta)
    if not len(J):
        return np.ones(len(theta), dtype=bool), list(range(len(theta)))
    size = np.linalg.norm(J, axis=1, keepdims=True)
    estimate = least_squares(J / np.where(size > 0, size, 1.0), np.zeros(len(J)), rcond=1e-9)
    # the last of the open parameters are fixed, one per dimension of the null space
    solved = {int(np.flatnonzero(row)[0]) for row in echelon(estimate.row_space)}
    return np.isnan(estimate.values), [j for j in range(len(theta)) if j not in solved]


def recover(system: System, bounds: Bounds | None = None) -> Recovery:
    """Solve for the parameters.

    Parameters
    ----------
    system
        The estimated combinations.
    bounds
        Lowest and highest value by name: solutions outside are dropped.
    """
    names = system.names
    open_, fixed = undetermined_parameters(system)
    free = [j for j in range(len(names)) if j not in fixed]
    base = np.full(len(names), GAUGE)
    warnings: list[str] = []
    candidates, searched = real_solutions(system.cleared(), free, base)
    found: list[tuple[float, FloatArray]] = []
    weight = _weights(system)
    for start in candidates:
        theta = _refine(system, start, free, weight)
        if theta is not None and not any(_same(theta, other) for _, other in found):
            found.append((_misfit(system, theta), theta))
    if found:
        best = min(misfit for misfit, _ in found)
        found = [(m, t) for m, t in found if m <= max(1.0, 3 * best)]
        if best > 1:
            warnings.append("the estimated combinations contradict each other by more than their errors")
    solutions = sorted((theta for _, theta in found), key=cmp_to_key(_larger_first))
    reasons: list[str] = []
    if bounds and len(solutions) > 1:
        solutions = [t for t in solutions if _inside(t, names, bounds, open_)] or solutions
    if searched and len(free):
        warnings.append("the parameters were found by a search; there may be more solutions than shown")
    if not solutions:
        reasons.append("no real values of the parameters give the estimated combinations")
        return Recovery((), open_, None, tuple(reasons), tuple(warnings))
    reasons += why_several(solutions, names, open_)
    gain = np.full((len(names), len(system.values)), np.nan)
    J = system.jacobian(solutions[0])[:, free]
    white = weight @ J
    if len(free) and np.isinf(least_squares(white, np.zeros(len(white)), rcond=1e-7).condition_number):
        warnings.append("two solutions nearly coincide: the parameters are hardly determined there")
    gain[free] = solution(white, weight, rcond=1e-13)
    gain[open_] = np.nan
    return Recovery(tuple(solutions), open_, gain, tuple(reasons), tuple(warnings))


def _weights(system: System) -> FloatArray:
    """Matrix that makes the errors of the combinations independent and of size one (relative if unknown)."""
    if system.covariance is not None:
        std = np.sqrt(np.diag(system.covariance))
        floor = 1e-14 * np.abs(system.values) + 1e-150
        scale = np.maximum(std, floor)
        correlation = system.covariance / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
        correlation[np.diag_indices(len(scale))] = np.maximum(np.diag(correlation), 1e-6)
        try:
            lower = np.linalg.cholesky(correlation)
        except np.linalg.LinAlgError:
            lower = np.eye(len(scale))
        return np.asarray(np.linalg.inv(lower) / scale)
    size = np.where(system.values != 0, np.abs(system.values), 1.0)
    return np.diag(1.0 / size)


def _refine(system: System, start: FloatArray, free: Sequence[int], weight: FloatArray) -> FloatArray | None:
    """Gauss–Newton on all combinations, steps halved until the misfit does not grow."""
    theta = start.copy()
    if not free:
        return theta

    def misfit(t: FloatArray) -> FloatArray:
        return np.asarray(weight @ (system.combinations(t) - system.values))

    with np.errstate(all="ignore"):
        r = misfit(theta)
        if not np.isfinite(r).all():
            return None
        for _ in range(60):
            J = weight @ system.jacobian(theta)[:, free]
            if not np.isfinite(J).all():
                return None
            step = solution(J, -r, rcond=1e-12)
            length = 1.0
            while length > 1e-6:
                trial = theta.copy()
                trial[free] += length * step
                new = misfit(trial)
                if np.isfinite(new).all() and new @ new <= (r @ r) * (1 + 1e-12):
                    break
                length /= 2
            else:
                break
            moved = np.max(np.abs(trial - theta) / np.maximum(np.abs(trial), 1e-300))
            theta, r = trial, new
            if moved < 1e-14:
                break
    return theta


def _misfit(system: System, theta: FloatArray) -> float:
    """Largest error of a combination in units of what rounding and four standard deviations allow."""
    mu = system.monomials(theta)
    size = np.abs(system.matrix) @ np.abs(mu) / np.abs(system.bottom(theta))
    size += np.abs(system.values) + 1e-300
    error = np.abs(system.combinations(theta) - system.values) / size
    std = 0.0 if system.covariance is None else np.sqrt(np.diag(system.covariance))
    return float(np.max(error / (1e-6 + 4 * std / size)))


def _same(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.all(np.abs(a - b) <= SAME * np.maximum(np.abs(a), np.abs(b))))


def _larger_first(a: FloatArray, b: FloatArray) -> int:
    """For sorting: by the first parameter that differs by more than rounding."""
    differ = np.flatnonzero(np.abs(a - b) > SAME * np.maximum(np.abs(a), np.abs(b)))
    return int(np.sign(b[differ[0]] - a[differ[0]])) if len(differ) else 0


def _inside(theta: FloatArray, names: Sequence[str], bounds: Bounds, open_: BoolArray) -> bool:
    return all(
        bounds[name][0] <= theta[j] <= bounds[name][1]
        for j, name in enumerate(names)
        if name in bounds and not open_[j]
    )


def why_several(solutions: Sequence[FloatArray], names: Sequence[str], open_: BoolArray) -> list[str]:
    """Say in words how several solutions differ; empty for one."""
    if len(solutions) < 2:
        return []
    table = np.array(solutions)
    differ = np.flatnonzero((np.ptp(table, axis=0) > SAME * np.max(np.abs(table), axis=0)) & ~open_)
    if not len(differ):
        return []
    who = listing([names[int(j)] for j in differ], "and")
    ordered = np.sort(table[:, differ], axis=1)
    if np.all(np.ptp(ordered, axis=0) <= 1e-5 * np.max(np.abs(ordered), axis=0)):
        return [f"{who} can be exchanged without any change of the amplitudes: see the solutions"]
    several = "has {} values" if len(differ) == 1 else "have {} sets of values"
    return [f"{who} {several.format(len(solutions))} that explain the data equally well"]


def only_determined(parameters: Sequence[str], lost: Sequence[str], words: Sequence[str]) -> str:
    """Say which parameters and combinations are determined and which parameters are not."""
    seen = [name for name in parameters if name not in lost]
    seen += [w for w in words if w not in seen and any(n in NAME.findall(w) for n in lost)]
    verb = "is" if len(seen) == 1 else "are"
    text = f"only {listing(seen, 'and')} {verb} determined" if seen else "nothing is determined"
    itself = "itself is" if len(lost) == 1 else "themselves are"
    return f"{text}; {listing(lost, 'and')} by {itself} not"
