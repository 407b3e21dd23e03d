"""A job on disk: single cells changed in its files, undo and redo, changes from outside noticed."""

from __future__ import annotations

import itertools
import os
import re
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from rotorid.base.text import listing
from rotorid.files.cells import clean
from rotorid.files.excel_workbook import SUFFIXES, is_workbook
from rotorid.files.input_file import MOST_BYTES, file_content, first_bytes
from rotorid.files.job_models import named_tables
from rotorid.files.problems import InputError
from rotorid.files.table_writing import write_files
from rotorid.worksheet.settings_cells import changed, setting, settings_in
from rotorid.worksheet.text_cells import KEYS, Cells, TextCells, kept_ids
from rotorid.worksheet.workbook_cells import WorkbookVersion

MOST_STEPS, MOST_TRIES = 200, 5
FRESH = 2.0
"""Seconds after a change in which another one may leave a file's time as it is."""
_NONE: Mapping[str, int] = {}
Contents = Mapping[Path, bytes | None]
"""What files hold; None: there is no such file."""


class Conflict(ValueError):
    """A cell was changed meanwhile; `now` is what it holds."""

    def __init__(self, message: str, now: Any) -> None:  # noqa: ANN401  any type of JSON
        super().__init__(message)
        self.now = now


class _OutsideError(Exception):
    """A file was changed while it was about to be replaced."""


class _Step(NamedTuple):
    """What changed files hold before or after a step, and the ids of their rows."""

    data: Contents
    ids: Mapping[str, list[str]]


class FilesVersion:
    """A job of files as `read` gives them; edits change this copy, not the files."""

    def __init__(self, job: Path, read: Callable[[Path], bytes | None]) -> None:
        self.job, self._read = job, read
        self.data: dict[Path, bytes | None] = {job: read(job)}
        self.tables: dict[str, Cells] = {}
        self.paths: dict[str, Path] = {}
        self.settings: dict[str, Any] = {}
        self.read_only, self._text = "", self.data[job] or b""
        if self.data[job] is None:  # its first edit writes down the names of the tables that are there
            self.data |= {path: read(path) for path in (job.parent / f"{key}.csv" for key in KEYS[:2])}
            names = [path.stem for path, data in self.data.items() if data is not None]
            self._text = "".join(f'{name} = "{name}.csv"\n' for name in names if "runs" in names).encode()
        try:
            self.settings = settings_in(self._text)
        except ValueError as error:
            self.read_only = f"{job.name} cannot be read, correct it there: {error}"
        for key, name in (*named_tables(self.settings).items(), ("rotor", self.settings.get("rotor"))):
            if isinstance(name, str) and name.isprintable():
                self._open(key, job.parent / name)

    def _open(self, key: str, path: Path) -> None:
        others = [other for other in self.tables if self.paths.get(other) == path]
        try:
            self.data[path], self.paths[key] = None, path  # while it cannot be read
            self.data[path] = self._read(path)
            if others:
                raise ValueError(f"{path.name} is the table of {others[0]}, too: edit it there")
            if path.suffix.lower() in (".toml", *SUFFIXES):
                raise ValueError(
                    f"{path.name} is no text table: it is read as it is, edit it where it comes from"
                )
            if key in KEYS and (data := self.data[path]):
                self.tables[key] = TextCells(path, data, key)
        except ValueError as error:
            if key in KEYS:
                self.tables[key] = Cells(path.name, str(error))

    def put_setting(self, key: Sequence[str], new: Any) -> None:  # noqa: ANN401
        """Change, add or (None) remove a setting."""
        self._text = changed(self._text, key, new)
        self.settings = settings_in(self._text)

    def create(self, key: str, header: Sequence[str]) -> None:
        """Begin a table in a file that the job names then."""
        path = self.paths.get(key)
        if path is None:
            paths = (
                self.job.with_name(f"{key}{end}.csv") for end in ("", *(f"_{n}" for n in range(2, 1000)))
            )
            path = next(path for path in paths if not path.exists())
            self.put_setting([key], path.name)
        separators = [table.separator for table in self.tables.values() if isinstance(table, TextCells)]
        # with a mark, because Excel takes a file without it for its own 8-bit encoding
        line = (separators or [","])[0].join(header)
        self.tables[key] = TextCells(path, f"{line}\n".encode("utf-8-sig"), key)
        self.paths[key] = path
        self.data.setdefault(path, None)
        if self.tables[key].read_only:
            raise ValueError(self.tables[key].read_only)

    def written(self) -> dict[Path, bytes]:
        """The files that are not as they were."""
        texts = {key: table for key, table in self.tables.items() if isinstance(table, TextCells)}
        files = {self.paths[key]: table.data() for key, table in texts.items() if not table.read_only}
        files[self.job] = self._text
        return {path: data for path, data in files.items() if data != (self.data[path] or b"")}


