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
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from rotorid.worksheet.job_files import Conflict
from rotorid.worksheet.session import Session
from rotorid.worksheet.workers import Refused

TOKEN = "X-Rotorid-Token"
PAGE = {"/": "index.html", "/worksheet.js": "worksheet.js", "/worksheet.css": "worksheet.css"}
_KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
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
    """Refuses requests of others, and puts the same headers on every answer."""

    def __init__(self, app: ASGIApp, token: str, own: str) -> None:
        self.app = app
        self.token = token.encode()
        self.own = own

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse with 403 and a sentence, or go on."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        if why := self.refusal(Request(scope)):
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
        if request.headers.get("host") != self.own:
            return "this name of the computer is not that of the worksheet"
        if request.headers.get("origin", f"http://{self.own}") != f"http://{self.own}":
            return "another page may not use the worksheet"
        if int(request.headers.get("content-length", "0")) > _LARGEST:
            return _TOO_LARGE
        given = request.headers.get(TOKEN, "").encode()
        if request.scope["path"] not in PAGE and not hmac.compare_digest(given, self.token):
            return "the address lacks the token of this worksheet: open the one that the program shows"
        return ""


class Routes:
    """What the page asks of its session, one method a route."""

    def __init__(self, session: Session) -> None:
        self.session = session

    async def state(self, request: Request) -> Response:
        """All that a window shows, as soon as it is newer than what the window has."""
        return _json(await self.session.after(int(request.query_params.get("after", "0"))))

    async def edit(self, request: Request) -> Response:
        """Cells, rows, settings: all of them, or none."""
        rows = self.session.files.apply((await request.json())["edits"])
        return _json({"version": self.session.changed(), "rows": rows})

    async def undo(self, request: Request) -> Response:
        """The last edit of any window."""
        self.session.files.undo()
        return _json({"version": self.session.changed()})

    async def redo(self, request: Request) -> Response:
        """The last edit that was undone."""
        self.session.files.redo()
        return _json({"version": self.session.changed()})

    async def take(self, request: Request) -> Response:
        """Rows of a file that a person chose."""
        given = await request.json()
        rows = await self.session.append(given["name"], given["data"], given.get("run", ""))
        return _json({"version": self.session.changed(), "rows": rows})

    async def trial(self, request: Request) -> Response:
        """A first trial weight."""
        options = (await request.json())["options"]
        about = self.session.about()
        if not options.pop("with_job", False):
            about["job"] = None
        return _json(await self.session.drawing.ask("trial", **about, options=options))

    async def picture(self, request: Request) -> Response:
        """The runs of one sensor and speed, the weights, the discs."""
        name, asked = request.path_params["name"], request.query_params
        if name == "runs":
            place = {key: asked[key] for key in ("speed", "sensor")}
            return _svg(await self.session.drawing.ask("channel", **self.session.about(), **place))
        try:
            return _svg(await self.session.picture(name))
        except Refused:  # the job has changed since the page saw that picture
            return Response(status_code=204, headers=HEADERS)

    async def convention(self, request: Request) -> Response:
        """One of the four drawings: lead-with, lead-against, lag-with, lag-against."""
        phase, _, side = request.path_params["name"].partition("-")
        return _svg(await self.session.drawing.ask("convention", phase=phase, angles=f"{side} rotation"))

    async def sheet(self, request: Request) -> Response:
        """The balancing sheet."""
        found = await self.session.printed("sheet", self.session.best)
        return Response(found, media_type="text/html", headers=HEADERS)

    async def whole(self, request: Request) -> Response:
        """All tables, as the command line prints them."""
        return PlainTextResponse(await self.session.printed("whole", self.session.best), headers=HEADERS)


def application(session: Session, token: str, own: str, ready: Callable[[], object]) -> Starlette:
    """The page of one job.

    Parameters
    ----------
    session
        The job.
    token
        That a request must have.
    own
        Address and port, as browsers send them.
    ready
        Is called when requests can be answered.
    """

    @contextlib.asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        async with session.running():
            ready()
            yield

    do = Routes(session)
    read = {"/state": do.state, "/sheet": do.sheet, "/whole": do.whole}
    read |= {"/picture/{name}": do.picture, "/convention/{name}": do.convention}
    write = {"/edit": do.edit, "/undo": do.undo, "/redo": do.redo, "/import": do.take, "/trial": do.trial}
    routes = [
        *(Route(path, _page) for path in PAGE),
        *(Route(path, _told(route)) for path, route in read.items()),
        *(Route(path, _told(route), methods=["POST"]) for path, route in write.items()),
    ]
    return Starlette(routes=routes, middleware=[Middleware(Guard, token=token, own=own)], lifespan=lifespan)


async def _page(request: Request) -> Response:
    name = PAGE[request.url.path]
    content = (resources("rotorid.worksheet") / "page" / name).read_bytes()
    return Response(content, media_type=_KINDS[name.rpartition(".")[2]], headers=HEADERS)


def _json(told: dict[str, Any]) -> Response:
    return JSONResponse(told, headers=HEADERS)


def _svg(text: str) -> Response:
    return Response(text, media_type="image/svg+xml", headers=HEADERS)


def _told(route: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
    """The route, with everything that is wrong as one sentence."""

    async def answered(request: Request) -> Response:
        try:
            return await route(request)
        except Conflict as error:
            told: dict[str, Any] = {"error": str(error), "now": error.now}
            return JSONResponse(told, 409, HEADERS)
        except Refused as error:
            words = "\n".join([str(error), *(one["text"] for one in error.problems)])
            return JSONResponse({"error": words.strip()}, 400, HEADERS)
        except (KeyError, TypeError, AttributeError, RecursionError) as error:
            return JSONResponse({"error": f"the page asked for what there is not: {error}"}, 400, HEADERS)
        except (ValueError, OSError, ClientDisconnect) as error:  # who has gone reads no answer
            return JSONResponse({"error": str(error)}, 400, HEADERS)

    return answered
