"""The command line: `rotorid COMMAND`. Thin: the commands are in `rotorid.commands`."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any

import typer

from rotorid.base.answer import COLUMNS
from rotorid.base.choices import one_of
from rotorid.cli.demo import demo
from rotorid.cli.help_and_suggestions import Command, Commands, whole_paragraphs
from rotorid.commands.command_line import json_text, run, typer_command, written_help
from rotorid.commands.progress import plain

_JOBS = {
    "Balance rotors": "balance vectors trial_weight split tolerance unbalance",
    "Compute rotors": "critical campbell response influence study",
    "Reduce rotors, let them move": "reduce bearings motion periodic",
    "Identify coefficients": "identify fit simulate modes runup calibrate",
}
"""Commands by what they are for, the chief one first."""
SCHEMAS = {
    "job": ("Job file of rotorid", "rotorid.files.job_keys:JobSettings"),
    "rotor": ("Rotor file of rotorid", "rotorid.files.rotor_keys:RotorFile"),
    "small": ("Small model for motion of rotorid", "rotorid.files.small_model:SmallModelFile"),
    "study": ("Study file of rotorid", "rotorid.study.study_file:StudyKeys"),
    "waveforms": ("Waveforms file of rotorid", "rotorid.files.waveform_jobs:WaveformsFile"),
}
"""Files that `schema` knows: what each is, and its keys."""


def worksheet(
    job: Annotated[
        Path, typer.Argument(metavar="JOB | FOLDER", help="Job (.toml, .xlsx), or a folder for one.")
    ] = Path(),
) -> None:
    """A local page to type, balance, check and print a job; nothing leaves the machine.

    Example: rotorid worksheet sample_data/turbo_job/job.toml

    Example: rotorid worksheet my_fan

    The files are the job: each cell is saved as it is typed, and `rotorid balance` reads the same files.
    """
    from rotorid.worksheet.server import serve

    def opened(address: str) -> None:
        typer.echo(f"worksheet: {address}   (end it with Ctrl+C)")
        if sys.stdout.isatty():
            import webbrowser

            webbrowser.open(address)

    serve(job, opened)


def schema(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="What file: job, rotor, small (model), study or waveforms.")
    ],
) -> None:
    """JSON schema of a job, a rotor file or other settings, for editors to check keys.

    Example: rotorid schema job
    """
    from rotorid.files.settings import settings_schema

    title, model = SCHEMAS[one_of(kind, "schema", list(SCHEMAS))]
    typer.echo(json_text(settings_schema(resolve_name(model), title)))


def _work_of(name: str) -> Any:  # noqa: ANN401 - a function, with any arguments
    """The function of a command; its module is loaded here."""
    home = {"study": "rotorid.study", "fleet_fit": "rotorid.fleet"}
    return resolve_name(f"{home.get(name, f'rotorid.commands.{name}')}:{name}")


def application(typed: Sequence[str] = ()) -> typer.Typer:
    """The command line: of the one command that the first word names, or of all."""
    app = typer.Typer(
        name="rotorid",
        cls=Commands,
        rich_markup_mode=None if plain() else "rich",  # else without any escape code
        invoke_without_command=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": COLUMNS},
        callback=_rotorid,
        help=whole_paragraphs(written_help(_rotorid)),
    )
    panel_of = {name.replace("_", "-"): job for job, names in _JOBS.items() for name in names.split()}
    one, named = {*typed[:1]} & {*panel_of}, [*typed] in (["--help"], ["-h"])
    for name in one or panel_of:
        work = _work_of(name.replace("-", "_"))
        made = app.command(name, cls=Command, rich_help_panel=panel_of[name], help=written_help(work))
        made(_rotorid if named else typer_command(work))  # of all only the first lines of help are shown
    if not one:
        fleet = typer.Typer(
            no_args_is_help=True, help="Jobs of many machines as a table, and coefficients of their type."
        )
        fit = _work_of("fleet_fit")
        fleet.command("fit", cls=Command, help=written_help(fit))(typer_command(fit))
        app.add_typer(fleet, name="fleet", rich_help_panel="More")
        for more in (worksheet, demo, schema):
            app.command(more.__name__, cls=Command, rich_help_panel="More", help=written_help(more))(more)
    return app


def _rotorid(
    ctx: typer.Context,
    version: bool = typer.Option(False, "--version", help="Print the version and end."),
) -> None:
    """Rotor models, flexible-rotor balancing and identification of oscillating systems.

    Every command has --json (one JSON document on standard output), --plot FILE and --output FILE
    where they make sense, --table for every table, and --help with examples. `rotorid` alone shows an
    example of each job.

    Exit status: 0, or 2 for bad input with one message.
    """
    if version:
        from rotorid import __version__

        typer.echo(f"rotorid {__version__}")
        raise typer.Exit
    if ctx.invoked_subcommand is None:
        typer.echo(_overview())


def _overview() -> str:
    """The four jobs, each with the first example of its first command, and what else there is for it."""
    lines = ["An example of each job, run in a checkout (else: rotorid demo DIR):"]
    for job, every in _JOBS.items():
        chief, *others = every.replace("_", "-").split()
        example = written_help(_work_of(chief)).split("Example: ")[1].partition("\n\n")[0]
        example, names = " ".join(example.split()), ", ".join(others)
        lines += ["", f"{job}:", f"  {example}"]
        lines += textwrap.wrap(f"also {names}", COLUMNS, initial_indent="  ", subsequent_indent="  ")
    return "\n".join([*lines, "", "More: fleet, worksheet, demo, schema; each: rotorid COMMAND --help"])


def main() -> None:
    """Run the command line."""
    run(lambda: application(sys.argv[1:])())
