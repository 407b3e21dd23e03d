"""Whirl: complex eigenvalues and shapes of the rotor turning at one speed or many.

λ² M + λ D(Ω) + K(Ω) of both planes (see `assembly`) is solved in one basis of the shaft for all speeds.

Basis. Let K₀ be the stiffness of the rotor on the mean of its supports, σ ≥ 0, and Uᵀ U = K₀ + σ M. The
basis begins with the static answers to the inertia of the lowest modes of K₀ and to unit forces at the
supports, so that K − K₀ never leaves its loads. For a pair (λ, x) of the reduced equations the shaft is then
left with the loads

    r = (λ² − σ) M x + λ B x + Ω J (λ G + B) x,      J (x, y) = (y, −x), or −i of z = x + i y,

less those that the basis answers. With e the part of U⁻ᵀ r outside of the images U x of the basis, the
relative error of λ is about |e|² / (xᴴ K₀ x + |λ|² xᴴ M x): it is of second order, as a Rayleigh quotient's.
The largest directions of all e (static answers to gyroscopic loads, to the inertia of the support vectors,
to material damping that differs along the shaft) join the basis, until the errors at the first, the middle
and the last speed are small. Images are orthonormal, in which low modes keep their digits.

Eigenvalues. With λ = σ + 1/μ the problem is μ² K_σ + μ D_σ + M with K_σ = K + σ D + σ² M and
D_σ = D + 2 σ M: the slowest modes are the largest μ, and mass may be zero. σ > 0 leaves room for rigid-body
modes. Vectors follow by inverse iteration.

Small real parts. With λ = ς + iω the imaginary part of xᴴ (λ² M + λ D + K) x = 0 is
2 ς ω m + ω Re d + ς Im d + Im k = 0: what does no work over an orbit, however large, is not in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fem._new.assembly import Planes, Reduced, assemble, both_planes, multiply, project
from fem._new.response import whirl_direction
from fem._new.rotor import Rotor, Support
from fem._new.undamped import Spectrum, finite_modes, lowest_modes
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray
from rotorid.base.checks import checked_speeds, whole
from rotorid.base.rpm import RPM, speed_text
from rotorid.base.tables import Column, Table, frame, html, terminal
from rotorid.base.text import counted

if TYPE_CHECKING:
    import pandas as pd

GROWTH = 1e-14
"""Re λ / |λ| above which a mode grows: rounding of what damps and drives it."""
NONE = complex(np.nan, np.nan)
"""No mode: neither part of it may pass for a number."""
DIRECTION_NAMES = {1.0: "forward", -1.0: "backward", 0.0: "mixed"}
_USUAL = 6  # modes, where nothing else is asked for
_TOLERANCE = 3e-9  # of eigenvalues, relative to their size
_ROUNDS = 8
_MORE = 3  # modes of a plane beyond those asked for
_SHIFT = 0.3  # σ in units of the reference frequency
_STILL = 1e-6  # |λ| below this part of the reference frequency is a rigid-body motion
_REAL = 0.1  # |Im λ| below this part of |λ| is no oscillation: log decrement above 62
_INFINITE = 1e-6  # |μ| below this part of the largest: no mass moves, or too little to be of interest
_QUIET = 1e-6  # |Re λ| below this part of |λ| comes from work, not from the eigenvalue, which has rounding
_BESIDE = 1 + 1e-14  # times an eigenvalue: there the matrix is not singular to the last bit


@dataclass(frozen=True, eq=False)
class Whirl:
    """Oscillating modes at each speed, by rising frequency, in one basis.

    What decays to nothing within a fraction of a turn (damping ratio above 0.995) does not oscillate: such
    motions are overdamped but for rounding, or at rest in the turning shaft, where its material damps them.

    Attributes
    ----------
    Q
        The equations in the basis.
    speeds
        rad/s, shape (S,).
    scale
        A frequency of the order of the lowest, rad/s.
    values
        λ, rad/s, shape (S, m), `NONE` where there are fewer. In two planes Im λ > 0; of a complex coordinate
        Im λ < 0 is backward whirl.
    vectors
        In the basis, scaled to length 1, shape (S, m, R).
    real
        Eigenvalues of motions that do not oscillate, rad/s, slowest first, one array per speed.
    still
        How many rigid-body motions without stiffness there are at each speed, shape (S,).
    error
        Estimated largest relative error of an eigenvalue.
    """

    Q: Reduced
    speeds: FloatArray
    scale: float
    values: ComplexArray
    vectors: ComplexArray
    real: tuple[FloatArray, ...]
    still: IndexArray
    error: float = 0.0


def solve(Q: Reduced, speeds: FloatArray, m: int, scale: float) -> Whirl:
    """The m modes of lowest frequency at each speed, in a basis; `scale` as in `Whirl`."""
    D, K = Q.at(speeds)
    lam, moving, oscillates = _eigenvalues(Q.M, D, K, scale)
    wanted = oscillates & ((lam.imag > 0) | (Q.P.planes == 1))
    room = ((0, 0), (0, m))
    key = np.pad(np.where(wanted, np.abs(lam.imag), np.inf), room, constant_values=np.inf)
    order = np.argsort(key, axis=1, kind="stable")[:, :m]
    there = np.isfinite(np.take_along_axis(key, order, axis=1))
    values = np.where(there, np.take_along_axis(np.pad(lam, room), order, axis=1), 1j * scale)
    values, vectors = _pairs(Q.M, D, K, values)
    values[~there], vectors[~there] = NONE, NONE
    at_rest = moving & ~oscillates
    real = tuple(np.sort(one.real[rest])[::-1] for one, rest in zip(lam, at_rest, strict=True))
    still = np.sum(np.abs(lam) < _STILL * scale, axis=1)
    return Whirl(Q, speeds, scale, values, vectors, real, still)


def with_speeds(whirl: Whirl, more: FloatArray) -> Whirl:
    """The same at more speeds, rad/s, in the same basis."""
    other = solve(whirl.Q, more, whirl.values.shape[1], whirl.scale)
    speeds, values, vectors, still = (
        np.concatenate((getattr(whirl, name), getattr(other, name)))
        for name in ("speeds", "values", "vectors", "still")
    )
    real, order = whirl.real + other.real, np.argsort(speeds, kind="stable")
    return replace(
        whirl,
        speeds=speeds[order],
        values=values[order],
        vectors=vectors[order],
        real=tuple(real[k] for k in order),
        still=still[order],
    )


def all_values(Q: Reduced, speeds: FloatArray, scale: float) -> tuple[ComplexArray, BoolArray]:
    """All eigenvalues at each speed, shape (S, 2 R), and which of them belong to motions that oscillate.

    Motions without mass, and rigid-body motions without stiffness, count as −scale.
    """
    D, K = Q.at(speeds)
    lam, moving, oscillates = _eigenvalues(Q.M, D, K, scale)
    k, j = np.nonzero(oscillates & (np.abs(lam.real) < _QUIET * np.abs(lam)))
    if k.size:
        lam[k, j] = _pairs(Q.M, D[k], K[k], lam[k, j][:, None])[0][:, 0]
    return np.where(moving, lam, -scale), oscillates


def polish(
    Q: Reduced, speeds: FloatArray, at: IndexArray, values: ComplexArray, vectors: ComplexArray, steps: int
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Improve single pairs by inverse iteration: each step squares the error, or more.

    Parameters
    ----------
    Q, speeds
        The problem, rad/s.
    at
        Which speed each pair belongs to, shape (B,).
    values, vectors
        Shapes (B,) and (B, R).
    steps
        How many, at least 1.

    Returns
    -------
    values, vectors
        Improved; vectors of length 1.
    last
        Relative change of the values by the last step, shape (B,).
    """
    D, K = Q.at(speeds[at])
    mirrored = Q.P.mirrored(speeds[at])
    lam, X, step = values[:, None], vectors[:, None], values[:, None]
    for _ in range(steps):
        lam = lam * _BESIDE
        inertia = 2 * lam[..., None] * Q.M
        new = _solved(_dynamic(Q.M, D, K, lam), X @ np.swapaxes(D, 1, 2) + X @ inertia[:, 0])
        left = Q.mirror(X) if mirrored else X.conj()
        test = left @ D + left @ inertia[:, 0]
        step = (test * X).sum(axis=2) / (test * new).sum(axis=2)
        lam, X = lam - step, new / np.linalg.norm(new, axis=2, keepdims=True)
    lam = _by_work(Q.M, D, K, lam, X)
    return lam[:, 0], X[:, 0], np.abs(step / lam)[:, 0]


