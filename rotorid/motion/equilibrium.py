"""Static equilibrium of a rotor in its journal bearings, of any number: K(Ω) q = w + Σ F(q, 0, Ω).

The deflections p at the nodes of forces are the unknowns; the others follow, being linear:

    A p = b + F(p),  A = K_pp − K_po K_oo⁻¹ K_op,  b = w_p − K_po K_oo⁻¹ w_o,

by Newton's method, its steps damped and kept inside the clearances, and where it fails by continuation in the
load, from the centred journals on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem.forces.laws import law
from fem.model.node_forces import CubicSpring, JournalBearing, NodeForce, SqueezeFilm, Stop, kind_of
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.base.checks import number
from rotorid.base.rpm import speed_text
from rotorid.motion.system import MotionSystem

_CLOSER = 0.8
"""Share of the way to its wall that a journal goes in one step at most."""
_ROUNDS = 60
_SMALLEST_STEP = 1e-4
"""Of the load, in its continuation; of Newton's way."""
_CONVERGED = 1e-8
"""Last step by the film's thickness: the error is its square."""
_SINGULAR = 1e13
_LOST = 1e-6
"""Share of the load that may be left over."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Where a rotor rests while its journals turn.

    Attributes
    ----------
    system
        What rests.
    speed
        rad/s.
    q
        Of all unknowns, shape (n,), m and rad.
    bearings
        The forces with a wall: journal bearings, squeeze films, seals; b of them.
    load
        On each of these, from the shaft, complex: x + iy, N, shape (b,).
    residual
        Largest force that is left over, by the weight.
    """

    system: MotionSystem
    speed: float
    q: FloatArray
    bearings: tuple[NodeForce, ...]
    load: ComplexArray
    residual: float

    @property
    def position(self) -> ComplexArray:
        """Of the shaft from the centre of each bearing, x + iy, m, shape (b,)."""
        return np.array([complex(*self.q[[*self.system.index(one.node)]]) for one in self.bearings])

    @property
    def eccentricity(self) -> FloatArray:
        """Of the shaft by the clearance, shape (b,)."""
        return np.abs(self.position) / self._walls

    @property
    def attitude(self) -> FloatArray:
        """Angle from the load's direction to the shaft's position, positive with the rotation, rad, (b,)."""
        return np.asarray(np.angle(self.position * self.load.conj()))

    @property
    def film(self) -> FloatArray:
        """Smallest thickness of the film, m, shape (b,)."""
        return self._walls - np.abs(self.position)

    @property
    def sommerfeld(self) -> FloatArray:
        """Of each bearing, S = η N L D / W (R / c)² with N in revolutions per second, shape (b,); else NaN."""
        revolutions = self.speed / (2 * np.pi)
        return np.array(
            [
                one.viscosity * revolutions * one.length * one.diameter / abs(W)
                * (one.diameter / 2 / one.clearance) ** 2
                if isinstance(one, JournalBearing) and W
                else np.nan
                for one, W in zip(self.bearings, self.load, strict=True)
            ]
        )  # fmt: skip

    @property
    def _walls(self) -> FloatArray:
        return np.array([one.wall for one in self.bearings])


def equilibria(system: MotionSystem, speeds: Sequence[float]) -> tuple[Equilibrium, ...]:
    """The equilibrium at each of some speeds, rad/s; errors as of `equilibrium`."""
    found: list[Equilibrium] = []
    for speed in speeds:
        found.append(equilibrium(system, speed, found[-1].q if found else None))
    return tuple(found)


