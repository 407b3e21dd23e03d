"""Estimate of the run-to-run error, from redundant runs: restricted likelihood on a grid.

Data are the residuals e of redundant runs, free of all coefficients (restricted likelihood), and those of
the corrected reading, Y₀ + W D, free of D. For a complex normal error of covariance Σ

    log L = −log det Σ − eᴴ Σ⁻¹ e,

taken on a grid of sizes (logarithmic, each as likely), mixtures of p, w and f, and shares of kinds (own
alone, common at a speed, to a run, to both: each as likely; see `balancing.coefficients.run_errors`). The
grid keeps what the data leave open: few spare runs, or errors common to all sensors, which count once.
Of more than `MOST` readings of a run evenly chosen ones take part: they tell a few sizes as well, and the
covariance of all would grow with the square of their number.

Source: restricted maximum likelihood (Patterson and Thompson 1971).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from balancing.coefficients.run_errors import Origin, RunErrors, Runs, assumed
from balancing.data.reading_errors import error_model
from balancing.data.trials import Trials
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IntArray
from rotorid.regression import gain, stretch

SIZES = np.geomspace(3e-4, 1.0, 12)
"""Whole size relative to the root mean square reading; refined where the likelihood is."""
_P, _F, _PF, _WF, _PW = (1.0, 0, 0), (0, 0, 1.0), (0.6, 0, 0.4), (0, 0.5, 0.5), (0.5, 0.5, 0)
MIXTURES = np.array([(_P, _P), (_P, _F), (_F, _F), (_PF, _PF), (_WF, _WF), (_PW, _PW)])
"""Shares of p, w and f in the mean variance of the readings, of the kind own and of those in common."""
SHARES = (0.04, 0.3, 0.6)
"""Of the kind own in the variance, or 1; no error between runs is common to all sensors to the last digit."""
EXPLAINED = 0.95
"""Level of the test by which the corrected reading takes part."""
FINE = 20
MOST = 64
_TOGETHER = 64
_LIKELY, _UNLIKELY, _POSSIBLE = 1e-5, 1e-3, 0.05


class Rows(NamedTuple):
    """Residuals e (K, S, C), combinations of the runs, and what is known of them.

    `m` (K, R): e = m Y; `known` (R, S, C): variance of the runs' readings in one direction by their errors;
    `free` (S, C, P): unknowns of a single row, absent (P = 0) or the coefficients of D.
    """

    e: ComplexArray
    m: ComplexArray
    known: FloatArray
    free: ComplexArray

    @property
    def dof(self) -> int:
        """Complex numbers that the rows tell of errors."""
        return int(self.e.size - self.free.shape[-1])


def spare_rows(A: ComplexArray, Y: ComplexArray, known: FloatArray) -> Rows:
    """Combinations of redundant runs that hold no coefficient.

    Parameters
    ----------
    A
        (1 T), shape (R, P + 1).
    Y, known
        Readings and their variances in one direction, (R, S, C).
    """
    R, n = A.shape
    size = np.sqrt(np.mean(np.abs(Y) ** 2 / np.mean(np.abs(Y) ** 2, axis=0).clip(1e-300), axis=(1, 2)))
    size = np.maximum(size, 0.1 * size.max())
    basis = np.linalg.svd(A / size[:, None])[0][:, n:] if n < R else np.zeros((R, 0))
    # in an order of their own, whatever that of the runs
    basis = basis @ np.linalg.eigh(basis.conj().T @ (size[:, None] ** 2 * basis))[1]
    m = basis.conj().T / size
    at = few(*Y.shape[1:])
    free = np.zeros((*Y.shape[1:], 0), dtype=complex)[at]
    return Rows(np.einsum("kr,rsc->ksc", m, Y[..., *at]), m, known[..., *at], free)


def corrected_row(
    A: ComplexArray, Y: ComplexArray, known: FloatArray, theta: ComplexArray
) -> tuple[Rows, ...]:
    """What the weights that correct the bare rotor leave of its reading, free of the weights; none for N ≤ P.

    Parameters
    ----------
    A, Y, known
        As `spare_rows`.
    theta
        (Y₀, W₁, …), shape (S, C, P + 1).
    """
    S, C, n = theta.shape
    if n > S * C or not theta[..., 0].any():
        return ()
    W, Y0 = theta[..., 1:].reshape(-1, n - 1), theta[..., 0].ravel()
    size = np.sqrt(np.mean(np.abs(Y) ** 2, axis=0)).ravel()
    size = np.maximum(size, 0.1 * size.max())
    D = -gain(W / size[:, None]) @ (Y0 / size)
    m = (np.concatenate(([1.0], D)) @ gain(A))[None]
    at = few(S, C)
    return (Rows(np.einsum("kr,rsc->ksc", m, Y[..., *at]), m, known[..., *at], theta[at][..., 1:]),)


def few(S: int, C: int) -> tuple[IntArray, IntArray]:
    """Index of at most `MOST` of S × C readings: all sensors where possible, speeds evenly chosen."""
    sensors = np.linspace(0, C - 1, min(C, MOST)).round().astype(np.int64)
    speeds = np.linspace(0, S - 1, min(S, MOST // len(sensors))).round().astype(np.int64)
    return speeds[:, None], sensors


class Grid(NamedTuple):
    """Points: every size, every mixture of p, w and f (M, 2, 3), every set of shares of the kinds (H, 3).

    A mixture gives squares of `RunErrors.sizes` relative to the square of the size, of the kind own and of
    those in common. `weights` (H,) are the probabilities of the shares before the data.
    """

    sizes: FloatArray
    mixtures: FloatArray
    shares: FloatArray
    weights: FloatArray

    @property
    def points(self) -> FloatArray:
        """Squares of `RunErrors.sizes`, sizes first, (G, 3, 3)."""
        found = np.einsum("g,mkb,hk->gmhbk", self.sizes**2, self.mixtures[:, [0, 1, 1]], self.shares)
        return np.asarray(found.reshape(-1, 3, 3))


def _grid(sizes: FloatArray, runs: Runs, mixtures: FloatArray = MIXTURES) -> Grid:
    """Of all mixtures and shares that such runs tell apart."""
    _, S, C = runs.Y.shape
    kinds = [[(1.0, 0.0, 0.0)]]
    if S * C > 1:
        kinds += [[(own, 0.0, 1 - own) for own in SHARES]]
    if S > 1 and C > 1:
        kinds += [[(own, (1 - own) * part, (1 - own) * (1 - part)) for own in SHARES] for part in (0.5, 1.0)]
    used = mixtures[~mixtures[..., 1].any(axis=1) | bool(runs.mean[1] > 0)]
    each = used / np.where(runs.mean > 0, runs.mean, 1.0) * runs.mean[0]
    weights = np.concatenate([np.full(len(kind), 1 / len(kind)) for kind in kinds])
    return Grid(sizes, each, np.concatenate(kinds), weights / weights.sum())


class Spectrum(NamedTuple):
    """Residuals in coordinates that are independent for errors of every size s: variance s² + `least`.

    `parts` (M·H, n) are the squares of the coordinates, `log` (M·H,) what their scales add to log det Σ.
    """

    log: FloatArray
    least: FloatArray
    parts: FloatArray

    def at(self, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log det Σ and eᴴ Σ⁻¹ e at every size, (sizes · M · H,) each."""
        log, q = np.empty((2, len(sizes), len(self.log)))
        for k, size in enumerate(sizes):
            variance = np.maximum(size**2 + self.least, 1e-300)
            log[k] = self.log + np.log(variance).sum(axis=1)
            q[k] = (self.parts / variance).sum(axis=1)
        return log.ravel(), q.ravel()


