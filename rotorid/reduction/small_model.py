"""A few masses on a massless shaft with its supports and other forces: the small model, and what it does.

The deflections of some nodes are kept, those of the masses and of all supports and forces; between them the
shaft hangs statically. With T the static shapes of the shaft, one column for a unit deflection of each kept
node (all others held), the equations of `fem.assembly` in the basis T read, per plane with M = diag(m)
(zero where only a support or a force acts), B = Tᵀ B T, G = Tᵀ G T, K = Tᵀ K T and rotation from x to y,

    x:  M x'' + (B + C) x' + Ω G y' + K x + Ω B y + supports = f_x
    y:  M y'' + (B + C) y' − Ω G x' + K y − Ω B x + supports = f_y.

Supports and pedestals stand at their places and act as in the whole rotor, so that they stay parameters of
the small model. C is the damping of the surroundings: it does not turn.

A model that keeps its supports: bearings and films are held rigidly while formula (50) gives the masses, as
if they were simple supports: then the masses are those of the shaft, whatever it runs on, and what the
formula cannot see, the mass that these supports hold at rest, stands at them. It is shared so that mass and
centre of mass of the model are the rotor's: with two supports that is one way only, with more the nearest
to the shares of static condensation, 1ᵀ M T. The model is then that of Craig and Bampton with masses
instead of modes: exact for what the supports carry, and near to the rotor on supports from soft to stiff.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

import fem
from fem import GRAVITY, JournalBearing, NodeForce, SqueezeFilm, StateSpace, Whirl, solve_modes
from fem.assembly import (
    Reduced,
    assemble,
    both_planes,
    free_motions,
    ignored_inertia,
    multiply,
    project,
    rounding_error,
)
from fem.forces import kind_of
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray, checked_speeds, number, read_only
from rotorid.base.text import counted, listing
from rotorid.reduction.condensation import held, static_shapes
from rotorid.reduction.masses import bending_stiffness, mass_nodes, natural_frequencies, plane_at_rest

LOST = 1e-3
"""Relative rounding error of a static shape."""
RIGID = 1e7
"""Stiffness of a rigid support by that of a shaft on two of them."""
NONE = 1e-12
"""Share of the largest entry below which damping, or a stiffness, is none."""
INFINITE = 1e13
"""Response times largest stiffness, per unit force: beyond, only rounding is left."""
POINTS, SAME = 61, 1e-6
"""Speeds over a range at which whirl is looked at, and relative distance of critical speeds that are one."""
_ROUNDING = 1e-5  # share of the largest entry that stands in few digits
_MATRICES = ("stiffness", "material_damping", "gyroscopic", "damping")


def _zero() -> FloatArray:
    return np.array(0.0)


@dataclass(frozen=True, eq=False)
class SmallModel(Answered):
    """Masses at nodes of a shaft that is given by its matrices, the same in both planes.

    Attributes
    ----------
    nodes
        Different numbers of the k nodes.
    masses
        kg, shape (k,); 0 where only a support or a force acts.
    weight
        N at 9.80665 m/s², shape (k,).
    stiffness
        K of the shaft, N/m, shape (k, k); symmetric and not negative, as the others.
    material_damping, gyroscopic, damping
        B, N·s/m, which turns with the shaft, G, kg, and C, N·s/m, of the surroundings, shape (k, k), or
        the number 0.
    supports, forces
        At these nodes.
    unbalance
        m e e^{iβ} by node, kg·m, β with the rotation.
    bow
        How far the shaft at rest deviates from a straight line by node, m, at three nodes or more.
    warnings
        What the reader must know.

    Raises
    ------
    ValueError
        For what no shaft has; the message begins with the attribute.
    """

    nodes: tuple[int, ...]
    masses: FloatArray
    weight: FloatArray
    stiffness: FloatArray
    material_damping: FloatArray = field(default_factory=_zero)
    gyroscopic: FloatArray = field(default_factory=_zero)
    damping: FloatArray = field(default_factory=_zero)
    supports: Sequence[fem.Support] = ()
    forces: Sequence[NodeForce] = ()
    unbalance: Mapping[int, complex] = field(default_factory=dict)
    bow: Mapping[int, complex] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        k = len(self.nodes)
        if not k or len(set(self.nodes)) != k:
            raise ValueError(f"nodes: different nodes, one at least, not {list(self.nodes)}")
        for name in ("masses", "weight", *_MATRICES):
            object.__setattr__(self, name, _array(name, getattr(self, name), k))
        if (self.masses < 0).any() or not self.masses.any():
            raise ValueError("masses: 0 or more, and not all of them 0")
        acting = *(support.node for support in self.supports), *(force.node for force in self.forces)
        for node in (*acting, *self.unbalance, *self.bow):
            self.node(node)
        if any(support.tilting_stiffness for support in self.supports):
            raise ValueError(
                "supports: a small model has no slopes; tilting stiffness belongs into the shaft's stiffness"
            )

    def node(self, name: str | int) -> int:
        """Number of a node, given as a number or as its text.

        Raises
        ------
        ValueError
            If the model has no such node.
        """
        if str(name) not in map(str, self.nodes):
            nodes = listing(map(str, self.nodes), "and")
            raise ValueError(f"node {name} does not exist: the small model has {nodes}")
        return int(name)

    @property
    def massive(self) -> tuple[int, ...]:
        """Nodes with a mass."""
        return tuple(node for node, mass in zip(self.nodes, self.masses, strict=True) if mass > 0)

    @property
    def stations(self) -> dict[str, int]:
        """None: its nodes have numbers alone."""
        return {}

    @property
    def symmetric(self) -> bool:
        """Whether no support distinguishes a direction."""
        return all(support.symmetric for support in self.supports)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the unknowns: x and y of the nodes, `x7` and `y7`, then pedestals, `foot_x1`."""
        stands = [i for i, support in enumerate(self.supports, start=1) if support.pedestal is not None]
        return (
            *(f"{axis}{node}" for axis in "xy" for node in self.nodes),
            *(f"foot_{axis}{i}" for axis in "xy" for i in stands),
        )

    def equations(self, *, complex_coordinate: bool | None = False) -> Reduced:
        """λ² M + λ D(Ω) + K(Ω) in the form of `fem.assembly`, of the linear model.

        `complex_coordinate`: of z = x + i y; None: where all supports are rotationally symmetric.
        """
        k = len(self.nodes)
        # a shaft that only carries the supports: its own matrices are replaced
        supports = [replace(each, node=self.nodes.index(each.node) + 1) for each in self.supports]
        carrier = fem.Rotor(np.ones(k), np.array(1.0), supports=supports)
        P = both_planes(carrier, complex_coordinate=complex_coordinate)
        basis = np.zeros((P.A.size, k))
        basis[P.A.deflections[:k], np.arange(k)] = 1.0
        Q, p = project(P, basis), P.planes
        along = np.eye(p)
        blocks = {
            "M": np.kron(along, np.diag(self.masses)),
            "D0": np.kron(along, self.material_damping + self.damping),
            "K0": np.kron(along, self.stiffness),
            "D1": np.kron(P.across, self.gyroscopic),
            "K1": np.kron(P.across, self.material_damping),
        }
        matrices: dict[str, Any] = {}
        for name, block in blocks.items():
            matrices[name] = np.array(getattr(Q, name))
            matrices[name][: p * k, : p * k] = block
        return replace(Q, **matrices)

    def motion(self, speed: float = 0.0, plane: str = "both", *, condensed: bool = False) -> fem.Motion:
        """The linear equations at a speed, without forces that are not linear.

        Parameters
        ----------
        speed
            rad/s; tables of supports are read there.
        plane
            "both", or "x" alone where nothing couples the planes.
        condensed
            Eliminate coordinates without mass, which is possible only where no damping acts on them, and
            exact but for gyroscopic moments: these follow the static shapes of shaft and supports then.

        Raises
        ------
        ValueError
            For an impossible speed or one outside a table, planes that are coupled, or damping on unknowns
            that are to be condensed.
        """
        if plane not in ("both", "x"):
            raise ValueError(f"no plane {plane!r}: it is 'both' or 'x'")
        speed = number(speed, "speed")
        Q, names = self.equations(), self.coordinates
        D, K = (matrix[0] for matrix in Q.at(np.array([speed])))
        inside = np.array([plane == "both" or "y" not in name for name in names])
        across = np.ix_(inside, ~inside)
        if D[across].any() or K[across].any():
            raise ValueError("the planes x and y of this rotor are coupled: take both")
        grid = np.ix_(inside, inside)
        kept = tuple(name for name, taken in zip(names, inside, strict=True) if taken)
        motion = fem.Motion(Q.M[grid], D[grid], K[grid], kept, speed)
        return without_massless(motion, speed * np.real(Q.D1[grid])) if condensed else motion

    def state_space(
        self,
        speed: float = 0.0,
        *,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
    ) -> StateSpace:
        """The model as s' = A s + B u, y = C s + D u at a speed, rad/s, both planes.

        Parameters
        ----------
        speed
            As in `motion`.
        inputs, outputs
            As in `fem.state_space`; by default forces on the masses and their deflections. Forces and
            deflections at the bearings have the names of their nodes, `f_x2` and `x2`.

        Raises
        ------
        ValueError
            As `motion` and `fem.state_space`.
        """
        masses = [f"{axis}{node}" for axis in "xy" for node in self.massive]
        return fem.state_space(
            self.motion(speed),
            inputs=[f"f_{name}" for name in masses] if inputs is None else inputs,
            outputs=masses if outputs is None else outputs,
        )

    def whirl(self, speeds: ArrayLike) -> Whirl:
        """All modes that oscillate, at each speed, rad/s, as `fem.threshold_of` takes them.

        Raises
        ------
        ValueError
            For a speed outside the table of a support.
        """
        omega, Q = checked_speeds(speeds), self.equations(complex_coordinate=None)
        # All: gyroscopic moments make also coordinates without mass oscillate, at high frequency.
        n = Q.size if Q.P.planes == 2 else 2 * Q.size
        K, on = np.abs(Q.at(omega[:1])[1][0].diagonal()), np.flatnonzero(self.masses)
        return solve_modes(Q, omega, n, float(np.sqrt(np.median(K[on] / self.masses[on]))))

    def critical_speeds(self, lowest: float, highest: float) -> FloatArray:
        """Speeds between two, rad/s, ascending, at which a mode whirls once a turn, either way."""
        speeds = np.linspace(lowest, highest, POINTS)
        for _ in range(3):  # of lines through two speeds each, the last between near ones
            gap = np.abs(self.whirl(speeds).values.imag) - speeds[:, None]
            i, k = np.nonzero((gap[:-1] > 0) != (gap[1:] > 0))
            part = gap[i, k] / (gap[i, k] - gap[i + 1, k])
            crossings = (speeds[i] + part * (speeds[i + 1] - speeds[i]))[np.isfinite(part)]
            speeds = np.union1d(speeds, crossings)
        crossings = np.sort(crossings)
        return crossings[np.diff(crossings, prepend=-1.0) > SAME * crossings]

    def deflections(self, speeds: FloatArray, unbalance: Mapping[int, complex]) -> ComplexArray:
        """Phasors of x, then y of the k nodes under unbalance as in `response`, m, shape (S, 2 k).

        ValueError where the model runs exactly at an undamped critical speed.
        """
        Q, k = self.equations(), len(self.nodes)
        D, K = Q.at(speeds)
        w, loads = speeds[:, None, None], np.zeros((Q.size, 1), complex)
        for node, amount in unbalance.items():
            i = self.nodes.index(self.node(node))
            loads[[i, k + i], 0] += np.array([1.0, -1j]) * amount
        try:
            X = np.linalg.solve(K - w * w * Q.M + 1j * w * D, w * w * loads)
        except np.linalg.LinAlgError:
            X = np.full((1, Q.size, 1), np.inf + 0j)
        size = np.abs(loads).max() * speeds.max() ** 2
        if not np.abs(X).max() * np.abs(K).max() <= INFINITE * size:
            raise ValueError(
                "the undamped model runs exactly at a critical speed, or nothing holds it: the response is "
                "infinite; leave out this speed"
            )
        return np.asarray(X[:, : 2 * k, 0])

    def response(self, speeds: ArrayLike, unbalance: Mapping[int, complex] | None = None) -> fem.Response:
        """Synchronous vibration of all nodes, as `fem.unbalance_response` gives that of a rotor.

        Parameters
        ----------
        speeds
            rad/s, one or many; tables of supports are read there.
        unbalance
            m e e^{iβ} by node, kg·m, β with the rotation; by default the model's own.

        Returns
        -------
        Its `rotor` is this model.

        Raises
        ------
        ValueError
            For impossible speeds, outside the table of a support, or exactly at an undamped critical speed;
            without unbalance, and for a model with forces that are not linear.
        """
        if self.forces:
            raise ValueError(
                "forces that are not linear act on this model: `rotorid motion` follows it, or `rotorid "
                "bearings --output` writes it with their linear coefficients"
            )
        omega, k = checked_speeds(speeds), len(self.nodes)
        if not (mounted := dict(self.unbalance if unbalance is None else unbalance)):
            raise ValueError("no unbalance is given: name at least one node")
        grows = fem.windows_of(self.whirl(np.unique(np.linspace(omega.min(), omega.max(), POINTS))))
        windows = tuple(one for one in grows if any(one.first <= w <= one.last for w in omega))
        bent = ("the bow of the model is left out: `rotorid motion` has it",) * bool(self.bow)
        warnings = (*self.warnings, *bent, *(window.sentence() for window in windows))

        def at(speeds: FloatArray) -> fem.Response:
            X = self.deflections(speeds, mounted)
            x, y = X[:, :k], X[:, k:]
            F, b, nodes = (x + 1j * y) / 2, (x - 1j * y) / 2, np.array(self.nodes)
            size = np.abs(F) + np.abs(b)
            largest = size.max(axis=1), nodes[size.argmax(axis=1)]
            rotor = cast(fem.Rotor, self)
            return fem.Response(speeds, F, mounted, rotor, warnings, b, *largest, nodes, at, windows)

        return at(omega)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; the file of the model has the rest."""
        return {
            "nodes": list(self.nodes),
            "masses_kg": self.masses.tolist(),
            "weight_N": self.weight.tolist(),
            "shaft_stiffness_N_per_m": self.stiffness.tolist(),
            "coordinates": list(self.coordinates),
            "warnings": list(self.warnings),
        }

    @property
    def answer(self) -> Answer:
        """Where its masses stand, and what acts on it."""
        acting = [f"{kind_of(force).replace('_', ' ')} at {force.node}" for force in self.forces]
        acting += [f"{support.kind} at {support.node}" for support in self.supports]
        masses = ", ".join(f"{m:.2f} at {n}" for n, m in zip(self.nodes, self.masses, strict=True) if m > 0)
        return Answer(
            f"Small model: {counted(len(self.nodes), 'node')} in both planes, masses in kg {masses}, in all "
            f"{self.masses.sum():.2f}, weight {self.weight.sum():.1f} N; {listing(acting, 'and') or 'free'}.",
            warnings=self.warnings,
        )


def _array(name: str, value: FloatArray, k: int) -> FloatArray:
    """Checked and read-only; the number 0 is a matrix of zeros."""
    shape = (k, k) if name in _MATRICES else (k,)
    array = np.array(value, dtype=float)
    if not array.ndim and array == 0:
        array = np.zeros(shape)
    if array.shape != shape or not np.isfinite(array).all():
        numbers = " × ".join(map(str, shape))
        raise ValueError(f"{name}: {numbers} finite numbers for {counted(k, 'node')}")
    if name in _MATRICES:
        rounding = _ROUNDING * np.abs(array).max()
        if np.abs(array - array.T).max() > rounding or np.linalg.eigvalsh(array)[0] < -rounding:
            raise ValueError(f"{name}: a symmetric matrix that has no negative eigenvalue")
    read_only(array)
    return array


def small_model(
    rotor: fem.Rotor, nodes: Sequence[int | str], masses: ArrayLike, *, modal_damping: Sequence[float] = ()
) -> SmallModel:
    """Put masses in place of a rotor's distributed mass; supports and forces stay where they are.

    Parameters
    ----------
    rotor
        With its supports and forces.
    nodes
        Where the masses stand: different node numbers, from 1, or names of stations.
    masses
        kg, all positive, shape (n,), as `equivalent_masses` estimates them.
    modal_damping
        Damping ratios ζ of the first modes of the plane x at rest on its springs, without masses of
        pedestals: C = Σ 2 ζ ω (M φ)(M φ)ᵀ / (φᵀ M φ), of the surroundings and the same in both planes.

    Returns
    -------
    The nodes of the masses come first, then those that only carry supports and forces.

    Raises
    ------
    ValueError
        For nodes that do not exist or repeat, masses that are not positive, too few kept nodes to hold the
        shaft, impossible damping ratios, or a mesh too fine for float64.

    Notes
    -----
    Gyroscopic moments act on slopes, and these follow the kept deflections statically: right to first order
    in the speed. Where discs with I_p = 0.02 m² × mass shift whirl frequencies by 3 %, 0.3 % is missing.
    Inertia of tilting is in the masses as far as they were fitted to modes that know it; none is added.
    """
    places = mass_nodes(rotor, nodes)
    m = np.array(masses, dtype=float)
    if m.shape != (len(places),):
        raise ValueError(f"{len(places)} nodes need as many masses, numbers in kg")
    others = {*(each.node for each in rotor.supports), *(each.node for each in rotor.forces)}
    model = condense(rotor, (*places, *sorted(others.difference(places))), dict(zip(places, m, strict=True)))
    damping = modal(rotor, places, m, modal_damping)
    return replace(model, damping=np.pad(damping, (0, len(model.nodes) - m.size)))


def condense(rotor: fem.Rotor, kept: tuple[int, ...], masses: Mapping[int, float]) -> SmallModel:
    """The small model whose nodes are these, with masses, kg, at some of them."""
    for place, mass in masses.items():
        if not (np.isfinite(mass) and mass > 0):
            way = "leave out this node" if mass == 0 else "use other nodes, more modes, or --nonnegative"
            raise ValueError(
                f"the mass at node {place} is {mass:.4g} kg, not positive: a physical model needs positive "
                f"masses; {way}"
            )
    linear, k = rotor.linear, len(kept)
    A = assemble(linear)
    T = _shaft_shapes(linear, A.shaft, np.array([A.deflection(node) for node in kept], dtype=np.intp))
    Q = project(both_planes(linear, complex_coordinate=False), T)
    ones = np.zeros((A.size, 1))
    ones[A.deflections] = 1.0
    remarks = [*ignored_inertia(rotor)]
    if rotor.model.gyroscopic:
        remarks.append(
            "gyroscopic moments act on slopes that follow the masses and supports statically: an "
            "approximation that gets worse with speed and for higher modes; compare with the rotor"
        )
    if rotor.model.rotary_inertia:
        remarks.append(
            "the inertia of tilting sections and discs is in the small model only as far as the masses were "
            "fitted to modes that know it; no moment of inertia is added"
        )
    return SmallModel(
        nodes=kept,
        masses=np.array([masses.get(node, 0.0) for node in kept]),
        weight=GRAVITY * (T.T @ multiply(A.mass, ones)[:, 0]),
        stiffness=_without_rounding(Q.K0[:k, :k], A.shaft[-1, A.deflections]),
        material_damping=_without_rounding(Q.D0[:k, :k], A.material[-1, A.deflections]),
        gyroscopic=np.real(Q.D1[:k, k : 2 * k]),
        supports=[replace(support, tilting_stiffness=0.0) for support in rotor.supports],
        forces=rotor.forces,
        warnings=tuple(remarks),
    )


def _without_rounding(matrix: FloatArray, whole: FloatArray) -> FloatArray:
    """Zero where all is rounding of the shaft's entries, as of two nodes, which nothing bends."""
    return matrix * float(np.abs(matrix).max() > NONE * np.abs(whole).max())


