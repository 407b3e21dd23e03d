"""Correction weights against hsbalance: least squares and min–max, arrays in, weights out.

hsbalance (with CVXPY) lives in its own environment, which `make .venv-hsbalance/.peer` makes;
ROTORID_HSBALANCE_PYTHON names another Python that has it. So the peer runs in a process of its own: this
module is started there as a script with a file of the problems, solves each with hsbalance's public classes
(`LeastSquares(A, alpha).solve()`, `Min_max(A, alpha).solve()`; making `Alpha` is not timed), and writes its
weights and the shortest time of several calls. Both programs run alone, one after the other, with one BLAS
thread. The objectives of both programs' weights are compared.

CVXPY takes the solver XPRESS for these problems wherever it is installed, whose free licence refuses problems
of these sizes: the environment is made without it, and CVXPY then takes its own default solver.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

SIZES = ((24, 4), (120, 8), (600, 12))
METHODS = ("least-squares", "minmax")
REQUIRED = {("least-squares", N): 250.0 for N, _ in SIZES} | {
    ("minmax", 24): 7.0,
    ("minmax", 120): 3.0,
    ("minmax", 600): 8.0,
}
REPEAT = {24: 40, 120: 20, 600: 8}  # of the peer; five times as often ours
ALLOWED = 1e-7


def problem(N: int, P: int) -> tuple[np.ndarray, np.ndarray]:
    """Influence coefficients (N, P) and readings (N,) of order one, as hsbalance's solvers like them best."""
    rng = np.random.default_rng(N)
    W = rng.standard_normal((N, P)) + 1j * rng.standard_normal((N, P))
    return W, rng.standard_normal(N) + 1j * rng.standard_normal(N)


def objective(method: str, W: np.ndarray, Y: np.ndarray, weights: np.ndarray) -> float:
    size = np.abs(Y + W @ weights)
    return float(size.max() if method == "minmax" else np.linalg.norm(size))


def peer(file: Path) -> None:
    """What runs in the environment of hsbalance: solves the problems of a file and adds weights and times."""
    import hsbalance

    data = dict(np.load(file))
    answers = {}
    for N, _ in SIZES:
        alpha, Y = hsbalance.Alpha(), data[f"Y{N}"][:, None]
        alpha.add(direct_matrix=data[f"W{N}"])
        for method in METHODS:
            model = hsbalance.LeastSquares if method == "least-squares" else hsbalance.Min_max
            times = []
            for _ in range(REPEAT[N]):
                start = time.perf_counter()
                weights = model(Y, alpha).solve()
                times.append(time.perf_counter() - start)
            answers[f"{method}{N}"] = np.asarray(weights).ravel()
            answers[f"seconds {method}{N}"] = np.array(min(times[1:]))
    np.savez(file, **answers)


def task() -> object:
    return run()[1]


def run() -> list:
    from balancing import solve
    from benchmarks.peers import run_peer
    from benchmarks.timing import Row, best_of

    problems = {N: problem(N, P) for N, P in SIZES}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "problems.npz"
        np.savez(
            file,
            **{f"{name}{N}": a for N, pair in problems.items() for name, a in zip("WY", pair, strict=True)},
        )
        run_peer("hsbalance", __file__, file)
        theirs = dict(np.load(file))
    rows = []
    for method in METHODS:
        for N, P in SIZES:
            W, Y = problems[N]
            seconds = best_of(lambda: None, lambda _: solve(W, Y, method=method), 5 * REPEAT[N])  # noqa: B023
            ours = objective(method, W, Y, solve(W, Y, method=method).weights)
            peers = objective(method, W, Y, theirs[f"{method}{N}"])
            rows.append(
                Row(
                    task=f"Weights, {method}, {N} readings, {P} planes",
                    ours="rotorid",
                    our_seconds=seconds,
                    peer="hsbalance",
                    peer_seconds=float(theirs[f"seconds {method}{N}"]),
                    difference=abs(ours - peers) / peers,
                    allowed=ALLOWED,
                    required_ratio=REQUIRED[method, N],
                    note="" if ours <= peers * (1 + 1e-7) else "ours is the larger objective",
                )
            )
    return rows


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # CVXPY's notes on its own future
    peer(Path(sys.argv[1]))
