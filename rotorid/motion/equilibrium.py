"""Static equilibrium of a rotor in its journal bearings, of any number: K(Ω) q = w + Σ F(q, 0, Ω).

By Newton's method, its steps damped, which keeps them inside the clearances, since beyond a wall a law gives
NaN; where it fails by continuation in the load, from the centred journals on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem import JournalBearing, NodeForce, Stop
from fem.forces import kind_of, law
from rotorid.base.arrays import ComplexArray, FloatArray, number
from rotorid.base.text import speed_text
from rotorid.motion.system import MotionSystem, followers

_SMALLEST_STEP = 1e-9
"""Of Newton's way, and of the load in its continuation."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Where a rotor rests while its journals turn.

    Attributes
    ----------
    system, speed
        What rests, and its speed, rad/s.
    q
        Of all unknowns, shape (n,), m and rad.
    bearings
        The forces with a wall: journal bearings, squeeze films, seals; b of them.
    load
        On each of these, from the shaft, complex: x + iy, N, shape (b,).
    """

    system: MotionSystem
    speed: float
    q: FloatArray
    bearings: tuple[NodeForce, ...]
    load: ComplexArray

    @property
    def position(self) -> ComplexArray:
        """Of the shaft from the centre of each bearing, x + iy, m, shape (b,)."""
        return self.system.at_forces(self.q)[np.isfinite(self.system.walls)]

    @property
    def eccentricity(self) -> FloatArray:
        """Of the shaft by the clearance, shape (b,)."""
        return np.abs(self.position) / [one.wall for one in self.bearings]

    @property
    def attitude(self) -> FloatArray:
        """Angle from the load's direction to the shaft's position, positive with the rotation, rad, (b,)."""
        return np.asarray(np.angle(self.position * self.load.conj()))

    @property
    def sommerfeld(self) -> FloatArray:
        """Of each journal bearing, S = η N L D / W (R / c)² with N in 1/s, shape (b,); NaN of others."""
        S = np.full(len(self.bearings), np.nan)
        for k, (one, W) in enumerate(zip(self.bearings, np.abs(self.load), strict=True)):
            if isinstance(one, JournalBearing) and W:
                drag = one.viscosity * self.speed / (2 * np.pi) * one.length * one.diameter
                S[k] = drag / W * (one.diameter / 2 / one.clearance) ** 2
        return S

    @property
    def touched(self) -> tuple[Stop, ...]:
        """Stops on which the shaft rests."""
        places = zip(self.system.forces, np.abs(self.system.at_forces(self.q)), strict=True)
        return tuple(force for force, r in places if isinstance(force, Stop) and r > force.gap)


def equilibria(system: MotionSystem, speeds: Sequence[float]) -> tuple[Equilibrium, ...]:
    """The equilibrium at each of some speeds, rad/s; errors as of `equilibrium`."""
    resting: list[Equilibrium] = []
    for speed in speeds:
        resting.append(equilibrium(system, speed, resting[-1].q if resting else None))
    return tuple(resting)


def equilibrium(system: MotionSystem, speed: float, start: FloatArray | None = None) -> Equilibrium:
    """Find where a rotor rests while its journals turn.

    A squeeze film carries nothing at rest but what its centring spring carries.

    Parameters
    ----------
    system, speed
        With its weight; rad/s, above 0 where there is a journal bearing.
    start
        Where the search begins, (n,), such as the equilibrium at a speed near by; None: at the centres.

    Raises
    ------
    ValueError
        With node and speed: a speed of 0 or outside the equations' range, a rotor that nothing holds, a shaft
        that comes to a wall.
    """
    speed = number(speed, "speed")
    check_journals(system, speed, "give speeds above 0")
    K = system.linear(speed)[1]
    if start is None:
        _check_held(system, K, speed)
    at = np.unique(system.law_tables[2])  # what has no force of its own follows these in a straight line
    others, T = np.setdiff1d(np.arange(system.size), at), followers(K, at)
    q = np.zeros(system.size)
    q[others] = np.linalg.solve(K[np.ix_(others, others)], system.weight[others])
    names = tuple(system.coordinates[i] for i in at)
    part = replace(system, coordinates=names, weight=(system.weight - K @ q)[at])
    q += T @ _solved(part, (K @ T)[at], speed, None if start is None else start[at])
    if not np.abs(_left_over(system, K, q, speed)[0]).max() <= 1e-6 * np.abs(system.weight).sum():
        _check_held(system, K, speed)
        raise ValueError(
            f"at {speed_text(speed)} the equilibrium is lost in float64; join neighbouring elements"
        )
    walled = np.flatnonzero(np.isfinite(system.walls))
    load = -each_force(system, q, speed)[walled, :, 0]
    q.setflags(write=False)
    return Equilibrium(system, speed, q, tuple(system.forces[k] for k in walled), load @ np.array([1, 1j]))


def at_rest(system: MotionSystem, speed: float) -> FloatArray:
    """Where the rotor rests while it turns, shape (n,); errors as of `equilibrium`."""
    here = np.zeros(system.size)
    if not system.weight.any() and not system.acting(here, here, speed)[0].any():
        return here  # also of a rotor that nothing holds
    return np.array(equilibrium(system, speed).q)


def eigenvalues_at_rest(
    system: MotionSystem, q: FloatArray, speed: float
) -> tuple[ComplexArray, ComplexArray]:
    """Finite eigenvalues, rad/s, (m,), and shapes, (n, m), of motion about rest in q."""
    from scipy.linalg import eig

    C, K = system.about(q, speed)
    zero, eye = np.zeros_like(C), np.eye(q.size)
    if np.linalg.cond(system.M) < 1e12:
        lower = -np.linalg.solve(system.M, np.hstack([K, C]))
        values, vectors = np.linalg.eig(np.vstack([np.hstack([zero, eye]), lower]))
    else:
        right = np.block([[eye, zero], [zero, system.M]])
        values, vectors = eig(np.block([[zero, eye], [-K, -C]]), right)
    finite = np.isfinite(values)  # not so without mass
    return values[finite].astype(complex), vectors[: q.size, finite].astype(complex)


def whirl_at_rest(system: MotionSystem, q: FloatArray, speed: float) -> tuple[float, ComplexArray]:
    """Angular frequency, rad/s, and shape (n,) of the least damped whirl around a rotor at rest in q (n,).

    Its size is what is free: see `room`; without walls it deflects as much as at rest.
    """
    values, shapes = eigenvalues_at_rest(system, q, speed)
    whirls = values.imag > 0
    k = int(np.where(whirls | ~whirls.any(), values.real, -np.inf).argmax())
    shape = shapes[:, k] * np.exp(-0.5j * np.angle(np.sum(shapes[:, k] ** 2)))
    size = room(system, q, shape)
    if size == np.inf:
        size = max(np.abs(q).max(), 1e-6) / np.abs(shape).max()
    return float(values[k].imag), np.asarray(size * shape)


def room(system: MotionSystem, q: FloatArray, shape: ComplexArray) -> float:
    """How many times a whirl q + Re(shape e^{iφ}) may be as large until a shaft is at its wall."""
    moved = np.hypot(*(np.abs(system.at_forces(part)) for part in (shape.real, shape.imag)))
    free = system.walls - np.abs(system.at_forces(q))
    return float((free / np.maximum(moved, 1e-300)).min(initial=np.inf))


def each_force(system: MotionSystem, q: FloatArray, speed: float) -> FloatArray:
    """Each force at rest and its derivatives as `fem.forces.laws.law` writes them, shape (f, 2, 6)."""
    out = np.zeros((len(system.forces), 2, 6))
    for k, (code, values, (x, y)) in enumerate(zip(*system.law_tables, strict=True)):
        law(code, values, q[x], q[y], 0.0, 0.0, speed, out[k])
    return out


def check_journals(system: MotionSystem, lowest: float, what: str) -> None:
    """Refuse a rotor at rest in journal bearings."""
    for force in system.forces:
        if isinstance(force, JournalBearing) and not lowest > 0:
            raise ValueError(f"speed 0: {named(force)} carries nothing at rest; {what}")


def named(force: NodeForce) -> str:
    """For messages: "the squeeze film 'left' at node 3"."""
    name = f" {force.name!r}" if force.name else ""
    return f"the {kind_of(force).replace('_', ' ')}{name} at node {force.node}"


def _left_over(
    system: MotionSystem, K: FloatArray, q: FloatArray, speed: float, share: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Forces that are left over under a share of the weight, and minus their derivative."""
    F, F_q, *_ = system.acting(q, np.zeros(system.size), speed)
    return share * system.weight + F - K @ q, K - F_q


