"""A rotor as plain data: shaft elements, discs and supports."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from fem.model.calibration import Calibration
from fem.model.disc import STEEL_DENSITY, Disc
from fem.model.node_forces import NodeForce, in_order
from fem.model.supports import Pedestal, Support
from rotorid.base.arrays import BoolArray, FloatArray, read_only
from rotorid.base.checks import whole
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted

__all__ = ["STEEL_DENSITY", "STEEL_MODULUS", "STEEL_POISSON"]
__all__ += ["Disc", "FloatArray", "Model", "Pedestal", "Rotor", "Support", "whole"]

STEEL_MODULUS = 2.1e11
STEEL_POISSON = 0.3


@dataclass(frozen=True)
class Model:
    """What the beam elements take into account besides bending and mass.

    Attributes
    ----------
    shear
        Shear deformation (Timoshenko), with Cowper's coefficient.
    rotary_inertia
        Inertia of tilting cross-sections, and the diametral inertia of discs.
    gyroscopic
        Gyroscopic moments of shaft and discs (polar inertia).
    """

    shear: bool = False
    rotary_inertia: bool = False
    gyroscopic: bool = False

    def __post_init__(self) -> None:
        for item in fields(self):
            if not isinstance(getattr(self, item.name), bool):
                raise ValueError(
                    f"model: {item.name} must be True or False, not {getattr(self, item.name)!r}"
                )


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
    poisson_ratio
        Of each element, shape (n,); shear alone depends on it.
    material_damping
        Viscous damping of each element's material per its stiffness, s, shape (n,): the stress grows by
        this many times its rate of change in the turning shaft. It damps whirl below, and drives it above,
        the speed of the whirl.
    model
        What the elements take into account.
    forces
        At nodes, those that are not linear (`fem.model.node_forces`), kept in the order of their kinds: for
        equilibrium and motion; what is linear refuses them, see `linear`.
    calibration
        What a fit to readings found of its parameters, None without one; equal rotors may differ in it.

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
    poisson_ratio: FloatArray = field(default_factory=lambda: np.array(STEEL_POISSON))
    material_damping: FloatArray = field(default_factory=lambda: np.array(0.0))
    model: Model = Model()
    forces: Sequence[NodeForce] = ()
    calibration: Calibration | None = None

    def __post_init__(self) -> None:
        for name, value in zip(PER_ELEMENT, _broadcast(self), strict=True):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "discs", _attached(self.discs, Disc, "disc", self.n_nodes))
        object.__setattr__(self, "supports", _attached(self.supports, Support, "support", self.n_nodes))
        object.__setattr__(self, "forces", in_order(_attached(self.forces, NodeForce, "force", self.n_nodes)))
        object.__setattr__(self, "stations", _stations(self.stations, self.n_nodes))
        if not isinstance(self.model, Model):
            raise ValueError(f"model must be a Model, not {self.model!r}")
        if not isinstance(self.calibration, Calibration | None):
            raise ValueError(f"calibration must be a Calibration, not {self.calibration!r}")

    __hash__ = None  # type: ignore[assignment]  # compared by value, and arrays have no hash

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rotor):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in PER_ELEMENT) and (
            (self.discs, self.supports, dict(self.stations), self.model, self.forces)
            == (other.discs, other.supports, dict(other.stations), other.model, other.forces)
        )

    def __repr__(self) -> str:
        forces = f", {counted(len(self.forces), 'force')}" if self.forces else ""
        return (
            f"Rotor({counted(self.n_elements, 'element')}, {self.positions[-1]:.4g} m, "
            f"{self.total_mass:.4g} kg, {counted(len(self.discs), 'disc')}, "
            f"{counted(len(self.supports), 'support')}{forces})"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        # A mapping proxy can be neither pickled nor deep-copied: rebuild from plain data.
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return type(self), tuple((values | {"stations": dict(self.stations)}).values())

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
                    f"no station is called {name_or_number!r}{did_you_mean(name_or_number, self.stations)} "
                    f"(stations: {known}); "
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
        outer, inner = self.outer_diameter**2, self.inner_diameter**2
        return np.asarray(math.pi / 64 * (outer - inner) * (outer + inner))

    @property
    def shear_modulus(self) -> FloatArray:
        """G = E / (2 (1 + ν)) of each element, Pa, shape (n,)."""
        return np.asarray(self.youngs_modulus / (2 * (1 + self.poisson_ratio)))

    @property
    def shear_coefficient(self) -> FloatArray:
        """Cowper's κ of each element, a circle or a circular ring, shape (n,).

        κ = 6 (1 + ν)(1 + m²)² / ((7 + 6 ν)(1 + m²)² + (20 + 12 ν) m²), m = inner by outer diameter
        (G. R. Cowper, J. Appl. Mech. 33 (1966) 335).
        """
        nu, m2 = self.poisson_ratio, (self.inner_diameter / self.outer_diameter) ** 2
        ring = (1 + m2) ** 2
        return np.asarray(6 * (1 + nu) * ring / ((7 + 6 * nu) * ring + (20 + 12 * nu) * m2))

    @property
    def symmetric(self) -> bool:
        """Whether every support is rotationally symmetric, so that one complex coordinate is enough."""
        return all(support.symmetric for support in self.supports)

    @property
    def constant(self) -> bool:
        """Whether no support depends on speed."""
        return all(support.constant for support in self.supports)

    @property
    def knots(self) -> FloatArray:
        """Speeds at which a table of a support may change its slope, rad/s, ascending."""
        return np.unique([speed for support in self.supports for speed in support.speeds])

    @property
    def linear(self) -> Rotor:
        """The same without the forces that are not linear."""
        return replace(self, forces=()) if self.forces else self

    @property
    def total_mass(self) -> float:
        """Mass of shaft and discs, kg."""
        shaft = float(np.sum(self.density * self.area * self.length))
        return shaft + math.fsum(disc.mass for disc in self.discs)


_T = TypeVar("_T", Disc, Support, NodeForce)
PER_ELEMENT = (
    "length",
    "outer_diameter",
    "inner_diameter",
    "youngs_modulus",
    "density",
    "poisson_ratio",
    "material_damping",
)
SHORTEST = 3000
"""A neighbour may be this many times as long as an element: float64 loses the stiffness of shorter ones."""
_MAY_BE_ZERO = ("inner_diameter", "density", "material_damping")


def too_short(length: FloatArray) -> BoolArray:
    """Which elements are too short beside their longer neighbour, from lengths of shape (n,)."""
    beside = np.concatenate(([0.0], length, [0.0]))
    return np.asarray(SHORTEST * length < np.maximum(beside[:-2], beside[2:]))


def _broadcast(rotor: Rotor) -> list[FloatArray]:
    """Checked, read-only arrays of equal length from what was given for each element."""
    arrays = []
    for name in PER_ELEMENT:
        try:
            array = np.atleast_1d(np.asarray(getattr(rotor, name), dtype=float))
        except (TypeError, ValueError):
            raise ValueError(f"{name} must be a number or one number per element") from None
        if array.ndim != 1:
            raise ValueError(f"{name} must be one number per element, not an array of shape {array.shape}")
        arrays.append(array)
    n = max(len(array) for array in arrays)
    for name, array in zip(PER_ELEMENT, arrays, strict=True):
        if len(array) not in (1, n) or not len(array):
            raise ValueError(f"{name} has {len(array)} values for {n} elements; give one value, or {n}")
        if name == "poisson_ratio":
            wrong, limit = ~((array > -1) & (array <= 0.5)), "above -1, at most 0.5"
        elif name in _MAY_BE_ZERO:
            wrong, limit = ~(np.isfinite(array) & (array >= 0)), "not negative"
        else:
            wrong, limit = ~(np.isfinite(array) & (array > 0)), "greater than zero"
        if wrong.any():
            i = int(np.argmax(wrong))
            raise ValueError(f"element {i + 1}: {name} must be finite and {limit}, not {array[i]}")
    # Copies: the caller's arrays stay his, ours stay read-only.
    arrays = [np.broadcast_to(array, (n,)).copy() for array in arrays]
    read_only(*arrays)
    length, outer, inner = arrays[:3]
    short = too_short(length)
    if short.any():
        i = int(np.argmax(short))
        raise ValueError(
            f"element {i + 1}: its length, {length[i]:g} m, is less than 1/{SHORTEST} of its longer "
            "neighbour's, too short for float64; join it with this neighbour"
        )
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
