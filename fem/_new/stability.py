"""Names of the old modules until this one is written."""

from fem.growth_check import judge
from fem.windows import Window, within

__all__ = ["Window", "judge", "within"]
