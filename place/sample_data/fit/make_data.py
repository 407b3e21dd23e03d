"""Write the records of this folder: `python make_data.py` (needs NumPy and SciPy only, not rotorid).

The equations are typed here once more, independently of the model files. The seed is fixed: the same numbers
on every run.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

HERE = Path(__file__).resolve().parent
Array = NDArray[np.float64]


def write(file: str, names: list[str], columns: list[Array], form: Callable[[float], str]) -> None:
    """One record; the first column is the time."""
    lines = [",".join(["t_s", *names])]
    for t, *values in zip(*columns, strict=True):
        lines.append(",".join([f"{t:.10g}", *(form(value) for value in values)]))
    (HERE / file).write_text("\n".join(lines) + "\n", encoding="utf-8")


def digits(n: int) -> Callable[[float], str]:
    """Rounded to n significant digits."""
    return lambda value: f"{value + 0.0:.{n}g}"


def linear(matrix: Array, start: Array, t: Array) -> Array:
    """States of dx/dt = A x at even times, (n, states)."""
    step, x = expm(matrix * (t[1] - t[0])), [start]
    for _ in t[1:]:
        x.append(step @ x[-1])
    return np.array(x)


def quasilinearization(rng: np.random.Generator) -> None:
    """[Q]: the closed form with theta = (1, -1, -1)."""
    t = np.array([float(f"{value:.10g}") for value in np.linspace(0.0, np.pi, 31)])
    w = np.sqrt(3) / 2
    decay = np.exp(-t / 2)
    x1 = np.sin(t) + decay * (1.5 * np.cos(w * t) + w * np.sin(w * t))
    x2 = np.cos(t) + decay * (-1.5 * w * np.sin(w * t) + w * w * np.cos(w * t))
    x2 += -0.5 * decay * (1.5 * np.cos(w * t) + w * np.sin(w * t))
    y = np.array([x1 + 2 * x2, 2 * x1 + x2])
    write("quasilinearization/record.csv", ["y1", "y2"], [t, *y], digits(15))
    noisy = y + 0.02 * rng.standard_normal(y.shape)
    write("quasilinearization/record_noisy.csv", ["y1", "y2"], [t, *noisy], digits(5))


def three_masses() -> None:
    """[F]: the chain with c1, m1, m2 = 0.14, 12, 28; five significant digits as printed there."""
    c1, c2, c3, c4, m1, m2, m3 = 0.14, 0.3, 0.2, 0.12, 12.0, 28.0, 18.0
    a = np.zeros((6, 6))
    a[[0, 2, 4], [1, 3, 5]] = 1.0
    a[1, [0, 2]] = -(c1 + c2) / m1, c2 / m1
    a[3, [0, 2, 4]] = c2 / m2, -(c2 + c3) / m2, c3 / m2
    a[5, [2, 4]] = c3 / m3, -(c3 + c4) / m3
    t = np.arange(251) / 5
    x = linear(a, np.array([0.5, 0.1, -0.2, -0.1, 0.3, 0.1]), t)
    write("three_masses/record.csv", ["y1", "v1", "y2", "v2", "y3", "v3"], [t, *x.T], digits(5))


def run_down(rng: np.random.Generator) -> None:
    """Decay of the rotor's three-mass model after a blow on the middle mass; displacements in um."""
    given = tomllib.loads((HERE / "run_down" / "model.toml").read_text(encoding="utf-8"))
    m = np.array([[196.6167587206449 if x == "m_x12" else x for x in row] for row in given["M"]], dtype=float)
    c, d = np.array(given["K"], dtype=float), np.diag([900.0, 1600.0, 1300.0])
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(m, c), -np.linalg.solve(m, d)]])
    t = np.arange(601) / 1000
    x = linear(a, np.array([0, 0, 0, 0, 0.05, 0]), t)
    y = 1e6 * x.T[:3] + 2.0 * rng.standard_normal((3, len(t)))
    write("run_down/record.csv", ["drive_end", "middle", "free_end"], [t, *y], lambda value: f"{value:.1f}")


def limit_cycle(rng: np.random.Generator) -> None:
    """Van der Pol's oscillator, lambda = 3, from (0.1, 0) onto its limit cycle."""
    t = np.arange(301) / 10
    found = solve_ivp(
        lambda _, x: (x[1], 3.0 * (1 - x[0] ** 2) * x[1] - x[0]),
        (0.0, 30.0), [0.1, 0.0], t_eval=t, method="DOP853", rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    y = found.y[0] + 0.05 * rng.standard_normal(len(t))
    write("limit_cycle/record.csv", ["x"], [t, y], lambda value: f"{value:.3f}")


if __name__ == "__main__":
    quasilinearization(np.random.default_rng(20))
    three_masses()
    run_down(np.random.default_rng(21))
    limit_cycle(np.random.default_rng(22))
