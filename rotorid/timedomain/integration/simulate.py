"""Simulation of a model over a record's times with its sensitivities: chooses the integrator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray, significant
from rotorid.base.registry import Method, find
from rotorid.timedomain.integration import adaptive, matrix_exponential
from rotorid.timedomain.integration.sensitivity_equations import Augmented
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record, from_t0
from rotorid.timedomain.models.simulation_errors import SimulationError, check_finite

__all__ = ["INTEGRATORS", "SimulationError", "Trajectory", "inputs_of", "simulate"]

Integrate = Callable[[Augmented, FloatArray, FloatArray, float], tuple[FloatArray, FloatArray, str]]
"""System, initial states and sensitivities, rtol → both at all times, and the method used."""
At = TypeVar("At", int, float)
Parts = Sequence[Sequence[int]]
"""Numbers of states, or of rows, that are corrected together."""
Step = Callable[[Augmented, float, float, FloatArray], FloatArray]
"""System, time now and then, states → states then."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States and outputs over time, and their derivatives by the parameters.

    Attributes
    ----------
    t
        Shape (n,).
    x, y
        States (n, n_x) and outputs (n, n_y).
    S, y_theta
        Derivatives by the parameters, (n, n_x, n_p) and (n, n_y, n_p); zeros without sensitivities.
    method
        The integrator used: "none" without states, "taylor" with the extra `rotorid[fast]`.
    """

    t: FloatArray
    x: FloatArray
    S: FloatArray
    y: FloatArray
    y_theta: FloatArray
    method: str


def simulate(
    model: OdeModel,
    theta: ArrayLike,
    record: Record | ArrayLike,
    *,
    method: str = "auto",
    rtol: float = 1e-10,
    sensitivities: bool = True,
) -> Trajectory:
    """Solve a model over the times of a record.

    Parameters
    ----------
    model
        The model.
    theta
        Parameters, shape (n_p,).
    record
        Times and inputs; times alone (n,) for a model without inputs.
    method
        One of `INTEGRATORS`; "auto" with the extra `rotorid[fast]` takes "taylor" in fits of a
        model that has needed many steps.
    rtol
        Relative tolerance of "dop853" and "lsoda"; the absolute one follows the size of each state.
    sensitivities
        Whether to solve for the derivatives too.

    Raises
    ------
    SimulationError
        The solution does not exist up to the last time, or takes too many steps.
    ValueError
        A method that does not suit the model, missing inputs.
    """
    integrate = find(INTEGRATORS, method, "integrator").function
    if not isinstance(record, Record):
        record = Record(np.asarray(record, dtype=float), name="the times")
    values = np.asarray(theta, dtype=float)
    if values.shape != (len(model.parameters),) or not np.isfinite(values).all():
        raise ValueError(
            f"theta must be {len(model.parameters)} finite numbers ({', '.join(model.parameters)})"
        )
    longer = from_t0(model, record)
    if longer is not record:
        run = simulate(model, values, longer, method=method, rtol=rtol, sensitivities=sensitivities)
        return Trajectory(run.t[1:], run.x[1:], run.S[1:], run.y[1:], run.y_theta[1:], run.method)
    u = inputs_of(model, record)
    t = record.t
    if not model.states:
        x, s, used = np.zeros((len(t), 0)), np.zeros((len(t), 0, len(values))), "none"
    else:
        system = Augmented(model, values, t, u, sensitivities)
        x0 = model.x0(values)
        s0 = model.x0_theta(values) if sensitivities else np.zeros((len(x0), 0))
        check_finite(model, t[:1], x0[None], s0[None])
        x, s, used = integrate(system, x0, s0, rtol)
        check_finite(model, t, x, s)
    y = model.h(t, x, values, u)
    y_theta = np.zeros((*y.shape, len(values)))
    if sensitivities:
        y_theta = model.h_x(t, x, values, u) @ s + model.h_theta(t, x, values, u)
    else:
        s = np.zeros((len(t), len(model.states), len(values)))
    bad = ~(np.isfinite(y) & np.isfinite(y_theta).all(axis=-1))
    if bad.any():
        i, j = np.argwhere(bad)[0]
        raise SimulationError(
            f"the output {model.outputs[j]} has no finite value at t = {t[i]:g}; change the parameters or "
            "the output"
        )
    return Trajectory(t, x, s, y, y_theta, used)


def inputs_of(model: OdeModel, record: Record) -> FloatArray:
    """Inputs of the model in its order, (n, n_u)."""
    if missing := [name for name in model.inputs if name not in record.inputs]:
        have = ", ".join(record.inputs) or "none"
        raise ValueError(f"{record.name}: the input {missing[0]} is missing; inputs are: {have}")
    if not model.inputs:
        return np.zeros((len(record.t), 0))
    return np.stack([record.inputs[name] for name in model.inputs], axis=1)


def simulated_record(
    model: OdeModel,
    theta: FloatArray,
    plan: Record,
    sigma: Mapping[str, float] | None = None,
    digits: int | None = None,
    seed: int = 0,
) -> Record:
    """What would be read of a model's outputs at the times and with the inputs of a record.

    Independent normal errors of standard deviations `sigma` are drawn, then samples are rounded to
    significant digits. Errors as in `simulate`.
    """
    y = simulate(model, theta, plan, sensitivities=False).y
    if sigma is not None:
        drawn = np.random.default_rng(seed).standard_normal(y.shape)
        y = y + drawn * [sigma[name] for name in model.outputs]
    columns = y.T if digits is None else [significant(column, digits) for column in y.T]
    return replace(plan, outputs=dict(zip(model.outputs, columns, strict=True)), sigma=sigma)


def _auto(
    system: Augmented, x0: FloatArray, s0: FloatArray, rtol: float
) -> tuple[FloatArray, FloatArray, str]:
    exact = system.model.linear_driven
    return (_exact if exact else adaptive.integrate)(system, x0, s0, rtol)


def _exact(
    system: Augmented, x0: FloatArray, s0: FloatArray, rtol: float
) -> tuple[FloatArray, FloatArray, str]:
    model, t, u = system.model, system.t, system.u
    if not model.linear_driven:
        raise ValueError(
            "expm solves linear models with constant coefficients, without explicit time; use dop853, lsoda, "
            "or auto"
        )
    n, k, nu = len(x0), s0.shape[1], u.shape[1] if model.driven else 0
    # behind x: 1, whose effect is the constant rate b; u, which grows by its slope; and the slope
    matrix = np.zeros((1 + k, n + 1 + 2 * nu, n + 1 + 2 * nu))
    matrix[:, :n, : n + 1 + nu] = model.matrices(system.theta)[: 1 + k, :, : n + 1 + nu]
    matrix[0, n + 1 : n + 1 + nu, n + 1 + nu :] = np.eye(nu)
    growth = np.diff(u[:, :nu], axis=0) / np.diff(t)[:, None]
    drive = np.concatenate([np.ones((len(t) - 1, 1)), u[:-1, :nu], growth], axis=1)
    return *matrix_exponential.propagate(t, x0, s0, matrix[0], matrix[1:], drive), "expm"


HEUN: dict[str, Callable[[int], Parts]] = {
    "heun": lambda n: [range(n)],
    "sequential-heun": lambda n: [[i] for i in range(n)],
}
"""Integrators of Euler's predictor and the trapezoidal corrector: the parts that each makes of n states."""
STEPWISE = (*HEUN, "rk4")
"""Integrators without error control, of one step from sample to sample."""


