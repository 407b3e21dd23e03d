"""A rotor as plain data: shaft elements, discs and supports."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STEEL_MODULUS = 2.1e11
STEEL_DENSITY = 7800.0
RPM = 60 / math.tau  # of 1 rad/s


@dataclass(frozen=True)
class Disc:
    """A rigid disc, or a concentrated mass, at a node.

    Attributes
    ----------
    node
        Node number, from 1.
    mass
        kg.
    polar_inertia, diametral_inertia
        About the shaft axis and about a diameter, kg·m².
    name
        For messages and drawings.

    Raises
    ------
    ValueError
        If the node is no whole number from 1 up, or the mass or an inertia is negative or not finite.
    """

    node: int
    mass: float
    polar_inertia: float = 0.0
    diametral_inertia: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        _check_attachment(self, "mass", "polar_inertia", "diametral_inertia")


@dataclass(frozen=True)
class Support:
    """An isotropic bearing between a node and the ground.

    Attributes
    ----------
    node
        Node number, from 1.
    stiffness
        N/m.
    damping
        Viscous, N·s/m.
    name
        For messages and drawings.

    Raises
    ------
    ValueError
        If the node is no whole number from 1 up, or stiffness or damping is negative or not finite.
    """

    node: int
    stiffness: float
    damping: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        _check_attachment(self, "stiffness", "damping")


@dataclass(frozen=True, eq=False)
class Rotor:
    """A shaft of beam elements with discs and supports.

    Element *i* (from 1) lies between nodes *i* and *i + 1*; nodes are numbered from 1, left to right,
    in every function and file of this project.

    Attributes
    ----------
    length, outer_diameter, inner_diameter
        Of each element, m, shape (n,); a scalar counts for all elements.
    youngs_modulus, density
        Of each element, Pa and kg/m³, shape (n,).
    discs, supports
        What is attached to nodes; several may share a node.
    stations
        Names of nodes, `{name: node}`.

    Raises
    ------
    ValueError
        With one sentence that says which element, disc or support is impossible, and why.
    """

    length: FloatArray
    outer_diameter: FloatArray
    inner_diameter: FloatArray = field(default_factory=lambda: np.array(0.0))
    youngs_modulus: FloatArray = field(default_factory=lambda: np.array(STEEL_MODULUS))
    density: FloatArray = field(default_factory=lambda: np.array(STEEL_DENSITY))
    discs: Sequence[Disc] = ()
    supports: Sequence[Support] = ()
    stations: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in zip(_PER_ELEMENT, _broadcast(self), strict=True):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "discs", _attached(self.discs, Disc, "disc", self.n_nodes))
        object.__setattr__(self, "supports", _attached(self.supports, Support, "support", self.n_nodes))
        object.__setattr__(self, "stations", _stations(self.stations, self.n_nodes))

    __hash__ = None  # type: ignore[assignment]  # compared by value, and arrays have no hash

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rotor):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in _PER_ELEMENT) and (
            (self.discs, self.supports, dict(self.stations))
            == (other.discs, other.supports, dict(other.stations))
        )

    def __repr__(self) -> str:
        return (
            f"Rotor({self.n_elements} elements, {self.positions[-1]:.4g} m, {self.total_mass:.4g} kg, "
            f"{len(self.discs)} discs, {len(self.supports)} supports)"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        # A mapping proxy can be neither pickled nor deep-copied: rebuild from plain data.
        values = [getattr(self, item.name) for item in fields(self)]
        return type(self), (*values[:-1], dict(self.stations))

    def node(self, name_or_number: str | int) -> int:
        """Number of a node, given as the name of a station or as a number, from 1.

        Raises
        ------
        ValueError
            If there is no such station or node.
        """
        if isinstance(name_or_number, str):
            if name_or_number in self.stations:
                return self.stations[name_or_number]
            if not name_or_number.strip().isdecimal():
                known = ", ".join(self.stations) or "none"
                raise ValueError(
                    f"no station is called {name_or_number!r} (stations: {known}); "
                    f"give one of these or a node number from 1 to {self.n_nodes}"
                )
            name_or_number = int(name_or_number)
        number = whole(name_or_number, "a node number")
        if not 1 <= number <= self.n_nodes:
            raise ValueError(f"node {number} does not exist: the rotor has nodes 1 to {self.n_nodes}")
        return number

    @property
    def n_elements(self) -> int:
        """Number of shaft elements."""
        return len(self.length)

    @property
    def n_nodes(self) -> int:
        """Number of nodes, one more than elements."""
        return len(self.length) + 1

    @property
    def positions(self) -> FloatArray:
        """Axial position of each node from the left end, m, shape (n + 1,)."""
        return np.concatenate(([0.0], np.cumsum(self.length)))

    @property
    def area(self) -> FloatArray:
        """Cross-section of each element, m², shape (n,)."""
        return np.asarray(math.pi / 4 * (self.outer_diameter**2 - self.inner_diameter**2))

    @property
    def second_moment(self) -> FloatArray:
        """Second moment of area of each element about a diameter, m⁴, shape (n,)."""
        return np.asarray(math.pi / 64 * (self.outer_diameter**4 - self.inner_diameter**4))

    @property
    def total_mass(self) -> float:
        """Mass of shaft and discs, kg."""
        shaft = float(np.sum(self.density * self.area * self.length))
        return shaft + math.fsum(disc.mass for disc in self.discs)


_T = TypeVar("_T", Disc, Support)
_PER_ELEMENT = ("length", "outer_diameter", "inner_diameter", "youngs_modulus", "density")


def whole(value: object, what: str) -> int:
    """A whole number as a plain int; raise ValueError naming `what` for anything else."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ValueError(f"{what} must be a whole number, not {value!r}") from None


