"""Amplitudes without phases: every solution that explains those of one sensor at one speed.

With the weights d_r (of each plane) mounted in run r, a linear rotor reads

    a_r = |y + Σ_p w_p d_rp|.

Nobody knows the phase of y, and only phases between y and the w_p act on amplitudes: y is real and ≥ 0, and
there are 1 + 2P real unknowns. For one plane, with D = −y/w, a_r = |w| |d_r − D|: D is the place where a
weight leaves nothing, and the amplitudes are the distances from it to the weights of the runs, in an unknown
scale. Three weights that stand not in one line leave two such places (circles of Apollonius, inverse to each
other in the circle through the weights), four leave one; weights in one line leave a mirror image however
many they are.

χ² = Σ ((a_r − |…|)/σ_r)² has several minima. For one plane the best scale for a place is a ratio of sums, so
that χ²(D) on a grid shows them all (`misfit`); for two planes they are looked for from many starts. Each is
refined (Levenberg–Marquardt, all starts at once).

What is uncertain is drawn from the likelihood exp(−χ²/2), flat in log y and in the logarithm of each w (whose
scales nobody knows; not below a tenth of the largest amplitude), by importance sampling: Student's t with 4
degrees of freedom around each minimum, and each draw belongs to the minimum whose t is largest there.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray

_TAIL = 4
"""Degrees of freedom of the distribution that draws are taken from."""
_WIDE = 1.5
"""Its covariance relative to that of a minimum."""
_MORE = 4
"""Drawn for each draw that is kept."""
_APART = 1e-2
"""Of the largest amplitude: minima that differ by less are one."""
_OPEN = 3.0
"""Of the largest amplitude: one standard deviation of what data leave open altogether."""
_RADII = np.geomspace(0.03, 30.0, 144)
_ANGLES = np.exp(2j * np.pi * np.arange(144) / 144)
_SMALL = 0.1
"""Of the largest amplitude: what is smaller counts as of this scale."""
_TINY = 1e-300


class Minima(NamedTuple):
    """Solutions of one reading, the best first.

    Attributes
    ----------
    parameters
        (y, Re w₁, Im w₁, …) of each, shape (B, 1 + 2P).
    chi_square
        Of each, shape (B,).
    """

    parameters: FloatArray
    chi_square: FloatArray

    def within(self, limit: float) -> Minima:
        """Those at most so much above the best."""
        near = self.chi_square <= self.chi_square[0] + limit
        return Minima(self.parameters[near], self.chi_square[near])


def misfit(
    weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray, places: ComplexArray
) -> FloatArray:
    """χ² of amplitudes (R,) with weights (R,) in one plane where a weight at a place (…) leaves nothing."""
    g = np.abs(weights - np.asarray(places)[..., None]) / errors
    a = amplitudes / errors
    scale = (g @ a) / np.maximum((g * g).sum(axis=-1), _TINY)
    return np.asarray(((a - scale[..., None] * g) ** 2).sum(axis=-1))


def effects(parameters: FloatArray) -> ComplexArray:
    """Complex w (…, P) of parameters (…, 1 + 2P)."""
    return np.asarray(parameters[..., 1::2] + 1j * parameters[..., 2::2])


class Amplitudes:
    """What one sensor read at one speed in R runs.

    Parameters
    ----------
    weights
        Of each run and plane, (R, P).
    amplitudes, errors
        Of each run, and one standard deviation, (R,).
    """

    def __init__(self, weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray) -> None:
        top, size = amplitudes.max(), np.sqrt((np.abs(weights) ** 2).sum(axis=0) / (weights != 0).sum(axis=0))
        self._T, self._a, self._s = weights / size, amplitudes / top, errors / top  # all around 1
        self._unit = top / np.concatenate(([1.0], np.repeat(size, 2)))

    def minima(self, within: float) -> Minima:
        """All minima of χ² that are at most so much above the least."""
        x, chi_square = self._refined(self._starts())
        x = np.where(x[:, :1] < 0, -x, x)
        kept: list[int] = []
        for k in np.argsort(chi_square, kind="stable").tolist():
            if all(np.abs(x[k] - x[j]).max() > _APART for j in kept):
                kept.append(k)
        return Minima(x[kept] * self._unit, chi_square[kept]).within(within)

    def covariances(self, parameters: FloatArray) -> FloatArray:
        """Of the parameters of minima, (B, 1 + 2P, 1 + 2P); what data leave open is wide, not infinite."""
        return self._spread(parameters / self._unit) * np.outer(self._unit, self._unit)

    def drawn(self, rng: np.random.Generator, at: Minima, count: int, dof: float = np.inf) -> FloatArray:
        """Parameters that the amplitudes allow, so many around each minimum, (B, count, 1 + 2P).

        `dof`: degrees of freedom of errors that were estimated.
        """
        X = at.parameters / self._unit
        B, n = X.shape
        root = np.linalg.cholesky(_WIDE * self._spread(X))
        tail = np.sqrt(rng.chisquare(_TAIL, (B, _MORE * count, 1)) / _TAIL)
        off = np.einsum("bij,bkj->bki", root, rng.standard_normal((B, _MORE * count, n)) / tail)
        x = (X[:, None] + off).reshape(-1, n)
        x = np.where(x[:, :1] < 0, -x, x)
        both = np.array([x - X[:, None], -x - X[:, None]])  # both signs are one solution
        distance = (np.einsum("bij,sbkj->sbki", np.linalg.inv(root), both) ** 2).sum(axis=-1).min(axis=0)
        size = np.log(np.einsum("bii->bi", root)).sum(axis=1)
        density = -0.5 * (_TAIL + n) * np.log1p(distance / _TAIL) - size[:, None]
        excess = (self._residuals(x)[0] ** 2).sum(axis=1) - at.chi_square[0]
        fit = -0.5 * excess if np.isinf(dof) else -0.5 * (dof + n) * np.log1p(excess.clip(0.0) / dof)
        squares = np.abs(effects(x)) ** 2
        flat = np.log(x[:, 0] + _SMALL) + np.log(squares + _SMALL**2).sum(axis=1)
        log_weight = fit - flat - np.logaddexp.reduce(density, axis=0)
        probability = np.exp(log_weight - log_weight.max())
        belongs, out = np.argmax(density, axis=0), np.repeat(X[:, None], count, axis=1)
        for b in range(B):
            share = np.cumsum(np.where(belongs == b, probability, 0.0))
            if share[-1] > 0:
                steps = (np.arange(count) + rng.random()) / count * share[-1]
                out[b] = rng.permutation(x[np.searchsorted(share, steps).clip(max=len(x) - 1)])
        return np.asarray(out * self._unit)

    def _residuals(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(|…| − a)/σ (B, R) of parameters (B, 1 + 2P), and their derivatives by these."""
        z = x[:, :1] + effects(x) @ self._T.T
        size = np.abs(z)
        along = (z.conj() / np.maximum(size, _TINY))[..., None]
        J = np.empty((*size.shape, x.shape[1]))
        J[..., :1], J[..., 1::2], J[..., 2::2] = along.real, (along * self._T).real, -(along * self._T).imag
        return (size - self._a) / self._s, J / self._s[:, None]

    def _spread(self, x: FloatArray) -> FloatArray:
        J = self._residuals(x)[1]
        return np.asarray(np.linalg.inv(np.einsum("bri,brj->bij", J, J) + np.eye(x.shape[1]) / _OPEN**2))

    def _starts(self) -> FloatArray:
        """Parameters (B, 1 + 2P) near every minimum."""
        P = self._T.shape[1]
        if P == 1:
            places, T = _RADII[:, None] * _ANGLES, self._T[:, 0]
            grid = misfit(T, self._a, self._s, places)
            walled = np.pad(grid, ((1, 1), (0, 0)), constant_values=np.inf)
            around = np.roll(grid, 1, axis=1), np.roll(grid, -1, axis=1), walled[2:], walled[:-2]
            low = np.all([grid <= other for other in around], axis=0)
            D = places[low] * np.exp(0.01 + 0.01j)  # off an axis of symmetry, on which saddles lie
            y = self._a.mean() * np.abs(D) / np.abs(T - D[:, None]).mean(axis=1)
            return np.column_stack((y, (-y / D).real, (-y / D).imag))
        one = [0.6 * size * way for size in (0.3, 1.0, 2.0) for way in _ANGLES[::18]]
        every = np.array(list(product(one, repeat=P)))
        return np.column_stack((np.full(len(every), 0.6), every.view(np.float64)))

    def _refined(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Minima of χ² from starts (B, 1 + 2P), and χ² there (B,)."""
        (r, J), damping = self._residuals(x), np.full((len(x), 1), 1e-2)
        for _ in range(200):
            normal, eye = np.einsum("bri,brj->bij", J, J), np.eye(x.shape[1])
            scale = damping * np.maximum(np.einsum("bii->bi", normal), 1e-9)
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
