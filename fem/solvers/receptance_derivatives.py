"""Synchronous receptance of a rotor with its exact derivatives by numbers of the rotor: ∂H = −H ∂D H.

With z = F e^{iωt} + b̄ e^{−iωt} the amplitudes (F, b) of all unknowns obey D (F, b) = (f, 0): on the shaft
K − ω² (M − G) acts forward and K + 2iωB − ω² (M + G) backward, the supports couple both. A sensor in the
direction α reads uᵀ (F, b) = F e^{−iα} + b e^{iα}. With q = D⁻¹ f of each load and p = D⁻ᵀ u of each sensor,

    H = uᵀ q,    ∂H / ∂θ = −pᵀ (∂D / ∂θ) q.

D⁻¹ comes from modes and series of the rotor on reference springs (`fem.solvers.receptance`) with what the
supports do besides as a change of low rank, where that loses digits from the full matrix. ∂D is a
difference of matrices, exact where they are linear or quadratic in θ; no equation is solved for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem.matrices.banded_matrices import Matrices, assemble, dense, multiply
from fem.matrices.support_dynamic_stiffness import Supported, supported, whirl_change
from fem.matrices.undamped_matrices import Whirl, one_plane
from fem.model.rotor import Rotor
from fem.solvers.receptance import (
    PIVOT,
    modes_up_to,
    near_resonance,
    receptance_series,
    reference_springs,
    support_change,
    uniform_damping,
    unit_loads,
)
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IndexArray

_CHUNK = 128  # speeds at a time, to stay in the processor's cache
_DIRECTIONS: tuple[Whirl, Whirl] = (1, -1)
BANDS = ("shaft", "mass", "gyroscopic", "material")


@dataclass(frozen=True, eq=False)
class MatrixChange:
    """∂D by one number of a rotor: bands of shaft and discs that change, and supports at nodes.

    The bands, by name, are those of the unknowns from `first` on; supports, (S, k, 2, 2), act on (F, b) as in
    `Supported`.
    """

    bands: dict[str, FloatArray]
    first: int
    nodes: tuple[int, ...]
    supports: ComplexArray

    @property
    def unknowns(self) -> IndexArray:
        """On which the bands act."""
        return self.first + np.arange(max((band.shape[1] for band in self.bands.values()), default=0))


def matrix_change(
    changed: Callable[[float], Rotor], value: float, step: float, speeds: FloatArray
) -> MatrixChange:
    """∂D of the rotors `changed(value)`; on one side only, where the other is no rotor."""
    ends, width = [], 0.0
    for side in (1.0, -1.0):
        try:
            ends.append(changed(value + side * step))
            width += step
        except ValueError:
            ends.append(changed(value))
    if width == 0:
        raise ValueError("the rotor can have no other value here, neither larger nor smaller")
    up, down = ends
    pairs = [pair for pair in zip(up.supports, down.supports, strict=True) if pair[0] != pair[1]]
    change = np.zeros((speeds.size, len(pairs), 2, 2), dtype=complex)
    for k, (more, less) in enumerate(pairs):
        change[:, k] = whirl_change(more, less, speeds) / width
    tilting = any(more.tilting_stiffness != less.tilting_stiffness for more, less in pairs)
    bands: dict[str, FloatArray] = {}
    first = end = 0
    if tilting or replace(down, supports=up.supports) != up:
        one, other = assemble(up), assemble(down)
        bands = {name: (getattr(one, name) - getattr(other, name)) / width for name in BANDS}
        bands = {name: band for name, band in bands.items() if band.any()}
    if bands:
        entries, columns = np.concatenate([np.argwhere(band) for band in bands.values()]).T
        first, end = int((columns + entries).min()) - one.width, int(columns.max()) + 1
    bands = {name: band[:, first:end] for name, band in bands.items()}
    return MatrixChange(bands, first, tuple(more.node for more, _ in pairs), change)


@dataclass(frozen=True, eq=False)
class ReceptanceWithDerivatives:
    """Receptance H (S, a, b) of sensors and loads, its derivatives by p numbers and by the sensors' angles.

    `by_number` has the shape (p, S, a, b); `by_angle`, (S, a, b), is per rad of each sensor's own angle.
    """

    H: ComplexArray
    by_number: ComplexArray
    by_angle: ComplexArray


def receptance_with_derivatives(
    rotor: Rotor,
    loads: FloatArray,
    rows: IndexArray,
    angles: FloatArray,
    speeds: FloatArray,
    changes: Sequence[MatrixChange],
) -> ReceptanceWithDerivatives:
    """Compute what sensors read under real loads that rotate with the rotor, and how numbers change it.

    Parameters
    ----------
    rotor
        The rotor.
    loads
        Real vectors, shape (size, b).
    rows
        Unknowns that the sensors read, from 0, shape (a,).
    angles
        Of their directions from x with the rotation, rad, (a,).
    speeds
        rad/s, shape (S,).
    changes
        ∂D of p numbers, at these speeds.

    Raises
    ------
    ValueError
        Outside a bearing table, or where the rotor is no rotor for `fem.response`.
    """
    A, at = assemble(rotor), supported(rotor, speeds)
    ports = _Ports(A, at, rows, [change.unknowns for change in changes])
    turn = np.exp(1j * angles)
    u = np.stack((turn.conj(), turn), axis=1)  # (a, 2)
    solve = _solver(rotor, A, at, ports, loads, u, speeds)
    found = [
        _derivatives(ports, u, speeds[part], part, solve(part), changes)
        for part in (slice(k, k + _CHUNK) for k in range(0, speeds.size, _CHUNK))
    ]
    H, by_angle = (np.concatenate([each[i] for each in found]) for i in (0, 2))
    by_number = np.concatenate([each[1] for each in found], axis=1)
    return ReceptanceWithDerivatives(H, by_number, by_angle)


class _Ports:
    """Unknowns that are asked for: those of sensors and supports, and on which changing bands act."""

    def __init__(self, A: Matrices, at: Supported, rows: IndexArray, more: Sequence[IndexArray]) -> None:
        held = np.array([A.deflection(node) for node in at.nodes], dtype=np.intp)
        self.unknowns = np.unique(np.concatenate((rows, held, *more)))
        self.rows, self.held = (np.searchsorted(self.unknowns, where) for where in (rows, held))
        self.of_node = dict(zip(at.nodes, self.held.tolist(), strict=True))


Pair = tuple[ComplexArray, ComplexArray]
"""q (S, 2, ports, b) of the loads, p (S, 2, ports, a) of the sensors; 2: forward and backward."""


def _solver(
    rotor: Rotor,
    A: Matrices,
    at: Supported,
    ports: _Ports,
    loads: FloatArray,
    u: ComplexArray,
    speeds: FloatArray,
) -> Callable[[slice], Pair]:
    """Q and p at some of the speeds, the fast way where there is one."""
    beta, top = uniform_damping(rotor), float(speeds.max())
    springs = reference_springs(rotor, A, at)
    held = np.array([A.deflection(node) for node in springs], dtype=np.intp)
    seen = ports.unknowns[ports.rows]
    columns = np.hstack((loads, unit_loads(A, seen), unit_loads(A, held)))
    places = np.concatenate((ports.unknowns, held))
    b, a, n = loads.shape[1], len(u), ports.unknowns.size
    pencils = [one_plane(rotor, A, whirl, springs) for whirl in _DIRECTIONS]
    spectra = [modes_up_to(pencil, top) for pencil in pencils]
    both = zip(pencils, spectra, strict=True)
    ahead, behind = (receptance_series(pencil, modes, places, columns, top) for pencil, modes in both)

    def full(omega: FloatArray, stiffness: ComplexArray) -> Pair:
        return _full_solution(A, ports, loads, u, Supported(at.nodes, stiffness, at.reference, 2), omega)

    if beta is None or ahead is None or behind is None:
        return lambda part: full(speeds[part], at.stiffness[part])

    def fast(part: slice) -> Pair:
        omega = speeds[part]
        near = np.zeros(omega.size, dtype=bool)
        for spectrum in spectra:
            near |= near_resonance(spectrum, omega)
        stiffer = 1.0 + 2j * beta * omega if beta else np.ones(omega.size)
        D = support_change(Supported(at.nodes, at.stiffness[part], at.reference, 2), springs)
        D[:, :, 1, 1] -= np.array(list(springs.values())) * (stiffer - 1.0)[:, None]
        directions = [ahead.at(omega**2, near), behind.at(omega**2 / stiffer, near) / stiffer]
        H = np.ascontiguousarray(np.moveaxis(np.stack(directions), -1, 0))  # (S, 2, places, columns)
        of_loads, of_sensors, of_held = H[..., :b], H[..., b : b + a] * u.T[:, None], H[..., b + a :]
        s, S = held.size, omega.size
        D, G = _spread(D), np.zeros((S, 2 * s, 2 * s), dtype=complex)
        G[:, :s, :s], G[:, s:, s:] = of_held[:, 0, n:], of_held[:, 1, n:]
        E = np.eye(2 * s) + D @ G
        inverse = np.linalg.inv(E)
        T = inverse @ D
        lost = near | (np.abs(E).max((1, 2), initial=0) * np.abs(inverse).max((1, 2), initial=0) > 1 / PIVOT)
        back = of_held[:, :, :n]  # (S, 2, ports, s)
        q = -back @ (T[:, :, :s] @ of_loads[:, 0, n:]).reshape(S, 2, s, b)
        q[:, 0] += of_loads[:, 0, :n]
        seen = np.swapaxes(T, 1, 2) @ of_sensors[:, :, n:].reshape(S, 2 * s, a)
        p = of_sensors[:, :, :n] - back @ seen.reshape(S, 2, s, a)
        if lost.any():
            q[lost], p[lost] = full(omega[lost], at.stiffness[part][lost])
        return q, p

    return fast


def _spread(D: ComplexArray) -> ComplexArray:
    """Blocks (S, s, 2, 2) at each support as matrices (S, 2s, 2s) on all F, then all b."""
    S, s = D.shape[:2]
    whole = np.zeros((S, 2, s, 2, s), dtype=complex)
    each = np.arange(s)
    whole[:, :, each, :, each] = np.moveaxis(D, 1, 0)
    return whole.reshape(S, 2 * s, 2 * s)


def _full_solution(
    A: Matrices, ports: _Ports, loads: FloatArray, u: ComplexArray, at: Supported, omega: FloatArray
) -> Pair:
    """Q and p from the whole matrices, speed by speed."""
    K, M, G, B = (dense(getattr(A, name)) for name in BANDS)
    size, held = A.size, np.array([A.deflection(node) for node in at.nodes], dtype=np.intp)
    f, seen = (np.zeros((2 * size, k), dtype=complex) for k in (loads.shape[1], len(u)))
    f[:size] = loads
    both = np.concatenate((held, size + held))
    rows, each = ports.unknowns[ports.rows], np.arange(len(u))
    seen[rows, each], seen[size + rows, each] = u.T
    q, p = [], []
    for w, supports in zip(omega, _spread(at.stiffness), strict=True):
        D = np.zeros((2, size, 2, size), dtype=complex)
        D[0, :, 0], D[1, :, 1] = K - w * w * (M - G), K + 2j * w * B - w * w * (M + G)
        whole = D.reshape(2 * size, 2 * size)
        whole[np.ix_(both, both)] += supports
        q.append(np.linalg.solve(whole, f))
        p.append(np.linalg.solve(whole.T, seen))
    shape = (len(omega), 2, size, -1)
    q_ports, p_ports = (np.array(each, complex).reshape(shape)[:, :, ports.unknowns] for each in (q, p))
    return q_ports, p_ports


def _derivatives(
    ports: _Ports,
    u: ComplexArray,
    omega: FloatArray,
    part: slice,
    pair: Pair,
    changes: Sequence[MatrixChange],
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """H, ∂H by the numbers, and by the angles."""
    q, p = pair
    read = q[:, :, ports.rows] * u.T[:, :, None]  # (S, 2, a, b)
    by_number = np.zeros((len(changes), *read[:, 0].shape), dtype=complex)
    w2, one = omega**2, np.ones(omega.size)
    factors = {
        "shaft": (one, one),
        "mass": (-w2, -w2),
        "gyroscopic": (w2, -w2),
        "material": (0 * one, 2j * omega),
    }
    for k, change in enumerate(changes):
        for node, D in zip(change.nodes, np.moveaxis(change.supports[part], 1, 0), strict=True):
            at = ports.of_node[node]
            by_number[k] -= np.swapaxes(p[:, :, at], 1, 2) @ (D @ q[:, :, at])
        first = int(np.searchsorted(ports.unknowns, change.first))
        for name, band in change.bands.items():
            acting = slice(first, first + band.shape[1])
            work = np.swapaxes(p[:, :, acting], 2, 3) @ _applied(band, q[:, :, acting])
            for i, factor in enumerate(factors[name]):
                by_number[k] -= factor[:, None, None] * work[:, i]
    return read.sum(axis=1), by_number, 1j * (read[:, 1] - read[:, 0])


def _applied(band: FloatArray, q: ComplexArray) -> AnyArray:
    """A band times vectors (S, 2, n, b)."""
    flat = np.moveaxis(q, 2, 0)
    product: AnyArray = multiply(band, flat.reshape(len(flat), -1))  # type: ignore[arg-type]
    return np.moveaxis(product.reshape(flat.shape), 0, 2)
