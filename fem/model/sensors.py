"""Names of `fem._new.rotor` until the old modules go."""

from collections.abc import Sequence

from fem._new.rotor import Rotor, Sensor, SensorLike, as_sensor, label

__all__ = ["Sensor", "SensorLike", "as_sensor", "as_sensors", "label"]


def as_sensors(sensors: Sequence[SensorLike], rotor: Rotor) -> list[Sensor]:
    """`as_sensor` for each."""
    return [as_sensor(sensor, rotor) for sensor in sensors]
