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
from contextvars import Context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Labels, UndeterminedError, estimate_influence
from rotorid.base.logs import progress
from rotorid.files import InputError, read_job
from rotorid.files.disk import each_file_once, file_content
from rotorid.files.problems import Problem, Problems
from rotorid.files.settings import read_toml
from rotorid.files.units import vibration

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from rotorid.files import Job

COLUMNS = (
    *("job", "machine", "machine_type", "date", "quantity", "weight_kind", "vibration_unit", "weight_unit"),
    *("runs", "sensor", "plane", "speed_rad_s", "radius_m", "re", "im", "std"),
)
"""Of the table: `job` is the path of the job below the tree, `runs` the SHA-256 of its readings."""
_DATE = re.compile(r"([\s_-]*\d{4}-\d\d-\d\d)*[\s_-]*")
_SHEET = re.compile(rb'<(?:\w+:)?sheet\s[^>]*?\bname="([^"]*)"')


def read_tree(tree: Path, machine_type: str) -> tuple[pd.DataFrame, list[str], dict[str, str]]:
    """The table of the jobs in a tree; jobs without coefficients; files that cannot be read, with reasons.

    Parameters
    ----------
    tree
        A folder with jobs at any depth, or a job. Hidden files are left out, links not followed out of it.
    machine_type
        Of the jobs that neither say it nor lie at least two folders deep, in that of their type; "": none.

    Raises
    ------
    OSError
        Without such a folder or file.
    """
    import pandas as pd

    root, tables = tree.resolve(strict=True), [pd.DataFrame(columns=list(COLUMNS))]
    undetermined, damaged = list[str](), dict[str, str]()
    inputs: set[Path] = set()
    files = sorted(tree.rglob("*")) if tree.is_dir() else [tree]
    # settings first: the workbooks that they name as tables are no jobs
    for count, file in enumerate(sorted(files, key=lambda file: file.suffix.lower() != ".toml"), 1):
        path = _printable(file.relative_to(tree) if file != tree else Path(file.name)).as_posix()
        hidden = re.search(r"(^|/)(\.|~\$)", path) or not file.resolve().is_relative_to(root)
        if hidden or not file.is_file() or file.resolve() in inputs:
            continue
        folders = path.split("/")
        try:
            # apart from what the command keeps of files that it reads: those of a whole tree are too many
            job = Context().run(_read_job, file)
            if job is not None:
                inputs |= {one.resolve() for one in job.files}
                tables.append(table_of(job, path, folders[0] if len(folders) > 2 else machine_type))
        except UndeterminedError:
            undetermined.append(path)
        except (ValueError, OSError, ArithmeticError, MemoryError) as error:
            damaged[path] = str(error).partition("\n")[0] or type(error).__name__
        progress.info("%d of %d files", count, len(files))
    return pd.concat(tables[1:] or tables, ignore_index=True), undetermined, damaged


def _read_job(file: Path) -> Job | None:
    """The job of settings with runs or weights, and of a workbook with such a sheet; None: no job."""
    names: set[str] = set()
    with each_file_once(), warnings.catch_warnings(action="ignore"):
        if file.suffix.lower() == ".toml":
            problems = Problems()
            names = {*problems.need(read_toml(file, problems))}
        elif file.suffix.lower() == ".xlsx":
            try:
                with zipfile.ZipFile(io.BytesIO(file_content(file))) as archive:
                    sheets = _SHEET.findall(archive.read("xl/workbook.xml"))
            except Exception as error:  # of any kind, where it is damaged
                raise ValueError(f"{file}: expected an intact Excel workbook") from error
            names = {name.decode("utf-8", "replace").strip().casefold() for name in sheets}
        return read_job(file) if names & {"runs", "weights"} else None


def table_of(job: Job, path: str = "", machine_type: str = "") -> pd.DataFrame:
    """Rows of one job, of this type unless it says another; UndeterminedError without coefficients."""
    import pandas as pd

    with warnings.catch_warnings(action="ignore"):
        influence = job.influence or estimate_influence(job.trials)
    labels, keys = job.trials.labels, job.settings
    s, c, p = np.indices(influence.W.shape).reshape(3, -1)
    W, planes = influence.W.ravel(), [influence.planes[k] for k in p]
    variances = np.diagonal(influence.channels(known=True), axis1=-2, axis2=-1)[..., 2:]
    values = (
        *(path, machine_of(job), keys.machine_type or machine_type, str(keys.date or "")),
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
    return job.settings.machine or next((name for name in folders if not _DATE.fullmatch(name)), "")


def _printable(path: Path) -> Path:
    """A path with � for what is no UTF-8, which tables cannot hold."""
    return Path(os.fsencode(path).decode("utf-8", "replace"))


def arrow(what: str) -> Any:  # noqa: ANN401 - a module
    """Pyarrow with `parquet`; ValueError without it: what needs it."""
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise ValueError(f"{what} needs pyarrow: pip install pyarrow") from error
    return pyarrow


def parquet(table: pa.Table) -> bytes:
    """A table as a Parquet file."""
    buffer = io.BytesIO()
    arrow("a Parquet table").parquet.write_table(table, buffer, write_page_checksum=True)
    return buffer.getvalue()


def read_parquet(path: Path, what: str) -> pa.Table:
    """The table of a Parquet file; InputError, that `what` was expected, where it is not there or damaged."""
    pa, reason = arrow(what), "it is damaged, or something else"
    try:
        return pa.parquet.read_table(io.BytesIO(path.read_bytes()), page_checksum_verification=True)
    except (OSError, pa.ArrowException) as error:
        reason = getattr(error, "strerror", "") or reason
        raise InputError([Problem(str(path), None, None, None, f"{what} ({reason})")]) from error


def read_fleet(path: Path) -> pd.DataFrame:
    """The table of jobs that `fleet fit --output` has written; InputError for what is none."""
    table: pd.DataFrame = read_parquet(path, "a table of a fleet").to_pandas()
    if lacking := [name for name in COLUMNS if name not in table]:
        expected = f"the table that rotorid fleet fit TREE --output {path.name} writes, with {lacking[0]}"
        raise InputError([Problem(str(path), None, lacking[0], None, expected)])
    return table
