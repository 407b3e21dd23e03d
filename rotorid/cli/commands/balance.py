"""`rotorid balance`: correction weights from trial runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import (
    AmplitudeErrorOption,
    AnglesOption,
    JsonOption,
    OutputOption,
    PhaseErrorOption,
    PhaseOption,
    PlotOption,
    ReportOption,
    RunErrorOption,
)
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.balance import BalanceOptions
from rotorid.workflows.balance import balance as work
from rotorid.workflows.coefficients import KINDS, MODEL_ERROR


def balance(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="JOB | RUNS WEIGHTS | RUNS",
            help="Job (.toml, .xlsx); or runs and weights tables; or a runs table with --influence.",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="METHOD",
            help="weighted (by the errors of the readings; the default), least-squares, or minmax (the "
            "smallest largest amplitude).",
            show_default=False,
        ),
    ] = None,
    influence: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Stored influence coefficients.", show_default=False)
    ] = None,
    coefficients: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help=f"{', '.join(KINDS)}: from the runs, from the job's rotor, or both; default: "
            "measured where there are trial weights.",
            show_default=False,
        ),
    ] = None,
    model_error: Annotated[
        float | None,
        typer.Option(
            metavar="PERCENT",
            min=0.0,
            help=f"Standard deviation of computed coefficients; combined: {MODEL_ERROR:g} if not given.",
            show_default=False,
        ),
    ] = None,
    amplitude_error: AmplitudeErrorOption = None,
    phase_error: PhaseErrorOption = None,
    run_error: RunErrorOption = None,
    phase: PhaseOption = None,
    angles: AnglesOption = None,
    planes: Annotated[
        str | None, typer.Option(metavar="LIST", help="Use these planes only.", show_default=False)
    ] = None,
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Use these speeds only, in the unit of the runs table, or with another one: 20Hz,25Hz.",
            show_default=False,
        ),
    ] = None,
    max_mass: Annotated[
        str | None,
        typer.Option(
            metavar="MASS", help="Largest weight of every plane, 5g; or left=5g,right=3g.", show_default=False
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SENSOR=VALUE",
            help="Largest amplitude of a sensor; VALUE alone: of all. May be repeated.",
            show_default=False,
        ),
    ] = None,
    ridge: Annotated[
        str | None,
        typer.Option(
            metavar="STRENGTH",
            help="Small weights where planes act alike: 0.01 … 0.1, or auto.",
            show_default=False,
        ),
    ] = None,
    truncate: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Keep this many combinations of planes (1, 2, …), or those above this share (below 1).",
            show_default=False,
        ),
    ] = None,
    split: Annotated[
        bool,
        typer.Option(
            "--split", help="Choose pieces in the holes of the job, all planes together (a picture of discs)."
        ),
    ] = False,
    split_seconds: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.1, help="For the proof that no choice is better.")
    ] = BalanceOptions.split_seconds,
    refine: Annotated[
        bool,
        typer.Option(
            "--refine",
            help="Add the job's check runs to its trial runs: coefficients and trim from all of them.",
        ),
    ] = False,
    history: Annotated[
        bool, typer.Option("--history", help="All runs and check runs of the job in one table, too.")
    ] = False,
    best_planes: Annotated[
        int | None,
        typer.Option(
            metavar="K", min=1, help="Use the best K planes, after comparing all choices.", show_default=False
        ),
    ] = None,
    trade_off: Annotated[
        bool, typer.Option("--trade-off", help="Residual against total weight, too (a second picture).")
    ] = False,
    grade: Annotated[
        str | None,
        typer.Option(
            metavar="GRADE", help="Judge the planes by ISO 21940-11: G0.4 to G4000.", show_default=False
        ),
    ] = None,
    rotor_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="For --grade, such as 500kg.", show_default=False)
    ] = None,
    service_speed: Annotated[
        str | None, typer.Option(metavar="SPEED", help="For --grade, such as 3000rpm.", show_default=False)
    ] = None,
    positions: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="For --grade, along the shaft: left=100mm,right=600mm; default: half in each plane.",
            show_default=False,
        ),
    ] = None,
    bearings: Annotated[
        str | None, typer.Option(metavar="A,B", help="For --positions, 0mm,700mm.", show_default=False)
    ] = None,
    centre: Annotated[
        str | None,
        typer.Option(metavar="POSITION", help="For --positions: of the centre of mass.", show_default=False),
    ] = None,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the coefficients, .csv or .xlsx.", show_default=False),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(metavar="FILE.xlsx", help="Write an empty workbook to fill in.", show_default=False),
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
