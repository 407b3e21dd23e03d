"""How the cost grows with the size of a problem: elements of a rotor, rows of tables, correction planes.

The exponent is p of cost ∝ size^p between two sizes. The time of the smaller one is multiplied by how much
more arithmetic the larger one is: banded matrices grow with the elements, readings count one by one (their
file is read, too), and a decomposition for P planes takes P² operations a reading.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from balancing import correct, estimate_influence, solve
from benchmarks import campbell, critical_speeds, unbalance_response
from benchmarks.balancing_solvers import METHODS, problem
from benchmarks.rotors import SIZES
from benchmarks.timing import Row, best_of, once
from rotorid.files import read_ode_model, read_record, read_trials
from rotorid.identify import fit

DECAY = """estimate = {c = 3.9, d = 0.12, v0 = 0.0}
states = {x = "v", v = "-c*x - d*v"}
outputs = {x = "x"}
initial = {x = 1.0, v = "v0"}
"""


def balance(folder: Path, rows: int) -> Callable[[], object]:
    """Weights of four planes and their errors: a bare run and one of each plane, with 200 sensors."""
    run, speed, sensor = (part.ravel() for part in np.indices((5, rows // 1000, 200)))
    noise = np.array((0.01, 0.01j)) @ np.random.default_rng(1).normal(size=(2, rows))
    z = (20 + 10 * run * np.exp(1j * speed * run)) * np.exp(0.1j * sensor) * (1 + noise)
    table = np.column_stack((run, 1000 + 10 * speed, sensor, np.abs(z), np.degrees(np.angle(z)) % 360))
    header, form = "run,speed_rpm,sensor,amplitude_um_pp,phase_deg", "run %d,%d,probe %d,%.3f,%.1f"
    np.savetxt(folder / "runs.csv", table, form, header=header, comments="")
    mounted = "".join(f"run {r},plane {r},10,0\n" for r in range(1, 5))
    (folder / "weights.csv").write_text(f"run,plane,mass_g,angle_deg\n{mounted}")
    return lambda: correct(estimate_influence(read_trials(folder / "runs.csv", folder / "weights.csv")))


def fit_decay(folder: Path, rows: int) -> Callable[[], object]:
    """Two coefficients and a starting value of an oscillation that decays."""
    t, noise = np.linspace(0.0, 50.0, rows), 0.001 * np.random.default_rng(3).normal(size=rows)
    table = np.column_stack((t, np.exp(-0.05 * t) * np.cos(2.0 * t) + noise))
    np.savetxt(folder / "record.csv", table, "%.9g", ",", header="t_s,x", comments="")
    (folder / "model.toml").write_text(DECAY)
    model = read_ode_model(folder / "model.toml")
    return lambda: fit(model, read_record(folder / "record.csv", model))


def weights(method: str, planes: int) -> Callable[[], object]:
    W, Y = problem(600, planes)
    return lambda: solve(W, Y, method=method)


def grown(task: str, of: str, sizes: tuple[int, int], work: int, seconds: Callable[[int], float]) -> Row:
    (few, many), times = map(seconds, sizes), sizes[1] // sizes[0]
    task = f"{task}, {sizes[1]:,} {of}: exponent {np.log(many / few) / np.log(times):.2f}"
    smaller = f"{times**work} × {sizes[0]:,} {of}"
    return Row(task, many, smaller, times**work * few, 0.0, required_ratio=0.8)


def run() -> list[Row]:
    rows = []
    for one in (critical_speeds, unbalance_response, campbell):
        elements = lambda n: best_of(lambda: one.make(SIZES[n]), one.ours, 10)  # noqa: E731, B023
        rows.append(grown(one.__name__.split(".")[1].replace("_", " "), "elements", (92, 460), 1, elements))
    with tempfile.TemporaryDirectory() as folder:
        for data in (balance, fit_decay):
            seconds = lambda n: once(lambda: data(Path(folder), n), lambda call: call())[0]  # noqa: E731, B023
            rows.append(grown(data.__name__.replace("_", " "), "rows", (10_000, 100_000), 1, seconds))
    for method in METHODS:
        seconds = lambda n: best_of(lambda: weights(method, n), lambda call: call(), 20)  # noqa: E731, B023
        rows.append(grown(f"weights, {method}", "planes", (2, 24), 2, seconds))
    return rows
