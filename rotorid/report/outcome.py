"""What a command gives, and what it is made of: input files with their hashes, options, time."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import time
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from rotorid.base.answer import COLUMNS, Answer, Answered, together
from rotorid.base.logs import workflows as log
from rotorid.base.tables import Table, file_bytes, frame, terminal
from rotorid.base.text import capital, listing
from rotorid.base.versions import SCHEMA_VERSION, now
from rotorid.report.options import changed, checked, plain

if TYPE_CHECKING:
    import pandas as pd
    from _typeshed import DataclassInstance
    from matplotlib.figure import Figure

    from fem import Rotor
    from rotorid.report.equations import Equations

_P = ParamSpec("_P")
_T = TypeVar("_T")
USUAL = ("plot", "output", "table", "json")
WITH_REPORT = ("report", *USUAL)
EQUATIONS = ("show", "latex")
"""Fields of `app.Destination` that a command has."""


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Delivered(Answered):
    """What a command gives: what `Destination.deliver` takes.

    Attributes
    ----------
    provenance
        Program version, input files with their hashes, date, and every option that differs from its default.
    """

    provenance: Mapping[str, Any]

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""

    @abstractmethod
    def to_frame(self) -> pd.DataFrame:
        """The main table."""

    def table_file(self, path: Path) -> bytes | Mapping[Path, bytes]:
        """What `--output` writes to a file of this name, or several files by their paths."""
        from rotorid.tables.reader.table_writing import table_bytes

        return table_bytes(path, self.to_frame())

    def further_file(self, option: str, path: Path) -> bytes | Mapping[Path, bytes]:
        """What another option that takes a file writes: `writes` of the options."""
        raise ValueError(f"{type(self).__name__} has no file for {option}")

    @property
    def equations(self) -> Equations:
        """What was solved, in symbols and in numbers."""
        raise ValueError(f"{type(self).__name__} has no equations")

    def figure(self) -> Figure:
        """The main picture."""
        raise ValueError(f"{type(self).__name__} has no picture")

    def sheet(self) -> bytes:
        """To print or to send, one HTML file."""
        raise ValueError(f"{type(self).__name__} has no sheet")

    @property
    def document(self) -> dict[str, Any]:
        """What `--json` prints."""
        return {**self.to_dict(), "schema_version": SCHEMA_VERSION, "provenance": dict(self.provenance)}


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Outcome(Delivered):
    """Sentences and tables; terminal, JSON, files and page are made of them.

    Attributes
    ----------
    result
        Of the library.
    sentences
        The decision first.
    tables, more
        Those of the answer, and those that only `--table` and the page show.
    file, behind
        What `--output` writes and `to_frame` gives; numbers that only the page shows.
    keys
        The JSON document without its version and provenance.
    pictures
        What makes each, by its caption; the first is that of `--plot`.
    title, rotor
        Of the page, if there is one: its heading, and what `rotor_description.rotor_sheet` takes.
    warnings, notes
        Clauses without "Warning: " and "Note: ", the worst first.
    """

    result: Any
    sentences: tuple[str, ...]
    tables: tuple[Table, ...]
    file: Table
    keys: Mapping[str, Any]
    pictures: Mapping[str, Callable[[], Figure]]
    title: str = ""
    rotor: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    more: tuple[Table, ...] = ()
    behind: tuple[Table, ...] = ()
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def answer(self) -> Answer:
        """What a terminal shows."""
        return Answer(
            "\n".join(self.sentences),
            "\n\n".join(terminal(table, COLUMNS) for table in self.tables),
            self.warnings,
            self.notes,
            tuple(f"{capital(table.name)}:\n{terminal(table, COLUMNS)}" for table in self.more),
            listing([table.name for table in self.more], "and"),
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        return dict(self.keys)

    def to_frame(self) -> pd.DataFrame:
        """The main table."""
        return frame(self.file)

    def table_file(self, path: Path) -> bytes:
        """What `--output` writes to a file of this name."""
        return file_bytes(path, self.file)

    def figure(self) -> Figure:
        """The picture."""
        return next(iter(self.pictures.values()))()

    def sheet(self) -> bytes:
        """To print or to send, one HTML file."""
        from rotorid.report.rotor import rotor_page

        return rotor_page(
            self.keys,
            self.provenance,
            title=self.title,
            sentences=self.sentences,
            notes=self.notes,
            tables=(self.tables, (*self.more, *self.behind)),
            pictures=self.pictures,
            rotor=self.rotor,
        )


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Parts(Delivered):
    """Results of the library beside each other."""

    @property
    @abstractmethod
    def parts(self) -> Mapping[str, Any]:
        """Results by their keys in the document, where "" is its top; None: not asked for."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        known = {key: part.to_dict() for key, part in self.parts.items() if part is not None}
        return {**known.pop("", {}), **known}

    @property
    def equations(self) -> Equations:
        """Those of the first."""
        from rotorid.report.equations_of_results import equations_of

        return equations_of(next(iter(self.parts.values())))

    @property
    def answer(self) -> Answer:
        """Those of the parts, one after the other."""
        return together(part.answer for part in self.parts.values() if part is not None)

    def to_frame(self) -> pd.DataFrame:
        """The table of the first."""
        frame: pd.DataFrame = next(iter(self.parts.values())).to_frame()
        return frame


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Found(Parts):
    """One result of the library as it is."""

    found: Any

    @property
    def parts(self) -> Mapping[str, Any]:
        """That one."""
        return {"": self.found}

    def figure(self) -> Figure:
        """Its picture."""
        from rotorid.base.plot_style import on_figure
        from rotorid.plots import plot

        return on_figure(lambda ax: plot(self.found, ax))


