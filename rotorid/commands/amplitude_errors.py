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
    if percent is None and degrees is None:
        return stated
    for name, value, high in (("--amplitude-error", percent, 1000.0), ("--phase-error", degrees, 360.0)):
        if value is not None and not 0 <= value <= high:
            raise ValueError(f"{name} takes a number from 0 to {high:g}, not {value:g}")
    from rotorid.identify import AmplitudeErrors

    relative = percent / 100.0 if percent is not None else (stated.relative if stated else 0.0)
    phase = math.radians(degrees) if degrees is not None else (stated.phase if stated else 0.0)
    return AmplitudeErrors(relative, phase, stated.floor if stated else 0.0)
