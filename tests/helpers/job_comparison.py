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


def _parts(value: object) -> tuple[type, str, Mapping[Any, Any]] | None:
    """Kind, form of the names and parts of what has parts."""
    if dataclasses.is_dataclass(value):
        names = (field.name for field in dataclasses.fields(value) if field.name not in _NOT_SAID)
        return type(value), ".{}", {name: getattr(value, name) for name in names}
    if isinstance(value, Mapping):
        return Mapping, ".{}", value
    if isinstance(value, (tuple, list)):
        return list, "[{}]", dict(enumerate(value, start=1))
    return None


def _unlike(a: object, b: object, name: str) -> Iterator[str]:
    mine, other = _parts(a), _parts(b)
    if mine and other and mine[0] is other[0]:
        _, form, parts = mine
        if list(parts) != list(other[2]):
            yield name
            return
        for key, part in parts.items():
            yield from _unlike(part, other[2][key], (name + form.format(key)).removeprefix("."))
    elif isinstance(a, (np.ndarray, float)) and isinstance(b, (np.ndarray, float)):
        rounding = _ROUNDING if name.startswith(_ROUNDED) else 0.0
        if np.shape(a) != np.shape(b) or not np.allclose(a, b, rtol=rounding, atol=0.0, equal_nan=True):
            yield name
    elif isinstance(a, np.ndarray) or isinstance(b, np.ndarray) or a != b:
        yield name
