"""Fits to time records against lmfit with SciPy's `solve_ivp`, both started at the same values.

The chain of three masses of [F] (251 samples of six states, three parameters), a Duffing oscillator and a
pendulum (201 samples of two states). lmfit minimises with Levenberg–Marquardt and finite differences; its
integration has the loosest of the tolerances 1e-6, 1e-7, … with which its parameters come within 2e-6 of the
optimum: that of [F] is known to its eight printed digits, that of the oscillators from an integration with
tolerance 1e-12. CasADi integrates [F] with CVODES and its forward sensitivities, and takes full Gauss–Newton
steps; the same rule for its tolerance. Reading and compiling the model is not counted. The oscillators are
fitted with the extra `rotorid[fast]` and without it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.timing import Row, best_of, relative_difference
from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import OdeModel, ode_model
from rotorid.identify.records import Record
from rotorid.samples import sample_data

F_OPTIMUM = np.array([0.13999975, 11.99998962, 28.00000273])
ALLOWED = 2e-6
Rates = Callable[[float, np.ndarray, np.ndarray], np.ndarray]
Fit = Callable[[], np.ndarray]


def chain_rates(_: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    c1, m1, m2 = theta
    y1, v1, y2, v2, y3, v3 = x
    a1 = (-(c1 + 0.3) * y1 + 0.3 * y2) / m1
    a2 = (0.3 * y1 - 0.5 * y2 + 0.2 * y3) / m2
    return np.array([v1, a1, v2, a2, v3, (0.2 * y2 - 0.32 * y3) / 18.0])


def duffing_rates(t: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    k, b, d = theta
    return np.array([x[1], -k * x[0] - b * x[0] ** 3 - d * x[1] + 0.3 * np.cos(1.2 * t)])


def pendulum_rates(t: float, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    k, d = theta
    return np.array([x[1], -k * np.sin(x[0]) - d * x[1]])


OSCILLATORS = {
    "Duffing oscillator": (duffing_rates, "-k*x - b*x**3 - d*v + 0.3*cos(1.2*t)", (1.0, 0.5, 0.1)),
    "pendulum": (pendulum_rates, "-k*sin(x) - d*v", (1.0, 0.1)),
}
"""Rates, the same as an expression, and the true parameters."""
START = {"k": 0.9, "b": 0.6, "d": 0.15}


def oscillator(name: str) -> tuple[OdeModel, Record]:
    """The model, and its exact record over 20 s with errors of 1e-3."""
    rates, expression, true = OSCILLATORS[name]
    estimate = {parameter: START[parameter] for parameter in START if f"{parameter}*" in expression}
    model = ode_model({"x": "v", "v": expression}, initial={"x": 1.0, "v": 0.0}, estimate=estimate)
    t, start = np.linspace(0.0, 20.0, 201), model.x0(model.start)[:, 0]
    exact = simulated(rates, start, t, true, method="DOP853", rtol=1e-12, atol=1e-12)
    noise = 1e-3 * np.random.default_rng(5).standard_normal(exact.shape)
    return model, Record(t, dict(zip(model.states, exact + noise, strict=True)))


def simulated(rates: Rates, start: np.ndarray, t: np.ndarray, theta: Any, **options: Any) -> np.ndarray:
    """States, shape (states, instants)."""
    return solve_ivp(rates, (t[0], t[-1]), start, t_eval=t, args=(np.asarray(theta),), **options).y


def with_lmfit(model: OdeModel, record: Record, rates: Rates, rtol: float) -> np.ndarray:
    import lmfit

    start, names = model.x0(model.start)[:, 0], model.parameters
    outputs = np.array([record.outputs[name] for name in model.outputs])

    def residual(parameters: Any) -> np.ndarray:
        theta = [parameters[name].value for name in names]
        return (simulated(rates, start, record.t, theta, rtol=rtol, atol=rtol / 100) - outputs).ravel()

    parameters = lmfit.Parameters()
    for name, value in zip(names, model.start, strict=True):
        parameters.add(name, value=value)
    result = lmfit.minimize(residual, parameters, method="leastsq", epsfcn=rtol)
    return np.array([result.params[name].value for name in names])


def casadi_fit(model: OdeModel, record: Record, tolerance: float) -> Fit:
    """[F] as a modelling language does it: CVODES with forward sensitivities, full Gauss–Newton steps."""
    import casadi

    x, theta = casadi.SX.sym("x", 6), casadi.SX.sym("theta", 3)
    rates = casadi.vertcat(*chain_rates(0.0, casadi.vertsplit(x), casadi.vertsplit(theta)).tolist())
    equations, options = {"x": x, "p": theta, "ode": rates}, {"abstol": tolerance / 100, "reltol": tolerance}
    run = casadi.integrator("run", "cvodes", equations, 0.0, record.t[1:], options)
    p, start = casadi.MX.sym("p", 3), model.x0(model.start)[:, 0]
    states = casadi.horzcat(casadi.DM(start), run(x0=start, p=p)["xf"])
    residual = casadi.vec(states - np.array([record.outputs[name] for name in model.outputs]))
    evaluate = casadi.Function("evaluate", [p], [residual, casadi.jacobian(residual, p)])

    def solve() -> np.ndarray:
        theta = model.start.copy()
        for _ in range(20):
            r, J = (np.array(part) for part in evaluate(theta))
            step = np.linalg.lstsq(J, -r[:, 0], rcond=None)[0]
            theta = theta + step
            if np.abs(step / theta).max() < 1e-8:
                break
        return theta

    return solve


def loosest(peer: str, fit_with: Callable[[float], Fit], optimum: np.ndarray) -> tuple[str, Fit]:
    """A peer's fit with the loosest tolerance that comes close enough to the optimum, and its name."""
    for tolerance in 10.0 ** -np.arange(6, 13):
        if relative_difference((solve := fit_with(tolerance))(), optimum) <= ALLOWED:
            return f"{peer} {tolerance:.0e}", solve
    raise RuntimeError(f"{peer} does not come within {ALLOWED:.0e} of the optimum")


