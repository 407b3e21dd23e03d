"""Quasilinearization after Bellman and Kalaba, as [Q] describes it.

About the current trajectory x_k(t) and parameters θ_k the equations are linear,
dx/dt = f + f_x (x − x_k) + f_θ (θ − θ_k). Their solution is x = D + G (θ − θ_k) with the particular solution
D and the homogeneous solutions G; θ follows from linear least squares, and x is the next trajectory. It need
not solve the original equations until the end, which is what makes the method forgiving.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.regression.estimate import Estimate
from rotorid.timedomain.integration.simulate import HEUN, Parts, SimulationError, heun_step, inputs_of
from rotorid.timedomain.methods.collocation import solve_linear
from rotorid.timedomain.methods.iteration_history import Path, Stop, at, half_square, negligible
from rotorid.timedomain.methods.least_squares_problem import LARGEST, Problem
from rotorid.timedomain.methods.trajectory import Curve
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record


def quasilinearization(
    problem: Problem, start: FloatArray, curves: Sequence[Curve], *, max_iterations: int, stop: Stop
) -> Path:
    """Iterate linear fits about the last trajectory until neither it nor the parameters change.

    Parameters
    ----------
    problem
        Model, records and weights; its integrators of `HEUN` take one step per sample, "sequential-heun" as
        [Q] does; with any other the linear equations are solved by collocation.
    start
        First parameters (n,).
    curves
        First trajectory of each record.
    max_iterations
        Steps at most.
    stop
        When to end.

    Raises
    ------
    SimulationError
        The linear equations have no finite solution with the starting values.
    """
    model, theta = problem.model, start.copy()
    states = tuple(curve(record.t) for curve, record in zip(curves, problem.records, strict=True))
    if not np.isfinite(first := _cost(problem, theta, states)):
        raise SimulationError("the starting trajectory is beyond all bounds; start from another one")
    history, costs, trajectories = [theta], [first], [states]
    found: Estimate | None = None
    step: FloatArray | None = None
    converged, message = False, f"not converged in {counted(max_iterations, 'iteration')}"
    ended: str | None = None
    for _ in range(max_iterations):
        if found is not None and problem.late:
            message = (
                f"not converged: quasilinearization was stopped after {problem.seconds:.3g} s (--max-seconds)"
            )
            break
        try:
            if not np.isfinite(theta).all():
                raise SimulationError("the parameters grow beyond all bounds")
            parts = [linear_solutions(problem, theta, curve, i) for i, curve in enumerate(curves)]
            found = _solve(problem, theta, states, [table for table, _ in parts])
        except SimulationError as error:
            if found is None:
                raise
            message = f"quasilinearization diverged after {counted(len(history) - 1, 'iteration')}: {error}"
            break
        last, step = step, found.solution
        theta = theta + step
        curves = [_next(curve, step) for _, curve in parts]
        before, states = states, tuple(table @ np.append(1.0, step) for table, _ in parts)
        history.append(theta)
        costs.append(half_square(found.residuals, problem.prior.residual(theta)))
        trajectories.append(states)
        change = max(_change(a, b) for a, b in zip(before, states, strict=True)) if model.states else 0.0
        earlier = last if stop.tolerance is None else None
        met = stop.met(negligible(step, theta, found, stop.short, earlier), costs)
        converged = bool(met) and change < 1e-3 and negligible(step, theta, found, stop.near, last)
        if met and (converged or stop.tolerance is not None):
            ended, message = met, stop.words(met, len(history) - 1, converged)
            break
    if found is None:
        raise ValueError("max_iterations must be at least 1")
    r = problem.residual(theta)
    if not np.isfinite(r).all():
        converged, message, r = False, f"not converged: {problem.failure}", -found.residuals
    path, size = np.array(history), np.array(costs)
    return Path(at(found, theta, r), path, size, converged, message, (), tuple(trajectories), ended)


def linear_solutions(
    problem: Problem, theta: FloatArray, curve: Curve, number: int
) -> tuple[FloatArray, Curve]:
    """D and G of the equations linearised about a trajectory of one of the records.

    Returns
    -------
    [D | G] at the times of the record, (n, n_x, 1 + n_p), and as a function of time.
    """
    model, record = problem.models[number], problem.records[number]
    t = record.t
    shape = (len(model.states), 1 + len(theta))
    first = np.column_stack((model.x0(theta), model.x0_theta(theta))) if model.states else np.zeros(shape)
    if not model.states or len(t) == 1:
        table = np.broadcast_to(first, (len(t), *shape)).copy()
        return table, lambda at: np.broadcast_to(first, (*np.shape(at), *shape))
    if problem.integrator in HEUN:
        parts = HEUN[problem.integrator](len(model.states))
        table = _heun(model, theta, curve(t), record, first, parts)
        flat = table.reshape(len(t), -1)

        def straight(at: FloatArray) -> FloatArray:
            columns = [np.interp(at, t, column) for column in flat.T]
            return np.stack(columns, axis=-1).reshape(*np.shape(at), *shape)

        return table, straight
    return _collocated(model, theta, curve, record, first)


def _heun(
    model: OdeModel, theta: FloatArray, x: FloatArray, record: Record, first: FloatArray, parts: Parts
) -> FloatArray:
    t, u = record.t, inputs_of(model, record)
    A = model.f_x(t, x, theta, u)
    b = model.f(t, x, theta, u) - np.einsum("tij,tj->ti", A, x)
    B = np.concatenate((b[..., None], model.f_theta(t, x, theta, u)), axis=-1)
    table = np.empty((len(t), *first.shape))
    table[0] = w = first
    with np.errstate(all="ignore"):
        for i, h in enumerate(np.diff(t)):
            table[i + 1] = w = heun_step(lambda j, w: A[j] @ w + B[j], i, i + 1, w, h, parts)
    if not np.isfinite(table).all():
        raise SimulationError(
            "the linearised equations have no finite solution; start from another trajectory"
        )
    return table


def _collocated(
    model: OdeModel, theta: FloatArray, curve: Curve, record: Record, first: FloatArray
) -> tuple[FloatArray, Curve]:
    u = inputs_of(model, record)
    constant = model.matrices(theta)[0, :, : len(model.states)] if model.linear_driven else None

    def equations(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        x = curve(t)
        at = (t, x, theta, np.stack([np.interp(t, record.t, column) for column in u.T], -1) if u.size else ())
        A = model.f_x(*at) if constant is None else constant
        b = model.f(*at) - (A @ x[..., None])[..., 0]
        return A, np.concatenate((b[..., None], model.f_theta(*at)), axis=-1)

    return solve_linear(equations, record.t, first)


def _solve(
    problem: Problem, theta: FloatArray, states: Sequence[FloatArray], tables: Sequence[FloatArray]
) -> Estimate:
    """Linear least squares for the change of the parameters."""
    outputs, slopes = [], []
    parts = zip(problem.models, problem.records, states, tables, problem.measured, strict=True)
    for model, record, x, W, data in parts:
        u = inputs_of(model, record)
        C = model.h_x(record.t, x, theta, u)
        y = model.h(record.t, x, theta, u) + np.einsum("tij,tj->ti", C, W[..., 0] - x)
        outputs.append(data - y)
        slopes.append(C @ W[..., 1:] + model.h_theta(record.t, x, theta, u))
    K, Y = problem.vector(slopes), problem.vector(outputs)
    if not (np.abs(K).max() < LARGEST and np.abs(Y).max() < LARGEST):
        raise SimulationError("the linearised outputs are beyond all bounds; start from another trajectory")
    return problem.linear_fit(K, Y, theta)


def _next(curve: Curve, step: FloatArray) -> Curve:
    weights = np.append(1.0, step)
    return lambda t: curve(t) @ weights


def _cost(problem: Problem, theta: FloatArray, states: Sequence[FloatArray]) -> float:
    """Of a trajectory that need not solve the equations."""
    tables = [
        model.h(record.t, x, theta, inputs_of(model, record)) - data
        for model, record, x, data in zip(
            problem.models, problem.records, states, problem.measured, strict=True
        )
    ]
    return half_square(problem.vector(tables))


def _change(before: FloatArray, after: FloatArray) -> float:
    size = float(np.abs(after).max())
    return float(np.abs(after - before).max()) / size if size > 0 else 0.0
