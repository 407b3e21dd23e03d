"""Material removal instead of weights: drilled holes and grinding, opposite to where a weight would be added.

A correction D is always the equivalent *added* unbalance, kg·m with its angle counted with the rotation.
Taking the unbalance u away at the angle φ changes the rotor by −u e^{iφ}; so D is done by u = |D| at
φ = arg D + 180°.

**Radial hole** (along a radius, from the surface at radius R inward). With z the depth below the surface and
A(z) the area of the hole,

    m = ρ ∫ A(z) dz,        u = ρ ∫ A(z) (R − z) dz:

the hole is symmetric about its axis, so only the distance R − z along the axis counts, and the deeper
material does less. A drill of diameter d and tip angle τ leaves a cone of height t = (d/2)/tan(τ/2) below the
cylinder of depth h. With A = π d²/4, the cone's volume A t/3 and its centre of mass t/4 below its base,

    u/ρ = A h (R − h/2) + (A t/3)(R − h − t/4).

A tip that has not yet gone in up to the full diameter leaves a cone of height s < t only, u/ρ =
(A t/3)(s/t)³(R − s/4). Both rise with depth as long as the tip stays outside the centre of the rotor, and
the depth follows from u as the root. The surface is taken as flat across the hole (the part missing is
d²/(32 R) of depth).

**Axial hole** (parallel to the axis of the rotor, at the radius r): u = ρ V r, the same V(h).

**Several holes** of one depth in a row, the spacing σ apart and symmetric to φ, sum to
u₁ Σ e^{i(k − (n − 1)/2)σ} = u₁ sin(nσ/2)/sin(σ/2), exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from balancing.data.conventions import Labels
from rotorid.base.answer import Answer
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import counted

Way = Literal["radial", "axial"]

TIP_ANGLE = np.radians(118.0)
"""Of a usual twist drill."""
PITCH = 1.5
"""Distance of neighbouring holes of a row by their diameter, where no spacing is given."""
_MOST = 1000


@dataclass(frozen=True)
class Drill:
    """A drill and what it goes into.

    Attributes
    ----------
    diameter
        m.
    radius
        Radial: of the surface, from which the hole goes inward; axial: of the hole's axis; m.
    density
        Of the material, kg/m³.
    way
        "radial" or "axial".
    tip_angle
        Full angle of the tip, rad; π: flat.

    Raises
    ------
    ValueError
        For sizes that are not positive, a tip angle outside 0 … 180°, or a drill wider than the rotor.
    """

    diameter: float
    radius: float
    density: float
    way: Way = "radial"
    tip_angle: float = float(TIP_ANGLE)

    def __post_init__(self) -> None:
        named = {"diameter of the drill": "m", "radius": "m", "density": "kg/m³"}
        for (name, unit), value in zip(
            named.items(), (self.diameter, self.radius, self.density), strict=True
        ):
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"the {name} must be positive and finite, not {value:g} {unit}")
        if self.way not in ("radial", "axial"):
            raise ValueError(f"a hole is drilled 'radial' or 'axial', not {self.way!r}")
        if not 0 < self.tip_angle <= np.pi * (1 + 1e-12):
            raise ValueError(
                f"the tip angle must be above 0 and up to 180° (flat), not {np.degrees(self.tip_angle):g}°"
            )
        if self.diameter / 2 >= self.radius:
            raise ValueError(
                f"a hole of diameter {1e3 * self.diameter:g} mm does not fit at a radius of "
                f"{1e3 * self.radius:g} mm; use a smaller drill"
            )

    @property
    def tip_height(self) -> float:
        """Height t of the tip's cone, m."""
        if self.tip_angle >= np.pi * (1 - 1e-12):
            return 0.0
        return float(self.diameter / 2 / np.tan(self.tip_angle / 2))

    def removed(self, depth: float) -> tuple[float, float]:
        """Mass (kg) and unbalance (kg·m) of a hole whose tip is `depth` (m) below the surface."""
        t, A = self.tip_height, np.pi * self.diameter**2 / 4
        h = max(depth - t, 0.0)
        s = min(depth, t)
        cone = A * s / 3 * (s / t) ** 2 if t > 0 else 0.0
        volume = A * h + cone
        if self.way == "axial":
            moment = volume * self.radius
        else:
            moment = A * h * (self.radius - h / 2) + cone * (self.radius - h - s / 4)
        return float(self.density * volume), float(self.density * moment)

    def depth_for(self, unbalance: float) -> float:
        """Depth of the tip, m, of a hole that takes away an unbalance, kg·m.

        Raises
        ------
        ValueError
            For an unbalance that is negative or that not even a radial hole down to the centre takes away.
        """
        if not (np.isfinite(unbalance) and unbalance >= 0):
            raise ValueError(
                f"the unbalance to be taken away must be finite and not negative, not {unbalance!r}"
            )
        if self.way == "radial" and unbalance > self.removed(self.radius)[1]:
            raise ValueError(
                f"one radial hole of diameter {1e3 * self.diameter:g} mm cannot take away "
                f"{1e6 * unbalance:.4g} g·mm: even down to the centre it takes "
                f"{1e6 * self.removed(self.radius)[1]:.4g} g·mm; use a larger drill or several holes"
            )
        from scipy.optimize import brentq

        area = self.density * np.pi * self.diameter**2 / 4
        flat = unbalance / (area * self.radius)
        deepest = self.radius if self.way == "radial" else 2 * flat + self.tip_height

        def missing(depth: float) -> float:
            return self.removed(depth)[1] - unbalance

        return float(brentq(missing, 0.0, deepest, xtol=1e-15 * deepest, rtol=1e-15)) if unbalance else 0.0


