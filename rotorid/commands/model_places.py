"""Where the planes and sensors of a job are in its rotor model, and what its sensors read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from balancing import Correction, Influence, Trials, WhatIf
    from fem import Sensor
    from rotorid.base.arrays import FloatArray
    from rotorid.base.text import Quantity
    from rotorid.calibration import RunReadings
    from rotorid.files import Job


REACH = 4.0
"""Times the fastest reading: up to here a machine may run."""


@dataclass(frozen=True)
class ModelPlaces:
    """Where the planes and sensors of a job are in its rotor model, and what the sensors read.

    Radii are those that make an unbalance, kg·m, of the job's masses; None where its weights are unbalances.
    """

    nodes: Mapping[str, int]
    sensors: Mapping[str, Sensor]
    radii: Mapping[str, float] | None
    quantity: Quantity

    def of_runs(self, trials: Trials, key_phasor: float) -> RunReadings:
        """Runs at these places; the key phasor's direction in degrees from x, with the rotation."""
        import numpy as np

        from rotorid.calibration import RunReadings

        return RunReadings(
            trials,
            tuple(self.nodes[plane] for plane in trials.planes),
            np.array([1.0 if self.radii is None else self.radii[plane] for plane in trials.planes]),
            tuple(self.sensors[sensor] for sensor in trials.sensors),
            {"displacement": 0, "velocity": 1, "acceleration": 2}[self.quantity],
            key_phasor,
        )


def model_places(job: Job, stations: Mapping[str, int] | None = None) -> ModelPlaces:
    """The places of all planes, or of given stations per unbalance, and of all sensors.

    Raises
    ------
    ValueError
        Where the job has no rotor, or no place in it for a plane or sensor.
    """
    from rotorid.files.units import weight

    if job.rotor is None:
        raise ValueError('computed coefficients need a rotor model: rotor = "rotor.toml" in the job file')
    missing = [f"[sensors.{s}]" for s in job.trials.sensors if s not in job.sensor_places]
    nodes = stations or {p: job.plane_nodes[p] for p in job.planes if p in job.plane_nodes}
    missing += [f"[planes.{p}]" for p in job.planes if stations is None and p not in nodes]
    if missing or not nodes:
        raise ValueError(
            "computed coefficients need the place of every sensor and plane in the model: node = … (or "
            f"station) in {', '.join(missing) or 'a [planes.NAME]'}"
        )
    by_mass = stations is None and weight(job.trials.labels.weight_unit).kind == "mass"
    if by_mass and (lost := [p for p in job.planes if p not in job.radii]):
        raise ValueError(
            f"weights as masses need the radius of every plane: radius_mm in [planes.{lost[0]}], or weights "
            "as unbalances"
        )
    return ModelPlaces(
        nodes,
        {s: job.sensor_places[s] for s in job.trials.sensors},
        {p: job.radii[p] for p in job.planes} if by_mass else None,
        _quantity(job.trials.labels.vibration_unit),
    )


def next_mode(job: Job, outlook: Correction | WhatIf) -> tuple[str, ...]:
    """What the rotor model of a job says of the next mode beyond its readings, where that is made worse."""
    assert job.rotor is not None
    if not {*job.trials.sensors} <= job.sensor_places.keys():
        return ()
    from balancing import mode_made_worse, model_influence
    from fem import critical_speeds_below

    fastest = float(job.trials.speeds.max())
    beyond = [w for w in critical_speeds_below(job.rotor, REACH * fastest) if w > fastest]
    if not beyond or not {*outlook.planes} <= job.plane_nodes.keys():
        return ()
    rotor, sensors, unit = job.rotor, job.sensor_places, job.trials.labels.vibration_unit

    def model(nodes: Mapping[str, int], speeds: FloatArray) -> Influence:
        return model_influence(rotor, nodes, sensors, speeds, quantity=_quantity(unit))

    levers = {} if outlook.labels.unbalances else job.radii
    return mode_made_worse(outlook, model, job.plane_nodes, levers, rotor.n_nodes, beyond[0])


def _quantity(unit: str) -> Quantity:
    """What an amplitude in this unit is.

    Raises
    ------
    ValueError
        For a unit that is only a label.
    """
    from rotorid.files.units import vibration

    kinds: dict[str, Quantity] = {"length": "displacement", "velocity": "velocity"}
    kinds["acceleration"] = "acceleration"
    kind = vibration(unit).kind if unit else ""
    if kind not in kinds:
        raise ValueError(
            "computed coefficients need amplitudes in a unit of length, velocity or acceleration, such as "
            f"um_pp or mm_s_rms; {unit or 'a column without a unit'} is none"
        )
    return kinds[kind]
