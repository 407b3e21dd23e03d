"""Result of a workflow: a document with its provenance (version, hashes of files, options), text, table."""

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

from rotorid.base.answer import Answer, Answered, together
from rotorid.base.logs import workflows as log
from rotorid.base.versions import SCHEMA_VERSION, now
from rotorid.workflows.input_checks import changed, checked, plain

if TYPE_CHECKING:
    import pandas as pd
    from _typeshed import DataclassInstance
    from matplotlib.figure import Figure

    from fem import Rotor
    from rotorid.report.equations import Equations

_P = ParamSpec("_P")
_T = TypeVar("_T")


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Outcome(Answered):
    """What a workflow gives.

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

    def table_file(self, path: Path) -> bytes:
        """What `--output` writes to a file of this name."""
        from rotorid.tables.reader.table_writing import table_bytes

        return table_bytes(path, self.to_frame())

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
class Parts(Outcome):
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
    """One result of the library as it is; subclasses say which."""

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


def workflow(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """Check its options first; while it works each file is read once: its hash is that of what was read."""
    signature = inspect.signature(function)
    kind, _, rest = str(signature.parameters["options"].annotation).partition(" | ")

    @functools.wraps(function)
    def wrapper(*args: _P.args, **kwargs: _P.kwargs) -> _T:
        from rotorid.tables.reader.input_file import each_file_once

        given = signature.bind(*args, **kwargs)
        options = given.arguments.get("options")
        if options is not None or not rest:
            given.arguments["options"] = checked(options, function.__globals__[kind])
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
