"""Names of the old modules until this one is written."""

from fem.model.calibration import Calibration, is_reading
from fem.model.rotor_parameters import (
    as_change,
    as_they_stand,
    expand,
    numbers_of,
    parameter_value,
    typical_size,
    with_changes,
    with_parameters,
)
from fem.parameter_bands import band, nearest_modes, spread

__all__ = [
    "Calibration",
    "as_change",
    "as_they_stand",
    "band",
    "expand",
    "is_reading",
    "nearest_modes",
    "numbers_of",
    "parameter_value",
    "spread",
    "typical_size",
    "with_changes",
    "with_parameters",
]
