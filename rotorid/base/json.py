"""Values as JSON types: arrays and tuples become lists, what is not finite becomes null."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """A document of arrays, tuples and numbers, to any depth, as JSON has it.

    >>> plain({"speed_rpm": (3000.0, float("inf")), "stable": np.array([True]), "plane": {"A": 1}})
    {'speed_rpm': [3000.0, None], 'stable': [True], 'plane': {'A': 1}}
    """
    return {key: cell(value) for key, value in values.items()}


def cell(value: Any) -> Any:  # noqa: ANN401  whatever a result holds
    """One value as JSON has it; what is none of its types stays as it is."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return plain(value)
    return [cell(item) for item in value] if isinstance(value, (list, tuple)) else value


def finite(value: float) -> float | None:
    """A plain float, or None where it is not finite."""
    return float(value) if np.isfinite(value) else None


def floats(values: Iterable[float]) -> list[float | None]:
    """A list of plain floats, None where one is not finite."""
    return [finite(value) for value in values]
