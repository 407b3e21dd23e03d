"""What the terminal can show, and what its user wants: colours, frames, movement."""

from __future__ import annotations

import os
from typing import Literal


def dumb() -> bool:
    """Whether the terminal says that it knows no escape codes, so that nothing can move on it."""
    return os.environ.get("TERM", "").lower() in ("dumb", "unknown")


def plain() -> bool:
    """Whether colours and frames are unwanted: NO_COLOR is set, or the terminal is a dumb one."""
    return bool(os.environ.get("NO_COLOR")) or dumb()


def markup_mode() -> Literal["rich"] | None:
    """How typer prints help and complaints: with rich, or as plain text without any escape code."""
    return None if plain() else "rich"