def heun_step(
    rate: Callable[[At, FloatArray], FloatArray],
    now: At,
    then: At,
    z: FloatArray,
    h: float,
    parts: Parts,
) -> FloatArray:
    """Predict, then correct part by part: a part takes those before it as corrected, the rest as predicted.

    Parameters
    ----------
    rate
        Of the states (n, …), at `now` and at `then`: times, or numbers of samples.
    z, h
        States now, and the length of the step.
    parts
        Of the rows of z.
    """
    k = rate(now, z)
    new: FloatArray = z + h * k
    for part in parts:
        new[part] = (z + h / 2 * (k + rate(then, new)))[part]
    return new


def _heun(name: str, system: Augmented, now: float, then: float, z: FloatArray) -> FloatArray:
    parts = [system.rows(states) for states in HEUN[name](system.nx)]
    return heun_step(system, now, then, z, then - now, parts)


def _rk4(system: Augmented, now: float, then: float, z: FloatArray) -> FloatArray:
    h, k1 = then - now, system(now, z)
    k2 = system(now + h / 2, z + h / 2 * k1)
    k3 = system(now + h / 2, z + h / 2 * k2)
    k4 = system(then, z + h * k3)
    return z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _stepwise(name: str, step: Step) -> Integrate:
    """One step from sample to sample."""

    def integrate(
        system: Augmented, x0: FloatArray, s0: FloatArray, rtol: float
    ) -> tuple[FloatArray, FloatArray, str]:
        table = np.empty((len(system.t), system.size))
        table[0] = z = system.pack(x0, s0)
        with np.errstate(all="ignore"):
            for i, (now, then) in enumerate(pairwise(system.t.tolist()), start=1):
                table[i] = z = step(system, now, then, z)
                if not np.isfinite(z).all():
                    table[i + 1 :] = np.nan
                    break
        return *system.unpack(table), name

    return integrate


INTEGRATORS: tuple[Method[Integrate], ...] = (
    Method("auto", "expm if possible, else dop853, and lsoda where that needs too many steps", _auto),
    Method("expm", "the exact solution of a linear model with constant coefficients", _exact),
    Method("dop853", "error control, for smooth models", partial(adaptive.integrate, method="dop853")),
    Method("lsoda", "error control, for stiff models", partial(adaptive.integrate, method="lsoda")),
    Method("heun", "one step from sample to sample", _stepwise("heun", partial(_heun, "heun"))),
    Method(
        "sequential-heun",
        "the scheme of [Q], to repeat its tables: heun, but each state is corrected with those before it in "
        "the model, whose order matters",
        _stepwise("sequential-heun", partial(_heun, "sequential-heun")),
    ),
    Method("rk4", "one step from sample to sample, as [F]", _stepwise("rk4", _rk4)),
)
