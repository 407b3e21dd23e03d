"""Arrays: their types, checks of numbers and speeds, complex numbers from sizes and angles."""

from __future__ import annotations

import math
import operator
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

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


def whole(value: object, what: str) -> int:
    """A whole number as a plain int; raise ValueError naming `what` for anything else."""
    try:
        if isinstance(value, bool):
            raise TypeError
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError(f"{what} must be a whole number, not {value!r}") from None


def number(value: object, what: str, *, signed: bool = False) -> float:
    """A finite number as a plain float, not negative unless `signed`; else raise ValueError with `what`."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ValueError(f"{what} must be a number, not {value!r}") from None
    if not math.isfinite(result) or (result < 0 and not signed):
        limit = "finite" if signed else "finite and not negative"
        raise ValueError(f"{what} must be {limit}, not {result}")
    return result + 0.0  # no negative zero


def checked_speeds(speeds: ArrayLike, *, ascending: bool = False) -> FloatArray:
    """One or many speeds in rad/s as a read-only array, shape (S,).

    Raises
    ------
    ValueError
        If they are no numbers, not finite or negative, or do not ascend although they must.
    """
    try:
        array = np.atleast_1d(np.array(speeds, dtype=float))
    except (TypeError, ValueError):  # no numbers, or lists of several lengths
        array = np.empty(0)
    if array.ndim != 1 or not array.size or not ((array >= 0) & (array < np.inf)).all():
        raise ValueError(
            "speeds must be numbers in rad/s, at least one, in one list, finite and not negative"
        )
    falls = np.flatnonzero(np.diff(array) <= 0)
    if ascending and falls.size:
        before, after = array[falls[0] :][:2]
        raise ValueError(
            f"speeds must ascend, each once: sort them; {after:.6g} rad/s follows {before:.6g} rad/s"
        )
    read_only(array)
    return array


def attachment(item: Any) -> str:  # noqa: ANN401  all that has a node and a name
    """Check the node of something attached to a rotor; returns "disc 'wheel' at node 3" for messages."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(item).__name__).lower()
    what = words + (f" {item.name!r}" if item.name else "")
    node = whole(item.node, f"the node of {what}")
    if node < 1:
        raise ValueError(f"{what}: node {node} does not exist, nodes are numbered from 1")
    object.__setattr__(item, "node", node)
    return f"{what} at node {node}"


def polar(size: ArrayLike, angle: ArrayLike) -> ComplexArray:
    """Complex numbers from sizes and angles (rad); exact at quarter turns, which people write most."""
    unit = np.exp(1j * np.asarray(angle, dtype=float))
    along, across = (np.where(np.abs(part) < 1e-15, 0.0, part) for part in (unit.real, unit.imag))
    return np.asarray(np.asarray(size) * (along + 1j * across), dtype=complex)


def turned(z: ComplexArray, radial: FloatArray, tangential: FloatArray) -> FloatArray:
    """Covariances (…, 2, 2) from variances along z and across."""
    unit = np.where(z != 0, z, 1.0)
    unit = unit / np.abs(unit)
    along, across = (np.stack((z.real, z.imag), axis=-1) for z in (unit, 1j * unit))
    parts = ((radial, along), (tangential, across))
    return np.asarray(sum(size[..., None, None] * u[..., :, None] * u[..., None, :] for size, u in parts))
