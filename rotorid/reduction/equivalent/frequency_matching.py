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

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.reduction.equivalent.small_model_modes import natural_frequencies

FARTHEST = 300.0
"""Largest logarithm of a mass in a trial step, which float64 can square."""

MOST = 3
"""Masses up to which elimination gives one polynomial."""

EXACT = 1e-9
"""Largest relative difference of frequencies of a set that counts as matching."""

SAME = 1e-6
"""Sets whose masses differ by less than this share are one."""

WIDEST = 1000.0
"""Ratio of highest to lowest frequency beyond which float64 cannot confirm a match."""


def matching_masses(compliance: ArrayLike, frequencies: ArrayLike) -> FloatArray:
    """All positive sets of one, two or three masses whose model has exactly these frequencies.

    By elimination: all roots of one polynomial (of degree 1, 2, 6), each refined, and confirmed to 1e-9 by
    `natural_frequencies`.

    Parameters
    ----------
    compliance
        m/N, shape (n, n), symmetric, positive definite.
    frequencies
        rad/s, shape (n,), positive, in any order.

    Returns
    -------
    kg, shape (s, n), by ascending first mass: s sets, which may be none.

    Raises
    ------
    ValueError
        For shapes that do not fit, more than three masses, entries that are not finite, a compliance that is
        not symmetric and positive definite, frequencies that are not positive, repeat, or are further apart
        than float64 resolves.

    Examples
    --------
    >>> matching_masses([[2e-8, 1e-8], [1e-8, 2e-8]], [1e3, 2e3]).round(3)
    array([[19.282, 43.218],
           [43.218, 19.282]])
    """
    alpha, omega = _checked(compliance, frequencies)
    lam = 1.0 / omega**2
    # dimensionless: shares u_i = α_ii m_i / Σ λ, which sum to one, and a compliance with unit diagonal
    root = np.sqrt(np.diag(alpha))
    shape = alpha / np.outer(root, root)
    z = lam / lam.sum()
    starts = (_one, _two, _three)[len(omega) - 1](shape, z)
    sets: list[FloatArray] = []
    for start in starts:
        m = _refined(shape, z, start) * lam.sum() / np.diag(alpha)
        matches = np.abs(natural_frequencies(alpha, m)[0] / omega - 1.0).max() < EXACT
        if matches and not any(np.abs(np.log(m / known)).max() < SAME for known in sets):
            sets.append(m)
    # rounded: equal first masses are equal only to rounding
    sets.sort(key=lambda m: np.round(np.log(m), 7).tolist())
    return np.array(sets).reshape(-1, len(omega))


def _checked(compliance: ArrayLike, frequencies: ArrayLike) -> tuple[FloatArray, FloatArray]:
    alpha = np.asarray(compliance, dtype=float)
    omega = np.sort(np.atleast_1d(np.asarray(frequencies, dtype=float)))
    n = len(omega)
    if omega.ndim != 1 or n == 0 or alpha.shape != (n, n):
        raise ValueError(
            f"n masses have a compliance (n, n) and n frequencies; got {alpha.shape} and {omega.shape}"
        )
    if n > MOST:
        raise ValueError(f"sets that match {n} frequencies are not searched: at most {MOST} masses")
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


def _refined(shape: FloatArray, z: FloatArray, start: FloatArray) -> FloatArray:
    """The masses next to a start that match, if there are any: ln λ(u) = ln z in the unknowns ln u.

    With unit vectors v_j of √u α √u the derivative of ln λ_j by ln u_i is v_ij².
    """
    from scipy.optimize import least_squares

    tiny = np.finfo(float).tiny

    def spectrum(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        root = np.exp(np.clip(x, -FARTHEST, FARTHEST) / 2)
        lam, V = np.linalg.eigh(root[:, None] * shape * root)
        return np.log(np.maximum(lam[::-1], tiny)) - np.log(z), V[:, ::-1].T ** 2

    found = least_squares(
        lambda x: spectrum(x)[0],
        np.log(start),
        jac=lambda x: spectrum(x)[1],
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    return np.asarray(np.exp(found.x))
