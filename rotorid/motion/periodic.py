"""Periodic motion of a rotor over a range of speeds: synchronous, of several revolutions, and self-excited.

Branches are followed from rest, and from the Hopf points of a rotor at rest. What they do not show is sought
by motion in time, from rest and from large whirls.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fem import InternalDamping
from rotorid.base.arrays import FloatArray
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.text import listing, percent
from rotorid.motion.branches import HOPF, Branch, follow, straight
from rotorid.motion.collocation import UNITY, Orbit, Periodic, repeating, turning
from rotorid.motion.equilibrium import at_rest, equilibrium, room, whirl_at_rest
from rotorid.motion.run import run
from rotorid.motion.steady import steady_end, steady_linear
from rotorid.motion.system import MotionSystem

_COARSE = 1e-3  # more of `Orbit.roughness` is said
_TURNS, _BLOCKS, _BETWEEN = 100, 8, 10
"""Revolutions of motion in time, how often so many more, and at how many speeds between both ends."""


@dataclass(eq=False)
class PeriodicMotion:
    """Branches of periodic motion, and what could not be found.

    Attributes
    ----------
    system
        What moves.
    low, high
        Range of speeds, rad/s.
    until
        When the search had to end, by `time.monotonic`.
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
    until: float
    branches: list[Branch] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    tried: str = ""

    @property
    def late(self) -> bool:
        """Whether the limit of time has come."""
        return time.monotonic() > self.until

    def problem(self, turns: int) -> Periodic:
        """What is sought of so many turns, or with a period of its own."""
        return Periodic(self.system, turns, self.low, self.high, self.until)

    def has(self, turns: int, orbit: Orbit) -> bool:
        """Whether a branch comes through a motion."""
        return any(branch.has(turns, orbit) for branch in self.branches)


def periodic_motion(
    system: MotionSystem,
    low: float,
    high: float,
    *,
    limit_cycle: bool = False,
    max_seconds: float = np.inf,
) -> PeriodicMotion:
    """Periodic motions over a range of speeds, their stability and bifurcations.

    Parameters
    ----------
    system
        What moves; without unbalance and bow its synchronous motion is rest.
    low, high
        rad/s; the same for one speed.
    limit_cycle
        Self-excited motions from the Hopf points of the rotor at rest.
    max_seconds
        Limit of time; what is known by then is given, with a warning.

    Raises
    ------
    ValueError
        For an impossible range, or if no motion is found to begin with.
    """
    if not 0 < low <= high:
        raise ValueError("periodic motion needs speeds above 0, the lower one first")
    if limit_cycle and system.forced:
        raise ValueError(
            "a limit cycle has a period of its own, which unbalance and bow do not allow: leave them out"
        )
    motion = PeriodicMotion(system, low, high, time.monotonic() + max_seconds)
    linear = all(isinstance(force, InternalDamping) for force in system.forces)
    if linear or not system.forced:
        motion.branches.extend(filter(None, [straight(system, low, high)]))
    if linear:
        motion.tried = "All forces are linear: there is one motion at each speed."
    else:
        if limit_cycle:
            _cycles(motion)
        _search(motion, limit_cycle)
    if motion.late and not motion.branches:
        raise ValueError(f"no periodic motion was found in {max_seconds:.6g} s: raise --max-seconds")
    if not motion.branches:
        equilibrium(system, low)  # its message is the better one
        raise ValueError(f"no periodic motion was found to begin with, {listing(motion.warnings, 'and')}")
    if motion.late:
        motion.warnings.insert(0, f"the search was stopped after {max_seconds:.6g} s (--max-seconds)")
    if not system.forced:
        motion.warnings.insert(0, "there is no unbalance and no bow: what is synchronous is rest")
    if limit_cycle and all(branch.turns for branch in motion.branches):
        motion.warnings.append("no limit cycle found: no Hopf point, and motion in time comes to none")
    for branch in motion.branches:
        motion.warnings += _doubts(branch, linear and system.forced)
    return motion


def _doubts(branch: Branch, response: bool) -> Iterator[str]:
    """What may be wrong with a branch, clauses."""
    if branch.ended.startswith("stopped"):
        yield f"the {branch.kind} branch {branch.ended} at {rpm_text(branch.orbits[-1].speed)}"
    if response and any(abs(abs(orbit.multipliers[0]) - 1) < UNITY - 1 for orbit in branch.points):
        yield "nothing damps a mode: at its critical speed the motion has no bound"
    worst = max(orbit.roughness for orbit in branch.orbits)
    if worst > _COARSE and not branch.straight:
        yield f"the {branch.kind} branch has too few steps in time: {percent(worst)} % of it may be wrong"


def _cycles(motion: PeriodicMotion) -> None:
    """Limit cycles that begin at the Hopf points of rest."""
    problem, n = motion.problem(0), motion.system.size
    for hopf in [b for branch in motion.branches for b in branch.bifurcations if b.bifurcation == HOPF]:
        whirl, shape = whirl_at_rest(motion.system, hopf.start, hopf.speed)
        guess = turning(hopf.speed, 2 * np.pi / whirl, hopf.start, 0.01 * shape)
        row = np.append(shape.real, np.zeros(n + 2))
        try:
            if not motion.has(0, problem.solve(guess, row)[0].orbit):
                motion.branches.append(follow(problem, guess, row))
        except np.linalg.LinAlgError:
            continue