def _shaft_shapes(rotor: fem.Rotor, band: FloatArray, at: IndexArray) -> FloatArray:
    """Shapes of the shaft for a unit deflection of each kept node, at these unknowns, shape (size, k)."""
    if free_motions(rotor, set(at)):
        raise ValueError(
            "one node, with or without a mass, does not hold the shaft: it can turn about it; give masses or "
            "supports at two nodes at least, or tilting stiffness"
        )
    T, _ = static_shapes(band, at)
    X = T.copy()
    X[at] = 0.0
    K = held(band, at)
    if (rounding_error(K, X, (X.T @ multiply(K, X)).diagonal()) > LOST).any():
        raise ValueError(
            f"the static shapes of {rotor.n_elements} elements are lost in float64; join neighbouring "
            "elements (50 to 200 are ample for a rotor)"
        )
    return T


def modal(rotor: fem.Rotor, nodes: Sequence[int], m: FloatArray, ratios: Sequence[float]) -> FloatArray:
    """Damping matrix (n, n) of given ratios of the first modes of formula (50)'s model, the plane at rest."""
    zeta = np.array(ratios, dtype=float)
    if zeta.ndim != 1 or zeta.size > m.size or not ((zeta >= 0) & (zeta < 1)).all():
        raise ValueError(
            "modal_damping must be a list of damping ratios, one for each of the first modes, from 0 to "
            f"below 1 (0.02 is 2 %), not {ratios}; each plane has {m.size} modes"
        )
    if not zeta.any():
        return np.zeros((m.size, m.size))
    omega, shapes = natural_frequencies(fem.compliance(plane_at_rest(rotor, None)[0], nodes), m)
    if np.isnan(omega).any():
        raise ValueError(
            "the plane x at rest is pushed aside by a negative stiffness: no damping ratios exist"
        )
    momentum = m[:, None] * shapes
    sizes = 2 * omega / (shapes * momentum).sum(axis=0)
    first = momentum[:, : zeta.size]
    return np.asarray((first * (zeta * sizes[: zeta.size])) @ first.T)