Version = FilesVersion | WorkbookVersion


class JobFiles:
    """The job that a worksheet shows: its files are read and edited in place.

    Parameters
    ----------
    given
        A job (`.toml` or `.xlsx`), or a folder with one, or with none yet; ValueError for any other.
    """

    def __init__(self, given: Path) -> None:
        self.job = _job_in(Path(given)).absolute()
        self._others: dict[str, int] = {}
        self._ids = itertools.count(1)
        self._known: dict[str, Cells] = {}
        self._stamps: dict[Path, object] = {}
        self._noticed: list[str] = []
        self._done: list[tuple[_Step, _Step]] = []
        self._undone: list[tuple[_Step, _Step]] = []
        self._now = self._version()
        self._known = dict(self._now.tables)

    def files(self) -> list[Path]:
        """The job and its tables that exist."""
        return [path for path, data in self._now.data.items() if data is not None]

    def state(self) -> dict[str, Any]:
        """What the page shows, in types of JSON."""
        now = self._now
        return {
            "job": self.job.name,
            "folder": self.job.parent.name,
            "exists": now.data[self.job] is not None,
            "kind": "workbook" if is_workbook(self.job) else "files",
            "read_only": now.read_only,
            "tables": {key: _shown(now.tables[key], now.read_only) for key in KEYS if key in now.tables},
            "settings": now.settings,
            "undo": bool(self._done),
            "redo": bool(self._undone),
        }

    def place(self, file: str, row: int) -> tuple[str, str] | None:
        """The table and the id of the row that a message of the reader names."""
        for key, table in self._now.tables.items():
            pair = self._now.paths.get(key, self.job), self.job.parent / file
            if Path(file).name == table.name and len({os.path.realpath(path.parent) for path in pair}) == 1:
                return next(((key, table.ids[i]) for i, (n, _) in table.rows.items() if n == row), None)
        return None

    def look(self, others: Mapping[str, int] = _NONE) -> list[str]:
        """Names of the files that another program has changed since the last look; of others by the time."""
        for path, known in self._now.data.items():
            stamp = _stamp(path)
            if stamp is None or stamp != self._stamps.get(path):
                with suppress(ValueError):  # another program is at the job
                    try:
                        data = self._read(path)
                    except ValueError:
                        data = known if path == self.job else None  # as a version has it
                    if data != known:
                        self._settle({}, {}, {})
                        break
                    self._stamps[path] = stamp
        for name, read in others.items():
            path = self.job.parent / name
            changed = path.stat().st_mtime_ns if path.exists() else 0
            if path not in self._now.data and changed != self._others.get(name, read):
                self._noticed.append(path.name)
            self._others[name] = changed
        names, self._noticed = list(dict.fromkeys(self._noticed)), []
        return names

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
            version = self._version()
            before = _Step(
                dict(version.data), {key: list(table.ids) for key, table in version.tables.items()}
            )
            try:
                made = [self._edit(version, edit) for edit in edits]
            except (LookupError, TypeError, AttributeError) as error:
                raise ValueError(f"an edit of an unknown form: {error}") from error
            after = _Step(version.written(), {key: table.ids for key, table in version.tables.items()})
            try:
                self._write(after.data, before.data)
            except _OutsideError:
                continue
            self._settle(before.data, after.data, after.ids)
            if after.data:
                before = before._replace(data={path: before.data.get(path) for path in after.data})
                self._done, self._undone = [*self._done[1 - MOST_STEPS :], (before, after)], []
            return made
        raise ValueError("another program goes on changing the files of the job: try again in a moment")

    def undo(self) -> None:
        """Take the last step back; ValueError where that is impossible."""
        self._go(self._done, self._undone, "undo", 0)

    def redo(self) -> None:
        """Do the last step that was undone again; ValueError where that is impossible."""
        self._go(self._undone, self._done, "redo", 1)

    def _go(
        self, steps: list[tuple[_Step, _Step]], others: list[tuple[_Step, _Step]], word: str, to: int
    ) -> None:
        if not steps:
            raise ValueError(f"there is nothing to {word}")
        here, there = steps[-1][1 - to], steps[-1][to]
        try:
            self._write(there.data, here.data)
        except _OutsideError as error:
            raise ValueError(f"{error} was changed by another program after that step: no {word}") from None
        self._settle(here.data, there.data, there.ids)
        others.append(steps.pop())

    def _read(self, path: Path) -> bytes | None:
        if path != self.job and not _is_inside(path, self.job):
            raise ValueError(f"{path.name} is not in the folder of the job: copy it there to edit it here")
        try:
            return first_bytes(path, MOST_BYTES + 1)  # as it is now, whatever was read before
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ValueError(f"{path.name} cannot be read ({error.strerror or error})") from error

    def _version(self, files: Contents | None = None, ids: Mapping[str, list[str]] | None = None) -> Version:
        """The job as it is on disk; `ids` of tables in `files`, which have just been written, are known."""
        version = (WorkbookVersion if is_workbook(self.job) else FilesVersion)(self.job, self._read)
        for key, table in version.tables.items():
            known = (ids or {}).get(key, []) if version.paths.get(key) in (files or {}) else []
            fits = len(known) == len(table.lines) and all(known)
            table.ids = list(known) if fits else kept_ids(self._known.get(key), table.lines, self._ids)
        return version

    def _settle(self, known: Contents, files: Contents, ids: Mapping[str, list[str]]) -> None:
        """Take what is on disk, where `files` replaced `known`; notice what another program has changed."""
        was = self._now.data
        self._now = self._version(files, ids)
        self._known |= {key: table for key, table in self._now.tables.items() if table.lines}
        expected = {**self._now.data, **was, **known, **files}
        outside = [path for path, data in known.items() if data != was.get(path, data)]
        outside += [path for path, data in self._now.data.items() if data != expected[path]]
        self._noticed += [path.name for path in outside]

    def _write(self, files: Contents, known: Contents) -> None:
        """Replace files, if they still hold what is known of them; None removes one."""
        for path in files:
            if not _is_inside(path, self.job):
                raise ValueError(f"{path.name} is not in the folder of the job")
            for name, program in ((f"~${path.name}", "Excel"), (f".~lock.{path.name}#", "LibreOffice")):
                if path.with_name(name).exists():
                    raise ValueError(_is_open(path, program, f" (if it is not, delete {name})"))

        def last_look() -> None:
            for path in files:
                if self._read(path) != known.get(path):
                    raise _OutsideError(path.name)

        kept = {path: data for path, data in files.items() if data is not None}
        try:
            last_look()
            write_files(kept, last_look)
            for path in files.keys() - kept.keys():
                path.unlink(missing_ok=True)
        except (InputError, PermissionError) as error:
            self._put_back(files, known)
            cause = error.__cause__ or error
            failed = Path(error.problems[0].file if isinstance(error, InputError) else error.filename)
            if isinstance(cause, PermissionError):
                raise ValueError(_is_open(failed, "Excel", " or protected")) from error
            raise ValueError(f"{failed.name} is not written: {getattr(cause, 'strerror', cause)}") from error

    def _put_back(self, files: Contents, known: Contents) -> None:
        """What a step had written or removed before it failed."""
        done = [path for path, data in files.items() if data == self._read(path) != known.get(path)]
        write_files({path: data for path in done if (data := known.get(path)) is not None})
        for path in done:
            if known.get(path) is None:
                path.unlink()

    def _edit(self, version: Version, edit: Mapping[str, Any]) -> str | None:
        if version.read_only:
            raise ValueError(version.read_only)
        if "key" in edit:
            key, new = [str(part) for part in edit["key"]], edit["new"]
            if not _is_done(setting(version.settings, key), new, edit, ".".join(key)):
                version.put_setting(key, new)
            return None
        if "create" in edit:
            known = edit["create"] in KEYS and edit["create"] not in version.tables
            if not known or not all(re.fullmatch(r"\w+", name) for name in edit["header"]):
                raise ValueError(
                    f"a table {edit['create']!r} cannot be made: there is one, or none of this name"
                )
            version.create(edit["create"], edit["header"])
            table = version.tables[edit["create"]]
            table.ids = kept_ids(None, table.lines, self._ids)
            return None
        table = version.tables[edit["table"]]
        if table.read_only:
            raise ValueError(table.read_only)
        if "cells" in edit:
            row_id, after = str(next(self._ids)), table.index(edit.get("after"))
            cells = {name: str(text) for name, text in edit["cells"].items()}
            table.insert(table.end if after is None else after, cells, row_id)
            return row_id
        index = table.index(edit.get("row") or edit["delete"])
        if index is None:
            raise Conflict(f"a row of {table.name} is not there any more", None)
        now = table.cells(index)
        if "delete" in edit:
            _is_done(now, None, edit, f"a row of {table.name}")
            table.delete(index)
            return None
        place, column, new = table.column(edit["column"]), edit["column"], clean(str(edit["new"]))
        said = {"old": clean(str(edit["old"]))} if "old" in edit else {}
        if not _is_done(now[place], new, said, f"{column} in a row of {table.name}"):
            table.put(index, column, new)
        return None


