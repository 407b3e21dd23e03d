"""Whirl: complex eigenvalues and shapes of the rotor turning at one speed or many.

λ² M + λ D(Ω) + K(Ω) of both planes (see `assembly`) is solved in one basis of the shaft for all speeds.

Basis. Let K₀ be the stiffness of the rotor on springs like its supports, σ ≥ 0, and Uᵀ U = K₀ + σ M. The
basis begins with the static answers to unit forces at the supports, so that no force of a support is ever
missing, and to the inertia of the lowest modes of K₀. For a pair (λ, x) of the reduced equations the shaft
is left with the loads

    r = (λ² − σ) M x + λ B x + Ω J (λ G + B) x,      J (x, y) = (y, −x), or −i of z = x + i y,

as far as the basis does not answer them: with e the part of U⁻ᵀ r outside of its images U x, the relative
error of λ is about |e|² / (xᴴ K₀ x + |λ|² xᴴ M x), of second order as that of a Rayleigh quotient. Vectors
have xᴴ K₀ x ≈ 1, images are orthonormal (in them low modes keep their digits), and |e|² is the estimate.
Where it is too large, the vectors corrected by their e, at a few speeds, are spanned by as few directions as
leave out 0.8 of the tolerance of none of them: these take the place of the modes. If that is not enough, the
largest directions of the new e join them.

Eigenvalues. With λ = σ + 1/μ the problem is μ² K_σ + μ D_σ + M with K_σ = K + σ D + σ² M and
D_σ = D + 2 σ M: the slowest modes are the largest μ, and mass may be zero. σ > 0 leaves room for rigid-body
modes. Vectors follow by inverse iteration.

Small real parts. With λ = ς + iω the imaginary part of xᴴ (λ² M + λ D + K) x = 0 is
2 ς ω m + ω Re d + ς Im d + Im k = 0: what does no work over an orbit, however large, is not in it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fem.assembly import Planes, Reduced, assemble, both_planes, multiply, project
from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.result import Result, holding_arrays
from fem.rotor import Rotor
from fem.undamped import Spectrum, finite_modes, lowest_modes, one_plane
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IndexArray, checked_speeds, whole
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, speed_text

GROWTH = 1e-14
"""Re λ / |λ| above which a mode grows: rounding of what damps and drives it."""
NONE = complex(np.nan, np.nan)
"""No mode: neither part of it may pass for a number."""
_TOLERANCE = 8e-9  # of eigenvalues, relative to their size
_FEW = 3  # speeds, about, for which the basis is made first
_SHIFT = 0.3  # σ in units of the reference frequency
_STILL = 1e-6  # |λ| below this part of the reference frequency is a rigid-body motion
_REAL = 0.1  # |Im λ| below this part of |λ| is no oscillation: log decrement above 62
_INFINITE = 1e-6  # |μ| below this part of the largest: no mass moves, or too little to be of interest
_QUIET = 1e-6  # |Re λ| below this part of |λ| comes from work, not from the eigenvalue, which has rounding


@holding_arrays
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

    def at(self, *speeds: ArrayLike) -> Whirl:
        """Whirl at other speeds, rad/s, in this basis."""
        return solve_modes(self.Q, np.hstack(speeds), self.values.shape[1], self.scale)


def solve_modes(Q: Reduced, speeds: FloatArray, m: int, scale: float) -> Whirl:
    """The m ≤ 2 R modes of lowest frequency at each speed, in a basis; `scale` as in `Whirl`.

    Parameters
    ----------
    Q
        The equations in a basis of the shaft.
    speeds
        rad/s, shape (S,).
    m
        How many modes, at most 2 R.
    scale
        A frequency of the order of the lowest, rad/s.

    Returns
    -------
    Eigenvalues, rad/s, and vectors in the basis, with NaN where there are fewer.
    """
    D, K = Q.at(speeds)
    lam = _eigenvalues(Q.M, D, K, scale)
    size = abs(lam)
    still = size < _STILL * scale
    oscillates = ~still & (abs(lam.imag) > _REAL * size)
    modes = np.where(oscillates & ((lam.imag > 0) | (Q.P.planes == 1)), lam, NONE)
    order = np.argsort(abs(modes.imag), axis=1, kind="stable")[:, :m]
    values = np.take_along_axis(modes, order, axis=1)
    missing = np.isnan(values)
    values[missing] = 1j * scale
    # Something of every unknown, so that no mode is left out, and apart for modes of one frequency.
    phases = np.outer(np.arange(1, m + 1), np.arange(Q.size) ** 1.5)
    vectors = _answers(Q.M, D, K, values, np.exp(1j * phases))
    vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
    values = _by_work(Q.M, D, K, values, vectors)
    values[missing] = vectors[missing] = NONE
    others = ~still & ~oscillates & (size < np.inf)
    real = tuple(np.sort(one.real[which])[::-1] for one, which in zip(lam, others, strict=True))
    return Whirl(Q, speeds, scale, values, vectors, real, still.sum(axis=1))


def polish(
    Q: Reduced, speeds: FloatArray, at: IndexArray, values: ComplexArray, vectors: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Improve single pairs by two steps of inverse iteration: each squares the error.

    Parameters
    ----------
    Q, speeds
        The problem, rad/s.
    at
        Which speed each pair belongs to, shape (B,).
    values, vectors
        Shapes (B,) and (B, R), vectors of length 1.
    """
    D, K = Q.at(speeds[at])
    lam, X = values[:, None], vectors[:, None]
    for _ in range(2):
        new = _answers(Q.M, D, K, lam, X @ np.swapaxes(D, 1, 2) + 2 * lam[..., None] * (X @ Q.M))
        lam = lam - 1 / (X.conj() * new).sum(axis=2)
        X = new / np.linalg.norm(new, axis=2, keepdims=True)
    return _by_work(Q.M, D, K, lam, X)[:, 0], X[:, 0]