def _solved(system: MotionSystem, K: FloatArray, speed: float, start: FloatArray | None) -> FloatArray:
    """The equilibrium: from the start or the centres at once, else with a load that grows."""
    q, share, step = np.zeros(system.size), 0.0, 1.0
    if start is not None and (near := _newton(system, K, start, speed, 1.0)) is not None:
        return near
    while share < 1.0:
        further = min(share + step, 1.0)
        if (solution := _newton(system, K, q, speed, further)) is not None:
            q, share, step = solution, further, 2 * step
        elif step > _SMALLEST_STEP:
            step /= 4
        else:
            e = np.abs(system.at_forces(q)) / system.walls
            k = int(np.argmax(e))
            raise ValueError(
                f"at {speed_text(speed)} no equilibrium is found: under {100 * share:.3g} % of the weight "
                f"the shaft uses {100 * e[k]:.4g} % of its clearance at {named(system.forces[k])}"
            )
    return q


def _newton(
    system: MotionSystem, K: FloatArray, q: FloatArray, speed: float, share: float
) -> FloatArray | None:
    """Newton's method until the last step is 1e-8 of the film: the error is its square; None without end."""
    r, J = _left_over(system, K, q, speed, share)
    for _ in range(100):
        try:
            d = np.asarray(np.linalg.solve(J, r), dtype=float)
        except np.linalg.LinAlgError:
            return None
        z, dz = system.at_forces(q), system.at_forces(d)
        gap = min((system.walls - np.abs(z)).min(initial=np.inf), np.abs(z + dz).max(initial=0.0))
        if np.abs(dz).max(initial=0.0) <= 1e-8 * gap:
            return np.asarray(q + d)
        t, size = 2.0, np.linalg.norm(r)
        while (
            not np.linalg.norm(r) < (1 - 0.1 * t) * size
        ):  # also at first, and beyond a wall, where it is NaN
            t /= 2
            if t < _SMALLEST_STEP:
                return None
            r, J = _left_over(system, K, q + t * d, speed, share)
        q = q + t * d
    return None


def _check_held(system: MotionSystem, K: FloatArray, speed: float) -> None:
    """Refuse a rotor that nothing holds in the middle."""
    J = _left_over(system, K, np.zeros(system.size), speed)[1]
    largest = np.abs(J).max(axis=1, keepdims=True)
    if not largest.all() or not np.linalg.cond(J / largest) < 1e13:
        raise ValueError(
            f"at {speed_text(speed)} nothing holds the rotor, its position is not determined: give it "
            "stiffness or journal bearings at two nodes, a squeeze film its centring spring"
        )
