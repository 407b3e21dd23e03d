"""Where output error begins."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.harmonic.comparison import Comparison
from rotorid.regression.nonlinear import Bounds, nonlinear_least_squares


def starting_values(
    start: Mapping[str, float] | ArrayLike, comparison: Comparison, bounds: Bounds | None
) -> FloatArray:
    """Starting values; those not given make the equations hold best for the measured amplitudes.

    Parameters
    ----------
    start
        By name, or (n,) in the model's order; NaN where there is none.
    comparison
        Model and data.
    bounds
        By name.

    Returns
    -------
    Shape (n,).

    Raises
    ------
    ValueError
        For unknown names, a wrong number of values, or where no experiment has every amplitude.
    """
    names = comparison.operator.parameters
    if isinstance(start, Mapping):
        wrong = [name for name in start if name not in names]
        if wrong:
            raise ValueError(f"a start is given for {wrong[0]!r}, which is not estimated: {', '.join(names)}")
        values = np.array([start.get(name, np.nan) for name in names], dtype=np.float64)
    else:
        values = np.array(start, dtype=np.float64)
    if values.shape != (len(names),):
        raise ValueError(f"{len(names)} starting values are needed, for {', '.join(names)}; got {start!r}")
    open_ = np.flatnonzero(np.isnan(values))
    if not len(open_):
        return values
    # no two alike, none 0 or 1: products of parameters have saddles there
    values[open_] = 0.35 + 0.1 * np.arange(len(open_))
    equations = comparison.equations()
    if not len(equations(values)[0]):
        missing = ", ".join(names[i] for i in open_)
        raise ValueError(f"no experiment has every amplitude: give starting values of {missing}")
    limits = {names[i]: bounds[names[i]] for i in open_ if bounds and names[i] in bounds}

    def whole(part: FloatArray) -> FloatArray:
        theta = values.copy()
        theta[open_] = part
        return theta

    found = nonlinear_least_squares(
        lambda part: equations(whole(part))[0],
        lambda part: equations(whole(part))[1][:, open_],
        values[open_],
        names=[names[i] for i in open_],
        sigma_stated=False,
        bounds=limits,
    )
    return whole(found.estimate.solution)
