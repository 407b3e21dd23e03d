"""Whether two jobs say the same: the proof that a workbook holds all of a job."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rotorid.tables.job.job_data import Job

_NOT_SAID = ("files", "warnings")
"""Where something was read from, and what was said about it."""
_ROUNDED = ("limits", "holes")
"""May have been converted by the command line, whose limits have units of their own."""
_ROUNDING = 4e-16


def differences(a: Job, b: Job) -> tuple[str, ...]:
    """Names of what is not the same in two jobs, such as `trials.readings`, first things first.

    Numbers are the same to the last digit, limits (which the command line may have converted) within
    4e-16 of their size.
    """
    return tuple(_unlike(a, b, ""))


def _unlike(a: Any, b: Any, name: str) -> Iterator[str]:  # noqa: ANN401, C901
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        for field in dataclasses.fields(a):
            if field.name not in _NOT_SAID:
                inner = f"{name}.{field.name}" if name else field.name
                yield from _unlike(getattr(a, field.name), getattr(b, field.name), inner)
    elif isinstance(a, Mapping) and isinstance(b, Mapping):
        if list(a) != list(b):
            yield name
            return
        for key in a:
            yield from _unlike(a[key], b[key], f"{name}.{key}")
    elif isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)):
        if len(a) != len(b):
            yield name
            return
        for k, (one, other) in enumerate(zip(a, b, strict=True), start=1):
            yield from _unlike(one, other, f"{name}[{k}]")
    elif isinstance(a, (np.ndarray, float)) and isinstance(b, (np.ndarray, float)):
        rounding = _ROUNDING if name.startswith(_ROUNDED) else 0.0
        if np.shape(a) != np.shape(b) or not np.allclose(a, b, rtol=rounding, atol=0.0, equal_nan=True):
            yield name
    elif isinstance(a, np.ndarray) or isinstance(b, np.ndarray) or a != b:
        yield name
