"""Amplitudes without phases: every solution that explains them.

With the weights d_p mounted, a sensor of a linear rotor reads |y + Σ w_p d_p| at a speed. Only phases between
y and the w_p act on it: y is real and ≥ 0, and there are 1 + 2 P unknowns. Where a weight D leaves nothing,
the amplitudes are distances from it in an unknown scale. Three weights that are not in one line leave two
such places (circles of Apollonius), four leave one; weights in one line leave a mirror image however many
they are.

Each reading (a sensor at a speed) is fitted for itself: χ² = Σ ((|y + Σ w d_r| − a_r)/σ_r)² from many starts,
and has one or several minima. One of each is chosen, and the weights D that leave least of all, Σ |y + w D|²,
are one solution of the job. Where one weight may leave nothing anywhere, choices in which it does not are
dropped, and solutions are the weights at the minima of the misfit of all readings, each in its own scale: the
95 % region of each are the weights next to it whose misfit errors explain. In all other cases regions are
those of draws by the curvature of χ² at the minima.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from balancing.conditioning import chance
from balancing.regions import real_parts
from rotorid.base.arrays import ComplexArray, FloatArray

UNLIKE = 1e-4
"""Chance below which no single weight leaves nothing at every reading."""
_DRAWS, _MOST = 1000, 32
"""Draws of a minimum; choices."""
_OPEN, _TINY = 3.0, 1e-300
"""Deviation of what is open, of the largest amplitude."""
_ALIKE = 0.01
"""Minima are one where no parameter differs by more, relative to the largest."""
_FAR, _FURTHER = 4.0, 2.0
"""How far from a weight its region is looked for: in errors, for so many times its limit; at most, in ln size
and angle."""
_STARTS = np.outer((0.5, 2.0), np.exp(2j * np.pi * np.arange(8) / 8 + 0.2j)).ravel()
"""Effects of a plane, for a bare rotor's reading of 1, from which fits start.

None is in one line with weights at usual angles: where these are in one, fits would stay on it, be it a
saddle.
"""


class Minimum(NamedTuple):
    """One solution of a reading: χ², (y, Re w₁, Im w₁, …) of shape (1 + 2P,), and draws (n, 1 + 2P) of it."""

    chi_square: float
    parameters: FloatArray
    draws: FloatArray


Choice = tuple[Minimum, ...]
"""One solution of each reading."""
Residuals = Callable[[FloatArray], FloatArray]
"""(…, R) of parameters (…, n)."""


class Fit:
    """What one sensor read at one speed in R runs, by all minima of χ², the best first.

    Parameters
    ----------
    weights
        Of each run and plane, (R, P), around 1.
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
        w = np.array(list(product(_STARTS, repeat=weights.shape[1])))
        x = np.column_stack((np.ones(len(w)), real_parts(w)))
        for steps in (15, 200):  # what starts near one another soon meets
            x, chi_square = refined(self._missed, np.where(x[:, :1] < 0, -x, x), steps)
        self.parameters, self.chi_square = x, chi_square

    def minima(self, rng: np.random.Generator, within: float) -> list[Minimum]:
        """Those so much above the best at most, with draws of each by the curvature of χ² there."""
        out = list[Minimum]()
        for x, chi_square in zip(self.parameters, self.chi_square, strict=True):
            if chi_square > self.chi_square[0] + within:
                break
            J = _slopes(self._missed, x)
            covariance = np.linalg.inv(J @ J.T + np.eye(len(x)) / _OPEN**2)
            draws = rng.multivariate_normal(x, covariance, _DRAWS, method="cholesky")
            out.append(Minimum(chi_square, x, draws))
        return out

    def _missed(self, x: FloatArray) -> FloatArray:
        """(|…| − a)/σ (…, R) of parameters (…, 1 + 2P)."""
        return (np.abs(x[..., :1] + effects(x) @ self._T.T) - self._a) / self._s


def _slopes(missed: Residuals, x: FloatArray) -> FloatArray:
    """Derivatives (…, n, R) of residuals by parameters (…, n)."""
    x, step = x[..., None, :], 1e-6 * np.eye(x.shape[-1])
    return (missed(x + step) - missed(x - step)) / 2e-6


