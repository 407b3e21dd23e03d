"""`rotorid balance`: its workbook of a job with results, and an empty one to fill in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rotorid.cli.common import provenance
from rotorid.cli.output import check_targets

if TYPE_CHECKING:
    from rotorid.cli.commands.balance_report import Report
    from rotorid.tables import Job
    from rotorid.tables.job.source import JobSource


def write_template(path: Path, files: object) -> None:
    """Write an empty workbook, and say so.

    Raises
    ------
    ValueError
        If there is a job as well, or the name is no workbook's or one of an existing file, which may be
        filled in already.
    """
    from rotorid.tables.job.workbook_template import template_bytes
    from rotorid.tables.reader.writing import write_bytes

    if files:
        raise ValueError(
            "--template writes an empty workbook: leave the job away, or use --output for its own"
        )
    check_targets(None, path)
    if path.suffix.lower() != ".xlsx":
        raise ValueError(f"{path}: the form is a workbook; the name must end in .xlsx")
    if path.exists():
        raise ValueError(f"{path}: exists already, and may be filled in; choose another name or delete it")
    write_bytes(path, template_bytes())
    typer.echo(f"written: {path}\nFill it in (its sheet notes says how), then: rotorid balance {path}")


def as_workbook(output: Path | None) -> Path | None:
    """The file of `--output` where it is a workbook, which holds the whole job; else None."""
    return output if output is not None and output.suffix.lower() == ".xlsx" else None


def workbook(
    job: Job, source: JobSource, output: Path | None, report: Report, options: Mapping[str, object]
) -> tuple[Path | None, Callable[[], bytes]]:
    """A file and its content for `emit`: the job with its results."""
    from rotorid.tables.job.workbook_writing import job_workbook_bytes

    target = as_workbook(output)
    return target, lambda: job_workbook_bytes(
        job, source, target or Path(), report, provenance(job.files, options)
    )
