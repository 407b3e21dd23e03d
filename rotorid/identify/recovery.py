"""From estimated combinations back to the parameters: all real solutions, or why there are several or none.

The combinations are polynomials in the parameters. One unknown after the other is eliminated: a polynomial in
one unknown by its roots, else one in which an unknown stands linearly with a single term as its factor.
Polynomials of sympy with rational coefficients cancel exactly. Where that does not end, a search does, which
may miss solutions. All combinations together then refine each solution, weighted by their errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cmp_to_key
from math import comb
from typing import Any

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.identify.combinations import why_several
from rotorid.identify.operator_model import products_of_powers
from rotorid.regression import echelon, least_squares, solution
from rotorid.regression.search import search_from

Polynomial = Any
"""Of sympy, which has no types."""

GAUGE = 0.7318
"""Value given to a parameter that nothing determines while the others are solved for."""
SAME = 1e-6
"""Relative difference below which two solutions are one."""
NEARLY_REAL = 1e-6
STARTS = 300
MAX_TERMS, MAX_BRANCHES = 2000, 64


@dataclass(frozen=True, eq=False)
class System:
    """Combinations `matrix @ monomials(θ) = values`, or ratios of such sums.

    Attributes
    ----------
    names
        Of the n parameters.
    exponents
        (monomials, n).
    matrix
        (q, monomials).
    values, covariance
        (q,), and (q, q) or None.
    below
        (q, monomials): what stands below each sum; a row of zeros is 1.
    """

    names: tuple[str, ...]
    exponents: FloatArray
    matrix: FloatArray
    values: FloatArray
    covariance: FloatArray | None
    below: FloatArray

    def combinations(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (q,) at the parameters (n,), and their derivatives (q, n)."""
        monomials, slopes = products_of_powers(self.exponents, theta)
        bottom = np.where(self.below.any(axis=1), self.below @ monomials, 1.0)
        values = self.matrix @ monomials / bottom
        return values, ((self.matrix - values[:, None] * self.below) @ slopes) / bottom[:, None]


@dataclass(frozen=True, eq=False)
class Recovery:
    """Parameters recovered from combinations.

    Attributes
    ----------
    solutions
        All real ones, (n,) each; complete, also where `undetermined` says that a value is arbitrary.
    undetermined
        (n,) mask: parameters that the combinations do not fix at all.
    rank
        Number of parameters that they fix together with the open ones.
    gain
        (n, q): change of the parameters per change of the combinations, at the first solution; NaN rows for
        undetermined ones, and without a solution.
    reasons
        In words, why there are several solutions or none.
    complete
        False: they were searched for, and there may be more.
    """

    solutions: tuple[FloatArray, ...]
    undetermined: BoolArray
    rank: int
    gain: FloatArray
    reasons: tuple[str, ...] = ()
    complete: bool = True

    @property
    def values(self) -> FloatArray:
        """Parameters with one value in all solutions; NaN for the others."""
        if not self.solutions:
            return np.full(len(self.undetermined), np.nan)
        lost = several(self.solutions) | self.undetermined
        return np.where(lost, np.nan, self.solutions[0])


def several(solutions: Sequence[FloatArray]) -> BoolArray:
    """Which parameters (n,) differ between solutions."""
    table = np.array(solutions)
    return np.asarray(np.ptp(table, axis=0) > SAME * np.abs(table).max(axis=0))


def recover(system: System) -> Recovery:
    """Solve for the parameters."""
    n = len(system.names)
    open_, free = _open(system)
    gain = np.full((n, len(system.values)), np.nan)
    if not len(system.values):
        return Recovery((), open_, 0, gain)
    candidates, complete = _candidates(system, free)
    weight = _weights(system)
    refined = [_refined(system, start, free, weight) for start in candidates]
    fits = sorted(((_misfit(system, t), t) for t in refined if np.isfinite(t).all()), key=lambda one: one[0])
    least = fits[0][0] if fits else np.inf
    solutions: list[FloatArray] = []
    for misfit, theta in fits:
        if misfit <= max(1.0, 3 * least) and not any(_larger(theta, s) == 0 for s in solutions):
            solutions.append(theta)
    solutions.sort(key=cmp_to_key(_larger))
    if not solutions:
        reason = "no real values of the parameters give the estimated combinations"
        return Recovery((), open_, len(free), gain, (reason,))
    differ = np.flatnonzero(several(solutions) & ~open_).tolist()
    J = weight @ system.combinations(solutions[0])[1][:, free]
    gain[free] = solution(J, weight, rcond=1e-13)
    gain[open_] = np.nan
    reasons = why_several(solutions, system.names, differ)
    return Recovery(tuple(solutions), open_, len(free), gain, tuple(reasons), complete or not free)


def _open(system: System) -> tuple[BoolArray, list[int]]:
    """Which parameters the combinations leave open at a general point, and which to solve for.

    The last of the open ones are fixed, one per dimension of the null space.
    """
    theta = np.random.default_rng(5).uniform(0.6, 1.7, len(system.names))
    J = system.combinations(theta)[1]
    if not len(J):
        return np.ones(len(theta), dtype=bool), []
    size = np.linalg.norm(J, axis=1, keepdims=True)
    estimate = least_squares(J / np.where(size > 0, size, 1.0), np.zeros(len(J)), rcond=1e-9)
    free = sorted({int(np.flatnonzero(row)[0]) for row in echelon(estimate.row_space)})
    return np.isnan(estimate.values), free


