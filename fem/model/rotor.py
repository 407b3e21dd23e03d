"""Names of `fem._new.rotor` until the old modules go."""

from fem._new.rotor import (
    PER_ELEMENT,
    SHORTEST,
    STEEL_DENSITY,
    STEEL_MODULUS,
    STEEL_POISSON,
    Disc,
    Model,
    Pedestal,
    Rotor,
    Support,
    too_short,
)
from rotorid.base.arrays import FloatArray
from rotorid.base.checks import whole

__all__ = ["PER_ELEMENT", "SHORTEST", "STEEL_DENSITY", "STEEL_MODULUS", "STEEL_POISSON"]
__all__ += ["Disc", "FloatArray", "Model", "Pedestal", "Rotor", "Support", "too_short", "whole"]
