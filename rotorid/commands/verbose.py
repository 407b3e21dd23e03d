"""`--verbose`: what is logged about a result, on standard error, so that `--json` stays one document."""

from __future__ import annotations

import functools
import inspect
import logging
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, get_type_hints

import typer

from rotorid.base.logs import workflows as log

VerboseOption = Annotated[
    bool,
    typer.Option(
        "--verbose", rich_help_panel="Output", help="The numbers behind the result, too: on standard error."
    ),
]
SHOWN = (
    "method",
    "integrator",
    "loss",
    "source",
    "amplitude_percent",
    "phase_deg",
    "floor",
    "run_percent",
    "run_floor",
    "common_share",
    "rank",
    "condition_number",
    "singular_values",
    "degrees_of_freedom",
    "chi_square",
    "chi_square_dof",
    "iterations",
    "converged",
    "message",
    "residual_rms",
    "rms_before",
    "rms_after",
    "max_before",
    "max_after",
    "duality_gap",
    "integration_change",
    "autocorrelation",
    "relative_error",
    "masses_std_kg",
    "mac",
    "elements",
    "unknowns_per_plane",
    "supports",
    "discs",
    "speeds",
    "estimated_relative_error",
    "permissible_kg_m",
    "specific_um",
    "force_N",
    "load_N",
    "agrees",
    "erratum",
    "differs",
)
"""Keys of the JSON documents that say how a result came about, at any depth."""
MOST = 12
"""So many numbers of a list are printed."""


class _Kept(logging.Handler):
    """Messages for after the result."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one."""
        self.lines.append(record.getMessage())


def verbosely(command: Callable[..., None]) -> Callable[..., None]:
    """The same command with an option `--verbose`; what was logged is printed after its result."""

    @functools.wraps(command)
    def wrapper(*args: Any, verbose: bool = False, **kwargs: Any) -> None:  # noqa: ANN401 - any command
        from rotorid.files.decimal_numbers import LARGEST_STATED, NotANumber, check_size
        from rotorid.files.input_file import each_file_once

        for option, value in kwargs.items():
            if isinstance(value, float):
                try:
                    check_size(value, LARGEST_STATED)
                except NotANumber as error:
                    raise ValueError(f"--{option.replace('_', '-')} takes {error}, not {value:g}") from None
        with each_file_once():
            if verbose:
                with _told():
                    command(*args, **kwargs)
            else:
                command(*args, **kwargs)

    hints = {**get_type_hints(command, include_extras=True), "verbose": VerboseOption}
    signature = inspect.signature(command)
    option = inspect.Parameter("verbose", inspect.Parameter.KEYWORD_ONLY, default=False)
    parameters = [*signature.parameters.values(), option]
    wrapper.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[parameter.replace(annotation=hints[parameter.name]) for parameter in parameters]
    )
    wrapper.__annotations__ = hints
    return wrapper


@contextmanager
def _told() -> Iterator[None]:
    """Print what is logged meanwhile after the result, also where both go to one file; times come last."""
    begun, kept, level = time.perf_counter(), _Kept(), log.level
    log.addHandler(kept)
    log.setLevel(logging.INFO)
    exits = None
    try:
        try:
            yield
        except typer.Exit as status:  # an exit status is a result, too
            exits = status
    finally:
        log.removeHandler(kept)
        log.setLevel(level)
    lines = sorted(dict.fromkeys(kept.lines), key=lambda line: line.startswith("time: "))
    lines.append(f"time: all {time.perf_counter() - begun:.3f} s")
    lines.append("versions: " + ", ".join(f"{name} {number}" for name, number in versions().items()))
    sys.stdout.flush()
    for line in lines:
        print(f"rotorid: {line}", file=sys.stderr)
    if exits is not None:
        raise exits


def note(document: Mapping[str, Any]) -> None:
    """Log what a result's document, or a few numbers under names of `SHOWN`, tell.

    Parameters
    ----------
    document
        As printed by `--json`, or any mapping with such keys; of lists of tables only `history` is looked at.
    """
    if log.isEnabledFor(logging.INFO):
        for name, value in _numbers(document):
            log.info("%s = %s", name, value)


def _numbers(document: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in document.items():
        name = f"{prefix}{key}"
        if key == "provenance":
            continue
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{name}.")
        elif key == "history" and isinstance(value, list) and value:
            costs = [row["cost"] for row in value if isinstance(row, Mapping) and "cost" in row]
            if costs:
                yield f"{name}.cost", f"{_plain(costs[0])} … {_plain(costs[-1])} in {len(costs)} entries"
        elif key in SHOWN and value is not None:
            yield name, _plain(value)


def _plain(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        more = f", … ({len(value)} in all)" if len(value) > MOST else ""
        return ", ".join(_plain(item) for item in value[:MOST]) + more
    return str(value)


def versions() -> dict[str, str]:
    """Of the program, of Python, and of the libraries that compute."""
    import platform
    from importlib.metadata import version

    from rotorid import __version__

    libraries = {name: version(name) for name in ("numpy", "scipy")}
    return {"rotorid": __version__, "python": platform.python_version(), **libraries}
