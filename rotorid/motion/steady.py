"""Steady motion: of the linear rotor, as a start, its part that turns with the shaft, the end of a motion."""

from __future__ import annotations

import itertools
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.motion.collocation import LEAST_STEPS, POINTS, Orbit, Periodic
from rotorid.motion.equilibrium import at_rest
from rotorid.motion.run import LEAST_A_TURN, TOLERANCE, MotionRun, run
from rotorid.motion.system import MotionSystem

LEAST_SAMPLES = 64
_TURNS, _BLOCKS = 100, 8
"""Turns of a motion that settles, and how often so many more."""
_A_TURN = 8  # values of the synchronous part
_TREND, _WANDERS = 1e-3, 1e-2
"""Change at which a motion that goes one way, and one that goes up and down, are not steady."""
_PERIODIC, _PERIODS = 2e-3, 8
"""Difference a period later, by the amplitude, and the most turns of a period."""
_LINES, _BROAD = 12, 5e-3
"""Lines of a spectrum, and what of its power is beside them where a motion is chaotic; two or three whirls
together leave 0.002 there at most, chaotic rubs 0.006 to 0.1."""


def steady_linear(
    system: MotionSystem, speeds: Sequence[float] | FloatArray
) -> list[tuple[float, FloatArray, ComplexArray]]:
    """Steady response to unbalance and bow of the rotor made linear about its equilibrium at each speed.

    Parameters
    ----------
    system
        What moves.
    speeds
        rad/s.

    Returns
    -------
    Each speed at which there is an equilibrium, that, shape (n,), and the response, (n,): the motion is
    Re(response e^{iφ}) about the equilibrium.
    """
    motions = []
    for speed in speeds:
        try:
            rest = at_rest(system, speed)
        except ValueError:
            continue
        C, K = system.about(rest, speed)
        load = speed**2 * system.unbalance + system.bow
        response = np.linalg.solve(K + 1j * speed * C - speed**2 * system.M, load)
        motions.append((float(speed), rest, response.astype(complex)))
    return motions


