"""Random balancing problems and what CVXPY answers for them: writes tests/data/minmax_reference.json.

Run `.venv-hsbalance/bin/python -m benchmarks.minmax_reference` from the repository's root (the environment of
hsbalance has CVXPY; some seconds). tests/helpers/minmax_problems.py makes the problems from seeds, here and
in the tests; only optimum objectives are stored, with a fingerprint of each problem.

Independent are the modelling (complex variables and norms as CVXPY writes them, scaled only as a whole) and
the solver, CVXOPT, where clarabel is what rotorid uses. The objective is evaluated at the weights returned,
which may break a limit by the solver's tolerance.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cvxpy as cp
import numpy as np

TESTS = Path(__file__).resolve().parent.parent / "tests"
sys.path.insert(0, str(TESTS / "helpers"))

from minmax_problems import SEEDS, case, fingerprint  # noqa: E402

TOLERANCES = (1e-9, 1e-8)


def optimum(seed: int, method: str) -> tuple[float, str]:
    """Smallest objective, and the status the solver reports."""
    problem = case(seed)
    size, unit = np.linalg.norm(problem.W, axis=0), np.abs(problem.Y).max()
    x = cp.Variable(problem.W.shape[1], complex=True)  # D · size / unit
    r = problem.Y / unit + (problem.W / size) @ x
    weighted = cp.multiply(problem.row_weights, r)
    objective = cp.max(cp.abs(weighted)) if method == "minmax" else cp.norm(weighted, 2)
    heavy, limited = (np.flatnonzero(np.isfinite(a)) for a in (problem.max_weight, problem.residual))
    constraints = [cp.abs(x[p]) <= problem.max_weight[p] * size[p] / unit for p in heavy]
    constraints += [cp.abs(r[i]) <= problem.residual[i] / unit for i in limited]
    if np.isfinite(problem.budget):
        constraints.append(cp.sum(cp.multiply(unit / size, cp.abs(x))) <= problem.budget)
    found = cp.Problem(cp.Minimize(objective), constraints)
    for tolerance in TOLERANCES:  # where rounding stops CVXOPT, the looser one
        stops = {"abstol": tolerance, "reltol": tolerance, "feastol": tolerance}
        try:
            found.solve(solver=cp.CVXOPT, kktsolver=cp.ROBUST_KKTSOLVER, **stops)
            break
        except cp.SolverError:
            continue
    values = problem.row_weights * np.abs(problem.Y + problem.W @ (np.asarray(x.value) * unit / size))
    return float(values.max() if method == "minmax" else np.linalg.norm(values)), str(found.status)


def main() -> None:
    rows = []
    for method, seeds in SEEDS.items():
        for seed in seeds:
            value, status = optimum(seed, method)
            if status != "optimal":
                raise RuntimeError(f"seed {seed}, {method}: {status}")
            rows.append(
                {
                    "seed": seed,
                    "method": method,
                    "kind": case(seed).kind,
                    "fingerprint": fingerprint(case(seed)),
                    "objective": value,
                }
            )
    content = {"made_by": f"CVXPY {cp.__version__} with CVXOPT, NumPy {np.__version__}", "answers": rows}
    text = json.dumps(content, indent=1)
    (TESTS / "data" / "minmax_reference.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
