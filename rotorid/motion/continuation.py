"""Branches of periodic motion over speed by arc length, past folds; where their stability changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.motion.collocation import Linearised, Orbit, Periodic, wall_met

_LONGEST, _SHORTEST = 0.04, 1e-7
"""Of a step along the branch, by the size of the motion and the range of speeds."""
_UNITY = 1.0 + 1e-9  # a multiplier up to this is not outside the unit circle: rounding
_CORNER = 1e-4  # a shorter step may turn sharply: where a shaft meets its stop, the branch has a corner
_ROUGH = 1e-4  # more of `Orbit.roughness` halves the steps in time
_NEAR = 0.999  # of a clearance is at the wall
LEAST_STEPS, _MOST_STEPS, _MOST_POINTS = 32, 512, 1500  # steps in a revolution or cycle
FOLD, BRANCH, DOUBLING, TORUS, HOPF = "fold", "branch point", "period doubling", "Neimark–Sacker", "Hopf"


@dataclass(frozen=True, eq=False)
class Point:
    """A periodic motion of a branch, with its Floquet multipliers, the largest first.

    Of a motion with a period of its own the multiplier 1 of its phase is left out and stands in `phase`.
    """

    orbit: Orbit
    multipliers: ComplexArray
    phase: complex = 1.0

    @property
    def largest(self) -> float:
        """Absolute value of the largest multiplier."""
        return float(np.abs(self.multipliers[0]))

    @property
    def outside(self) -> int:
        """How many multipliers are outside the unit circle."""
        return int((np.abs(self.multipliers) > _UNITY).sum())


@dataclass(frozen=True, eq=False)
class Bifurcation:
    """Where the stability of a branch changes, or the branch turns; `after` how many points of it.

    `direction` is the eigenvector of the multiplier, shape (2n,).
    """

    kind: str
    point: Point
    after: int
    direction: ComplexArray


@dataclass(frozen=True, eq=False)
class Branch:
    """Periodic motions one after the other.

    Attributes
    ----------
    kind
        "synchronous", "period 2" and so on, "limit cycle", or "rest".
    turns
        Revolutions in a period, 0 for a period of its own.
    points, bifurcations
        Along the branch.
    ended
        Why it is no longer.
    """

    kind: str
    turns: int
    points: tuple[Point, ...]
    bifurcations: tuple[Bifurcation, ...]
    ended: str

    @property
    def speeds(self) -> FloatArray:
        """rad/s."""
        return np.array([point.orbit.speed for point in self.points])

    @property
    def stable(self) -> BoolArray:
        """Whether the motion returns after a small disturbance."""
        return np.array([point.outside == 0 for point in self.points])

    def at(self, speed: float, values: FloatArray) -> list[tuple[FloatArray, bool]]:
        """Values (k,) between those of the points around a speed, (points, k); whether both are stable."""
        speeds, stable, found = self.speeds, self.stable, []
        for k in np.flatnonzero(np.diff(speeds)):
            share = (speed - speeds[k]) / (speeds[k + 1] - speeds[k])
            if -1e-9 <= share <= 1 + 1e-9:
                between = (1 - share) * values[k] + share * values[k + 1]
                found.append((between, bool(stable[k] and stable[k + 1])))
        return found


@dataclass(frozen=True, eq=False)
class Start:
    """First guess of a branch, the conditions it is to meet, rows · y = values, and the last one's kind.

    The branch leaves in the direction in which the last condition's value grows.
    """

    guess: Orbit
    rows: FloatArray
    values: FloatArray


def at_speed(problem: Periodic, guess: Orbit, sign: float = 1.0) -> Start:
    """The start of a branch at the speed of the guess, upwards or, sign −1, downwards."""
    y = problem.unknowns(guess)
    rows = np.zeros((problem.free, y.size))
    rows[-1, -1] = sign
    if not problem.turns:
        rows[0, : guess.start.size] = guess.state[guess.start.size :]
    return Start(guess, rows, rows @ y)


def follow(problem: Periodic, start: Start, low: float, high: float, kind: str) -> Branch:
    """Follow a branch until it leaves a range of speeds, rad/s.

    Raises
    ------
    numpy.linalg.LinAlgError
        If there is no solution at the start.
    """
    at, _ = _solved(problem, start.guess, start.rows, start.values)
    walk = _Walk(problem, low, high, kind)
    tangent = walk.onwards(at, start.rows[-1])
    points, found, length = [walk.point(at)], list[Bifurcation](), _LONGEST / 4
    origin, first, ended = problem.unknowns(at.orbit), at.orbit.scale, ""
    while not ended:
        try:
            new, new_tangent, iterations, length = walk.step(at, tangent, length)
            passed = walk.passed(at, tangent, new, new_tangent, length, len(points))
        except np.linalg.LinAlgError as problem_met:
            length /= 2
            ended = f"stopped: {problem_met}" if length < _SHORTEST else ""
            continue
        if joined := [one.point for one in passed if walk.ends(one.point.orbit, first)]:
            points += joined
            ended = "joins the motion that it comes from"
            break
        found += passed
        points.append(walk.point(new))
        at, tangent = new, new_tangent
        away = walk.weights(at) * (problem.unknowns(at.orbit) - origin)
        if not low < at.orbit.speed < high:
            ended = "end of the range of speeds"
        elif len(points) > 20 and np.linalg.norm(away) < length:
            ended = "closed"
        elif met := wall_met(problem.system, at.orbit.deflections, _NEAR):
            ended = f"stopped: {met}"
        elif len(points) >= _MOST_POINTS:
            ended = f"stopped: {_MOST_POINTS} points"
        length = min(_LONGEST, length * (1.5 if iterations < 5 else 1.0 if iterations < 8 else 0.6))
    return Branch(kind, problem.turns, tuple(points), tuple(found), ended)


@dataclass(frozen=True, eq=False)
class _Walk:
    """What does not change along a branch."""

    problem: Periodic
    low: float
    high: float
    kind: str

    def weights(self, at: Linearised) -> FloatArray:
        """By which unknowns count for the length of a branch."""
        size = at.scale
        size[: -at.free] *= np.sqrt(size.size - at.free)
        size[-1] = self.high - self.low
        return 1 / size

    def rows(self, at: Linearised, tangent: FloatArray) -> FloatArray:
        """The phase condition, if there is one, and the length along the tangent."""
        return self.with_phase(at, self.weights(at) ** 2 * tangent)

    def with_phase(self, at: Linearised, along: FloatArray) -> FloatArray:
        """A condition, after that of the phase, if there is one: the motion is not moved along itself."""
        if self.problem.turns:
            return along[None]
        n, phase = at.orbit.start.size, np.zeros(along.size)
        phase[:n] = at.orbit.state[n:] / at.orbit.scale[:n] ** 2
        return np.array([phase, along])

    def corrected(
        self, at: Linearised, tangent: FloatArray, length: float
    ) -> tuple[Linearised, FloatArray, int]:
        """The solution at a length from another one, its tangent, and the iterations it took."""
        rows = self.rows(at, tangent)
        values = rows @ self.problem.unknowns(at.orbit)
        values[-1] += length
        guess = at.moved(tangent * length)
        new, iterations = _solved(self.problem, guess, rows, values)
        return new, self.onwards(new, rows[-1]), iterations

    def onwards(self, at: Linearised, along: FloatArray) -> FloatArray:
        """The tangent, in the direction of a row."""
        rows = self.with_phase(at, along)
        change = at.change(rows, np.eye(len(rows))[-1], left=0.0)
        return change / np.linalg.norm(self.weights(at) * change)

    def step(
        self, at: Linearised, tangent: FloatArray, length: float
    ) -> tuple[Linearised, FloatArray, int, float]:
        """The next point, its tangent, iterations, and how long the step was."""
        new, onwards, iterations = self.corrected(at, tangent, length)
        weights, y = self.weights(at), self.problem.unknowns(at.orbit)
        aside = weights * (self.problem.unknowns(new.orbit) - y - tangent * length)
        turn = (weights * tangent) @ (weights * onwards) / np.linalg.norm(weights * onwards)
        far = np.linalg.norm(aside) > 0.5 * length or turn < 0.9
        if far and length > _CORNER:
            raise np.linalg.LinAlgError("the branch turns too sharply")
        end = min(max(new.orbit.speed, self.low), self.high)
        if end != new.orbit.speed:
            rows = self.rows(at, tangent)
            last = rows.copy()
            last[-1] = np.eye(tangent.size)[-1]
            values = last @ y
            values[-1] = end
            new, _ = _solved(self.problem, new.orbit, last, values)
            onwards = self.onwards(new, rows[-1])
            length = float(rows[-1] @ (self.problem.unknowns(new.orbit) - y))
        return new, onwards, iterations, length

    def ends(self, orbit: Orbit, first: FloatArray) -> bool:
        """Whether a motion is that of fewer revolutions, or rest; `first` is the size of the first motion."""
        if self.problem.turns:
            return orbit.repeats(self.problem.turns)
        moved = np.ptp(orbit.ends, axis=0)
        return bool((moved < 0.1 * first[: moved.size]).all())

    def point(self, at: Linearised) -> Point:
        """What is kept of a solution."""
        multipliers = at.multipliers
        if self.problem.turns:
            return Point(at.orbit, multipliers)
        k = int(np.abs(multipliers - 1).argmin())
        return Point(at.orbit, np.delete(multipliers, k), complex(multipliers[k]))

    def passed(
        self,
        at: Linearised,
        tangent: FloatArray,
        new: Linearised,
        onwards: FloatArray,
        length: float,
        after: int,
    ) -> list[Bifurcation]:
        """Bifurcations between two points; LinAlgError where there are too many for one step."""
        before, now = self.point(at), self.point(new)
        few, many = sorted((before.outside, now.outside))
        fold = tangent[-1] * onwards[-1] < 0
        long = length > 1e-3 * _LONGEST
        if long and many - few > (1 if fold else 2):
            raise np.linalg.LinAlgError("several bifurcations at once")
        if not fold and many == few:
            return []

        def test(s: float) -> float:
            there, direction, _ = self.corrected(at, tangent, s)
            size = np.abs(self.point(there).multipliers[few])
            return float(direction[-1] if fold else np.log(size / _UNITY))

        there = self.corrected(at, tangent, _root(test, length))[0]
        kind, eigenvector = (FOLD, tangent[: -at.free].astype(complex)) if fold else self._kind(there, few)
        if long and kind in (BRANCH, DOUBLING) and many - few == 2:
            raise np.linalg.LinAlgError("two bifurcations at once")
        return [Bifurcation(kind, self.point(there), after, eigenvector)]

    def _kind(self, at: Linearised, which: int) -> tuple[str, ComplexArray]:
        """Name and eigenvector of what passes the unit circle."""
        value = self.point(at).multipliers[which]
        scale = at.orbit.scale
        values, vectors = np.linalg.eig(at.monodromy * scale / scale[:, None])
        direction = np.asarray(vectors[:, np.abs(values - value).argmin()] * scale, dtype=np.complex128)
        alone = abs(value.imag) < 1e-6
        if self.kind == "rest" and not (alone and value.real > 0):
            return HOPF, direction
        return (BRANCH if value.real > 0 else DOUBLING) if alone else TORUS, direction


def _root(test: Callable[[float], float], length: float) -> float:
    """Where a test along a step changes its sign; the step's end where it does so only by rounding."""
    from scipy.optimize import brentq

    first, last = test(0.0), test(length)
    if first * last > 0:
        return length
    return float(brentq(test, 0.0, length, xtol=1e-9 * length))


def _solved(problem: Periodic, guess: Orbit, rows: FloatArray, values: FloatArray) -> tuple[Linearised, int]:
    """A solution, its steps in time short enough, and longer again where they may be."""
    steps, turns = len(guess.velocities), max(problem.turns, 1)
    if guess.roughness < _ROUGH / 100 and steps >= 2 * LEAST_STEPS * turns:
        guess = guess.resampled(steps // 2)
    at, iterations = problem.solve(guess, rows, values)
    while at.orbit.roughness > _ROUGH:
        steps = 2 * len(at.orbit.velocities)
        if steps > _MOST_STEPS * turns:
            break
        at, _ = problem.solve(at.orbit.resampled(steps), rows, values)
    return at, iterations
