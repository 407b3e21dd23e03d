"""Quasilinearization after Bellman and Kalaba, as [Q] describes it.

About the last trajectory x_s(t) and parameters θ_s the equations are linear, [Q] (2.17),

    dx/dt = f + f_x (x − x_s) + f_θ (θ − θ_s),    x = G θ + D,                             (2.18)
    dG/dt = f_x G + f_θ,    dD/dt = f − f_θ θ_s + f_x (D − x_s),    G θ + D = x0(θ) at t0,   (2.21)–(2.24)

and θ follows from linear least squares, M θ = Y with M = Σ (h_x G)ᵀ(h_x G) (2.28); x, the next trajectory,
need not solve the equations until the end. D + G θ_s is integrated in place of D: θ − θ_s keeps its digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.integrators import HEUN, heun_step, recurrence
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.record_least_squares import LARGEST, Iterations, Problem, negligible
from rotorid.identify.records import Record, inputs_of, refined
from rotorid.identify.sensitivity_steps import Step, iterate
from rotorid.identify.simulation import simulate


def quasilinearization(
    problem: Problem,
    theta: FloatArray,
    near: tuple[float, float],
    most: int,
    epsilon: float | None,
) -> Iterations:
    """Iterate linear fits about the last trajectory until neither it nor the parameters change.

    Parameters
    ----------
    problem
        Model, records and weights; its integrators of `HEUN` take one step per sample, "sequential-heun" as
        [Q] does; with any other the linear equations are solved by two steps of DOP853 from sample to sample.
    theta
        First parameters (n,); their solution is the first trajectory.
    near, most, epsilon
        As in `sensitivity_steps` and `iterate`.

    Raises
    ------
    SimulationError
        The linear equations have no finite solution with the starting values.
    """
    wanted, records = problem.integrator, problem.records
    grids = [(one, np.arange(len(one))) if wanted in HEUN else refined(one, 2) for one in records]
    parts = [*zip(problem.models, grids, strict=True)]

    def seen(states: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        """At the times of the records."""
        return tuple(x[at] for x, (_, at) in zip(states, grids, strict=True))

    runs = [
        simulate(model, theta, fine, integrator=wanted, sensitivities=False) for model, (fine, _) in parts
    ]
    states = [run.x for run in runs]
    samples = [seen(states)]
    rows: list[tuple[FloatArray, FloatArray]] = []

    def steps(theta: FloatArray, states: Sequence[FloatArray]) -> Iterator[Step]:
        last = 1e-300
        yield theta, problem.residual(theta), None, theta, False, False
        while True:
            tables = [
                linear_solutions(model, theta, fine, x, wanted)
                for (model, (fine, _)), x in zip(parts, states, strict=True)
            ]
            K, Y = linear_rows(problem, theta, samples[-1], seen(tables))
            fitted = problem.linear_fit(K, Y, theta)
            step = fitted.solution
            rows[:], theta = [(K, Y + K @ theta)], theta + step
            states = [W @ np.append(1.0, step) for W in tables]
            samples.append(seen(states))
            pairs = zip(*samples[-2:], strict=True)
            still = all(np.abs(b - a).max(initial=0) < 1e-3 * np.abs(b).max(initial=1e-300) for a, b in pairs)
            # quadratic convergence: the next step is smaller than this one by more than this than the last
            size = max(float(np.abs(step).max()), 1e-300)
            following, last = step * min(1.0, size / last), size
            short, settled = (negligible(following, theta, fitted, x) for x in ((1e-9, 1e-5), near))
            yield theta, fitted.residuals, fitted, step, short, still and settled

    done = iterate(problem, "quasilinearization", steps(theta, states), most, epsilon)
    return replace(done, trajectories=tuple(samples), regression=rows[0])


def linear_solutions(
    model: OdeModel, theta: FloatArray, record: Record, x: FloatArray, integrator: str
) -> FloatArray:
    """W = [D + G θ_s | G] at the times of a record, (n, n_x, 1 + n_p), about θ_s and states (n, n_x).

    All steps are taken at once: W is P W + q of the last.
    """
    from scipy.integrate import DOP853
    from scipy.interpolate import CubicSpline

    t, n, u, first = record.t, len(model.states), inputs_of(model, record), model.x0(theta)
    if not n or len(t) == 1:
        return np.broadcast_to(first, (len(t), *first.shape))

    def linear(t: FloatArray, x: FloatArray, u: FloatArray) -> FloatArray:
        """[A B] of dW/dt = A W + B."""
        table = model.f(t, x, theta, u)
        A, B = table[..., 1 : 1 + n], table[..., 1 + n :]
        return np.concatenate([A, table[..., :1] - A @ x[..., None], B], axis=-1)

    def rate(table: FloatArray, z: FloatArray) -> FloatArray:
        rates = table[..., :n] @ z
        rates[..., n:] += table[..., n:]
        return rates

    h, table = np.diff(t)[:, None, None], linear(t, x, u)
    z = np.broadcast_to(np.eye(n, n + first.shape[1]), table[1:].shape)
    if integrator in HEUN:
        z = heun_step(rate, table[:-1], table[1:], z, h, [np.s_[:, i] for i in HEUN[integrator](n)])
    else:
        curve, rates = CubicSpline(t, x), np.zeros((12, *z.shape))
        for j, (weights, c) in enumerate(zip(DOP853.A, DOP853.C, strict=True)):
            times = t[:-1] + c * h[:, 0, 0]
            between = linear(times, curve(times), u[:-1] + c * np.diff(u, axis=0)) if j else table[:-1]
            rates[j] = rate(between, z + h * np.tensordot(weights[:j], rates[:j], 1))
        z = z + h * np.tensordot(DOP853.B, rates, 1)
    W = np.concatenate([first[None], recurrence(z[..., :n], first, z[..., n:])])
    if not np.isfinite(W).all():
        raise SimulationError("the linearised equations have no finite solution; start from another place")
    return W


def linear_rows(
    problem: Problem, theta: FloatArray, states: Sequence[FloatArray], tables: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Rows K (θ − θ_s) = Y of the samples, from states and `linear_solutions` there; M θ = Y is Kᵀ of it."""
    slopes, left = [], []
    parts = zip(problem.models, problem.records, problem.measured, strict=True)
    for (model, record, data), x, W in zip(parts, states, tables, strict=True):
        z = np.concatenate([x[..., None], W[..., 1:], W[..., :1] - x[..., None]], axis=-1)
        table = model.h(record.t, z, theta, inputs_of(model, record))
        left.append(data - table[..., 0] - table[..., -1])
        slopes.append(table[..., 1:-1])
    K, Y = problem.vector(slopes), problem.vector(left)
    if not (np.abs(K).max() < LARGEST and np.abs(Y).max() < LARGEST):
        raise SimulationError("the linearised outputs are beyond all bounds; start from another trajectory")
    return K, Y
