"""`rotorid reduce`: a rotor as a few masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotorid.commands.app import STATE_SPACES, Destination, command
from rotorid.commands.outcome import EQUATIONS, WITH_REPORT
from rotorid.commands.reduce import ReduceOptions
from rotorid.commands.reduce import reduce as work

if TYPE_CHECKING:
    from rotorid.commands.reduce_result import ReducedRotor


@command(
    ReduceOptions,
    least={"masses": 1, "modes": 1},
    panels={
        "Input": "nodes modes speed measured compliance seals",
        "Method": "rank place masses candidates methods",
        "Errors": "errors",
        "Small model": "response stability model state_space damping force both_planes keep_supports",
        "Expert": "normalise rows nonnegative supports_apart",
    },
    to=(*WITH_REPORT, *EQUATIONS),
)
def reduce(
    rotor: Annotated[
        Path | None,
        typer.Argument(
            metavar="ROTOR",
            help="Rotor table (.csv, .xlsx) or rotor file (.toml); not needed with --compliance.",
        ),
    ] = None,
    *,
    options: ReduceOptions,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            metavar="FILE.toml",
            help="Write the small model for `rotorid motion`, `periodic`, `bearings`, and for `fit`, "
            "`identify` and `simulate`, a damper to be estimated at each mass.",
        ),
    ] = None,
    state_space: Annotated[
        Path | None,
        typer.Option(
            "--state-space", metavar="FILE", help="Write A, B, C, D in both planes: .json, .npz or .mat."
        ),
    ] = None,
    to: Destination,
) -> None:
    """A rotor as a few masses at chosen nodes (formula 50), and how good they are.

    The formula is one of a plane at rest; bearings, seals, gyroscopic effect and damping come back with the
    small model (--response, --stability, --model, --state-space). With --keep-supports bearings, films and
    other forces stay apart from the masses, for motion.

    Example: rotorid reduce sample_data/rotor23.csv --nodes 7,12,18 --modes 2

    Example: rotorid reduce sample_data/rotor23.csv --rank --plot map.png
    """
    used = {
        "--damping": (options.damping, model or state_space, "--model or --state-space"),
        "--both-planes": (options.both_planes, model, "--model"),
        "--force": (options.force, model, "--model"),
    }
    for option, (given, of_use, needed) in used.items():
        if given and not of_use:
            raise ValueError(f"{option} does nothing without {needed}")

    if options.keep_supports and state_space:
        raise ValueError("--state-space writes the rotor on its supports: leave out --keep-supports")

    def work_of() -> ReducedRotor:
        masses = work(rotor, options)
        return masses.with_small() if rotor is not None and (model or state_space) else masses

    to.deliver(
        "reduction",
        work_of,
        more=(
            (
                model,
                (".toml",),
                lambda reduced: reduced.model_files(model or Path(), "" if rotor is None else rotor.name),
            ),
            (
                state_space,
                STATE_SPACES,
                lambda reduced: reduced.state_space_bytes((state_space or Path()).suffix.lower()),
            ),
        ),
    )
