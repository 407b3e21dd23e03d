"""`rotorid identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorid.base.json import finite
from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.cli.progress import busy
from rotorid.cli.verbose import note

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.harmonic.experiments import AmplitudeErrors
    from rotorid.harmonic.result import Identification

METHODS = ("equation-error", "output-error")
LOSSES = ("linear", "soft_l1", "huber", "cauchy")
ModelArgument = Annotated[
    Path, typer.Argument(metavar="MODEL.toml", help="Equations, known numbers, what to estimate.")
]
DataArgument = Annotated[
    Path | None,
    typer.Argument(
        metavar="DATA",
        help="Measured amplitudes, .csv or .xlsx; only --design does without.",
        show_default=False,
    ),
]
DesignOption = Annotated[
    str | None,
    typer.Option(
        metavar="FIRST:LAST:STEP",
        help="Which of these frequencies to measure next: rad/s, or with Hz or rpm at the end.",
        show_default=False,
    ),
]
ChooseOption = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="How many frequencies --design chooses.", show_default=False),
]
PercentOption = Annotated[
    float | None,
    typer.Option(
        metavar="PERCENT", help="One standard deviation of an amplitude, in percent.", show_default=False
    ),
]
DegreesOption = Annotated[
    float | None,
    typer.Option(
        metavar="DEGREES", help="One standard deviation of a phase, in degrees.", show_default=False
    ),
]


def identify(
    model: ModelArgument,
    data: DataArgument = None,
    method: Annotated[
        str, typer.Option(metavar="METHOD", help=f"{' or '.join(METHODS)} (nonlinear, for noisy data).")
    ] = METHODS[0],
    loss: Annotated[
        str, typer.Option(metavar="LOSS", help=f"Of output error: {', '.join(LOSSES)}.")
    ] = LOSSES[0],
    amplitude_error: PercentOption = None,
    phase_error: DegreesOption = None,
    design: DesignOption = None,
    choose: ChooseOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Coefficients of a model from measured amplitudes, with intervals, or what the data do tell.

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv

    With --amplitude-error 2 --phase-error 1 --design 5:40:1 --choose 3: which frequencies to measure next.
    """
    from rotorid.cli.commands.planning import plan
    from rotorid.harmonic import identify as estimate
    from rotorid.harmonic.plots import figure_identification
    from rotorid.tables import read_harmonic_model, read_measurements

    check_targets(plot, output)
    for option, value, known in (("--method", method, METHODS), ("--loss", loss, LOSSES)):
        if value not in known:
            from rotorid.base.suggestions import did_you_mean

            raise ValueError(
                f"{option} {value!r} is not known{did_you_mean(value, known)}: {' or '.join(known)}"
            )
    if loss != LOSSES[0] and method != METHODS[1]:
        raise ValueError(f"--loss belongs to --method {METHODS[1]}: linear regression has none")
    if data is None and (design is None or plot is not None):
        raise ValueError(
            "give a table of measured amplitudes after the model file (only --design does without)"
        )
    if choose is not None and design is None:
        raise ValueError("--choose belongs to --design FIRST:LAST:STEP")
    with busy("identification"):
        file = read_harmonic_model(model)
        file = replace(file, errors=_errors(file.errors, amplitude_error, phase_error))
        result = None
        if data is not None:
            experiments = read_measurements(data, file)
            start = (file.start or None) if method == METHODS[1] else None
            result = estimate(
                file.model, experiments, method=method, bounds=file.bounds or None, loss=loss, start=start
            )
        chosen = None if design is None else plan(file, result, design, choose)
    if result is not None:
        note({"degrees_of_freedom": result.dof})

    def draw() -> Figure:
        assert result is not None
        return figure_identification(result)

    document: dict[str, Any] = {} if result is None else {**result.to_dict(), **_details(result)}
    if chosen is not None:
        document["design"] = chosen.to_dict()
    parts = [part for part in (result, chosen) if part is not None]
    emit(
        document,
        lambda: "\n\n".join(part.summary() for part in parts),
        as_json=json,
        files=[model] if data is None else [model, data],
        options={
            "method": method,
            "loss": loss if method == METHODS[1] else None,
            "amplitude_error": amplitude_error,
            "phase_error": phase_error,
            "design": design,
            "choose": choose,
        },
        figure=(plot, draw),
        table=(output, parts[-1].to_frame),
    )


def _errors(
    stated: AmplitudeErrors | None, percent: float | None, degrees: float | None
) -> AmplitudeErrors | None:
    """Errors of the model file, those of the command line before them."""
    if percent is None and degrees is None:
        return stated
    for name, value, high in (("--amplitude-error", percent, 1000.0), ("--phase-error", degrees, 360.0)):
        if value is not None and not 0 <= value <= high:
            raise ValueError(f"{name} takes a number from 0 to {high:g}, not {value:g}")
    from rotorid.harmonic.experiments import AmplitudeErrors

    relative = percent / 100.0 if percent is not None else (stated.relative if stated else 0.0)
    phase = math.radians(degrees) if degrees is not None else (stated.phase if stated else 0.0)
    return AmplitudeErrors(relative, phase, stated.floor if stated else 0.0)


def _details(result: Identification) -> Mapping[str, Any]:
    """What the interface does not ask for: correlations, residuals, the effect of each experiment."""
    import numpy as np

    names = result.parameters
    correlation, influence = result.correlation, result.influence
    frame = result.residual_frame()
    return {
        "correlation": None
        if correlation is None
        else {a: {b: finite(correlation[i, j]) for j, b in enumerate(names)} for i, a in enumerate(names)},
        "residuals": [
            {key: finite(value) if key in ("re", "im") else value for key, value in row.items()}
            for row in frame.to_dict("records")
        ],
        "influence": None
        if influence is None
        else [
            {
                "experiment": experiment,
                "change": {name: finite(np.asarray(influence)[i, j]) for j, name in enumerate(names)},
            }
            for i, experiment in enumerate(result.experiments.names)
        ],
    }
