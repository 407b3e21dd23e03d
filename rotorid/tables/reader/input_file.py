"""Input files as bytes: a command reads each of them once, so that its hash is that of what was read."""

from __future__ import annotations

import errno
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

STANDARD_INPUT = "-"
MOST_BYTES = 200_000_000
_read: ContextVar[dict[Path, bytes] | None] = ContextVar("read", default=None)


@contextmanager
def each_file_once() -> Iterator[None]:
    """While a command runs, a file that was read is not read again, and `-` is standard input."""
    token = _read.set({})
    try:
        yield
    finally:
        _read.reset(token)


def file_content(path: Path) -> bytes:
    """What a file holds, or held when the command first read it.

    Raises
    ------
    OSError
        If it cannot be read, is larger than 200 MB, or no regular file (a pipe could go on for ever).
    """
    seen = _read.get()
    if seen is None:
        return _load(path)
    if path not in seen:
        seen[path] = _standard_input(path) if str(path) == STANDARD_INPUT else _load(path)
    return seen[path]


def _load(path: Path) -> bytes:
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
    if not stat.S_ISREG(mode):
        raise OSError(
            errno.EINVAL, "it is no regular file; a table may come from standard input, -", str(path)
        )
    with path.open("rb") as stream:
        return _within_limit(path, stream.read(MOST_BYTES + 1))


def _standard_input(path: Path) -> bytes:
    if sys.stdin is None:
        raise OSError(errno.EBADF, "it is closed", str(path))
    return _within_limit(path, sys.stdin.buffer.read(MOST_BYTES + 1))


def _within_limit(path: Path, data: bytes) -> bytes:
    if len(data) > MOST_BYTES:
        raise OSError(errno.EFBIG, f"it has more than {MOST_BYTES // 10**6} MB", str(path))
    return data
