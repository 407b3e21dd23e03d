"""`rotorid reduce`: a rotor as a few masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.cli.common import JsonOption, OutputOption, PlotOption, ReportOption, options_of
from rotorid.cli.output import check_targets, chosen, deliver
from rotorid.workflows.reduce import Normalise, Place, ReduceOptions, Rows, View, choices
from rotorid.workflows.reduce import reduce as work

if TYPE_CHECKING:
    from rotorid.workflows.reduced_rotor import ReducedRotor

say = options_of(ReduceOptions)


def reduce(
    rotor: Annotated[
        Path | None,
        typer.Argument(
            metavar="[ROTOR]",
            help="Rotor table (.csv, .xlsx) or rotor file (.toml); not needed with --compliance.",
        ),
    ] = None,
    nodes: Annotated[str | None, say("nodes", "LIST")] = None,
    place: Annotated[Place | None, say("place")] = None,
    masses: Annotated[int | None, say("masses", "N", least=1)] = None,
    modes: Annotated[int | None, say("modes", "N", least=1)] = None,
    normalise: Annotated[Normalise, say("normalise")] = ReduceOptions.normalise,
    rows: Annotated[Rows, say("rows")] = ReduceOptions.rows,
    nonnegative: Annotated[bool, say("nonnegative", None, "--nonnegative")] = False,
    supports_apart: Annotated[bool, say("supports_apart", None, "--supports-apart")] = False,
    measured: Annotated[Path | None, say("measured", "FILE")] = None,
    compliance: Annotated[Path | None, say("compliance", "FILE")] = None,
    seals: Annotated[str | None, say("seals", "LIST")] = None,
    errors: Annotated[str | None, say("errors", "LIST")] = None,
    what_if: Annotated[str | None, say("what_if", "LIST")] = None,
    speed: Annotated[str | None, say("speed", "SPEED")] = None,
    rank: Annotated[bool, say("rank", None, "--rank")] = False,
    candidates: Annotated[str | None, say("candidates", "LIST")] = None,
    trade_off: Annotated[bool, say("trade_off", None, "--trade-off")] = False,
    methods: Annotated[bool, say("methods", None, "--methods"), choices] = False,
    response: Annotated[str | None, say("response", "A:B:STEP")] = None,
    stability: Annotated[str | None, say("stability", "A:B")] = None,
    damping: Annotated[str | None, say("damping", "LIST")] = None,
    both_planes: Annotated[bool, say("both_planes", None, "--both-planes")] = False,
    force: Annotated[str | None, say("force", "LIST")] = None,
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
