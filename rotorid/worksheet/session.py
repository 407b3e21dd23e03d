"""One job in the worksheet: its files, what is computed of them, and who waits for news."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import Any

from rotorid.files.problems import quote
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.workers import Refused, Worker

LOOK = 0.25
"""Seconds between two looks at the files."""
_NOTHING: dict[str, Any] = {"busy": "", "runs": None, "problems": [], "refused": "", "answer": None}


class Session:
    """State that all windows of one job share.

    Attributes
    ----------
    files
        The job on disk.
    version
        Grows with every change that a window should see.
    front, drawing, aside
        What answers at once, what draws, and what may take its time.
    """

    def __init__(self, files: JobFiles) -> None:
        self.files = files
        self.version = 1
        self.front, self.drawing, self.aside = self._workers = [Worker(files.job.parent) for _ in range(3)]
        self._of_files = 1
        self._notice = ""
        self._asked: dict[str, Any] = {}
        self._results = dict(_NOTHING)
        self._news, self._left = asyncio.Event(), False
        self._computing: asyncio.Task[None] | None = None

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Compute, and look for changes from outside, until the page is closed."""
        self.changed()
        watching = asyncio.ensure_future(self._watch())
        yield
        for task in (watching, self._computing):
            if task is not None:
                task.cancel()
        await asyncio.gather(*(worker.stop() for worker in self._workers))

    async def after(self, version: int, seconds: float = 20.0) -> dict[str, Any]:
        """All that a window shows, as soon as it is newer, or after so many seconds."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while self.version <= version and not self._left:
                    await self._news.wait()
        news = {"version": self.version, "notice": self._notice, "results": self._results}
        return {**self.files.state(), **news}

    def leave(self) -> None:
        """Answer those who wait for news, since the program ends."""
        self._left = True
        self._news.set()

    def changed(self, notice: str = "") -> int:
        """Say that the files are others, and compute them anew; what is being computed is given up."""
        self._notice = notice
        self._of_files += 1
        if self._computing is not None:
            self._computing.cancel()
        self._publish(busy="computing")
        self._computing = asyncio.ensure_future(self._compute())
        return self.version

    async def drawn(self, do: str) -> str:
        """The picture or the sheet of the answer."""
        if not self._asked:
            raise ValueError("there is no answer yet")
        final = self._asked["split"] or self._asked["refine"]  # which may take long
        worker = self.aside if final else self.drawing
        return str(await worker.ask(do, job=self.files.job.name, asked=self._asked))

    def _publish(self, **results: object) -> None:
        self._results = {**self._results, **results}
        self.version += 1
        self._news.set()
        self._news = asyncio.Event()

    async def _watch(self) -> None:
        while True:
            await asyncio.sleep(LOOK)
            if names := self.files.look(self.front.read | self.aside.read):
                verb = "was" if len(names) == 1 else "were"
                self.changed(f"{' and '.join(names)} {verb} changed by another program")

    async def _compute(self) -> None:
        """Runs, then the weights at once; pieces in the holes and the trim aside, in place of these."""
        job, state = self.files.job.name, self.files.state()
        planes = state["settings"].get("planes", {})
        has_holes = any(
            "holes" in key for plane in planes.values() if isinstance(plane, dict) for key in plane
        )
        asked = {"version": self._of_files, "checked": True, "split": False, "refine": False}
        if not state["exists"]:
            self._publish(**_NOTHING)
            return
        try:
            self._publish(runs=await self.front.ask("so_far", job=job))
        except Refused:
            self._publish(runs=None)
        try:
            answer = await self.front.ask("balanced", job=job, asked=asked)
            self._publish(problems=[], refused="")
        except Refused as error:
            problems = [self._problem(one) for one in error.problems]
            self._publish(problems=problems, refused=str(error))
            answer = None
        if answer is None and "check" in state["tables"]:
            asked["checked"] = False
            with contextlib.suppress(Refused):
                answer = await self.front.ask("balanced", job=job, asked=asked)
        refine = answer is not None and asked["checked"] and "check" in state["tables"]
        final = {**asked, "split": has_holes, "refine": refine}
        self._asked = {} if answer is None else asked
        if answer is None or final == asked:
            self._publish(answer=answer, busy="")
            return
        self._publish(
            answer=answer, busy="choosing pieces for the holes" if has_holes else "computing the trim"
        )
        try:
            answer = await self.aside.ask("balanced", job=job, asked=final)
            self._asked = final
            self._publish(answer=answer, busy="")
        except Refused as error:
            why = str(error) or "; ".join(one["text"] for one in error.problems)
            what = "trim" if refine else "pieces"
            answer["warnings"].append(f"no {what}: {why}")
            self._publish(answer=answer, busy="")

    def _problem(self, problem: dict[str, Any]) -> dict[str, Any]:
        """A problem of a file, with the cell of the page."""
        table, row = self.files.place(problem["file"], problem["row"]) or (None, None)
        column, value, text = problem["column"], problem["value"], problem["text"]
        if row:
            text = f"{'' if value is None else f'{quote(value)} stands here; '}expected {problem['expected']}"
        elif (problem["row"], column) == (None, "weights"):
            text = "no trial run yet"
        return {"table": table, "row": row, "column": column, "text": text, "missing": not value}
