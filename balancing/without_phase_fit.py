"""Amplitudes without phases: every solution that explains them.

With the weights d_p mounted, a sensor of a linear rotor reads |y + Σ w_p d_p| at a speed. Only phases between
y and the w_p act on it: y is real and ≥ 0, and there are 1 + 2 P unknowns. Where a weight D leaves nothing,
the amplitudes are distances from it in an unknown scale. Three weights that are not in one line leave two
such places (circles of Apollonius), four leave one; weights in one line leave a mirror image however many
they are.

Each reading (a sensor at a speed) is fitted for itself: χ² = Σ ((|y + Σ w d_r| − a_r)/σ_r)² from many starts,
and has one or several minima. One of each is chosen, and the weights D that leave least of all, Σ |y + w D|²,
are one solution of the job. Where one weight may leave nothing anywhere, choices in which it does not are
dropped, and the weight is the one at which the least misfit of all readings, each in its own scale, is
smallest: its 95 % region are the weights whose misfit errors explain. In all other cases regions are those of
draws by the curvature of χ² at the minima.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from balancing.conditioning import chance
from balancing.regions import real_parts
from rotorid.base.arrays import ComplexArray, FloatArray

UNLIKE = 1e-4
"""Chance below which no single weight leaves nothing at every reading."""
_DRAWS, _MOST, _PLACES = 1000, 32, 4000
"""Draws of a minimum; choices; places of a weight."""
_OPEN, _TINY = 3.0, 1e-300
"""Deviation of what is open, of the largest amplitude."""
_FURTHER = 2.0
"""Logarithm of sizes, and angle, how far away from a weight its region is looked for."""
_STARTS = {
    p: np.outer(np.geomspace(least, most, sizes), np.exp(2j * np.pi * np.arange(ways) / ways)).ravel()
    for p, least, most, sizes, ways in ((1, 0.1, 10.0, 9, 16), (2, 0.3, 3.0, 3, 8))
}
"""Effects of a plane, relative to the bare rotor's reading, from which fits of one or two planes start."""


class Minimum(NamedTuple):
    """One solution of a reading: χ², (y, Re w₁, Im w₁, …) of shape (1 + 2P,), and draws (n, 1 + 2P) of it."""

    chi_square: float
    parameters: FloatArray
    draws: FloatArray


Choice = tuple[Minimum, ...]
"""One solution of each reading."""


