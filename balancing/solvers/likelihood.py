"""The likelihood of corrections where normal errors stand in W and in Y₀, profiled over the true values.

For each reading the data z = (Y, W₁, …, W_P), stretched into (Re, Im) pairs, have errors of covariance C.
Their true values satisfy Y + W D = 0, that is B z = 0 with B = [1, D₁, …, D_P] stretched. The most likely
true values at given D are ẑ = z − C Bᵀ Σ⁻¹ r, with r = B z = Y + W D and Σ(D) = B C Bᵀ. What is left is a
function of D alone,

    Q(D) = Σ w² rᵀ Σ(D)⁻¹ r.

Half its gradient is Σ w² Ŵᵀ Σ⁻¹ r (Ŵ: the W part of ẑ, stretched). With u = Σ⁻¹ r, derivatives B_q of B by
the q-th real unknown, the columns F_q = B C B_qᵀ u and G = Ŵ − F, half its Hessian is exactly

    H = Σ w² (Gᵀ Σ⁻¹ G − U C Uᵀ),   rows of U: B_qᵀ u.

The Gauss–Newton matrix M = Σ w² Ŵᵀ Σ⁻¹ Ŵ (Jacobian L⁻¹ Ŵ, Σ = L Lᵀ) overrates what the readings tell: Ŵ holds
errors e of its own, independent of r, and M contains their squares. They have the covariance of z less what r
tells of it, K = C − C Bᵀ Σ⁻¹ B C, so that

    A = M − Σ w² E[eᵀ Σ⁻¹ e]

is the honest information about D (H has the same mean). The score Ŵᵀ Σ⁻¹ r has the covariance M, hence for
w = 1 Cov(D) = A⁻¹ M A⁻¹, which is larger than M⁻¹. Source: W. A. Fuller, *Measurement Error Models* (1987),
chapters 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from balancing.data.reading_errors import inverse_root, symmetric
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import stretch, unstretch

_HALVINGS = 40
LEAST_INFORMATION = 0.1
"""Share of M that is left to A in any direction; smaller ones count as this much."""


class Problem(NamedTuple):
    """Stretched data: W (N, 2, 2P), Y (N, 2), C (N, 2P + 2, 2P + 2), its `_blocks`, w² of each (N,)."""

    W: FloatArray
    Y: FloatArray
    C: FloatArray
    blocks: FloatArray
    weight: FloatArray


def problem_of(W: ComplexArray, Y: ComplexArray, C: FloatArray, weight: FloatArray) -> Problem:
    """The stretched problem of W (N, P), Y (N,), C (N, 2P + 2, 2P + 2) and row weights (N,)."""
    rows = stretch(W).reshape(len(Y), 2, -1)
    return Problem(rows, stretch(Y).reshape(-1, 2), C, _blocks(C), weight**2)


class State(NamedTuple):
    """What is known at one D.

    Q; rᵀ Σ⁻¹ r of each reading (N,); whitened by L⁻¹: r (N, 2), Ŵ as J and F (N, 2, 2P), C Bᵀ as A
    (N, 2P + 2, 2); U of one plane (N, 2, 2), alike for all; L as l11, l21, l22 (3, N).
    """

    objective: float
    each: FloatArray
    r: FloatArray
    J: FloatArray
    F: FloatArray
    U: FloatArray
    A: FloatArray
    L: FloatArray


Step = Callable[[FloatArray, State], tuple[FloatArray, float, bool]]


def constraint(d: FloatArray) -> FloatArray:
    """B = [1, D₁, …] stretched, (2, 2P + 2), from the stretched D."""
    return stretch(np.concatenate(([1.0], unstretch(d)))[None])


def evaluate(problem: Problem, d: FloatArray) -> State:
    """Everything at the stretched D; Σ must be regular."""
    W, Y, C, _, weight = problem
    N, P = len(Y), len(d) // 2
    B = constraint(d)
    CB = C @ B.T
    S = B @ CB
    l11 = np.sqrt(S[:, 0, 0])
    l21 = S[:, 1, 0] / l11
    l22 = np.sqrt(
        np.maximum(S[:, 1, 1] - l21**2, 1e-15 * np.trace(S, axis1=1, axis2=2))
    )  # > 0 but for rounding
    L = np.stack((l11, l21, l22))
    A = np.swapaxes(_whiten(L, np.swapaxes(CB, 1, 2)), 1, 2)
    r = _whiten(L, (Y + W @ d)[..., None])[..., 0]
    u2 = r[:, 1] / l22
    U = _both_parts(np.stack(((r[:, 0] - l21 * u2) / l11, u2), axis=1))
    adjustment = unstretch((A @ r[..., None])[:, 2:, 0])
    J = _whiten(L, W - stretch(adjustment[:, None]))
    F = np.swapaxes(A.reshape(N, P + 1, 2, 2)[:, 1:], 2, 3) @ np.swapaxes(U, 1, 2)[:, None]  # (N, P, 2, 2)
    each = np.einsum("ni,ni->n", r, r)
    return State(float(weight @ each), each, r, J, np.swapaxes(F, 1, 2).reshape(N, 2, 2 * P), U, A, L)


def gradient(problem: Problem, at: State) -> FloatArray:
    """Half the gradient of Q, (2P,)."""
    return np.asarray(np.einsum("niq,ni,n->q", at.J, at.r, problem.weight))


def hessian(problem: Problem, at: State) -> FloatArray:
    """Half the Hessian of Q, (2P, 2P)."""
    G = at.J - at.F
    return _gram(G, problem.weight) - _across(at.U, problem.blocks, problem.weight)


def jacobian(problem: Problem, at: State) -> tuple[FloatArray, FloatArray]:
    """Gauss–Newton: rows w L⁻¹ Ŵ (2N, 2P) and w L⁻¹ r (2N,)."""
    root = np.sqrt(problem.weight)[:, None]
    return (root[..., None] * at.J).reshape(-1, at.J.shape[-1]), (root * at.r).ravel()


def covariance(problem: Problem, at: State) -> FloatArray:
    """A⁻¹ V A⁻¹ at the minimum, with V = M for equal weights and Σ w⁴ Ŵᵀ Σ⁻¹ Ŵ for others, (2P, 2P)."""
    inverse = _corrected_inverse(problem, at)
    rows = (problem.weight[:, None, None] * at.J).reshape(-1, len(inverse)) @ inverse
    return symmetric(rows.T @ rows)


def derivatives(problem: Problem, at: State, d: FloatArray) -> FloatArray:
    """Of the stretched D at the minimum by the data z of each reading, (N, 2P, 2P + 2): −A⁻¹ Ŵᵀ Σ⁻¹ B."""
    l11, l21, l22 = at.L
    first = problem.weight[:, None] * at.J[:, 0] / l11[:, None]
    second = problem.weight[:, None] * at.J[:, 1] / l22[:, None]
    # Ŵᵀ Σ⁻¹ = Jᵀ L⁻¹, the columns of L⁻¹: (1/l11, −l21/(l11 l22)) and (0, 1/l22)
    rows = np.stack((first - second * (l21 / l11)[:, None], second), axis=-1)
    return np.asarray(-_corrected_inverse(problem, at) @ rows @ constraint(d))


def _corrected_inverse(problem: Problem, at: State) -> FloatArray:
    """A⁻¹: that of M less what the errors of Ŵ put into it."""
    root = inverse_root(_gram(at.J, problem.weight), 1e-15)
    share, vectors = np.linalg.eigh(symmetric(root.T @ _noise(problem, at) @ root))
    X = root @ vectors
    return np.asarray((X / np.maximum(1 - share, LEAST_INFORMATION)) @ X.T)


class Minimum(NamedTuple):
    """Where steps ended: stretched weights, the problem, what is known there, whether Q falls no further."""

    d: FloatArray
    problem: Problem
    at: State
    settled: bool


def descend(
    problem: Problem, d: FloatArray, step: Step, *, most: int, settled: float, rounding: float
) -> Minimum:
    """Steps down from the stretched D, each shortened until Q falls.

    Parameters
    ----------
    problem, d
        What is minimised, and where to start.
    step
        At some D: a step, how far it should lead down, and whether Q is convex enough to end there.
    most
        Number of steps.
    settled
        Share of 1 + Q below which a step is the last one, and taken whole: rounding of Q says nothing of it.
    rounding
        The same where no part of a step leads down: above it the search is stuck.
    """
    at = evaluate(problem, d)
    for _ in range(most):
        move, expected, sound = step(d, at)
        new, t = evaluate(problem, d + move), 1.0
        if expected <= settled * (1 + at.objective):
            return Minimum(d + move, problem, new, sound)
        while not new.objective <= at.objective - 1e-4 * t * expected and t > 0.5**_HALVINGS:
            t /= 2
            new = evaluate(problem, d + t * move)
        if new.objective >= at.objective:
            return Minimum(d, problem, at, sound and expected <= rounding * (1 + at.objective))
        d, at = d + t * move, new
    return Minimum(d, problem, at, False)


def _blocks(C: FloatArray) -> FloatArray:
    """W part of covariances (N, 2P + 2, 2P + 2), a row for each pair of planes, (P², 4N)."""
    N, P = len(C), C.shape[1] // 2 - 1
    pairs = C.reshape(N, P + 1, 2, P + 1, 2)[:, 1:, :, 1:]
    return np.ascontiguousarray(pairs.transpose(1, 3, 0, 2, 4)).reshape(P * P, 4 * N)


def _whiten(L: FloatArray, X: FloatArray) -> FloatArray:
    """L⁻¹ X for stacks X (N, 2, k)."""
    l11, l21, l22 = L[..., None]
    out = np.empty_like(X)
    out[:, 0] = X[:, 0] / l11
    out[:, 1] = (X[:, 1] - l21 * out[:, 0]) / l22
    return out


def _both_parts(u: FloatArray) -> FloatArray:
    """B_qᵀ u within its plane for q = Re, Im, (N, 2, 2): B_q turns a pair by nothing and by 90°."""
    return np.stack((u, np.stack((u[:, 1], -u[:, 0]), axis=1)), axis=1)


def _gram(X: FloatArray, weight: FloatArray) -> FloatArray:
    """Σ weight Xᵀ X over readings, (2P, 2P)."""
    n = X.shape[-1]
    return np.asarray((X * weight[:, None, None]).reshape(-1, n).T @ X.reshape(-1, n))


def _across(U: FloatArray, covariances: FloatArray, weight: FloatArray) -> FloatArray:
    """Σ weight U C Uᵀ over readings for covariances as `_blocks`, (2P, 2P)."""
    P = int(np.sqrt(len(covariances)))
    outer = np.einsum("n,nak,nbl->nklab", weight, U, U).reshape(-1, 4)
    return np.asarray((covariances @ outer).reshape(P, P, 2, 2).transpose(0, 2, 1, 3).reshape(2 * P, 2 * P))


def _noise(problem: Problem, at: State) -> FloatArray:
    """Σ w² E[eᵀ Σ⁻¹ e], (2P, 2P): as U K Uᵀ, with the rows of L⁻¹ for u."""
    l11, l21, l22 = at.L
    K = _blocks(problem.C - at.A @ np.swapaxes(at.A, 1, 2))  # of K = C − C Bᵀ Σ⁻¹ B C
    first = np.stack((1 / l11, np.zeros_like(l11)), axis=1)
    second = np.stack((-l21 / (l11 * l22), 1 / l22), axis=1)
    return _across(_both_parts(first), K, problem.weight) + _across(_both_parts(second), K, problem.weight)
