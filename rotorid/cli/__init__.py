"""The command line: `rotorid COMMAND`. Thin: read, call, print; one file per command."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings
from collections.abc import Callable, Iterator

import typer

from rotorid.base.answer import COLUMNS, kinds
from rotorid.cli.choices import Command
from rotorid.cli.commands import (
    balance,
    bearings,
    calibrate,
    campbell,
    critical,
    demo,
    fit,
    identify,
    influence,
    modes,
    motion,
    periodic,
    reduce,
    response,
    runup,
    schema,
    simulate,
    split,
    tolerance,
    trial_weight,
    unbalance,
    vectors,
)
from rotorid.cli.common_options import written_help
from rotorid.cli.fleet import fleet
from rotorid.cli.study import study
from rotorid.cli.terminal import markup_mode
from rotorid.cli.verbose import verbosely
from rotorid.cli.worksheet import worksheet

app = typer.Typer(
    name="rotorid",
    rich_markup_mode=markup_mode(),
    invoke_without_command=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_COMMANDS: dict[str, dict[str, Callable[..., None] | typer.Typer]] = {
    "Balance rotors": {
        "balance": balance.balance,
        "worksheet": worksheet,
        "vectors": vectors.vectors,
        "trial-weight": trial_weight.trial_weight,
        "split": split.split,
        "tolerance": tolerance.tolerance,
        "unbalance": unbalance.unbalance,
        "fleet": fleet,
    },
    "Compute rotors": {
        "critical": critical.critical,
        "campbell": campbell.campbell,
        "response": response.response,
        "influence": influence.influence,
        "study": study,
    },
    "Reduce rotors, let them move": {
        "reduce": reduce.reduce,
        "bearings": bearings.bearings,
        "motion": motion.motion,
        "periodic": periodic.periodic,
    },
    "Identify coefficients": {
        "identify": identify.identify,
        "fit": fit.fit,
        "simulate": simulate.simulate,
        "modes": modes.modes,
        "runup": runup.runup,
        "calibrate": calibrate.calibrate,
    },
    "Samples, and checks": {"demo": demo.demo, "schema": schema.schema},
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
    """Run the command line; the exit status is 2 for bad input or usage, with one message, no traceback."""
    if sys.stderr is None:  # print would take standard output instead
        sys.stderr = io.StringIO()
    if sys.stdout is None:  # the caller closed it: a result that nobody can read is no success
        sys.exit(_complain(OSError("standard output is closed: there is nowhere to print the result")))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # an old code page has no arrows or signs of degrees
            stream.reconfigure(errors="replace")
    try:
        with _warnings_last():
            app()
    except (ArithmeticError, MemoryError) as problem:
        reason = f"numbers too large or too small to compute with: {problem}"
        sys.exit(
            _complain(ValueError(reason if isinstance(problem, ArithmeticError) else "not enough memory"))
        )
    except (ValueError, OSError) as problem:
        # ValueError covers InputError (files) and everything the library refuses with one clear sentence
        if isinstance(problem, BrokenPipeError):
            _forget_output()
            sys.exit(0)
        if isinstance(problem, OSError) and not problem.filename:
            _forget_output()
        sys.exit(_complain(problem))


def _forget_output() -> None:
    """Let the interpreter flush what is left of standard output into nothing, without a complaint."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def _warnings_last() -> Iterator[None]:
    """Print what was warned of when all else is printed: one of each kind, numerical trouble first."""
    with warnings.catch_warnings(record=True) as caught:
        try:
            yield
        finally:
            try:
                sys.stdout.flush()
            finally:
                caught.sort(key=lambda one: issubclass(one.category, UserWarning))
                for text in kinds(_safe(str(one.message)) for one in caught):
                    print(f"rotorid: Warning: {text}", file=sys.stderr)


def _complain(problem: Exception) -> int:
    text = str(problem)
    if isinstance(problem, OSError) and problem.strerror:
        text = f"{problem.filename}: {problem.strerror}" if problem.filename else problem.strerror
    with contextlib.suppress(OSError):  # nobody can read it
        print(f"rotorid: {_safe(text)}", file=sys.stderr)
    return 2


def _safe(text: str) -> str:
    """Text without control characters: names of files may hold any."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)
