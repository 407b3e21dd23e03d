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
from typing import Any, NamedTuple

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
    columns = np.stack((z, 1j * z), axis=-1).reshape(*more, m, 2 * n)
    return np.stack((columns.real, columns.imag), axis=-2).reshape(*more, 2 * m, 2 * n)


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
    sigma: ArrayLike | None = None,
    rcond: float = RCOND,
) -> Estimate:
    """Solve `K θ = Y` by linear least squares, weighted by errors where these are stated.

    Parameters
    ----------
    K
        Matrix (m, n), real: of complex equations `stretch(K)` or `stack(K)`.
    Y
        Right side (m,).
    names
        Of the n unknowns; default θ1, θ2, ….
    sigma
        Stated errors of Y, which weight the rows: one standard deviation of each entry, (m,) or one number,
        > 0. Default: rows count alike.
    rcond
        Scaled singular values below `rcond` times the largest count as zero.

    Raises
    ------
    ValueError
        For shapes that do not fit, entries that are complex or not finite, no rows or columns, errors that
        are not positive.

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
    A, y = np.asarray(K), np.asarray(Y)
    if A.ndim != 2 or A.shape[:1] != y.shape or 0 in A.shape:
        raise ValueError(f"K must be (m, n) and Y (m,), not empty; got {A.shape} and {y.shape}")
    m, n = A.shape
    labels = tuple(names or (f"θ{i + 1}" for i in range(n)))
    if not len(labels) == len(set(labels)) == n:
        raise ValueError(f"{n} different names are needed for the {n} columns of K; got {list(labels)}")
    stated, error = sigma is not None, np.asarray(1.0 if sigma is None else sigma, dtype=np.float64)
    if error.shape not in ((), (m,)) or not ((error > 0) & (error < np.inf)).all():
        raise ValueError(f"errors need one finite number above 0 per row of Y, {m}; got {error.shape}")
    white, white_y = A / error[..., None], y / error
    if np.iscomplexobj(white) or not (np.isfinite(white).all() and np.isfinite(white_y).all()):
        raise ValueError("K and Y must be real and finite")
    unit, scale = unit_columns(white)
    U, s, Vt = np.linalg.svd(unit, full_matrices=False)
    rank = int(np.count_nonzero(s > rcond * s[0]))
    Vt[:, ~white.any(axis=0)] = 0.0  # rounding, beside which there is nothing
    inverse = (Vt[:rank].T / s[:rank]) @ U[:, :rank].T / scale[:, None]
    x = inverse @ white_y
    # one step of refinement costs nothing and recovers the last digits of badly scaled problems
    x = x + inverse @ (white_y - white @ x)
    left = white_y - white @ x
    chi_square, dof = float(left @ left), m - rank
    covariance = inverse @ inverse.T * (1.0 if stated else chi_square / dof) if stated or dof > 0 else None
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
    return solution_and_rank(A, y, rcond)[0]


def solution_and_rank(A: ArrayLike, y: ArrayLike, rcond: float = RCOND) -> tuple[Any, int]:
    """`solution`, and the rank of A with its columns scaled, by one decomposition."""
    unit, scale = unit_columns(np.asarray(A))
    x, _, rank, _ = np.linalg.lstsq(unit, y, rcond)
    return (x.T / scale).T, int(rank)


def covariance_root(covariance: FloatArray, variance: FloatArray) -> FloatArray:
    """R with R Rᵀ = C, (…, n, n), without what is negative of it; in units of a variance (…, n).

    R is symmetric in these units: the same whatever eigenvectors a library returns of equal variances.
    """
    scale = np.sqrt(np.where(variance > 0, variance, 1.0))
    values, vectors = np.linalg.eigh(covariance / (scale[..., :, None] * scale[..., None, :]))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    return np.asarray(scale[..., :, None] * root)


class NormalMatrix(NamedTuple):
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
        return plain(self._asdict())


def normal_matrix(names: tuple[str, ...], K: FloatArray) -> NormalMatrix:
    """That of rows K (m, n)."""
    full = np.linalg.matrix_rank(unit_columns(K)[0], JACOBIAN_RCOND) == len(names)
    return NormalMatrix(names, K.T @ K, float(f"{np.linalg.cond(K) ** 2:.4g}") if full else np.inf)
