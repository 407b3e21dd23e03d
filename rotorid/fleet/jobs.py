"""Coefficients of the jobs in a folder tree as one Parquet table, a row per job, speed, sensor and plane.

Columns are in SI, phases lead, angles run with the rotation. `std`, one standard deviation of the real and of
the imaginary part, is that of errors which are stated or measured; what is assumed is none here, so that the
scatter between machines is not taken for errors of readings which nobody knows.
"""

from __future__ import annotations

import hashlib
import io
import re
import warnings
from contextvars import Context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Influence, Labels, UndeterminedError, estimate_influence
from rotorid.base.arrays import FloatArray
from rotorid.base.logs import progress
from rotorid.files import read_job
from rotorid.files.disk import each_file_once, file_content
from rotorid.files.input_problems import printable, refusal
from rotorid.files.settings import read_toml
from rotorid.files.units import vibration

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

    from rotorid.files import Job

COLUMNS = (
    *("job", "machine", "machine_type", "date", "quantity", "vibration_unit", "weight_unit", "runs"),
    *("sensor", "plane", "mounted", "speed_rad_s", "re", "im", "std"),
)
"""Of the table: `job` is the path of the job below the tree, `runs` the SHA-256 of its readings."""
_DATE = re.compile(r"([\s_-]*\d{4}-\d\d-\d\d)*[\s_-]*")


def read_tree(tree: Path) -> tuple[pd.DataFrame, list[str], dict[str, str]]:
    """The table of the jobs in a tree; jobs without coefficients; files that cannot be read, with reasons.

    Parameters
    ----------
    tree
        A folder with jobs at any depth; one that does not say its type and lies at least two folders deep is
        of the type that the first of them names. Hidden files are left out.

    Raises
    ------
    OSError
        Without such a folder.
    """
    import pandas as pd

    tables, undetermined, damaged = [pd.DataFrame(columns=list(COLUMNS))], list[str](), dict[str, str]()
    files = sorted(tree.resolve(strict=True).rglob("*.toml"))
    for count, file in enumerate(files, 1):
        path = printable(file.relative_to(tree.resolve()).as_posix())
        if f"/{path}".count("/."):
            continue
        folders = path.split("/")
        usual = folders[0] if len(folders) > 2 else ""
        try:
            # apart from what the command keeps of files that it reads: those of a whole tree are too many
            tables += Context().run(_read_job, file, path, usual)
        except UndeterminedError:
            undetermined.append(path)
        except (ValueError, OSError, ArithmeticError, MemoryError) as error:
            damaged[path] = str(error).partition("\n")[0] or type(error).__name__
        progress.info("%d of %d files", count, len(files))
    return pd.concat(tables[1:] or tables, ignore_index=True), undetermined, damaged


def _read_job(file: Path, path: str, machine_type: str) -> list[pd.DataFrame]:
    """The rows of a job, of this type unless it says another; none of a file that is no job."""
    import pandas as pd

    with each_file_once(), warnings.catch_warnings(action="ignore"):
        if not {"runs", "weights"}.intersection(read_toml(file)):
            return []
        job = read_job(file)
        measured = estimate_influence(job.trials)
    labels, keys, W = job.trials.labels, job.settings, measured.W
    s, c, p = np.indices(W.shape).reshape(3, -1)
    planes = [measured.planes[k] for k in p]
    values = (
        *(path, machine_of(job), keys.machine_type or machine_type, str(keys.date or "")),
        *(quantity_of(labels), labels.vibration_unit, labels.weight_unit, runs_of(job)),
        *([measured.sensors[k] for k in c], planes, [mounted_in(job, plane) for plane in planes]),
        *(measured.speeds[s], W.real.ravel(), W.imag.ravel(), known_errors(measured).ravel()),
    )
    return [pd.DataFrame(dict(zip(COLUMNS, values, strict=True)))]


def known_errors(measured: Influence) -> FloatArray:
    """Standard deviation of either part of coefficients, (S, C, P); 0 where errors are assumed."""
    variances = np.einsum("...ii->...i", measured.channels(known=True))[..., 2:]
    return np.asarray(np.sqrt(variances.reshape(*measured.W.shape, 2).mean(axis=-1)))


def quantity_of(labels: Labels) -> str:
    """What is read; "" unknown."""
    unit = labels.vibration_unit
    return vibration(unit).kind.replace("length", "displacement") if unit else ""


def mounted_in(job: Job, plane: str) -> str:
    """What the weights of a plane are: masses at another radius act otherwise."""
    if job.trials.labels.unbalances:
        return "unbalance"
    return f"mass at {1e3 * job.radii[plane]:.3g} mm" if plane in job.radii else "mass"


def runs_of(job: Job) -> str:
    """The SHA-256 of the readings of a job, by which its copies are known."""
    return hashlib.sha256(job.trials.readings.tobytes()).hexdigest()


def machine_of(job: Job) -> str:
    """As the job says; else its folder, or the first above it whose name is not a date alone."""
    folders = (printable(folder.name) for folder in job.files[0].resolve().parents)
    return job.settings.machine or next((name for name in folders if not _DATE.fullmatch(name)), "")


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
    pa, data = arrow(what), file_content(path)
    try:
        return pa.parquet.read_table(io.BytesIO(data), page_checksum_verification=True)
    except pa.ArrowException as error:
        raise refusal(path, f"{what} (it is damaged, or something else)") from error


def read_fleet(path: Path) -> pd.DataFrame:
    """The table of jobs that `fleet fit --output` has written; InputError for what is none."""
    table: pd.DataFrame = read_parquet(path, "a table of a fleet").to_pandas()
    if not {*COLUMNS} <= {*table}:
        raise refusal(path, f"the table that rotorid fleet fit TREE --output {path.name} writes")
    return table