def _candidates(system: System, free: list[int]) -> tuple[list[FloatArray], bool]:
    """Real solutions (n,) for the free unknowns, the others at `GAUGE`, and whether these are surely all."""
    n = len(system.names)
    try:
        branches = _eliminated(_polynomials(system, free), frozenset(range(len(free))))
    except _NotReducible:
        return _searched(system, free), False
    roots = _roots(system)
    candidates = np.full((len(branches), n), GAUGE)
    for row, branch in zip(candidates, branches, strict=True):
        for j, value in branch.items():
            k = free[j]
            row[k] = float(value) ** roots[k] if roots[k] == 1 or value >= 0 else np.nan
    return [row for row in candidates if np.isfinite(row).all()], True


class _NotReducible(Exception):
    """No unknown can be eliminated by these simple means."""


def _roots(system: System) -> list[int]:
    """The whole power that each parameter is of its unknown: 2 where sqrt(k) stands in the model."""
    from fractions import Fraction

    powers = [
        [Fraction(e).limit_denominator(50).denominator for e in column] for column in system.exponents.T
    ]
    return [int(np.lcm.reduce(one)) for one in powers]


def _polynomials(system: System, free: list[int]) -> list[Polynomial]:
    """Polynomials that are 0, in a ring of sympy whose generators are the free unknowns."""
    from sympy import QQ, ring, symbols

    R = ring(symbols(f"x:{len(free)}"), QQ)[0]
    fixed = np.setdiff1d(np.arange(len(system.names)), free)
    known = np.prod(GAUGE ** system.exponents[:, fixed], axis=1)
    cleared = system.below.any(axis=1)
    rows = (system.matrix - np.where(cleared, system.values, 0.0)[:, None] * system.below) * known
    exponents = np.round(system.exponents[:, free] * np.array(_roots(system))[free]).astype(int)
    polynomials = []
    for row, value in zip(rows, np.where(cleared, 0.0, system.values), strict=True):
        used = np.flatnonzero(row)
        lowest = exponents[used].min(axis=0, initial=0)  # multiplied so that no exponent is negative
        polynomial = R.term_new(tuple((-lowest).tolist()), _exact(-value))
        for m in used:
            polynomial += R.term_new(tuple((exponents[m] - lowest).tolist()), _exact(row[m]))
        polynomials.append(_reduced(polynomial))
    return polynomials


def _exact(value: float) -> Any:  # noqa: ANN401 - sympy has no types
    from sympy import QQ

    return QQ(*float(value).as_integer_ratio())


def _reduced(polynomial: Polynomial) -> Polynomial:
    """Without powers of unknowns that all of several terms share: such an unknown is not 0."""
    if len(polynomial) < 2:
        return polynomial
    shared = [min(exponents) for exponents in zip(*polynomial, strict=True)]
    lower = {tuple(np.subtract(m, shared).tolist()): x for m, x in polynomial.items()}
    return polynomial.ring.from_dict(lower)


def _unknowns(polynomial: Polynomial) -> list[int]:
    return [j for j, degree in enumerate(polynomial.degrees()) if degree > 0]


def _eliminated(polynomials: Sequence[Polynomial], open_: frozenset[int]) -> list[dict[int, Any]]:
    """All branches of values for the open unknowns."""
    if not open_:
        return [{}]
    left = sorted({p: None for p in polynomials if _unknowns(p)}, key=len)
    single = [p for p in left if len(_unknowns(p)) == 1]
    if single:
        polynomial = min(single, key=lambda p: (max(p.degrees()), len(p)))
        (j,) = _unknowns(polynomial)
        one = polynomial.ring.one
        branches = [
            {j: root, **branch}
            for root in _real_roots(polynomial, j)
            for branch in _eliminated([_put(p, j, one * root, one) for p in left], open_ - {j})
        ]
        if len(branches) > MAX_BRANCHES:
            raise _NotReducible
        return branches
    for polynomial in left:
        for j in _unknowns(polynomial):
            x = polynomial.ring.gens[j]
            top, bottom = -polynomial.coeff_wrt(x, 0), polynomial.coeff_wrt(x, 1)
            if polynomial.degree(x) != 1 or len(bottom) != 1 or not top:
                continue
            others = [_put(p, j, top, bottom) for p in left if p is not polynomial]
            branches = _eliminated(others, open_ - {j})
            for branch in branches:
                at = [branch.get(i, 0) for i in range(len(polynomial.ring.gens))]
                divisor = bottom(*at)
                branch[j] = top(*at) / divisor if divisor else None
            return [branch for branch in branches if branch[j] is not None]
    raise _NotReducible


