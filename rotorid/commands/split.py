"""`split`: one given weight in holes, as two fixed weights, in two planes along the shaft, or drilled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar

from rotorid.commands.option_units import length, positions, size, vectors, weight, weights
from rotorid.commands.option_values import degrees, pairs
from rotorid.report.options import changed, refuse
from rotorid.report.outcome import Outcome, command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Holes, Labels
    from balancing.one_weight import OneWeight
    from rotorid.commands.option_units import Amount, Positions, Vector

_WAYS = ("holes", "two", "drill", "planes")
_OF_HOLES = ("pieces", "per_hole", "taken")
_APART, _MOST = 1e-3, 1000
"""Degrees between holes that count as one; holes at most."""
GOOD_ENOUGH = 0.2
"""The fewest pieces whose error is at most this, or at most 1.2 times the least."""


@dataclass(frozen=True)
class SplitOptions:
    """Options of `split`: angles in degrees.

    Attributes
    ----------
    holes : N|DEG,DEG,…
        Number of equally spaced holes from 0°, or the angles of holes, ascending.
    pieces : 10g,20g
        Available pieces; without them amounts are free.
    per_hole : N from 1
        Pieces in one hole, at most; default: 1.
    taken : HOLE:WEIGHT,…
        Holes in which something is mounted already, such as 3:10g,7:20g.
    two : 20g,30g
        Angles of two fixed weights instead of holes.
    drill : DIAMETER
        Drill one radial hole in steel opposite to VECTOR instead, such as 8mm.
    planes : PLANE=POSITION,PLANE=POSITION
        Share it between two planes along the shaft.
    at : POSITION,…
        Where it is, or each of several, along the shaft; of one at two positions: a couple, opposite at the
        second.
    radius : LENGTH
        Where the masses stand; the surface that is drilled.
    angles : WAY
        "with rotation" or "against rotation", of all angles.
    """

    holes: str | int | Sequence[float] | None = None
    pieces: str | Sequence[float] | None = None
    per_hole: int | None = None
    taken: str | Mapping[str, float] | None = None
    two: str | Sequence[float] | None = None
    drill: Amount | None = None
    planes: Positions | None = None
    at: str | Sequence[float] | None = None
    radius: Amount | None = None
    angles: str = "with rotation"
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "radius angles",
        "Holes": "holes pieces per_hole taken",
        "Instead of holes": "two drill planes at",
    }
    to = ("plot", "json")


@command
def split(vector: Vector, options: SplitOptions | None = None) -> Outcome:
    """Mount one given weight: in holes, as two weights, in two planes, or by drilling.

    Example: rotorid split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g

    Example: rotorid split 35g@120 --two 20g,30g

    Example: rotorid split 3g@120 --drill 8mm --radius 100mm

    Example: rotorid split 35g@120 --at 250mm --planes left=100mm,right=600mm

    Parameters
    ----------
    vector : VECTOR
        Weight to be added and its angle in degrees, such as 35g@120 or 3500g_mm@120; several with + between
        them are added.
    options
        The way to mount it, and what belongs to it.

    Raises
    ------
    ValueError
        For a weight or an option that cannot be, or that means nothing with the way that was chosen.
    """
    from balancing.one_weight import Split, combine

    options = options or SplitOptions()
    labels, each = vectors(vector, options.angles)
    ways = [name for name in _WAYS if name in changed(options)]
    if len(ways) != 1:
        raise ValueError("say how to mount the weight, in one way: --holes, --two, --planes or --drill")
    if ways != ["holes"]:
        refuse(options, _OF_HOLES, "means something only with --holes")
    if ways != ["planes"]:
        refuse(options, ("at",), "means something only with --planes")
    target = combine(each)
    if target == 0 and ways != ["planes"]:
        raise ValueError("there is nothing to mount: the weight is 0")
    radius = None if options.radius is None else size(options.radius, "--radius")
    how = {"holes": _in_holes, "two": _at_two_angles, "drill": _drilled}.get(ways[0])
    placed = how(target, labels, radius, options) if how else _in_planes(each, options)
    return Outcome(
        result=placed,
        sentences=(placed.sentence(labels), *(placed.lines(labels) if isinstance(placed, Split) else ())),
        file="there is no table of one weight: see to_dict()",
        keys=placed.to_dict(labels),
        pictures={"": lambda: _figure(placed, labels, target)},
    )


def _in_holes(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> OneWeight:
    from balancing.one_weight import split as in_holes

    return in_holes(target, _holes(labels, radius, options), good_enough=GOOD_ENOUGH)


def _at_two_angles(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> OneWeight:
    from balancing.one_weight import two_positions

    masses = weights(options.two or "", "--two", labels, radius)
    if len(masses) != 2:
        raise ValueError(f"--two {options.two!r}: give two weights, such as 20g,30g")
    try:
        return two_positions(target, *masses)
    except ValueError:
        low, high = map(labels.weight_words, (abs(masses[0] - masses[1]), sum(masses)))
        wanted = labels.weight_words(abs(target))
        raise ValueError(
            f"--two: these together make from {low} to {high}, not {wanted}; use other weights"
        ) from None


def _in_planes(given: list[complex], options: SplitOptions) -> OneWeight:
    from balancing.one_weight import TwoPlanes

    planes = positions(options.planes or "")
    places = {name: place for name, place in planes.items() if place is not None}
    if len(planes) != 2 or len({*places.values()}) != 2:
        raise ValueError("--planes needs two at different positions, such as left=100mm,right=600mm")
    parts = options.at.split(",") if isinstance(options.at, str) else options.at or ()
    at = tuple(length(part, "--at", "250mm") for part in parts)
    if (len(given), len(at)) == (1, 2):
        given = [given[0], -given[0]]
    if len(at) != len(given):
        raise ValueError(
            f"--at needs the position of each weight, {len(given)} in all; of one weight two make a couple"
        )
    return TwoPlanes(tuple(given), at, tuple(places), tuple(places.values()))


def _drilled(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> OneWeight:
    from balancing.one_weight import drill

    if radius is None:
        raise ValueError("--drill needs --radius, such as --radius 100mm")
    unbalance = target * (1.0 if labels.unbalances else radius)
    return drill(unbalance, radius, size(options.drill or "", "--drill", "8mm"))


def _holes(labels: Labels, radius: float | None, options: SplitOptions) -> Holes:
    """The holes of the plane.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    import numpy as np

    from balancing import equal_holes, from_list

    given = options.holes or ""
    if isinstance(given, int) or (isinstance(given, str) and given.strip().isdecimal()):
        if not 1 <= int(given) <= _MOST:
            raise ValueError(f"--holes {given}: give the number of equally spaced holes, 1 to {_MOST}")
        angles = equal_holes(int(given))
    else:
        angles = np.radians(_listed(given))
    taken: dict[str, str | float] = pairs(
        options.taken or {}, "--taken", lambda _, text: text, "3:10g", sign=":"
    )
    numbers = list(map(str, range(1, len(angles) + 1)))
    if wrong := taken.keys() - numbers:
        raise ValueError(f"--taken: {min(wrong)!r} is not the number of a hole, 1 to {len(angles)}")
    there = [weight(taken[k], "--taken", labels, radius, "3:10g") if k in taken else 0.0 for k in numbers]
    return from_list(
        labels.with_rotation(angles),
        () if options.pieces is None else weights(options.pieces, "--pieces", labels, radius),
        per_hole=options.per_hole or 1,
        taken=there,
    )


def _listed(given: str | Sequence[float]) -> list[float]:
    """Angles of holes, degrees: ascending within one turn, so that their numbers are those on the rotor."""
    parts = given.split(",") if isinstance(given, str) else given
    angles = [degrees(part, "--holes") for part in parts]
    if angles[-1] - angles[0] > 360 - _APART or any(b - a < _APART for a, b in pairwise(angles)):
        raise ValueError(
            f"--holes {given!r}: list each hole once, in the order of their angles, within one turn; or give "
            "the number of equally spaced ones"
        )
    return angles


def _figure(placed: OneWeight, labels: Labels, target: complex) -> Figure:
    """A disc for each solution."""
    from balancing.one_weight import Split, TwoPlanes, TwoPositions
    from balancing.plots import weight_figure

    if isinstance(placed, Split):
        return weight_figure(labels, target, holes=placed.holes, mounting=placed.mounting)
    if isinstance(placed, TwoPositions):
        return weight_figure(labels, target, *map(tuple, placed.weights()))
    if isinstance(placed, TwoPlanes):
        each = ((weight,) for weight in placed.weights().tolist())
        return weight_figure(labels, target, *each, titles=placed.planes)
    return weight_figure(labels, target, (target,), remove=True)
