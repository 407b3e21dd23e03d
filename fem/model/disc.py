"""Names of `fem._new.rotor` until the old modules go."""

from fem._new.rotor import STEEL_DENSITY, Disc

__all__ = ["STEEL_DENSITY", "Disc"]
