"""Balancing with a calibrated rotor: coefficients with its errors.

The parameters of the rotor err by L ε with L Lᵀ their covariance and independent real ε; a coefficient by
Σ ∂W/∂θ L ε, the same ε at all speeds and sensors, and by its lack of fit.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing import Gaussian, Trials, with_parameters
from fem import is_reading
from fem.parameters import as_change, parameter_value
from rotorid.calibration import run_errors

if TYPE_CHECKING:
    from balancing import Influence
    from fem import Rotor
    from rotorid.base.arrays import ComplexArray
    from rotorid.calibration import RunReadings
    from rotorid.commands.model_places import ModelPlaces
    from rotorid.files import Job


def calibrated(influence: Influence, job: Job, places: ModelPlaces) -> Influence:
    """Computed coefficients as those of a job's calibrated rotor: at the angles it found, with its errors.

    What changes between runs is as the job states it, else assumed.
    """
    assert job.rotor is not None
    calibration = job.rotor.calibration
    assert calibration is not None
    W, dW = _derivatives(places.of_runs(_bare_run(influence), job.key_phasor), job.rotor)
    columns = np.einsum("nscp,nm->mscp", dW, calibration.columns())
    none = Gaussian.none(*W.shape).noise
    errors = Gaussian(none.blocks[0], none.columns, influence.reading, run_errors(job.trials))
    return with_parameters(
        replace(influence, W=W, errors=errors), columns, np.full(W.shape[:2], calibration.lack_of_fit)
    )


def _bare_run(influence: Influence) -> Trials:
    """One run without weights, to ask for coefficients."""
    S, C, P = influence.W.shape
    return Trials(
        ("bare",),
        influence.speeds,
        influence.sensors,
        influence.planes,
        np.ones((1, S, C), dtype=complex),
        np.zeros((1, P), dtype=complex),
    )


def _derivatives(runs: RunReadings, rotor: Rotor) -> tuple[ComplexArray, ComplexArray]:
    """Coefficients and their derivatives by the calibrated numbers, at these, that act on these sensors."""
    assert rotor.calibration is not None
    names = [as_change(rotor, path) for path in rotor.calibration.names]
    numbers = zip(rotor.calibration.names, rotor.calibration.values.tolist(), strict=True)
    angles = {path: value for path, value in numbers if is_reading(path)}
    paths = dict.fromkeys((*names, *(as_change(rotor, path) for path in angles)))
    values = {path: angles[path] if path in angles else parameter_value(rotor, path) for path in paths}
    return runs.coefficients(rotor, values, names)
