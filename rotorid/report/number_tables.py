"""Sections and tables of a sheet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.result import Column
from rotorid.base.tables import LETTERS, NARROW, Table
from rotorid.report.document import NOTHING, Cells

if TYPE_CHECKING:
    from rotorid.report.rotor_figures import Drawing


def words(head: str, cells: Iterable[object]) -> Cells:
    """A column of words; markup stays markup."""
    return Cells(head, tuple(cell if isinstance(cell, str) else str(cell) for cell in cells), words=True)


def figures(head: str, values: Iterable[object]) -> Cells:
    """A column of numbers that are not from the document, with up to six digits, without trailing zeros."""
    shown = (f"{v:.6g}".replace("-", "−") if isinstance(v, float) else str(v) for v in values)
    return Cells(head, tuple(shown))


def shown(columns: Sequence[Column], rows: Iterable[int] | None = None) -> tuple[Cells, ...]:
    """Columns of a result as its text prints them; of these rows, None: of all."""
    printed = [(one, one.shown) for one in columns if one.shown is not None]
    picked = [*range(len(columns[0].values))] if rows is None else [*rows]
    return tuple(
        Cells(
            one.name if one.title is None else one.title,
            tuple(NOTHING if value != value else show(value) for value in np.asarray(one.values)[picked]),
            words=show is str,
        )
        for one, show in printed
    )


def numbered(head: str, count: int) -> Cells:
    """A column of the numbers from 1."""
    return figures(head, range(1, count + 1))


def below(*tables: Sequence[Cells]) -> tuple[Cells, ...]:
    """Columns of tables with the same heads, one table below the other."""
    return tuple(
        replace(column[0], cells=tuple(cell for part in column for cell in part.cells))
        for column in zip(*tables, strict=True)
    )


@dataclass(frozen=True)
class Grid:
    """A table.

    Attributes
    ----------
    caption
        What it shows, in a few words.
    columns
        One at least, all of one length.
    note
        What the reader must know about it; may be empty.
    """

    caption: str
    columns: tuple[Cells, ...]
    note: str = ""

    @property
    def heads(self) -> tuple[str, ...]:
        """Of the columns."""
        return tuple(column.head for column in self.columns)

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """Cells row by row."""
        return tuple(zip(*(column.cells for column in self.columns), strict=True))

    @property
    def texts(self) -> tuple[int, ...]:
        """Which columns hold words, from 0."""
        return tuple(i for i, column in enumerate(self.columns) if column.words)

    @property
    def wide(self) -> bool:
        """Whether it has more columns or letters than a telephone shows side by side."""
        from markupsafe import Markup

        cells = [[len(Markup(cell).striptags()) for cell in (one.head, *one.cells)] for one in self.columns]
        return len(cells) > NARROW or sum(map(max, cells)) > LETTERS

    @property
    def whole(self) -> bool:
        """Whether it is short enough to stand on one page."""
        return len(self.rows) <= 12


@dataclass(frozen=True)
class Part:
    """A section of a sheet: a heading, sentences, tables, drawings.

    Attributes
    ----------
    heading
        Short.
    said
        Sentences before the tables; texts, or markup with numbers of the document.
    tables, drawings
        In this order.
    listing
        Text of a file, behind them.
    """

    heading: str
    said: tuple[str, ...] = ()
    tables: tuple[Grid | Table, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    listing: str = ""


def every_warning(document: Mapping[str, Any]) -> list[str]:
    """All warnings of a document and its parts, in the order of the document, each once."""
    found: list[str] = []
    for key, value in document.items():
        if key == "warnings":
            found += map(str, value)
        elif isinstance(value, Mapping):
            found += every_warning(value)
    return list(dict.fromkeys(found))
