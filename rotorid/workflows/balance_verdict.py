"""Verdict of a balance: by limits of the readings, and by a tolerance of the planes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing import Correction, Influence
    from balancing.correction.verdict import Verdict
    from balancing.iso21940 import Tolerance
    from balancing.mounting.mount_result import Mounted
    from rotorid.tables import Job


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
