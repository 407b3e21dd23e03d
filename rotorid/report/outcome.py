"""What a command gives, and what it is made of: input files with their hashes, options, date."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from rotorid.base.answer import COLUMNS, LINES, Answer, Answered
from rotorid.base.json import SCHEMA_VERSION, now
from rotorid.base.tables import Column, Table, csv, frame, terminal
from rotorid.base.text import capital, listing
from rotorid.report.options import changed, checked, plain

if TYPE_CHECKING:
    import pandas as pd
    from _typeshed import DataclassInstance
    from matplotlib.figure import Figure

    from rotorid.report.equations import Equations

_P = ParamSpec("_P")
_T = TypeVar("_T")
WITHOUT_FILE = ("plot", "table", "json")
USUAL = ("output", *WITHOUT_FILE)
WITH_REPORT = ("report", *USUAL)
EQUATIONS = ("show",)
"""Fields of `app.Destination` that a command has."""
Written = bytes | Mapping[Path, bytes]
"""A file, or several by their paths."""


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Outcome(Answered):
    """Sentences and tables; terminal, JSON, files and page are made of them.

    Attributes
    ----------
    result
        Of the library.
    sentences
        The decision first.
    tables, more
        Those of the answer, and those that only `--table` and the page show; a text is a table that is
        aligned already.
    beyond
        What `more` shows, in words; empty: the names of its tables.
    short
        Whether the first table is a short form of the first of `more`, which then stands for it.
    to_mount
        Whether the first table is what to mount, which is shown whole.
    file
        What `--output` writes and `to_frame` gives; a text: why there is none.
    files
        What makes other files of `--output`, by the ending of their name.
    keys
        The JSON document without its version and provenance.
    pictures
        What makes each, by its caption; the first is that of `--plot`.
    title, lines
        Heading of the page, and lines of the answer at most.
    warnings, notes
        Clauses without "Warning: " and "Note: ", the worst first.
    solved
        What `equations_of` shows in symbols and in numbers; None: nothing that could be shown.
    provenance
        Program version, input files with their hashes, date, and every option that differs from its default;
        of a command it follows from what that has read.
    """

    result: Any
    sentences: tuple[str, ...] = ()
    keys: Mapping[str, Any] | Callable[[], Mapping[str, Any]] = dataclasses.field(default_factory=dict)
    provenance: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    tables: tuple[Table | str, ...] = ()
    more: tuple[Table | str | Callable[[], str], ...] = ()
    beyond: str = ""
    short: bool = False
    to_mount: bool = False
    file: Table | Callable[[], Table] | str
    files: Mapping[str, Callable[[Path], Written]] = dataclasses.field(default_factory=dict)
    pictures: Mapping[str, Callable[[], Figure]] = dataclasses.field(default_factory=dict)
    title: str = ""
    lines: int = LINES
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    solved: object = None

    @property
    def answer(self) -> Answer:
        """What a terminal shows."""
        names = [table.name for table in self.more if isinstance(table, Table)]
        return Answer(
            "\n".join(self.sentences),
            "\n\n".join(map(aligned, self.tables)),
            self.warnings,
            self.notes,
            tuple(
                f"{capital(each.name)}:\n{aligned(each)}" if isinstance(each, Table) else each
                for each in self.more
            ),
            self.beyond or listing(names, "and"),
            self.short,
            self.to_mount,
        )

    @property
    def document(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {**self.to_dict(), "schema_version": SCHEMA_VERSION, "provenance": dict(self.provenance)}

    def summary(self) -> str:
        """For a terminal, a few lines of at most 100 columns."""
        return self.answer.brief(self.lines)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return dict(self.keys() if callable(self.keys) else self.keys)

    def table(self) -> Table:
        """The main table; ValueError where there is none."""
        if isinstance(self.file, str):
            raise ValueError(self.file)
        return self.file if isinstance(self.file, Table) else self.file()

    def to_frame(self) -> pd.DataFrame:
        """The main table."""
        return frame(self.table().columns)

    def written(self, path: Path) -> Written:
        """What `--output` writes to a file of this name."""
        for ending, build in self.files.items():
            if path.name.lower().endswith(ending):
                return build(path)
        if path.suffix.lower() != ".xlsx":
            return csv(self.table())
        from rotorid.base.tables import excel

        return excel(self.table())

    def figure(self) -> Figure:
        """The main picture; ValueError where there is none."""
        if not self.pictures:
            raise ValueError(self.file if isinstance(self.file, str) else "there is no picture of this")
        return next(iter(self.pictures.values()))()

    @property
    def equations(self) -> Equations:
        """What was solved, in symbols and in numbers; ValueError where nothing can be shown."""
        if self.solved is None:
            raise ValueError("--show equations: there is nothing here that was solved")
        from rotorid.report.equations_of_results import equations_of

        return equations_of(self.solved)

    def sheet(self) -> bytes:
        """To print or to send, one HTML file."""
        from rotorid.report.page import block, drawn, render_report

        if isinstance(self.file, str) and not self.pictures:
            raise ValueError(self.file)
        return render_report(
            "outcome.html",
            self.to_dict(),
            title=self.title,
            warnings=[*self.warnings, *self.notes],
            provenance=self.provenance,
            sentences=self.sentences,
            tables=list(map(block, self.tables)),
            pictures=[(drawn(draw, caption), caption) for caption, draw in self.pictures.items()],
            more=list(map(block, self.more)),
        )


def aligned(table: Table | str) -> str:
    """For a terminal."""
    return terminal(table, COLUMNS) if isinstance(table, Table) else table


def outcome_of(
    result: Any,  # noqa: ANN401 - any result that tells its answer
    provenance: Mapping[str, Any] | None = None,
    *,
    answer: Answer | None = None,
    **more: Any,  # noqa: ANN401 - fields of an outcome
) -> Outcome:
    """The outcome of a result that has `answer`, `to_dict`, `to_frame`, and perhaps `figure`."""
    shown = answer or result.answer
    draw = getattr(result, "figure", None)
    given: dict[str, Any] = {
        "sentences": tuple(shown.judgement.splitlines()),
        "tables": tuple(filter(None, [shown.numbers])),
        "more": shown.tables,
        "beyond": shown.more,
        "warnings": shown.warnings,
        "notes": shown.notes,
        "to_mount": shown.to_mount,
        "file": lambda: table_of(result.to_frame()),
        "pictures": {} if draw is None else {"": draw},
        "keys": getattr(result, "to_dict", None),
    }
    return Outcome(result=result, provenance=provenance or {}, **given | more)


def table_of(data: pd.DataFrame, name: str = "result") -> Table:
    """A DataFrame as a table; what pandas has as missing is unknown."""
    known = data.astype(object).where(data.notna(), None)
    return Table(name, tuple(Column(str(each), known[each].tolist()) for each in known))


def options_of(function: Callable[..., Any]) -> type[DataclassInstance]:
    """The dataclass of the options of a command."""
    annotation = str(inspect.signature(function).parameters["options"].annotation)
    kind: type[DataclassInstance] = inspect.unwrap(function).__globals__[annotation.partition(" | ")[0]]
    return kind


def command(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """Check its options first; while it works each file is read once: its hash is that of what was read.

    Its outcome gets the provenance of these files, with texts among its arguments that are no file.
    """
    signature, kind = inspect.signature(function), options_of(function)
    needed = signature.parameters["options"].default is inspect.Parameter.empty

    @functools.wraps(function)
    def wrapper(*args: _P.args, **kwargs: _P.kwargs) -> _T:
        from rotorid.files.disk import each_file_once

        given = signature.bind(*args, **kwargs)
        options = given.arguments.get("options")
        if options is not None or needed:
            given.arguments["options"] = options = checked(options, kind)
        with each_file_once() as files:
            made = function(*given.args, **given.kwargs)
            if not isinstance(made, Outcome) or made.provenance:
                return made
            names = [*map(str, files)]
            texts = {key: x for key, x in given.arguments.items() if isinstance(x, str) and x not in names}
            return dataclasses.replace(made, provenance=provenance(files, options or kind(), **texts))

    return wrapper


def provenance(
    files: Iterable[Path],
    options: DataclassInstance,
    **given: object,
) -> dict[str, Any]:
    """Program version, input files with their hashes, date, and options that differ from their defaults.

    What is `given` in place of files stands before the options.

    Raises
    ------
    InputError
        For a file that cannot be read.
    """
    from rotorid import __version__
    from rotorid.files.disk import sha256

    return {
        "program": "rotorid",
        "version": __version__,
        "date": now().isoformat(timespec="seconds"),
        "inputs": [{"file": str(f), "sha256": sha256(f)} for f in files],
        "options": {key: plain(value) for key, value in (given | changed(options)).items()},
    }