def without_massless(motion: fem.Motion, gyroscopic: FloatArray) -> fem.Motion:
    """Eliminate the coordinates o without mass; the others are m.

    Without forces on them q_o = −K_oo⁻¹ K_om q_m, and K_mm − K_mo K_oo⁻¹ K_om is exact where no damping acts
    on q_o. The gyroscopic part G of C, shape (n, n), is taken along with the static shapes
    R = (1; −K_oo⁻¹ K_om) and, for the forces, L = (1, −K_mo K_oo⁻¹): L G R. ValueError where other damping
    acts on a coordinate without mass, or no stiffness holds it.
    """
    massive, K, damping = np.diag(motion.M) > 0, motion.K, np.abs(motion.C - gyroscopic)
    on, off = np.flatnonzero(massive), np.flatnonzero(~massive)
    touched = np.maximum(damping.max(axis=0), damping.max(axis=1))[off]
    if (bad := off[touched > NONE * max(np.abs(motion.C).max(), damping.max())]).size:
        raise ValueError(
            f"damping acts on {motion.coordinates[bad[0]]!r}, which has no mass: it cannot be condensed into "
            "stiffness; keep the supports, or take the state space"
        )
    Koo = K[np.ix_(off, off)]
    if off.size and np.linalg.cond(Koo) >= 1 / NONE:
        raise ValueError(
            "supports without mass can move without force: they cannot be condensed; give them stiffness"
        )
    L, R = np.eye(len(K))[on], np.eye(len(K))[:, on]
    R[off] = -np.linalg.solve(Koo, K[np.ix_(off, on)])
    L[:, off] = -np.linalg.solve(Koo.T, K[np.ix_(on, off)].T).T
    kept = tuple(motion.coordinates[i] for i in on)
    return fem.Motion(L @ motion.M @ R, L @ motion.C @ R, L @ K @ R, kept, motion.speed)


