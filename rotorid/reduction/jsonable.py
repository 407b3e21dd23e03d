"""Numbers as JSON types."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def floats(values: Iterable[float]) -> list[float | None]:
    """Numbers as a list for JSON, None where one is not finite."""
    return [float(value) if np.isfinite(value) else None for value in values]
