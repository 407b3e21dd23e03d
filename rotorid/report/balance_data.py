"""Data that only the balancing sheet shows, in the job's units: runs, coefficients, 95 % widths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_result import HELD
from balancing.data.result_columns import INVISIBLE, known, mounted_rows, reading_columns, vector_columns
from balancing.solvers.error_propagation import region_radius
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.result import Column, rows
from rotorid.base.rpm import rpm
from rotorid.regression import coverage_factor
from rotorid.tables.reader import units

if TYPE_CHECKING:
    from balancing import Correction, Influence
    from balancing.data.trials import Trials
    from balancing.mounting.mount_result import Mounted
    from rotorid.tables import Job


def sheet_data(
    result: Correction, influence: Influence, job: Job, mounted: Mounted | None = None
) -> dict[str, Any]:
    """What stands under the key "sheet" of the document in a balancing sheet.

    Parameters
    ----------
    result, influence, job
        Of one and the same job.
    mounted
        Pieces in holes, where they were chosen.

    Returns
    -------
    dict
        machine, runs, slow_roll, influence, corrections, add, residuals; what is unknown is None.
    """
    return {
        "machine": _machine(result, job),
        "runs": _runs(job.trials),
        "slow_roll": _slow_roll(job),
        "influence": _influence(influence),
        "corrections": _corrections(result, job),
        "add": _add(result, job),
        "residuals": _residuals(result, mounted),
    }


def _machine(c: Correction, job: Job) -> dict[str, Any]:
    labels = c.labels
    planes = []
    for p, plane in enumerate(c.planes):
        holes = job.holes.get(plane)
        planes.append(
            {
                "plane": plane,
                "action": "remove" if plane in c.remove else "add",
                "radius_mm": _millimetres(job.radii.get(plane)),
                "trial_radius_mm": _millimetres(job.trial_radii.get(plane)),
                **c.plane_limits(p),
                "holes": None if holes is None else len(holes.angles),
                "node": job.plane_nodes.get(plane),
            }
        )
    unit = units.SPEED[labels.speed_unit]
    return {
        "planes": planes,
        "sensors": [
            {"sensor": s, "node": None if (at := job.sensor_places.get(s)) is None else at.node}
            for s in c.sensors
        ],
        "speeds_rpm": [rpm(w) for w in c.speeds],
        "speed_unit": labels.speed_unit,
        "speeds": [float(f"{w * unit.scale:.12g}") for w in c.speeds],
    }


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
        readings = (*reading_columns(trials.labels, trials.speeds, trials.sensors), Column("values", values))
        weights = mounted_rows(trials.labels, trials.planes, trials.weights[r])
        found.append({"run": run, "weights": weights, "readings": rows(readings)})
    return found


def _slow_roll(job: Job) -> list[dict[str, Any]] | None:
    """One row per sensor, and per speed (rpm) where the vectors differ by speed."""
    if job.slow_roll is None:
        return None
    trials = job.trials
    by_speed = job.slow_roll.ndim == 2
    speeds = trials.speeds if by_speed else np.full(1, np.nan)
    size, phase = vector_columns(trials.labels, "amplitude", job.slow_roll)
    return rows(
        (*reading_columns(trials.labels, speeds, trials.sensors), size, replace(phase, name="phase_deg"))
    )


def _influence(f: Influence) -> dict[str, Any]:
    """Vibration caused by a weight of one at 0°, phase as the job counts it; half widths of 95 %."""
    size = np.abs(f.W) * (f.labels.vibration_scale / f.labels.weight_scale)
    along, across = _widths(f)
    share = 100 * along / np.where(np.abs(f.W) > 0, np.abs(f.W), np.nan)
    readings = reading_columns(f.labels, f.speeds, f.sensors)
    table = (
        *(replace(column, values=np.repeat(list(column.values), len(f.planes))) for column in readings),
        Column("plane", f.planes * (len(f.speeds) * len(f.sensors))),
        Column("influence", size.ravel()),
        Column("phase_deg", f.labels.vibration(f.W)[1].ravel()),
        Column("influence_95_percent", share.ravel()),
        Column("phase_95_deg", across.ravel()),
    )
    return {"unit": f.unit, "rows": rows(table)}


def _widths(f: Influence) -> tuple[FloatArray, FloatArray]:
    """Half widths (S, C, P) of 95 % intervals: of sizes, and of phases in degrees (NaN: not determined)."""
    factor = coverage_factor(f.dof)
    if f.covariance is None or factor is None:
        return known(None, f.W.shape), known(None, f.W.shape)
    S, C, P = f.W.shape
    own = f.covariance[..., 2:, 2:].reshape(S, C, P, 2, P, 2)
    blocks = np.stack([own[:, :, p, :, p, :] for p in range(P)], axis=2)
    unit = np.where(np.abs(f.W) > 0, f.W, 1.0) / np.where(np.abs(f.W) > 0, np.abs(f.W), 1.0)
    found = []
    for way in (unit, 1j * unit):
        u = np.stack((way.real, way.imag), axis=-1)
        variance = np.einsum("scpi,scpij,scpj->scp", u, blocks, u)
        found.append(factor * np.sqrt(np.maximum(variance, 0.0)))
    along, across = found
    clear = np.abs(f.W) > region_radius(f.dof) / factor * np.maximum(along, across)
    angle = np.degrees(across / np.where(np.abs(f.W) > 0, np.abs(f.W), 1.0))
    return along, np.where(clear, angle, np.nan)


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
            Column("held_by_a_limit", sizes < HELD * np.abs(c.weights)),
            Column("mass_at_radius", _masses_at_radius(c, job, c.planes, c.weights)),
            Column("mass_unit", (c.labels.weight_unit.partition("_")[0],) * n),
        )
    )


def _add(c: Correction, job: Job) -> list[dict[str, Any]] | None:
    """What to add (or remove: opposite) where the weights of the last run stay mounted."""
    if c.mounted is None or c.to_add is None or not np.any(c.mounted[2]):
        return None
    planes = c.mounted[1]
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
    covariance = c.after_covariance if mounted is None else mounted.after_covariance
    limit = None if c.limits is None else c.limits.residual.ravel() * c.labels.vibration_scale
    return rows(
        (
            *c.vibration_columns(INVISIBLE, None if mounted is None else mounted.after),
            Column("within_95", c.within(covariance)),
            Column("limit", known(limit, c.before.size)),
        )
    )


def _millimetres(metres: float | None) -> float | None:
    return None if metres is None else float(f"{metres * 1e3:.12g}")
