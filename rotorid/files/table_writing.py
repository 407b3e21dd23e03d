"""Writing tables: whole or not at all, and never anything that a spreadsheet would run."""

from __future__ import annotations

import errno
import math
import os
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base import logs
from rotorid.base.tables import Column, Table, Value, csv_bytes, excel
from rotorid.files.problems import InputError, Problem

if TYPE_CHECKING:
    import pandas as pd


def write_table(path: str | Path, frame: pd.DataFrame) -> None:
    """Write a table to `.csv` or `.xlsx`, whole or not at all.

    Numbers keep all their digits; NaN and None become blanks. Text that a spreadsheet could take for a
    formula gets a leading blank in CSV (readers drop it) and is marked as text in a workbook.

    Parameters
    ----------
    path
        Ends in `.csv` or `.xlsx`; an existing file is replaced.
    frame
        The table; its index is not written.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    write_bytes(Path(path), table_bytes(path, frame))


def table_bytes(path: str | Path, frame: pd.DataFrame, *, sheet: str = "table") -> bytes:
    """What `write_table` writes to a file of this name."""
    path = Path(path)
    kind = path.suffix.lower()
    names = [*map(str, frame.columns)]
    plain = frame.astype(object).where(frame.notna(), None)  # the blanks of all kinds of columns
    cells: list[list[Any]] = plain.to_numpy().tolist()
    rows = [[_plain(value) for value in row] for row in cells]
    if kind == ".csv":
        return csv_bytes((), names, rows)
    if kind == ".xlsx":
        columns = (Column(name, [row[k] for row in rows]) for k, name in enumerate(names))
        return excel(Table(sheet, tuple(columns)))
    raise InputError([Problem(str(path), None, None, None, "a name that ends in .csv or .xlsx")])


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file by way of a temporary one beside it, so that nobody ever sees half of it."""
    write_files({path: data})


def write_files(files: Mapping[Path, bytes], last_look: Callable[[], None] | None = None) -> None:
    """Write several files that belong together: all are complete on disk before the first is replaced.

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
    if not files:
        return
    path = next(iter(files))
    # behind a link, the file that it names
    targets = {path: Path(os.path.realpath(path)) for path in files}
    waiting = {
        path: target.with_name(f".{target.name[:80]}.{number}.{os.getpid()}.tmp")
        for number, (path, target) in enumerate(targets.items())
    }
    try:
        for path in files:
            if path.exists() and not path.is_file():
                raise OSError(
                    errno.EINVAL, "it is a folder" if path.is_dir() else "it is no regular file", str(path)
                )
            if targets[path].is_symlink():
                raise OSError(errno.ELOOP, "its links go in a circle", str(path))
        for path, data in files.items():
            with waiting[path].open("xb") as stream:
                stream.write(data)
                if targets[path].exists():
                    waiting[path].chmod(stat.S_IMODE(targets[path].stat().st_mode))
                stream.flush()
                os.fsync(stream.fileno())
        if last_look is not None:
            last_look()
        for path, temporary in waiting.items():
            temporary.replace(targets[path])
            logs.files.debug("written %s, %d bytes", path, len(files[path]))
    except OSError as error:
        expected = f"a file that can be written ({error.strerror or error})"
        raise InputError([Problem(str(path), None, None, None, expected)]) from error
    finally:
        for temporary in waiting.values():
            temporary.unlink(missing_ok=True)


def _plain(value: object) -> Value:
    item = getattr(value, "item", None)
    if callable(item):
        value = item()
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return None
    if isinstance(value, float) and math.isinf(value):
        raise ValueError("an infinite number cannot be written to a table")
    return value if isinstance(value, (bool, int, float)) else str(value)