def _search(motion: PeriodicMotion, limit_cycle: bool) -> None:
    """Follow what is found at both ends, in the middle and between bifurcations, and say what is not."""
    low, high, remarks = motion.low, motion.high, dict[str, dict[str, None]]()

    def done(speeds: Iterable[float]) -> list[str]:
        """Search at these until it is late; at which it was, rpm."""
        at = []
        for speed, name in ((speed, f"{speed * RPM:.6g}") for speed in speeds):
            for end in _ends(motion, speed):
                words = _kept(motion, end, limit_cycle) if isinstance(end, Orbit) else end
                if words and not motion.late:
                    remarks.setdefault(words, {})[name] = None
            at += [] if motion.late else [name]
        return at

    ends = done(dict.fromkeys((low, high)))
    bifurcations = (orbit.speed for branch in motion.branches for orbit in branch.bifurcations)
    edges = sorted({low, high, *bifurcations})
    middles = {(a + b) / 2 for a, b in [(low, high), *itertools.pairwise(edges)]} - {low}
    between = done(sorted(middles)[:_BETWEEN])
    motion.warnings += [f"{words}, at {listing(at, 'and')} rpm" for words, at in remarks.items()]
    start = "from rest and from large whirls" if motion.system.forced else "with a large whirl"
    at = listing([*ends, *between], "and") or "no speed"
    motion.tried = f"Motion in time was begun {start} at {at} rpm. Other motions were not sought."


def _ends(motion: PeriodicMotion, speed: float) -> Iterator[Orbit | str]:
    """Motions at a speed, or why there is none: that near the linear rotor's, and what others come to in time."""
    system = motion.system
    if system.forced and speed in (motion.low, motion.high):
        _, rests, responses = steady_linear(system, [speed])
        still = np.zeros((1, system.size))
        rest, response = np.vstack((rests, still)), np.vstack((responses, still))
        guess = turning(speed, 2 * np.pi / speed, rest[0], response[0])
        try:
            yield motion.problem(1).solve(guess, guess.at_speed)[0].orbit
        except np.linalg.LinAlgError as met:
            yield f"no periodic motion is found from rest: {met}"
    for q, v in _starts(system, speed):
        if not motion.late:
            yield _reached(motion, speed, q, v)


def _starts(system: MotionSystem, speed: float) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Deflections and velocities where motion in time begins: rest, and large whirls."""
    still = np.zeros(system.size)
    try:
        rest = at_rest(system, speed)
    except ValueError:
        rest = still
    if not system.forced:
        yield rest + 0.5 * whirl_at_rest(system, rest, speed)[1].real, still
        return
    yield rest, still
    for response in steady_linear(system, [speed])[2]:
        load = speed**2 * system.unbalance + system.bow
        shape = response * np.exp(1j * np.angle(np.vdot(response, load)))  # in phase with the load
        size = 0.9 * np.sqrt(2) * room(system, rest, shape)
        for large in (size if np.isfinite(size) else 5.0) * shape * np.array([[1.0], [-1j]]):
            yield rest + large.real, -speed * large.imag


def _reached(motion: PeriodicMotion, speed: float, q: FloatArray, v: FloatArray) -> Orbit | str:
    """What motion in time comes to: one period of it, what else in words, or "" for rest."""
    system, turn, sizes = motion.system, 2 * np.pi / speed, list[float]()
    for block in range(_BLOCKS):
        try:
            part = run(system, (speed, speed), _TURNS * turn, (q, v))
        except ValueError as problem_met:
            return f"motion in time is not known: {problem_met}"
        if part.stopped:
            return f"motion in time ends: {part.stopped.split(' after ')[0]}"
        q, v, end = part.q, part.v, steady_end(part)
        if end is None or motion.late:
            break
        sizes.append(float(end.amplitude.max()))
        if not system.forced and (end.at_rest or sizes[-1] < 1e-4 * sizes[0]):
            return ""
        cycle = turn if system.forced else 2 * np.pi / abs(end.frequency)
        repeats = np.isfinite(end.period)
        for period in (cycle, end.period)[: 1 + repeats] if repeats or block == _BLOCKS - 1 else ():
            again = repeating(system, speed, period, q, v)
            if again and again.outside == 0:
                return again
    if not system.forced and sizes[-1:] < [0.95 * size for size in sizes[_BLOCKS // 2 :][:1]]:
        return ""
    return f"motion in time comes to no periodic motion in {_TURNS * _BLOCKS} revolutions"


def _kept(motion: PeriodicMotion, end: Orbit, limit_cycle: bool) -> str:
    """Follow a motion to both sides if it is not known; what is not followed, in words."""
    turns = round(end.period * end.speed / (2 * np.pi)) if motion.system.forced else 0
    if motion.has(turns, end):
        return ""
    if turns > 1:
        return f"motion in time comes again after {turns} revolutions only"
    if not turns and not limit_cycle:
        return "motion in time comes to a whirl with a period of its own (--limit-cycle)"
    ways = [sign for sign, last in ((1.0, motion.high), (-1.0, motion.low)) if end.speed != last]
    for sign in ways or [1.0]:
        try:
            motion.branches.append(follow(motion.problem(turns), end, sign * end.at_speed))
        except np.linalg.LinAlgError as met:
            return f"a periodic motion is not followed: {met}"
        if motion.branches[-1].ended == "closed":
            break
    return ""
