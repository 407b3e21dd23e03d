"""A job in memory, whole files written at each change; undo, changes of other programs noticed."""

from __future__ import annotations

import os
import re
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
from rotorid.worksheet.text_table import Line, Table, read_table, shown

KEYS = ("runs", "weights", "check", "check_weights")
"""Tables that are shown."""
MOST_STEPS, MOST_TRIES = 200, 5
Files = dict[Path, bytes | None]
"""What files hold; None: there is none."""


class Conflict(ValueError):
    """What an edit changes is not what it was."""


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
    done, undone
        What files held before each step that can be undone, and after each that can be done again.
    """

    def __init__(self, given: Path) -> None:
        self.job = _job_in(Path(given)).absolute()
        self._held: Files = {}
        self._stamps: dict[Path, object] = {}
        self._noticed: list[str] = []
        self.done: list[Files] = []
        self.undone: list[Files] = []
        self.now = self._job()

    def place(self, file: str, row: int | None) -> tuple[str, str] | None:
        """The table and the id of the row that a message of the reader names."""
        for key, table in self.now.tables.items():
            if self.job.parent / file == table.path:
                return next(((key, line.id) for line in table.rows() if line.number == row), None)
        return None

    def look(self, read: Mapping[str, int] | None = None) -> list[str]:
        """Names of the files that another program has changed since the last look.

        Of further ones that were `read`, each with the time (ns) at which it had been changed before.
        """
        for path, held in self._held.items():
            stamp = _stamp(path)
            if stamp != self._stamps.get(path):
                data = None
                with suppress(ValueError):
                    data = self._read(path)
                if data != held:
                    self._reload()
                    break
                self._stamps[path] = stamp
        for path, before in ((self.job.parent / name, time) for name, time in (read or {}).items()):
            if path not in self._held:
                changed = path.stat().st_mtime_ns if path.exists() else 0
                self._noticed += [path.name] * (changed != self._stamps.get(path, before))
                self._stamps[path] = changed
        names, self._noticed = list(dict.fromkeys(self._noticed)), []
        return names

    def apply(self, edits: Sequence[Mapping[str, Any]]) -> None:
        """Carry out edits, all or none, as one step of undo.

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
                    self.done, self.undone = [*self.done[1 - MOST_STEPS :], step], []
                return
            self._reload()
        raise ValueError("another program goes on changing the files of the job: try again in a moment")

    def undo(self) -> None:
        """Go back to the files before the last step; ValueError where that is impossible."""
        self._go(self.done, self.undone, "undo")

    def redo(self) -> None:
        """Go forth to the files that were undone; ValueError where that is impossible."""
        self._go(self.undone, self.done, "redo")

    def _go(self, steps: list[Files], others: list[Files], word: str) -> None:
        if not steps:
            raise ValueError(f"there is nothing to {word}")
        try:
            others.append(self._write(steps[-1]))
        except _OutsideError as error:
            self._reload()
            raise ValueError(f"{error} was changed by another program after that step: no {word}") from None
        steps.pop()

    def _read(self, path: Path) -> bytes | None:
        """What a file holds now; ValueError if it is outside of the folder or cannot be read."""
        if path != self.job and not self._is_inside(path):
            raise ValueError(f"{path.name} is not in the folder of the job: copy it there to edit it here")
        try:
            return first_bytes(path, MOST_BYTES + 1)  # as it is now, whatever was read before
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ValueError(f"{path.name} cannot be read ({error.strerror or error})") from error

    def _is_inside(self, path: Path) -> bool:
        return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(self.job.parent))

    def _reload(self) -> None:
        """Take what is on disk; what another program has changed is noticed, and ends undo."""
        before, self._held = self._held, {}
        self.done, self.undone = [], []
        self.now = self._job()
        changed = (path for path, data in before.items() if self._held.get(path, data) != data)
        self._noticed += [path.name for path in changed]

    def _content(self, path: Path) -> bytes | None:
        """What is held of a file, which is read where nothing is."""
        if self._held.setdefault(path, None) is None:
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
        folder, tables, seen = self.job.parent, dict[str, Table](), {self.job}
        settings = settings_in(text or b"")
        if text is None:  # its first edit writes down the names of the tables that are there
            settings = {key: f"{key}.csv" for key in KEYS[:2] if (folder / f"{key}.csv").exists()}
            text = "".join(f'{key} = "{name}"\n' for key, name in settings.items()).encode() or None
        for key, name in (*named_tables(settings).items(), ("rotor", settings.get("rotor"))):
            if not isinstance(name, str) or not name.isprintable():
                continue
            path = folder / name
            try:
                data = self._content(path)
                if path in seen or path.suffix.lower() in (".toml", *SUFFIXES):
                    raise ValueError(f"{name} is no table of its own: edit it where it comes from")
                seen.add(path)
                if key in KEYS and data:
                    tables[key] = read_table(path, key, data)
            except ValueError as error:
                if key in KEYS:
                    tables[key] = Table(path, read_only=str(error))
        return Job(text, settings, tables)

    def _in_sheets(self) -> Job:
        """A job in sheets, which are only shown."""
        why, problems = f"edit {self.job.name} in Excel: what is saved there appears here", Problems()
        written = open_job(self.job, problems)
        tables = {
            key: shown(self.job.parent / grid.source, key, grid)
            for key in KEYS
            if isinstance(grid := written.tables.get(key), Grid)
        }
        return Job(self._held[self.job], written.settings, tables, why)

    def _write(self, files: Files) -> Files:
        """Make files hold this; what those that held something else held before."""
        files = {path: data for path, data in files.items() if data != self._held.get(path)}
        for path in files:
            if not self._is_inside(path):
                raise ValueError(f"{path.name} is not in the folder of the job")
            for name, program in ((f"~${path.name}", "Excel"), (f".~lock.{path.name}#", "LibreOffice")):
                if path.with_name(name).exists():
                    raise ValueError(_is_open(path, program, f" (if it is not, delete {name})"))
        before = {path: self._held.get(path) for path in files}
        try:
            self._replace(files, before)
        except (InputError, PermissionError) as error:
            with suppress(InputError, OSError, _OutsideError):
                self._replace(
                    {path: before[path] for path in files if self._read(path) == files[path]}, files
                )
            cause = error.__cause__ or error
            failed = Path(error.problems[0].file if isinstance(error, InputError) else error.filename)
            if isinstance(cause, PermissionError):
                raise ValueError(_is_open(failed, "Excel", " or protected")) from error
            raise ValueError(f"{failed.name} is not written: {getattr(cause, 'strerror', cause)}") from error
        self._held |= files
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
        if "key" in edit:
            key, new = [str(part) for part in edit["key"]], edit["new"]
            now, typed = setting(draft.settings, key), bool(edit.get("typed"))
            if not _is_done(text_of(now) if typed else now, new, edit, ".".join(key)):
                draft.set(key, value_of(key[-1], new) if typed else new)
            return
        if "create" in edit:
            self._create(draft, edit["create"], edit["header"])
            return
        table = draft.tables[edit["table"]]
        if table.read_only:
            raise ValueError(table.read_only)
        if "cells" in edit:
            table.add({name: str(text) for name, text in edit["cells"].items()})
            return
        line, what = table.row(edit.get("row") or edit["delete"]), f"a row of {table.path.name}"
        if line is None:
            raise Conflict(f"{what} is not there any more")
        if "delete" in edit:
            _is_done(line.cells, None, edit, what)
            table.lines.remove(line)
            table.changed = True
            return
        texts = {key: clean(str(edit[key])) for key in ("old", "new") if key in edit}
        column = edit["column"]
        if not _is_done(line.cells[table.column(column)], texts["new"], texts, f"{column} in {what}"):
            table.write(line, {column: texts["new"]})

    def _create(self, draft: Job, key: str, header: Sequence[str]) -> None:
        """Begin a table in a file that the job names then."""
        if key not in KEYS or key in draft.tables or not all(re.fullmatch(r"\w+", one) for one in header):
            raise ValueError(f"a table {key!r} cannot be made: there is one, or none of this name")
        name = named_tables(draft.settings).get(key)
        if name is None:
            names = (f"{key}{end}.csv" for end in ("", *(f"_{n}" for n in range(2, 1000))))
            name = next(name for name in names if not self.job.with_name(name).exists())
            draft.set([key], name)
        separator = next((one.separator for one in draft.tables.values() if one.lines), ",")
        lines = [Line(separator.join(header), id="header"), Line("")]
        # with a mark, because Excel takes a file without it for its own 8-bit encoding
        draft.tables[key] = Table(
            self.job.with_name(name), header, lines, separator=separator, encoding="utf-8-sig", changed=True
        )


def _is_done(now: Any, new: Any, edit: Mapping[str, Any], what: str) -> bool:  # noqa: ANN401
    """Whether a value is the new one already; Conflict if it is not the old one either."""
    if now != new and now != edit.get("old", now):
        there = "nothing" if now is None else repr(now)
        raise Conflict(f"{what} was changed meanwhile: {there} is there now")
    return bool(now == new)


def _is_open(path: Path, program: str, hint: str) -> str:
    return f"{path.name} is open in {program}{hint}: close it there, then try again; nothing was changed"


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
        kind = given.suffix.lower()
        if kind not in (".toml", *SUFFIXES) or not (given.parent if kind == ".toml" else given).exists():
            raise ValueError(f"{given}: expected a folder, or a job (.toml or .xlsx) that exists")
        return given
    jobs = [path for path in sorted(given.glob("*.toml")) if path.name[0] != "." and _is_job(path)]
    if len(jobs) > 1:
        names = listing([path.name for path in jobs], "and")
        raise ValueError(f"{given} holds {names}: name the one to open")
    return [*jobs, given / "job.toml"][0]


def _is_job(path: Path) -> bool:
    try:
        return isinstance(settings_in(file_content(path)).get("runs"), str)
    except (OSError, ValueError):
        return False
