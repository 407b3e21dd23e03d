"""`rotorid reduce`: a rotor as a few masses."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from rotorid.cli.common import (
    JsonOption,
    OutputOption,
    PlotOption,
    ReportOption,
    emit,
)
from rotorid.cli.output import check_targets
from rotorid.cli.verbose import note
from rotorid.workflows.parameters import nodes as parse_nodes
from rotorid.workflows.parameters import (
    one_speed,
    rising_speeds,
)


class Place(StrEnum):
    """Which of all places of the masses is taken."""

    BEST = "best"
    COMPROMISE = "compromise"
    MAC = "mac"
    BOOK = "book"


class Normalise(StrEnum):
    """How shapes are scaled."""

    FIRST = "first"
    LARGEST = "largest"
    LENGTH = "length"


class Rows(StrEnum):
    """How rows of the regression are weighted."""

    EQUAL = "equal"
    RELATIVE = "relative"


class View(StrEnum):
    """What the picture shows."""

    SHAPES = "shapes"
    METHODS = "methods"
    PLACEMENT = "placement"
    RESPONSE = "response"
    STABILITY = "stability"


def reduce(  # noqa: C901, PLR0915
    rotor: Annotated[
        Path | None,
        typer.Argument(
            metavar="[ROTOR]",
            help="Rotor table (.csv, .xlsx) or rotor file (.toml); not needed with --compliance.",
            show_default=False,
        ),
    ] = None,
    nodes: Annotated[
        str | None,
        typer.Option(help="Where the masses stand: nodes or stations, 7,12,18.", show_default=False),
    ] = None,
    place: Annotated[
        Place | None,
        typer.Option(
            help="Instead of --nodes, of all places: best by frequency, best by MAC, a compromise, or the "
            "book's rule (extrema of the first two modes).",
            show_default=False,
        ),
    ] = None,
    masses: Annotated[
        int | None,
        typer.Option(min=1, help="How many masses --place and --rank set; default 3.", show_default=False),
    ] = None,
    modes: Annotated[
        int | None,
        typer.Option(min=1, help="How many modes the regression uses; default 2.", show_default=False),
    ] = None,
    normalise: Annotated[
        Normalise,
        typer.Option(help="Shapes scaled to 1 at the first mass (the book), at their largest, or in length."),
    ] = Normalise.FIRST,
    rows: Annotated[
        Rows,
        typer.Option(
            help="Rows of the regression as they stand (the book: the first mode dominates), or of each mode "
            "relative to its 1/ω²."
        ),
    ] = Rows.EQUAL,
    nonnegative: Annotated[bool, typer.Option("--nonnegative", help="No mass below 0.")] = False,
    supports_apart: Annotated[
        bool,
        typer.Option("--supports-apart", help="Compliance of the shaft and its two bearings apart, (47)."),
    ] = False,
    measured: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Measured modes (mode, frequency_rad_s, node, shape), used instead of computed ones.",
            show_default=False,
        ),
    ] = None,
    compliance: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Without a rotor: table node, force_node, compliance_m_per_N, with --measured.",
            show_default=False,
        ),
    ] = None,
    seals: Annotated[
        str | None,
        typer.Option(
            "--seals",
            metavar="LIST",
            help="With --compliance: springs to the ground that it does not hold, N/m, 12=2e6.",
            show_default=False,
        ),
    ] = None,
    errors: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Standard deviations of the inputs in percent: compliance=1.3,shapes=1,frequencies=0.1.",
            show_default=False,
        ),
    ] = None,
    what_if: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="What changes of inputs do, in percent: alpha12=1.3,U31=-0.3.",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="SPEED",
            help="Of tables of bearings and seals, and of --model and --state-space, such as 3000rpm; "
            "default: the lowest of the tables.",
            show_default=False,
        ),
    ] = None,
    rank: Annotated[bool, typer.Option("--rank", help="Rank all places of the masses.")] = False,
    candidates: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Nodes that --rank and --place choose from.", show_default=False),
    ] = None,
    trade_off: Annotated[
        bool, typer.Option("--trade-off", help="Other masses at these nodes: frequencies against shapes.")
    ] = False,
    methods: Annotated[bool, typer.Option("--methods", help="Beside Guyan, IRS and SEREP.")] = False,
    response: Annotated[
        str | None,
        typer.Option(
            metavar="A:B:STEP",
            help="Unbalance response beside the full rotor's, rad/s or with a unit; or auto.",
            show_default=False,
        ),
    ] = None,
    stability: Annotated[
        str | None,
        typer.Option(metavar="A:B", help="Stability beside the full rotor's, 0:9000rpm.", show_default=False),
    ] = None,
    damping: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Modal damping of the small model, percent of critical of the first modes: 1,0.5.",
            show_default=False,
        ),
    ] = None,
    both_planes: Annotated[
        bool,
        typer.Option("--both-planes", help="Planes x and y in --model, also where nothing couples them."),
    ] = False,
    force: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Nodes of measured forces, inputs f_x12 of --model, 12 or 7,12.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Write the small model for `rotorid fit` and `identify`, a damper to be estimated at each "
            "mass.",
            show_default=False,
        ),
    ] = None,
    state_space: Annotated[
        Path | None,
        typer.Option(
            "--state-space",
            metavar="FILE",
            help="Write A, B, C, D in both planes: .json, .npz or .mat.",
            show_default=False,
        ),
    ] = None,
    view: Annotated[View | None, typer.Option(help="What --plot draws.", show_default=False)] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
    sheet: ReportOption = None,
) -> None:
    """Equivalent masses at chosen nodes (formula 50), how good they are, and the small model to go on with.

    The formula is one of a plane at rest; bearings, seals, gyroscopic effect and damping come back with the
    small model (--response, --stability, --model, --state-space).

    Example: rotorid reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2

    Example: rotorid reduce sample_data/rotor23.csv --rank --plot map.png
    """
    from rotorid.cli.commands import reduce_inputs as given
    from rotorid.cli.commands.reduce_report import Report
    from rotorid.tables import read_rotor, rotor_files

    check_targets(plot, output, model=model, state_space=state_space, report=sheet)
    how: dict[str, Any] = {"normalise": normalise.value, "rows": rows.value}
    signed = how | {"nonnegative": nonnegative}
    if rotor is None:
        needing = {
            "--place": place,
            "--rank": rank,
            "--candidates": candidates,
            "--trade-off": trade_off,
            "--methods": methods,
            "--response": response,
            "--stability": stability,
            "--damping": damping,
            "--both-planes": both_planes,
            "--state-space": state_space,
            "--supports-apart": supports_apart,
            "--speed": speed,
        }
        if unfit := next((option for option, value in needing.items() if value), None):
            raise ValueError(f"{unfit} needs a rotor: give ROTOR instead of --compliance")
        result, files = given.from_tables(compliance, measured, nodes, modes, seals, errors, signed)
        report = Report(result)
    else:
        if compliance is not None or seals is not None:
            raise ValueError(
                "--compliance and --seals take the place of a rotor: give them, or ROTOR, not both"
            )
        given.check_used(
            {
                "--masses": (masses is not None, rank or place is not None, "--rank or --place"),
                "--candidates": (candidates is not None, rank or place is not None, "--rank or --place"),
                "--damping": (damping is not None, bool(model or state_space), "--model or --state-space"),
                "--both-planes": (both_planes, model is not None, "--model"),
                "--force": (force is not None, model is not None, "--model"),
                "--view": (view is not None, plot is not None, "--plot"),
            }
        )
        computed: dict[str, object] = {
            "--rank": rank,
            "--place": place,
            "--methods": methods,
            "--trade-off": trade_off,
        }
        computed |= {"--response": response, "--stability": stability}
        if measured is not None and (unfit := next((name for name, on in computed.items() if on), None)):
            raise ValueError(
                f"{unfit} compares with the computed rotor, not with the measured modes: leave out {unfit} "
                "or --measured"
            )
        from rotorid.reduction import rank_nodes
        from rotorid.reduction import reduce as reduce_rotor
        from rotorid.tables.data.modes_table import read_modes

        machine = read_rotor(rotor)
        files = [*rotor_files(rotor), *([measured] if measured else [])]
        at = None if speed is None else one_speed(speed, "--speed")
        data = None if measured is None else read_modes(measured, machine)
        placement = None
        if rank or place is not None:
            chosen = None if candidates is None else parse_nodes(candidates, "--candidates")
            placement = rank_nodes(
                machine, masses or 3, modes or min(2, masses or 3), candidates=chosen, speed=at, **how
            )
        places = given.places(machine, nodes, place and place.value, placement, data, masses or 3, at)
        used = min(2, len(places)) if modes is None else modes
        if data is not None and measured is not None:
            data = given.at(data, machine, places, measured)
        result = reduce_rotor(
            machine,
            places,
            used,
            speed=at,
            supports_apart=supports_apart,
            measured=None if data is None else (data.frequencies, data.shapes),
            errors=given.errors(errors, data, used, len(places)),
            **signed,
        )
        driven = [] if force is None else [machine.node(node) for node in parse_nodes(force, "--force")]
        report = Report(result, placement if rank else None, both_planes=both_planes, forces=driven)
        ratios = given.percents(damping, "--damping")
        if trade_off:
            report.add_trade_off(how["normalise"], at)
        if methods:
            report.add_methods(how, at)
        if ratios or response or stability or state_space or model:
            report.add_small(ratios, at)
        if response is not None:
            report.add_response(None if response == "auto" else rising_speeds(response, "--response"))
        if stability is not None:
            report.add_stability(*given.speed_range(stability))
    solved = report.result.masses
    note({"rank": solved.rank, "degrees_of_freedom": solved.dof})
    note({"singular_values": solved.singular_values.tolist()})
    if what_if is not None:
        report.shift = report.result.what_if(given.changes(what_if))
    emit(
        report.to_dict(),
        report.text,
        as_json=json,
        files=files,
        options={
            "nodes": nodes,
            "place": place and place.value,
            "masses": masses,
            "modes": modes,
            **signed,
            "supports_apart": supports_apart,
            "measured": measured,
            "compliance": compliance,
            "seals": seals,
            "errors": errors,
            "what_if": what_if,
            "speed": speed,
            "rank": rank,
            "methods": methods,
            "trade_off": trade_off,
            "candidates": candidates,
            "response": response,
            "stability": stability,
            "damping": damping,
            "both_planes": both_planes,
            "force": force,
            "model": model,
            "state_space": state_space,
        },
        figure=(plot, lambda: report.figure(None if view is None else view.value)),
        table=(output, report.frame),
        report=(sheet, report.sheet),
        more=(
            (model, lambda: report.model_bytes("" if rotor is None else rotor.name)),
            (state_space, lambda: report.state_space_bytes(state_space or Path())),
        ),
    )