def spectrum(rows: Rows, runs: Runs, grid: Grid) -> Spectrum:
    """Of all rows, at every mixture and share of a grid; rows of many readings as if independent."""
    step = max(1, _TOGETHER // rows.e[0].size)
    at = few(*runs.Y.shape[1:])
    runs = Runs(*(part[..., *at] for part in runs))
    blocks = [slice(k, k + step) for k in range(0, len(rows.e), step)]
    found = [_of_block(rows.e[part], rows.m[part], rows, runs, grid) for part in blocks]
    return Spectrum(
        np.sum([each.log for each in found], axis=0),
        np.concatenate([each.least for each in found], axis=1),
        np.concatenate([each.parts for each in found], axis=1),
    )


def _of_block(e: ComplexArray, m: ComplexArray, rows: Rows, runs: Runs, grid: Grid) -> Spectrum:
    """Σ = s² V + K = L U (s² + μ) Uᴴ Lᴴ, with V = L Lᴴ and the eigenvalues μ of L⁻¹ K L⁻ᴴ."""
    K, S, C = e.shape
    n = K * S * C
    pairs = np.einsum("kr,lr->rkl", m, m.conj())

    def alone(variance: FloatArray) -> ComplexArray:  # (…, R, S·C): of the kind own
        each = np.einsum("rkl,...rn->...knl", pairs, variance.reshape(*variance.shape[:-2], -1))
        full = each[..., None] * np.eye(S * C)[:, None, :]  # (…, K, N, K, N)
        return np.asarray(full.reshape(*variance.shape[:-3], n, n))

    size = np.einsum("mb,brsc->mrsc", grid.mixtures[:, 0], runs.size)
    along = runs.Y.reshape(-1, S * C), runs.effect.reshape(-1, S * C)
    each = [np.einsum("rkl,ri,rj->kilj", pairs, part, part.conj()) for part in along]
    each.append(np.einsum("rkl,ij->kilj", pairs, _outer(runs.unbalance.reshape(-1, S * C))))
    common = np.einsum("mb,bkilj->mkilj", grid.mixtures[:, 1], each)
    same = np.kron(np.eye(S), np.ones((C, C)))[:, None, :]
    parts = [alone(size), (common * same).reshape(-1, n, n), common.reshape(-1, n, n)]
    # of both directions; the least is rounding
    V = 2 * np.einsum("hk,kmij->mhij", grid.shares, parts).reshape(-1, n, n)
    V = V + 1e-9 * np.trace(V, axis1=1, axis2=2).real.mean() / n * np.eye(n)
    known = 2 * alone(rows.known)
    left, V, known = _without(rows.free, e, V, known)
    L = np.linalg.cholesky(V)
    inverse = np.linalg.inv(L)
    least, U = np.linalg.eigh(inverse @ known @ inverse.conj().swapaxes(1, 2))
    square = np.abs(U.conj().swapaxes(1, 2) @ (inverse @ left)[..., None])[..., 0] ** 2
    log = 2 * np.log(np.einsum("gii->gi", L).real).sum(axis=1)
    return Spectrum(log, np.maximum(least, 0.0), square)


def _outer(columns: ComplexArray) -> ComplexArray:
    """Σ c cᴴ over columns (M, n), (n, n)."""
    return np.asarray(columns.T @ columns.conj())


def _without(free: AnyArray, e: AnyArray, V: AnyArray, known: AnyArray) -> tuple[AnyArray, ...]:
    """Residuals and their covariances, (…, n, n) both, without what the free unknowns do."""
    P = free.shape[-1]
    if not P:
        return e.ravel(), V, known
    basis = np.linalg.qr(free.reshape(e.size, P), mode="complete")[0][:, P:]
    left = basis.conj().T
    return left @ e.ravel(), left @ V @ basis, left @ known @ basis


def estimated(rows: Sequence[Rows], runs: Runs) -> RunErrors:
    """Size, mixture and kinds of the errors between runs.

    Parameters
    ----------
    rows
        Of redundant runs, and of the corrected reading; the latter counts where the former do not contradict.
    runs
        All of them.
    """
    coarse = _grid(SIZES, runs)
    found = [spectrum(each, runs, coarse) for each in rows if each.dof > 0]
    found = _agreeing(rows, found, SIZES, _posterior(found[:1], coarse))
    table = _posterior(found, coarse).reshape(len(SIZES), -1)
    seen = np.flatnonzero(table.sum(axis=1) > _LIKELY * table.sum(axis=1).max())
    low, high = SIZES[max(seen[0] - 1, 0)], SIZES[min(seen[-1] + 1, len(SIZES) - 1)]
    sizes = np.geomspace(low, high, FINE)
    fine = coarse._replace(sizes=sizes)
    probability = _posterior(found, fine)
    cumulated = np.cumsum(probability.reshape(FINE, -1).sum(axis=1))
    limits = np.interp((0.025, 0.975), cumulated, sizes) * np.sqrt(runs.mean[0])
    return _of_grid(fine.points, probability, runs, "estimated", (float(limits[0]), float(limits[1])))


def given(rows: Sequence[Rows], runs: Runs, relative: float, floor: float, origin: Origin) -> RunErrors:
    """Errors of known size; the data (as `estimated`) say only how much of them is common."""
    grid = _known(runs, relative, floor)
    if not grid.sizes.any():
        return RunErrors(origin=origin)
    found = [spectrum(each, runs, grid) for each in rows if each.dof > 0]
    found = _agreeing(rows, found, grid.sizes, np.ones(len(grid.points)))
    return _of_grid(grid.points, _posterior(found, grid), runs, origin, None)


def known_run_errors(trials: Trials, runs: Runs) -> RunErrors:
    """Errors between these runs: as stated; none beside stated errors of a reading; else assumed."""
    if trials.run_errors is not None:
        return given([], runs, *trials.run_errors, "stated")
    return RunErrors() if error_model(trials).source == "stated" else assumed(runs)


def scatter(
    rows: Sequence[Rows], runs: Runs, relative: float = 0.0, floor: float = 0.0
) -> tuple[float, float]:
    """How many times errors of known size the residuals are, and the probability of more.

    Whatever is common: shares count by how well they fit at the best size.
    """
    n = sum(each.dof for each in rows)
    grid = _known(runs, relative, floor)
    log, q = _likelihood([spectrum(each, runs, grid) for each in rows], grid)
    weight = _normal(-log - n * np.log(np.maximum(q, 1e-300)))
    return float(np.sqrt(weight @ q / n)), _chance(q, n, weight)


def seen_in(
    run: RunErrors, residual: ComplexArray, parts: FloatArray, W: ComplexArray
) -> tuple[float, RunErrors]:
    """Probability that errors alone leave more of a corrected reading than was found; what it says of them.

    Parameters
    ----------
    run
        Errors between runs: how sure their size is.
    residual, W
        Y₀ + W D, (S, C), and coefficients, (S, C, P).
    parts
        What of its covariance comes from what, as `RunErrors.degrees` takes it, (5, 2N, 2N).
    """
    dof = residual.size - W.shape[-1]
    if dof <= 0:
        return 1.0, run
    likely = run.probability > _UNLIKELY * run.probability.max()
    probability, ratios = _normal(np.log(run.probability[likely])), run.ratios[likely]
    e, parts, _ = _without(stretch(W.reshape(residual.size, -1)), stretch(residual.ravel()), parts, parts[0])
    V = np.einsum("gk,kij->gij", run.factors(ratios), parts)
    V += 1e-12 * np.trace(V, axis1=1, axis2=2).max() * np.eye(len(e))
    q = e @ np.linalg.solve(V, e[None, :, None])[..., 0].T / 2
    seen = _normal(np.log(probability) - np.linalg.slogdet(V)[1] / 2 - q)
    return _chance(q, dof, probability), replace(run, probability=seen, ratios=ratios)


def _agreeing(
    rows: Sequence[Rows], found: Sequence[Spectrum], sizes: FloatArray, probability: FloatArray
) -> list[Spectrum]:
    """Without that of the corrected reading where it is beyond what the grid explains (95 %).

    Unbalance outside the planes leaves such a rest; it says nothing of the errors.
    """
    used = [each for each in rows if each.dof > 0]
    return [
        each
        for row, each in zip(used, found, strict=True)
        if not row.free.shape[-1] or _chance(each.at(sizes)[1], row.dof, probability) > 1 - EXPLAINED
    ]


def _known(runs: Runs, relative: float, floor: float) -> Grid:
    """Every share of errors of one size, p and f."""
    parts = np.array([relative**2, 0.0, floor**2]) * runs.mean
    whole = parts.sum()
    mixture = parts / whole if whole else np.array([1.0, 0.0, 0.0])
    return _grid(np.sqrt([whole / (runs.mean[0] or 1.0)]), runs, np.stack((mixture, mixture))[None])


def _likelihood(found: Sequence[Spectrum], grid: Grid) -> tuple[FloatArray, FloatArray]:
    """Sum over all rows."""
    log, q = np.zeros((2, len(grid.points)))
    for each in found:
        more = each.at(grid.sizes)
        log, q = log + more[0], q + more[1]
    return log, q


def _posterior(found: Sequence[Spectrum], grid: Grid) -> FloatArray:
    log, q = _likelihood(found, grid)
    return _normal(np.tile(np.log(grid.weights), len(log) // len(grid.weights)) - log - q)


def _chance(q: FloatArray, n: int, probability: FloatArray) -> float:
    """Probability that errors leave more than q, at the best of the points of a grid that are likely."""
    from scipy.special import chdtrc

    return float(chdtrc(2 * n, 2 * q[probability > _POSSIBLE * probability.max()].min()))


def _normal(log: FloatArray) -> FloatArray:
    weight = np.exp(log - log.max())
    return np.asarray(weight / weight.sum())


def _of_grid(
    at: FloatArray,
    probability: FloatArray,
    runs: Runs,
    origin: Origin,
    interval: tuple[float, float] | None,
) -> RunErrors:
    """The grid in one: variances averaged by their precision, so that large ones do not decide."""
    total = np.einsum("gbk,b->gk", at, runs.mean)
    precision = probability / total.sum(axis=1)
    variance = np.einsum("g,gbk->bk", precision / precision.sum(), at)
    base = runs.mean @ variance
    kept = probability > 1e-6 * probability.max()
    return RunErrors(
        np.sqrt(variance),
        origin,
        interval,
        probability[kept] / probability[kept].sum(),
        (total / np.where(base > 0, base, 1.0))[kept],
        kinds=base,
    )
