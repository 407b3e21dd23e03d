"""Coefficients of the jobs in a folder tree as one Parquet table, a row per job, speed, sensor and plane.

Columns are in SI, phases lead, angles run with the rotation. `std`, one standard deviation of the real and of
the imaginary part, is that of errors which are stated or measured; what is assumed is none here, so that the
scatter between machines is not taken for errors of readings which nobody knows.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import warnings
import zipfile
from collections.abc import Collection
from contextvars import Context
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from balancing import Labels, UndeterminedError, estimate_influence
from rotorid.base.logs import progress
from rotorid.files import InputError, read_job
from rotorid.files.disk import each_file_once, file_content
from rotorid.files.problems import Problem, Problems
from rotorid.files.toml_file import read_toml
from rotorid.files.units import vibration

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.files import Job

COLUMNS = (
    *("job", "machine", "machine_type", "date", "quantity", "weight_kind", "vibration_unit", "weight_unit"),
    *("runs", "sensor", "plane", "speed_rad_s", "radius_m", "re", "im", "std"),
)
"""Of the table: `job` is the path of the job below the tree, `runs` the SHA-256 of its readings."""
_DATE = re.compile(r"(?<!\d)\d{4}-\d\d-\d\d(?!\d)")
_SHEET = re.compile(rb'<(?:\w+:)?sheet\s[^>]*?\bname="([^"]*)"')


def read_tree(tree: Path, machine_type: str | None) -> tuple[pd.DataFrame, list[str], dict[str, str]]:
    """The table of the jobs in a tree; jobs without coefficients; files that cannot be read, with reasons.

    Parameters
    ----------
    tree
        A folder with jobs at any depth, or a job. Hidden files are left out, links not followed out of it.
    machine_type
        Of the jobs that neither say it nor lie at least two folders deep, in that of their type.

    Raises
    ------
    OSError
        Without such a folder or file.
    """
    import pandas as pd

    tables: list[pd.DataFrame] = []
    undetermined: list[str] = []
    damaged: dict[str, str] = {}
    jobs = _jobs(tree, damaged)
    for count, (file, path) in enumerate(jobs.items(), 1):
        try:
            # apart from what the command keeps of files that it reads: those of a whole tree are too many
            tables.append(Context().run(_table_of_file, file, path, machine_type or ""))
        except UndeterminedError:
            undetermined.append(path)
        except (ValueError, OSError, ArithmeticError, MemoryError) as error:
            damaged[path] = _first_line(error)
        progress.info("%d of %d jobs", count, len(jobs))
    table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=list(COLUMNS))
    return table, undetermined, damaged


def _jobs(tree: Path, damaged: dict[str, str]) -> dict[Path, str]:
    """Files that are jobs, with their paths below the tree; not the workbooks that others name as tables."""
    root, jobs, tables = tree.resolve(strict=True), dict[Path, str](), set[Path]()
    for file in sorted(tree.rglob("*")) if tree.is_dir() else [tree]:
        path = file.relative_to(tree) if file != tree else Path(file.name)
        hidden = any(part.startswith((".", "~$")) for part in path.parts)
        if hidden or file.suffix.lower() not in (".toml", ".xlsx") or not file.is_file():
            continue
        if not file.resolve().is_relative_to(root):
            continue
        name = _printable(path).as_posix()
        try:
            keys, values = Context().run(_settings, file)
        except (OSError, ValueError) as error:
            damaged[name] = _first_line(error)
            continue
        tables |= {(file.parent / value).resolve() for value in values if str(value).endswith(".xlsx")}
        if {"runs", "weights"} & {*keys}:
            jobs[file] = name
    return {file: name for file, name in jobs.items() if file.resolve() not in tables}


def _settings(file: Path) -> tuple[Collection[str], Collection[str]]:
    """Keys and values of a settings file; names of the sheets of a workbook, and nothing else of it."""
    if file.suffix.lower() == ".toml":
        problems = Problems()
        settings = problems.need(read_toml(file, problems))
        return settings.keys(), [value for value in settings.values() if isinstance(value, str)]
    try:
        with zipfile.ZipFile(io.BytesIO(file_content(file))) as archive:
            names = _SHEET.findall(archive.read("xl/workbook.xml"))
    except Exception as error:  # of any kind, where it is damaged
        raise ValueError(f"{file}: expected an intact Excel workbook") from error
    return [name.decode("utf-8", "replace").strip().casefold() for name in names], ()


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__


def _table_of_file(file: Path, path: str, machine_type: str) -> pd.DataFrame:
    with each_file_once(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folders = path.split("/")
        return table_of(read_job(file), path, folders[0] if len(folders) > 2 else machine_type)


def table_of(job: Job, path: str = "", machine_type: str = "") -> pd.DataFrame:
    """Rows of one job, of this type unless it says another; UndeterminedError without coefficients."""
    import pandas as pd

    influence, labels, keys = job.influence or estimate_influence(job.trials), job.trials.labels, job.settings
    s, c, p = np.indices(influence.W.shape).reshape(3, -1)
    W, planes = influence.W.ravel(), [influence.planes[k] for k in p]
    variances = np.diagonal(influence.channels(known=True), axis1=-2, axis2=-1)[..., 2:]
    values = (
        *(
            path,
            machine_of(job),
            keys.machine_type or machine_type,
            "" if keys.date is None else str(keys.date),
        ),
        *(*kind_of(labels), labels.vibration_unit, labels.weight_unit, runs_of(job)),
        *([influence.sensors[k] for k in c], planes, influence.speeds[s]),
        *([job.radii.get(plane, np.nan) for plane in planes], W.real, W.imag),
        np.sqrt(variances.reshape(-1, 2).mean(axis=-1)),
    )
    return pd.DataFrame(dict(zip(COLUMNS, values, strict=True)))


def kind_of(labels: Labels) -> tuple[str, str]:
    """What is read ("" unknown), and what weights are."""
    unit = labels.vibration_unit
    quantity = vibration(unit).kind.replace("length", "displacement") if unit else ""
    return quantity, "unbalance" if labels.unbalances else "mass"


def runs_of(job: Job) -> str:
    """The SHA-256 of the readings of a job, by which its copies are known."""
    return hashlib.sha256(job.trials.readings.tobytes()).hexdigest()


def machine_of(job: Job) -> str:
    """As the job says; else its folder, or the first above it whose name is not a date alone."""
    folders = (folder.name for folder in _printable(job.files[0].resolve()).parents)
    return job.settings.machine or next((name for name in folders if _DATE.sub("", name).strip(" _-")), "")


def _printable(path: Path) -> Path:
    """A path with � for what is no UTF-8, which tables cannot hold."""
    return Path(os.fsencode(path).decode("utf-8", "replace"))


def parquet(table: pd.DataFrame) -> bytes:
    """A table of jobs as a Parquet file; ValueError without the package for it."""
    buffer = io.BytesIO()
    try:
        table.to_parquet(buffer, engine="pyarrow", index=False)
    except ImportError as error:
        raise ValueError("the table of a fleet needs pyarrow: pip install pyarrow") from error
    return buffer.getvalue()


def read_fleet(path: Path) -> pd.DataFrame:
    """The table of jobs that `fleet fit --output` has written.

    Raises
    ------
    InputError
        For a file that is not there, damaged or another table.
    """
    import pandas as pd

    lacking = None
    try:
        table = pd.read_parquet(io.BytesIO(file_content(path)), engine="pyarrow")
        lacking = next((name for name in COLUMNS if name not in table), None)
        if lacking is None:
            return table
        expected = f"the table that rotorid fleet fit TREE --output {path.name} writes, with {lacking}"
    except ImportError as error:
        raise ValueError("the table of a fleet needs pyarrow: pip install pyarrow") from error
    except OSError as error:
        expected = f"a table of a fleet ({error.strerror or error})"
    except Exception:  # of any kind, where it is damaged
        expected = "a whole Parquet table of a fleet"
    raise InputError([Problem(str(path), None, lacking, None, expected)])
