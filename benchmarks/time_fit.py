"""Fits to time records against lmfit with SciPy's `solve_ivp`, both started at the same values.

The chain of three masses of [F] (251 samples of six states, three parameters), and six coupled nonlinear
oscillators' states (three masses with cubic springs, 201 samples, four parameters). lmfit minimises with
Levenberg–Marquardt and finite differences, its usual way; its integration has the loosest of the tolerances
1e-6, 1e-7, … with which its parameters come within 2e-6 of the least-squares optimum. That optimum is known
from [F] to its eight printed digits, and for the nonlinear chain from an integration with tolerance 1e-12.
CasADi integrates with CVODES and its
forward sensitivities, and takes full Gauss–Newton steps; the same rule for its tolerance.
The time to read and compile the model belongs to reading its file and is not counted for any program.
Nonlinear models, a pendulum and a Duffing oscillator too, are fitted with the extra `rotorid[fast]` and
without it. What compiling costs shows the first fit of the nonlinear chain from the shell, with and without.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.timing import Row, best_of, once, relative_difference
from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import OdeModel, ode_model
from rotorid.identify.records import Record
from rotorid.samples import sample_data

F_OPTIMUM = np.array([0.13999975, 11.99998962, 28.00000273])
ALLOWED = 2e-6
Rates = Callable[[float, np.ndarray, np.ndarray], np.ndarray]


def chain_rates(_: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    c1, m1, m2 = theta
    y1, v1, y2, v2, y3, v3 = x
    return np.array(
        [
            v1,
            (-(c1 + 0.3) * y1 + 0.3 * y2) / m1,
            v2,
            (0.3 * y1 - 0.5 * y2 + 0.2 * y3) / m2,
            v3,
            (0.2 * y2 - 0.32 * y3) / 18.0,
        ]
    )


def cubic_rates(_: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    k, e, d, g = theta
    y1, v1, y2, v2, y3, v3 = x
    a, b = y2 - y1, y3 - y2
    return np.array(
        [
            v1,
            -y1 - e * y1**3 + k * a + g * a**3 - d * v1,
            v2,
            -k * a - g * a**3 + k * b + g * b**3 - d * v2,
            v3,
            -k * b - g * b**3 - y3 - e * y3**3 - d * v3,
        ]
    )


def pendulum_rates(_: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    return np.array([x[1], -theta[0] * np.sin(x[0]) - theta[1] * x[1]])


def duffing_rates(t: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    k, b, d = theta
    return np.array([x[1], -k * x[0] - b * x[0] ** 3 - d * x[1] + 0.3 * np.cos(1.2 * t)])


CUBIC = {
    "y1": "v1",
    "v1": "-y1 - e*y1**3 + k*(y2 - y1) + g*(y2 - y1)**3 - d*v1",
    "y2": "v2",
    "v2": "-k*(y2 - y1) - g*(y2 - y1)**3 + k*(y3 - y2) + g*(y3 - y2)**3 - d*v2",
    "y3": "v3",
    "v3": "-k*(y3 - y2) - g*(y3 - y2)**3 - y3 - e*y3**3 - d*v3",
}
CUBIC_INITIAL = {"y1": 1.0, "v1": 0.0, "y2": -0.5, "v2": 0.3, "y3": 0.2, "v3": 0.0}
CUBIC_START = {"k": 1.8, "e": 0.4, "d": 0.07, "g": 0.25}


def cubic() -> tuple[OdeModel, Record]:
    """Three masses with cubic springs, exact record with errors of 1e-3."""
    model = ode_model(CUBIC, initial=CUBIC_INITIAL, estimate=CUBIC_START)
    return model, measured(model, cubic_rates, [2.0, 0.5, 0.05, 0.3])


def pendulum() -> tuple[OdeModel, Record]:
    model = ode_model(
        {"phi": "w", "w": "-g*sin(phi) - d*w"},
        initial={"phi": 2.0, "w": 0.0},
        estimate={"g": 9.0, "d": 0.2},
    )
    return model, measured(model, pendulum_rates, [9.81, 0.1])


def duffing() -> tuple[OdeModel, Record]:
    model = ode_model(
        {"x": "v", "v": "-k*x - b*x**3 - d*v + 0.3*cos(1.2*t)"},
        initial={"x": 1.0, "v": 0.0},
        estimate={"k": 0.9, "b": 0.6, "d": 0.15},
    )
    return model, measured(model, duffing_rates, [1.0, 0.5, 0.1])


def measured(model: OdeModel, rates: Rates, truth: list[float]) -> Record:
    """The exact record over 20 s with errors of 1e-3."""
    from scipy.integrate import solve_ivp

    t, start = np.linspace(0.0, 20.0, 201), model.x0(model.start)[:, 0]
    found = solve_ivp(
        rates, (0.0, 20.0), start, t_eval=t, args=(np.array(truth),), method="DOP853", rtol=1e-12, atol=1e-12
    )
    noise = 1e-3 * np.random.default_rng(5).standard_normal(found.y.shape)
    return Record(t, dict(zip(model.states, found.y + noise, strict=True)))


@contextmanager
def without_extra() -> Iterator[None]:
    """As if heyoka were not installed, for models made inside."""
    with patch("rotorid.identify.adaptive_steps.find_spec", lambda name: None):
        yield


def from_the_shell(extra: bool) -> None:
    """One fit of the nonlinear chain by the command line, in a process of its own."""
    model, record = cubic()
    with tempfile.TemporaryDirectory() as folder:
        lines = ["[states]", *(f'{name} = "{rate}"' for name, rate in CUBIC.items()), "[initial]"]
        lines += [f"{name} = {value}" for name, value in CUBIC_INITIAL.items()]
        lines += ["[estimate]", *(f"{name} = {value}" for name, value in CUBIC_START.items())]
        (Path(folder) / "model.toml").write_text("\n".join(lines))
        table = np.column_stack([record.t, *record.outputs.values()])
        names = ",".join(["t_s", *model.outputs])
        np.savetxt(Path(folder) / "record.csv", table, "%.9g", ",", header=names, comments="")
        code = "" if extra else "import sys; sys.modules['heyoka'] = None; "
        code += "from rotorid.cli import main; main()"
        program = [sys.executable, "-c", code, "fit", f"{folder}/model.toml", f"{folder}/record.csv"]
        subprocess.run(program, check=True, capture_output=True)


def shell() -> Row:
    """What compiling costs: no more than it saves in the same fit."""
    with_it, without_it = (
        min(once(lambda: None, lambda _, extra=extra: from_the_shell(extra))[0] for _ in range(5))
        for extra in (True, False)
    )
    return Row(
        task="First fit of the chain from the shell, compiling included",
        ours="with the extra",
        our_seconds=with_it,
        peer="without it",
        peer_seconds=without_it,
        difference=0.0,
        allowed=0.0,
        required_ratio=0.9,
    )


def with_lmfit(model: OdeModel, record: Record, rates: Rates, rtol: float) -> np.ndarray:
    import lmfit
    from scipy.integrate import solve_ivp

    start, names = model.x0(model.start)[:, 0], model.parameters
    measured = np.array([record.outputs[name] for name in model.outputs])

    def residual(parameters: Any) -> np.ndarray:
        theta = np.array([parameters[name].value for name in names])
        span = (record.t[0], record.t[-1])
        found = solve_ivp(rates, span, start, t_eval=record.t, args=(theta,), rtol=rtol, atol=rtol / 100)
        return (found.y - measured).ravel()

    parameters = lmfit.Parameters()
    for name, value in zip(names, model.start, strict=True):
        parameters.add(name, value=value)
    found = lmfit.minimize(residual, parameters, method="leastsq", epsfcn=rtol)
    return np.array([found.params[name].value for name in names])


class WithCasadi:
    """[F] as a modelling language does it: CVODES with forward sensitivities, full Gauss–Newton steps."""

    def __init__(self, model: OdeModel, record: Record, tolerance: float) -> None:
        import casadi

        x, theta = casadi.SX.sym("x", 6), casadi.SX.sym("theta", 3)
        rates = casadi.vertcat(*chain_rates(0.0, casadi.vertsplit(x), casadi.vertsplit(theta)).tolist())
        options = {"abstol": tolerance / 100, "reltol": tolerance}
        run = casadi.integrator(
            "run", "cvodes", {"x": x, "p": theta, "ode": rates}, 0.0, record.t[1:], options
        )
        p = casadi.MX.sym("p", 3)
        start = model.x0(model.start)[:, 0]
        states = casadi.horzcat(casadi.DM(start), run(x0=start, p=p)["xf"])
        measured = np.array([record.outputs[name] for name in model.outputs])
        residual = casadi.vec(states - measured)
        self.evaluate = casadi.Function("evaluate", [p], [residual, casadi.jacobian(residual, p)])
        self.start = model.start

    def fit(self) -> np.ndarray:
        theta = self.start.copy()
        for _ in range(20):
            r, J = (np.array(part) for part in self.evaluate(theta))
            step = np.linalg.lstsq(J, -r[:, 0], rcond=None)[0]
            theta = theta + step
            if np.abs(step / theta).max() < 1e-8:
                break
        return theta


def against_casadi(model: OdeModel, record: Record, ours: Row) -> Row:
    """[F] against CasADi at equal accuracy; the time to build its functions is not counted either."""
    for tolerance in 10.0 ** -np.arange(6, 13):
        peer = WithCasadi(model, record, tolerance)
        theirs = peer.fit()
        if relative_difference(theirs, F_OPTIMUM) <= ALLOWED:
            break
    else:
        raise RuntimeError(f"casadi does not come within {ALLOWED:.0e} of the optimum")
    return Row(
        task=ours.task,
        ours="rotorid",
        our_seconds=ours.our_seconds,
        peer=f"casadi, cvodes {tolerance:.0e}",
        peer_seconds=best_of(lambda: None, lambda _: peer.fit(), 3),
        difference=ours.difference,
        allowed=ALLOWED,
        required_ratio=1.0,
        goal=4.0,
        note=f"casadi is off by {relative_difference(theirs, F_OPTIMUM):.0e}",
    )


def compare(
    task: str,
    model: OdeModel,
    record: Record,
    rates: Rates,
    optimum: np.ndarray,
    required: float,
    repeat: int,
    integrator: str = "auto",
) -> Row:
    """Ours and theirs at equal accuracy; the first tolerance of lmfit that reaches it counts."""
    for rtol in 10.0 ** -np.arange(6, 12):
        theirs = with_lmfit(model, record, rates, rtol)
        if relative_difference(theirs, optimum) <= ALLOWED:
            break
    else:
        raise RuntimeError(f"{task}: lmfit does not come within {ALLOWED:.0e} of the optimum")
    fit(model, record, integrator=integrator)  # compiles
    seconds = best_of(lambda: None, lambda _: fit(model, record, integrator=integrator), repeat)
    return Row(
        task=task,
        ours="rotorid",
        our_seconds=seconds,
        peer=f"lmfit, solve_ivp rtol {rtol:.0e}",
        peer_seconds=best_of(lambda: None, lambda _: with_lmfit(model, record, rates, rtol), 2),
        difference=relative_difference(fit(model, record, integrator=integrator).values, optimum),
        allowed=ALLOWED,
        required_ratio=required,
        note=f"lmfit is off by {relative_difference(theirs, optimum):.0e}",
    )


def the_chain() -> tuple[OdeModel, Record]:
    folder = sample_data() / "fit" / "three_masses"
    chain = read_ode_model(folder / "model.toml")
    return chain, read_record(folder / "record.csv", chain)


def with_chain(chain: OdeModel, record: Record) -> Row:
    row = compare("Fit of [F], linear, 3 parameters", chain, record, chain_rates, F_OPTIMUM, 10.0, 30)
    return replace(row, goal=40.0)


def task() -> Row:
    return with_chain(*the_chain())


def run() -> list[Row]:
    chain, record = the_chain()
    linear = with_chain(chain, record)
    rows = [linear, against_casadi(chain, record, linear)]
    for name, make, rates, required, plain in (
        ("a nonlinear chain, 6 states, 4 parameters", cubic, cubic_rates, 100.0, 3.0),
        ("a pendulum", pendulum, pendulum_rates, 10.0, 0.9),
        ("a Duffing oscillator", duffing, duffing_rates, 10.0, 0.9),
    ):
        with without_extra():
            model, data = make()
            optimum = fit(model, data, integrator="dop853", rtol=1e-12).values
            slow = compare(f"Fit of {name}, without the extra", model, data, rates, optimum, plain, 5)
        model, data = make()
        rows += [compare(f"Fit of {name}", model, data, rates, optimum, required, 20, "taylor"), slow]
    return [*rows, shell()]
