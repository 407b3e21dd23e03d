"""Problems of an input file: messages with file, row and column, what was found and what was expected."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from rotorid.base.json import SCHEMA_VERSION

_T = TypeVar("_T")
STANDARD_INPUT = "-"
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
        return _line([self])


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


def refusal(
    path: Path | str,
    expected: str,
    row: int | None = None,
    column: str | None = None,
    value: str | None = None,
) -> InputError:
    """To be raised: one problem of a file."""
    return InputError([Problem(str(path), row, column, value, expected)])


class TableWarning(UserWarning):
    """Something in a file that is usable but that its owner should know."""


class Problems(list[Problem]):
    """Collects the problems of one or several files, to be raised together."""

    def add(
        self,
        expected: str,
        file: Path | str,
        row: int | None = None,
        column: str | None = None,
        value: str | None = None,
    ) -> None:
        """Note one problem."""
        self.append(Problem(str(file), row, column, value, expected))

    def need(self, value: _T | None) -> _T:
        """What was read; raises `InputError` where that is nothing, for which there is a problem then."""
        if value is None:
            self.stop()
            raise AssertionError("nothing and no problem")
        return value

    def refuse_newer(self, file: str, version: object) -> None:
        """Note a file of a later `schema_version`, which may mean something else, and what is none."""
        if isinstance(version, bool) or version not in range(1, SCHEMA_VERSION + 1):  # or 1.0, of a workbook
            expected = f"{SCHEMA_VERSION}: a file of a later version needs a newer rotorid"
            self.add(expected, file, None, "schema_version", str(version))

    def stop(self) -> None:
        """Raise `InputError` with all problems, file by file and row by row, if there are any."""
        if self:
            files = [problem.file for problem in self]
            raise InputError(
                sorted(dict.fromkeys(self), key=lambda one: (files.index(one.file), one.row or 0))
            )


def _message(problems: Sequence[Problem]) -> str:
    groups: dict[tuple[str, str | None, str], list[Problem]] = {}
    for one in problems:
        groups.setdefault((one.file, one.column, one.expected), []).append(one)
    parts = list[list[Problem]]()
    for group in groups.values():
        together = len(group) > FEW and all(one.row is not None for one in group)
        parts += [group] if together else [[one] for one in group]
    lines = [_line(part) for part in parts[:MOST_LINES]]
    left = sum(map(len, parts[MOST_LINES:]))
    return "\n".join([*lines, *([f"and {left} more problems"] if left else [])])


def _line(problems: Sequence[Problem]) -> str:
    """One problem, or the same one of several rows."""
    first = problems[0]
    place = ["standard input" if first.file == STANDARD_INPUT else printable(first.file)]
    rows = sorted({one.row for one in problems if one.row is not None})
    if len(rows) > 1 and rows[-1] - rows[0] >= len(rows):
        place.append(f"rows {', '.join(map(str, rows[:FEW]))} and others ({len(rows)} in all)")
    elif rows:
        place.append(f"rows {rows[0]}–{rows[-1]}" if len(rows) > 1 else f"row {rows[0]}")
    if first.column is not None:
        place.append(f"{'key' if first.file.endswith('.toml') else 'column'} {printable(first.column)}")
    values = list(dict.fromkeys(quote(one.value) for one in problems if one.value is not None))
    more = " and so on" if len(values) > FEW else ""
    there = f"found {', '.join(values[:FEW])}{more}, " if values else ""
    return f"{', '.join(place)}: {there}expected {first.expected}"


def printable(text: str) -> str:
    """Text for a message, with control characters written as escapes."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def quote(value: str) -> str:
    """A found value for a message: nothing, or the value in quotes, shortened, without control characters."""
    if not value:
        return "nothing (a blank)"
    shown = value if len(value) <= LONGEST_VALUE else value[: LONGEST_VALUE - 1] + "…"
    return repr(shown)
