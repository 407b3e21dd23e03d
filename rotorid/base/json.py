"""Numbers as JSON types: what is not finite becomes null."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def finite(value: float) -> float | None:
    """A plain float, or None where it is not finite."""
    return float(value) if np.isfinite(value) else None


def floats(values: Iterable[float]) -> list[float | None]:
    """A list of plain floats, None where one is not finite."""
    return [finite(value) for value in values]