def _put(polynomial: Polynomial, j: int, top: Polynomial, bottom: Polynomial) -> Polynomial:
    """Put top/bottom for unknown j, multiplied out."""
    x = polynomial.ring.gens[j]
    degree = polynomial.degree(x)
    if degree < 1:
        return polynomial
    if comb(len(top) + degree - 1, degree) * len(polynomial) > 50 * MAX_TERMS:
        raise _NotReducible
    whole = polynomial.ring.zero
    for e in range(degree, -1, -1):
        whole = whole * top + polynomial.coeff_wrt(x, e) * bottom ** (degree - e)
    if len(whole) > MAX_TERMS:
        raise _NotReducible
    return _reduced(whole)


def _real_roots(polynomial: Polynomial, j: int) -> list[Any]:
    """Real roots of a polynomial in unknown j, as rational numbers."""
    from sympy import QQ

    exact = {m[j]: x for m, x in polynomial.items()}
    degree = max(exact)
    if degree == 1:
        return [-exact.get(0, QQ(0)) / exact[1]]
    coefficients = np.array([float(exact.get(degree - k, 0)) for k in range(degree + 1)])
    # scale the unknown so that first and last coefficient are alike
    last = int(np.flatnonzero(coefficients)[-1])
    scale = abs(coefficients[last] / coefficients[0]) ** (1 / last) if last else 1.0
    roots = np.roots(coefficients * scale ** np.arange(degree, -1, -1.0)) * scale
    real = {float(r.real) for r in roots if abs(r.imag) <= NEARLY_REAL * abs(r)}
    return [_exact(r) for r in sorted(real)]


def _searched(system: System, free: list[int]) -> list[FloatArray]:
    """Where Levenberg–Marquardt ends from many starting points of all magnitudes and signs."""
    size = np.where(system.values != 0, np.abs(system.values), 1.0)
    rng = np.random.default_rng(1)
    typical = float(np.exp(np.mean(np.log(size))))
    ends: list[FloatArray] = []
    for i in range(STARTS):
        start = 10 ** rng.uniform(-2, 2, len(free)) * (1.0 if i % 2 else typical)
        start *= rng.choice((-1, 1), len(free)) if i % 4 > 1 else 1
        theta = _refined(system, _with(system, free, start), free, np.diag(1.0 / size), limit=100)
        if _misfit(system, theta) < 1e4 and not any(np.allclose(theta, t, rtol=1e-5, atol=0) for t in ends):
            ends.append(theta)
    return ends


def _with(system: System, free: list[int], values: FloatArray) -> FloatArray:
    theta = np.full(len(system.names), GAUGE)
    theta[free] = values
    return theta


def _weights(system: System) -> FloatArray:
    """Matrix that makes the errors of the combinations independent and of size one (relative if unknown)."""
    if system.covariance is None:
        return np.diag(1.0 / np.where(system.values != 0, np.abs(system.values), 1.0))
    scale = np.maximum(np.sqrt(np.diag(system.covariance)), 1e-14 * np.abs(system.values) + 1e-100)
    values, vectors = np.linalg.eigh(system.covariance / np.outer(scale, scale))
    return np.asarray((vectors / np.sqrt(np.maximum(values, 1e-12))) @ vectors.T / scale)


def _refined(
    system: System, start: FloatArray, free: list[int], weight: FloatArray, limit: int = 60
) -> FloatArray:
    """Least squares of all combinations from a start (n,); NaN where it runs away."""
    if not free:
        return start

    def residual(x: FloatArray) -> FloatArray:
        return np.asarray(weight @ (system.combinations(_with(system, free, x))[0] - system.values))

    def jacobian(x: FloatArray) -> FloatArray:
        return np.asarray(weight @ system.combinations(_with(system, free, x))[1][:, free])

    with np.errstate(all="ignore"):
        end = search_from(residual, start[free], jacobian, limit=limit)
        if end is None:
            return np.full(len(start), np.nan)
        x = end[1]
        for _ in range(3):  # to the last digits
            J, r = jacobian(x), residual(x)
            if not (np.isfinite(J).all() and np.isfinite(r).all()):
                break
            new = x - solution(J, r, rcond=1e-12)
            if not np.linalg.norm(residual(new)) <= np.linalg.norm(r):
                break
            x = new
    return _with(system, free, x)


def _misfit(system: System, theta: FloatArray) -> float:
    """Largest error of a combination in units of what rounding and four standard deviations allow."""
    monomials = np.abs(products_of_powers(system.exponents, theta)[0])
    bottom = np.where(system.below.any(axis=1), np.abs(system.below) @ monomials, 1.0)
    size = np.abs(system.matrix) @ monomials / bottom + np.abs(system.values) + 1e-300
    std = 0.0 if system.covariance is None else np.sqrt(np.diag(system.covariance))
    error = np.abs(system.combinations(theta)[0] - system.values)
    return float(np.nan_to_num(error / (1e-6 * size + 4 * std), nan=np.inf).max())


def _larger(a: FloatArray, b: FloatArray) -> int:
    """For sorting, the larger first: by the first parameter that differs by more than rounding."""
    differ = np.flatnonzero(np.abs(a - b) > SAME * np.maximum(np.abs(a), np.abs(b)))
    return int(np.sign(b[differ[0]] - a[differ[0]])) if len(differ) else 0
