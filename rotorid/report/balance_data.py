"""What only the balancing sheet shows, as JSON types in the job's units: runs, coefficients, 95 % widths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_result import HELD
from balancing.solvers.error_propagation import region_radius
from rotorid.base.arrays import FloatArray
from rotorid.base.json import finite
from rotorid.base.units import rpm
from rotorid.regression import coverage_factor
from rotorid.tables.reader import units

if TYPE_CHECKING:
    from balancing import Correction, Influence
    from balancing.data.trials import Trials
    from balancing.mounting.mounted_result import Mounted
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
    limits = c.limits
    forbidden = (c.to_dict()["limits"] or {}).get("forbidden_deg", {})
    planes = []
    for p, plane in enumerate(c.planes):
        largest = None if limits is None else finite(limits.max_weight[p] * labels.weight_scale)
        holes = job.holes.get(plane)
        planes.append(
            {
                "plane": plane,
                "action": "remove" if plane in c.remove else "add",
                "radius_mm": _millimetres(job.radii.get(plane)),
                "trial_radius_mm": _millimetres(job.trial_radii.get(plane)),
                "max_weight": largest,
                "forbidden_deg": forbidden.get(plane, []),
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
    labels = trials.labels
    size, phase = labels.vibration(trials.readings)
    mass, angle = labels.weight(trials.weights)
    return [
        {
            "run": run,
            "weights": [
                {
                    "plane": plane,
                    "mass": float(mass[r, p]),
                    "unit": labels.weight_unit,
                    "angle_deg": float(angle[r, p]),
                }
                for p, plane in enumerate(trials.planes)
                if trials.weights[r, p] != 0
            ],
            "readings": [
                {
                    "speed_rpm": rpm(speed),
                    "sensor": sensor,
                    "values": [
                        {"amplitude": float(size[k, r, s, c]), "phase_deg": float(phase[k, r, s, c])}
                        for k in range(len(size))
                        if np.isfinite(size[k, r, s, c])
                    ],
                }
                for s, speed in enumerate(trials.speeds)
                for c, sensor in enumerate(trials.sensors)
            ],
        }
        for r, run in enumerate(trials.runs)
    ]


def _slow_roll(job: Job) -> list[dict[str, Any]] | None:
    """One row per sensor, and per speed (rpm) where the vectors differ by speed."""
    if job.slow_roll is None:
        return None
    size, phase = job.trials.labels.vibration(job.slow_roll)
    by_speed = job.slow_roll.ndim == 2
    speeds: list[float | None] = [rpm(w) for w in job.trials.speeds] if by_speed else [None]
    size, phase = np.atleast_2d(size), np.atleast_2d(phase)
    return [
        {
            "speed_rpm": speed,
            "sensor": sensor,
            "amplitude": float(size[s, c]),
            "phase_deg": float(phase[s, c]),
        }
        for s, speed in enumerate(speeds)
        for c, sensor in enumerate(job.trials.sensors)
    ]


def _influence(f: Influence) -> dict[str, Any]:
    """Vibration caused by a weight of one at 0°, phase as the job counts it; half widths of 95 %."""
    scale = f.labels.vibration_scale / f.labels.weight_scale
    size = np.abs(f.W) * scale
    phase = f.labels.vibration(f.W)[1]
    along, across = _widths(f)
    return {
        "unit": f.unit,
        "rows": [
            {
                "speed_rpm": rpm(speed),
                "sensor": sensor,
                "plane": plane,
                "influence": float(size[s, c, p]),
                "phase_deg": float(phase[s, c, p]),
                "influence_95_percent": None if along is None else _percent(along[s, c, p], f.W[s, c, p]),
                "phase_95_deg": None if across is None else finite(across[s, c, p]),
            }
            for s, speed in enumerate(f.speeds)
            for c, sensor in enumerate(f.sensors)
            for p, plane in enumerate(f.planes)
        ],
    }


def _percent(width: float, value: complex) -> float | None:
    return float(100 * width / abs(value)) if value != 0 else None


def _widths(f: Influence) -> tuple[FloatArray | None, FloatArray | None]:
    """Half widths (S, C, P) of 95 % intervals: of sizes, and of phases in degrees (NaN: not determined)."""
    if f.covariance is None:
        return None, None
    S, C, P = f.W.shape
    own = f.covariance[..., 2:, 2:].reshape(S, C, P, 2, P, 2)
    blocks = np.stack([own[:, :, p, :, p, :] for p in range(P)], axis=2)
    unit = np.where(np.abs(f.W) > 0, f.W, 1.0) / np.where(np.abs(f.W) > 0, np.abs(f.W), 1.0)
    factor = coverage_factor(f.dof)
    if factor is None:
        return None, None
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
    mass, angle = c.labels.weight(c.weights)
    factor, mass_std, angle_std = c.coverage_factor, c.mass_std, c.angle_std
    rows = []
    for p, plane in enumerate(c.planes):
        width = half = None
        held = False
        if factor is not None and mass_std is not None and angle_std is not None:
            width = float(factor * mass_std[p] * c.labels.weight_scale)
            half = finite(float(factor * np.degrees(angle_std[p])))
            held = bool(width < HELD * mass[p])
        rows.append(
            {
                "plane": plane,
                "place_deg": float((angle[p] + 180.0 * (plane in c.remove)) % 360),
                "mass_95": width,
                "angle_95_deg": half,
                "held_by_a_limit": held,
                "mass_at_radius": _mass_at_radius(c, job, plane, abs(c.weights[p])),
                "mass_unit": c.labels.weight_unit.partition("_")[0],
            }
        )
    return rows


def _add(c: Correction, job: Job) -> list[dict[str, Any]] | None:
    """What to add (or remove: opposite) where the weights of the last run stay mounted."""
    if c.mounted is None or c.to_add is None or not np.any(c.mounted[2]):
        return None
    mass, angle = c.labels.weight(c.to_add)
    return [
        {
            "plane": plane,
            "action": "remove" if plane in c.remove else "add",
            "mass": float(mass[p]),
            "place_deg": float((angle[p] + 180.0 * (plane in c.remove)) % 360),
            "mass_at_radius": _mass_at_radius(c, job, plane, abs(c.to_add[p])),
        }
        for p, plane in enumerate(c.mounted[1])
    ]


def _mass_at_radius(c: Correction, job: Job, plane: str, weight: float) -> float | None:
    """Of an unbalance (kg·m) in a plane whose radius is known, in the unit's own mass."""
    if units.weight(c.labels.weight_unit).kind != "unbalance" or plane not in job.radii:
        return None
    mass = units.MASS[c.labels.weight_unit.partition("_")[0]]
    return float(weight) / job.radii[plane] * mass.scale


