"""The document of a sheet: its numbers are printed with the place at which the document holds them."""

from __future__ import annotations

import math
from collections import UserDict
from decimal import Decimal
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markupsafe import Markup

NOTHING = "–"
"""Printed where the document has no number (null)."""


class Document(UserDict[str, Any]):
    """What `--json` prints, as JSON types, and its numbers as a sheet shows them."""

    def show(
        self,
        key: str,
        digits: int = 3,
        *,
        decimals: int | None = None,
        unit: str = "",
        trim: bool = False,
    ) -> Markup:
        """Print the number at a path as `<span data-key="path">number</span>`.

        Parameters
        ----------
        key
            Such as "corrections.0.mass".
        digits
            Significant digits; not used with `decimals`.
        decimals
            Digits after the point; with unit "°" a number that would round to 360 is printed as 0.
        unit
            Printed behind the number (inside the element, after a narrow space; "°" without one).
        trim
            Whether zeros at the end are left out: 3.36 with five digits, not 3.3600.

        Raises
        ------
        KeyError
            If the document has nothing there, or something that is neither a number nor null.
        """
        from markupsafe import Markup

        value = self.value(key)
        if value is None:
            text = NOTHING
        else:
            text = significant(value, digits) if decimals is None else fixed(value, decimals, unit == "°")
            if trim and "." in text and "e" not in text:
                text = text.rstrip("0").rstrip(".")
            text += unit if unit in ("", "°") else f"\u202f{unit}"
        return Markup('<span data-key="{}">{}</span>').format(key, text.replace("-", "−"))

    def value(self, key: str) -> float | None:
        """Return the number at a path; None where the document says null.

        Raises
        ------
        KeyError
            If the document has nothing there, or something that is neither a number nor null.
        """
        found = self.found(key)
        if found is None:
            return None
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise KeyError(f"the document has no number at {key}")
        return float(found)

    def found(self, key: str) -> Any:  # noqa: ANN401
        """Return what the document holds at a path.

        Raises
        ------
        KeyError
            If it has nothing there.
        """
        found: Any = self.data
        for part in key.split("."):
            try:
                found = found[int(part)] if isinstance(found, list | tuple) else found[part]
            except (IndexError, KeyError, TypeError, ValueError):
                raise KeyError(f"the document has nothing at {key}") from None
        return found


def significant(value: float, digits: int = 3) -> str:
    """Print a number with significant digits, without an exponent from 0.0001 to 9999999.

    Examples
    --------
    >>> significant(416.93, 4), significant(0.04829), significant(13.0), significant(23900), significant(0)
    ('416.9', '0.0483', '13.0', '23900', '0')
    >>> significant(2.5e-7)
    '2.50e-07'
    """
    if not math.isfinite(value):
        return NOTHING
    if value == 0:
        return "0"
    rounded = f"{value:.{digits - 1}e}"
    exponent = int(rounded.partition("e")[2])
    if not -5 < exponent < 7:
        return rounded
    return f"{Decimal(rounded):.{max(0, digits - 1 - exponent)}f}"


def fixed(value: float, decimals: int, angle: bool = False) -> str:
    """Print a number with digits after the point; an angle of 359.96° becomes 0.0, and -0.0 becomes 0.0.

    Examples
    --------
    >>> fixed(9.514, 1), fixed(359.96, 1, angle=True), fixed(-0.01, 1)
    ('9.5', '0.0', '0.0')
    """
    if not math.isfinite(value):
        return NOTHING
    rounded = round(value, decimals)
    if angle and rounded == 360:
        rounded = 0.0
    return f"{rounded + 0.0:.{decimals}f}"
