"""A rotor whose motion is sought: linear equations over speed, and what else acts at its nodes.

    M q'' + C(Ω) q' + K(Ω) q = w + Σ F(q, q', Ω) + Re[(u (Ω² − i Ω') + b) e^{iφ}],  Ω = φ'

with the weight w, the laws F of `fem.forces`, the unbalance u = m e in x and −i m e in y at its node (a mass
centre at e e^{iφ} acts with −m e (e^{iφ})'' there), and b, what a bent shaft needs to be straight: the
shaft's stiffness times the bow. A bow is at rest in the turning shaft: internal damping does not feel it.

`reduced_system` has fewer unknowns (Craig and Bampton): the deflections of some nodes stay, the others follow
as they do at rest, and with those nodes held still the others have natural modes, of which the lowest stay.
Static deflections of the kept nodes are exact. Source: R. R. Craig, M. C. C. Bampton, AIAA Journal 6 (1968)
1313.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import fem
from fem import GRAVITY, NodeForce
from fem.forces import law, tables
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray, number
from rotorid.base.compiled import compiled_part
from rotorid.reduction import SmallModel

ENOUGH = 3e-4
"""Error of the natural frequencies at which a reduced system needs no more modes."""
_RIGID = 1e-6


@dataclass(frozen=True, eq=False)
class MotionSystem:
    """What moves; made by `system`.

    Attributes
    ----------
    coordinates
        Names of the n unknowns as in `fem.Motion`: `x7` and `y7` are the deflections of node 7, m.
    knots
        Speeds at which `C` and `K` are known, rad/s, ascending, shape (s,); between them both are linear.
    M, C, K
        Mass, shape (n, n), the fluid's in seals included; linear damping, gyroscopic effect included, and
        stiffness, shape (s, n, n).
    forces
        What is not linear, f of them.
    weight, unbalance, bow
        w, N, and, complex, u, kg·m, and b, N, shape (n,) each.
    modes, frequency_error
        Of a reduced system: how many modes stay in both planes together, and the largest relative error of
        the natural frequencies without damping, those below twice the highest speed or at least the first two
        that bend the shaft, at the lowest speed; bearings with films left out. Infinite where fewer unknowns
        move. Of another one None and 0.
    """

    coordinates: tuple[str, ...]
    knots: FloatArray
    M: FloatArray
    C: FloatArray
    K: FloatArray
    forces: tuple[NodeForce, ...]
    weight: FloatArray
    unbalance: ComplexArray
    bow: ComplexArray
    modes: int | None = None
    frequency_error: float = 0.0

    @property
    def size(self) -> int:
        """How many unknowns there are, n."""
        return len(self.coordinates)

    @property
    def forced(self) -> bool:
        """Whether unbalance or bow drive it."""
        return bool(self.unbalance.any() or self.bow.any())

    def index(self, node: int) -> tuple[int, int]:
        """Where x and y of a node stand, from 0; ValueError for a node that has no deflection here."""
        try:
            return self.coordinates.index(f"x{node}"), self.coordinates.index(f"y{node}")
        except ValueError:
            raise ValueError(
                f"node {node} does not move of its own; nodes {', '.join(map(str, self.nodes))} do"
            ) from None

    @cached_property
    def nodes(self) -> tuple[int, ...]:
        """Nodes with deflections of their own."""
        return tuple(int(name[1:]) for name in self.coordinates if name[0] == "x" and name[1:].isdecimal())

    @cached_property
    def law_tables(self) -> tuple[IndexArray, FloatArray, IndexArray]:
        """Codes (f,) and parameters (f, 8) of the laws, and where x and y of their nodes stand, (f, 2)."""
        places = np.array([self.index(force.node) for force in self.forces], dtype=np.intp).reshape(-1, 2)
        return *tables(self.forces), places

    @cached_property
    def walls(self) -> FloatArray:
        """Clearances of the forces, m, infinite without a wall, shape (f,)."""
        return np.array([force.wall for force in self.forces])

    def at_forces(self, q: FloatArray) -> ComplexArray:
        """Deflections x + iy at the forces, m, shape (…, f), of unknowns (…, n)."""
        x, y = self.law_tables[2].T
        return np.asarray(q[..., x] + 1j * q[..., y])

    def linear(self, speed: float) -> tuple[FloatArray, FloatArray]:
        """C and K at a speed, rad/s, shape (n, n) each; ValueError outside the knots."""
        if not self.knots[0] <= speed <= self.knots[-1]:
            raise ValueError(
                f"these equations hold from {self.knots[0]:.6g} to {self.knots[-1]:.6g} rad/s, not at "
                f"{speed:.6g} rad/s"
            )
        return self.around(speed)[:2]

    def around(self, speed: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """C and K at a speed and their derivatives by it, (n, n) each; beyond the knots as at their ends."""
        i = max(0, min(int(np.searchsorted(self.knots, speed, "right")) - 1, len(self.knots) - 2))
        over, past = max(self.knots[i + 1] - self.knots[i], 1e-9), speed - self.knots[i]
        C_speed, K_speed = ((each[i + 1] - each[i]) / over for each in (self.C, self.K))
        return self.C[i] + past * C_speed, self.K[i] + past * K_speed, C_speed, K_speed

    def acting(self, q: FloatArray, v: FloatArray, speed: float) -> tuple[FloatArray, ...]:
        """Forces that are not linear, F (n,), and their derivatives by q and v, (n, n), and Ω, (n,)."""
        n = self.size
        out = np.zeros(n), np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
        add_forces(*self.law_tables, q, v, speed, *out)
        return out

    def about(self, q: FloatArray, speed: float) -> tuple[FloatArray, FloatArray]:
        """C and K of small motion about rest in q, shape (n, n) each."""
        C, K = self.linear(speed)
        _, F_q, F_v, _ = self.acting(q, np.zeros(self.size), speed)
        return C - F_v, K - F_q


def system(
    linear: Callable[[float], fem.Motion],
    knots: FloatArray,
    *,
    forces: Sequence[NodeForce] = (),
    weight: Mapping[str, float] | None = None,
    unbalance: Mapping[int, complex] | None = None,
) -> MotionSystem:
    """Put together what moves; ValueError as `linear`, and for nodes that do not move.

    Parameters
    ----------
    linear, knots
        The equations of motion at a speed, rad/s; where their matrices may change slope, and both ends.
    forces
        What is not linear.
    weight
        N by coordinate.
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation.
    """
    motions = [linear(float(speed)) for speed in knots]
    names = motions[0].coordinates
    made = MotionSystem(
        coordinates=names,
        knots=np.asarray(knots, dtype=float),
        M=motions[0].M.copy(),
        C=np.array([motion.C for motion in motions]),
        K=np.array([motion.K for motion in motions]),
        forces=tuple(forces),
        weight=np.zeros(len(names)),
        unbalance=np.zeros(len(names), dtype=complex),
        bow=np.zeros(len(names), dtype=complex),
    )
    for force in forces:
        for i in made.index(force.node):
            made.M[i, i] += force.mass
    for name, force_there in (weight or {}).items():
        made.weight[motions[0].index(name)] += force_there
    for node, value in (unbalance or {}).items():
        made.unbalance[[*made.index(node)]] += value, -1j * value
    return made


def rotor_system(
    rotor: fem.Rotor | SmallModel,
    lowest: float,
    highest: float,
    *,
    unbalance: Mapping[int, complex] | None = None,
    bow: Mapping[int, complex] | None = None,
    gravity: float = GRAVITY,
    direction: float = -90.0,
) -> MotionSystem:
    """Put together what moves of a rotor at speeds from `lowest` to `highest`.

    Parameters
    ----------
    rotor
        With the forces at its nodes; or a small model.
    lowest, highest
        rad/s; the same for one speed alone.
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation; a small model has its own if there is none here.
    bow
        How far the shaft at rest deviates from a straight line by node, m, complex, at three nodes or more;
        between them it runs as a shaft does that is bent there. A small model has its own, too.
    gravity, direction
        m/s², and where it points, degrees from x with the rotation; −y by default.

    Raises
    ------
    ValueError
        Speeds that are no range or outside a bearing table; nodes that do not exist; a bow at fewer than
        three nodes.
    """
    lowest, highest = number(lowest, "lowest speed"), number(highest, "highest speed")
    if lowest > highest:
        raise ValueError(f"the speeds must ascend, not from {lowest:.6g} to {highest:.6g} rad/s")
    inside = {s for support in rotor.supports for s in support.speeds if lowest < s < highest}
    if isinstance(rotor, SmallModel):
        names = tuple(f"x{node}" for node in rotor.nodes)
        stiffness, load = rotor.stiffness, rotor.weight / GRAVITY
        unbalance = rotor.unbalance if unbalance is None else unbalance
        bow = rotor.bow if bow is None else bow
    else:
        undamped = np.zeros_like(rotor.material_damping)
        shaft = replace(rotor.linear, supports=(), material_damping=undamped)
        plane = fem.equations_of_motion(shaft, plane="x")
        names, stiffness = plane.coordinates, plane.K
        load = plane.M @ np.array([name[0] == "x" for name in names], dtype=float)

    def linear(speed: float) -> fem.Motion:
        if isinstance(rotor, SmallModel):
            return rotor.motion(speed)
        return fem.equations_of_motion(rotor.linear, speed=speed)

    knots = np.array([lowest, *sorted(inside), highest])
    made = system(linear, knots, forces=rotor.forces, unbalance=unbalance)
    planes = np.array(
        [[made.coordinates.index(name.replace("x", axis, 1)) for name in names] for axis in "xy"]
    )
    angle = np.radians(number(direction, "direction", signed=True))
    way = np.round([np.cos(angle), np.sin(angle)], 15)  # straight down is straight down
    made.weight[planes] = number(gravity, "gravity") * np.outer(way, load)
    at = np.array([names.index(f"x{rotor.node(node)}") for node in bow or {}], dtype=np.intp)
    if 0 < len(at) < 3:
        raise ValueError("a bow needs three nodes or more: through two of them a straight shaft passes")
    if bow:  # (K_bb − K_bo K_oo⁻¹ K_ob) times the bow bends the straight shaft as it is bent at rest
        bent = (stiffness @ followers(stiffness, at))[at] @ np.array([*bow.values()])
        made.bow[planes[:, at]] = np.outer([1, -1j], bent)
    return without_followers(made) if isinstance(rotor, SmallModel) else made


def without_followers(system: MotionSystem) -> MotionSystem:
    """Without the unknowns that have no mass, damping or force of their own: they follow the others at rest.

    They stay where their stiffness depends on speed.
    """
    moves = np.array(system.M.any(axis=0) | system.C.any(axis=(0, 1)) | system.C.any(axis=(0, 2)))
    moves[system.law_tables[2]] = True
    if moves.all() or np.ptp(system.K[:, ~moves], axis=0).any():
        return system
    kept = np.flatnonzero(moves)
    return _in_basis(system, followers(system.K[0], kept), tuple(system.coordinates[i] for i in kept))


def followers(K: FloatArray, kept: IndexArray) -> FloatArray:
    """Deflections of all unknowns by those k that are kept, where no force acts on the others, (n, k)."""
    T = np.zeros((len(K), len(kept)))
    others = np.setdiff1d(np.arange(len(K)), kept)
    T[kept, np.arange(len(kept))] = 1.0
    T[others] = -np.linalg.solve(K[np.ix_(others, others)], K[np.ix_(others, kept)])
    return T


def _in_basis(system: MotionSystem, T: FloatArray, coordinates: tuple[str, ...]) -> MotionSystem:
    """The system with the unknowns q = T r, r named anew."""
    return replace(
        system,
        coordinates=coordinates,
        **{name: T.T @ getattr(system, name) @ T for name in "MCK"},
        **{name: T.T @ getattr(system, name) for name in ("weight", "unbalance", "bow")},
    )


def reduced_system(system: MotionSystem, nodes: Sequence[int], modes: int | None = None) -> MotionSystem:
    """Keep some nodes, those of forces, feet of pedestals, and so many modes, `mode_1` …, between them.

    Parameters
    ----------
    system
        All unknowns.
    nodes
        To be kept, besides those of forces.
    modes
        In both planes together; None: as many as bring the error down to `ENOUGH`.

    Raises
    ------
    ValueError
        For nodes that do not move, and more modes than there are.
    """
    from scipy.linalg import eigh

    kept_nodes = sorted({*nodes, *(force.node for force in system.forces)})
    feet = [i for i, name in enumerate(system.coordinates) if name.startswith("foot")]
    kept = np.array([*(i for node in kept_nodes for i in system.index(node)), *feet], dtype=np.intp)
    others = np.setdiff1d(np.arange(system.size), kept)
    if modes is not None and not 0 <= modes <= others.size:
        raise ValueError(f"modes: from 0 to {others.size} between the kept nodes, not {modes}")
    K, M, n = (system.K[0] + system.K[0].T) / 2, system.M, len(kept)
    inner = np.ix_(others, others)
    still = np.zeros((system.size, others.size))
    still[others] = eigh(K[inner], M[inner])[1]
    T = np.hstack((followers(K, kept), still))
    K, M = T.T @ K @ T, T.T @ M @ T

    def frequencies(size: int) -> FloatArray:
        squares = eigh(K[:size, :size], M[:size, :size], eigvals_only=True)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    full = frequencies(system.size)
    bends, end = np.searchsorted(full, (_RIGID * full[-1], 2 * system.knots[-1])).tolist()
    end = max(end, min(bends + 2, full.size))

    def error(modes: int) -> float:
        few = frequencies(n + modes)[bends:end]
        return float(np.max(few / full[bends:end] - 1.0, initial=0.0)) if len(few) == end - bends else np.inf

    if modes is None:  # in pairs of both planes
        modes = next((few for few in range(0, others.size, 2) if error(few) <= ENOUGH), others.size)
    names = (*(system.coordinates[i] for i in kept), *(f"mode_{k + 1}" for k in range(modes)))
    return replace(_in_basis(system, T[:, : n + modes], names), modes=modes, frequency_error=error(modes))


@compiled_part
def add_forces(  # noqa: PLR0913  what is compiled takes no objects
    codes: IndexArray,
    values: FloatArray,
    places: IndexArray,
    q: FloatArray,
    v: FloatArray,
    speed: float,
    F: FloatArray,
    F_q: FloatArray,
    F_v: FloatArray,
    F_speed: FloatArray,
) -> None:
    """Add the forces of `MotionSystem.law_tables` to F and their derivatives to F_q, F_v and F_speed."""
    out = np.empty((2, 6))
    for f in range(len(codes)):
        ix, iy = places[f, 0], places[f, 1]
        law(codes[f], values[f], q[ix], q[iy], v[ix], v[iy], speed, out)
        for row in range(2):
            i = ix if row == 0 else iy
            F[i] += out[row, 0]
            F_q[i, ix] += out[row, 1]
            F_q[i, iy] += out[row, 2]
            F_v[i, ix] += out[row, 3]
            F_v[i, iy] += out[row, 4]
            F_speed[i] += out[row, 5]