def _residuals(c: Correction, mounted: Mounted | None) -> list[dict[str, Any]]:
    """Vibration before and after, as it will be mounted, with the radius of its 95 % region and its limit."""
    readings = c.after if mounted is None else mounted.after
    covariance = c.after_covariance if mounted is None else mounted.after_covariance
    old, old_phase = c.labels.vibration(c.before)
    new, new_phase = c.labels.vibration(readings)
    within = None
    if covariance is not None:
        largest = np.sqrt(np.linalg.eigvalsh(covariance)[..., -1]) * c.labels.vibration_scale
        within = region_radius(c.dof) * largest
    limit = None if c.limits is None else c.limits.residual * c.labels.vibration_scale
    nothing = 1e-9 * old.max()
    rows = []
    for s, speed in enumerate(c.speeds):
        for k, sensor in enumerate(c.sensors):
            gone = bool(new[s, k] <= nothing)
            rows.append(
                {
                    "speed_rpm": rpm(speed),
                    "sensor": sensor,
                    "before": float(old[s, k]),
                    "before_phase_deg": float(old_phase[s, k]),
                    "after": 0.0 if gone else float(new[s, k]),
                    "after_phase_deg": None if gone else float(new_phase[s, k]),
                    "within_95": None if within is None else float(within[s, k]),
                    "limit": None if limit is None else finite(limit[s, k]),
                }
            )
    return rows


def _millimetres(metres: float | None) -> float | None:
    return None if metres is None else float(f"{metres * 1e3:.12g}")
