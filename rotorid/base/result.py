"""Tables of results: columns, told once, as JSON rows, as a DataFrame and as text.

A result has a function `result → tuple of Column`; `rows`, `frame` and `text` make its tables of it.

>>> import numpy as np
>>> columns = (
...     Column("mode", [1, 2], str),
...     Column("speed_rpm", np.array([2980.5, np.nan]), "{:.1f}".format, "rpm"),
...     Column("whirl", ["forward", "mixed"]),
... )
>>> rows(columns)[0]
{'mode': 1, 'speed_rpm': 2980.5, 'whirl': 'forward'}
>>> print(text(columns))
  mode         rpm
  1         2980.5
  2
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotorid.base.json import cell
from rotorid.base.text import WIDTH, table

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name
        With its unit, as files and frames have it.
    values
        One cell a row; NaN or None where there is nothing.
    shown
        A cell as text; None: the column is not printed.
    title
        Over the column in text, where that is not the name.
    """

    name: str
    values: Collection[Any]
    shown: Callable[[Any], str] | None = None
    title: str | None = None


def numbered(name: str, values: NDArray[Any]) -> tuple[Column, ...]:
    """The columns of an array, numbered from 1: `numbered("mass_{}_kg", masses)`."""
    return tuple(Column(name.format(k), column) for k, column in enumerate(values.T, start=1))


def rows(columns: Sequence[Column]) -> list[dict[str, Any]]:
    """One dict a row, of JSON types."""
    names = [column.name for column in columns]
    cells = (cell(column.values) for column in columns)
    return [dict(zip(names, row, strict=True)) for row in zip(*cells, strict=True)]


def frame(columns: Sequence[Column]) -> pd.DataFrame:
    """The same as a DataFrame."""
    import pandas as pd

    return pd.DataFrame({column.name: column.values for column in columns})


def text(columns: Sequence[Column], left: int = 1, width: int = WIDTH) -> str:
    """The columns that are printed, all but the first `left` aligned to the right; nothing stays blank."""
    printed = []
    for each in columns:
        if (shown := each.shown) is not None:
            cells = ["" if value is None or value != value else shown(value) for value in each.values]
            printed.append([each.name if each.title is None else each.title, *cells])
    return table([list(row) for row in zip(*printed, strict=True)], left, width)
