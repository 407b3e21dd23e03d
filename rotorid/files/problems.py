"""Problems of an input file: messages with file, row and column, what was found and what was expected."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from rotorid.base.json import SCHEMA_VERSION
from rotorid.files.input_file import STANDARD_INPUT

_T = TypeVar("_T")
LONGEST_VALUE = 60
FEW = 3
"""So many equal complaints about a column stand alone; more share a line."""
MOST_LINES = 20
"""Of one message; a whole column in a wrong format needs no more."""


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a file.

    Attributes
    ----------
    file
        As the user named it; a sheet of a workbook is named too.
    row
        As a spreadsheet numbers rows: the first line is row 1, comment lines count.
    column
        Name of the column, or of the key in a `.toml` file.
    value
        What was found, `""` for a blank; None where nothing can be quoted.
    expected
        What should be there.
    """

    file: str
    row: int | None
    column: str | None
    value: str | None
    expected: str

    def __str__(self) -> str:
        rows = "" if self.row is None else f"row {self.row}"
        return _line(self, rows, () if self.value is None else (quote(self.value),))


class InputError(ValueError):
    """A file that cannot be used; the message lists its problems.

    Equal complaints about many rows of a column share a line, and a long list ends with a count.

    Attributes
    ----------
    problems
        All the `Problem`s, in the order of the message.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(_message(self.problems))


class TableWarning(UserWarning):
    """Something in a file that is usable but that its owner should know."""


class Problems:
    """Collects the problems of one or several files, to be raised together."""

    def __init__(self) -> None:
        self._items: list[Problem] = []

    def add(self, file: str, row: int | None, column: str | None, value: str | None, expected: str) -> None:
        """Note one problem."""
        self._items.append(Problem(file, row, column, value, expected))

    def extend(self, more: Iterable[Problem]) -> None:
        """Note those of another file, or of an `InputError`."""
        self._items.extend(more)

    def need(self, value: _T | None) -> _T:
        """What was read; raises `InputError` where that is nothing, for which there is a problem then."""
        if value is None:
            self.stop()
            raise AssertionError("nothing and no problem")
        return value

    def __iter__(self) -> Iterator[Problem]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def drop(self, file: str) -> None:
        """Forget those of a file."""
        self._items = [problem for problem in self._items if problem.file != file]

    def of(self, file: str) -> list[Problem]:
        """Problems of one file so far."""
        return [problem for problem in self._items if problem.file == file]

    def refuse_newer(self, file: str, version: object) -> None:
        """Note a file of a later `schema_version`, which may mean something else, and what is none."""
        if isinstance(version, bool) or version not in range(1, SCHEMA_VERSION + 1):  # or 1.0, of a workbook
            expected = f"{SCHEMA_VERSION}: a file of a later version needs a newer rotorid"
            self.add(file, None, "schema_version", str(version), expected)

    def stop(self) -> None:
        """Raise `InputError` with all problems, file by file and row by row, if there are any."""
        if not self._items:
            return
        files = list(dict.fromkeys(problem.file for problem in self._items))
        place = {file: number for number, file in enumerate(files)}
        unique = dict.fromkeys(self._items)
        raise InputError(sorted(unique, key=lambda problem: (place[problem.file], problem.row or 0)))


def _message(problems: tuple[Problem, ...]) -> str:
    groups: dict[tuple[str, str | None, str], list[Problem]] = {}
    for problem in problems:
        groups.setdefault((problem.file, problem.column, problem.expected), []).append(problem)
    lines: list[str] = []
    left = len(problems)
    for group in groups.values():
        together = len(group) > FEW and all(problem.row is not None for problem in group)
        for problem in () if len(lines) >= MOST_LINES or together else group[: MOST_LINES - len(lines)]:
            lines.append(str(problem))
            left -= 1
        if together and len(lines) < MOST_LINES:
            values = tuple(dict.fromkeys(quote(p.value) for p in group if p.value is not None))
            rows = sorted({problem.row for problem in group if problem.row is not None})
            first = f"{rows[0]}–{rows[-1]}"
            if rows[-1] - rows[0] >= len(rows):
                first = f"{', '.join(map(str, rows[:FEW]))} and others ({len(rows)} in all)"
            lines.append(_line(group[0], f"rows {first}", values))
            left -= len(group)
    return "\n".join([*lines, *([f"and {left} more problems"] if left else [])])


def _line(problem: Problem, rows: str, values: tuple[str, ...]) -> str:
    file = "standard input" if problem.file == STANDARD_INPUT else problem.file
    place = [printable(file), *([rows] if rows else [])]
    if problem.column is not None:
        what = "key" if problem.file.endswith(".toml") else "column"
        place.append(f"{what} {printable(problem.column)}")
    found = ""
    if values:
        found = f"found {', '.join(values[:FEW])}{' and so on' if len(values) > FEW else ''}, "
    return f"{', '.join(place)}: {found}expected {problem.expected}"


def printable(text: str) -> str:
    """Text for a message, with control characters written as escapes."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def quote(value: str) -> str:
    """A found value for a message: nothing, or the value in quotes, shortened, without control characters."""
    if not value:
        return "nothing (a blank)"
    shown = value if len(value) <= LONGEST_VALUE else value[: LONGEST_VALUE - 1] + "…"
    return repr(shown)
