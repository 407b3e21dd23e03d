"""Names of the old module until this one is written."""

from fem.windows import Window, ranges, within

__all__ = ["Window", "ranges", "within"]
