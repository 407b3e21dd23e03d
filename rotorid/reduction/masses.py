"""Equivalent masses of a rotor by regression over its modes, formula (50), and the model that they make.

Free vibration of n masses in compliance form ([S] (49)), with springs c to the ground at the masses
(seals), is `x + α (M x″ + C x) = 0`. In a mode (λ = 1/ω², shape U) this reads

    Σ_j α_ij U_jk m_j = λ_k (U_ik + Σ_j α_ij c_j U_jk)          for every mass i and mode k,

linear in the masses: formula (50) of [S], B m = D. Where there are more rows (n k) than masses the masses
depend on how large the rows are: how each shape is scaled and how each row is weighted. Both are stated.

Shaft flexibility apart from that of two supports, formula (47): a force at a from the left support A loads
the supports, a span l apart, by the shares (l − a)/l and a/l ([S] (41)), whatever their stiffness. With R of
these shares, (n, 2), and δ of the shaft on rigid supports, α = δ + R diag(1/c) Rᵀ.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

import fem
from rotorid.base.arrays import FloatArray
from rotorid.regression import RCOND, Estimate, least_squares

Normalisation = Literal["first", "largest", "length"]
"""Each shape scaled to 1 at the first mass, to 1 at its largest entry, or to unit length."""
RowWeights = Literal["equal", "relative"]
"""Rows as they stand, or rows of mode k divided by λ_k."""
ZERO_AT_FIRST = 1e-9
"""A shape smaller than this share of its largest entry at the first mass has a node there."""
ASYMMETRY = 1e-4
"""A compliance matrix is symmetric (Maxwell); larger differences, of its largest entry, are refused."""


def design(
    compliance: ArrayLike,
    frequencies: ArrayLike,
    shapes: ArrayLike,
    *,
    seal_stiffness: ArrayLike = 0.0,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
) -> tuple[FloatArray, FloatArray]:
    """Matrix B and right side D of formula (50), for one set of masses or many at once.

    Parameters
    ----------
    compliance
        Deflection at mass i under unit force at mass j, m/N, shape (…, n, n), symmetric.
    frequencies
        Natural frequencies of the k modes, rad/s, shape (k,) or (…, k).
    shapes
        Mode shapes at the masses, shape (…, n, k), of any size and sign.
    seal_stiffness
        Of springs from each mass to the ground that `compliance` does not hold, N/m, scalar or (…, n).
    normalise
        "first": each shape is 1 at the first mass, as in the book; the result then depends on which mass is
        the first, and a shape with almost a node there outweighs all others. "largest": 1 at the largest
        entry; "length": unit length. The last two do not depend on the order of the masses: prefer them for
        ranking places and for measured shapes. For one mode all three give the same masses.
    rows
        "equal": rows as they stand, as in the book; those of the first mode are largest (by λ_1/λ_k) and
        dominate, so that the first frequency fits best. "relative": rows of mode k divided by
        λ_k = 1/ω_k², so that every mode counts the same; prefer it where the upper frequencies matter as
        much as the first.

    Returns
    -------
    B (…, n k, n) and D (…, n k), weighted, rows mode by mode (row n k' + i is mass i in mode k'). In a batch
    (leading dimensions) members whose shapes cannot be scaled have NaN rows.

    Raises
    ------
    ValueError
        For shapes that do not fit, NaN or infinite entries, frequencies that are not positive, a compliance
        that is not symmetric, unknown choices; without leading dimensions also for a mode
        with a node at the first mass (scaled to 1 there) or without any displacement.
    """
    alpha, omega, U, springs = _checked(compliance, frequencies, shapes, seal_stiffness)
    if rows not in ("equal", "relative"):
        raise ValueError(f'rows must be "equal" or "relative", not {rows!r}')
    scale = _scale(U, normalise)
    if np.isnan(scale).any() and max(alpha.ndim, U.ndim, omega.ndim + 1, springs.ndim + 1) == 2:
        raise ValueError(
            "a mode has a node at the first mass, or no displacement at any mass; choose other nodes, leave "
            'the mode out, or take normalise="largest"'
        )
    U = U / scale
    factors = omega**2 if rows == "relative" else np.ones_like(omega)
    B = np.swapaxes(U, -1, -2)[..., :, None, :] * alpha[..., None, :, :]  # (…, k, i, j)
    B = B * factors[..., :, None, None]
    D = np.swapaxes(U + alpha @ (springs[..., :, None] * U), -1, -2) * (factors / omega**2)[..., None]
    *batch, k, n = D.shape
    return np.broadcast_to(B, (*batch, k, n, n)).reshape(*batch, k * n, n), D.reshape(*batch, k * n)


def _scale(shapes: FloatArray, normalise: Normalisation) -> FloatArray:
    """What each shape of (…, n, k) is divided by, (…, 1, k); NaN where that is impossible."""
    sizes = np.abs(shapes)
    largest = sizes.max(axis=-2, keepdims=True)
    if normalise == "first":
        scale = shapes[..., :1, :]
        scale = np.where(np.abs(scale) < ZERO_AT_FIRST * largest, 0.0, scale)
    elif normalise == "largest":
        scale = np.take_along_axis(shapes, sizes.argmax(axis=-2, keepdims=True), axis=-2)
    elif normalise == "length":
        scale = np.linalg.norm(shapes, axis=-2, keepdims=True)
    else:
        raise ValueError(f'normalise must be "first", "largest" or "length", not {normalise!r}')
    return np.where(scale == 0, np.nan, scale)


def _checked(
    compliance: ArrayLike, frequencies: ArrayLike, shapes: ArrayLike, seal_stiffness: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The inputs of formula (50) as arrays that fit each other."""
    alpha, U, springs = (np.asarray(part, dtype=float) for part in (compliance, shapes, seal_stiffness))
    omega = np.atleast_1d(np.asarray(frequencies, dtype=float))
    n, k = U.shape[-2:] if U.ndim > 1 else (0, 0)
    if alpha.shape[-2:] != (n, n) or omega.shape[-1] != k or not n * k:
        raise ValueError(
            f"compliance must be (n, n) and shapes (n, k) for k frequencies; got {alpha.shape}, {U.shape} "
            f"and {omega.shape[-1]} frequencies"
        )
    if springs.ndim and springs.shape[-1] not in (1, n):
        raise ValueError(f"seal_stiffness must be one number or one per mass ({n}); got {springs.shape}")
    for name, value in (("compliance", alpha), ("shapes", U), ("seal_stiffness", springs)):
        if not np.isfinite(value).all():
            raise ValueError(f"{name} must be finite; found NaN or infinity")
    if not ((omega > 0) & np.isfinite(omega)).all():
        raise ValueError(
            "natural frequencies must be positive and finite: a rigid-body mode determines no masses"
        )
    largest = np.abs(alpha).max(axis=(-2, -1), keepdims=True)
    if (np.abs(alpha - np.swapaxes(alpha, -1, -2)) > ASYMMETRY * largest).any():
        raise ValueError(
            "compliance must be symmetric (deflection at i under a force at j equals that at j under a force "
            "at i); correct it, or average the two entries if both are measured"
        )
    return alpha, omega, U, np.broadcast_to(springs, (*springs.shape[:-1], n))


