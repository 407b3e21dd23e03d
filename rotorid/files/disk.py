"""Files on disk: each is read once, so that its hash is that of what was read, and written whole or not."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from rotorid.base.choices import did_you_mean
from rotorid.base.logs import files as log
from rotorid.files.input_problems import STANDARD_INPUT, refusal

MOST_BYTES = 200_000_000
SUFFIXES = (".xlsx", ".xlsm")
"""Of workbooks."""
reading: ContextVar[Callable[[Path], None] | None] = ContextVar("reading", default=None)
"""Is called before a file is opened, and may refuse it by an OSError."""
_files: ContextVar[tuple[dict[Path, bytes], dict[Path, None]] | None] = ContextVar("files", default=None)
"""What was read of files, and the files that were asked for."""


@contextmanager
def each_file_once(held: Mapping[Path, bytes] | None = None) -> Iterator[Collection[Path]]:
    """While a command runs, a file that was read is not read again, and `-` is standard input.

    Inside another one what that has read counts; `held` is what is known of files beforehand. Gives the files
    that are asked for inside, in that order.
    """
    contents, asked = (_files.get() or ({},))[0], dict[Path, None]()
    contents.update(held or {})
    token = _files.set((contents, asked))
    try:
        yield asked
    finally:
        _files.reset(token)


def file_content(path: Path) -> bytes:
    """What a file holds, or held when the command first read it.

    Raises
    ------
    InputError
        If it cannot be read, is larger than 200 MB, or no regular file (a pipe could go on for ever).
    """
    contents, asked = _files.get() or ({}, {})
    asked[path] = None
    if path in contents:
        return contents[path]
    try:
        if _files.get() is None or str(path) != STANDARD_INPUT:
            data = first_bytes(path, MOST_BYTES + 1)
        elif sys.stdin is None:
            raise OSError(errno.EBADF, "it is closed", str(path))
        else:
            data = sys.stdin.buffer.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise OSError(errno.EFBIG, f"it has more than {MOST_BYTES // 10**6} MB", str(path))
    except (OSError, ValueError) as error:
        raise refusal(path, why_unreadable(path, error)) from error
    log.debug("read %s, %d bytes", path, len(data))
    contents[path] = data
    return data


def first_bytes(path: Path, most: int) -> bytes:
    """The beginning of a file, whether or not it was read before.

    Raises
    ------
    OSError
        If it cannot be read or is no regular file.
    """
    if (ask := reading.get()) is not None:
        ask(path)
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
    contents = (_files.get() or ({},))[0]
    if path in contents or str(path) == STANDARD_INPUT:
        return hashlib.sha256(file_content(path)).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def is_workbook(path: Path) -> bool:
    """Whether the name says that the file is a workbook."""
    return path.suffix.lower() in SUFFIXES


def why_unreadable(path: Path, error: OSError | ValueError) -> str:
    """What is expected of a file that could not be read."""
    if isinstance(error, FileNotFoundError):
        names = list[str]()
        with suppress(OSError):
            names = os.listdir(path.parent)
        return f"a file that exists{did_you_mean(path.name, names)}"
    if isinstance(error, IsADirectoryError):
        return "a file, not a folder"
    return f"a file that can be read ({getattr(error, 'strerror', None) or error})"


def write_files(files: Mapping[Path, bytes], last_look: Callable[[], None] | None = None) -> None:
    """Write files that belong together: all are complete beside the old ones before the first is replaced.

    Parameters
    ----------
    files
        What to write where, in the order in which old files are replaced.
    last_look
        Called when all are complete beside the old ones; what it raises leaves these as they are.

    Raises
    ------
    InputError
        If one cannot be written; where that shows before the first is replaced, all stay as they were.
    """
    waiting, path = dict[Path, Path](), Path()
    try:
        for path, data in files.items():
            if path.exists() and not path.is_file():
                kind = "it is a folder" if path.is_dir() else "it is no regular file"
                raise OSError(errno.EINVAL, kind, str(path))
            target = Path(os.path.realpath(path))  # behind a link, the file that it names
            if target.is_symlink():
                raise OSError(errno.ELOOP, "its links go in a circle", str(path))
            temporary = target.with_name(f".{target.name[:80]}.{len(waiting)}.{os.getpid()}.tmp")
            with temporary.open("xb") as stream:
                waiting[temporary] = target
                stream.write(data)
                if target.exists():
                    temporary.chmod(stat.S_IMODE(target.stat().st_mode))
                stream.flush()
                os.fsync(stream.fileno())
        if last_look is not None:
            last_look()
        for path, (temporary, target) in zip(files, waiting.items(), strict=True):
            temporary.replace(target)
            log.debug("written %s, %d bytes", path, len(files[path]))
    except OSError as error:
        raise refusal(path, f"a file that can be written ({error.strerror or error})") from error
    finally:
        for temporary in waiting:
            temporary.unlink(missing_ok=True)
