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
from rotorid.base.text import RPM, listing, percent, rpm_text
from rotorid.motion.branches import HOPF, Branch, follow, straight
from rotorid.motion.collocation import UNITY, Orbit, Periodic, turning
from rotorid.motion.equilibrium import equilibrium, room, whirl_at_rest
from rotorid.motion.steady import settled, steady_linear
from rotorid.motion.system import MotionSystem

_COARSE = 1e-3  # more of `Orbit.roughness` is said
_BETWEEN = 10
"""Speeds between both ends, at most, at which motion in time is begun."""


@dataclass(eq=False)
class PeriodicMotion(Periodic):
    """Branches of periodic motion, and what could not be found.

    Attributes
    ----------
    branches
        The first is synchronous, or, without unbalance and bow, at rest.
    warnings
        Clauses.
    tried
        Where motions were sought, in sentences.
    """

    branches: list[Branch] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    tried: str = ""

    def has(self, orbit: Orbit) -> bool:
        """Whether a branch comes through a motion."""
        return any(branch.has(orbit) for branch in self.branches)


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
    if limit_cycle and all(branch.orbits[0].turns for branch in motion.branches):
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
    if worst > _COARSE:
        yield f"the {branch.kind} branch has too few steps in time: {percent(worst)} % of it may be wrong"


def _cycles(motion: PeriodicMotion) -> None:
    """Limit cycles that begin at the Hopf points of rest."""
    n = motion.system.size
    for hopf in [b for branch in motion.branches for b in branch.bifurcations if b.bifurcation == HOPF]:
        whirl, shape = whirl_at_rest(motion.system, hopf.start, hopf.speed)
        guess = turning(hopf.speed, 2 * np.pi / whirl, 0, hopf.start, 0.01 * shape)
        row = np.append(shape.real, np.zeros(n + 2))
        try:
            if not motion.has(motion.solve(guess, row).orbit):
                motion.branches.append(follow(motion, guess, row))
        except np.linalg.LinAlgError:
            continue


def _search(motion: PeriodicMotion, limit_cycle: bool) -> None:
    """Follow what is found at some speeds, and say what is not."""
    remarks, done = dict[str, dict[float, None]](), list[float]()
    for speed in _speeds(motion):
        for end in _ends(motion, speed):
            words = _kept(motion, end, limit_cycle) if isinstance(end, Orbit) else end
            if words and not motion.late:
                remarks.setdefault(words, {})[speed] = None
        if motion.late:
            break
        done.append(speed)
    motion.warnings += [f"{words}, at {_listed(at)}" for words, at in remarks.items()]
    start = "from rest and from large whirls" if motion.system.forced else "with a large whirl"
    motion.tried = f"Motion in time was begun {start} at {_listed(done)}. Other motions were not sought."


def _listed(speeds: Iterable[float]) -> str:
    return f"{listing([f'{speed * RPM:.6g}' for speed in sorted(speeds)], 'and') or 'no'} rpm"


def _speeds(motion: PeriodicMotion) -> Iterator[float]:
    """Both ends, and when these are done the middle and those between bifurcations."""
    low, high = motion.low, motion.high
    yield from dict.fromkeys((low, high))
    bifurcations = (orbit.speed for branch in motion.branches for orbit in branch.bifurcations)
    edges = sorted({low, high, *bifurcations})
    yield from sorted({(a + b) / 2 for a, b in [(low, high), *itertools.pairwise(edges)]} - {low})[:_BETWEEN]


def _ends(motion: PeriodicMotion, speed: float) -> Iterator[Orbit | str]:
    """Motions near the linear rotor's and that motion in time comes to; or, in words, why there is none."""
    system = motion.system
    still = np.zeros(system.size)
    _, rest, response = next(iter(steady_linear(system, [speed])), (speed, still, still.astype(complex)))
    starts = [(rest, still)]
    if not system.forced:
        starts = [(rest + 0.5 * whirl_at_rest(system, rest, speed)[1].real, still)]
    elif response.any():
        load = speed**2 * system.unbalance + system.bow
        shape = response * np.exp(1j * np.angle(np.vdot(response, load)))  # in phase with the load
        size = 0.9 * np.sqrt(2) * room(system, rest, shape)
        large = (size if np.isfinite(size) else 5.0) * shape
        starts += [(rest + whirl.real, -speed * whirl.imag) for whirl in (large, -1j * large)]
    if system.forced and speed in (motion.low, motion.high):
        guess = turning(speed, 2 * np.pi / speed, 1, rest, response)
        try:
            yield motion.solve(guess, guess.at_speed).orbit
        except np.linalg.LinAlgError as met:
            yield f"no periodic motion is found from rest: {met}"
    for q, v in starts:
        if not motion.late:
            yield settled(system, speed, q, v, until=motion.until)[2]


def _kept(motion: PeriodicMotion, end: Orbit, limit_cycle: bool) -> str:
    """Follow a motion to both sides if it is not known; what is not followed, in words."""
    if motion.has(end):
        return ""
    if end.turns > 1:
        return f"motion in time comes again after {end.turns} revolutions only"
    if not end.turns and not limit_cycle:
        return "motion in time comes to a whirl with a period of its own (--limit-cycle)"
    ways = [sign for sign, last in ((1.0, motion.high), (-1.0, motion.low)) if end.speed != last]
    for sign in ways or [1.0]:
        try:
            motion.branches.append(follow(motion, end, sign * end.at_speed))
        except np.linalg.LinAlgError as met:
            return f"a periodic motion is not followed: {met}"
        if motion.branches[-1].ended == "closed":
            break
    return ""
