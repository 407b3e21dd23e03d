"""Input files as bytes: a command reads each of them once, so that its hash is that of what was read."""

from __future__ import annotations

import errno
import hashlib
import stat
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import NamedTuple

from rotorid.base.logs import files

STANDARD_INPUT = "-"
MOST_BYTES = 200_000_000
reading: ContextVar[Callable[[Path], None] | None] = ContextVar("reading", default=None)
"""Is called before a file is opened, and may refuse it by an OSError."""


class _Files(NamedTuple):
    """What was read of files, and the files that were asked for."""

    known: dict[Path, bytes]
    asked: dict[Path, None]


_files: ContextVar[_Files | None] = ContextVar("files", default=None)


@contextmanager
def each_file_once(held: Mapping[Path, bytes] | None = None) -> Iterator[Collection[Path]]:
    """While a command runs, a file that was read is not read again, and `-` is standard input.

    Inside another one what that has read counts; `held` is what is known of files beforehand. Gives the files
    that are asked for inside, in that order.
    """
    outer = _files.get()
    inner = _Files({} if outer is None else outer.known, {})
    inner.known.update(held or {})
    token = _files.set(inner)
    try:
        yield inner.asked
    finally:
        _files.reset(token)


def file_content(path: Path) -> bytes:
    """What a file holds, or held when the command first read it.

    Raises
    ------
    OSError
        If it cannot be read, is larger than 200 MB, or no regular file (a pipe could go on for ever).
    """
    seen = _files.get()
    if seen is not None:
        seen.asked[path] = None
        if path in seen.known:
            return seen.known[path]
    if seen is not None and str(path) == STANDARD_INPUT:
        if sys.stdin is None:
            raise OSError(errno.EBADF, "it is closed", str(path))
        data = sys.stdin.buffer.read(MOST_BYTES + 1)
    else:
        data = first_bytes(path, MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise OSError(errno.EFBIG, f"it has more than {MOST_BYTES // 10**6} MB", str(path))
    files.debug("read %s, %d bytes", path, len(data))
    if seen is not None:
        seen.known[path] = data
    return data


def first_bytes(path: Path, most: int) -> bytes:
    """The beginning of a file, whether or not it was read before.

    Raises
    ------
    OSError
        If it cannot be read or is no regular file.
    """
    if (asked := reading.get()) is not None:
        asked(path)
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise OSError(errno.EINVAL, "it is no regular file; - is standard input", str(path))
    with path.open("rb") as stream:
        return stream.read(most)


def sha256(path: Path) -> str:
    """SHA-256 of what was read of a file; of the file as it is where it was mapped or read bit by bit.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    seen = _files.get()
    if (seen is not None and path in seen.known) or str(path) == STANDARD_INPUT:
        return hashlib.sha256(file_content(path)).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
