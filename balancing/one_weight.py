"""One weight as it is mounted: in holes, as two fixed masses, by drilling or grinding, or rounded to a scale.

Every weight is complex, kg or kg·m, its angle counted with the rotation. Taking the unbalance u away at the
angle φ changes the rotor by −u e^{iφ}; so an added unbalance D is done by u = |D| at φ = arg D + 180°.

**Radial hole** (from the surface at radius R inward). With z the depth and A(z) the area of the hole,

    m = ρ ∫ A(z) dz,        u = ρ ∫ A(z) (R − z) dz.

A drill of diameter d and tip angle τ leaves a cone of height t = (d/2)/tan(τ/2) below the cylinder of depth
h. With A = π d²/4, the cone's volume A t/3 and its centre of mass t/4 below its base,

    u/ρ = A h (R − h/2) + (A t/3)(R − h − t/4);

a tip that has gone in by s < t only leaves u/ρ = (A t/3)(s/t)³(R − s/4). The surface is taken as flat across
the hole (the part missing is d²/(32 R) of depth). **Axial hole** (at the radius r): u = ρ V r, the same V(h).
**Several holes**, n of one depth in a row, σ apart and symmetric to φ, sum to u₁ sin(nσ/2)/sin(σ/2), exactly.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from balancing.conventions import Labels
from balancing.holes import Holes, Mounting, equal_together, lightest
from balancing.pieces import FEW, HEAVIER, NOTHING, SPARE, PlaneVectors
from rotorid.base.answer import Answer
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.tables import Column, Table
from rotorid.base.text import counted, percent

__all__ = [
    "Drill",
    "Removal",
    "Rounded",
    "Split",
    "TwoPositions",
    "combine",
    "drill_holes",
    "grind",
    "rounded",
    "split",
    "trim",
    "two_positions",
]
TIP_ANGLE = float(np.radians(118.0))
"""Of a usual twist drill."""
PITCH = 1.5
"""Distance of neighbouring holes of a row by their diameter, where no spacing is given."""
_EDGE = 1e-12


class OneWeight(ABC):
    """How one weight is mounted, in the units and angles of `labels`."""

    @abstractmethod
    def sentence(self, labels: Labels) -> str:
        """What to do."""

    @abstractmethod
    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""

    def tables(self, labels: Labels) -> tuple[Table, ...]:
        """A row for each hole or solution: the single values of it, and of all of them."""
        every = self.to_dict(labels)
        places = every.get("holes") or every.get("solutions") or [{}]
        each = [every | place for place in places]
        rows = [{key: one[key] for key in one if not isinstance(one[key], dict | list)} for one in each]
        return (Table("weight", tuple(Column(key, [row[key] for row in rows]) for key in rows[0])),)

    def answer(self, labels: Labels) -> Answer:
        """For a terminal."""
        return Answer(self.sentence(labels))


def _document(method: str, target: complex, labels: Labels, **more: Any) -> dict[str, Any]:  # noqa: ANN401
    head = {"method": method, "unit": labels.weight_unit, "angles": labels.angles}
    return {**head, "target": labels.weight_entry(target), **more}


@dataclass(frozen=True, eq=False)
class Split(OneWeight):
    """A weight split on the holes of one plane.

    Attributes
    ----------
    target
        Wanted, kg or kg·m.
    holes
        What can be mounted.
    mounting
        What is to be mounted.
    fewer
        The nearest of 1, 2, … pieces, as long as these are fewer and each is nearer than the one before;
        empty for free amounts.
    """

    target: complex
    holes: Holes
    mounting: Mounting
    fewer: tuple[Split, ...] = ()

    @property
    def error(self) -> complex:
        """Mounted vector minus target."""
        return self.mounting.vector - self.target

    @property
    def relative_error(self) -> float:
        """|error| by the size of the target (a target of 0: by what is mounted, or 0)."""
        return abs(self.error) / (abs(self.target) or abs(self.mounting.vector) or 1.0)

    @property
    def pieces(self) -> int:
        """Number of pieces mounted; where amounts are free, of holes in use."""
        counts = self.mounting.counts
        return int(counts.sum()) if counts.shape[1] else int(np.count_nonzero(self.mounting.amounts))

    def in_holes(self, labels: Labels) -> list[str]:
        """Equal contents together, such as "10 g in holes 7 (120°), 9 (150°)"."""
        contents = []
        for row in self._entries(labels)["holes"]:
            each = (
                (f"{one['count']} × " if one["count"] > 1 else "") + f"{one['mass']:.6g}"
                for one in row["pieces"]
            )
            what = f"{' + '.join(each) or format(row['mass'], '.6g')} {labels.weight_in}"
            contents.append((what, f"{row['hole']} ({round(row['angle_deg'], 2) % 360:g}°)"))
        return equal_together(contents)

    def _entries(self, labels: Labels) -> dict[str, Any]:
        rows = []
        for h in np.flatnonzero(self.mounting.amounts):
            weight = labels.weight_entry(self.mounting.amounts[h] * np.exp(1j * self.holes.angles[h]))
            pieces = zip(self.mounting.counts[h], self.holes.pieces, strict=False)
            each = [{"count": int(n), "mass": labels.weight_entry(size)["mass"]} for n, size in pieces if n]
            rows.append({"hole": self.holes.names[h], **weight, "pieces": each})
        return _document(
            "holes",
            self.target,
            labels,
            holes=rows,
            mounted=labels.weight_entry(self.mounting.vector),
            error=labels.weight_entry(self.error),
            relative_error=self.relative_error,
            number_of_pieces=self.pieces,
        )

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        fewer = [one._entries(labels) for one in self.fewer]
        return {**self._entries(labels), "words": self.in_holes(labels), "fewer_pieces": fewer}

    def sentence(self, labels: Labels) -> str:
        """What to mount, what it makes, and what is missing."""
        wanted, share = labels.weight_at(self.target), percent(self.relative_error)
        if not self.pieces:
            return f"Nothing is mounted, for {wanted}."
        many = counted(self.pieces, "hole" if self.holes.free_amounts else "piece")
        return (
            f"Mount {many}: {labels.weight_at(self.mounting.vector)} together, for {wanted}; error {share} %."
        )

    def answer(self, labels: Labels) -> Answer:
        """What goes where, and what fewer pieces can do."""
        out = [f"  {line}" for line in self.in_holes(labels)]
        out += ["", "With fewer pieces:"] if self.fewer else []
        for one in self.fewer:
            where = "; ".join(one.in_holes(labels))
            out.append(f"  {one.pieces}: error {percent(one.relative_error)} %: {where}")
        return Answer(self.sentence(labels), "\n".join(out))


def split(
    target: complex, holes: Holes, *, most_pieces: int | None = None, good_enough: float = 0.0
) -> Split:
    """Mount what makes the vector nearest to a target, or the fewest pieces that come near enough.

    Parameters
    ----------
    target
        Wanted in addition to what is taken, kg or kg·m.
    holes
        What can be mounted.
    most_pieces
        At most so many pieces altogether; None: as many as help. Has no meaning for free amounts.
    good_enough
        Relative error that needs no more pieces, nor does 1.2 times the least error: the nearest of the
        fewest pieces that keep to it, of at most 1.5 times the least weight that makes the target, or two
        pieces; 0: the nearest of all. Has no meaning for free amounts.

    Raises
    ------
    ValueError
        For a target that is not finite, a number of pieces below 1, a negative error, or where nothing
        admissible exists, not even mounting nothing.

    Examples
    --------
    >>> from balancing.holes import equal_holes, from_list
    >>> found = split(0.035j, from_list(equal_holes(12), [0.01, 0.02]), most_pieces=2)
    >>> found.in_holes(Labels(weight_unit="g", weight_scale=1e3))
    ['20 g in holes 3 (60°), 5 (120°)']
    """
    if not np.isfinite(target):
        raise ValueError(f"the weight to be split must be finite, not {target!r}")
    if most_pieces is not None and most_pieces < 1:
        raise ValueError(f"the number of pieces must be 1 or more, not {most_pieces!r}")
    if not good_enough >= 0:
        raise ValueError(f"the relative error that is good enough must not be negative, not {good_enough!r}")
    target, heaviest = complex(target), np.inf
    if good_enough and not holes.free_amounts:
        most = holes.per_hole * float(holes.pieces.max())
        heaviest = HEAVIER * float(lightest(holes, holes.free, target, most).sum())
    plane = PlaneVectors(holes, holes.free, holes.max_weight, target, most_pieces, heaviest)
    if plane.any_weight:
        return Split(target, holes, plane.place(target))
    nearest = plane.near(target, 1)
    if not len(nearest.d):
        raise ValueError(NOTHING)
    best = Split(target, holes, plane.mount(nearest.put[0]))
    enough = max(FEW * abs(best.error), good_enough * abs(target)) if good_enough else 0.0
    fewer: list[Split] = []
    for n in range(0 if holes.free_amounts else best.pieces):
        for put in plane.near(target, 1, n).put:
            one = Split(target, holes, plane.mount(put))
            if abs(one.error) <= enough:
                return replace(one, fewer=tuple(fewer))
            if 0 < n <= SPARE and all(abs(one.error) < abs(other.error) for other in fewer):
                fewer.append(one)
    return replace(best, fewer=tuple(fewer))


@dataclass(frozen=True, eq=False)
class TwoPositions(OneWeight):
    """Where two fixed masses stand so that together they are a wanted weight.

    Attributes
    ----------
    masses
        Of the two weights, kg or kg·m, shape (2,).
    angles
        Of each solution (row) and mass, rad with the rotation, 0 ≤ angle < 2π, shape (2, 2). The second
        solution is the first one mirrored at the direction of the target; both rows are equal where the
        masses stand in one line.
    target
        The wanted weight.
    """

    masses: FloatArray
    angles: FloatArray
    target: complex

    def weights(self) -> ComplexArray:
        """Both weights of each solution (row), shape (2, 2)."""
        return np.asarray(np.exp(1j * self.angles) * self.masses)

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        rows = map(labels.directions, self.angles)
        solutions = [
            {"angles_deg": row, "first_angle_deg": row[0], "second_angle_deg": row[1]} for row in rows
        ]
        masses = (self.masses * labels.weight_scale).tolist()
        return _document("two positions", self.target, labels, masses=masses, solutions=solutions)

    def sentence(self, labels: Labels) -> str:
        """Both solutions."""
        each = (" and ".join(map(labels.weight_at, pair)) for pair in self.weights())
        return f"{labels.weight_at(self.target)} from two weights: either {' or '.join(each)}."


@dataclass(frozen=True)
class Rounded(OneWeight):
    """A weight rounded to what scale and angle marks can show.

    Attributes
    ----------
    wanted
        Before rounding.
    weight
        After it.
    worst
        The largest error that rounding with these steps can make of a weight of this size.
    """

    wanted: complex
    weight: complex
    worst: float

    @property
    def error(self) -> complex:
        """`weight` minus the wanted one."""
        return self.weight - self.wanted

    @property
    def relative_error(self) -> float:
        """|error| by the size of the wanted one; 0 for a wanted weight of 0 that stays 0."""
        return abs(self.error) / (abs(self.wanted) or 1.0)

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        return _document(
            "one weight",
            self.wanted,
            labels,
            weight=labels.weight_entry(self.weight),
            error=labels.weight_entry(self.error),
            relative_error=self.relative_error,
            largest_possible_error=self.worst * labels.weight_scale,
        )

    def sentence(self, labels: Labels) -> str:
        """The weight, and what rounding did to it."""
        lost = f" (error {percent(self.relative_error)} %)" if self.worst else ""
        return f"Mount {labels.weight_at(self.weight)}{lost}."


def two_positions(target: complex, mass_a: float, mass_b: float) -> TwoPositions:
    """Angles of two fixed masses whose sum is the target: a e^{iα} + b e^{iβ} = T.

    The three vectors form a triangle with the sides a, b and |T|. Its angle at the origin between T and a
    follows from the law of cosines, b² = a² + |T|² − 2 a |T| cos(α − arg T); it may be laid off to either
    side, and b closes the triangle.

    Parameters
    ----------
    target
        Wanted weight, kg or kg·m.
    mass_a, mass_b
        Sizes of both weights in the same unit, > 0.

    Raises
    ------
    ValueError
        For masses that are not positive, and for a target out of reach: |a − b| ≤ |T| ≤ a + b.

    Examples
    --------
    >>> np.degrees(two_positions(0.035j, 0.02, 0.03).angles).round(2)
    array([[148.81,  55.23],
           [ 31.19, 124.77]])
    """
    a, b, size = _positive(mass_a, "mass"), _positive(mass_b, "mass"), abs(_finite(target))
    if not abs(a - b) - _EDGE * (a + b) <= size <= (a + b) * (1 + _EDGE):
        raise ValueError(
            f"weights of {a:g} and {b:g} cannot make {size:g} at any angles: together they reach from "
            f"{abs(a - b):g} to {a + b:g}; use other masses"
        )
    # equal masses that cancel each other may stand anywhere
    cosine = (a * a + size * size - b * b) / (2 * a * size) if size > _EDGE * a else 1.0
    opening = np.arccos(np.clip(cosine, -1.0, 1.0))
    first = a * np.exp(1j * (np.angle(target) + np.array([opening, -opening])))
    return TwoPositions(np.array([a, b]), _turn(np.angle(np.column_stack((first, target - first)))), target)


def combine(weights: Iterable[complex]) -> complex:
    """The one weight that does what several mounted ones do together: their vector sum.

    A sum that is only the rounding error of weights which cancel each other is 0.

    Raises
    ------
    ValueError
        For no weights, or one that is not finite.

    Examples
    --------
    >>> combine([3.0, 4.0j])
    (3+4j)
    """
    each = np.array([_finite(weight) for weight in weights], dtype=complex)
    if not each.size:
        raise ValueError("there is no weight to combine")
    total = complex(each.sum())
    return total if abs(total) > 4 * np.finfo(float).eps * np.abs(each).sum() else 0j


def trim(target: complex, mounted: Iterable[complex] | complex) -> complex:
    """What has to be added so that it and what is mounted already make the target.

    Parameters
    ----------
    target
        Wanted in this plane altogether, kg or kg·m.
    mounted
        What stays in: one weight or several, possibly none.

    Raises
    ------
    ValueError
        For weights that are not finite.
    """
    several = mounted if isinstance(mounted, Iterable) else [mounted]
    return combine([target, *(-weight for weight in several)])


def round_to(value: float, step: float) -> float:
    """The multiple of a scale's step nearest to a value; 0 as the step leaves the value as it is.

    Raises
    ------
    ValueError
        For a step that is negative or not finite, or a value that is not finite.

    Examples
    --------
    >>> round_to(34.7, 0.5)
    34.5
    """
    if not (np.isfinite(step) and step >= 0):
        raise ValueError(f"the step of a scale must be positive (0: no rounding), not {step!r}")
    if not np.isfinite(value):
        raise ValueError(f"only a finite number can be rounded, not {value!r}")
    return float(f"{round(value / step) * step:.12g}") if step else float(value)  # 347 · 0.1 is 34.7


def rounded(weight: complex, mass_step: float = 0.0, angle_step: float = 0.0) -> Rounded:
    """A weight with its size and angle rounded to steps, and what that does to it.

    With a size m′ within Δm/2 of m and an angle within Δφ/2, the error is |m′ e^{iδ} − m| with
    |error|² = m′² + m² − 2 m m′ cos δ: convex in m′ and rising with |δ| ≤ π, so that `worst` stands at a
    corner of the allowed range.

    Parameters
    ----------
    weight
        Wanted, kg or kg·m.
    mass_step
        Step of the scale in the same unit, 0: none.
    angle_step
        Step of the angle, rad, at most 2π, 0: none.

    Raises
    ------
    ValueError
        For steps that are negative, not finite, or beyond a full turn.
    """
    weight, size = _finite(weight), abs(weight)
    if not 0 <= angle_step <= 2 * np.pi:
        raise ValueError(f"the step of an angle must be from 0 to 360°, not {np.degrees(angle_step):g}°")
    angle = round_to(float(np.angle(weight)), angle_step)
    new = complex(round_to(size, mass_step) * np.exp(1j * angle)) if mass_step or angle_step else weight
    sizes = np.array([max(size - mass_step / 2, 0.0), size + mass_step / 2])
    return Rounded(weight, new, float(np.abs(sizes * np.exp(0.5j * angle_step) - size).max()))


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
    way: Literal["radial", "axial"] = "radial"
    tip_angle: float = TIP_ANGLE

    def __post_init__(self) -> None:
        for name in ("diameter", "radius", "density"):
            _positive(getattr(self, name), name)
        if not 0 < self.tip_angle <= np.pi * (1 + _EDGE):
            raise ValueError("the tip angle must be above 0 and up to 180° (flat)")
        if self.diameter / 2 >= self.radius:
            raise ValueError("the hole does not fit at this radius; use a smaller drill")

    @property
    def tip_height(self) -> float:
        """Height t of the tip's cone, m."""
        return max(float(self.diameter / 2 / np.tan(self.tip_angle / 2)), 0.0)

    def removed(self, depth: float) -> tuple[float, float]:
        """Mass (kg) and unbalance (kg·m) of a hole whose tip is `depth` (m) below the surface."""
        t, area = self.tip_height, self.density * np.pi * self.diameter**2 / 4
        h, s = max(depth - t, 0.0), min(depth, t)
        cone = area * s / 3 * (s / t) ** 2 if t else 0.0
        if self.way == "axial":
            return area * h + cone, (area * h + cone) * self.radius
        return area * h + cone, area * h * (self.radius - h / 2) + cone * (self.radius - h - s / 4)


