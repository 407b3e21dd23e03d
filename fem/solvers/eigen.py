"""The lowest modes of the conservative rotor, K φ = λ M φ, in the accurate (inverse) form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices.banded_matrices import Matrices, dense, multiply, rounding_error
from fem.matrices.undamped_matrices import NO_MASS, Pencil, one_plane, orthonormal_rigid
from fem.model.rotor import Rotor
from rotorid.base.arrays import AnyArray, FloatArray

DENSE = 64  # unknowns up to which all modes at once cost less than a subspace of the lowest
_BLOCK = 4
_CONVERGED = 1e-10
_TOO_FINE = 1e-2
_UNSTABLE = (
    "the rotor on its supports is statically unstable, or its stiffness is lost in float64: a support has "
    "negative stiffness; check its sign and size"
)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The lowest m modes.

    Attributes
    ----------
    squares
        λ = ω², rad²/s², those nearest to zero (beyond the shift) in ascending order, shape (m,); exactly 0
        for rigid-body modes, negative where a mode has negative mass.
    vectors
        All unknowns, scaled to |φᵀ M φ| = 1 kg, shape (size, m).
    signs
        The sign of φᵀ M φ, shape (m,).
    shift
        σ ≥ 0 of the matrix K + σ M that was factored; 0 for a supported rotor.
    factor
        Cholesky factor of K + σ M as an upper band.
    rounding
        Relative error that rounding may cause in quantities linear in a mode, shape (m,). Frequencies
        suffer only by its square.
    """

    squares: FloatArray
    vectors: AnyArray
    signs: FloatArray
    shift: float
    factor: AnyArray
    rounding: FloatArray


def finite_modes(A: Matrices | Pencil) -> int:
    """Number of modes with finite frequency: unknowns that move mass."""
    return int(np.count_nonzero(A.mass[-1]))


def factor(pencil: Pencil) -> tuple[float, AnyArray]:
    """Shift σ and Cholesky factor of K + σ M; σ = 0 if the supports hold the rotor firmly.

    Raises
    ------
    ValueError
        If the matrix is singular, or not positive, all the same.
    """
    shift = _shift(pencil)
    K = pencil.stiffness
    U, info = _cholesky(K + shift * pencil.mass if shift else K)
    if info != 0 and shift and not pencil.definite and not pencil.rigid.shape[1]:
        shift = 0.0
        U, info = _cholesky(K)
    if info == 0:
        return shift, U
    if shift and pencil.definite:
        raise ValueError(NO_MASS)
    if shift:
        raise ValueError(
            "the rotor is free, or almost, and its polar inertia exceeds its diametral inertia: its modes "
            "under rotation cannot be found this way; hold it by soft supports at two nodes"
        )
    if any(np.less(support.stiffness, 0).any() for support in pencil.rotor.supports):
        raise ValueError(_UNSTABLE)
    raise ValueError(
        f"the stiffness matrix of {pencil.rotor.n_elements} elements is singular in float64: elements are "
        "too short beside the rest of the rotor; join neighbouring elements, 50 to 200 are ample for a rotor"
    )


def _cholesky(band: AnyArray) -> tuple[AnyArray, int]:
    from scipy.linalg import lapack

    pbtrf = lapack.zpbtrf if np.iscomplexobj(band) else lapack.dpbtrf
    U, info = pbtrf(band)
    return U, int(info)


def _shift(pencil: Pencil) -> float:
    """About the square of the first bending frequency where springs are 1000 times softer, else 0."""
    rotor = pencil.rotor
    mass, span = rotor.total_mass, float(rotor.length.sum())
    if mass == 0:
        raise ValueError("the rotor has no mass: give the shaft a density, or add discs")
    shift = rigid_scale(rotor)
    held = not pencil.rigid.shape[1] and pencil.springs >= 1e-3 * shift * mass
    # Tilting springs hold like springs at the ends.
    tilting = sum(support.tilting_stiffness for support in rotor.supports) / span**2
    return 0.0 if held or (not pencil.rigid.shape[1] and tilting >= 1e-3 * shift * mass) else shift


