"""Real solutions of small polynomial systems: roots, substitution, at last a search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from rotorid.base.arrays import FloatArray

Powers = tuple[tuple[int, int], ...]
"""Sorted (unknown, exponent) pairs."""
Poly = dict[Powers, float]

NEARLY_REAL = 1e-6
NEGLIGIBLE = 1e-13
MAX_TERMS = 2000
STARTS = 300
MAX_BRANCHES = 64


class PolynomialSystem(Protocol):
    """What `recovery.System` offers."""

    @property
    def exponents(self) -> FloatArray: ...  # noqa: D102
    @property
    def matrix(self) -> FloatArray: ...  # noqa: D102
    @property
    def values(self) -> FloatArray: ...  # noqa: D102
    def monomials(self, theta: FloatArray) -> FloatArray: ...  # noqa: D102
    def jacobian(self, theta: FloatArray) -> FloatArray: ...  # noqa: D102


def real_solutions(
    system: PolynomialSystem, free: Sequence[int], base: FloatArray
) -> tuple[list[FloatArray], bool]:
    """Candidates for all real solutions, and whether a search was needed (which may miss some).

    Parameters
    ----------
    system
        `matrix @ monomials(θ) = values`, possibly more equations than unknowns.
    free
        Indices of the unknowns; the others have the values of `base` (n,).
    """
    polys = _polynomials(system, frozenset(free), base)
    try:
        branches = _eliminate(polys, frozenset(free))
    except _NotReducible:
        return _search(system, list(free), base), True
    out = []
    for branch in branches:
        theta = base.copy()
        for j, value in branch.items():
            theta[j] = value
        out.append(theta)
    return out, False


class _NotReducible(Exception):
    """No unknown can be eliminated by these simple means."""


def _polynomials(system: PolynomialSystem, free: frozenset[int], base: FloatArray) -> list[Poly]:
    polys = []
    for row, value in zip(system.matrix, system.values, strict=True):
        poly: Poly = {(): -float(value)} if value else {}
        for m in np.flatnonzero(row):
            powers, factor = [], float(row[m])
            for j in np.flatnonzero(system.exponents[m]):
                exponent = int(system.exponents[m, j])
                if j in free:
                    powers.append((int(j), exponent))
                else:
                    factor *= base[j] ** exponent
            _accumulate(poly, tuple(powers), factor)
        polys.append(_whole(poly))
    return polys


def _accumulate(poly: Poly, powers: Powers, value: float) -> None:
    """Add a term; what is left of two that cancel but for rounding is zero."""
    old = poly.get(powers, 0.0)
    total = old + value
    if abs(total) <= NEGLIGIBLE * max(abs(old), abs(value)):
        poly.pop(powers, None)
    else:
        poly[powers] = total


def _times(a: Powers, b: Powers) -> Powers:
    powers = dict(a)
    for j, e in b:
        powers[j] = powers.get(j, 0) + e
    return tuple(sorted((j, e) for j, e in powers.items() if e))


def _product(a: Poly, b: Poly) -> Poly:
    out: Poly = {}
    for m, x in a.items():
        for n, y in b.items():
            _accumulate(out, _times(m, n), x * y)
    if len(out) > MAX_TERMS:
        raise _NotReducible
    return out


def _whole(poly: Poly) -> Poly:
    """Multiply so that every unknown has lowest exponent 0."""
    lowest: dict[int, int] = {}
    unknowns = _unknowns(poly)
    for j in unknowns:
        lowest[j] = min(dict(m).get(j, 0) for m in poly)
    shift = tuple(sorted((j, -e) for j, e in lowest.items() if e))
    return {_times(m, shift): x for m, x in poly.items()} if shift else poly


def _unknowns(poly: Poly) -> set[int]:
    return {j for m in poly for j, _ in m}


def _eliminate(polys: list[Poly], open_: frozenset[int]) -> list[dict[int, float]]:
    """All branches of values for the open unknowns."""
    if not open_:
        return [{}]
    polys = [p for p in polys if _unknowns(p)]
    single = [p for p in polys if len(_unknowns(p)) == 1]
    if single:
        poly = min(single, key=lambda p: (max(e for m in p for _, e in m), len(p)))
        (j,) = _unknowns(poly)
        out: list[dict[int, float]] = []
        for root in _real_roots(poly, j):
            rest = [_replace(p, j, {(): root}, {(): 1.0}) for p in polys if p is not poly]
            out += [{j: root, **branch} for branch in _eliminate(rest, open_ - {j})]
            if len(out) > MAX_BRANCHES:
                raise _NotReducible
        return out
    for poly in sorted(polys, key=len):
        for j in sorted(_unknowns(poly)):
            with_j = {m: x for m, x in poly.items() if j in dict(m)}
            if any(dict(m)[j] != 1 for m in with_j):
                continue
            if len(with_j) > 1:
                continue
            ((m, x),) = with_j.items()
            bottom: Poly = {_times(m, ((j, -1),)): x}
            top: Poly = {k: -y for k, y in poly.items() if k not in with_j}
            if not top:
                continue
            rest = [_replace(p, j, top, bottom) for p in polys if p is not poly]
            out = []
            for branch in _eliminate(rest, open_ - {j}):
                value = _value(top, branch) / _value(bottom, branch) if _value(bottom, branch) else np.nan
                if np.isfinite(value):
                    out.append({**branch, j: value})
            return out
    raise _NotReducible


def _replace(poly: Poly, j: int, top: Poly, bottom: Poly) -> Poly:
    """Put top/bottom for unknown j, multiplied out."""
    degree = max((dict(m).get(j, 0) for m in poly), default=0)
    if degree == 0:
        return poly
    one: Poly = {(): 1.0}
    tops, bottoms = [one], [one]
    for _ in range(degree):
        tops.append(_product(tops[-1], top))
        bottoms.append(_product(bottoms[-1], bottom))
    out: Poly = {}
    for m, x in poly.items():
        e = dict(m).get(j, 0)
        others: Powers = tuple((k, n) for k, n in m if k != j)
        term: Poly = {others: x}
        for k, y in _product(_product(term, tops[e]), bottoms[degree - e]).items():
            _accumulate(out, k, y)
    return _whole(out)


def _real_roots(poly: Poly, j: int) -> list[float]:
    degree = max(dict(m).get(j, 0) for m in poly)
    coefficients = np.zeros(degree + 1)
    for m, x in poly.items():
        coefficients[degree - dict(m).get(j, 0)] = x
    if degree == 1:
        return [float(-coefficients[1] / coefficients[0])]
    # scale the unknown so that first and last coefficient are alike
    last = coefficients[np.flatnonzero(coefficients)[-1]]
    order = int(np.flatnonzero(coefficients)[-1])
    scale = abs(last / coefficients[0]) ** (1 / order) if order else 1.0
    roots = np.roots(coefficients * scale ** np.arange(degree, -1, -1.0)) * scale
    real = [float(r.real) for r in roots if abs(r.imag) <= NEARLY_REAL * abs(r)]
    return sorted(set(real))


def _value(poly: Poly, values: Mapping[int, float]) -> float:
    return float(sum(x * np.prod([values[j] ** e for j, e in m]) for m, x in poly.items()))


def _search(system: PolynomialSystem, free: list[int], base: FloatArray) -> list[FloatArray]:
    """Levenberg–Marquardt from many starting points of all magnitudes and signs."""
    from scipy.optimize import least_squares

    size = np.where(system.values != 0, np.abs(system.values), 1.0)
    rng = np.random.default_rng(1)
    found: list[FloatArray] = []

    def residual(x: FloatArray) -> FloatArray:
        theta = base.copy()
        theta[free] = x
        return np.asarray((system.matrix @ system.monomials(theta) - system.values) / size)

    def jacobian(x: FloatArray) -> FloatArray:
        theta = base.copy()
        theta[free] = x
        return np.asarray(system.jacobian(theta)[:, free] / size[:, None])

    method = "lm" if len(system.values) >= len(free) else "trf"
    typical = float(np.exp(np.mean(np.log(size))))
    for i in range(STARTS):
        magnitude = 10 ** rng.uniform(-2, 2, len(free)) * (1.0 if i % 2 else typical)
        start = magnitude * (rng.choice((-1, 1), len(free)) if i % 4 > 1 else 1)
        with np.errstate(all="ignore"):
            try:
                fit = least_squares(residual, start, jacobian, method=method, x_scale="jac", max_nfev=100)
            except (ValueError, np.linalg.LinAlgError):  # an unknown ran away to infinity
                continue
        theta = base.copy()
        theta[free] = fit.x
        if fit.cost < 1e-2 and np.isfinite(theta).all():
            known = any(np.all(np.abs(theta - t) <= 1e-5 * np.maximum(np.abs(t), 1e-300)) for t in found)
            if not known:
                found.append(theta)
    return found
