"""`--verbose`: the numbers behind a result, on standard error, so that `--json` stays one document."""

from __future__ import annotations

import functools
import inspect
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

if TYPE_CHECKING:
    from fem import Rotor

VerboseOption = Annotated[
    bool,
    typer.Option("--verbose", help="The numbers behind the result, too: on standard error."),
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


@dataclass
class Notes:
    """What a command that runs with `--verbose` has said so far."""

    begun: float
    numbers: dict[str, str] = field(default_factory=dict)
    spans: list[tuple[str, float]] = field(default_factory=list)


_NOTES: ContextVar[Notes | None] = ContextVar("notes", default=None)


def verbosely(command: Callable[..., None]) -> Callable[..., None]:
    """The same command with an option `--verbose`; what was noted is printed after its result."""

    @functools.wraps(command)
    def wrapper(*args: Any, verbose: bool = False, **kwargs: Any) -> None:  # noqa: ANN401 - any command
        from rotorid.tables.reader.input_file import each_file_once
        from rotorid.tables.reader.number import LARGEST_STATED, NotANumber, check_size

        for option, value in kwargs.items():
            if isinstance(value, float):
                try:
                    check_size(value, LARGEST_STATED)
                except NotANumber as error:
                    raise ValueError(f"--{option.replace('_', '-')} takes {error}, not {value:g}") from None
        with each_file_once():
            if verbose:
                with_notes(*args, **kwargs)
            else:
                command(*args, **kwargs)

    def with_notes(*args: Any, **kwargs: Any) -> None:  # noqa: ANN401 - any command
        notes = Notes(time.perf_counter())
        token = _NOTES.set(notes)
        try:
            command(*args, **kwargs)
        except typer.Exit:  # an exit status is a result, too
            _tell(notes)
            raise
        else:
            _tell(notes)
        finally:
            _NOTES.reset(token)

    hints = {**get_type_hints(command, include_extras=True), "verbose": VerboseOption}
    signature = inspect.signature(command)
    option = inspect.Parameter("verbose", inspect.Parameter.KEYWORD_ONLY, default=False)
    parameters = [*signature.parameters.values(), option]
    wrapper.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[parameter.replace(annotation=hints[parameter.name]) for parameter in parameters]
    )
    wrapper.__annotations__ = hints
    return wrapper


def note(document: Mapping[str, Any]) -> None:
    """Keep what a result's document, or a few numbers under names of `SHOWN`, tell; nothing if not asked for.

    Parameters
    ----------
    document
        As printed by `--json`, or any mapping with such keys; of lists of tables only `history` is looked at.
    """
    notes = _NOTES.get()
    if notes is not None:
        notes.numbers |= dict(_numbers(document))


def note_rotor(rotor: Rotor, **more: object) -> None:
    """Keep how large the model of a rotor is, and `more` numbers under names of `SHOWN`."""
    if _NOTES.get() is None:
        return
    stride = 4 if rotor.model.shear else 2
    note(
        {
            "elements": rotor.n_elements,
            "unknowns_per_plane": 2 * rotor.n_nodes + (stride - 2) * rotor.n_elements,
            "discs": len(rotor.discs),
            "supports": len(rotor.supports),
            **more,
        }
    )


def span(what: str, seconds: float) -> None:
    """Keep how long a part of the work took; nothing if not asked for."""
    notes = _NOTES.get()
    if notes is not None:
        notes.spans.append((what, seconds))


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


def _tell(notes: Notes) -> None:
    """Print after the result, also where both end in one file."""
    sys.stdout.flush()
    for line in _report(notes):
        print(f"rotorid: {line}", file=sys.stderr)


def _report(notes: Notes) -> list[str]:
    lines = [f"{name} = {value}" for name, value in notes.numbers.items()]
    lines += [f"time: {what} {seconds:.3f} s" for what, seconds in notes.spans]
    lines.append(f"time: all {time.perf_counter() - notes.begun:.3f} s")
    return [*lines, "versions: " + ", ".join(f"{name} {number}" for name, number in versions().items())]


def versions() -> dict[str, str]:
    """Of the program, of Python, and of the libraries that compute."""
    import platform

    import numpy as np
    import scipy

    from rotorid import __version__

    return {
        "rotorid": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }
