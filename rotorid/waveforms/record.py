"""A record of a machine: a tacho and sensors, sampled together at one rate."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from rotorid.base.arrays import AnyArray

Edge = Literal["leading", "trailing", "rising", "falling", "centre"]
"""What of the tacho's mark is angle 0: where it begins or ends, whatever its polarity; where the signal rises
or falls; or its middle."""


@dataclass(frozen=True)
class SignalPath:
    """What stands between a motion and its samples, and is taken off the vectors again.

    Attributes
    ----------
    high_pass_rad_s
        Corner of an AC coupling, a Butterworth filter of `high_pass_order`; None: none, down to 0 Hz.
    high_pass_order
        See above.
    delay_s
        How much later the samples are than the motion: of an anti-alias filter, say.
    """

    high_pass_rad_s: float | None = None
    high_pass_order: int = 1
    delay_s: float = 0.0


@dataclass(frozen=True, eq=False)
class Channel:
    """The samples of one sensor.

    Attributes
    ----------
    name
        Of the sensor.
    samples
        As they are stored (integers too, perhaps left on disk), shape (N,).
    factor
        What one number means: m, m/s, m/s² (peak values, SI); or in the label of the amplitudes.
    derivative
        0, 1, 2: the numbers are displacements, velocities, accelerations; None: neither is known.
    path
        See there.
    """

    name: str
    samples: AnyArray
    factor: float = 1.0
    derivative: int | None = None
    path: SignalPath = field(default_factory=SignalPath)


@dataclass(frozen=True)
class TachoSettings:
    """How turns are marked.

    Attributes
    ----------
    pulses
        A turn.
    edge
        See `Edge`.
    level
        In the numbers of the record, where an edge is; None: halfway between the low and the high level.
    """

    pulses: int = 1
    edge: Edge = "leading"
    level: float | None = None


@dataclass(frozen=True, eq=False)
class WaveformRecord:
    """One run: a tacho and sensors, sampled together.

    Attributes
    ----------
    run
        Its name.
    source
        The file, for messages.
    rate
        Samples a second.
    tacho
        None: there is none.
    sensors
        At least one.
    """

    run: str
    source: str
    rate: float
    tacho: Channel | None
    sensors: tuple[Channel, ...]
