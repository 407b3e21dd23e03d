"""Holes of one plane as the command line writes them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from balancing.data.conventions import Labels
from balancing.mounting.holes import Holes, equal_holes, from_list
from rotorid.workflows.parameters import degrees
from rotorid.workflows.quantities import weight, weights

_APART = 1e-3
"""Degrees between holes that count as one."""


def read_holes(
    labels: Labels,
    radius: float | None,
    holes: str,
    first: float,
    pieces: str | None,
    stock: str | None,
    per_hole: int,
    taken: str | None,
    max_mass: str | None,
    step: str | None,
) -> Holes:
    """The holes of the command line.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    sign = labels.angle_sign
    if "," in holes:
        angles = sign * np.radians(_listed(holes))
    else:
        count = holes.strip()
        if not (count.isascii() and count.isdecimal() and 1 <= int(count) <= 1000):
            raise ValueError(
                f"--holes {holes!r}: give the number of equally spaced holes, 1 to 1000, or their angles, "
                "such as 0,30,75"
            )
        if not -360 <= first <= 360:
            raise ValueError(f"--first-hole: {first:g} is no angle from -360 to 360 degrees")
        angles = equal_holes(int(count), sign * np.radians(first), sign)
    if pieces is not None and step is not None:
        raise ValueError("give either --pieces or a --step of free amounts, not both")
    mounted = np.zeros(len(angles))
    for part in [] if taken is None else taken.split(","):
        name, colon, text = part.partition(":")
        if not (colon and name.strip().isdecimal() and 1 <= int(name) <= len(angles)):
            raise ValueError(
                f"--taken {part.strip()!r}: write the number of a hole, 1 to {len(angles)}, and the weight "
                "in it, such as 3:10g"
            )
        if mounted[int(name) - 1]:
            raise ValueError(f"--taken: hole {int(name)} is listed twice")
        mounted[int(name) - 1] = weight(text, "--taken", labels, radius, "3:10g")
    return from_list(
        angles,
        () if pieces is None else weights(pieces, "--pieces", labels, radius),
        per_hole=per_hole,
        step=0.0 if step is None else weight(step, "--step", labels, radius, "0.5g"),
        taken=mounted,
        stock=None if stock is None else _whole(stock),
        max_weight=np.inf if max_mass is None else weight(max_mass, "--max-mass", labels, radius),
    )


def _listed(text: str) -> list[float]:
    """Angles of holes, degrees: ascending within one turn, so that their numbers are those on the rotor."""
    found = [degrees(part, "--holes") for part in text.split(",")]
    for number, (one, following) in enumerate(pairwise(found), start=1):
        if abs(following - one) < _APART:
            raise ValueError(f"--holes: {following:g}° is listed twice; list each hole once")
        if following < one:
            raise ValueError(
                f"--holes: {following:g}° stands after {one:g}°; list the holes in the order of their angles "
                f"(hole {number + 1} would not be where its number says)"
            )
    if found[-1] - found[0] > 360 - _APART:
        raise ValueError(
            f"--holes: {found[0]:g}° and {found[-1]:g}° are a full turn or more apart; list each hole once, "
            "within one turn"
        )
    return found


def _whole(text: str) -> list[int]:
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isascii() and part.isdecimal() and len(part) < 10 for part in parts):
        raise ValueError(f"--stock {text!r}: give a whole number for each of the pieces, such as 8,4")
    return [int(part) for part in parts]
