"""Names of the old modules until this one is written."""

from fem.mesh import refined
from fem.model.rotor import (
    SHORTEST,
    STEEL_DENSITY,
    STEEL_MODULUS,
    STEEL_POISSON,
    Disc,
    Model,
    Rotor,
    too_short,
)
from fem.model.sensors import Sensor, SensorLike, as_sensor, label
from fem.model.supports import KINDS, Coefficient, Pair, Pedestal, Support

__all__ = [
    "KINDS",
    "SHORTEST",
    "STEEL_DENSITY",
    "STEEL_MODULUS",
    "STEEL_POISSON",
    "Coefficient",
    "Disc",
    "Model",
    "Pair",
    "Pedestal",
    "Rotor",
    "Sensor",
    "SensorLike",
    "Support",
    "as_sensor",
    "label",
    "refined",
    "too_short",
]