def begin(
    system: MotionSystem,
    speed: float,
    how: Literal["rest", "steady"] = "rest",
    shift: Mapping[int, complex] | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
    """How a motion begins: unknowns and velocities, shape (n,) each, where the angle is 0; and warnings.

    Parameters
    ----------
    system
        What moves.
    speed
        rad/s.
    how
        At rest in equilibrium, or in steady motion: where forces are not linear it begins near the steady
        motion of the linear rotor and settles for so many turns as it takes, 800 at most.
    shift
        Nodes moved from there, x + iy, m.
    tolerance
        As `run` takes it.

    Raises
    ------
    ValueError
        As `equilibrium` and `run`, if it touches a wall, and for nodes that do not move.
    """
    q, v, warnings = at_rest(system, speed), np.zeros(system.size), tuple[str, ...]()
    if how == "steady" and speed and system.forced:
        ((_, _, response),) = steady_linear(system, [speed])
        if (np.abs(system.at_forces(q + response.real)) <= 0.9 * system.walls).all():
            q, v = q + response.real, (1j * speed * response).real
        if system.forces:
            q, v, end = settled(system, speed, q, v, tolerance)
            warnings = (f"at the first speed {end}",) if isinstance(end, str) else ()
    q = q.copy()
    for node, by in (shift or {}).items():
        q[[*system.index(node)]] += by.real, by.imag
    return q, v, warnings


def settled(
    system: MotionSystem,
    speed: float,
    q: FloatArray,
    v: FloatArray,
    tolerance: float = TOLERANCE,
    until: float = np.inf,
) -> tuple[FloatArray, FloatArray, Orbit | str]:
    """What motion in time comes to from a state at the angle 0, until `time.monotonic` is so late.

    Returns
    -------
    The state in the end, and a stable periodic motion there; or, in words, what else, "" for rest.
    """
    turn, sizes = 2 * np.pi / speed, list[float]()
    for block in range(_BLOCKS):
        try:
            part = run(system, (speed, speed), _TURNS * turn, (q, v), tolerance=tolerance)
        except ValueError as problem:
            return q, v, f"motion in time is not known: {problem}"
        if part.stopped:
            return q, v, f"motion in time ends: {part.stopped.split(' after ')[0]}"
        q, v, end = part.q, part.v, steady_end(part)
        if end is None or time.monotonic() > until:
            break
        sizes.append(float(end.amplitude.max()))
        if not system.forced and (end.at_rest or sizes[-1] < 1e-4 * sizes[0]):
            return q, v, ""
        cycle = turn if system.forced else 2 * np.pi / abs(end.frequency)
        repeats = np.isfinite(end.period)
        for period in (cycle, end.period)[: 1 + repeats] if repeats or block == _BLOCKS - 1 else ():
            orbit = repeating(system, speed, period, q, v)
            if orbit and orbit.outside == 0:
                return orbit.start, orbit.velocities[-1, -1], orbit
    if not system.forced and sizes[-1:] < [0.95 * size for size in sizes[_BLOCKS // 2 :][:1]]:
        return q, v, ""
    return q, v, f"motion in time comes to no periodic motion in {_TURNS * _BLOCKS} revolutions"


def repeating(
    system: MotionSystem, speed: float, period: float, q: FloatArray, v: FloatArray
) -> Orbit | None:
    """The periodic motion near that in time from a state at the angle 0; None where there is none.

    Parameters
    ----------
    system
        What moves.
    speed, period
        rad/s and s.
    q, v
        All unknowns and their velocities, (n,) each.
    """
    turns = round(period * speed / (2 * np.pi)) if system.forced else 0
    period = 2 * np.pi * turns / speed if turns else period
    steps, first = LEAST_STEPS * max(turns, 1), q
    velocities = np.empty((steps * POINTS.size, q.size))
    times = (np.arange(steps)[:, None] + POINTS).ravel() * (period / steps)
    for k, (begin, end) in enumerate(itertools.pairwise([0.0, *times])):
        part = run(system, (speed, speed), end - begin, (q, v), rate=1 / (end - begin), angle=speed * begin)
        q, v = part.q, part.v
        velocities[k] = v
    guess = Orbit(speed, period, turns, first, velocities.reshape(steps, POINTS.size, -1))
    try:
        at = Periodic(system, speed, speed).newton(guess, guess.at_speed)
    except np.linalg.LinAlgError:
        return None
    away = np.abs(at.orbit.ends - guess.ends).max(axis=0) / at.orbit.scale[: q.size]
    return at.solution if away.max() < 0.3 else None


def synchronous_part(motion: MotionRun, turns: int = 4) -> tuple[FloatArray, ComplexArray]:
    """Follow the synchronous part of the deflections in x, that of x(t) = Re(X e^{iφ}) + the rest.

    Each value is a mean over so many whole turns, which fades at both ends.

    Parameters
    ----------
    motion
        With eight samples a turn at least.
    turns
        Averaged over, 2 or more.

    Returns
    -------
    Speeds in the middle of these turns, rad/s, shape (r,), and X at the nodes, m, shape (r, m).

    Raises
    ------
    ValueError
        For fewer samples a turn, or fewer turns.
    """
    angle = motion.turned - motion.turned[0]
    whole = int(angle[-1] / (2 * np.pi))
    if whole < turns:
        raise ValueError(f"the rotor makes {whole} turns; {turns} are needed for its synchronous part")
    if not motion.resolved:
        raise ValueError(
            f"{LEAST_A_TURN} samples a turn are needed at least for the synchronous part: a higher rate"
        )
    begins = np.arange(_A_TURN * (whole - turns) + 1) * (2 * np.pi / _A_TURN)
    turning = 2 * motion.z.real * np.exp(-1j * motion.turned)[:, None]
    mean, steps = [], np.gradient(angle)
    for begin in begins:
        part = slice(*np.searchsorted(angle, (begin, begin + 2 * np.pi * turns)))
        weight = np.sin((angle[part] - begin) / (2 * turns)) ** 2 * steps[part]
        mean.append(weight @ turning[part] / weight.sum())
    return np.interp(begins + np.pi * turns, angle, motion.speed), np.array(mean)


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
        What changes most, where it goes one way: "grows" or "decays", the size, or "drifts", the mean.
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
    chaotic
        Whether the motion does not come again, and its spectrum is no few lines.
    """

    mean: ComplexArray
    amplitude: FloatArray
    change: float
    trend: str
    at_rest: bool
    frequency: float
    speed: float
    period: float
    eccentricity: FloatArray
    chaotic: bool = False

    @property
    def steady(self) -> bool:
        """Whether it changes by less than 0.1 % one way or 1 % up and down, and is not chaotic."""
        return self.at_rest or (not self.chaotic and self.change <= (_TREND if self.trend else _WANDERS))

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
    whole, t = float(motion.time[-1]), motion.time
    window = max(0.2 * whole, min(8 * 2 * np.pi / last, whole) if last else 0.0)
    since = int(np.searchsorted(t, whole - window))
    t, z = t[since:] - t[since], motion.z[since:]
    mean = _faded_mean(z)
    size = np.abs(z - mean).max(axis=0)
    most, eccentricity = int(size.argmax()), motion.eccentricity(since)
    largest = np.maximum(np.abs(motion.z - mean).max(axis=0), np.abs(mean))
    if (size <= 1e-6 * largest).all():
        return SteadyEnd(mean, size, 0.0, "", True, np.nan, last, np.nan, eccentricity)
    halves = [z[k * len(z) // 8 :][: len(z) // 2] for k in range(5)]
    means = np.array([_faded_mean(part) for part in halves])
    strength = np.sqrt([_faded_mean(np.abs(part - mean) ** 2).real for part in halves])
    values = np.hstack([strength, means.real, means.imag])
    spread = np.ptp(values, axis=0)
    which = int(spread.argmax())
    ways = np.unique(np.sign(np.diff(values[:, which])))
    trend = ""
    if len(ways) == 1:
        trend = "drifts" if which >= strength.shape[1] else "grows" if ways[0] > 0 else "decays"
    around = z[:, most] - mean[most]
    frequency = _strongest(t, around)
    period = _period(t, around, 2 * np.pi / (last if motion.system.forced and last else abs(frequency)))
    rough = bool(np.isnan(period)) and _beside_lines(motion.z[motion.time.size // 2 :, most]) > _BROAD
    change = float(spread.max() / strength.max())
    return SteadyEnd(mean, size, change, trend, False, frequency, last, period, eccentricity, rough)


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
    top = minimize_scalar(
        lambda w: -abs(np.exp(-1j * w * t) @ faded),
        bounds=(middle - lines[1], middle + lines[1]),
        method="bounded",
        options={"xatol": 1e-9 * lines[1]},
    )
    return float(top.x)


def _beside_lines(z: ComplexArray) -> float:
    """Part of the power of a motion that is not in the largest lines of its spectrum."""
    power = np.abs(np.fft.fft(np.hanning(len(z) + 2)[1:-1] * (z - z.mean()))) ** 2
    whole = power.sum()
    for _ in range(_LINES):
        power[(int(power.argmax()) + np.arange(-3, 4)) % len(power)] = 0.0
    return float(power.sum() / whole)


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
