"""A sign of life on standard error: a bar on a terminal, a line now and then in a log, and else nothing."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rotorid.cli.terminal import dumb

PATIENCE = 1.0
"""Seconds without a sign, on a terminal."""
FIRST_LINE = 10.0
"""Seconds before the first line where there is no terminal; each further line waits twice as long."""
LONGEST_PAUSE = 60.0
"""Seconds between two lines at most."""

Advance = Callable[[], None]
"""Says that one more step is done."""


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
    with steps(what):
        yield


@contextmanager
def steps(what: str, total: int | None = None) -> Iterator[Advance]:
    """As `busy`, for work whose steps can be counted.

    Parameters
    ----------
    what
        What takes so long.
    total
        How many steps there will be; None: not known, the function that is handed out does nothing visible.

    Yields
    ------
    Advance
        To be called after each step.
    """
    done = threading.Event()
    count = _Count(what, total)
    show = _bar if _terminal() else _lines
    thread = threading.Thread(target=show, args=(count, done), daemon=True)
    thread.start()
    try:
        yield count.advance
    finally:
        done.set()
        thread.join()


class _Count:
    """How far the work is; the thread that shows it only reads."""

    def __init__(self, what: str, total: int | None) -> None:
        self.what, self.total, self.done = what, total, 0
        self.begun = time.perf_counter()

    def advance(self) -> None:
        """One more step."""
        self.done += 1

    def line(self) -> str:
        """For a log."""
        far = "" if self.total is None else f", {self.done} of {self.total}"
        return f"rotorid: {self.what}{far}, {time.perf_counter() - self.begun:.0f} s so far"


def _terminal() -> bool:
    return sys.stderr.isatty() and not dumb()


def _lines(count: _Count, done: threading.Event) -> None:
    """For a log, a pipe, or a terminal that cannot draw."""
    pause = FIRST_LINE
    while not done.wait(pause):
        print(count.line(), file=sys.stderr, flush=True)
        pause = min(2 * pause, LONGEST_PAUSE)


def _bar(count: _Count, done: threading.Event) -> None:
    """For a terminal: a spinner, with a bar where the steps are counted, and the time."""
    if done.wait(PATIENCE):
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn
    from rich.progress import TimeElapsedColumn as Elapsed

    counted = [] if count.total is None else [BarColumn(), MofNCompleteColumn()]
    columns = [SpinnerColumn(), TextColumn("{task.description}", markup=False), *counted, Elapsed()]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(count.what, total=count.total)
        while not done.wait(0.1):
            bar.update(task, completed=count.done)
