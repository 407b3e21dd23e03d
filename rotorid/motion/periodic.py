"""Periodic motion of a rotor over speed: synchronous, of several revolutions, and self-excited."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.rpm import rpm_text
from rotorid.base.text import listing, percent
from rotorid.motion.collocation import POINTS, Orbit, Periodic
from rotorid.motion.continuation import (
    DOUBLING,
    HOPF,
    Bifurcation,
    Branch,
    Start,
    at_speed,
    follow,
    settled,
)
from rotorid.motion.equilibrium import equilibrium
from rotorid.motion.system import MotionSystem

_STEPS = 32  # in one revolution, or one period of a motion's own, to begin with
_COARSE = 1e-3
"""Of `Orbit.roughness`."""
_SAME = 0.02  # of the motion: what differs by less is no other motion
_CYCLES = 60  # of motion in time, before it is taken for a limit cycle
_FIRST = 0.01  # amplitude at the beginning of a branch, of the smallest clearance


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
    """

    system: MotionSystem
    low: float
    high: float
    branches: tuple[Branch, ...]
    warnings: tuple[str, ...]


def periodic_motion(
    system: MotionSystem,
    low: float,
    high: float,
    *,
    subsynchronous: int | None = None,
    limit_cycle: bool = False,
    steps: int | None = None,
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
    steps
        In time, in a revolution or a cycle, kept; default: from 32 up, as the motion needs them.

    Raises
    ------
    ValueError
        For an impossible range, or if no motion is found to begin with.
    """
    if not 0 < low < high:
        raise ValueError("periodic motion needs speeds above 0, the lower one first")
    forced = bool(np.abs(system.unbalance).any() or np.abs(system.bow).any())
    if limit_cycle and forced:
        raise ValueError(
            "a limit cycle has a period of its own, which unbalance and bow do not allow: leave them out"
        )
    search = _Search(system, low, high, steps)
    kind = "synchronous" if forced else "rest"
    branches = search.main(kind)
    warnings = [] if forced else ["there is no unbalance and no bow: what is synchronous is rest"]
    if subsynchronous:
        more = search.subsynchronous(subsynchronous, branches) if forced else []
        warnings += [] if more else [f"no motion of {subsynchronous} revolutions was found"]
        branches += more
    if limit_cycle:
        more = search.cycles(branches)
        warnings += [] if more else ["no limit cycle found: no Hopf point, and motion in time comes to none"]
        branches += more
    return PeriodicMotion(system, low, high, tuple(branches), tuple(warnings + _doubts(branches)))


@dataclass(frozen=True, eq=False)
class _Search:
    """What the branches have in common."""

    system: MotionSystem
    low: float
    high: float
    steps: int | None

    @property
    def count(self) -> int:
        """Steps in one revolution or cycle to begin with."""
        return self.steps or _STEPS

    def follow(self, problem: Periodic, start: Start, kind: str) -> Branch:
        return follow(problem, start, self.low, self.high, kind, fixed_steps=self.steps is not None)

    def main(self, kind: str) -> list[Branch]:
        """From the lowest speed upwards and, if that is another branch, from the highest downwards."""
        problem, found = Periodic(self.system, 1), list[Branch]()
        problems: list[str] = []
        for speed, sign in ((self.low, 1.0), (self.high, -1.0)):
            try:
                guess = settled(problem, speed, self.count, _at_rest(self.system, speed))
                if not self.known(guess, found):
                    found.append(self.follow(problem, at_speed(problem, guess, sign), kind))
            except np.linalg.LinAlgError as met:
                problems.append(f"at {rpm_text(speed)}: {met}")
        if not found:
            equilibrium(self.system, self.low)  # its message is the better one
            raise ValueError(f"no periodic motion was found to begin with, {listing(problems, 'and')}")
        return found

    def subsynchronous(self, turns: int, branches: list[Branch]) -> list[Branch]:
        """From period doublings, or else from what the motion in time comes to."""
        problem, found = Periodic(self.system, turns), list[Branch]()
        doublings = [b for branch in branches for b in branch.bifurcations if b.kind == DOUBLING]
        starts = [self.doubled(b) for b in doublings] if turns == 2 else []
        for start in starts:
            found += self._try(problem, start, found)
        for speed in np.linspace(self.low, self.high, 9)[1:-1] if not found else ():
            try:
                guess = settled(problem, float(speed), turns * self.count, _at_rest(self.system, speed), 0)
                for _ in range(30):
                    guess = problem.marched(guess)
                begin = at_speed(problem, guess)
                guess = problem.solve(guess, begin.rows, begin.values)[0].orbit
            except np.linalg.LinAlgError:
                continue
            if not guess.repeats(turns) and not self.known(guess, found):
                for sign in (1.0, -1.0):
                    found += self._try(problem, at_speed(problem, guess, sign), [])
        return found

    def _try(self, problem: Periodic, start: Start, known: list[Branch]) -> list[Branch]:
        """The branch, if there is one that is not known."""
        try:
            at, _ = problem.solve(start.guess, start.rows, start.values)
            if self.known(at.orbit, known):
                return []
            kind = f"period {problem.turns}" if problem.turns else "limit cycle"
            return [self.follow(problem, start, kind)]
        except np.linalg.LinAlgError:
            return []

    def known(self, orbit: Orbit, branches: list[Branch]) -> bool:
        """Whether a branch comes through this motion, or through the same some revolutions later."""
        size = orbit.scale[: orbit.start.size]
        for branch in branches:
            later = orbit.ends[:-1][:: len(orbit.velocities) // max(branch.turns, 1)]
            states = (
                np.array([point.orbit.start for point in branch.points]) / orbit.scale[: orbit.start.size]
            )
            way = np.column_stack([states, branch.speeds / (self.high - self.low)])
            step = np.diff(way, axis=0)
            for state in later / size:
                from_here = np.append(state, orbit.speed / (self.high - self.low)) - way[:-1]
                share = np.clip((from_here * step).sum(axis=1) / (step * step).sum(axis=1), 0.0, 1.0)
                if np.linalg.norm(from_here - share[:, None] * step, axis=1).min(initial=1.0) < _SAME:
                    return True
        return False

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

    def cycles(self, branches: list[Branch]) -> list[Branch]:
        """Those that begin at Hopf points, and what motion in time comes to at the highest speed."""
        hopf = [b for branch in branches for b in branch.bifurcations if b.kind == HOPF]
        problem, found = Periodic(self.system, 0), list[Branch]()
        for point in hopf:
            found += self._try(problem, self.cycle(point), [])
        if any(b.stable[-1] and b.points[-1].orbit.speed >= self.high * (1 - 1e-9) for b in found):
            return found
        try:
            guess = self.whirling(problem)
            row = at_speed(problem, guess, -1.0)
            phase = np.append(guess.state[self.system.size :], np.zeros(self.system.size + 2))
            rows = np.array([phase, row.rows[0]])
            start = Start(guess, rows, rows @ problem.unknowns(guess))
            cycle = problem.solve(guess, rows, start.values)[0].orbit
        except np.linalg.LinAlgError:
            return found
        rest = np.abs(cycle.ends - cycle.start).max() < 0.1 * _FIRST * _length(self.system, cycle.start)
        if not rest:
            found.append(self.follow(problem, start, "limit cycle"))
        return found

    def whirling(self, problem: Periodic) -> Orbit:
        """What a disturbance at rest comes to at the highest speed, cut where it is nearly periodic."""
        rest = _at_rest(self.system, self.high)
        whirl, shape = whirl_at_rest(self.system, rest, self.high)
        start = rest + _FIRST * _length(self.system, rest) * shape.real / np.abs(shape).max()
        steps, n = self.count, rest.size
        orbit = Orbit(self.high, 2 * np.pi / whirl, start, np.zeros((steps, 4, n)))
        for _ in range(_CYCLES):
            orbit = problem.marched(orbit)
        after = problem.marched(orbit).ends
        ends = np.concatenate([orbit.ends[:-1], after])
        away = np.abs((ends - ends[0]) / orbit.scale[:n]).max(axis=1)
        near = steps // 2 + int(away[steps // 2 : 3 * steps // 2 + 1].argmin())
        return problem.marched(replace(orbit, period=orbit.period * near / steps))

    def cycle(self, point: Bifurcation) -> Start:
        """Of the limit cycles that begin at a Hopf point."""
        orbit = point.point.orbit
        whirl, shape = whirl_at_rest(self.system, orbit.start, orbit.speed)
        shape *= np.exp(-0.5j * np.angle(np.sum(shape * shape))) / np.abs(shape).max()
        amplitude = _FIRST * _length(self.system, orbit.start)
        t = 2 * np.pi * (np.arange(self.count)[:, None] + POINTS) / self.count
        moved = amplitude * shape * np.exp(1j * t)[..., None]
        guess = Orbit(
            orbit.speed, 2 * np.pi / whirl, orbit.start + amplitude * shape.real, (1j * whirl * moved).real
        )
        n = shape.size
        rows = np.zeros((2, 2 * n + 2))
        rows[0, :n], rows[1, :n] = shape.imag, shape.real
        values = rows[:, :n] @ orbit.start + [0.0, amplitude * shape.real @ shape.real]
        return Start(guess, rows, values)


def whirl_at_rest(system: MotionSystem, q: FloatArray, speed: float) -> tuple[float, ComplexArray]:
    """Angular frequency, rad/s, and shape (n,) of the least damped whirl around a rotor at rest in q (n,)."""
    C, K = system.linear(speed)
    _, F_q, F_v, _ = system.acting(q, np.zeros_like(q), speed)
    n, eye = q.size, np.eye(q.size)
    zero = np.zeros((n, n))
    left = np.block([[zero, eye], [F_q - K, F_v - C]])
    values, vectors = scipy.linalg.eig(left, np.block([[eye, zero], [zero, system.M]]))
    whirls = np.isfinite(values) & (values.imag > 0)
    k = np.flatnonzero(whirls)[values[whirls].real.argmax()]
    return float(values[k].imag), np.asarray(vectors[:n, k])


def _length(system: MotionSystem, q: FloatArray) -> float:
    """The smallest clearance, or the largest deflection."""
    walls = [force.wall for force in system.forces if np.isfinite(force.wall)]
    return min(walls) if walls else max(float(np.abs(q).max()), 1e-6)


def _at_rest(system: MotionSystem, speed: float) -> FloatArray:
    """Where the rotor rests at a speed, (n,); at the centres, where it cannot."""
    try:
        q = equilibrium(system, speed).q
    except ValueError:
        q = np.zeros(system.size)
    return q if q.any() else np.full(system.size, 1e-4 * _length(system, q))


def _doubts(branches: list[Branch]) -> list[str]:
    """What may be wrong with the branches."""
    said = [f"the {b.kind} branch {b.ended}" for b in branches if b.ended.startswith("stopped")]
    for branch in branches:
        worst = max(point.orbit.roughness for point in branch.points)
        if worst > _COARSE:
            said.append(
                f"the {branch.kind} branch has too few steps in time: {percent(worst)} % of it may be "
                "wrong (--steps)"
            )
    return said
