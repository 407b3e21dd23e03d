"""Integration with error control, of states and sensitivities, in a bounded number of steps."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.timedomain.integration import taylor
from rotorid.timedomain.integration.sensitivity_equations import Augmented
from rotorid.timedomain.models.simulation_errors import LARGEST, SimulationError, diverged

MAX_STEPS = {"dop853": 10_000, "lsoda": 30_000}
"""Steps between the first and the last time (more samples than a tenth of this allow ten each)."""
TRIAL_STEPS = 3_000
"""Steps of dop853 after which "auto" takes a model for stiff (more samples allow four each)."""
SMALL = 0.1
"""Absolute tolerance of a state, as a share of rtol times its largest size so far."""


class _TooManySteps(SimulationError):
    pass


def integrate(
    system: Augmented,
    x0: FloatArray,
    s0: FloatArray,
    rtol: float,
    method: str = "auto",
) -> tuple[FloatArray, FloatArray, str]:
    """States (n, n_x), sensitivities (n, n_x, n_p) and the method used ("dop853" or "lsoda").

    Parameters
    ----------
    system
        With the times.
    x0, s0
        Initial states and sensitivities.
    rtol
        Relative tolerance; the absolute one follows the size of each state and sensitivity.
    method
        "auto", "dop853" or "lsoda".

    Raises
    ------
    SimulationError
        Divergence, or too many steps.
    """
    if not 1e-14 < rtol < 1:
        raise ValueError(f"rtol must be between 1e-14 and 1, not {rtol:g}")
    z0, n = system.pack(x0, s0), len(system.t)
    if method == "auto":
        usual = rtol >= taylor.TOLERANCE
        quick = taylor.integrate(system, x0, s0, longest_step(system)) if usual else None
        if quick is not None:
            return *system.unpack(quick), "taylor"
        try:
            return *_solve(system, z0, "dop853", rtol, max(TRIAL_STEPS, 4 * n)), "dop853"
        except _TooManySteps:
            method = "lsoda"
    return *_solve(system, z0, method, rtol, max(MAX_STEPS[method], 10 * n)), method


def _solve(
    system: Augmented, z0: FloatArray, method: str, rtol: float, budget: int
) -> tuple[FloatArray, FloatArray]:
    t = system.t
    table = np.empty((len(t), system.size))
    table[0] = z0
    # inputs have corners at the samples: no step may cross one
    ends = list(range(1, len(t))) if system.model.driven else [len(t) - 1] if len(t) > 1 else []
    first, begin, steps_left = None, 0, budget
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what lsoda would warn of is raised as an error
        scale = _first_scale(system, z0)
        for end in ends:
            steps, first = _segment(system, table, begin, end, method, rtol, scale, first, budget)
            budget -= steps
            begin = end
    if method == "dop853":
        taylor.learn(system, table, steps_left - budget, longest_step(system))
    return system.unpack(table)


def _segment(  # noqa: PLR0913
    system: Augmented,
    table: FloatArray,
    begin: int,
    end: int,
    method: str,
    rtol: float,
    scale: FloatArray,
    first: float | None,
    budget: int,
) -> tuple[int, float]:
    """Fill rows begin + 1 … end; the number of steps, and the size of the last full one."""
    t, span = system.t, float(system.t[end] - system.t[begin])
    first = None if first is None else min(first, span)
    limits = _atol(system, scale if method == "dop853" else _levelled(system, scale), rtol)
    options = {"rtol": rtol, "atol": limits, "first_step": first, "max_step": longest_step(system)}
    solver = _solver(system, method, (float(t[begin]), table[begin], float(t[end])), options)
    row, steps, longest = begin + 1, 0, 0.0
    while row <= end:
        if steps >= budget:
            raise _TooManySteps(
                f"{method} needs too many steps: it has come to t = {solver.t:.6g} only; choose other "
                f"parameters or bounds{', or lsoda (stiff models)' if method == 'dop853' else ''}"
            )
        steps += 1
        solver.step()
        _check(system, solver)
        longest = max(longest, float(solver.step_size))
        upto = int(np.searchsorted(t, solver.t, side="right"))
        upto = min(upto, end + 1) if solver.status == "running" else end + 1
        if upto > row:
            if upto == row + 1 and t[row] == solver.t:
                table[row] = solver.y
            else:
                table[row:upto] = solver.dense_output()(t[row:upto]).T
                if solver.status != "running":
                    table[end] = solver.y
            row = upto
        np.maximum(scale, np.abs(solver.y), out=scale)
        if method == "dop853":  # lsoda keeps its own copy
            solver.atol = _atol(system, scale, rtol)
    return steps, longest


def longest_step(system: Augmented) -> float:
    """Of a model that depends on the time itself: a pulse must not be stepped over."""
    t = system.t
    return shortest_pulse(t) if system.model.timed and len(t) > 1 else np.inf


def shortest_pulse(t: FloatArray) -> float:
    """That is not stepped over, s."""
    return max(float(np.diff(t).min()), float(t[-1] - t[0]) / 1000)


def _solver(
    system: Augmented, method: str, problem: tuple[float, FloatArray, float], options: dict[str, Any]
) -> Any:  # noqa: ANN401  scipy has no types
    """Scipy's, for the first time, the states there and the last time."""
    from scipy.integrate import DOP853, LSODA

    if method == "lsoda":
        return LSODA(system, *problem, **options, jac=system.jacobian)
    solver = DOP853(system, *problem, **options)
    if not np.isfinite(solver.h_abs):  # of rates that are not finite; it would be tried for ever
        solver.h_abs = 1e-6 * (problem[2] - problem[0])
    return solver


