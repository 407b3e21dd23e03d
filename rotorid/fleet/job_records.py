"""A job that was read as rows of the tables of a fleet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from balancing import Influence, Labels, Trials
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.files.job import Job
from rotorid.files.units import vibration
from rotorid.fleet.machine_type import MachineRecord
from rotorid.tables.fleet.fleet_tables import Columns, JobRows

QUANTITIES = {"length": "displacement", "velocity": "velocity", "acceleration": "acceleration"}
"""Of a reading, by the kind of its unit."""
_SI = Labels()


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
    """Rows of a job in all tables.

    `own` is what the table `jobs` has of it, `influence` its coefficients, where something determines them,
    `proposed` the planes and corrections (P,) that were mounted where its check runs do not say them, and
    `before` the vibration of the bare rotor, (S, C).
    """
    trials, check = job.trials, job.check
    rows = {"readings": [_readings(trials, "trial")], "weights": [_weights(trials, "trial")]}
    if influence is not None:
        rows["coefficients"] = [_coefficients(job, influence)]
    if check is not None:
        rows["readings"].append(_readings(check, "check"))
        rows["outcomes"] = [_outcomes(job, check, before)]
        if job.check_mounted:
            rows["weights"].append(_weights(check, "check"))
            proposed = check.planes, check.weights[-1]
    if proposed is not None:
        weight, angle = _SI.weight(proposed[1])
        corrections = {"plane": np.array(proposed[0]), "weight": weight, "angle_deg": angle}
        rows["corrections"] = [{**corrections, "mounted": job.check_mounted}]
    cells = {table: [_cells(own["job"], part) for part in parts] for table, parts in rows.items()}
    return {**cells, "jobs": [{column: [value] for column, value in own.items()}]}


def _cells(job: str, columns: dict[str, Any]) -> Columns:
    """Columns as lists, with the id of the job; what is no array is the same in all rows."""
    rows = next(len(cells) for cells in columns.values() if isinstance(cells, np.ndarray))
    return {
        name: cells.tolist() if isinstance(cells, np.ndarray) else [cells] * rows
        for name, cells in {"job": job, **columns}.items()
    }


def _readings(trials: Trials, kind: str) -> dict[str, Any]:
    """One row a run, speed, sensor and repeat."""
    readings = np.moveaxis(trials.readings, 0, -1)
    r, s, c, k = np.nonzero(~np.isnan(readings))
    amplitude, phase = _SI.vibration(readings[r, s, c, k])
    spread = np.full((2, 2, len(r)), np.nan)
    if trials.covariance is not None:
        spread = trials.covariance[:, :, k, r, s, c]
    return {
        "kind": kind,
        "run": _named(trials.runs, r),
        "repeat": k + 1,
        "speed_rad_s": trials.speeds[s],
        "sensor": _named(trials.sensors, c),
        "amplitude": amplitude,
        "phase_deg": phase,
        "std_re": np.sqrt(spread[0, 0]),
        "std_im": np.sqrt(spread[1, 1]),
        "cov_re_im": spread[0, 1],
    }


def _weights(trials: Trials, kind: str) -> dict[str, Any]:
    """One row a run and plane, also where nothing is mounted."""
    r, p = np.indices(trials.weights.shape).reshape(2, -1)
    weight, angle = _SI.weight(trials.weights.ravel())
    runs, planes = _named(trials.runs, r), _named(trials.planes, p)
    return {"kind": kind, "run": runs, "plane": planes, "weight": weight, "angle_deg": angle}


def _coefficients(job: Job, influence: Influence) -> dict[str, Any]:
    """One row a speed, sensor and plane."""
    s, c, p = np.indices(influence.W.shape).reshape(3, -1)
    W = influence.W.ravel()
    own: FloatArray = np.full((len(W), 2, 2), np.nan)
    if influence.known_errors:
        own = MachineRecord.of(influence).covariance.reshape(own.shape)
    return {
        "speed_rad_s": influence.speeds[s],
        "sensor": _named(influence.sensors, c),
        "plane": _named(influence.planes, p),
        "radius": _named([job.radii.get(plane) for plane in influence.planes], p),
        "re": W.real,
        "im": W.imag,
        "var_re": own[:, 0, 0],
        "cov_re_im": own[:, 0, 1],
        "var_im": own[:, 1, 1],
        "source": "measured" if job.influence is None else "stored",
    }


def _outcomes(job: Job, check: Trials, before: ComplexArray | None) -> dict[str, Any]:
    """One row a check run, speed and sensor."""
    r, s, c = np.indices(check.mean.shape).reshape(3, -1)
    speeds, sensors = job.trials.speeds.tolist(), job.trials.sensors
    at = np.array([speeds.index(speed) for speed in check.speeds])[s]
    by = np.array([sensors.index(sensor) for sensor in check.sensors])[c]
    limit = np.full(len(r), np.inf) if job.limits is None else job.limits.residual[at, by]
    return {
        "run": _named(check.runs, r),
        "speed_rad_s": check.speeds[s],
        "sensor": _named(check.sensors, c),
        "before": np.nan if before is None else np.abs(before[at, by]),
        "after": np.abs(check.mean).ravel(),
        "limit": np.where(np.isinf(limit), np.nan, limit),
    }


def _named(names: Sequence[Any], places: Any) -> Any:  # noqa: ANN401 - arrays of objects and of indices
    return np.array(names, dtype=object)[places]