def rigid_scale(rotor: Rotor) -> float:
    """About the square of the first bending frequency of the free rotor, rad²/s²."""
    span = float(rotor.length.sum())
    bending = float(rotor.length @ (rotor.youngs_modulus * rotor.second_moment)) / span
    return 500.0 * bending / (max(rotor.total_mass, np.finfo(float).tiny) * span**3)


def lowest_modes(
    rotor: Rotor, A: Matrices, m: int, pencil: Pencil | None = None, tolerance: float = _CONVERGED
) -> Spectrum:
    """Lowest m modes of a pencil, by default of one plane at rest; m must not exceed the finite modes.

    Small models are solved at once, larger ones in a block Krylov space of (K + σ M)⁻¹ M. Either way the
    squares of the frequencies are then recomputed as quotients of energies, so that errors of the vectors
    count only by their square and fine meshes keep their digits. The `tolerance` is that of the vectors.

    Raises
    ------
    ValueError
        If the mesh is so fine that float64 carries fewer than about two digits of a shape.
    """
    pencil = one_plane(rotor, A) if pencil is None else pencil
    shift, U = factor(pencil)
    X = None
    if pencil.size > DENSE and 4 * m < pencil.size:
        X = _krylov(pencil, U, m, tolerance)
    if X is None:
        X = _dense(pencil, shift, m)
    free = pencil.rigid.shape[1]
    MX = multiply(pencil.mass, X)
    inertia = np.einsum("ij,ij->j", X.conj(), MX).real
    X = np.divide(X, np.sqrt(np.abs(inertia)), order="F")
    signs = np.sign(inertia)
    if free:
        motions, its = orthonormal_rigid(pencil)
        X[:, :free], signs[:free] = motions[:, :m], its[:m]
    elif shift and m > 1 and (signs[:2] > 0).all() and pencil.waves.shape[0] == 1:
        X[:, :2] = _part(pencil, X[:, :2])
    energy = pencil.energy(X)
    energy[:free] = 0.0
    if (energy < 0).any():
        raise ValueError(_UNSTABLE)
    squares = signs * energy
    order = np.argsort(np.abs(squares + shift), kind="stable")
    squares, X, signs = squares[order], X[:, order], signs[order]
    K = pencil.stiffness + shift * pencil.mass if shift else pencil.stiffness
    rounding = rounding_error(K, X, np.abs(squares + shift))
    if shift and not free:
        # What the chord slopes of the elements cannot resolve beside the energy of very soft springs.
        stiffness = 4 * rotor.youngs_modulus * rotor.second_moment / rotor.length**3
        largest = np.max(np.abs(X[pencil.waves.ravel()]) ** 2, axis=0)
        noise = np.finfo(float).eps ** 2 * stiffness.sum() * largest
        rounding = np.maximum(rounding, np.sqrt(noise / np.maximum(np.abs(squares), np.finfo(float).tiny)))
    if m and rounding.max() > _TOO_FINE:
        raise ValueError(
            f"the mesh of {rotor.n_elements} elements is too fine for float64: rounding alone may change "
            f"mode {int(np.argmax(rounding)) + 1} by {100 * rounding.max():.2g} %; join neighbouring "
            "elements, 50 to 200 are ample for a rotor"
        )
    return Spectrum(squares, X, signs, shift, U, rounding)


def _part(pencil: Pencil, X: FloatArray) -> FloatArray:
    """Two modes on very soft springs, which the shifted matrix cannot tell apart."""
    from scipy.linalg import eigh

    one, other = pencil.energy(X)
    both = (pencil.energy(X[:, :1] + X[:, 1:]) - pencil.energy(X[:, :1] - X[:, 1:]))[0] / 4
    _, Q = eigh(np.array([[one, both], [both, other]]), X.T @ multiply(pencil.mass, X))
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


