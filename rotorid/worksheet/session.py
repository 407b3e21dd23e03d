"""One job in the worksheet: its files, what is computed of them, and who waits for news."""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator
from typing import Any

from rotorid.worksheet.calculation import UNCHECKED
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.workers import Refused, Worker

LOOK = 0.25
"""Seconds between two looks at the files."""
_NEEDED = re.compile(r"(run|speed|sensor|amplitude|phase)(?!_std)(_|$)")
"""Columns of a runs table without which its rows say nothing."""
_NOTHING: dict[str, Any] = {
    "busy": "",
    "runs": None,
    "problems": [],
    "refused": "",
    "answer": None,
    "pieces": None,
    "trim": None,
    "pictures": {},
}


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
        self._behind = ""
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

    def state(self) -> dict[str, Any]:
        """All that a window shows."""
        return {
            "version": self.version,
            **self.files.state(),
            "notice": self._notice,
            "results": self._results,
        }

    async def after(self, version: int, seconds: float = 20.0) -> dict[str, Any]:
        """The state, as soon as it is newer, or after so many seconds."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while self.version <= version and not self._left:
                    await self._news.wait()
        return self.state()

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
        self._publish(pieces=None, trim=None, pictures={}, busy="computing")
        self._computing = asyncio.ensure_future(self._compute())
        return self.version

    @property
    def best(self) -> str:
        """What is printed: the pieces in holes where there are some."""
        return ("answer" if self._results["pieces"] is None else "pieces") + self._behind

    def about(self) -> dict[str, Any]:
        """What a request to a worker says of the job."""
        return {"job": self.files.job.name, "version": self._of_files}

    async def picture(self, name: str) -> str:
        """One of the pictures, as SVG."""
        kind = {"overview": "answer", "discs": "pieces"}[name]
        return await self.printed("picture", kind + self._behind)

    async def printed(self, do: str, kind: str) -> str:
        """A picture or a text of one of the balances."""
        worker = self.drawing if kind.startswith("answer") else self.aside  # which may take long
        return str(await worker.ask(do, **self.about(), kind=kind))

    async def append(self, name: str, data: str, run: str) -> list[str | None]:
        """Add the rows of another runs table to that of the job, all as one run where it is named.

        Raises
        ------
        ValueError
            If it is none, or in other units than the job.
        """
        state = self.files.state()
        if "runs" not in state["tables"]:
            raise ValueError("the job has no runs yet: make their table first")
        phase = state["settings"].get("phase", "lead")
        read = await self.front.ask("rows", name=name, data=data, phase=phase)
        own = state["tables"]["runs"]["header"]
        names = [column if column in own else "" for column in read["header"]]
        if lost := [
            one for one in own if _NEEDED.match(one) and one not in names and not (one == "run" and run)
        ]:
            raise ValueError(
                f"{name}: a column {lost[0]} as in the runs of the job; it has {', '.join(read['header'])}"
            )
        kept = [dict(zip(names, cells, strict=True)) for cells in read["rows"]]
        for cells in kept:
            cells.pop("", None)
            cells.update({"run": run} if run else {})
        return self.files.apply([{"table": "runs", "after": None, "cells": cells} for cells in kept])

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
        """Runs, then the answer at once; pictures, trim and pieces aside."""
        about, state = self.about(), self.files.state()
        if not state["exists"]:
            self._publish(**_NOTHING)
            return
        checked, self._behind = "check" in state["tables"], ""
        await self._part("runs", self.front.ask("so_far", **about))
        found = await self._part("answer", self.front.ask("balanced", **about, kind="answer"))
        if not found and checked:
            self._behind = UNCHECKED
            asked = self.front.ask("balanced", **about, kind="answer" + UNCHECKED)
            found = await self._part("answer", asked, keep=True)
        if found and checked and not self._behind:
            self._publish(busy="computing the trim")
            await self._part("trim", self.aside.ask("balanced", **about, kind="trim"))
        if found and any(_holes(plane) for plane in state["settings"].get("planes", {}).values()):
            self._publish(busy="choosing pieces for the holes")
            await self._part("pieces", self.aside.ask("balanced", **about, kind="pieces" + self._behind))
        self._publish(busy="")

    async def _part(self, name: str, asked: Any, *, keep: bool = False) -> bool:  # noqa: ANN401 - of `ask`
        """Publish a part with its picture, or why there is none (`keep` what was said); whether there is."""
        said: dict[str, Any] = {}
        try:
            found = await asked
        except Refused as error:
            found = None
            said = {"problems": [self._problem(one) for one in error.problems], "refused": str(error)}
        if keep or name == "runs":
            said = {}
        elif name == "answer" and found is not None:
            said = {"problems": [], "refused": ""}
        if found is not None and (shown := {"answer": "overview", "pieces": "discs"}.get(name)):
            said["pictures"] = {**self._results["pictures"], shown: str(self._of_files)}
        self._publish(**{name: found}, **said)
        return found is not None

    def _problem(self, problem: dict[str, Any]) -> dict[str, Any]:
        """A problem of a file, with the cell of the page."""
        row = problem["row"]
        table, place = (row and self.files.place(problem["file"], row)) or (None, None)
        column, text = problem["column"], problem["text"]
        if (row, column) == (None, "weights"):
            text = "no trial run yet"
        return {"table": table, "row": place, "column": column, "text": text, "missing": not problem["value"]}


def _holes(plane: object) -> bool:
    return isinstance(plane, dict) and any(str(key).startswith("holes") for key in plane)