def equilibrium(system: MotionSystem, speed: float, start: FloatArray | None = None) -> Equilibrium:
    """Find where a rotor rests while its journals turn.

    A squeeze film carries nothing at rest but what its centring spring carries.

    Parameters
    ----------
    system
        With its weight.
    speed
        rad/s, above 0 where there is a journal bearing.
    start
        Where the search begins, (n,), such as the equilibrium at a speed near by; None: at the centres.

    Raises
    ------
    ValueError
        With node and speed: a speed of 0 or outside the equations' range, a rotor that nothing holds, a shaft
        that comes to a wall or rubs on a stop.
    """
    speed = number(speed, "speed")
    journal = next((force for force in system.forces if isinstance(force, JournalBearing)), None)
    if journal is not None and speed == 0:
        raise ValueError(
            f"speed 0: no film carries a load at rest; {_named(journal)} has an equilibrium only above it"
        )
    resting = replace(system, forces=tuple(_at_rest(force) for force in system.forces))
    K = system.linear(speed)[1]
    held = _condensed(resting, K, speed)
    q = held.all_of(_solved(held, None if start is None else start[held.p]))
    _check_walls(system, q, speed)
    F = resting.acting(q, np.zeros(system.size), speed)[0]
    residual = float(np.abs(K @ q - system.weight - F).max() / (np.abs(system.weight).sum() or 1.0))
    if not residual <= _LOST:
        raise ValueError(
            f"the equilibrium at {speed_text(speed)} is lost in float64: {residual:.2g} of the weight is left "
            "over; join neighbouring elements (50 to 200 are ample for a rotor)"
        )
    walled = [k for k, force in enumerate(system.forces) if np.isfinite(force.wall)]
    load = -each_force(resting, q, speed)[walled, :, 0]
    q.setflags(write=False)
    bearings = tuple(system.forces[k] for k in walled)
    return Equilibrium(system, speed, q, bearings, load[:, 0] + 1j * load[:, 1], residual)


def each_force(system: MotionSystem, q: FloatArray, speed: float) -> FloatArray:
    """Each force at rest and its derivatives as `fem.forces.laws.law` writes them, shape (f, 2, 6)."""
    out = np.zeros((len(system.forces), 2, 6))
    for k, (code, values, place) in enumerate(zip(*system.law_tables, strict=True)):
        law(code, values, *q[place], 0.0, 0.0, speed, out[k])
    return out


