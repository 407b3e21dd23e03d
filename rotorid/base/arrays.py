"""Types of arrays, for annotations, and arrays that nobody may change."""

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