def _check_attachment(item: Disc | Support, *quantities: str) -> None:
    """Check a disc or support on its own and make its numbers plain."""
    what = type(item).__name__.lower() + (f" {item.name!r}" if item.name else "")
    number = whole(item.node, f"the node of {what}")
    if number < 1:
        raise ValueError(f"{what}: node {number} does not exist, nodes are numbered from 1")
    object.__setattr__(item, "node", number)
    for name in quantities:
        value = getattr(item, name)
        try:
            value = float(value)
        except (TypeError, ValueError):
            raise ValueError(f"{what} at node {number}: {name} must be a number, not {value!r}") from None
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{what} at node {number}: {name} must be finite and not negative, not {value}")
        object.__setattr__(item, name, value)


def _broadcast(rotor: Rotor) -> list[FloatArray]:
    """Checked, read-only arrays of equal length from what was given for each element."""
    arrays = []
    for name in _PER_ELEMENT:
        try:
            array = np.atleast_1d(np.asarray(getattr(rotor, name), dtype=float))
        except (TypeError, ValueError):
            raise ValueError(f"{name} must be a number or one number per element") from None
        if array.ndim != 1:
            raise ValueError(f"{name} must be one number per element, not an array of shape {array.shape}")
        arrays.append(array)
    n = max(len(array) for array in arrays)
    for name, array in zip(_PER_ELEMENT, arrays, strict=True):
        if len(array) not in (1, n) or not len(array):
            raise ValueError(f"{name} has {len(array)} values for {n} elements; give one value, or {n}")
        positive = name not in ("inner_diameter", "density")
        wrong = ~np.isfinite(array) | (array <= 0 if positive else array < 0)
        if wrong.any():
            i = int(np.argmax(wrong))
            limit = "greater than zero" if positive else "not negative"
            raise ValueError(f"element {i + 1}: {name} must be finite and {limit}, not {array[i]}")
    # Copies: the caller's arrays stay his, ours stay read-only.
    arrays = [np.broadcast_to(array, (n,)).copy() for array in arrays]
    for array in arrays:
        array.flags.writeable = False
    outer, inner = arrays[1], arrays[2]
    if (inner >= outer).any():
        i = int(np.argmax(inner >= outer))
        raise ValueError(
            f"element {i + 1}: the inner diameter, {inner[i]} m, must be smaller than the outer, {outer[i]} m"
        )
    return arrays


def _attached(items: Sequence[_T], kind: type[_T], what: str, n_nodes: int) -> tuple[_T, ...]:
    try:
        items = tuple(items)
    except TypeError:
        raise ValueError(f"{what}s must be a list of {kind.__name__} objects, not {items!r}") from None
    for i, item in enumerate(items, start=1):
        if not isinstance(item, kind):
            raise ValueError(f"{what} {i} must be a {kind.__name__}, not {item!r}")
        if item.node > n_nodes:
            raise ValueError(
                f"{what} {i} stands at node {item.node}, but the rotor has nodes 1 to {n_nodes} only"
            )
    return items


def _stations(stations: Mapping[str, int], n_nodes: int) -> Mapping[str, int]:
    checked = {}
    for name, node in dict(stations).items():
        number = whole(node, f"the node of station {name!r}")
        if not 1 <= number <= n_nodes:
            raise ValueError(
                f"station {name!r} stands at node {number}, but the rotor has nodes 1 to {n_nodes}"
            )
        checked[str(name)] = number
    return MappingProxyType(checked)
