"""`rotorid balance`: correction weights from trial runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypedDict

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    check_inputs,
    check_targets,
    emit,
    names,
    speeds,
)


class Overrides(TypedDict):
    """What the command line says in place of the job file."""

    phase: str | None
    angles: str | None
    amplitude_error_percent: float | None
    phase_error_deg: float | None


def balance(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="JOB | RUNS WEIGHTS | RUNS",
            help="Job (.toml, .xlsx); or runs and weights tables; or a runs table with --influence.",
            show_default=False,
        ),
    ],
    influence: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Stored influence coefficients.", show_default=False)
    ] = None,
    amplitude_error: Annotated[
        float | None,
        typer.Option(metavar="PERCENT", help="Standard deviation of a reading's amplitude.", min=0.0),
    ] = None,
    phase_error: Annotated[
        float | None,
        typer.Option(metavar="DEGREES", help="Standard deviation of a reading's phase.", min=0.0),
    ] = None,
    phase: Annotated[
        str | None, typer.Option(metavar="lead|lag", help="What a positive phase means.", show_default=False)
    ] = None,
    angles: Annotated[
        str | None,
        typer.Option(
            metavar="'with rotation'|'against rotation'", help="How angles count.", show_default=False
        ),
    ] = None,
    planes: Annotated[
        str | None, typer.Option(metavar="A,B", help="Correct in these planes only.", show_default=False)
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(
            "--speeds",
            metavar="LIST",
            help="Use these speeds only, in the unit of the runs table, or with another one: 20Hz,25Hz.",
            show_default=False,
        ),
    ] = None,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the coefficients, .csv or .xlsx.", show_default=False),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Correction weights that minimise the vibration, with predicted residuals and uncertainty.

    Example: rotorid balance sample_data/turbo_job/job.toml --plot corrections.png

    Example: rotorid balance runs.csv weights.csv --amplitude-error 2 --phase-error 2
    """
    from balancing import correct, estimate_influence
    from balancing.plots import overview
    from rotorid.tables import job_from_files, read_job
    from rotorid.tables.influence import influence_bytes

    check_targets(plot, output, save_influence)
    targets = [path for path in (plot, output, save_influence) if path is not None]
    check_inputs(targets, [*files, *([influence] if influence is not None else [])])
    settings: Overrides = {
        "phase": phase,
        "angles": angles,
        "amplitude_error_percent": amplitude_error,
        "phase_error_deg": phase_error,
    }
    is_job = len(files) == 1 and influence is None and files[0].suffix.lower() in (".toml", ".xlsx")
    job = read_job(files[0], **settings) if is_job else job_from_files(files, influence=influence, **settings)
    coefficients = job.influence if job.influence is not None else estimate_influence(job.trials)
    result = correct(
        coefficients,
        baseline=job.trials if job.influence is not None else None,
        planes=names(planes),
        speeds=None if speed is None else speeds(speed, job.trials.labels.speed_unit),
    )
    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=job.files,
        options={
            **settings,
            "planes": planes,
            "speeds": speed,
            "influence": influence,
        },
        figure=(plot, lambda: overview(result)),
        table=(output, result.to_frame),
        more=None
        if save_influence is None
        else (save_influence, lambda: influence_bytes(save_influence, coefficients)),
    )
