"""`trial-weight`: the first trial weight of a plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, get_args

from rotorid.base.answer import Answer, together
from rotorid.base.logs import workflows as log
from rotorid.base.words import Angles, Phase, Quantity
from rotorid.commands.coefficients import choose, used_planes
from rotorid.commands.option_quantities import limited, mass, quantity, size, speed_with_unit
from rotorid.commands.quantities import Names, degrees, names, number, one_of
from rotorid.report.options import job_source, refuse
from rotorid.report.outcome import USUAL, Delivered, command, provenance
from rotorid.tables.reader.units import FORCE, MASS, UNBALANCE

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing import Lag, TrialWeight
    from rotorid.commands.option_quantities import Amount
    from rotorid.tables import Job

_WITH_JOB = ("plane", "mass", "share")
_ANGLE = ("reading_phase", "lag", "critical", "damping", "sensor_angle", "key_phasor", "measures")
_WITHOUT_JOB = (*_ANGLE, "speed", "fraction", "unit")


@dataclass(frozen=True)
class TrialWeightOptions:
    """Options of `trial_weight`: angles in degrees, `fraction` and `share` in percent.

    Attributes
    ----------
    rotor_mass : MASS
        Of the rotor, such as 500kg.
    bearing_load : FORCE
        Carried at the plane, such as 2500N.
    carried_by : N from 1
        Planes that share the mass of the rotor.
    speed : SPEED
        Of the trial run, such as 3000rpm.
    radius : RADIUS
        Where the weight goes, 200mm.
    fraction : PERCENT
        Without a job: its force, percent of the load.
    share : PERCENT
        With a job: the change it makes, percent of the largest reading.
    plane : LIST
        Planes of the job; default: all of them.
    mass : MASS
        Try this weight, with a job: what would it do?
    max_mass : MASS
        Largest weight of the plane, 30g.
    reading_phase : DEGREES
        Without a job: phase of the largest reading.
    lag : below|at|above|DEGREES
        Where the speed is, seen from the critical one; or by how much the vibration lags.
    critical : SPEED
        Critical speed, in place of --lag: 2400rpm.
    damping : RATIO
        Damping ratio at the critical speed.
    sensor_angle : DEGREES
        Where the sensor is (without a job).
    key_phasor : DEGREES
        Where the key phasor is (without a job).
    measures : QUANTITY
        displacement, velocity, acceleration (without a job).
    phase : lead|lag
        What a positive phase means.
    angles : DIRECTION
        How angles count: with rotation, against rotation, or clockwise and counter-clockwise where the job
        states its rotation.
    unit : UNIT
        Of the result without a job: g, oz, kg, mg or lb.
    """

    rotor_mass: Amount | None = None
    bearing_load: Amount | None = None
    carried_by: int = 1
    speed: Amount | None = None
    radius: Amount | None = None
    fraction: float = 10.0
    share: float = 40.0
    plane: Names | None = None
    mass: Amount | None = None
    max_mass: Amount | None = None
    reading_phase: float | None = None
    lag: str | float | None = None
    critical: Amount | None = None
    damping: float = 0.05
    sensor_angle: float = 0.0
    key_phasor: float = 0.0
    measures: str = "displacement"
    phase: str | None = None
    angles: str | None = None
    unit: str = "g"
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "rotor_mass speed radius bearing_load carried_by",
        "Weight": "fraction share mass max_mass plane",
        "Angle": "reading_phase lag critical damping sensor_angle key_phasor measures",
        "Conventions": "phase angles unit",
    }
    to: ClassVar[Sequence[str]] = USUAL


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialWeights(Delivered):
    """A trial weight for each plane."""

    weights: tuple[TrialWeight, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return {
            "trial_weights": [weight.to_dict() for weight in self.weights],
            "conventions": self.weights[0].labels.conventions(),
        }

    @property
    def answer(self) -> Answer:
        """Those of the planes."""
        return together(weight.answer for weight in self.weights)

    def to_frame(self) -> pd.DataFrame:
        """One row per plane, speed and sensor."""
        import pandas as pd

        return pd.concat([weight.to_frame() for weight in self.weights], ignore_index=True)

    def figure(self) -> Figure:
        """A polar picture of each plane."""
        from balancing.plots import trial_figure

        return trial_figure(self.weights)


@command
def trial_weight(
    job: Job | Path | str | None = None, options: TrialWeightOptions | None = None
) -> TrialWeights:
    """A first trial weight: how heavy, and at which angle.

    Amount from the load or from coefficients; angle opposite to the heavy spot.

    Example: rotorid trial-weight --rotor-mass 500kg --speed 3000rpm --radius 200mm --fraction 10

    Example: rotorid trial-weight --bearing-load 9kN --speed 50Hz --radius 8in --reading-phase 120 --lag below

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
    from balancing import plane_load

    options = options or TrialWeightOptions()
    rotor, load = options.rotor_mass, options.bearing_load
    carried = plane_load(
        None if rotor is None else mass(rotor, "--rotor-mass"),
        None if load is None else quantity(load, "--bearing-load", FORCE, "2500N"),
        options.carried_by,
    )
    files: Sequence[Path] = ()
    if job is None:
        refuse(options, _WITH_JOB, "needs a job with coefficients")
        weights = [_from_force(options, carried)]
    else:
        why = "is for a trial weight without a job, which has phases, speeds and coefficients"
        refuse(options, _WITHOUT_JOB, why)
        read = job_source(job, options.phase, options.angles)
        weights, files = _from_job(read, options, carried), read.files
    first = weights[0]
    for name, value in {"force_N": first.force, "load_N": first.load}.items():
        if value is not None:
            log.info("%s = %.6g", name, value)
    return TrialWeights(weights=tuple(weights), provenance=provenance(files, options))


