"""Shaft vectors in which a rotor's whirl is small: modes, and static answers to what acts on them.

All vectors belong to one plane and serve both. They are orthonormal in the stiffness K + σ M of the rotor on
reference supports (about the mean of the true ones), in which low modes keep their digits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem.matrices.banded_matrices import assemble, multiply
from fem.matrices.lateral_planes import Planes
from fem.model.rotor import Rotor
from fem.model.supports import Support
from fem.solvers.eigen import finite_modes, lowest_modes
from rotorid.base.arrays import AnyArray, FloatArray

_NEW = 1e-7  # part of a vector that must be new for it to join the basis


@dataclass(frozen=True, eq=False)
class Reference:
    """The conservative rotor on reference supports.

    Attributes
    ----------
    modes
        Its lowest modes, shape (size, m).
    factor
        Cholesky factor U of its K + σ M, an upper band.
    scale
        Frequency of its lowest mode that is no rigid-body motion, rad/s.
    frequencies
        Of its modes, rad/s, shape (m,).
    """

    modes: FloatArray
    factor: FloatArray
    scale: float
    frequencies: FloatArray


def reference(P: Planes, speeds: FloatArray, m: int) -> Reference:
    """Modes of the rotor on the mean stiffness of its supports, pedestals in series."""
    K, _ = P.supports(speeds)
    direct = np.einsum("ksii->ksi", K).real
    if direct.size:
        floor = 1e-6 * max(float(np.abs(direct).max()), np.finfo(float).tiny)
        direct = np.exp(np.log(np.maximum(direct, floor)).mean(axis=(0, 2)))
        direct[direct < 2 * floor] = 0.0
        for j, i in enumerate(P.pedestals):
            stand = P.pedestal_stiffness[j].mean()
            direct[i] = direct[i] * stand / (direct[i] + stand)
    supports = [
        Support(s.node, float(k), tilting_stiffness=s.tilting_stiffness)
        for s, k in zip(P.rotor.supports, np.ravel(direct), strict=True)
    ]
    rotor: Rotor = replace(P.rotor, supports=supports)
    A = assemble(rotor)
    spectrum = lowest_modes(rotor, A, min(m, finite_modes(A)))
    moving = spectrum.squares[spectrum.squares > 0]
    lowest = float(moving[0]) if moving.size else spectrum.shift
    frequencies = np.sqrt(np.maximum(spectrum.squares, 0.0))
    return Reference(spectrum.vectors, spectrum.factor, float(np.sqrt(lowest)), frequencies)


def starting_vectors(P: Planes, ref: Reference, m: int) -> tuple[FloatArray, FloatArray]:
    """A coarse basis for about 2 m modes of both planes, and what makes it a fine one.

    Coarse: m modes, static vectors of unit forces at the supports, and the static answer to the gyroscopic
    moments of the lowest half. Fine: all modes of `ref`, the answer to the gyroscopic moments and (where it
    differs along the shaft) the material damping of each, and to the inertia of the support vectors.
    """
    n = P.A.size
    unit = np.zeros((n, len(P.rows)))
    unit[P.rows, np.arange(len(P.rows))] = 1.0
    coarse = [_image(ref.factor, ref.modes[:, :m]), _static(ref.factor, unit)]
    fine = [_image(ref.factor, ref.modes[:, m:])]
    if P.A.gyroscopic.any():
        moments = _static(ref.factor, multiply(P.A.gyroscopic, ref.modes))
        half = (m + 1) // 2
        coarse.append(moments[:, :half])
        fine.append(moments[:, half:])
    if np.ptp(P.rotor.material_damping) > 0:
        fine.append(_static(ref.factor, multiply(P.A.material, ref.modes)))
    if len(P.rows):
        fine.append(_static(ref.factor, multiply(P.A.mass, _solve_upper(ref.factor, coarse[1]))))
    Y = _new(np.empty((n, 0)), np.hstack(coarse))
    return Y, _new(Y, np.hstack(fine))


def vectors(ref: Reference, Y: FloatArray) -> FloatArray:
    """Shaft vectors U⁻¹ Y."""
    return _solve_upper(ref.factor, Y)


def enlarge(ref: Reference, Y: FloatArray, X: AnyArray) -> FloatArray:
    """What is new in complex shaft vectors X, shape (size, k); columns to append to Y."""
    X = X / np.maximum(np.abs(X).max(axis=0), np.finfo(float).tiny)
    return _new(Y, _image(ref.factor, np.hstack((X.real, X.imag))))


def _new(Y: FloatArray, columns: FloatArray) -> FloatArray:
    """Orthonormal columns that complete Y to the span of both."""
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    for _ in range(2):  # once is not enough in floating point
        columns = columns - Y @ (Y.T @ columns)
    Q, S, _ = np.linalg.svd(columns, full_matrices=False)
    Q = Q[:, S > _NEW]
    Q = Q[:, : max(0, len(Y) - Y.shape[1])]
    return np.asarray(Q - Y @ (Y.T @ Q))


def _image(factor: FloatArray, X: FloatArray) -> FloatArray:
    """U X."""
    width = len(factor) - 1
    Y = factor[width, :, None] * X
    for above in range(1, width + 1):
        Y[:-above] += factor[width - above, above:, None] * X[above:]
    return Y


def _static(factor: FloatArray, F: FloatArray) -> FloatArray:
    """U⁻ᵀ F: the image of the static answer to loads F."""
    from scipy.linalg.lapack import dtbtrs

    # LAPACK is not asked for nothing: that has written beyond its arrays.
    return np.asarray(dtbtrs(factor, F, trans="T")[0]) if F.shape[1] else F


def _solve_upper(factor: FloatArray, Y: FloatArray) -> FloatArray:
    from scipy.linalg.lapack import dtbtrs

    return np.asarray(dtbtrs(factor, Y)[0]) if Y.shape[1] else Y
