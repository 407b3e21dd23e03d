"""A process that computes beside the page, and is ended when nobody wants its result any more."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from asyncio.subprocess import PIPE, Process
from pathlib import Path
from typing import Any

GRACE = 0.3
"""Seconds that a computation may go on when nobody wants it: a new process takes longer to start."""
_LONGEST = 100_000_000
"""Bytes of one answer."""


class Refused(ValueError):
    """What was asked cannot be computed: why, and the problems of files.

    Attributes
    ----------
    problems
        As `files.problems.Problem` has them, with their text.
    """

    def __init__(self, sentence: str, problems: list[dict[str, Any]]) -> None:
        super().__init__(sentence)
        self.problems = problems


class Worker:
    """One process of `calculation` in the folder of a job, one request at a time.

    Attributes
    ----------
    read
        Names of all files that it has read so far, and when each was changed before that (ns).
    """

    def __init__(self, folder: Path) -> None:
        self.read: dict[str, int] = {}
        self._folder = folder
        self._process: Process | None = None
        self._lock = asyncio.Lock()

    async def start(self) -> Process:
        """Start it where it does not run; it imports what it needs with the first request."""
        if self._process is None or self._process.returncode is not None:
            # -P: what lies in the folder of a job is no module; Ctrl+C is for the server, which ends this
            command = sys.executable, "-P", "-m", "rotorid.worksheet.calculation"
            self._process = await asyncio.create_subprocess_exec(
                *command, stdin=PIPE, stdout=PIPE, limit=_LONGEST, start_new_session=True
            )
        return self._process

    async def ask(self, do: str, **given: object) -> Any:  # noqa: ANN401 - JSON
        """What the process answers.

        Cancelled, it goes on for `GRACE` seconds; then the process is ended.

        Raises
        ------
        Refused
            If it cannot be computed.
        """
        async with self._lock:
            process = await self.start()
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write(json.dumps({"do": do, "folder": str(self._folder), **given}).encode() + b"\n")
            reading = asyncio.ensure_future(process.stdout.readline())
            try:
                line = await asyncio.shield(reading)
            except asyncio.CancelledError:
                if not (await asyncio.wait({reading}, timeout=GRACE))[0]:
                    reading.cancel()
                    await self.stop()
                    await self.start()
                raise
        if not line.endswith(b"\n"):
            await self.stop()
            raise Refused("the calculation ended unexpectedly: try again", [])
        answer = json.loads(line)
        self.read |= answer["read"]
        if "value" in answer:
            return answer["value"]
        raise Refused(answer.get("refused", ""), answer.get("problems", []))

    async def stop(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
