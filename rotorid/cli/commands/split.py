"""`rotorid split`: one given weight on holes, at two free angles, or as material taken away."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    emit,
)
from rotorid.cli.output import check_targets

_WAYS = ("--holes", "--two", "--drill", "--grind")
_HOLES, _DRILL, _ROUND = ("--holes",), ("--drill",), ()
_BELONGS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(
        (
            "--first-hole",
            "--pieces",
            "--stock",
            "--per-hole",
            "--most-pieces",
            "--good-enough",
            "--taken",
            "--max-mass",
        ),
        _HOLES,
    ),
    **dict.fromkeys(("--axial", "--depth", "--density", "--tip-angle", "--spacing"), _DRILL),
    "--step": ("--holes", ""),
    "--angle-step": ("",),
}
"""Options that mean something only with one of these ways ("": none of them, one weight)."""


def split(
    vector: Annotated[
        str,
        typer.Argument(
            metavar="VECTOR",
            help="Weight to be added and its angle in degrees, such as 35g@120 or 3500g_mm@120; several "
            "with + between them are added.",
            show_default=False,
        ),
    ],
    holes: Annotated[
        str | None,
        typer.Option(
            metavar="N|DEG,DEG,…",
            help="Number of equally spaced holes, or their angles, ascending.",
            show_default=False,
        ),
    ] = None,
    first_hole: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Angle of hole 1 of equally spaced ones; default: 0.", show_default=False
        ),
    ] = None,
    pieces: Annotated[
        str | None,
        typer.Option(
            metavar="10g,20g", help="Available pieces; without them amounts are free.", show_default=False
        ),
    ] = None,
    stock: Annotated[
        str | None,
        typer.Option(metavar="8,4", help="How many there are of each of the pieces.", show_default=False),
    ] = None,
    per_hole: Annotated[
        int | None,
        typer.Option(metavar="N", help="Pieces in one hole, at most; default: 1.", show_default=False),
    ] = None,
    most_pieces: Annotated[
        int | None, typer.Option(metavar="N", help="Pieces altogether, at most.", show_default=False)
    ] = None,
    good_enough: Annotated[
        float | None,
        typer.Option(metavar="PERCENT", help="Fewest pieces whose error is not larger.", show_default=False),
    ] = None,
    taken: Annotated[
        str | None,
        typer.Option(
            metavar="HOLE:WEIGHT,…",
            help="Holes in which something is mounted already, such as 3:10g,7:20g.",
            show_default=False,
        ),
    ] = None,
    max_mass: Annotated[
        str | None,
        typer.Option(
            metavar="WEIGHT", help="Largest weight of the plane, as a vector sum.", show_default=False
        ),
    ] = None,
    step: Annotated[
        str | None,
        typer.Option(
            metavar="0.5g",
            help="Smallest step of free amounts in holes, or of the scale for one weight.",
            show_default=False,
        ),
    ] = None,
    angle_step: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Step of the angle for one weight.", show_default=False),
    ] = None,
    mounted: Annotated[
        str | None,
        typer.Option(
            metavar="VECTOR",
            help="What is mounted already and counts towards VECTOR, such as 10g@30+20g@200 (trim).",
            show_default=False,
        ),
    ] = None,
    two: Annotated[
        str | None,
        typer.Option(
            metavar="20g,30g", help="Angles of two fixed weights instead of holes.", show_default=False
        ),
    ] = None,
    drill: Annotated[
        str | None,
        typer.Option(
            metavar="DIAMETER",
            help="Drill material away opposite to VECTOR instead, such as 8mm.",
            show_default=False,
        ),
    ] = None,
    grind: Annotated[bool, typer.Option("--grind", help="Grind it off opposite to VECTOR instead.")] = False,
    radius: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Where the masses stand; from where radial holes are drilled, or where axial ones are.",
            show_default=False,
        ),
    ] = None,
    axial: Annotated[
        bool, typer.Option("--axial/--radial", help="Drill along the rotor's axis or towards it.")
    ] = False,
    depth: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH", help="Largest depth of the full diameter, such as 20mm.", show_default=False
        ),
    ] = None,
    density: Annotated[
        float | None,
        typer.Option(metavar="KG/M3", help="Of the material drilled; default: 7850.", show_default=False),
    ] = None,
    tip_angle: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Of the drill; 180 for a flat one; default: 118.", show_default=False
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Between holes in a row, where one would be too deep; default: 1.5 diameters.",
            show_default=False,
        ),
    ] = None,
    angles: Annotated[
        str, typer.Option(metavar="WAY", help='"with rotation" or "against rotation", of all angles.')
    ] = "with rotation",
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Mount one given weight: in holes (exactly the nearest), at two angles, or by drilling or grinding.

    Examples: rotorid split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g

    rotorid split 35g@120 --two 20g,30g

    rotorid split 35g@120 --drill 8mm --depth 20mm --radius 100mm
    """
    from balancing.mounting.hand_mounting import combine, trim
    from rotorid.cli.commands import split_answers as answers
    from rotorid.cli.holes import read_holes
    from rotorid.tables.reader.units import MASS
    from rotorid.workflows.quantities import size, vectors

    options: dict[str, object] = {
        "--holes": holes,
        "--first-hole": first_hole,
        "--pieces": pieces,
        "--stock": stock,
        "--per-hole": per_hole,
        "--most-pieces": most_pieces,
        "--good-enough": good_enough,
        "--taken": taken,
        "--max-mass": max_mass,
        "--step": step,
        "--angle-step": angle_step,
        "--mounted": mounted,
        "--two": two,
        "--drill": drill,
        "--grind": grind or None,
        "--radius": radius,
        "--axial": axial or None,
        "--depth": depth,
        "--density": density,
        "--tip-angle": tip_angle,
        "--spacing": spacing,
    }
    check_targets(plot, output)
    labels, weights = vectors(vector, angles)
    single = len(weights) == 1 and mounted is None and step is None and angle_step is None
    _check_options(options, single)
    target = combine(weights)
    if mounted is not None:
        other, there = vectors(mounted, angles, "--mounted")
        if (labels.weight_unit in MASS) != (other.weight_unit in MASS):
            raise ValueError("--mounted: write it as VECTOR is written, both masses or both unbalances")
        target = trim(target, there)
    if target == 0 and any(options[way] is not None for way in _WAYS):
        raise ValueError("there is nothing to mount: the weight is 0")
    away = None if radius is None else size(radius, "--radius")
    wanted = answers.Wanted(target, labels, away)
    if holes is not None:
        plane = read_holes(
            labels,
            away,
            holes,
            first_hole or 0.0,
            pieces,
            stock,
            1 if per_hole is None else per_hole,
            taken,
            max_mass,
            step,
        )
        answer = answers.on_holes(wanted, plane, most_pieces, good_enough or 0.0)
    elif two is not None:
        answer = answers.at_two_angles(wanted, two)
    elif drill is not None:
        answer = answers.drilled(
            wanted,
            drill,
            axial,
            depth,
            7850.0 if density is None else density,
            118.0 if tip_angle is None else tip_angle,
            spacing,
        )
    elif grind:
        answer = answers.ground(wanted)
    else:
        answer = answers.as_one(wanted, step, angle_step or 0.0)
    emit(
        answer.document,
        answer.text,
        as_json=json,
        files=[],
        options={"vector": vector, **{k.strip("-"): v for k, v in options.items()}, "angles": angles},
        figure=(plot, answer.figure),
        table=(output, answer.table),
    )


def _check_options(options: Mapping[str, object], single: bool) -> None:
    """Exactly one way to mount the weight, and no option that means nothing with it."""
    ways = [name for name in _WAYS if options[name] is not None]
    if len(ways) > 1:
        raise ValueError(f"{' and '.join(ways)} are different ways to mount a weight: give one of them")
    if not ways and single:
        raise ValueError(
            "say how to mount the weight: --holes, --two, --drill or --grind "
            "(or --step, to round it to a scale)"
        )
    way = ways[0] if ways else ""
    for name, belongs in _BELONGS.items():
        if options[name] is not None and way not in belongs:
            needed = " or ".join(w for w in belongs if w)
            how = f"only with {needed}" if needed else f"not with {way}"
            raise ValueError(f"{name} means something {how}")
