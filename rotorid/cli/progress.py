"""A sign of life on standard error, for whoever waits at a terminal and for nobody else."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

PATIENCE = 1.0  # seconds without a sign


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Show what is going on, and for how long, if it takes more than a second.

    Silent when standard error is not a terminal; nothing is left on the screen afterwards.

    Parameters
    ----------
    what
        What takes so long.
    """
    if not sys.stderr.isatty():
        yield
        return
    shown: list[Progress] = []
    lock, done = threading.Lock(), threading.Event()

    def show() -> None:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        with lock:
            if done.is_set():
                return
            bar = Progress(
                SpinnerColumn(),
                TextColumn("{task.description}"),
                TimeElapsedColumn(),
                console=Console(stderr=True),
                transient=True,
            )
            bar.add_task(what, total=None)
            bar.start()
            shown.append(bar)

    timer = threading.Timer(PATIENCE, show)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        done.set()
        timer.cancel()
        with lock:
            for bar in shown:
                bar.stop()
