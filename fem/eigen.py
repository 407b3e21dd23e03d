"""The lowest modes of the conservative rotor, K φ = λ M φ, in the accurate (inverse) form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices import WIDTH, Matrices, dense, multiply, rounding_error, strain_energy
from fem.rotor import FloatArray, Rotor

DENSE = 64  # unknowns up to which all modes at once cost less than a subspace of the lowest
_BLOCK = 4
_CONVERGED = 1e-10
_TOO_FINE = 1e-2
_NO_MASS = (
    "the rotor can move as a rigid body without moving any mass: give the shaft a density, or add supports"
)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The lowest m modes.

    Attributes
    ----------
    squares
        λ = ω², rad²/s², ascending, shape (m,); exactly 0 for rigid-body modes.
    vectors
        Deflections and slopes, scaled to φᵀ M φ = 1 kg, shape (2 N, m).
    shift
        σ ≥ 0 of the matrix K + σ M that was factored; 0 for a supported rotor.
    factor
        Cholesky factor of K + σ M as an upper band.
    rounding
        Relative error that rounding may cause in quantities linear in a mode, shape (m,). Frequencies
        suffer only by its square.
    """

    squares: FloatArray
    vectors: FloatArray
    shift: float
    factor: FloatArray
    rounding: FloatArray


def finite_modes(A: Matrices) -> int:
    """Number of modes with finite frequency: unknowns that move mass."""
    return int(np.count_nonzero(A.mass[WIDTH]))


def factor(rotor: Rotor, A: Matrices) -> tuple[float, FloatArray]:
    """Shift σ and Cholesky factor of K + σ M; σ = 0 if the supports hold the rotor firmly.

    Raises
    ------
    ValueError
        If the matrix is singular all the same.
    """
    from scipy.linalg.lapack import dpbtrf

    shift = _shift(rotor, A)
    U, info = dpbtrf(A.stiffness + shift * A.mass if shift else A.stiffness)
    if info != 0:
        if shift:
            raise ValueError(_NO_MASS)
        raise ValueError(
            f"the stiffness matrix of {rotor.n_elements} elements is singular in float64: elements are too "
            "short beside the rest of the rotor; join neighbouring elements, 50 to 200 are ample for a rotor"
        )
    return shift, U


def _shift(rotor: Rotor, A: Matrices) -> float:
    """About the square of the first bending frequency where springs are 1000 times softer, else 0."""
    mass, span = rotor.total_mass, float(rotor.length.sum())
    if mass == 0:
        raise ValueError("the rotor has no mass: give the shaft a density, or add discs")
    bending = float(rotor.length @ (rotor.youngs_modulus * rotor.second_moment)) / span
    shift = 500.0 * bending / (mass * span**3)
    springs = sum(support.stiffness for support in rotor.supports)
    return shift if A.rigid or springs < 1e-3 * shift * mass else 0.0


def lowest_modes(rotor: Rotor, A: Matrices, m: int) -> Spectrum:
    """Lowest m modes; m must not exceed the number of finite modes.

    Small models are solved at once, larger ones in a block Krylov space of (K + σ M)⁻¹ M. Either way the
    squares of the frequencies are then recomputed as quotients of energies (`strain_energy`), so that
    errors of the vectors count only by their square and fine meshes keep their digits.

    Raises
    ------
    ValueError
        If the mesh is so fine that float64 carries fewer than about two digits of a shape.
    """
    shift, U = factor(rotor, A)
    X = None
    if A.size > DENSE and 4 * m < A.size:
        X = _krylov(rotor, A, U, m)
    if X is None:
        X = _dense(A, shift, m)
    X = X / np.sqrt(np.einsum("ij,ij->j", X, multiply(A.mass, X)))
    if A.rigid:
        rigid = _rigid_modes(rotor, A)[:, :m]
        X[:, : rigid.shape[1]] = rigid
    elif shift and m > 1:
        X[:, :2] = _part(rotor, A, X[:, :2])
    squares = strain_energy(rotor, X)
    squares[: A.rigid] = 0.0
    order = np.argsort(squares, kind="stable")
    squares, X = squares[order], X[:, order]
    rounding = rounding_error(A.stiffness + shift * A.mass if shift else A.stiffness, X)
    if shift and not A.rigid:
        # What the chord slopes of the elements cannot resolve beside the energy of very soft springs.
        stiffness = 4 * rotor.youngs_modulus * rotor.second_moment / rotor.length**3
        noise = np.finfo(float).eps ** 2 * stiffness.sum() * np.max(X[0::2] ** 2, axis=0)
        rounding = np.maximum(rounding, np.sqrt(noise / np.maximum(squares, np.finfo(float).tiny)))
    if m and rounding.max() > _TOO_FINE:
        raise ValueError(
            f"the mesh of {rotor.n_elements} elements is too fine for float64: rounding alone may change "
            f"mode {int(np.argmax(rounding)) + 1} by {100 * rounding.max():.2g} %; join neighbouring "
            "elements, 50 to 200 are ample for a rotor"
        )
    return Spectrum(squares, X, shift, U, rounding)


