"""Whether a correction makes a mode worse that no reading shows: by a rotor model, where that is sure.

Readings y = A u of an unbalance u, spread along the shaft, determine only some of u. With independent
normal unbalances of one size at all nodes what else it may be is drawn as it is after the readings,
u + A⁺ (y − A u); their size is that of y, as one reading tells it (χ²). The readings are taken at their word:
what they err by is in the weights as well, and goes with them. Near its critical speed a mode reads b u, and
b u + b D with the weights mounted. It is worse where that is the larger one in at least 95 of 100 draws. Gain
and phase between model and machine are those that make its coefficients the job's; a model that does not
agree with these says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from balancing.regions import LEVEL

if TYPE_CHECKING:
    from balancing.influence import Influence
    from balancing.prediction import Outlook
    from rotorid.base.arrays import FloatArray

DRAWS = 2000
BESIDE = 0.98
"""Of a critical speed: where damping is small, a mode reads much there, and not without bound."""
SEEN = 1e-3
"""Effect of an unbalance, of the largest, that readings tell."""
AGREES = 0.95
"""Correlation of the model's coefficients with those of the job."""


def mode_made_worse(
    outlook: Outlook,
    model: Callable[[Mapping[str, int], FloatArray], Influence],
    nodes: Mapping[str, int],
    levers: Mapping[str, float],
    count: int,
    critical: float,
) -> tuple[str, ...]:
    """A sentence about the mode of a critical speed, which weights make worse by the model, or none.

    Parameters
    ----------
    outlook
        Weights, and the readings that they are made of.
    model
        Coefficients per unbalance of the same sensors, of nodes by name, at speeds in rad/s.
    nodes
        Of each plane.
    levers
        m, of planes whose weights are masses.
    count
        How many nodes there are.
    critical
        rad/s, beyond all readings.

    Returns
    -------
    One sentence; none where fewer than 95 of 100 rotors that read the same get worse.
    """
    shaft = {str(node): node for node in range(1, count + 1)}
    W = model(shaft, np.append(outlook.speeds, BESIDE * critical)).W
    planes = W[..., [nodes[plane] - 1 for plane in outlook.planes]]
    planes = planes * [levers.get(plane, 1.0) for plane in outlook.planes]
    here, there = planes[:-1].ravel(), outlook.influence.W.ravel()
    common = np.vdot(here, there)
    if abs(common) < AGREES * np.linalg.norm(here) * np.linalg.norm(there) or not outlook.weights.any():
        return ()
    W = W * common / np.linalg.norm(here) ** 2
    A, b, y = W[:-1].reshape(-1, count), W[-1], outlook.before.ravel()
    added = planes[-1] @ outlook.weights * common / np.linalg.norm(here) ** 2
    rng = np.random.default_rng(0)
    u = rng.standard_normal((DRAWS, count, 2)) @ [1, 1j] * np.linalg.norm(y) / np.linalg.norm(A)
    u = u / np.sqrt(rng.chisquare(2, (DRAWS, 1)))
    u = u + (y - u @ A.T) @ np.linalg.pinv(A, SEEN).T
    ratio = np.linalg.norm(u @ b.T + added, axis=1) / np.linalg.norm(u @ b.T, axis=1)
    share = np.mean(ratio > 1)
    if share < LEVEL:
        return ()
    at, many = outlook.labels.speed_words(critical), f"{100 * share:.0f} of 100 rotors"
    return (
        f"But by the rotor model these weights make the mode at {at} worse, if the machine runs up to it: by "
        f"{np.median(ratio):.2g} times, in {many} that read the same here.",
    )
