"""What a motion at constant speed has come to: rest, a periodic motion or a whirl, or nothing steady yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.motion.run import MotionRun

_SHARE = 0.2
"""Part of the time that is looked at, its last."""
_LEAST_TURNS = 8
LEAST_SAMPLES = 64
_TREND, _WANDERS = 1e-3, 1e-2
"""Change at which a motion that grows or decays, and one that goes up and down, are not steady."""
_REST = 1e-6
"""Of amplitude by the largest one: at rest below it."""
_PERIODIC = 2e-3
"""Of the motion a period later, by the amplitude."""
_PERIODS = 8


@dataclass(frozen=True, eq=False)
class SteadyEnd:
    """The last part of a motion at constant speed; m nodes.

    Attributes
    ----------
    mean
        x + iy, m, shape (m,).
    amplitude
        Largest distance from the mean, m, shape (m,).
    change
        Of root mean square and mean from the first to the last half of this part, by the largest of the
        former.
    trend
        Whether what changes most goes one way, up or down.
    at_rest
        Whether nothing moves any more.
    frequency
        Of the largest part of the motion at the node that moves most, rad/s, negative where it whirls
        against the rotation; NaN at rest.
    speed
        Of the rotor, rad/s.
    period
        After which the motion comes again, s; NaN for none.
    eccentricity
        As `MotionRun.eccentricity`.
    """

    mean: ComplexArray
    amplitude: FloatArray
    change: float
    trend: bool
    at_rest: bool
    frequency: float
    speed: float
    period: float
    eccentricity: FloatArray

    @property
    def steady(self) -> bool:
        """Whether it changes by less than 0.1 % where it grows or decays, 1 % where it goes up and down."""
        return self.at_rest or self.change <= (_TREND if self.trend else _WANDERS)

    @property
    def periodic(self) -> bool:
        """Whether the end is steady and comes again after a period, or rests."""
        return self.at_rest or (self.steady and bool(np.isfinite(self.period)))

    @property
    def whirl_ratio(self) -> float:
        """Frequency of the largest part of the motion by the speed; NaN at rest or where nothing turns."""
        return self.frequency / self.speed if self.speed else np.nan


def steady_end(motion: MotionRun) -> SteadyEnd | None:
    """Look at the last fifth of a motion, or at its last eight turns where that is more.

    None where the speed changes, for fewer than 64 samples, or fewer than 8 a turn.
    """
    first, last = motion.speeds
    if first != last or motion.time.size < LEAST_SAMPLES or not motion.resolved:
        return None
    whole = float(motion.time[-1])
    window = max(_SHARE * whole, min(_LEAST_TURNS * 2 * np.pi / last, whole) if last else 0.0)
    since = int(np.searchsorted(motion.time, whole - window))
    t, z = motion.time[since:] - motion.time[since], motion.z[since:]
    mean = _faded_mean(z)
    size = np.abs(z - mean).max(axis=0)
    most = int(size.argmax())
    largest = np.maximum(np.abs(motion.z - mean).max(axis=0), np.abs(mean))
    if (size <= _REST * largest).all():
        return SteadyEnd(mean, size, 0.0, False, True, np.nan, last, np.nan, motion.eccentricity(since))
    halves = [z[k * len(z) // 8 :][: len(z) // 2] for k in range(5)]
    means = np.array([_faded_mean(part) for part in halves])
    strength = np.sqrt([_faded_mean(np.abs(part - mean) ** 2).real for part in halves])
    values = np.hstack([strength, means.real, means.imag])
    spread = np.ptp(values, axis=0)
    steps = np.diff(values[:, spread.argmax()])
    z = z[:, most] - mean[most]
    frequency = _strongest(t, z)
    forced = motion.system.unbalance.any() or motion.system.bow.any()
    own = 2 * np.pi / (last if forced and last else abs(frequency))
    return SteadyEnd(
        mean=mean,
        amplitude=size,
        change=float(spread.max() / strength.max()),
        trend=bool((steps > 0).all() or (steps < 0).all()),
        at_rest=False,
        frequency=frequency,
        speed=last,
        period=_period(t, z, own),
        eccentricity=motion.eccentricity(since),
    )


def _faded_mean(z: ComplexArray | FloatArray) -> ComplexArray:
    """Mean over a window that fades at both ends: a motion that is cut anywhere does not change it."""
    weight = np.hanning(len(z) + 2)[1:-1, None]
    return np.asarray((weight * z).sum(axis=0) / weight.sum(), dtype=complex)


def _strongest(t: FloatArray, z: ComplexArray) -> float:
    """Frequency of the largest line of the spectrum, rad/s, with sign, between the lines of the transform."""
    from scipy.optimize import minimize_scalar

    faded = np.hanning(len(z) + 2)[1:-1] * z
    lines = 2 * np.pi * np.fft.fftfreq(len(z), t[1])
    middle = lines[int(np.abs(np.fft.fft(faded)).argmax())]
    found = minimize_scalar(
        lambda w: -abs(np.exp(-1j * w * t) @ faded),
        bounds=(middle - lines[1], middle + lines[1]),
        method="bounded",
        options={"xatol": 1e-9 * lines[1]},
    )
    return float(found.x)


def _period(t: FloatArray, z: ComplexArray, one: float) -> float:
    """The shortest of one to eight times a period after which the motion comes again; NaN for none."""
    from scipy.interpolate import CubicSpline

    at = CubicSpline(t, z)
    for period in one * np.arange(1, _PERIODS + 1):
        inside = t[t <= t[-1] - period]
        if inside.size < len(t) // 4:
            break
        if np.abs(at(inside + period) - at(inside)).max() <= _PERIODIC * np.abs(z).max():
            return float(period)
    return np.nan
