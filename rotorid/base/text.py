"""Numbers, lists and tables in words: text of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

WIDTH = 80
MOST_NAMES = 40
ROUNDING = 1e-12
"""A share that is nothing but rounding."""


def percent(share: float) -> str:
    """A share in percent, two digits, never as 1e+02; rounding is 0."""
    if share < ROUNDING:
        return "0"
    return f"{100 * share:.0f}" if share >= 0.0995 else f"{100 * share:.2g}"


def figures(value: float, digits: int = 4) -> str:
    """A number with so many significant digits, written out where that is short.

    >>> figures(0.99996), figures(12345.6, 3), figures(2.5e-7)
    ('1.000', '12346', '2.500e-07')
    """
    if not 1e-4 <= abs(value) < 1e6:
        return "0" if value == 0 else f"{value:.{digits - 1}e}"
    exponent = int(f"{value:.{digits - 1}e}".rpartition("e")[2])  # of the rounded number: 0.99996 is 1.000
    places = max(digits - 1 - exponent, 0)
    return f"{value:.{places}f}"


def error_figures(error: float) -> str:
    """A standard deviation, two digits."""
    return figures(error, 2) if error == error else "unknown"


def capital(text: str) -> str:
    """The text with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def sentence(text: str) -> str:
    """A clause as a sentence.

    >>> sentence("the runs agree")
    'The runs agree.'
    """
    return capital(text) + ("" if text.endswith(".") else ".")


def wrap(text: str, indent: str = "") -> str:
    """The text in lines of 80 columns, all but the first indented."""
    return textwrap.fill(text, WIDTH, subsequent_indent=indent)


def cut(text: str, width: int) -> str:
    """The text, shortened to so many characters."""
    return text if len(text) <= width else text[: width - 1] + "…"


def counted(n: int, noun: str, nouns: str = "") -> str:
    """So many of something.

    >>> counted(1, "plane"), counted(0, "plane"), counted(2, "mass", "masses")
    ('1 plane', '0 planes', '2 masses')
    """
    return f"{n} {noun if n == 1 else nouns or f'{noun}s'}"


def listing(names: Iterable[str], conjunction: str = "or") -> str:
    """`a, b or c`; of a great many only the first."""
    items = list(names)
    if len(items) > MOST_NAMES:
        items = [*items[: MOST_NAMES - 1], f"{len(items) - MOST_NAMES + 1} more"]
        conjunction = "and"
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {conjunction} {items[-1]}"


def table(rows: list[list[str]], left: int = 1, width: int = WIDTH) -> str:
    """Columns right-aligned, except for the first `left` ones; names are cut where the width needs it."""
    columns = len(rows[0])
    widths = [max(len(r[i]) for r in rows) for i in range(columns)]
    names = left - 1
    widths[names] = max(min(widths[names], width - 2 * columns - (sum(widths) - widths[names])), 8)
    lines = []
    for row in rows:
        cells = [cut(cell, widths[i]) for i, cell in enumerate(row)]
        cells = [f"{x:<{widths[i]}}" if i < left else f"{x:>{widths[i]}}" for i, x in enumerate(cells)]
        lines.append(("  " + "  ".join(cells)).rstrip())
    return "\n".join(lines)
