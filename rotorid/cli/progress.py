"""A sign of life on standard error: a spinner on a terminal, a line now and then in a log, else nothing."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rotorid.cli.terminal import dumb

PATIENCE = 1.0
"""Seconds without a sign, on a terminal."""
FIRST_LINE = 10.0
"""Seconds before the first line where there is no terminal; each further line waits twice as long."""
LONGEST_PAUSE = 60.0
"""Seconds between two lines at most."""


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Show what is going on, and for how long, if it takes more than a second.

    On a terminal nothing is left on the screen afterwards. Elsewhere, and on a terminal that cannot move its
    cursor, there is a line after 10 s, and then ever fewer.

    Parameters
    ----------
    what
        What takes so long.
    """
    done = threading.Event()
    show = _spinner if sys.stderr.isatty() and not dumb() else _lines
    thread = threading.Thread(target=show, args=(what, done), daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _lines(what: str, done: threading.Event) -> None:
    """For a log, a pipe, or a terminal that cannot draw."""
    begun, pause = time.perf_counter(), FIRST_LINE
    while not done.wait(pause):
        print(f"rotorid: {what}, {time.perf_counter() - begun:.0f} s so far", file=sys.stderr, flush=True)
        pause = min(2 * pause, LONGEST_PAUSE)


def _spinner(what: str, done: threading.Event) -> None:
    """For a terminal: that it goes on, and the time."""
    if done.wait(PATIENCE):
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        shown.add_task(what, total=None)
        done.wait()
