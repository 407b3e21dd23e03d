"""Functions of numbers that are compiled by numba where it is installed, and plain Python elsewhere."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from functools import cached_property, update_wrapper
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numpy as np

_F = TypeVar("_F", bound=Callable[..., Any])

COMPILED = find_spec("numba") is not None
"""Whether the extra rotorid[fast] is installed: without it some hundred times slower, the same numbers."""


def compiled(function: _F) -> _F:
    """The function, as machine code from its first call on, where numba is installed; else as it is."""
    return Compiled(function) if COMPILED else function  # type: ignore[return-value, arg-type]


class Compiled:
    """A function that numba compiles at its first call: until then numba is not imported.

    Machine code is kept beside the module for the next start, as long as this function and all that it calls
    are what they were: numba alone looks at the file of the function only, and would go on with old code of
    functions that it takes from other files.

    Parameters
    ----------
    function
        As Python has it, later `py_func`; it may call others of this class by their global names.
    """

    def __init__(self, function: FunctionType) -> None:
        update_wrapper(self, function)
        self.py_func = function

    def __call__(self, *arguments: Any) -> Any:  # noqa: ANN401  as the function has them
        """As the function."""
        return self.machine(*arguments)

    @property
    def uses(self) -> dict[str, Any]:
        """Global names in its body with what they mean."""
        known = self.py_func.__globals__
        return {name: known[name] for name in self.py_func.__code__.co_names if name in known}

    @cached_property
    def machine(self) -> Callable[..., Any]:
        """What numba makes of it."""
        from numba import njit

        function = self.py_func
        called = {name: used.machine for name, used in self.uses.items() if isinstance(used, Compiled)}
        own = FunctionType(function.__code__, {**function.__globals__, **called}, function.__name__)
        update_wrapper(own, function)
        made: Any = njit(cache=True, error_model="numpy")(own)
        made._cache._cache_file._source_stamp = self.stamp
        return made  # type: ignore[no-any-return]

    @cached_property
    def stamp(self) -> str:
        """Digest of the sources of this function and of all that it calls, and of constants in them."""
        digest = hashlib.sha256()
        for each in sorted(
            _reached(self), key=lambda one: (one.py_func.__module__, one.py_func.__qualname__)
        ):
            digest.update(Path(each.py_func.__code__.co_filename).read_bytes())
            for name, value in each.uses.items():
                if isinstance(value, (int, float, complex, tuple, np.ndarray)):
                    digest.update(name.encode() + pickle.dumps(value))
        return digest.hexdigest()


def _reached(first: Compiled) -> Iterator[Compiled]:
    found, left = {id(first)}, [first]
    while left:
        one = left.pop()
        yield one
        for used in one.uses.values():
            if isinstance(used, Compiled) and id(used) not in found:
                found.add(id(used))
                left.append(used)
