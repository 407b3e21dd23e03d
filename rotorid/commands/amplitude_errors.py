"""Stated errors of amplitudes: those of a model file, and the options before them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotorid.identify import AmplitudeErrors


def amplitude_errors(
    stated: AmplitudeErrors | None, percent: float | None, degrees: float | None
) -> AmplitudeErrors | None:
    """Errors of the model file, those of the options before them."""
    from rotorid.identify import AmplitudeErrors

    if percent is None and degrees is None:
        return stated
    for name, value, high in (("--amplitude-error", percent, 1000.0), ("--phase-error", degrees, 360.0)):
        if value is not None and not 0 <= value <= high:
            raise ValueError(f"{name} takes a number from 0 to {high:g}, not {value:g}")
    relative, phase, floor = (stated.relative, stated.phase, stated.floor) if stated else (0.0, 0.0, 0.0)
    relative = relative if percent is None else percent / 100.0
    return AmplitudeErrors(relative, phase if degrees is None else math.radians(degrees), floor)