def _part(rotor: Rotor, A: Matrices, X: FloatArray) -> FloatArray:
    """Two modes on very soft springs, which the shifted matrix cannot tell apart."""
    from scipy.linalg import eigh

    one, other = strain_energy(rotor, X)
    both = (strain_energy(rotor, X[:, :1] + X[:, 1:]) - strain_energy(rotor, X[:, :1] - X[:, 1:]))[0] / 4
    _, Q = eigh(np.array([[one, both], [both, other]]), X.T @ multiply(A.mass, X))
    return np.asarray(X @ Q)


def fine_mesh_warning(rotor: Rotor, rounding: FloatArray) -> tuple[str, ...]:
    """A sentence where fewer than six digits are sure."""
    worst = float(rounding.max(initial=0.0))
    if worst < 1e-6:
        return ()
    lost = int(np.ceil(np.log10(worst / np.finfo(float).eps)))
    return (
        f"the mesh is fine for float64 ({rotor.n_elements} elements): rounding costs up to {lost} of 16 "
        f"digits of mode shapes and responses (relative error about {worst:.0e})",
    )


def _dense(A: Matrices, shift: float, m: int) -> FloatArray:
    from scipy.linalg import eigh

    K = dense(A.stiffness + shift * A.mass if shift else A.stiffness)
    M = dense(A.mass)
    if 4 * m > A.size:
        _, X = eigh(M, K, driver="gvd", check_finite=False)
        return np.asarray(X[:, : -m - 1 : -1])
    _, X = eigh(M, K, subset_by_index=[A.size - m, A.size - 1], check_finite=False)
    return np.asarray(X[:, ::-1])


def _krylov(rotor: Rotor, A: Matrices, U: FloatArray, m: int) -> FloatArray | None:
    """Ritz vectors of U⁻ᵀ M U⁻¹ in a block Krylov space; None if it does not converge."""
    from scipy.linalg.lapack import dsyevd, dtbtrs

    # A block rather than a single vector finds modes of equal frequency, too. The loads are waves along
    # the rotor, with a little of everything so that no mode is orthogonal to all of them.
    block = _BLOCK
    s = rotor.positions / rotor.positions[-1]
    start = np.zeros((A.size, block))
    start[0::2] = np.cos(np.pi * np.outer(s, np.arange(block)))
    start[0::2] += 0.1 * np.sin(np.outer(np.arange(1.0, s.size + 1) ** 2, np.arange(1.0, block + 1)))
    V, _ = np.linalg.qr(dtbtrs(U, multiply(A.mass, start), trans="T")[0])
    basis, image = np.empty((A.size, 0)), np.empty((A.size, 0))
    last = np.inf
    while basis.shape[1] + block <= min(A.size, 10 * m + 60):
        Z = dtbtrs(U, multiply(A.mass, dtbtrs(U, V)[0]), trans="T")[0]
        basis, image = np.hstack((basis, V)), np.hstack((image, Z))
        if basis.shape[1] >= m + block:
            S = basis.T @ image
            mu, Q, _ = dsyevd((S + S.T) / 2)
            mu, Q = mu[: -m - 1 : -1], Q[:, : -m - 1 : -1]
            residual = float((np.linalg.norm(image @ Q - (basis @ Q) * mu, axis=0) / mu).max())
            # On fine meshes rounding stops the residual before the tolerance does.
            if residual < _CONVERGED or (residual < 1e-5 and residual > last / 3):
                return np.asarray(dtbtrs(U, basis @ Q)[0])
            last = residual
        for _ in range(2):
            Z = Z - basis @ (basis.T @ Z)
        V, _ = np.linalg.qr(Z)
    return None


def _rigid_modes(rotor: Rotor, A: Matrices) -> FloatArray:
    """Rigid-body motions: translation and rotation about the centre of mass, or about the one support."""
    ones = np.tile([1.0, 0.0], rotor.n_nodes)
    arm = np.empty(A.size)
    held = [support.node for support in rotor.supports if support.stiffness > 0]
    arm[0::2], arm[1::2] = rotor.positions, 1.0
    M_ones = multiply(A.mass, ones[:, None])[:, 0]
    centre = rotor.positions[held[0] - 1] if held else float(M_ones @ arm) / float(M_ones @ ones)
    arm[0::2] -= centre
    X = np.column_stack([arm] if held else [ones, arm])
    inertia = np.einsum("ij,ij->j", X, multiply(A.mass, X))
    if inertia.min() <= 1e-14 * rotor.total_mass * np.max(X[0::2] ** 2):
        raise ValueError(_NO_MASS)
    return np.asarray(X / np.sqrt(inertia))
