"""A rotor and its small model together, as tests compare them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import fem
from rotorid import reduction


class Pair(NamedTuple):
    """A rotor and its small model."""

    rotor: fem.Rotor
    small: reduction.SmallModel

    def eigenvalues(self, speed: float = 0.0) -> Any:
        """All finite eigenvalues of the small model at a speed, 1/s."""
        return fem.state_space(self.small.motion(speed), inputs=(), outputs=()).eigenvalues


def small_rotor(rotor: fem.Rotor, nodes: Any, masses: Any, **how: Any) -> Pair:
    """The rotor with masses at some nodes."""
    return Pair(rotor, reduction.small_model(rotor, nodes, masses, **how))


def compare_response(pair: Pair, *speeds: Any, **how: Any) -> reduction.ResponseCost:
    """Response of both."""
    return reduction.compare_response(*pair, *speeds, **how)


def compare_stability(pair: Pair, highest: float, **how: Any) -> reduction.StabilityCost:
    """Stability of both."""
    return reduction.compare_stability(*pair, highest, **how)


def stability_threshold(pair: Pair, highest: float, lowest: float = 0.0, steps: int = 40) -> fem.Stability:
    """Of the small model."""
    return fem.threshold_of(pair.small.whirl(fem.range_of_speeds(lowest, highest, steps)))


def whirl_of(pair: Pair, speeds: np.ndarray) -> fem.Whirl:
    """Of the small model."""
    return pair.small.whirl(speeds)
