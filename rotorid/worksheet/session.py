"""One job in the worksheet: its files, what is computed of them, and who waits for news."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from rotorid.base.worker_processes import worker_pool
from rotorid.worksheet.calculation import Results, answered
from rotorid.worksheet.job_files import JobFiles, Stamp
from rotorid.worksheet.page import page

LOOK = 0.25
"""Seconds between two looks at the files."""
GRACE = 0.3
"""Seconds that a computation may go on when nobody wants it: a new process takes longer to start."""


class Worker:
    """A process that computes in the folder of a job, one request at a time.

    Attributes
    ----------
    read
        Names of all files that it has read so far, each with its stamp before that.
    """

    def __init__(self, folder: Path) -> None:
        self.read: dict[str, Stamp] = {}
        self._folder = str(folder)
        self._lock = asyncio.Lock()
        self._pool: Executor | None = None
        self._process: Future[int]

    async def ask(self, do: str, *given: object) -> Any:  # noqa: ANN401 - what the request gives
        """What a request of `calculation` gives; ended when nobody waits for it any more.

        Raises
        ------
        ValueError
            If it cannot be computed.
        """
        async with self._lock:
            if self._pool is None:
                self._pool = worker_pool(1)
                self._process = self._pool.submit(os.getpid)
            request = self._pool.submit(answered, self._folder, do, *given)
            asked = asyncio.wrap_future(request)
            asked.add_done_callback(lambda one: one.cancelled() or one.exception())  # nobody may wait
            try:
                answer = await asyncio.shield(asked)
            except asyncio.CancelledError:
                if not (await asyncio.wait({asked}, timeout=GRACE))[0]:
                    self.stop()
                raise
            except BrokenProcessPool as error:
                self.stop()
                raise ValueError("the calculation ended unexpectedly: try again") from error
        self.read |= answer["read"]
        if "refused" in answer:
            raise ValueError(answer["refused"])
        return answer["value"]

    def stop(self) -> None:
        """End the process, as soon as it has started."""
        pool, self._pool = self._pool, None
        if pool is not None:
            self._process.add_done_callback(_end)
            pool.shutdown(wait=False)


def _end(process: Future[int]) -> None:
    with contextlib.suppress(BrokenProcessPool, ProcessLookupError):
        os.kill(process.result(), signal.SIGTERM)


class Session:
    """State that all windows of one job share.

    Attributes
    ----------
    files
        The job on disk.
    version
        Grows with every change that a window should see.
    worker
        The process that computes and draws.
    """

    def __init__(self, files: JobFiles) -> None:
        self.files = files
        self.version = 1
        self.worker = Worker(files.job.parent)
        self._notice = ""
        self.results = Results()
        self._news = asyncio.Event()
        self._computing: asyncio.Task[None] | None = None

    @contextlib.asynccontextmanager
    async def running(self, ready: Callable[[], object]) -> AsyncIterator[None]:
        """Compute, and look for changes from outside, until the page is closed; say when it is `ready`."""
        self.changed()
        watching = asyncio.ensure_future(self._watch())
        ready()
        yield
        for task in (watching, self._computing):
            if task is not None:
                task.cancel()
        self.worker.stop()

    async def after(self, version: int, seconds: float = 1.0) -> dict[str, Any]:
        """The page that a window shows, as soon as it is newer, or after so many seconds."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while self.version <= version:
                    await self._news.wait()
        return {"version": self.version, "html": page(self.files, self.results, self._notice)}

    def changed(self, notice: str = "") -> None:
        """Say that the files are others, and compute them anew; what is being computed is given up."""
        self._notice = notice
        if self._computing is not None:
            self._computing.cancel()
        self._publish(busy="computing")
        self._computing = asyncio.ensure_future(self._compute())

    async def drawn(self, do: str) -> str:
        """The picture or the sheet of the answer."""
        if self.results.asked is None:
            raise ValueError("there is no answer yet")
        return str(await self.worker.ask(do, *self.results.asked))

    def _publish(self, **results: Any) -> None:  # noqa: ANN401
        self.results = self.results._replace(**results)
        self.version += 1
        self._news.set()
        self._news = asyncio.Event()

    async def _watch(self) -> None:
        while True:
            await asyncio.sleep(LOOK)
            if names := self.files.look(self.worker.read):
                verb = "was" if len(names) == 1 else "were"
                self.changed(f"{' and '.join(names)} {verb} changed by another program")

    async def _compute(self) -> None:
        """The answer in place of what was there."""
        seen = Results()
        if self.files.now.text is not None:
            try:
                seen = await self.worker.ask("whole_job", self.files.job.name, self.version)
            except ValueError as error:
                seen = Results(refused=str(error))
        self._publish(**{**seen._asdict(), "version": self.version})
