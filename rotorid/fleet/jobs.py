"""Coefficients of the jobs in a folder tree as one Parquet table, a row per job, speed, sensor and plane.

Columns are in SI, phases lead, angles run with the rotation. Variances are those of errors that are stated or
measured; what is assumed is none here, so that the scatter between machines is not taken for errors of
readings which nobody knows.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import time
import warnings
import zipfile
from collections.abc import Mapping
from contextvars import Context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Labels, UndeterminedError, estimate_influence
from rotorid.base.logs import progress
from rotorid.files import InputError, read_job
from rotorid.files.input_file import each_file_once, file_content
from rotorid.files.problems import Problems
from rotorid.files.toml_file import read_toml
from rotorid.files.units import vibration
from rotorid.fleet.machine_type import MachineRecord

if TYPE_CHECKING:
    import pandas as pd

    from rotorid.files import Job

OF_A_JOB = {"runs", "weights"}
"""Keys, and names of sheets, by which a file is known for a job."""
QUANTITIES = {"length": "displacement", "velocity": "velocity", "acceleration": "acceleration"}
"""Of a reading, by the kind of its unit."""
NUMBERS = ("speed_rad_s", "radius_m", "re", "im", "var_re", "cov_re_im", "var_im")
TEXTS = ("job", "machine", "machine_type", "date", "quantity", "weight_kind", "vibration_unit", "weight_unit")
COLUMNS = (*TEXTS, "runs", "sensor", "plane", *NUMBERS)
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

    rows: list[dict[str, Any]] = []
    undetermined: list[str] = []
    damaged: dict[str, str] = {}
    jobs = _jobs(tree, damaged)
    begun = time.monotonic()
    for count, (file, job) in enumerate(jobs.items(), 1):
        try:
            # apart from what the command keeps of files that it reads: those of a whole tree are too many
            rows += Context().run(_rows, file, job, machine_type)
        except UndeterminedError:
            undetermined.append(job)
        except (ValueError, OSError, ArithmeticError, MemoryError) as error:
            damaged[job] = str(error).partition("\n")[0] or type(error).__name__
        left = (time.monotonic() - begun) / count * (len(jobs) - count)
        progress.info("%d of %d, %.0f s left", count, len(jobs), left)
    return pd.DataFrame(rows, columns=list(COLUMNS)), undetermined, damaged


def _jobs(tree: Path, damaged: dict[str, str]) -> dict[Path, str]:
    """Files that are jobs, with their paths below the tree; not the workbooks that others name as tables."""
    root, jobs, tables = tree.resolve(strict=True), dict[Path, str](), set[Path]()
    for file in sorted(tree.rglob("*")) if tree.is_dir() else [tree]:
        path = file.relative_to(tree) if file != tree else Path(file.name)
        hidden = any(part.startswith((".", "~$")) for part in path.parts)
        if hidden or file.suffix.lower() not in (".toml", ".xlsx") or not file.is_file():
            continue
        if file.is_symlink() and not file.resolve().is_relative_to(root):
            continue
        name = _printable(path).as_posix()
        try:
            keys = Context().run(_settings, file)
        except (OSError, ValueError) as error:
            damaged[name] = str(error).partition("\n")[0]
            continue
        tables |= {(file.parent / value).resolve() for value in keys.values() if str(value).endswith(".xlsx")}
        if OF_A_JOB & keys.keys():
            jobs[file] = name
    return {file: name for file, name in jobs.items() if file.resolve() not in tables}


def _settings(file: Path) -> Mapping[str, Any]:
    """Keys of a settings file, or names of the sheets of a workbook, of which nothing else is read."""
    if file.suffix.lower() == ".toml":
        problems = Problems()
        return problems.need(read_toml(file, problems))
    try:
        with zipfile.ZipFile(io.BytesIO(file_content(file))) as archive:
            names = _SHEET.findall(archive.read("xl/workbook.xml"))
    except Exception as error:  # of any kind, where it is damaged
        raise ValueError(f"{file}: expected an intact Excel workbook") from error
    return dict.fromkeys(name.decode("utf-8", "replace").strip().casefold() for name in names)


def _rows(file: Path, path: str, machine_type: str | None) -> list[dict[str, Any]]:
    """Rows of one job; UndeterminedError where nothing gives its coefficients."""
    with each_file_once(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        job = read_job(file)
        influence = job.influence or estimate_influence(job.trials)
        parts = path.split("/")
        quantity, weight_kind = kind_of(job.trials.labels)
        shared = {
            "job": path,
            "machine": job.settings.machine or machine_of(file),
            "machine_type": job.settings.machine_type or (parts[0] if len(parts) > 2 else machine_type or ""),
            "date": "" if job.settings.date is None else job.settings.date.isoformat(),
            "quantity": quantity,
            "weight_kind": weight_kind,
            "vibration_unit": job.trials.labels.vibration_unit,
            "weight_unit": job.trials.labels.weight_unit,
            "runs": runs_of(job),
        }
    V = MachineRecord.of(influence).covariance
    return [
        {
            **shared,
            "sensor": influence.sensors[c],
            "plane": plane,
            "speed_rad_s": influence.speeds[s],
            "radius_m": job.radii.get(plane, np.nan),
            "re": W.real,
            "im": W.imag,
            "var_re": V[s, c, p, 0, 0],
            "cov_re_im": V[s, c, p, 0, 1],
            "var_im": V[s, c, p, 1, 1],
        }
        for (s, c, p), W in np.ndenumerate(influence.W)
        for plane in [influence.planes[p]]
    ]


def kind_of(labels: Labels) -> tuple[str, str]:
    """What is read ("" unknown), and what weights are."""
    unit = labels.vibration_unit
    quantity = QUANTITIES.get(vibration(unit).kind, "") if unit else ""
    return quantity, "unbalance" if labels.unbalances else "mass"


def runs_of(job: Job) -> str:
    """The SHA-256 of the readings of a job, by which its copies are known."""
    return hashlib.sha256(job.trials.readings.tobytes()).hexdigest()


def machine_of(file: Path) -> str:
    """The folder of a job, or the first above it whose name is not a date alone."""
    names = (folder.name for folder in _printable(file.resolve()).parents)
    return next((name for name in names if _DATE.sub("", name).strip(" _-")), "")


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

    problems = Problems()
    try:
        table = pd.read_parquet(io.BytesIO(file_content(path)), engine="pyarrow")
    except ImportError as error:
        raise ValueError("the table of a fleet needs pyarrow: pip install pyarrow") from error
    except OSError as error:
        problems.add(str(path), None, None, None, f"a table of a fleet ({error.strerror or error})")
    except Exception:  # of any kind, where it is damaged
        problems.add(str(path), None, None, None, "a whole Parquet table of a fleet")
    else:
        if lost := [name for name in COLUMNS if name not in table]:
            expected = f"the table that rotorid fleet fit TREE --output {path.name} writes, with {lost[0]}"
            problems.add(str(path), None, lost[0], None, expected)
    if len(problems):
        raise InputError(problems)
    return table
