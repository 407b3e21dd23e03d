"""Which times to sample: expected standard deviations, and a D-optimal choice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rotorid.regression.d_optimal import Design, designed
from rotorid.timedomain.integration.simulate import simulate
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record


def design_times(
    model: OdeModel,
    guess: ArrayLike,
    times: ArrayLike,
    n: int,
    *,
    sigma: Mapping[str, float],
    driven_by: Record | None = None,
) -> Design:
    """Choose n of the candidate times so that the parameters come out best (D-optimal).

    Parameters
    ----------
    model, guess
        The model and its parameters (n_p,); the choice is good as far as these are.
    times, sigma
        That could be sampled, s, shape (c,), rising; the standard deviation of a sample of each output.
    driven_by
        A record with the inputs, where the model has any. Its first time is that of the initial values, where
        the model does not say; else they belong to t = 0.

    Raises
    ------
    ValueError
        For times before the initial values or outside the inputs, missing inputs, n out of range.
    SimulationError
        The states diverge.
    """
    t, theta = np.asarray(times, dtype=float), np.asarray(guess, dtype=float)
    if model.inputs and driven_by is None:
        raise ValueError(f"a design needs a record with the input {', '.join(model.inputs)} of the model")
    begin = model.t0 if isinstance(model.t0, float | int) else driven_by.t[0] if driven_by else 0.0
    known = driven_by.t if driven_by and model.inputs else np.array([begin])
    last = known[-1] if model.inputs else np.inf
    if t[0] < begin or t[-1] > last:
        raise ValueError(f"candidate times must lie from {begin:g} to {last:g} s: there the model is known")
    grid = np.union1d(np.append(known, begin), t)
    inputs = {x: np.interp(grid, known, driven_by.inputs[x]) for x in model.inputs} if driven_by else {}
    run = simulate(model, theta, Record(grid, inputs=inputs, name="the design"))
    error = np.array([sigma[name] for name in model.outputs])
    J = run.y_theta[np.searchsorted(grid, t)] / error[:, None]
    return designed(model.parameters, theta, t, J, n, repeat=False, unit="s")
