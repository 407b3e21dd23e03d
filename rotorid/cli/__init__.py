"""The command line: `rotorid COMMAND`. Thin: read, call, print; one file per command."""

from __future__ import annotations

from collections.abc import Callable

import typer

from rotorid.base.answer import COLUMNS
from rotorid.cli.choices import Command
from rotorid.cli.commands import calibrate, fit
from rotorid.cli.demo import demo
from rotorid.cli.schema import schema
from rotorid.cli.worksheet import worksheet
from rotorid.commands import (
    Delivered,
    balance,
    bearings,
    campbell,
    critical,
    identify,
    influence,
    modes,
    motion,
    periodic,
    reduce,
    response,
    runup,
    simulate,
    split,
    tolerance,
    trial_weight,
    unbalance,
    vectors,
)
from rotorid.commands.app import run, typer_command, written_help
from rotorid.commands.terminal import markup_mode
from rotorid.commands.verbose import verbosely
from rotorid.fleet.adding import fleet_add
from rotorid.fleet.fitting import fleet_fit
from rotorid.fleet.showing import fleet_show
from rotorid.study.studies import study

app = typer.Typer(
    name="rotorid",
    rich_markup_mode=markup_mode(),
    invoke_without_command=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
fleet = typer.Typer(
    no_args_is_help=True, help="Jobs of many machines as tables, and coefficients of their type."
)
_FLEET: dict[str, Callable[..., Delivered]] = {"add": fleet_add, "show": fleet_show, "fit": fleet_fit}
for _name, _work in _FLEET.items():
    fleet.command(_name, cls=Command)(verbosely(typer_command(_work)))
_COMMANDS: dict[str, dict[str, Callable[..., None] | typer.Typer]] = {
    "Balance rotors": {
        "balance": typer_command(balance),
        "worksheet": worksheet,
        "vectors": typer_command(vectors),
        "trial-weight": typer_command(trial_weight),
        "split": typer_command(split),
        "tolerance": typer_command(tolerance),
        "unbalance": typer_command(unbalance),
        "fleet": fleet,
    },
    "Compute rotors": {
        "critical": typer_command(critical),
        "campbell": typer_command(campbell),
        "response": typer_command(response),
        "influence": typer_command(influence),
        "study": typer_command(study),
    },
    "Reduce rotors, let them move": {
        "reduce": typer_command(reduce),
        "bearings": typer_command(bearings),
        "motion": typer_command(motion),
        "periodic": typer_command(periodic),
    },
    "Identify coefficients": {
        "identify": typer_command(identify),
        "fit": fit.fit,
        "simulate": typer_command(simulate),
        "modes": typer_command(modes),
        "runup": typer_command(runup),
        "calibrate": calibrate.calibrate,
    },
    "Samples, and checks": {"demo": demo, "schema": schema},
}
for _job, _commands in _COMMANDS.items():
    for _name, _command in _commands.items():
        if isinstance(_command, typer.Typer):
            app.add_typer(_command, name=_name, rich_help_panel=_job)
            continue
        app.command(_name, cls=Command, rich_help_panel=_job)(verbosely(_command))


def _version(show: bool) -> None:
    if show:
        from rotorid import __version__

        typer.echo(f"rotorid {__version__}")
        raise typer.Exit


@app.callback()
def _rotorid(
    ctx: typer.Context,
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version and end."
    ),
) -> None:
    """Rotor models, flexible-rotor balancing and identification of oscillating systems.

    Every command has --json (one JSON document on standard output), --plot FILE and --output FILE
    where they make sense, --table for every table, --verbose for the numbers behind a result (on
    standard error), and --help with examples. `rotorid` alone shows an example of each job.

    Exit status: 0, or 2 for bad input with one message.
    """
    if ctx.invoked_subcommand is None:
        typer.echo(_overview())


_rotorid.__doc__ = written_help(_rotorid)


def _overview() -> str:
    """The jobs, each with the first example of its first command, and their commands."""
    lines = [
        "An example of each job, run in a checkout (else: rotorid demo DIR). More: rotorid COMMAND --help"
    ]
    for job, commands in _COMMANDS.items():
        told: dict[str, str] = {}
        for name, command in commands.items():
            if isinstance(command, typer.Typer):
                told |= {
                    f"{name} {one.name}": one.callback.__doc__ or "" for one in command.registered_commands
                }
            else:
                told[name] = command.__doc__ or ""
        example = " ".join("".join(told.values()).split("Example: ")[1].partition("\n\n")[0].split())
        short = len(job) + len(example) + 2 <= COLUMNS
        lines += [f"{job}: {example}"] if short else [f"{job}:", f"  {example}"]
        lines += [f"  {name:<12}  {text.partition('.')[0]}" for name, text in told.items()]
    return "\n".join(lines)


def main() -> None:
    """Run the command line."""
    run(app)
