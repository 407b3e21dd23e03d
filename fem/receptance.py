"""Response to rotating forces of a rotor on damped isotropic supports, per unit of force.

The equation in the complex coordinate is (K + i ω C − ω² M) Z = F, with C at few nodes. The fast way
takes the receptance of the conservative rotor from its lowest modes, adds the static contribution of all
others as a power series in ω², and brings in each damper as a change of rank one (Sherman–Morrison). A
bound on what the series leaves out decides how long it must be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.eigen import DENSE, Spectrum, finite_modes, lowest_modes
from fem.matrices import WIDTH, Matrices, general, multiply
from fem.rotor import FloatArray, Rotor

ComplexArray = NDArray[np.complex128]

TOLERANCE = 1e-10  # of the series, relative to the response
NEAR = 1e-8  # |ω² − λ| / λ where the fast formula has lost half of the digits
_TERMS = 12
_CHUNK = 64  # speeds at a time, to stay in the processor's cache


@dataclass(frozen=True, eq=False)
class _Series:
    """Σ over modes and powers of the conservative receptance between rows and columns."""

    modal: FloatArray  # (rows·columns, m)
    squares: FloatArray  # (m,)
    powers: list[FloatArray]  # each (rows·columns,), factor of (ω² + shift)**j
    shift: float


def receptance(
    rotor: Rotor, A: Matrices, rows: NDArray[np.intp], loads: FloatArray, speeds: FloatArray, exact: bool
) -> tuple[ComplexArray, tuple[str, ...], FloatArray]:
    """Deflections at unknowns `rows` under real load vectors rotating at each speed.

    Parameters
    ----------
    rotor, A
        The rotor and its matrices.
    rows
        Unknowns from 0, shape (a,).
    loads
        Shape (2 N, b).
    speeds
        rad/s, shape (S,).
    exact
        Solve the banded system at every speed instead of at the few where the fast way loses digits.

    Returns
    -------
    H
        Deflection per unit of load, shape (S, a, b).
    warnings
        Said where damping is so light that rounding of the banded equations shows.
    rounding
        As in `Spectrum`.

    Raises
    ------
    ValueError
        At a critical speed that no damping limits.
    """
    top = float(speeds.max())
    spectrum = _modes_for(rotor, A, top)
    near = _near(spectrum, speeds)
    _check_limited(A, spectrum, speeds, near)
    series = None if exact else _series(A, spectrum, rows, loads, top)
    if series is None:
        return *solve_banded(A, rows, loads, speeds), spectrum.rounding
    H = np.empty((speeds.size, rows.size, loads.shape[1]), dtype=complex)
    for start in range(0, speeds.size, _CHUNK):
        part = slice(start, start + _CHUNK)
        H[part] = _evaluate(series, A, rows.size, loads.shape[1], speeds[part], near[part])
    if not near.any():
        return H, (), spectrum.rounding
    H[near], warnings = solve_banded(A, rows, loads, speeds[near])
    return H, warnings, spectrum.rounding


def solve_banded(
    A: Matrices, rows: NDArray[np.intp], loads: FloatArray, speeds: FloatArray
) -> tuple[ComplexArray, tuple[str, ...]]:
    """Receptance, shape (S, a, b), by the LU factors of the banded complex matrix at each speed.

    Also a warning where rounding the entries of K changes the result by more than 1e-6 of itself; it is
    looked for at the slowest and fastest speed and at the largest response.

    Raises
    ------
    ValueError
        If the matrix is singular at one of the speeds.
    """
    from scipy.linalg.lapack import zgbsv

    K, M = general(A.stiffness), general(A.mass)
    rhs = np.asfortranarray(loads, dtype=complex)

    def deflection(omega: float) -> ComplexArray:
        band = np.asfortranarray(K - omega * omega * M, dtype=complex)
        band[2 * WIDTH, A.damped] += 1j * omega * A.damping
        _, _, X, info = zgbsv(WIDTH, WIDTH, band, rhs, overwrite_ab=True)
        if info != 0 or not np.isfinite(X).all():
            raise _unlimited(omega, omega)
        return np.asarray(X)

    H = np.empty((speeds.size, rows.size, loads.shape[1]), dtype=complex)
    for k, omega in enumerate(speeds):
        H[k] = deflection(float(omega))[rows]
    suspects = {int(np.argmin(speeds)), int(np.argmax(speeds)), int(np.argmax(np.abs(H).max(axis=(1, 2))))}
    errors = {k: _sensitivity(A, loads, deflection(float(speeds[k]))) for k in suspects}
    worst = max(errors, key=errors.__getitem__)
    if errors[worst] < 1e-6:
        return H, ()
    text = (
        f"near {speeds[worst]:.6g} rad/s rounding may change the response by {errors[worst]:.0e} of itself: "
        "hardly any damping limits it, or the mesh is too fine, or the speed is very low"
    )
    return H, (text,)


def _sensitivity(A: Matrices, loads: FloatArray, X: ComplexArray) -> float:
    """What rounding the entries of K may change, relative to the deflection at the load."""
    size = np.abs(X)
    change = np.finfo(float).eps * np.einsum("ij,ij->j", size, multiply(np.abs(A.stiffness), size))
    at_load = np.abs(np.einsum("ij,ij->j", loads, X))
    floor = 1e-6 * size.max(axis=0) * np.abs(loads).max(axis=0)  # where a load meets an antiresonance
    return float(np.max(change / np.maximum(np.maximum(at_load, floor), np.finfo(float).tiny)))


def _modes_for(rotor: Rotor, A: Matrices, top: float) -> Spectrum:
    """All modes of a small model, else those up to three times the highest speed."""
    available = finite_modes(A)
    if A.size <= DENSE:
        return lowest_modes(rotor, A, available)
    # Weyl's count of the modes of a beam below a frequency, with the discs' mass spread evenly.
    span = float(rotor.length.sum())
    bending = float(rotor.length @ (rotor.youngs_modulus * rotor.second_moment)) / span
    wave_number = (rotor.total_mass / span * (3 * top) ** 2 / bending) ** 0.25
    m = min(available, int(wave_number * span / np.pi) + 4)
    while True:
        spectrum = lowest_modes(rotor, A, m)
        if m == available or spectrum.squares[-1] > 9 * top * top:
            return spectrum
        m = min(available, 2 * m)


def _near(spectrum: Spectrum, speeds: FloatArray) -> NDArray[np.bool_]:
    squared = speeds * speeds
    margin = NEAR * (spectrum.squares + spectrum.shift)
    within = (spectrum.squares + margin >= squared.min()) & (spectrum.squares - margin <= squared.max())
    gap = np.abs(spectrum.squares[within, None] - squared)
    return np.asarray((gap <= margin[within, None]).any(axis=0))


def _check_limited(A: Matrices, spectrum: Spectrum, speeds: FloatArray, near: NDArray[np.bool_]) -> None:
    """Refuse speeds where nothing limits the response."""
    if not near.any():
        return
    omega = speeds[near]
    squares = spectrum.squares[:, None]
    modal_damping = (spectrum.vectors[A.damped] ** 2).T @ A.damping
    stiffness = np.abs(squares - omega * omega + 1j * omega * modal_damping[:, None])
    limit = stiffness / (squares + spectrum.shift)
    if (limit <= NEAR).any():
        mode, k = np.unravel_index(int(np.argmin(limit)), limit.shape)
        raise _unlimited(float(omega[k]), float(np.sqrt(spectrum.squares[mode])))


def _unlimited(omega: float, critical: float) -> ValueError:
    return ValueError(
        f"at {omega:.10g} rad/s the undamped rotor stands exactly at its critical speed "
        f"{critical:.10g} rad/s, where the amplitude has no limit; give a support damping or choose "
        "another speed"
    )


def _series(
    A: Matrices, spectrum: Spectrum, rows: NDArray[np.intp], loads: FloatArray, top: float
) -> _Series | None:
    """Modes and static corrections; None where the series does not reach its tolerance."""
    from scipy.linalg.lapack import dpbtrs

    # Dampers are rows and columns, too.
    rows = np.concatenate((rows, A.damped))
    unit = np.zeros((A.size, A.damped.size))
    unit[A.damped, np.arange(A.damped.size)] = 1.0
    columns = np.hstack((loads, unit))
    V, shifted = spectrum.vectors, spectrum.squares + spectrum.shift
    participation = V.T @ columns
    modal = (V[rows][:, None, :] * participation.T[None, :, :]).reshape(-1, shifted.size)
    powers: list[FloatArray] = []
    if shifted.size == A.size:
        return _Series(modal, spectrum.squares, powers, spectrum.shift)

    R = dpbtrs(spectrum.factor, columns)[0]
    total = np.maximum(np.einsum("ij,ij->j", columns, R), np.finfo(float).tiny)
    # Without the modes; twice, as the frequencies are more accurate than the factor's own.
    MV = multiply(A.mass, V)
    R = R - V @ (participation / shifted[:, None])
    R -= V @ (MV.T @ R)
    powers.append(R[rows].reshape(-1))
    if shifted.size == finite_modes(A):
        return _Series(modal, spectrum.squares, powers, spectrum.shift)
    # At the loads, what is left after j terms is below x**j / (1 − x) of the static remainder
    # (Cauchy–Schwarz); the tolerance leaves room for sensors where the remainder is larger.
    remainder = float((np.abs(np.einsum("ij,ij->j", columns, R)) / total).max())
    ratio = (top * top + spectrum.shift) / shifted[-1]
    if ratio >= 0.5:
        return None
    flexible = shifted[min(A.rigid, shifted.size - 1)]
    wanted = TOLERANCE * min(1.0, flexible / (top * top + spectrum.shift))
    error = remainder / (1 - ratio)
    for _ in range(_TERMS):
        error *= ratio
        if error <= wanted:
            return _Series(modal, spectrum.squares, powers, spectrum.shift)
        load = multiply(A.mass, R)
        load -= MV @ (V.T @ load)  # rounding must not bring the modes back
        R = dpbtrs(spectrum.factor, load)[0]
        R -= V @ (MV.T @ R)
        powers.append(R[rows].reshape(-1))
    return None


def _evaluate(
    series: _Series, A: Matrices, a: int, b: int, speeds: FloatArray, skip: NDArray[np.bool_]
) -> ComplexArray:
    """Receptance with dampers at each speed, shape (S, a, b); finite nonsense where `skip` is true."""
    squared = speeds * speeds
    gap = series.squares[:, None] - squared
    gap[:, skip] = 1.0
    conservative = (series.modal @ (1.0 / gap)).reshape(a + A.damped.size, b + A.damped.size, -1)
    for j, power in enumerate(series.powers):
        conservative += power.reshape(*conservative.shape[:2], 1) * (squared + series.shift) ** j
    H: ComplexArray = conservative.astype(complex)
    for k, damping in enumerate(A.damping):
        D = 1j * damping * speeds
        row = H[a + k] / (1.0 + D * H[a + k, b + k])
        H -= H[:, b + k, None] * (D * row)
        H[a + k] = row
    return np.moveaxis(H[:a, :b], 2, 0)
