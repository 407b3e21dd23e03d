"""Taylor integration of a model with its sensitivities by heyoka, with the extra `rotorid[fast]`.

Compiling takes a second or two, and so a model is compiled whose fits have cost that much the ordinary way.
States and parameters are scaled by their sizes there, and what is compiled has to repeat the last ordinary
solution. Source: Biscani and Izzo, "Revisiting high-order Taylor methods for astrodynamics and celestial
mechanics", MNRAS 504 (2021) 2614.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import FloatArray

if TYPE_CHECKING:
    from rotorid.timedomain.integration.sensitivity_equations import Augmented
    from rotorid.timedomain.models.ode_model import OdeModel

WORK = 20_000
"""Steps of the ordinary way after which a model is compiled."""
TOLERANCE = 1e-12
LARGE = 40
"""States and sensitivities above which the code is smaller and slower: compiling would take long."""
SAME = 1e-7
"""Difference from the ordinary solution, relative to each component, above which it is not used."""
STEPS = 20_000
"""At most; more leave it to the ordinary way to say why."""


@contextmanager
def learning(models: Sequence[OdeModel]) -> Iterator[None]:
    """Count and compile within fits alone: a single simulation does not depend on what went before."""
    for model in models:
        model.machine["fitted"] = True
    try:
        yield
    finally:
        for model in models:
            model.machine["fitted"] = False


def integrate(system: Augmented, x0: FloatArray, s0: FloatArray, longest: float) -> FloatArray | None:
    """States and sensitivities (n, size); None where the model is not compiled, or has no finite solution."""
    machine = system.model.machine
    taylor = machine.get("taylor") if machine.get("fitted") else None
    return None if taylor is None or not system.np else taylor(system, x0, s0, longest)


def learn(system: Augmented, table: FloatArray, steps: int, longest: float) -> None:
    """Count the steps of a fit's ordinary solutions (n, size), and compile the model when they are many."""
    machine = system.model.machine
    if not machine.get("fitted"):
        return
    machine["steps"] = machine.get("steps", 0) + steps
    if machine["steps"] < WORK or "taylor" in machine or not system.np or not system.model.rates_alone:
        return
    machine["taylor"] = None
    x, s = system.unpack(table)
    try:
        made = _Taylor(system.model, np.abs(x).max(axis=0), np.abs(system.theta[: system.np]))
    except (ImportError, TypeError, ValueError, RuntimeError):
        return  # not installed, or a function it does not know
    again = made(system, x[0], s[0], longest)
    size = np.abs(table).max(axis=0)
    if again is not None and (np.abs(again - table).max(axis=0) <= SAME * size).all():
        machine["taylor"] = made


class _Taylor:
    """A compiled model: states over their sizes, derivatives by parameters over theirs."""

    def __init__(self, model: OdeModel, states: FloatArray, parameters: FloatArray) -> None:
        import heyoka as hy
        import sympy

        self.x = np.where(states > 0, states, 1.0)
        self.p = np.where(parameters > 0, parameters, 1.0)
        n, k, nu = len(self.x), len(self.p), len(model.inputs)
        put: dict[Any, Any] = {sympy.Symbol("t"): hy.time}
        for i, name in enumerate(model.states):
            put[sympy.Symbol(name)] = float(self.x[i]) * hy.expression(f"z{i}")
        for i, name in enumerate(model.parameters):
            put[sympy.Symbol(name)] = float(self.p[i]) * hy.par[i]
        for i, name in enumerate(model.inputs):  # straight lines
            put[sympy.Symbol(name)] = hy.par[k + i] + hy.par[k + nu + i] * hy.time
        rates = []
        for i, rate in enumerate(model.rates):
            numbers = {r: sympy.Float(float(r)) for r in rate.atoms(sympy.Rational) if not r.is_Integer}
            whole = hy.from_sympy(rate.xreplace(numbers), put)
            rates.append((hy.expression(f"z{i}"), whole / float(self.x[i])))
        # parameters may stand in initial values and outputs only; heyoka counts up to the last that it sees
        rates[0] = (rates[0][0], rates[0][1] + 1e-300 * hy.par[k + 2 * nu - 1])
        with_slopes = hy.var_ode_sys(rates, [hy.par[i] for i in range(k)], order=1)
        self.solver = hy.taylor_adaptive(
            with_slopes,
            [0.0] * n,
            pars=[0.0] * (k + 2 * nu),
            tol=TOLERANCE,
            compact_mode=n * (1 + k) > LARGE,
            opt_level=1,
        )
        self.done = hy.taylor_outcome.time_limit

    def __call__(
        self, system: Augmented, x0: FloatArray, s0: FloatArray, longest: float
    ) -> FloatArray | None:
        """As `integrate`."""
        solver, t, u, k = self.solver, system.t, system.u, system.np
        slopes = self.p / self.x[:, None]
        solver.time = t[0]
        solver.state[:] = system.pack(x0 / self.x, s0 * slopes)
        solver.pars[:k] = system.theta / self.p
        options = {"max_steps": STEPS, "max_delta_t": longest}
        if not system.model.driven:
            outcome, *_, table = solver.propagate_grid(t, **options)
        else:
            table = np.full((len(t), system.size), np.nan)
            table[0], outcome = solver.state, self.done
            for i, slope in enumerate(np.diff(u, axis=0) / np.diff(t)[:, None]):
                solver.pars[k:] = np.concatenate([u[i] - slope * t[i], slope])
                outcome = solver.propagate_until(t[i + 1], **options)[0]
                if outcome != self.done:
                    break
                table[i + 1] = solver.state
        if outcome != self.done or not np.isfinite(table).all():
            return None
        return np.asarray(table * np.concatenate([self.x, (1 / slopes).ravel()]))
