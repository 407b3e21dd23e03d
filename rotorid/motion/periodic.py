"""Periodic motion of a rotor over speed: synchronous, of several revolutions, and self-excited."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.text import listing, percent
from rotorid.motion.collocation import POINTS, Linearised, Orbit, Periodic
from rotorid.motion.continuation import (
    DOUBLING,
    HOPF,
    LEAST_STEPS,
    Bifurcation,
    Branch,
    Start,
    at_speed,
    follow,
)
from rotorid.motion.equilibrium import equilibrium
from rotorid.motion.run import run
from rotorid.motion.start import at_rest, steady_linear
from rotorid.motion.steady_end import steady_end
from rotorid.motion.system import MotionSystem

_COARSE = 1e-3
"""Of `Orbit.roughness`."""
_SAME = 0.02  # of the motion: what differs by less is no other motion
_FIRST, _FAR = 0.01, 0.5  # amplitudes of what is free: where a branch begins, and motion in time
_STILL, _FADES = 1e-4, 0.95  # of its size at the beginning, and half the time ago: it comes to rest
_NEAR = 0.3  # of its size: the periodic motion that a motion in time comes to
_TURNS, _BLOCKS = 100, 8  # revolutions of motion in time, and how often so many more
_ASKED = 12
_NOT_AGAIN = "comes to a periodic motion that Newton's method does not find again"
_NOTHING = f"comes to no periodic motion in {_TURNS * _BLOCKS} revolutions"


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """Branches of periodic motion, and what could not be found.

    Attributes
    ----------
    system
        What moves.
    low, high
        Range of speeds, rad/s.
    branches
        The first is synchronous, or, without unbalance and bow, at rest.
    warnings
        Clauses.
    tried
        Where motions were sought, in sentences.
    """

    system: MotionSystem
    low: float
    high: float
    branches: tuple[Branch, ...]
    warnings: tuple[str, ...]
    tried: str


def periodic_motion(
    system: MotionSystem,
    low: float,
    high: float,
    *,
    subsynchronous: int | None = None,
    limit_cycle: bool = False,
    max_seconds: float = np.inf,
) -> PeriodicMotion:
    """Periodic motions over a range of speeds, their stability and bifurcations.

    Parameters
    ----------
    system
        What moves; without unbalance and bow its synchronous motion is rest.
    low, high
        rad/s.
    subsynchronous
        Also motions of so many revolutions: those that begin at a period doubling, for 2, or else those that
        the motion in time comes to at a speed of the range.
    limit_cycle
        Self-excited motions from the Hopf points of the rotor at rest.
    max_seconds
        Limit of time; what is known by then is given, with a warning.

    Raises
    ------
    ValueError
        For an impossible range, or if no motion is found to begin with.
    """
    if not 0 < low < high:
        raise ValueError("periodic motion needs speeds above 0, the lower one first")
    forced = _forced(system)
    if limit_cycle and forced:
        raise ValueError(
            "a limit cycle has a period of its own, which unbalance and bow do not allow: leave them out"
        )
    search = _Search(system, low, high, forced, time.monotonic() + max_seconds)
    branches, problems = search.main()
    warnings = [] if forced else ["there is no unbalance and no bow: what is synchronous is rest"]
    turns = 0 if limit_cycle else subsynchronous if forced else None
    if turns is not None:
        branches += search.begun(turns, branches)
    warnings += search.complete(branches, turns) if system.forces else []
    if search.late and not branches:
        raise ValueError(f"no periodic motion was found in {max_seconds:.6g} s: raise --max-seconds")
    if not branches:
        equilibrium(system, low)  # its message is the better one
        raise ValueError(f"no periodic motion was found to begin with, {listing(problems + warnings, 'and')}")
    if limit_cycle and not any(b.turns == 0 for b in branches):
        warnings.append("no limit cycle found: no Hopf point, and motion in time comes to none")
    if subsynchronous and not any(b.turns == subsynchronous for b in branches):
        warnings.append(f"no motion of {subsynchronous} revolutions was found")
    warnings += _doubts(branches)
    if search.late:
        warnings.insert(0, f"the search was stopped after {max_seconds:.6g} s (--max-seconds)")
    return PeriodicMotion(system, low, high, tuple(branches), tuple(warnings), search.tried)


@dataclass(frozen=True, eq=False)
class _Search:
    """What the branches have in common."""

    system: MotionSystem
    low: float
    high: float
    forced: bool
    until: float
    in_time_at: list[float] = field(default_factory=list)

    def problem(self, turns: int) -> Periodic:
        """What a motion of so many revolutions is sought of."""
        return Periodic(self.system, turns, self.until)

    @property
    def late(self) -> bool:
        """Whether the limit of time has come."""
        return time.monotonic() > self.until

    @property
    def tried(self) -> str:
        """Where motions were sought, in sentences."""
        at, in_time = (
            f"{listing([f'{speed * RPM:.6g}' for speed in speeds], 'and')} rpm"
            for speeds in ((self.low, self.high), self.in_time_at)
        )
        start = "at rest" if self.forced else "with a large whirl"
        words = f"Motions were followed from rest at {at}"
        words += f"; motion in time was begun {start} at {in_time}" if self.in_time_at else ""
        return f"{words}. Other motions were not sought."

    def follow(self, problem: Periodic, start: Start) -> list[Branch]:
        """The branch, if it begins."""
        kind = {0: "limit cycle", 1: "synchronous" if self.forced else "rest"}.get(problem.turns)
        try:
            return [follow(problem, start, self.low, self.high, kind or f"period {problem.turns}")]
        except np.linalg.LinAlgError:
            return []

    def main(self) -> tuple[list[Branch], list[str]]:
        """From rest at the lowest speed upwards and, if that is another branch, at the highest downwards."""
        problem, found, said = self.problem(1), list[Branch](), list[str]()
        for speed, sign in ((self.low, 1.0), (self.high, -1.0)):
            try:
                start = at_speed(problem, self.linear(speed))
                orbit = problem.solve(start.guess, start.rows, start.values)[0].orbit
            except np.linalg.LinAlgError as met:
                said.append(f"at {rpm_text(speed)} no periodic motion is found from rest: {met}")
                continue
            if not _known(problem.turns, orbit, found):
                found += self.follow(problem, at_speed(problem, orbit, sign))
        return found, said

    def linear(self, speed: float) -> Orbit:
        """Steady motion of the rotor made linear about its equilibrium; without one rest at the centres."""
        _, rests, responses = steady_linear(self.system, [speed])
        rest, response = (rests[0], responses[0]) if len(rests) else (np.zeros(self.system.size), 0.0)
        turning = np.exp(2j * np.pi * (np.arange(LEAST_STEPS)[:, None] + POINTS) / LEAST_STEPS)[..., None]
        velocities = (1j * speed * turning * response).real * np.ones(self.system.size)
        return Orbit(speed, 2 * np.pi / speed, rest + np.real(response), velocities)

    def begun(self, turns: int, branches: list[Branch]) -> list[Branch]:
        """Limit cycles that begin at Hopf points, or motions of two revolutions at period doublings."""
        problem, found = self.problem(turns), list[Branch]()
        begin = {0: (HOPF, self.cycle), 2: (DOUBLING, self.doubled)}
        kind, start = begin.get(turns, ("", self.doubled))
        for point in (b for branch in branches for b in branch.bifurcations if b.kind == kind):
            try:
                first = start(point)
                orbit = problem.solve(first.guess, first.rows, first.values)[0].orbit
            except np.linalg.LinAlgError:
                continue
            if not _known(turns, orbit, found):
                found += self.follow(problem, first)
        return found

    def complete(self, branches: list[Branch], turns: int | None) -> list[str]:
        """Follow what motion in time comes to and no branch shows; what is not followed, in words."""
        said: dict[str, list[str]] = {}
        for speed in self._asked(branches):
            try:
                end = self.reached(speed)
            except ValueError as problem_met:
                end = f"is not known: {problem_met}"
            if self.late:
                break
            self.in_time_at.append(speed)
            if isinstance(end, Orbit):
                own = round(end.period * speed / (2 * np.pi)) if self.forced else 0
                if _known(own, end, branches):
                    continue
                if own in (1, turns):
                    problem = self.problem(own)
                    ways = [sign for sign, last in ((1.0, self.high), (-1.0, self.low)) if speed != last]
                    more = [b for way in ways for b in self.follow(problem, at_speed(problem, end, way))]
                    branches += more
                    end = "" if more else _NOT_AGAIN
                elif own:
                    end = f"comes again after {own} revolutions only (--subsynchronous {own})"
                else:
                    end = "comes to a whirl with a period of its own (--limit-cycle)"
            if end:
                said.setdefault(end, []).append(f"{speed * RPM:.6g}")
        return [f"motion in time {end}, at {listing(at, 'and')} rpm" for end, at in said.items()]

    def _asked(self, branches: list[Branch]) -> list[float]:
        """Speeds at which motion in time is asked: three, and in the middle of where no branch is stable."""
        edges = {self.low, self.high}
        for branch in branches:
            edges |= {*branch.speeds[[0, -1]], *(b.point.orbit.speed for b in branch.bifurcations)}
        asked, apart = [self.low, (self.low + self.high) / 2, self.high], 1e-3 * (self.high - self.low)
        for a, b in itertools.pairwise(sorted(edges)):
            ways = (way for branch in branches for way in branch.at((a + b) / 2, branch.speeds[:, None]))
            if b - a > apart and not any(stable for _, stable in ways):
                asked.append((a + b) / 2)
        return sorted({*asked})[:_ASKED]

    def reached(self, speed: float) -> Orbit | str:
        """What motion in time from rest comes to: one period of it, what else in words, or "" for rest."""
        q, v = _at_rest(self.system, speed), np.zeros(self.system.size)
        if not self.forced:
            q = q + _FAR * whirl_at_rest(self.system, q, speed)[1].real
        sizes, turn, period = list[float](), 2 * np.pi / speed, 0.0
        for _ in range(_BLOCKS):
            if self.late:
                return _NOTHING
            motion = run(self.system, (speed, speed), _TURNS * turn, (q, v))
            if motion.stopped:
                return f"from rest ends: {motion.stopped.split(' after ')[0]}"
            q, v, end = motion.q, motion.v, steady_end(motion)
            if end is None:
                return _NOTHING
            sizes.append(float(end.amplitude.max()))
            if not self.forced and (end.at_rest or sizes[-1] < _STILL * sizes[0]):
                return ""
            if np.isfinite(end.period) and (found := repeating(self.system, speed, end.period, q, v)):
                return found.orbit
            period = turn if self.forced else 2 * np.pi / abs(end.frequency)
        if not self.forced and sizes[-1] < _FADES * sizes[(len(sizes) - 1) // 2]:
            return ""
        found = repeating(self.system, speed, period, q, v)
        stable = found is not None and (np.abs(found.multipliers) < 1).all()
        return found.orbit if found and stable else _NOTHING

    def doubled(self, point: Bifurcation) -> Start:
        """Of the branch of twice the period that begins at a period doubling."""
        orbit, direction = point.point.orbit, np.real(point.direction)
        direction = direction / np.abs(direction / orbit.scale).max()
        amplitude, n = 0.02, orbit.start.size
        at = Periodic(self.system, 1).linearised(orbit)
        change = np.append(direction, 0.0) * amplitude
        halves = [at.moved(sign * change).velocities for sign in (1.0, -1.0)]
        guess = Orbit(orbit.speed, 2 * orbit.period, orbit.start + change[:n], np.concatenate(halves))
        row = np.append(direction / orbit.scale**2, 0.0)
        size = row[:-1] @ direction
        return Start(guess, row[None], np.array([row[:-1] @ orbit.state + amplitude * size]))

    def cycle(self, point: Bifurcation) -> Start:
        """Of the limit cycles that begin at a Hopf point."""
        orbit = point.point.orbit
        whirl, shape = whirl_at_rest(self.system, orbit.start, orbit.speed)
        shape = _FIRST * shape
        t = 2 * np.pi * (np.arange(LEAST_STEPS)[:, None] + POINTS) / LEAST_STEPS
        moved = (1j * whirl * shape * np.exp(1j * t)[..., None]).real
        n = shape.size
        rows = np.zeros((2, 2 * n + 2))
        rows[0, :n], rows[1, :n] = shape.imag, shape.real
        values = rows[:, :n] @ orbit.start + [0.0, shape.real @ shape.real]
        return Start(Orbit(orbit.speed, 2 * np.pi / whirl, orbit.start + shape.real, moved), rows, values)


def repeating(
    system: MotionSystem, speed: float, period: float, q: FloatArray, v: FloatArray
) -> Linearised | None:
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
    turns = round(period * speed / (2 * np.pi)) if _forced(system) else 0
    period = 2 * np.pi * turns / speed if turns else period
    problem = Periodic(system, turns)
    try:
        guess = _one_period(system, speed, period, LEAST_STEPS * max(turns, 1), q, v)
        start = at_speed(problem, guess)
        at, _ = problem.solve(guess, start.rows, start.values)
    except np.linalg.LinAlgError:
        return None
    if turns > 1 and at.orbit.repeats(turns):
        return repeating(system, speed, 2 * np.pi / speed, q, v)
    away = np.abs(at.orbit.ends - guess.ends).max(axis=0) / at.orbit.scale[: q.size]
    return at if away.max() < _NEAR else None


def departing(system: MotionSystem, turns: int, left: Bifurcation) -> float:
    """Frequency, rad/s, of the motion by which a motion of so many revolutions is left at a bifurcation.

    A multiplier gives it but for its sign and multiples of 2π / T: these are of the largest part of the
    disturbance, its eigenvector followed through the period T.
    """
    orbit, direction = left.point.orbit, left.direction
    states = Periodic(system, turns).linearised(orbit).states[..., : direction.size] @ direction
    places = np.ravel([system.index(node) for node in system.nodes])
    moved, N = states[:-1, places], len(states) - 1
    phase = float(np.angle(np.vdot(moved[0], states[-1, places])))
    parts = np.fft.fft(moved * np.exp(-1j * phase * np.arange(N) / N)[:, None], axis=0)
    k = np.fft.fftfreq(N, 1 / N)[np.linalg.norm(parts, axis=1).argmax()]
    return float(abs(phase + 2 * np.pi * k) / orbit.period)


def _forced(system: MotionSystem) -> bool:
    """Whether unbalance or bow drive it."""
    return bool(system.unbalance.any() or system.bow.any())


def whirl_at_rest(system: MotionSystem, q: FloatArray, speed: float) -> tuple[float, ComplexArray]:
    """Angular frequency, rad/s, and shape (n,) of the least damped whirl around a rotor at rest in q (n,).

    Its size is what is free: one of the shafts comes to its wall, or deflects twice as much as at rest.
    """
    C, K = system.linear(speed)
    _, F_q, F_v, _ = system.acting(q, np.zeros_like(q), speed)
    n, eye = q.size, np.eye(q.size)
    zero = np.zeros((n, n))
    left = np.block([[zero, eye], [F_q - K, F_v - C]])
    values, vectors = scipy.linalg.eig(left, np.block([[eye, zero], [zero, system.M]]))
    finite = np.isfinite(values)
    whirls = finite & (values.imag > 0) if (finite & (values.imag > 0)).any() else finite
    k = np.flatnonzero(whirls)[values[whirls].real.argmax()]
    shape = vectors[:n, k] * np.exp(-0.5j * np.angle(np.sum(vectors[:n, k] ** 2)))
    places = np.array([system.index(node) for node in system.nodes])
    moved, at = np.linalg.norm(shape[places], axis=1), np.linalg.norm(q[places], axis=1)
    free = np.full(len(places), max(float(at.max()), 1e-6))
    for force in system.forces:
        if np.isfinite(force.wall):
            free[system.nodes.index(force.node)] = force.wall - at[system.nodes.index(force.node)]
    return float(values[k].imag), np.asarray(shape * min(free / np.maximum(moved, 1e-300)))


def _one_period(
    system: MotionSystem, speed: float, period: float, steps: int, q: FloatArray, v: FloatArray
) -> Orbit:
    """The motion in time from a state at the angle 0 as the guess of a periodic one."""
    first, velocities = q, np.empty((steps * len(POINTS), q.size))
    times = (np.arange(steps)[:, None] + POINTS).ravel() * (period / steps)
    for k, (begin, end) in enumerate(itertools.pairwise([0.0, *times])):
        part = run(system, (speed, speed), end - begin, (q, v), rate=1 / (end - begin), angle=speed * begin)
        q, v = part.q, part.v
        velocities[k] = v
    return Orbit(speed, period, first, velocities.reshape(steps, len(POINTS), -1))


def _known(turns: int, orbit: Orbit, branches: list[Branch]) -> bool:
    """Whether a branch comes through a motion, or one as large: by largest and smallest deflections."""
    size = orbit.scale[: orbit.start.size].max()
    for branch in branches:
        if branch.turns == turns:
            extents = np.array([_extent(point.orbit) for point in branch.points])
            for extent, _ in branch.at(orbit.speed, extents):
                if np.abs(extent - _extent(orbit)).max() < _SAME * size:
                    return True
    return False


def _extent(orbit: Orbit) -> FloatArray:
    """Largest and smallest deflections, shape (2n,)."""
    q = orbit.deflections
    return np.concatenate([q.max(axis=(0, 1)), q.min(axis=(0, 1))])


def _at_rest(system: MotionSystem, speed: float) -> FloatArray:
    """Where the rotor rests at a speed, (n,); at the centres, where it cannot."""
    try:
        return at_rest(system, speed)
    except ValueError:
        return np.zeros(system.size)


def _doubts(branches: list[Branch]) -> list[str]:
    """What may be wrong with the branches."""
    stopped = [b for b in branches if b.ended.startswith("stopped")]
    said = [f"the {b.kind} branch {b.ended} at {rpm_text(b.speeds[-1])}" for b in stopped]
    for branch in branches:
        worst = max(point.orbit.roughness for point in branch.points)
        if worst > _COARSE:
            said.append(
                f"the {branch.kind} branch has too few steps in time: {percent(worst)} % of it may be wrong"
            )
    return said
