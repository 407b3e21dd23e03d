"""What a motion at constant speed has come to: rest, a periodic motion or a whirl, or nothing steady yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.motion.run import LEAST_A_TURN, MotionRun

_SHARE = 0.2
"""Part of the time that is looked at, its last."""
_LEAST_TURNS = 8
LEAST_SAMPLES = 64
_CHANGE = 1e-3
"""Of amplitude and mean from one half of the window to the other, by the amplitude: steady below it."""
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
    nodes
        As in the motion.
    begins
        Where the part that is looked at begins, s.
    mean
        x + iy, m, shape (m,).
    amplitude
        Largest distance from the mean, m, shape (m,).
    change
        Of amplitude and mean from one half of this part to the other, by the amplitude.
    steady
        Whether they stay as they are, to a thousandth.
    at_rest
        Whether nothing moves any more.
    frequency
        Of the largest part of the motion at the node that moves most, rad/s, negative where it whirls
        against the rotation; NaN at rest.
    speed
        Of the rotor, rad/s.
    period
        After which the motion comes again, turns of the rotor, or s where it does not turn; NaN for none.
    eccentricity
        Smallest and largest by the clearance, of each bearing, shape (b, 2).
    """

    nodes: tuple[int, ...]
    begins: float
    mean: ComplexArray
    amplitude: FloatArray
    change: float
    steady: bool
    at_rest: bool
    frequency: float
    speed: float
    period: float
    eccentricity: FloatArray

    @property
    def periodic(self) -> bool:
        """Whether the end is steady and comes again after a period, or rests."""
        return self.at_rest or (self.steady and bool(np.isfinite(self.period)))

    @property
    def whirl_ratio(self) -> float:
        """Frequency of the largest part of the motion by the speed; NaN at rest or where nothing turns."""
        return self.frequency / self.speed if self.speed else np.nan


def steady_end(motion: MotionRun) -> SteadyEnd:
    """Look at the last fifth of a motion, or at its last eight turns where that is more.

    Raises
    ------
    ValueError
        If the speed changes, for fewer than 64 samples, or fewer than 8 a turn.
    """
    first, last = motion.speeds
    if first != last:
        raise ValueError("the speed changes: there is no steady end")
    if motion.time.size < LEAST_SAMPLES:
        raise ValueError(f"{LEAST_SAMPLES} samples are needed at least to tell whether the end is steady")
    if not motion.resolved:
        raise ValueError(
            f"{LEAST_A_TURN} samples a turn are needed at least to tell whether the end is steady"
        )
    whole = float(motion.time[-1])
    window = max(_SHARE * whole, min(_LEAST_TURNS * 2 * np.pi / last, whole) if last else 0.0)
    k = int(np.searchsorted(motion.time, whole - window))
    t, z = motion.time[k:], motion.z[k:]
    mean = _hann_mean(z)
    size = np.abs(z - mean).max(axis=0)
    largest = np.abs(motion.z - mean).max(axis=0)
    most = int(size.argmax())
    at_rest = bool((size <= _REST * np.maximum(largest, np.abs(mean))).all())
    halves = np.array_split(z, 2)
    means = [_hann_mean(half) for half in halves]
    sizes = [np.abs(half - mean).max(axis=0) for half in halves]
    change = max(np.abs(sizes[1] - sizes[0]).max(), np.abs(means[1] - means[0]).max())
    change = float(change / (size[most] or 1.0))
    steady = at_rest or change <= _CHANGE
    frequency = np.nan if at_rest else _strongest(t, z[:, most] - mean[most])
    period = np.nan if at_rest else _period(t, z[:, most] - mean[most], frequency, last, _forced(motion))
    return SteadyEnd(
        nodes=motion.nodes,
        begins=float(t[0]),
        mean=mean,
        amplitude=size,
        change=change,
        steady=steady,
        at_rest=at_rest,
        frequency=frequency,
        speed=last,
        period=period,
        eccentricity=np.array(
            [
                np.array([np.abs(z[:, i]).min(), np.abs(z[:, i]).max()]) / force.wall
                for force, i in motion.bearings
            ]
        ).reshape(-1, 2),
    )


def _forced(motion: MotionRun) -> bool:
    return bool(motion.system.unbalance.any() or motion.system.bow.any())


def _hann_mean(z: ComplexArray) -> ComplexArray:
    """Mean over a window that fades at both ends: a motion that is cut anywhere does not change it."""
    weight = np.hanning(len(z) + 2)[1:-1, None]
    return np.asarray((weight * z).sum(axis=0) / weight.sum())


def _strongest(t: FloatArray, z: ComplexArray) -> float:
    """Frequency of the largest line of the spectrum, rad/s, with sign, between the lines of the transform."""
    from scipy.optimize import minimize_scalar

    faded = np.hanning(len(z) + 2)[1:-1] * z
    step = float(t[1] - t[0])
    lines = 2 * np.pi * np.fft.fftfreq(len(z), step)
    middle = lines[int(np.abs(np.fft.fft(faded)).argmax())]
    width = 2 * np.pi / (len(z) * step)
    found = minimize_scalar(
        lambda w: -abs(np.exp(-1j * w * (t - t[0])) @ faded),
        bounds=(middle - width, middle + width),
        method="bounded",
        options={"xatol": 1e-9 * width},
    )
    return float(found.x)


def _period(t: FloatArray, z: ComplexArray, frequency: float, speed: float, forced: bool) -> float:
    """Shortest period found: one to eight turns where unbalance acts, else that of the strongest line."""
    from scipy.interpolate import CubicSpline

    at = CubicSpline(t, z)
    size = np.abs(z).max()
    one = 2 * np.pi / speed if speed else 1.0
    own = 2 * np.pi / abs(frequency)
    candidates = [n * (one if forced and speed else own) for n in range(1, _PERIODS + 1)]
    for period in candidates:
        inside = t[t <= t[-1] - period]
        if inside.size < len(t) // 4:
            break
        if np.abs(at(inside + period) - at(inside)).max() <= _PERIODIC * size:
            return period / one
    return np.nan
