"""A sign of life on a terminal: rich's status, with how far long work is; elsewhere nothing."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rotorid.base.logs import progress as log


def plain() -> bool:
    """Whether colours, frames and movement are unwanted: NO_COLOR is set, or the terminal is a dumb one."""
    return bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM", "").lower() in ("dumb", "unknown")


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Show what is going on, and what the work says of how far it is, to the logger `rotorid.progress`."""
    if not sys.stderr.isatty() or plain():
        yield
        return
    from rich.console import Console

    handler = logging.Handler()
    with Console(stderr=True).status(what, refresh_per_second=5) as status:
        handler.emit = lambda record: status.update(f"{what}, {record.getMessage()}")  # type: ignore[method-assign]
        log.setLevel(logging.INFO)
        log.addHandler(handler)
        try:
            yield
        finally:
            log.removeHandler(handler)
