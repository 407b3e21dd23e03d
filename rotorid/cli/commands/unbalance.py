"""`rotorid unbalance`: where the unbalance is, from a single run and a rotor model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    emit,
    picture,
)
from rotorid.cli.output import check_targets
from rotorid.workflows.parameters import nodes as parse_nodes

if TYPE_CHECKING:
    from balancing.unbalance_result import Unbalance
    from rotorid.tables import Job

METHODS = ("minimum-norm", "ridge", "modal")


def unbalance(
    job: Annotated[
        Path, typer.Argument(metavar="JOB.toml", help="Job with a rotor and the place of every sensor in it.")
    ],
    stations: Annotated[str, typer.Option(help="Nodes or stations where unbalance may be: 6,9,12.")],
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help=f"{', '.join(METHODS)}; minimum-norm is least squares where the readings suffice.",
        ),
    ] = METHODS[0],
    modes: Annotated[
        int | None,
        typer.Option(min=1, metavar="K", help="Of the rotor, for modal: 1 … K.", show_default=False),
    ] = None,
    ridge: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="STRENGTH", help="For ridge; default: from the errors.", show_default=False
        ),
    ] = None,
    model_error: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="PERCENT", help="Standard deviation of the coefficients.", show_default=False
        ),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Unbalance at any stations of a rotor model that explains the readings of one run, without trial runs.

    Example: rotorid unbalance sample_data/model_job/job.toml --stations 6,12,19
    """
    from balancing.plots.unbalance_bars import unbalance_bars
    from rotorid.tables import read_job

    if method not in METHODS:
        raise ValueError(f"--method {method!r} is not known: one of {', '.join(METHODS)}")
    if (modes is not None) != (method == "modal"):
        raise ValueError("--method modal and --modes K belong together")
    if ridge is not None and method != "ridge":
        raise ValueError("--ridge is an option of --method ridge")
    check_targets(plot, output)
    read = read_job(job)
    result = _estimate(read, stations, method, modes, ridge, model_error)
    emit(
        result.to_dict(),
        result.summary,
        as_json=json,
        files=read.files,
        options={
            "stations": stations,
            "method": method,
            "modes": modes,
            "ridge": ridge,
            "model_error": model_error,
        },
        figure=(plot, picture(lambda ax: unbalance_bars(result, ax))),
        table=(output, result.to_frame),
    )


def _estimate(
    job: Job, stations: str, method: str, modes: int | None, ridge: float | None, model_error: float | None
) -> Unbalance:
    from balancing.coefficients.from_model import modal_shapes
    from balancing.unbalance import unbalance_of_run
    from rotorid.workflows.coefficients import computed

    if job.rotor is None:
        raise ValueError('this needs a rotor model: rotor = "rotor.toml" in the job file')
    asked = parse_nodes(stations, "--stations")
    places = {str(node): job.rotor.node(node) for node in asked}
    if len(set(places.values())) < len(asked):
        raise ValueError(f"--stations {stations!r}: every station may stand only once")
    influence = computed(job, (model_error or 0.0), places)
    shapes = modal_shapes(job.rotor, places, modes) if modes is not None else None
    if method == "modal":
        return unbalance_of_run(influence, job.trials, method="modal", shapes=shapes)
    if method == "ridge":
        return unbalance_of_run(influence, job.trials, method="ridge", ridge=ridge)
    return unbalance_of_run(influence, job.trials)
