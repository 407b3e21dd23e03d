"""Jobs in a tree of folders: which files are jobs, and what their places say of them."""

from __future__ import annotations

import datetime
import hashlib
import io
import os
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotorid.tables.fleet.job_records import job_id
from rotorid.tables.job.job_from_excel import SETTINGS
from rotorid.tables.job.job_keys import TABLES
from rotorid.tables.reader.input_file import file_content
from rotorid.tables.reader.problems import InputError, Problem, Problems
from rotorid.tables.reader.toml_file import read_toml

_OF_A_JOB = {*TABLES, "key_phasor", "speed_weights"}
"""Keys that only jobs have."""
_SHEET = re.compile(rb'<(?:\w+:)?sheet\s[^>]*?\bname="([^"]*)"')
_DATE = re.compile(r"(?<!\d)\d{4}-\d\d-\d\d(?!\d)")


@dataclass(frozen=True)
class FoundJob:
    """A file that is a job.

    Attributes
    ----------
    file
        Where it is.
    path
        Relative to the tree, with "/".
    machine, machine_type, date
        What its place says, for a job that does not.
    tables
        The files that it names for `TABLES`, by their keys.
    """

    file: Path
    path: str
    machine: str
    machine_type: str
    date: datetime.date | None
    tables: dict[str, Path]

    @property
    def runs_file(self) -> Path:
        """What holds its runs."""
        return self.tables.get("runs", self.file)

    def quick_id(self) -> str:
        """The id of the job without reading it; another one where it has a rotor or waveforms.

        Raises
        ------
        OSError
            For a file that cannot be read.
        """
        files = self.file, *self.tables.values()
        return job_id(hashlib.sha256(file_content(file)).hexdigest() for file in files)


def job_files(tree: Path, closed: Callable[[OSError], None]) -> Iterator[Path]:
    """Files that may be jobs, by name; without hidden ones, and without folders that links lead to.

    `closed` is called for a folder that cannot be read.

    Raises
    ------
    OSError
        Where there is no such tree.
    """
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


def found_job(file: Path, tree: Path, machine_type: str = "") -> FoundJob | None:
    """The job in a file; None where it is clearly something else.

    Parameters
    ----------
    file, tree
        The file, and the tree in which it is.
    machine_type
        Instead of the one that its place says.

    Raises
    ------
    OSError
        For a file that cannot be read.
    InputError
        For one of which nobody can say what it is.
    """
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
    parts = (file.relative_to(tree) if file != tree else Path(file.name)).parts
    dates = map(_date, (file.name, file.parent.resolve().name, *reversed(parts[:-1])))
    named = {key: str(said[key]) for key in TABLES if isinstance(said.get(key), str)}
    return FoundJob(
        file=file,
        path="/".join(parts),
        machine=machine_of(file),
        machine_type=machine_type or (parts[0] if len(parts) > 2 else ""),
        date=next((date for date in dates if date is not None), None),
        tables={key: file.parent / name for key, name in named.items() if name.isprintable()},
    )


def machine_of(file: Path) -> str:
    """The folder of a job, or the first above it whose name is not a date alone."""
    names = (folder.name for folder in file.resolve().parents)
    return next((name for name in names if _DATE.sub("", name).strip(" _-")), "")


def _sheets(file: Path) -> set[str]:
    """Names of the sheets of a workbook, of which nothing else is read."""
    try:
        with zipfile.ZipFile(io.BytesIO(file_content(file))) as archive:
            names = _SHEET.findall(archive.read("xl/workbook.xml"))
    except (zipfile.BadZipFile, KeyError, NotImplementedError, zlib.error) as error:
        raise InputError([Problem(str(file), None, None, None, "an intact Excel workbook")]) from error
    return {name.decode("utf-8", "replace").strip().casefold() for name in names}


def _date(name: str) -> datetime.date | None:
    for text in _DATE.findall(name):
        with suppress(ValueError):
            return datetime.date.fromisoformat(text)
    return None