def held_nodes(rotor: fem.Rotor) -> tuple[int, ...]:
    """Nodes that hold a rotor: bearings with a stiffness, journal bearings and squeeze films.

    Parameters
    ----------
    rotor
        With its supports and forces.

    Returns
    -------
    Node numbers, ascending.
    """
    films = [force.node for force in rotor.forces if isinstance(force, (JournalBearing, SqueezeFilm))]
    springs = [s.node for s in rotor.supports if s.kind == "bearing" and s.table[0].any()]
    return tuple(sorted({*films, *springs}))


def held_rigidly(rotor: fem.Rotor) -> fem.Rotor:
    """The rotor on rigid supports at its bearings, journal bearings and squeeze films, without all else.

    Parameters
    ----------
    rotor
        With its supports and forces.

    Raises
    ------
    ValueError
        If these are fewer than two.
    """
    nodes = held_nodes(rotor)
    if len(nodes) < 2:
        raise ValueError(
            "to keep the supports, the masses are found with the shaft held rigidly at its bearings, journal "
            f"bearings and squeeze films: two nodes at least are needed, this rotor has {len(nodes)}"
        )
    stiffness = RIGID * bending_stiffness(rotor)
    tilting = {node: sum(s.tilting_stiffness for s in rotor.supports if s.node == node) for node in nodes}
    return replace(
        rotor,
        supports=[fem.Support(node, stiffness, tilting_stiffness=tilting[node]) for node in nodes],
        forces=(),
    )


