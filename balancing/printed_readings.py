"""What tables and texts of results are made of, in the job's own units and conventions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.conventions import Labels
from balancing.reading_errors import Reading, RunErrors
from balancing.reading_errors import rms as rms
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.tables import Column, records
from rotorid.base.text import RPM, figures, rpm

INVISIBLE = 1e-9
"""Predicted amplitudes below this share of the largest one before are zero to a reader."""


def degrees(angle: float, places: int = 1) -> str:
    """An angle as text, 0 ≤ angle < 360."""
    return f"{round(angle, places) % 360:.{places}f}°"


def three_figures(value: float) -> str:
    """An amplitude as text."""
    return figures(value, 3)


def weight_columns(labels: Labels, planes: Sequence[str], weights: ArrayLike) -> tuple[Column, ...]:
    """plane, mass, unit and angle_deg of weights (P,), kg or kg·m."""
    mass, angle = labels.weight(weights)
    return (
        Column("plane", planes),
        Column("mass", mass, figures, title=labels.weight_in),
        Column("unit", (labels.weight_unit,) * len(planes), None),
        Column("angle_deg", angle, degrees, title="angle"),
    )


def weight_rows(labels: Labels, planes: Sequence[str], weights: ArrayLike) -> list[dict[str, Any]]:
    """Weights of the planes as JSON rows."""
    return records(weight_columns(labels, planes, weights))


def reading_columns(labels: Labels, speeds: FloatArray, sensors: Sequence[str]) -> tuple[Column, Column]:
    """speed_rpm and sensor of readings (S, C), one row a reading, speed by speed; speeds in rad/s."""
    turns = np.repeat([rpm(speed) for speed in speeds], len(sensors))
    return (
        Column("speed_rpm", turns, lambda turn: labels.speed_number(turn / RPM), title=labels.speed_in),
        Column("sensor", tuple(sensors) * len(speeds)),
    )


def largest_readings(
    labels: Labels,
    speeds: FloatArray,
    sensors: Sequence[str],
    before: ComplexArray,
    after: ComplexArray,
    within: FloatArray | None = None,
) -> str:
    """The three largest readings (S, C) after in words, with those before: "probe 1 at 1220 rpm 3.36 → 0.05".

    `within` is the radius of their 95 % region in the job's unit, NaN where it is not known; where nothing is
    left, the three largest of these.
    """
    old, new = (labels.vibration(readings)[0] for readings in (before, after))
    reach = np.full(old.shape, np.nan) if within is None else within
    size = new if new.max() > INVISIBLE * old.max() else np.nan_to_num(reach)
    share = np.round(size / (size.max() or 1.0), 6)  # equal ones in their order, whatever was rounded
    words = []
    for place in np.argsort(-share, axis=None, kind="stable")[:3]:
        s, c = divmod(int(place), len(sensors))
        width = "" if np.isnan(reach[s, c]) else f" (± {figures(reach[s, c], 2)})"
        left = f"{three_figures(old[s, c])} → {small(new[s, c], old.max())}{width}"
        words.append(f"{sensors[c]} at {labels.speed_words(speeds[s])} {left}")
    unit = f", {labels.vibration_in}" if labels.vibration_in else ""
    return f"{unit}: {'; '.join(words)}."


def small(value: float, scale: float) -> str:
    """A predicted amplitude; rounding of an exact solution is zero to a reader."""
    return "0" if value <= INVISIBLE * scale else three_figures(value)


def covariance_column(labels: Labels, name: str, covariance: FloatArray | None, count: int) -> Column:
    """Covariance (2, 2) of each of so many readings; None: not known."""
    if covariance is None:
        return Column(name, [None] * count, None)
    return Column(name, labels.vibration_covariance(covariance).reshape(-1, 2, 2), None)


def vector_columns(
    labels: Labels, name: str, readings: ComplexArray, nothing: float | None = None
) -> tuple[Column, Column]:
    """NAME and NAME_phase_deg of readings of any shape, one row a reading.

    Parameters
    ----------
    labels
        Units and conventions.
    name
        Of the amplitude.
    readings
        Inside (SI, lead).
    nothing
        Amplitudes up to this one, in the job's unit, are rounding: 0, and their direction means nothing.
    """
    size, phase = (part.ravel() for part in labels.vibration(readings))
    if nothing is not None:
        phase = np.where(size > nothing, phase, np.nan)
        size = np.where(size > nothing, size, 0.0)
    return (
        Column(name, size, three_figures),
        Column(f"{name}_phase_deg", phase, lambda angle: degrees(angle, 0), title="phase"),
    )


def reading_names(labels: Labels, sensors: Sequence[str], speeds: FloatArray) -> tuple[str, ...]:
    """What to call each reading, speed by speed."""
    return tuple(f"sensor {c!r} at {labels.speed_words(s)}" for s in speeds for c in sensors)


def error_words(reading: Reading, run: RunErrors, labels: Labels) -> str:
    """Errors of a reading and between runs in one or two sentences."""
    e, whole, parts = reading.errors, float(np.linalg.norm(run.typical)), {}
    if e is not None:
        parts = {
            f"{100 * e.amplitude:.3g} % of the amplitude": e.amplitude,
            f"{np.degrees(e.phase):.3g}°": e.phase,
            labels.amplitude_words(e.floor): e.floor,
        }
    between = {f"{100 * whole:.2g} %": whole * (whole > 5e-4)}
    if run.origin == "stated":  # as it was, whatever share of it is common
        relative, floor = whole * np.sqrt(1 - run.evenly), whole * np.sqrt(run.evenly) * run.level
        between = {f"{100 * relative:.2g} %": relative, labels.amplitude_words(floor): floor}
    stated, changes = (", ".join(w for w, size in each.items() if size) for each in (parts, between))
    if reading.source == "residuals":
        return f"One standard deviation of a reading and from run to run in one: {changes} ({run.origin})."
    out = f"One standard deviation of a reading: {stated or 'not known'} ({reading.source})"
    return out + (f"; from run to run: {changes} ({run.origin})." if changes else ".")


def error_document(reading: Reading, run: RunErrors, labels: Labels) -> dict[str, Any]:
    """Errors of a reading and between runs in numbers; amplitudes in the job's unit.

    Where the runs tell both in one ("residuals"), those of a reading are None.
    """
    e = None if reading.source == "residuals" else reading.errors
    scale = labels.vibration_scale
    whole = float(np.linalg.norm(run.typical))
    return {
        "source": reading.source,
        "amplitude_percent": e and 100 * e.amplitude,
        "phase_deg": e and np.degrees(e.phase),
        "floor": e and e.floor * scale,
        "degrees_of_freedom": reading.dof,
        "between_runs": {
            "source": run.origin,
            "percent": 100 * whole,
            "rms": whole * run.level * scale,
        },
    }
