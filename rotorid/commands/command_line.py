"""The frame of the commands: parameters made of a dataclass of options, delivery of results, exit status.

A command is a function of a rotor, a job or data and of a dataclass of options that gives an outcome. On the
command line its docstring is the help; each parameter before `options` is an argument, or a required option
after the first, and each field of the dataclass an option, with the texts of their docstrings:

    number : -n N from 1
        How many critical speeds.

where words that begin with - are what is typed beside, or with two -- instead of, `--number`.
"""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import inspect
import io
import itertools
import json
import os
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, cast, get_origin

import typer

from rotorid.base.answer import LINES, kinds
from rotorid.commands.progress import busy
from rotorid.report.options import option_name
from rotorid.report.outcome import WITH_REPORT, Outcome, options_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.report.outcome import Written

_TYPES: dict[str, Any] = {"bool": bool, "int": int, "float": float, "Path": Path, "Amplitudes": list[str]}
"""What is typed, by the first alternative of an annotation; else one of a few words, or any text."""
PICTURES = (".png", ".svg", ".pdf")
TABLES = (".csv", ".xlsx")
Show = Literal["equations"]


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
        What was solved, in place of the answer.
    """

    json: bool = False
    table: bool = False
    plot: Path | None = None
    output: Path | None = None
    report: Path | None = None
    show: Show | None = None

    def deliver(self, what: str, work: Callable[[], Outcome], options: Any = None) -> None:  # noqa: ANN401
        """Do the work of a command, print its answer, and write its files, all of them or none.

        Parameters
        ----------
        what
            What takes so long, for the sign of life.
        work
            Gives the outcome.
        options
            Of a class that may have `outputs`: how the name of --output may end.

        Raises
        ------
        ValueError
            For a file that could not be written, before any work is done, and for one that was read.
        """
        from rotorid.files.disk import write_files
        from rotorid.files.input_problems import printable, refusal

        asked: list[tuple[Path | None, Sequence[str], Callable[[Outcome, Path], Written]]] = [
            (self.plot, PICTURES, lambda made, path: figure_bytes(made.figure(), path)),
            (self.output, getattr(options, "outputs", TABLES), lambda made, path: made.written(path)),
            (self.report, (".html",), lambda made, path: made.sheet()),
        ]
        check_targets([(path, endings) for path, endings, _ in asked])
        with busy(what):
            made = work()
        equations = made.equations if self.show else None
        built: dict[Path, bytes] = {}
        for path, _, build in asked:
            if path is not None:
                try:
                    file = build(made, path)
                except OSError as error:  # a workbook needs room for temporary files
                    raise refusal(path, f"a file that can be written ({error.strerror})") from error
                built |= file if isinstance(file, Mapping) else {path: file}
        check_inputs(built, [Path(entry["file"]) for entry in made.provenance["inputs"]])
        write_files(built)
        if self.json:
            document = made.document
            if self.output and "rotor" in document and self.output.suffix == ".toml":
                document["rotor"] = str(self.output)  # which `calibrate` has written
            if equations:
                document["equations"] = equations.to_dict()
            typer.echo(json_text(document))
            return
        answer = equations.answer(made.answer) if equations else made.answer
        text = answer.whole() if self.table else answer.brief(2 * LINES if equations else made.lines)
        typer.echo("\n".join([text, *(f"written: {printable(str(path))}" for path in built)]))


def check_targets(targets: Iterable[tuple[Path | None, Sequence[str]]]) -> None:
    """Refuse files that could not be written, with how their names may end, before any work is done."""
    for path, endings in targets:
        if path is None:
            continue
        folder, kind = path.parent, "a folder" if path.is_dir() else "no regular file"
        refused = {
            f"cannot write this kind of file; the name must end in {', '.join(endings)}": (
                path.suffix.lower() not in endings
            ),
            f"the folder {folder} does not exist": not folder.is_dir(),
            f"cannot be written, it is {kind}": path.exists() and not path.is_file(),
            "cannot be written, permission denied": not os.access(path if path.exists() else folder, os.W_OK),
        }
        if why := [words for words, holds in refused.items() if holds]:
            raise ValueError(f"{path}: {why[0]}")


def check_inputs(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Refuse to write a result over a file that was read for it."""
    for path, source in itertools.product(targets, inputs):
        there = path.exists() and source.exists()  # realpath: of a circle of links, too
        if path.samefile(source) if there else os.path.realpath(path) == os.path.realpath(source):
            raise ValueError(
                f"{path}: this is an input of the command, which must not be overwritten; choose another name"
            )


def json_text(document: Mapping[str, Any]) -> str:
    """A document as JSON; in plain ASCII where standard output cannot write more."""
    return json.dumps(
        document,
        ensure_ascii="utf" not in (getattr(sys.stdout, "encoding", None) or "utf-8").casefold(),
        allow_nan=False,
        indent=1,
    )


def figure_bytes(figure: Figure, path: Path) -> bytes:
    """A figure in the format that the name of its file asks for."""
    import matplotlib as mpl

    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "rotorid"}):  # the same ids each time
        figure.savefig(stream, dpi=150, format=path.suffix.lower().lstrip("."))
    return stream.getvalue()


