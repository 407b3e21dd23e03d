"""Weights combined into one, trimmed, rounded to a scale, or split into two fixed masses at free angles.

Every weight is complex, kg or kg·m, its angle counted with the rotation. Nothing here knows holes: pieces in
holes are found in `balancing.mounting.split`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from balancing.data.conventions import Labels
from rotorid.base.answer import Answer
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import percent

_EDGE = 1e-12
"""Relative; a target this close to the limit of its range is on it."""


@dataclass(frozen=True, eq=False)
class TwoPositions:
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

    def vectors(self) -> ComplexArray:
        """The sum of both weights in each solution, shape (2,)."""
        return np.asarray(self.weights().sum(axis=1))

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the labels' unit and angles."""
        return {
            "method": "two positions",
            "unit": labels.weight_unit,
            "angles": labels.angles,
            "target": labels.weight_entry(self.target),
            "masses": (self.masses * labels.weight_scale).tolist(),
            "solutions": [{"angles_deg": labels.directions(row)} for row in self.angles],
        }

    def rows(self, labels: Labels) -> list[dict[str, Any]]:
        """Each weight of each solution."""
        found, mass = self.to_dict(labels), f"mass_{labels.weight_unit}"
        return [
            {"solution": k, mass: size, "angle_deg": angle}
            for k, solution in enumerate(found["solutions"], start=1)
            for size, angle in zip(found["masses"], solution["angles_deg"], strict=True)
        ]

    def answer(self, labels: Labels) -> Answer:
        """Both solutions."""
        unit, (one, other) = labels.weight_in, self.masses * labels.weight_scale
        lines = []
        for row, word in zip(self.angles, ("either", "or"), strict=True):
            a, b = labels.directions(row)
            lines.append(f"  {word:<6} {one:g} {unit} at {a:.1f}° and {other:g} {unit} at {b:.1f}°")
        return Answer(f"{labels.weight_at(self.target)} from two weights:", "\n".join(lines))


@dataclass(frozen=True)
class Rounded:
    """A weight rounded to what scale and angle marks can show.

    Attributes
    ----------
    wanted
        Before rounding.
    weight
        After it.
    error
        `weight` minus the wanted one.
    relative_error
        |error| by the size of the wanted one; 0 for a wanted weight of 0 that stays 0.
    worst
        The largest |error| that rounding with these steps can make of a weight of this size.
    """

    wanted: complex
    weight: complex
    error: complex
    relative_error: float
    worst: float

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the labels' unit and angles."""
        return {
            "method": "one weight",
            "unit": labels.weight_unit,
            "angles": labels.angles,
            "target": labels.weight_entry(self.wanted),
            "weight": labels.weight_entry(self.weight),
            "error": labels.weight_entry(self.error),
            "relative_error": self.relative_error,
            "largest_possible_error": self.worst * labels.weight_scale,
        }

    def rows(self, labels: Labels) -> list[dict[str, Any]]:
        """The weight."""
        shown = labels.weight_entry(self.weight)
        return [{f"mass_{labels.weight_unit}": shown["mass"], "angle_deg": shown["angle_deg"]}]

    def answer(self, labels: Labels) -> Answer:
        """The weight, and what rounding did to it."""
        scale, unit = labels.weight_scale, labels.weight_in
        lost = (
            f"Instead of {labels.weight_at(self.wanted)}: error {abs(self.error) * scale:.3g} {unit} "
            f"({percent(self.relative_error)} %); with these steps at most {self.worst * scale:.3g} {unit}."
        )
        return Answer(f"Mount {labels.weight_at(self.weight)}.", lost if self.worst else "")


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
    target, size = _finite(target), abs(target)
    a, b = (_positive(m, "a mass") for m in (mass_a, mass_b))
    low, high = abs(a - b), a + b
    if not low - _EDGE * high <= size <= high * (1 + _EDGE):
        raise ValueError(
            f"weights of {a:g} and {b:g} cannot make {size:g} at any angles: together they reach from "
            f"{low:g} to {high:g}; use other masses"
        )
    if size <= _EDGE * high:  # equal masses that cancel each other may stand anywhere
        angles = np.array([[0.0, np.pi], [np.pi, 0.0]])
    else:
        cosine = (a * a + size * size - b * b) / (2 * a * size)
        opening = np.arccos(np.clip(cosine, -1.0, 1.0))
        alpha = np.angle(target) + np.array([opening, -opening])
        rest = target - a * np.exp(1j * alpha)
        angles = np.mod(np.column_stack((alpha, np.angle(rest))), 2 * np.pi)
        angles[angles >= 2 * np.pi] = 0.0
    return TwoPositions(np.array([a, b]), angles, target)


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
    each = np.array([_finite(w) for w in weights], dtype=complex)
    if each.size == 0:
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
    several = [mounted] if isinstance(mounted, (complex, float, int)) else list(mounted)
    return combine([_finite(target), *(-_finite(w) for w in several)])


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
    if step == 0:
        return float(value)
    many = round(value / step)
    inverse = round(1 / step)
    # 347 · 0.1 is 34.7 only after division by ten
    return float(many / inverse) if inverse and abs(inverse * step - 1) < _EDGE else float(many * step)


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
    worst = float(np.abs(sizes * np.exp(0.5j * angle_step) - size).max())
    error = new - weight
    relative = abs(error) / size if size > 0 else 0.0
    return Rounded(weight, new, error, relative, worst)


def _finite(value: complex) -> complex:
    if not np.isfinite(value):
        raise ValueError(f"a weight must be finite, not {value!r}")
    return complex(value)


def _positive(value: float, what: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{what} must be positive and finite, not {value!r}")
    return float(value)
