"""Names of the old modules until this one is written."""

from fem.growth_check import judge
from fem.windows import Window, within

Window.sentence = Window.said  # type: ignore[attr-defined]

__all__ = ["Window", "judge", "within"]