def _eigenvalues(M: FloatArray, D: AnyArray, K: AnyArray, scale: float) -> ComplexArray:
    """All λ, shape (S, 2 R); −inf for motions without mass."""
    R = len(M)
    M, D = scale * scale * M, scale * D
    A = np.zeros((len(D), 2 * R, 2 * R), dtype=D.dtype)
    A[:, :R, R:] = np.eye(R)
    A[:, R:] = -np.linalg.solve(
        K + _SHIFT * D + _SHIFT**2 * M,
        np.concatenate((np.broadcast_to(M, D.shape), D + 2 * _SHIFT * M), axis=2),
    )
    mu = np.linalg.eigvals(A).astype(complex)
    # Motions without mass have μ = 0, as double eigenvalues that rounding turns into the root of its size.
    size = abs(mu)
    massless = size <= _INFINITE * size.max(axis=1, keepdims=True)
    mu[massless] = 1.0
    return np.where(massless, -np.inf, scale * (_SHIFT + 1 / mu))


def _answers(
    M: FloatArray, D: AnyArray, K: AnyArray, values: ComplexArray, loads: ComplexArray
) -> ComplexArray:
    """(λ² M + λ D + K)⁻¹ of loads (S, m, R) beside values λ (S, m)."""
    lam = values[..., None, None] * (1 + 1e-14)  # beside an eigenvalue, where the matrix is singular
    dynamic = lam * M
    dynamic += D[:, None]  # in place, as they are many
    dynamic *= lam
    dynamic += K[:, None]
    loads = np.broadcast_to(loads, dynamic.shape[:-1])[..., None]
    try:
        answers = np.linalg.solve(dynamic, loads)
    except np.linalg.LinAlgError:  # singular to the last bit all the same: moved by rounding
        dynamic += 1e-14 * abs(dynamic).max(axis=3, keepdims=True) * np.eye(len(M))  # each in its scale
        answers = np.linalg.solve(dynamic, loads)
    return np.asarray(answers[..., 0])


