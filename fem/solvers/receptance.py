"""Response to forces that rotate with the rotor, per unit of force.

The fast way takes the receptance of the conservative rotor on reference springs
(`fem.matrices.undamped_matrices`) from its lowest modes, adds the static contribution of all others as a
power series in ω², and brings in what the supports do besides as a change of low rank: one per supported
node, two where forward and backward whirl are coupled. A bound on what the series leaves out decides how long
it must be. The exact way is `fem.solvers.synchronous_banded`; it takes over where the fast one loses digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fem.matrices.banded_matrices import Matrices, multiply
from fem.matrices.support_dynamic_stiffness import Supported, supported
from fem.matrices.undamped_matrices import Pencil, one_plane
from fem.model.rotor import Rotor
from fem.solvers.eigen import DENSE, Spectrum, factor, finite_modes, lowest_modes, rigid_scale
from fem.solvers.synchronous_banded import solve_banded
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray

TOLERANCE = 1e-10  # of the series, relative to the response
NEAR = 1e-8  # |ω² − λ| / λ where the fast formula has lost half of the digits
PIVOT = 1e-4  # of the low-rank change, relative: below, four digits are lost
_TERMS = 12
_CHUNK, _ROWS = 256, 64  # speeds at a time up to so many rows, to stay in the processor's cache; above, half


@dataclass(frozen=True, eq=False)
class Series:
    """Σ over modes and powers of the conservative receptance between rows and columns."""

    factors: FloatArray  # (rows·columns, m + p): modes with the sign of their mass, then powers
    squares: FloatArray  # (m,)
    shift: float
    shape: tuple[int, int]

    def at(self, squared: AnyArray, skip: BoolArray) -> AnyArray:
        """Receptance where ω² is given, shape (rows, columns, S); finite nonsense where `skip` is true."""
        m, n = self.squares.size, self.factors.shape[1]
        terms = np.empty((n, squared.size), dtype=squared.dtype)
        gap = np.subtract(self.squares[:, None], squared, out=terms[:m])
        gap[:, skip] = 1.0
        np.divide(1.0, gap, out=gap)
        if n > m:
            terms[m] = 1.0
            for j in range(m + 1, n):
                np.multiply(terms[j - 1], squared + self.shift, out=terms[j])
        return np.asarray((self.factors @ terms).reshape(*self.shape, -1))


@dataclass(frozen=True, eq=False)
class Receptance:
    """Deflections under loads that rotate with the rotor, ready for any speed of a range.

    Attributes
    ----------
    rotor, A
        The rotor and its matrices.
    rows
        Unknowns from 0, shape (a,).
    loads
        Real load vectors, shape (size, b).
    reference
        Springs {node: N/m} of the conservative rotor.
    moving
        Which of these differ from what the supports do, shape (s,).
    forward, backward
        Series of both directions; None where the banded equations are solved instead, or one is enough.
    spectra
        Of the conservative rotors.
    beta
        Material damping, s.
    """

    rotor: Rotor
    A: Matrices
    rows: IndexArray
    loads: FloatArray
    reference: dict[int, float]
    moving: IndexArray
    forward: Series | None
    backward: Series | None
    spectra: tuple[Spectrum, ...]
    beta: float

    @property
    def rounding(self) -> FloatArray:
        """As in `Spectrum`."""
        return self.spectra[0].rounding

    def parts(self, speeds: FloatArray) -> Iterator[tuple[slice, Amplitudes]]:
        """Amplitudes at speeds in rad/s, some speeds at a time, so that memory does not grow with them."""
        step = _CHUNK if self.rows.size <= _ROWS else _CHUNK // 2
        for start in range(0, speeds.size, step):
            part = slice(start, start + step)
            yield part, self._at(speeds[part])

    def _at(self, speeds: FloatArray) -> Amplitudes:
        at = supported(self.rotor, speeds)
        if self.forward is None:
            return Amplitudes(*solve_banded(self.rotor, self.A, at, self.rows, self.loads, speeds))
        change = support_change(at, self.reference)[:, self.moving]
        near = np.zeros(speeds.size, dtype=bool)
        for spectrum in self.spectra:
            near |= near_resonance(spectrum, speeds)
        directions = [self.forward.at(speeds * speeds, near)]
        D = np.moveaxis(change, 0, -1)
        if self.backward is not None:
            # K (1 + 2 i ω β) − ω² (M + G): the same pencil at a complex frequency.
            stiffer = 1.0 + 2j * self.beta * speeds if self.beta else np.ones(speeds.size)
            directions.append(self.backward.at(speeds * speeds / stiffer, near) / stiffer)
            springs = np.array(list(self.reference.values()))[self.moving]
            D = D.copy()
            D[:, 1, 1] -= springs[:, None] * (stiffer - 1.0)
        (F, *behind), lost = _amplitudes(directions, D, self.rows.size, self.loads.shape[1])
        b = behind[0] if behind else np.zeros_like(F) if at.planes == 2 else None
        near |= lost
        if not near.any():
            return Amplitudes(F, b, None)
        few = Supported(at.nodes, at.stiffness[near], at.reference, at.planes)
        F[near], across, doubt = solve_banded(self.rotor, self.A, few, self.rows, self.loads, speeds[near])
        if b is not None and across is not None:
            b[near] = across
        return Amplitudes(F, b, doubt)


@dataclass(frozen=True, eq=False)
class Amplitudes:
    """Forward and backward amplitude per unit of load, z = F e^{iωt} + b̄ e^{−iωt}, each of shape (S, a, b).

    b is None on rotationally symmetric supports; `doubt` is the largest relative error that rounding of the
    banded equations may cause, and the speed, rad/s: None where they were not solved.
    """

    F: ComplexArray
    b: ComplexArray | None
    doubt: tuple[float, float] | None


def prepare(
    rotor: Rotor, A: Matrices, rows: IndexArray, loads: FloatArray, speeds: FloatArray, exact: bool = False
) -> Receptance:
    """Modes and series for deflections at unknowns `rows` under real load vectors rotating at each speed.

    Parameters
    ----------
    rotor, A
        The rotor and its matrices.
    rows
        Unknowns from 0, shape (a,).
    loads
        Shape (size, b).
    speeds
        rad/s, shape (S,): the range in which it is to be used.
    exact
        Solve the banded system at every speed instead of at the few where the fast way loses digits.

    Raises
    ------
    ValueError
        At a critical speed that no damping limits, or outside a bearing table.
    """
    at = supported(rotor, speeds)
    reference = reference_springs(rotor, A, at)
    held = np.array([A.deflection(node) for node in reference], dtype=np.intp)
    varies = {support.node for support in rotor.supports if not support.plain}
    change = np.abs(support_change(at, reference)).max(axis=(0, 2, 3), initial=0.0) > 0
    moving = np.flatnonzero(change | np.array([node in varies for node in reference], dtype=bool))
    held = held[moving]
    top = float(speeds.max())

    pencil = one_plane(rotor, A, 1, reference)
    spectra = [modes_up_to(pencil, top)]
    both = np.concatenate((rows, held))
    forward = (
        None
        if exact
        else receptance_series(pencil, spectra[0], both, np.hstack((loads, unit_loads(A, held))), top)
    )
    backward = None
    beta = uniform_damping(rotor)
    if at.planes == 2 and forward is not None and held.size:
        if beta is None:
            forward = None
        else:
            behind = pencil if not rotor.model.gyroscopic else one_plane(rotor, A, -1, reference)
            if behind is not pencil:
                spectra.append(modes_up_to(behind, top))
            backward = receptance_series(behind, spectra[-1], both, unit_loads(A, held), top)
            forward = None if backward is None else forward
    return Receptance(
        rotor, A, rows, loads, reference, moving, forward, backward, tuple(spectra), beta or 0.0
    )


def reference_springs(rotor: Rotor, A: Matrices, at: Supported) -> dict[int, float]:
    """Springs {node: N/m} of the conservative rotor; a gyroscopic one may have to be held."""
    springs = dict(zip(at.nodes, at.reference.tolist(), strict=True))
    hold = rigid_scale(rotor) * rotor.total_mass
    if not rotor.model.gyroscopic or sum(k > 1e-3 * hold for k in springs.values()) >= 2:
        return springs
    try:
        factor(one_plane(rotor, A, 1, springs))
    except ValueError:
        # M − G is negative in a rigid motion, so that no shift makes K + σ M positive.
        for node in (1, rotor.n_nodes):
            springs[node] = springs.get(node, 0.0) + hold
    return springs


def support_change(at: Supported, reference: dict[int, float]) -> ComplexArray:
    """What the supports do besides the reference springs, shape (S, s, 2, 2)."""
    change = np.zeros((at.stiffness.shape[0], len(reference), 2, 2), dtype=complex)
    change[:, : len(at.nodes)] = at.stiffness
    springs = np.array(list(reference.values()))
    for i in (0, 1):
        change[:, :, i, i] -= springs
    return change


def unit_loads(A: Matrices, unknowns: IndexArray) -> FloatArray:
    """A load 1 on each of these unknowns, (size, m)."""
    unit = np.zeros((A.size, unknowns.size))
    unit[unknowns, np.arange(unknowns.size)] = 1.0
    return unit


def uniform_damping(rotor: Rotor) -> float | None:
    """The material damping if it is the same everywhere, so that B = β K; else None."""
    beta = rotor.material_damping
    if not beta.any():
        return 0.0
    tilting = any(support.tilting_stiffness for support in rotor.supports)
    return None if tilting or (beta != beta[0]).any() else float(beta[0])


def modes_up_to(pencil: Pencil, top: float) -> Spectrum:
    """All modes of a small model, else those up to three times the highest speed."""
    rotor, A, available = pencil.rotor, pencil.matrices, finite_modes(pencil)
    if pencil.size <= DENSE:
        return lowest_modes(rotor, A, available, pencil)
    # Weyl's count of the modes of a beam below a frequency, with the discs' mass spread evenly.
    span = float(rotor.length.sum())
    bending = float(rotor.length @ (rotor.youngs_modulus * rotor.second_moment)) / span
    wave_number = (rotor.total_mass / span * (3 * top) ** 2 / bending) ** 0.25
    m = min(available, int(wave_number * span / np.pi) + 4)
    while True:
        spectrum = lowest_modes(rotor, A, m, pencil)
        if m == available or abs(spectrum.squares[-1]) > 9 * top * top:
            return spectrum
        m = min(available, 2 * m)


def near_resonance(spectrum: Spectrum, speeds: FloatArray) -> BoolArray:
    """At which speeds the fast formula would lose half of the digits."""
    squared = speeds * speeds
    # Rigid-body motions have λ = 0 without rounding.
    moving = spectrum.squares != 0
    margin = np.where(moving, NEAR * (np.abs(spectrum.squares) + spectrum.shift), 0.0)
    within = (spectrum.squares + margin >= squared.min()) & (spectrum.squares - margin <= squared.max())
    gap = np.abs(spectrum.squares[within, None] - squared)
    return np.asarray((gap <= margin[within, None]).any(axis=0))


def receptance_series(
    pencil: Pencil, spectrum: Spectrum, rows: IndexArray, columns: FloatArray, top: float
) -> Series | None:
    """Modes and static corrections; None where the series does not reach its tolerance."""
    from scipy.linalg.lapack import dpbtrs

    V, shifted, squares = spectrum.vectors, spectrum.squares + spectrum.shift, spectrum.squares
    participation = spectrum.signs[:, None] * (V.T @ columns)
    modal = (V[rows][:, None, :] * participation.T[None, :, :]).reshape(-1, shifted.size)
    powers: list[FloatArray] = []

    def series() -> Series:
        factors = np.column_stack((modal, *powers))
        return Series(factors, squares, spectrum.shift, (rows.size, columns.shape[1]))

    if shifted.size == pencil.size:
        return series()

    R = dpbtrs(spectrum.factor, columns)[0]
    total = np.maximum(np.einsum("ij,ij->j", columns, R), np.finfo(float).tiny)
    # Without the modes; twice, as the frequencies are more accurate than the factor's own.
    MV = multiply(pencil.mass, V) * spectrum.signs
    R = R - V @ (participation / shifted[:, None])
    R -= V @ (MV.T @ R)
    powers.append(R[rows].reshape(-1))
    if shifted.size == finite_modes(pencil):
        return series()
    # At the loads, what is left after j terms is below x**j / (1 − x) of the static remainder
    # (Cauchy–Schwarz); the tolerance leaves room for sensors where the remainder is larger.
    remainder = float((np.abs(np.einsum("ij,ij->j", columns, R)) / total).max())
    ratio = (top * top + spectrum.shift) / abs(shifted[-1])
    if ratio >= 0.5:
        return None
    flexible = abs(shifted[min(pencil.rigid.shape[1], shifted.size - 1)])
    wanted = TOLERANCE * min(1.0, flexible / (top * top + spectrum.shift))
    error = remainder / (1 - ratio)
    for _ in range(_TERMS):
        error *= ratio
        if error <= wanted:
            return series()
        load = multiply(pencil.mass, R)
        load -= MV @ (V.T @ load)  # rounding must not bring the modes back
        R = dpbtrs(spectrum.factor, load)[0]
        R -= V @ (MV.T @ R)
        powers.append(R[rows].reshape(-1))
    return None


def _amplitudes(
    directions: Sequence[AnyArray], change: AnyArray, a: int, b: int
) -> tuple[list[ComplexArray], BoolArray]:
    """Amplitudes in each direction, shape (S, a, b), and speeds where digits are lost.

    The amplitudes q at the supports obey (1 + H D) q = H f with D coupling forward and backward; the
    forces D q then act on each of the two.

    Parameters
    ----------
    directions
        H of forward whirl between rows and loads, the supports last in both, shape (a + s, b + s, S); and of
        backward whirl, where no load acts, (a + s, s, S).
    change
        D, shape (s, planes, planes, S).
    a, b
        Rows and loads without the supports.
    """
    s, planes = len(change), len(directions)
    H, n = directions[0], s * planes
    # Unknowns: forward at all supports, then backward at all.
    E = np.zeros((n, n + b, H.shape[2]), dtype=complex)
    for p, J in enumerate(directions):
        for q in range(planes):
            E[p * s : (p + 1) * s, q * s : (q + 1) * s] = J[a:, J.shape[1] - s :] * change[:, p, q]
    size = np.abs(E[:, :n]).max(axis=1, initial=0.0)
    E[:s, n:] = H[a:, :b]
    E[np.arange(n), np.arange(n)] += 1.0
    lost = np.zeros(H.shape[2], dtype=bool)
    for k in range(n):
        pivot = E[k, k].copy()
        lost |= np.abs(pivot) < PIVOT * np.maximum(1.0, size[k])
        pivot[lost] = 1.0
        E[k, k + 1 :] /= pivot
        factors = E[:, k].copy()
        factors[k] = 0.0
        E[:, k + 1 :] -= factors[:, None] * E[k, k + 1 :]
    moved = E[:, n:].reshape(planes, s, b, lost.size)
    out = []
    for p, J in enumerate(directions):
        F = H[:a, :b].astype(complex) if p == 0 else np.zeros((a, b, H.shape[2]), dtype=complex)
        for k in range(s):
            force = sum(change[k, p, q] * moved[q, k] for q in range(planes))
            F -= J[:a, J.shape[1] - s + k, None] * force
        out.append(np.moveaxis(F, 2, 0))
    return out, lost
