"""Periodic motion by collocation: Radau's points in equal steps, exact Jacobian, Floquet multipliers.

A period T is cut into N steps of h = T / N. In each the velocity is the polynomial through its values at the
s = 4 points c h of Radau IIA (order 7 at the ends of the steps), c_s = 1, and the deflection its integral:

    Q_j = q_i + h Σ a_jl V_l,   M Σ (a⁻¹)_jl (V_l − v_i) / h + C V_j + K Q_j = forces(Q_j, V_j, φ_j, Ω).

Nothing is divided by M: nodes without mass that a film or damper holds are no special case, and what is stiff
in a film does not limit h. What makes more than about N / 4 cycles in a period is damped by the method: it
would not show that it is unstable. Newton's method eliminates the V of each step; what is left is the map of
the state (q, v) over one period, whose derivative Φ, the monodromy matrix, has the Floquet multipliers as its
eigenvalues. Unknowns are then the state at the beginning, the speed and, of motion with a period of its own,
the period. Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), IV.5; E. J.
Doedel, H. B. Keller, J. P. Kernévez, Int. J. Bifurcation Chaos 1 (1991) 745.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.compiled import compiled
from rotorid.motion.system import MotionSystem, add_forces

_S = 4


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
_NEWTON = 14
_SMALL, _ROUNDED = 1e-9, 1e-6
"""Last change of Newton's method by the size of the motion; below what it may be that of rounding."""


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

    @property
    def step(self) -> float:
        """T / N, s."""
        return self.period / len(self.velocities)

    @cached_property
    def state(self) -> FloatArray:
        """Deflections and velocities at the beginning, shape (2n,)."""
        return np.concatenate([self.start, self.velocities[-1, -1]])

    @cached_property
    def ends(self) -> FloatArray:
        """Deflections at the beginning of each step and at the end of the last, shape (N + 1, n)."""
        moved = np.einsum("l,ilk->ik", _A[-1], self.velocities).cumsum(axis=0)
        return self.start + self.step * np.concatenate([np.zeros((1, moved.shape[1])), moved])

    @cached_property
    def deflections(self) -> FloatArray:
        """At Radau's points, shape (N, 4, n)."""
        moved = np.einsum("jl,ilk->ijk", _A, self.velocities)
        return np.asarray(self.ends[:-1, None, :] + self.step * moved)

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
        moved = self.step * np.abs(np.einsum("l,ilk->ik", _HIGHEST, self.velocities))
        return float((moved / self.scale[: self.start.size]).max())

    def repeats(self, turns: int) -> bool:
        """Whether a motion of so many revolutions is one of fewer."""
        ends, N = self.ends[:-1], len(self.velocities)
        away = [
            np.abs((ends - np.roll(ends, N // turns * k, axis=0)) / self.scale[: self.start.size]).max()
            for k in range(1, turns)
            if turns % k == 0
        ]
        return bool(away) and min(away) < 0.02

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
        return np.asarray(self.resampled(512).deflections.reshape(-1, self.start.size) @ directions.T)


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

    def angles(self, steps: int) -> FloatArray:
        """Of rotation at Radau's points of a period, rad, shape (N, 4)."""
        return 2 * np.pi * self.turns / steps * (np.arange(steps)[:, None] + POINTS)

    def _equations(
        self, q: FloatArray, v: FloatArray, V: FloatArray, h: float, speed: float, angles: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Equations of N steps for themselves: what is left, (N, 4 n), and its derivatives.

        From q and v at their beginnings, (N, n), the velocities V, (N, 4, n), and the angles of rotation at
        Radau's points, (N, 4). Derivatives are by V, (N, 4 n, 4 n), and by q, v, h and Ω, (N, 4 n, 2 n + 2).
        """
        system = self.system
        N, _, n = V.shape
        M = system.M
        C, K, C_speed, K_speed = _linear(system, speed)
        moved = np.einsum("jl,ilk->ijk", _A, V)
        Q = q[:, None] + h * moved
        shape = (N * _S, n)
        F, F_speed = np.zeros(shape), np.zeros(shape)
        C_t, K_t = np.zeros((*shape, n)), np.zeros((*shape, n))
        _forces_along(*system.law_tables, Q.reshape(shape), V.reshape(shape), speed, F, K_t, C_t, F_speed)
        K_t, C_t = ((linear - own).reshape(N, _S, n, n) for linear, own in ((K, K_t), (C, C_t)))
        turning = np.exp(1j * angles)[..., None]
        driven = (system.unbalance * speed**2 + system.bow) * turning
        inert = (np.einsum("jl,ilk->ijk", _INVERSE, V) - _INVERSE.sum(axis=1)[:, None] * v[:, None]) @ M.T / h
        R = inert + V @ C.T + Q @ K.T - F.reshape(V.shape) - system.weight - driven.real
        J = np.einsum("jl,kp->jklp", _INVERSE / h, M)[None] + h * np.einsum("jl,ijkp->ijklp", _A, K_t)
        for j in range(_S):
            J[:, j, :, j] += C_t[:, j]
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
        V, h, n = orbit.velocities, orbit.step, orbit.start.size
        N = len(V)
        angles = self.angles(N)
        R, J, others = self._equations(
            orbit.ends[:-1], np.roll(V[:, -1], 1, axis=0), V, h, orbit.speed, angles
        )
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

    def solve(self, guess: Orbit, rows: FloatArray, values: FloatArray) -> tuple[Linearised, int]:
        """Newton's method with conditions rows · y = values on the unknowns y = `unknowns` of the orbit.

        Returns
        -------
        The equations at the solution, and how many iterations it took.

        Raises
        ------
        numpy.linalg.LinAlgError
            If it does not converge.
        """
        orbit, before = guess, np.inf
        for k in range(_NEWTON):
            at = self.linearised(orbit)
            orbit, change = at.corrected(rows, values - rows @ self.unknowns(orbit))
            if change < _SMALL or 0.1 * before < change < _ROUNDED:
                return self.linearised(orbit), k + 1
            before = change
            if not change < 1e3 or not orbit.period > 0:
                break
        raise np.linalg.LinAlgError("Newton's method does not converge")

    def unknowns(self, orbit: Orbit) -> FloatArray:
        """State at the beginning, the period if it is an unknown, and the speed, shape (2 n + 1 or 2,)."""
        free = [orbit.speed] if self.turns else [orbit.period, orbit.speed]
        return np.concatenate([orbit.state, free])


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

    @cached_property
    def multipliers(self) -> ComplexArray:
        """Floquet multipliers, the largest first, shape (2 n,)."""
        scale = self.orbit.scale
        values = np.linalg.eigvals(self.monodromy * scale / scale[:, None])
        return values[np.argsort(-np.abs(values), kind="stable")].astype(complex)

    @property
    def monodromy(self) -> FloatArray:
        """Derivative of the state after one period by that before, shape (2 n, 2 n)."""
        return np.asarray(self.states[-1][:, : 2 * self.orbit.start.size])

    @property
    def scale(self) -> FloatArray:
        """Sizes of the unknowns."""
        free = [self.orbit.speed] if self.free == 1 else [self.orbit.period, self.orbit.speed]
        return np.concatenate([self.orbit.scale, np.abs(free)])

    def change(self, rows: FloatArray, values: FloatArray, left: float = 1.0) -> FloatArray:
        """Of the unknowns, so that rows · change = values; `left` is 0 for a tangent, shape (2 n + free,)."""
        n2, orbit, scale = 2 * self.orbit.start.size, self.orbit, self.scale
        end = self.states[-1]
        matrix = np.zeros((n2 + self.free, n2 + self.free))
        matrix[:n2] = -np.delete(end, n2, axis=1)
        matrix[:n2, :n2] += np.eye(n2)
        matrix[n2:] = rows
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
        velocities = orbit.velocities + np.einsum(
            "ijkm,im->ijk", self.steps, np.concatenate([states, np.tile(rest, (len(states), 1))], axis=1)
        )
        speed = orbit.speed + change[-1]
        own = self.free == 2
        period = orbit.period + change[-2] if own else orbit.period * orbit.speed / speed
        return Orbit(float(speed), float(period), orbit.start + change[:n], velocities)


def wall_met(system: MotionSystem, q: FloatArray, near: float = 1.0) -> str:
    """The node that is nearer to its wall than 1 − `near` of its clearance, in words; q (…, n)."""
    if not system.forces:
        return ""
    places = system.law_tables[2]
    walls = np.array([force.wall for force in system.forces])
    share = np.hypot(q[..., places[:, 0]], q[..., places[:, 1]]).reshape(-1, len(walls)).max(axis=0) / walls
    return f"node {system.forces[int(share.argmax())].node} is at its wall" if (share >= near).any() else ""


def _linear(system: MotionSystem, speed: float) -> tuple[FloatArray, ...]:
    """C and K at a speed, beyond the knots as at their ends, and their derivatives by it."""
    knots = system.knots
    i = max(0, min(int(np.searchsorted(knots, speed, "right")) - 1, len(knots) - 2))
    slopes = [(matrix[i + 1] - matrix[i]) / (knots[i + 1] - knots[i]) for matrix in (system.C, system.K)]
    past = speed - knots[i]
    return (system.C[i] + past * slopes[0], system.K[i] + past * slopes[1], *slopes)


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
