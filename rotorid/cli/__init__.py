"""The command line: `rotorid COMMAND`. Thin: read, call, print; one file per command."""

from __future__ import annotations

import sys
import warnings

import typer

from rotorid.cli import balance, critical, demo, influence, reduce

app = typer.Typer(
    name="rotorid",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo")(demo.demo)
app.command("critical")(critical.critical)
app.command("influence")(influence.influence)
app.command("balance")(balance.balance)
app.command("reduce")(reduce.reduce)


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
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn  # type: ignore[assignment]
            app()
    except (ValueError, OSError) as problem:
        # ValueError covers InputError (files) and everything the library refuses with one clear sentence
        if isinstance(problem, BrokenPipeError):
            sys.stderr.close()
            sys.exit(0)
        sys.exit(_complain(problem))


def _warn(message: Warning | str, *_: object) -> None:
    print(f"rotorid: warning: {message}", file=sys.stderr)


def _complain(problem: Exception) -> int:
    text = str(problem)
    if isinstance(problem, OSError) and problem.strerror:
        text = f"{problem.filename}: {problem.strerror}" if problem.filename else problem.strerror
    print(f"rotorid: {text}", file=sys.stderr)
    return 2
