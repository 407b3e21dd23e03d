"""Documents: values as JSON types, the version of their keys, and their date."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

SCHEMA_VERSION = 1
"""Grows when a key or column goes or means something else, not when one is added: see docs/stability.md."""


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """A document of arrays, tuples and numbers, to any depth, as JSON has it; what is not finite is null.

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


def now() -> datetime:
    """The date for what is written, in UTC: that of SOURCE_DATE_EPOCH, if set, so that bytes repeat."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    return datetime.fromtimestamp(int(epoch), UTC) if epoch else datetime.now(UTC)
