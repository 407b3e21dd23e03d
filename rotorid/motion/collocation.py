"""Periodic motion at one speed, by collocation in time and Newton's method.

A period T is cut into N steps of h = T / N. In each the velocity is the polynomial through its values at the
s = 4 points c h of Radau IIA (order 7 at the ends of the steps), c_s = 1, and the deflection its integral:

    Q_j = q_i + h Σ a_jl V_l,   M Σ (a⁻¹)_jl (V_l − v_i) / h + C V_j + K Q_j = forces(Q_j, V_j, φ_j, Ω).

Nothing is divided by M: nodes without mass that a film or damper holds are no special case, and what is stiff
in a film does not limit h. What makes more than about N / 4 cycles in a period is damped by the method: it
would not show that it is unstable. Newton's method eliminates the V of each step; what is left is the map of
the state (q, v) over one period, whose derivative Φ, the monodromy matrix, has the Floquet multipliers as its
eigenvalues.

The unknowns are the state at the beginning, T and Ω, 2 n + 2 for the 2 n conditions that the state comes
again. One more is that T goes with 1 / Ω, or, of a motion with a period of its own, that it is not moved
along itself; the last, row · unknowns, is what the caller wants to stay as it is in the guess: a speed, a
size, a length along a branch.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), IV.5; E. J. Doedel, H. B.
Keller, J. P. Kernévez, Int. J. Bifurcation Chaos 1 (1991) 745.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.compiled import compiled
from rotorid.motion.rosenbrock import Equations, evaluate
from rotorid.motion.run import equations_of
from rotorid.motion.system import MotionSystem

_S, LEAST_STEPS, MOST_STEPS = 4, 32, 512
"""Radau's points in a step; steps in a revolution or cycle."""
UNITY = 1.0 + 1e-9  # a multiplier up to this is not outside the unit circle: rounding
_ROUGH = 1e-4  # more of `Orbit.roughness` halves the steps in time


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
    turns
        Revolutions in one period; 0 for a period of its own, of a rotor without unbalance and bow.
    start
        Deflections at the beginning, where the angle of rotation is 0, shape (n,).
    velocities
        At Radau's points of each step, shape (N, 4, n).
    multipliers
        Floquet multipliers, the largest first; of a motion with a period of its own that of its phase, 1,
        last. Empty of a guess.
    bifurcation, frequency
        Where one is, its kind, and the frequency of a motion that begins there, rad/s; NaN for none.
    """

    speed: float
    period: float
    turns: int
    start: FloatArray
    velocities: FloatArray
    multipliers: ComplexArray = field(default_factory=lambda: np.empty(0, dtype=complex))
    bifurcation: str = ""
    frequency: float = np.nan

    @property
    def outside(self) -> int:
        """How many multipliers are outside the unit circle."""
        return int((np.abs(self.multipliers) > UNITY).sum())

    @property
    def stable(self) -> bool:
        """Whether the motion returns after a small disturbance; not where it bifurcates."""
        return not self.bifurcation and self.outside == 0

    @property
    def unknowns(self) -> FloatArray:
        """Deflections and velocities at the beginning, T and Ω, shape (2 n + 2,)."""
        return np.concatenate([self.start, self.velocities[-1, -1], [self.period, self.speed]])

    @property
    def at_speed(self) -> FloatArray:
        """The row of unknowns that is the speed, see `Periodic.solve`."""
        return np.asarray(np.eye(2 * self.start.size + 2)[-1])

    @cached_property
    def ends(self) -> FloatArray:
        """Deflections at the beginning of each step and at the end of the last, shape (N + 1, n)."""
        steps = np.einsum("l,ilk->ik", _A[-1], self.velocities) * self.period / len(self.velocities)
        return np.concatenate([self.start[None], self.start + steps.cumsum(axis=0)])

    @cached_property
    def deflections(self) -> FloatArray:
        """At Radau's points, shape (N, 4, n)."""
        moved = np.einsum("jl,ilk->ijk", _A, self.velocities)
        return np.asarray(self.ends[:-1, None, :] + self.period / len(moved) * moved)

    @cached_property
    def scale(self) -> FloatArray:
        """Sizes of the state, shape (2 n,): half of what each coordinate moves, and of its velocity.

        At least a hundredth of its largest value, and 1e-3 of the largest one.
        """
        q = self.deflections.reshape(-1, self.start.size)
        size = np.maximum(np.ptp(q, axis=0) / 2, 1e-2 * np.abs(q).max(axis=0))
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
        """Largest and smallest deflections, shape (2 n,)."""
        return np.concatenate([self.deflections.max(axis=(0, 1)), self.deflections.min(axis=(0, 1))])

    def resampled(self, count: int) -> Orbit:
        """The orbit in so many steps."""
        N, v = len(self.velocities), self.velocities
        rates = np.concatenate([np.roll(v[:, -1:], 1, axis=0), v], axis=1)
        at = (np.arange(count)[:, None] + POINTS) * (N / count)
        step = np.ceil(at - 1e-9).astype(int) - 1
        powers = np.vander((at - step).ravel(), _S + 1, increasing=True).reshape(count, _S, _S + 1)
        weights = powers @ np.linalg.inv(np.vander(np.append(0.0, POINTS), increasing=True))
        return replace(self, velocities=np.einsum("ijl,ijlk->ijk", weights, rates[step]))

    def readings(self, directions: FloatArray) -> FloatArray:
        """What sensors read at 2048 times of a period, shape (2048, k), of directions (k, n)."""
        along = replace(self, start=directions @ self.start, velocities=self.velocities @ directions.T)
        return np.asarray(along.resampled(512).deflections.reshape(-1, len(directions)))


