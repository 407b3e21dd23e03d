"""The equations of motion of a rotor: matrices of one plane in bands, and both planes in a basis or whole.

Unknowns of one plane: `stride` per node, the deflection w (m) first, then the tilt θ (rad); with `shear` two
shear angles of the element to the right follow, and the last node has w and θ only. Both planes have the
same real symmetric matrices M, K of the shaft, G (polar inertia on the tilts) and B = Σ β K of the elements.
With rotation from x to y at the speed Ω and z = x + i y

    M z'' + (B − i Ω G) z' + (K − i Ω B) z + supports = f:

    x:  M x'' + B x' + Ω G y' + K x + Ω B y + supports = f_x
    y:  M y'' + B y' − Ω G x' + K y − Ω B x + supports = f_y.

Supports are matrices of (x, y) at their nodes: force −k (x, y) − c (x', y'). Internal damping at a node,
F = −c (z' − i Ω z), is the same as material damping there, c in the place of B: a support of damping c and of
stiffness Ω c ((0, 1), (−1, 0)). On a forward orbit z = e^{iωt} it does the work of −i c (ω − Ω): it damps
below and drives above the speed of the whirl. Where every support is rotationally symmetric, z takes half of
the unknowns, with scalars k = kxx − i kxy and c = cxx − i cxy. A pedestal is one more unknown in each plane.

Synchronous motion z = F e^{iωt} + b̄ e^{−iωt} has x = F + b, y = −i (F − b), so that a matrix D of (x, y) acts
on (F, b) as T⁻¹ D T with T = [[1, 1], [−i, i]]. A load f that turns with the rotor is f on x and −i f on y.
With the same F and b at any complex λ, x = (F + b) e^{λt}, the shaft does not couple them: it is
λ² M − i λ Ω G + (λ − i Ω) B + K on F, and with i Ω in the place of −i Ω on b; at λ = i Ω these are
K − Ω² (M − G) and K − Ω² (M + G) + 2 i Ω B.

Symmetric bands are kept as LAPACK does, upper form: `band[width + i - j, j]` is entry (i, j) for i ≤ j.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fem.elements import dense as dense
from fem.elements import multiply as multiply
from fem.elements import shaft_bands, strains
from fem.forces import InternalDamping, kind_of
from fem.result import holding_arrays
from fem.rotor import Rotor, Support
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IndexArray

TO_XY = np.array([[1, 1], [-1j, 1j]])  # (x, y) from (F, b)
FROM_XY = np.array([[0.5, 0.5j], [0.5, -0.5j]])
_TURN = np.kron(FROM_XY, TO_XY.T).T


@holding_arrays
class Matrices:
    """The assembled rotor, one plane.

    Attributes
    ----------
    shaft
        Stiffness of the shaft (and tilting springs) without the supports' stiffness, upper band of shape
        (width + 1, size).
    mass
        Shaft and discs; tilting inertia if the model has `rotary_inertia`.
    gyroscopic
        G, polar inertia of shaft and discs on the slopes; zero unless the model has `gyroscopic`.
    material
        B, Σ β K of the elements, and internal damping at nodes.
    stride
        Unknowns per node.
    """

    shaft: FloatArray
    mass: FloatArray
    gyroscopic: FloatArray
    material: FloatArray
    stride: int

    @property
    def width(self) -> int:
        """Entries of a band above its diagonal."""
        return len(self.shaft) - 1

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.shaft.shape[1])

    def deflection(self, node: int) -> int:
        """Unknown, from 0, of the deflection of a node, from 1; that of its slope is the next."""
        return self.stride * (node - 1)

    @property
    def deflections(self) -> IndexArray:
        """Unknowns of the deflections of all nodes, shape (N,)."""
        return np.arange(0, self.size, self.stride)


def assemble(rotor: Rotor) -> Matrices:
    """Matrices of a rotor.

    Raises
    ------
    ValueError
        For a rotor with forces that are not linear.
    """
    model = rotor.model
    K, M, G, B = shaft_bands(rotor)
    A = Matrices(K, M, G, B, 4 if model.shear else 2)
    for disc in rotor.discs:
        w = A.deflection(disc.node)
        M[-1, w] += disc.mass
        if model.rotary_inertia:
            M[-1, w + 1] += disc.diametral_inertia
        if model.gyroscopic:
            G[-1, w + 1] += disc.polar_inertia
    for support in rotor.supports:
        K[-1, A.deflection(support.node) + 1] += support.tilting_stiffness
    for force in rotor.forces:
        if not isinstance(force, InternalDamping):
            kind = kind_of(force).replace("_", " ")
            raise ValueError(
                f"the {kind} at node {force.node} is not linear, and this asks for linear equations: "
                "write the coefficients of all such forces at rest first, `rotorid bearings ROTOR --speeds "
                "A:B --output linear.toml`, or take rotor.linear, which leaves them out"
            )
        B[-1, A.deflection(force.node)] += force.damping
    return A


def free_motions(rotor: Rotor, held: set[int]) -> int:
    """Number of rigid-body motions, of 2, left by springs at the nodes `held` and by tilting springs."""
    tilting = any(support.tilting_stiffness > 0 for support in rotor.supports)
    return max(2 - len(held) - tilting, 0)


def rounding_error(band: FloatArray, X: AnyArray, energy: FloatArray) -> FloatArray:
    """Relative error of xᴴ K x that rounding the entries of K may cause, for each column of X, shape (m,).

    It grows with the fourth power of the number of elements: about 1e-13 at 20, 1e-5 at 2000. Solutions
    of K x = f are wrong by as much. The `energy` is xᴴ K x.
    """
    size = abs(X)
    scatter = (size * multiply(abs(band), size)).sum(axis=0)
    return np.asarray(math.ulp(1.0) * scatter / np.maximum(energy, 1e-300))


def ignored_inertia(rotor: Rotor) -> tuple[str, ...]:
    """One warning for each kind of moments of inertia of the discs that the model leaves out."""
    effects = {
        "diametral": ("rotary inertia", rotor.model.rotary_inertia),
        "polar": ("gyroscopic effect", rotor.model.gyroscopic),
    }
    return tuple(
        f"disc at node {', '.join(map(str, nodes))}: {kind} inertia is ignored, the model has no {effect}"
        for kind, (effect, counted) in effects.items()
        if (nodes := [disc.node for disc in rotor.discs if getattr(disc, f"{kind}_inertia")]) and not counted
    )


def internal_damping(rotor: Rotor) -> list[InternalDamping]:
    """Those of the forces at nodes that are internal damping, which turns with the shaft."""
    return [force for force in rotor.forces if isinstance(force, InternalDamping)]


def on_waves(D: AnyArray) -> ComplexArray:
    """Matrices of (x, y) as they act on (F, b), shape (…, 2, 2)."""
    # As one product: many products of 2 × 2 matrices take ten times as long.
    return (D.reshape(-1, 4) @ _TURN).reshape(D.shape)


@holding_arrays
class Supported:
    """Dynamic stiffness at the supported nodes at synchronous vibration, all that stands at a node added up.

    Attributes
    ----------
    nodes
        Numbers from 1, length s.
    stiffness
        D on forward and backward amplitudes (F, b), N/m, shape (S, s, 2, 2); on rotationally symmetric
        supports only entry (0, 0) matters.
    planes
        1: forward only; 2: forward and backward are coupled.
    """

    nodes: tuple[int, ...]
    stiffness: ComplexArray
    planes: int

    @property
    def springs(self) -> dict[int, float]:
        """Real spring nearest to D at each node, N/m; 0 for what is mostly negative."""
        middle = np.sort(self.stiffness[..., 0, 0].real, axis=0)[len(self.stiffness) // 2]
        return dict(zip(self.nodes, np.maximum(middle, 0.0).tolist(), strict=True))


def supported(rotor: Rotor, speeds: FloatArray) -> Supported:
    """Dynamic stiffness of all supports, and of internal damping at nodes, at speeds in rad/s.

    Internal damping takes no part in forward whirl, which does not strain what turns with the shaft.

    Raises
    ------
    ValueError
        If a speed lies outside a bearing table.
    """
    dampers = internal_damping(rotor)
    attached = [support.node for support in rotor.supports] + [damper.node for damper in dampers]
    nodes = tuple(dict.fromkeys(attached))
    stiffness = np.zeros((len(nodes), 2, 2, speeds.size), complex)
    for support in rotor.supports:
        at = stiffness[nodes.index(support.node)]
        if support.constant and not support.pedestal:  # linear in the speed
            k, c = on_waves(support.table)[:, 0, ..., None]
            at += k + c * (1j * speeds)
        else:
            at += np.moveaxis(on_waves(support.dynamic_stiffness(speeds)), 0, -1)
    for damper in dampers:
        stiffness[nodes.index(damper.node), 1, 1] += 2j * damper.damping * speeds
    return Supported(nodes, stiffness.transpose(3, 0, 1, 2), 1 if rotor.symmetric else 2)


def whirl_change(more: Support, less: Support, speeds: FloatArray) -> ComplexArray:
    """The differential between two neighbouring supports on (F, b), no digits lost to the pedestal.

    Bearing B and pedestal S in series are D = B − B (B + S)⁻¹ B: dD = S G dB G S + B G dS G B, G = (B + S)⁻¹.
    """
    (B, S), (other, beneath) = (support.dynamic_parts(speeds) for support in (more, less))
    if S is None or beneath is None:
        return on_waves(B - other)
    more_B, more_S, B, S = B - other, S - beneath, (B + other) / 2, (S + beneath) / 2
    G = np.linalg.inv(B + S)
    return on_waves(S @ G @ more_B @ G @ S + B @ G @ more_S @ G @ B)


@holding_arrays
class Planes:
    """A rotor as both planes see it.

    Attributes
    ----------
    rotor, A
        The rotor and its single-plane bands.
    planes
        2: unknowns x and y, real matrices; 1: the complex coordinate z, complex matrices.
    rows
        Unknown of the deflection at each support, from 0, shape (s,).
    pedestals
        Which supports stand on a pedestal, shape (f,).
    feet
        Mass, damping and stiffness of the pedestals, shape (3, planes, f).
    """

    rotor: Rotor
    A: Matrices
    planes: int
    rows: IndexArray
    pedestals: IndexArray
    feet: FloatArray

    @property
    def across(self) -> AnyArray:
        """Force in x from y, and with the opposite sign in y from x; or the same of z."""
        return np.array([[0.0, 1.0], [-1.0, 0.0]] if self.planes == 2 else [[-1j]])

    def supports(self, speeds: FloatArray) -> tuple[AnyArray, AnyArray]:
        """Stiffness and damping of all supports, each of shape (S, s, planes, planes).

        Raises
        ------
        ValueError
            Outside the table of a support.
        """
        parts = np.array([support.at(speeds) for support in self.rotor.supports])
        parts = parts.reshape(len(self.rotor.supports), 2, speeds.size, 2, 2).transpose(1, 2, 0, 3, 4)
        k, c = parts if self.planes == 2 else parts[..., :1, :1] - 1j * parts[..., :1, 1:]
        return k, c


def both_planes(rotor: Rotor, *, complex_coordinate: bool | None = None) -> Planes:
    """Look at a rotor in both planes; by default with the complex coordinate where that is enough."""
    one = rotor.symmetric if complex_coordinate is None else complex_coordinate
    A, p, supports = assemble(rotor), 1 if one else 2, rotor.supports
    pedestals = {i: support.pedestal for i, support in enumerate(supports) if support.pedestal}
    feet = [(2 * (foot.mass,), foot.xy("damping"), foot.xy("stiffness")) for foot in pedestals.values()]
    return Planes(
        rotor,
        A,
        p,
        A.deflections[[support.node - 1 for support in supports]],
        np.array(list(pedestals), np.intp),
        np.reshape(feet, (-1, 3, 2)).transpose(1, 2, 0)[:, :p],
    )


@holding_arrays
class Reduced:
    """λ² M + λ (D₀ + Ω D₁ + supports) + K₀ + Ω K₁ + supports, in a basis of d shaft vectors per plane.

    Unknowns: d per plane, plane after plane, then the pedestals, again plane after plane; R in all.

    Attributes
    ----------
    P
        The rotor.
    basis
        Vectors of one plane, shape (size, d).
    M, D0, D1, K0, K1
        Shape (R, R).
    ties
        What a unit entry (i, j) of each support's matrices adds, shape (s, planes, planes, R, R).
    """

    P: Planes
    basis: FloatArray
    M: FloatArray
    D0: FloatArray
    D1: AnyArray
    K0: FloatArray
    K1: AnyArray
    ties: FloatArray

    @property
    def size(self) -> int:
        """Number of unknowns, R."""
        return len(self.M)

    def at(self, speeds: FloatArray) -> tuple[AnyArray, AnyArray]:
        """D and K at each speed, shape (S, R, R)."""
        omega, (k, c) = speeds[:, None, None], self.P.supports(speeds)
        D = self.D0 + omega * self.D1 + np.tensordot(c, self.ties, 3)
        return D, self.K0 + omega * self.K1 + np.tensordot(k, self.ties, 3)

    def expand(self, vectors: AnyArray) -> AnyArray:
        """Shaft unknowns of reduced vectors (…, R), shape (…, planes, size)."""
        planes, d = self.P.planes, self.basis.shape[1]
        coefficients = vectors[..., : planes * d].reshape(*vectors.shape[:-1], planes, d)
        return coefficients @ self.basis.T

    def nodes(self, vectors: AnyArray) -> AnyArray:
        """Deflections of all nodes in reduced vectors (…, R), shape (…, planes, N)."""
        return self.expand(vectors)[..., :: self.P.A.stride]


def project(P: Planes, basis: FloatArray) -> Reduced:
    """The equations in a basis of the shaft, shape (size, d), the same in both planes.

    Stiffness and material damping are summed from strains: so they keep their digits on any mesh.
    """
    d, p, f = basis.shape[1], P.planes, len(P.pedestals)
    strain = strains(P.rotor, basis)
    damped = (P.rotor.material_damping[:, None] * strain).reshape(-1, d)
    strain = strain.reshape(-1, d)
    K, B = strain.T @ strain, strain.T @ damped
    for support in P.rotor.supports:
        tilt = basis[P.A.deflection(support.node) + 1]
        K += support.tilting_stiffness * np.outer(tilt, tilt)
    for damper in internal_damping(P.rotor):
        w = basis[P.A.deflection(damper.node)]
        B += damper.damping * np.outer(w, w)
    M, G = (basis.T @ multiply(band, basis) for band in (P.A.mass, P.A.gyroscopic))
    along, across = np.eye(p), P.across
    forms, feet = np.array([M, B, K, G, B]), np.arange(p * d, p * (d + f))
    matrices = np.zeros((5, p * (d + f), p * (d + f)), across.dtype)
    planes = np.einsum("kab,kij->kaibj", [along] * 3 + [across] * 2, forms)
    matrices[:, : p * d, : p * d] = planes.reshape(5, p * d, p * d)
    matrices[:3, feet, feet] = P.feet.reshape(3, -1)
    # What a support feels: motion of its node against the ground or the foot, in each plane.
    relative = np.zeros((len(P.rows), p, p * (d + f)))
    for plane, unknowns in enumerate(feet.reshape(p, f)):
        relative[:, plane, plane * d : (plane + 1) * d] = basis[P.rows]
        relative[P.pedestals, plane, unknowns] = -1.0
    ties = np.einsum("sia,sjb->sijab", relative, relative)
    (M, D0, K0), (D1, K1) = matrices[:3].real, matrices[3:]
    return Reduced(P, basis, M, D0, D1, K0, K1, ties)


class WholeBand:
    """The full model at complex frequencies, its bands prepared once; pedestals are condensed.

    F and b alternate, or F = z stands alone; the supports alone couple them. Entries of K are rounded: an
    element of 1/500 of its neighbours, of 20, costs 1e-5 of a deflection at rest and 1e-3 of the peak of a
    resonance that amplifies 1000 times; see `rounding_error`.
    """

    def __init__(self, P: Planes) -> None:
        A, p = P.A, P.planes
        self.P, self.size, self.reach = P, p * A.size, p * A.width
        self._bands = np.zeros((4, 2 * A.width + 1, A.size))
        upper = np.array([A.mass, A.gyroscopic, A.material, A.shaft])
        for off in range(A.width + 1):
            entries = upper[:, A.width - off, off:]
            self._bands[:, A.width - off, off:] = entries
            self._bands[:, A.width + off, : A.size - off] = entries

    def factor(self, value: complex, speed: float) -> Callable[..., ComplexArray]:
        """Solutions X of P X = B, P = λ² M + λ D + K at one λ and speed: of B, and whether of Pᵀ X = B.

        B is of shape (size,) or (size, m), in the order of the band.
        """
        from scipy.linalg.lapack import zgbtrf, zgbtrs

        P, p, reach = self.P, self.P.planes, self.reach
        band = np.zeros((3 * reach + 1, self.size), complex, order="F")
        for plane, turning in enumerate((1j * speed, -1j * speed)[:p]):
            powers = [value * value, -value * turning, value - turning, 1.0]
            band[reach::p, plane::p] = np.tensordot(powers, self._bands, 1)
        for row, support in zip(P.rows, P.rotor.supports, strict=True):
            D = on_waves(support.dynamic_stiffness(value / 1j, speed))
            for a, b in np.ndindex(p, p):
                band[2 * reach + a - b, p * row + b] += D[a, b]
        lu, pivots, info = zgbtrf(band, reach, reach, overwrite_ab=True)
        if info > 0:  # singular to the last bit: an eigenvalue
            lu[2 * reach, info - 1] = 1e-16 * np.abs(lu).max()

        def solve(B: ComplexArray, transposed: bool = False) -> ComplexArray:
            return np.asarray(zgbtrs(lu, reach, reach, B, pivots, trans=int(transposed))[0])

        return solve
