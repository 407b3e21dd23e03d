"""`rotorid balance`: correction weights from trial runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common_options import (
    AmplitudeErrorOption,
    AnglesOption,
    JsonOption,
    OutputOption,
    PhaseErrorOption,
    PhaseOption,
    PlotOption,
    ReportOption,
    RunErrorOption,
    options_of,
)
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.balance import BalanceOptions, choices
from rotorid.workflows.balance import balance as work

say = options_of(BalanceOptions)


def balance(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="JOB | RUNS WEIGHTS | RUNS",
            help="Job (.toml, .xlsx); or runs and weights tables; or a runs table with --influence.",
        ),
    ] = None,
    method: Annotated[str | None, say("method", "METHOD"), choices] = None,
    influence: Annotated[Path | None, say("influence", "FILE")] = None,
    coefficients: Annotated[str | None, say("coefficients", "KIND")] = None,
    model_error: Annotated[float | None, say("model_error", "PERCENT", least=0.0)] = None,
    amplitude_error: AmplitudeErrorOption = None,
    phase_error: PhaseErrorOption = None,
    run_error: RunErrorOption = None,
    phase: PhaseOption = None,
    angles: AnglesOption = None,
    planes: Annotated[str | None, say("planes", "LIST")] = None,
    speeds: Annotated[str | None, say("speeds", "LIST")] = None,
    max_mass: Annotated[str | None, say("max_mass", "MASS")] = None,
    limit: Annotated[list[str] | None, say("limit", "SENSOR=VALUE")] = None,
    ridge: Annotated[str | None, say("ridge", "STRENGTH")] = None,
    truncate: Annotated[float | None, say("truncate", "NUMBER")] = None,
    split: Annotated[bool, say("split", None, "--split")] = False,
    split_seconds: Annotated[
        float, say("split_seconds", "SECONDS", least=0.1)
    ] = BalanceOptions.split_seconds,
    refine: Annotated[bool, say("refine", None, "--refine")] = False,
    history: Annotated[bool, say("history", None, "--history")] = False,
    best_planes: Annotated[int | None, say("best_planes", "K", least=1)] = None,
    trade_off: Annotated[bool, say("trade_off", None, "--trade-off")] = False,
    grade: Annotated[str | None, say("grade", "GRADE")] = None,
    rotor_mass: Annotated[str | None, say("rotor_mass", "MASS")] = None,
    service_speed: Annotated[str | None, say("service_speed", "SPEED")] = None,
    positions: Annotated[str | None, say("positions", "LIST")] = None,
    bearings: Annotated[str | None, say("bearings", "A,B")] = None,
    centre: Annotated[str | None, say("centre", "POSITION")] = None,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the coefficients, .csv or .xlsx."),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(metavar="FILE.xlsx", help="Write an empty workbook to fill in."),
    ] = None,
    sheet: ReportOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Correction weights that minimise the vibration, with predicted residuals and uncertainty.

    Example: rotorid balance sample_data/turbo_job/job.toml --plot corrections.png

    Example: rotorid balance sample_data/turbo_job/holes.toml --split --report sheet.html

    Example: rotorid balance runs.csv weights.csv --amplitude-error 2 --phase-error 2 --max-mass 5g

    Example: rotorid balance --template job.xlsx, and when it is filled in: rotorid balance job.xlsx --output
    sheet.xlsx (the job and its results in one workbook; --output weights.csv: the corrections alone)
    """
    options = chosen(BalanceOptions, locals())
    if template is not None:
        _write_template(template, files or ())
        return
    if not files:
        raise ValueError(
            "give a job (.toml, .xlsx) or a runs table and a weights table; --template writes a form"
        )
    check_targets(plot, output, save_influence, report=sheet)
    workbook = output if output is not None and output.suffix.lower() == ".xlsx" else None
    deliver(
        "correction weights",
        lambda: work(files, options),
        as_json=json,
        plot=plot,
        output=None if workbook else output,
        report=sheet,
        more=[
            (save_influence, lambda found: found.influence_table(save_influence or "")),
            (workbook, lambda found: found.workbook(workbook or "")),
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
    check_targets(None, path)
    if path.suffix.lower() != ".xlsx":
        raise ValueError(f"{path}: the form is a workbook; the name must end in .xlsx")
    if path.exists():
        raise ValueError(f"{path}: exists already, and may be filled in; choose another name or delete it")
    write_bytes(path, template_bytes())
    typer.echo(f"written: {path}\nFill it in (its sheet notes says how), then: rotorid balance {path}")
