"""One residual unbalance or reading against its limit: pass, fail, or not decidable with these readings.

What is judged is a complex number with errors: a residual unbalance, or a reading. With its covariance V and
the radius ρ of the 95 % region (`balancing.correction.correct.region_radius`) it lies in the ellipse

    E = { z : (z − ẑ)ᵀ V⁻¹ (z − ẑ) ≤ ρ² }.

It passes where all of E is within the limit, |z| ≤ limit; it fails where none of E is; otherwise, and where
the errors are unknown, these readings do not decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.iso21940 import Tolerance
from balancing.solvers.error_propagation import region_edge, region_radius
from rotorid.base.arrays import ComplexArray, FloatArray

Kind = Literal["plane", "bearing", "sensor"]
Word = Literal["pass", "fail", "not decidable"]

_POINTS = 2880


@dataclass(frozen=True, eq=False)
class Judgement:
    """One residual unbalance or reading against its limit.

    Attributes
    ----------
    kind, name
        "plane", "bearing" (a tolerance plane) or "sensor", and which.
    speed
        rad/s, of a reading; None for an unbalance.
    value
        Estimate: a weight of the job (plane), kg·m (bearing), a reading (sensor).
    limit
        In the same unit.
    low, high
        Least and largest size in the 95 % region; None where errors are unknown.
    region
        Points on the edge of the region; None as before.
    """

    kind: Kind
    name: str
    speed: float | None
    value: complex
    limit: float
    low: float | None = None
    high: float | None = None
    region: ComplexArray | None = None

    @property
    def size(self) -> float:
        """Of the estimate."""
        return abs(self.value)

    @property
    def verdict(self) -> Word:
        """Pass, fail or not decidable."""
        if self.low is None or self.high is None:
            return "not decidable"
        if self.high <= self.limit:
            return "pass"
        return "fail" if self.low > self.limit else "not decidable"


def judge(
    kind: Kind,
    name: str,
    value: complex,
    limit: float,
    covariance: FloatArray | None,
    dof: float | None = None,
    speed: float | None = None,
) -> Judgement:
    """Judge one complex value.

    Parameters
    ----------
    kind, name, speed
        As of `Judgement`.
    value, limit
        In the same unit.
    covariance
        Of real and imaginary part, (2, 2); None: unknown.
    dof
        Degrees of freedom of the covariance; None for stated errors.

    Raises
    ------
    ValueError
        For a limit that is not a number ≥ 0.
    """
    if not (np.isfinite(limit) and limit >= 0):
        raise ValueError(f"the limit of {kind} {name!r} must be a finite number ≥ 0, not {limit}")
    if covariance is None:
        return Judgement(kind, name, speed, complex(value), float(limit))
    region = region_edge(np.asarray(value, dtype=complex), np.asarray(covariance), dof, _POINTS)
    size = np.abs(region)
    variances, axes = np.linalg.eigh(np.asarray(covariance, dtype=np.float64))
    reach = region_radius(dof) * np.sqrt(np.maximum(variances, 0.0))
    centre = axes.T @ np.array([complex(value).real, complex(value).imag])
    safe = np.where(reach > 0, reach, 1.0)
    inside = bool(np.sum((centre / safe) ** 2) <= 1 and (reach > 0).all())
    low = 0.0 if inside else float(size.min())
    return Judgement(kind, name, speed, complex(value), float(limit), low, float(size.max()), region)


def judge_unbalance(
    residual: ArrayLike,
    covariance: FloatArray | None,
    tolerance: Tolerance,
    planes: Sequence[str],
    *,
    radii: Mapping[str, float] | None = None,
    dof: float | None = None,
) -> tuple[Judgement, ...]:
    """Residual unbalance of each plane, and what they are together at the tolerance planes.

    Parameters
    ----------
    residual
        Of the planes, (P,), kg·m, or kg at the radii.
    covariance
        Of (Re, Im) of each, (2P, 2P); None: unknown.
    tolerance
        With the same names of planes (in any order).
    planes
        Names, length P.
    radii
        m, of each plane, where the residuals are masses; None: they are unbalances.
    dof
        Degrees of freedom of the covariance; None for stated errors.

    Raises
    ------
    ValueError
        For planes that the tolerance does not name, and radii that are lacking or not positive.
    """
    if sorted(planes) != sorted(tolerance.planes):
        raise ValueError(
            f"the tolerance is for the planes {', '.join(map(repr, tolerance.planes)) or '(none)'}, "
            f"the residual unbalance is in {', '.join(map(repr, planes))}: name the same planes in both"
        )
    radius = np.array([1.0 if radii is None else radii.get(p, 0.0) for p in planes])
    if not (np.isfinite(radius) & (radius > 0)).all():
        raise ValueError(f"the radius of plane {planes[int(np.argmin(radius))]!r} must be a number above 0")
    order = [tolerance.planes.index(p) for p in planes]
    u = np.asarray(residual, dtype=complex)
    rows = []
    for p, name in enumerate(planes):
        own = None if covariance is None else covariance[2 * p : 2 * p + 2, 2 * p : 2 * p + 2]
        rows.append(judge("plane", name, u[p], tolerance.limits[order[p]] / radius[p], own, dof))
    T, limits = tolerance.transfer, tolerance.bearing_limits
    if T is None or limits is None:
        return tuple(rows)
    B = T[:, order] * radius
    wide = np.kron(B, np.eye(2))
    for k, name in enumerate(("A", "B")):
        own = None
        if covariance is not None:
            own = (wide @ covariance @ wide.T)[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
        rows.append(judge("bearing", name, (B @ u)[k], float(limits[k]), own, dof))
    return tuple(rows)