def equivalent_masses(
    compliance: ArrayLike,
    frequencies: ArrayLike,
    shapes: ArrayLike,
    *,
    seal_stiffness: ArrayLike = 0.0,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
    nonnegative: bool = False,
) -> Estimate:
    """Estimate the masses of an n-mass model from k modes, [S] (50).

    Parameters
    ----------
    compliance, frequencies, shapes, seal_stiffness, normalise, rows
        As in `design`, without leading dimensions. Computed or measured: the modes need not be those of a
        computed rotor.
    nonnegative
        Least squares over masses ≥ 0; those at the bound 0 have no interval. Where
        the bound holds nothing back the masses are those of the free regression.

    Returns
    -------
    Estimate of m1 … mn, kg. Masses that the modes do not determine are NaN in `values`, and
    `describe_rank()` names them. The intervals take the scatter of the rows of (50) for random; what errors
    of compliance and shapes do is `InputErrors` of `reduce`.

    Raises
    ------
    ValueError
        As in `design`.

    Examples
    --------
    >>> estimate = equivalent_masses([[2e-8, 1e-8], [1e-8, 2e-8]], [1e3], [[1.0], [1.0]])
    >>> estimate.values.round(3)
    array([33.333, 33.333])
    """
    B, D = design(
        compliance, frequencies, shapes, seal_stiffness=seal_stiffness, normalise=normalise, rows=rows
    )
    if B.ndim != 2:
        raise ValueError("equivalent_masses takes one model at a time; for many at once use design")
    names = [f"m{i + 1}" for i in range(B.shape[1])]
    used = B.any(axis=1)  # a row of zeros is no degree of freedom
    if not used.any():
        raise ValueError("every row of the regression is zero: these modes and compliances say nothing")
    free = least_squares(B[used], D[used], names=names)
    return _nonnegative(free, B[used], D[used]) if nonnegative else free


def _nonnegative(free: Estimate, B: FloatArray, D: FloatArray) -> Estimate:
    """The masses ≥ 0 with the least residual; covariance of the regression of the positive masses alone."""
    from scipy.optimize import nnls

    norms = np.linalg.norm(B, axis=0)
    start, _ = nnls(B / np.where(norms > 0, norms, 1.0), D / (np.linalg.norm(D) or 1.0))
    inner = least_squares(B * (start > 0), D, names=free.names)
    solution, unknown = inner.solution * (start > 0), np.where(np.isnan(free.values), np.nan, 0.0)
    covariance = inner.covariance
    return dataclasses.replace(
        free,
        values=unknown + solution,
        solution=solution,
        residuals=inner.residuals,
        covariance=None if covariance is None else covariance + np.add.outer(unknown, unknown),
        solution_covariance=inner.solution_covariance,
        dof=inner.dof,
    )


