"""Integration with error control, in a bounded number of steps: scipy's, and Taylor series by heyoka.

Absolute tolerances follow the size that each state and sensitivity has had so far. heyoka belongs to the
extra `rotorid[fast]`; a model is compiled once, which takes up to a second. Source: Biscani and Izzo,
"Revisiting high-order Taylor methods for astrodynamics and celestial mechanics", MNRAS 504 (2021) 2614.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache
from importlib.util import find_spec
from itertools import pairwise
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.integrators import System
from rotorid.identify.ode import OdeModel, SimulationError

LARGEST = 1e100
"""States beyond this size (in the units of the model) have diverged."""
STEPS = {
    "auto": (("dop853", 3_000, 4), ("lsoda", 30_000, 10)),
    "dop853": (("dop853", 10_000, 10),),
    "lsoda": (("lsoda", 30_000, 10),),
}
"""What is tried, with so many steps at most, or so many for each sample; then a model is stiff for dop853."""
LEVEL = 1e-4
"""Smallest size that counts, relative to the largest."""


def adaptive(system: System, rtol: float, integrator: str) -> tuple[FloatArray, str]:
    """States and sensitivities (n, size), and the integrator used.

    Parameters
    ----------
    system
        With times and initial values.
    rtol
        Relative tolerance.
    integrator
        "auto", "dop853", "lsoda" or "taylor".

    Raises
    ------
    SimulationError
        Divergence, or too many steps.
    """
    if not 1e-14 < rtol < 1:
        raise ValueError(f"rtol must be between 1e-14 and 1, not {rtol:g}")
    if integrator == "taylor":
        table = taylor(system.model)(system)
        if table is not None:
            return table, "taylor"
        integrator = "dop853"  # says why
    t, name, reached = system.t, "", 0.0
    for name, most, each in STEPS[integrator]:
        table, reached = _solve(system, name, rtol, max(most, each * len(t)))
        if reached == t[-1]:
            return table, name
    raise SimulationError(
        f"{name} needs too many steps: it has come to t = {reached:.6g} only, of {t[-1]:.6g} s. Are the "
        "times in seconds, and not in ms? Choose other parameters or bounds, or lsoda (stiff models)"
    )


def worth_compiling(model: OdeModel, steps: int) -> bool:
    """Whether heyoka knows the model, and a fit by solutions of so many steps takes longer than compiling.

    Both were measured: compiling takes as long as a fit whose solutions have size² steps, about.
    """
    size = len(model.states) * (1 + len(model.parameters))
    if not 0 < size**2 <= steps or find_spec("heyoka") is None:
        return False
    try:
        taylor(model)
    except ValueError:
        return False
    return True


def diverged(model: OdeModel, time: float, state: int, value: str) -> SimulationError:
    """The error for a state that has left all bounds."""
    return SimulationError(
        f"the solution diverges: at t = {time:.6g} the state {model.states[state]} is {value}; choose other "
        "parameters or bounds"
    )


def _solve(system: System, name: str, rtol: float, most: int) -> tuple[FloatArray, float]:
    """By scipy's "dop853" or "lsoda", and the time that it comes to in so many steps at most."""
    from scipy.integrate import DOP853, LSODA

    t, sizes, last = system.t, first_sizes(system), 0.0
    table = np.full((len(t), len(sizes)), np.nan)
    table[0] = system.first
    options: dict[str, Any] = {"rtol": rtol, "max_step": _longest_step(system)}
    solver_type: Any = LSODA if name == "lsoda" else DOP853
    # inputs have corners at the samples: no step may cross one
    corners = range(len(t)) if system.model.driven or len(t) < 2 else (0, len(t) - 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what lsoda would warn of is raised as an error
        for begin, end in pairwise(corners):
            first = min(last, float(t[end] - t[begin])) or None
            limits, row, last = _tolerances(system, sizes, rtol), begin + 1, 0.0
            solver = solver_type(
                system, float(t[begin]), table[begin], float(t[end]), first_step=first, atol=limits, **options
            )
            if not np.isfinite(getattr(solver, "h_abs", 0.0)):  # of rates that are not finite
                solver.h_abs = 1e-6 * (t[end] - t[begin])
            while row <= end:
                if not most:
                    return table, solver.t
                most, system.steps = most - 1, system.steps + 1
                solver.step()
                _check(system, solver)
                last = max(last, solver.step_size)
                done = solver.status == "finished"
                upto = end + 1 if done else int(np.searchsorted(t[: end + 1], solver.t, side="right"))
                if upto > row:
                    table[row:upto] = solver.dense_output()(t[row:upto]).T
                row, now = upto, np.abs(solver.y)
                if (now > sizes).any():
                    sizes = np.maximum(now, sizes)
                    solver.atol = _tolerances(system, sizes, rtol)
    return table, float(t[-1])


def _longest_step(system: System) -> float:
    """Of a model that depends on the time itself: a pulse must not be stepped over."""
    t = system.t
    if not system.model.timed or len(t) < 2:
        return np.inf
    return max(float(np.diff(t).min()), float(t[-1] - t[0]) / 1000)


def first_sizes(system: System) -> FloatArray:
    """Sizes to begin with, (size,): of the initial values, and of their changes in one sample."""
    t, n, z = system.t, system.nx, system.first
    rates = np.abs(system(float(t[0]), z))
    # at rest now, a model may be driven later
    later = np.abs(system.model.f(t, z[:n], system.theta, system.u)[..., 0])
    rates[:n] = np.max(later, axis=0, where=np.isfinite(later), initial=0.0)
    step = float(t[-1] - t[0]) / max(1, len(t) - 1)
    return np.asarray(np.abs(z) + step * np.where(np.isfinite(rates), rates, 0.0))


def _tolerances(system: System, sizes: FloatArray, rtol: float) -> FloatArray:
    """Absolute tolerances (size,): a tenth of rtol times the sizes of states and sensitivities."""
    x, s = sizes[: system.nx], sizes[system.nx :].reshape(system.nx, system.np)
    most = float(x.max()) or 1.0  # all zero: at rest
    theta = np.abs(system.theta[: system.np])
    least = np.maximum(LEVEL * s.max(axis=0, initial=0.0), 1e-6 * most / np.where(theta > 0, theta, 1.0))
    floors = np.concatenate([np.full(len(x), LEVEL * most), np.tile(least, len(x))])
    return np.asarray(np.maximum(0.1 * rtol * np.maximum(sizes, floors), 1e-300))


def _check(system: System, solver: Any) -> None:  # noqa: ANN401  scipy has no types
    """Refuse a step that failed or left all bounds."""
    y, n, more = np.asarray(solver.y), system.nx, ""
    size = np.abs(y[:n])
    lost = ~(size < LARGEST)
    if not lost.any():
        if solver.status != "failed" and np.isfinite(y).all():
            return
        # steps have become too small: the state that changes fastest for its size
        rates = np.abs(system(solver.t, y)[:n]) / np.maximum(size, 1e-300)
        lost, more = np.where(np.isfinite(rates), rates, np.inf), " and no step leads on"
    state = int(np.argmax(lost))
    raise diverged(system.model, solver.t, state, f"{y[state]:.3g}{more}")


@lru_cache(maxsize=8)
def taylor(model: OdeModel) -> Callable[[System], FloatArray | None]:
    """A compiled model: it gives states and sensitivities (n, size), or None without a finite solution.

    States are divided by their sizes, derivatives by parameters by theirs. Sizes are parameters of the code,
    so that it does not depend on what was solved before.
    """
    try:
        import heyoka as hy
    except ImportError as error:
        raise ValueError("the integrator taylor needs the extra: pip install rotorid[fast]") from error
    import sympy

    n, k, nu = len(model.states), len(model.parameters), len(model.inputs)
    par = [hy.par[i] for i in range(2 * k + 2 * nu + n)]
    sizes, states = par[2 * k + 2 * nu :], [hy.expression(f"z{i}") for i in range(n)]
    quantities = [hy.time, *(size * z for size, z in zip(sizes, states, strict=True))]
    quantities += [par[k + i] * par[i] for i in range(k)]
    quantities += [par[2 * k + i] + par[2 * k + nu + i] * hy.time for i in range(nu)]  # straight lines
    put = dict(zip(model.symbols, quantities, strict=True))
    try:
        if model.inertia:
            raise ValueError("a mass matrix is solved numerically")
        rates = []
        for z, size, rate in zip(states, sizes, model.rates, strict=True):
            numbers = {r: sympy.Float(float(r)) for r in rate.atoms(sympy.Rational) if not r.is_Integer}
            rates.append((z, hy.from_sympy(rate.xreplace(numbers), put) / size))
        # parameters may stand in initial values and outputs only; heyoka counts up to the last it sees
        rates[0] = (rates[0][0], rates[0][1] + 1e-300 * par[-1])
        solver = hy.taylor_adaptive(
            hy.var_ode_sys(rates, par[:k], order=1),
            [0.0] * n,
            pars=[0.0] * len(par),
            tol=1e-12,
            compact_mode=n * (1 + k) > 40,  # smaller code, quicker to compile
            opt_level=1,
        )
    except (TypeError, ValueError, RuntimeError) as error:
        raise ValueError(f"the integrator taylor cannot compile this model ({error}); use auto") from error

    def solve(system: System) -> FloatArray | None:
        t, u, theta = system.t, system.u, system.theta
        whole = system if system.np else System(model, theta, t, u, True)
        x, p = first_sizes(whole)[:n], np.abs(theta)
        x, p = np.where(x > 0, x, 1.0), np.where(p > 0, p, 1.0)
        scale = np.concatenate([x, (x[:, None] / p).ravel()])
        table = np.full((len(t), len(scale)), np.nan)
        solver.time, solver.state[:] = t[0], whole.first / scale
        solver.pars[:] = np.concatenate([theta / p, p, np.zeros(2 * nu), x])
        options = {"max_steps": 20_000, "max_delta_t": _longest_step(system)}
        if not model.driven:
            table = solver.propagate_grid(t, **options)[-1]
        else:
            table[0] = solver.state
            for i, slope in enumerate(np.diff(u, axis=0) / np.diff(t)[:, None]):
                solver.pars[2 * k : 2 * (k + nu)] = np.concatenate([u[i] - slope * t[i], slope])
                solver.propagate_until(t[i + 1], **options)
                table[i + 1] = solver.state if solver.time == t[i + 1] else np.nan
        usable = len(table) == len(t) and np.isfinite(table).all()
        return np.asarray(table * scale)[:, : len(system.first)] if usable else None

    return solve
