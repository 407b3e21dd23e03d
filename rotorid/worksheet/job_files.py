"""A job in memory, whole files written at each change; undo, changes of other programs noticed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotorid.base.text import listing
from rotorid.files.cells import Grid, clean
from rotorid.files.disk import MOST_BYTES, SUFFIXES, file_content, first_bytes, is_workbook, write_files
from rotorid.files.job import open_job
from rotorid.files.job_models import named_tables
from rotorid.files.problems import InputError, Problems
from rotorid.worksheet.job_settings import setting, settings_in, text_of, value_of, with_setting
from rotorid.worksheet.text_table import Conflict, Line, Table, read_table, shown

KEYS = ("runs", "weights", "check", "check_weights")
"""Tables that are shown."""
MOST_STEPS, MOST_TRIES = 200, 5
Files = dict[Path, bytes | None]
"""What files hold; None: there is none."""
Stamp = tuple[int, ...]


class _OutsideError(Exception):
    """A file was changed while it was about to be replaced."""


@dataclass(eq=False)
class Job:
    """What the files of a job say, edited in place before they are written.

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
    tables: dict[str, Table] = field(default_factory=dict)
    read_only: str = ""

    def set(self, key: Sequence[str], new: Any) -> None:  # noqa: ANN401
        """Change a setting; None: remove it."""
        self.text = with_setting(self.text or b"", key, new)
        self.settings = settings_in(self.text)


