"""Limits of a correction: largest weights and amplitudes, forbidden angles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.suggestions import did_you_mean

Arc = tuple[float, float]
"""First angle and width, rad, with the rotation; 0 < width ≤ 2π."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of a correction; everything that is not limited is infinite, or has no arcs.

    Attributes
    ----------
    max_weight
        Largest total weight of each plane on the bare rotor, kg or kg·m, shape (P,).
    residual
        Largest predicted amplitude of each reading, shape (S, C).
    forbidden
        Arcs of each plane where no weight can be mounted (the ends of an arc are allowed).

    Raises
    ------
    ValueError
        Negative or NaN limits, arcs that are none, planes without an angle that is left.
    """

    max_weight: FloatArray
    residual: FloatArray
    forbidden: tuple[tuple[Arc, ...], ...]

    def __post_init__(self) -> None:
        for name in ("max_weight", "residual"):
            array = np.array(getattr(self, name), dtype=np.float64)
            if np.isnan(array).any() or (array < 0).any():
                raise ValueError(f"the limits {name} must be numbers ≥ 0 (infinite for none)")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if len(self.forbidden) != len(self.max_weight):
            raise ValueError("there must be arcs, or none, for every plane")
        for arcs in self.forbidden:
            for start, width in arcs:
                if not (np.isfinite(start) and 0 < width <= 2 * np.pi):
                    raise ValueError(f"an arc of {width} rad from {start} rad is none")

    @classmethod
    def none(cls, S: int, C: int, P: int) -> Limits:
        """No limits at all, for S speeds, C sensors and P planes."""
        return cls(np.full(P, np.inf), np.full((S, C), np.inf), ((),) * P)

    @classmethod
    def of(
        cls,
        speeds: int,
        sensors: Sequence[str],
        planes: Sequence[str],
        *,
        max_weight: Mapping[str, float] | None = None,
        residual: Mapping[str, float | FloatArray] | None = None,
        forbidden: Mapping[str, Sequence[Arc]] | None = None,
    ) -> Limits:
        """Limits by name of plane and sensor; a sensor's limit is a number, or one per speed (S,)."""
        weight, amplitude = np.full(len(planes), np.inf), np.full((speeds, len(sensors)), np.inf)
        arcs: list[tuple[Arc, ...]] = [() for _ in planes]
        for name, value in (max_weight or {}).items():
            weight[_place(name, planes, "plane")] = value
        for name, size in (residual or {}).items():
            amplitude[:, _place(name, sensors, "sensor")] = size
        for name, own in (forbidden or {}).items():
            arcs[_place(name, planes, "plane")] = tuple(own)
        return cls(weight, amplitude, tuple(arcs))

    @property
    def any(self) -> bool:
        """Whether anything is limited."""
        return bool(
            np.isfinite(self.max_weight).any() or np.isfinite(self.residual).any() or any(self.forbidden)
        )

    def pick(self, speeds: Sequence[int], planes: Sequence[int]) -> Limits:
        """Those of some speeds and planes, by index."""
        return Limits(
            self.max_weight[list(planes)],
            self.residual[list(speeds)],
            tuple(self.forbidden[p] for p in planes),
        )


def _place(name: str, names: Sequence[str], what: str) -> int:
    if name not in names:
        hint = did_you_mean(str(name), names)
        raise ValueError(f"there is no {what} {name!r}{hint}; there are {', '.join(map(repr, names))}")
    return list(names).index(name)
