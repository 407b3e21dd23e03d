"""Integration with error control, in a bounded number of steps: scipy's, and Taylor series by heyoka.

heyoka belongs to the
extra `rotorid[fast]`; a model is compiled once, which takes up to a second. Source: Biscani and Izzo,
"Revisiting high-order Taylor methods for astrodynamics and celestial mechanics", MNRAS 504 (2021) 2614.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.integrators import System, written_out
from rotorid.identify.ode import OdeModel, SimulationError

LARGEST = 1e100
"""States beyond this size (in the units of the model) have diverged."""
STEPS = {
    "auto": (("dop853", 45_000), ("lsoda", 60_000)),
    "dop853": (("dop853", 150_000),),
    "lsoda": (("lsoda", 60_000), ("dop853", 150_000)),
}
"""What is tried, with so many rates at most, or 150 for each sample; dop853 says why lsoda failed."""
LEVEL = 1e-4
"""Smallest size that counts, relative to the largest."""


def adaptive(system: System, rtol: float, integrator: str) -> tuple[FloatArray, str]:
    """States and sensitivities (n, n_x, 1 + k), and the integrator used.

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
    # with a tenth of the tolerance lsoda keeps it as well as dop853, in less time where rates cost little
    few = not system.model.driven and written_out(system.model, system.k)
    *tries, last = [(name, rtol, most) for name, most in STEPS[integrator]]
    if few and integrator == "auto" and rtol >= 1e-10:
        tries.insert(0, ("lsoda", 0.1 * rtol, 10_000))
    for one in tries:
        with suppress(SimulationError):
            return _solve(system, *one), one[0]
    return _solve(system, *last), last[0]


def worth_compiling(model: OdeModel, calls: int) -> bool:
    """Whether heyoka knows the model, and a fit by solutions of so many rates takes longer than compiling.

    Both were measured: compiling takes as long as a fit whose solutions have 60 size² rates, about.
    """
    size = len(model.states) * (1 + len(model.parameters))
    if 0 < 60 * size**2 <= calls:
        with suppress(ValueError):  # not installed, or not for this model
            return taylor(model) is not None
    return False


def _solve(system: System, name: str, rtol: float, most: int) -> FloatArray:
    """By scipy's "dop853" or "lsoda", with so many rates at most."""
    t, theta = system.t, np.abs(system.theta[: system.k])
    table = np.full((len(t), *system.first.shape), np.nan)
    table[0], system.most = system.first, system.calls + max(most, 150 * len(t))
    # of a sensitivity times its parameter as of the state
    sizes = np.outer(first_sizes(system), [1.0, *1.0 / np.where(theta > 0, theta, 1.0)]).ravel()
    piece, options = _dop853 if name == "dop853" else _lsoda, {"rtol": rtol, "atol": 0.01 * rtol * sizes}
    # inputs have corners at the samples: no step may cross one
    for begin, end in pairwise(range(len(t)) if system.model.driven or len(t) < 2 else (0, len(t) - 1)):
        y = piece(system, t[begin : end + 1], table[begin].ravel(), options)
        table[begin : begin + len(y)] = y.reshape(-1, *system.first.shape)
        if not np.isfinite(table[end]).all():
            break
    return table


def _lsoda(system: System, t: FloatArray, first: FloatArray, options: dict[str, Any]) -> FloatArray:
    """Without Python between the samples."""
    from scipy.integrate import ODEintWarning, odeint

    with warnings.catch_warnings(), suppress(ODEintWarning):
        warnings.simplefilter("error", ODEintWarning)
        y = odeint(system, first, t, tfirst=True, mxstep=10**6, hmax=_longest_step(system), **options)
        if np.abs(y).max() < LARGEST:
            return np.asarray(y)
    raise SimulationError("lsoda leads no further: the solution diverges, or is too stiff")


def _dop853(system: System, t: FloatArray, first: FloatArray, options: dict[str, Any]) -> FloatArray:
    """Up to where no step leads on; the row there has what is lost, the state that changes fastest."""
    from scipy.integrate import solve_ivp

    options |= {"max_step": _longest_step(system), "first_step": t[1] - t[0]}
    steps = solve_ivp(system, t[[0, -1]], first, "DOP853", t[1:], **options).y
    y = np.vstack((first, *np.transpose(steps)))
    if len(y) < len(t):
        last = system.latest.reshape(system.first.shape).copy()
        x, size = last[:, 0], np.abs(system(t[len(y)], last)[:, 0])
        rates = size / np.maximum(np.abs(x), 1e-300) + 0 * x  # no number where x is infinite
        x[np.argmax(rates)] = np.inf
        y = np.vstack((y, last.ravel()))
    return y


