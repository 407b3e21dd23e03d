"""Equivalent masses of a rotor by regression over its modes, formula (50).

Free vibration of n masses in compliance form ([S] (49)), with springs c to the ground at the masses
(seals), is `x + α (M x″ + C x) = 0`. In a mode (λ = 1/ω², shape U) this reads

    Σ_j α_ij U_jk m_j = λ_k (U_ik + Σ_j α_ij c_j U_jk)          for every mass i and mode k,

linear in the masses: formula (50) of [S], B m = D. Where there are more rows (n k) than masses the masses
depend on how large the rows are: how each shape is scaled and how each row is weighted. Both are stated.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.answer import Answer
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.regression import Estimate, least_squares

if TYPE_CHECKING:
    import pandas as pd


Normalisation = Literal["first", "largest", "length"]
"""Each shape scaled to 1 at the first mass, to 1 at its largest entry, or to unit length."""

RowWeights = Literal["equal", "relative"] | ArrayLike
"""Rows as they stand, rows of mode k divided by λ_k, or own factors of shape (n, k)."""

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
        much as the first. An array (n, k), or one that broadcasts to it: own factors ≥ 0 of the rows (not
        squared; 0 leaves a row out), such as the inverse of their errors.

    Returns
    -------
    B (…, n k, n) and D (…, n k), weighted, rows mode by mode (row n k' + i is mass i in mode k'). In a batch
    (leading dimensions) members whose shapes cannot be scaled have NaN rows.

    Raises
    ------
    ValueError
        For shapes that do not fit, NaN or infinite entries, frequencies that are not positive, a compliance
        that is not symmetric, unknown choices, negative weights; without leading dimensions also for a mode
        with a node at the first mass (scaled to 1 there) or without any displacement.
    """
    alpha, omega, U, springs = _checked(compliance, frequencies, shapes, seal_stiffness)
    n, k = U.shape[-2:]
    batch = np.broadcast_shapes(alpha.shape[:-2], omega.shape[:-1], U.shape[:-2], springs.shape[:-1])
    U = normalised(U, normalise, quiet=len(batch) > 0)
    B = np.swapaxes(U, -1, -2)[..., :, None, :] * alpha[..., None, :, :]  # (…, k, i, j)
    D = (U + alpha @ (springs[..., :, None] * U)) / omega[..., None, :] ** 2  # (…, i, k)
    factors = row_factors(rows, omega, n)
    B = B * np.swapaxes(factors, -1, -2)[..., None]
    D = np.swapaxes(D * factors, -1, -2)
    return (
        np.ascontiguousarray(np.broadcast_to(B, (*batch, k, n, n))).reshape(*batch, k * n, n),
        np.ascontiguousarray(np.broadcast_to(D, (*batch, k, n))).reshape(*batch, k * n),
    )


def normalised(shapes: FloatArray, normalise: Normalisation, *, quiet: bool = False) -> FloatArray:
    """Shapes (…, n, k) scaled; with `quiet` NaN where that is impossible, else a ValueError."""
    largest = np.abs(shapes).max(axis=-2, keepdims=True)
    if normalise == "first":
        scale, bad = shapes[..., :1, :], np.abs(shapes[..., :1, :]) < ZERO_AT_FIRST * largest
    elif normalise == "largest":
        scale, bad = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=-2, keepdims=True), axis=-2), False
    elif normalise == "length":
        scale, bad = np.linalg.norm(shapes, axis=-2, keepdims=True), False
    else:
        raise ValueError(f'normalise must be "first", "largest" or "length", not {normalise!r}')
    still = largest == 0
    if not quiet and still.any():
        raise ValueError("a mode has no displacement at any mass; choose other nodes or leave the mode out")
    if not quiet and np.any(bad):
        raise ValueError(
            "a mode has a node at the first mass; choose another node for the first mass, "
            'or normalise="largest"'
        )
    return np.asarray(shapes / np.where(bad | still, np.nan, scale))


def row_factors(rows: RowWeights, omega: FloatArray, n: int) -> FloatArray:
    """What the rows of (50) are multiplied by: (…, n, k) or what broadcasts to it."""
    k = omega.shape[-1]
    if isinstance(rows, str):
        if rows == "equal":
            return np.ones((n, k))
        if rows == "relative":
            return np.asarray(omega[..., None, :] ** 2)
        raise ValueError(f'rows must be "equal", "relative" or an array of weights (n, k), not {rows!r}')
    factors = np.asarray(rows, dtype=float)
    if factors.ndim > 2 or any(a not in (1, b) for a, b in zip(factors.shape[::-1], (k, n), strict=False)):
        raise ValueError(f"row weights must have shape (n, k) = ({n}, {k}); got {factors.shape}")
    if not np.isfinite(factors).all() or (factors < 0).any() or not factors.any():
        raise ValueError("row weights must be finite, not negative, and not all zero")
    return np.broadcast_to(factors, (n, k))


