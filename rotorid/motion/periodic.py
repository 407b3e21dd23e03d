"""Periodic motion of a rotor over speed: synchronous, of several revolutions, and self-excited.

**Collocation.** A period T is cut into N steps of h = T / N. In each the velocity is the polynomial through
its values at the s = 4 points c h of Radau IIA (order 7 at the ends of the steps), c_s = 1, and the
deflection its integral:

    Q_j = q_i + h Σ a_jl V_l,   M Σ (a⁻¹)_jl (V_l − v_i) / h + C V_j + K Q_j = forces(Q_j, V_j, φ_j, Ω).

Nothing is divided by M: nodes without mass that a film or damper holds are no special case, and what is stiff
in a film does not limit h. What makes more than about N / 4 cycles in a period is damped by the method: it
would not show that it is unstable. Newton's method eliminates the V of each step; what is left is the map of
the state (q, v) over one period, whose derivative Φ, the monodromy matrix, has the Floquet multipliers as its
eigenvalues. Unknowns are then the state at the beginning, the speed and, of motion with a period of its own,
the period. Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), IV.5; E. J.
Doedel, H. B. Keller, J. P. Kernévez, Int. J. Bifurcation Chaos 1 (1991) 745.

**Branches** are followed by arc length, past folds. A rotor at rest, and one whose forces are all linear,
need neither: the response is that of the equations about the equilibrium, with the multipliers e^{λT}.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fem import InternalDamping
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from rotorid.base.compiled import compiled
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.text import ROUNDING, listing, percent
from rotorid.motion.equilibrium import at_rest, eigenvalues_at_rest, equilibrium, whirl_at_rest
from rotorid.motion.run import run
from rotorid.motion.steady import steady_end, steady_linear
from rotorid.motion.system import MotionSystem, add_forces

_S, LEAST_STEPS, MOST_STEPS = 4, 32, 512
"""Radau's points in a step; steps in a revolution or cycle."""
_LONGEST, _SHORTEST, _CORNER = 0.04, 1e-7, 1e-4
"""Of a step along a branch, by the size of the motion and the range of speeds; shorter ones may turn sharply:
where a shaft meets its stop, the branch has a corner."""
_POINTS_OF_BRANCH, _GRID = 1500, 120
"""Points of a branch at most, and of one that is straight."""
_UNITY = 1.0 + 1e-9  # a multiplier up to this is not outside the unit circle: rounding
_ROUGH, _COARSE = 1e-4, 1e-3  # more of `Orbit.roughness` halves the steps in time, or is said
_SAME = 0.02  # of the motion: what differs by less is no other motion
_TURNS, _BLOCKS, _ASKED = 100, 8, 12
"""Revolutions of motion in time, how often so many more, and at how many speeds."""
KINDS = FOLD, DOUBLING, TORUS, HOPF, BRANCH = (
    "fold",
    "period doubling",
    "Neimark–Sacker",
    "Hopf",
    "branch point",
)


def _radau() -> tuple[FloatArray, FloatArray]:
    """Points c, shape (s,), and coefficients a, shape (s, s), of Radau IIA."""
    c = np.sort(np.real(np.polynomial.legendre.legroots([0.0] * (_S - 1) + [-1.0, 1.0]))) / 2 + 0.5
    c[-1] = 1.0
    powers = np.arange(1, _S + 1)
    a = (c[:, None] ** powers / powers) @ np.linalg.inv(c[:, None] ** (powers - 1))
    return c, a


POINTS, _A = _radau()
_INVERSE = np.linalg.inv(_A)
_HIGHEST = np.linalg.inv(np.polynomial.legendre.legvander(2 * POINTS - 1, _S - 1))[-1]


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion, or the guess of one.

    Attributes
    ----------
    speed, period
        Ω, rad/s, and T, s.
    start
        Deflections at the beginning, where the angle of rotation is 0, shape (n,).
    velocities
        At Radau's points of each step, shape (N, 4, n).
    """

    speed: float
    period: float
    start: FloatArray
    velocities: FloatArray

    @cached_property
    def state(self) -> FloatArray:
        """Deflections and velocities at the beginning, shape (2n,)."""
        return np.concatenate([self.start, self.velocities[-1, -1]])

    @cached_property
    def ends(self) -> FloatArray:
        """Deflections at the beginning of each step and at the end of the last, shape (N + 1, n)."""
        moved = np.einsum("l,ilk->ik", _A[-1], self.velocities).cumsum(axis=0)
        step = self.period / len(moved)
        return self.start + step * np.concatenate([np.zeros((1, moved.shape[1])), moved])

    @cached_property
    def deflections(self) -> FloatArray:
        """At Radau's points, shape (N, 4, n)."""
        moved = np.einsum("jl,ilk->ijk", _A, self.velocities)
        return np.asarray(self.ends[:-1, None, :] + self.period / len(moved) * moved)

    @cached_property
    def scale(self) -> FloatArray:
        """Sizes of the state, shape (2n,): half of what each coordinate moves, and of its velocity.

        At least a hundredth of its largest value, or all of that, where nothing moves more; and no coordinate
        counts as less than 1e-3 of the largest one.
        """
        q = self.deflections.reshape(-1, self.start.size)
        moved, largest = np.ptp(q, axis=0) / 2, np.abs(q).max(axis=0)
        size = np.maximum(moved, largest * (1e-2 if (moved > 1e-2 * largest).any() else 1.0))
        size = np.maximum(size, max(1e-3 * float(size.max()), 1e-9))
        return np.concatenate([size, size * 2 * np.pi / self.period])

    @cached_property
    def roughness(self) -> float:
        """What the highest power of the polynomials moves in one step, of the whole motion, at most.

        At the ends of the steps the motion is better by far, where the forces are smooth.
        """
        moved = np.abs(np.einsum("l,ilk->ik", _HIGHEST, self.velocities)) * self.period / len(self.velocities)
        return float((moved / self.scale[: self.start.size]).max())

    @property
    def extent(self) -> FloatArray:
        """Largest and smallest deflections, shape (2n,)."""
        return np.concatenate([self.deflections.max(axis=(0, 1)), self.deflections.min(axis=(0, 1))])

    def resampled(self, count: int) -> Orbit:
        """The same in so many steps."""
        N, v = len(self.velocities), self.velocities
        known = np.concatenate([np.roll(v[:, -1:], 1, axis=0), v], axis=1)
        at = (np.arange(count)[:, None] + POINTS) * (N / count)
        step = np.ceil(at - 1e-9).astype(int) - 1
        powers = np.vander((at - step).ravel(), _S + 1, increasing=True).reshape(count, _S, _S + 1)
        weights = powers @ np.linalg.inv(np.vander(np.append(0.0, POINTS), increasing=True))
        return replace(self, velocities=np.einsum("ijl,ijlk->ijk", weights, known[step]))

    def readings(self, directions: FloatArray) -> FloatArray:
        """What sensors read at 2048 times of a period, shape (2048, k), of directions (k, n)."""
        along = replace(self, start=directions @ self.start, velocities=self.velocities @ directions.T)
        return np.asarray(along.resampled(512).deflections.reshape(-1, len(directions)))