def _dense(pencil: Pencil, shift: float, m: int) -> AnyArray:
    from scipy.linalg import eigh

    K = dense(pencil.stiffness + shift * pencil.mass if shift else pencil.stiffness)
    M = dense(pencil.mass)
    if not pencil.definite:
        mu, X = eigh(M, K, check_finite=False)
        return np.asarray(X[:, np.argsort(-np.abs(mu), kind="stable")[:m]])
    if 4 * m > pencil.size:
        _, X = eigh(M, K, driver="gvd", check_finite=False)
        return np.asarray(X[:, : -m - 1 : -1])
    _, X = eigh(M, K, subset_by_index=[pencil.size - m, pencil.size - 1], check_finite=False)
    return np.asarray(X[:, ::-1])


def _krylov(pencil: Pencil, U: AnyArray, m: int, tolerance: float) -> AnyArray | None:
    """Ritz vectors of U⁻ᴴ M U⁻¹ in a block Krylov space; None if it does not converge."""
    from scipy.linalg import lapack

    real = not np.iscomplexobj(U)
    tbtrs, adjoint = (lapack.dtbtrs, "T") if real else (lapack.ztbtrs, "C")
    # A block rather than a single vector finds modes of equal frequency, too. The loads are waves along
    # the rotor, with a little of everything so that no mode is orthogonal to all of them.
    planes, n_nodes = pencil.waves.shape
    block = _BLOCK * planes
    s = pencil.rotor.positions / pencil.rotor.positions[-1]
    waves = np.cos(np.pi * np.outer(np.arange(_BLOCK), s))
    waves += 0.1 * np.sin(np.outer(np.arange(1.0, _BLOCK + 1), np.arange(1.0, n_nodes + 1) ** 2))
    start = np.zeros((block, pencil.size), U.dtype).T
    for plane, unknowns in enumerate(pencil.waves):
        start[unknowns, plane * _BLOCK : (plane + 1) * _BLOCK] = waves.T
    V, _ = _orthonormal(tbtrs(U, multiply(pencil.mass, start), trans=adjoint)[0])
    most = min(pencil.size, 10 * m + 60) // block * block
    basis = np.empty((pencil.size, most), U.dtype, order="F")
    T = np.zeros((most, most), U.dtype)  # the operator in this basis, block tridiagonal
    last = np.inf
    for k in range(block, most + 1, block):
        basis[:, k - block : k] = V
        Z = tbtrs(U, multiply(pencil.mass, tbtrs(U, V)[0]), trans=adjoint)[0]
        known = basis[:, :k]
        dual = known.T if real else known.conj().T
        T[:k, k - block : k] = dual @ Z
        Z -= known @ T[:k, k - block : k]
        Z -= known @ (dual @ Z)
        V, beta = _orthonormal(Z)
        if k < 2 * (m + block) and k + block <= most:
            continue
        mu, Q = np.linalg.eigh(T[:k, :k], "U")
        order = np.argsort(-np.abs(mu), kind="stable")[:m]
        mu, Q = mu[order], Q[:, order]
        # What the operator adds outside the basis: its last block alone.
        residual = float((np.linalg.norm(beta @ Q[-block:], axis=0) / np.abs(mu)).max())
        # On fine meshes rounding stops the residual before the tolerance does.
        if residual < tolerance or (residual < 1e-5 and residual > last / 3):
            return np.asarray(tbtrs(U, np.asfortranarray(known @ Q))[0])
        last = residual
    return None


def _orthonormal(Z: AnyArray) -> tuple[AnyArray, AnyArray]:
    """QR factors, the vectors in LAPACK's order of memory."""
    from scipy.linalg import lapack

    geqrf, orgqr = (lapack.zgeqrf, lapack.zungqr) if np.iscomplexobj(Z) else (lapack.dgeqrf, lapack.dorgqr)
    packed, tau, _, _ = geqrf(Z)
    return np.asarray(orgqr(packed, tau)[0]), np.triu(packed[: Z.shape[1]])
