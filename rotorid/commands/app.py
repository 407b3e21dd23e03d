"""The frame of the commands: parameters made of a dataclass of options, delivery of results, exit status.

A command is a function of a rotor, a job or data and of a dataclass of options that gives an outcome. On the
command line its docstring is the help; each parameter before `options` is an argument, or a required option
after the first, and each field of the dataclass an option, with the texts of their docstrings:

    number : -n N
        How many critical speeds.

where words that begin with - are what is typed beside, or with two -- instead of, `--number`.
"""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import functools
import inspect
import io
import json
import os
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    NamedTuple,
    TypeVar,
    cast,
    get_origin,
    get_type_hints,
)

import typer
from typer.models import OptionInfo

from rotorid.base.answer import LINES, kinds
from rotorid.commands.progress import busy
from rotorid.report.outcome import USUAL, WITH_REPORT, Delivered, options_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_R = TypeVar("_R", bound=Delivered)
Command = Callable[..., None]
INPUT, OUTPUT = "Input", "Output"
RotorArgument = Annotated[
    Path,
    typer.Argument(metavar="ROTOR", help="Rotor table (.csv, .xlsx) or rotor file (.toml)."),
]
_TYPES: dict[str, Any] = {"bool": bool, "int": int, "float": float, "Path": Path, "Amplitudes": list[str]}
"""What is typed, by the first alternative of an annotation; else one of a few words, or any text."""
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
        endings: Sequence[str] = TABLES,
        more: Sequence[tuple[Path | None, Sequence[str], Callable[[_R], bytes | Mapping[Path, bytes]]]] = (),
    ) -> _R:
        """Do the work of a command, print what it result, and write its files, all of them or none.

        Parameters
        ----------
        what
            What takes so long, for the sign of life.
        work
            Gives the result.
        draw
            Makes the picture; default: the result's main one.
        endings
            Of the name of the table.
        more
            Further files, how their names may end, and what makes them; or makes several, by their paths.

        Raises
        ------
        ValueError
            For a file that could not be written, before any work is done, and for one that was read.
        """
        from rotorid.commands.verbose import note
        from rotorid.tables.reader.problems import printable
        from rotorid.tables.reader.table_writing import write_files

        if self.latex and (self.show is None or self.json or self.table):
            raise ValueError("--latex belongs to --show equations, without --json or --table")
        plot, output = self.plot, self.output
        files: list[tuple[Path | None, Sequence[str], Callable[[_R], bytes | Mapping[Path, bytes]]]] = [
            (plot, PICTURES, lambda r: figure_bytes(draw(r) if draw else r.figure(), plot or Path())),
            (output, endings, lambda r: r.table_file(output or Path())),
            *more,
            (self.report, (".html",), lambda r: r.sheet()),
        ]
        check_targets([(path, endings) for path, endings, _ in files])
        with busy(what):
            result = work()
        equations = result.equations if self.show else None
        document = result.document
        if equations:
            document["equations"] = equations.to_dict()
        note(document)
        targets = {path: build for path, _, build in files if path is not None}
        built: dict[Path, bytes] = {}
        for path, build in targets.items():
            made = build(result)
            built |= made if isinstance(made, Mapping) else {path: made}
        check_inputs(built, [Path(entry["file"]) for entry in document["provenance"]["inputs"]])
        write_files(built)
        if self.json:
            typer.echo(json_text(document))
        else:
            written = [f"written: {printable(str(path))}" for path in built]
            answer = equations.answer(result.answer) if equations else result.answer
            text = answer.whole() if self.table else answer.brief(LINES - len(written))
            typer.echo("\n".join([equations.latex() if equations and self.latex else text, *written]))
        return result


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


def command(
    options: type | None = None,
    *,
    names: Mapping[str, Sequence[str]] | None = None,
    least: Mapping[str, float] | None = None,
    panels: Mapping[str, str] | None = None,
    to: Sequence[str] = USUAL,
) -> Callable[[Command], Command]:
    """Replace the parameters `options` and `to` of a command by one for each field of these dataclasses.

    Their help and their metavar are the documentation of the dataclass, field by field, their names and
    defaults those of the fields.

    Parameters
    ----------
    options
        The dataclass of the workflow's options; None for a command without.
    names
        What is typed instead of `--field`.
    least
        The least value of a number.
    panels
        Of the help, in their order: title, and the options in it, the common ones first. Options that are
        not named stand in `INPUT`, before these, or in `OUTPUT` (those of `to`).
    to
        Which fields of `Destination` the command has.
    """
    fields = [] if options is None else [*_parameters(options, names or {}, least or {})]
    where = [one for one in _parameters(Destination, {}, {}) if one.name in to]

    def decorate(function: Command) -> Command:
        hints = get_type_hints(function, include_extras=True)
        parameters: list[inspect.Parameter] = []
        for name, parameter in inspect.signature(function).parameters.items():
            expanded = {"options": fields, "to": where}.get(name)
            parameters += [parameter.replace(annotation=hints[name])] if expanded is None else expanded

        @functools.wraps(function)
        def wrapper(**given: Any) -> None:  # noqa: ANN401 - what typer has read
            if options is not None:
                given["options"] = _taken(options, given)
            given["to"] = _taken(Destination, given)
            function(**given)

        wrapper.__doc__ = written_help(function)
        only = inspect.Parameter.KEYWORD_ONLY
        parameters = _in_panels([parameter.replace(kind=only) for parameter in parameters], panels or {}, to)
        wrapper.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        wrapper.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return wrapper

    return decorate


