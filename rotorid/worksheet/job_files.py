"""A job in memory, whole files written at each change; undo, changes of other programs noticed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from rotorid.base.text import listing
from rotorid.files.cells import Grid
from rotorid.files.disk import MOST_BYTES, SUFFIXES, file_content, first_bytes, is_workbook, write_files
from rotorid.files.input_problems import InputError, Problems
from rotorid.files.job import open_job
from rotorid.files.job_keys import named_tables
from rotorid.worksheet.job_text import KEYS, Conflict, Job, Table, read_table, settings_in, shown

MOST_STEPS, MOST_TRIES = 200, 5
Files = dict[Path, bytes | None]
"""What files hold; None: there is none."""
Stamp = tuple[int, ...]


class JobFiles:
    """The job that a worksheet shows: a `.toml` or `.xlsx`, or that of a folder, or none there yet."""

    def __init__(self, given: Path) -> None:
        self.job = _job_in(Path(given)).absolute()
        self._held: Files = {}
        self._stamps: dict[Path, Stamp] = {}
        self._noticed: list[Path] = []
        self.done: list[Files] = []  # what files held before each step that can be undone
        self.now = self._load()

    def watch(self, read: Mapping[str, Stamp]) -> None:
        """Look for changes of these files, too, each with its stamp before it was read."""
        self._stamps = {self.job.parent / name: at for name, at in read.items()} | self._stamps

    def look(self) -> list[str]:
        """Names of the files that another program has changed since the last look."""
        changed = {path: now for path, at in self._stamps.items() if (now := stamp(path)) != at}
        self._stamps |= changed
        self._noticed += changed.keys() - self._held.keys()
        if changed or self._noticed:
            self.now = self._load()
        names, self._noticed = list(dict.fromkeys(path.name for path in self._noticed)), []
        return names

    def apply(self, edits: Sequence[Mapping[str, Any]]) -> None:
        """Carry out edits, all or none, as one step of undo; ValueError where that is impossible.

        Each is a `cell` with its `old` and `new` text (Conflict if it holds neither), `cells` of a row that
        is added to a `table`, the row to `delete`, or a table to `create` with its `header`. A cell is called
        TABLE|ROW|COLUMN, a row TABLE|ROW, a setting KEY, KEY|KEY or KEY|NAME|KEY.
        """
        for _ in range(MOST_TRIES):
            draft = self._load()
            try:
                for edit in edits:
                    draft.edit(edit, self.job.parent)
            except (LookupError, TypeError, AttributeError) as error:
                raise ValueError(f"an edit of an unknown form: {error}") from error
            changed = {table.path: table.data() for table in draft.tables.values() if table.changed}
            with suppress(Conflict):
                if step := self._write({**changed, self.job: draft.text}):
                    self.done = [*self.done[1 - MOST_STEPS :], step]
                return
        raise ValueError("another program goes on changing the files of the job: try again in a moment")

    def undo(self) -> None:
        """Go back to the files before the last step; ValueError where that is impossible."""
        self._load()
        if self._noticed:
            raise ValueError(f"{self._noticed[0].name} was changed by another program: no undo")
        if not self.done:
            raise ValueError("there is nothing to undo")
        self._write(self.done[-1])
        self.done.pop()

    def _load(self) -> Job:
        """What the files say now; what another program has changed is noticed, and ends undo."""
        before, self._held, job = self._held, {}, Job()
        try:
            job.text = self._content(self.job)
            if is_workbook(self.job):
                self._read_sheets(job)
            else:
                self._read_files(job)
        except (ValueError, RecursionError) as error:
            why = f"{self.job.name} cannot be read, correct it there: {error}"
            job = Job(job.text or b"", read_only=why)
        changed = [path for path, data in before.items() if self._held.get(path, data) != data]
        self._noticed += changed
        if changed:
            self.done = []
        return job

    def _read_files(self, job: Job) -> None:
        job.settings = settings_in(job.text or b"")
        for key, name in named_tables(job.settings).items():
            path = self.job.parent / name
            if key not in KEYS or not name.isprintable():
                continue
            try:
                if path in self._held or path.suffix.lower() in (".toml", *SUFFIXES):
                    raise ValueError(f"{name} is no table of its own: edit it where it comes from")
                if data := self._content(path):
                    job.tables[key] = read_table(path, key, data)
            except ValueError as error:
                job.tables[key] = Table(path, read_only=str(error))

    def _read_sheets(self, job: Job) -> None:
        written = open_job(self.job, Problems())
        job.settings = written.settings
        job.read_only = f"edit {self.job.name} in Excel: what is saved there appears here"
        for key in KEYS:
            if isinstance(grid := written.tables.get(key), Grid):
                job.tables[key] = shown(self.job.parent / grid.source, key, grid)

    def _content(self, path: Path) -> bytes | None:
        """What a file holds, which is watched from now on."""
        self._stamps[path] = stamp(path)
        self._held[path] = None  # also where it cannot be read
        self._held[path] = self._read(path)
        return self._held[path]

    def _read(self, path: Path) -> bytes | None:
        """What a file holds now; ValueError if it is outside of the folder or cannot be read."""
        if path != self.job and not is_inside(path, self.job.parent):
            raise ValueError(f"{path.name} is not in the folder of the job: copy it there to edit it here")
        try:
            return first_bytes(path, MOST_BYTES + 1)  # as it is now, whatever was read before
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ValueError(f"{path.name} cannot be read ({error.strerror or error})") from error

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
            with suppress(ValueError, OSError):
                done = {path: before[path] for path in files if self._read(path) == files[path]}
                self._replace(done, files)
            words = "where a file is open in Excel, close it there, then try again"
            raise ValueError(f"nothing was changed: {error}; {words}") from error
        self._held |= files
        self._stamps |= {path: stamp(path) for path in files}
        self.now = self._load()
        return before

    def _replace(self, files: Files, before: Files) -> None:
        """Write and remove files that hold now what they held before."""

        def last_look() -> None:
            for path in files:
                if self._read(path) != before[path]:
                    raise Conflict(f"{path.name} was changed by another program")

        write_files({path: data for path, data in files.items() if data is not None}, last_look)
        for path, data in files.items():
            if data is None:
                path.unlink(missing_ok=True)


def is_inside(path: Path, folder: Path | str) -> bool:
    """Whether a file is in a folder, wherever links lead."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def stamp(path: Path) -> Stamp:
    """What tells that a file is as it was; empty: there is none."""
    with suppress(OSError):
        at = path.stat()
        return at.st_mtime_ns, at.st_ctime_ns, at.st_size, at.st_ino
    return ()


def _job_in(given: Path) -> Path:
    """The file that is given, or the only job of a folder, or one to be made there, and the folder, too."""
    kind, jobs = given.suffix.lower(), list[Path]()
    if not kind and not given.exists() and given.parent.is_dir():
        given.mkdir()
    if not given.is_dir():
        if kind in (".toml", *SUFFIXES) and (given.parent if kind == ".toml" else given).exists():
            return given
        raise ValueError(f"{given}: expected a folder, or a job (.toml or .xlsx) that exists")
    for path in sorted(given.glob("[!.]*.toml")):
        with suppress(OSError, ValueError, RecursionError):
            jobs += [path] if isinstance(settings_in(file_content(path)).get("runs"), str) else []
    if len(jobs) > 1:
        names = listing([path.name for path in jobs], "and")
        raise ValueError(f"{given} holds {names}: name the one to open")
    return jobs[0] if jobs else given / "job.toml"
