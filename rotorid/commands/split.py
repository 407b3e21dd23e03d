"""`split`: one given weight in holes, at two free angles, as material taken away, or rounded to a scale."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rotorid.base.tables import Column, Table
from rotorid.commands.option_quantities import size, vectors, weight, weights
from rotorid.commands.quantities import degrees, option_name, pairs
from rotorid.report.options import changed, refuse
from rotorid.report.outcome import USUAL, Outcome, command, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Holes, Labels
    from balancing.one_weight import OneWeight
    from rotorid.commands.option_quantities import Amount, Vector

_WAYS = ("holes", "two", "drill", "grind")
_HOLES = (
    "first_hole",
    "pieces",
    "stock",
    "per_hole",
    "most_pieces",
    "good_enough",
    "taken",
    "max_mass",
)
_BELONGS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_HOLES, ("holes",)),
    "density": ("drill",),
    "step": ("holes", ""),
    "angle_step": ("",),
}
"""Options that mean something only with one of these ways ("": none of them, one weight)."""
_APART = 1e-3
"""Degrees between holes that count as one."""
_GOOD_ENOUGH = 20.0


@dataclass(frozen=True)
class SplitOptions:
    """Options of `split`: angles in degrees, `good_enough` in percent, `density` in kg/m³.

    Attributes
    ----------
    holes : N|DEG,DEG,…
        Number of equally spaced holes, or their angles, ascending.
    first_hole : DEG
        Angle of hole 1 of equally spaced ones; default: 0.
    pieces : 10g,20g
        Available pieces; without them amounts are free.
    stock : 8,4
        How many there are of each of the pieces.
    per_hole : N
        Pieces in one hole, at most; default: 1.
    most_pieces : N
        Pieces altogether, at most.
    good_enough : PERCENT
        The fewest pieces whose error is at most this, or at most 1.2 times the least; 0 for the nearest;
        default: 20.
    taken : HOLE:WEIGHT,…
        Holes in which something is mounted already, such as 3:10g,7:20g.
    max_mass : WEIGHT
        Largest weight of the plane, as a vector sum.
    step : 0.5g
        Smallest step of free amounts in holes, or of the scale for one weight.
    angle_step : DEG
        Step of the angle for one weight.
    mounted : VECTOR
        What is mounted already and counts towards VECTOR, such as 10g@30+20g@200 (trim).
    two : 20g,30g
        Angles of two fixed weights instead of holes.
    drill : DIAMETER
        Drill one radial hole opposite to VECTOR instead, such as 8mm.
    grind
        Grind it off opposite to VECTOR instead.
    radius : LENGTH
        Where the masses stand; the surface that is drilled.
    density : KG/M3
        Of the material drilled; default: 7850.
    angles : WAY
        "with rotation" or "against rotation", of all angles.
    """

    holes: str | int | Sequence[float] | None = None
    first_hole: float | None = None
    pieces: str | Sequence[float] | None = None
    stock: str | Sequence[int] | None = None
    per_hole: int | None = None
    most_pieces: int | None = None
    good_enough: float | None = None
    taken: str | Mapping[str, float] | None = None
    max_mass: Amount | None = None
    step: Amount | None = None
    angle_step: float | None = None
    mounted: Vector | None = None
    two: str | Sequence[float] | None = None
    drill: Amount | None = None
    grind: bool = False
    radius: Amount | None = None
    density: float | None = None
    angles: str = "with rotation"
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "mounted radius angles",
        "Holes": "holes pieces stock per_hole first_hole taken most_pieces good_enough",
        "Limits and steps": "max_mass step angle_step",
        "Instead of holes": "two drill density grind",
    }
    to: ClassVar[Sequence[str]] = USUAL


@command
def split(vector: Vector, options: SplitOptions | None = None) -> Outcome:
    """Mount one given weight: in holes, at two angles, or by drilling or grinding.

    Example: rotorid split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g

    Example: rotorid split 35g@120 --two 20g,30g

    Example: rotorid split 3g@120 --drill 8mm --radius 100mm

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
    way = _way(options, single=len(each) == 1)
    if options.mounted is not None:
        other, there = vectors(options.mounted, options.angles, "--mounted")
        if labels.unbalances != other.unbalances:
            raise ValueError("--mounted: write it as VECTOR is written, both masses or both unbalances")
        each = [*each, *(-weight for weight in there)]
    target = combine(each)
    if target == 0 and way:
        raise ValueError("there is nothing to mount: the weight is 0")
    radius = None if options.radius is None else size(options.radius, "--radius")
    how: Callable[[_Wanted], OneWeight] = {
        "holes": _in_holes,
        "two": _at_two_angles,
        "drill": _removed,
        "grind": _removed,
        "": _rounded,
    }[way]
    placed = how(_Wanted(target, labels, radius, options))
    keys = placed.to_dict(labels)
    rows, below = _rows(keys), placed.lines(labels) if isinstance(placed, Split) else []
    return Outcome(
        result=placed,
        sentences=(placed.sentence(labels), *below),
        tables=(),
        file=Table("weight", tuple(Column(name, [row[name] for row in rows]) for name in rows[0])),
        keys=keys,
        pictures={"": lambda: _figure(placed, labels, target)},
        provenance=provenance((), options, vector=vector),
    )


