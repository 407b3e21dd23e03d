"""Names of the old module until this one is written."""

from fem.orbits import DIRECTION_NAMES, orbits

__all__ = ["DIRECTION_NAMES", "orbits"]