def _by_work(M: FloatArray, D: AnyArray, K: AnyArray, values: ComplexArray, X: ComplexArray) -> ComplexArray:
    """Values (S, m) whose small real parts have the digits of what damps and drives them."""
    quiet = abs(values.real) < _QUIET * abs(values)
    if not quiet.any():
        return values

    def form(A: AnyArray, sign: int) -> ComplexArray:
        part = A + sign * np.swapaxes(A.conj(), -1, -2)
        return np.asarray((X.conj() * (X @ np.swapaxes(part, -1, -2))).sum(axis=2))

    omega = values.imag
    power = omega * form(D, 1).real + form(K, -1).imag
    inertia = 2 * omega * form(M, 1).real + form(D, -1).imag
    return np.where(quiet, 1j * omega - power / inertia, values)


def solve_whirl(P: Planes, speeds: FloatArray, m: int) -> Whirl:
    """The m oscillating modes of lowest frequency at each speed, rad/s, to about eight digits.

    Parameters
    ----------
    P
        The rotor as both planes see it.
    speeds
        rad/s, shape (S,).
    m
        How many modes.

    Returns
    -------
    Eigenvalues, rad/s, vectors in a reduced basis, and the estimated error.

    Raises
    ------
    ValueError
        If a support has no table at a speed, or the mesh is too fine for float64.
    """
    most = finite_modes(one_plane(P.rotor, P.A))
    modes = min(m // 2 + 3, most)  # of a plane; some more than asked for
    while True:
        spectrum, scale = reference(P, speeds, modes)
        whirl = _in_basis(P, spectrum, scale, speeds, m)
        # Rigid-body motions and overdamped ones take room, too; and modes near the next ones feel them.
        if modes == most or (abs(whirl.values) ** 2 < spectrum.squares[-1]).all():
            return whirl
        modes = min(2 * modes, most)


def reference(P: Planes, speeds: FloatArray, m: int) -> tuple[Spectrum, float]:
    """The m lowest modes of a plane on supports as at the middle speed, without pedestals; their scale.

    Parameters
    ----------
    P, speeds, m
        As in `solve_whirl`, m of one plane.

    Returns
    -------
    The modes, and the lowest frequency that is not 0, rad/s.
    """
    K, _ = P.supports(speeds[speeds.size // 2, None])
    springs = np.maximum(np.einsum("sii->s", K[0]).real / P.planes, 0.0)
    held = zip(P.rows // P.A.stride + 1, springs, strict=True)
    spectrum = lowest_modes(one_plane(P.rotor, P.A, 0, held), m)
    moving = spectrum.squares[spectrum.squares > 0]
    return spectrum, np.sqrt(moving[0] if moving.size else spectrum.shift)


def _in_basis(P: Planes, spectrum: Spectrum, scale: float, speeds: FloatArray, m: int) -> Whirl:
    """Whirl in a reduced basis that is made for a few speeds, then for all."""
    from scipy.linalg.lapack import dtbtrs

    A, U, kept = P.A, spectrum.factor, P.rows.size
    loads = np.hstack((np.eye(A.size)[:, P.rows], multiply(A.mass, spectrum.vectors)))
    Y = np.linalg.qr(dtbtrs(U, loads, trans="T")[0])[0]
    some = speeds[:: -1 - speeds.size // _FEW][::-1]  # with the last, where gyroscopic loads are largest
    while True:
        Q = project(P, dtbtrs(U, Y)[0])
        loads = np.hstack([multiply(band, Q.basis) for band in (A.mass, A.gyroscopic, A.material)])
        images = dtbtrs(U, loads, trans="T")[0]
        outside, triangle = np.linalg.qr(images - Y @ (Y.T @ images))
        whirl = solve_modes(Q, some, m, scale)
        x, r = _vectors_and_loads(whirl, spectrum.shift)
        missing = -r @ triangle.T
        error = float((abs(missing) ** 2).sum(axis=(2, 3)).max())
        if error > _TOLERANCE and Y.shape[1] < A.size:
            parts = np.concatenate((x[..., kept:], missing), axis=3)
            columns = parts.reshape(-1, parts.shape[3])
            directions = np.linalg.eigh((columns.conj().T @ columns).real)[1]
            dropped = (abs(parts @ directions) ** 2).sum(axis=2).cumsum(axis=2).max(axis=(0, 1))
            new = np.hstack((Y[:, kept:], outside)) @ directions[:, dropped > 0.8 * _TOLERANCE]
            Y = np.linalg.qr(np.hstack((Y[:, :kept], new)))[0]
            kept = Y.shape[1]
        elif some.size < speeds.size:
            some = speeds
        else:
            return replace(whirl, error=error)


def _vectors_and_loads(whirl: Whirl, shift: float) -> tuple[ComplexArray, ComplexArray]:
    """Shaft vectors x, and the factors of M, G and B times the basis in r, (S, m, planes, d or 3 d)."""
    p, d = whirl.Q.P.planes, whirl.Q.basis.shape[1]
    lam, speed = np.nan_to_num(whirl.values)[..., None, None], whirl.speeds[:, None, None, None]
    x = np.nan_to_num(whirl.vectors)[..., : p * d].reshape(*whirl.values.shape, p, d)
    turned = speed * (whirl.Q.P.across @ x)
    return x, np.concatenate(((lam * lam - shift) * x, lam * turned, lam * x + turned), axis=3)


@holding_arrays
class WhirlModes(Result):
    """Modes of the rotor at one speed, by rising frequency.

    Attributes
    ----------
    speed
        rad/s.
    eigenvalues
        λ with Im λ > 0, rad/s, shape (n,): the motion is Re(shape · e^{λt}).
    x, y
        Complex shapes in both planes, shape (N, n), the farthest node at amplitude 1.
    real
        Eigenvalues of motions that do not oscillate (overdamped, or running away), rad/s, as far as they
        were found, slowest first.
    error
        Estimated relative error of the eigenvalues.
    rotor
        The rotor.
    warnings
        What the reader must know.
    """

    speed: float
    eigenvalues: ComplexArray
    x: ComplexArray
    y: ComplexArray
    real: FloatArray
    error: float
    rotor: Rotor
    warnings: tuple[str, ...] = ()

    @property
    def frequencies(self) -> FloatArray:
        """Whirl frequencies |Im λ|, rad/s, shape (n,)."""
        return self.eigenvalues.imag

    @property
    def log_decrements(self) -> FloatArray:
        """Logarithmic decrements −2π Re λ / |Im λ|, shape (n,); negative: unstable."""
        return decrements_of(self.eigenvalues)

    @property
    def direction(self) -> FloatArray:
        """1 forward, −1 backward, 0 neither (a line, or different along the rotor), shape (n,)."""
        return whirl_direction(self.x.T, self.y.T)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return plain(
            {
                "speed_rad_s": self.speed,
                "frequencies_rad_s": self.frequencies,
                "log_decrements": self.log_decrements,
                "direction": self._ways,
                "real_eigenvalues_rad_s": self.real,
                "warnings": self.warnings,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """The modes, one row each."""
        columns = (
            Column("mode", range(1, self.eigenvalues.size + 1)),
            Column("whirl", self._ways),
            Column("rpm", self.frequencies * RPM, "{:.2f}".format, "frequencies_rad_s.*", RPM),
            Column("rad/s", self.frequencies, "{:.4f}".format, "frequencies_rad_s.*"),
            Column("log dec", self.log_decrements, "{:z.4f}".format, "log_decrements.*"),
        )
        return (Table("whirl modes", columns),)

    def sentence(self) -> str:
        """How many modes there are at this speed, and which of them decays least."""
        least = int(np.argmin(self.log_decrements))
        return (
            f"{counted(self.eigenvalues.size, 'whirl mode')} at {speed_text(self.speed)}; mode {least + 1} "
            f"decays least, log decrement {self.log_decrements[least]:z.4g}."
        )

    @property
    def _ways(self) -> list[str]:
        return [DIRECTION_NAMES[way] for way in self.direction.tolist()]


def whirl_modes(rotor: Rotor, speed: float, n: int | None = None) -> WhirlModes:
    """Compute the whirl modes of lowest frequency at a speed, in a reduced basis: to 1e-8 and better.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    speed
        rad/s.
    n
        How many modes that oscillate, by default 6 or all there are; forward and backward whirl count apart.

    Raises
    ------
    ValueError
        If the speed is impossible or outside the table of a support, the model has fewer modes, or the mesh
        is too fine for float64.
    """
    speeds = checked_speeds([speed])
    n = checked_number(rotor, n)
    whirl = solve_whirl(both_planes(rotor), speeds, n)
    there = np.isfinite(whirl.values[0])
    if not there.any():
        raise ValueError(
            f"the rotor has no oscillating mode at {speed:.6g} rad/s: all motions are overdamped"
        )
    values, x, y = in_both_planes(whirl.values[0, there], whirl.Q.nodes(whirl.vectors[0, there]))
    size = np.hypot(abs(x), abs(y)).max(axis=1)
    real = whirl.real[0]
    warnings = missing_modes(real, int(whirl.still[0]), values.size, n)
    return WhirlModes(float(speeds[0]), values, x.T / size, y.T / size, real, whirl.error, rotor, warnings)


def decrements_of(lam: ComplexArray) -> FloatArray:
    """Logarithmic decrements; 0 of what neither grows nor decays, but for rounding.

    Parameters
    ----------
    lam
        Eigenvalues, rad/s, any shape.

    Returns
    -------
    Decrements, of that shape.
    """
    return np.where(abs(lam.real) <= GROWTH * abs(lam), 0.0, -2 * np.pi * lam.real / abs(lam.imag))


def whirling(Q: Reduced, values: ComplexArray, vectors: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """λ with Im λ > 0 and directions of modes (…) with vectors (…, R); NaN and 0 of none."""
    lam, x, y = in_both_planes(values, Q.nodes(np.nan_to_num(vectors)))
    return lam, np.where(np.isnan(lam), 0.0, whirl_direction(x, y))


def in_both_planes(
    values: ComplexArray, shapes: ComplexArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Eigenvalues with Im λ > 0 and their x and y, from (…) and (…, planes, N)."""
    if shapes.shape[-2] == 2:
        return values, shapes[..., 0, :], shapes[..., 1, :]
    # z = φ e^{λt}: x is its real part, y its imaginary part; the conjugate of λ has the positive frequency.
    z, way = shapes[..., 0, :], np.copysign(1.0, values.imag)[..., None]
    x = z.real + 1j * way * z.imag
    return values.real + 1j * abs(values.imag), x, -1j * way * x


def missing_modes(real: FloatArray, still: int, count: int, n: int) -> tuple[str, ...]:
    """Warnings of modes that are missing: `count` of n oscillate."""
    texts = [f"only {count} of {n} modes oscillate"] if count < n else []
    if still > 1:
        texts.append(f"rigid-body motions that nothing holds (eigenvalue 0, {still // 2} times) are left out")
    if real.max(initial=0.0) > 0:
        texts.append(
            f"the rotor runs away without oscillating (eigenvalue {real.max():.4g} 1/s): "
            "a support pushes it aside; check negative stiffness"
        )
    return tuple(texts)


def checked_number(rotor: Rotor, n: int | None) -> int:
    """How many modes to look for, by default 6 or all there are.

    Parameters
    ----------
    rotor
        The rotor.
    n
        How many modes are asked for; None: the default.

    Returns
    -------
    How many to compute.

    Raises
    ------
    ValueError
        If the model has fewer.
    """
    available = available_modes(rotor)
    n = min(6, available) if n is None else whole(n, "the number of modes")
    if not 1 <= n <= available:
        raise ValueError(
            f"{n} modes cannot be found: the model has 1 to {available}; "
            "choose n in this range, or divide the shaft into more elements"
        )
    return n


def available_modes(rotor: Rotor) -> int:
    """How many modes can oscillate at most: two for each unknown of a plane that moves mass.

    Parameters
    ----------
    rotor
        The rotor.

    Returns
    -------
    Their number.
    """
    pedestals = sum(bool(s.pedestal and s.pedestal.mass) for s in rotor.supports)
    return 2 * (finite_modes(one_plane(rotor, assemble(rotor))) + pedestals)
