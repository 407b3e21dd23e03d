"""Design of experiments: which frequencies to measure, as `rotorid.regression.d_optimal` chooses them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.identify.amplitude_residuals import compare
from rotorid.identify.amplitudes import AmplitudeErrors
from rotorid.identify.direct_problem import forced_vibration
from rotorid.identify.operator_model import HarmonicModel
from rotorid.regression.d_optimal import Design, designed


def design(
    model: HarmonicModel,
    guess: Mapping[str, float],
    candidates: ArrayLike,
    n: int,
    *,
    errors: AmplitudeErrors,
    inputs: Mapping[str, complex] | None = None,
    measured: Sequence[str] | None = None,
    repeat: bool = False,
) -> Design:
    """Choose n of the candidate frequencies so that the parameters come out best (D-optimal).

    Parameters
    ----------
    model
        With as many equations as outputs.
    guess
        A value of every parameter; the choice is good as far as these are.
    candidates
        Frequencies that could be measured, rad/s, shape (c,).
    n
        How many shall be.
    errors
        Of the readings.
    inputs
        Amplitude of each input signal, at all frequencies.
    measured
        Outputs with a sensor; default all.
    repeat
        Whether a frequency may be measured several times.

    Returns
    -------
    Design
        From a greedy choice improved by exchanges until none helps.

    Raises
    ------
    ValueError
        For missing guesses or inputs, unknown sensors, n out of range, candidates at an undamped resonance.
    """
    w = np.asarray(candidates, dtype=np.float64)
    if w.ndim != 1 or not len(w) or not np.isfinite(w).all() or (w < 0).any():
        raise ValueError("the candidate frequencies must be a list of finite numbers, not negative")
    missing = [name for name in model.parameters if name not in guess]
    if missing:
        raise ValueError(f"guess a value of {', '.join(missing)}")
    theta = np.array([guess[name] for name in model.parameters], dtype=np.float64)
    J = _sensitivities(model, theta, w, errors, inputs or {}, measured)
    return designed(model.parameters, theta, w, J, n, repeat, "rad/s")


def _sensitivities(
    model: HarmonicModel,
    theta: FloatArray,
    w: FloatArray,
    errors: AmplitudeErrors,
    inputs: Mapping[str, complex],
    measured: Sequence[str] | None,
) -> FloatArray:
    """Derivatives of amplitudes over errors, (c, 2·sensors, n)."""
    model.check_square()
    sensors = tuple(model.outputs if measured is None else measured)
    for name in sensors:
        if name not in model.outputs:
            raise ValueError(f"{name} is no output; those are {', '.join(model.outputs)}")
    if model.varying:
        raise ValueError(f"a design needs {', '.join(model.varying)} known, not changing from row to row")
    lost = [name for name in model.inputs if name not in inputs]
    if lost or not sensors:
        raise ValueError(f"give the amplitude of {', '.join(lost)}" if lost else "no output has a sensor")
    exact = forced_vibration(model, theta, w.tolist(), inputs)
    read = {name: exact.signals[name] for name in (*model.inputs, *sensors)}
    plan = replace(exact, signals=read, errors=errors)
    J = compare(model, plan).jacobian(theta)
    return J.reshape(len(w), 2 * len(sensors), len(theta))
