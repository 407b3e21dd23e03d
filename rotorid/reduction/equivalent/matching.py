"""Masses that match given frequencies exactly: all positive sets, alike in frequencies and not in shapes.

The n-mass model with compliance α has the eigenvalues λ = 1/ω² of α diag(m), so that

    det(z I − α diag(m)) = Π_k (z − λ_k):    Σ_{|S| = j} det α_S Π_{i ∈ S} m_i = e_j(λ),    j = 1 … n,

with the principal minors of α over sets S of j masses and the elementary symmetric functions e_j. These are
n polynomial equations of degrees 1 … n: at most n! mass sets. Several positive ones are usual, or none:
frequencies alone do not determine where the mass is ([S] 1.10 therefore uses the shapes as well). For n > 1
the number of positive sets is even unless two of them coincide: the equations map the positive masses
properly into, and not onto, the space of their right sides, so that the signs of their Jacobian at the
solutions cancel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import BoolArray, FloatArray, IntArray
from rotorid.base.text import counted
from rotorid.reduction.equivalent.vibration import natural_frequencies

EXACT = 1e-9
"""Largest relative difference of frequencies of a set that counts as matching."""

SAME = 1e-6
"""Sets whose masses differ by less than this share are one."""

WIDEST = 1000.0
"""Ratio of highest to lowest frequency beyond which float64 cannot confirm a match."""

STARTS = 2000
"""Random starts in a round, for four masses and more."""

ROUNDS = 5
"""Rounds at most; there is another one as long as a set was reached fewer times than RARE."""

RARE = 5

STEPS = 60
"""Newton steps of each start."""


@dataclass(frozen=True, eq=False)
class Matching:
    """All positive mass sets found whose n-mass model has exactly n given frequencies.

    Attributes
    ----------
    masses
        kg, shape (s, n), by ascending first mass; s may be 0.
    frequencies
        Those given, rad/s, ascending, shape (n,).
    complete
        Whether the sets are proven to be all: up to three masses by elimination.
    found
        How many of the starts ended at each set, shape (s,).
    starts
        How many starts there were.
    warnings
        What is not certain.
    """

    masses: FloatArray
    frequencies: FloatArray
    complete: bool
    found: IntArray
    starts: int
    warnings: tuple[str, ...]


def matching_masses(compliance: ArrayLike, frequencies: ArrayLike) -> FloatArray:
    """All positive mass sets whose n-mass model has exactly these n frequencies.

    `match` with its masses only; for four masses and more look at what it says about completeness.

    Parameters
    ----------
    compliance
        m/N, shape (n, n).
    frequencies
        rad/s, shape (n,).

    Returns
    -------
    kg, shape (s, n): s sets, which may be none.

    Examples
    --------
    >>> matching_masses([[2e-8, 1e-8], [1e-8, 2e-8]], [1e3, 2e3]).round(3)
    array([[19.282, 43.218],
           [43.218, 19.282]])
    """
    return match(compliance, frequencies).masses


def match(compliance: ArrayLike, frequencies: ArrayLike, *, starts: int = STARTS, seed: int = 0) -> Matching:
    """Find all positive mass sets whose n-mass model has exactly n given frequencies.

    One, two and three masses: by elimination, all roots of one polynomial (degree 1, 2, 6). Four and more:
    Newton's method from many random starts, which proves nothing about sets that none of them reached. Every
    root is refined and every set confirmed to 1e-9 by `natural_frequencies`.

    Parameters
    ----------
    compliance
        m/N, shape (n, n), symmetric, positive definite.
    frequencies
        rad/s, shape (n,), positive, in any order.
    starts, seed
        Of the random starts, for four masses and more: their number in a round. There are up to five rounds
        while a set was reached by fewer than five starts, or the number of sets is odd.

    Raises
    ------
    ValueError
        For shapes that do not fit, entries that are not finite, a compliance that is not symmetric and
        positive definite, frequencies that are not positive, repeat, or are further apart than float64
        resolves.

    Notes
    -----
    Newton's equations are ln λ_j(m) = ln λ_j in ln m: with unit vectors v_j of √m α √m the derivative of
    ln λ_j by ln m_i is v_ij². All starts go through each step together.
    """
    alpha, omega = _checked(compliance, frequencies)
    n = len(omega)
    lam = 1.0 / omega**2
    # dimensionless: shares u_i = α_ii m_i / Σ λ, which sum to one, and a compliance with unit diagonal
    root = np.sqrt(np.diag(alpha))
    shape = alpha / np.outer(root, root)
    z = lam / lam.sum()
    first = _random(n, starts, seed) if n > 3 else (_one, _two, _three)[n - 1](shape, z)
    u = _refined(shape, z, first)
    used, sets, found = len(first), *_distinct(u[_confirmed(shape, z, u)])
    for extra in range(1, ROUNDS if n > 3 else 1):
        if not found.size or (found.min() >= RARE and len(found) % 2 == 0):
            break
        u = _refined(shape, z, _random(n, starts, (seed, extra)))
        sets, found = _distinct(np.concatenate((np.repeat(sets, found, axis=0), u[_confirmed(shape, z, u)])))
        used += len(u)
    masses = sets * lam.sum() / np.diag(alpha)
    kept = [np.abs(natural_frequencies(alpha, m)[0] / omega - 1.0).max() < EXACT for m in masses]
    masses, found = masses[kept], found[kept]
    return Matching(
        masses=masses,
        frequencies=omega,
        complete=n <= 3,
        found=found,
        starts=used,
        warnings=() if n <= 3 else (_incomplete(n, used, found),),
    )


def _incomplete(n: int, starts: int, found: IntArray) -> str:
    rare = f", the rarest reached by {found.min()} of them" if found.size else ""
    odd = "; their number should be even: one is missing or two coincide" if len(found) % 2 else ""
    return (
        f"{counted(len(found), 'set')} of masses found from {starts} random starts{rare}: for {n} masses "
        f"it is not proven that there are no others{odd}"
    )


def _checked(compliance: ArrayLike, frequencies: ArrayLike) -> tuple[FloatArray, FloatArray]:
    alpha = np.asarray(compliance, dtype=float)
    omega = np.sort(np.atleast_1d(np.asarray(frequencies, dtype=float)))
    n = len(omega)
    if omega.ndim != 1 or n == 0 or alpha.shape != (n, n):
        raise ValueError(
            f"n masses have a compliance (n, n) and n frequencies; got {alpha.shape} and {omega.shape}"
        )
    if not (np.isfinite(alpha).all() and np.isfinite(omega).all()):
        raise ValueError("compliance and frequencies must be finite")
    if (omega <= 0).any():
        raise ValueError("frequencies must be positive: masses cannot match a rigid-body mode")
    if np.abs(alpha - alpha.T).max() > 1e-6 * np.abs(alpha).max():
        raise ValueError("the compliance must be symmetric (Maxwell)")
    alpha = (alpha + alpha.T) / 2
    if not np.linalg.eigvalsh(alpha)[0] > 0:
        raise ValueError("the compliance must be positive definite: every force must do positive work")
    if (np.diff(omega) <= EXACT * omega[1:]).any():
        raise ValueError("two frequencies are equal: give n different ones")
    if omega[-1] > WIDEST * omega[0]:
        raise ValueError(
            f"the frequencies differ by more than a factor of {WIDEST:g}: float64 cannot confirm a match; "
            "use fewer masses"
        )
    return alpha, omega


def _one(shape: FloatArray, z: FloatArray) -> FloatArray:
    return np.ones((1, 1))


def _two(shape: FloatArray, z: FloatArray) -> FloatArray:
    """u1 + u2 = 1, p u1 u2 = z1 z2 with p = det α (unit diagonal): both orders of the roots."""
    product = z[0] * z[1] / (1.0 - shape[0, 1] ** 2)
    return _pairs(np.array([1.0]), np.array([product]))


def _three(shape: FloatArray, z: FloatArray) -> FloatArray:
    """Starts (s, 3) next to every positive set of three, by elimination.

    With unit diagonal, p_ij = 1 − α_ij² and d = det α the equations are u1 + u2 + u3 = 1,
    p12 u1 u2 + p13 u1 u3 + p23 u2 u3 = s and u1 u2 u3 = κ = z1 z2 z3 / d. For given u1 = a the others have
    the sum t = 1 − a and the product q = κ/a, and p12 u2 + p13 u3 = R/a² with R = s a − p23 κ. Solved for
    u2, u3 and put into u2 u3 = q:

        (R − p13 a² t)(p12 a² t − R) = κ a³ (p12 − p13)²,

    of degree 6 in a. Where p12 = p13 the left side is a square, whose roots are the right ones but double; so
    each of the masses takes the part of the first in turn, and every (a, roots of x² − t x + q) is a start.
    """
    p = 1.0 - shape**2
    s, kappa = float(z[0] * z[1] + z[0] * z[2] + z[1] * z[2]), float(z.prod() / np.linalg.det(shape))
    size = np.abs(p).max()
    p, s = p / size, s / size
    P = np.polynomial.Polynomial
    a, t = P([0.0, 1.0]), P([1.0, -1.0])
    starts = [np.empty((0, 3))]
    for i, j, k in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        R = s * a - p[j, k] * kappa
        left = (R - p[i, k] * a**2 * t) * (p[i, j] * a**2 * t - R)
        roots = (left - kappa * (p[i, j] - p[i, k]) ** 2 * a**3).roots()
        # a double root may come out as a pair that is a little complex: its real part is the start
        real = roots.real[
            (roots.real > 0) & (roots.real < 1) & (np.abs(roots.imag) < 0.05 * np.abs(roots.real))
        ]
        others = _pairs(1.0 - real, kappa / real)
        both = np.concatenate((real, real))
        start = np.empty((len(both), 3))
        start[:, i], start[:, j], start[:, k] = both, others[:, 0], others[:, 1]
        starts.append(start)
    return np.concatenate(starts)


def _pairs(total: FloatArray, product: FloatArray) -> FloatArray:
    """Both orders of the roots of x² − total x + product, (2 s, 2); of complex ones the real part twice."""
    half = np.sqrt(np.maximum(total**2 / 4 - product, 0.0))
    large = total / 2 + half
    small = np.where(half > 0, product / large, total / 2)
    return np.concatenate((np.column_stack((large, small)), np.column_stack((small, large))))


def _random(n: int, count: int, seed: int | tuple[int, int]) -> FloatArray:
    """Shares that sum to one, (count, n): evenly spread, and as many with masses of different orders."""
    if count < 1:
        raise ValueError(f"starts must be at least 1, not {count}")
    rng = np.random.default_rng(seed)
    even = rng.dirichlet(np.ones(n), size=(count + 1) // 2)
    uneven = rng.dirichlet(np.full(n, 0.3), size=count // 2)
    return np.maximum(np.concatenate((even, uneven)), 1e-6)


def _spectra(shape: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithms of λ, descending (s, n), and their derivatives by x = ln u, (s, mode, mass)."""
    root = np.exp(x / 2)
    lam, V = np.linalg.eigh(root[:, :, None] * shape * root[:, None, :])
    tiny = np.finfo(float).tiny
    return np.log(np.maximum(lam[:, ::-1], tiny)), np.swapaxes(V[:, :, ::-1], 1, 2) ** 2


