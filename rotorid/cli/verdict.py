"""Verdict of a balance: limits of the readings, and a tolerance of the planes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.cli.common import one_speed
from rotorid.cli.tolerance import quantity

if TYPE_CHECKING:
    from balancing import Correction, Influence
    from balancing.mounted import Mounted
    from balancing.tolerance import Tolerance
    from balancing.verdict import Verdict
    from rotorid.tables import Job


def tolerance_of(
    grade: str | None, mass: str | None, service_speed: str | None, planes: tuple[str, ...]
) -> Tolerance | None:
    """Tolerance of one or two planes in equal parts; None where no grade is given.

    Raises
    ------
    ValueError
        For some of the three options only, more than two planes, and values that cannot be.
    """
    from balancing.tolerance import tolerance
    from rotorid.tables import units

    given = [value is not None for value in (grade, mass, service_speed)]
    if not any(given):
        return None
    if grade is None or mass is None or service_speed is None:
        raise ValueError("a tolerance needs --grade, --rotor-mass and --service-speed together")
    if len(planes) > 2:
        raise ValueError(
            "a balance quality grade is one of rigid rotors: it is shared by one or two planes, not by "
            f"{len(planes)}; choose two with --planes, or judge by limits of the readings"
        )
    return tolerance(
        quantity(mass, "--rotor-mass", units.MASS, "500kg"),
        one_speed(service_speed, "--service-speed"),
        grade,
        planes=dict.fromkeys(planes),
    )


def judge(
    result: Correction, influence: Influence, job: Job, tolerance: Tolerance | None, mounted: Mounted | None
) -> Verdict | None:
    """Of the check run if there is one, else of the prediction; None without anything to judge by."""
    from balancing.verdict import verdict_of_check, verdict_of_prediction
    from rotorid.tables.units import weight

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
        mounted=None if mounted is None else mounted.weights,
        after=None if mounted is None else mounted.after,
    )