@dataclass(frozen=True, eq=False)
class Periodic:
    """What a periodic motion is sought of.

    Attributes
    ----------
    system
        What moves.
    turns
        Revolutions in one period; 0 for a period of its own, of a rotor without unbalance and bow.
    until
        When the search has to end, by `time.monotonic`.
    """

    system: MotionSystem
    turns: int
    until: float = np.inf

    @property
    def free(self) -> int:
        """How many unknowns there are beside the state: the speed, after the period if that is one."""
        return 1 if self.turns else 2

    def unknowns(self, orbit: Orbit) -> FloatArray:
        """State at the beginning, the period if it is an unknown, and the speed, shape (2 n + free,)."""
        return np.concatenate([orbit.state, [orbit.period, orbit.speed][-self.free :]])

    def at_speed(self, guess: Orbit, sign: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Conditions rows · unknowns = values that hold the speed, whose branch goes up or, sign −1, down."""
        y = self.unknowns(guess)
        rows = np.zeros((self.free, y.size))
        rows[-1, -1] = sign
        if not self.turns:
            rows[0, : guess.start.size] = guess.state[guess.start.size :]
        return rows, rows @ y

    def _equations(self, orbit: Orbit) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Equations of N steps for themselves: what is left, (N, 4 n), and its derivatives.

        Derivatives are by the velocities V, (N, 4 n, 4 n), and by q and v at the beginning, h and Ω,
        (N, 4 n, 2 n + 2).
        """
        system, V, speed = self.system, orbit.velocities, orbit.speed
        N, _, n = V.shape
        h, M = orbit.period / N, system.M
        v, Q = np.roll(V[:, -1], 1, axis=0), orbit.deflections
        C, K, C_speed, K_speed = system.around(speed)
        shape = (N * _S, n)
        F, F_speed = np.zeros(shape), np.zeros(shape)
        C_t, K_t = np.zeros((*shape, n)), np.zeros((*shape, n))
        _forces_along(*system.law_tables, Q.reshape(shape), V.reshape(shape), speed, F, K_t, C_t, F_speed)
        K_t, C_t = ((linear - part).reshape(N, _S, n, n) for linear, part in ((K, K_t), (C, C_t)))
        turned = 2 * np.pi * self.turns / N * (np.arange(N)[:, None] + POINTS)
        turning = np.exp(1j * turned)[..., None]
        driven = (system.unbalance * speed**2 + system.bow) * turning
        inert = (np.einsum("jl,ilk->ijk", _INVERSE, V) - _INVERSE.sum(axis=1)[:, None] * v[:, None]) @ M.T / h
        R = inert + V @ C.T + Q @ K.T - F.reshape(V.shape) - system.weight - driven.real
        J = np.einsum("jl,kp->jklp", _INVERSE / h, M)[None] + h * np.einsum("jl,ijkp->ijklp", _A, K_t)
        for j in range(_S):
            J[:, j, :, j] += C_t[:, j]
        moved = np.einsum("jl,ilk->ijk", _A, V)
        by_h = -inert / h + np.einsum("ijkp,ijp->ijk", K_t, moved)
        by_speed = V @ C_speed.T + Q @ K_speed.T - F_speed.reshape(V.shape)
        by_speed -= (2 * speed * system.unbalance * turning).real
        by_v = np.broadcast_to(np.einsum("j,kp->jkp", -_INVERSE.sum(axis=1) / h, M), K_t.shape)
        others = np.concatenate([K_t, by_v, by_h[..., None], by_speed[..., None]], axis=-1)
        return R.reshape(N, -1), J.reshape(N, _S * n, _S * n), others.reshape(N, _S * n, -1)

    def linearised(self, orbit: Orbit) -> Linearised:
        """Newton's equations at an orbit or its guess, all but the state at the beginning eliminated.

        Raises
        ------
        numpy.linalg.LinAlgError
            Where they have no solution, or a force none (a wall), or the limit of time has come.
        """
        if time.monotonic() > self.until:
            raise np.linalg.LinAlgError("time is up")
        V, n = orbit.velocities, orbit.start.size
        N = len(V)
        h = orbit.period / N
        R, J, others = self._equations(orbit)
        by_h, by_speed = others[..., -2:-1], others[..., -1:]
        moved = np.einsum("l,ilk->ik", _A[-1], V)[..., None]
        if self.turns:  # the period goes with the speed
            by_free, h_free = by_speed - by_h * (h / orbit.speed), np.array([-h / orbit.speed])
        else:
            by_free, h_free = np.concatenate([by_h / N, by_speed], axis=-1), np.array([1 / N, 0.0])
        right = np.concatenate([others[..., :-2], R[..., None], by_free], axis=-1)
        if not np.isfinite(right).all():
            raise np.linalg.LinAlgError(wall_met(self.system, orbit.deflections) or "the forces overflow")
        S = -np.linalg.solve(J, right).reshape(N, _S, n, -1)
        P = np.concatenate([h * np.einsum("l,ilkm->ikm", _A[-1], S), S[:, -1]], axis=1)
        P[:, :n, :n] += np.eye(n)
        P[:, :n, 2 * n + 1 :] += moved * h_free
        G = np.zeros((N + 1, 2 * n, 2 * n + 1 + self.free))
        G[0, :, : 2 * n] = np.eye(2 * n)
        for i in range(N):
            G[i + 1] = P[i, :, : 2 * n] @ G[i]
            G[i + 1, :, 2 * n :] += P[i, :, 2 * n :]
        return Linearised(orbit, self.free, S, G)

    def newton(self, orbit: Orbit, rows: FloatArray, values: FloatArray) -> tuple[Linearised, int]:
        """The orbit with rows · unknowns = values, and the iterations; LinAlgError without convergence."""
        before = np.inf
        for k in range(14):
            at = self.linearised(orbit)
            orbit, change = at.corrected(rows, values - rows @ self.unknowns(orbit))
            if change < 1e-9 or 0.1 * before < change < 1e-6:  # the latter by rounding
                return self.linearised(orbit), k + 1
            before = change
            if not change < 1e3 or not orbit.period > 0:
                break
        raise np.linalg.LinAlgError("Newton's method does not converge")

    def solve(self, guess: Orbit, rows: FloatArray, values: FloatArray) -> tuple[Linearised, int]:
        """The same with steps in time that are short enough, and longer again where they may be."""
        steps = len(guess.velocities)
        if guess.roughness < _ROUGH / 100 and steps >= 2 * LEAST_STEPS:
            guess = guess.resampled(steps // 2)
        at, iterations = self.newton(guess, rows, values)
        while at.orbit.roughness > _ROUGH and 2 * len(at.orbit.velocities) <= MOST_STEPS:
            at, _ = self.newton(at.orbit.resampled(2 * len(at.orbit.velocities)), rows, values)
        return at, iterations


@dataclass(frozen=True, eq=False)
class Linearised:
    """Newton's equations at an orbit.

    Attributes
    ----------
    orbit
        Where.
    free
        How many unknowns there are beside the state.
    steps
        Change of the velocities by the state at the beginning of their step, what is left of the equations,
        and the free unknowns, shape (N, 4, n, 2 n + 1 + free).
    states
        The same of the states at the ends, by the state at the beginning, shape (N + 1, 2 n, 2 n + 1 + free).
    """

    orbit: Orbit
    free: int
    steps: FloatArray
    states: FloatArray

    @property
    def multipliers(self) -> ComplexArray:
        """Floquet multipliers, the largest first, shape (2 n,)."""
        return self.eigen[0]

    @cached_property
    def eigen(self) -> tuple[ComplexArray, ComplexArray]:
        """Multipliers, the largest first, and their vectors, (2 n, 2 n), of the state after a period."""
        scale = self.orbit.scale
        monodromy = self.states[-1][:, : scale.size]
        values, vectors = np.linalg.eig(monodromy * scale / scale[:, None])
        order = np.argsort(-np.abs(values), kind="stable")
        return values[order].astype(complex), (vectors * scale[:, None])[:, order].astype(complex)

    @property
    def scale(self) -> FloatArray:
        """Sizes of the unknowns."""
        free = [self.orbit.period, self.orbit.speed][-self.free :]
        return np.concatenate([self.orbit.scale, np.abs(free)])

    def change(self, rows: FloatArray, values: FloatArray, left: float = 1.0) -> FloatArray:
        """Of the unknowns, so that rows · change = values; `left` is 0 for a tangent, shape (2 n + free,)."""
        n2, orbit, scale = 2 * self.orbit.start.size, self.orbit, self.scale
        end = self.states[-1]
        matrix = np.concatenate([-np.delete(end, n2, axis=1), rows])
        matrix[:n2, :n2] += np.eye(n2)
        right = np.concatenate([end[:, n2] * left, values])
        right[: n2 // 2] += left * (orbit.ends[-1] - orbit.start)
        size = np.concatenate([scale[:n2], np.abs(rows * scale).max(axis=1)])
        return np.linalg.solve(matrix * scale / size[:, None], right / size) * scale

    def corrected(self, rows: FloatArray, values: FloatArray) -> tuple[Orbit, float]:
        """One step of Newton's method: the next guess, and how much of the motion it changes."""
        change = self.change(rows, values)
        new = self.moved(change, 1.0)
        size = self.orbit.scale[self.orbit.start.size :]
        moved = np.abs(new.velocities - self.orbit.velocities) / size
        return new, float(max(moved.max(), (np.abs(change) / self.scale).max()))

    def moved(self, change: FloatArray, left: float = 0.0) -> Orbit:
        """The orbit with its unknowns changed, along the solution."""
        orbit, n = self.orbit, self.orbit.start.size
        rest = np.concatenate([[left], change[2 * n :]])
        states = self.states[:-1] @ np.concatenate([change[: 2 * n], rest])
        by = np.concatenate([states, np.tile(rest, (len(states), 1))], axis=1)
        velocities = orbit.velocities + np.einsum("ijkm,im->ijk", self.steps, by)
        speed = float(orbit.speed + change[-1])
        period = orbit.period + change[-2] if self.free == 2 else orbit.period * orbit.speed / speed
        return Orbit(speed, float(period), orbit.start + change[:n], velocities)

    def departing(self, which: int, places: IndexArray) -> float:
        """Frequency, rad/s, of the motion that belongs to a multiplier.

        The multiplier gives it but for its sign and multiples of 2π / T: these are of the largest part of the
        disturbance at some coordinates, its eigenvector followed through the period T.
        """
        direction = self.eigen[1][:, which]
        states = (self.states[..., : direction.size] @ direction)[:, places]
        N = len(states) - 1
        phase = float(np.angle(np.vdot(states[0], states[-1])))
        parts = np.fft.fft(states[:-1] * np.exp(-1j * phase * np.arange(N) / N)[:, None], axis=0)
        k = np.fft.fftfreq(N, 1 / N)[np.linalg.norm(parts, axis=1).argmax()]
        return float(abs(phase + 2 * np.pi * k) / self.orbit.period)


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

    `frequency` of a motion that begins there, rad/s; NaN for none.
    """

    kind: str
    point: Point
    after: int
    frequency: float = np.nan


@dataclass(frozen=True, eq=False)
class Branch:
    """Periodic motions one after the other.

    Attributes
    ----------
    kind
        "synchronous", "limit cycle", or "rest".
    turns
        Revolutions in a period, 1, or 0 for a period of its own.
    points, bifurcations
        Along the branch.
    ended
        Why it is no longer.
    straight
        Whether it is that of linear equations, which no Newton's method found.
    """

    kind: str
    turns: int
    points: tuple[Point, ...]
    bifurcations: tuple[Bifurcation, ...]
    ended: str
    straight: bool = False

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

    def has(self, turns: int, orbit: Orbit) -> bool:
        """Whether it comes through a motion, or one as large: by largest and smallest deflections."""
        if self.turns != turns:
            return False
        extents = np.array([point.orbit.extent for point in self.points])
        near = _SAME * orbit.scale[: orbit.start.size].max()
        return any(np.abs(one - orbit.extent).max() < near for one, _ in self.at(orbit.speed, extents))


@dataclass(frozen=True, eq=False)
class _Walk:
    """What does not change along a branch."""

    problem: Periodic
    low: float
    high: float
    kind: str

    def follow(self, guess: Orbit, rows: FloatArray, values: FloatArray) -> Branch:
        """Follow a branch from where rows · unknowns = values until it leaves the range of speeds.

        It leaves in the direction in which the last condition's value grows; LinAlgError if there is no
        solution at the start.
        """
        at, _ = self.problem.solve(guess, rows, values)
        points, passed, ended, length = [self.point(at)], list[Bifurcation](), "", _LONGEST / 4
        origin, first = self.problem.unknowns(at.orbit), at.orbit.scale
        if self.low == self.high:
            ended = "one speed"
        else:
            tangent = self.onwards(at, rows[-1])
        while not ended:
            try:
                new, new_tangent, iterations, length = self.step(at, tangent, length)
                more = self.passed(at, tangent, new, new_tangent, length, len(points))
            except np.linalg.LinAlgError as problem_met:
                length /= 2
                ended = f"stopped: {problem_met}" if length < _SHORTEST else ""
                continue
            if joined := [one.point for one in more if self.joins(one.point.orbit, first)]:
                points += joined
                ended = "joins the motion that it comes from"
                break
            passed += more
            points.append(self.point(new))
            at, tangent = new, new_tangent
            away = self.weights(at) * (self.problem.unknowns(at.orbit) - origin)
            if not self.low < at.orbit.speed < self.high:
                ended = "end of the range of speeds"
            elif len(points) > 20 and np.linalg.norm(away) < length:
                ended = "closed"
            elif met := wall_met(self.problem.system, at.orbit.deflections, 0.999):
                ended = f"stopped: {met}"
            elif len(points) >= _POINTS_OF_BRANCH:
                ended = f"stopped: {_POINTS_OF_BRANCH} points"
            length = min(_LONGEST, length * (1.5 if iterations < 5 else 1.0 if iterations < 8 else 0.6))
        return Branch(self.kind, self.problem.turns, tuple(points), tuple(passed), ended)

    def weights(self, at: Linearised) -> FloatArray:
        """By which unknowns count for the length of a branch."""
        size = at.scale
        size[: -at.free] *= np.sqrt(size.size - at.free)
        size[-1] = self.high - self.low
        return 1 / size

    def with_phase(self, at: Linearised, along: FloatArray) -> FloatArray:
        """A condition, after that of the phase, if there is one: the motion is not moved along itself."""
        if self.problem.turns:
            return along[None]
        n, phase = at.orbit.start.size, np.zeros(along.size)
        phase[:n] = at.orbit.state[n:] / at.orbit.scale[:n] ** 2
        return np.array([phase, along])

    def conditions(self, at: Linearised, tangent: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
        """Of the solution at a length along the tangent."""
        rows = self.with_phase(at, self.weights(at) ** 2 * tangent)
        values = rows @ self.problem.unknowns(at.orbit)
        values[-1] += length
        return rows, values

    def onwards(self, at: Linearised, along: FloatArray) -> FloatArray:
        """The tangent, in the direction of a row."""
        rows = self.with_phase(at, along)
        change = at.change(rows, np.eye(len(rows))[-1], left=0.0)
        return change / np.linalg.norm(self.weights(at) * change)

    def step(
        self, at: Linearised, tangent: FloatArray, length: float
    ) -> tuple[Linearised, FloatArray, int, float]:
        """The next point, its tangent, iterations, and how long the step was."""
        rows, values = self.conditions(at, tangent, length)
        new, iterations = self.problem.solve(at.moved(tangent * length), rows, values)
        onwards = self.onwards(new, rows[-1])
        weights, y = self.weights(at), self.problem.unknowns(at.orbit)
        aside = weights * (self.problem.unknowns(new.orbit) - y - tangent * length)
        turn = (weights * tangent) @ (weights * onwards) / np.linalg.norm(weights * onwards)
        if length > _CORNER and (np.linalg.norm(aside) > 0.5 * length or turn < 0.9):
            raise np.linalg.LinAlgError("the branch turns too sharply")
        end = min(max(new.orbit.speed, self.low), self.high)
        if end != new.orbit.speed:
            last = rows.copy()
            last[-1] = np.eye(tangent.size)[-1]
            values = last @ y
            values[-1] = end
            new, _ = self.problem.solve(new.orbit, last, values)
            onwards = self.onwards(new, rows[-1])
            length = float(rows[-1] @ (self.problem.unknowns(new.orbit) - y))
        return new, onwards, iterations, length

    def joins(self, orbit: Orbit, first: FloatArray) -> bool:
        """Whether a limit cycle has come to rest; `first` is the size of the first one."""
        moved = np.ptp(orbit.ends, axis=0)
        return not self.problem.turns and bool((moved < 0.1 * first[: moved.size]).all())

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
        few, many = sorted((self.point(at).outside, self.point(new).outside))
        fold = tangent[-1] * onwards[-1] < 0
        long = length > 1e-3 * _LONGEST
        if long and many - few > (1 if fold else 2):
            raise np.linalg.LinAlgError("several bifurcations at once")
        if not fold and many == few:
            return []

        def corrected(s: float) -> tuple[Linearised, FloatArray]:
            rows, values = self.conditions(at, tangent, s)
            return self.problem.solve(at.moved(tangent * s), rows, values)[0], rows[-1]

        def test(s: float) -> float:
            there, along = corrected(s)
            if fold:
                return float(self.onwards(there, along)[-1])
            return float(np.log(np.abs(self.point(there).multipliers[few]) / _UNITY))

        there = corrected(_root(test, 0.0, length))[0]
        point = self.point(there)
        if fold:
            return [Bifurcation(FOLD, point, after)]
        value = point.multipliers[few]
        if abs(value.imag) >= 1e-6:
            which = int(np.abs(there.multipliers - value).argmin())
            places = np.ravel([self.problem.system.index(node) for node in self.problem.system.nodes])
            return [Bifurcation(TORUS, point, after, there.departing(which, places))]
        if long and many - few == 2:
            raise np.linalg.LinAlgError("two bifurcations at once")
        return [Bifurcation(BRANCH if value.real > 0 else DOUBLING, point, after)]


def _joined(up: Branch, down: Branch) -> Branch:
    """One branch of the two that begin at the same motion, from the end of the second on."""
    n = len(down.points)
    before = [replace(one, after=n - one.after) for one in reversed(down.bifurcations)]
    after = [replace(one, after=one.after + n - 1) for one in up.bifurcations]
    ended = down.ended if down.ended.startswith("stopped") else up.ended
    return replace(
        up,
        points=(*reversed(down.points), *up.points[1:]),
        bifurcations=(*before, *after),
        ended=ended,
    )


def _root(test: Callable[[float], float], first: float, last: float) -> float:
    """Where a test changes its sign; the end where it does so only by rounding."""
    from scipy.optimize import brentq

    if test(first) * test(last) > 0:
        return last
    return float(brentq(test, first, last, xtol=1e-9 * (last - first)))


def wall_met(system: MotionSystem, q: FloatArray, near: float = 1.0) -> str:
    """The node that is nearer to its wall than 1 − `near` of its clearance, in words; q (…, n)."""
    if not system.forces:
        return ""
    share = (np.abs(system.at_forces(q)) / system.walls).reshape(-1, len(system.forces)).max(axis=0)
    return f"node {system.forces[int(share.argmax())].node} is at its wall" if (share >= near).any() else ""


@compiled
def _forces_along(  # noqa: PLR0913  what is compiled takes no objects
    codes: IndexArray,
    values: FloatArray,
    places: IndexArray,
    Q: FloatArray,
    V: FloatArray,
    speed: float,
    F: FloatArray,
    F_q: FloatArray,
    F_v: FloatArray,
    F_speed: FloatArray,
) -> None:
    """`add_forces` at many points, one a row."""
    for i in range(len(Q)):
        add_forces(codes, values, places, Q[i], V[i], speed, F[i], F_q[i], F_v[i], F_speed[i])


def _turning(speed: float, period: float, rest: FloatArray, response: ComplexArray) -> Orbit:
    """The motion rest + Re(response e^{2πit/T})."""
    turned = np.exp(2j * np.pi * (np.arange(LEAST_STEPS)[:, None] + POINTS) / LEAST_STEPS)[..., None]
    velocities = (2j * np.pi / period * turned * response).real
    return Orbit(speed, period, rest + response.real, velocities)


def straight(system: MotionSystem, low: float, high: float) -> Branch | None:
    """The branch of a rotor at rest, or of one whose forces are linear; None where nothing holds it."""

    def points(speeds: FloatArray) -> list[tuple[Point, ComplexArray]]:
        """Motions, and their eigenvalues, those that grow most first."""
        every = []
        for speed, rest, response in zip(*steady_linear(system, speeds), strict=True):
            values = eigenvalues_at_rest(system, rest, speed)[0]
            values = values[np.isfinite(values)]
            values = values[np.argsort(-values.real, kind="stable")]
            period = 2 * np.pi / speed
            every.append((Point(_turning(speed, period, rest, response), np.exp(period * values)), values))
        return every

    knots = system.knots[(system.knots > low) & (system.knots < high)]
    every = points(np.union1d(np.linspace(low, high, _GRID), knots))
    if system.forced and len(every) > 1:  # at and beside speeds that are a frequency of free motion
        at = np.array([one.orbit.speed for one, _ in every])
        values = np.array([each[np.argsort(each.imag)] for _, each in every])
        away = values.imag - at[:, None]
        steps, modes = np.nonzero(away[:-1] * away[1:] <= 0)
        share = away[steps, modes] / (away[steps, modes] - away[steps + 1, modes])
        critical, damping = at[steps] + share * np.diff(at)[steps], np.abs(values[steps, modes].real)
        damped = damping > 1e-9 * critical  # of the others no amplitude is known there
        beside = (critical + damping * np.linspace(-3, 3, 13)[:, None])[:, damped]
        every += points(np.unique(beside[(beside > low) & (beside < high)]))
        every.sort(key=lambda one: one[0].orbit.speed)
    if not every:
        return None
    passed = []
    for after, ((a, _), (b, _)) in enumerate(itertools.pairwise(every), start=1):
        k, many = sorted((a.outside, b.outside))
        while k < many:

            def test(speed: float, k: int = k) -> float:
                return float(np.log(np.abs(points(np.array([speed]))[0][0].multipliers[k]) / _UNITY))

            ((there, values),) = points(np.array([_root(test, a.orbit.speed, b.orbit.speed)]))
            whirls = abs(values[k].imag) > 1e-6 * there.orbit.speed
            kind = BRANCH if not whirls else TORUS if system.forced else HOPF
            passed.append(Bifurcation(kind, there, after, abs(values[k].imag) if whirls else np.nan))
            k += 2 if whirls else 1
    last = every[-1][0].orbit.speed
    ended = "end of the range of speeds" if last == high else "stopped: it rests no more"
    kind = "synchronous" if system.forced else "rest"
    return Branch(kind, 1, tuple(one for one, _ in every), tuple(passed), ended, straight=True)


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
    search = _Search(system, low, high, limit_cycle, time.monotonic() + max_seconds)
    linear = all(isinstance(force, InternalDamping) for force in system.forces)
    if linear or not system.forced:
        search.branches.extend(filter(None, [straight(system, low, high)]))
    else:
        search.synchronous()
    if not linear:
        if limit_cycle:
            search.cycles()
        search.complete()
    if search.late and not search.branches:
        raise ValueError(f"no periodic motion was found in {max_seconds:.6g} s: raise --max-seconds")
    if not search.branches:
        equilibrium(system, low)  # its message is the better one
        raise ValueError(f"no periodic motion was found to begin with, {listing(search.warnings, 'and')}")
    warnings = [] if system.forced else ["there is no unbalance and no bow: what is synchronous is rest"]
    warnings += search.warnings + search.doubts()
    if search.late:
        warnings.insert(0, f"the search was stopped after {max_seconds:.6g} s (--max-seconds)")
    tried = "All forces are linear: there is one motion at each speed." if linear else search.tried
    return PeriodicMotion(system, low, high, tuple(search.branches), tuple(warnings), tried)


@dataclass(frozen=True, eq=False)
class _Search:
    """The branches that are known by now, warnings, and where motion in time was asked."""

    system: MotionSystem
    low: float
    high: float
    limit_cycle: bool
    until: float
    branches: list[Branch] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    in_time_at: list[float] = field(default_factory=list)

    @property
    def late(self) -> bool:
        """Whether the limit of time has come."""
        return time.monotonic() > self.until

    @property
    def tried(self) -> str:
        """Where motions were sought, in sentences."""
        ends = dict.fromkeys((self.low, self.high))
        at, in_time = (
            f"{listing([f'{speed * RPM:.6g}' for speed in speeds], 'and')} rpm"
            for speeds in (ends, self.in_time_at)
        )
        start = "from rest and from large whirls" if self.system.forced else "with a large whirl"
        words = f"Motions were followed from rest at {at}"
        words += f"; motion in time was begun {start} at {in_time}" if self.in_time_at else ""
        return f"{words}. Other motions were not sought."

    def doubts(self) -> list[str]:
        """What was asked for and not found, and what may be wrong with the branches."""
        remarks = []
        if self.limit_cycle and all(branch.turns for branch in self.branches):
            remarks.append("no limit cycle found: no Hopf point, and motion in time comes to none")
        for branch in self.branches:
            if branch.ended.startswith("stopped"):
                remarks.append(f"the {branch.kind} branch {branch.ended} at {rpm_text(branch.speeds[-1])}")
            undamped = any(abs(point.largest - 1) < _UNITY - 1 for point in branch.points)
            if branch.straight and self.system.forced and undamped:
                remarks.append("nothing damps a mode: at its critical speed the motion has no bound")
            worst = 0.0 if branch.straight else max(point.orbit.roughness for point in branch.points)
            if worst > _COARSE:
                remarks.append(
                    f"the {branch.kind} branch has too few steps in time: {percent(worst)} % of it may be "
                    "wrong"
                )
        return remarks

    def follow(self, turns: int, guess: Orbit, rows: FloatArray, values: FloatArray) -> bool:
        """Whether a branch begins there; it is kept."""
        kind = "synchronous" if turns else "limit cycle"
        try:
            walk = _Walk(Periodic(self.system, turns, self.until), self.low, self.high, kind)
            self.branches.append(walk.follow(guess, rows, values))
        except np.linalg.LinAlgError:
            return False
        return True

    def known(self, turns: int, orbit: Orbit) -> bool:
        """Whether a branch comes through a motion."""
        return any(branch.has(turns, orbit) for branch in self.branches)

    def synchronous(self) -> None:
        """From rest at the lowest speed upwards and, if that is another branch, at the highest downwards."""
        problem = Periodic(self.system, 1, self.until)
        for speed, sign in dict.fromkeys(((self.low, 1.0), (self.high, -1.0))):
            _, rests, responses = steady_linear(self.system, [speed])
            still = np.zeros((1, self.system.size))
            rest, response = (np.vstack((part, still))[0] for part in (rests, responses))
            try:
                guess = _turning(speed, 2 * np.pi / speed, rest, response)
                orbit = problem.solve(guess, *problem.at_speed(guess))[0].orbit
            except np.linalg.LinAlgError as met:
                self.warnings.append(f"at {rpm_text(speed)} no periodic motion is found from rest: {met}")
                continue
            if not self.known(1, orbit):
                self.follow(1, orbit, *problem.at_speed(orbit, sign))

    def cycles(self) -> None:
        """Limit cycles that begin at the Hopf points of rest."""
        problem = Periodic(self.system, 0, self.until)
        for hopf in [b for branch in self.branches for b in branch.bifurcations if b.kind == HOPF]:
            orbit, n = hopf.point.orbit, self.system.size
            whirl, shape = whirl_at_rest(self.system, orbit.start, orbit.speed)
            guess = _turning(orbit.speed, 2 * np.pi / whirl, orbit.start, 0.01 * shape)
            rows = np.zeros((2, 2 * n + 2))
            rows[0, :n], rows[1, :n] = shape.imag, shape.real
            values = rows[:, :n] @ guess.start
            try:
                first = problem.solve(guess, rows, values)[0].orbit
            except np.linalg.LinAlgError:
                continue
            if not self.known(0, first):
                self.follow(0, guess, rows, values)

    def complete(self) -> None:
        """Follow what motion in time comes to and no branch shows; what is not followed, in words."""
        remarks: dict[str, dict[str, None]] = {}
        for speed in self._asked():
            self.in_time_at.append(speed)
            for q, v in self.starts(speed):
                try:
                    end = self.reached(speed, q, v)
                except ValueError as problem_met:
                    end = f"is not known: {problem_met}"
                if self.late:
                    self.in_time_at.remove(speed)
                    return
                if isinstance(end, Orbit):
                    end = self._kept(speed, end)
                if end:
                    remarks.setdefault(end, {})[f"{speed * RPM:.6g}"] = None
        self.warnings.extend(
            f"motion in time {end}, at {listing(at, 'and')} rpm" for end, at in remarks.items()
        )

    def _kept(self, speed: float, end: Orbit) -> str:
        """Follow a motion that is not known; what is not followed, in words."""
        turns = round(end.period * speed / (2 * np.pi)) if self.system.forced else 0
        if self.known(turns, end):
            return ""
        if turns > 1:
            return f"comes again after {turns} revolutions only"
        if not turns and not self.limit_cycle:
            return "comes to a whirl with a period of its own (--limit-cycle)"
        problem = Periodic(self.system, turns, self.until)
        begun = len(self.branches)
        for sign, last in ((1.0, self.high), (-1.0, self.low)):
            closed = any(branch.ended == "closed" for branch in self.branches[begun:])
            if (speed != last or self.low == last) and not closed:
                self.follow(turns, end, *problem.at_speed(end, sign))
        parts = self.branches[begun:]
        if len(parts) == 2:
            self.branches[begun:] = [_joined(*parts)]
        return "" if parts else "comes to a periodic motion that Newton's method does not find again"

    def _asked(self) -> list[float]:
        """Speeds at which motion in time is asked: three, and in the middle of where no branch is stable."""
        edges, asked = {self.low, self.high}, [self.low, (self.low + self.high) / 2, self.high]
        for branch in self.branches:
            edges |= {*branch.speeds[[0, -1]], *(b.point.orbit.speed for b in branch.bifurcations)}
        for a, b in itertools.pairwise(sorted(edges)):
            ways = (way for one in self.branches for way in one.at((a + b) / 2, one.speeds[:, None]))
            if b - a > 1e-3 * (self.high - self.low) and not any(stable for _, stable in ways):
                asked.append((a + b) / 2)
        return sorted({*asked})[:_ASKED]

    def starts(self, speed: float) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Deflections and velocities where motion in time begins: rest, and large whirls."""
        try:
            rest = at_rest(self.system, speed)
        except ValueError:
            rest = np.zeros(self.system.size)
        still = np.zeros(self.system.size)
        if not self.system.forced:
            yield rest + 0.5 * whirl_at_rest(self.system, rest, speed)[1].real, still
            return
        yield rest, still
        response = steady_linear(self.system, [speed])[2]
        if not response.any():
            return
        load = speed**2 * self.system.unbalance + self.system.bow
        shape = response[0] * np.exp(1j * np.angle(np.vdot(response[0], load)))  # in phase with the load
        room = self.system.walls - np.abs(self.system.at_forces(rest))
        moved = np.hypot(*(np.abs(self.system.at_forces(part)) for part in (shape.real, shape.imag)))
        size = 0.9 * float((np.sqrt(2) * room / np.maximum(moved, 1e-300)).min(initial=np.inf))
        for lag in (0.0, 0.5 * np.pi):
            large = (size if np.isfinite(size) else 5.0) * shape * np.exp(-1j * lag)
            yield rest + large.real, -speed * large.imag

    def reached(self, speed: float, q: FloatArray, v: FloatArray) -> Orbit | str:
        """What motion in time comes to: one period of it, what else in words, or "" for rest."""
        forced = self.system.forced
        sizes, turn, period = list[float](), 2 * np.pi / speed, 0.0
        nothing = f"comes to no periodic motion in {_TURNS * _BLOCKS} revolutions"
        for _ in range(_BLOCKS):
            if self.late:
                return nothing
            motion = run(self.system, (speed, speed), _TURNS * turn, (q, v))
            if motion.stopped:
                return f"from rest ends: {motion.stopped.split(' after ')[0]}"
            q, v, end = motion.q, motion.v, steady_end(motion)
            if end is None:
                return nothing
            sizes.append(float(end.amplitude.max()))
            if not forced and (end.at_rest or sizes[-1] < 1e-4 * sizes[0]):
                return ""
            if np.isfinite(end.period) and (found := repeating(self.system, speed, end.period, q, v)):
                return found.orbit
            period = turn if forced else 2 * np.pi / abs(end.frequency)
        if not forced and sizes[-1] < 0.95 * sizes[(len(sizes) - 1) // 2]:
            return ""
        again = repeating(self.system, speed, period, q, v)
        return again.orbit if again and (np.abs(again.multipliers) < 1).all() else nothing


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
    turns = round(period * speed / (2 * np.pi)) if system.forced else 0
    period = 2 * np.pi * turns / speed if turns else period
    problem, steps, first = Periodic(system, turns), LEAST_STEPS * max(turns, 1), q
    velocities = np.empty((steps * _S, q.size))
    times = (np.arange(steps)[:, None] + POINTS).ravel() * (period / steps)
    for k, (begin, end) in enumerate(itertools.pairwise([0.0, *times])):
        part = run(system, (speed, speed), end - begin, (q, v), rate=1 / (end - begin), angle=speed * begin)
        q, v = part.q, part.v
        velocities[k] = v
    guess = Orbit(speed, period, first, velocities.reshape(steps, _S, -1))
    try:
        at, _ = problem.newton(guess, *problem.at_speed(guess))
    except np.linalg.LinAlgError:
        return None
    away = np.abs(at.orbit.ends - guess.ends).max(axis=0) / at.orbit.scale[: q.size]
    return at if away.max() < 0.3 else None


@dataclass(frozen=True, eq=False)
class Readings:
    """Periodic motion as sensors read it.

    Attributes
    ----------
    motion
        The branches.
    labels
        Names of the k sensors.
    directions
        Unit vectors of what they read in the coordinates, shape (k, n).
    """

    motion: PeriodicMotion
    labels: tuple[str, ...]
    directions: FloatArray

    def amplitudes(self, points: list[Point]) -> FloatArray:
        """Half of what each sensor reads from peak to peak, m, shape (points, k)."""
        sizes = []
        for point in points:
            read = point.orbit.readings(self.directions)
            size = np.ptp(read, axis=0) / 2
            sizes.append(np.where(size > 1e3 * ROUNDING * np.abs(read).max(axis=0), size, 0.0))
        return np.array(sizes).reshape(-1, len(self.labels))

    @cached_property
    def along(self) -> tuple[FloatArray, ...]:
        """Amplitudes at the points of each branch, m, shape (points, k)."""
        return tuple(self.amplitudes([*branch.points]) for branch in self.motion.branches)

    @cached_property
    def at(self) -> tuple[FloatArray, ...]:
        """Amplitudes at the bifurcations of each branch, m, shape (bifurcations, k)."""
        return tuple(self.amplitudes([b.point for b in each.bifurcations]) for each in self.motion.branches)

    @cached_property
    def jumps(self) -> tuple[tuple[float, FloatArray, FloatArray], ...]:
        """Where a stable motion ends at a fold: speed, rad/s, amplitudes there and where it jumps to, m.

        That is the stable motion at the same speed whose amplitudes are nearest.
        """
        jumps = []
        for branch, sizes in zip(self.motion.branches, self.at, strict=True):
            for fold, size in zip(branch.bifurcations, sizes, strict=True):
                if fold.kind != FOLD or not branch.stable[fold.after - 1 : fold.after + 1].any():
                    continue
                speed = fold.point.orbit.speed
                there = zip(self.motion.branches, self.along, strict=True)
                others = [one for b, values in there for one, stable in b.at(speed, values) if stable]
                far = [one for one in others if np.abs(one - size).max() > 0.02 * size.max()]
                if far:
                    jumps.append((speed, size, min(far, key=lambda one: np.abs(one - size).max())))
        return tuple(jumps)