def typer_command(work: Callable[..., Delivered]) -> Command:
    """The command of a function: its first parameter, lists of files and what may be left out are arguments.

    Others before `options` are required options; those after it are Python's alone. A class of options may
    have `writes`: names of those that take a file, and how its name may end, which the outcome's
    `further_file` makes; and `before(*arguments)`, which may refuse what is typed, or do all that is asked.
    """
    kind = options_of(work)
    about = _documentation(work)
    every = list(inspect.signature(work).parameters.items())
    given = dict(every[: [name for name, _ in every].index("options")])
    further: Mapping[str, Sequence[str]] = getattr(kind, "writes", {})

    def deliver(options: Any, to: Destination, **values: Any) -> None:  # noqa: ANN401 - of that kind
        what = work.__name__.replace("_", " ")
        arguments = [values[name] for name in given]
        if hasattr(options, "before") and (answer := options.before(*arguments)):
            typer.echo(answer)
            return
        to.deliver(
            what,
            lambda: work(*arguments, options),
            endings=getattr(kind, "outputs", TABLES),
            more=[(getattr(options, name), ends, _further(options, name)) for name, ends in further.items()],
        )

    hints: dict[str, Any] = {}
    parameters = []
    for name, one in given.items():
        told: dict[str, Any] = {"metavar": about[name].metavar, "help": about[name].text}
        files = str(one.annotation).startswith(("Sequence[Path", "JobGiven"))
        first = files or not hints or one.default is not one.empty
        declared = typer.Argument(**told) if first else typer.Option(f"--{name}", **told)
        taken: Any = Path if "Path" in str(one.annotation) and first else str
        taken = list[Path] if files else taken
        hints[name] = Annotated[taken if one.default is one.empty else taken | None, declared]
        default = None if one.default == () else one.default
        parameters.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default))
    parameters += [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY) for name in ("options", "to")]
    deliver.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    deliver.__annotations__ = hints
    made = command(kind, panels=getattr(kind, "panels", {}), to=getattr(kind, "to", WITH_REPORT))(deliver)
    made.__doc__ = inspect.cleandoc(written_help(work)).partition("Parameters\n")[0]
    return made


def _further(options: Any, name: str) -> Callable[[Delivered], bytes | Mapping[Path, bytes]]:  # noqa: ANN401
    """What makes a further file."""
    return lambda result: result.further_file(name, Path(getattr(options, name)))


def _in_panels(
    parameters: Sequence[inspect.Parameter], panels: Mapping[str, str], to: Sequence[str]
) -> list[inspect.Parameter]:
    """Arguments, then options, panel by panel."""
    titles = {**panels, OUTPUT: " ".join((*to, panels.get(OUTPUT, "")))}
    panel_of = {name: title for title, names in titles.items() for name in names.split()}
    order = list(panel_of)
    for parameter in parameters:
        declared = parameter.annotation.__metadata__[0]
        if isinstance(declared, OptionInfo):
            declared.rich_help_panel = panel_of.get(parameter.name, INPUT)
    return sorted(parameters, key=lambda one: order.index(one.name) if one.name in panel_of else -1)


def _taken(kind: type, given: dict[str, Any]) -> Any:  # noqa: ANN401 - of that kind
    """The dataclass made of its fields among what typer has read; lists as tuples."""
    values = {}
    for field in dataclasses.fields(kind):
        value = given.pop(field.name, None)
        values[field.name] = (
            field.default if value is None else tuple(value) if isinstance(value, list) else value
        )
    return kind(**values)


def _parameters(
    kind: type, names: Mapping[str, Sequence[str]], least: Mapping[str, float]
) -> Iterator[inspect.Parameter]:
    """One option for each field of a dataclass."""
    about = _documentation(kind)
    choices = getattr(sys.modules[kind.__module__], "choices", None)
    for field in dataclasses.fields(kind):
        name, written = field.name, about[field.name]
        taken = _type(kind, str(field.type))
        flag = (f"--{name.replace('_', '-')}",) if taken is bool else ()  # without its --no-…
        typed = names.get(name, written.flags or flag)
        low = least.get(name, written.least)
        option = typer.Option(*typed, metavar=written.metavar, help=written.text, min=low)
        default = None if field.default == () else field.default
        if field.default is dataclasses.MISSING:
            default = inspect.Parameter.empty
        annotation: Any = Annotated[taken if default is not None else taken | None, option, choices]
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _type(kind: type, annotation: str) -> Any:  # noqa: ANN401 - a type, for typer
    first = annotation.partition(" | ")[0]
    if first in _TYPES:
        return _TYPES[first]
    alias = getattr(sys.modules[kind.__module__], first, str)
    return alias if get_origin(alias) is Literal else str


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
        text = f"{problem.filename}: {problem.strerror}" if problem.filename else problem.strerror
    with contextlib.suppress(OSError):  # nobody can read it
        print(f"rotorid: {_safe(text)}", file=sys.stderr)
    return 2


def _safe(text: str) -> str:
    """Text without control characters: names of files may hold any."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)
