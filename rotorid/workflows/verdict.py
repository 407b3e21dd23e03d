"""Verdict of a balance: limits of the readings, and a tolerance of the planes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing import Correction, Influence
    from balancing.correction.verdict import Verdict
    from balancing.iso21940 import Tolerance
    from balancing.mounting.mounted_result import Mounted
    from rotorid.tables import Job
    from rotorid.workflows.quantities import Amount, Positions


def tolerance_of(
    planes: Sequence[str],
    grade: str | None,
    rotor_mass: Amount | None,
    service_speed: Amount | None,
    places: Positions | None,
    bearings: str | tuple[float, float] | None,
    centre: Amount | None,
) -> Tolerance | None:
    """Tolerance of one or two planes; None where no grade is given.

    Parameters
    ----------
    planes
        Those that are used.
    grade, rotor_mass, service_speed, places, bearings, centre
        As in `BalanceOptions`; `places` are the positions.

    Raises
    ------
    ValueError
        For some of the options only, more than two planes, and values that cannot be.
    """
    from balancing.iso21940 import tolerance
    from rotorid.workflows.quantities import length, mass, positions, speed_with_unit, two_positions

    if all(x is None for x in (grade, rotor_mass, service_speed, places, bearings, centre)):
        return None
    if grade is None or rotor_mass is None or service_speed is None:
        raise ValueError("a tolerance needs --grade, --rotor-mass and --service-speed together")
    if len(planes) > 2:
        raise ValueError(
            "a balance quality grade is one of rigid rotors: it is shared by one or two planes, not by "
            f"{len(planes)}; choose two with --planes, or judge by limits of the readings"
        )
    at = dict.fromkeys(planes) if places is None else positions(places)
    if set(at) != set(planes):
        raise ValueError(f"--positions must name the planes that are used, {', '.join(planes)}")
    return tolerance(
        mass(rotor_mass, "--rotor-mass"),
        speed_with_unit(service_speed, "--service-speed"),
        grade,
        planes=at,
        bearings=None if bearings is None else two_positions(bearings),
        centre=None if centre is None else length(centre, "--centre", "350mm"),
    )


def judge(
    result: Correction, influence: Influence, job: Job, tolerance: Tolerance | None, mounted: Mounted | None
) -> Verdict | None:
    """Of the check run if there is one, else of the prediction; None without anything to judge by."""
    import numpy as np

    from balancing.correction.verdict import verdict_of_check, verdict_of_prediction
    from rotorid.tables.reader.units import weight

    limited = result.limits is not None and bool(np.isfinite(result.limits.residual).any())
    if tolerance is None and not limited:
        return None
    radii = None
    if tolerance is not None and weight(result.labels.weight_unit).kind == "mass":
        radii = {p: job.radii[p] for p in result.planes if p in job.radii}
        if lost := [p for p in result.planes if p not in radii]:
            raise ValueError(
                "a tolerance is one of unbalances, and the weights are masses: give the radius of every "
                f"plane, radius_mm in [planes.{lost[0]}] of the job"
            )
    if job.check is not None:
        return verdict_of_check(
            influence,
            job.check,
            tolerance=tolerance,
            radii=radii,
            limits=job.limits_of(influence.planes),
            planes=result.planes,
        )
    return verdict_of_prediction(
        result,
        tolerance=tolerance,
        radii=radii,
        mounted=None if mounted is None or mounted.on_top_of is not None else mounted.weights,
        after=None if mounted is None else mounted.after,
    )
