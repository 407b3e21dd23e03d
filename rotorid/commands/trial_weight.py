"""`trial-weight`: the first trial weight of a plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, radians
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, get_args

from rotorid.base.answer import together
from rotorid.base.text import SHORT_ANGLES, Angles, Phase
from rotorid.commands.choice_of_coefficients import choose, used_planes
from rotorid.commands.option_units import above_zero, quantity, size, speed_with_unit
from rotorid.commands.option_values import Names, degrees, names, number, one_of
from rotorid.files import units
from rotorid.report.options import job_source, refuse
from rotorid.report.outcome import WITHOUT_FILE, Outcome, command, outcome_of, provenance, table_of

if TYPE_CHECKING:
    from balancing import Lag, TrialWeight
    from rotorid.commands.option_units import Amount
    from rotorid.files import Job

_WITHOUT_JOB = ("reading_phase", "lag", "sensor_angle", "speed")


@dataclass(frozen=True)
class TrialWeightOptions:
    """Options of `trial_weight`: angles in degrees.

    Attributes
    ----------
    load : MASS|FORCE
        What the plane carries: its share of the rotor, 250kg, or the load of its bearing, 2500N.
    speed : SPEED
        Of the trial run, such as 3000rpm.
    radius : RADIUS
        Where the weight goes, 200mm.
    share : PERCENT
        Of the load, its force, 10 by default; with a job of the largest reading, the change it makes, 40.
    plane : LIST
        Planes of the job; default: all of them.
    reading_phase : DEGREES
        Without a job: phase of the largest reading.
    lag : below|at|above|DEGREES
        Where the speed is, seen from the critical one; or by how much the vibration lags.
    sensor_angle : DEGREES
        Where the sensor is, seen from the key phasor (without a job).
    phase : lead|lag
        What a positive phase means.
    angles : DIRECTION
        How angles count: with rotation, against rotation, or clockwise and counter-clockwise where the job
        states its rotation.
    """

    load: Amount | None = None
    speed: Amount | None = None
    radius: Amount | None = None
    share: float | None = None
    plane: Names | None = None
    reading_phase: float | None = None
    lag: str | float | None = None
    sensor_angle: float = 0.0
    phase: str | None = None
    angles: str | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "load speed radius",
        "Weight": "share plane",
        "Angle": "reading_phase lag sensor_angle",
        "Conventions": "phase angles",
    }
    to = WITHOUT_FILE


@command
def trial_weight(job: Job | Path | str | None = None, options: TrialWeightOptions | None = None) -> Outcome:
    """A first trial weight: how heavy, and at which angle.

    Amount from the load or from coefficients; angle opposite to the heavy spot.

    Example: rotorid trial-weight --load 250kg --speed 3000rpm --radius 200mm

    Example: rotorid trial-weight --load 9kN --speed 50Hz --radius 8in --reading-phase 120 --lag below

    Example: rotorid trial-weight sample_data/model_job/job.toml --plane middle

    Parameters
    ----------
    job : JOB
        Job (.toml, .xlsx) with coefficients, a rotor or trial runs: they give amount and angle.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a job or an option that cannot be, or that means nothing with or without a job.
    """
    import pandas as pd

    from balancing.plots import trial_figure

    options = options or TrialWeightOptions()
    carried = None if options.load is None else _load(options.load)
    files: Sequence[Path] = ()
    if job is None:
        refuse(options, ("plane",), "needs a job with coefficients")
        weights = [_from_force(options, carried)]
    else:
        refuse(
            options,
            _WITHOUT_JOB,
            "is for a trial weight without a job, which has phases, speeds and coefficients",
        )
        read = job_source(job, options.phase, options.angles)
        weights, files = _from_job(read, options, carried), read.files
    return outcome_of(
        tuple(weights),
        provenance(files, options),
        answer=together(weight.answer for weight in weights),
        keys={
            "trial_weights": [weight.to_dict() for weight in weights],
            "conventions": weights[0].labels.conventions(),
        },
        file=lambda: table_of(pd.concat([weight.to_frame() for weight in weights]), "trial weights"),
        pictures={"The weight in each plane.": lambda: trial_figure(tuple(weights))},
        title="Trial weight",
    )


def _load(given: Amount) -> float:
    """Read "250kg" or "2500N" in N."""
    weights = {
        name: replace(unit, multiply=unit.multiply * units.STANDARD_GRAVITY)
        for name, unit in units.MASS.items()
    }
    example = "250kg or 2500N"
    return above_zero(quantity(given, "--load", weights | units.FORCE, example), given, "--load", example)


def _from_force(options: TrialWeightOptions, load: float | None) -> TrialWeight:
    """Without a job: amount from the load, angle from the phase and the lag."""
    from balancing import Labels, trial_from_force

    if options.speed is None or options.radius is None or load is None:
        raise ValueError("without a job, give --load, --speed and --radius")
    phase_means: Phase = one_of(options.phase or "lead", "--phase", get_args(Phase))
    way, phase = options.angles or "with rotation", options.reading_phase
    counted: Angles = one_of(SHORT_ANGLES.get(way, way), "--angles", get_args(Angles))
    assumed = ("phase",) if options.phase is None and phase is not None else ()
    labels = Labels(weight_unit="g", weight_scale=1e3, phase=phase_means, angles=counted, assumed=assumed)
    return trial_from_force(
        "1",
        speed_with_unit(options.speed, "--speed"),
        size(options.radius, "--radius", "200mm"),
        load,
        fraction=(10.0 if options.share is None else options.share) / 100,
        phase=None if phase is None else labels.phase_sign * radians(degrees(phase, "--reading-phase")),
        lag=_lag(options),
        sensor_angle=labels.with_rotation(radians(degrees(options.sensor_angle, "--sensor-angle"))),
        labels=labels,
    )


def _from_job(job: Job, options: TrialWeightOptions, load: float | None) -> list[TrialWeight]:
    """With a job: amount and angle from its coefficients, one weight for each plane asked for."""
    from balancing import trial_from_coefficients

    influence, baseline = choose(job)
    today = influence if baseline is None else influence.rebased(baseline)
    unbalances = today.labels.unbalances
    stated = None if options.radius is None else size(options.radius, "--radius", "200mm")
    if stated is not None and unbalances:
        raise ValueError(
            "--radius is for weights as masses; those of this job are unbalances, mass times radius"
        )
    weights = []
    for name in names(options.plane) or used_planes(job, influence):
        radius = None if unbalances else (job.radii.get(name) or stated)
        limits = job.limits_of([name] if name in job.planes else [])
        weights.append(
            trial_from_coefficients(
                today,
                name,
                share=(40.0 if options.share is None else options.share) / 100,
                limit=inf if limits is None else float(limits.max_weight.min(initial=inf)),
                radius=radius,
                trial_radius=stated or getattr(job.planes.get(name), "trial_radius", None)
                if radius is not None
                else None,
                load=load,
            )
        )
    return weights


def _lag(options: TrialWeightOptions) -> Lag | None:
    from balancing import expected_lag

    lag = options.lag
    if lag is None or lag in ("below", "at", "above"):
        return None if lag is None else expected_lag(str(lag))
    if not 0 <= (angle := number(str(lag))) <= 360:
        raise ValueError(f"--lag {lag!r}: below, at or above, or degrees from 0 to 360, are needed")
    return expected_lag(degrees=angle)
