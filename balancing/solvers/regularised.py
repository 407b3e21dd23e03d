"""Ridge and truncated solutions: small weights in planes that act alike, at the price of a bias.

With the rows weighted by w and the columns scaled to length 1, B = diag(w) W S⁻¹ = U diag(σ) Vᴴ (S holds the
lengths), y = w Y and x = S D, both solutions filter the directions of V:

    x = −f(BᴴB) Bᴴ y = −V f(σ²) Vᴴ Bᴴ y,

    ridge:     f(μ) = 1/(μ + λ²), λ = strength · σ₁;  minimises |y + B x|² + λ² |x|²
    truncated: f(μ) = 1/μ for the largest singular values, 0 for the rest

The differential of a function of a Hermitian matrix M = BᴴB is V (F ∘ Vᴴ dM V) Vᴴ with the divided
differences F_ij = (f(μᵢ) − f(μⱼ)) / (μᵢ − μⱼ) (Daleckii and Krein), hence with dM = dBᴴ B + Bᴴ dB and
c = Vᴴ Bᴴ y

    dx = −V (F ∘ Vᴴ dM V) c − f(M) (dBᴴ y + Bᴴ dy) + V f² c dλ²        (the last term: ridge only)

with dλ² = 2 strength² σ₁ Re(u₁ᴴ dB v₁). The lengths S belong to the measured columns as well: with
dA = diag(w) dW and dS_q = Re(B_qᴴ dA_q), dB_q = (dA_q − B_q dS_q)/S_q and dD_q = (dx_q − D_q dS_q)/S_q.
Every term is linear in the change δ of one coefficient or in its conjugate: l δ + r δ̄.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from balancing.coefficients.identifiability import check_effect, scaled_columns, separation
from balancing.data.reading_errors import symmetric
from balancing.solvers.conditioning import check_channels, check_stack
from balancing.solvers.error_propagation import error_form, real_jacobian
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import RCOND

ROBUST = 0.3
"""γ of the robust cross-validation."""
BIAS, DETERMINED = 0.05, 5.0
"""Share that a ridge chosen by itself may take from combinations with an effect so many times their error."""
STRENGTHS = np.geomspace(1e-4, 1.0, 241)
"""From which strength="auto" chooses, 4 % apart."""


@dataclass(frozen=True, eq=False)
class Regularised:
    """A regularised correction.

    Attributes
    ----------
    weights
        Shape (P,). Biased towards zero.
    residual
        Predicted readings Y + W D, shape (N,).
    covariance
        Of (Re D₁, Im D₁, …), shape (2P, 2P), of first order; None where errors are unknown. It is that of the
        estimate: the bias is not in it, hence a region around `weights` need not contain the true correction
        with 95 %.
    jacobian
        Derivatives of the stretched weights by (Re Y, Im Y, Re W₁, …) of each reading, (N, 2P, 2P + 2), at
        fixed strength or number.
    strength
        Of a ridge, relative to the largest singular value; None for a truncated solution.
    kept
        Number of combinations of planes that a truncated solution keeps; None for a ridge.
    effective
        Effective number of determined combinations, Σ σ² f(σ²) ≤ P.
    singular_values
        Of the row-weighted, column-scaled W, shape (P,), the last ones zero if N < P.
    words
        What the user must know about the solution.
    """

    weights: ComplexArray
    residual: ComplexArray
    covariance: FloatArray | None
    jacobian: FloatArray
    strength: float | None
    kept: int | None
    effective: float
    singular_values: FloatArray
    words: str


@dataclass(frozen=True, eq=False)
class _Problem:
    """Weighted, scaled and decomposed: B (N, P) = U σ Vᴴ, BV = B V; σ (P,), row weights w and lengths S."""

    W: ComplexArray
    Y: ComplexArray
    w: FloatArray
    S: FloatArray
    B: ComplexArray
    BV: ComplexArray
    sigma: FloatArray
    V: ComplexArray

    @property
    def c(self) -> ComplexArray:
        """Vᴴ Bᴴ y."""
        return np.asarray(self.BV.conj().T @ (self.w * self.Y))


def ridge(
    W: ArrayLike,
    Y: ArrayLike,
    strength: float | str,
    row_weights: ArrayLike | None = None,
    *,
    channels: FloatArray | None = None,
    total: FloatArray | None = None,
    planes: Sequence[str] | None = None,
) -> Regularised:
    """Minimise Σ wᵢ² |Yᵢ + (W D)ᵢ|² + (strength · σ₁)² Σ |s_p D_p|².

    Parameters
    ----------
    W, Y
        Stacked influence coefficients (N, P) and vibration (N,).
    strength
        Relative to the largest singular value σ₁ of the row-weighted W with columns scaled to length 1 by
        1/s_p: combinations of planes whose singular value is well above strength · σ₁ stay as they are, those
        below vanish. 0.01 hardly changes planes with a condition number of 10; 0.1 is much. "auto": by
        generalised cross-validation (`cross_validated`), and not more than is `harmless`.
    row_weights
        How much each reading counts, (N,), ≥ 0; default all alike.
    channels
        Covariance of (Re Y, Im Y, Re W₁, …) of each reading, (N, 2P + 2, 2P + 2); None: unknown.
    total
        The same with what the readings have in common, which "auto" looks at; None: nothing.
    planes
        Names for messages.

    Raises
    ------
    ValueError
        For a strength that is not above zero, NaN, shapes that do not fit, or "auto" with N ≤ P.
    UndeterminedError
        For a plane without any effect.

    Examples
    --------
    >>> W = [[1, 1], [1, 1.01], [1, 0.99]]
    >>> found = ridge(W, [-2, -2, -2.03], 0.05)
    >>> found.weights.round(2).real.tolist(), round(found.effective, 2)
    ([1.02, 0.99], 1.0)
    """
    problem = _problem(W, Y, row_weights, planes)
    if strength == "auto":
        most = harmless(W, channels if total is None else total, row_weights)
        chosen = min(cross_validated(W, Y, row_weights), most)
        note = ", chosen by generalised cross-validation"
        if chosen == most:
            note += f" and kept so small that what is determined loses at most {100 * BIAS:g} %"
    elif isinstance(strength, str) or not (np.isfinite(strength) and strength > 0):
        raise ValueError(
            f"the strength of a ridge is a number above 0, such as 0.05, or 'auto'; got {strength!r}"
        )
    else:
        chosen, note = float(strength), ""
    mu = problem.sigma**2
    f = 1 / (mu + chosen**2 * mu[0])
    words = f"ridge of strength {chosen:.2g}{note}"
    return _solution(problem, f, -np.outer(f, f), words, channels, strength=chosen)


def harmless(W: ArrayLike, channels: FloatArray | None, row_weights: ArrayLike | None = None) -> float:
    """Largest strength of a ridge that takes no more than `BIAS` from combinations that are determined.

    Determined is a combination v of the planes whose effect |B v| is `DETERMINED` times its error: cross-
    validation looks at the readings alone, and shrinks what explains little of them.

    Parameters
    ----------
    W, channels, row_weights
        As in `ridge`. Infinite without errors.
    """
    if channels is None:
        return np.inf
    K, _, w = check_stack(W, np.ones(np.shape(W)[0]), row_weights)
    S, s, V = separation(w[:, None] * K)
    errors = error_form(channels, w)[1:, 1:] / np.outer(S, S)
    squares = np.einsum("pk,pq,qk->k", V.conj(), errors, V).real
    clear = s[s**2 > DETERMINED**2 * squares]
    return float(clear.min() / s[0] * np.sqrt(BIAS / (1 - BIAS))) if clear.size else np.inf


def truncated(
    W: ArrayLike,
    Y: ArrayLike,
    keep: float,
    row_weights: ArrayLike | None = None,
    *,
    channels: FloatArray | None = None,
    planes: Sequence[str] | None = None,
) -> Regularised:
    """Least squares over the best determined combinations of planes only; the others stay without weights.

    Parameters
    ----------
    W, Y, row_weights, channels, planes
        As in `ridge`.
    keep
        1, 2, …: the number of combinations; below 1: the smallest singular value to keep, relative to the
        largest. What is zero to rounding is never kept.

    Raises
    ------
    ValueError
        For a `keep` that is neither, for more combinations than there are, for a cut between equal singular
        values, NaN, shapes that do not fit.
    UndeterminedError
        For a plane without any effect.
    """
    problem = _problem(W, Y, row_weights, planes)
    sigma, P = problem.sigma, len(problem.sigma)
    there = int(np.count_nonzero(sigma))
    if not (np.isfinite(keep) and keep > 0 and (keep < 1 or keep == int(keep))):
        raise ValueError(
            "keep is the number of combinations of planes (1, 2, …), or the smallest singular value relative "
            f"to the largest (between 0 and 1); got {keep!r}"
        )
    kept = int(keep) if keep >= 1 else int(np.count_nonzero(sigma >= keep * sigma[0]))
    if kept > there:
        raise ValueError(
            f"the readings determine {there} combinations of the {P} planes; {kept} cannot be kept"
        )
    if kept < there and sigma[kept - 1] - sigma[kept] <= RCOND * sigma[0]:
        raise ValueError(
            f"the singular values {kept} and {kept + 1} are equal: there is no reason to keep one and not "
            "the other; keep more or fewer combinations"
        )
    mu = sigma**2
    f = np.zeros(P)
    f[:kept] = 1 / mu[:kept]
    F = np.zeros((P, P))
    F[:kept, :kept] = -np.outer(f[:kept], f[:kept])
    F[:kept, kept:] = f[:kept, None] / (mu[:kept, None] - mu[kept:])
    F[kept:, :kept] = F[:kept, kept:].T
    return _solution(problem, f, F, f"truncated to {kept} of {P}", channels, kept=kept)


def cross_validated(W: ArrayLike, Y: ArrayLike, row_weights: ArrayLike | None = None) -> float:
    """Strength of a ridge by robust generalised cross-validation.

    Minimises (γ + (1 − γ) Σ s²/N) |w r|² / (N − Σ s)², s = σ² f(σ²), γ = 0.3. Each reading is predicted from
    the others; the strength that does so best wins. With γ = 1, the usual formula, one noise in four is
    taken for something to be explained by enormous weights where planes act alike. Needs no stated errors,
    but more readings than planes. Rows of weight zero are not counted.

    Raises
    ------
    ValueError
        With fewer than P + 1 readings.

    Notes
    -----
    Source: Golub, Heath and Wahba (1979), Technometrics 21, 215; Lukas (2006), Inverse Problems 22, 1883.
    """
    problem = _problem(W, Y, row_weights, None)
    y = problem.w * problem.Y
    N, P = int(np.count_nonzero(problem.w)), len(problem.sigma)
    if N <= P:
        raise ValueError(
            f"the strength of a ridge cannot be chosen from {N} readings for {P} planes: give a number "
            "(0.01 to 0.1), or add sensors or speeds"
        )
    mu = problem.sigma**2
    solid = problem.sigma > 0
    U = problem.BV[:, solid] / problem.sigma[solid]
    along = U.conj().T @ y
    outside = float(np.linalg.norm(y - U @ along) ** 2)
    share = mu[solid] / (mu[solid] + STRENGTHS[:, None] ** 2 * mu[0])
    misfit = outside + ((1 - share) ** 2) @ np.abs(along) ** 2
    robust = ROBUST + (1 - ROBUST) * (share**2).sum(axis=1) / N
    return float(STRENGTHS[np.argmin(robust * misfit / (N - share.sum(axis=1)) ** 2)])


def _problem(
    W: ArrayLike, Y: ArrayLike, row_weights: ArrayLike | None, planes: Sequence[str] | None
) -> _Problem:
    K, y, w = check_stack(W, Y, row_weights)
    told = separation(w[:, None] * K)
    check_effect(told, planes or [str(p + 1) for p in range(K.shape[1])])
    B, S = scaled_columns(w[:, None] * K)
    # what is zero to rounding is zero: a weak ridge would blow up the rounding
    solid = np.arange(len(S)) < told.rank
    sigma = np.where(solid, told.singular_values, 0.0)
    return _Problem(K, y, w, S, B, B @ told.directions * solid, sigma, told.directions)


def _solution(
    problem: _Problem,
    f: FloatArray,
    F: FloatArray,
    words: str,
    channels: FloatArray | None,
    *,
    strength: float | None = None,
    kept: int | None = None,
) -> Regularised:
    D = -(problem.V @ (f * problem.c)) / problem.S
    J = _jacobian(problem, f, F, D, strength)
    covariance = None
    if channels is not None:
        covariance = symmetric(np.sum(J @ check_channels(channels, problem.W) @ np.swapaxes(J, 1, 2), axis=0))
    effective, P = float(np.sum(problem.sigma**2 * f)), len(D)
    if kept is None:
        words += f": {effective:.2g} of {P}"
    words += (
        f" combinations of the planes{'' if kept else ' are determined'}; the weights are biased "
        "towards zero, and the intervals are those of this estimate, not of the true unbalance"
    )
    return Regularised(
        weights=D,
        residual=problem.Y + problem.W @ D,
        covariance=covariance,
        jacobian=J,
        strength=strength,
        kept=kept,
        effective=effective,
        singular_values=problem.sigma,
        words=words,
    )


def _jacobian(
    problem: _Problem, f: FloatArray, F: FloatArray, D: ComplexArray, strength: float | None
) -> FloatArray:
    """Derivatives of the stretched D, (N, 2P, 2P + 2); the derivation is in the head of this module."""
    w, S, B, BV, V, c = problem.w, problem.S, problem.B, problem.BV, problem.V, problem.c
    N, P = B.shape
    # dx = l δ + r conj(δ) for a change δ of B_nq; arrays (N, P of x, P of q)
    T = V @ (F * c).T  # T_qi = Σ_j F_ij V_qj c_j
    Q = BV @ (F * c).T  # Q_ni = Σ_j F_ij (BV)_nj c_j
    G = (V * f) @ V.conj().T  # f(M)
    lin = -np.einsum("pi,ni,qi->npq", V, BV.conj(), T)
    anti = -np.einsum("pi,qi,ni->npq", V, V.conj(), Q) - (w * problem.Y)[:, None, None] * G
    if strength is not None:
        along = (V @ (f**2 * c)) * strength**2 * problem.sigma[0]
        grown = np.outer(BV[:, 0] / problem.sigma[0], V[:, 0].conj())  # u₁ v₁ᴴ
        lin += along[:, None] * grown.conj()[:, None, :]
        anti += along[:, None] * grown[:, None, :]
    # through the lengths of the columns, which follow Re(B_qᴴ dA_q) = Σ (conj(B) δ + B conj(δ)) / 2
    stretching = np.einsum("npq,nq->pq", lin, B) + np.einsum("npq,nq->pq", anti, B.conj())
    lengths = (stretching + np.diag(D * S)) / 2
    to_W = w[:, None, None] / (S[:, None] * S)
    lin = (lin - lengths * B.conj()[:, None, :]) * to_W
    anti = (anti - lengths * B[:, None, :]) * to_W
    to_Y = -np.einsum("pi,i,ni->np", V, f, BV.conj()) * w[:, None] / S
    return real_jacobian(
        np.concatenate((to_Y[:, :, None], lin), axis=2),
        np.concatenate((np.zeros((N, P, 1)), anti), axis=2),
    )
