"""Jobs in a tree of folders: which files are jobs, and what their places say of them."""

from __future__ import annotations

import datetime
import hashlib
import io
import os
import re
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorid.files.excel_workbook import is_workbook
from rotorid.files.input_file import file_content
from rotorid.files.job_excel import SETTINGS
from rotorid.files.job_models import TABLES
from rotorid.files.problems import InputError, Problem, Problems
from rotorid.files.toml_file import read_toml

_OF_A_JOB = {*TABLES, "key_phasor", "speed_weights"}
"""Keys that only jobs have."""
_SHEET = re.compile(rb'<(?:\w+:)?sheet\s[^>]*?\bname="([^"]*)"')
_DATE = re.compile(r"(?<!\d)\d{4}-\d\d-\d\d(?!\d)")
_SHOWN = 3
"""Lines of a reason."""


@dataclass(frozen=True)
class FoundJob:
    """A file that is a job.

    Its path is relative to the tree, with "/"; machine, type and date are what its place says, for a job that
    does not; `tables` are the files that it names for `TABLES`, by their keys.
    """

    file: Path
    path: str
    machine: str
    machine_type: str
    date: datetime.date | None
    tables: dict[str, Path]

    def quick_id(self) -> str:
        """The id of the job without reading it; "" for unreadable files, another for a rotor or waveforms."""
        files = self.file, *self.tables.values()
        try:
            return job_id(hashlib.sha256(file_content(file)).hexdigest() for file in files)
        except OSError:  # reading says it better
            return ""


def job_id(hashes: Iterable[str]) -> str:
    """The id of a job, 16 hex digits of the SHA-256 over those of its files in their order."""
    return hashlib.sha256("".join(hashes).encode()).hexdigest()[:16]


def find_jobs(trees: Sequence[Path], machine_type: str | None) -> tuple[list[FoundJob], dict[Path, str]]:
    """Jobs in trees of folders, or of single files, and why of other files nobody can say what they are.

    `machine_type` counts instead of the one that a place says; workbooks that jobs name are no jobs of their
    own. OSError where there is no such tree.
    """
    found: dict[Path, FoundJob] = {}
    damaged: dict[Path, str] = {}
    closed: list[OSError] = []
    for tree in trees:
        for file in _files(tree, closed.append):
            try:
                job = _job_in(file, tree, machine_type)
            except (OSError, ValueError) as error:
                damaged[file] = reason_of(error)
                continue
            if job is not None:
                found.setdefault(file.resolve(), job)
    places: dict[tuple[str, str], FoundJob] = {}
    for file, job in list(found.items()):
        other = places.setdefault((job.machine, job.path), job)
        if other is not job and len({job.quick_id(), other.quick_id()} - {""}) > 1:
            damaged[found.pop(file).file] = (
                f"{other.file} is another job at the same place below its tree, of the same machine: "
                "add the folder above both, or say `machine` in them"
            )
    damaged |= {Path(error.filename): reason_of(error) for error in closed}
    tables = (table for job in found.values() for table in job.tables.values())
    named = {table.resolve() for table in tables if is_workbook(table)}
    return [job for file, job in found.items() if file not in named], damaged


def reason_of(error: Exception) -> str:
    """The first lines of what is wrong with a file."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    lines = text.splitlines() or [type(error).__name__]
    more = f"\nand {len(lines) - _SHOWN} more lines" if len(lines) > _SHOWN else ""
    return "\n".join(lines[:_SHOWN]) + more


def _files(tree: Path, closed: Callable[[OSError], None]) -> Iterator[Path]:
    """Files that may be jobs, by name; without hidden ones, and without folders that links lead to."""
    if tree.is_file():
        yield tree
        return
    root = tree.resolve(strict=True)
    for folder, folders, names in os.walk(tree, onerror=closed):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            path = Path(folder, name)
            if name.startswith((".", "~$")) or path.suffix.lower() not in (".toml", ".xlsx"):
                continue
            if not path.is_symlink() or path.resolve().is_relative_to(root):
                yield path


def _job_in(file: Path, tree: Path, machine_type: str | None) -> FoundJob | None:
    """The job in a file; None where it is clearly something else."""
    if file.suffix.lower() == ".xlsx":
        sheets = _sheets(file)
        if "runs" not in sheets and len(sheets & {*TABLES, *SETTINGS}) < 2:
            return None
        said: dict[str, Any] = {}
    else:
        problems = Problems()
        said = problems.need(read_toml(file, problems))
        if not _OF_A_JOB & said.keys():
            return None
    parts = _readable(file.relative_to(tree) if file != tree else Path(file.name)).parts
    named = {key: str(said[key]) for key in TABLES if isinstance(said.get(key), str)}
    return FoundJob(
        file=file,
        path="/".join(parts),
        machine=str(said.get("machine") or machine_of(file)),
        machine_type=machine_type or (parts[0] if len(parts) > 2 else ""),
        date=_date([file.name, file.parent.resolve().name, *reversed(parts[:-1])]),
        tables={key: file.parent / name for key, name in named.items() if name.isprintable()},
    )


def machine_of(file: Path) -> str:
    """The folder of a job, or the first above it whose name is not a date alone."""
    names = (folder.name for folder in _readable(file.resolve()).parents)
    return next((name for name in names if _DATE.sub("", name).strip(" _-")), "")


def _readable(path: Path) -> Path:
    """A path with � for what is no UTF-8, which tables cannot hold."""
    return Path(os.fsencode(path).decode("utf-8", "replace"))


def _sheets(file: Path) -> set[str]:
    """Names of the sheets of a workbook, of which nothing else is read."""
    try:
        with zipfile.ZipFile(io.BytesIO(file_content(file))) as archive:
            names = _SHEET.findall(archive.read("xl/workbook.xml"))
    except (zipfile.BadZipFile, KeyError, EOFError, RuntimeError, zlib.error) as error:
        raise InputError([Problem(str(file), None, None, None, "an intact Excel workbook")]) from error
    return {name.decode("utf-8", "replace").strip().casefold() for name in names}


def _date(names: Sequence[str]) -> datetime.date | None:
    """The first date in names of files and folders."""
    for text in _DATE.findall("/".join(names)):
        with suppress(ValueError):
            return datetime.date.fromisoformat(text)
    return None
