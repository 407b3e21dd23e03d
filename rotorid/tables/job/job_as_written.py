"""A job as its files have it, before anything is converted: tables as cells, settings as they are written."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotorid.files.conventions import Conventions
from rotorid.files.layout import read_runs_grid
from rotorid.tables.job.job_data import Job, Overrides
from rotorid.tables.job.job_from_excel import WrittenJob, open_job
from rotorid.tables.job.job_keys import LARGEST, READINGS, TABLES
from rotorid.tables.job.readings import overriding_errors
from rotorid.tables.reader.columns import Source, read_grid
from rotorid.tables.reader.grid import Grid
from rotorid.tables.reader.problems import Problems, TableWarning
from rotorid.tables.reader.settings_keys import Quantity
from rotorid.tables.reader.text_file import read_bytes

_SHEET = {"influence": "influence", "weights": "weights", "check_weights": "weights"}
"""Of a workbook that a job names for a table; all others are runs tables."""


@dataclass(frozen=True)
class JobSource:
    """What a job is read from: files, and what the caller says besides.

    Attributes
    ----------
    files
        A job (`.toml`, `.xlsx`), or a runs table and, perhaps, a weights table.
    influence
        Influence table, beside tables.
    overrides
        Conventions and errors in place of those of the job.
    max_weights, limits
        As `job_limits.with_limits` takes them.
    """

    files: tuple[Path, ...]
    influence: Path | None = None
    overrides: Overrides = field(default_factory=Overrides)
    max_weights: Mapping[str, Quantity] = field(default_factory=dict)
    limits: Mapping[str, Quantity] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class JobTables:
    """A job as it is written, with the tables of its files.

    Attributes
    ----------
    written
        Settings and remarks; no table is named in the settings, and the rotor in `rotor` instead.
    tables
        Cells, by the names of `keys.TABLES`.
    rotor
        File of the rotor model.
    """

    written: WrittenJob
    tables: Mapping[str, Grid]
    rotor: Path | None = None


def job_tables(source: JobSource, job: Job) -> JobTables:
    """Read the files of a job again, as they are written, with what the caller says put in its place.

    Parameters
    ----------
    source
        What the job was read from.
    job
        The job as it was read.

    Raises
    ------
    InputError
        If a file cannot be read any more.
    """
    problems = Problems()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TableWarning)  # said when the job was read
        if source.influence is not None or len(source.files) != 1:
            named: dict[str, Source] = dict(zip(TABLES, source.files, strict=False))
            if source.influence is not None:
                named["influence"] = source.influence
            written, rotor = WrittenJob(Path()), None
        else:
            written = open_job(source.files[0], problems)
            named, rotor = _files(written.settings, written.path)
            written.settings.pop("columns", None)  # the tables have the names of runs tables
            if not written.tables:
                written.comments["settings"] = _comments(written.path, problems)
        if source.overrides.waveforms is not None:
            named["runs"] = Path(source.overrides.waveforms)
        tables = _grids({**named, **written.tables}, job.conventions, problems)
    problems.stop()
    _override(written.settings, source, job)
    return JobTables(written, tables, rotor)


def _comments(path: Path, problems: Problems) -> tuple[str, ...]:
    """Whole lines of a job file that are comments."""
    data = (read_bytes(path, problems) or b"").decode("utf-8-sig")
    lines = [line.strip() for line in data.splitlines()]
    return tuple(line.lstrip("# ") for line in lines if line.startswith("#") and line.strip("# "))


def _files(settings: dict[str, Any], job: Path) -> tuple[dict[str, Source], Path | None]:
    """Take the files out of the settings of a job that was read before."""
    named: dict[str, Source] = {
        key: job.parent / settings.pop(key).strip()
        for key in TABLES
        if isinstance(settings.get(key), str)  # slow_roll may be vectors
    }
    if isinstance(settings.get("runs"), list):
        named["runs"] = tuple(job.parent / name.strip() for name in settings.pop("runs"))
    rotor = settings.pop("rotor", None)
    return named, None if rotor is None else job.parent / str(rotor).strip()


def _grids(sources: Mapping[str, Source], conventions: Conventions, problems: Problems) -> dict[str, Grid]:
    out = {}
    for key, source in sources.items():
        sheet = _SHEET.get(key, "runs")
        if isinstance(source, Path) and source.suffix.lower() == ".toml":
            from rotorid.tables.waveforms.vectors_of_records import read_vectors_grid

            found = read_vectors_grid(source, conventions.labels.phase, problems)
            grid = None if found is None else found[0]
        elif key in READINGS:
            grid = read_runs_grid(source, conventions, problems)
        else:
            grid = read_grid(source, sheet, problems, may_be_empty=sheet == "weights")
        if grid is not None:
            out[key] = grid
    return out


def _override(settings: dict[str, Any], source: JobSource, job: Job) -> None:
    """Put what the caller says into the settings."""
    words = {"phase": source.overrides.phase, "angles": source.overrides.angles}
    settings |= {key: word for key, word in words.items() if word}
    given = overriding_errors(source.overrides)
    if given:
        settings["errors"] = {**settings.get("errors", {}), **given}
    labels = job.trials.labels
    planes = {
        name: (f"max_{'mass' if most.unit.kind == 'mass' else 'unbalance'}_{most.unit.name}", most.value)
        for name, most in source.max_weights.items()
    }
    sensors = {
        name: (
            "limit",
            most.value if most.unit.name == labels.vibration_unit else most.si * labels.vibration_scale,
        )
        for name, most in source.limits.items()
    }
    for table, items in (("planes", planes), ("sensors", sensors)):
        for name, (key, value) in items.items():
            own = dict(settings.setdefault(table, {}).get(name, {}))
            for old in [k for k in own if k == key or (LARGEST.accepts(k) and LARGEST.accepts(key))]:
                del own[old]
            settings[table] = {**settings[table], name: {**own, key: value}}