def _from_force(options: TrialWeightOptions, load: float | None) -> TrialWeight:
    """Without a job: amount from the load, angle from the phase and the lag."""
    from balancing import Labels, trial_from_force

    missing = [name for name in ("speed", "radius") if getattr(options, name) is None]
    if load is None:
        missing.insert(0, "rotor-mass (or --bearing-load)")
    if options.speed is None or options.radius is None or load is None:
        raise ValueError(f"without a job, give --{' and --'.join(missing)}")
    phase_means: Phase = one_of(options.phase or "lead", "--phase", get_args(Phase))
    counted: Angles = one_of(options.angles or "with rotation", "--angles", get_args(Angles))
    shown = MASS[one_of(options.unit, "--unit", tuple(MASS))]
    labels = Labels(weight_unit=shown.name, weight_scale=shown.scale, phase=phase_means, angles=counted)
    measures: Quantity = one_of(options.measures, "--measures", get_args(Quantity))
    speed, phase, most = speed_with_unit(options.speed, "--speed"), options.reading_phase, options.max_mass
    return trial_from_force(
        "1",
        speed,
        size(options.radius, "--radius", "200mm"),
        load,
        fraction=options.fraction / 100,
        limit=inf if most is None else mass(most, "--max-mass", "30g"),
        phase=None if phase is None else labels.leading(radians(degrees(phase, "--reading-phase"))),
        lag=_lag(options, speed),
        sensor_angle=labels.with_rotation(radians(degrees(options.sensor_angle, "--sensor-angle"))),
        key_phasor=labels.with_rotation(radians(degrees(options.key_phasor, "--key-phasor"))),
        quantity=measures,
        labels=labels,
    )


def _from_job(job: Job, options: TrialWeightOptions, load: float | None) -> list[TrialWeight]:
    """With a job: amount and angle from its coefficients, one weight for each plane asked for."""
    from balancing import trial_from_coefficients

    job = limited(job, options.max_mass, ())
    influence, baseline = choose(job)
    today = influence if baseline is None else influence.rebased(baseline)
    unbalances = today.labels.unbalances
    stated = None if options.radius is None else size(options.radius, "--radius", "200mm")
    if stated is not None and unbalances:
        raise ValueError(
            "--radius is for weights as masses; those of this job are unbalances, mass times radius"
        )
    amount, units = None, (UNBALANCE, "300g_mm") if unbalances else (MASS, "30g")
    if options.mass is not None:
        amount = quantity(options.mass, "--mass", *units)
    weights = []
    for name in names(options.plane) or used_planes(job, influence):
        limit, radius = inf, None if unbalances else (job.radii.get(name) or stated)
        if job.limits is not None and name in job.planes:
            limit = float(job.limits.max_weight[job.planes.index(name)])
        weights.append(
            trial_from_coefficients(
                today,
                name,
                share=options.share / 100,
                amount=amount,
                limit=limit,
                radius=radius,
                trial_radius=stated or job.trial_radii.get(name) if radius is not None else None,
                load=load,
            )
        )
    return weights


def _lag(options: TrialWeightOptions, speed: float) -> Lag | None:
    from balancing import expected_lag

    lag, critical = options.lag, options.critical
    if lag is not None and critical is not None:
        raise ValueError("--lag and --critical are two ways to the same end: choose one")
    if critical is not None:
        at = speed_with_unit(critical, "--critical")
        if not at > 0:
            raise ValueError(f"--critical {critical!r}: a critical speed above 0 is needed")
        return expected_lag(ratio=speed / at, damping=options.damping)
    if lag is None:
        return None
    if lag in ("below", "at", "above"):
        return expected_lag(str(lag))
    angle = number(str(lag))
    if not 0 <= angle <= 360:
        raise ValueError(f"--lag {lag!r}: below, at or above, or degrees from 0 to 360, are needed")
    return expected_lag(degrees=angle)
