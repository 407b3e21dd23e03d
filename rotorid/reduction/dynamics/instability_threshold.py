"""Threshold of instability of the small model, found as `fem.stability_threshold` finds the full rotor's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import fem
from rotorid.reduction.dynamics.small_rotor_whirl import whirl_of

if TYPE_CHECKING:
    from rotorid.reduction.dynamics.small_rotor import SmallRotor

STEPS = 40
"""Into how many steps a range of speeds is divided."""


def stability_threshold(
    small: SmallRotor, highest: float, *, lowest: float = 0.0, steps: int = STEPS
) -> fem.Stability:
    """Find the first speed at which a mode of the small model stops decaying.

    What `fem.stability_threshold` asks of the full rotor, over all motions of the small one.

    Parameters
    ----------
    small
        The small model.
    highest, lowest
        Range of speeds, rad/s: within the tables of all supports.
    steps
        Into how many steps the range is divided; a mode that is unstable only between two neighbouring
        speeds is not seen. The threshold itself is found by iteration, to 1e-10 of it or better.

    Raises
    ------
    ValueError
        For an impossible range, or outside the table of a support.
    """
    return fem.threshold_of(whirl_of(small, fem.range_of_speeds(lowest, highest, steps)))
