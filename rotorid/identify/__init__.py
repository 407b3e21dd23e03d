"""Identification: coefficients of models from harmonic tests, vibration modes and time records."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Package(ModuleType):
    """`rotorid.identify` is a function of the library, too: importing this package must not hide it."""

    def __call__(self, *args: Any, **options: Any) -> Any:  # noqa: ANN401
        return sys.modules["rotorid"].__getattr__("identify")(*args, **options)


sys.modules[__name__].__class__ = _Package