def _atol(system: Augmented, scale: FloatArray, rtol: float) -> FloatArray:
    """Absolute tolerances (size,), after the sizes of states and sensitivities."""
    x, s = system.unpack(scale[None])
    # below rounding of the largest there is nothing to control
    sizes = np.maximum(SMALL * rtol * x[0], 1e-16 * x[0].max())
    least = 1e-6 * SMALL * rtol * _per_parameter(system, float(x[0].max()))
    slopes = np.maximum(SMALL * rtol * s[0], np.maximum(least, 1e-16 * s[0].max(axis=0, initial=0.0)))
    return np.asarray(np.maximum(system.pack(sizes, slopes), 1e-300))


def _first_scale(system: Augmented, z0: FloatArray) -> FloatArray:
    """Sizes to begin with, (size,): of the initial values, and of their changes in one sample."""
    t, n = system.t, system.nx
    step = float(t[-1] - t[0]) / max(1, len(t) - 1)
    rates = np.abs(system(float(t[0]), z0))
    # at rest now, a model may be driven later
    later = np.abs(system.model.f(t, z0[:n], system.theta, system.u))
    rates[:n] = np.max(later, axis=0, where=np.isfinite(later), initial=0.0)
    return np.asarray(np.abs(z0) + step * np.where(np.isfinite(rates), rates, 0.0))


def _levelled(system: Augmented, scale: FloatArray) -> FloatArray:
    """Sizes for tolerances that cannot be changed on the way: at least a thousandth of the largest."""
    x, s = system.unpack(scale[None])
    most = float(x[0].max()) or 1.0  # all zero: at rest
    largest = np.maximum(s[0].max(axis=0, initial=0.0), 1e-3 * _per_parameter(system, most))
    return system.pack(np.maximum(x[0], 1e-3 * most), np.maximum(s[0], 1e-3 * largest))


def _per_parameter(system: Augmented, value: float) -> FloatArray:
    """A size of the states per size of each parameter, (n_p,)."""
    theta = np.abs(system.theta[: system.np])
    return np.asarray(value / np.where(theta > 0, theta, 1.0))


def _check(system: Augmented, solver: Any) -> None:  # noqa: ANN401
    """Refuse a step that failed or left all bounds."""
    n = system.nx
    y = np.asarray(solver.y)
    size = np.abs(y[:n])
    if solver.status != "failed" and np.isfinite(y).all() and size.max() < LARGEST:
        return
    time = float(solver.t)
    if not np.isfinite(size).all() or size.max() >= LARGEST:
        state = int(np.argmax(~(size < LARGEST)))
        raise diverged(system.model, time, state, f"{y[state]:.3g}")
    # steps have become too small: the state that changes fastest for its size
    rates = np.abs(system(time, y)[:n]) / np.maximum(size, 1e-300)
    rates[~np.isfinite(rates)] = np.inf
    state = int(np.argmax(rates))
    raise diverged(system.model, time, state, f"{y[state]:.3g} and no step leads on")