def check_free(held: Sequence[int], nodes: Sequence[int]) -> None:
    """Refuse masses where the shaft is held.

    Parameters
    ----------
    held, nodes
        Where it is held, and where masses shall stand.

    Raises
    ------
    ValueError
        For a node that is both.
    """
    if both := [node for node in nodes if node in held]:
        raise ValueError(
            f"node {both[0]} is held rigidly while the masses are found, so none can be found there: leave "
            "it out of --nodes; it is kept with its bearing, and with its share of the rotor's mass"
        )


def keep_supports(
    rotor: fem.Rotor, nodes: Sequence[int], masses: FloatArray, *, modal_damping: Sequence[float] = ()
) -> SmallModel:
    """Condense a shaft to its masses, supports and forces; nodes of the model ascend.

    Parameters
    ----------
    rotor
        With its supports and forces.
    nodes, masses
        As estimated on `held_rigidly`, n of them.
    modal_damping
        Damping ratios of the first modes on rigid supports; of the surroundings, in both planes alike.

    Raises
    ------
    ValueError
        As `small_model`, and for a mass at a node that was held.
    """
    rigid = held_nodes(rotor)
    check_free(rigid, nodes)
    kept = sorted({*nodes, *(s.node for s in rotor.supports), *(force.node for force in rotor.forces)})
    model = condense(rotor, tuple(kept), dict(zip(nodes, masses.tolist(), strict=True)))
    every, z, damping = model.masses.copy(), rotor.positions, np.zeros_like(model.stiffness)
    at, rest = z[np.array(kept) - 1], np.flatnonzero(np.isin(kept, rigid))
    shaft = rotor.density * rotor.area * rotor.length * (z[:-1] + z[1:]) / 2
    moment = float(shaft.sum() + sum(disc.mass * z[disc.node - 1] for disc in rotor.discs))
    lacking = rotor.total_mass - every.sum(), moment - float(every @ at)
    every[rest] = _shared(model.weight[rest] / GRAVITY, at[rest], *lacking)
    if modal_damping:
        places = [kept.index(node) for node in nodes]
        damping[np.ix_(places, places)] = modal(held_rigidly(rotor), nodes, masses, modal_damping)
    model = replace(model, masses=every, damping=damping)
    return replace(model, warnings=(*model.warnings, *_of_masses(rotor, model)))