class _Wanted(NamedTuple):
    """A weight, how it is printed, and where it stands (m; None: nobody says)."""

    target: complex
    labels: Labels
    radius: float | None
    options: SplitOptions


def _way(options: SplitOptions, *, single: bool) -> str:
    """The one way to mount the weight ("": as one weight); no option may mean nothing with it."""
    given = changed(options)
    ways = [name for name in _WAYS if name in given]
    if len(ways) > 1:
        raise ValueError(
            f"{' and '.join(map(option_name, ways))} are different ways to mount a weight: give one of them"
        )
    if not ways and single and given.keys().isdisjoint(("mounted", "step", "angle_step")):
        raise ValueError(
            "say how to mount the weight: --holes, --two, --drill or --grind "
            "(or --step, to round it to a scale)"
        )
    way = ways[0] if ways else ""
    for name, belongs in _BELONGS.items():
        if way not in belongs:
            needed = " or ".join(option_name(one) for one in belongs if one)
            how = f"only with {needed}" if needed else f"not with {option_name(way)}"
            refuse(options, (name,), f"means something {how}")
    return way


def _in_holes(wanted: _Wanted) -> OneWeight:
    from balancing.one_weight import split as in_holes

    options = wanted.options
    good_enough = _GOOD_ENOUGH if options.good_enough is None else options.good_enough
    if not 0 <= good_enough <= 100:
        raise ValueError(f"--good-enough: {good_enough:g} is no error from 0 to 100 percent")
    return in_holes(
        wanted.target, _holes(wanted), most_pieces=options.most_pieces, good_enough=good_enough / 100
    )


def _at_two_angles(wanted: _Wanted) -> OneWeight:
    from balancing.one_weight import two_positions

    labels, target, given = wanted.labels, abs(wanted.target), wanted.options.two
    assert given is not None
    masses = weights(given, "--two", labels, wanted.radius)
    if len(masses) != 2:
        raise ValueError(f"--two {given!r}: give two weights, such as 20g,30g")
    low, high = abs(masses[0] - masses[1]), sum(masses)
    if not low * (1 - 1e-12) <= target <= high * (1 + 1e-12):
        words = [labels.weight_words(weight) for weight in (low, high, target)]
        raise ValueError(
            f"--two: these together make from {words[0]} to {words[1]}, not {words[2]}; use other weights"
        )
    return two_positions(wanted.target, *masses)


def _removed(wanted: _Wanted) -> OneWeight:
    from balancing.one_weight import STEEL, drill, grind

    options, radius = wanted.options, wanted.radius
    if radius is None:
        way = "--grind" if options.drill is None else "--drill"
        raise ValueError(f"{way} needs --radius, such as --radius 100mm")
    unbalance = wanted.target * (1.0 if wanted.labels.unbalances else radius)
    if options.drill is None:
        return grind(unbalance, radius)
    diameter = size(options.drill, "--drill", "8mm")
    return drill(unbalance, radius, diameter, STEEL if options.density is None else options.density)


def _rounded(wanted: _Wanted) -> OneWeight:
    import numpy as np

    from balancing.one_weight import rounded

    options, angle = wanted.options, wanted.options.angle_step or 0.0
    if not 0 <= angle <= 360:
        raise ValueError(f"--angle-step: {angle:g} is no step of an angle, 0 to 360 degrees")
    step = 0.0
    if options.step is not None:
        step = weight(options.step, "--step", wanted.labels, wanted.radius, "0.5g")
    # steps count from the job's 0° either way, so the sign of the angle does not matter
    return rounded(wanted.target, step, float(np.radians(angle)))


