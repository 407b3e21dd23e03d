"""The proof: every printed number of the references beside what the program computes now.

`validate()` asks each provider (`PROVIDERS`, a module each) for its rows.
Nothing is stored but what is printed; all else is computed by the public functions when it is asked for.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from rotorid.base.answer import Answer
from rotorid.base.text import listing, sentence
from rotorid.validation.row import AGREES, CONSEQUENCE, DIFFERS, ERRATUM, GIVEN, Row, Status, row, tables
from rotorid.workflows.result_provenance import Outcome, provenance

if TYPE_CHECKING:
    import pandas as pd

Key = TypeVar("Key", bound=Hashable)

__all__ = ["Group", "Row", "Status", "ValidateOptions", "Validation", "row", "validate"]

PROVIDERS = {
    "rotor": "Rotor of 23 elements: critical speeds and mode shapes",
    "masses": "Equivalent masses of that rotor, formula (50)",
    "lessons": "Coefficients from amplitudes, frequencies and shapes",
    "formulas": "Misprinted equations, at the true solution",
    "closed_forms": "Closed forms: seal, damping, several speeds",
    "time_records": "Parameters from time records",
    "balancing": "Published balancing examples",
}
NAMES = tuple(PROVIDERS)
WIDTH = 100
HEADS = dict(zip(get_args(Status), ("agree", "misprint", "follow", "differ", "given"), strict=True))
"""Every status with the head of its column."""
SELECTED = "{} numbers of [F], whose print is damaged, were selected by agreement: consistent, but no proof"


@dataclass(frozen=True)
class Group:
    """Rows that belong together.

    Attributes
    ----------
    name, title
        In one word, and in words.
    rows
        In the order of their source.
    failure
        Why they could not be computed; empty if they were.
    """

    name: str
    title: str
    rows: tuple[Row, ...]
    failure: str = ""

    def sources(self) -> dict[str, list[Row]]:
        """Rows by where they are printed."""
        return _by(self.rows, lambda r: r.source)


@dataclass(frozen=True)
class ValidateOptions:
    """Options of `validate`.

    Attributes
    ----------
    every
        Every number, too; with all tables.
    """

    every: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Validation(Outcome):
    """Printed and computed numbers.

    Attributes
    ----------
    groups
        In the order of reading.
    every
        Whether the summary has every row, too.
    """

    groups: tuple[Group, ...]
    every: bool = False

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows."""
        return tuple(r for group in self.groups for r in group.rows)

    @property
    def counts(self) -> dict[Status, int]:
        """How many rows have each status."""
        return _counts(self.rows)

    @property
    def holds(self) -> bool:
        """Whether no row differs and no group failed."""
        return not self.counts[DIFFERS] and not any(group.failure for group in self.groups)

    @property
    def last_line(self) -> str:
        """The result in one line."""
        n = self.counts
        failed = listing([repr(group.name) for group in self.groups if group.failure], "and")
        return (
            f"{sum(n.values()) - n[GIVEN]} numbers can fail: {n[AGREES]} agree, {n[ERRATUM]} misprints, "
            f"{n[CONSEQUENCE]} consequences, {n[DIFFERS]} differ; {n[GIVEN]} given, not counted"
        ) + (f"; not computed: {failed}" if failed else "")

    @property
    def answer(self) -> Answer:
        """Whether every number holds, and what differs; behind it sources, misprints and wide tolerances."""
        said = "Every printed number is met, or is known as a misprint, or as what follows from one."
        differ = [r for r in self.rows if r.status == DIFFERS]
        failed = [
            f"{group.title}: FAILED, none of its numbers was computed: {group.failure}"
            for group in self.groups
            if group.failure
        ]
        selected = sum(r.kind == "selected" for r in self.rows)
        wide = [r for r in self.rows if r.reason]
        wrong = [r for r in self.rows if r.status in (ERRATUM, CONSEQUENCE)]
        chapters = (
            self._sources(),
            _chapter("Misprints, and what follows from them", wrong, _erratum),
            _chapter("Tolerances other than half a unit of the last printed digit", wide, _tolerance),
        )
        return Answer(
            f"{said if self.holds else 'NOT every printed number is met.'}\n{self.last_line}.",
            "\n".join([*failed, *_chapter("Differ", differ, _difference)]),
            notes=(SELECTED.format(selected),) if selected else (),
            tables=(*("\n".join(lines) for lines in chapters if lines), f"{self.last_line}."),
            more="every source, misprints, wide tolerances",
        )

    def _sources(self) -> list[str]:
        """A line for each source, and where asked for each number."""
        width = max([len(source) for group in self.groups for source in group.sources()] or [0]) + 2
        lines = [f"{'':{width}}{''.join(f'{name:>9}' for name in HEADS.values())}    worst"]
        for group in self.groups:
            lines.append(group.title)
            for source, rows in group.sources().items():
                lines.append(_source_line(source, rows, width))
                lines += [_row_line(r) for r in rows] if self.every else []
        said = "Worst: the largest difference among those that agree, in percent of its tolerance."
        return [*lines, "", said]

    def to_frame(self) -> pd.DataFrame:
        """One row per number, with the group before the columns of `to_dict`."""
        import pandas as pd

        return pd.DataFrame([{"group": g.name, **r.to_dict()} for g in self.groups for r in g.rows])

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: `rows`, `groups` with their counts, `counts`."""
        return {
            "rows": [{"group": g.name, **r.to_dict()} for g in self.groups for r in g.rows],
            "groups": [
                {
                    "group": g.name,
                    "title": g.title,
                    "numbers": len(g.rows),
                    **_counts(g.rows),
                    **({"failure": g.failure} if g.failure else {}),
                }
                for g in self.groups
            ],
            "counts": {"numbers": len(self.rows), **self.counts},
        }


def validate(groups: Iterable[str] | None = None, options: ValidateOptions | None = None) -> Validation:
    """Compute every printed number of the references and compare.

    Parameters
    ----------
    groups
        Some of the providers, by name; default all.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a group that does not exist.

    Examples
    --------
    >>> validate(["rotor"]).last_line
    '72 numbers can fail: 72 agree, 0 misprints, 0 consequences, 0 differ; 3 given, not counted'
    """
    chosen = list(PROVIDERS) if groups is None else list(groups)
    for name in chosen:
        if name not in PROVIDERS:
            raise ValueError(
                f"there is no group {name!r} of printed numbers; groups are {', '.join(PROVIDERS)}"
            )
    from rotorid.validation import (
        balancing,
        closed_forms,
        formula_50,
        formulas,
        identification,
        rotor,
        time_records,
    )

    own = (rotor, formula_50, identification, formulas, closed_forms, time_records, balancing)
    modules = dict(zip(NAMES, own, strict=True))
    options = options or ValidateOptions()
    return Validation(
        groups=tuple(_group(name, modules[name].rows) for name in chosen),
        every=options.every,
        provenance=provenance(tables(), options),
    )


def _group(name: str, provider: Callable[[], Iterable[Row]]) -> Group:
    """What a provider computes; where it fails, the others are still to be shown."""
    try:
        return Group(name, PROVIDERS[name], tuple(provider()))
    except Exception as error:  # a failure of any kind is a result of the proof
        return Group(name, PROVIDERS[name], (), f"{type(error).__name__}: {error}")


def _counts(rows: Sequence[Row]) -> dict[Status, int]:
    return {status: sum(r.status == status for r in rows) for status in HEADS}


def _by(rows: Iterable[Row], key: Callable[[Row], Key]) -> dict[Key, list[Row]]:
    found: dict[Key, list[Row]] = {}
    for r in rows:
        found.setdefault(key(r), []).append(r)
    return found


def _source_line(source: str, rows: Sequence[Row], width: int) -> str:
    n = _counts(rows)
    agreeing = [r.misfit for r in rows if r.status == AGREES]
    worst = f"{100 * max(agreeing):7.0f} %" if agreeing else f"{'–':>7}"
    return f"  {source:{width - 2}}{''.join(f'{n[status]:>9}' for status in HEADS)}{worst}"


def _row_line(r: Row) -> str:
    return (
        f"    {r.quantity:<44} {r.text:>24} {r.computed:>16.9g} {r.difference:>+11.2e}"
        f" (± {r.tolerance:.1e})  {r.status}{f', {r.kind}' if r.kind in ('selected', 'bound') else ''}"
    )


def _chapter(title: str, rows: Sequence[Row], words: Callable[[Sequence[Row]], str]) -> list[str]:
    """A heading and a paragraph for each source and reason."""
    if not rows:
        return []
    lines = [f"{title}:"]
    for own in _by(rows, lambda r: (r.source, r.erratum, r.follows, r.reason)).values():
        lines += textwrap.wrap(words(own), WIDTH, initial_indent="  ", subsequent_indent="    ")
    return lines


def _named(rows: Sequence[Row], most: int = 6) -> str:
    """The quantities, the first few of many."""
    names = [_printed_and_right(r) for r in rows[:most]]
    more = f" and {len(rows) - most} more" if len(rows) > most else ""
    return f"{rows[0].source}: {'; '.join(names)}{more}"


def _printed_and_right(r: Row) -> str:
    return f"{r.quantity}: printed {r.text}, computed {r.computed:.{_digits(r)}g}"


def _digits(r: Row) -> int:
    """As many digits as were printed, and two more; at least five, at most twelve."""
    return min(12, max(5, sum(c.isdigit() for c in r.text.lower().split("e")[0].lstrip("-+.0")) + 2))


def _difference(rows: Sequence[Row]) -> str:
    note = rows[0].note
    return _named(rows, len(rows)) + (f" ({note})" if note else "")


def _erratum(rows: Sequence[Row]) -> str:
    follows = f" (follows from {rows[0].follows})" if rows[0].follows else ""
    return f"{_named(rows)}. {sentence(rows[0].erratum + follows)}"


def _tolerance(rows: Sequence[Row]) -> str:
    what = rows[0].quantity if len(rows) == 1 else f"{len(rows)} numbers"
    low, high = min(r.tolerance for r in rows), max(r.tolerance for r in rows)
    size = f"{low:.2g}" if low == high else f"{low:.2g} to {high:.2g}"
    return f"{rows[0].source}, {what}: {size}. {sentence(rows[0].reason)}"
