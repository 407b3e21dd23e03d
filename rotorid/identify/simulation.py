"""Simulation of a model over a record's times with its sensitivities: chooses the integrator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray, significant
from rotorid.base.choices import Method, find
from rotorid.identify.adaptive_steps import LARGEST, adaptive
from rotorid.identify.integrators import HEUN, System, exact, stepwise
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.records import Record

STEPWISE = (*HEUN, "rk4")
"""Integrators without error control, of one step from sample to sample."""
INTEGRATORS: tuple[Method[None], ...] = (
    Method("auto", "expm if possible, else lsoda or dop853, whichever is quicker", None),
    Method("expm", "the exact solution of a linear model with constant coefficients", None),
    Method("dop853", "error control, for smooth models", None),
    Method("lsoda", "error control, for stiff models", None),
    Method(
        "taylor",
        "Taylor series, compiled for the model: for long or many fits, with the extra rotorid[fast]",
        None,
    ),
    Method("heun", "one step from sample to sample", None),
    Method(
        "sequential-heun",
        "the scheme of [Q], to repeat its tables: heun, but each state is corrected with those before it in "
        "the model, whose order matters",
        None,
    ),
    Method("rk4", "one step from sample to sample, as [F]", None),
)


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
        Derivatives by the parameters, (n, n_x, n_p) and (n, n_y, n_p); empty without sensitivities.
    integrator
        The one used: "none" without states.
    calls
        Rates that "dop853" or "lsoda" has asked for.
    """

    t: FloatArray
    x: FloatArray
    S: FloatArray
    y: FloatArray
    y_theta: FloatArray
    integrator: str
    calls: int = 0


@np.errstate(all="ignore")  # what is not finite is looked for
def simulate(
    model: OdeModel,
    theta: ArrayLike,
    record: Record | ArrayLike,
    *,
    integrator: str = "auto",
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
    integrator
        One of `INTEGRATORS`.
    rtol
        Relative tolerance of "dop853" and "lsoda"; the absolute one follows the size of each state.
    sensitivities
        Whether to solve for the derivatives too.

    Raises
    ------
    SimulationError
        The solution does not exist up to the last time, or takes too many steps.
    ValueError
        An integrator that does not suit the model, missing inputs.
    """
    find(INTEGRATORS, integrator, "integrator")
    given = record if isinstance(record, Record) else Record(np.asarray(record), name="the times")
    values = np.asarray(theta, dtype=float)
    if values.shape != (len(model.parameters),) or not np.isfinite(values).all():
        raise ValueError(
            f"theta must be {len(model.parameters)} finite numbers ({', '.join(model.parameters)})"
        )
    t, n = given.t, len(model.states)
    system, used = System(model, values, given, sensitivities), "none"
    table = np.zeros((len(t), n, 1 + system.k))
    if integrator in STEPWISE and n:
        table, used = stepwise(system, integrator), integrator
    elif n and (integrator == "expm" or (integrator == "auto" and model.linear_driven)):
        table, used = exact(system), "expm"
    elif n:
        table, used = adaptive(system, rtol, integrator)
    if not -LARGEST < table.min(initial=0.0) <= table.max(initial=0.0) < LARGEST:
        largest = np.append(LARGEST, np.full(system.k, np.inf))
        lost = np.logical_not(np.abs(table) < largest)
        for i, k, j in np.argwhere(lost.swapaxes(1, 2))[:1].tolist():
            value = f"state {model.states[j]}{' or its sensitivity' * (k > 0)} is {table[i, j, k]:.3g}"
            raise SimulationError(
                f"the solution diverges: at t = {t[i]:.6g} the {value}; choose other parameters or bounds"
            )
    seen = model.h(t, table, values, system.u)
    for i, j in np.argwhere(~np.isfinite(seen.sum(axis=-1)))[:1]:
        raise SimulationError(
            f"the output {model.outputs[j]} has no finite value at t = {t[i]:g}; change the parameters or "
            "the output"
        )
    return Trajectory(t, table[..., 0], table[..., 1:], seen[..., 0], seen[..., 1:], used, system.calls)


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
        errors = np.random.default_rng(seed).standard_normal(y.shape)
        y = y + errors * [sigma[name] for name in model.outputs]
    columns = y.T if digits is None else [significant(column, digits) for column in y.T]
    return replace(plan, outputs=dict(zip(model.outputs, columns, strict=True)), sigma=sigma)