def beside(task: str, ours: Fit, peer: tuple[str, Fit], optimum: np.ndarray, *ratios: float) -> Row:
    """Two fits at equal accuracy, with the ratio required and the ratio aimed at."""
    name, theirs = peer
    return Row(
        task=task,
        our_seconds=best_of(lambda: None, lambda _: ours(), 20),
        peer=name,
        peer_seconds=best_of(lambda: None, lambda _: theirs(), 2),
        difference=relative_difference(ours(), optimum),
        allowed=ALLOWED,
        required_ratio=ratios[0],
        note=f"the peer is off by {relative_difference(theirs(), optimum):.0e}",
        goal=ratios[1],
    )


def with_chain(casadi: bool = False) -> Row:
    folder = sample_data() / "fit" / "three_masses"
    model = read_ode_model(folder / "model.toml")
    record = read_record(folder / "record.csv", model)
    ours = lambda: fit(model, record).values  # noqa: E731
    if casadi:
        peer, ratios = loosest("casadi, cvodes", partial(casadi_fit, model, record), F_OPTIMUM), (1.0, 4.0)
    else:
        lmfit = partial(partial, with_lmfit, model, record, chain_rates)
        peer, ratios = loosest("lmfit, solve_ivp rtol", lmfit, F_OPTIMUM), (10.0, 40.0)
    return beside("Fit of [F], linear, 3 parameters", ours, peer, F_OPTIMUM, *ratios)


def with_oscillator(name: str) -> list[Row]:
    with patch.dict("sys.modules", heyoka=None):  # as if not installed
        plain, record = oscillator(name)
        optimum = fit(plain, record, integrator="dop853", rtol=1e-12).values
        lmfit = partial(partial, with_lmfit, plain, record, OSCILLATORS[name][0])
        peer = loosest("lmfit, solve_ivp rtol", lmfit, optimum)
        ours = lambda: fit(plain, record).values  # noqa: E731
        without = beside(f"Fit of a {name}, without the extra", ours, peer, optimum, 0.9, 3.0)
    model, record = oscillator(name)
    compiled = lambda: fit(model, record, integrator="taylor").values  # noqa: E731
    return [without, beside(f"Fit of a {name}", compiled, peer, optimum, 10.0, 10.0)]


task = with_chain


def run() -> list[Row]:
    oscillators = [row for name in OSCILLATORS for row in with_oscillator(name)]
    return [with_chain(), with_chain(casadi=True), *oscillators]
