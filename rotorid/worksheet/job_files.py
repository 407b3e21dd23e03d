"""A job on disk: single cells changed in its files, undo and redo, changes from outside noticed."""

from __future__ import annotations

import itertools
import re
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from rotorid.base.text import listing
from rotorid.tables.job.job_keys import TABLES
from rotorid.tables.reader.excel_workbook import SUFFIXES, is_workbook
from rotorid.tables.reader.grid import clean
from rotorid.tables.reader.input_file import MOST_BYTES, file_content, first_bytes
from rotorid.tables.reader.problems import InputError
from rotorid.tables.reader.table_writing import write_files
from rotorid.worksheet.settings_cells import changed, setting, settings_in
from rotorid.worksheet.text_cells import KEYS, Cells, TextCells, kept_ids
from rotorid.worksheet.workbook_cells import WorkbookVersion

MOST_STEPS = 200
MOST_TRIES = 5
FRESH = 2.0
"""Seconds after a change in which another one may leave a file's time as it is."""
Contents = Mapping[Path, bytes | None]
"""What files hold; None: there is none."""


class Conflict(ValueError):
    """A cell was changed meanwhile; `now` is what it holds."""

    def __init__(self, message: str, now: Any) -> None:  # noqa: ANN401
        super().__init__(message)
        self.now = now


class _OutsideError(Exception):
    """A file was changed while it was about to be replaced."""


class _Step(NamedTuple):
    """One side of a step of undo: what its files hold, and the ids of the rows of their tables."""

    data: Contents
    ids: Mapping[str, Sequence[str]]


class FilesVersion:
    """A job of files as they are at one time; edits change this copy, not the files.

    Parameters
    ----------
    job
        The job file, which may not exist yet.
    read
        Gives what a file holds.
    """

    def __init__(self, job: Path, read: Callable[[Path], bytes | None]) -> None:
        self.job, self._read = job, read
        self.data: dict[Path, bytes | None] = {job: read(job)}
        self.tables: dict[str, Cells] = {}
        self.paths: dict[str, Path] = {}
        self.settings: dict[str, Any] = {}
        self.read_only, self._text = "", self.data[job] or b""
        if self.data[job] is None:  # its first edit writes down the names of the tables that are there
            self.data |= {job.parent / f"{key}.csv": read(job.parent / f"{key}.csv") for key in KEYS[:2]}
            names = [path.stem for path, data in self.data.items() if data is not None]
            if "runs" in names:
                self._text = "".join(f'{name} = "{name}.csv"\n' for name in names).encode()
        try:
            self.settings = settings_in(self._text)
        except ValueError as error:
            self.read_only = f"{job.name} cannot be read, correct it there: {error}"
        for key in (*TABLES, "rotor"):
            name = self.settings.get(key)
            if isinstance(name, str) and name.isprintable():
                self._open(key, job.parent / name)

    def _open(self, key: str, path: Path) -> None:
        others = [other for other in self.tables if self.paths.get(other) == path]
        table = Cells(path.name)
        try:
            if not is_inside(path, self.job.parent):
                raise ValueError("is not in the folder of the job: copy it there to edit it here")
            self.data[path] = self._read(path)
            self.paths[key] = path
            if others:
                raise ValueError(f"is the table of {others[0]}, too: edit it there")
            if path.suffix.lower() in (".toml", *SUFFIXES):
                raise ValueError("is no text table: it is read as it is, edit it where it comes from")
            if key in KEYS and (data := self.data[path]) is not None:
                self.tables[key] = TextCells(path, data, key)
        except ValueError as error:
            table.read_only = f"{path.name} {error}"
            if key in KEYS:
                self.tables[key] = table

    def put_setting(self, key: Sequence[str], new: Any) -> None:  # noqa: ANN401  any value of JSON
        """Change, add or (None) remove a setting."""
        self._text = changed(self._text, key, new)
        self.settings = settings_in(self._text)

    def create(self, key: str, header: Sequence[str]) -> None:
        """Begin a table in a file that the job names then."""
        path, folder = self.paths.get(key), self.job.parent
        if path is None:
            names = (f"{key}{number}.csv" for number in ("", *(f"_{n}" for n in range(2, 1000))))
            path = next(folder / name for name in names if not (folder / name).exists())
            self.put_setting([key], path.name)
        separators = [table.separator for table in self.tables.values() if isinstance(table, TextCells)]
        line = (separators or [","])[0].join(header)
        # with a mark, because Excel takes a file without it for its own 8-bit encoding
        table = TextCells(path, f"{line}\n".encode("utf-8-sig"), key)
        table.ids = ["", ""]
        self.tables[key], self.paths[key], self.data[path] = table, path, None

    def written(self) -> dict[Path, bytes]:
        """The files that are not as they were."""
        tables = {k: table for k, table in self.tables.items() if isinstance(table, TextCells)}
        files = {self.paths[key]: table.data() for key, table in tables.items() if not table.read_only}
        files[self.job] = self._text
        changed_files = {path: data for path, data in files.items() if data != self.data.get(path)}
        return {} if list(changed_files) == [self.job] and self._text == b"" else changed_files


