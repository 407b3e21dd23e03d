"""Fits to time records against lmfit with SciPy's `solve_ivp`, both started at the same values.

The chain of three masses of [F] (251 samples of six states, three parameters), and six coupled nonlinear
oscillators' states (three masses with cubic springs, 201 samples, four parameters). lmfit minimises with
Levenberg–Marquardt and finite differences, its usual way; its integration has the loosest of the tolerances
1e-6, 1e-7, … with which its parameters come within 2e-6 of the least-squares optimum. That optimum is known
from [F] to its eight printed digits, and for the nonlinear chain from an integration with tolerance 1e-12.
CasADi integrates with CVODES and its
forward sensitivities, and takes full Gauss–Newton steps; the same rule for its tolerance.
The time to read and compile the model belongs to reading its file and is not counted for any program.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.timing import Row, best_of, relative_difference
from rotorid.samples import sample_data
from rotorid.tables import read_ode_model, read_record
from rotorid.timedomain.fit import fit
from rotorid.timedomain.models.model import OdeModel, ode_model
from rotorid.timedomain.models.record import Record

F_OPTIMUM = np.array([0.13999975, 11.99998962, 28.00000273])
ALLOWED = 2e-6
LINEAR_LIMIT = 5e-3  # s
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


def cubic() -> tuple[OdeModel, Record]:
    """Three masses with cubic springs, exact record with errors of 1e-3."""
    from scipy.integrate import solve_ivp

    model = ode_model(
        {
            "y1": "v1",
            "v1": "-y1 - e*y1**3 + k*(y2 - y1) + g*(y2 - y1)**3 - d*v1",
            "y2": "v2",
            "v2": "-k*(y2 - y1) - g*(y2 - y1)**3 + k*(y3 - y2) + g*(y3 - y2)**3 - d*v2",
            "y3": "v3",
            "v3": "-k*(y3 - y2) - g*(y3 - y2)**3 - y3 - e*y3**3 - d*v3",
        },
        initial={"y1": 1.0, "v1": 0.0, "y2": -0.5, "v2": 0.3, "y3": 0.2, "v3": 0.0},
        estimate={"k": 1.8, "e": 0.4, "d": 0.07, "g": 0.25},
    )
    t = np.linspace(0.0, 20.0, 201)
    truth, start = np.array([2.0, 0.5, 0.05, 0.3]), model.x0(model.start)
    found = solve_ivp(
        cubic_rates, (0.0, 20.0), start, t_eval=t, args=(truth,), method="DOP853", rtol=1e-12, atol=1e-12
    )
    noise = 1e-3 * np.random.default_rng(5).standard_normal(found.y.shape)
    return model, Record(t, dict(zip(model.states, found.y + noise, strict=True)))


def with_lmfit(model: OdeModel, record: Record, rates: Rates, rtol: float) -> np.ndarray:
    import lmfit
    from scipy.integrate import solve_ivp

    start, names = model.x0(model.start), model.parameters
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
        start = model.x0(model.start)
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
) -> Row:
    """Ours and theirs at equal accuracy; the first tolerance of lmfit that reaches it counts."""
    for rtol in 10.0 ** -np.arange(6, 12):
        theirs = with_lmfit(model, record, rates, rtol)
        if relative_difference(theirs, optimum) <= ALLOWED:
            break
    else:
        raise RuntimeError(f"{task}: lmfit does not come within {ALLOWED:.0e} of the optimum")
    fit(model, record)  # compiles
    seconds = best_of(lambda: None, lambda _: fit(model, record), repeat)
    return Row(
        task=task,
        ours="rotorid",
        our_seconds=seconds,
        peer=f"lmfit, solve_ivp rtol {rtol:.0e}",
        peer_seconds=best_of(lambda: None, lambda _: with_lmfit(model, record, rates, rtol), 2),
        difference=relative_difference(fit(model, record).values, optimum),
        allowed=ALLOWED,
        required_ratio=required,
        note=f"lmfit is off by {relative_difference(theirs, optimum):.0e}",
    )


def run() -> list[Row]:
    folder = sample_data() / "fit" / "three_masses"
    chain = read_ode_model(folder / "model.toml")
    record = read_record(folder / "record.csv", chain)
    linear = compare("Fit of [F], linear, 3 parameters", chain, record, chain_rates, F_OPTIMUM, 10.0, 30)
    limit = Row(
        task="The same",
        ours="rotorid",
        our_seconds=linear.our_seconds,
        peer="the limit of 5 ms",
        peer_seconds=LINEAR_LIMIT,
        difference=0.0,
        allowed=0.0,
        required_ratio=1.0,
    )
    model, measured = cubic()
    optimum = fit(model, measured, integrator="dop853", rtol=1e-12).values
    task = "Fit of a nonlinear chain, 6 states, 4 parameters"
    return [
        linear,
        limit,
        against_casadi(chain, record, linear),
        compare(task, model, measured, cubic_rates, optimum, 3.0, 5),
    ]
