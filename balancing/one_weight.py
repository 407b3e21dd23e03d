"""One weight as it is mounted: in holes, as two fixed masses, in two planes along the shaft, or by drilling.

Every weight is complex, kg or kg·m, its angle counted with the rotation. Taking the unbalance u away at the
angle φ changes the rotor by −u e^{iφ}; so an added unbalance D is done by u = |D| at φ = arg D + 180°.

**Radial hole** from the surface at radius R inward, by a drill of diameter d and tip angle 118°: a cylinder
of depth h and below it a cone of height t = (d/2)/tan 59°, of volume A t/3 (A = π d²/4), its centre of mass
t/4 below its base:

    u/ρ = A h (R − h/2) + (A t/3)(R − h − t/4),

so that h² / 2 − h (R − t/3) + u/(ρ A) − (t/3)(R − t/4) = 0. The surface is taken as flat across the hole (the
part missing is d²/(32 R) of depth).

**Two planes** at z₁ and z₂ take weights wᵢ at zᵢ′ with the same force, Σ D = Σ w, and moment, Σ z D = Σ z′ w:
D₂ = Σ wᵢ (zᵢ′ − z₁)/(z₂ − z₁), D₁ = Σ wᵢ − D₂. Beyond the planes one of them is opposite.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from balancing.conventions import Labels
from balancing.holes import Holes, Mounting, contents, equal_together
from balancing.piece_search import solve_discrete
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import counted, percent

STEEL = 7850.0
"""kg/m³."""
_TIP = float(np.tan(np.radians(59.0)))


@dataclass(frozen=True, eq=False)
class Split:
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
        names, angles = self.holes.names, labels.directions(self.holes.angles)
        return equal_together(
            (f"{words} {labels.weight_in}", f"{names[h]} ({angles[h]:.6g}°)")
            for h, _, words in contents(self.holes, self.mounting, labels.weight_scale)
        )

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        rows = []
        for h, made, _ in contents(self.holes, self.mounting, labels.weight_scale):
            pieces = zip(self.mounting.counts[h], self.holes.pieces, strict=False)
            each = [{"count": int(n), "mass": labels.weight_entry(size)["mass"]} for n, size in pieces if n]
            rows.append({"hole": self.holes.names[h], **labels.weight_entry(made), "pieces": each})
        return _document("holes", self.target, labels) | {
            "error": labels.weight_entry(self.error),
            "relative_error": self.relative_error,
            "holes": rows,
            "mounted": labels.weight_entry(self.mounting.vector),
            "number_of_pieces": self.pieces,
            "words": self.in_holes(labels),
        }

    def sentence(self, labels: Labels) -> str:
        """What to mount, what it makes, and what is missing."""
        wanted, share = labels.weight_at(self.target), percent(self.relative_error)
        if not self.pieces:
            return f"Nothing is mounted, for {wanted}."
        many = counted(self.pieces, "hole" if self.holes.free_amounts else "piece")
        return (
            f"Mount {many}: {labels.weight_at(self.mounting.vector)} together, for {wanted}; error {share} %."
        )

    def lines(self, labels: Labels) -> list[str]:
        """What goes where, and what fewer pieces can do."""
        fewer = [
            f"  {one.pieces}: error {percent(one.relative_error)} %: {'; '.join(one.in_holes(labels))}"
            for one in self.fewer
        ]
        more = ["", "With fewer pieces:", *fewer] if fewer else []
        return [*(f"  {line}" for line in self.in_holes(labels)), *more]


def split(target: complex, holes: Holes, *, good_enough: float = 0.0) -> Split:
    """Mount what makes the vector nearest to a target, or the fewest pieces that come near enough.

    Parameters
    ----------
    target
        Wanted in addition to what is taken, kg or kg·m.
    holes
        What can be mounted.
    good_enough
        Relative error that needs no more pieces (else 1.2 times the least error), of at most 1.5 times the
        least weight that makes the target, or two pieces; 0: the nearest, of at most four pieces more than
        the least number that weighs enough. Has no meaning for free amounts.

    Raises
    ------
    ValueError
        For a target that is not finite, and where nothing admissible exists, not even mounting nothing.

    Examples
    --------
    >>> from balancing.holes import equal_holes, from_list
    >>> found = split(0.035j, from_list(equal_holes(12), [0.01, 0.02]), good_enough=0.2)
    >>> found.in_holes(Labels(weight_unit="g", weight_scale=1e3))
    ['20 g in holes 3 (60°), 5 (120°)']
    """
    target = complex(target)

    def enough(made: ComplexArray) -> bool:
        return bool(abs(made[0] - target) <= good_enough * abs(target))

    asked = enough if good_enough and not holes.free_amounts else None
    found = solve_discrete([[1.0]], [-target], [holes], asked, wanted=[target])
    placed, *fewer = (
        Split(target, holes, mounted)
        for one in (found, *found.fewer)
        for mounted in one.mountings
        if mounted is not None
    )
    return replace(placed, fewer=tuple(one for one in fewer if one.pieces))


@dataclass(frozen=True, eq=False)
class TwoPositions:
    """Where two fixed masses stand so that together they are the target.

    Attributes
    ----------
    target
        Wanted, kg or kg·m.
    masses
        Of the two weights, kg or kg·m, shape (2,).
    angles
        Of each solution (row) and mass, rad with the rotation, −π … π, shape (2, 2). The second solution is
        the first one mirrored at the direction of the target; both rows are equal where the masses stand in
        one line.
    """

    target: complex
    masses: FloatArray
    angles: FloatArray

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
        return {**_document("two positions", self.target, labels), "masses": masses, "solutions": solutions}

    def sentence(self, labels: Labels) -> str:
        """Both solutions in one sentence."""
        each = (" and ".join(map(labels.weight_at, pair)) for pair in self.weights())
        return f"{labels.weight_at(self.target)} from two weights: either {' or '.join(each)}."


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
    _positive(mass_a, mass_b)
    a, b, size = mass_a, mass_b, abs(target)
    little = 1e-12 * (a + b)
    if not abs(a - b) - little <= size <= a + b + little:
        raise ValueError(
            f"weights of {a:g} and {b:g} cannot make {size:g} at any angles: together they reach from "
            f"{abs(a - b):g} to {a + b:g}; use other masses"
        )
    # equal masses that cancel each other may stand anywhere
    cosine = (a * a + size * size - b * b) / (2 * a * size) if size > little else 1.0
    opening = np.arccos(np.clip(cosine, -1.0, 1.0))
    first = a * np.exp(1j * (np.angle(target) + np.array([opening, -opening])))
    return TwoPositions(target, np.array([a, b]), np.angle(np.column_stack((first, target - first))))


@dataclass(frozen=True, eq=False)
class TwoPlanes:
    """Weights along the shaft, and those in two planes with the same force and moment.

    Attributes
    ----------
    given, at
        kg or kg·m, and where they are along the shaft, m.
    planes, positions
        Names and places of two planes, m.
    """

    given: tuple[complex, ...]
    at: tuple[float, ...]
    planes: tuple[str, ...]
    positions: tuple[float, ...]

    def weights(self) -> ComplexArray:
        """In both planes, (2,)."""
        first, second = self.positions
        w = np.array(self.given)
        there = np.sum(w * (np.array(self.at) - first)) / (second - first)
        return np.array([w.sum() - there, there])

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        rows = zip(self.planes, self.positions, map(labels.weight_entry, self.weights()), strict=True)
        each = [{"plane": plane, "position_m": z, **entry} for plane, z, entry in rows]
        return {**_document("two planes", sum(self.given), labels), "planes": each}

    def sentence(self, labels: Labels) -> str:
        """What stands for what."""
        given = zip(map(labels.weight_at, self.given), self.at, strict=True)
        made = zip(map(labels.weight_at, self.weights()), self.planes, strict=True)
        there = " and ".join(f"{words} in plane {plane!r}" for words, plane in made)
        each = " and ".join(f"{words} at {1e3 * z:.6g} mm" for words, z in given)
        return f"{there} have the force and the moment of {each}."


def combine(weights: Iterable[complex]) -> complex:
    """The one weight that does what several mounted ones do together: their vector sum.

    A sum that is only the rounding error of weights which cancel each other is 0.

    Raises
    ------
    ValueError
        For no weights.

    Examples
    --------
    >>> combine([3.0, 4.0j])
    (3+4j)
    """
    each = np.array([*weights], dtype=complex)
    if not each.size:
        raise ValueError("there is no weight to combine")
    total = complex(each.sum())
    return total if abs(total) > 4 * np.finfo(float).eps * np.abs(each).sum() else 0j


@dataclass(frozen=True, eq=False)
class Removal:
    """Material taken away at one place, opposite to an unbalance that was to be added.

    Attributes
    ----------
    target
        What was to be added, kg·m.
    radius
        Of the surface that is drilled, m.
    mass
        To be taken away, kg.
    diameter, depth, tip_depth
        Of the hole, of its full diameter and of its tip, m.
    """

    target: complex
    radius: float
    mass: float
    diameter: float
    depth: float
    tip_depth: float

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types."""
        target = self.target / (1.0 if labels.unbalances else self.radius)
        document = _document("drilling", target, labels)
        document |= {"angle_deg": self._angle(labels), "radius_m": self.radius, "mass_kg": self.mass}
        hole = {"diameter_m": self.diameter, "depth_m": self.depth, "tip_depth_m": self.tip_depth}
        return document | {"unbalance_kg_m": abs(self.target), **hole}

    def _angle(self, labels: Labels) -> float:
        return labels.weight_entry(-self.target)["angle_deg"]

    def sentence(self, labels: Labels) -> str:
        """Where, and how much or how deep."""
        grams, at = 1e3 * self.mass, f"at {self._angle(labels):.1f}°"
        size, tip = 1e3 * self.diameter, 1e3 * self.tip_depth
        return f"Drill a hole of diameter {size:.4g} mm {at}, down to {tip:.4g} mm (the tip): {grams:.4g} g."


