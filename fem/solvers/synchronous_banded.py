"""Exact solution of the synchronous equations at one speed after another, by LU factors of a band.

Forward amplitudes F and backward amplitudes b, z = F e^{iωt} + b̄ e^{−iωt}, obey

    (K − ω² (M − G)) F + [D (F, b)]₁ = f,        (K − ω² (M + G) + 2 i ω B) b + [D (F, b)]₂ = 0:

material damping takes no part in forward whirl, which does not strain the turning shaft periodically.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fem.matrices.banded_matrices import Matrices, free_motions, general, multiply
from fem.matrices.support_dynamic_stiffness import Supported
from fem.matrices.undamped_matrices import whirling_mass
from fem.model.rotor import Rotor
from fem.solvers.eigen import rigid_scale
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray

AT_CRITICAL = 1e-8  # relative distance of λ from ω² at which an undamped rotor stands at its critical speed


def solve_banded(
    rotor: Rotor, A: Matrices, at: Supported, rows: IndexArray, loads: FloatArray, speeds: FloatArray
) -> tuple[ComplexArray, ComplexArray | None, tuple[float, float]]:
    """Amplitudes F and b, each of shape (S, a, b), at unknowns `rows` under forward loads.

    Also by how much of itself rounding the entries of K changes the result, and at which speed, rad/s; it is
    looked for at the slowest and fastest speed and at the largest response. b is None for one plane.

    Raises
    ------
    ValueError
        If nothing limits the response at one of the speeds.
    """
    from scipy.linalg.lapack import zgbsv

    planes, width = at.planes, at.planes * A.width
    K, mass = _wide(A.shaft, planes), _wide(whirling_mass(A, 1), planes)
    lag = np.zeros_like(K)
    if planes == 2:
        mass[:, 1::2] = _wide(whirling_mass(A, -1), planes)[:, 1::2]
        lag[:, 1::2] = 2 * _wide(A.material, planes)[:, 1::2]
    feet = np.array([A.deflection(node) for node in at.nodes], dtype=np.intp)

    # One load more, with a little of everything: it excites a mode that the given loads do not.
    probe = np.zeros(A.size)
    probe[A.deflections] = np.sin(1.0 + np.arange(rotor.n_nodes) ** 2)
    rhs = np.zeros((planes * A.size, loads.shape[1] + 1), dtype=complex, order="F")
    rhs[::planes, :-1], rhs[::planes, -1] = loads, probe

    def deflection(k: int) -> ComplexArray:
        omega = speeds[k]
        band = np.asfortranarray(K - omega * omega * mass, dtype=complex)
        if planes == 2:
            band += 1j * omega * lag
        for p in range(planes):
            for q in range(planes):
                np.add.at(band[2 * width + p - q], planes * feet + q, at.stiffness[k, :, p, q])
        _, _, X, info = zgbsv(width, width, band, rhs, overwrite_ab=True)
        if info != 0 or not np.isfinite(X).all():
            raise unlimited(float(omega))
        return np.asarray(X)

    parts = [np.empty((speeds.size, rows.size, loads.shape[1]), dtype=complex) for _ in range(planes)]
    probes = np.empty((A.size, planes, speeds.size), dtype=complex)
    for k in range(speeds.size):
        X = deflection(k)
        for plane, part in enumerate(parts):
            part[k] = X[planes * rows + plane, :-1]
            probes[:, plane, k] = X[plane::planes, -1]
    _check_limited(rotor, A, at, feet, probe, probes, speeds)
    size = np.abs(parts[0]).max(axis=(1, 2))
    suspects = {int(np.argmin(speeds)), int(np.argmax(speeds)), int(np.argmax(size))}
    errors = {k: _sensitivity(A, loads, deflection(k)[::planes, :-1]) for k in suspects}
    worst = max(errors, key=errors.__getitem__)
    return parts[0], parts[1] if planes == 2 else None, (errors[worst], float(speeds[worst]))


def rounding_warning(doubts: Iterable[tuple[float, float] | None]) -> tuple[str, ...]:
    """A sentence where rounding changes more than 1e-6 of some response: relative errors and their speeds."""
    error, speed = max((doubt for doubt in doubts if doubt is not None), default=(0.0, 0.0))
    if error < 1e-6:
        return ()
    return (
        f"near {speed:.6g} rad/s rounding may change the response by {error:.0e} of "
        "itself: hardly any damping limits it, or the mesh is too fine, or the speed is very low",
    )


def unlimited(omega: float) -> ValueError:
    """The error for an undamped rotor at its critical speed."""
    return ValueError(
        f"at {omega:.10g} rad/s the undamped rotor stands exactly at its critical speed {omega:.10g} rad/s, "
        "where the amplitude has no limit; give a support damping or choose another speed"
    )


def _wide(band: FloatArray, planes: int) -> FloatArray:
    """General band of `planes` copies with their unknowns interleaved."""
    single = general(band)
    if planes == 1:
        return single
    w = band.shape[0] - 1
    wide = np.zeros((6 * w + 1, 2 * band.shape[1]))
    for plane in (0, 1):
        wide[2 * w : 6 * w + 1 : 2, plane::2] = single[w:]
    return wide


def _check_limited(
    rotor: Rotor,
    A: Matrices,
    at: Supported,
    feet: IndexArray,
    probe: FloatArray,
    X: ComplexArray,
    speeds: FloatArray,
) -> None:
    """Refuse speeds where nothing limits the response.

    With one mode φ alone, x = φ (φᵀ f) / (λ − ω²): then |xᴴ f| / (xᴴ K x) is the relative distance of λ from
    ω², or the share of damping forces, whichever is larger.
    """
    work = np.abs(np.einsum("i,is->s", probe, X[:, 0]))
    energy = np.zeros(speeds.size)
    # Rigid-body motions have λ = 0: only a rotor at rest stands there.
    free = free_motions(rotor, {node for node, k in zip(at.nodes, at.reference, strict=True) if k > 0})
    inertia = np.where(speeds == 0, rigid_scale(rotor), 0.0) if free else np.zeros(speeds.size)
    for plane in range(X.shape[1]):
        for part in (X[:, plane].real, X[:, plane].imag):
            energy += np.einsum("is,is->s", part, multiply(A.shaft, part))
            energy += inertia * np.einsum("is,is->s", part, multiply(A.mass, part))
        held = np.abs(at.stiffness[:, :, plane, plane]) * np.abs(X[feet, plane]).T ** 2
        energy += held.sum(axis=1)
    wrong = work <= AT_CRITICAL * energy
    if wrong.any():
        raise unlimited(float(speeds[int(np.argmax(wrong))]))


def _sensitivity(A: Matrices, loads: FloatArray, X: ComplexArray) -> float:
    """What rounding the entries of K may change, relative to the deflection at the load."""
    size = np.abs(X)
    change = np.finfo(float).eps * np.einsum("ij,ij->j", size, multiply(np.abs(A.shaft), size))
    at_load = np.abs(np.einsum("ij,ij->j", loads, X))
    floor = 1e-6 * size.max(axis=0) * np.abs(loads).max(axis=0)  # where a load meets an antiresonance
    return float(np.max(change / np.maximum(np.maximum(at_load, floor), np.finfo(float).tiny)))
