"""Output of a command: terminal or JSON, picture, table, sheet, all of them or none."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from rotorid.cli.progress import busy

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
    from matplotlib.figure import Figure

    from rotorid.workflows.result_provenance import Outcome

_O = TypeVar("_O", bound="DataclassInstance")
_R = TypeVar("_R", bound="Outcome")
PICTURES = (".png", ".svg", ".pdf")
TABLES = (".csv", ".xlsx")
STATE_SPACES = (".json", ".npz", ".mat")


def chosen(kind: type[_O], given: Mapping[str, Any]) -> _O:
    """The options of a workflow among the parameters of its command, which have the same names.

    Parameters
    ----------
    kind
        A dataclass of options.
    given
        The parameters: `locals()` at the beginning of the command.
    """
    fields = dataclasses.fields(kind)
    found = {f.name: f.default if given[f.name] is None else given[f.name] for f in fields}
    return kind(**{name: tuple(v) if isinstance(v, list) else v for name, v in found.items()})


def deliver(
    what: str,
    work: Callable[[], _R],
    *,
    as_json: bool,
    plot: Path | None = None,
    output: Path | None = None,
    report: Path | None = None,
    draw: Callable[[_R], Figure] | None = None,
    more: Sequence[tuple[Path | None, Callable[[_R], bytes]]] = (),
) -> _R:
    """Do the work of a command, print what it found, and write its files, all of them or none.

    Parameters
    ----------
    what
        What takes so long, for the sign of life.
    work
        Gives the result.
    as_json
        Print one JSON document instead of text.
    plot, output, report
        Files for the picture, the table and the sheet, checked by `check_targets` before.
    draw
        Makes the picture; default: the result's main one.
    more
        Further files, and what makes them.
    """
    from rotorid.cli.verbose import note
    from rotorid.tables.reader.problems import printable
    from rotorid.tables.reader.table_writing import table_bytes, write_files

    with busy(what):
        found = work()
    document = found.document
    note(document)
    targets = [path for path in (plot, output, report, *(path for path, _ in more)) if path is not None]
    check_inputs(targets, [Path(entry["file"]) for entry in document["provenance"]["inputs"]])
    written: dict[Path, bytes] = {}
    if plot is not None:
        written[plot] = figure_bytes(found.figure() if draw is None else draw(found), plot)
    if output is not None:
        written[output] = table_bytes(output, found.to_frame())
    written |= {path: build(found) for path, build in more if path is not None}
    if report is not None:
        written[report] = found.sheet()
    write_files(written)
    if as_json:
        typer.echo(json_text(document))
    else:
        typer.echo("\n".join([found.summary(), *(f"written: {printable(str(path))}" for path in written)]))
    return found


def check_targets(
    plot: Path | None,
    output: Path | None,
    *more: Path | None,
    model: Path | None = None,
    state_space: Path | None = None,
    report: Path | None = None,
) -> None:
    """Refuse files that could not be written, before any work is done; `more` are tables, too."""
    targets = [(plot, PICTURES), (output, TABLES), *((path, TABLES) for path in more)]
    targets += [(model, (".toml",)), (state_space, STATE_SPACES), (report, (".html",))]
    asked: list[Path] = []
    for path, endings in targets:
        if path is None:
            continue
        if path.suffix.lower() not in endings:
            raise ValueError(
                f"{path}: cannot write this kind of file; the name must end in {', '.join(endings)}"
            )
        if not path.parent.is_dir():
            raise ValueError(f"{path}: the folder {path.parent} does not exist")
        if path.exists() and not path.is_file():
            what = "a folder" if path.is_dir() else "no regular file"
            raise ValueError(f"{path}: cannot be written, it is {what}")
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise ValueError(f"{path}: cannot be written, permission denied")
        twin = next((other for other in asked if _same_file(path, other)), None)
        if twin is not None:
            raise ValueError(f"{path}: two results cannot go into one file; give each its own name")
        asked.append(path)


def check_inputs(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Refuse to write a result over a file that was read for it."""
    sources = list(inputs)
    for path in targets:
        if any(_same_file(path, source) for source in sources):
            raise ValueError(
                f"{path}: this is an input of the command, which must not be overwritten; choose another name"
            )


def _same_file(a: Path, b: Path) -> bool:
    if a.exists() and b.exists():
        return a.samefile(b)
    return os.path.realpath(a) == os.path.realpath(b)  # of a circle of links, too


def json_text(document: Mapping[str, Any]) -> str:
    """A document as JSON; in plain ASCII where standard output cannot write more."""
    plain = "utf" not in (getattr(sys.stdout, "encoding", None) or "utf-8").casefold()
    return json.dumps(document, ensure_ascii=plain, allow_nan=False, indent=1)


def figure_bytes(figure: Figure, path: Path) -> bytes:
    """A figure in the format that the name of its file asks for."""
    stream = io.BytesIO()
    figure.savefig(stream, dpi=150, format=path.suffix.lower().lstrip("."))
    return stream.getvalue()
