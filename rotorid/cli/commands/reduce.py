"""`rotorid reduce`: a rotor as a few masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, ReportOption
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.reduce import Normalise, Place, ReduceOptions, Rows, View, choices
from rotorid.workflows.reduce import reduce as work

if TYPE_CHECKING:
    from rotorid.workflows.reduced_rotor import ReducedRotor


def reduce(
    rotor: Annotated[
        Path | None,
        typer.Argument(
            metavar="[ROTOR]",
            help="Rotor table (.csv, .xlsx) or rotor file (.toml); not needed with --compliance.",
        ),
    ] = None,
    nodes: Annotated[
        str | None, typer.Option("--nodes", help="Where the masses stand: nodes or stations, 7,12,18.")
    ] = None,
    place: Annotated[
        Place | None,
        typer.Option(
            "--place",
            help="Instead of --nodes, of all places: best by frequency, best by MAC, a compromise, or the "
            "book's rule (extrema of the first two modes).",
        ),
    ] = None,
    masses: Annotated[
        int | None, typer.Option("--masses", min=1, help="How many masses --place and --rank set; default 3.")
    ] = None,
    modes: Annotated[
        int | None, typer.Option("--modes", min=1, help="How many modes the regression uses; default 2.")
    ] = None,
    normalise: Annotated[
        Normalise,
        typer.Option(
            "--normalise",
            help="Shapes scaled to 1 at the first mass (the book), at their largest, or in length.",
        ),
    ] = ReduceOptions.normalise,
    rows: Annotated[
        Rows,
        typer.Option(
            "--rows",
            help="Rows of the regression as they stand (the book: the first mode dominates), or of each mode "
            "relative to its 1/ω².",
        ),
    ] = ReduceOptions.rows,
    nonnegative: Annotated[bool, typer.Option("--nonnegative", help="No mass below 0.")] = False,
    supports_apart: Annotated[
        bool,
        typer.Option("--supports-apart", help="Compliance of the shaft and its two bearings apart, (47)."),
    ] = False,
    measured: Annotated[
        Path | None,
        typer.Option(
            "--measured",
            metavar="FILE",
            help="Measured modes (mode, frequency_rad_s, node, shape), used instead of computed ones.",
        ),
    ] = None,
    compliance: Annotated[
        Path | None,
        typer.Option(
            "--compliance",
            metavar="FILE",
            help="Without a rotor: table node, force_node, compliance_m_per_N, with --measured.",
        ),
    ] = None,
    seals: Annotated[
        str | None,
        typer.Option(
            "--seals",
            metavar="LIST",
            help="With --compliance: springs to the ground that it does not hold, N/m, 12=2e6.",
        ),
    ] = None,
    errors: Annotated[
        str | None,
        typer.Option(
            "--errors",
            metavar="LIST",
            help="Standard deviations of the inputs in percent: compliance=1.3,shapes=1,frequencies=0.1.",
        ),
    ] = None,
    what_if: Annotated[
        str | None,
        typer.Option(
            "--what-if", metavar="LIST", help="What changes of inputs do, in percent: alpha12=1.3,U31=-0.3."
        ),
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(
            "--speed",
            metavar="SPEED",
            help="Of tables of bearings and seals, and of --model and --state-space, such as 3000rpm; "
            "default: the lowest of the tables.",
        ),
    ] = None,
    rank: Annotated[bool, typer.Option("--rank", help="Rank all places of the masses.")] = False,
    candidates: Annotated[
        str | None,
        typer.Option("--candidates", metavar="LIST", help="Nodes that --rank and --place choose from."),
    ] = None,
    trade_off: Annotated[
        bool, typer.Option("--trade-off", help="Other masses at these nodes: frequencies against shapes.")
    ] = False,
    methods: Annotated[bool, typer.Option("--methods", help="Beside other reductions:"), choices] = False,
    response: Annotated[
        str | None,
        typer.Option(
            "--response",
            metavar="A:B:STEP",
            help="Unbalance response beside the full rotor's, rad/s or with a unit; or auto.",
        ),
    ] = None,
    stability: Annotated[
        str | None,
        typer.Option("--stability", metavar="A:B", help="Stability beside the full rotor's, 0:9000rpm."),
    ] = None,
    damping: Annotated[
        str | None,
        typer.Option(
            "--damping",
            metavar="LIST",
            help="Modal damping of the small model, percent of critical of the first modes: 1,0.5.",
        ),
    ] = None,
    both_planes: Annotated[
        bool,
        typer.Option("--both-planes", help="Planes x and y in --model, also where nothing couples them."),
    ] = False,
    force: Annotated[
        str | None,
        typer.Option(
            "--force", metavar="LIST", help="Nodes of measured forces, inputs f_x12 of --model, 12 or 7,12."
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            metavar="FILE.toml",
            help="Write the small model for `rotorid fit` and `identify`, a damper to be estimated at each "
            "mass.",
        ),
    ] = None,
    state_space: Annotated[
        Path | None,
        typer.Option(
            "--state-space", metavar="FILE", help="Write A, B, C, D in both planes: .json, .npz or .mat."
        ),
    ] = None,
    view: Annotated[View | None, typer.Option("--view", help="What --plot draws.")] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
    report: ReportOption = None,
) -> None:
    """Equivalent masses at chosen nodes (formula 50), how good they are, and the small model to go on with.

    The formula is one of a plane at rest; bearings, seals, gyroscopic effect and damping come back with the
    small model (--response, --stability, --model, --state-space).

    Example: rotorid reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2

    Example: rotorid reduce sample_data/rotor23.csv --rank --plot map.png
    """
    options = chosen(ReduceOptions, locals())
    check_targets(plot, output, model=model, state_space=state_space, report=report)
    used = {
        "--damping": (damping, model or state_space, "--model or --state-space"),
        "--both-planes": (both_planes, model, "--model"),
        "--force": (force, model, "--model"),
        "--view": (view, plot, "--plot"),
    }
    for option, (given, of_use, needed) in used.items():
        if given and not of_use:
            raise ValueError(f"{option} does nothing without {needed}")

    def found() -> ReducedRotor:
        masses = work(rotor, options)
        return masses.with_small() if rotor is not None and (model or state_space) else masses

    deliver(
        "reduction",
        found,
        as_json=json,
        plot=plot,
        output=output,
        report=report,
        draw=lambda found: found.figure(view),
        more=(
            (model, lambda found: found.model_bytes("" if rotor is None else rotor.name)),
            (state_space, lambda found: found.state_space_bytes((state_space or Path()).suffix.lower())),
        ),
    )
