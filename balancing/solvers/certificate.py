"""Certified lower bounds for correction weights: what no weights within the limits can do better.

Any complex vectors a and u, one entry per reading, give a bound (weak duality). With r = Y + W D, largest
amplitudes L, and the dual norm ‖a‖* of the objective f(r), Σ|aᵢ|/wᵢ for f = max wᵢ|rᵢ| and ‖a/w‖ for
f = ‖w r‖, every D within the limits obeys

    ‖a‖* f(r) ≥ Re aᴴr ≥ Re (a + u)ᴴr − Σ|uᵢ| Lᵢ = Re zᴴY − Σ|uᵢ| Lᵢ + Re Σ_p conj(g_p) D_p,

z = a + u, g = Wᴴz. The last sum is smallest where each weight stands along the projection of −g_p onto
the sector where it may stand, of length s_p: it is at least −Σ s_p m_p with m_p ≤ M_p and Σ m_p ≤ budget,
which is filled greedily. Planes without a largest weight need s_p = 0: z is corrected for that. So the
bound needs no trust in the solver that proposed a and u; it holds up to the rounding of these few sums.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from balancing.data.limits import Arc
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.regression import gain

_ROUNDING = 1e-11
_SPREAD = 1e-6


@dataclass(frozen=True, eq=False)
class Problem:
    """Weights D (P,) that minimise an amplitude of Y + W D, within limits.

    Attributes
    ----------
    W, Y
        Shapes (N, P), (N,).
    row_weights
        ≥ 0, shape (N,).
    residual, max_weight
        Largest amplitudes (N,) and weights (P,), infinite for none.
    sectors
        Where each plane's weight may stand, convex (width ≤ π); None: anywhere.
    budget
        Largest sum of the weights' sizes.
    minmax
        Minimise max wᵢ|rᵢ| instead of ‖w r‖.
    """

    W: ComplexArray
    Y: ComplexArray
    row_weights: FloatArray
    residual: FloatArray
    max_weight: FloatArray
    sectors: tuple[Arc | None, ...]
    budget: float
    minmax: bool

    def objective(self, weights: ComplexArray) -> float:
        """What is minimised."""
        size = self.row_weights * np.abs(self.Y + self.W @ weights)
        return float(size.max() if self.minmax else np.linalg.norm(size))

    def of_planes(self, chosen: BoolArray) -> Problem:
        """The same of some planes (P,) only."""
        return replace(
            self,
            W=self.W[:, chosen],
            max_weight=self.max_weight[chosen],
            sectors=tuple(s for s, c in zip(self.sectors, chosen, strict=True) if c),
        )


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound, and what each limit contributes to it.

    Attributes
    ----------
    value
        No weights within the limits reach a smaller objective.
    residual_prices, weight_prices
        By how much it falls, at first, where the limit of a reading (N,), or a plane (P,), is relaxed by a
        factor 1 + ε, divided by ε; for min–max also each reading's share in the maximum.
    """

    value: float
    residual_prices: FloatArray
    weight_prices: FloatArray


def project(weight: complex, sector: Arc | None) -> complex:
    """Nearest complex number of a sector (start, width ≤ π) from the origin; `weight` itself for None."""
    if sector is None or weight == 0:
        return complex(weight)
    start, width = sector
    beyond = float(np.mod(np.angle(weight) - start, 2 * np.pi))
    if beyond <= width:
        return complex(weight)
    after, before = beyond - width, 2 * np.pi - beyond
    edge, away = (start + width, after) if after < before else (start, before)
    return complex(max(abs(weight) * np.cos(away), 0.0) * np.exp(1j * edge))


def lower_bound(problem: Problem, a: ComplexArray, u: ComplexArray) -> Bound:
    """Bound from dual vectors a and u, shape (N,) each; u is zero where no amplitude is limited."""
    w, L = problem.row_weights, problem.residual
    N, P = problem.W.shape
    a, u = _corrected(problem, a, u)
    g = problem.W.conj().T @ (a + u)
    reach = np.array([abs(project(-v, s)) for v, s in zip(g.tolist(), problem.sectors, strict=True)])
    limited = np.minimum(problem.max_weight, problem.budget)
    size = np.linalg.norm(problem.W, axis=0) * (np.linalg.norm(a) + np.linalg.norm(u))
    open_ = np.isinf(limited)
    trivial = Bound(0.0, np.zeros(N), np.zeros(P))
    if (reach[open_] > _ROUNDING * size[open_]).any():
        return trivial
    mass = _greedy(reach, limited, problem.budget)
    kept, on = np.where(np.isfinite(L), np.abs(u), 0.0), w > 0
    share = np.zeros(N)
    share[on] = np.abs(a[on]) / w[on]
    norm = float(share.sum() if problem.minmax else np.linalg.norm(share))
    paid = kept * np.where(kept > 0, L, 0.0)
    total = float(np.vdot(a + u, problem.Y).real - paid.sum() - reach @ mass)
    if norm <= 0 or total <= 0:
        return trivial
    prices = paid / norm
    if problem.minmax:
        prices = prices + share / norm * (total / norm)
    return Bound(total / norm, prices, reach * mass / norm)


def _corrected(problem: Problem, a: ComplexArray, u: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Dual vectors changed so that planes without a largest weight cannot lower the sum.

    The smallest change δ of z, rows measured by their weight and by what stands there already, with
    Wᴴδ = the projection of −Wᴴz onto each such plane's sector; what remains belongs to its polar cone.
    """
    where = np.isinf(np.minimum(problem.max_weight, problem.budget))
    if not where.any():
        return a, u
    W, w = problem.W[:, where], problem.row_weights
    sectors = [s for s, free in zip(problem.sectors, where, strict=True) if free]
    on, z = w > 0, a + u
    own = np.where(np.isfinite(problem.residual) & ~on, 1.0, 0.0)
    if own.any():
        own *= np.linalg.norm(w) / np.sqrt(max(on.sum(), 1)) or 1.0
    unit = np.where(on, w, own)
    there = np.zeros(len(w))
    np.divide(np.abs(z), unit, out=there, where=unit > 0)
    spread = unit * (np.sqrt(there + _SPREAD * there.max()) if problem.minmax else 1.0)
    smallest = gain(spread[:, None] * W).conj().T  # of the solutions δ' of (spread W)ᴴ δ' = move
    for _ in range(2):
        g = W.conj().T @ (a + u)
        move = np.array([project(-v, s) for v, s in zip(g.tolist(), sectors, strict=True)])
        change = spread * (smallest @ move)
        a, u = a + np.where(on, change, 0.0), u + np.where(on, 0.0, change)
    return a, u


def _greedy(reach: FloatArray, limited: FloatArray, budget: float) -> FloatArray:
    """Sizes m_p ≤ limited with Σ m_p ≤ budget that make Σ reach m largest; zero where nothing is limited."""
    if np.isinf(budget):
        return np.where(np.isfinite(limited), limited, 0.0)
    order = np.argsort(-reach, kind="stable")
    filled = np.minimum(np.cumsum(limited[order]), budget)
    mass = np.empty_like(reach)
    mass[order] = np.diff(filled, prepend=0.0)
    return mass
