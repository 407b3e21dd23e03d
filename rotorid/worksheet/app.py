"""What the worksheet answers, and to whom.

Only this computer reaches the page. Every request but those for the page itself, which holds nothing, needs
the token: it stands in the fragment of the address, which no browser sends, and travels as a header, which
no other site can set. A page of another origin, or of another name for this address, is refused.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Awaitable, Callable, Mapping
from importlib.resources import files as resources
from typing import Any

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from rotorid.worksheet.page import ACTIONS, View
from rotorid.worksheet.session import Session
from rotorid.worksheet.text_table import Conflict

TOKEN = "X-Rotorid-Token"
PAGE = {
    "/": ("index.html", "text/html"),
    "/worksheet.js": ("worksheet.js", "text/javascript"),
    "/worksheet.css": ("worksheet.css", "text/css"),
}
_LARGEST = 30_000_000
"""Bytes of a request."""
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
Given = Mapping[str, Any]


async def state(session: Session, given: Given) -> dict[str, Any]:
    """The page, as soon as it is newer than the version that a window has."""
    return await session.after(int(given.get("after", 0)))


async def edit(session: Session, given: Given) -> dict[str, Any]:
    """Change cells and settings, all or none."""
    session.files.apply(given["edits"])
    session.changed()
    return {}


async def do(session: Session, given: Given) -> dict[str, Any]:
    """What a button does."""
    if given["do"] == "undo":
        session.files.undo()
    else:
        session.files.apply(ACTIONS[given["do"]](View(session.files, session.results), given))
    session.changed()
    return {}


async def trial(session: Session, given: Given) -> str:
    """A proposed trial weight."""
    if "with_job" in given:
        return str(await session.worker.ask("trial", session.files.job.name, {}))
    options: dict[str, Any] = {}
    for name, text in given.items():
        if text:
            key, _, unit = name.partition(" ")
            number = text.replace(",", ".")
            options[key] = float(number) if unit == "deg" else f"{number}{unit}"
    return str(await session.worker.ask("trial", None, options))


ROUTES: Mapping[str, Callable[[Session, Given], Awaitable[dict[str, Any] | str]]] = {
    **{f"/{one.__name__}": one for one in (state, edit, do, trial)},
    "/picture": lambda session, given: session.drawn("picture"),
    "/sheet": lambda session, given: session.drawn("sheet"),
}


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

    async def answer(request: Request) -> Response:
        """A file of the page, or what is asked for; everything that is wrong as one sentence."""
        path, kind, status = request.url.path, "text/html", 400
        if why := _refusal(request, token, address):
            return JSONResponse({"error": why}, 403, HEADERS)
        if path in PAGE:
            name, kind = PAGE[path]
            content = (resources("rotorid.worksheet") / "page" / name).read_bytes()
            return Response(content, media_type=kind, headers=HEADERS)
        try:
            made = await ROUTES[path](session, await _given(request))
            if isinstance(made, dict):
                return JSONResponse(made, headers=HEADERS)
            kind = "image/svg+xml" if made.startswith("<svg") else kind
            return Response(made, media_type=kind, headers=HEADERS)
        except (KeyError, TypeError, AttributeError, RecursionError) as wrong:
            why = f"the page asked for what there is not: {wrong}"
        except (ValueError, OSError, ClientDisconnect) as wrong:  # who has gone reads no answer
            why, status = str(wrong), 409 if isinstance(wrong, Conflict) else 400
        return JSONResponse({"error": why}, status, HEADERS)

    routes = [Route(path, answer, methods=["GET", "POST"]) for path in (*PAGE, *ROUTES)]
    return Starlette(routes=routes, lifespan=lambda _: session.running(ready))


def _refusal(request: Request, token: str, address: str) -> str:
    """Why a request is refused; empty where it is not."""
    if request.headers.get("host") != address:
        return "this name of the computer is not that of the worksheet"
    if request.headers.get("origin", f"http://{address}") != f"http://{address}":
        return "another page may not use the worksheet"
    key = request.headers.get(TOKEN, "").encode()
    if request.url.path not in PAGE and not hmac.compare_digest(key, token.encode()):
        return "the address lacks the key of this worksheet: open the one that the program shows"
    return ""


async def _given(request: Request) -> Given:
    """The query, or the body, of which no more is kept than may be."""
    if request.method == "GET":
        return request.query_params
    body = bytearray()
    async for part in request.stream():  # a body in chunks does not say its size before
        body += part
        if len(body) > _LARGEST:
            raise ValueError(f"at most {_LARGEST // 10**6} MB")
    given: Given = json.loads(body)
    return given
