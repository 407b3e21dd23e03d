"""Methods of correction: weights D that make Y + W D small, and how to solve again for redrawn data.

Least squares, ridge: with rows weighted by w and columns scaled, (BᴴB + λ²) x = −Bᴴ w Y, λ relative to the
largest singular value. Min–max and limits: `balancing.limits_and_minmax`.

The weighted fit divides residuals by their errors, which depend on D through those of W: normal errors of
covariance C stand in z = (Y, W₁, …, W_P), (Re, Im) pairs, of each reading. With B = [1, D₁, …] stretched,
r = B z = Y + W D and Σ = B C Bᵀ the most likely true values at given D are ẑ = z − C Bᵀ Σ⁻¹ r; what is left,

    Q(D) = Σ w² rᵀ Σ⁻¹ r,

has half the gradient Σ w² Ŵᵀ Σ⁻¹ r, with Ŵ the W part of ẑ, stretched: a least-squares problem of residuals
w L⁻¹ r and rows w L⁻¹ Ŵ, Σ = L Lᵀ. Its matrix M = Σ w² Ŵᵀ Σ⁻¹ Ŵ contains the squares of errors e that Ŵ has
itself, of covariance K = C − C Bᵀ Σ⁻¹ B C; the honest information about D is A = M − Σ w² E[eᵀ Σ⁻¹ e], and
one step from D, −A⁻¹ (gradient), solves the problem for redrawn data. Source: W. A. Fuller, *Measurement
Error Models* (1987), chapters 2 and 3. The gradient has the errors dY + dW D of the true D; each draw takes
that of another draw for it, for with the estimate regions of uncertain weights are too small.

Unbalance outside the planes leaves residuals that no error of a reading explains; large weights would excuse
them by the errors of W. Where χ² is beyond what errors explain (95 %), every reading of Y therefore gets a
further error, alike for all, such that χ² equals its degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.linalg import norm
from numpy.typing import ArrayLike

from balancing.conditioning import UndeterminedError, chance, check_planes, check_stack
from balancing.limits_and_minmax import (
    AT_LIMIT,
    TINY,
    TOLERANCE,
    Bounds,
    InfeasibleError,
    Optimum,
    bounds_of,
    explain,
    nearest,
    smallest_maximum,
    within,
)
from balancing.regions import LEVEL, real_parts
from balancing.trials import Limits
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.choices import Method, find
from rotorid.base.text import capital
from rotorid.regression import solution, solution_and_rank, stretch, unstretch

Resolve = Callable[[ComplexArray, ComplexArray], ComplexArray]
Explained = Callable[[ComplexArray], bool]

FLOOR = 1e-4
"""Every residual of the weighted fit gets a further error of this share of the rms error of all."""
LEAST_INFORMATION = 0.2
"""Share of M that is left to A in any direction."""
STEPS, CLOSE = 500, 1e-10
"""Of the search for the weighted weights: at most so many, until one is so short."""
SETTLED = 1e-6
"""Share of 1 + Q by which the next step would lower Q, at a minimum."""
DRAWN = 1e-6
"""Tolerance of cone programs for redrawn data."""


class NoErrorsError(ValueError):
    """A weighted fit is asked for where no errors are known, or only rounding."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Correction weights and the vibration they should leave.

    Attributes
    ----------
    weights
        Shape (P,), within every limit.
    residual
        Y + W D, shape (N,).
    objective
        max wᵢ|rᵢ| of min–max, else sqrt(Σ wᵢ²|rᵢ|²).
    active_weights, active_residuals
        Planes (P,) at their largest weight, and readings (N,) at their limit.
    resolve
        (W (B, N, P), Y (B, N)) → weights (B, P) of the same problem with redrawn data, NaN where it has no
        solution; further errors of the size `model_error` are drawn in it. NaN for a ridge, whose scatter
        would hide its bias.
    gap
        Largest relative distance of the objective from its optimum, over all readings; None for a closed form
        or a search.
    chi_square, dof
        Of the weighted fit without limits: what its weights leave in units of the errors, with what readings
        have in common, and its degrees of freedom.
    model_error
        Of the weighted fit: standard deviation, in the unit of Y, of what else stands in both parts of every
        reading; 0 where errors explain what the weights leave.
    """

    weights: ComplexArray
    residual: ComplexArray
    objective: float
    active_weights: BoolArray
    active_residuals: BoolArray
    resolve: Resolve
    gap: float | None = None
    chi_square: float | None = None
    dof: int | None = None
    model_error: float = 0.0

    @property
    def explained(self) -> bool:
        """Whether errors alone may leave what the weights leave."""
        return self.model_error == 0


class Job(NamedTuple):
    """Equations W (N, P), Y (N,), row weights w (N,), bounds and names of planes.

    `channels` and `columns` as of `solve`, (N, 2P + 2, 2P + 2) and (M, N, P + 1); `explained` asks whether
    errors alone may leave what weights leave; None: by χ².
    """

    method: str
    W: ComplexArray
    Y: ComplexArray
    w: FloatArray
    bounds: Bounds
    planes: Sequence[str]
    channels: FloatArray
    columns: ComplexArray
    explained: Explained | None = None

    def fitted(self, D: ComplexArray, resolve: Resolve, **more: Any) -> Solution:  # noqa: ANN401
        """The solution with weights D."""
        residual, share = self.Y + self.W @ D, 1 - AT_LIMIT
        left = self.w * np.abs(residual)
        objective = float(left.max() if self.method == "minmax" else np.linalg.norm(left))
        heavy = np.abs(D) >= share * self.bounds.max_weight
        high = np.abs(residual) >= share * self.bounds.residual
        return Solution(D, residual, objective, heavy, high, resolve, **more)


Solver = Callable[[Job], Solution]


def method_words(name: str, *, weighted: bool) -> str:
    """What a method of correction makes small; `weighted`: readings count differently."""
    every: tuple[Method[Any], ...] = (*METHODS, RIDGE)
    method = find(every, name, "method")
    about = method.about.replace("amplitude", "weighted amplitude") if weighted else method.about
    return f"{capital(method.title or method.name)}: {about}."


def solve(  # noqa: PLR0913
    W: ArrayLike,
    Y: ArrayLike,
    method: str = "least-squares",
    *,
    row_weights: ArrayLike | None = None,
    limits: Limits | None = None,
    strength: float | None = None,
    channels: FloatArray | None = None,
    columns: ComplexArray | None = None,
    names: Sequence[str] | None = None,
    conflict: Callable[[Bounds, Sequence[str]], str] = explain,
    explained: Explained | None = None,
) -> Solution:
    """Weights D that make Y + W D small, within limits, and how to solve the same problem for redrawn data.

    Parameters
    ----------
    W, Y
        Influence coefficients (N, P) and readings (N,), complex, stacked speed by speed.
    method
        One of `METHODS`: "least-squares" minimises sqrt(Σ wᵢ²|rᵢ|²), "minmax" max wᵢ|rᵢ|, "weighted" the sum
        of squares of residuals in units of their errors.
    row_weights
        wᵢ ≥ 0, shape (N,); default 1. A reading of weight 0 counts only for its limit.
    limits
        Of weights, amplitudes (its `residual` (S, C) has N entries) and angles; default none.
    strength
        Of a ridge: least squares minimises Σ wᵢ² |rᵢ|² + (strength · σ₁)² Σ |sₚ Dₚ|², σ₁ the largest singular
        value of the row-weighted W with columns scaled to length 1 by 1/sₚ. 0.01 hardly changes planes with a
        condition number of 10; 0.1 is much. Weights are biased towards zero.
    channels
        Covariance of (Re Y, Im Y, Re W₁, …) of each reading, (N, 2P + 2, 2P + 2) or (S, C, …); None: unknown.
    columns
        What of it the readings have in common, as `balancing.Influence.columns`, (M, …, P + 1). The weighted
        fit weighs readings by the rest, and its χ² allows for them.
    names
        Of the planes (P), for messages; default "1", "2", ….
    conflict
        Says which limits cannot be met together; default with plain numbers.
    explained
        Of the weighted fit: whether errors alone may leave what weights (P,) leave; default: by χ² at typical
        sizes of the errors.

    Raises
    ------
    ValueError
        For NaN, shapes that do not fit, an unknown method, a ridge with another method or limits, a weighted
        fit without errors.
    UndeterminedError
        For planes (that may carry a weight) the readings do not tell apart.
    InfeasibleError
        For limits that cannot be met: which ones, and how far to relax them.

    Notes
    -----
    Sources: [S] (33), (40) for the closed form, by SVD of the row-weighted, column-scaled W.

    Examples
    --------
    >>> solution = solve([[1.0], [1.0]], [3.0, 5.0], method="minmax")
    >>> print(f"{solution.weights[0].real:.6f} {solution.objective:.6f}")
    -4.000000 1.000000
    """
    function = find(METHODS, method, "method").function
    K, y, w = check_stack(W, Y, row_weights)
    N, P = K.shape
    planes = names or [str(p + 1) for p in range(P)]
    bounds, n = bounds_of(K, y, limits), 2 * P + 2
    channels = np.zeros((N, n, n)) if channels is None else channels.reshape(N, n, n)
    columns = np.zeros((0, N, P + 1), complex) if columns is None else columns.reshape(-1, N, P + 1)
    job = Job(method, K, y, w, bounds, planes, channels, columns, explained)
    if strength is not None:
        if method != "least-squares" or limits is not None or not 0 < strength < np.inf:
            raise ValueError(
                f"a ridge has a strength above 0, such as 0.05 (got {strength!r}), and goes with least "
                "squares without limits only"
            )
        A = w[:, None] * K
        size = norm(A, axis=0) + TINY
        short = strength * norm(A / size, 2) * np.diag(size)
        D = -solution(np.vstack((A, short)), np.append(w * y, np.zeros(P)))
        return job.fitted(D, lambda W, _: np.nan * W[:, 0])
    if () in bounds.sectors:
        raise ValueError(
            f"forbidden arcs leave plane {planes[bounds.sectors.index(())]!r} no angle: leave it out"
        )
    try:
        return function(job)
    except InfeasibleError:
        raise InfeasibleError(conflict(bounds, planes)) from None


def _closed_form(job: Job) -> ComplexArray:
    """Least squares of the row-weighted, column-scaled equations; refuses dependent planes."""
    A = job.w[:, None] * job.W
    best, rank = solution_and_rank(A, job.w * job.Y)
    if rank < A.shape[1]:
        check_planes(A[job.w > 0], job.planes)
    return -best


def _fit_plain(job: Job) -> Solution:
    best, minmax = _closed_form(job), job.method == "minmax"

    def again(bounds: Bounds, target: ComplexArray, tolerance: float = DRAWN) -> Optimum:
        if minmax:
            return smallest_maximum(bounds, job.w, tolerance)
        root = stretch(np.linalg.qr(job.w[:, None] * bounds.W)[1])
        left = float(np.linalg.norm(job.w * (bounds.Y + bounds.W @ target)))
        return nearest(bounds, target, root, left, tolerance)

    def resolve(W: ComplexArray, Y: ComplexArray) -> ComplexArray:
        A = job.w[:, None] * W
        adjoint = np.conj(np.swapaxes(A, -1, -2))
        drawn = -np.linalg.solve(adjoint @ A, adjoint @ (job.w * Y)[..., None])[..., 0]
        return _within_limits(job.bounds, W, Y, np.asarray(drawn, dtype=complex), again, always=minmax)

    if not minmax and within(job.bounds, best):
        return job.fitted(best, resolve)
    optimum = again(job.bounds, best, TOLERANCE)
    return job.fitted(optimum.weights, resolve, gap=optimum.gap)


def _within_limits(
    bounds: Bounds,
    W: ComplexArray,
    Y: ComplexArray,
    drawn: ComplexArray,
    again: Callable[[Bounds, ComplexArray], Optimum],
    *,
    always: bool = False,
) -> ComplexArray:
    """Weights (B, P) of redrawn data, solved again `always`, or where they are not within the limits."""
    for b in range(len(W)):
        part = bounds._replace(W=W[b], Y=Y[b])
        if always or not within(part, drawn[b]):
            try:
                drawn[b] = again(part, drawn[b]).weights
            except ValueError:
                drawn[b] = np.nan
    return drawn


class _State(NamedTuple):
    """At some D: w L⁻¹ Ŵ (2N, 2P), w L⁻¹ r (2N,), C Bᵀ L⁻ᵀ as A (N, 2P + 2, 2), L⁻¹ (N, 2, 2)."""

    rows: FloatArray
    r: FloatArray
    A: FloatArray
    white: FloatArray


class _Errors(NamedTuple):
    """Readings that count for the weighted fit: W (N, P), Y (N,), covariances C, row weights w (N,).

    Both parts of Y have a further variance.
    """

    W: ComplexArray
    Y: ComplexArray
    C: FloatArray
    w: FloatArray
    further: float = 0.0

    def at(self, D: ComplexArray) -> _State:
        """What the fit needs at some weights."""
        B = stretch([[1.0, *D]])
        CB = self.C @ B.T
        CB[:, :2] += self.further * np.eye(2)
        S = B @ CB
        S = S + 1e-14 * np.trace(S, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        white = np.linalg.inv(np.linalg.cholesky(S))
        A = CB @ np.swapaxes(white, 1, 2)
        r = white @ stretch(self.Y + self.W @ D).reshape(-1, 2, 1)
        true = self.W - unstretch((A @ r)[..., 0])[:, 1:]
        rows = self.w[:, None, None] * (white @ stretch(true[:, None]))
        return _State(rows.reshape(-1, 2 * len(D)), (self.w[:, None] * r[..., 0]).ravel(), A, white)

    def minimum(self, start: ComplexArray) -> ComplexArray:
        """Weights at which Q is smallest, sought from some start by steps of Levenberg and Marquardt."""
        D, damping = start, 1e-3
        state = self.at(D)
        for _ in range(STEPS):
            J, sizes = state.rows, np.linalg.norm(state.rows, axis=0)
            damped = np.vstack((J, np.sqrt(damping) * np.diag(sizes)))
            step = -solution(damped, np.append(state.r, np.zeros(len(sizes))))
            tried = self.at(D + unstretch(step))
            shorter = tried.r @ tried.r <= state.r @ state.r
            if shorter:
                D, state = D + unstretch(step), tried
            damping *= 0.1 if shorter else 10.0
            if np.linalg.norm(sizes * step) <= CLOSE * np.linalg.norm(sizes * stretch(D)):
                break
        if state.r @ state.rows @ solution(state.rows, state.r) <= SETTLED * (1 + state.r @ state.r):
            return D
        raise UndeterminedError(
            "the trial runs tell too little of the planes for the weighted fit: its weights grow without "
            "bound; use larger trial weights, fewer planes or another method"
        )

    def chi_square(self, D: ComplexArray, common: FloatArray) -> float:
        """χ² of r, least about D, with columns (N, 2P + 2, M) common to all readings; w does not count."""
        at, (_, n, M) = self._replace(w=np.ones_like(self.w)).at(D), common.shape
        shared = (at.white @ stretch([[1.0, *D]]) @ common).reshape(len(at.r), M)
        X = np.column_stack((at.rows, shared, at.r))
        G = X.T @ X
        G[n - 2 : -1, n - 2 : -1] += np.eye(M)
        return float(G[-1, -1] - G[-1, :-1] @ solution(G[:-1, :-1], G[:-1, -1]))

    def inverse(self, at: _State) -> FloatArray:
        """A⁻¹ (2P, 2P)."""
        A, (N, P) = at.A[:, 2:], self.W.shape
        K = (self.C[:, 2:, 2:] - A @ np.swapaxes(A, 1, 2)).reshape(N, P, 2, P, 2)
        white = self.w[:, None, None, None] * (at.white[:, None] @ stretch(np.reshape([1, 1j], (2, 1, 1))))
        square = np.einsum("nixa,njxb,npaqb->piqj", white, white, K).reshape(2 * P, 2 * P)  # of e
        whiten = np.linalg.inv(np.linalg.cholesky(at.rows.T @ at.rows))
        share, V = np.linalg.eigh(whiten @ square @ whiten.T)
        V = whiten.T @ V
        return np.asarray((V / np.maximum(1 - share, LEAST_INFORMATION)) @ V.T)

    def descend(self, bounds: Bounds, D: ComplexArray) -> tuple[float, ComplexArray]:
        """Q and weights where steps end within limits: cone programs of the linearised problem."""
        Q = np.inf
        for _ in range(100):
            at = self.at(D)
            target = D - unstretch(solution(at.rows, at.r))
            move = nearest(bounds, target, np.linalg.qr(at.rows)[1]).weights - D
            for k in range(20 if np.isfinite(Q) else 1):  # the first step is taken whole, to the limits
                end = D + 0.5**k * move
                new = self.at(end).r
                if new @ new < Q and within(bounds, end):
                    break
            else:
                break
            fall, Q, D = Q - new @ new, float(new @ new), end
            if fall <= 1e-10 * (1 + Q):
                break
        return Q, D


def _fit_weighted(job: Job) -> Solution:
    start, on, bounds = _closed_form(job), job.w > 0, job.bounds
    common = np.moveaxis(real_parts(job.columns[:, on]), 0, 2)
    errors = _Errors(job.W[on], job.Y[on], job.channels[on] - common @ np.swapaxes(common, 1, 2), job.w[on])
    B, D, dof = stretch([[1.0, *start]]), start, 2 * int(on.sum() - len(start))
    variance = np.trace(B @ errors.C @ B.T, axis1=1, axis2=2).mean() / 2
    if not variance > 1e-12 * job.channels[:, 0, 0].mean():
        raise NoErrorsError(
            "the method weighted needs errors of the readings ([errors], --errors or repeated readings)"
        )

    def wider(share: float) -> _Errors:
        """The errors with a further variance of both parts of Y."""
        return errors._replace(further=(FLOOR**2 + share) * variance)

    @cache
    def least(share: float) -> float:
        """Least χ² of a share."""
        nonlocal D
        D = wider(share).minimum(D)
        return wider(share).chi_square(D, common)

    chi, share = least(0.0), 0.0
    explained = job.explained or (lambda _: chance(chi, dof) >= 1 - LEVEL)
    if chi > dof > 0 and not explained(D):
        D = start
        before, share = 0.0, chi / dof - 1
        for _ in range(50):  # by secants, since 1/χ² is nearly linear in the share
            miss, last = (1 / least(at) - 1 / dof for at in (share, before))
            before, share = share, max(share - miss * (share - before) / (miss - last), 0.0)
            if abs(share - before) <= 1e-8 * share:
                break
        D = wider(share).minimum(D)
    wide = wider(share)
    if not within(bounds, D):
        D = min((wide.descend(bounds, one) for one in (D, start, 0 * D)), key=lambda end: end[0])[1]
    at = wide.at(D)
    inverse, rng, model_error = wide.inverse(at), np.random.default_rng(1), float(np.sqrt(share * variance))
    root = np.linalg.cholesky(np.linalg.inv(inverse)).T
    rows = at.rows.reshape(len(at.white), 2, -1)
    gradient = np.moveaxis(wide.w[:, None, None] * (np.swapaxes(at.white, 1, 2) @ rows), -1, 0)
    response = -(inverse @ gradient.reshape(len(inverse), -1)).T

    def step(left: ComplexArray) -> ComplexArray:
        """To the weights (B, P) of what these leave, (B, N)."""
        return unstretch(real_parts(left[:, on]) @ response)

    previous = mean = step((bounds.Y + bounds.W @ D)[None])

    def resolve(W: ComplexArray, Y: ComplexArray) -> ComplexArray:
        nonlocal previous
        further = model_error * rng.standard_normal((*Y.shape, 2)).view(complex)[..., 0]
        first = step(Y + further + W @ D)
        off, previous = np.concatenate((previous, first)) - mean, first[-1:]
        off *= norm(D) / np.fmax(norm(off, axis=1, keepdims=True), norm(D))
        drawn = D + first + step(((W - bounds.W) @ (off[1:] + off[:-1])[..., None])[..., 0])
        again = partial(nearest, root=root, tolerance=DRAWN)
        return _within_limits(bounds, W, Y, drawn, again)

    return job.fitted(D, resolve, chi_square=chi, dof=dof, model_error=model_error)


METHODS: tuple[Method[Solver], ...] = (
    Method("weighted", "every reading counts by its error, that of the coefficients included", _fit_weighted),
    Method(
        "least-squares", "the sum of squared amplitudes is the smallest possible", _fit_plain, "least squares"
    ),
    Method("minmax", "the largest amplitude is the smallest possible", _fit_plain, "min–max"),
)
"""The first is the usual one where errors are known, the second where they are not."""
RIDGE = Method("ridge", "small weights where planes act alike", None)
"""Of least squares without limits, by its strength."""