@dataclass(frozen=True, eq=False)
class Removal(OneWeight):
    """Material taken away, opposite to an unbalance that was to be added.

    Attributes
    ----------
    method
        "drilling" or "grinding".
    wanted
        The unbalance that was to be added, kg·m.
    radius
        Where weights would have been added, m.
    angles
        Where material is taken away, rad with the rotation, 0 ≤ angle < 2π, shape (n,).
    values
        Sizes in SI units, of one place, by their key in JSON.
    """

    method: Literal["drilling", "grinding"]
    wanted: complex
    radius: float
    angles: FloatArray
    values: Mapping[str, Any]

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        target = self.wanted / (1.0 if labels.unbalances else self.radius)
        each = [{"angle_deg": angle} for angle in labels.directions(self.angles)]
        where = {"holes": each} if self.method == "drilling" else each[0]
        return _document(self.method, target, labels, radius_m=self.radius, **self.values, **where)

    def sentence(self, labels: Labels) -> str:
        """Where, and how much or how deep."""
        at = ", ".join(f"{angle:.1f}°" for angle in labels.directions(self.angles))
        if self.method == "grinding":
            return f"Grind off {1e3 * self.values['mass_kg']:.5g} g at {at}, radius {1e3 * self.radius:g} mm."
        size, tip = (f"{1e3 * self.values[key]:.4g} mm" for key in ("diameter_m", "tip_depth_m"))
        return (
            f"Drill {counted(len(self.angles), 'hole')} of diameter {size} at {at}, down to {tip} (the tip)."
        )


