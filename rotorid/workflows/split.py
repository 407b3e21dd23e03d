"""`split`: one given weight on holes, at two free angles, as material taken away, or rounded to a scale."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from rotorid.commands.input_checks import changed, refuse
from rotorid.commands.outcome import Delivered, command, provenance
from rotorid.commands.quantities import degrees, option_name, pairs

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing.data.conventions import Labels
    from balancing.mounting.combine_trim_round import Rounded, TwoPositions
    from balancing.mounting.holes import Holes
    from balancing.mounting.material_removal import Drilling, Grinding
    from balancing.mounting.split import OnHoles
    from rotorid.base.answer import Answer
    from rotorid.workflows.option_quantities import Amount, Vector

    Found = OnHoles | TwoPositions | Drilling | Grinding | Rounded
    Mount = Callable[[complex, Labels, float | None, "SplitOptions"], Found]

_WAYS = ("holes", "two", "drill", "grind")
_HOLES = (
    "first_hole",
    "pieces",
    "best",
    "stock",
    "per_hole",
    "most_pieces",
    "good_enough",
    "taken",
    "max_mass",
)
_DRILL = ("axial", "depth", "density", "tip_angle", "spacing")
_BELONGS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_HOLES, ("holes",)),
    **dict.fromkeys(_DRILL, ("drill",)),
    "step": ("holes", ""),
    "angle_step": ("",),
}
"""Options that mean something only with one of these ways ("": none of them, one weight)."""
_APART = 1e-3
"""Degrees between holes that count as one."""


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
        Available pieces; without them amounts are free. The fewest are taken whose error is at most 1.2
        times the least, or a fifth of VECTOR.
    best
        The nearest to VECTOR, however many pieces that takes.
    stock : 8,4
        How many there are of each of the pieces.
    per_hole : N
        Pieces in one hole, at most; default: 1.
    most_pieces : N
        Pieces altogether, at most.
    good_enough : PERCENT
        Fewest pieces whose error is not larger.
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
        Drill material away opposite to VECTOR instead, such as 8mm.
    grind
        Grind it off opposite to VECTOR instead.
    radius : LENGTH
        Where the masses stand; from where radial holes are drilled, or where axial ones are.
    axial
        Drill along the rotor's axis or towards it.
    depth : LENGTH
        Largest depth of the full diameter, such as 20mm.
    density : KG/M3
        Of the material drilled; default: 7850.
    tip_angle : DEG
        Of the drill; 180 for a flat one; default: 118.
    spacing : DEG
        Between holes in a row, where one would be too deep; default: 1.5 diameters.
    angles : WAY
        "with rotation" or "against rotation", of all angles.
    """

    holes: str | int | Sequence[float] | None = None
    first_hole: float | None = None
    pieces: str | Sequence[float] | None = None
    best: bool = False
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
    axial: bool = False
    depth: Amount | None = None
    density: float | None = None
    tip_angle: float | None = None
    spacing: float | None = None
    angles: str = "with rotation"


@dataclass(frozen=True, eq=False, kw_only=True)
class SplitWeight(Delivered):
    """How a weight is mounted: the weight, kg or kg·m with the rotation, and how weights are printed."""

    target: complex
    labels: Labels
    found: Found

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return self.found.to_dict(self.labels)

    @property
    def answer(self) -> Answer:
        """What to mount or to take away."""
        return self.found.answer(self.labels)

    def to_frame(self) -> pd.DataFrame:
        """What is mounted or taken away, place by place."""
        import pandas as pd

        return pd.DataFrame(self.found.rows(self.labels))

    def figure(self) -> Figure:
        """A disc for each solution."""
        from balancing.mounting.combine_trim_round import Rounded, TwoPositions
        from balancing.mounting.material_removal import Drilling
        from balancing.mounting.split import OnHoles
        from balancing.plots.discs import placed

        found, labels, target = self.found, self.labels, self.target
        if isinstance(found, OnHoles):
            return placed(labels, target, holes=found.nearest.holes, mounting=found.nearest.mounting)
        if isinstance(found, TwoPositions):
            return placed(labels, target, *map(tuple, found.weights()))
        if isinstance(found, Rounded):
            return placed(labels, target, (found.weight,) if found.weight else ())
        if not isinstance(found, Drilling):
            return placed(labels, target, (target,), remove=True)
        holes = tuple(found.added(labels))
        words = [f"{1e3 * found.mass:.4g} g\n{1e3 * found.depth:.2f} mm deep"] * len(holes)
        return placed(labels, target, holes, remove=True, words=words)


@command
def split(weight: Vector, options: SplitOptions | None = None) -> SplitWeight:
    """Mount one given weight: in holes (exactly the nearest), at two angles, or by drilling or grinding.

    Parameters
    ----------
    weight
        To be added, and its angle: "35g@120", "3500g_mm@120", several with + between them, or complex, kg.
    options
        The way to mount it, and what belongs to it.

    Raises
    ------
    ValueError
        For a weight or an option that cannot be, or that means nothing with the way that was chosen.
    """
    from balancing.mounting.combine_trim_round import combine, trim
    from rotorid.workflows.option_quantities import size, vectors

    options = options or SplitOptions()
    labels, weights = vectors(weight, options.angles)
    way = _way(options, single=len(weights) == 1)
    target = combine(weights)
    if options.mounted is not None:
        other, there = vectors(options.mounted, options.angles, "--mounted")
        if labels.unbalances != other.unbalances:
            raise ValueError("--mounted: write it as VECTOR is written, both masses or both unbalances")
        target = trim(target, there)
    if target == 0 and way:
        raise ValueError("there is nothing to mount: the weight is 0")
    radius = None if options.radius is None else size(options.radius, "--radius")
    mount: dict[str, Mount] = {
        "holes": _on_holes,
        "two": _at_two_angles,
        "drill": _drilled,
        "grind": _ground,
        "": _rounded,
    }
    return SplitWeight(
        target=target,
        labels=labels,
        found=mount[way](target, labels, radius, options),
        provenance=provenance((), options, vector=weight),
    )


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