def _eigenvalues(
    M: FloatArray, D: AnyArray, K: AnyArray, scale: float
) -> tuple[ComplexArray, BoolArray, BoolArray]:
    """All λ, shape (S, 2 R); which belong to motions with mass and stiffness; which to those that oscillate.

    λ without mass are σ + 1 in units of the scale.
    """
    R = len(M)
    M, D = scale * scale * M, scale * D
    A = np.zeros((len(D), 2 * R, 2 * R), dtype=D.dtype)
    A[:, :R, R:] = np.eye(R)
    loads = np.concatenate((np.broadcast_to(M, D.shape), D + 2 * _SHIFT * M), axis=2)
    A[:, R:] = -np.linalg.solve(K + _SHIFT * D + _SHIFT**2 * M, loads)
    mu = np.linalg.eigvals(A).astype(complex)
    # Motions without mass have μ = 0, as double eigenvalues that rounding turns into the root of its size.
    size = np.abs(mu)
    finite = size > _INFINITE * size.max(axis=1, keepdims=True)
    lam = scale * (_SHIFT + 1 / np.where(finite, mu, 1.0))
    size = np.abs(lam)
    moving = finite & (size >= _STILL * scale)
    return lam, moving, moving & (np.abs(lam.imag) > _REAL * size)


def _pairs(
    M: FloatArray, D: AnyArray, K: AnyArray, values: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Values (S, m) with real parts from work where these are small, and vectors, by inverse iteration."""
    # Something of every unknown, so that no mode is left out, and apart for modes of one frequency.
    start = np.exp(1j * np.outer(np.arange(1, values.shape[1] + 1), np.arange(len(M)) ** 1.5))
    X = _solved(_dynamic(M, D, K, values * _BESIDE), start)
    X /= np.linalg.norm(X, axis=2, keepdims=True)
    return _by_work(M, D, K, values, X), X


def _dynamic(M: FloatArray, D: AnyArray, K: AnyArray, values: ComplexArray) -> ComplexArray:
    """λ² M + λ D + K, shape (S, m, R, R)."""
    terms = np.stack((np.broadcast_to(M, D.shape), D, K), axis=1).reshape(len(D), 3, M.size)
    powers = np.stack((values**2, values, np.ones_like(values)), axis=2)
    return np.asarray((powers @ terms).reshape(*values.shape, *M.shape))


def _solved(A: ComplexArray, b: ComplexArray) -> ComplexArray:
    """A⁻¹ b of matrices (…, R, R) and vectors (…, R)."""
    return np.asarray(np.linalg.solve(A, np.broadcast_to(b, A.shape[:-1])[..., None])[..., 0])


def _by_work(
    M: FloatArray, D: AnyArray, K: AnyArray, values: ComplexArray, X: ComplexArray
) -> ComplexArray:
    """Values (S, m) whose small real parts have the digits of what damps and drives them."""

    def form(A: AnyArray) -> ComplexArray:
        return np.asarray((X.conj() * (X @ np.swapaxes(A, -1, -2))).sum(axis=2))

    omega = values.imag
    adjoint = np.swapaxes(D.conj(), 1, 2)
    power = omega * form(D + adjoint).real + form(K - np.swapaxes(K.conj(), 1, 2)).imag
    inertia = 4 * omega * form(M).real + form(D - adjoint).imag
    quiet = np.abs(values.real) < _QUIET * np.abs(values)
    return np.where(quiet, 1j * omega - power / inertia, values)


def solve_whirl(P: Planes, speeds: FloatArray, m: int) -> Whirl:
    """The m oscillating modes of lowest frequency at each speed, rad/s, to about eight digits.

    Raises
    ------
    ValueError
        If a support has no table at a speed, or the mesh is too fine for float64.
    """
    most = finite_modes(P.A)
    modes = min(m // 2 + _MORE, most)
    while True:
        Q, scale, error = _reduced(P, speeds, m, modes)
        whirl = replace(solve(Q, speeds, m, scale), error=error)
        # Rigid-body motions and overdamped ones take room, too.
        if modes == most or np.isfinite(whirl.values).all():
            return whirl
        modes = min(2 * modes, most)


def reference(P: Planes, speeds: FloatArray, m: int) -> tuple[Spectrum, float]:
    """Modes of the rotor on the mean stiffness of its supports, and the lowest frequency that is not 0."""
    K, _ = P.supports(speeds)
    direct = np.einsum("ksii->ksi", K).real
    floor = 1e-6 * float(np.abs(direct).max(initial=np.finfo(float).tiny))
    mean = np.exp(np.log(np.maximum(direct, floor)).mean(axis=(0, 2)))
    mean[mean < 2 * floor] = 0.0
    for i, stand in zip(P.pedestals, P.pedestal_stiffness.mean(axis=1), strict=True):
        mean[i] *= stand / (mean[i] + stand)
    supports = [
        Support(s.node, float(k), tilting_stiffness=s.tilting_stiffness)
        for s, k in zip(P.rotor.supports, mean, strict=True)
    ]
    rotor: Rotor = replace(P.rotor, supports=supports)
    A = assemble(rotor)
    spectrum = lowest_modes(rotor, A, min(m, finite_modes(A)))
    moving = spectrum.squares[spectrum.squares > 0]
    return spectrum, float(np.sqrt(moving[0] if moving.size else spectrum.shift))


def _reduced(P: Planes, speeds: FloatArray, m: int, modes: int) -> tuple[Reduced, float, float]:
    """The equations in a basis that begins with so many modes, the scale, and the error that it leaves."""
    from scipy.linalg.lapack import dtbtrs

    spectrum, scale = reference(P, speeds, modes)
    n, U = P.A.size, spectrum.factor
    unit = np.zeros((n, len(P.rows)))
    unit[P.rows, np.arange(len(P.rows))] = 1.0
    images = dtbtrs(U, np.hstack((multiply(P.A.mass, spectrum.vectors), unit)), trans="T")[0]
    images, Y = images / np.linalg.norm(images, axis=0), np.empty((n, 0))
    some = speeds[sorted({0, speeds.size // 2, speeds.size - 1})]
    for _ in range(_ROUNDS):
        directions, sizes, _ = np.linalg.svd(images - Y @ (Y.T @ images), full_matrices=False)
        left_out = np.cumsum(sizes[::-1] ** 2)[::-1]
        new = directions[:, left_out > _TOLERANCE / 3][:, : n - Y.shape[1]]
        Y = np.hstack((Y, new - Y @ (Y.T @ new)))
        Q = project(P, dtbtrs(U, Y)[0])
        loads = _unanswered(solve(Q, some, m, scale), spectrum.shift)
        columns = loads.reshape(-1, n).T
        images = dtbtrs(U, np.hstack((columns.real, columns.imag)), trans="T")[0]
        images -= Y @ (Y.T @ images)
        errors = (images**2).sum(axis=0).reshape(2, *loads.shape[:3]).sum(axis=(0, 3))
        if errors.max() <= _TOLERANCE or Y.shape[1] == n:
            break
    return Q, scale, float(errors.max())


def _unanswered(whirl: Whirl, shift: float) -> ComplexArray:
    """The loads r of each pair for unit energy, shape (S, m, planes, size)."""
    Q, A, p = whirl.Q, whirl.Q.P.A, whirl.Q.P.planes
    lam = np.nan_to_num(whirl.values)[..., None, None]
    X = np.nan_to_num(whirl.vectors)
    shapes = Q.expand(X)

    def times(band: FloatArray) -> ComplexArray:
        return multiply(band, shapes.reshape(-1, A.size).T).T.reshape(shapes.shape)

    strain = np.linalg.norm(X[..., : p * Q.basis.shape[1]], axis=2) ** 2
    motion = (X.conj() * (X @ Q.M)).sum(axis=2).real * np.abs(lam[..., 0, 0]) ** 2
    energy = np.maximum(strain + motion, np.finfo(float).tiny)[..., None, None]
    material = times(A.material)
    across = np.array([[0.0, 1.0], [-1.0, 0.0]]) if p == 2 else np.array([[-1j]])
    turning = whirl.speeds[:, None, None, None] * (across @ (lam * times(A.gyroscopic) + material))
    return ((lam**2 - shift) * times(A.mass) + lam * material + turning) / np.sqrt(energy)
from fem.whirl import WhirlModes, available_modes, checked_number, in_both_planes, missing_modes, whirl_modes  # noqa