class JobFiles:
    """The job that a worksheet shows.

    Parameters
    ----------
    given
        A job (`.toml` or `.xlsx`), or a folder with one, or with none yet; ValueError for any other.

    Attributes
    ----------
    job
        Its file.
    now
        What its files say.
    done
        What files held before each step that can be undone.
    """

    def __init__(self, given: Path) -> None:
        self.job = _job_in(Path(given)).absolute()
        self._held: Files = {}
        self._stamps: dict[Path, Stamp] = {}
        self._noticed: list[Path] = []
        self.done: list[Files] = []
        self.now = self._job()

    def place(self, file: str, row: int | None) -> tuple[str, str] | None:
        """The table and the id of the row that a message of the reader names."""
        tables = self.now.tables.items()
        ids = {(one.path, line.number): (key, line.id) for key, one in tables for line in one.rows()}
        return ids.get((self.job.parent / file, row or 0))

    def look(self, read: Mapping[str, Stamp] | None = None) -> list[str]:
        """Names of the files that another program has changed since the last look.

        Of further ones that were `read`, too, each with its stamp before that.
        """
        self._stamps = {self.job.parent / name: at for name, at in (read or {}).items()} | self._stamps
        changed = {path: now for path, at in self._stamps.items() if (now := stamp(path)) != at}
        self._stamps |= changed
        self._noticed += changed.keys() - self._held.keys()
        if changed:
            self._reload()
        names, self._noticed = list(dict.fromkeys(path.name for path in self._noticed)), []
        return names

    def apply(self, edits: Sequence[Mapping[str, Any]]) -> None:
        """Carry out edits, all or none, as one step of undo.

        Each is a `cell` with its `old` and `new` text, `cells` of a row that is added to a `table`, the row
        to `delete`, or a table to `create` with its `header`. A cell is called TABLE|ROW|COLUMN, a row
        TABLE|ROW, a setting KEY, KEY|KEY or KEY|NAME|KEY.

        Raises
        ------
        Conflict
            If a cell does not hold any more what the edit says.
        ValueError
            If an edit is impossible, or a file cannot be written.
        """
        for _ in range(MOST_TRIES):
            draft = self._job()
            try:
                for edit in edits:
                    self._edit(draft, edit)
            except (LookupError, TypeError, AttributeError) as error:
                raise ValueError(f"an edit of an unknown form: {error}") from error
            changed = {table.path: table.data() for table in draft.tables.values() if table.changed}
            with suppress(_OutsideError):
                if step := self._write({self.job: draft.text, **changed}):
                    self.done = [*self.done[1 - MOST_STEPS :], step]
                return
            self._reload()
        raise ValueError("another program goes on changing the files of the job: try again in a moment")

    def undo(self) -> None:
        """Go back to the files before the last step; ValueError where that is impossible."""
        if not self.done:
            raise ValueError("there is nothing to undo")
        try:
            self._write(self.done[-1])
        except _OutsideError as error:
            self._reload()
            raise ValueError(f"{error} was changed by another program after that step: no undo") from None
        self.done.pop()

    def _read(self, path: Path) -> bytes | None:
        """What a file holds now; ValueError if it is outside of the folder or cannot be read."""
        inside = Path(os.path.realpath(path)).is_relative_to(os.path.realpath(self.job.parent))
        if path != self.job and not inside:
            raise ValueError(f"{path.name} is not in the folder of the job: copy it there to edit it here")
        try:
            return first_bytes(path, MOST_BYTES + 1)  # as it is now, whatever was read before
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ValueError(f"{path.name} cannot be read ({error.strerror or error})") from error

    def _reload(self) -> None:
        """Take what is on disk; what another program has changed is noticed, and ends undo."""
        before, self._held = self._held, {}
        self.now = self._job()
        changed = [path for path, data in before.items() if self._held.get(path, data) != data]
        self._noticed += changed
        if changed:
            self.done = []

    def _content(self, path: Path) -> bytes | None:
        """What is held of a file, which is read where nothing is."""
        if self._held.get(path) is None:
            self._stamps.setdefault(path, stamp(path))
            self._held[path] = None  # also where it cannot be read
            self._held[path] = self._read(path)
        return self._held[path]

    def _job(self) -> Job:
        """What the files say that are held."""
        text = None
        try:
            text = self._content(self.job)
            return self._in_sheets() if is_workbook(self.job) else self._in_files(text)
        except InputError as error:
            return Job(text, read_only=str(error))
        except ValueError as error:
            return Job(text or b"", read_only=f"{self.job.name} cannot be read, correct it there: {error}")

    def _in_files(self, text: bytes | None) -> Job:
        folder, tables, settings = self.job.parent, dict[str, Table](), settings_in(text or b"")
        for key, name in named_tables(settings).items():
            path, others = folder / name, [table.path for table in tables.values()]
            if key not in KEYS or not name.isprintable():
                continue
            try:
                if path in others or path.suffix.lower() in (".toml", *SUFFIXES):
                    raise ValueError(f"{name} is no table of its own: edit it where it comes from")
                if data := self._content(path):
                    tables[key] = read_table(path, key, data)
            except ValueError as error:
                tables[key] = Table(path, read_only=str(error))
        return Job(text, settings, tables)

    def _in_sheets(self) -> Job:
        """A job in sheets, which are only shown."""
        why = f"edit {self.job.name} in Excel: what is saved there appears here"
        written = open_job(self.job, Problems())
        tables = {
            key: shown(self.job.parent / grid.source, key, grid)
            for key in KEYS
            if isinstance(grid := written.tables.get(key), Grid)
        }
        return Job(self._held[self.job], written.settings, tables, why)

    def _write(self, files: Files) -> Files:
        """Make files hold this, all or none; what those that held something else held before."""
        files = {path: data for path, data in files.items() if data != self._held.get(path)}
        before = {path: self._held.get(path) for path in files}
        for path in files:
            for name in (f"~${path.name}", f".~lock.{path.name}#"):
                if path.with_name(name).exists():
                    why = f"(if it is not, delete {name}): close it there, then try again"
                    raise ValueError(f"{path.name} is open in Excel or LibreOffice {why}")
        try:
            self._replace(files, before)
        except (InputError, OSError) as error:
            with suppress(ValueError, OSError, _OutsideError):
                done = {path: before[path] for path in files if self._read(path) == files[path]}
                self._replace(done, files)
            words = "where a file is open in Excel, close it there, then try again"
            raise ValueError(f"nothing was changed: {error}; {words}") from error
        self._held |= files
        self._stamps = dict.fromkeys(files, Stamp()) | self._stamps
        self.now = self._job()
        return before

    def _replace(self, files: Files, before: Files) -> None:
        """Write and remove files that hold now what they held before."""

        def last_look() -> None:
            for path in files:
                if self._read(path) != before[path]:
                    raise _OutsideError(path.name)

        last_look()
        write_files({path: data for path, data in files.items() if data is not None}, last_look)
        for path, data in files.items():
            if data is None:
                path.unlink(missing_ok=True)

    def _edit(self, draft: Job, edit: Mapping[str, Any]) -> None:
        """Carry out one edit on a draft."""
        if draft.read_only:
            raise ValueError(draft.read_only)
        if "create" in edit:
            self._create(draft, edit["create"], edit["header"])
            return
        whole = edit.get("table") or edit.get("delete") or edit["cell"]
        name, _, place = whole.partition("|")
        row, _, column = place.rpartition("|")
        if name not in KEYS:
            key = [part for part in (name, row, column) if part]
            if not _is_done(text_of(setting(draft.settings, key)), edit["new"], edit, ".".join(key)):
                draft.set(key, value_of(key[-1], edit["new"]))
            return
        table = draft.tables[name]
        if table.read_only:
            raise ValueError(table.read_only)
        if "cells" in edit:
            table.add({name: str(text) for name, text in edit["cells"].items()})
        elif "delete" in edit:
            table.lines.remove(table.row(place))
            table.changed = True
        else:
            line, new = table.row(row), clean(edit["new"])
            what = f"{column} in a row of {table.path.name}"
            if not _is_done(line.cells[table.column(column)], new, edit, what):
                table.write(line, {column: new})

    def _create(self, draft: Job, key: str, header: Sequence[str]) -> None:
        """Begin a table in a file that the job names then."""
        if key not in KEYS or key in draft.tables:
            raise ValueError(f"a table {key!r} cannot be made: there is one, or none of this name")
        name = named_tables(draft.settings).get(key)
        if name is None:
            names = (f"{key}{end}.csv" for end in ("", *range(2, 1000)))
            name = next(name for name in names if not self.job.with_name(name).exists())
            draft.set([key], name)
        separator = next((one.separator for one in draft.tables.values() if one.lines), ",")
        lines = [Line(separator.join(header), id="header"), Line()]
        # with a mark, because Excel takes a file without it for its own 8-bit encoding
        draft.tables[key] = Table(
            self.job.with_name(name), header, lines, separator=separator, encoding="utf-8-sig", changed=True
        )


