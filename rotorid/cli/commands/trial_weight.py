"""`rotorid trial-weight`: the first trial weight of a plane."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import AnglesOption, JsonOption, OutputOption, PhaseOption, PlotOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.trial_weight import MEASURES, TrialWeightOptions
from rotorid.workflows.trial_weight import trial_weight as work


def trial_weight(
    job: Annotated[
        Path | None,
        typer.Argument(
            metavar="[JOB]",
            help="Job (.toml, .xlsx) with coefficients, a rotor or trial runs: they give amount and angle.",
            show_default=False,
        ),
    ] = None,
    rotor_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="Of the rotor, such as 500kg.", show_default=False)
    ] = None,
    bearing_load: Annotated[
        str | None,
        typer.Option(metavar="FORCE", help="Carried at the plane, such as 2500N.", show_default=False),
    ] = None,
    carried_by: Annotated[
        int, typer.Option(metavar="N", min=1, help="Planes that share the mass of the rotor.")
    ] = TrialWeightOptions.carried_by,
    speed: Annotated[
        str | None, typer.Option(metavar="SPEED", help="Such as 3000rpm.", show_default=False)
    ] = None,
    radius: Annotated[
        str | None, typer.Option(metavar="RADIUS", help="Where the weight goes, 200mm.", show_default=False)
    ] = None,
    fraction: Annotated[
        float, typer.Option(metavar="PERCENT", help="Force of the weight, of the load (without a job).")
    ] = TrialWeightOptions.fraction,
    share: Annotated[
        float, typer.Option(metavar="PERCENT", help="Change, of the largest reading (with a job).")
    ] = TrialWeightOptions.share,
    plane: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Planes of the job; default: all of them.", show_default=False),
    ] = None,
    mass: Annotated[
        str | None,
        typer.Option(
            metavar="MASS", help="Try this weight, with a job: what would it do?", show_default=False
        ),
    ] = None,
    max_mass: Annotated[
        str | None,
        typer.Option(metavar="MASS", help="Largest weight of the plane, 30g.", show_default=False),
    ] = None,
    reading_phase: Annotated[
        float | None,
        typer.Option(metavar="DEGREES", help="Of the largest initial reading, no job.", show_default=False),
    ] = None,
    lag: Annotated[
        str | None,
        typer.Option(
            metavar="below|at|above|DEGREES",
            help="Speed against the critical one, or the lag.",
            show_default=False,
        ),
    ] = None,
    critical: Annotated[
        str | None,
        typer.Option(metavar="SPEED", help="Critical speed, in place of --lag: 2400rpm.", show_default=False),
    ] = None,
    damping: Annotated[
        float, typer.Option(metavar="RATIO", help="Damping ratio at the critical speed.")
    ] = TrialWeightOptions.damping,
    sensor_angle: Annotated[
        float, typer.Option(metavar="DEGREES", help="Where the sensor is (without a job).")
    ] = TrialWeightOptions.sensor_angle,
    key_phasor: Annotated[
        float, typer.Option(metavar="DEGREES", help="Where the key phasor is (without a job).")
    ] = TrialWeightOptions.key_phasor,
    measures: Annotated[
        str, typer.Option(metavar="QUANTITY", help=f"{', '.join(MEASURES)} (without a job).")
    ] = TrialWeightOptions.measures,
    phase: PhaseOption = None,
    angles: AnglesOption = None,
    unit: Annotated[
        str, typer.Option(metavar="UNIT", help="Of the result without a job: g, oz, kg, mg or lb.")
    ] = TrialWeightOptions.unit,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """A first trial weight: amount from the load or the sensitivity, angle opposite to the heavy spot.

    Example: rotorid trial-weight --rotor-mass 500kg --speed 3000rpm --radius 200mm --fraction 10

    Example: rotorid trial-weight --bearing-load 9kN --speed 50Hz --radius 8in --reading-phase 120 --lag below

    Example: rotorid trial-weight sample_data/model_job/job.toml --plane middle
    """
    options = chosen(TrialWeightOptions, locals())
    check_targets(plot, output)
    deliver("trial weight", lambda: work(job, options), as_json=json, plot=plot, output=output)
