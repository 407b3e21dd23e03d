"""`rotorid trial-weight`: the first trial weight of a plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.cli.verbose import note
from rotorid.plots import plot
from rotorid.workflows.parameters import names
from rotorid.workflows.quantities import limited, quantity, speed_with_unit

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing.data.conventions import Labels
    from balancing.trial_angle import Lag
    from balancing.trial_result import TrialWeight

MEASURES = ("displacement", "velocity", "acceleration")


FRACTION, SHARE, DAMPING = 10.0, 40.0, 0.05
"""Percent of the load, percent of the largest reading, and the damping ratio, if nobody says."""


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
    ] = 1,
    speed: Annotated[
        str | None, typer.Option(metavar="SPEED", help="Such as 3000rpm.", show_default=False)
    ] = None,
    radius: Annotated[
        str | None, typer.Option(metavar="RADIUS", help="Where the weight goes, 200mm.", show_default=False)
    ] = None,
    fraction: Annotated[
        float, typer.Option(metavar="PERCENT", help="Force of the weight, of the load (without a job).")
    ] = FRACTION,
    share: Annotated[
        float, typer.Option(metavar="PERCENT", help="Change, of the largest reading (with a job).")
    ] = SHARE,
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
    ] = DAMPING,
    sensor_angle: Annotated[
        float, typer.Option(metavar="DEGREES", help="Where the sensor is (without a job).")
    ] = 0.0,
    key_phasor: Annotated[
        float, typer.Option(metavar="DEGREES", help="Where the key phasor is (without a job).")
    ] = 0.0,
    measures: Annotated[
        str, typer.Option(metavar="QUANTITY", help=f"{', '.join(MEASURES)} (without a job).")
    ] = MEASURES[0],
    phase: Annotated[
        str | None, typer.Option(metavar="lead|lag", help="What a positive phase means.", show_default=False)
    ] = None,
    angles: Annotated[
        str | None,
        typer.Option(
            metavar="'with rotation'|'against rotation'", help="How angles count.", show_default=False
        ),
    ] = None,
    unit: Annotated[
        str, typer.Option(metavar="UNIT", help="Of the result without a job: g, oz, kg, mg or lb.")
    ] = "g",
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """A first trial weight: amount from the load or the sensitivity, angle opposite to the heavy spot.

    Example: rotorid trial-weight --rotor-mass 500kg --speed 3000rpm --radius 200mm --fraction 10

    Example: rotorid trial-weight --bearing-load 9kN --speed 50Hz --radius 8in --reading-phase 120 --lag below

    Example: rotorid trial-weight sample_data/model_job/job.toml --plane middle
    """
    check_targets(plot, output)
    asked: dict[str, Any] = dict(locals())
    options = {key: value for key, value in asked.items() if key not in ("json", "plot", "output", "job")}
    load = None if bearing_load is None else _force(bearing_load)
    rotor = None if rotor_mass is None else _mass(rotor_mass, "--rotor-mass")
    if load is not None and rotor is not None:
        raise ValueError("--rotor-mass and --bearing-load are two ways to the same load: choose one")
    if job is None:
        own: dict[str, object] = {
            "--plane": plane,
            "--mass": mass,
            "--share": share if share != SHARE else None,
        }
        _refuse(own, "needs a job with coefficients")
        found = [_from_force(asked, rotor, load)]
        files: Sequence[Path] = ()
    else:
        needless: dict[str, object] = {
            "--reading-phase": reading_phase,
            "--lag": lag,
            "--critical": critical,
            "--speed": speed,
            "--fraction": fraction if fraction != FRACTION else None,
            "--damping": damping if damping != DAMPING else None,
            "--sensor-angle": sensor_angle or None,
            "--key-phasor": key_phasor or None,
            "--measures": measures if measures != MEASURES[0] else None,
            "--unit": unit if unit != "g" else None,
        }
        _refuse(needless, "is for a trial weight without a job, which has phases, speeds and coefficients")
        found, files = _from_job(job, asked, rotor, load)
    if plot is not None and any(t.angle is None for t in found):
        raise ValueError("--plot needs an angle: give --reading-phase and --lag, or a job")
    first = found[0].to_dict()
    note({key: first[key] for key in ("force_N", "load_N")})
    emit(
        {"trial_weights": [t.to_dict() for t in found], "conventions": found[0].labels.conventions()},
        lambda: "\n\n".join(t.summary() for t in found),
        as_json=json,
        files=files,
        options={**options, "job": job},
        figure=(plot, lambda: _figure(found)),
        table=(output, lambda: _table(found)),
    )


def _from_force(asked: dict[str, Any], rotor: float | None, load: float | None) -> TrialWeight:
    """Without a job: amount from the load, angle from the phase and the lag."""
    from math import inf, radians

    from balancing.data.conventions import Labels
    from balancing.trial_weight import trial_from_force
    from rotorid.tables.reader import units
    from rotorid.tables.runs.conventions import Conventions, as_angles, as_phase

    missing = [name for name in ("speed", "radius") if asked[name] is None]
    if rotor is None and load is None:
        missing.insert(0, "rotor-mass (or --bearing-load)")
    if missing:
        raise ValueError(f"without a job, give --{' and --'.join(missing)}")
    if asked["measures"] not in MEASURES:
        from rotorid.base.suggestions import did_you_mean

        hint = did_you_mean(asked["measures"], MEASURES)
        raise ValueError(f"--measures {asked['measures']!r} is not known{hint}: one of {', '.join(MEASURES)}")
    known = Conventions(as_phase(asked["phase"] or "lead"), as_angles(asked["angles"] or "with rotation"))
    shown = units.one_of(units.MASS)(asked["unit"])
    labels = Labels(weight_unit=shown.name, weight_scale=shown.scale, phase=known.phase, angles=known.angles)
    speed = speed_with_unit(asked["speed"], "--speed")
    phase = asked["reading_phase"]
    return trial_from_force(
        "1",
        speed,
        quantity(asked["radius"], "--radius", units.LENGTH, "200mm"),
        rotor_mass=rotor,
        bearing_load=load,
        fraction=asked["fraction"] / 100,
        planes=asked["carried_by"],
        limit=inf if asked["max_mass"] is None else _mass(asked["max_mass"], "--max-mass"),
        phase=None if phase is None else known.phase_sign * radians(_degrees(phase, "--reading-phase")),
        lag=_lag(asked, speed),
        sensor_angle=known.angle_sign * radians(_degrees(asked["sensor_angle"], "--sensor-angle")),
        key_phasor=known.angle_sign * radians(_degrees(asked["key_phasor"], "--key-phasor")),
        quantity=asked["measures"],
        labels=labels,
    )


def _from_job(
    path: Path, asked: dict[str, Any], rotor: float | None, load: float | None
) -> tuple[list[TrialWeight], Sequence[Path]]:
    """With a job: amount and angle from its coefficients, one weight for each plane asked for."""
    from math import inf

    from balancing.coefficients.baseline import starting_point
    from balancing.trial_weight import GRAVITY, trial_from_coefficients
    from rotorid.tables import read_job
    from rotorid.tables.reader import units
    from rotorid.workflows.coefficients import choose, used_planes

    job = read_job(path, phase=asked["phase"], angles=asked["angles"])
    job = limited(job, asked["max_mass"], [])
    influence, baseline = choose(job)
    start = starting_point(influence, baseline)
    labels = start.labels
    by_mass = labels.weight_unit in units.MASS
    own = None if asked["radius"] is None else quantity(asked["radius"], "--radius", units.LENGTH, "200mm")
    if own is not None and not own > 0:
        raise ValueError(f"--radius {asked['radius']!r}: a radius above 0 is needed")
    if own is not None and not by_mass:
        raise ValueError(
            "--radius is for weights as masses; those of this job are unbalances, mass times radius"
        )
    amount = None if asked["mass"] is None else _weight(asked["mass"], labels)
    if rotor is not None:
        load = rotor * GRAVITY / asked["carried_by"]
    if load is not None and not load > 0:
        raise ValueError("the load must be above 0: --rotor-mass or --bearing-load")
    found = []
    for name in names(asked["plane"]) or used_planes(job, influence):
        limit, radius = inf, (job.radii.get(name) or own) if by_mass else None
        if job.limits is not None and name in job.planes:
            limit = float(job.limits.max_weight[job.planes.index(name)])
        found.append(
            trial_from_coefficients(
                influence,
                start.readings,
                name,
                share=asked["share"] / 100,
                amount=amount,
                limit=limit,
                radius=radius,
                trial_radius=own or job.trial_radii.get(name) if radius is not None else None,
                load=load,
                errors=start.model.errors,
                labels=labels,
            )
        )
    return found, job.files


def _lag(asked: dict[str, Any], speed: float) -> Lag | None:
    from balancing.trial_angle import expected_lag

    text, critical = asked["lag"], asked["critical"]
    if text is not None and critical is not None:
        raise ValueError("--lag and --critical are two ways to the same end: choose one")
    if critical is not None:
        at = speed_with_unit(critical, "--critical")
        if not at > 0:
            raise ValueError(f"--critical {critical!r}: a critical speed above 0 is needed")
        return expected_lag(ratio=speed / at, damping=asked["damping"])
    if text is None:
        return None
    if text in ("below", "at", "above"):
        return expected_lag(text)
    try:
        return expected_lag(degrees=float(text))
    except ValueError:
        raise ValueError(
            f"--lag {text!r}: below, at or above, or degrees from 0 to 360, are needed"
        ) from None


def _degrees(value: float, what: str) -> float:
    if not -360 <= value <= 360:
        raise ValueError(f"{what} {value:g}: an angle from -360 to 360 degrees is needed")
    return value


def _mass(text: str, what: str) -> float:
    from rotorid.tables.reader.units import MASS

    return quantity(text, what, MASS, "500kg" if what == "--rotor-mass" else "30g")


def _weight(text: str, labels: Labels) -> float:
    from rotorid.tables.reader import units

    by_mass = labels.weight_unit in units.MASS
    known, example = (units.MASS, "30g") if by_mass else (units.UNBALANCE, "300g_mm")
    return quantity(text, "--mass", known, example)


def _force(text: str) -> float:
    from rotorid.tables.reader.units import FORCE

    return quantity(text, "--bearing-load", FORCE, "2500N")


def _refuse(options: Mapping[str, object], why: str) -> None:
    for name, value in options.items():
        if value is not None:
            raise ValueError(f"{name} {why}")


def _table(found: Sequence[TrialWeight]) -> pd.DataFrame:
    import pandas as pd

    return pd.concat([t.to_frame() for t in found], ignore_index=True)


def _figure(found: Sequence[TrialWeight]) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5 * len(found), 5.5), layout="constrained")
    for k, t in enumerate(found):
        plot(t, figure.add_subplot(1, len(found), k + 1, projection="polar"))
    return figure