def solve_many(B: FloatArray, D: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Masses (t, n) and condition numbers (t,) of many regressions; NaN masses where they are not determined.

    Columns are scaled to length 1 first. The condition number is NaN where a shape cannot be scaled, inf
    where the rank is deficient.
    """
    masses, condition = np.full((len(B), B.shape[2]), np.nan), np.full(len(B), np.nan)
    usable = np.flatnonzero(np.isfinite(B).all(axis=(1, 2)))
    B, D = B[usable], D[usable]
    scale = np.linalg.norm(B, axis=1)
    scale[scale == 0] = 1.0
    left, s, right = np.linalg.svd(B / scale[:, None, :], full_matrices=False)
    determined = s[:, -1] > RCOND * s[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        condition[usable] = np.where(determined, s[:, 0] / s[:, -1], np.inf)
        solved = np.einsum("tin,ti,tn,tnj->tj", left, D, 1 / s, right, optimize=True) / scale
    masses[usable[determined]] = solved[determined]
    return masses, condition


def natural_frequencies(
    compliance: ArrayLike, masses: ArrayLike, *, seal_stiffness: ArrayLike = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Natural frequencies and shapes of a model in compliance form, or of many at once.

    Parameters
    ----------
    compliance, seal_stiffness
        As in `design`.
    masses
        kg, shape (…, n). Masses that are zero or negative are taken as they are.

    Returns
    -------
    Frequencies, rad/s, ascending, shape (…, n), NaN where a mode does not vibrate (only with masses that are
    not positive); shapes (…, n, n), a column per mode, scaled to the largest entry = 1.
    """
    alpha, m = np.asarray(compliance, dtype=float), np.asarray(masses, dtype=float)
    n = m.shape[-1]
    springs = np.broadcast_to(np.asarray(seal_stiffness, dtype=float), m.shape)[..., None, :]
    flexible = np.linalg.solve(np.eye(n) + alpha * springs, alpha)
    flexible = (flexible + np.swapaxes(flexible, -1, -2)) / 2
    lam, shapes, positive = np.empty_like(m), np.empty_like(flexible), (m > 0).all(axis=-1)
    root = np.sqrt(m[positive])[..., None]
    lam[positive], vectors = np.linalg.eigh(root * flexible[positive] * np.swapaxes(root, -1, -2))
    shapes[positive] = vectors / root
    if not positive.all():
        values, vectors = np.linalg.eig(flexible[~positive] * m[~positive][..., None, :])
        real = np.abs(values.imag) <= 1e-9 * np.abs(values)
        lam[~positive], shapes[~positive] = np.where(real, values.real, np.nan), vectors.real
    largest = np.nan_to_num(np.abs(lam)).max(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        omega = np.where(lam > 1e-15 * largest, 1.0 / np.sqrt(lam), np.nan)
    order = np.argsort(omega, axis=-1)  # NaN last
    shapes = np.take_along_axis(shapes, order[..., None, :], axis=-1)
    top = np.abs(shapes).argmax(axis=-2, keepdims=True)
    return np.take_along_axis(omega, order, axis=-1), shapes / np.take_along_axis(shapes, top, axis=-2)


def mac(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Modal assurance criterion between the columns of two sets of shapes.

    Parameters
    ----------
    a, b
        Shapes at the same points, (…, n, j) and (…, n, k).

    Returns
    -------
    (…, j, k), 1 where two shapes are proportional, 0 where they are orthogonal.

    Examples
    --------
    >>> mac([[1.0], [2.0]], [[2.0, 2.0], [4.0, -1.0]])
    array([[1., 0.]])
    """
    A, B = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    sizes = (A**2).sum(axis=-2)[..., :, None] * (B**2).sum(axis=-2)[..., None, :]
    return np.asarray((np.swapaxes(A, -1, -2) @ B) ** 2 / sizes)


def like(shapes: FloatArray, reference: FloatArray) -> FloatArray:
    """Scale each column to the least-squares size of the reference column, so that both can be drawn."""
    factor = (shapes * reference).sum(axis=0) / (shapes**2).sum(axis=0)
    return np.asarray(shapes * np.where(np.abs(factor) < 1e-12, 1.0, factor))


def mass_nodes(rotor: fem.Rotor, nodes: Sequence[int | str]) -> tuple[int, ...]:
    """Numbers of different nodes, given as numbers from 1 or names of stations; ValueError for others."""
    places = tuple(rotor.node(node) for node in nodes)
    if not places or len(set(places)) != len(places):
        raise ValueError(f"the masses need different nodes; got {list(nodes)}")
    return places


def plane_at_rest(rotor: fem.Rotor, speed: float | None) -> tuple[fem.Rotor, list[str]]:
    """The rotor's plane x without rotation, on springs to the ground or to pedestals, and what to say of it.

    Neither gyroscopic moments nor coupling between x and y nor damping have a place in formula (50).
    """
    if speed is not None and not (np.isfinite(speed) and speed >= 0):
        raise ValueError(f"the speed must be finite and not negative, in rad/s, not {speed}")
    lowest = max((support.speeds[0] for support in rotor.supports if support.speeds), default=0.0)
    omega = lowest if speed is None else float(speed)
    supports = [
        dataclasses.replace(
            support,
            stiffness=float(support.at(omega)[0][0, 0]),
            damping=0.0,
            speeds=(),
            pedestal=support.pedestal and fem.Pedestal(0.0, support.pedestal.xy("stiffness")[0]),
        )
        for support in rotor.supports
    ]
    model = dataclasses.replace(rotor.model, gyroscopic=False)
    plane = rotor
    remarks = []
    if (*supports, model) != (*rotor.supports, rotor.model):
        plane = dataclasses.replace(rotor, supports=supports, model=model)
    pedestals = any(s.pedestal and s.pedestal.mass for s in rotor.supports)
    if rotor.model.gyroscopic or not rotor.symmetric or any(s.coupled for s in rotor.supports) or pedestals:
        remarks.append(
            "formula (50) knows neither rotation nor coupling of the planes nor masses of pedestals: the "
            "model holds for the plane x of the rotor at rest; all that comes back in the small model"
        )
    if not rotor.constant:
        remarks.append(f"the stiffness of the supports (kxx) is that at {omega:.6g} rad/s (--speed)")
    return plane, remarks


@dataclass(frozen=True, eq=False)
class Separated:
    """The shaft's flexibility apart from that of its two supports.

    Attributes
    ----------
    nodes, positions
        Of the n masses, and their distance a from the left support, m.
    supports, span
        Nodes of both supports, and l between them, m.
    delta
        Compliance of the shaft on rigid supports, m/N, shape (n, n).
    """

    nodes: tuple[int, ...]
    positions: FloatArray
    supports: tuple[int, int]
    span: float
    delta: FloatArray

    @property
    def fractions(self) -> FloatArray:
        """Shares R of a force at each mass that both supports carry, (n, 2)."""
        return np.stack((self.span - self.positions, self.positions), axis=1) / self.span

    def compliance(self, stiffness: ArrayLike) -> FloatArray:
        """α, m/N, shape (n, n), with supports of this stiffness, N/m, one or (2,)."""
        return np.asarray(self.delta + (self.fractions / np.asarray(stiffness)) @ self.fractions.T)


def separate(rotor: fem.Rotor, nodes: Sequence[int | str]) -> Separated:
    """Separate the shaft's flexibility from that of its two supports, [S] (41)–(47).

    Parameters
    ----------
    rotor
        With bearings at two nodes.
    nodes
        Those of the n masses, numbers from 1 or names of stations; they may overhang.

    Raises
    ------
    ValueError
        For supports that equilibrium alone cannot share a force among, and for nodes that cannot be.
    """
    places = mass_nodes(rotor, nodes)
    ends = sorted({support.node for support in rotor.supports})
    if len(ends) != 2 or any(s.kind == "seal" or s.tilting_stiffness > 0 for s in rotor.supports):
        raise ValueError(
            "formula (47) needs bearings at exactly two nodes, without tilting stiffness and seals; this "
            f"rotor has supports at {', '.join(map(str, ends)) or 'no node'}: use the small model"
        )
    left, right, *at = rotor.positions[np.array([*ends, *places]) - 1]
    n = len(places)
    # on supports about as stiff as the shaft neither δ nor R diag(1/c) Rᵀ is lost in their sum
    c = bending_stiffness(rotor)
    even = dataclasses.replace(rotor, supports=[fem.Support(node, c) for node in ends])
    apart = Separated(places, np.array(at) - left, (ends[0], ends[1]), right - left, np.zeros((n, n)))
    delta = fem.compliance(even, places) - apart.compliance(c)
    off = ~np.isin(places, ends)  # the shaft does not bend where it is held
    return dataclasses.replace(apart, delta=(delta + delta.T) / 2 * np.outer(off, off))


def bending_stiffness(rotor: fem.Rotor) -> float:
    """48 E I / l³ of its stiffest section over its whole length, N/m."""
    bending = float((rotor.youngs_modulus * rotor.second_moment).max())
    return 48 * bending / float(np.sum(rotor.length)) ** 3