def _is_done(now: Any, new: Any, edit: Mapping[str, Any], what: str) -> bool:  # noqa: ANN401
    """Whether a value is the new one already; Conflict if it is not the old one either."""
    if now != new and now != edit.get("old", now):
        raise Conflict(
            f"{what} was changed meanwhile: {'nothing' if now is None else now!r} is there now", now
        )
    return bool(now == new)


def _shown(table: Cells, read_only: str) -> dict[str, Any]:
    rows = [{"id": table.ids[i], "row": number, "cells": cells} for i, (number, cells) in table.rows.items()]
    why = read_only or table.read_only
    return {"file": table.name, "header": list(table.header), "rows": rows, "read_only": why}


def _is_open(path: Path, program: str, hint: str) -> str:
    return f"{path.name} is open in {program}{hint}: close it there, then try again; nothing was changed"


def _is_inside(path: Path, job: Path) -> bool:
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(job.parent))


def _stamp(path: Path) -> object:
    """What tells that a file is as it was; None where nothing does."""
    try:
        found = path.stat()
    except OSError:
        return ()
    old = time.time() - found.st_mtime > FRESH
    return (found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino) if old else None


def _job_in(given: Path) -> Path:
    """The file that is given, or the only job of a folder, or one to be made there, and the folder, too."""
    if not given.suffix and not given.exists() and given.parent.is_dir():
        given.mkdir()
    if not given.is_dir():
        there = given.is_file() or (given.suffix.lower() == ".toml" and given.parent.is_dir())
        if given.suffix.lower() not in (".toml", *SUFFIXES) or not there:
            raise ValueError(f"{given}: expected a folder, or a job (.toml or .xlsx) that exists")
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
        with zipfile.ZipFile(path) as archive:
            return bool(re.search(rb'(?i)<sheet [^>]*name="runs"', archive.read("xl/workbook.xml")))
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return False
