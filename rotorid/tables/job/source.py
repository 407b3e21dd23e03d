"""A job as its files have it, before anything is converted: tables as cells, settings as they are written."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotorid.tables.job.job_data import Job
from rotorid.tables.job.keys import COLUMNS
from rotorid.tables.job.quantity import Quantity
from rotorid.tables.job.settings import Overrides
from rotorid.tables.job.workbook_reading import TABLES, is_notes, read_job_book
from rotorid.tables.reader.columns import read_grid
from rotorid.tables.reader.grid import Cell, Grid, Row
from rotorid.tables.reader.problems import Problems, TableWarning
from rotorid.tables.reader.text_file import read_bytes
from rotorid.tables.reader.toml_file import read_toml
from rotorid.tables.reader.workbook import is_workbook, read_workbook

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
    phase, angles, amplitude_error_percent, phase_error_deg, run_error_percent
        In place of what the job says.
    max_weights, limits
        As `job_limits.with_limits` takes them.
    """

    files: tuple[Path, ...]
    influence: Path | None = None
    phase: str | None = None
    angles: str | None = None
    amplitude_error_percent: float | None = None
    phase_error_deg: float | None = None
    run_error_percent: float | None = None
    max_weights: Mapping[str, Quantity] = field(default_factory=dict)
    limits: Mapping[str, Quantity] = field(default_factory=dict)

    @property
    def overrides(self) -> Overrides:
        """Conventions and errors in place of those of the job."""
        errors = self.amplitude_error_percent, self.phase_error_deg, self.run_error_percent
        return Overrides(self.phase, self.angles, *errors)


@dataclass(frozen=True, eq=False)
class JobTables:
    """A job as it is written.

    Attributes
    ----------
    tables
        Cells, by the names of `jobbook.TABLES`.
    settings
        Nested as in a job file; no table is named in it, and the rotor in `rotor` instead.
    rotor
        File of the rotor model.
    remarks, comments
        As in `JobBook`.
    notes
        Sheets for remarks.
    sources
        Where each table comes from.
    """

    tables: Mapping[str, Grid]
    settings: dict[str, Any]
    rotor: Path | None = None
    remarks: Mapping[tuple[str, str], Mapping[str, Cell]] = field(default_factory=dict)
    comments: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    notes: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)


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
        found = _read(source, problems)
    problems.stop()
    _override(found.settings, source, job)
    return found


def _read(source: JobSource, problems: Problems) -> JobTables:
    if source.influence is not None or len(source.files) != 1:
        named = dict(zip(TABLES, source.files, strict=False))
        if source.influence is not None:
            named["influence"] = source.influence
        return JobTables(_grids(named, problems), {}, sources={k: str(p) for k, p in named.items()})
    path = source.files[0]
    if is_workbook(path):
        return _of_workbook(path, problems)
    settings = dict(read_toml(path, problems) or {})
    named, rotor = _files(settings, path)
    data = (read_bytes(path, problems) or b"").decode("utf-8-sig")
    lines = [line.strip() for line in data.splitlines()]
    said = tuple(line.lstrip("# ") for line in lines if line.startswith("#") and line.strip("# "))
    sources = {key: str(file) for key, file in named.items()} | {"settings": str(path)}
    return JobTables(_grids(named, problems), settings, rotor, comments={"settings": said}, sources=sources)


def _of_workbook(path: Path, problems: Problems) -> JobTables:
    sheets = read_workbook(path, problems)
    book = None if sheets is None else read_job_book(path, sheets, COLUMNS, problems)
    problems.stop()
    assert sheets is not None
    assert book is not None
    settings = dict(book.settings)
    named, rotor = _files(settings, path)
    tables = {**book.tables, **_grids(named, problems)}
    notes = {title: rows for title, rows in sheets.items() if is_notes(title)}
    sources = {**{key: grid.source for key, grid in book.tables.items()}, "settings": str(path)}
    sources |= {key: str(file) for key, file in named.items()}
    return JobTables(tables, settings, rotor, book.remarks, book.comments, notes, sources)


def _files(settings: dict[str, Any], job: Path) -> tuple[dict[str, Path], Path | None]:
    """Take the files out of the settings of a job that was read before."""
    named = {
        key: job.parent / settings.pop(key).strip()
        for key in TABLES
        if isinstance(settings.get(key), str)  # slow_roll may be vectors
    }
    rotor = settings.pop("rotor", None)
    return named, None if rotor is None else job.parent / str(rotor).strip()


def _grids(named: Mapping[str, Path], problems: Problems) -> dict[str, Grid]:
    out = {}
    for key, path in named.items():
        sheet = _SHEET.get(key, "runs")
        grid = read_grid(path, sheet, problems, may_be_empty=sheet == "weights")
        if grid is not None:
            out[key] = grid
    return out


def _override(settings: dict[str, Any], source: JobSource, job: Job) -> None:
    """Put what the caller says into the settings."""
    words = {"phase": source.phase, "angles": source.angles}
    settings |= {key: word for key, word in words.items() if word}
    errors = {
        "amplitude_percent": source.amplitude_error_percent,
        "phase_deg": source.phase_error_deg,
        "run_percent": source.run_error_percent,
    }
    given = {key: value for key, value in errors.items() if value is not None}
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
            for old in [k for k in own if k.startswith(("max_mass_", "max_unbalance_")) or k == "limit"]:
                del own[old]
            settings[table] = {**settings[table], name: {**own, key: value}}
