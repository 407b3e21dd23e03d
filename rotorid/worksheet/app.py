"""Routes of the worksheet, and who may use them.

Only this computer reaches the page. Every request but those for the page itself, which holds nothing, needs
the token: it stands in the fragment of the address, which no browser sends, and travels as a header, which
no other site can set. A page of another origin, or of another name for this address, is refused.
"""

from __future__ import annotations

import contextlib
import hmac
from collections.abc import AsyncIterator, Awaitable, Callable
from importlib.resources import files as resources
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from rotorid.worksheet.job_files import Conflict
from rotorid.worksheet.session import Session
from rotorid.worksheet.workers import Refused

TOKEN = "X-Rotorid-Token"
PAGE = {
    "/": ("index.html", "text/html"),
    "/worksheet.js": ("worksheet.js", "text/javascript"),
    "/worksheet.css": ("worksheet.css", "text/css"),
}
_LARGEST = 30_000_000
"""Bytes of a request."""
_TOO_LARGE = f"at most {_LARGEST // 10**6} MB"
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Guard:
    """Refuses requests of others, and what is too large."""

    def __init__(self, app: ASGIApp, token: str, address: str) -> None:
        self.app = app
        self.token = token.encode()
        self.address = address

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse with 403 and a sentence, or go on."""
        if scope["type"] == "http" and (why := self.refusal(Request(scope))):
            await JSONResponse({"error": why}, 403, HEADERS)(scope, receive, send)
            return
        size = 0

        async def counted() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > _LARGEST:  # a body in chunks does not say so before
                raise ValueError(_TOO_LARGE)
            return message

        await self.app(scope, counted, send)

    def refusal(self, request: Request) -> str:
        """Why a request is refused; empty where it is not."""
        if request.headers.get("host") != self.address:
            return "this name of the computer is not that of the worksheet"
        if request.headers.get("origin", f"http://{self.address}") != f"http://{self.address}":
            return "another page may not use the worksheet"
        if int(request.headers.get("content-length", "0")) > _LARGEST:
            return _TOO_LARGE
        token = request.headers.get(TOKEN, "").encode()
        if request.scope["path"] not in PAGE and not hmac.compare_digest(token, self.token):
            return "the address lacks the key of this worksheet: open the one that the program shows"
        return ""


def application(session: Session, token: str, address: str, ready: Callable[[], object]) -> Starlette:
    """The page of one job.

    Parameters
    ----------
    session
        The job.
    token
        That a request must have.
    address
        Address and port, as browsers send them.
    ready
        Is called when requests can be answered.
    """

    @contextlib.asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        async with session.running():
            ready()
            yield

    async def state(request: Request) -> dict[str, Any]:
        return await session.after(int(request.query_params.get("after", "0")))

    async def edit(request: Request) -> dict[str, Any]:
        rows = session.files.apply((await request.json())["edits"])
        return {"version": session.changed(), "rows": rows}

    async def undo(request: Request) -> dict[str, Any]:
        session.files.undo()
        return {"version": session.changed()}

    async def redo(request: Request) -> dict[str, Any]:
        session.files.redo()
        return {"version": session.changed()}

    async def trial(request: Request) -> dict[str, Any]:
        options = (await request.json())["options"]
        job = session.files.job.name if options.pop("with_job", False) else None
        return dict(await session.drawing.ask("trial", job=job, options=options))

    async def runs(request: Request) -> str:
        place = {key: request.query_params[key] for key in ("speed", "sensor")}
        return str(await session.drawing.ask("channel", job=session.files.job.name, **place))

    async def picture(request: Request) -> str:
        return await session.drawn("picture")

    async def sheet(request: Request) -> str:
        return await session.drawn("sheet")

    async def convention(request: Request) -> str:
        phase, _, side = request.path_params["name"].partition("-")
        return str(await session.drawing.ask("convention", phase=phase, angles=f"{side} rotation"))

    seen = {"/state": state, "/sheet": sheet, "/picture/runs": runs, "/picture/answer": picture}
    routes = [
        *(Route(path, _page) for path in PAGE),
        *(Route(path, _answer(route)) for path, route in seen.items()),
        Route("/convention/{name}", _answer(convention)),
        *(Route(f"/{do.__name__}", _answer(do), methods=["POST"]) for do in (edit, undo, redo, trial)),
    ]
    guard = Middleware(Guard, token=token, address=address)
    return Starlette(routes=routes, middleware=[guard], lifespan=lifespan)


async def _page(request: Request) -> Response:
    name, kind = PAGE[request.url.path]
    content = (resources("rotorid.worksheet") / "page" / name).read_bytes()
    return Response(content, media_type=kind, headers=HEADERS)


def _answer(route: Callable[[Request], Awaitable[Any]]) -> Callable[..., Any]:
    """The route as JSON, SVG or HTML, with everything that is wrong as one sentence."""

    async def answered(request: Request) -> Response:
        error: dict[str, Any]
        try:
            answer = await route(request)
            if isinstance(answer, dict):
                return JSONResponse(answer, headers=HEADERS)
            kind = "image/svg+xml" if answer.startswith("<svg") else "text/html"
            return Response(answer, media_type=kind, headers=HEADERS)
        except Conflict as conflict:
            return JSONResponse({"error": str(conflict), "now": conflict.now}, 409, HEADERS)
        except Refused as refused:
            error = {"error": "\n".join([str(refused), *(one["text"] for one in refused.problems)]).strip()}
        except (KeyError, TypeError, AttributeError, RecursionError) as wrong:
            error = {"error": f"the page asked for what there is not: {wrong}"}
        except (ValueError, OSError, ClientDisconnect) as wrong:  # who has gone reads no answer
            error = {"error": str(wrong)}
        return JSONResponse(error, 400, HEADERS)

    return answered
