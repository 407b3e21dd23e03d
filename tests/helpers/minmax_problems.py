"""Random balancing problems from seeds: NumPy only."""

from dataclasses import dataclass

import numpy as np

KINDS = ("plain", "weighted", "max_weight", "residual", "both", "budget")


@dataclass(frozen=True, eq=False)
class Case:
    kind: str
    W: np.ndarray
    Y: np.ndarray
    row_weights: np.ndarray
    max_weight: np.ndarray
    residual: np.ndarray
    budget: float


def case(seed):
    """Problem of one seed; every limit holds at 0.6 times the least-squares weights, so none is infeasible.

    Amplitudes of some 1e-5 m, planes whose effects differ up to a thousandfold, condition numbers up to 100.
    """
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    N, P = int(rng.integers(4, 49)), int(rng.integers(1, 7))
    N = max(N, P + 1)
    W = normal(rng, (N, P))
    if P > 1:
        W[:, 1] = W[:, 0] + 10.0 ** rng.uniform(-2, 0) * W[:, 1]
    W *= 1e-2 * 10.0 ** rng.uniform(-1.5, 1.5, P)
    Y = W @ (normal(rng, P) * 1e-5 / np.linalg.norm(W, axis=0)) * np.sqrt(N) + 4e-6 * normal(rng, N)
    D = np.linalg.lstsq(W, -Y, rcond=None)[0]
    w = rng.uniform(0.2, 3.0, N) if kind in ("weighted", "both") else np.ones(N)
    M, L, budget = np.full(P, np.inf), np.full(N, np.inf), np.inf
    if kind in ("max_weight", "both"):
        M = np.where(rng.random(P) < 0.7, rng.uniform(0.61, 1.1, P) * np.abs(D), np.inf)
    if kind in ("residual", "both"):
        L = np.where(rng.random(N) < 0.5, 1.02 * np.abs(Y + 0.6 * W @ D), np.inf)
    if kind == "budget":
        budget = 0.7 * np.abs(D).sum()
    return Case(kind, W, Y, w, M, L, budget)


def fingerprint(problem):
    """A number that changes with any of the problem's: the stored answers belong to these very problems."""
    finite = [a[np.isfinite(a)] for a in (problem.row_weights, problem.max_weight, problem.residual)]
    parts = [np.abs(problem.W).ravel(), np.abs(problem.Y) * 1e5, *finite]
    return float(np.abs(np.concatenate(parts)).sum())


def normal(rng, shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
