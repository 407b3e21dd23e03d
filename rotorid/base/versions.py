"""What documents and files that are written say about themselves: the version of their keys, and a date."""

from __future__ import annotations

import os
from datetime import UTC, datetime

SCHEMA_VERSION = 1
"""Grows when a key or column goes or means something else, not when one is added: see docs/stability.md."""


def now() -> datetime:
    """The date for what is written, in UTC: that of SOURCE_DATE_EPOCH where it is set, so that bytes repeat.

    Raises
    ------
    ValueError
        Where the variable is no number of seconds.
    """
    said = os.environ.get("SOURCE_DATE_EPOCH")
    try:
        return datetime.now(UTC) if not said else datetime.fromtimestamp(int(said), UTC)
    except (ValueError, OverflowError, OSError):
        raise ValueError(f"SOURCE_DATE_EPOCH takes whole seconds since 1970, not {said!r}") from None
