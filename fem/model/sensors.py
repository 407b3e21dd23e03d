"""Where and in which direction vibration is read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from fem.model.rotor import Rotor
from rotorid.base.checks import number


@dataclass(frozen=True)
class Sensor:
    """A probe at a node that reads the deflection in one direction.

    Attributes
    ----------
    node
        Number, from 1, or name of a station.
    angle
        Of its direction from x with the rotation, degrees.

    Raises
    ------
    ValueError
        If the angle is not finite.
    """

    node: str | int
    angle: float = 0.0

    def __post_init__(self) -> None:
        what = f"sensor at {self.node!r}: angle"
        object.__setattr__(self, "angle", number(self.angle, what, signed=True))

    def __str__(self) -> str:
        return f"{self.node} at {self.angle:g}°" if self.angle else str(self.node)

    @property
    def radians(self) -> float:
        """The angle in rad."""
        return math.radians(self.angle)


SensorLike = str | int | tuple[str | int, float] | Sensor


def as_sensor(sensor: SensorLike, rotor: Rotor) -> Sensor:
    """A sensor from a node, a station, a pair (node, angle in degrees) or a Sensor.

    Raises
    ------
    ValueError
        If there is no such node, or it is none of these.
    """
    if isinstance(sensor, tuple) and len(sensor) != 2:
        raise ValueError(f"a sensor is a node or a pair (node, angle in degrees), not {sensor!r}")
    found = _sensor(sensor)
    rotor.node(found.node)
    return found


def label(sensor: SensorLike) -> str | int:
    """How a table names it: as given, or "5 at 45°"."""
    return str(_sensor(sensor)) if isinstance(sensor, (tuple, Sensor)) else sensor


def _sensor(sensor: SensorLike) -> Sensor:
    if isinstance(sensor, Sensor):
        return sensor
    return Sensor(*sensor) if isinstance(sensor, tuple) else Sensor(sensor)


def as_sensors(sensors: Sequence[SensorLike], rotor: Rotor) -> list[Sensor]:
    """`as_sensor` for each."""
    return [as_sensor(sensor, rotor) for sensor in sensors]
