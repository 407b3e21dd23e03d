"""`rotorid balance`: correction weights from trial runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import TABLES, Destination, check_targets, command
from rotorid.commands.balance import BalanceOptions
from rotorid.commands.balance import balance as work


@command(BalanceOptions, panels=BalanceOptions.panels, to=BalanceOptions.to)
def balance(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="JOB | RUNS WEIGHTS | RUNS",
            help="Job (.toml, .xlsx); or runs and weights tables; or a runs table with --influence.",
        ),
    ] = None,
    *,
    options: BalanceOptions,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the coefficients, .csv or .xlsx."),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(metavar="FILE.xlsx", help="Write an empty workbook to fill in."),
    ] = None,
    to: Destination,
) -> None:
    """Correction weights from trial runs or a rotor model, with ± and what will be left.

    Example: rotorid balance sample_data/turbo_job/job.toml --plot corrections.png

    Example: rotorid balance sample_data/turbo_job/holes.toml --split --report sheet.html

    Example: rotorid balance sample_data/turbo_job/runs.csv sample_data/turbo_job/weights.csv --phase lead

    Example: rotorid balance --template job.xlsx

    Den Hartog's method: influence coefficients at several speeds, least squares over all of them.

    The workbook, filled in, is a job: --output sheet.xlsx writes it with its results, and --output
    weights.csv the corrections alone.
    """
    if template is not None:
        _write_template(template, files or ())
        return
    if not files:
        raise ValueError(
            "give a job (.toml, .xlsx) or a runs table and a weights table; --template writes a form"
        )
    to.deliver(
        "correction weights",
        lambda: work(files, options),
        more=[(save_influence, TABLES, lambda result: result.influence_table(save_influence or ""))],
    )


def _write_template(path: Path, files: Sequence[Path]) -> None:
    """Write an empty workbook, and say so.

    Raises
    ------
    ValueError
        If there is a job as well, or the name is no workbook's or one of an existing file, which may be
        filled in already.
    """
    from rotorid.files.table_writing import write_bytes
    from rotorid.tables.job.workbook_template import template_bytes

    if files:
        raise ValueError(
            "--template writes an empty workbook: leave the job away, or use --output for its own"
        )
    check_targets([(path, TABLES)])
    if path.suffix.lower() != ".xlsx":
        raise ValueError(f"{path}: the form is a workbook; the name must end in .xlsx")
    if path.exists():
        raise ValueError(f"{path}: exists already, and may be filled in; choose another name or delete it")
    write_bytes(path, template_bytes())
    typer.echo(f"written: {path}\nFill it in (its sheet notes says how), then: rotorid balance {path}")
