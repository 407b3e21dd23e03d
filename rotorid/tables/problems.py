"""Every complaint about an input file: what was found where, and what was expected."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

LONGEST_VALUE = 60


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
        place = [self.file]
        if self.row is not None:
            place.append(f"row {self.row}")
        if self.column is not None:
            place.append(f"{'key' if self.file.endswith('.toml') else 'column'} {self.column}")
        found = "" if self.value is None else f"found {quote(self.value)}, "
        return f"{', '.join(place)}: {found}expected {self.expected}"


class InputError(ValueError):
    """A file that cannot be used; the message lists all its problems, one line each.

    Attributes
    ----------
    problems
        The `Problem`s, in the order of the message.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class TableWarning(UserWarning):
    """Something in a file that is usable but that its owner should know."""


class Problems:
    """Collects the problems of one or several files, to be raised together."""

    def __init__(self) -> None:
        self._items: list[Problem] = []

    def add(self, file: str, row: int | None, column: str | None, value: str | None, expected: str) -> None:
        """Note one problem."""
        self._items.append(Problem(file, row, column, value, expected))

    def __len__(self) -> int:
        return len(self._items)

    def of(self, file: str) -> list[Problem]:
        """Problems of one file so far."""
        return [problem for problem in self._items if problem.file == file]

    def stop(self) -> None:
        """Raise `InputError` with all problems, file by file and row by row, if there are any."""
        if not self._items:
            return
        files = list(dict.fromkeys(problem.file for problem in self._items))
        unique = dict.fromkeys(self._items)
        raise InputError(sorted(unique, key=lambda problem: (files.index(problem.file), problem.row or 0)))


def quote(value: str) -> str:
    """A found value for a message: nothing, or the value in quotes, shortened, without control characters."""
    if not value:
        return "nothing (a blank)"
    shown = value if len(value) <= LONGEST_VALUE else value[: LONGEST_VALUE - 1] + "…"
    return repr(shown)


def suggest(name: str, known: Iterable[str]) -> str | None:
    """The known name nearest to a misspelt one, or None."""
    names = list(known)
    folded = {candidate.casefold(): candidate for candidate in reversed(names)}
    longer = next(
        (candidate for candidate in names if candidate.casefold().startswith(f"{name.casefold()}_")), None
    )
    if longer is not None:
        return longer  # only the unit is missing
    close = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.6)
    return folded[close[0]] if close else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """`" (did you mean 'x'?)"`, or an empty text."""
    near = suggest(name, known)
    return f" (did you mean {near!r}?)" if near else ""


def listing(names: Iterable[str], conjunction: str = "or") -> str:
    """`a, b or c`."""
    items = list(names)
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {conjunction} {items[-1]}"
