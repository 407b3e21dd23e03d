"""Unknown numbers of a rotor: what is to be estimated, what is known of it beforehand, and its bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem import Rotor, is_reading
from fem.parameters import numbers_of, parameter_value

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
