"""What the worksheet answers, and to whom.

Only this computer reaches the page. Every request but those for the page itself, which holds nothing, needs
the token: it stands in the fragment of the address, which no browser sends, and travels as a header, which
no other site can set. A page of another origin, or of another name for this address, is refused.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import multiprocessing
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import BrokenExecutor, Executor
from pathlib import Path
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.types import Receive, Scope, Send

from rotorid.base.worker_processes import worker_pool
from rotorid.worksheet.calculation import Results, answered, drawn, trial, whole_job
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.job_text import Conflict

TOKEN = "X-Rotorid-Token"
PAGE = {"/": "text/html", "/worksheet.js": "text/javascript", "/worksheet.css": "text/css"}
_LARGEST = 30_000_000
"""Bytes of a request."""
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
LOOK, LOOKS = 0.1, 10
"""Seconds between two looks at the files; how many a window waits for news."""
GRACE = 0.3
"""Seconds that a computation may go on when nobody wants it: a new process takes longer to start."""


class Worksheet:
    """Answers all windows of one job; a process computes in its folder, one request at a time.

    Requests must have a token, and be for an address and port, as browsers send them.
    """

    def __init__(self, files: JobFiles, token: str, address: str) -> None:
        self._files, self._token, self._address = files, token, address
        self._results, self._notice = Results(), ""
        self._version = 0  # grows with every change that a window should see
        self._computing: asyncio.Task[None] | None = None
        self._lock = asyncio.Lock()
        self._pool: Executor | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request; everything that is wrong is answered by one sentence."""
        request = Request(scope, receive)
        why, status = self._refusal(request), 403
        if not why:
            try:
                answer = await self._answer(request)
            except (KeyError, TypeError, AttributeError, RecursionError) as wrong:
                why, status = f"the page asked for what there is not: {wrong}", 400
            except (ValueError, OSError, ClientDisconnect) as wrong:  # who has gone reads no answer
                why, status = str(wrong), 409 if isinstance(wrong, Conflict) else 400
        if why:
            answer = JSONResponse({"error": why}, status)
        answer.headers.update(HEADERS)
        await answer(scope, receive, send)

    def stop(self) -> None:
        """End the process that computes."""
        self._pool = None
        for process in multiprocessing.active_children():
            process.terminate()

    def _refusal(self, request: Request) -> str:
        """Why a request is refused; empty where it is not."""
        if request.headers.get("host") != self._address:
            return "this name of the computer is not that of the worksheet"
        if request.headers.get("origin", f"http://{self._address}") != f"http://{self._address}":
            return "another page may not use the worksheet"
        key = request.headers.get(TOKEN, "").encode()
        if request.url.path not in PAGE and not hmac.compare_digest(key, self._token.encode()):
            return "the address lacks the key of this worksheet: open the one that the program shows"
        return ""

    async def _answer(self, request: Request) -> Response:
        """A file of the page, or what is asked for by the query or the body."""
        path, asked = request.url.path, self._results.get("asked")
        if path in PAGE:
            file = Path(__file__).with_name("page") / (path[1:] or "index.html")
            return Response(file.read_bytes(), media_type=PAGE[path])
        given: Mapping[str, Any] = request.query_params
        if request.method != "GET":
            body = bytearray()
            async for part in request.stream():  # a body in chunks does not say its size before
                body += part
                if len(body) > _LARGEST:
                    raise ValueError(f"at most {_LARGEST // 10**6} MB")
            given = json.loads(body)
        match path:
            case "/state":
                return JSONResponse(await self._state(int(given.get("after", 0))))
            case "/trial":
                return JSONResponse(await self._ask(trial, self._files.job.name, {**given}))
            case "/picture" | "/sheet" if asked:
                return HTMLResponse(await self._ask(drawn, path[1:], *asked))
            case "/edit":
                self._files.apply(given["edits"])
            case "/undo":
                self._files.undo()
            case _:
                raise ValueError(f"there is no {path[1:]} yet")
        self._changed()
        return JSONResponse({})

    async def _state(self, after: int) -> dict[str, Any]:
        """What a window shows, as soon as it is newer than the version that it has, or after a second."""
        for _ in range(LOOKS):
            names = self._files.look()
            if names or not self._version:
                self._changed(names)
            if self._version > after:
                break
            await asyncio.sleep(LOOK)
        busy = "" if self._computing is None or self._computing.done() else "computing"
        job = self._files.job
        now = {"name": f"{job.parent.name} / {job.name}", "notice": self._notice, "busy": busy}
        return {**self._files.now.state(), **self._results, **now, "version": self._version}

    def _changed(self, names: Iterable[str] = ()) -> None:
        """Compute files anew, of which other programs changed some; what is being computed is given up."""
        if self._computing is not None:
            self._computing.cancel()
        self._notice = "; ".join(f"{name} was changed by another program" for name in names)
        self._version += 1
        self._computing = asyncio.ensure_future(self._compute())

    async def _compute(self) -> None:
        """The answer in place of what was there."""
        seen = Results()
        if self._files.now.text is not None:
            try:
                seen = await self._ask(whole_job, self._files.job.name, self._version)
            except ValueError as error:
                seen = {"refused": str(error)}
        for one in seen.get("problems", ()):
            one["at"] = f"{self._files.job.parent / one['file']} {one['row']}"
        self._results = seen
        self._version += 1

    async def _ask(self, do: Callable[..., Any], *given: object) -> Any:  # noqa: ANN401  what it gives
        """What a function of `calculation` gives, or ValueError; ended when nobody waits for it any more."""
        async with self._lock:
            self._pool = self._pool or worker_pool(1)
            request = self._pool.submit(answered, str(self._files.job.parent), do, *given)
            asked = asyncio.wrap_future(request)
            asked.add_done_callback(lambda one: one.cancelled() or one.exception())  # nobody may wait
            try:
                await asyncio.wait({asked})
            except asyncio.CancelledError:
                if not (await asyncio.wait({asked}, timeout=GRACE))[0]:
                    self.stop()
                raise
            if isinstance(asked.exception(), BrokenExecutor):
                self.stop()
                raise ValueError("the calculation ended unexpectedly: try again")
        answer = asked.result()
        self._files.watch(answer["read"])
        if "refused" in answer:
            raise ValueError(answer["refused"])
        return answer["value"]
