"""Unknown numbers of a rotor: what is to be estimated, what is known of it beforehand, and its bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fem import Rotor, is_reading
from fem.parameters import numbers_of, parameter_value
from rotorid.base.arrays import FloatArray

_SIGNED = ("kxy", "kyx", "cxy", "cyx", "offset", "angle")
"""Last words of paths of numbers that may have either sign."""
_CHANGES = (".scale", ".offset")
_ABOVE_ZERO = ("youngs_modulus", "density", "pedestal_stiffness")
LEAST = 1e-3
"""Of its value: the lower bound of what must be above zero."""


@dataclass(frozen=True)
class Unknown:
    """A number of the rotor file that is to be estimated.

    Attributes
    ----------
    path
        As in `fem.parameters`: "bearing[1].kxx", "disc[2].scale", "probe[p1].angle".
    name
        To print; default: the path.
    start
        Where the search begins; default: the prior value, or that of the file.
    prior
        Value and one standard deviation that are known beforehand; None: nothing.
    bounds
        Lowest and largest value; None: 0 where the number cannot be negative.
    beside
        It is not wished for, but not known exactly either.
    """

    path: str
    name: str = ""
    start: float | None = None
    prior: tuple[float, float] | None = None
    bounds: tuple[float, float] | None = None
    beside: bool = False

    @property
    def label(self) -> str:
        """What it is called in print."""
        return self.name or self.path

    def first(self, rotor: Rotor) -> float:
        """Where the search begins."""
        if self.start is not None:
            return self.start
        return self.prior[0] if self.prior else parameter_value(rotor, self.path)

    def limits(self, rotor: Rotor) -> tuple[float | None, float | None]:
        """Bounds for the search."""
        if self.bounds is not None:
            return self.bounds
        words = self.path.split(".")
        value = parameter_value(rotor, self.path)
        signed = words[-1] in _SIGNED or (words[0].startswith("seal") and words[-1] != "scale")
        if is_reading(self.path) or signed or value < 0:
            return None, None
        positive = words[-1] == "scale" or words[-1].startswith(_ABOVE_ZERO)
        return (LEAST * value if positive and np.isfinite(value) else 0.0), None


def check_different(rotor: Rotor, paths: Sequence[str]) -> None:
    """Refuse paths that mean the same number of a rotor.

    Raises
    ------
    ValueError
        For a value that is asked for beside itself, its scale or its offset, and a change asked for twice.
    """
    numbers = [numbers_of(rotor, path) for path in paths]
    ways = [path.rpartition(".")[2] if path.endswith(_CHANGES) else "" for path in paths]
    for k, path in enumerate(paths):
        for i in range(k):
            how = {ways[i], ways[k]}
            if numbers[i] & numbers[k] and ("" in how or (len(how) == 1 and numbers[i] == numbers[k])):
                raise ValueError(f"{paths[i]} and {path} are the same number of the rotor: estimate one")


def as_they_stand(rotor: Rotor, values: Mapping[str, float]) -> FloatArray:
    """Derivatives (n, n) of changes, as `with_changes` makes them of the rotor with these values, by these.

    A scale s is 1 there, and multiplies what is added to the same numbers, a, too: ds' = ds / s,
    da' = da − a ds / s.

    Raises
    ------
    ValueError
        For what is added to more numbers than such a scale multiplies.
    """
    T = np.eye(len(values))
    numbers = [numbers_of(rotor, path) for path in values]
    for j, (path, scale) in enumerate(values.items()):
        if path.endswith(".scale"):
            T[j, j] = 1 / (scale or 1.0)  # with nothing left of the numbers
            for i, (other, added) in enumerate(values.items()):
                if other.endswith(".offset") and numbers[i] & numbers[j]:
                    if not numbers[i] <= numbers[j]:
                        raise ValueError(f"{other} adds to more numbers than {path} multiplies")
                    T[i, j] = -added * T[j, j]
    return T
