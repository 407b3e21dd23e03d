"""The proposed trial weight as people read it: text and JSON types."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.data.conventions import Labels
from balancing.data.result_columns import largest_readings, reading_columns, three_figures, vector_columns
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import rpm

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class TrialWeight(Answered):
    """A proposed trial weight for one plane.

    Attributes
    ----------
    plane
        Name.
    amount
        kg (with `radius`) or kg·m.
    angle
        rad with the rotation; None where nothing is known to choose it by.
    angle_reach
        How far the best angle may be from it, rad, either side; 0 from coefficients; None as before.
    basis
        Where amount and angle come from, in words.
    radius
        m; None where the amount is an unbalance.
    speed
        rad/s, the highest at which it will turn.
    load
        N, that the plane carries; None: unknown.
    speeds, sensors, before, expected
        Readings (S, C) without and with it; None where there are no coefficients.
    labels
        Units and conventions to print in.
    warnings
        What the user should know.
    """

    plane: str
    amount: float
    angle: float | None
    angle_reach: float | None
    basis: str
    radius: float | None
    speed: float
    load: float | None = None
    speeds: FloatArray | None = None
    sensors: tuple[str, ...] = ()
    before: ComplexArray | None = None
    expected: ComplexArray | None = None
    labels: Labels = field(default_factory=Labels)
    warnings: tuple[str, ...] = ()

    @property
    def force(self) -> float | None:
        """Centrifugal force at the highest speed, N; None for masses without a radius."""
        if self.radius is None and not self.labels.unbalances:
            return None
        return self.amount * (1.0 if self.radius is None else self.radius) * self.speed**2

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        size, angle = self._weight()
        share = None if self.force is None or self.load is None else 100 * self.force / self.load
        expected = self._columns()
        document = {
            "plane": self.plane,
            "mass": size,
            "unit": self.labels.weight_unit,
            "angle_deg": angle,
            "angle_reach_deg": None if self.angle_reach is None else math.degrees(self.angle_reach),
            "basis": self.basis,
            "radius_m": self.radius,
            "speed_rpm": rpm(self.speed),
            "force_N": self.force,
            "load_N": self.load,
            "force_percent": share,
            "expected": None if expected is None else rows(expected),
            "conventions": self.labels.conventions(),
            "warnings": self.warnings,
        }
        return plain(document)

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and sensor with the expected readings; one row without coefficients."""
        size, angle = self._weight()
        expected = self._columns()
        n = 1 if expected is None else len(expected[0].values)
        return frame(
            (
                Column("plane", (self.plane,) * n),
                Column("mass", np.full(n, size)),
                Column("unit", (self.labels.weight_unit,) * n),
                Column("angle_deg", np.full(n, angle)),
                *(expected or ()),
            )
        )

    @property
    def answer(self) -> Answer:
        """Amount and place, what for, and the readings expected with it."""
        found, labels = self.to_dict(), self.labels
        at = "" if self.radius is None else f" at the radius {self.radius * 1e3:.6g} mm"
        angle = "at any angle (no phase, or no lag, is known)"
        if found["angle_deg"] is not None:
            angle = f"at {found['angle_deg']:.0f}° {labels.angle_words}"
            if self.angle_reach:
                angle += f" (± {math.degrees(self.angle_reach):.0f}°)"
        lines = [f"Plane {self.plane}: {self.basis}"]
        if self.force is not None:
            share = "" if self.load is None else f", {found['force_percent']:.3g} % of the load"
            lines[0] += f"; force at {labels.speed_words(self.speed)} {self.force:.4g} N{share}"
        table: tuple[str, ...] = ()
        if self.speeds is not None and self.before is not None and self.expected is not None:
            largest = largest_readings(labels, self.speeds, self.sensors, self.before, self.expected)
            lines.append(f"  largest with it{largest}")
            head = f"Plane {self.plane}, now and with the weight, {labels.vibration_in}"
            table = (f"{head}\n{text(self._columns() or (), left=2)}",)
        return Answer(
            f"Trial weight in plane {self.plane}: {found['mass']:.4g} {labels.weight_in}{at}, {angle}.",
            "\n".join(lines),
            ((labels.assumed_in_words(),) if labels.assumed else ()) + self.warnings,
            tables=table,
            more="every reading",
        )

    def _weight(self) -> tuple[float, float]:
        """Size in the job's unit and angle in degrees; NaN: nothing is known to choose it by."""
        size, angle = self.labels.weight(self.amount * np.exp(1j * (self.angle or 0.0)))
        return float(size), np.nan if self.angle is None else float(angle)

    def _columns(self) -> tuple[Column, ...] | None:
        """Readings without and with it, one row per speed and sensor; None without coefficients."""
        if self.speeds is None or self.before is None or self.expected is None:
            return None
        change = np.abs(self.expected - self.before) * self.labels.vibration_scale
        return (
            *reading_columns(self.labels, self.speeds, self.sensors),
            *vector_columns(self.labels, "before", self.before),
            *vector_columns(self.labels, "after", self.expected),
            Column("change", change.ravel(), three_figures),
        )