def refined(missed: Residuals, x: FloatArray, steps: int) -> tuple[FloatArray, FloatArray]:
    """Different minima of χ² from starts (B, n), and χ² there, the best first.

    So many steps of Levenberg–Marquardt, from all starts at once.
    """
    damping, eye = np.full(len(x), 1e-2), np.eye(x.shape[1])
    for _ in range(steps):
        r, J = missed(x), _slopes(missed, x)
        normal = J @ J.swapaxes(1, 2)
        scale = damping * normal.trace(axis1=1, axis2=2)
        step = np.linalg.solve(normal + scale[:, None, None] * eye, J @ r[..., None])[..., 0]
        better = (missed(x - step) ** 2).sum(axis=1) < (1 - 1e-12) * (r**2).sum(axis=1)
        x = np.where(better[:, None], x - step, x)
        damping = (damping * np.where(better, 0.2, 5.0)).clip(1e-10, 1e6)
        if np.abs(step).max() < 1e-9:
            break
    chi_square = (missed(x) ** 2).sum(axis=1)
    order = np.lexsort((*-x.T, chi_square.round(9)))  # rounding decides nothing
    close = np.abs(x[order, None] - x[order]).max(axis=2) <= _ALIKE * np.abs(x[order]).max(axis=1)
    kept = order[close.argmax(axis=1) == np.arange(len(x))]
    return x[kept], chi_square[kept]


def effects(parameters: FloatArray) -> ComplexArray:
    """Complex w (…, P) of parameters (…, 1 + 2P)."""
    return parameters[..., 1::2] + 1j * parameters[..., 2::2]


def best_weights(x: FloatArray, weights: FloatArray) -> ComplexArray:
    """Weights (n, P) that leave least, by parameters (n, N, 1 + 2P)."""
    y, w = x[..., :1] * weights[:, None], effects(x) * weights[:, None]
    return -(np.linalg.pinv(w, 1e-7) @ y)[..., 0]


def common_weight(
    starts: ComplexArray,
    T: ComplexArray,
    a: FloatArray,
    s: FloatArray,
    limit: float,
    *levels: float,
) -> list[list[ComplexArray]]:
    """One weight that leaves nothing anywhere; nothing where there is none.

    Each minimum of the misfit from starts (B, 1) that is larger by a limit at most, the best first: the
    weight (1,) and, for each level, weights (n, 1) nearer to it than to another at which the misfit is larger
    by no more. T: weights of the runs (R, 1); a, s: amplitudes and errors (R, N), each reading in its best
    scale.
    """

    def missed(x: FloatArray) -> FloatArray:
        distance = np.abs(T - (x @ (1, 1j))[..., None, None]) / s
        unit = distance / np.linalg.norm(distance, axis=-2, keepdims=True)
        off = unit * (unit * a / s).sum(axis=-2, keepdims=True) - a / s
        return np.asarray(off.reshape(*x.shape[:-1], -1))

    x, chi_square = refined(missed, real_parts(starts), 200)
    best = x[chi_square <= chi_square[0] + limit] @ (1, 1j)
    if chance(chi_square[0], a.size - a.shape[1] - 2) < UNLIKE:
        return []
    out = []
    for k, one in enumerate(best):
        least = np.linalg.norm(_slopes(missed, x[k]), -2) * np.abs(one)
        reach = np.array([min(_FAR * max(levels) ** 0.5 / max(least, _TINY), _FURTHER)])
        for n in (61, 101):  # a wide look, then a close one
            axes = np.linspace(-reach, reach, n)
            away = axes[:, :1] + 1j * axes[:, -1]
            places = one * np.exp(away)[..., None]
            above = (missed(real_parts(places)) ** 2).sum(axis=-1) - chi_square[k]
            above[np.abs(np.log(places / best)).argmin(axis=-1) != k] = np.inf
            reach = np.abs(real_parts(away[above <= max(levels), None])).max(axis=0) + axes[1] - axes[0]
        out.append([best[k, None], *(places[above <= level] for level in levels)])
    return out


def _together(minima: Sequence[Minimum], weights: FloatArray) -> tuple[float, float]:
    """Misfit of minima of the first readings, and how far in errors one weight is from leaving nothing."""
    chi_square, x, draws = (np.array(of) for of in zip(*minima, strict=True))
    D = best_weights(x[None], weights[: len(x)])[0]
    left = real_parts((x[:, 0] + effects(x) @ D)[:, None])
    off = real_parts((draws[..., 0] + effects(draws) @ D)[..., None])
    unlike = left**2 / off.var(axis=1).clip(_TINY)
    return chi_square.sum(), unlike.sum()


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
    order = np.argsort(misfits.round(9), kind="stable")
    return [kept[k] for k in order if misfits[k] <= misfits.min() + limit]