def _refined(shape: FloatArray, z: FloatArray, starts: FloatArray) -> FloatArray:
    """Newton's method from all starts together, with steps shortened where the residual would grow."""
    x = np.log(starts)
    aim = np.log(z)
    logs, J = _spectra(shape, x)
    active = np.arange(len(x))
    for _ in range(STEPS):
        residual = logs - aim
        size = np.abs(residual).max(axis=1)
        active = active[size[active] > 1e-15]
        if not active.size:
            break
        # least squares with a cut-off: at a fold J is singular, and there the smallest step is the right one
        step = -(np.linalg.pinv(J[active], rcond=1e-10) @ residual[active][:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 2.0 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        waiting, scale, moved = np.arange(len(active)), 1.0, []
        for _ in range(6):
            if not waiting.size:
                break
            trial = x[active[waiting]] + scale * step[waiting]
            new_logs, new_J = _spectra(shape, trial)
            better = np.abs(new_logs - aim).max(axis=1) < size[active[waiting]]
            rows = active[waiting[better]]
            x[rows], logs[rows], J[rows] = trial[better], new_logs[better], new_J[better]
            moved.append(rows)
            waiting, scale = waiting[~better], scale / 3
        active = np.sort(np.concatenate(moved))  # no step helps the rest: at rounding, or stuck
    return np.asarray(np.exp(x))


def _confirmed(shape: FloatArray, z: FloatArray, u: FloatArray) -> BoolArray:
    logs, _ = _spectra(shape, np.log(u))
    return np.asarray(np.abs(logs - np.log(z)).max(axis=1) < EXACT)


def _distinct(u: FloatArray) -> tuple[FloatArray, IntArray]:
    """Each set once, by ascending first share, and how often it was found."""
    sets: list[FloatArray] = []
    count: list[int] = []
    for row in u:
        same = [i for i, known in enumerate(sets) if np.abs(np.log(row / known)).max() < SAME]
        if same:
            count[same[0]] += 1
        else:
            sets.append(row)
            count.append(1)
    # rounded: equal first shares are equal only to rounding
    order = np.lexsort(np.round(np.log(sets), 7).T[::-1]) if sets else np.empty(0, dtype=np.intp)
    return np.array(sets).reshape(-1, u.shape[1])[order], np.array(count, dtype=np.int64)[order]
