"""Angle of a first trial weight, from the phase of the initial reading and the expected lag.

A reading with phase φ (positive = lead) at a sensor at the angle α is A cos(ωt + φ), with t = 0 when the
mark passes the key phasor, at the angle κ; angles count with the rotation. At time t the mark stands at κ +
ωt, the high spot, at the angle h from the mark, at κ + ωt + h. The sensor reads its largest value when the
high spot passes it: κ + ωt + h = α at ωt = −φ, hence

    h = φ + α − κ.

The vibration lags the unbalance that causes it by ψ (0 far below the critical speed, 90° at it, towards
180° above), so the heavy spot is ahead of the high spot, at h + ψ, and the trial weight opposite,

    angle = φ + α − κ + ψ + 180°.

For one mode ψ = atan2(2 ζ η, 1 − η²), η = speed / critical speed. A velocity leads its displacement by 90°,
an acceleration by 180°: these are taken off φ first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Quantity = Literal["displacement", "velocity", "acceleration"]

DAMPING = 0.05
"""Damping ratio of the critical speed if nobody says."""

_LAGS = {"below": (0.0, 45.0, 90.0), "at": (90.0, 90.0, 90.0), "above": (90.0, 135.0, 180.0)}
_LEAD = {"displacement": 0.0, "velocity": math.pi / 2, "acceleration": math.pi}


@dataclass(frozen=True)
class Lag:
    """How far a vibration lags the unbalance behind it, rad: expected, least and largest, and why."""

    expected: float
    low: float
    high: float
    words: str


def expected_lag(
    where: str | None = None,
    *,
    degrees: float | None = None,
    ratio: float | None = None,
    damping: float = DAMPING,
) -> Lag:
    """How far the vibration lags, from one of these.

    Parameters
    ----------
    where
        "below", "at" or "above" the critical speed.
    degrees
        The lag.
    ratio
        Speed / critical speed, of one mode with this damping ratio.

    Raises
    ------
    ValueError
        Unless exactly one is given, and for impossible numbers.
    """
    if sum(x is not None for x in (where, degrees, ratio)) != 1:
        raise ValueError("give one of: below, at or above the critical speed; a lag; the critical speed")
    if where is not None:
        if where not in _LAGS:
            raise ValueError(f"the speed is below, at or above the critical speed, not {where!r}")
        low, middle, high = (math.radians(x) for x in _LAGS[where])
        return Lag(middle, low, high, f"{where} the critical speed")
    if degrees is not None:
        if not 0 <= degrees <= 360:
            raise ValueError(f"a lag is from 0 to 360 degrees, not {degrees:g}")
        lag = math.radians(degrees)
        return Lag(lag, lag, lag, f"{degrees:g}°, as stated")
    assert ratio is not None
    positive("ratio of the speed to the critical speed", ratio)
    positive("damping ratio", damping)
    lag = math.atan2(2 * damping * ratio, 1 - ratio**2)
    words = f"one mode at {ratio:.3g} times the critical speed, damping {damping:g}"
    low, high = (0.0, math.pi / 2) if ratio < 1 else (math.pi / 2, math.pi)
    return Lag(lag, low, high, words)


def opposing_angle(
    phase: float,
    lag: float,
    *,
    sensor_angle: float = 0.0,
    key_phasor: float = 0.0,
    quantity: Quantity = "displacement",
) -> float:
    """Angle opposite to the heavy spot, rad with the rotation, 0 ≤ angle < 2π (derived in the module).

    Parameters
    ----------
    phase
        Of the reading, rad, positive = lead.
    lag
        ψ, rad.
    sensor_angle, key_phasor
        α and κ, rad with the rotation, from any common origin.
    quantity
        What the sensor reads.
    """
    if quantity not in _LEAD:
        raise ValueError(f"quantity must be one of {', '.join(_LEAD)}, not {quantity!r}")
    angle = phase - _LEAD[quantity] + sensor_angle - key_phasor + lag + math.pi
    return angle % (2 * math.pi)


def positive(what: str, value: float) -> None:
    """Refuse a number that is not positive and finite.

    Raises
    ------
    ValueError
        Naming it.
    """
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"the {what} must be a finite number above 0, not {value:g}")