def _holes(wanted: _Wanted) -> Holes:
    """The holes of the plane.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    import numpy as np

    from balancing import equal_holes, from_list

    _, labels, radius, options = wanted
    given = options.holes
    if given is None or isinstance(given, int) or (isinstance(given, str) and "," not in given):
        count = str(given).strip()
        if not (count.isascii() and count.isdecimal() and 1 <= int(count) <= 1000):
            raise ValueError(
                f"--holes {given!r}: give the number of equally spaced holes, 1 to 1000, or their angles, "
                "such as 0,30,75"
            )
        counted = equal_holes(int(count), np.radians(degrees(options.first_hole or 0.0, "--first-hole")))
    else:
        counted = np.radians(_listed(given))
    angles = labels.with_rotation(counted)
    if options.pieces is not None and options.step is not None:
        raise ValueError("give either --pieces or a --step of free amounts, not both")
    mounted = np.zeros(len(angles))
    numbers = {str(h): h - 1 for h in range(1, len(angles) + 1)}
    taken: dict[str, str | float] = pairs(
        options.taken or {}, "--taken", lambda _, text: text, "3:10g", sign=":"
    )
    for name, amount in taken.items():
        if name not in numbers:
            raise ValueError(f"--taken: {name!r} is not the number of a hole, 1 to {len(angles)}")
        mounted[numbers[name]] = weight(amount, "--taken", labels, radius, "3:10g")
    most, step = options.max_mass, options.step
    return from_list(
        angles,
        () if options.pieces is None else weights(options.pieces, "--pieces", labels, radius),
        per_hole=1 if options.per_hole is None else options.per_hole,
        step=0.0 if step is None else weight(step, "--step", labels, radius, "0.5g"),
        taken=mounted,
        stock=None if options.stock is None else _whole(options.stock),
        max_weight=np.inf if most is None else weight(most, "--max-mass", labels, radius),
    )


def _listed(given: str | Sequence[float]) -> list[float]:
    """Angles of holes, degrees: ascending within one turn, so that their numbers are those on the rotor."""
    parts = given.split(",") if isinstance(given, str) else given
    angles = [degrees(part, "--holes") for part in parts]
    if angles[-1] - angles[0] > 360 - _APART or any(b - a < _APART for a, b in pairwise(angles)):
        raise ValueError(
            f"--holes {given!r}: list each hole once, in the order of their angles, within one turn"
        )
    return angles


def _whole(given: str | Sequence[int]) -> list[int]:
    if not isinstance(given, str):
        return list(given)
    parts = [part.strip() for part in given.split(",")]
    if not all(part.isascii() and part.isdecimal() and len(part) < 10 for part in parts):
        raise ValueError(f"--stock {given!r}: give a whole number for each of the pieces, such as 8,4")
    return [int(part) for part in parts]


def _rows(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What is mounted or taken away, place by place."""
    mass, method = f"mass_{found['unit']}", found["method"]
    if method == "holes":
        return [
            {"hole": row["hole"], "angle_deg": row["angle_deg"], mass: row["mass"], "pieces": _pieces(row)}
            for row in found["holes"]
        ]
    if method == "two positions":
        return [
            {"solution": k, "angle_deg": angle, mass: size}
            for k, solution in enumerate(found["solutions"], start=1)
            for angle, size in zip(solution["angles_deg"], found["masses"], strict=True)
        ]
    if method in ("drilling", "grinding"):
        grams, radius = 1e3 * found["mass_kg"], 1e3 * found["radius_m"]
        depth = {"depth_mm": 1e3 * found["depth_m"]} if method == "drilling" else {}
        return [{"angle_deg": found["angle_deg"], "mass_g": grams, "radius_mm": radius, **depth}]
    return [{"angle_deg": found["weight"]["angle_deg"], mass: found["weight"]["mass"]}]


def _pieces(row: Mapping[str, Any]) -> str:
    return " + ".join(f"{one['count']} × {one['mass']:g}" for one in row["pieces"])


def _figure(placed: OneWeight, labels: Labels, target: complex) -> Figure:
    """A disc for each solution."""
    from balancing.one_weight import Removal, Rounded, Split, TwoPositions
    from balancing.plots import weight_figure

    if isinstance(placed, Split):
        return weight_figure(labels, target, holes=placed.holes, mounting=placed.mounting)
    if isinstance(placed, TwoPositions):
        return weight_figure(labels, target, *map(tuple, placed.weights()))
    if isinstance(placed, Rounded):
        return weight_figure(labels, target, (placed.weight,) if placed.weight else ())
    assert isinstance(placed, Removal)
    return weight_figure(labels, target, (target,), remove=True)