@dataclass(frozen=True, eq=False)
class _Condensed:
    """A p = b + F(p), and the other unknowns `follow[:, 0] − follow[:, 1:] p`."""

    system: MotionSystem
    speed: float
    p: IndexArray
    A: FloatArray
    b: FloatArray
    others: IndexArray
    follow: FloatArray

    def all_of(self, p: FloatArray) -> FloatArray:
        q = np.zeros(self.system.size)
        q[self.p], q[self.others] = p, self.follow[:, 0] - self.follow[:, 1:] @ p
        return q

    def left(self, p: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
        """What is left over under a share of the load, and minus its derivative."""
        F, F_q, *_ = self.system.acting(self.all_of(p), np.zeros(self.system.size), self.speed)
        return share * self.b + F[self.p] - self.A @ p, self.A - F_q[np.ix_(self.p, self.p)]

    def places(self, p: FloatArray) -> ComplexArray:
        """Where the shaft is at each force, (f,)."""
        x, y = self.system.law_tables[2].T
        q = np.zeros(self.system.size)
        q[self.p] = p
        return np.asarray(q[x] + 1j * q[y])

    @property
    def walls(self) -> FloatArray:
        return np.array([force.wall for force in self.system.forces])


def _condensed(system: MotionSystem, K: FloatArray, speed: float) -> _Condensed:
    p = np.unique(system.law_tables[2])
    o = np.setdiff1d(np.arange(system.size), p)
    _check_held(system, K[np.ix_(o, o)], speed)
    follow = np.linalg.solve(K[np.ix_(o, o)], np.column_stack([system.weight[o], K[np.ix_(o, p)]]))
    A = K[np.ix_(p, p)] - K[np.ix_(p, o)] @ follow[:, 1:]
    found = _Condensed(system, speed, p, A, system.weight[p] - K[np.ix_(p, o)] @ follow[:, 0], o, follow)
    _check_held(system, found.left(np.zeros(p.size), 0.0)[1], speed)
    return found


def _solved(held: _Condensed, start: FloatArray | None) -> FloatArray:
    """The unknowns p: from the start or the centres at once, else with a load that grows."""
    p, share, step = np.zeros(held.p.size), 0.0, 1.0
    if start is not None and (found := _newton(held, start, 1.0)) is not None:
        return found
    while share < 1.0:
        further = min(share + step, 1.0)
        found = _newton(held, p, further)
        if found is not None:
            p, share, step = found, further, 2 * step
        elif step < _SMALLEST_STEP:
            raise _no_place(held, p)
        else:
            step /= 4
    return p


def _newton(held: _Condensed, p: FloatArray, share: float) -> FloatArray | None:
    """Newton's method, or None where it does not come to an end."""
    r, J = held.left(p, share)
    for _ in range(_ROUNDS):
        if not np.isfinite(r).all() or not np.isfinite(J).all():
            return None
        try:
            d = np.linalg.solve(J, r)
        except np.linalg.LinAlgError:
            return None
        gap = min((held.walls - np.abs(held.places(p))).min(initial=np.inf), np.abs(p + d).max(initial=0.0))
        if np.abs(d).max(initial=0.0) <= _CONVERGED * gap:
            return np.asarray(p + d)
        t = _inside(held, p, d)
        size = np.linalg.norm(r)
        while True:
            r, J = held.left(p + t * d, share)
            if np.linalg.norm(r) < (1 - 0.1 * t) * size:
                break
            t /= 2
            if t < _SMALLEST_STEP:
                return None
        p = p + t * d
    return None


def _inside(held: _Condensed, p: FloatArray, d: FloatArray) -> float:
    """Share of a step, 1 at most, that leaves the shaft inside all walls."""
    z, dz, walls = held.places(p), held.places(d), held.walls
    bounded = np.isfinite(walls) & (dz != 0)
    z, dz, walls = z[bounded], dz[bounded], walls[bounded]
    furthest = np.abs(z) + _CLOSER * (walls - np.abs(z))
    half, square = (z.conj() * dz).real, np.abs(dz) ** 2
    t = (np.sqrt(half**2 + square * (furthest**2 - np.abs(z) ** 2)) - half) / square
    return float(min(t.min(initial=1.0), 1.0))


def _at_rest(force: NodeForce) -> NodeForce:
    """What acts while nothing moves: of a squeeze film its centring spring."""
    return CubicSpring(force.node, force.name, force.centring_stiffness) if isinstance(force, SqueezeFilm) else force


def _check_held(system: MotionSystem, K: FloatArray, speed: float) -> None:
    if K.size:
        largest = np.abs(K).max(axis=1, keepdims=True)
        if largest.all() and np.linalg.cond(K / largest) < _SINGULAR:
            return
        springless = [force for force in system.forces if force == CubicSpring(force.node, force.name)]
        why = "; ".join(
            f"the squeeze film at node {force.node} has no centring spring, and at rest its shaft falls to the wall"
            for force in springless
        )
        raise ValueError(
            f"the equilibrium at {speed_text(speed)} is not determined: nothing holds the rotor"
            + (f" ({why})" if why else "; give it bearings at two nodes")
        )


def _check_walls(system: MotionSystem, q: FloatArray, speed: float) -> None:
    """Refuse a shaft beyond a wall that the forces at rest do not know, or on a stop."""
    for force in system.forces:
        drop = float(np.hypot(*q[[*system.index(force.node)]]))
        if isinstance(force, Stop) and drop > force.gap:
            raise ValueError(
                f"at {speed_text(speed)} the shaft rests on {_named(force)}: it drops by {1e3 * drop:.4g} mm "
                f"there, the gap is {1e3 * force.gap:.4g} mm"
            )
        if drop >= force.wall:
            raise ValueError(
                f"at {speed_text(speed)} the shaft drops by {1e3 * drop:.4g} mm at {_named(force)}, more than "
                f"its clearance, {1e3 * force.wall:.4g} mm"
            )


def _no_place(held: _Condensed, p: FloatArray) -> ValueError:
    e = np.abs(held.places(p)) / held.walls
    k = int(np.argmax(e))
    return ValueError(
        f"no equilibrium inside the clearances is found at {speed_text(held.speed)}; under a part of the load "
        f"the shaft is nearest to the wall of {_named(held.system.forces[k])}, at {100 * e[k]:.4g} % of its clearance"
    )


def _named(force: NodeForce) -> str:
    name = f" {force.name!r}" if force.name else ""
    return f"the {kind_of(force).replace('_', ' ')}{name} at node {force.node}"