@dataclass(frozen=True, eq=False)
class Drilling:
    """Holes of one depth that do what an added weight would do.

    Attributes
    ----------
    drill
        What was used.
    angles
        Of the holes, rad with the rotation, 0 ≤ angle < 2π, shape (n,): in a row, opposite to the weight.
    depth
        Of the full diameter, m: 0 where only a part of the tip goes in.
    tip_depth
        Down to the point of the tip, m.
    mass, unbalance
        Taken away by one hole, kg and kg·m.
    weight
        The equivalent added unbalance of all of them, −Σ u e^{iφ}, kg·m.
    wanted
        What it was to be, kg·m.
    """

    drill: Drill
    angles: FloatArray
    depth: float
    tip_depth: float
    mass: float
    unbalance: float
    weight: complex
    wanted: complex

    def added(self, labels: Labels) -> ComplexArray:
        """The weights that would have to be added instead of the holes, kg or kg·m as the labels', (n,)."""
        each = -self.unbalance * np.exp(1j * self.angles)
        return np.asarray(each if labels.unbalances else each / self.drill.radius)

    def target(self, labels: Labels) -> complex:
        """The one weight that was to be added, kg or kg·m as the labels'."""
        return self.wanted if labels.unbalances else self.wanted / self.drill.radius

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, angles as the labels count them."""
        return {
            "method": "drilling",
            "unit": labels.weight_unit,
            "angles": labels.angles,
            "target": labels.weight_entry(self.target(labels)),
            "way": self.drill.way,
            "diameter_m": self.drill.diameter,
            "radius_m": self.drill.radius,
            "depth_m": self.depth,
            "tip_depth_m": self.tip_depth,
            "mass_of_one_kg": self.mass,
            "unbalance_of_one_kg_m": self.unbalance,
            "holes": [{"angle_deg": angle} for angle in labels.directions(self.angles)],
        }

    def rows(self, labels: Labels) -> list[dict[str, Any]]:
        """Each hole."""
        same = {
            "diameter_mm": 1e3 * self.drill.diameter,
            "depth_mm": 1e3 * self.depth,
            "tip_depth_mm": 1e3 * self.tip_depth,
            "mass_g": 1e3 * self.mass,
        }
        at = enumerate(labels.directions(self.angles), start=1)
        return [{"hole": k, "angle_deg": angle, **same} for k, angle in at]

    def answer(self, labels: Labels) -> Answer:
        """Where and how deep."""
        at = ", ".join(f"{a:.1f}°" for a in labels.directions(self.angles))
        tool, n = self.drill, len(self.angles)
        where = "towards the axis from" if tool.way == "radial" else "parallel to the axis at"
        deep = f"full diameter {1e3 * self.depth:.2f} mm deep" if self.depth else "only the tip goes in"
        lines = (
            f"  {counted(n, 'hole')} of diameter {1e3 * tool.diameter:g} mm at {at}, {where} a radius of "
            f"{1e3 * tool.radius:g} mm",
            f"  {deep}, tip at {1e3 * self.tip_depth:.2f} mm",
            f"  each takes away {1e3 * self.mass:.4g} g, {1e6 * self.unbalance:.5g} g·mm",
        )
        weight = labels.weight_at(self.target(labels))
        return Answer(f"Instead of adding {weight}, take away opposite:", "\n".join(lines))


@dataclass(frozen=True)
class Grinding:
    """Material ground off: mass (kg), unbalance (kg·m), radius (m) and angle (rad with the rotation)."""

    mass: float
    unbalance: float
    radius: float
    angle: float
    weight: complex

    def target(self, labels: Labels) -> complex:
        """The weight that would have to be added instead, kg or kg·m as the labels'."""
        return self.weight if labels.unbalances else self.weight / self.radius

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, angles as the labels count them."""
        return {
            "method": "grinding",
            "unit": labels.weight_unit,
            "angles": labels.angles,
            "target": labels.weight_entry(self.target(labels)),
            "radius_m": self.radius,
            "mass_kg": self.mass,
            "unbalance_kg_m": self.unbalance,
            "angle_deg": labels.directions(np.array([self.angle]))[0],
        }

    def rows(self, labels: Labels) -> list[dict[str, Any]]:
        """The one place."""
        angle = self.to_dict(labels)["angle_deg"]
        return [{"angle_deg": angle, "mass_g": 1e3 * self.mass, "radius_mm": 1e3 * self.radius}]

    def answer(self, labels: Labels) -> Answer:
        """How much, and where."""
        (angle,) = labels.directions(np.array([self.angle]))
        return Answer(
            f"Instead of adding {labels.weight_at(self.target(labels))}, grind off {1e3 * self.mass:.5g} g "
            f"at {angle:.1f}°, radius {1e3 * self.radius:g} mm ({1e6 * self.unbalance:.5g} g·mm)."
        )


def opposite(weight: complex) -> complex:
    """What is taken away instead of an added weight: the same size at angle + 180°."""
    return -weight


def grind(weight: complex, radius: float) -> Grinding:
    """Material to be ground off at a radius (of its centre of mass), instead of adding an unbalance.

    Parameters
    ----------
    weight
        Equivalent added unbalance, kg·m.
    radius
        m.

    Raises
    ------
    ValueError
        For a radius that is not positive, or a weight that is not finite.
    """
    size = _size(weight)
    if not (np.isfinite(radius) and radius > 0):
        raise ValueError(f"the radius must be positive and finite, not {radius:g} m")
    angle = float(_turn(np.array(np.angle(opposite(weight)))))
    return Grinding(size / radius, size, float(radius), angle, complex(weight))


def drill_holes(
    weight: complex,
    drill: Drill,
    *,
    max_depth: float = np.inf,
    spacing: float | None = None,
    count: int | None = None,
) -> Drilling:
    """Holes instead of an added weight: one, or as few as keep each within the largest depth.

    Parameters
    ----------
    weight
        Equivalent added unbalance, kg·m.
    drill
        Diameter, place and material.
    max_depth
        Of the full diameter, m.
    spacing
        Angle between neighbouring holes of a row, rad; None: holes `PITCH` diameters apart.
    count
        Number of holes; None: the smallest that is possible.

    Raises
    ------
    ValueError
        Where holes would overlap, or no number of holes is enough.
    """
    size = _size(weight)
    if not max_depth > 0:
        raise ValueError(f"the largest depth must be positive, not {1e3 * max_depth:g} mm")
    if spacing is None:
        spacing = PITCH * drill.diameter / drill.radius
    if not 0 < spacing < np.pi:
        raise ValueError(f"the spacing of holes must be above 0 and below 180°, not {np.degrees(spacing):g}°")
    if count is not None and not 1 <= count <= _MOST:
        raise ValueError(f"the number of holes must be from 1 to {_MOST}, not {count!r}")
    # beyond half a turn another hole takes away more than it helps
    most = min(max(1, int(np.floor(np.pi / spacing + 1e-9))), _MOST) if count is None else count
    touching = None
    for n in range(count or 1, most + 1):
        found = _row(weight, size, drill, n, spacing)
        if found is None or found.depth > max_depth * (1 + 1e-12):
            continue
        if not _overlap(found, spacing):
            return found
        touching = found
    if touching is not None:
        raise ValueError(
            f"{len(touching.angles)} holes of diameter {1e3 * drill.diameter:g} mm and depth "
            f"{1e3 * touching.depth:.4g} mm, {np.degrees(spacing):.4g}° apart, would run into each other: "
            "use a larger spacing or a smaller depth"
        )
    limit = f" up to {1e3 * max_depth:g} mm deep" if np.isfinite(max_depth) else ""
    row = "one hole" if most == 1 else f"a row of {most} holes {np.degrees(spacing):.3g}° apart"
    raise ValueError(
        f"{1e6 * size:.4g} g·mm cannot be taken away by {row} of diameter {1e3 * drill.diameter:g} mm"
        f"{limit}: use a larger drill or depth, or another spacing"
    )


def row_factor(count: int, spacing: float) -> float:
    """Vector sum of `count` equal holes `spacing` (rad) apart, by that of one: sin(nσ/2)/sin(σ/2)."""
    if spacing == 0:
        return float(count)
    return float(np.sin(count * spacing / 2) / np.sin(spacing / 2))


def _row(weight: complex, size: float, drill: Drill, n: int, spacing: float) -> Drilling | None:
    """A row of n holes; None where they reach the centre, or where they cancel each other."""
    factor = row_factor(n, spacing)
    if factor <= 0:
        return None
    each = size / factor
    if drill.way == "radial" and each > drill.removed(drill.radius)[1]:
        return None
    tip_depth = drill.depth_for(each)
    mass, unbalance = drill.removed(tip_depth)
    middle = np.angle(opposite(weight))
    angles = _turn(middle + spacing * (np.arange(n) - (n - 1) / 2))
    done = -complex(unbalance * np.exp(1j * angles).sum())
    depth = max(tip_depth - drill.tip_height, 0.0)
    return Drilling(drill, angles, depth, tip_depth, mass, unbalance, done, complex(weight))


def _overlap(found: Drilling, spacing: float) -> bool:
    """Whether holes of a row run into each other.

    Axial holes touch where the chord 2 r sin(σ/2) is d; radial ones, which lean towards each other, where
    half their width meets the plane between them: (R − h) tan(σ/2) = d/2 at the bottom of the full diameter.
    """
    n, drill = len(found.angles), found.drill
    if n == 1:
        return False
    width = drill.diameter
    if drill.tip_height > 0 and found.tip_depth < drill.tip_height:
        width *= found.tip_depth / drill.tip_height
    if drill.way == "axial":
        apart = 2 * drill.radius * np.sin(spacing / 2)
    else:
        apart = 2 * (drill.radius - found.depth) * np.tan(spacing / 2)
    return bool(apart < width * (1 - 1e-12) or n * spacing > 2 * np.pi * (1 + 1e-9))


def _size(weight: complex) -> float:
    if not np.isfinite(weight):
        raise ValueError(f"a weight must be finite, not {weight!r}")
    return abs(weight)


def _turn(angles: FloatArray) -> FloatArray:
    turned = np.mod(angles, 2 * np.pi)
    return np.where(turned >= 2 * np.pi, 0.0, turned)
