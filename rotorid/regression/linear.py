"""Linear least squares `K θ = Y`: the one kernel of every estimation problem of this project.

Complex equations become real rows in one of two ways:

- complex unknowns (balancing, forces): `stretch`, an entry k becomes [[Re k, −Im k], [Im k, Re k]]
  ([S] (12)–(15), (29)–(33));
- real unknowns in complex equations (identification): `stack`, a row becomes its real and its imaginary part.

Solution by SVD of the row-weighted, column-scaled matrix; KᵀK is never formed. The covariance follows the
source of the errors: stated errors of Y are taken as they are and give normal intervals; otherwise the
variance of the residuals and Student's t; without degrees of freedom there is no interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, text
from rotorid.regression.estimate import WORD_TOLERANCE, Estimate, unit_columns

RCOND = 1e-12
"""Singular values below RCOND times the largest count as zero (after column scaling)."""
JACOBIAN_RCOND = 1e-10
"""The same for derivatives, which carry more rounding than a table."""


def stretch(a: ArrayLike) -> FloatArray:
    """Stretch complex equations for complex unknowns into real ones.

    Parameters
    ----------
    a
        Complex vector (m,), matrix (m, n), or matrices (…, m, n).

    Returns
    -------
    (2m,) with Re, Im interleaved, or (…, 2m, 2n) with blocks [[Re, −Im], [Im, Re]], so that
    `stretch(A @ x) == stretch(A) @ stretch(x)`. Source: [S] (12)–(15).

    Raises
    ------
    ValueError
        For a single number.

    Examples
    --------
    >>> stretch([1 + 2j])
    array([1., 2.])
    >>> stretch([[1 + 2j]])
    array([[ 1., -2.],
           [ 2.,  1.]])
    """
    z = np.asarray(a, dtype=complex)
    if z.ndim == 1:
        return np.ascontiguousarray(z).view(np.float64)
    *more, m, n = z.shape
    out = np.empty((*more, m, 2, n, 2))
    out[..., 0, :, 0] = out[..., 1, :, 1] = z.real
    out[..., 0, :, 1] = -z.imag
    out[..., 1, :, 0] = z.imag
    return out.reshape(*more, 2 * m, 2 * n)


def unstretch(v: ArrayLike) -> ComplexArray:
    """Turn stretched vectors back into complex ones.

    Parameters
    ----------
    v
        Re, Im pairs, shape (…, 2n).

    Returns
    -------
    Shape (…, n).

    Raises
    ------
    ValueError
        For another shape.
    """
    return np.ascontiguousarray(v, dtype=np.float64).view(np.complex128)


def stack(a: ArrayLike) -> FloatArray:
    """Split complex equations for real unknowns into real rows.

    Parameters
    ----------
    a
        Complex array, rows first: (m,) or (m, n).

    Returns
    -------
    (2m,) or (2m, n): each row's real part, then its imaginary part. Source: [S] (23).
    """
    z = np.asarray(a, dtype=complex)
    return np.stack((z.real, z.imag), axis=1).reshape(2 * z.shape[0], *z.shape[1:])


def least_squares(
    K: ArrayLike,
    Y: ArrayLike,
    *,
    names: Sequence[str] | None = None,
    weights: ArrayLike | None = None,
    sigma: ArrayLike | None = None,
    rcond: float = RCOND,
) -> Estimate:
    """Solve `K θ = Y` by weighted linear least squares.

    Parameters
    ----------
    K
        Matrix (m, n), real; or complex for complex unknowns, then it and Y are stretched and the estimate
        has 2n parameters "Re name", "Im name". For real unknowns in complex equations pass `stack(K)`.
    Y
        Right side (m,).
    names
        Of the n unknowns; default θ1, θ2, ….
    weights
        Weight of each squared residual, ≥ 0, shape of Y; a row of weight 0 is left out. Default: 1. Without
        `sigma` only.
    sigma
        Stated errors of Y, which weight the rows: one standard deviation of each entry, shape of Y or scalar,
        > 0 (of real and imaginary part alike, for complex Y).
    rcond
        Scaled singular values below `rcond` times the largest count as zero.

    Raises
    ------
    ValueError
        For shapes that do not fit, NaN or infinite entries, no rows or columns, negative weights, errors
        that are not positive.

    Notes
    -----
    Source: [S] (9), (15), (33). Errors of K are not looked at: where K holds measured amplitudes, use an
    effective-variance fit.

    Examples
    --------
    >>> print(least_squares([[1, 0], [1, 1], [1, 2]], [1.0, 3.1, 4.9], names=["a", "b"]).summary())
    All 2 parameters are determined (condition number 2.81).
    <BLANKLINE>
      parameter  estimate      ±    %  95 %: from       to
      a              1.05   0.11   11   -0.370597   2.4706
      b              1.95  0.087  4.4     0.84961  3.05039
    """
    A, y, labels = _real_problem(K, Y, names)
    m, n = A.shape
    over = _row_factors(weights, sigma, len(np.asarray(Y)), m)
    white, white_y = A * over[:, None], y * over
    unit, scale = unit_columns(white)
    U, s, Vt = np.linalg.svd(unit, full_matrices=False)
    rank = int(np.count_nonzero(s > rcond * s[0]))
    inverse = (Vt[:rank].T / s[:rank]) @ U[:, :rank].T / scale[:, None]
    x = inverse @ white_y
    # one step of refinement costs nothing and recovers the last digits of badly scaled problems
    x = x + inverse @ (white_y - white @ x)
    left = white_y - white @ x
    chi_square, stated = float(left @ left), sigma is not None
    dof = int(np.count_nonzero(over)) - rank
    covariance: FloatArray | None = None
    if stated or dof > 0:
        covariance = inverse @ inverse.T * (1.0 if stated else chi_square / dof)
    # length of each unit vector's part outside the row space
    lost = np.linalg.norm(np.eye(n) - Vt[:rank].T @ Vt[:rank], axis=0) > WORD_TOLERANCE
    return Estimate(
        names=labels,
        values=np.where(lost, np.nan, x),
        solution=x,
        covariance=None if covariance is None else np.where(lost[:, None] | lost, np.nan, covariance),
        residuals=y - A @ x,
        dof=dof,
        rank=rank,
        condition_number=float(s[0] / s[-1]) if rank == n else float("inf"),
        errors_stated=stated,
        chi_square=chi_square if stated else None,
        row_space=Vt[:rank] * scale,
        solution_covariance=covariance,
    )


def gain(A: ArrayLike, *, rcond: float = 1e-14) -> Any:  # noqa: ANN401
    """Matrix G with the least-squares solution x = G y of A x = y, for many matrices at once.

    Of several solutions it gives the one of the smallest scaled length; a column of zeros gives x = 0.

    Parameters
    ----------
    A
        Real or complex, (…, m, n); columns are scaled before its SVD.
    rcond
        Scaled singular values below `rcond` times the largest count as zero.

    Returns
    -------
    (…, n, m), real where A is.
    """
    unit, scale = unit_columns(np.asarray(A))
    return np.asarray(np.linalg.pinv(unit, rcond=rcond) / scale[..., None])


def solution(A: ArrayLike, y: ArrayLike, *, rcond: float = RCOND) -> Any:  # noqa: ANN401
    """The least-squares solution of A x = y alone, without errors: for steps of an iteration, and bounds.

    Parameters
    ----------
    A
        (m, n), real or complex; its columns are scaled, a column of zeros gives x = 0.
    y
        (m,), or (m, k) for k right sides.
    rcond
        Scaled singular values below `rcond` times the largest count as zero.

    Returns
    -------
    (n,) or (n, k), real where A and y are; of several solutions the one with the smallest scaled length.

    Examples
    --------
    >>> solution([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]], [1.0, 3.0, 5.0]).round(12).tolist()
    [1.0, 2.0]
    """
    return solution_and_rank(A, y, rcond=rcond)[0]


def solution_and_rank(A: ArrayLike, y: ArrayLike, *, rcond: float = RCOND) -> tuple[Any, int]:
    """As `solution`, and the rank of A: below n the equations leave combinations of x open."""
    unit, scale = unit_columns(np.asarray(A))
    x, _, rank, _ = np.linalg.lstsq(unit, np.asarray(y), rcond=rcond)
    return (x.T / scale).T, int(rank)


def covariance_root(covariance: FloatArray, variance: FloatArray) -> FloatArray:
    """R with R Rᵀ = C, (…, n, n), without what is negative of it; in units of a variance (…, n).

    R is symmetric in these units: the same whatever eigenvectors a library returns of equal variances.
    """
    size = np.sqrt(np.maximum(variance, 0.0))
    scale = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / (scale[..., :, None] * scale[..., None, :]))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    return np.asarray(scale[..., :, None] * root)


def _real_problem(
    K: ArrayLike, Y: ArrayLike, names: Sequence[str] | None
) -> tuple[FloatArray, FloatArray, tuple[str, ...]]:
    """The equations, real, and names of their unknowns."""
    A, y = np.asarray(K), np.asarray(Y)
    if A.ndim != 2 or A.shape[:1] != y.shape or 0 in A.shape:
        raise ValueError(f"K must be (m, n) and Y (m,), not empty; got {A.shape} and {y.shape}")
    n = A.shape[1]
    labels = tuple(names or (f"θ{i + 1}" for i in range(n)))
    if not len(labels) == len(set(labels)) == n:
        raise ValueError(f"{n} different names are needed for the {n} columns of K; got {list(labels)}")
    if np.iscomplexobj(A) or np.iscomplexobj(y):
        A, y = stretch(A), stretch(y)
        labels = tuple(f"{part} {name}" for name in labels for part in ("Re", "Im"))
    A, y = A.astype(np.float64), y.astype(np.float64)
    if not (np.isfinite(A).all() and np.isfinite(y).all()):
        raise ValueError("K and Y must be finite")
    return A, y, labels


def _row_factors(weights: ArrayLike | None, sigma: ArrayLike | None, rows: int, m: int) -> FloatArray:
    """What makes the m real rows of so many rows of Y weigh alike, (m,)."""
    if weights is not None and sigma is not None:
        raise ValueError("give either weights or errors of Y, not both")
    stated = sigma is not None
    each = np.asarray(sigma if stated else 1.0 if weights is None else weights, dtype=np.float64)
    right = (each > 0 if stated else each >= 0).all() and each.any() and np.isfinite(each).all()
    if not right or each.shape not in ((), (rows,)):
        raise ValueError(
            f"weights and errors need one finite entry per row of Y, {rows}: errors greater than zero, "
            f"weights not negative and not all 0; got {each.shape}"
        )
    over = 1.0 / each if stated else np.sqrt(each)
    return np.repeat(np.broadcast_to(over, rows), m // rows)


@dataclass(frozen=True, eq=False)
class NormalMatrix:
    """KᵀK (n, n) of the data's rows, [Q] (2.28), to look at: nothing is solved by it.

    Rows are taken over their errors where these are known, in the units of the unknowns. The condition number
    has four digits; it is infinite where the rows do not determine all unknowns.
    """

    names: tuple[str, ...]
    matrix: FloatArray
    condition_number: float

    def text(self) -> str:
        """As a table."""
        columns = (Column(n, row, "{:.6g}".format) for n, row in zip(self.names, self.matrix, strict=True))
        title = f"normal matrix of the last step, condition number {self.condition_number:.4g}"
        return f"{title}\n{text((Column('', self.names), *columns), width=10_000)}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(vars(self))


def normal_matrix(names: tuple[str, ...], K: FloatArray) -> NormalMatrix:
    """That of rows K (m, n)."""
    s = np.linalg.svd(K, compute_uv=False)
    full = solution_and_rank(K, np.zeros(len(K)), rcond=JACOBIAN_RCOND)[1] == len(names)
    return NormalMatrix(names, K.T @ K, float(f"{(s[0] / s[-1]) ** 2:.4g}") if full else np.inf)
