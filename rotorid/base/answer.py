"""What a result tells: the judgement and the answer first, and the tables behind them.

Every command prints the `brief` text of its answer, which fits a terminal: at most `LINES` lines of at most
`COLUMNS` columns. What does not fit is counted, and `--table` prints the `whole`.

>>> answer = Answer(
...     "Mount these weights.",
...     "left 3 g at 20°",
...     warnings=("the weight in plane 'A' is small", "the weight in plane 'B' is small"),
...     tables=("  sensor   1.0",),
...     more="every sensor",
... )
>>> print(answer.brief())
Mount these weights.
<BLANKLINE>
left 3 g at 20°
<BLANKLINE>
Warning: the weight in plane 'A' is small
<BLANKLINE>
Every sensor: --table.
"""

from __future__ import annotations

import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from rotorid.base.text import capital, counted, cut

LINES, COLUMNS = 12, 100
_VARIABLE = re.compile(r"'[^']*'|[-+]?\d[\d.,]*(?:e[-+]?\d+)?")
"""What differs between two remarks of a kind: names and numbers."""
_QUANTITY = re.compile(r"(only |at most )?([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?= ?%| (?!rpm|Hz|rad/s)[^\W\d])")
"""A number with a unit, and words that make a small one worse; a speed only says where."""
_SIGN, _KEPT = re.compile(r"(?<=[±→]) "), "\u00a0"


@dataclass(frozen=True)
class Answer:
    """Text of a result, in the order of what matters.

    Attributes
    ----------
    judgement
        What to do, or what the data say, in a sentence or two.
    numbers
        The answer with its errors, and the few numbers that matter: lines of at most `COLUMNS` columns.
    warnings, notes
        Clauses without "Warning: " and "Note: ", the worst first.
    tables
        Blocks that only the whole text has, or what makes one.
    more
        What these show, in words.
    short
        Whether `numbers` is a short form of the first of these, which the whole text leaves out.
    to_mount
        Whether the first block of `numbers` is what to mount, which is shown whatever the room is.
    """

    judgement: str
    numbers: str = ""
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    tables: tuple[Any, ...] = ()
    more: str = ""
    short: bool = False
    to_mount: bool = False

    def brief(self, lines: int = LINES) -> str:
        """At most so many lines that are not blank; of each kind of remark one.

        Remarks of a kind are the same words with other names or numbers.
        """
        head, remarks = _wrapped(self.judgement), self._remarks(kinds)
        room = lines - len(head) - 3 - bool(remarks)  # blank lines, and where the rest is
        first = len(remarks[0]) if remarks else 0
        most = len(self.numbers) if self.to_mount else lines - len(head) - first - 1
        numbers, hidden = _shortened(_wrapped(self.numbers), room - first, most)
        fitting = sum(end <= room - len(numbers) for end in accumulate(map(len, remarks)))
        shown = remarks[: max(fitting, 1)]
        rest = [
            counted(hidden, "more line") if hidden else "",
            counted(others, "more remark") if (others := len(remarks) - len(shown)) else "",
            self.more if self.tables else "",
        ]
        where = cut(capital("; ".join(filter(None, rest))), COLUMNS - len(": --table."))
        blocks = (
            head,
            numbers,
            [line for remark in shown for line in remark],
            [f"{where}: --table."] if where else [],
        )
        return "\n\n".join("\n".join(block) for block in blocks if block)

    def whole(self) -> str:
        """Everything."""
        head = [self.judgement] if self.short else [self.judgement, self.numbers]
        lines = [*map(_wrapped, head), *self._remarks(tuple)]
        tables = (each() if callable(each) else each for each in self.tables)
        return "\n\n".join(filter(None, (*map("\n".join, lines), *tables)))

    def _remarks(self, chosen: Callable[[Iterable[str]], Iterable[str]]) -> list[list[str]]:
        """Lines of the chosen warnings, then of notes."""
        each = (("Warning", self.warnings), ("Note", self.notes))
        return [_wrapped(f"{word}: {clause}") for word, clauses in each for clause in chosen(clauses)]


class Answered(ABC):
    """A result that tells its answer; `summary` prints it."""

    @property
    @abstractmethod
    def answer(self) -> Answer:
        """The judgement and the answer first, and the tables behind them."""

    def summary(self) -> str:
        """For a terminal, a few lines of at most 100 columns."""
        return self.answer.brief()


def together(answers: Iterable[Answer]) -> Answer:
    """Answers beside each other as one: their judgements first."""
    each = list(answers)

    def joined(field: str, between: str) -> str:
        return between.join(filter(None, dict.fromkeys(getattr(one, field) for one in each)))

    def all_of(field: str) -> Any:  # noqa: ANN401
        return tuple(dict.fromkeys(words for one in each for words in getattr(one, field)))

    return Answer(
        joined("judgement", "\n"),
        joined("numbers", "\n\n"),
        all_of("warnings"),
        all_of("notes"),
        all_of("tables"),
        joined("more", "; "),
        to_mount=any(one.to_mount for one in each),
    )


def kinds(clauses: Iterable[str]) -> list[str]:
    """The worst clause of each kind, by its quantities (else the first).

    >>> kinds(["plane 'A': 3 g over", "plane 'B': 300 g over"])
    ["plane 'B': 300 g over"]
    >>> kinds(["line 3: no mass", "line 5: no mass", "no weight", "line 3: no mass"])
    ['line 3: no mass', 'no weight']
    """
    alike: dict[str, list[str]] = {}
    for clause in dict.fromkeys(clauses):
        alike.setdefault(_VARIABLE.sub("#", clause), []).append(clause)
    return [_worst(same).rstrip(".") for same in alike.values()]


def _worst(same: list[str]) -> str:
    """The clause whose first quantity that differs is the largest (after "only" the smallest)."""
    return max(
        same,
        key=lambda clause: [
            float(number) * (-1 if less else 1)
            for less, number in _QUANTITY.findall(re.sub(r"'[^']*'", "", clause))
        ],
    )


def _wrapped(words: str) -> list[str]:
    """Lines of at most `COLUMNS`; a sign stays beside its number."""
    parts: list[str] = []
    for line in words.splitlines():
        parts += textwrap.wrap(_SIGN.sub(_KEPT, line), COLUMNS, subsequent_indent="  ") or [""]
    return [part.replace(_KEPT, " ") for part in parts]


def _shortened(lines: list[str], room: int, most: int) -> tuple[list[str], int]:
    """As many lines as there is room for, and how many others there are.

    A block that does not fit is left out whole, of the first at most so many lines are shown.
    """
    if len(lines) <= room:
        return lines, 0
    ends = [k for k, line in enumerate(lines) if not line] or [len(lines)]
    shown = max([min(ends[0], max(room, most)), *(end for end in ends if end <= room)])
    return lines[:shown], sum(map(bool, lines[shown:]))
