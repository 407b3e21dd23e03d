"""Checks of numbers and speeds, shared by the parts of a rotor."""

from __future__ import annotations

import math
import operator
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray, read_only


def whole(value: object, what: str) -> int:
    """A whole number as a plain int; raise ValueError naming `what` for anything else."""
    try:
        if isinstance(value, (bool, np.bool_)):
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
    except (TypeError, ValueError):
        raise ValueError("speeds must be numbers in rad/s") from None
    if array.ndim != 1 or not array.size:
        raise ValueError("speeds must be one number or a list of at least one")
    if not (np.isfinite(array) & (array >= 0)).all():
        raise ValueError("speeds must be finite and not negative, in rad/s")
    if ascending and (np.diff(array) <= 0).any():
        k = int(np.argmax(np.diff(array) <= 0))
        raise ValueError(
            f"speeds must ascend, but {array[k + 1]:.6g} rad/s follows {array[k]:.6g} rad/s; sort them"
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