def _longest_step(system: System) -> float:
    """Of a model that depends on the time itself: a pulse must not be stepped over."""
    t = system.t
    if not system.model.timed or len(t) < 2:
        return np.inf
    return max(float(np.diff(t).min()), float(t[-1] - t[0]) / 1000)


def first_sizes(system: System) -> FloatArray:
    """Sizes of the states, (n_x,): of the initial values, and of their changes in one sample."""
    t, x, model = system.t, system.first[:, 0], system.model
    # at rest now, a model may be driven later
    rates = np.abs(model.f(t, x, system.theta, system.u)[..., 0])
    fastest = np.max(rates, axis=0, where=np.isfinite(rates), initial=0.0)
    sizes = np.abs(x) + fastest * float(t[-1] - t[0]) / max(1, len(t) - 1)
    return np.asarray(np.maximum(sizes, LEVEL * (sizes.max() or 1.0)))


@lru_cache(maxsize=8)
def taylor(model: OdeModel) -> Callable[[System], FloatArray | None]:
    """A compiled model: it gives states and sensitivities, or None without a finite solution.

    States are divided by their sizes, derivatives by parameters by theirs. Sizes are parameters of the code,
    so that it does not depend on what was solved before.
    """
    try:
        import heyoka as hy
    except ImportError as error:
        raise ValueError("the integrator taylor needs heyoka: pip install heyoka numba") from error
    n, k, nu = len(model.states), len(model.parameters), len(model.inputs)
    # parameters over their sizes and these, inputs as straight lines, sizes of the states
    theta, size, level, slope, of_x = np.split(
        np.array([hy.par[i] for i in range(2 * (k + nu) + n)]), np.cumsum([k, k, nu, nu])
    )
    z = [hy.expression(f"z{i}") for i in range(n)]
    quantities = [hy.time, *of_x * z, *size * theta, *level + slope * hy.time]
    put = dict(zip(model.symbols, quantities, strict=True))
    try:
        if model.inertia:
            raise ValueError("a mass matrix is solved numerically")
        # heyoka takes no fractions but floats
        rates = [
            e.replace(lambda x: x.is_Rational and not x.is_Integer, lambda x: x.evalf()) for e in model.rates
        ]
        rates = [hy.from_sympy(e, put) for e in rates] / of_x
        # parameters may stand in initial values and outputs only; heyoka counts up to the last it sees
        rates[0] += 1e-300 * of_x[-1]
        solver = hy.taylor_adaptive(
            hy.var_ode_sys([*zip(z, rates, strict=True)], [*theta], order=1),
            [0.0] * n,
            pars=[0.0] * (2 * (k + nu) + n),
            tol=1e-12,
            compact_mode=n * (1 + k) > 40,  # smaller code, quicker to compile
            opt_level=1,
        )
    except (TypeError, ValueError, RuntimeError) as error:
        raise ValueError(f"the integrator taylor cannot compile this model ({error}); use auto") from error

    def solve(system: System) -> FloatArray | None:
        t, u, values = system.t, system.u, system.theta
        whole = system if system.k else System(model, values, system.record, True)
        x, p = first_sizes(whole)[:, None], np.where(values == 0, 1.0, np.abs(values))
        scale, options = x / [1.0, *p], {"max_steps": 20_000, "max_delta_t": _longest_step(system)}

        def flat(table: FloatArray) -> FloatArray:
            return np.append(table[:, 0], table[:, 1:])

        solver.time, solver.state[:] = t[0], flat(whole.first / scale)
        solver.pars[:] = np.concatenate([values / p, p, np.zeros(2 * nu), x[:, 0]])
        if not model.driven:
            table = solver.propagate_grid(t, **options)[-1]
        else:
            table = np.full((len(t), scale.size), np.nan)
            table[0] = solver.state
            for i, slopes in enumerate(np.diff(u, axis=0) / np.diff(t)[:, None]):
                solver.pars[2 * k : 2 * (k + nu)] = np.concatenate([u[i] - slopes * t[i], slopes])
                solver.propagate_until(t[i + 1], **options)
                table[i + 1] = solver.state if solver.time == t[i + 1] else np.nan
        if len(table) < len(t) or not np.isfinite(table).all():
            return None
        S = table[:, n:].reshape(-1, n, k)
        return np.asarray(np.concatenate([table[:, :n, None], S], axis=2) * scale)[..., : 1 + system.k]

    return solve
