"""What can be mounted in a plane, as a job says it: holes, available weights, weights that are there already.

Angles of holes count as all angles of the job do. Where material is removed (`remove = true`) a hole drilled
at the angle φ acts like a weight added at φ + 180°: `Holes` has the angles of these equivalent weights, so
that amounts are positive and Σ amounts e^{iφ} is the correction D in either case; `names` say which hole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from balancing import Holes, Labels, Limits, from_list
from rotorid.base.suggestions import did_you_mean
from rotorid.files.settings_keys import Said
from rotorid.files.weights_with_units import in_job_units, other_kind
from rotorid.tables.job.job_keys import FORBIDDEN, HOLES, SAME_DEG


def read_holes(
    said: Said, labels: Labels | None, planes: Sequence[str], limits: Limits | None
) -> dict[str, Holes]:
    """Holes of the planes that have some, as the job's weights are (kg or kg·m); problems are noted.

    Parameters
    ----------
    said
        All keys of the job.
    labels
        Of the job: unit of the weights, direction of the angles. None: nothing is made, but all is checked.
    planes
        Names of all planes of the job.
    limits
        Of these planes. Holes strictly inside a forbidden arc are left out, unless there is a weight in them
        already; the plane's largest weight is that of its holes.
    """
    made = {}
    for name, plane in said["planes"].items():
        holes_at = _angles(plane)
        sound = _fits_together(plane, tuple(holes_at))
        if not (sound and holes_at) or labels is None or name not in planes:
            continue
        arcs: Sequence[tuple[float, float]] = ()
        largest = math.inf
        if limits is not None:
            at = list(planes).index(name)
            arcs, largest = limits.forbidden[at], float(limits.max_weight[at])
        holes = _make(plane, holes_at, labels, arcs, largest)
        if holes is not None:
            made[name] = holes
    return made


def _angles(plane: Said) -> dict[str, float]:
    """Angle of each hole by its name, "1", "2", … unless the job says another; none with a problem."""
    section, names = plane.section, plane["hole_names"]
    if "holes_deg" in section and "holes" in section:
        section.complain("holes", "either holes, equally spaced, or holes_deg, their angles, not both")
        return {}
    if "first_hole_deg" in section and "holes" not in section:
        section.complain("first_hole_deg", "the number of equally spaced holes too, holes = 12")
    degrees = _degrees(plane)
    if names is not None and degrees and len(names) != len(degrees):
        expected = f"a name for each of the {len(degrees)} holes, not {len(names)} names"
        section.complain("hole_names", expected)
        return {}
    if names is None and "hole_names" in section:
        return {}
    return hole_angles(plane)


def hole_angles(plane: Said) -> dict[str, float]:
    """Angle of each hole of a plane by its name, degrees as the job counts; none where there are no holes."""
    degrees = _degrees(plane)
    return dict(zip(plane["hole_names"] or map(str, range(1, len(degrees) + 1)), degrees, strict=False))


def _degrees(plane: Said) -> tuple[float, ...]:
    if plane["holes"] is None:
        return tuple(plane["holes_deg"] or ())
    return tuple(plane["first_hole_deg"] + 360.0 * k / plane["holes"] for k in range(plane["holes"]))


def _fits_together(plane: Said, names: Sequence[str]) -> bool:
    """Whether keys of which each is right by itself can stand together; else problems."""
    section, available, step, taken = plane.section, plane["available_g"], plane["step_g"], plane["taken"]
    before = len(section.refused)
    given = [name for key in HOLES for name in section.keys if key.accepts(name)]
    if given and "holes" not in section and "holes_deg" not in section:
        section.complain(given[0], "the holes of the plane too, holes = 12 or holes_deg = [0, 30, 75]")
        return False
    if available is not None and step is not None:
        expected = f"either {available.key}, single weights, or {step.key}, any size in steps"
        section.complain(step.key, expected)
    some = any(key.startswith("available_") for key in given)
    for key in ("per_hole", "stock"):
        if key in given and key not in section.refused and not some:
            section.complain(key, "the weights that are available too, available_g = [5, 10]")
    for name in taken:
        if names and name not in names:
            few = f"from {names[0]} to {names[-1]}" if len(names) > 1 else names[0]
            section.complain("taken", f"holes of the plane, {few}, not {name!r}{did_you_mean(name, names)}")
    sizes = () if available is None else available.value
    if len(set(sizes)) < len(sizes):
        section.complain(available.key, "each weight once (stock says how many of each there are)")
    if names and all(name in taken for name in names):
        section.complain("taken", "at least one hole that is free")
    if sizes and plane["stock"] and len(plane["stock"]) != len(sizes):
        expected = f"one number for each of the {len(sizes)} available weights, not {len(plane['stock'])}"
        section.complain("stock", expected)
    return len(section.refused) == before


def _make(
    plane: Said, holes: dict[str, float], labels: Labels, arcs: Sequence[tuple[float, float]], limit: float
) -> Holes | None:
    section, available, step = plane.section, plane["available_g"], plane["step_g"]
    radius = None if plane["radius_mm"] is None else plane["radius_mm"].si
    pieces = () if available is None else in_job_units(available, labels.weight_unit, radius)
    steps = (0.0,) if step is None else in_job_units(step, labels.weight_unit, radius)
    if pieces is None or steps is None:
        wrong = (available if pieces is None else step).key
        section.complain(wrong, other_kind(wrong, labels.weight_unit))
        return None
    turn = 180.0 if plane["remove"] else 0.0
    angles = {
        name: math.radians((labels.with_rotation(angle) + turn) % 360.0) for name, angle in holes.items()
    }
    taken = {name: plane["taken"].get(name, 0.0) / labels.weight_scale for name in holes}
    kept = [name for name, angle in angles.items() if taken[name] > 0 or not inside(angle, arcs)]
    key = "holes" if plane["holes"] is not None else "holes_deg"
    if not any(taken[name] == 0 for name in kept):
        section.complain(key, f"at least one free hole outside the angles of {FORBIDDEN.name}")
        return None
    try:
        return from_list(
            [angles[name] for name in kept],
            pieces,
            per_hole=plane["per_hole"],
            step=steps[0],
            taken=[taken[name] for name in kept],
            stock=None if plane["stock"] is None else np.array(plane["stock"]),
            names=kept,
            max_weight=limit,
        )
    except ValueError as error:
        section.complain(key, f"holes in which something can be mounted: {error}")
        return None


def inside(angle: float, arcs: Sequence[tuple[float, float]]) -> bool:
    """Whether an angle lies strictly inside one of the arcs; their ends, to within rounding, do not count."""
    near = math.radians(SAME_DEG)
    return any(near < (angle - start) % (2 * math.pi) < width - near for start, width in arcs)
