"""The command line: `rotorid COMMAND`. Thin: read, call, print; one file per command."""

from __future__ import annotations

import contextlib
import os
import sys
import warnings

import typer

from rotorid.cli import (
    balance,
    campbell,
    critical,
    demo,
    fit,
    identify,
    influence,
    reduce,
    response,
    split,
    tolerance,
    trial_weight,
    unbalance,
)

app = typer.Typer(
    name="rotorid",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo")(demo.demo)
app.command("critical")(critical.critical)
app.command("campbell")(campbell.campbell)
app.command("response")(response.response)
app.command("influence")(influence.influence)
app.command("balance")(balance.balance)
app.command("trial-weight")(trial_weight.trial_weight)
app.command("split")(split.split)
app.command("tolerance")(tolerance.tolerance)
app.command("unbalance")(unbalance.unbalance)
app.command("reduce")(reduce.reduce)
app.command("identify")(identify.identify)
app.command("fit")(fit.fit)


def _version(show: bool) -> None:
    if show:
        from rotorid import __version__

        typer.echo(f"rotorid {__version__}")
        raise typer.Exit


@app.callback()
def _rotorid(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version and end."
    ),
) -> None:
    """Rotor models, flexible-rotor balancing and identification of oscillating systems.

    Every command has --json (one JSON document on standard output), --plot FILE and --output FILE where they
    make sense, and --help with an example. Exit status: 0, or 2 for bad input with one message.
    """


def main() -> None:
    """Run the command line; the exit status is 2 for bad input or usage, with one message, no traceback."""
    if sys.stdout is None:  # the caller closed it: a result that nobody can read is no success
        sys.exit(_complain(OSError("standard output is closed: there is nowhere to print the result")))
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn  # type: ignore[assignment]
            try:
                app()
            finally:
                sys.stdout.flush()
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


def _warn(message: Warning | str, *_: object) -> None:
    print(f"rotorid: Warning: {_safe(str(message))}", file=sys.stderr)


def _complain(problem: Exception) -> int:
    text = str(problem)
    if isinstance(problem, OSError) and problem.strerror:
        text = f"{problem.filename}: {problem.strerror}" if problem.filename else problem.strerror
    print(f"rotorid: {_safe(text)}", file=sys.stderr)
    return 2


def _safe(text: str) -> str:
    """Text without control characters: names of files may hold any."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)