def options_of(function: Callable[..., Any]) -> type[DataclassInstance]:
    """The dataclass of the options of a command."""
    annotation = str(inspect.signature(function).parameters["options"].annotation)
    kind: type[DataclassInstance] = inspect.unwrap(function).__globals__[annotation.partition(" | ")[0]]
    return kind


def command(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """Check its options first; while it works each file is read once: its hash is that of what was read."""
    signature, kind = inspect.signature(function), options_of(function)
    needed = signature.parameters["options"].default is inspect.Parameter.empty

    @functools.wraps(function)
    def wrapper(*args: _P.args, **kwargs: _P.kwargs) -> _T:
        from rotorid.tables.reader.input_file import each_file_once

        given = signature.bind(*args, **kwargs)
        options = given.arguments.get("options")
        if options is not None or needed:
            given.arguments["options"] = checked(options, kind)
        with each_file_once():
            return function(*given.args, **given.kwargs)

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

    return {
        "program": "rotorid",
        "version": __version__,
        "date": now().isoformat(timespec="seconds"),
        "inputs": [{"file": str(f), "sha256": hash_of(f)} for f in files],
        "options": {key: plain(value) for key, value in (given | changed(options)).items()},
    }


def hash_of(file: Path) -> str:
    """SHA-256 of a file."""
    from rotorid.tables.reader.input_file import sha256

    return sha256(file)


def text_of(file: object) -> str:
    """Text of a file that was read; nothing, where what was given is none."""
    from rotorid.tables.reader.input_file import file_content

    return file_content(Path(file)).decode("utf-8-sig", "replace") if isinstance(file, Path | str) else ""


@contextmanager
def phase(what: str) -> Iterator[None]:
    """Log how long a part of the work takes."""
    begun = time.perf_counter()
    yield
    log.info("time: %s %.3f s", what, time.perf_counter() - begun)


def log_rotor(rotor: Rotor, **more: object) -> None:
    """Log how large the model of a rotor is, and more numbers."""
    stride = 4 if rotor.model.shear else 2
    sizes: dict[str, object] = {
        "elements": rotor.n_elements,
        "unknowns_per_plane": 2 * rotor.n_nodes + (stride - 2) * rotor.n_elements,
        "discs": len(rotor.discs),
        "supports": len(rotor.supports),
    }
    for name, value in (sizes | more).items():
        log.info("%s = %s", name, f"{value:.6g}" if isinstance(value, float) else value)
