"""What a simulation cannot do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import FloatArray

if TYPE_CHECKING:
    from rotorid.timedomain.models.ode_model import OdeModel


LARGEST = 1e100
"""States beyond this size (in the units of the model) have diverged."""


class SimulationError(ValueError):
    """A solution that does not exist, or cannot be computed, up to the last time."""


def check_finite(model: OdeModel, t: FloatArray, x: FloatArray, s: FloatArray) -> None:
    """Refuse states (n, n_x) or sensitivities (n, n_x, n_p) that have diverged.

    Raises
    ------
    SimulationError
        Naming the time and the state.
    """
    with np.errstate(all="ignore"):
        bad = np.logical_not(np.abs(x) < LARGEST)
        bad_s = np.logical_not(np.isfinite(s).all(axis=-1))
    if not (bad.any() or bad_s.any()):
        return
    rows = (bad | bad_s).any(axis=1)
    i = int(np.flatnonzero(rows)[0])
    if bad[i].any():
        j = int(np.flatnonzero(bad[i])[0])
        raise diverged(model, float(t[i]), j, f"{x[i, j]:.3g}")
    j = int(np.flatnonzero(bad_s[i])[0])
    raise diverged(model, float(t[i]), j, "not finite in its sensitivity to the parameters")


def diverged(model: OdeModel, time: float, state: int, value: str) -> SimulationError:
    """The error for a state that has left all bounds."""
    return SimulationError(
        f"the solution diverges: at t = {time:.6g} the state {model.states[state]} is {value}; choose other "
        "parameters or bounds"
    )
