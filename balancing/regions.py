"""Regions that hold 95 % of draws: of one complex number, and of several together.

A draw d lies at the distance √(δᵀ V⁻¹ δ) from the estimate, δ the real vector of d minus the estimate and V
the covariance of the draws. The region is the ellipsoid whose distance 95 % of the draws stay within, so that
it needs no distribution of its own: what is drawn decides, sizes that are only estimated included.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray

LEVEL = 0.95
NORMAL_RADIUS = float(np.sqrt(-2 * np.log(1 - LEVEL)))
"""Radius of the region of one complex normal number, in standard deviations: 2.448."""
_HELD = 1e-9  # least share of the largest variance, for directions that a limit holds


@dataclass(frozen=True, eq=False)
class Region:
    """Where k complex numbers are with 95 %.

    Attributes
    ----------
    centre
        The estimate, (k,).
    covariance
        Of (Re, Im, …), (2k, 2k).
    radius
        Distance that 95 % of the draws stay within, in standard deviations.
    """

    centre: ComplexArray
    covariance: FloatArray
    radius: float

    @classmethod
    def of(cls, draws: ComplexArray, centre: ComplexArray) -> Region:
        """From draws (n, k) around an estimate (k,); NaN where there are no more than 2k."""
        off, n = real_parts(draws - centre), 2 * len(centre)
        if len(draws) <= n:
            return cls(centre, np.full((n, n), np.nan), np.nan)
        region = cls(centre, np.atleast_2d(np.cov(off.T)), 1.0)
        square = region._distance(off) ** 2
        square = square / np.maximum(1 - square / len(draws), 0.1)  # as if a draw had no part in V
        return replace(region, radius=float(np.sqrt(np.quantile(square, LEVEL))))

    def holds(self, values: ComplexArray) -> BoolArray:
        """Whether k numbers lie in it, (…), of values (…, k)."""
        return self._distance(real_parts(np.asarray(values) - self.centre)) <= self.radius

    def edge(self, points: int) -> ComplexArray:
        """Points on the edge of the region of one number, (points,)."""
        return region_edge(self.centre[0], self.covariance, points, self.radius)

    def _distance(self, off: FloatArray) -> FloatArray:
        """Distance of real vectors (…, 2k), in standard deviations; far along what is held."""
        values, axes = np.linalg.eigh(self.covariance)
        along = off @ axes / np.sqrt(np.maximum(values, max(_HELD * values[-1], 1e-300)))
        return np.asarray(np.linalg.norm(along, axis=-1))


def region_edge(
    values: ArrayLike, covariance: FloatArray, points: int, radius: float = NORMAL_RADIUS
) -> ComplexArray:
    """Edges of regions of single complex numbers.

    Parameters
    ----------
    values
        Complex, shape (…).
    covariance
        Of their real and imaginary parts, shape (…, 2, 2).
    points
        How many of each edge, first and last alike.
    radius
        In standard deviations; default: of 95 %.

    Returns
    -------
    Complex, shape (…, points), counter-clockwise.
    """
    turn = 2 * np.pi * np.arange(points) / (points - 1)
    variances, axes = np.linalg.eigh(covariance)
    reach = radius * np.sqrt(np.maximum(variances, 0.0))
    xy = axes @ (reach[..., None] * np.array([np.cos(turn), np.sin(turn)]))
    return np.asarray(np.asarray(values)[..., None] + xy[..., 0, :] + 1j * xy[..., 1, :])


def reach(covariance: FloatArray) -> FloatArray:
    """Radius (…) of the circle that the 95 % region of a normal number of covariance (…, 2, 2) is within."""
    return np.asarray(NORMAL_RADIUS * np.sqrt(np.linalg.eigvalsh(covariance)[..., -1].clip(0.0)))


def half_width(deviations: FloatArray) -> FloatArray:
    """Half of the 95 % interval of real deviations from an estimate, over the first axis."""
    return np.quantile(np.abs(deviations), LEVEL, axis=0)


def mean_variances(covariance: FloatArray) -> FloatArray:
    """Mean of the variances of both parts of n complex numbers, (…, n), of covariances (…, 2n, 2n)."""
    each = np.einsum("...ii->...i", covariance)
    return np.asarray(each.reshape(*each.shape[:-1], -1, 2).mean(axis=-1))


def real_parts(values: ComplexArray) -> FloatArray:
    """Complex numbers as real ones.

    Parameters
    ----------
    values
        Shape (…, k).

    Returns
    -------
    Shape (…, 2k): Re, Im, Re, …
    """
    return np.ascontiguousarray(values, dtype=complex).view(np.float64)
