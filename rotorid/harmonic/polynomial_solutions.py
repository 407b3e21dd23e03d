"""Real solutions of small polynomial systems: roots, substitution, at last a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.harmonic.parameter_combinations import powers_product, powers_slopes
from rotorid.regression.search import search_from

NEARLY_REAL = 1e-6
NEGLIGIBLE = 1e-13
MAX_TERMS = 2000
STARTS = 300
MAX_BRANCHES = 64


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
        (q, monomials): what stands below each sum; a row of zeros, or None, is 1.
    """

    names: tuple[str, ...]
    exponents: FloatArray
    matrix: FloatArray
    values: FloatArray
    covariance: FloatArray | None
    below: FloatArray | None = None

    def combinations(self, theta: FloatArray) -> FloatArray:
        """Values (q,) at the parameters."""
        return np.asarray(self.matrix @ self.monomials(theta) / self.bottom(theta))

    def cleared(self) -> System:
        """The same without fractions: what stands below, multiplied by the value, is taken away above."""
        if self.below is None:
            return self
        matrix = self.matrix - self.values[:, None] * self.below
        values = np.where(self.below.any(axis=1), 0.0, self.values)
        return System(self.names, self.exponents, matrix, values, None)

    def bottom(self, theta: FloatArray) -> FloatArray:
        """What stands below each sum (q,), 1 where nothing does."""
        if self.below is None:
            return np.ones(len(self.values))
        return np.where(self.below.any(axis=1), self.below @ self.monomials(theta), 1.0)

    def monomials(self, theta: FloatArray) -> FloatArray:
        """Values (monomials,)."""
        return powers_product(self.exponents, theta)

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Derivatives (q, n) of the combinations by the parameters."""
        out = powers_slopes(self.exponents, theta)
        slopes = self.matrix @ out
        if self.below is not None:
            slopes -= self.combinations(theta)[:, None] * (self.below @ out)
        return np.asarray(slopes / self.bottom(theta)[:, None])


def real_solutions(system: System, free: Sequence[int], base: FloatArray) -> tuple[list[FloatArray], bool]:
    """Candidates for all real solutions, and whether a search was needed (which may miss some).

    Parameters
    ----------
    system
        `matrix @ monomials(θ) = values`, possibly more equations than unknowns.
    free
        Indices of the unknowns; the others have the values of `base` (n,).
    """
    try:
        polys = {poly: _unknowns(poly) for poly in _polynomials(system, free, base)}
        branches = _eliminate(polys, frozenset(range(len(free))))
    except _NotReducible:
        return _search(system, list(free), base), True
    out = []
    for branch in branches:
        theta = base.copy()
        for j, value in branch.items():
            theta[free[j]] = value
        out.append(theta)
    return out, False


class _NotReducible(Exception):
    """No unknown can be eliminated by these simple means."""


def _polynomials(system: System, free: Sequence[int], base: FloatArray) -> list[Any]:
    """The equations in a ring of sympy, whose generators are the free unknowns."""
    from sympy import RR, ring, symbols

    R = ring(symbols(f"x:{len(free)}"), RR)[0]
    fixed = np.setdiff1d(np.arange(len(base)), free)
    known = system.matrix * np.prod(base[fixed] ** system.exponents[:, fixed], axis=1)
    exponents = system.exponents[:, list(free)].astype(int)
    polys = []
    for row, value in zip(known, system.values, strict=True):
        used = np.flatnonzero(row)
        lowest = exponents[used].min(axis=0, initial=0)  # multiplied so that no exponent is negative
        poly = R.term_new(tuple((-lowest).tolist()), RR(-float(value)))
        for m in used:
            poly += R.term_new(tuple((exponents[m] - lowest).tolist()), RR(float(row[m])))
        polys.append(_whole(poly))
    return polys


def _whole(poly: Any) -> Any:  # noqa: ANN401 - sympy has no types
    """Without powers of unknowns that all its terms share: an unknown is not 0."""
    shared = [min(exponents) for exponents in zip(*poly, strict=True)]
    lower = {tuple(np.subtract(m, shared).tolist()): x for m, x in poly.items()}
    return poly.ring.from_dict(lower)


def _unknowns(poly: Any) -> set[int]:  # noqa: ANN401
    return {j for j, degree in enumerate(poly.degrees()) if degree > 0}


def _eliminate(polys: dict[Any, set[int]], open_: frozenset[int]) -> list[dict[int, float]]:
    """All branches of values for the open unknowns, from polynomials with their unknowns."""
    if not open_:
        return [{}]
    out: list[dict[int, float]] = []
    single = [poly for poly, unknowns in polys.items() if len(unknowns) == 1]
    if single:
        poly = min(single, key=lambda p: (p.degree(min(polys[p])), len(p)))
        (j,) = polys[poly]
        for root in _real_roots(poly, j):
            value = poly.ring.ground_new(poly.ring.domain(root))
            rest = _others(polys, poly, j, value, poly.ring.one)
            out += [{j: root, **branch} for branch in _eliminate(rest, open_ - {j})]
            if len(out) > MAX_BRANCHES:
                raise _NotReducible
        return out
    for poly in sorted(polys, key=len):
        for j in sorted(polys[poly]):
            top, bottom = -poly.coeff_wrt(j, 0), poly.coeff_wrt(j, 1)
            if poly.degree(j) != 1 or len(bottom) != 1 or not top:
                continue
            for branch in _eliminate(_others(polys, poly, j, top, bottom), open_ - {j}):
                value = _value(top, branch) / _value(bottom, branch) if _value(bottom, branch) else np.nan
                if np.isfinite(value):
                    out.append({**branch, j: value})
            return out
    raise _NotReducible


def _others(polys: dict[Any, set[int]], used: Any, j: int, top: Any, bottom: Any) -> dict[Any, set[int]]:  # noqa: ANN401
    """The other polynomials with top/bottom for unknown j, each with its unknowns, if it has any."""
    rest = {}
    for poly, unknowns in polys.items():
        if poly is used:
            continue
        if j in unknowns:
            poly = _replace(poly, j, top, bottom)
            unknowns = _unknowns(poly)
        if unknowns:
            rest[poly] = unknowns
    return rest


def _replace(poly: Any, j: int, top: Any, bottom: Any) -> Any:  # noqa: ANN401
    """Put top/bottom for unknown j, multiplied out; where terms cancel but for rounding there is nothing."""
    degree = poly.degree(j)
    if comb(len(top) + degree - 1, degree) * len(poly) > 50 * MAX_TERMS:
        raise _NotReducible

    def put(poly: Any, top: Any, bottom: Any) -> Any:  # noqa: ANN401
        return sum(poly.coeff_wrt(j, e) * top**e * bottom ** (degree - e) for e in range(degree + 1))

    found, sizes = put(poly, top, bottom), put(_size(poly), _size(top), _size(bottom))
    kept = {m: x for m, x in found.items() if abs(x) > NEGLIGIBLE * sizes[m]}
    if len(kept) > MAX_TERMS:
        raise _NotReducible
    return _whole(poly.ring.from_dict(kept))


def _size(poly: Any) -> Any:  # noqa: ANN401
    """The polynomial with all coefficients positive."""
    return poly.ring.from_dict({m: abs(x) for m, x in poly.items()})


def _real_roots(poly: Any, j: int) -> list[float]:  # noqa: ANN401
    degree = poly.degree(j)
    coefficients = np.zeros(degree + 1)
    for m, x in poly.items():
        coefficients[degree - m[j]] = float(x)
    if degree == 1:
        return [float(-coefficients[1] / coefficients[0])]
    # scale the unknown so that first and last coefficient are alike
    last = coefficients[np.flatnonzero(coefficients)[-1]]
    order = int(np.flatnonzero(coefficients)[-1])
    scale = abs(last / coefficients[0]) ** (1 / order) if order else 1.0
    roots = np.roots(coefficients * scale ** np.arange(degree, -1, -1.0)) * scale
    real = [float(r.real) for r in roots if abs(r.imag) <= NEARLY_REAL * abs(r)]
    return sorted(set(real))


def _value(poly: Any, values: dict[int, float]) -> float:  # noqa: ANN401
    return float(
        sum(float(x) * np.prod([values[j] ** e for j, e in enumerate(m) if e]) for m, x in poly.items())
    )


def _search(system: System, free: list[int], base: FloatArray) -> list[FloatArray]:
    """Levenberg–Marquardt from many starting points of all magnitudes and signs."""
    size = np.where(system.values != 0, np.abs(system.values), 1.0)
    rng = np.random.default_rng(1)
    found: list[FloatArray] = []

    def whole(x: FloatArray) -> FloatArray:
        theta = base.copy()
        theta[free] = x
        return theta

    def residual(x: FloatArray) -> FloatArray:
        return np.asarray((system.matrix @ system.monomials(whole(x)) - system.values) / size)

    def jacobian(x: FloatArray) -> FloatArray:
        return np.asarray(system.jacobian(whole(x))[:, free] / size[:, None])

    typical = float(np.exp(np.mean(np.log(size))))
    for i in range(STARTS):
        magnitude = 10 ** rng.uniform(-2, 2, len(free)) * (1.0 if i % 2 else typical)
        start = magnitude * (rng.choice((-1, 1), len(free)) if i % 4 > 1 else 1)
        end = search_from(residual, start, jacobian, limit=100)
        if end is None or end[0] >= 1e-2:
            continue
        theta = whole(end[1])
        known = any(np.all(np.abs(theta - t) <= 1e-5 * np.maximum(np.abs(t), 1e-300)) for t in found)
        if not known:
            found.append(theta)
    return found
