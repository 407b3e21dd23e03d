"""A command run in this process, and whether two answers say the same."""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
import signal
import sys
import traceback
import warnings
from dataclasses import dataclass
from typing import Any

import rotorid.cli

SECONDS = 10
"""Longest time of one core that any file may take."""
CLOSE = 1e-7
"""Relative difference of numbers that are the same: iterations end at other last digits."""


class TooLong(BaseException):
    """Not to be caught by the program."""


@dataclass(frozen=True)
class Answer:
    """What a command gave: exit status, document, standard error; the end of a traceback if it broke."""

    status: int
    document: Any = None
    error: str = ""
    broken: str = ""


def answer(words, *, seconds=SECONDS):
    """Run `rotorid WORDS --json`; never raises."""
    out, err = io.StringIO(), io.StringIO()
    previous_words, sys.argv = sys.argv, ["rotorid", *words, "--json"]
    previous = signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    status, broken = 0, ""
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            warnings.simplefilter("default")
            rotorid.cli.main()
    except SystemExit as stop:
        status = stop.code or 0
    except TooLong:
        broken = f"still computing after {seconds} s"
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        broken = f"{type(error).__name__}: {error} ({frame.filename.rpartition('/')[2]}:{frame.lineno})"[:300]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, previous)
        sys.argv = previous_words
    if broken or status:
        if not broken and (status not in (1, 2) or not err.getvalue().startswith("rotorid: ")):
            broken = f"exit status {status}: {err.getvalue()[:200]!r}"
        return Answer(status, None, err.getvalue(), broken)
    try:
        return Answer(0, _plain(json.loads(out.getvalue())), err.getvalue())
    except ValueError as error:
        return Answer(0, None, err.getvalue(), f"no JSON: {error}")


def _stop(_signal, _frame):
    raise TooLong


def _plain(document):
    """Without what the names of files and rows change."""
    document.pop("provenance", None)
    return document


def same(one, other, path=""):
    """None, or where two documents differ."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        return next((d for k in one if (d := same(one[k], other[k], f"{path}.{k}"))), None)
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        if one and all(isinstance(x, (int, float)) for x in (*one, *other)):
            scale = max(map(abs, (*one, *other)))
            close = all(abs(a - b) <= CLOSE * scale for a, b in zip(one, other, strict=True))
            return None if close else f"{path}: {one} and {other}"[:200]
        pairs = enumerate(zip(one, other, strict=True))
        return next((d for i, (a, b) in pairs if (d := same(a, b, f"{path}[{i}]"))), None)
    if isinstance(one, str) and isinstance(other, str):
        return None if _words(one) == _words(other) else f"{path}: {one!r} and {other!r}"[:300]
    if isinstance(one, (int, float)) and isinstance(other, (int, float)):
        close = math.isclose(one, other, rel_tol=CLOSE, abs_tol=1e-10)
        return None if close else f"{path}: {one} and {other}"
    return None if one == other else f"{path}: {one!r} and {other!r}"[:300]


def _words(text):
    """A sentence without its numbers and paths: they stand in the document, too, and rows of a file move."""
    return re.sub(r"\S*/\S*|[-+]?\d[\d.,e+-]*", "#", text)
