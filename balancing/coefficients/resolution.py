"""Whether measured coefficients tell the planes apart, or only their errors do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from balancing.coefficients.repeatability import tail
from rotorid.base.arrays import ComplexArray, FloatArray

LEVEL, SINGLE_LEVEL = 0.95, 0.99
HOPELESS = 1e3
"""No instrument supports planes that act alike up to so large a condition number."""

_STEPS = 30


class Resolution(NamedTuple):
    """Test of the hypothesis that a combination of the planes, `direction`, has no effect at all.

    `chi_square` with `n` degrees of freedom over all readings, `largest` the part of one reading;
    `direction` (P,) for planes scaled to equal effect.
    """

    chi_square: float
    n: int
    largest: float
    direction: ComplexArray

    def significant(self, readings: int, dof: float | None) -> bool:
        """Whether some reading tells the planes apart: all together at 95 %, or one of them at 99 %."""
        if self.n <= 0:
            return False
        if tail(self.chi_square, self.n, dof) < 1 - LEVEL:
            return True
        return readings * tail(self.largest, 2, dof) < 1 - SINGLE_LEVEL


def resolution(W: ComplexArray, covariance: FloatArray) -> Resolution:
    """Minimise the χ² of the effect W v over all combinations v of the planes.

    Parameters
    ----------
    W
        Stacked coefficients, shape (N, P).
    covariance
        Of (Re W₁, Im W₁, …) of each reading, shape (N, 2P, 2P).

    Notes
    -----
    χ²(v) = Σ |w v|² / σ²(v) over the readings w with the variance σ²(v) = vᴴ S v of each in one direction;
    its minimum has 2N − 2(P − 1) degrees of freedom where the true effects are dependent. Stationary v solve
    A(v) v = B(v) v with A = Σ w wᴴ/σ², B = Σ |w v|² S/σ⁴; the iteration takes the mean of S/σ² for B.
    """
    N, P = W.shape
    norms = np.linalg.norm(W, axis=0)
    scaled = W / norms
    S = hermitian(covariance) / np.outer(norms, norms)
    best: tuple[float, ComplexArray, FloatArray] | None = None
    v = np.linalg.svd(scaled)[2][-1].conj()
    for _ in range(_STEPS):
        effect = np.abs(scaled @ v) ** 2
        variance = np.einsum("p,npq,q->n", v, S, v.conj()).real
        variance = np.maximum(variance, 1e-9 * variance.max())
        if not variance.max() > 0:
            return Resolution(np.inf, 2 * (N - P + 1), np.inf, v)
        each = effect / variance
        total = float(each.sum())
        if best is not None and total > best[0] * (1 - 1e-9):
            break
        best = (total, v, each)
        A = np.einsum("np,nq->pq", scaled.conj(), scaled / variance[:, None])
        B = np.einsum("npq,n->qp", S, 1 / variance) / N
        v = _smallest(A, B)
    assert best is not None
    total, v, each = best
    return Resolution(total, 2 * (N - P + 1), float(each.max()), v)


def hermitian(covariance: FloatArray) -> ComplexArray:
    """S[p, q] = E[dz_p conj(dz_q)] / 2 from covariances (N, 2P, 2P); half: the variance in one direction."""
    N, n, _ = covariance.shape
    C = covariance.reshape(N, n // 2, 2, n // 2, 2)
    real = C[:, :, 0, :, 0] + C[:, :, 1, :, 1]
    imaginary = C[:, :, 1, :, 0] - C[:, :, 0, :, 1]
    return np.asarray((real + 1j * imaginary) / 2)


def _smallest(A: ComplexArray, B: ComplexArray) -> ComplexArray:
    """Eigenvector of A v = λ B v with the smallest λ, of length 1."""
    values, vectors = np.linalg.eigh(B)
    root = vectors / np.sqrt(np.maximum(values, 1e-12 * values.max()))
    v = root @ np.linalg.eigh(root.conj().T @ A @ root)[1][:, 0]
    return np.asarray(v / np.linalg.norm(v))
