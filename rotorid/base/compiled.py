"""Functions of numbers that are compiled by numba where it is installed, and plain Python elsewhere."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cached_property, update_wrapper
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

_F = TypeVar("_F", bound=Callable[..., Any])

COMPILED = find_spec("numba") is not None
"""Whether the extra rotorid[fast] is installed: without it some hundred times slower, the same numbers."""


def compiled(function: _F) -> _F:
    """The function, as machine code from its first call on, where numba is installed; else as it is."""
    return Compiled(function) if COMPILED else function  # type: ignore[return-value, arg-type]


def compiled_part(function: _F) -> _F:
    """The same for what those call: from Python it runs as Python, since to load numba takes a second."""
    return Compiled(function, alone=False) if COMPILED else function  # type: ignore[return-value, arg-type]


class Compiled:
    """A function that numba compiles at its first call: until then numba is not imported.

    It may call others of this class by their global names; constants stand in the modules of such functions.
    Machine code is kept beside the module for the next start as long as its `stamp` is the same: numba alone
    would look at the file of the function only, and go on with old code of what it takes from other files.
    """

    def __init__(self, function: FunctionType, *, alone: bool = True) -> None:
        update_wrapper(self, function)
        self.py_func, self.alone = function, alone

    def __call__(self, *arguments: Any) -> Any:  # noqa: ANN401  as the function has them
        """As the function."""
        return (self.machine if self.alone else self.py_func)(*arguments)

    @cached_property
    def machine(self) -> Callable[..., Any]:
        """What numba makes of it."""
        from numba import njit

        code, names = self.py_func.__code__, self.py_func.__globals__
        used = {name: names.get(name) for name in code.co_names}
        called = {name: each.machine for name, each in used.items() if isinstance(each, Compiled)}
        linked = FunctionType(code, {**names, **called}, code.co_name)
        made: Any = njit(cache=True, error_model="numpy")(update_wrapper(linked, self.py_func))
        made._cache._cache_file._source_stamp = self.stamp
        return made  # type: ignore[no-any-return]

    @cached_property
    def stamp(self) -> str:
        """Digest of the source of its module, and of those whose functions of this class that one imports."""
        names = self.py_func.__globals__
        imported = {each.py_func.__module__: each for each in names.values() if isinstance(each, Compiled)}
        digest = hashlib.sha256(Path(self.py_func.__code__.co_filename).read_bytes())
        for name in sorted(imported.keys() - {self.py_func.__module__}):
            digest.update(imported[name].stamp.encode())
        return digest.hexdigest()
