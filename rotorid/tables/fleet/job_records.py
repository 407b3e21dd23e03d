"""A job that was read as rows of the tables of a fleet."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from balancing.coefficients.influence import Influence
from balancing.coefficients.machine_type import record_of
from balancing.data.conventions import Labels
from balancing.data.trials import Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.tables.fleet.fleet_tables import Columns, JobRows
from rotorid.tables.job.job_data import Job
from rotorid.tables.reader.units import vibration

QUANTITIES = {"length": "displacement", "velocity": "velocity", "acceleration": "acceleration"}
"""Of a reading, by the kind of its unit."""


def job_id(hashes: Iterable[str]) -> str:
    """The id of a job, 16 hex digits of the SHA-256 over those of its files in their order."""
    return hashlib.sha256("".join(hashes).encode()).hexdigest()[:16]


def kind_of(labels: Labels) -> tuple[str, str]:
    """What is read ("" unknown), and what weights are."""
    unit, weights = labels.vibration_unit, "unbalance" if labels.unbalances else "mass"
    return QUANTITIES.get(vibration(unit).kind, "") if unit else "", weights


def job_rows(
    job: Job,
    own: dict[str, Any],
    influence: Influence | None,
    proposed: tuple[Sequence[str], ComplexArray] | None,
    before: ComplexArray | None,
) -> JobRows:
    """Rows of all tables.

    Parameters
    ----------
    job
        As it was read.
    own
        What the table `jobs` has of it besides what follows from the job; `job` is its id.
    influence
        Its coefficients, or None where nothing determines them.
    proposed
        Planes, and the corrections (P,) that were proposed and mounted, where its check runs do not say them.
    before
        Vibration of the bare rotor, shape (S, C), or None.
    """
    trials, check, labels = job.trials, job.check, job.trials.labels
    rows: JobRows = {"readings": [_readings(trials, "trial")], "weights": [_weights(trials, "trial")]}
    if influence is not None:
        rows["coefficients"] = [_coefficients(influence, job.radii, stored=job.influence is not None)]
    if check is not None:
        rows["readings"].append(_readings(check, "check"))
        rows["outcomes"] = [_outcomes(job, check, before)]
        if job.check_mounted:
            rows["weights"].append(_weights(check, "check"))
            proposed = check.planes, check.weights[-1]
    if proposed is not None:
        rows["corrections"] = [_corrections(*proposed, mounted=job.check_mounted)]
    for part in (part for parts in rows.values() for part in parts):
        part["job"] = [own["job"]] * len(next(iter(part.values())))
    more = {
        "date": job.date or own["date"],
        "machine": job.machine or own["machine"],
        "machine_type": job.machine_type or own["machine_type"],
        **dict(zip(("quantity", "weight_kind"), kind_of(labels), strict=True)),
        "vibration_unit": labels.vibration_unit,
        "weight_unit": labels.weight_unit,
        "trial_runs": len(trials.runs),
        "check_runs": 0 if check is None else len(check.runs),
        "vectors": sum(len(part["run"]) for part in rows["readings"]),
    }
    return {**rows, "jobs": [{column: [value] for column, value in (own | more).items()}]}


def _readings(trials: Trials, kind: str) -> Columns:
    """One row a run, speed, sensor and repeat."""
    readings = np.moveaxis(trials.readings, 0, -1)
    r, s, c, k = np.nonzero(~np.isnan(readings))
    values = readings[r, s, c, k]
    spread = np.full((2, 2, len(r)), np.nan)
    if trials.covariance is not None:
        spread = trials.covariance[:, :, k, r, s, c]
    return {
        "kind": [kind] * len(r),
        "run": _named(trials.runs, r),
        "repeat": (k + 1).tolist(),
        "speed_rad_s": trials.speeds[s].tolist(),
        "sensor": _named(trials.sensors, c),
        "amplitude": np.abs(values).tolist(),
        "phase_deg": _degrees(values),
        "std_re": np.sqrt(spread[0, 0]).tolist(),
        "std_im": np.sqrt(spread[1, 1]).tolist(),
        "cov_re_im": spread[0, 1].tolist(),
    }


def _weights(trials: Trials, kind: str) -> Columns:
    """One row a run and plane, also where nothing is mounted."""
    r, p = np.indices(trials.weights.shape).reshape(2, -1)
    return {
        "kind": [kind] * len(r),
        "run": _named(trials.runs, r),
        "plane": _named(trials.planes, p),
        "weight": np.abs(trials.weights).ravel().tolist(),
        "angle_deg": _degrees(trials.weights.ravel()),
    }


def _coefficients(influence: Influence, radii: Mapping[str, float], *, stored: bool) -> Columns:
    """One row a speed, sensor and plane."""
    s, c, p = np.indices(influence.W.shape).reshape(3, -1)
    W = influence.W.ravel()
    own: FloatArray = np.full((len(W), 2, 2), np.nan)
    if influence.covariance is not None:
        own = record_of("", "", influence).covariance.reshape(own.shape)
    return {
        "speed_rad_s": influence.speeds[s].tolist(),
        "sensor": _named(influence.sensors, c),
        "plane": _named(influence.planes, p),
        "radius": [radii.get(influence.planes[k]) for k in p],
        "re": W.real.tolist(),
        "im": W.imag.tolist(),
        "var_re": own[:, 0, 0].tolist(),
        "cov_re_im": own[:, 0, 1].tolist(),
        "var_im": own[:, 1, 1].tolist(),
        "source": ["stored" if stored else "measured"] * len(W),
    }


def _corrections(planes: Sequence[str], weights: ComplexArray, *, mounted: bool) -> Columns:
    return {
        "plane": list(planes),
        "weight": np.abs(weights).tolist(),
        "angle_deg": _degrees(weights),
        "mounted": [mounted] * len(planes),
    }


def _outcomes(job: Job, check: Trials, before: ComplexArray | None) -> Columns:
    """One row a check run, speed and sensor."""
    r, s, c = np.indices(check.mean.shape).reshape(3, -1)
    trials = job.trials
    at = np.array([trials.speeds.tolist().index(speed) for speed in check.speeds])[s]
    by = np.array([trials.sensors.index(sensor) for sensor in check.sensors])[c]
    limit = np.full(len(r), np.nan) if job.limits is None else job.limits.residual[at, by]
    return {
        "run": _named(check.runs, r),
        "speed_rad_s": check.speeds[s].tolist(),
        "sensor": _named(check.sensors, c),
        "before": (np.full(len(r), np.nan) if before is None else np.abs(before[at, by])).tolist(),
        "after": np.abs(check.mean).ravel().tolist(),
        "limit": np.where(np.isinf(limit), np.nan, limit).tolist(),
    }


def _named(names: Sequence[str], places: Any) -> list[str]:  # noqa: ANN401 - indices
    return [names[place] for place in places.tolist()]


def _degrees(values: ComplexArray) -> list[float]:
    """Angles, 0 ≤ angle < 360."""
    degrees = np.mod(np.degrees(np.angle(values)), 360.0)
    return list(np.where(degrees >= 360.0, 0.0, degrees).tolist())
