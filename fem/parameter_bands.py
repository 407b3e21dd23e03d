"""Names of `fem._new.parameters` until the old modules go."""

from fem._new.parameters import NORMAL_95, band, nearest_modes, spread

__all__ = ["NORMAL_95", "band", "nearest_modes", "spread"]