def turning(speed: float, period: float, turns: int, rest: FloatArray, response: ComplexArray) -> Orbit:
    """The motion rest + Re(response e^{2πit/T})."""
    turned = np.exp(2j * np.pi * (np.arange(LEAST_STEPS)[:, None] + POINTS) / LEAST_STEPS)[..., None]
    velocities = (2j * np.pi / period * turned * response).real
    return Orbit(speed, period, turns, rest + response.real, velocities)


@dataclass(eq=False)
class Periodic:
    """What a periodic motion is sought of.

    Attributes
    ----------
    system
        What moves.
    low, high
        Range of speeds, rad/s.
    until
        When the search has to end, by `time.monotonic`.
    """

    system: MotionSystem
    low: float
    high: float
    until: float = np.inf

    @property
    def late(self) -> bool:
        """Whether the limit of time has come."""
        return time.monotonic() > self.until

    def _equations(self, orbit: Orbit) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Equations of N steps for themselves: what is left, (N, 4 n), and its derivatives.

        Derivatives are by the velocities V, (N, 4 n, 4 n), and by q and v at the beginning, T and Ω,
        (N, 4 n, 2 n + 2).
        """
        V, speed, M = orbit.velocities, orbit.speed, self.system.M
        N, _, n = V.shape
        h, v, Q = orbit.period / N, np.roll(V[:, -1], 1, axis=0), orbit.deflections
        angles = 2 * np.pi * orbit.turns / N * (np.arange(N)[:, None] + POINTS)
        at = angles.ravel(), Q.reshape(-1, n), V.reshape(-1, n)
        states = _along(equations_of(self.system, speed, speed), speed, *at).reshape(N, _S, -1, n)
        f, by_speed, K_t, C_t = (
            states[:, :, 2],
            -states[:, :, 3],
            -states[:, :, 5 : 5 + n],
            -states[:, :, 5 + n :],
        )
        inert = np.einsum("jl,ilk->ijk", _INVERSE / h, V - v[:, None]) @ M.T
        J = np.einsum("jl,kp->jklp", _INVERSE / h, M)[None] + h * np.einsum("jl,ijkp->ijklp", _A, K_t)
        for j in range(_S):
            J[:, j, :, j] += C_t[:, j]
        moved = np.einsum("jl,ilk->ijk", _A, V)
        by_period = (np.einsum("ijkp,ijp->ijk", K_t, moved) - inert / h) / N
        by_v = np.broadcast_to(np.einsum("j,kp->jkp", -_INVERSE.sum(axis=1) / h, M), K_t.shape)
        others = np.concatenate([K_t, by_v, by_period[..., None], by_speed[..., None]], axis=-1)
        return (inert - f).reshape(N, -1), J.reshape(N, _S * n, _S * n), others.reshape(N, _S * n, -1)

    def linearised(self, orbit: Orbit) -> Linearised:
        """Newton's equations at an orbit or its guess, all but the unknowns eliminated.

        Raises
        ------
        numpy.linalg.LinAlgError
            Where they have no solution, or a force none (a wall), or the limit of time has come.
        """
        if self.late:
            raise np.linalg.LinAlgError("time is up")
        V, n = orbit.velocities, orbit.start.size
        N = len(V)
        R, J, others = self._equations(orbit)
        right = np.concatenate([others, R[..., None]], axis=-1)
        if not np.isfinite(right).all():
            raise np.linalg.LinAlgError(wall_met(self.system, orbit.deflections) or "the forces overflow")
        S = -np.linalg.solve(J, right).reshape(N, _S, n, -1)
        P = np.concatenate([orbit.period / N * np.einsum("l,ilkm->ikm", _A[-1], S), S[:, -1]], axis=1)
        P[:, :n, :n] += np.eye(n)
        P[:, :n, 2 * n] += np.einsum("l,ilk->ik", _A[-1], V) / N
        G = np.zeros((N + 1, 2 * n, 2 * n + 3))
        G[0, :, : 2 * n] = np.eye(2 * n)
        for i in range(N):
            G[i + 1] = P[i, :, : 2 * n] @ G[i]
            G[i + 1, :, 2 * n :] += P[i, :, 2 * n :]
        return Linearised(orbit, S, G)

    def newton(self, orbit: Orbit, row: FloatArray) -> Linearised:
        """The orbit with the same row · unknowns; LinAlgError without convergence."""
        value, before = row @ orbit.unknowns, np.inf
        for _ in range(14):
            at = self.linearised(orbit)
            change = at.change(row, float(value - row @ orbit.unknowns))
            new = at.moved(change, 1.0)
            moved = np.abs(new.velocities - orbit.velocities) / orbit.scale[orbit.start.size :]
            orbit, size = new, float(max(moved.max(), (np.abs(change) / at.scale).max()))
            if size < 1e-9 or 0.1 * before < size < 1e-6:  # the latter by rounding
                return self.linearised(orbit)
            before = size
            if not size < 1e3 or not orbit.period > 0:
                break
        raise np.linalg.LinAlgError("Newton's method does not converge")

    def solve(self, guess: Orbit, row: FloatArray) -> Linearised:
        """The same with steps in time that are short enough, and longer again where they may be."""
        steps = len(guess.velocities)
        if guess.roughness < _ROUGH / 100 and steps >= 2 * LEAST_STEPS:
            guess = guess.resampled(steps // 2)
        at = self.newton(guess, row)
        while at.orbit.roughness > _ROUGH and 2 * len(at.orbit.velocities) <= MOST_STEPS:
            at = self.newton(at.orbit.resampled(2 * len(at.orbit.velocities)), row)
        return at


@dataclass(frozen=True, eq=False)
class Linearised:
    """Newton's equations at an orbit.

    Attributes
    ----------
    orbit
        Where.
    steps
        Change of the velocities by the state at the beginning of their step, T, Ω and, of what is left of the
        equations, 1, shape (N, 4, n, 2 n + 3).
    states
        The same of the states at the ends, by the state at the beginning of all, shape (N + 1, 2 n, 2 n + 3).
    """

    orbit: Orbit
    steps: FloatArray
    states: FloatArray

    @property
    def scale(self) -> FloatArray:
        """Sizes of the unknowns."""
        return np.concatenate([self.orbit.scale, [self.orbit.period, self.orbit.speed]])

    def change(self, row: FloatArray, value: float, left: float = 1.0) -> FloatArray:
        """Of the unknowns, so that row · change = value; `left` is 0 for a tangent, shape (2 n + 2,)."""
        orbit, scale, n = self.orbit, self.scale, self.orbit.start.size
        kept, missed = np.zeros(scale.size), 0.0
        if orbit.turns:
            missed = 2 * np.pi * orbit.turns - orbit.period * orbit.speed
            kept[-2:] = orbit.speed, orbit.period
        else:
            kept[:n] = orbit.velocities[-1, -1] / scale[:n] ** 2
        rows, end = np.array([kept, row]), self.states[-1]
        matrix = np.concatenate([-end[:, :-1], rows])
        matrix[: 2 * n, : 2 * n] += np.eye(2 * n)
        right = np.concatenate([end[:, -1] * left, [missed * left, value]])
        right[:n] += left * (orbit.ends[-1] - orbit.start)
        size = np.concatenate([orbit.scale, np.abs(rows * scale).max(axis=1)])
        return np.linalg.solve(matrix * scale / size[:, None], right / size) * scale

    def moved(self, change: FloatArray, left: float = 0.0) -> Orbit:
        """The orbit with its unknowns changed, along the solution."""
        orbit, n2 = self.orbit, 2 * self.orbit.start.size
        rest = np.append(change[n2:], left)
        states = self.states[:-1] @ np.append(change, left)
        by = np.concatenate([states, np.tile(rest, (len(states), 1))], axis=1)
        velocities = orbit.velocities + np.einsum("ijkm,im->ijk", self.steps, by)
        period, speed = orbit.period + float(change[-2]), orbit.speed + float(change[-1])
        return Orbit(speed, period, orbit.turns, orbit.start + change[: n2 // 2], velocities)

    @cached_property
    def eigen(self) -> tuple[ComplexArray, ComplexArray]:
        """Multipliers, the largest first, and their vectors, (2 n, 2 n), of the state after a period."""
        values, vectors = np.linalg.eig(self.states[-1][:, : len(self.states[-1])])
        order = np.argsort(-np.abs(values), kind="stable")
        return values[order].astype(complex), vectors[:, order].astype(complex)

    @cached_property
    def solution(self) -> Orbit:
        """The orbit with its multipliers."""
        values = self.eigen[0]
        if not self.orbit.turns:
            values = np.append(np.delete(values, np.abs(values - 1).argmin()), 1.0)
        return replace(self.orbit, multipliers=values)

    def departing(self, multiplier: complex, places: IndexArray) -> float:
        """Frequency, rad/s, of the motion that belongs to a multiplier.

        The multiplier gives it but for its sign and multiples of 2π / T: these are of the largest part of the
        disturbance at some coordinates, its eigenvector followed through the period T.
        """
        values, vectors = self.eigen
        direction = vectors[:, np.abs(values - multiplier).argmin()]
        states = (self.states[..., : direction.size] @ direction)[:, places]
        N, phase = len(states) - 1, np.angle(np.vdot(states[0], states[-1]))
        parts = np.fft.fft(states[:-1] * np.exp(-1j * phase * np.arange(N) / N)[:, None], axis=0)
        k = np.fft.fftfreq(N, 1 / N)[np.linalg.norm(parts, axis=1).argmax()]
        return float(abs(phase + 2 * np.pi * k) / self.orbit.period)


def wall_met(system: MotionSystem, q: FloatArray, near: float = 1.0) -> str:
    """The node that is nearer to its wall than 1 − `near` of its clearance, in words; q (…, n)."""
    if not system.forces:
        return ""
    share = (np.abs(system.at_forces(q)) / system.walls).reshape(-1, len(system.forces)).max(axis=0)
    return f"node {system.forces[int(share.argmax())].node} is at its wall" if (share >= near).any() else ""


@compiled
def _along(
    equations: Equations, speed: float, angles: FloatArray, Q: FloatArray, V: FloatArray
) -> FloatArray:
    """The states of `evaluate` at many points of a motion, one a row."""
    m, n = Q.shape
    states = np.empty((m, 5 + 2 * n, n))
    for i in range(m):
        np.positive(Q[i], states[i, 0])
        np.positive(V[i], states[i, 1])
        evaluate(equations, (angles[i], speed, 0.0), 0.0, states[i], True)
    return states
