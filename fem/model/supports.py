"""Names of `fem._new.rotor` until the old modules go."""

from fem._new.rotor import KINDS, ROUNDED, Coefficient, Pair, Pedestal, Support

__all__ = ["KINDS", "ROUNDED", "Coefficient", "Pair", "Pedestal", "Support"]
