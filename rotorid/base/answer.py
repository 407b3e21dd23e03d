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
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

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
        What to do, or what was found, in a sentence or two.
    found
        The answer with its errors, and the few numbers that matter: lines of at most `COLUMNS` columns.
    warnings, notes
        Clauses without "Warning: " and "Note: ", the worst first.
    tables
        Blocks that only the whole text has.
    more
        What these show, in words.
    short
        Whether `found` is a short form of the first of these, which the whole text leaves out.
    to_mount
        Whether the first block of `found` is what to mount, which is shown whatever the room is.
    """

    judgement: str
    found: str = ""
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()
    more: str = ""
    short: bool = False
    to_mount: bool = False

    def brief(self, lines: int = LINES) -> str:
        """At most so many lines that are not blank; of each kind of remark one.

        Remarks of a kind are the same words with other names or numbers.
        """
        head = _wrapped(self.judgement.splitlines())
        remarks = [_remark("Warning", one) for one in kinds(self.warnings)]
        remarks += [_remark("Note", one) for one in kinds(self.notes)]
        room = lines - len(head) - 3 - bool(remarks)  # blank lines, and where the rest is
        remark = max(map(len, remarks[:1]), default=0)
        most = len(self.found) if self.to_mount else lines - len(head) - remark - 1
        found, hidden = _first(_wrapped(self.found.splitlines()), room - remark, most)
        told, untold = _fitting(remarks, room - len(found))
        more = self.more if len(self.more) < COLUMNS // 2 else "the tables"
        left = [hidden, counted(untold, "more remark") if untold else "", more if self.tables else ""]
        rest = cut(capital("; ".join(part for part in left if part)), COLUMNS - len(": --table."))
        return _joined(head, found, told, [f"{rest}: --table."] if rest else [])

    def whole(self) -> str:
        """Everything."""
        remarks = [_remark("Warning", each) for each in self.warnings]
        remarks += [_remark("Note", each) for each in self.notes]
        head = (self.judgement,) if self.short else (self.judgement, self.found)
        first = (_wrapped(part.splitlines()) for part in head)
        parts = (*map("\n".join, [*first, *remarks]), *self.tables)
        return "\n\n".join(part for part in parts if part)


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
    return Answer(
        "\n".join(one.judgement for one in each if one.judgement),
        "\n\n".join(one.found for one in each if one.found),
        tuple(dict.fromkeys(warning for one in each for warning in one.warnings)),
        tuple(dict.fromkeys(note for one in each for note in one.notes)),
        tuple(table for one in each for table in one.tables),
        "; ".join(dict.fromkeys(one.more for one in each if one.tables)),
        to_mount=any(one.to_mount for one in each),
    )


def kinds(clauses: Iterable[str]) -> list[str]:
    """The worst clause of each kind, by its quantities (else the first).

    >>> kinds(["plane 'A': 3 g over", "plane 'B': 300 g over"])
    ["plane 'B': 300 g over"]
    >>> kinds(["line 3: no mass", "line 5: no mass", "no weight", "line 3: no mass"])
    ['line 3: no mass', 'no weight']
    """
    found: dict[str, list[str]] = {}
    for clause in dict.fromkeys(clauses):
        found.setdefault(_VARIABLE.sub("#", clause), []).append(clause)
    return [_worst(same).rstrip(".") for same in found.values()]


def _worst(same: list[str]) -> str:
    """The clause whose quantity that differs most, in ratio, is the largest (after "only" the smallest)."""
    each = [_QUANTITY.findall(re.sub(r"'[^']*'", "", clause)) for clause in same]
    worst, most = same[0], 1.0
    for column in zip(*each, strict=False):
        sizes = [max(abs(float(number)), 1e-300) ** (-1 if less else 1) for less, number in column]
        if max(sizes) / min(sizes) > most:
            worst, most = same[sizes.index(max(sizes))], max(sizes) / min(sizes)
    return worst


def _remark(word: str, clause: str) -> list[str]:
    return _wrapped([f"{word}: {clause}"])


def _wrapped(lines: Iterable[str]) -> list[str]:
    """Lines of at most `COLUMNS`; a sign stays beside its number."""
    kept = (_SIGN.sub(_KEPT, line) for line in lines)
    parts = [part for line in kept for part in textwrap.wrap(line, COLUMNS, subsequent_indent="  ") or [""]]
    return [part.replace(_KEPT, " ") for part in parts]


def _first(lines: list[str], room: int, most: int) -> tuple[list[str], str]:
    """As many lines as there is room for, and words for the others.

    A block that does not fit is left out whole, of the first at most so many lines are shown.
    """
    if len(lines) <= room:
        return lines, ""
    ends = [k for k, line in enumerate(lines) if not line] or [len(lines)]
    shown = lines[: max([min(ends[0], max(room, most)), *(end for end in ends if end <= room)])]
    return shown, counted(hidden, "more line") if (hidden := sum(map(bool, lines[len(shown) :]))) else ""


def _fitting(remarks: Sequence[list[str]], room: int) -> tuple[list[str], int]:
    """The first remarks that fit, at least one, and how many are left."""
    told: list[str] = []
    for k, remark in enumerate(remarks):
        if k and len(told) + len(remark) > room:
            return told, len(remarks) - k
        told += remark
    return told, 0


def _joined(*blocks: Sequence[str]) -> str:
    return "\n\n".join("\n".join(block) for block in blocks if block)
