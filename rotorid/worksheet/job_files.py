"""A job in memory, whole files written at each change; undo, changes of other programs noticed."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rotorid.base.text import listing
from rotorid.files.cells import Grid, clean
from rotorid.files.disk import MOST_BYTES, file_content, first_bytes, write_files
from rotorid.files.excel_workbook import SUFFIXES, is_workbook
from rotorid.files.job_excel import open_job
from rotorid.files.job_models import named_tables
from rotorid.files.problems import InputError, Problems
from rotorid.worksheet.job_settings import setting, settings_in, with_setting
from rotorid.worksheet.text_table import Table, read_table, shown

KEYS = ("runs", "weights", "check", "check_weights")
"""Tables that are shown."""
MOST_STEPS, MOST_TRIES = 200, 5
_NONE: Mapping[str, int] = {}


class Conflict(ValueError):
    """A cell was changed meanwhile; `now` is what it holds."""

    def __init__(self, message: str, now: Any) -> None:  # noqa: ANN401  any type of JSON
        super().__init__(message)
        self.now = now


class _OutsideError(Exception):
    """A file was changed while it was about to be replaced."""


@dataclass(frozen=True, eq=False)
class Version:
    """A job at one moment; an edit makes the next.

    Attributes
    ----------
    text
        The job file; None before there is one.
    settings, tables
        What it says, and its tables by `KEYS`.
    read_only
        Why nothing can be edited, else empty.
    """

    text: bytes | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    tables: Mapping[str, Table] = field(default_factory=dict)
    read_only: str = ""

    def with_table(self, key: str, table: Table) -> Version:
        """With another table."""
        return replace(self, tables={**self.tables, key: table})

    def with_setting(self, key: Sequence[str], new: Any) -> Version:  # noqa: ANN401
        """With another setting, None: without it."""
        text = with_setting(self.text or b"", key, new)
        return replace(self, text=text, settings=settings_in(text))


class JobFiles:
    """The job that a worksheet shows.

    Parameters
    ----------
    given
        A job (`.toml` or `.xlsx`), or a folder with one, or with none yet; ValueError for any other.
    """

    def __init__(self, given: Path) -> None:
        self.job = _job_in(Path(given)).absolute()
        self._ids = map(str, itertools.count(1))
        self._disk: dict[Path, bytes | None] = {}
        self._stamps: dict[Path, object] = {}
        self._others: dict[str, int] = {}
        self._noticed: list[str] = []
        self._tables: dict[str, Table] = {}
        self._now = self._read_job()
        self._done: list[Version] = []
        self._undone: list[Version] = []

    def state(self) -> dict[str, Any]:
        """What the page shows, in types of JSON."""
        now = self._now
        return {
            "job": self.job.name,
            "folder": self.job.parent.name,
            "exists": now.text is not None,
            "read_only": now.read_only,
            "tables": {
                key: {
                    "file": table.path.name,
                    "header": list(table.header),
                    "rows": [
                        {"id": one.id, "row": n, "cells": list(one.cells or ())} for n, one in table.rows()
                    ],
                    "read_only": now.read_only or table.read_only,
                }
                for key, table in now.tables.items()
            },
            "settings": now.settings,
            "undo": bool(self._done),
            "redo": bool(self._undone),
        }

    def place(self, file: str, row: int | None) -> tuple[str, str] | None:
        """The table and the id of the row that a message of the reader names."""
        for key, table in self._now.tables.items():
            if self.job.parent / file == table.path:
                return next(((key, line.id) for n, line in table.rows() if n == row), None)
        return None

    def look(self, others: Mapping[str, int] = _NONE) -> list[str]:
        """Names of the files that another program has changed since the last look; of others by the time."""
        for path, held in self._disk.items():
            stamp = _stamp(path)
            if stamp != self._stamps.get(path):
                data = None
                with suppress(ValueError):
                    data = self._read(path)
                if data != held:
                    self._reload()
                    break
                self._stamps[path] = stamp
        for name, read in others.items():
            path = self.job.parent / name
            changed = path.stat().st_mtime_ns if path.exists() else 0
            if path not in self._disk and changed != self._others.get(name, read):
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
            version, made = self._now, []
            try:
                for edit in edits:
                    version, row_id = self._edited(version, edit)
                    made.append(row_id)
            except (LookupError, TypeError, AttributeError) as error:
                raise ValueError(f"an edit of an unknown form: {error}") from error
            before = self._now
            with suppress(_OutsideError):
                if self._write(version):
                    self._done, self._undone = [*self._done[1 - MOST_STEPS :], before], []
                return made
            self._reload()
        raise ValueError("another program goes on changing the files of the job: try again in a moment")

    def undo(self) -> None:
        """Go back to the version before the last step; ValueError where that is impossible."""
        self._go(self._done, self._undone, "undo")

    def redo(self) -> None:
        """Go forth to the version that was undone; ValueError where that is impossible."""
        self._go(self._undone, self._done, "redo")

    def _go(self, versions: list[Version], others: list[Version], word: str) -> None:
        if not versions:
            raise ValueError(f"there is nothing to {word}")
        before = self._now
        try:
            self._write(versions[-1])
        except _OutsideError as error:
            self._reload()
            raise ValueError(f"{error} was changed by another program after that step: no {word}") from None
        versions.pop()
        others.append(before)

    def _read(self, path: Path) -> bytes | None:
        if path != self.job and not _is_inside(path, self.job):
            raise ValueError(f"{path.name} is not in the folder of the job: copy it there to edit it here")
        try:
            return first_bytes(path, MOST_BYTES + 1)  # as it is now, whatever was read before
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ValueError(f"{path.name} cannot be read ({error.strerror or error})") from error

    def _read_job(self) -> Version:
        """The job as it is on disk."""
        job, self._disk = self.job, {}
        text = None
        try:
            text = self._disk[job] = self._read(job)
            version = self._read_workbook() if is_workbook(job) else self._read_files(text)
        except InputError as error:
            version = Version(text, read_only=str(error))
        except ValueError as error:
            self._disk.setdefault(job, None)
            version = Version(text or b"", read_only=f"{job.name} cannot be read, correct it there: {error}")
        pairs = version.tables.items()
        tables = {key: table.with_ids(self._tables.get(key), self._ids) for key, table in pairs}
        self._tables |= {key: table for key, table in tables.items() if table.lines}
        return replace(version, tables=tables)

    def _read_files(self, text: bytes | None) -> Version:
        folder, tables = self.job.parent, {}
        settings = settings_in(text or b"")
        if text is None:  # its first edit writes down the names of the tables that are there
            settings = {key: f"{key}.csv" for key in KEYS[:2] if (folder / f"{key}.csv").exists()}
            text = "".join(f'{key} = "{name}"\n' for key, name in settings.items()).encode() or None
        for key, name in (*named_tables(settings).items(), ("rotor", settings.get("rotor"))):
            if not isinstance(name, str) or not name.isprintable():
                continue
            path = folder / name
            twice = path in self._disk
            try:
                self._disk[path] = None  # while it cannot be read
                data = self._disk[path] = self._read(path)
                if twice or path.suffix.lower() in (".toml", *SUFFIXES):
                    raise ValueError(f"{name} is no table of its own: edit it where it comes from")
                if key in KEYS and data:
                    tables[key] = read_table(path, key, data)
            except ValueError as error:
                if key in KEYS:
                    tables[key] = Table(path, read_only=str(error))
        return Version(text, settings, tables)

    def _read_workbook(self) -> Version:
        """A job in sheets, which are only shown."""
        why, problems = f"edit {self.job.name} in Excel: what is saved there appears here", Problems()
        written = open_job(self.job, problems)
        tables = {
            key: replace(shown(self.job.parent / grid.source, key, grid), read_only=why)
            for key in KEYS
            if isinstance(grid := written.tables.get(key), Grid)
        }
        return Version(self._disk[self.job], written.settings, tables, why)

    def _reload(self) -> None:
        """Take what is on disk; what another program has changed is noticed, and ends undo."""
        before = self._disk
        self._now, self._done, self._undone = self._read_job(), [], []
        both = [path for path in before if path in self._disk]
        self._noticed += [path.name for path in both if self._disk[path] != before[path]]

    def _files(self, version: Version) -> dict[Path, bytes | None]:
        tables = version.tables.values()
        return {self.job: version.text, **{one.path: one.data() for one in tables if not one.read_only}}

    def _write(self, version: Version) -> bool:
        """Make the files those of a version; whether any was another."""
        new, old = self._files(version), self._files(self._now)
        files = {path: data for path, data in new.items() if path not in old or data != old[path]}
        files |= dict.fromkeys(old.keys() - new.keys())
        if not files:
            return False
        for path in files:
            if not _is_inside(path, self.job):
                raise ValueError(f"{path.name} is not in the folder of the job")
            for name, program in ((f"~${path.name}", "Excel"), (f".~lock.{path.name}#", "LibreOffice")):
                if path.with_name(name).exists():
                    raise ValueError(_is_open(path, program, f" (if it is not, delete {name})"))
        try:
            self._replace(files)
        except (InputError, PermissionError) as error:
            with suppress(InputError, OSError, _OutsideError):
                self._put_back(files)
            cause = error.__cause__ or error
            failed = Path(error.problems[0].file if isinstance(error, InputError) else error.filename)
            if isinstance(cause, PermissionError):
                raise ValueError(_is_open(failed, "Excel", " or protected")) from error
            raise ValueError(f"{failed.name} is not written: {getattr(cause, 'strerror', cause)}") from error
        self._disk |= files
        self._now, self._tables = version, {**self._tables, **version.tables}
        return True

    def _replace(self, files: Mapping[Path, bytes | None]) -> None:
        def last_look() -> None:
            for path in files:
                if self._read(path) != self._disk.get(path):
                    raise _OutsideError(path.name)

        last_look()
        write_files({path: data for path, data in files.items() if data is not None}, last_look)
        for path, data in files.items():
            if data is None:
                path.unlink(missing_ok=True)

    def _put_back(self, files: Mapping[Path, bytes | None]) -> None:
        """What a step had written or removed before it failed."""
        done = [path for path, data in files.items() if data == self._read(path) != self._disk.get(path)]
        write_files({path: data for path in done if (data := self._disk.get(path)) is not None})
        for path in done:
            if self._disk.get(path) is None:
                path.unlink()

    def _edited(self, version: Version, edit: Mapping[str, Any]) -> tuple[Version, str | None]:
        if version.read_only:
            raise ValueError(version.read_only)
        if "key" in edit:
            key, new = [str(part) for part in edit["key"]], edit["new"]
            done = _is_done(setting(version.settings, key), new, edit, ".".join(key))
            return version if done else version.with_setting(key, new), None
        if "create" in edit:
            return self._with_new_table(version, edit["create"], edit["header"]), None
        table = version.tables[edit["table"]]
        if table.read_only:
            raise ValueError(table.read_only)
        if "cells" in edit:
            row_id = next(self._ids)
            cells = {name: str(text) for name, text in edit["cells"].items()}
            return version.with_table(edit["table"], table.with_row(edit.get("after"), cells, row_id)), row_id
        line = table.row(edit.get("row") or edit["delete"])
        if line is None or line.cells is None:
            raise Conflict(f"a row of {table.path.name} is not there any more", None)
        if "delete" in edit:
            expected: dict[str, Any] = {"old": tuple(edit["old"])} if "old" in edit else {}
            _is_done(line.cells, None, expected, f"a row of {table.path.name}")
            return version.with_table(edit["table"], table.without(line)), None
        column, new = edit["column"], clean(str(edit["new"]))
        old = {"old": clean(str(edit["old"]))} if "old" in edit else {}
        now = line.cells[table.column(column)]
        if not _is_done(now, new, old, f"{column} in a row of {table.path.name}"):
            version = version.with_table(edit["table"], table.with_cells(line, {column: new}))
        return version, None

    def _with_new_table(self, version: Version, key: str, header: Sequence[str]) -> Version:
        """Begin a table in a file that the job names then."""
        if key not in KEYS or key in version.tables or not all(re.fullmatch(r"\w+", one) for one in header):
            raise ValueError(f"a table {key!r} cannot be made: there is one, or none of this name")
        name = named_tables(version.settings).get(key)
        if name is None:
            names = (f"{key}{end}.csv" for end in ("", *(f"_{n}" for n in range(2, 1000))))
            name = next(name for name in names if not self.job.with_name(name).exists())
            version = version.with_setting([key], name)
        separators = [one.separator for one in version.tables.values() if one.lines]
        line = (separators or [","])[0].join(header)
        # with a mark, because Excel takes a file without it for its own 8-bit encoding
        made = read_table(self.job.with_name(name), key, f"{line}\n".encode("utf-8-sig"))
        if made.read_only:
            raise ValueError(made.read_only)
        return version.with_table(key, made.with_ids(None, self._ids))


def _is_done(now: Any, new: Any, edit: Mapping[str, Any], what: str) -> bool:  # noqa: ANN401
    """Whether a value is the new one already; Conflict if it is not the old one either."""
    if now != new and now != edit.get("old", now):
        there = "nothing" if now is None else repr(now)
        raise Conflict(f"{what} was changed meanwhile: {there} is there now", now)
    return bool(now == new)


def _is_open(path: Path, program: str, hint: str) -> str:
    return f"{path.name} is open in {program}{hint}: close it there, then try again; nothing was changed"


def _is_inside(path: Path, job: Path) -> bool:
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(job.parent))


def _stamp(path: Path) -> tuple[int, ...]:
    """What tells that a file is as it was."""
    try:
        at = path.stat()
    except OSError:
        return ()
    return at.st_mtime_ns, at.st_ctime_ns, at.st_size, at.st_ino


def _job_in(given: Path) -> Path:
    """The file that is given, or the only job of a folder, or one to be made there, and the folder, too."""
    if not given.suffix and not given.exists() and given.parent.is_dir():
        given.mkdir()
    if not given.is_dir():
        there = given.is_file() or (given.suffix.lower() == ".toml" and given.parent.is_dir())
        if given.suffix.lower() not in (".toml", *SUFFIXES) or not there:
            raise ValueError(f"{given}: expected a folder, or a job (.toml or .xlsx) that exists")
        return given
    jobs = [path for path in sorted(given.glob("*.toml")) if path.name[0] != "." and _is_job(path)]
    if len(jobs) > 1:
        raise ValueError(
            f"{given} holds {listing([path.name for path in jobs], 'and')}: name the one to open"
        )
    return jobs[0] if jobs else given / "job.toml"


def _is_job(path: Path) -> bool:
    try:
        return isinstance(settings_in(file_content(path)).get("runs"), str)
    except (OSError, ValueError):
        return False
