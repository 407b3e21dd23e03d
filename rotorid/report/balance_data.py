"""Data that only the balancing sheet shows, in the job's units: runs, what to mount, 95 % widths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.result import Column, rows
from rotorid.base.rpm import rpm
from rotorid.files import units

if TYPE_CHECKING:
    from balancing import Correction, Mounted, Trials
    from rotorid.tables import Job


def sheet_data(result: Correction, job: Job, mounted: Mounted | None = None) -> dict[str, Any]:
    """What stands under the key "sheet" of the document in a balancing sheet.

    Parameters
    ----------
    result, job
        Of one and the same job.
    mounted
        Pieces in holes, where they were chosen.

    Returns
    -------
    dict
        machine, runs, slow_roll, corrections, add, residuals; what is unknown is None.
    """
    return {
        "machine": _machine(result, job),
        "runs": _runs(job.trials),
        "slow_roll": _slow_roll(job),
        "corrections": _corrections(result, job),
        "add": _add(result, job),
        "residuals": _residuals(result, mounted),
    }


def _machine(c: Correction, job: Job) -> dict[str, Any]:
    limits = c.limits_document() or {"max_weight": {}, "forbidden_deg": {}}
    planes = []
    for plane in c.planes:
        holes = job.holes.get(plane)
        planes.append(
            {
                "plane": plane,
                "action": "remove" if plane in c.remove else "add",
                "radius_mm": _millimetres(job.radii.get(plane)),
                "trial_radius_mm": _millimetres(job.trial_radii.get(plane)),
                "max_weight": limits["max_weight"].get(plane),
                "forbidden_deg": limits["forbidden_deg"].get(plane, []),
                "holes": None if holes is None else len(holes.angles),
                "node": job.plane_nodes.get(plane),
            }
        )
    return {"planes": planes}


def _runs(trials: Trials) -> list[dict[str, Any]]:
    size, phase = trials.labels.vibration(trials.readings)
    found = []
    for r, run in enumerate(trials.runs):
        values = [
            [
                {"amplitude": size[(k, r, *place)], "phase_deg": phase[(k, r, *place)]}
                for k in range(trials.repeats[(r, *place)])
            ]
            for place in np.ndindex(*size.shape[2:])
        ]
        readings = (*_places(trials.speeds, trials.sensors), Column("values", values))
        weights = _mounted(trials, trials.weights[r])
        found.append({"run": run, "weights": weights, "readings": rows(readings)})
    return found


def _slow_roll(job: Job) -> list[dict[str, Any]] | None:
    """One row per sensor, and per speed (rpm) where the vectors differ by speed."""
    if job.slow_roll is None:
        return None
    trials = job.trials
    by_speed = job.slow_roll.ndim == 2
    speeds = trials.speeds if by_speed else np.full(1, np.nan)
    size, phase = (part.ravel() for part in trials.labels.vibration(job.slow_roll))
    vectors = Column("amplitude", size), Column("phase_deg", phase)
    return rows((*_places(speeds, trials.sensors), *vectors))


def _places(speeds: FloatArray, sensors: Sequence[str]) -> tuple[Column, Column]:
    """Speed and sensor of readings (S, C), one row a reading, speed by speed; speeds in rad/s."""
    turns = np.repeat([rpm(speed) for speed in speeds], len(sensors))
    return Column("speed_rpm", turns), Column("sensor", tuple(sensors) * len(speeds))


def _mounted(trials: Trials, weights: ComplexArray) -> list[dict[str, Any]]:
    """Rows of the planes in which there is something."""
    there, labels = np.flatnonzero(weights).tolist(), trials.labels
    mass, angle = labels.weight(weights[there])
    return rows(
        (
            Column("plane", [trials.planes[p] for p in there]),
            Column("mass", mass),
            Column("unit", (labels.weight_unit,) * len(there)),
            Column("angle_deg", angle),
        )
    )


def _corrections(c: Correction, job: Job) -> list[dict[str, Any]]:
    """Where each weight goes (material to remove: opposite), its 95 %, its mass at a known radius."""
    sizes, angles = c.half_widths()
    n = len(c.planes)
    return rows(
        (
            Column("plane", c.planes),
            Column("place_deg", c.places(c.planes, c.weights)),
            Column("mass_95", sizes * c.labels.weight_scale),
            Column("angle_95_deg", np.degrees(angles)),
            Column("held_by_a_limit", c.held),
            Column("mass_at_radius", _masses_at_radius(c, job, c.planes, c.weights)),
            Column("mass_unit", (c.labels.weight_unit.partition("_")[0],) * n),
        )
    )


def _add(c: Correction, job: Job) -> list[dict[str, Any]] | None:
    """What to add (or remove: opposite) where the weights of the last run stay mounted."""
    if not c.mounted.weights.any():
        return None
    planes = c.mounted.planes
    return rows(
        (
            Column("plane", planes),
            Column("action", ["remove" if plane in c.remove else "add" for plane in planes]),
            Column("mass", c.labels.weight(c.to_add)[0]),
            Column("place_deg", c.places(planes, c.to_add)),
            Column("mass_at_radius", _masses_at_radius(c, job, planes, c.to_add)),
        )
    )


def _masses_at_radius(
    c: Correction, job: Job, planes: Sequence[str], weights: ComplexArray
) -> list[float | None]:
    """Of unbalances (kg·m) in planes whose radius is known, in the unit's own mass."""
    if units.weight(c.labels.weight_unit).kind != "unbalance":
        return [None] * len(planes)
    scale = units.MASS[c.labels.weight_unit.partition("_")[0]].scale
    return [
        abs(weight) / job.radii[plane] * scale if plane in job.radii else None
        for plane, weight in zip(planes, weights, strict=True)
    ]


def _residuals(c: Correction, mounted: Mounted | None) -> list[dict[str, Any]]:
    """Vibration before and after, as it will be mounted, with the radius of its 95 % region and its limit."""
    limit: FloatArray = np.full(c.before.size, np.nan)
    if c.limits is not None:
        limit = c.limits.residual.ravel() * c.labels.vibration_scale
    return rows(
        (
            *c.vibration_columns(after=None if mounted is None else mounted.after),
            Column("within_95", c.within.ravel()),
            Column("limit", limit),
        )
    )


def _millimetres(metres: float | None) -> float | None:
    return None if metres is None else float(f"{metres * 1e3:.12g}")
