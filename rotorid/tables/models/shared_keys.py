"""Keys that model files of both kinds have: errors of amplitudes, and pairs of numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rotorid.tables.reader.decimal_numbers import LARGEST
from rotorid.tables.reader.toml_file import Section

if TYPE_CHECKING:
    from rotorid.harmonic.experiments import AmplitudeErrors


def read_errors(section: Section) -> AmplitudeErrors | None:
    """`[errors]`: None if there is none."""
    errors = section.section("errors")
    if errors is None:
        return None
    percent = errors.number("amplitude_percent", 0.0, low=0.0, high=1000.0) or 0.0
    phase = errors.number("phase_deg", 0.0, low=0.0, high=360.0) or 0.0
    floor = errors.number("floor", 0.0, low=0.0) or 0.0
    errors.finish()
    if not (percent or phase or floor):
        errors.refuse("at least one of amplitude_percent, phase_deg and floor above 0, or no [errors] at all")
        return None
    from rotorid.harmonic.experiments import AmplitudeErrors

    return AmplitudeErrors(percent / 100.0, math.radians(phase), floor)


def pair(value: object) -> tuple[float, float] | None:
    """Two numbers in order, the outer ones perhaps infinite."""
    if not isinstance(value, list) or len(value) != 2:
        return None
    if not all(isinstance(item, (int, float)) and not isinstance(item, bool) for item in value):
        return None
    low, high = (
        float(max(min(item, LARGEST * 10), -LARGEST * 10)) if isinstance(item, int) else item
        for item in value
    )
    sizes_fit = all(abs(item) <= LARGEST or math.isinf(item) for item in (low, high))
    return (low, high) if sizes_fit and low < high else None