def _checked(
    compliance: ArrayLike, frequencies: ArrayLike, shapes: ArrayLike, seal_stiffness: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    alpha = np.asarray(compliance, dtype=float)
    omega = np.atleast_1d(np.asarray(frequencies, dtype=float))
    U, springs = np.asarray(shapes, dtype=float), np.asarray(seal_stiffness, dtype=float)
    fits = alpha.ndim >= 2 and U.ndim >= 2 and alpha.shape[-2] == alpha.shape[-1] == U.shape[-2] > 0
    if not fits or U.shape[-1] != omega.shape[-1] or omega.shape[-1] == 0:
        raise ValueError(
            f"compliance must be (n, n) and shapes (n, k) for k frequencies; got {alpha.shape}, {U.shape} "
            f"and {omega.shape[-1]} frequencies"
        )
    n = U.shape[-2]
    if springs.ndim and springs.shape[-1] not in (1, n):
        raise ValueError(f"seal_stiffness must be one number or one per mass ({n}); got {springs.shape}")
    springs = np.broadcast_to(springs, (*springs.shape[:-1], n))
    for name, value in (("compliance", alpha), ("shapes", U), ("seal_stiffness", springs)):
        if not np.isfinite(value).all():
            raise ValueError(f"{name} must be finite; found NaN or infinity")
    if not ((omega > 0) & np.isfinite(omega)).all():
        raise ValueError(
            "natural frequencies must be positive and finite: a rigid-body mode determines no masses"
        )
    gap = np.abs(alpha - np.swapaxes(alpha, -1, -2)).max(axis=(-2, -1))
    if (gap > ASYMMETRY * np.abs(alpha).max(axis=(-2, -1))).any():
        raise ValueError(
            "compliance must be symmetric (deflection at i under a force at j equals that at j under a force "
            "at i); correct it, or average the two entries if both are measured"
        )
    return alpha, omega, U, springs


@dataclass(frozen=True, eq=False)
class BoundedEstimate(Estimate):
    """Masses that had to be ≥ 0; those at the bound are kept at zero and have no interval.

    Attributes
    ----------
    at_bounds
        Names of the masses at the bound: the data would make them negative.
    """

    at_bounds: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user must know before trusting the numbers."""
        if not self.at_bounds:
            return ()
        one = len(self.at_bounds) == 1
        return (
            f"{', '.join(self.at_bounds)} {'stands at its bound' if one else 'stand at their bounds'} 0 (the "
            "modes ask for less than nothing there): no standard deviation is given, and those of the others "
            f"hold {'it' if one else 'them'} fixed; leave {'this place' if one else 'these places'} out, or "
            "choose others",
        )

    @property
    def answer(self) -> Answer:
        """Masses ± standard deviations, and those at the bound."""
        return self.told(self.at_bounds)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the keys of an estimate, `at_bounds` and `warnings`."""
        return plain({**super().to_dict(), "at_bounds": self.at_bounds, "warnings": self.warnings})

    def to_frame(self) -> pd.DataFrame:
        """One row per mass: value, std, interval, and whether it stands at the bound."""
        frame = super().to_frame()
        frame["at_bound"] = [name in self.at_bounds for name in self.names]
        return frame


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
        Least squares over masses ≥ 0; the result is a `BoundedEstimate`, which names the masses at the
        bound. Where the bound holds nothing back the masses are those of the free regression.

    Returns
    -------
    Estimate of m1 … mn, kg. Masses that the modes do not determine are NaN in `values`, and
    `describe_rank()` names them. The intervals take the scatter of the rows of (50) for random; what errors
    of compliance and shapes do is `mass_uncertainty`.

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
    choices: dict[str, Any] = {"seal_stiffness": seal_stiffness, "normalise": normalise, "rows": rows}
    B, D = design(compliance, frequencies, shapes, **choices)
    if B.ndim != 2:
        raise ValueError("equivalent_masses takes one model at a time; for many at once use design")
    names = [f"m{i + 1}" for i in range(B.shape[1])]
    weights = np.where(np.abs(B).max(axis=1) > 0, 1.0, 0.0)  # rows of weight 0 are no degrees of freedom
    if not weights.any():
        raise ValueError("every row of the regression is zero: these modes and compliances say nothing")
    free = least_squares(B, D, names=names, weights=weights)
    return _bounded(B, D, weights, free) if nonnegative else free


def _bounded(B: FloatArray, D: FloatArray, weights: FloatArray, free: Estimate) -> BoundedEstimate:
    """The masses ≥ 0 with the least residual.

    B m is unique at the minimum, so masses that the free regression determines are unique here, too. The
    covariance is that of the regression of the positive masses alone.
    """
    from scipy.optimize import nnls

    norms = np.linalg.norm(B, axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    size = np.linalg.norm(D) or 1.0
    start, _ = nnls(B / scale, D / size)
    kept = np.flatnonzero(start > 0)
    known = ~np.isnan(free.values)
    n = len(free.names)
    solution, residuals, full = np.zeros(n), D.copy(), None
    if kept.size:
        inner = least_squares(B[:, kept], D, names=[free.names[j] for j in kept], weights=weights)
        solution[kept], residuals = inner.solution, inner.residuals
        if inner.covariance is not None:
            full = np.zeros((n, n))
            full[np.ix_(kept, kept)] = inner.covariance
    covariance = None if full is None else full.copy()
    if covariance is not None:
        lost = ~known
        lost[solution == 0] = True
        covariance[lost, :] = covariance[:, lost] = np.nan
    shared = {f.name: getattr(free, f.name) for f in dataclasses.fields(free)}
    changed = {
        "values": np.where(known, solution, np.nan),
        "solution": solution,
        "residuals": residuals,
        "covariance": covariance,
        "solution_covariance": full,
        "dof": int(np.count_nonzero(weights)) - kept.size,
    }
    at_bounds = tuple(name for j, name in enumerate(free.names) if known[j] and j not in kept)
    return BoundedEstimate(**{**shared, **changed}, at_bounds=at_bounds)
