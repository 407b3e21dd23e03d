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
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression.estimate import Estimate
from rotorid.regression.undetermined_combinations import WORD_TOLERANCE

RCOND = 1e-12
"""Singular values below RCOND times the largest count as zero (after column scaling)."""


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
    if z.ndim == 0:
        raise ValueError("stretch takes a vector or matrices, not a number")
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
    pairs = np.ascontiguousarray(v, dtype=np.float64)
    if not pairs.shape or pairs.shape[-1] % 2:
        raise ValueError(f"a stretched vector has Re, Im pairs; got shape {pairs.shape}")
    return pairs.view(np.complex128)


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


def least_squares(  # noqa: PLR0915
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
        Weight of each squared residual, ≥ 0, shape of Y; a row of weight 0 is left out. Default: 1/σ² with
        `sigma`, else 1.
    sigma
        Stated errors of Y: one standard deviation of each entry, shape of Y or scalar, > 0 (of real and
        imaginary part alike, for complex Y); or the covariance matrix of the (stretched) Y, which then also
        weights the rows.
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
    A, y, labels, doubled = _real_problem(K, Y, names)
    m, n = A.shape
    row, covariance_y = _row_errors(sigma, m, doubled)
    w = _row_weights(weights, m, doubled)
    if covariance_y is not None:
        if w is not None:
            raise ValueError("give either weights or a covariance matrix of Y, not both")
        white = np.linalg.solve(np.linalg.cholesky(covariance_y), np.column_stack((A, y)))
        scaled_A, scaled_y, error_scale = white[:, :n], white[:, n], np.ones(m)
    else:
        root = np.sqrt(w) if w is not None else (1.0 / row if row is not None else np.ones(m))
        scaled_A, scaled_y = A * root[:, None], y * root
        # standard deviation of a weighted row: stated, or 1 (in units of s) by the meaning of weights
        error_scale = root * row if row is not None else np.ones(m)

    norms = np.linalg.norm(scaled_A, axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    U, s, Vt = np.linalg.svd(scaled_A / scale, full_matrices=False)
    rank = int(np.count_nonzero(s > rcond * s[0])) if s.size and s[0] > 0 else 0
    pinv_rows = (Vt[:rank].T / s[:rank]) @ U[:, :rank].T / scale[:, None]
    solution = pinv_rows @ scaled_y
    # one step of refinement costs nothing and recovers the last digits of badly scaled problems
    solution = solution + pinv_rows @ (scaled_y - scaled_A @ solution)
    residuals = y - A @ solution
    weighted = scaled_y - scaled_A @ solution

    active = m if w is None else int(np.count_nonzero(w))
    dof = active - rank
    stated = row is not None or covariance_y is not None
    spread = pinv_rows * error_scale
    covariance: FloatArray | None = None
    if stated:
        covariance = spread @ spread.T
    elif dof > 0:
        covariance = spread @ spread.T * float(weighted @ weighted) / dof
    chi_square: float | None = None
    if stated:
        used = error_scale > 0
        chi_square = float(np.sum((weighted[used] / error_scale[used]) ** 2))

    row_space = Vt[:rank] * scale
    values, full_covariance = solution.copy(), covariance
    if rank < n:
        null = _null_share(Vt[:rank])
        lost = null > WORD_TOLERANCE
        values[lost] = np.nan
        if covariance is not None:
            covariance = covariance.copy()
            covariance[lost, :] = covariance[:, lost] = np.nan
    condition = float(s[0] / s[-1]) if rank == n and m >= n else float("inf")
    return Estimate(
        names=labels,
        values=values,
        solution=solution,
        covariance=covariance,
        residuals=residuals,
        dof=dof,
        rank=rank,
        condition_number=condition,
        singular_values=s,
        errors_stated=stated,
        chi_square=chi_square,
        row_space=row_space,
        solution_covariance=full_covariance,
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
    K = np.asarray(A)
    size = np.linalg.norm(K, axis=-2, keepdims=True)
    scale = np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.pinv(K / scale, rcond=rcond) / np.swapaxes(scale, -1, -2))


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
    K = np.asarray(A)
    size = np.linalg.norm(K, axis=0)
    scale = np.where(size > 0, size, 1.0)
    found, _, rank, _ = np.linalg.lstsq(K / scale, np.asarray(y), rcond=rcond)
    return (found.T / scale).T, int(rank)


def covariance_root(covariance: FloatArray, variance: FloatArray) -> FloatArray:
    """R with R Rᵀ = C, shape (…, n, n), without what is negative of it; in units of a variance (…, n)."""
    size = np.sqrt(np.maximum(variance, 0.0))
    scale = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / (scale[..., :, None] * scale[..., None, :]))
    return np.asarray(scale[..., :, None] * vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :])


def _real_problem(
    K: ArrayLike, Y: ArrayLike, names: Sequence[str] | None
) -> tuple[FloatArray, FloatArray, tuple[str, ...], bool]:
    A, y = np.asarray(K), np.asarray(Y)
    if A.ndim != 2 or y.ndim != 1 or A.shape[0] != y.shape[0]:
        raise ValueError(f"K must be (m, n) and Y (m,); got {A.shape} and {y.shape}")
    if 0 in A.shape:
        raise ValueError(f"there is nothing to estimate: K has shape {A.shape}")
    n = A.shape[1]
    labels = tuple(names) if names is not None else tuple(f"θ{i + 1}" for i in range(n))
    if len(labels) != n or len(set(labels)) != n:
        raise ValueError(f"{n} different names are needed for the {n} columns of K; got {list(labels)}")
    doubled = np.iscomplexobj(A) or np.iscomplexobj(y)
    if doubled:
        A, y = stretch(A), stretch(y)
        labels = tuple(f"{part} {name}" for name in labels for part in ("Re", "Im"))
    A, y = A.astype(np.float64), y.astype(np.float64)
    if not (np.isfinite(A).all() and np.isfinite(y).all()):
        raise ValueError("K and Y must be finite; found NaN or infinity")
    return A, y, labels, doubled


def _row_errors(
    sigma: ArrayLike | None, m: int, doubled: bool
) -> tuple[FloatArray | None, FloatArray | None]:
    if sigma is None:
        return None, None
    s = np.asarray(sigma, dtype=np.float64)
    if not np.isfinite(s).all():
        raise ValueError("the stated errors must be finite")
    if s.ndim == 2:
        if s.shape != (m, m):
            raise ValueError(f"the covariance of Y must have shape ({m}, {m}); got {s.shape}")
        return None, s
    row = _per_row(s, m, doubled, "sigma")
    if (row <= 0).any():
        raise ValueError("every stated error must be greater than zero")
    return row, None


def _row_weights(weights: ArrayLike | None, m: int, doubled: bool) -> FloatArray | None:
    if weights is None:
        return None
    w = _per_row(np.asarray(weights, dtype=np.float64), m, doubled, "weights")
    if not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise ValueError("weights must be finite, not negative, and not all zero")
    return w


def _per_row(values: FloatArray, m: int, doubled: bool, what: str) -> FloatArray:
    if values.ndim == 0:
        return np.full(m, float(values))
    expanded = np.repeat(values, 2) if doubled else values
    if expanded.shape != (m,):
        raise ValueError(f"{what} must have one entry per row of Y; got shape {values.shape}")
    return expanded


def _null_share(rows: FloatArray) -> FloatArray:
    """Length of each unit vector's part outside the row space (n,), from orthonormal rows."""
    n = rows.shape[1]
    return np.asarray(np.linalg.norm(np.eye(n) - rows.T @ rows, axis=0))
