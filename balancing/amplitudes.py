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


def predicted(weights: ComplexArray, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (B, R) with weights (R, P) by parameters (B, 1 + 2P), and their derivatives by these."""
    z = parameters[:, :1] + (parameters[:, 1::2] + 1j * parameters[:, 2::2]) @ weights.T
    size = np.abs(z)
    along = (z.conj() / np.maximum(size, _TINY))[..., None]
    derivatives = np.empty((*size.shape, parameters.shape[1]))
    derivatives[..., :1] = along.real
    derivatives[..., 1::2], derivatives[..., 2::2] = (along * weights).real, -(along * weights).imag
    return size, derivatives


def misfit(
    weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray, places: ComplexArray
) -> FloatArray:
    """χ² of amplitudes (R,) with weights (R,) in one plane where a weight at a place (…) leaves nothing."""
    g = np.abs(weights - np.asarray(places)[..., None]) / errors
    a = amplitudes / errors
    scale = (g @ a) / np.maximum((g * g).sum(axis=-1), _TINY)
    return np.asarray(((a - scale[..., None] * g) ** 2).sum(axis=-1))


def minima(weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray, within: float) -> Minima:
    """All minima of χ² that are at most so much above the least.

    Parameters
    ----------
    weights
        Of each run and plane, around 1, shape (R, P).
    amplitudes, errors
        Of each run, amplitudes around 1, and one standard deviation, shape (R,).
    within
        Of χ².
    """
    starts = _starts(weights, amplitudes, errors)
    x, chi_square = _refined(weights, amplitudes, errors, starts)
    x = np.where(x[:, :1] < 0, -x, x)
    order = np.argsort(chi_square, kind="stable")
    order = order[chi_square[order] <= chi_square[order[0]] + within]
    kept: list[int] = []
    for k in order.tolist():
        if all(np.abs(x[k] - x[j]).max() > _APART * amplitudes.max() for j in kept):
            kept.append(k)
    return Minima(x[kept], chi_square[kept])


def _starts(weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray) -> FloatArray:
    """Parameters (B, 1 + 2P) near every minimum."""
    P = weights.shape[1]
    if P == 1:
        places = _RADII[:, None] * _ANGLES
        grid = misfit(weights[:, 0], amplitudes, errors, places)
        around = [np.roll(grid, k, axis=1) for k in (-1, 1)]
        walled = np.pad(grid, ((1, 1), (0, 0)), constant_values=np.inf)
        low = np.all([grid <= other for other in (*around, walled[2:], walled[:-2])], axis=0)
        D = places[low] * np.exp(0.01 + 0.01j)  # off an axis of symmetry, on which saddles lie
        g = np.abs(weights[:, 0] - D[:, None])
        y = (g @ amplitudes) / np.maximum((g * g).sum(axis=1), _TINY) * np.abs(D)
        return np.column_stack((y, (-y / D).real, (-y / D).imag))
    y = amplitudes.max() * 0.6
    one = [y * size * way for size in (0.3, 1.0, 2.0) for way in _ANGLES[::18]]
    every = np.array(list(product(one, repeat=P)))
    return np.column_stack((np.full(len(every), y), every.view(np.float64)))


def _refined(
    weights: ComplexArray, amplitudes: FloatArray, errors: FloatArray, x: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Minima of χ² from starts (B, 1 + 2P), and χ² there (B,)."""

    def at(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        size, derivatives = predicted(weights, x)
        r = (size - amplitudes) / errors
        return r, derivatives / errors[:, None], (r * r).sum(axis=1)

    (r, J, chi_square), damping = at(x), np.full(len(x), 1e-2)
    eye = np.eye(x.shape[1])
    for _ in range(40):
        normal = np.einsum("bri,brj->bij", J, J)
        scale = np.einsum("bii->bi", normal)
        scale = np.maximum(scale, 1e-9 * scale.max(axis=1, keepdims=True)) + _TINY
        normal = normal + (damping[:, None] * scale)[..., None] * eye
        step = np.linalg.solve(normal, np.einsum("bri,br->bi", J, r)[..., None])[..., 0]
        r_new, J_new, new = at(x - step)
        better = new < chi_square
        x = np.where(better[:, None], x - step, x)
        r, J = np.where(better[:, None], r_new, r), np.where(better[:, None, None], J_new, J)
        done = bool(np.all(np.abs(step).max(axis=1) < 1e-10) or np.all(damping >= 1e6))
        chi_square = np.where(better, new, chi_square)
        damping = np.where(better, damping / 5, damping * 5).clip(1e-10, 1e6)
        if done:
            break
    return x, chi_square


def covariances(weights: ComplexArray, errors: FloatArray, parameters: FloatArray) -> FloatArray:
    """Of the parameters of each minimum, (B, 1 + 2P, 1 + 2P); what data leave open is wide, not infinite."""
    J = predicted(weights, parameters)[1] / errors[:, None]
    return np.asarray(np.linalg.inv(np.einsum("bri,brj->bij", J, J) + np.eye(J.shape[-1]) / _OPEN**2))


def drawn(
    rng: np.random.Generator,
    weights: ComplexArray,
    amplitudes: FloatArray,
    errors: FloatArray,
    at: Minima,
    count: int,
    dof: float = np.inf,
) -> FloatArray:
    """Parameters that the amplitudes allow, drawn around each minimum.

    Parameters
    ----------
    rng
        Random numbers.
    weights, amplitudes, errors
        As of `minima`.
    at
        The minima.
    count
        Draws of each.
    dof
        Degrees of freedom of errors that were estimated.

    Returns
    -------
    Shape (B, count, 1 + 2P).
    """
    X, n = at.parameters, at.parameters.shape[1]
    root = np.linalg.cholesky(_WIDE * covariances(weights, errors, X))
    inverse, size = np.linalg.inv(root), np.log(np.einsum("bii->bi", root)).sum(axis=1)
    shape = len(X), _MORE * count
    spread = np.sqrt(rng.chisquare(_TAIL, (*shape, 1)) / _TAIL)
    x = X[:, None] + np.einsum("bij,bkj->bki", root, rng.standard_normal((*shape, n)) / spread)
    x = x.reshape(-1, n)
    x = np.where(x[:, :1] < 0, -x, x)
    chi_square = (((predicted(weights, x)[0] - amplitudes) / errors) ** 2).sum(axis=1)
    off = np.array([x - X[:, None], -x - X[:, None]])  # both signs are one solution
    distance = (np.einsum("bij,sbkj->sbki", inverse, off) ** 2).sum(axis=-1).min(axis=0)
    density = -0.5 * (_TAIL + n) * np.log1p(distance / _TAIL) - size[:, None]
    excess = chi_square - at.chi_square[0]
    fit = -0.5 * excess if np.isinf(dof) else -0.5 * (dof + n) * np.log1p(excess.clip(0.0) / dof)
    effects = (x[:, 1:] ** 2).reshape(len(x), -1, 2).sum(axis=-1)
    flat = np.log(x[:, 0] + _SMALL) + np.log(effects + _SMALL**2).sum(axis=1)
    top = density.max(axis=0)
    log_weight = fit - flat - top - np.log(np.exp(density - top).sum(axis=0))
    probability = np.exp(log_weight - log_weight.max())
    belongs = np.argmax(density, axis=0)
    out = np.repeat(X[:, None], count, axis=1)
    for b in range(len(X)):
        share = np.cumsum(np.where(belongs == b, probability, 0.0))
        if share[-1] > 0:
            steps = (np.arange(count) + rng.random()) / count * share[-1]
            chosen = np.searchsorted(share, steps).clip(max=len(x) - 1)
            out[b] = rng.permutation(x[chosen])
    return out