def _shared(shares: FloatArray, at: FloatArray, mass: float, moment: float) -> FloatArray:
    """Masses of this sum and this first moment about 0, the nearest to `shares`, each a tenth of it at least.

    Where that cannot be, sum and moment are the nearest.
    """
    from scipy.optimize import lsq_linear

    first = 1e7  # weight of mass and moment by that of the shares
    largest = np.abs(shares).max()  # an overhang or a mass nearby may lift what a node carries
    scale = np.sqrt(np.maximum(shares, 1e-3 * largest))
    length = float(np.ptp(at))
    rows = first * np.stack((np.ones_like(at), (at - at.mean()) / length)) * scale
    wanted = first * np.array([mass, (moment - mass * at.mean()) / length])
    least = np.maximum(0.1 * shares, 0.01 * largest) / scale
    solved = lsq_linear(
        np.vstack((rows, np.eye(len(at)))),
        np.concatenate((wanted, shares / scale)),
        bounds=(least, np.inf),
        method="bvls",
        tol=1e-14,
    )
    return np.asarray(scale * solved.x)


def _of_masses(rotor: fem.Rotor, model: SmallModel) -> list[str]:
    """What is wrong with the masses of a model that keeps its supports, in words."""
    remarks, total = [], rotor.total_mass
    if abs(model.masses.sum() / total - 1) > 1e-9:
        remarks.append(
            "the masses are too large to leave some for the supports: together "
            f"{model.masses.sum():.1f} kg of the rotor's {total:.1f} kg; use other nodes or more modes"
        )
    if bare := [str(node) for node in model.nodes if node not in model.massive]:
        remarks.append(
            f"no mass stands at node {listing(bare, 'and')}, where supports or forces act: the shaft follows "
            "there without inertia; better let a mass stand there, with --nodes"
        )
    return remarks