class Fit:
    """What one sensor read at one speed in R runs, by all minima of χ², the best first.

    Parameters
    ----------
    weights
        Of each run and plane, (R, P), around 1; those in one line are real.
    amplitudes, errors
        Of each run, the largest 1, and one standard deviation, (R,).

    Attributes
    ----------
    parameters
        (y, Re w₁, Im w₁, …) of each minimum, shape (B, 1 + 2P).
    chi_square
        Of each, shape (B,).
    """

    def __init__(self, weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray) -> None:
        self._T, self._a, self._s = weights, amplitudes, errors
        P = weights.shape[1]
        w = np.array(list(product(_STARTS[P], repeat=P)))
        size = np.abs(1 + w @ weights.T) / errors
        scale = (size @ (amplitudes / errors)) / (size**2).sum(axis=1)
        x, chi_square = self._refined(scale[:, None] * np.column_stack((np.ones(len(w)), real_parts(w))))
        # weights in one line: what starts on it stays there, be it a minimum or a saddle
        again, lower = self._refined(x + 0.02)
        x = np.where((lower < chi_square - 1e-9)[:, None], again, x)
        x, chi_square = np.where(x[:, :1] < 0, -x, x), np.minimum(lower, chi_square)
        kept: list[int] = []
        for k in np.argsort(chi_square, kind="stable").tolist():
            if all(np.abs(x[k] - x[j]).max() > 0.01 for j in kept):
                kept.append(k)
        self.parameters, self.chi_square = x[kept], chi_square[kept]

    def minima(self, rng: np.random.Generator, within: float) -> list[Minimum]:
        """Those so much above the best at most, with draws of each by the curvature of χ² there."""
        n, out = self.parameters.shape[1], list[Minimum]()
        for x, chi_square in zip(self.parameters, self.chi_square, strict=True):
            if chi_square > self.chi_square[0] + within:
                break
            J = self._residuals(x[None])[1][0]
            root = np.linalg.cholesky(np.linalg.inv(J.T @ J + np.eye(n) / _OPEN**2))
            draws = x + rng.standard_normal((_DRAWS, n)) @ root.T
            out.append(Minimum(float(chi_square), x, np.where(draws[:, :1] < 0, -draws, draws)))
        return out

    def _residuals(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(|…| − a)/σ (B, R) of parameters (B, 1 + 2P), and their derivatives by these."""
        z = x[:, :1] + effects(x) @ self._T.T
        size = np.abs(z)
        along = (z.conj() / np.maximum(size, _TINY))[..., None]
        J = np.empty((*size.shape, x.shape[1]))
        J[..., :1], J[..., 1::2], J[..., 2::2] = along.real, (along * self._T).real, -(along * self._T).imag
        return (size - self._a) / self._s, J / self._s[:, None]

    def _refined(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Minima of χ² from starts (B, 1 + 2P), and χ² there (B,): Levenberg–Marquardt, all at once."""
        (r, J), damping = self._residuals(x), np.full((len(x), 1), 1e-2)
        for _ in range(200):
            normal, eye = np.einsum("bri,brj->bij", J, J), np.eye(x.shape[1])
            scale = damping * np.einsum("bii->b", normal)[:, None]
            gradient = np.einsum("bri,br->bi", J, r)[..., None]
            step = np.linalg.solve(normal + scale[..., None] * eye, gradient)[..., 0]
            r_new, J_new = self._residuals(x - step)
            better = ((r_new**2).sum(axis=1) < (r**2).sum(axis=1))[:, None]
            x, r = np.where(better, x - step, x), np.where(better, r_new, r)
            J = np.where(better[..., None], J_new, J)
            damping = np.where(better, damping / 5, damping * 5).clip(1e-10, 1e6)
            if np.all(np.abs(step) < 1e-9):
                break
        return x, (r**2).sum(axis=1)


def effects(parameters: FloatArray) -> ComplexArray:
    """Complex w (…, P) of parameters (…, 1 + 2P)."""
    return np.asarray(parameters[..., 1::2] + 1j * parameters[..., 2::2])


def best_weights(x: FloatArray, weights: FloatArray) -> ComplexArray:
    """Weights (n, P) that leave least, by parameters (n, N, 1 + 2P)."""
    y, w = x[..., :1] * weights[:, None], effects(x) * weights[:, None]
    return np.asarray(-(np.linalg.pinv(w, 1e-7) @ y)[..., 0])


def common_weight(
    start: ComplexArray, T: ComplexArray, a: FloatArray, s: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Places (n, 1) of one weight that leaves nothing, the best first, and χ² (n,) there of a ± s (R, N).

    Readings have one scale each, the best one.
    """

    def misfit(places: ComplexArray) -> FloatArray:
        distance = np.abs(T - places[:, None]) / s
        scale = (distance * a / s).sum(axis=1) / np.maximum((distance**2).sum(axis=1), _TINY)
        return np.asarray(((a / s - scale[:, None] * distance) ** 2).sum(axis=(1, 2)))

    spiral = np.geomspace(1e-4, 1.0, _PLACES) * np.exp(2.4j * np.arange(_PLACES))
    for reach in (*np.geomspace(1.0, 1e-6, 12), _FURTHER):
        places = np.vstack((start, start * np.exp(reach * spiral[:, None])))
        chi_square = misfit(places)
        start = places[chi_square.round(9).argmin()]  # rounding moves nothing
    return places, chi_square


def _together(minima: Sequence[Minimum], weights: FloatArray) -> tuple[float, float]:
    """Misfit of minima of the first readings, and how far in errors one weight is from leaving nothing."""
    x, draws = (np.array([getattr(one, name) for one in minima]) for name in ("parameters", "draws"))
    D = best_weights(x[None], weights[: len(x)])[0]
    left = real_parts((x[:, 0] + effects(x) @ D)[:, None])
    off = real_parts((draws[..., 0] + effects(draws) @ D)[..., None])
    unlike = left**2 / off.var(axis=1).clip(_TINY)
    return sum(one.chi_square for one in minima), float(unlike.sum())


def choices(readings: Sequence[Sequence[Minimum]], weights: FloatArray, limit: float) -> list[Choice]:
    """A minimum of each reading: those that go together, the best first.

    Where one weight may leave nothing anywhere, what is left by a choice counts in its errors.
    """
    kept: list[Choice] = [()]
    for minima in readings:
        longer = [(*some, one) for some in kept for one in minima]
        kept = sorted(longer, key=lambda choice: sum(_together(choice, weights)))[:_MOST]
    misfits, unlike = np.array([_together(choice, weights) for choice in kept]).T
    P = kept[0][0].parameters.size // 2
    if chance(unlike[0], 2 * (len(readings) - P)) >= UNLIKE:
        misfits = misfits + unlike
    return [kept[k] for k in np.argsort(misfits, kind="stable") if misfits[k] <= misfits.min() + limit]
