"""Output of a command: terminal or JSON, picture, table, sheet, all of them or none."""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import typer

from rotorid.base.answer import LINES
from rotorid.cli.progress import busy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.workflows.result_provenance import Outcome

_R = TypeVar("_R", bound="Outcome")
PICTURES = (".png", ".svg", ".pdf")
TABLES = (".csv", ".xlsx")
Show = Literal["equations"]
STATE_SPACES = (".json", ".npz", ".mat")


@dataclass(frozen=True)
class Destination:
    """Where the result of a command goes.

    Attributes
    ----------
    json
        One JSON document on standard output, nothing else.
    table
        Every table behind the answer, too.
    plot : FILE
        Picture, .png, .svg or .pdf.
    output : FILE
        Table, .csv or .xlsx.
    report : FILE
        Sheet to print or to send, .html, one file.
    show : equations
        What was solved, in symbols and in numbers, instead of the answer; with --json beside it.
    latex
        The equations as a document of LaTeX.
    """

    json: bool = False
    table: bool = False
    plot: Path | None = None
    output: Path | None = None
    report: Path | None = None
    show: Show | None = None
    latex: bool = False

    def deliver(
        self,
        what: str,
        work: Callable[[], _R],
        *,
        draw: Callable[[_R], Figure] | None = None,
        more: Sequence[tuple[Path | None, Sequence[str], Callable[[_R], bytes | Mapping[Path, bytes]]]] = (),
    ) -> _R:
        """Do the work of a command, print what it found, and write its files, all of them or none.

        Parameters
        ----------
        what
            What takes so long, for the sign of life.
        work
            Gives the result.
        draw
            Makes the picture; default: the result's main one.
        more
            Further files, how their names may end, and what makes them; or makes several, by their paths.

        Raises
        ------
        ValueError
            For a file that could not be written, before any work is done, and for one that was read.
        """
        from rotorid.cli.verbose import note
        from rotorid.tables.reader.problems import printable
        from rotorid.tables.reader.table_writing import write_files

        if self.latex and (self.show is None or self.json or self.table):
            raise ValueError("--latex belongs to --show equations, without --json or --table")
        plot, output = self.plot, self.output
        files: list[tuple[Path | None, Sequence[str], Callable[[_R], bytes | Mapping[Path, bytes]]]] = [
            (plot, PICTURES, lambda r: figure_bytes(draw(r) if draw else r.figure(), plot or Path())),
            (output, TABLES, lambda r: r.table_file(output or Path())),
            *more,
            (self.report, (".html",), lambda r: r.sheet()),
        ]
        check_targets([(path, endings) for path, endings, _ in files])
        with busy(what):
            found = work()
        equations = found.equations if self.show else None
        document = found.document
        if equations:
            document["equations"] = equations.to_dict()
        note(document)
        targets = {path: build for path, _, build in files if path is not None}
        built: dict[Path, bytes] = {}
        for path, build in targets.items():
            made = build(found)
            built |= made if isinstance(made, Mapping) else {path: made}
        check_inputs(built, [Path(entry["file"]) for entry in document["provenance"]["inputs"]])
        write_files(built)
        if self.json:
            typer.echo(json_text(document))
        else:
            written = [f"written: {printable(str(path))}" for path in built]
            answer = equations.answer(found.answer) if equations else found.answer
            text = answer.whole() if self.table else answer.brief(LINES - len(written))
            typer.echo("\n".join([equations.latex() if equations and self.latex else text, *written]))
        return found


def check_targets(targets: Iterable[tuple[Path | None, Sequence[str]]]) -> None:
    """Refuse files that could not be written, with how their names may end, before any work is done."""
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
    import matplotlib as mpl

    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "rotorid"}):  # the same ids each time
        figure.savefig(stream, dpi=150, format=path.suffix.lower().lstrip("."))
    return stream.getvalue()
