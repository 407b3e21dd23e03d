"""The conservative rotor K φ = λ M φ, λ = ω², that critical speeds and receptances start from.

At synchronous whirl the gyroscopic moment is an inertia: forward, z = Z e^{iωt}, the mass is M − G, backward
M + G. Either is real and symmetric; M − G may be indefinite (thin discs), and then some forward modes have
λ < 0: no critical speed. Forward and backward amplitudes are uncoupled on rotationally symmetric supports.
On other supports x = F + b, y = −i (F − b), and a support matrix D of (x, y) acts on (F, b) as T⁻¹ D T with
T = [[1, 1], [−i, i]]: Hermitian, if D is real and symmetric. Pedestals add unknowns of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem.matrices.banded_matrices import Matrices, multiply, shaft_energy
from fem.model.rotor import Rotor, Support
from fem.model.supports import Pedestal
from rotorid.base.arrays import AnyArray, FloatArray, IndexArray

Whirl = Literal[-1, 0, 1]  # backward, without gyroscopic effect, forward

NO_MASS = (
    "the rotor can move as a rigid body without moving any mass: give the shaft a density, or add supports"
)
TO_XY = np.array([[1, 1], [-1j, 1j]])  # (x, y) from (F, b)
FROM_XY = np.array([[0.5, 0.5j], [0.5, -0.5j]])


@dataclass(frozen=True, eq=False)
class Pencil:
    """Bands of stiffness and mass, and what is known beyond them.

    Attributes
    ----------
    rotor, matrices
        What it describes.
    stiffness, mass
        Upper bands, shape (width + 1, size); Hermitian, the stiffness not negative.
    energy
        Twice the potential energy of each column, with few digits lost.
    rigid
        Motions that strain nothing, shape (size, r).
    springs
        Sum of what holds the rotor, N/m.
    waves
        Unknowns that are deflections, shape (planes, N): forward and backward.
    tilts
        Those that are slopes.
    definite
        Whether the mass is known to be positive semidefinite.
    """

    rotor: Rotor
    matrices: Matrices
    stiffness: AnyArray
    mass: AnyArray
    energy: Callable[[AnyArray], FloatArray]
    rigid: AnyArray
    springs: float
    waves: IndexArray
    tilts: IndexArray
    definite: bool

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.stiffness.shape[1])


def whirling_mass(A: Matrices, whirl: Whirl) -> FloatArray:
    """M − G forward, M + G backward, M at rest."""
    return A.mass - whirl * A.gyroscopic if whirl else A.mass


def one_plane(rotor: Rotor, A: Matrices, whirl: Whirl = 0, springs: dict[int, float] | None = None) -> Pencil:
    """Pencil of one plane, on given springs {node: N/m}; by default on the stiffness of plain supports."""
    if springs is None:
        held = [_Spring(s.node, s.stiffness * np.eye(2)) for s in rotor.supports if s.plain and s.stiffness]
    else:
        held = [_Spring(node, k * np.eye(2)) for node, k in springs.items() if k]
    return _pencil(rotor, A, (whirl,), held)


def static_stiffness(support: Support, speed: float) -> FloatArray:
    """Symmetric part of a support's stiffness without its pedestal, N/m, shape (2, 2).

    The antisymmetric part (kxy − kyx)/2 does work over an orbit, as damping does: it belongs to no
    conservative rotor.
    """
    k = support.at(speed)[0]
    return np.asarray((k + k.T) / 2)


def whole_rotor(rotor: Rotor, A: Matrices, speed: float = 0.0) -> Pencil:
    """Pencil of the synchronous conservative rotor with all its supports as they are at a speed.

    One plane, forward, where the supports are rotationally symmetric, else both. Unknowns of pedestals
    stand beside those of their node.
    """
    whirls: tuple[Whirl, ...] = (1,) if rotor.symmetric else (1, -1)
    springs = [_Spring(s.node, static_stiffness(s, speed), s.pedestal) for s in rotor.supports]
    return _pencil(rotor, A, whirls, [spring for spring in springs if spring.k.any()])


@dataclass(frozen=True, eq=False)
class _Spring:
    """What holds a node: symmetric stiffness in (x, y), N/m, shape (2, 2), to the ground or to a pedestal."""

    node: int
    k: FloatArray
    pedestal: Pedestal | None = None


def _pencil(rotor: Rotor, A: Matrices, whirls: Sequence[Whirl], springs: list[_Spring]) -> Pencil:
    planes = len(whirls)
    pedestals = [(s.node, s.pedestal.mass) for s in springs if s.pedestal is not None]
    skew = any(s.k[0, 1] or s.k[1, 0] for s in springs)
    dtype = complex if skew and planes == 2 else float
    shaft, stands = _places(A, [node for node, _ in pedestals], planes)
    size = shaft.size + stands.size
    width = int((shaft[0, A.width :] - shaft[0, : -A.width]).max()) + planes - 1
    K, M = (np.zeros((width + 1, size), dtype=dtype, order="F") for _ in range(2))
    for places, whirl in zip(shaft, whirls, strict=True):
        _add_band(K, A.shaft, places)
        _add_band(M, whirling_mass(A, whirl), places)
    forms = list(_forms(springs, shaft[:, A.deflections], stands, dtype))
    for unknowns, form in forms:
        _add_form(K, form, unknowns)
    M[width, stands] += np.array([mass for _, mass in pedestals])

    def energy(X: AnyArray) -> FloatArray:
        total = np.zeros(X.shape[1])
        for places in shaft:
            Y = X[places]
            total = total + shaft_energy(rotor, Y.real)
            if dtype is complex:
                total = total + shaft_energy(rotor, Y.imag)
        for unknowns, form in forms:
            Y = X[unknowns]
            total = total + (Y.conj() * (form @ Y)).real.sum(axis=0)
        return np.asarray(total)

    motions = _whirling_rigid(rotor, A, springs, dtype, planes)
    rigid = np.zeros((size, motions.shape[2]), dtype=dtype)
    rigid[shaft] = motions
    return Pencil(
        rotor=rotor,
        matrices=A,
        stiffness=K,
        mass=M,
        energy=energy,
        rigid=rigid,
        springs=sum(float(np.trace(s.k)) / 2 for s in springs),
        waves=shaft[:, A.deflections],
        tilts=shaft[:, A.deflections + 1],
        definite=not any(whirls) or not rotor.model.gyroscopic,
    )


def _places(A: Matrices, pedestals: list[int], planes: int) -> tuple[IndexArray, IndexArray]:
    """Where unknowns of the shaft stand, (planes, size), and of pedestals at nodes, (planes, pedestals)."""
    at = [A.deflection(node) for node in pedestals]
    place = np.arange(A.size)
    for i in at:
        place[i + 1 :] += 1
    stands = np.array([place[i] + 1 + at[:k].count(i) for k, i in enumerate(at)], dtype=np.intp)
    plane = np.arange(planes)[:, None]
    return planes * place + plane, planes * stands + plane


def _add_band(band: AnyArray, source: FloatArray, places: IndexArray) -> None:
    """Add the band of one plane where its unknowns stand."""
    if band.shape == source.shape:  # there are no others
        band += source
        return
    width, own, size = len(band) - 1, len(source) - 1, len(places)
    for above in range(own + 1):
        rows, columns = places[: size - above], places[above:]
        band[width + rows - columns, columns] += source[own - above, above:]


def _add_form(band: AnyArray, form: AnyArray, unknowns: IndexArray) -> None:
    """Add a Hermitian form of a few unknowns."""
    for a, i in enumerate(unknowns):
        for b, j in enumerate(unknowns):
            if i <= j:
                band[len(band) - 1 + i - j, j] += form[a, b]


def _forms(
    springs: list[_Spring], nodes: IndexArray, stands: IndexArray, dtype: type
) -> Iterator[tuple[IndexArray, AnyArray]]:
    """Unknowns and Hermitian form, on (F, b) or on F alone, of each bearing and pedestal."""
    planes, seats = len(nodes), iter(stands.T)

    def turned(k: FloatArray) -> AnyArray:
        form = np.asarray(FROM_XY @ k @ TO_XY)[:planes, :planes]
        return form.real if dtype is float else form

    for s in springs:
        node, form = nodes[:, s.node - 1], turned(s.k)
        if s.pedestal is None:
            yield node, form
            continue
        own = next(seats)
        yield np.concatenate((node, own)), np.block([[form, -form], [-form, form]])
        yield own, turned(np.diag(s.pedestal.xy("stiffness")))


def _whirling_rigid(rotor: Rotor, A: Matrices, springs: list[_Spring], dtype: type, planes: int) -> AnyArray:
    """Rigid motions of the shaft that strain no support: F, or F and b, shape (planes, size, r)."""
    if planes == 1:
        return _rigid(rotor, A, [(s.node, np.ones(1)) for s in springs], 1)[0][None]
    constraints = []
    for s in springs:
        values, directions = np.linalg.eigh(s.k)
        stiff = np.abs(values) > 1e-12 * np.abs(values).max()
        constraints += [(s.node, direction) for direction in directions.T[stiff]]
    x, y = _rigid(rotor, A, constraints, 2)
    # A motion in y alone is as good with any phase; one of them makes (F, b) real.
    turned = (1j if dtype is complex else 1) * y
    return np.stack((x + turned, x - turned)) / 2


def _rigid(
    rotor: Rotor, A: Matrices, constraints: list[tuple[int, FloatArray]], planes: int
) -> tuple[FloatArray, FloatArray]:
    """Rigid motions, (size, r), in x and in y (one plane: 0) that leave every (node, direction) in place."""
    if constraints and planes == 1 and len({node for node, _ in constraints}) > 1:
        none = np.zeros((A.size, 0))
        return none, none
    translation, tilt = np.zeros(A.size), np.zeros(A.size)
    translation[A.deflections] = 1.0
    span = float(rotor.positions[-1])
    tilt[A.deflections], tilt[A.deflections + 1] = rotor.positions / span, 1.0 / span
    rows = [np.kron(direction, [1.0, rotor.positions[node - 1] / span]) for node, direction in constraints]
    if any(support.tilting_stiffness for support in rotor.supports):
        rows += list(np.kron(np.eye(planes), [0.0, 1.0]))
    basis = np.eye(2 * planes)
    if rows:
        _, s, V = np.linalg.svd(np.array(rows))
        basis = V[int(np.count_nonzero(s > 1e-9 * s[0])) :].T
    motions = np.column_stack((translation, tilt))
    x = motions @ basis[:2]
    if planes == 1:
        return x, np.zeros_like(x)
    return x, motions @ basis[2:]


def orthonormal_rigid(pencil: Pencil) -> tuple[AnyArray, FloatArray]:
    """Rigid motions that are orthogonal in the mass, scaled to |rᵀ M r| = 1 kg, and the sign of each."""
    R = np.array(pencil.rigid)
    signs = np.ones(R.shape[1])
    for k in range(R.shape[1]):
        # The translation comes first, then what turns about the centre of mass.
        for j in range(k):
            R[:, k] -= R[:, j] * (signs[j] * (R[:, j].conj() @ multiply(pencil.mass, R[:, k : k + 1])[:, 0]))
        inertia = float((R[:, k].conj() @ multiply(pencil.mass, R[:, k : k + 1])[:, 0]).real)
        largest = float(np.max(np.abs(R[pencil.waves.ravel(), k]) ** 2))
        if abs(inertia) <= 1e-14 * pencil.rotor.total_mass * largest:
            raise ValueError(NO_MASS)
        R[:, k] /= np.sqrt(abs(inertia))
        signs[k] = np.sign(inertia)
    return R, signs
