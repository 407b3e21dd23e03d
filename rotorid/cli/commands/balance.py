"""`rotorid balance`: correction weights from trial runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rotorid.commands.app import EQUATIONS, OUTPUT, TABLES, WITH_REPORT, Destination, check_targets, command
from rotorid.workflows.balance import BalanceOptions
from rotorid.workflows.balance import balance as work


@command(
    BalanceOptions,
    names={"machine_type": ["--type"]},
    least={
        "model_error": 0.0,
        "amplitude_error": 0.0,
        "phase_error": 0.0,
        "run_error": 0.0,
        "split_seconds": 0.1,
        "best_planes": 1,
    },
    panels={
        "Input and conventions": "phase angles amplitude_error phase_error run_error waveforms",
        "Method": "method planes speeds best_planes trade_off coefficients",
        "Limits": "max_mass limit",
        "Mounting": "split best",
        "Machines of a type": "machine_type",
        "Check run": "refine history",
        "Grade": "grade rotor_mass service_speed positions bearings centre",
        OUTPUT: "save_influence template",
        "Expert": "influence model_error ridge truncate split_seconds",
    },
    to=(*WITH_REPORT, *EQUATIONS),
)
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
    output = to.output
    workbook = output if output is not None and output.suffix.lower() == ".xlsx" else None
    replace(to, output=None if workbook else output).deliver(
        "correction weights",
        lambda: work(files, options),
        more=[
            (save_influence, TABLES, lambda found: found.influence_table(save_influence or "")),
            (workbook, TABLES, lambda found: found.workbook(workbook or "")),
        ],
    )


def _write_template(path: Path, files: Sequence[Path]) -> None:
    """Write an empty workbook, and say so.

    Raises
    ------
    ValueError
        If there is a job as well, or the name is no workbook's or one of an existing file, which may be
        filled in already.
    """
    from rotorid.tables.job.workbook_template import template_bytes
    from rotorid.tables.reader.table_writing import write_bytes

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