Version = FilesVersion | WorkbookVersion


class JobFiles:
    """The job that a worksheet shows: its files are read and edited in place.

    Parameters
    ----------
    given
        A job (`.toml` or `.xlsx`), or a folder with one, or with none yet.

    Raises
    ------
    ValueError
        If there is no such file or folder, or several jobs in it.
    """

    def __init__(self, given: Path) -> None:
        self.job = job_in(Path(given))
        self._ids = itertools.count(1)
        self._known: dict[str, Cells] = {}
        self._stamps: dict[Path, object] = {}
        self._noticed: list[str] = []
        self._done: list[tuple[_Step, _Step]] = []
        self._undone: list[tuple[_Step, _Step]] = []
        self._take(self._version(self._read, {}))

    def files(self) -> list[Path]:
        """The job and its tables that exist."""
        return [path for path, data in self._now.data.items() if data is not None]

    def state(self) -> dict[str, Any]:
        """What the page shows, in types of JSON."""
        now = self._now
        tables = {}
        for key in (key for key in KEYS if key in now.tables):
            table = now.tables[key]
            rows = [
                {"id": table.ids[index], "row": number, "cells": cells}
                for index, (number, cells) in table.rows.items()
            ]
            tables[key] = {
                "file": table.name,
                "header": list(table.header),
                "rows": rows,
                "read_only": now.read_only or table.read_only,
            }
        return {
            "job": self.job.name,
            "folder": self.job.absolute().parent.name,
            "exists": now.data[self.job] is not None,
            "kind": "workbook" if is_workbook(self.job) else "files",
            "read_only": now.read_only,
            "tables": tables,
            "settings": now.settings,
            "undo": bool(self._done),
            "redo": bool(self._undone),
        }

    def place(self, file: str, row: int) -> tuple[str, str] | None:
        """The table and the id of the row that a message of the reader names."""
        for key, table in self._now.tables.items():
            folder = self._now.paths.get(key, self.job).resolve().parent
            if Path(file).name == table.name and Path(file).resolve().parent == folder:
                for index, (number, _) in table.rows.items():
                    if number == row:
                        return key, table.ids[index]
        return None

    def look(self) -> list[str]:
        """Names of the files that another program has changed since the last look."""
        names, self._noticed = self._noticed, []
        for path, known in self._now.data.items():
            stamp = _stamp(path)
            if stamp is None or stamp != self._stamps.get(path):
                try:
                    same = self._read(path) == known
                except ValueError:  # another program is at it
                    continue
                names += [] if same else [path.name]
                self._stamps[path] = stamp
        if names:
            self._take(self._version(self._read, {}))
        return list(dict.fromkeys(names))

    def apply(self, edits: Sequence[Mapping[str, Any]]) -> list[str | None]:
        """Carry out edits, all or none, as one step of undo; the ids of new rows.

        Raises
        ------
        Conflict
            If a cell does not hold any more what the edit says.
        ValueError
            If an edit is impossible, or a file cannot be written.
        """
        for _ in range(MOST_TRIES):
            version = self._version(self._read, {})
            before = {key: list(table.ids) for key, table in version.tables.items()}
            known = dict(version.data)
            try:
                made = [self._edit(version, edit) for edit in edits]
            except (KeyError, TypeError, AttributeError) as error:
                raise ValueError(f"an edit of an unknown form: {error}") from error
            files = version.written()
            try:
                self._write(files, known)
            except _OutsideError:
                continue
            names = [path.name for path, data in known.items() if data != self._now.data.get(path, data)]
            self._noticed += names
            after = {key: list(table.ids) for key, table in version.tables.items()}
            self._take(self._version(partial(self._known_or_read, known | files), after))
            if files:
                old: Contents = {path: known.get(path) for path in files}
                self._done = [*self._done, (_Step(old, before), _Step(files, after))][-MOST_STEPS:]
                self._undone = []
            return made
        raise ValueError("another program goes on changing the files of the job: try again in a moment")

    def undo(self) -> None:
        """Take the last step back; ValueError where that is impossible."""
        if not self._done:
            raise ValueError("there is nothing to undo")
        before, after = self._done[-1]
        self._go(after, before, "undone")
        self._undone.append(self._done.pop())

    def redo(self) -> None:
        """Take the last step that was undone again; ValueError where that is impossible."""
        if not self._undone:
            raise ValueError("there is nothing to redo")
        before, after = self._undone[-1]
        self._go(before, after, "redone")
        self._done.append(self._undone.pop())

    def _go(self, here: _Step, there: _Step, done: str) -> None:
        for path, data in here.data.items():
            if self._read(path) != data:
                raise ValueError(
                    f"{path.name} was changed by another program after that step, which cannot be {done}"
                )
        try:
            self._write(there.data, here.data)
        except _OutsideError:
            raise ValueError("another program has just changed the files: try again") from None
        version = self._version(self._read, {})
        ids = {key: ids for key, ids in there.ids.items() if version.paths.get(key) in there.data}
        self._take(self._version(self._read, ids))

    def _known_or_read(self, known: Contents, path: Path) -> bytes | None:
        return known[path] if path in known else self._read(path)

    def _read(self, path: Path) -> bytes | None:
        try:
            return first_bytes(path, MOST_BYTES + 1)  # as it is now, whatever was read before
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ValueError(f"{path.name} cannot be read ({error.strerror or error})") from error

    def _version(self, read: Callable[[Path], bytes | None], ids: Mapping[str, Sequence[str]]) -> Version:
        version = (WorkbookVersion if is_workbook(self.job) else FilesVersion)(self.job, read)
        for key, table in version.tables.items():
            given = ids.get(key, ())
            fits = len(given) == len(table.lines) and all(given)
            table.ids = list(given) if fits else kept_ids(self._known.get(key), table.lines, self._new_id)
        return version

    def _new_id(self) -> str:
        return str(next(self._ids))

    def _take(self, version: Version) -> None:
        self._now = version
        self._known |= version.tables

    def _write(self, files: Contents, known: Contents) -> None:
        """Replace files, if they still hold what is known of them; None removes one."""
        for path in files:
            if not is_inside(path, self.job.parent):
                raise ValueError(f"{path.name} is not in the folder of the job")
            for name, program in ((f"~${path.name}", "Excel"), (f".~lock.{path.name}#", "LibreOffice")):
                if path.with_name(name).exists():
                    raise ValueError(_is_open(path, program, f" (if it is not open, delete {name})"))

        def last_look() -> None:
            if any(self._read(path) != known.get(path) for path in files):
                raise _OutsideError

        kept = {path: data for path, data in files.items() if data is not None}
        try:
            write_files(kept, last_look)
            if not kept:
                last_look()
            for path in files.keys() - kept.keys():
                path.unlink(missing_ok=True)
        except (InputError, PermissionError) as error:
            if isinstance(error.__cause__ or error, PermissionError):
                raise ValueError(_is_open(next(iter(kept or files)), "Excel", " or is protected")) from error
            raise
        finally:
            for path in files:
                self._stamps.pop(path, None)

    def _edit(self, version: Version, edit: Mapping[str, Any]) -> str | None:
        if version.read_only:
            raise ValueError(version.read_only)
        if "key" in edit:
            self._set(version, [str(part) for part in edit["key"]], edit)
            return None
        key = edit["create"] if "create" in edit else edit["table"]
        if "create" in edit:
            header = [str(name) for name in edit["header"]]
            if key not in KEYS or key in version.tables or not all(re.fullmatch(r"\w+", n) for n in header):
                raise ValueError(f"a table {key!r} cannot be made: there is one, or it has no such columns")
            version.create(key, header)
            return None
        if key not in version.tables:
            raise ValueError(f"the job has no table {key!r}")
        table = version.tables[key]
        if table.read_only:
            raise ValueError(table.read_only)
        if "row" in edit:
            _put(table, edit)
        elif "delete" in edit:
            index = _index(table, edit["delete"])
            now = table.cells(index)
            if "old" in edit and now != edit["old"]:
                raise Conflict(f"a row of {table.name} was changed meanwhile: it is not deleted", now)
            table.delete(index)
        else:
            row_id, after = self._new_id(), edit.get("after")
            cells = {name: str(text) for name, text in edit["cells"].items()}
            table.insert(table.ids.index(after) if after in table.ids else table.end, cells, row_id)
            return row_id
        return None

    def _set(self, version: Version, key: Sequence[str], edit: Mapping[str, Any]) -> None:
        now, new = setting(version.settings, key), edit["new"]
        if now == new:
            return
        if "old" in edit and now != edit["old"]:
            raise Conflict(f"{'.'.join(key)} was changed meanwhile: it is {now!r} now", now)
        version.put_setting(key, new)