def drill(target: complex, radius: float, diameter: float, density: float = STEEL) -> Removal:
    """One radial hole instead of an added unbalance.

    Parameters
    ----------
    target
        What was to be added, kg·m.
    radius, diameter
        Of the surface and of the drill, m.
    density
        Of the material, kg/m³.

    Raises
    ------
    ValueError
        For sizes that are not positive, and where one hole cannot be so small or so large.
    """
    _positive(radius, diameter, density)
    tip, area = diameter / 2 / _TIP, density * np.pi * diameter**2 / 4
    left = abs(target) - area * tip / 3 * (radius - tip / 4)  # what the tip alone does not take away
    middle = radius - tip / 3
    fits = 0 <= 2 * left <= area * middle**2
    depth = middle - float(np.sqrt(middle**2 - 2 * left / area)) if fits else np.inf
    if depth + tip > radius:
        raise ValueError(
            f"a hole of diameter {1e3 * diameter:g} mm cannot take away {1e6 * abs(target):.4g} g·mm: use a "
            f"{'smaller' if left < 0 else 'larger'} drill, or share the weight (--holes) and drill each part"
        )
    return Removal(target, radius, area * (depth + tip / 3), diameter, depth, depth + tip)


OneWeight = Split | TwoPlanes | TwoPositions | Removal


def _document(method: str, target: complex, labels: Labels) -> dict[str, Any]:
    """Keys that every document has."""
    head = {"method": method, "unit": labels.weight_unit, "angles": labels.angles}
    return {**head, "target": labels.weight_entry(target)}


def _positive(*sizes: float) -> None:
    if not all(0 < size < np.inf for size in sizes):
        raise ValueError("masses, sizes and densities must be positive and finite")
