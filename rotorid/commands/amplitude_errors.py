"""Stated errors of amplitudes: those of a model file, or the option in their place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rotorid.commands.quantities import number

if TYPE_CHECKING:
    from rotorid.identify import AmplitudeErrors

Errors = str | tuple[float, float]
"""One standard deviation of an amplitude, percent, and of a phase, degrees."""


def percent_and_degrees(given: Errors) -> tuple[float, float]:
    """Read "2,1".

    Raises
    ------
    ValueError
        For anything else, an amplitude's below 0 or above 1000 percent, a phase's above 360 degrees.
    """
    parts = [number(part) for part in given.split(",")] if isinstance(given, str) else given
    if len(parts) != 2 or not (0 <= parts[0] <= 1000 and 0 <= parts[1] <= 360):
        raise ValueError(f"--errors {given!r}: percent of an amplitude and degrees of a phase, 2,1")
    return parts[0], parts[1]


def amplitude_errors(stated: AmplitudeErrors | None, given: Errors | None) -> AmplitudeErrors | None:
    """Errors of the model file; an option takes their place."""
    if given is None:
        return stated
    from rotorid.identify import AmplitudeErrors

    percent, degrees = percent_and_degrees(given)
    return AmplitudeErrors(percent / 100.0, math.radians(degrees), stated.floor if stated else 0.0)