def _is_done(now: str, new: str, edit: Mapping[str, Any], what: str) -> bool:
    """Whether a text is the new one already; Conflict if it is not the old one either."""
    if now not in (new, clean(edit.get("old", now))):
        raise Conflict(f"{what} was changed meanwhile: {now!r} is there now")
    return now == new


def stamp(path: Path) -> Stamp:
    """What tells that a file is as it was; empty: there is none."""
    try:
        at = path.stat()
    except OSError:
        return ()
    return at.st_mtime_ns, at.st_ctime_ns, at.st_size, at.st_ino


def _job_in(given: Path) -> Path:
    """The file that is given, or the only job of a folder, or one to be made there, and the folder, too."""
    kind = given.suffix.lower()
    if not kind and not given.exists() and given.parent.is_dir():
        given.mkdir()
    if given.is_dir():
        jobs = [path for path in sorted(given.glob("*.toml")) if path.name[0] != "." and _is_job(path)]
        if len(jobs) > 1:
            names = listing([path.name for path in jobs], "and")
            raise ValueError(f"{given} holds {names}: name the one to open")
        return [*jobs, given / "job.toml"][0]
    if kind not in (".toml", *SUFFIXES) or not (given.parent if kind == ".toml" else given).exists():
        raise ValueError(f"{given}: expected a folder, or a job (.toml or .xlsx) that exists")
    return given


def _is_job(path: Path) -> bool:
    try:
        return isinstance(settings_in(file_content(path)).get("runs"), str)
    except (OSError, ValueError):
        return False
