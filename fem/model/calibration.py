"""Names of `fem._new.rotor` until the old modules go."""

from fem._new.rotor import Calibration, is_reading

__all__ = ["Calibration", "is_reading"]
