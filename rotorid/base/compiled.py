"""Functions of numbers that are compiled by numba where it is installed, and plain Python elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

_F = TypeVar("_F", bound=Callable[..., Any])

try:
    from numba import njit
except ImportError:  # the extra rotorid[fast] is not installed: some hundred times slower, the same numbers
    COMPILED = False

    def compiled(function: _F) -> _F:
        """The function as it is."""
        return function

else:
    COMPILED = True

    def compiled(function: _F) -> _F:
        """The function as machine code, kept beside its module for the next start."""
        made: Any = njit(cache=True, error_model="numpy")(function)
        return made  # type: ignore[no-any-return]
