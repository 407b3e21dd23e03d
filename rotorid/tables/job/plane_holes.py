"""Holes and weights of the planes of a job, made of what the planes say."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from balancing.data.conventions import Labels
from balancing.data.limits import Arc, Limits
from balancing.mounting.holes import Holes, from_list
from rotorid.tables.job.job_holes import SAME_DEG, TURN, HoleKeys
from rotorid.tables.job.keys import PlaneKeys
from rotorid.tables.job.quantity import to_job_weight
from rotorid.tables.reader import units


def make_holes(
    labels: Labels, planes: Sequence[str], keys: Mapping[str, PlaneKeys], limits: Limits | None
) -> dict[str, Holes]:
    """Holes of the planes that have some, as the job's weights are (kg or kg·m); problems are noted.

    Parameters
    ----------
    labels
        Of the job: unit of the weights, direction of the angles.
    planes
        Names of all planes of the job.
    keys
        What the job says about them.
    limits
        Of these planes. Holes strictly inside a forbidden arc are left out, unless there is a weight in them
        already; the plane's largest weight is that of its holes.
    """
    made = {}
    for name, plane in keys.items():
        if plane.holes is None or name not in planes:
            continue
        arcs: Sequence[Arc] = ()
        largest = math.inf
        if limits is not None:
            at = list(planes).index(name)
            arcs, largest = limits.forbidden[at], float(limits.max_weight[at])
        holes = _make(plane.holes, labels, plane.radius, arcs, largest, remove=plane.remove)
        if holes is not None:
            made[name] = holes
    return made


def _make(
    keys: HoleKeys, labels: Labels, radius: float | None, arcs: Sequence[Arc], limit: float, *, remove: bool
) -> Holes | None:
    weights = [*keys.available, *([keys.step] if keys.step is not None else [])]
    sizes = [to_job_weight(weight, labels.weight_unit, radius) for weight in weights]
    if None in sizes:
        keys.section.complain(weights[0].key, _other_kind(weights[0].key, labels.weight_unit))
        return None
    known = [size for size in sizes if size is not None]
    turn = 180.0 if remove else 0.0
    angles = [math.radians((labels.with_rotation(angle) + turn) % TURN) for angle in keys.degrees]
    taken = [keys.taken.get(name, 0.0) / labels.weight_scale for name in keys.names]
    kept = [k for k, angle in enumerate(angles) if taken[k] > 0 or not inside(angle, arcs)]
    if not any(taken[k] == 0 for k in kept):
        keys.section.complain(keys.key, "at least one free hole outside the angles of forbidden_deg")
        return None
    count = len(keys.available)
    try:
        return from_list(
            [angles[k] for k in kept],
            known[:count],
            per_hole=keys.per_hole,
            step=known[count] if keys.step is not None and not count else 0.0,
            taken=[taken[k] for k in kept],
            stock=None if keys.stock is None else np.array(keys.stock),
            names=[keys.names[k] for k in kept],
            max_weight=limit,
        )
    except ValueError as error:
        keys.section.complain(keys.key, f"holes in which something can be mounted: {error}")
        return None


def inside(angle: float, arcs: Sequence[Arc]) -> bool:
    """Whether an angle lies strictly inside one of the arcs; their ends, to within rounding, do not count."""
    near = math.radians(SAME_DEG)
    return any(near < (angle - start) % (2 * math.pi) < width - near for start, width in arcs)


def _other_kind(key: str, weight_unit: str) -> str:
    stem = key.partition("_")[0]
    mass = units.weight(weight_unit).kind == "mass"
    other, are = (f"{stem}_g", "masses") if mass else (f"{stem}_g_mm", "unbalances (mass × radius)")
    return f"{other}, because the weights of the job are {are}, or radius_mm too, to convert"
