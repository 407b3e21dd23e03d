"""Values as JSON types: arrays and tuples become lists, what is not finite becomes null."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """A document of arrays, tuples and numbers, to any depth, as JSON has it.

    >>> import numpy as np
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
