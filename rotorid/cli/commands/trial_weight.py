"""`rotorid trial-weight`: the first trial weight of a plane."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorid.cli.common import AnglesOption, JsonOption, OutputOption, PhaseOption, PlotOption, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.trial_weight import TrialWeightOptions
from rotorid.workflows.trial_weight import trial_weight as work

say = options_of(TrialWeightOptions)


def trial_weight(
    job: Annotated[
        Path | None,
        typer.Argument(
            metavar="[JOB]",
            help="Job (.toml, .xlsx) with coefficients, a rotor or trial runs: they give amount and angle.",
        ),
    ] = None,
    rotor_mass: Annotated[str | None, say("rotor_mass", "MASS")] = None,
    bearing_load: Annotated[str | None, say("bearing_load", "FORCE")] = None,
    carried_by: Annotated[int, say("carried_by", "N", least=1)] = TrialWeightOptions.carried_by,
    speed: Annotated[str | None, say("speed", "SPEED")] = None,
    radius: Annotated[str | None, say("radius", "RADIUS")] = None,
    fraction: Annotated[float, say("fraction", "PERCENT")] = TrialWeightOptions.fraction,
    share: Annotated[float, say("share", "PERCENT")] = TrialWeightOptions.share,
    plane: Annotated[str | None, say("plane", "LIST")] = None,
    mass: Annotated[str | None, say("mass", "MASS")] = None,
    max_mass: Annotated[str | None, say("max_mass", "MASS")] = None,
    reading_phase: Annotated[float | None, say("reading_phase", "DEGREES")] = None,
    lag: Annotated[str | None, say("lag", "below|at|above|DEGREES")] = None,
    critical: Annotated[str | None, say("critical", "SPEED")] = None,
    damping: Annotated[float, say("damping", "RATIO")] = TrialWeightOptions.damping,
    sensor_angle: Annotated[float, say("sensor_angle", "DEGREES")] = TrialWeightOptions.sensor_angle,
    key_phasor: Annotated[float, say("key_phasor", "DEGREES")] = TrialWeightOptions.key_phasor,
    measures: Annotated[str, say("measures", "QUANTITY")] = TrialWeightOptions.measures,
    phase: PhaseOption = None,
    angles: AnglesOption = None,
    unit: Annotated[str, say("unit", "UNIT")] = TrialWeightOptions.unit,
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
