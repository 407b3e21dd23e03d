"""Rigid discs and concentrated masses."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rotorid.base.checks import attachment, number

STEEL_DENSITY = 7800.0


@dataclass(frozen=True)
class Disc:
    """A rigid disc, or a concentrated mass, at a node.

    Attributes
    ----------
    node
        Node number, from 1.
    mass
        kg.
    polar_inertia, diametral_inertia
        About the shaft axis and about a diameter, kg·m².
    name
        For messages and drawings.

    Raises
    ------
    ValueError
        If the node is no whole number from 1 up, or the mass or an inertia is negative or not finite.
    """

    node: int
    mass: float
    polar_inertia: float = 0.0
    diametral_inertia: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        what = attachment(self)
        for name in ("mass", "polar_inertia", "diametral_inertia"):
            object.__setattr__(self, name, number(getattr(self, name), f"{what}: {name}"))

    @classmethod
    def from_geometry(
        cls,
        node: int,
        width: float,
        outer_diameter: float,
        inner_diameter: float = 0.0,
        density: float = STEEL_DENSITY,
        name: str = "",
    ) -> Disc:
        """Disc from its sizes in m and its density in kg/m³: a hollow cylinder around the shaft.

        m = ρ w π (D² − d²) / 4, I_p = m (D² + d²) / 8, I_d = m (D² + d²) / 16 + m w² / 12.

        Raises
        ------
        ValueError
            If a size is negative or not finite, or the bore is not smaller than the disc.

        >>> disc = Disc.from_geometry(3, width=0.07, outer_diameter=0.28, inner_diameter=0.05)
        >>> round(disc.mass, 3), round(disc.polar_inertia, 4), round(disc.diametral_inertia, 4)
        (32.548, 0.3291, 0.1779)
        """
        what = f"disc{f' {name!r}' if name else ''} at node {node}"
        w = number(width, f"{what}: width")
        D = number(outer_diameter, f"{what}: outer_diameter")
        d = number(inner_diameter, f"{what}: inner_diameter")
        if d >= D:
            raise ValueError(f"{what}: the inner diameter, {d} m, must be smaller than the outer, {D} m")
        mass = number(density, f"{what}: density") * w * math.pi / 4 * (D * D - d * d)
        polar = mass * (D * D + d * d) / 8
        return cls(node, mass, polar, polar / 2 + mass * w * w / 12, name)
