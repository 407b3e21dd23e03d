"""Branches of periodic motion over speed, and their bifurcations.

The motions of `collocation` are followed by arc length, past folds. A rotor at rest, and one whose forces are
all linear, need neither: the response is that of the equations about the equilibrium, with the multipliers
e^{λT}.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.text import ROUNDING
from rotorid.motion.collocation import UNITY, Linearised, Orbit, Periodic, turning, wall_met
from rotorid.motion.equilibrium import eigenvalues_at_rest
from rotorid.motion.steady import steady_linear
from rotorid.motion.system import MotionSystem

_LONGEST, _SHORTEST, _CORNER = 0.04, 1e-7, 1e-4
"""Of a step along a branch, by the size of the motion and the range of speeds; shorter ones may turn sharply:
where a shaft meets its stop, the branch has a corner."""
_SMALLEST = 0.1  # of a limit cycle, by its first, which is a hundredth of the room: below it is rest
_FLAT = 1e-8  # change of speed along a branch, by the range, that may be rounding
_ORBITS, _GRID = 1500, 120
"""Of a branch at most, and of one that is straight."""
_SAME = 0.02  # of the motion: what differs by less is no other motion
KINDS = FOLD, DOUBLING, TORUS, HOPF, BRANCH = (
    "fold",
    "period doubling",
    "Neimark–Sacker",
    "Hopf",
    "branch point",
)


@dataclass(frozen=True, eq=False)
class Branch:
    """Periodic motions one after the other.

    Attributes
    ----------
    kind
        "synchronous", "limit cycle", or "rest".
    orbits
        Along the branch, its bifurcations in their places.
    ended
        Why it is no longer.
    """

    kind: str
    orbits: tuple[Orbit, ...]
    ended: str

    @property
    def points(self) -> tuple[Orbit, ...]:
        """Without the bifurcations."""
        return tuple(orbit for orbit in self.orbits if not orbit.bifurcation)

    @property
    def bifurcations(self) -> tuple[Orbit, ...]:
        """Where the stability changes, or the branch turns."""
        return tuple(orbit for orbit in self.orbits if orbit.bifurcation)

    @property
    def speeds(self) -> FloatArray:
        """rad/s, of the points."""
        return np.array([orbit.speed for orbit in self.points])

    @property
    def stable(self) -> BoolArray:
        """Of the points."""
        return np.array([orbit.stable for orbit in self.points])

    @property
    def stable_ranges(self) -> list[tuple[float, float]]:
        """Lowest and highest speeds of its stable stretches, from bifurcation to bifurcation, rad/s."""
        ranges = []
        for _, group in itertools.groupby(self.orbits, lambda one: one.stable or bool(one.bifurcation)):
            stretch = [*group]
            if any(orbit.stable for orbit in stretch):
                speeds = [orbit.speed for orbit in stretch]
                ranges.append((min(speeds), max(speeds)))
        return ranges

    def at(self, speed: float, values: FloatArray) -> list[tuple[FloatArray, bool]]:
        """Values (k,) between those of the points around a speed, (points, k); whether both are stable."""
        speeds, stable = self.speeds, self.stable
        if len(speeds) == 1:
            return [(values[0], bool(stable[0]))] if np.isclose(speed, speeds[0], rtol=1e-9) else []
        around = []
        for k in np.flatnonzero(np.diff(speeds)):
            share = (speed - speeds[k]) / (speeds[k + 1] - speeds[k])
            if -1e-9 <= share <= 1 + 1e-9:
                between = (1 - share) * values[k] + share * values[k + 1]
                around.append((between, bool(stable[k] and stable[k + 1])))
        return around

    def has(self, orbit: Orbit) -> bool:
        """Whether it comes through a motion, or one as large: by largest and smallest deflections."""
        if self.orbits[0].turns != orbit.turns:
            return False
        extents = np.array([point.extent for point in self.points])
        near = _SAME * orbit.scale[: orbit.start.size].max()
        return any(np.abs(one - orbit.extent).max() < near for one, _ in self.at(orbit.speed, extents))


def follow(problem: Periodic, guess: Orbit, row: FloatArray) -> Branch:
    """Follow a branch from a guess, whose row · unknowns stays, until it leaves the range of speeds.

    It begins in the direction in which that grows; LinAlgError if there is no solution at the start.
    """
    at = problem.solve(guess, row)
    orbits, length, ended = [at.solution], _LONGEST / 4, ""
    first, size = at.orbit, _SMALLEST * at.orbit.scale[: at.orbit.start.size]
    if problem.low == problem.high:
        ended = "one speed"
    else:
        tangent = _tangent(problem, at, row)
    while not ended:
        try:
            new, onwards, length = _step(problem, at, tangent, length)
            passed = _passed(problem, at, tangent, new, onwards, length)
        except np.linalg.LinAlgError as problem_met:
            length /= 2
            ended = f"stopped: {problem_met}" if length < _SHORTEST else ""
            continue
        if not first.turns and any((np.ptp(orbit.ends, axis=0) < size).all() for orbit in passed):
            orbits += [replace(orbit, bifurcation="") for orbit in passed]
            ended = "joins the motion that it comes from"
            break
        orbits += [*passed, new.solution]
        at, tangent = new, onwards
        away = _weights(problem, at) * (at.orbit.unknowns - first.unknowns)
        if np.isclose(at.orbit.speed, (problem.low, problem.high), rtol=1e-12).any():
            ended = "end of the range of speeds"
        elif len(orbits) > 20 and np.linalg.norm(away) < length:
            ended = "closed"
        elif met := wall_met(problem.system, at.orbit.deflections, 0.999):
            ended = f"stopped: {met}"
        elif len(orbits) >= _ORBITS:
            ended = f"stopped: {_ORBITS} points"
        length = min(_LONGEST, 1.5 * length)
    return Branch("synchronous" if first.turns else "limit cycle", tuple(orbits), ended)


def _weights(problem: Periodic, at: Linearised) -> FloatArray:
    """By which unknowns count for the length of a branch."""
    size = at.scale
    weights = np.asarray(1 / (size * np.sqrt(size.size - 2)))
    weights[-2:] = 0.0 if at.orbit.turns else 1 / size[-2], 1 / (problem.high - problem.low)
    return weights


def _tangent(problem: Periodic, at: Linearised, row: FloatArray) -> FloatArray:
    """Of length 1, in the direction in which row · unknowns grows."""
    change = at.change(row, 1.0, left=0.0)
    return np.asarray(change / np.linalg.norm(_weights(problem, at) * change))


def _step(
    problem: Periodic, at: Linearised, tangent: FloatArray, length: float
) -> tuple[Linearised, FloatArray, float]:
    """The next point, not beyond the range of speeds, its tangent, and how long the step was."""
    weights, y = _weights(problem, at), at.orbit.unknowns
    along = row = weights**2 * tangent
    ahead = y[-1] + length * tangent[-1]
    end = min(max(ahead, problem.low), problem.high)
    if end != ahead:
        length *= (end - y[-1]) / (ahead - y[-1])
        row = at.orbit.at_speed
    new = problem.solve(at.moved(tangent * length), row)
    onwards, way = _tangent(problem, new, along), new.orbit.unknowns - y
    if row is along and not problem.low < new.orbit.speed < problem.high:
        raise np.linalg.LinAlgError("the branch leaves the range of speeds")
    aside = np.linalg.norm(weights * (way - tangent * length))
    turn = (along @ onwards) / np.linalg.norm(weights * onwards)
    if length > _CORNER and (aside > 0.5 * length or turn < 0.9):
        raise np.linalg.LinAlgError("the branch turns too sharply")
    return new, onwards, float(along @ way)


def _passed(
    problem: Periodic,
    at: Linearised,
    tangent: FloatArray,
    new: Linearised,
    onwards: FloatArray,
    length: float,
) -> list[Orbit]:
    """The bifurcation between two points; LinAlgError where there are several and the step may be shorter."""
    few, many = sorted((at.solution.outside, new.solution.outside))
    slopes = tangent[-1], onwards[-1]
    fold = slopes[0] * slopes[1] < 0 and max(map(abs, slopes)) > _FLAT * (problem.high - problem.low)
    if not fold and many == few:
        return []

    row = _weights(problem, at) ** 2 * tangent

    def corrected(s: float) -> Linearised:
        return problem.solve(at.moved(tangent * s), row)

    def test(s: float) -> float:
        there = corrected(s)
        if fold:
            return float(_tangent(problem, there, row)[-1])
        return float(np.log(np.abs(there.solution.multipliers[few]) / UNITY))

    there = corrected(_root(test, 0.0, length))
    value = there.solution.multipliers[few]
    kind, frequency = BRANCH if value.real > 0 else DOUBLING, np.nan
    if fold:
        kind = FOLD
    elif abs(value.imag) >= 1e-6:
        places = np.ravel([problem.system.index(node) for node in problem.system.nodes])
        kind, frequency = TORUS, there.departing(value, places)
    if length > 1e-3 * _LONGEST and many - few > 1 + (kind == TORUS):
        raise np.linalg.LinAlgError("several bifurcations at once")
    return [replace(there.solution, bifurcation=kind, frequency=frequency)]


def _root(test: Callable[[float], float], first: float, last: float) -> float:
    """Where a test changes its sign; the end where it does so only by rounding."""
    from scipy.optimize import brentq

    if test(first) * test(last) > 0:
        return last
    return float(brentq(test, first, last, xtol=1e-9 * (last - first)))


def straight(system: MotionSystem, low: float, high: float) -> Branch | None:
    """The branch of a rotor at rest, or of one whose forces are linear; None where nothing holds it."""

    def motions(speeds: FloatArray) -> list[tuple[Orbit, ComplexArray]]:
        """Motions, and their eigenvalues, those that grow most first."""
        every = []
        for speed, rest, response in steady_linear(system, speeds):
            values = eigenvalues_at_rest(system, rest, speed)[0]
            values = values[np.argsort(-values.real, kind="stable")]
            period = 2 * np.pi / speed
            orbit = turning(speed, period, 1, rest, response)
            every.append((replace(orbit, multipliers=np.exp(period * values)), values))
        return every

    knots = system.knots[(system.knots > low) & (system.knots < high)]
    every = motions(np.union1d(np.linspace(low, high, _GRID), knots))
    if system.forced and len(every) > 1:  # at and beside speeds that are a frequency of free motion
        at = np.array([one.speed for one, _ in every])
        values = np.array([each[np.argsort(each.imag)] for _, each in every])
        away = values.imag - at[:, None]
        steps, modes = np.nonzero(away[:-1] * away[1:] <= 0)
        share = away[steps, modes] / (away[steps, modes] - away[steps + 1, modes])
        critical, damping = at[steps] + share * np.diff(at)[steps], np.abs(values[steps, modes].real)
        damped = damping > 1e-9 * critical  # of the others no amplitude is known there
        beside = (critical + damping * np.linspace(-3, 3, 13)[:, None])[:, damped]
        every += motions(np.unique(beside[(beside > low) & (beside < high)]))
        every.sort(key=lambda one: one[0].speed)
    if not every:
        return None
    orbits = [every[0][0]]

    def test(speed: float) -> float:
        return float(motions(np.array([speed]))[0][1][0].real)

    for (a, _), (b, _) in itertools.pairwise(every):
        if (a.outside == 0) != (b.outside == 0):
            ((there, values),) = motions(np.array([_root(test, a.speed, b.speed)]))
            frequency = abs(values[0].imag) or np.nan
            kind = BRANCH if np.isnan(frequency) else TORUS if system.forced else HOPF
            orbits.append(replace(there, bifurcation=kind, frequency=frequency))
        orbits.append(b)
    ended = "end of the range of speeds" if orbits[-1].speed == high else "stopped: it rests no more"
    return Branch("synchronous" if system.forced else "rest", tuple(orbits), ended)


def amplitudes(orbits: Sequence[Orbit], directions: FloatArray) -> FloatArray:
    """Half of what k sensors read from peak to peak, m, shape (orbits, k).

    Parameters
    ----------
    orbits
        Periodic motions.
    directions
        Unit vectors of what sensors read in the coordinates, shape (k, n).
    """
    sizes = []
    for orbit in orbits:
        read = orbit.readings(directions)
        size = np.ptp(read, axis=0) / 2
        sizes.append(np.where(size > 1e3 * ROUNDING * np.abs(read).max(axis=0), size, 0.0))
    return np.array(sizes).reshape(-1, len(directions))


def jumps(branches: Sequence[Branch], directions: FloatArray) -> list[tuple[float, FloatArray, FloatArray]]:
    """Where a stable motion ends at a fold: speed, rad/s, amplitudes there and where it jumps to, m, (k,).

    That is the stable motion at the same speed whose amplitudes are nearest.
    """
    jumps, along = [], [(branch, amplitudes(branch.points, directions)) for branch in branches]
    for orbits in (branch.orbits for branch in branches):
        for k, fold in enumerate(orbits):
            if fold.bifurcation == FOLD and any(one.stable for one in orbits[k - 1 : k + 2]):
                (size,) = amplitudes([fold], directions)
                others = [one for b, values in along for one, stable in b.at(fold.speed, values) if stable]
                far = [one for one in others if np.abs(one - size).max() > _SAME * size.max()]
                if far:
                    jumps.append((fold.speed, size, min(far, key=lambda one: np.abs(one - size).max())))
    return jumps
