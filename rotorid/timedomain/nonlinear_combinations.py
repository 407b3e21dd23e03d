"""Combinations of parameters that a record determines of a nonlinear model: sums, products, or neither.

The null space of the sensitivities is a direction at the values found. Where the outputs stay what they are
along the straight line in that direction, linear combinations are determined; where they stay along a line
of constant ratios (θ exp(h v)), products of powers are. Otherwise the directions hold near these values only,
and no standard deviation is given. That more may be determined is said only where beside them it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.search import RCOND
from rotorid.regression.undetermined_combinations import Combination, echelon
from rotorid.timedomain.methods.least_squares_problem import Problem

REACH = 0.2
"""How far to go, relative to the parameters."""
FLAT = 1e-5
"""Change of the outputs that is none, relative to that by changing the parameters by all of themselves."""


def combined(problem: Problem, found: Estimate) -> tuple[Estimate, str]:
    """The estimate with combinations that hold for the nonlinear model, and a warning or nothing."""
    if found.full_rank:
        return found, ""
    theta = found.solution
    scale = np.where(theta == 0, 1.0, theta)
    rows = found.row_space * scale
    null = np.linalg.svd(rows)[2][found.rank :]
    null = null / np.abs(null).max(axis=1, keepdims=True)
    r0 = problem.residual(theta)
    typical = float(np.linalg.norm(problem.jacobian(theta) * scale))

    def flat(points: list[FloatArray]) -> bool:
        moved = max(float(np.linalg.norm(problem.residual(point) - r0)) for point in points)
        return bool(moved <= FLAT * typical)  # also false where the states diverge

    steps = [sign * REACH * v for v in null for sign in (1, -1)]
    moving = theta[(np.abs(null) > 1e-6).any(axis=0)]
    # products first: of a ray through 0, which is both, the ratios say more than a combination that is 0
    product = moving.all() and flat([np.where(theta == 0, step, theta * np.exp(step)) for step in steps])
    linear = not product and flat([theta + scale * step for step in steps])
    problem.residual(theta)  # the problem keeps the runs of the last point
    if product:
        return replace(found, curved=_products(found, rows)), ""
    if linear:
        return found, ""
    near = tuple(replace(c, words=f"(near these values) {c.words}", std=None) for c in found.combinations)
    which = ", ".join(found.undetermined)
    if _deficient_beside(problem, theta):
        return replace(found, curved=near), ""
    words = (
        f"the record's sensitivity to {which} (or to a combination) vanishes at the values found, but not "
        "beside them: it may be determined after all; start elsewhere"
    )
    return replace(found, curved=near), words


def _deficient_beside(problem: Problem, theta: FloatArray) -> bool:
    """Whether the sensitivities lack rank at other values near these, too: a curve of values fits alike."""
    other = theta + REACH * np.where(theta == 0, 1.0, theta) * np.linspace(1.0, -0.7, len(theta))
    deficient = False
    if np.isfinite(problem.residual(other)).all():
        J = problem.jacobian(other)
        deficient = least_squares(J, np.zeros(len(J)), rcond=RCOND).rank < len(theta)
    problem.residual(theta)
    return deficient


def _products(found: Estimate, rows: FloatArray) -> tuple[Combination, ...]:
    """Products of powers: linear combinations of logarithms, with exponents as coefficients."""
    theta, cov = found.solution, found.solution_covariance
    out = []
    for powers in echelon(rows):
        if np.count_nonzero(powers) < 2:
            continue
        signs = np.where(powers % 2 == 0, 1.0, np.sign(theta))  # of θ^power; 1 where θ is not in the product
        value = float(np.prod(np.where(powers == 0, 1.0, signs * np.abs(theta) ** powers)))
        slope = value * powers / np.where(theta == 0, 1.0, theta)
        std = None if cov is None else float(np.sqrt(max(float(slope @ cov @ slope), 0.0)))
        out.append(Combination(_words(powers, found.names), value, std, powers))
    return tuple(out)


def _words(powers: FloatArray, names: tuple[str, ...]) -> str:
    """Such as a·b^2/c."""
    above = [_power(name, power) for power, name in zip(powers, names, strict=True) if power > 0]
    below = [_power(name, -power) for power, name in zip(powers, names, strict=True) if power < 0]
    if not below:
        return "·".join(above)
    under = below[0] if len(below) == 1 else f"({'·'.join(below)})"
    return f"{'·'.join(above) or '1'}/{under}"


def _power(name: str, power: float) -> str:
    return name if power == 1 else f"{name}^{power:.4g}"
