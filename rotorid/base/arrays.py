"""Types of arrays, for annotations; arrays that nobody may change; rounding."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
AnyArray = NDArray[Any]  # real or complex, as the problem is
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]


def read_only(*arrays: AnyArray) -> None:
    """Let nobody write into arrays of a result."""
    for array in arrays:
        array.flags.writeable = False


def significant(values: FloatArray, digits: int) -> FloatArray:
    """Numbers (n,) rounded to so many significant digits.

    >>> significant(np.array([-0.0033186, 15.871, -0.0]), 2).tolist()
    [-0.0033, 16.0, 0.0]
    """
    return np.array([float(f"{value:.{digits - 1}e}") + 0.0 for value in values])
