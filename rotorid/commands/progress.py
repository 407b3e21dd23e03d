"""A sign of life on standard error: a spinner on a terminal, a line now and then in a log, else nothing."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rotorid.base.logs import progress as log
from rotorid.commands.terminal import dumb

PATIENCE = 1.0
"""Seconds without a sign, on a terminal."""
REDRAWN = 0.2
"""Seconds after which the stage is shown anew."""
FIRST_LINE = 10.0
"""Seconds before the first line where there is no terminal; each further line waits twice as long."""
LONGEST_PAUSE = 60.0
"""Seconds between two lines at most."""


class _Stage(logging.Handler):
    """Keeps what the work last said of how far it is: to the logger `rotorid.progress`."""

    text = ""

    def emit(self, record: logging.LogRecord) -> None:
        """Take a message."""
        self.text = f", {record.getMessage()}"


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
    done, stage = threading.Event(), _Stage()
    log.setLevel(logging.INFO)
    log.propagate = False
    log.addHandler(stage)
    show = _spinner if sys.stderr.isatty() and not dumb() else _lines
    thread = threading.Thread(target=show, args=(what, done, stage), daemon=True)
    thread.start()
    try:
        yield
    finally:
        log.removeHandler(stage)
        done.set()
        thread.join()


def _lines(what: str, done: threading.Event, stage: _Stage) -> None:
    """For a log, a pipe, or a terminal that cannot draw."""
    begun, pause = time.perf_counter(), FIRST_LINE
    while not done.wait(pause):
        seconds = f"{time.perf_counter() - begun:.0f} s so far"
        print(f"rotorid: {what}{stage.text}, {seconds}", file=sys.stderr, flush=True)
        pause = min(2 * pause, LONGEST_PAUSE)


def _spinner(what: str, done: threading.Event, stage: _Stage) -> None:
    """For a terminal: that it goes on, and the time."""
    if done.wait(PATIENCE):
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(what, total=None)
        while not done.wait(REDRAWN):
            shown.update(task, description=what + stage.text)
