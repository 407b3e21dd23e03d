"""Correction weights against hsbalance: least squares and min–max, arrays in, weights out.

hsbalance (with CVXPY) lives in an environment that `make .venv-hsbalance/.peer` makes, without the solver
XPRESS, whose free licence refuses these sizes; ROTORID_HSBALANCE_PYTHON names another Python that has it.
This module runs there as a script that solves each problem with hsbalance's public classes (making `Alpha`
is not timed) and writes its weights and the shortest time of several calls. Both programs run alone, one
after the other, with one BLAS thread. The objectives of both programs' weights are compared.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

SIZES = ((24, 4), (120, 8), (600, 12))
METHODS = ("least-squares", "minmax")
REQUIRED = {("least-squares", N): 250.0 for N, _ in SIZES}
REQUIRED |= {("minmax", 24): 7.0, ("minmax", 120): 3.0, ("minmax", 600): 8.0}
REPEAT = {24: 40, 120: 20, 600: 8}  # of the peer; five times as often ours


def problem(N: int, P: int) -> tuple[np.ndarray, np.ndarray]:
    """Influence coefficients (N, P) and readings (N,) of order one, as hsbalance's solvers like them best."""
    rng = np.random.default_rng(N)
    W = rng.standard_normal((N, P)) + 1j * rng.standard_normal((N, P))
    return W, rng.standard_normal(N) + 1j * rng.standard_normal(N)


def objective(method: str, W: np.ndarray, Y: np.ndarray, weights: np.ndarray) -> float:
    size = np.abs(Y + W @ weights)
    return float(size.max() if method == "minmax" else np.linalg.norm(size))


def peer(file: str) -> None:
    """What runs in the environment of hsbalance: writes weights and times of all problems."""
    import hsbalance

    answers = {}
    for N, P in SIZES:
        W, Y = problem(N, P)
        alpha = hsbalance.Alpha()
        alpha.add(direct_matrix=W)
        for method in METHODS:
            model = hsbalance.LeastSquares if method == "least-squares" else hsbalance.Min_max
            times = []
            for _ in range(REPEAT[N]):
                start = time.perf_counter()
                weights = model(Y[:, None], alpha).solve()
                times.append(time.perf_counter() - start)
            answers[f"{method}{N}"] = np.asarray(weights).ravel()
            answers[f"seconds {method}{N}"] = np.array(min(times[1:]))
    np.savez(file, **answers)


def of_peer() -> dict[str, np.ndarray]:
    python = Path(os.environ.get("ROTORID_HSBALANCE_PYTHON", ".venv-hsbalance/bin/python"))
    if not python.exists():
        raise FileNotFoundError(f"no Python with hsbalance at {python}: `make {python.parents[1]}/.peer`")
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        command = [str(python), str(Path(__file__).resolve()), f"{folder}/answers.npz"]
        subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
        return dict(np.load(f"{folder}/answers.npz"))


def task() -> object:
    return run()[1]


def run() -> list:
    from balancing import solve
    from benchmarks.timing import Row, best_of

    theirs, rows = of_peer(), []
    for method in METHODS:
        for N, P in SIZES:
            W, Y = problem(N, P)
            ours, peers = (
                objective(method, W, Y, weights)
                for weights in (solve(W, Y, method=method).weights, theirs[f"{method}{N}"])
            )
            row = Row(
                task=f"Weights, {method}, {N} readings, {P} planes",
                our_seconds=best_of(lambda: None, lambda _: solve(W, Y, method=method), 5 * REPEAT[N]),  # noqa: B023
                peer="hsbalance",
                peer_seconds=float(theirs[f"seconds {method}{N}"]),
                difference=abs(ours - peers) / peers,
                allowed=1e-7,
                required_ratio=REQUIRED[method, N],
            )
            rows.append(row)
    return rows


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # CVXPY's notes on its own future
    peer(sys.argv[1])
