"""Quasilinearization after Bellman and Kalaba, as [Q] describes it.

About the last trajectory x_s(t) and parameters θ_s the equations are linear, [Q] (2.17),

    dx/dt = f + f_x (x − x_s) + f_θ (θ − θ_s),    x = G θ + D,                             (2.18)
    dG/dt = f_x G + f_θ,    dD/dt = f − f_θ θ_s + f_x (D − x_s),    G θ + D = x0(θ) at t0,   (2.21)–(2.24)

and θ follows from linear least squares, M θ = Y with M = Σ (h_x G)ᵀ(h_x G) (2.28); x, the next trajectory,
need not solve the equations until the end. D + G θ_s is integrated in place of D: θ − θ_s keeps its digits.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.identify.integrators import HEUN, heun_step, recurrence
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.record_residuals import LARGEST, Iterations, Problem, negligible
from rotorid.identify.records import Record, inputs_of, refined
from rotorid.identify.sensitivity_steps import Steps

FINER = 5  # points of a trajectory from sample to sample; of the schemes of `HEUN` one


def quasilinearization(
    problem: Problem,
    start: FloatArray,
    trajectories: Sequence[tuple[FloatArray, FloatArray]],
    *,
    max_iterations: int,
    epsilon: float | None,
) -> Iterations:
    """Iterate linear fits about the last trajectory until neither it nor the parameters change.

    Parameters
    ----------
    problem
        Model, records and weights; its integrators of `HEUN` take one step per sample, "sequential-heun" as
        [Q] does; with any other the linear equations are solved by a step of DOP853 from point to point.
    trajectories
        First states (n, n_x) of each record at the times of `refined`, and their slopes.
    start, max_iterations, epsilon
        As in `sensitivity_steps`.

    Raises
    ------
    SimulationError
        The linear equations have no finite solution with the starting values.
    """
    theta, states, last, fitted = start.copy(), list(trajectories), np.inf, None
    every = FINER if problem.integrator not in HEUN else 1
    records = [refined(record, every) for record in problem.records]
    samples = [tuple(x[::every] for x, _ in states)]
    steps = Steps(problem, theta, problem.residual(theta), max_iterations, epsilon)
    for count in range(1, max_iterations + 1):
        try:
            tables = [
                linear_solutions(model, theta, record, *x, problem.integrator)
                for model, record, x in zip(problem.models, records, states, strict=True)
            ]
            K, Y = linear_rows(problem, theta, samples[-1], [W[::every] for W, _ in tables])
            fitted = problem.linear_fit(K, Y, theta)
        except SimulationError as error:
            if fitted is None:
                raise
            steps.message = f"quasilinearization diverged after {counted(count - 1, 'iteration')}: {error}"
            break
        step = fitted.solution
        regression, theta = (K, Y + K @ theta), theta + step
        states = [(W @ np.append(1.0, step), rates @ np.append(1.0, step)) for W, rates in tables]
        samples.append(tuple(x[::every] for x, _ in states))
        steps.append(theta, fitted.residuals)
        pairs = zip(*samples[-2:], strict=True)
        still = all(np.abs(b - a).max(initial=0) < 1e-3 * np.abs(b).max(initial=1e-300) for a, b in pairs)
        # quadratic convergence: the next step is smaller than this one by more than this one than the last
        size = max(float(np.abs(step).max()), 1e-300)
        following, last = step * min(1.0, size / last if count > 1 else 1.0), size
        settled = still and negligible(following, theta, fitted, steps.near)
        if steps.end(step, negligible(following, theta, fitted, (1e-9, 1e-5)), settled):
            break
    assert fitted is not None
    r = problem.residual(theta)
    if not np.isfinite(r).all():
        steps.converged, steps.message, r = False, "not converged: the states diverge", -fitted.residuals
    return steps.result(fitted, r, trajectories=tuple(samples), regression=regression)


def linear_solutions(
    model: OdeModel, theta: FloatArray, record: Record, x: FloatArray, slopes: FloatArray, integrator: str
) -> tuple[FloatArray, FloatArray]:
    """W = [D + G θ_s | G] at the times of a record, (n, n_x, 1 + n_p), and dW/dt.

    About θ_s and states (n, n_x) with slopes. DOP853 steps from all times at once: W is P W + q of the last.
    """
    from scipy.integrate import DOP853
    from scipy.interpolate import CubicHermiteSpline

    t, n, u = record.t, len(model.states), inputs_of(model, record)
    first = model.x0(theta)
    if not n or len(t) == 1:
        W = np.broadcast_to(first, (len(t), *first.shape))
        return W, np.zeros_like(W)

    def linear(t: FloatArray, x: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A and B of dW/dt = A W + B."""
        table = model.f(t, x, theta, u)
        A, B = table[..., 1 : 1 + n], np.delete(table, np.s_[1 : 1 + n], axis=-1)
        B[..., 0] -= (A @ x[..., None])[..., 0]
        return A, B

    A, B = linear(t, x, u)
    if integrator in HEUN:
        W, parts = np.empty((len(t), *first.shape)), HEUN[integrator](n)
        W[0] = w = first
        for i, h in enumerate(np.diff(t)):
            W[i + 1] = w = heun_step(lambda j, w: A[j] @ w + B[j], i, i + 1, w, h, parts)
    else:
        h, curve = np.diff(t)[:, None, None], CubicHermiteSpline(t, x, slopes)
        begin, rates = np.eye(n, n + first.shape[1]), np.zeros((12, len(t) - 1, n, n + first.shape[1]))
        for j, (weights, c) in enumerate(zip(DOP853.A, DOP853.C, strict=True)):
            at = t[:-1] + c * h[:, 0, 0]
            between, load = linear(at, curve(at), u[:-1] + c * np.diff(u, axis=0))
            rates[j] = between @ (begin + h * np.tensordot(weights[:j], rates[:j], 1))
            rates[j, :, :, n:] += load
        end = begin + h * np.tensordot(DOP853.B, rates, 1)
        W = np.concatenate([first[None], recurrence(end[..., :n], first, end[..., n:])])
    if not np.isfinite(W).all():
        raise SimulationError("the linearised equations have no finite solution; start from another place")
    return W, A @ W + B


def linear_rows(
    problem: Problem, theta: FloatArray, states: Sequence[FloatArray], tables: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Rows K (θ − θ_s) = Y of the samples, from states and `linear_solutions` there; M θ = Y is Kᵀ of it."""
    slopes, left = [], []
    parts = zip(problem.models, problem.records, problem.inputs, problem.measured, strict=True)
    for (model, record, u, data), x, W in zip(parts, states, tables, strict=True):
        outputs = model.h(record.t, x, theta, u)
        C = outputs[..., 1 : 1 + x.shape[1]]
        left.append(data - outputs[..., 0] - (C @ (W[..., 0] - x)[..., None])[..., 0])
        slopes.append(C @ W[..., 1:] + outputs[..., 1 + x.shape[1] :])
    K, Y = problem.vector(slopes), problem.vector(left)
    if not (np.abs(K).max() < LARGEST and np.abs(Y).max() < LARGEST):
        raise SimulationError("the linearised outputs are beyond all bounds; start from another trajectory")
    return K, Y