def _on_holes(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> OnHoles:
    from balancing.mounting.fewest_pieces import FEW
    from balancing.mounting.split import split_on_holes

    good_enough = options.good_enough or 0.0
    if not 0 <= good_enough <= 100:
        raise ValueError(f"--good-enough: {good_enough:g} is no error from 0 to 100 percent")
    holes = _holes(labels, radius, options)
    if options.best and good_enough:
        raise ValueError("--best takes the nearest, --good-enough the fewest pieces: give one of them")
    within = 1.0 if options.best else FEW
    most = options.most_pieces
    return split_on_holes(target, holes, most_pieces=most, good_enough=good_enough / 100, within=within)


def _at_two_angles(
    target: complex, labels: Labels, radius: float | None, options: SplitOptions
) -> TwoPositions:
    from balancing.mounting.combine_trim_round import two_positions
    from rotorid.workflows.option_quantities import weights

    assert options.two is not None
    masses = weights(options.two, "--two", labels, radius)
    if len(masses) != 2:
        raise ValueError(f"--two {options.two!r}: give two weights, such as 20g,30g")
    scale, unit = labels.weight_scale, labels.weight_in
    size, low, high = abs(target), abs(masses[0] - masses[1]), sum(masses)
    if not low * (1 - 1e-12) <= size <= high * (1 + 1e-12):
        raise ValueError(
            f"--two: {masses[0] * scale:g} and {masses[1] * scale:g} {unit} together make from "
            f"{low * scale:g} to {high * scale:g} {unit}, not {size * scale:g} {unit}; use other weights"
        )
    return two_positions(target, *masses)


def _unbalance(target: complex, labels: Labels, radius: float | None, why: str) -> tuple[complex, float]:
    """The wanted unbalance, kg·m, and the radius, m, which is needed."""
    if radius is None:
        raise ValueError(f"{why} needs --radius, such as --radius 100mm")
    return (target if labels.unbalances else target * radius), radius


def _drilled(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> Drilling:
    import numpy as np

    from balancing.mounting.material_removal import Drill, drill_holes
    from rotorid.workflows.option_quantities import size

    unbalance, at = _unbalance(target, labels, radius, "--drill")
    assert options.drill is not None
    tool = Drill(
        size(options.drill, "--drill", "8mm"),
        at,
        7850.0 if options.density is None else options.density,
        "axial" if options.axial else "radial",
        float(np.radians(118.0 if options.tip_angle is None else options.tip_angle)),
    )
    return drill_holes(
        unbalance,
        tool,
        max_depth=np.inf if options.depth is None else size(options.depth, "--depth", "20mm"),
        spacing=None if options.spacing is None else float(np.radians(options.spacing)),
    )


def _ground(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> Grinding:
    from balancing.mounting.material_removal import grind

    return grind(*_unbalance(target, labels, radius, "--grind"))


def _rounded(target: complex, labels: Labels, radius: float | None, options: SplitOptions) -> Rounded:
    import numpy as np

    from balancing.mounting.combine_trim_round import rounded
    from rotorid.workflows.option_quantities import weight

    angle = options.angle_step or 0.0
    if not 0 <= angle <= 360:
        raise ValueError(f"--angle-step: {angle:g} is no step of an angle, 0 to 360 degrees")
    step = 0.0 if options.step is None else weight(options.step, "--step", labels, radius, "0.5g")
    # steps count from the job's 0° either way, so the sign of the angle does not matter
    return rounded(target, step, float(np.radians(angle)))


def _holes(labels: Labels, radius: float | None, options: SplitOptions) -> Holes:
    """The holes of the plane.

    Raises
    ------
    ValueError
        Naming the option and what is wrong with it.
    """
    import numpy as np

    from balancing.mounting.holes import equal_holes, from_list
    from rotorid.workflows.option_quantities import weight, weights

    given = options.holes
    if given is None or isinstance(given, int) or (isinstance(given, str) and "," not in given):
        first = options.first_hole or 0.0
        count = str(given).strip()
        if not (count.isascii() and count.isdecimal() and 1 <= int(count) <= 1000):
            raise ValueError(
                f"--holes {given!r}: give the number of equally spaced holes, 1 to 1000, or their angles, "
                "such as 0,30,75"
            )
        counted = equal_holes(int(count), np.radians(degrees(first, "--first-hole")))
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
    found = [degrees(part, "--holes") for part in parts]
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


def _whole(given: str | Sequence[int]) -> list[int]:
    if not isinstance(given, str):
        return list(given)
    parts = [part.strip() for part in given.split(",")]
    if not all(part.isascii() and part.isdecimal() and len(part) < 10 for part in parts):
        raise ValueError(f"--stock {given!r}: give a whole number for each of the pieces, such as 8,4")
    return [int(part) for part in parts]
