"""The digits in which numbers are written: what one unit of the last digit of each cell stands for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.files.cells import Cell, Shown, show

_SURE = 15
"""A float shows so many digits truly; more, as in 0.30000000000000004, are those of a computation."""


def written_steps(cells: Sequence[Cell]) -> FloatArray:
    """Steps in which the numbers of a column are written, in its unit: 98 in 1, 0.3 in 0.1, 1.2e-3 in 1e-4.

    Spreadsheets drop zeros at the end: beside 12.75 a cell with 13 means 13.00. With D the most decimals and
    m the most significant digits of any number of the column, a number whose first digit stands at 10^e and
    that has d decimals counts as written with max(d, min(D, m − 1 − e)) of them, 0 with D. So columns with
    a fixed number of decimals and columns with a fixed number of significant digits both come out right as
    soon as one number shows all its digits, and a step is never smaller than that of the instrument. Zeros
    at the end of whole numbers are not counted as significant. A number with more than 15 digits comes from
    a computation, and counts as it is to 12.

    Parameters
    ----------
    cells
        Of one column; all hold numbers. Those of a workbook have the digits that their format shows, or as
        many as they need.

    Returns
    -------
    ndarray
        Shape (rows,), 10 to the power of minus the decimals.
    """
    texts = [(cell.text if isinstance(cell, Shown) else show(cell)).replace(",", ".") for cell in cells]
    digits = {text: _digits(text) for text in set(texts)}  # a long column says most of its numbers again
    found = np.array([digits[text] for text in texts], dtype=np.int64).reshape(-1, 3)
    decimals, significant, first = found.T
    most = decimals.max(initial=-99)
    fixed = np.minimum(most, significant.max(initial=0) - 1 - first)
    return np.asarray(10.0 ** -np.where(significant > 0, np.maximum(decimals, fixed), most))


def _digits(text: str) -> tuple[int, int, int]:
    """Decimals, significant digits (none of 0), and at which power of ten the first one stands."""
    if float(text) == 0:  # also 1e-999
        return max(0, -int(Decimal(re.sub("[eE].*", "", text)).as_tuple().exponent)), 0, 0
    number = Decimal(text)
    _, digits, exponent = number.as_tuple()
    if len(digits) > _SURE:
        number = Decimal(f"{float(text):.12g}")
        _, digits, exponent = number.as_tuple()
    if int(exponent) >= 0:
        digits = number.normalize().as_tuple().digits
    return -int(exponent), len(digits), number.adjusted()