def _put(table: Cells, edit: Mapping[str, Any]) -> None:
    index, column, new = _index(table, edit["row"]), str(edit["column"]), clean(str(edit["new"]))
    now = table.cells(index)[table.column(column)]
    if now == new or now.replace(",", ".") == new.replace(",", ".") != clean(str(edit["old"])):
        return
    if now != clean(str(edit["old"])):
        raise Conflict(f"{column} in a row of {table.name} was changed meanwhile: it is {now!r} now", now)
    table.put(index, column, new)


def _index(table: Cells, row_id: str) -> int:
    if row_id not in table.ids:
        raise Conflict(f"the row of {table.name} is not there any more", None)
    return table.ids.index(row_id)


def _is_open(path: Path, program: str, hint: str) -> str:
    return f"{path.name} is open in {program}{hint}: close it there, then type again; nothing was changed"


def _stamp(path: Path) -> object:
    """What tells that a file is as it was; None where nothing does."""
    try:
        found = path.stat()
    except OSError:
        return ()
    old = time.time() - found.st_mtime > FRESH
    return (found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino) if old else None


def is_inside(path: Path, folder: Path) -> bool:
    """Whether a file, behind its links, is in a folder."""
    return path.resolve().is_relative_to(folder.resolve())


def job_in(given: Path) -> Path:
    """The job of a worksheet: the file that is given, or the only one of a folder, or one to be made.

    Raises
    ------
    ValueError
        If there is none, or several.
    """
    if not given.is_dir():
        if given.suffix.lower() not in (".toml", *SUFFIXES):
            raise ValueError(f"{given}: a folder or a job (.toml or .xlsx) is needed")
        if not given.is_file() and (is_workbook(given) or not given.parent.is_dir()):
            raise ValueError(f"{given}: there is no such file")
        return given
    found = [path for path in sorted(given.iterdir()) if path.name[0] not in "~." and _is_job(path)]
    if len(found) > 1:
        raise ValueError(
            f"{given} holds {listing([path.name for path in found], 'and')}: name the one to open"
        )
    return found[0] if found else given / "job.toml"


def _is_job(path: Path) -> bool:
    try:
        if path.suffix.lower() == ".toml":
            return isinstance(settings_in(file_content(path)).get("runs"), str)
        if is_workbook(path):
            with zipfile.ZipFile(path) as archive:
                return (
                    re.search(rb'<sheet [^>]*name="runs"', archive.read("xl/workbook.xml"), re.I) is not None
                )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        pass
    return False
