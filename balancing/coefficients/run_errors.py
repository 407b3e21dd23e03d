"""Run-to-run errors: what the same rotor with the same weights shows another time.

Mounting, thermal state, drift and what is not linear change a whole run, however often it is read. A reading
Y of a run has, besides its own error, one of the variance p²|Y|² + w²|W T|² + f² in each direction, in
proportion to the reading, to what the mounted weights do, and to neither; of three kinds: its own at each
sensor; common to the sensors at a speed; common to the run. What is common changes all readings in proportion
(p), as other weights do (w), or as further unbalances in the planes do (f). On a real rig nearly all of it is
common (`sample_data/rk4`): errors taken as independent then cover single planes, but not their sum.

How large they are is estimated in `balancing.coefficients.run_error_estimate`, which keeps what the data
leave open as points of a grid. A covariance of n numbers, with the eigenvalues λ relative to the one stated,
is passed on with degrees of freedom ν:

    log s² = E[mean log λ],   n F(n, ν; 95 %) = the 95 % quantile of the mixture of Σ λ χ²(1), over s².
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from balancing.data.reading_errors import inverse_root
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.regression import stretch

Origin = Literal["stated", "estimated", "assumed", "none"]

ASSUMED = 0.02
"""Of a reading, from run to run, where nothing says more: in proportion, and as further unbalances, each."""
_LIKELY = 1e-5


@dataclass(frozen=True, eq=False)
class RunErrors:
    """One standard deviation of what changes from run to run, in one direction of a reading.

    Attributes
    ----------
    sizes
        Of the reading, of the weights' effect, and in the unit of a reading, for the kinds own, common at a
        speed, common to the run, (3, 3).
    origin
        Where they come from.
    interval
        95 % interval of the whole, root mean square over the readings, in their unit; None: not estimated.
    probability, ratios
        Points of the grid, (G,), and the variance of each kind there, in units of that above, (G, 3).
    kinds
        Variance of each kind, mean over the readings, in their unit squared, (3,).
    merged
        Whether the kind own stands among the errors of the readings: runs read once do not tell them apart.
    """

    sizes: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    origin: Origin = "none"
    interval: tuple[float, float] | None = None
    probability: FloatArray = field(default_factory=lambda: np.ones(1))
    ratios: FloatArray = field(default_factory=lambda: np.ones((1, 3)))
    merged: bool = False
    kinds: FloatArray = field(default_factory=lambda: np.zeros(3))

    @property
    def common(self) -> float:
        """Share of the variance that readings have in common."""
        return float(self.kinds[1:].sum() / self.kinds.sum()) if self.kinds.any() else 0.0

    def variance(self, readings: ComplexArray, effect: ComplexArray) -> FloatArray:
        """Of each reading in a run whose weights do `effect`, in one direction, all kinds together."""
        p, w, f = np.sum(self.sizes**2, axis=1)
        return np.asarray(p * np.abs(readings) ** 2 + w * np.abs(effect) ** 2 + f)

    def factors(self, ratios: FloatArray) -> FloatArray:
        """Of the readings' own errors, the three kinds (G, 3), and known errors of a model, (G, 5)."""
        known = np.ones(len(ratios))
        return np.column_stack((ratios[:, 0] if self.merged else known, ratios, known))

    def degrees(self, parts: FloatArray, reading_dof: float | None = None) -> tuple[float, float | None]:
        """Scale and degrees of freedom of a covariance that holds these errors.

        Parameters
        ----------
        parts
            What of it comes from the readings' own errors, from the three kinds, and from errors of a model,
            which are known; (4, n, n) without them, or (5, n, n).
        reading_dof
            Degrees of freedom of the readings' own errors; None: known.

        Returns
        -------
        s² to multiply it by, and ν of Student's t and F (the region of n numbers at 95 % is exact); None
        (normal) where nothing is open.
        """
        from scipy.special import chdtr, chdtri, fdtri

        total = parts.sum(axis=0)
        n = len(total)
        root = inverse_root(total, 1e-12)
        white = root.T @ parts @ root
        share = float(np.trace(white[0])) / n
        spread = 0.0 if reading_dof is None else share**2 / reading_dof
        likely = self.probability > _LIKELY * self.probability.max()
        weight, ratios = self.probability[likely] / self.probability[likely].sum(), self.ratios[likely]
        each = np.einsum("gk,kij->gij", self.factors(ratios)[:, : len(white)], white)
        values = np.linalg.eigvalsh(each).clip(1e-9)
        size = float(np.exp(weight @ np.log(values).mean(axis=1)))
        if values.max() - values.min() < 1e-3 * size:
            return size, 1 / spread if spread else None
        # a sum of squares of unlike variances is a χ² of the same mean and variance
        unit = (values**2).sum(axis=1) / values.sum(axis=1)
        dof = values.sum(axis=1) / unit
        ends = chdtri(dof, 0.05) * unit
        bound = passes_zero(lambda c: float(weight @ chdtr(dof, c / unit)) - 0.95, min(ends), max(ends), 1e-4)
        wanted = bound / size
        if wanted <= chdtri(n, 0.05) * 1.001:
            return bound / float(chdtri(n, 0.05)), 1 / spread if spread else None
        nu = passes_zero(lambda nu: wanted - n * float(fdtri(n, nu, 0.95)), 0.5, 1e5, 1e-4)
        return size, 1 / (1 / nu + spread)


