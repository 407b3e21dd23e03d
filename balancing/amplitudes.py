"""Amplitudes without phases: every solution that explains them.

With the weights d_p mounted, a sensor of a linear rotor reads |y + Σ w_p d_p| at a speed. Only phases between
y and the w_p act on it: y is real and ≥ 0, and there are 1 + 2 P unknowns. Where a weight D leaves nothing,
the amplitudes are distances from it in an unknown scale. Three weights that are not in one line leave two
such places (circles of Apollonius), four leave one; weights in one line leave a mirror image however many
they are.

Each reading (a sensor at a speed) is fitted for itself: χ² = Σ ((|y + Σ w d_r| − a_r)/σ_r)² from many starts,
and has one or several minima. One of each is chosen, and the weights D that leave least of all, Σ |y + w D|²,
are one solution of the job. Where one weight may leave nothing anywhere, choices in which it does not are
dropped. What is uncertain is drawn: amplitudes with their errors are fitted again from each minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from balancing.conditioning import chance
from balancing.regions import LEVEL, real_parts
from rotorid.base.arrays import ComplexArray, FloatArray

UNLIKE = 1e-4
"""Chance below which no single weight leaves nothing at every reading."""
_DRAWS, _MOST = 1000, 32
"""Draws of a minimum; choices."""
_WALK, _OPEN, _SMALL, _TINY = 60, 3.0, 0.1, 1e-300
"""Steps of a draw. Of the largest amplitude: deviation of what is open; what is smaller is of this scale."""
_FURTHER = 2.0
"""A region is looked for so many times as far away as weights are drawn."""
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

    def minima(self, rng: np.random.Generator, within: float, dof: float) -> list[Minimum]:
        """Those so much above the best at most, with draws by random walks (Metropolis) from each.

        `dof`: degrees of freedom of errors that were estimated.
        """
        n, out = self.parameters.shape[1], list[Minimum]()
        for x, chi_square in zip(self.parameters, self.chi_square, strict=True):
            if chi_square > self.chi_square[0] + within:
                break
            J = self._residuals(x[None])[1][0]
            root = 2.4 * np.linalg.cholesky(np.linalg.inv(J.T @ J + np.eye(n) / _OPEN**2) / n)
            draws = np.repeat(x[None], _DRAWS, axis=0)
            probability = self._log_probability(draws, dof)
            for _ in range(_WALK):
                moved = draws + rng.standard_normal(draws.shape) @ root.T
                there = self._log_probability(moved, dof)
                taken = there - probability > np.log(rng.random(_DRAWS))
                draws = np.where(taken[:, None], moved, draws)
                probability = np.where(taken, there, probability)
            out.append(Minimum(float(chi_square), x, np.where(draws[:, :1] < 0, -draws, draws)))
        return out

    def _log_probability(self, x: FloatArray, dof: float) -> FloatArray:
        """Of parameters (n, 1 + 2P): likelihood, flat in the logarithms of y and the |w|."""
        z = np.abs(x[:, :1] + effects(x) @ self._T.T)
        excess = (((z - self._a) / self._s) ** 2).sum(axis=1) - self.chi_square[0]
        fit = excess if np.isinf(dof) else (dof + x.shape[1]) * np.log1p(excess.clip(0.0) / dof)
        flat = np.log(np.abs(effects(x)) ** 2 + _SMALL**2).sum(axis=1) + np.log(np.abs(x[:, 0]) + _SMALL)
        return np.asarray(-0.5 * fit - flat)

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


def region(
    best: ComplexArray, draws: ComplexArray, misfit: Callable[[ComplexArray], FloatArray], dof: int, limit: float
) -> tuple[ComplexArray, ComplexArray]:
    """The best weights (P,), and weights (n, P) of their region of 95 %: of draws (n, P).

    Of one plane where a weight may leave nothing anywhere: the weight of least misfit, and all within a limit
    of it, sought from the draws on.
    """
    if len(best) == 1:
        spread, least = draws - best, best
        for k in range(60):
            places = np.vstack((least, least + 0.7**k * spread))
            least = places[np.argmin(misfit(places))]
        places = np.vstack((least, least + _FURTHER * spread))
        above = misfit(places)
        if chance(above[0], dof) >= UNLIKE:
            return least, places[above <= above[0] + limit]
    numbers = np.hstack((np.abs(draws), np.angle(draws * best.conj())))
    tail = (1 - LEVEL) / (4 * len(best))
    low, high = np.quantile(numbers, (tail, 1 - tail), axis=0)
    return best, draws[((numbers >= low) & (numbers <= high)).all(axis=1)]


def _together(minima: Sequence[Minimum], weights: FloatArray) -> tuple[float, float]:
    """Misfit of minima of the first readings, and how far in errors one weight is from leaving nothing."""
    misfit, x = sum(one.chi_square for one in minima), np.array([one.parameters for one in minima])
    D = best_weights(x[None], weights[: len(x)])[0]
    draws = np.array([one.draws for one in minima])
    left = real_parts((x[:, 0] + effects(x) @ D)[:, None])
    off = real_parts((draws[..., 0] + effects(draws) @ D)[..., None]) - left[:, None]
    inverse = np.linalg.pinv(np.einsum("nki,nkj->nij", off, off) / _DRAWS)
    return misfit, float(np.einsum("ni,nij,nj->", left, inverse, left))


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
