"""Trajectories to begin with: from the model, from expressions of time, from arrays, from measured data."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.regression import gain
from rotorid.timedomain.integration.simulate import HEUN, inputs_of, simulate
from rotorid.timedomain.methods.least_squares_problem import Problem
from rotorid.timedomain.models.ode_model import OdeModel, ode_model
from rotorid.timedomain.models.record import Record

Curve = Callable[[FloatArray], FloatArray]
"""States (*B, n_x) at times (*B,)."""
FINER = 4
"""Points of the model's own solution between two samples."""


def given_trajectory(model: OdeModel, given: Mapping[str, str | float | ArrayLike], record: Record) -> Curve:
    """A trajectory by state: expressions of t, numbers, or arrays with one value per time of the record.

    Raises
    ------
    ValueError
        States that are missing or unknown; arrays of another length.
    """
    if set(given) != set(model.states):
        raise ValueError(
            f"a starting trajectory needs every state ({', '.join(model.states)}); got {', '.join(given)}"
        )
    curves = [_curve(name, given[name], record) for name in model.states]
    return lambda t: np.stack([np.broadcast_to(curve(t), np.shape(t)) for curve in curves], axis=-1)


def measured_trajectory(model: OdeModel, theta: FloatArray, record: Record) -> Curve:
    """The states that explain the measured outputs at each time, straight between the samples.

    Solves h(t, x, θ) = y at each time by Gauss–Newton steps of smallest change, beginning at the initial
    values; what the outputs do not tell stays there.
    """
    t = record.t
    if not model.states:
        return _straight(t, np.zeros((len(t), 0)))
    u = inputs_of(model, record)
    y = np.stack([_filled(t, record.outputs.get(name)) for name in model.outputs], axis=-1)
    seen = ~np.isnan(y)
    x = np.tile(model.x0(theta), (len(t), 1))
    for _ in range(20):
        miss = np.where(seen, y - model.h(t, x, theta, u), 0.0)
        slopes = np.where(seen[..., None], model.h_x(t, x, theta, u), 0.0)
        finite = np.isfinite(slopes).all() and np.isfinite(miss).all()
        step = np.einsum("tij,tj->ti", gain(slopes, rcond=1e-8), miss) if finite else None
        if step is None or not np.isfinite(step).all():
            raise ValueError(f"{record.name}: no states explain the measured outputs")
        x = x + step
        if np.abs(step).max() <= 1e-9 * (1 + np.abs(x).max()):
            break
    return _straight(t, x)


def own_trajectory(problem: Problem, theta: FloatArray, number: int) -> Curve:
    """The model's own solution over one of the records, smooth between its samples; of `HEUN` straight.

    Raises
    ------
    SimulationError
        The states diverge.
    """
    model, record = problem.models[number], problem.records[number]
    t = record.t
    if problem.integrator in HEUN or len(t) == 1 or not model.states:
        x = simulate(model, theta, record, method=problem.integrator, sensitivities=False).x
        return _straight(t, x)
    from scipy.interpolate import CubicHermiteSpline

    fine = np.interp(np.arange(FINER * (len(t) - 1) + 1) / FINER, np.arange(len(t)), t)
    inputs = {name: np.interp(fine, t, column) for name, column in record.inputs.items()}
    longer = Record(fine, {}, inputs, None, record.name)
    x = simulate(model, theta, longer, method=problem.integrator, rtol=problem.rtol, sensitivities=False).x
    slopes = model.f(fine, x, theta, inputs_of(model, longer))
    if not np.isfinite(slopes).all():
        return _straight(fine, x)
    return CubicHermiteSpline(fine, x, slopes)  # type: ignore[no-any-return]


def _straight(t: FloatArray, x: FloatArray) -> Curve:
    n = x.shape[1]
    return lambda at: (
        np.stack([np.interp(at, t, column) for column in x.T], axis=-1) if n else np.zeros((*np.shape(at), 0))
    )


def _filled(t: FloatArray, column: FloatArray | None) -> FloatArray:
    """Measured values with straight lines through gaps; NaN where nothing was measured at all."""
    if column is None or np.isnan(column).all():
        return np.full(len(t), np.nan)
    known = ~np.isnan(column)
    return np.interp(t, t[known], column[known])


def _curve(name: str, value: str | float | ArrayLike, record: Record) -> Curve:
    if isinstance(value, str):
        model = ode_model({}, outputs={"value": value}, estimate={"unused": 0.0})
        return lambda t: model.h(t, np.zeros((*np.shape(t), 0)), np.zeros(1))[..., 0]
    array = np.asarray(value, dtype=float)
    if array.shape not in ((), record.t.shape) or not np.isfinite(array).all():
        raise ValueError(
            f"the starting trajectory of {name} needs one finite value, or {len(record)} of them"
        )
    table = np.broadcast_to(array, record.t.shape)
    return lambda t: np.interp(t, record.t, table)
