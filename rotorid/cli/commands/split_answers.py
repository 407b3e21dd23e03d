"""What `rotorid split` answers: on holes, at two angles, drilled, ground off, or rounded to a scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.text import counted
from rotorid.workflows.quantities import size as length_of
from rotorid.workflows.quantities import weight, weights

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing.data.conventions import Labels
    from balancing.mounting.hand_mounting import TwoPositions
    from balancing.mounting.holes import Holes, Mounting
    from balancing.mounting.removal import Drilling
    from balancing.mounting.split import Split


@dataclass(frozen=True)
class Answer:
    """The document, its text, the rows of its table, its picture."""

    document: dict[str, Any]
    text: Callable[[], str]
    rows: list[dict[str, Any]]
    figure: Callable[[], Figure]

    def table(self) -> pd.DataFrame:
        """The rows as a table."""
        import pandas as pd

        return pd.DataFrame(self.rows)


@dataclass(frozen=True)
class Wanted:
    """The weight to be mounted, and how weights are printed; a radius (m) where one was given."""

    target: complex
    labels: Labels
    radius: float | None

    def polar(self, weight: complex) -> dict[str, float]:
        """A weight as people of the job write it."""
        size, angle = self.labels.weight(weight)
        return {"mass": float(f"{size:.12g}"), "angle_deg": float(f"{angle:.12g}")}

    def words(self, weight: complex) -> str:
        """The same as text."""
        shown = self.polar(weight)
        return f"{shown['mass']:.5g} {self.labels.weight_unit} at {shown['angle_deg']:.1f}°"

    def document(self, method: str) -> dict[str, Any]:
        """What all documents begin with."""
        return {
            "method": method,
            "unit": self.labels.weight_unit,
            "angles": self.labels.angles,
            "target": self.polar(self.target),
        }


def on_holes(wanted: Wanted, holes: Holes, most_pieces: int | None, good_enough: float) -> Answer:
    """The nearest vector in the holes."""
    from balancing.mounting.split import fewer_pieces, split

    if not 0 <= good_enough <= 100:
        raise ValueError(f"--good-enough: {good_enough:g} is no error from 0 to 100 percent")
    found = split(wanted.target, holes, most_pieces=most_pieces, good_enough=good_enough / 100)
    fewer = fewer_pieces(found)
    document = {
        "method": "holes",
        **found.to_dict(wanted.labels),
        "words": found.lines(wanted.labels),
        "fewer_pieces": [one.to_dict(wanted.labels) for one in fewer],
    }
    rows = [
        {
            "hole": row["hole"],
            "angle_deg": row["angle_deg"],
            f"mass_{wanted.labels.weight_unit}": row["mass"],
            "pieces": words.partition(" in hole")[0],
        }
        for row, words in zip(document["holes"], document["words"], strict=False)
    ]
    return Answer(
        document,
        lambda: _holes_text(wanted, found, fewer),
        rows,
        lambda: _figure(wanted, holes=holes, mounting=found.mounting),
    )


def _holes_text(wanted: Wanted, found: Split, fewer: list[Split]) -> str:
    from balancing.mounting.split import percent

    lines = [found.summary(wanted.labels)]
    if fewer:
        lines += ["", "With fewer pieces:"]
    for one in fewer:
        words = ", ".join(one.lines(wanted.labels))
        lines.append(f"  {one.pieces}: error {percent(one.relative_error)} %: {words}")
    return "\n".join(lines)


def at_two_angles(wanted: Wanted, two: str) -> Answer:
    """Two fixed weights at free angles."""
    from balancing.mounting.hand_mounting import two_positions

    masses = weights(two, "--two", wanted.labels, wanted.radius)
    if len(masses) != 2:
        raise ValueError(f"--two {two!r}: give two weights, such as 20g,30g")
    scale, unit = wanted.labels.weight_scale, wanted.labels.weight_unit
    size, low, high = abs(wanted.target), abs(masses[0] - masses[1]), sum(masses)
    if not low * (1 - 1e-12) <= size <= high * (1 + 1e-12):
        raise ValueError(
            f"--two: {masses[0] * scale:g} and {masses[1] * scale:g} {unit} together make from "
            f"{low * scale:g} to {high * scale:g} {unit}, not {size * scale:g} {unit}; use other weights"
        )
    found = two_positions(wanted.target, masses[0], masses[1])
    shown = [_angles_of(wanted, row) for row in found.angles]
    document = {
        **wanted.document("two positions"),
        "masses": [m * scale for m in masses],
        "solutions": [{"angles_deg": row} for row in shown],
    }
    rows = [
        {"solution": k + 1, f"mass_{unit}": m * scale, "angle_deg": angle}
        for k, row in enumerate(shown)
        for m, angle in zip(masses, row, strict=True)
    ]
    return Answer(document, lambda: _two_text(wanted, found), rows, lambda: _two_figure(wanted, found))


def _angles_of(wanted: Wanted, angles: np.ndarray) -> list[float]:
    return [float(f"{a:.12g}") for a in wanted.labels.weight(np.exp(1j * angles))[1]]


def _two_text(wanted: Wanted, found: TwoPositions) -> str:
    scale, unit = wanted.labels.weight_scale, wanted.labels.weight_unit
    lines = [f"{wanted.words(wanted.target)} from two weights:"]
    for row, word in zip(found.angles, ("either", "or"), strict=True):
        a, b = _angles_of(wanted, row)
        first, second = (m * scale for m in found.masses)
        lines.append(f"  {word:<6} {first:g} {unit} at {a:.1f}° and {second:g} {unit} at {b:.1f}°")
    return "\n".join(lines)


def _two_figure(wanted: Wanted, found: TwoPositions) -> Figure:
    return _figure(wanted, *(tuple(found.masses * np.exp(1j * row)) for row in found.angles))


def unbalance_of(wanted: Wanted, why: str) -> tuple[complex, float]:
    """The wanted unbalance, kg·m, and the radius, m, which is needed."""
    from rotorid.tables.reader.units import MASS

    if wanted.radius is None:
        raise ValueError(f"{why} needs --radius, such as --radius 100mm")
    mass = wanted.labels.weight_unit in MASS
    return (wanted.target * wanted.radius if mass else wanted.target), wanted.radius


def drilled(
    wanted: Wanted,
    diameter: str,
    axial: bool,
    depth: str | None,
    density: float,
    tip_angle: float,
    spacing: float | None,
) -> Answer:
    """Holes drilled opposite to the weight."""
    from balancing.mounting.removal import Drill, drill_holes

    unbalance, radius = unbalance_of(wanted, "--drill")
    tool = Drill(
        length_of(diameter, "--drill", "8mm"),
        radius,
        density,
        "axial" if axial else "radial",
        float(np.radians(tip_angle)),
    )
    found = drill_holes(
        unbalance,
        tool,
        max_depth=np.inf if depth is None else length_of(depth, "--depth", "20mm"),
        spacing=None if spacing is None else float(np.radians(spacing)),
    )
    at = _angles_of(wanted, found.angles)
    document = {
        **wanted.document("drilling"),
        "way": tool.way,
        "diameter_m": tool.diameter,
        "radius_m": tool.radius,
        "depth_m": found.depth,
        "tip_depth_m": found.tip_depth,
        "mass_of_one_kg": found.mass,
        "unbalance_of_one_kg_m": found.unbalance,
        "holes": [{"angle_deg": angle} for angle in at],
    }
    rows = [
        {
            "hole": k + 1,
            "angle_deg": angle,
            "diameter_mm": 1e3 * tool.diameter,
            "depth_mm": 1e3 * found.depth,
            "tip_depth_mm": 1e3 * found.tip_depth,
            "mass_g": 1e3 * found.mass,
        }
        for k, angle in enumerate(at)
    ]
    factor = wanted.target / unbalance if unbalance else 1.0
    holes = tuple(-found.unbalance * np.exp(1j * found.angles) * factor.real)
    return Answer(
        document, lambda: _drilling_text(wanted, found), rows, lambda: _figure(wanted, holes, remove=True)
    )


def _drilling_text(wanted: Wanted, found: Drilling) -> str:
    at = ", ".join(f"{a:.1f}°" for a in _angles_of(wanted, found.angles))
    tool, n = found.drill, len(found.angles)
    where = "towards the axis from" if tool.way == "radial" else "parallel to the axis at"
    only = (
        "only the tip goes in, " if found.depth == 0 else f"full diameter {1e3 * found.depth:.2f} mm deep, "
    )
    return "\n".join(
        [
            f"Instead of adding {wanted.words(wanted.target)}, take away opposite:",
            f"  {counted(n, 'hole')} of diameter {1e3 * tool.diameter:g} mm at {at}, {where} a "
            f"radius of {1e3 * tool.radius:g} mm",
            f"  {only}tip at {1e3 * found.tip_depth:.2f} mm",
            f"  each takes away {1e3 * found.mass:.4g} g, {1e6 * found.unbalance:.5g} g·mm",
        ]
    )


def ground(wanted: Wanted) -> Answer:
    """Material ground off opposite to the weight."""
    from balancing.mounting.removal import grind

    unbalance, radius = unbalance_of(wanted, "--grind")
    found = grind(unbalance, radius)
    (angle,) = _angles_of(wanted, np.array([found.angle]))
    document = {
        **wanted.document("grinding"),
        "radius_m": radius,
        "mass_kg": found.mass,
        "unbalance_kg_m": found.unbalance,
        "angle_deg": angle,
    }
    text = (
        f"Instead of adding {wanted.words(wanted.target)}, grind off {1e3 * found.mass:.5g} g "
        f"at {angle:.1f}°, radius {1e3 * radius:g} mm ({1e6 * found.unbalance:.5g} g·mm)"
    )
    rows = [{"angle_deg": angle, "mass_g": 1e3 * found.mass, "radius_mm": 1e3 * radius}]
    return Answer(document, lambda: text, rows, lambda: _figure(wanted, (wanted.target,), remove=True))


def as_one(wanted: Wanted, step: str | None, angle_step: float) -> Answer:
    """One weight, rounded to what a scale and marks show."""
    from balancing.mounting.hand_mounting import rounded
    from balancing.mounting.split import percent

    if not 0 <= angle_step <= 360:
        raise ValueError(f"--angle-step: {angle_step:g} is no step of an angle, 0 to 360 degrees")
    size = 0.0 if step is None else weight(step, "--step", wanted.labels, wanted.radius, "0.5g")
    # steps count from the job's 0° either way, so the sign of the angle does not matter
    found = rounded(wanted.target, size, float(np.radians(angle_step)))
    scale = wanted.labels.weight_scale
    document = {
        **wanted.document("one weight"),
        "weight": wanted.polar(found.weight),
        "error": wanted.polar(found.error),
        "relative_error": found.relative_error,
        "largest_possible_error": found.worst * scale,
    }
    lines = [wanted.words(found.weight)]
    if size or angle_step:
        lines += [
            f"instead of {wanted.words(wanted.target)}: error {abs(found.error) * scale:.3g} "
            f"{wanted.labels.weight_unit} ({percent(found.relative_error)} %); with these steps at most "
            f"{found.worst * scale:.3g} {wanted.labels.weight_unit}"
        ]
    rows = [
        {f"mass_{wanted.labels.weight_unit}": v["mass"], "angle_deg": v["angle_deg"]}
        for v in (document["weight"],)
    ]
    loose = (found.weight,) if found.weight else ()
    return Answer(document, lambda: "\n".join(lines), rows, lambda: _figure(wanted, loose))


def _figure(
    wanted: Wanted,
    *loose: tuple[complex, ...],
    holes: Holes | None = None,
    mounting: Mounting | None = None,
    remove: bool = False,
) -> Figure:
    """A disc for each of several ways to place weights."""
    from matplotlib.figure import Figure

    from balancing.plots.discs import disc, seen_from

    ways = loose or ((),)
    fig = Figure(figsize=(4.6 * len(ways) + 0.4, 5.6), layout="constrained")
    for k, placed in enumerate(ways):
        disc(
            fig.add_subplot(1, len(ways), k + 1),
            "weight" if len(ways) == 1 else f"solution {k + 1}",
            holes,
            mounting,
            wanted.labels,
            remove=remove,
            weight=wanted.target,
            loose=placed,
        )
    fig.suptitle(seen_from(wanted.labels).replace("; ", "\n"), fontsize="small")
    return fig