def typer_command(work: Callable[..., Outcome]) -> Callable[..., None]:
    """The command of a function: its first parameter, lists of files and what may be left out are arguments.

    Others before `options` are required options; those after it are Python's alone. A class of options may
    have `panels` of the help, title by title with the options in each, and `to`, the fields of `Destination`;
    options that no panel names stand in Input. Its `before(*arguments)` may refuse what is typed, or do all
    that is asked.
    """
    kind, about = options_of(work), _documentation(work)
    every = list(inspect.signature(work).parameters.items())
    arguments = dict(every[: [name for name, _ in every].index("options")])
    to = getattr(kind, "to", WITH_REPORT)
    panels: Mapping[str, str] = getattr(kind, "panels", {})
    titles = {**panels, "Output": " ".join((*to, panels.get("Output", "")))}
    panel_of = {name: title for title, names in titles.items() for name in names.split()}
    first = [_argument(name, one, about[name], k) for k, (name, one) in enumerate(arguments.items())]
    options = [
        *_options(kind, panel_of),
        *(one for one in _options(Destination, panel_of) if one.name in to),
    ]
    order = ["", *panel_of]
    options.sort(key=lambda one: order.index(one.name if one.name in panel_of else ""))

    def run_command(**typed: Any) -> None:  # noqa: ANN401 - what typer has read
        from rotorid.files.cells import LARGEST_STATED
        from rotorid.files.disk import each_file_once

        for name, value in typed.items():  # squares of larger ones no computer holds
            if isinstance(value, float) and not abs(value) <= LARGEST_STATED:
                raise ValueError(
                    f"{option_name(name)} takes a number up to {LARGEST_STATED:g}, not {value:g}"
                )
        given = [typed.pop(name) for name in arguments]
        target, chosen = _taken(Destination, typed), _taken(kind, typed)
        with each_file_once():
            if hasattr(chosen, "before") and (answer := chosen.before(*given)):
                typer.echo(answer)
            else:
                target.deliver(work.__name__.replace("_", " "), lambda: work(*given, chosen), chosen)

    parameters = [*first, *options]
    run_command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run_command.__annotations__ = {one.name: one.annotation for one in parameters}
    return run_command


def _argument(name: str, one: inspect.Parameter, about: _Documented, place: int) -> inspect.Parameter:
    """A file, several, or a text; after the first a required option, unless it may be left out."""
    several = str(one.annotation).startswith(("Sequence[", "JobGiven"))
    first = several or not place or one.default is not one.empty
    taken: Any = Path if "Path" in str(one.annotation) and first else str
    declared = typer.Argument if first else typer.Option
    return _parameter(name, about, list[taken] if several else taken, one.default, declared)


def _options(kind: type, panel_of: Mapping[str, str]) -> Iterator[inspect.Parameter]:
    """One option for each field of a dataclass; what it chooses from is told in its help."""
    about, module = _documentation(kind), sys.modules[kind.__module__]
    for field in dataclasses.fields(kind):
        name, kind_of = field.name, str(field.type).partition(" | ")[0]
        alias = getattr(module, kind_of, str)
        taken = _TYPES.get(kind_of, alias if get_origin(alias) is Literal else str)
        default = inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default
        yield _parameter(
            name,
            about[name],
            taken,
            default,
            typer.Option,
            panel_of.get(name, "Input"),
            getattr(module, "choices", None),
        )


def _parameter(
    name: str,
    about: _Documented,
    taken: Any,  # noqa: ANN401 - a type
    default: object,
    declared: Any,  # noqa: ANN401 - of typer
    panel: str = "Input",
    choices: object = None,
) -> inspect.Parameter:
    flag = (option_name(name),) if taken is bool else ()  # without its --no-…
    default = None if default == () else default
    option = declared(
        *(about.flags or flag),
        metavar=about.metavar,
        help=about.text,
        min=about.least,
        rich_help_panel=None if declared is typer.Argument else panel,
    )
    annotation: Any = Annotated[taken if default is not None else taken | None, option, choices]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _taken(kind: type, given: dict[str, Any]) -> Any:  # noqa: ANN401 - of that kind
    """The dataclass made of its fields among what typer has read; lists as tuples."""
    values = {field.name: given.pop(field.name, None) for field in dataclasses.fields(kind)}
    return kind(
        **{name: tuple(v) if isinstance(v, list) else v for name, v in values.items() if v is not None}
    )


def written_help(of: Any) -> str:  # noqa: ANN401 - a function or a class
    """The docstring, which is the help; `python -OO` drops it, the file has it still."""
    if sys.flags.optimize < 2:
        return of.__doc__ or ""
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(of))).body
    return ast.get_docstring(cast("ast.FunctionDef | ast.ClassDef", definition)) or ""


class _Documented(NamedTuple):
    """How an option is typed, what of, from which number on, and what it is."""

    flags: tuple[str, ...]
    metavar: str | None
    least: float | None
    text: str


def _documentation(of: Any) -> dict[str, _Documented]:  # noqa: ANN401 - a function or a class
    """Of each parameter or attribute, from lines `name : FLAGS METAVAR from LEAST` and the indented below."""
    entries: dict[str, _Documented] = {}
    name = ""
    for line in inspect.cleandoc(written_help(of)).partition("----------\n")[2].splitlines():
        if line.startswith(" "):
            entries[name] = entries[name]._replace(text=f"{entries[name].text} {line.strip()}".strip())
        elif line:
            name, _, head = line.partition(" : ")
            typed, _, least = head.partition(" from ")
            flags = [word for word in typed.split() if word.startswith("-")]
            if flags and not any(flag.startswith("--") for flag in flags):
                flags.append(f"--{name.replace('_', '-')}")
            metavar = " ".join(word for word in typed.split() if not word.startswith("-"))
            entries[name] = _Documented(tuple(flags), metavar or None, float(least) if least else None, "")
    return entries


def run(app: Callable[[], object]) -> None:
    """Run a command line; the exit status is 2 for bad input or usage, with one message, no traceback."""
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
        text = f"{problem.filename or 'standard output'}: {problem.strerror}"
    with contextlib.suppress(OSError):  # nobody can read it
        print(f"rotorid: {_safe(text)}", file=sys.stderr)
    return 2


def _safe(text: str) -> str:
    """Text without control characters: names of files may hold any."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)