def passes_zero(function: Callable[[float], float], low: float, high: float, rtol: float = 1e-14) -> float:
    """Where a growing function passes zero; the end of the range where it does not."""
    from scipy.optimize import brentq

    if function(low) >= 0:
        return float(low)
    return float(high) if function(high) <= 0 else float(brentq(function, low, high, rtol=rtol))


class Runs(NamedTuple):
    """Readings and what the mounted weights do of them, (R, S, C), and what unbalances do, (P, S, C)."""

    Y: ComplexArray
    effect: ComplexArray
    unbalance: ComplexArray

    def along(self, r: int) -> ComplexArray:
        """What errors in common of a run go along, (2 + P, S, C): of p, of w, and the rest of f."""
        return np.concatenate((self.Y[[r]], self.effect[[r]], self.unbalance))

    @property
    def size(self) -> FloatArray:
        """Variance of each reading by errors of size 1, (3, R, S, C)."""
        return np.stack((np.abs(self.Y) ** 2, np.abs(self.effect) ** 2, np.ones(self.Y.shape)))

    @property
    def mean(self) -> FloatArray:
        """Mean variance of all readings by errors of size 1, (3,)."""
        return np.asarray(self.size.mean(axis=(1, 2, 3)))


def runs_of(Y: ComplexArray, weights: ComplexArray, W: ComplexArray) -> Runs:
    """Runs with the readings (R, S, C) and weights (R, P) at the coefficients (S, C, P)."""
    return Runs(Y, np.einsum("scp,rp->rsc", W, weights), unbalances(W))


class RunColumns(NamedTuple):
    """Errors between runs: own variance of each reading, (R, S, C); common columns, (2, R, 2 + P, S, C)."""

    own: FloatArray
    common: ComplexArray


def run_columns(run: RunErrors, runs: Runs) -> RunColumns:
    """Of such runs; the common ones as `Influence.common`."""
    own = np.einsum("b,brsc->rsc", run.sizes[:, 0] ** 2, runs.size)
    along = np.stack([runs.along(r) for r in range(len(runs.Y))])
    p, w, f = run.sizes[:, [2, 1]]
    each = np.stack((p, w, *[f] * len(runs.unbalance)), axis=1)
    return RunColumns(own, each[:, None, :, None, None] * along)


def unbalances(W: ComplexArray) -> ComplexArray:
    """What unbalances do, one in each plane, of equal effect and together of mean square 1, (P, S, C)."""
    columns = np.moveaxis(W, -1, 0)
    size = np.sqrt(np.mean(np.abs(columns) ** 2, axis=(1, 2), keepdims=True) * len(columns))
    return np.asarray(columns / np.where(size > 0, size, 1.0))


def marginal(common: ComplexArray | None, parameters: ComplexArray | None = None) -> FloatArray:
    """Covariance of each channel by common columns (…, M, S, C, n) and of parameters, (S, C, 2n, 2n)."""
    out = np.zeros((1, 1, 1, 1))
    if common is not None:
        F = common.reshape(-1, *common.shape[-3:])
        out = stretch(np.einsum("mscp,mscq->scpq", F, F.conj()))
    if parameters is not None:
        real = stretch(parameters[..., None])[..., 0]
        out = out + np.einsum("mscp,mscq->scpq", real, real)
    return out


def shares_of(parts: Sequence[FloatArray], total: FloatArray) -> FloatArray:
    """How much of a covariance (…, n, n) comes from each part, sum 1."""
    variance = np.einsum("...ii->...i", total)
    variance = np.where(variance > 0, variance, np.inf)
    values = np.array([np.sum(np.einsum("...ii->...i", part) / variance) for part in parts])
    return np.asarray(values / values.sum() if values.sum() > 0 else np.eye(len(values))[0])


def assumed(runs: Runs) -> RunErrors:
    """Where no run tells of them: of both kinds that corrections are most sensitive to.

    Data do not choose here: errors common to a run leave no trace in the corrected reading.
    """
    sizes = np.zeros((3, 3))
    sizes[0, 2] = ASSUMED
    sizes[2, 2] = ASSUMED * np.sqrt(runs.mean[0])
    return RunErrors(sizes, "assumed")