def grind(weight: complex, radius: float) -> Removal:
    """Material to be ground off at a radius (of its centre of mass, m) instead of adding an unbalance, kg·m.

    Raises
    ------
    ValueError
        For a radius that is not positive, or a weight that is not finite.
    """
    size = abs(_finite(weight))
    values = {"mass_kg": size / _positive(radius, "radius"), "unbalance_kg_m": size}
    return Removal("grinding", weight, radius, _turn(np.angle([-weight])), values)


def drill_holes(weight: complex, drill: Drill, *, max_depth: float = np.inf) -> Removal:
    """Holes instead of an added weight: one, or a row of as few as keep each within the largest depth.

    Parameters
    ----------
    weight
        Equivalent added unbalance, kg·m.
    drill
        Diameter, place and material.
    max_depth
        Of the full diameter, m. Radial holes of a row end where they would meet.

    Raises
    ------
    ValueError
        Where no number of holes, `PITCH` diameters apart, is enough.
    """
    from scipy.optimize import brentq

    size, apart, most = abs(_finite(weight)), PITCH * drill.diameter / drill.radius, max_depth
    for n in range(1, max(1, int(np.pi / apart)) + 1):  # beyond half a turn more holes do not help
        each = size * np.sin(apart / 2) / np.sin(n * apart / 2)
        if drill.way == "radial":
            meet = drill.diameter / 2 / np.tan(apart / 2) if n > 1 else 0.0
            most = min(max_depth, drill.radius - drill.tip_height - meet)
        deepest = min(most, 1e3 * drill.radius) + drill.tip_height
        if drill.removed(deepest)[1] >= each:
            tip = brentq(
                lambda z, each=each: drill.removed(z)[1] - each, 0.0, deepest, xtol=1e-15, rtol=1e-14
            )
            mass, unbalance = drill.removed(tip)
            values = {
                "way": drill.way,
                "diameter_m": drill.diameter,
                "depth_m": max(tip - drill.tip_height, 0.0),
                "tip_depth_m": tip,
                "mass_of_one_kg": mass,
                "unbalance_of_one_kg_m": unbalance,
            }
            angles = np.angle(-weight) + apart * (np.arange(n) - (n - 1) / 2)
            return Removal("drilling", weight, drill.radius, _turn(angles), values)
    raise ValueError(
        f"{1e6 * size:.4g} g·mm cannot be taken away by holes of diameter {1e3 * drill.diameter:g} mm: "
        "use a larger drill or depth"
    )


def _finite(value: complex) -> complex:
    if not np.isfinite(value):
        raise ValueError(f"a weight must be finite, not {value!r}")
    return complex(value)


def _positive(value: float, what: str) -> float:
    if not 0 < value < np.inf:
        raise ValueError(f"the {what} must be positive and finite, not {value:g}")
    return float(value)


def _turn(angles: FloatArray) -> FloatArray:
    turned = np.mod(angles, 2 * np.pi)
    return np.where(turned >= 2 * np.pi, 0.0, turned)
