"""A rotor as plain data: shaft elements, discs, supports and pedestals, sensors; what a calibration says."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fem.forces import NodeForce, check_numbers, code_of
from fem.result import holding_arrays
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, attachment, number, read_only, whole
from rotorid.base.choices import Method, did_you_mean, find
from rotorid.base.text import counted

STEEL_MODULUS = 2.1e11
STEEL_DENSITY = 7800.0
STEEL_POISSON = 0.3
SHORTEST = 3000
"""A neighbour may be this many times as long as an element: float64 loses the stiffness of shorter ones."""
_ROUNDED = 5e-6  # relative error of a speed that was written with six digits: it does not end a table
Coefficient = float | tuple[tuple[float, float], tuple[float, float]]  # isotropic, or ((xx, xy), (yx, yy))
Pair = float | tuple[float, float]  # in both directions, or in x and in y
KINDS = (
    Method("bearing", "pushes back and brakes: its own stiffness and damping are not negative", 0.0),
    Method("seal", "may push outwards or drive, and is left out of maps over bearing stiffness", -math.inf),
)
"""Kinds of supports, with the lowest diagonal entry of their stiffness and damping."""


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
        check_numbers(self, attachment(self))

    @classmethod
    def from_geometry(
        cls,
        node: int,
        width: float,
        outer_diameter: float,
        inner_diameter: float = 0.0,
        density: float = STEEL_DENSITY,
        name: str = "",
    ) -> Disc:
        """Disc from its sizes in m and its density in kg/m³: a hollow cylinder around the shaft.

        m = ρ w π (D² − d²) / 4, I_p = m (D² + d²) / 8, I_d = m (D² + d²) / 16 + m w² / 12.

        Raises
        ------
        ValueError
            If a size is negative or not finite, or the bore is not smaller than the disc.

        >>> disc = Disc.from_geometry(3, width=0.07, outer_diameter=0.28, inner_diameter=0.05)
        >>> round(disc.mass, 3), round(disc.polar_inertia, 4), round(disc.diametral_inertia, 4)
        (32.548, 0.3291, 0.1779)
        """
        D, d = outer_diameter, inner_diameter
        if not 0 <= d < D:
            raise ValueError(
                f"disc at node {node}: the inner diameter, {d} m, must be smaller than the outer"
            )
        mass = density * width * math.pi / 4 * (D * D - d * d)
        polar = mass * (D * D + d * d) / 8
        return cls(node, mass, polar, polar / 2 + mass * width * width / 12, name)


@dataclass(frozen=True)
class Pedestal:
    """A mass on a spring and a damper, between a bearing and the ground.

    Attributes
    ----------
    mass
        kg; 0 for a mere spring in series.
    stiffness
        N/m, a number for both directions or one for each, (x, y); above 0.
    damping
        N·s/m, likewise.

    Raises
    ------
    ValueError
        If a value is negative or not finite, or a stiffness is zero.
    """

    mass: float = 0.0
    stiffness: Pair = 0.0
    damping: Pair = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, "pedestal")
        for name in ("stiffness", "damping"):
            value = _canonical(getattr(self, name), (2,), f"pedestal: {name}")
            object.__setattr__(self, name, value)
        if min(self.xy("stiffness")) <= 0:
            raise ValueError("pedestal: stiffness must be above 0 in x and y; leave out a rigid pedestal")

    def xy(self, name: str) -> tuple[float, float]:
        """Stiffness or damping in x and in y."""
        value = getattr(self, name)
        return value if isinstance(value, tuple) else (value, value)


@dataclass(frozen=True)
class Support:
    """A bearing or an annular seal between a node and the ground, or a pedestal.

    The force on the rotor is −k (x, y) − c (x', y') with 2 × 2 matrices k and c.

    Attributes
    ----------
    node
        Node number, from 1.
    stiffness
        N/m: a number (isotropic) or ((kxx, kxy), (kyx, kyy)); with `speeds`, one of these for each speed
        (one alone counts for all speeds). Kept in one canonical form, so that equal supports compare equal.
    damping
        Viscous, N·s/m, likewise.
    name
        For messages and drawings.
    speeds
        Where stiffness and damping are tabulated, rad/s, ascending; between them both are interpolated
        linearly, outside they are unknown. Empty: constant.
    pedestal
        What the bearing stands on, None for the ground.
    kind
        One of `KINDS`, which say what diagonal entries may be.
    tilting_stiffness
        N·m/rad, isotropic, of a spring that holds the slope, as a long bearing does; a very large one
        clamps the shaft.

    Raises
    ------
    ValueError
        If the node is no whole number from 1 up, or a value is impossible; the message says which.
    """

    node: int
    stiffness: Any = 0.0  # Coefficient, or one per speed
    damping: Any = 0.0
    name: str = ""
    speeds: tuple[float, ...] = ()
    pedestal: Pedestal | None = None
    kind: str = KINDS[0].name
    tilting_stiffness: float = 0.0

    def __post_init__(self) -> None:
        what = attachment(self)
        check_numbers(self, what)
        signed = find(KINDS, self.kind, f"{what}: kind").function < 0
        speeds = tuple(map(float, self.speeds))
        if speeds and not (0 <= speeds[0] < speeds[-1] < math.inf and (np.diff(speeds) > 0).all()):
            raise ValueError(f"{what}: speeds must be at least two, not negative and ascending, in rad/s")
        object.__setattr__(self, "speeds", speeds)
        n = max(1, len(speeds))
        for name in ("stiffness", "damping"):
            value, its = getattr(self, name), f"{what}: {name}"
            if not speeds or np.isscalar(value) or any(np.ndim(row) == 1 for row in value):
                value = [value] * n
            if len(value) != n:
                raise ValueError(f"{its} has {len(value)} values for {n} speeds")
            values = tuple(_canonical(entry, (2, 2), its, signed) for entry in value)
            object.__setattr__(self, name, values if speeds else values[0])

    @property
    def constant(self) -> bool:
        """Whether stiffness and damping are the same at all speeds."""
        return not self.speeds

    @cached_property
    def symmetric(self) -> bool:
        """Whether no direction differs: kxx = kyy, kxy = −kyx, the same for damping and pedestal."""
        if self.plain:
            return True
        xx, xy, yx, yy = self.table.reshape(-1, 4).T
        stand = self.pedestal
        alike = stand is None or {type(stand.stiffness), type(stand.damping)} == {float}
        return alike and np.array_equal((xx, xy), (yy, -yx))

    @property
    def plain(self) -> bool:
        """Whether one stiffness and one damping are all: isotropic, constant, on the ground."""
        return {type(self.stiffness), type(self.damping)} == {float} and self.pedestal is None

    @property
    def coupled(self) -> bool:
        """Whether any stiffness or damping couples x and y."""
        return bool(self.table[..., (0, 1), (1, 0)].any())

    @property
    def damped(self) -> bool:
        """Whether it has any damping, that of the pedestal included."""
        return bool(self.table[1].any() or (self.pedestal and any(self.pedestal.xy("damping"))))

    def at(self, omega: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrices at speeds in rad/s, each of shape (…, 2, 2), without the pedestal.

        Raises
        ------
        ValueError
            Outside the table, but for the rounding of six digits: it is never extrapolated.
        """
        omega = np.asarray(omega, dtype=float)
        if self.constant:
            k, c = self.table.repeat(omega.size, axis=1).reshape(2, *omega.shape, 2, 2)
            return k, c
        first, last = self.speeds[0], self.speeds[-1]
        near = np.clip(omega, first, last)
        outside = omega[~(np.abs(omega - near) <= _ROUNDED * last)]
        if outside.size:
            raise ValueError(
                f"{attachment(self)}: its table holds {first:.6g} to {last:.6g} rad/s, not "
                f"{outside[0]:.6g} rad/s; it is not extrapolated"
            )
        hats = np.array([np.interp(near, self.speeds, row) for row in np.eye(len(self.speeds))])
        k, c = np.einsum("n...,knij->k...ij", hats, self.table)
        return k, c

    def dynamic_stiffness(self, omega: ArrayLike, speed: ArrayLike | None = None) -> ComplexArray:
        """Force per deflection of the rotor's node at frequencies ω, pedestal included, shape (…, 2, 2).

        k + iωc in series with the pedestal's k − ω² m + iωc. Stiffness and damping are those at the
        rotor's `speed`, rad/s; None: at the frequency itself (synchronous).
        """
        bearing, stand = self.dynamic_parts(omega, speed)
        if stand is None:
            return bearing
        return bearing - bearing @ np.linalg.solve(bearing + stand, bearing)

    def dynamic_parts(
        self, omega: ArrayLike, speed: ArrayLike | None = None
    ) -> tuple[ComplexArray, ComplexArray | None]:
        """What `dynamic_stiffness` puts in series: bearing and pedestal, (…, 2, 2) each; None: the ground."""
        k, c = self.at(omega if speed is None else speed)
        w = np.asarray(omega)[..., None, None]
        bearing = k + 1j * w * c
        stand = self.pedestal
        if stand is None:
            return bearing, None
        k, c = np.diag(stand.xy("stiffness")), np.diag(stand.xy("damping"))
        return bearing, k - w * w * stand.mass * np.eye(2) + 1j * w * c

    @cached_property
    def table(self) -> FloatArray:
        """Stiffness and damping at the speeds of the table, or one entry, shape (2, n, 2, 2)."""
        rows = (*self.stiffness, *self.damping) if self.speeds else (self.stiffness, self.damping)
        matrices = [row if isinstance(row, tuple) else ((row, 0.0), (0.0, row)) for row in rows]
        return np.array(matrices).reshape(2, -1, 2, 2)


def _canonical(value: Any, shape: tuple[int, ...], what: str, signed: bool = False) -> Any:  # noqa: ANN401
    """A number where it is the same in all directions, else tuples of this shape."""
    array = np.array(value, dtype=float) + 0.0
    if array.shape not in ((), shape):
        raise ValueError(f"{what} must be a number or of the shape {shape}, not {value!r}")
    first, *between, last = (
        number(entry, what, signed=True) for entry in (array.flat if array.ndim else 2 * [array])
    )
    for entry in (first, last):
        number(entry, what, signed=signed)
    if first == last and not any(between):
        return first
    return (first, last) if array.ndim == 1 else tuple(map(tuple, array.tolist()))


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


def is_reading(path: str) -> bool:
    """Whether it is `probe[NAME].angle`, `.gain` or `key_phasor.angle`: of readings, no number of a rotor.

    Angles in degrees with the rotation: the true one less the one that the job says. A gain is what is
    read over what is there.

    Parameters
    ----------
    path
        Path of a parameter.

    Returns
    -------
    Whether it belongs to readings.
    """
    return re.fullmatch(r"probe\[[^*]+\]\.(angle|gain)|key_phasor\.angle", path) is not None


@holding_arrays
class Calibration:
    """Parameters that were fitted to readings, and how well the rotor with them agrees.

    Attributes
    ----------
    names
        Paths of the parameters, as `fem.parameters.with_parameters` has them, length n.
    values
        What they were found to be, shape (n,); scales relative to the rotor that was calibrated.
    covariance
        Of the parameters as they now stand in the rotor, shape (n, n): of absolute ones in their unit, of a
        scale relative to the rotor as it is now.
    lack_of_fit
        Relative standard deviation of a coefficient that the model leaves.
    needs_trial_run
        Whether the data contradict the model, so that its coefficients alone are not to be trusted.
    data
        Files it was made from, `{name: SHA-256}`: they must not count twice.

    Raises
    ------
    ValueError
        For arrays of another shape, a covariance that is not symmetric or has negative variances, a negative
        lack of fit, a name that comes twice.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    lack_of_fit: float = 0.0
    needs_trial_run: bool = False
    data: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        n = len(self.names)
        if len({*self.names}) < n:
            raise ValueError("calibration: one of its names comes twice")
        for name, shape in {"values": (n,), "covariance": (n, n)}.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.size != math.prod(shape) or not np.isfinite(array).all():
                raise ValueError(f"calibration: {name} must be finite and of the shape {shape}")
            object.__setattr__(self, name, array.reshape(shape))
            read_only(getattr(self, name))
        R = self.correlation
        possible = np.allclose(R, R.T, rtol=0.0, atol=1e-9) and (np.linalg.eigvalsh(R) > -1e-9).all()
        if not possible or not 0 <= self.lack_of_fit < np.inf:
            raise ValueError(
                "calibration: the covariance must be symmetric and must not be negative in any direction, "
                "lack_of_fit finite and not negative"
            )

    @property
    def std(self) -> FloatArray:
        """Standard deviations, shape (n,)."""
        return np.sqrt(np.abs(np.diag(self.covariance)))

    @property
    def correlation(self) -> FloatArray:
        """Correlations of the parameters, shape (n, n); 0 of what has no error."""
        scale = np.where(self.std > 0, self.std, 1.0)
        return self.covariance / scale / scale[:, None]

    def columns(self) -> FloatArray:
        """Principal columns L of the covariance, L Lᵀ = covariance, shape (n, m).

        Those of the correlations, so that units do not count, with an eigenvalue above 1e-12 of the largest.
        """
        values, V = np.linalg.eigh(self.correlation)
        kept = values > 1e-12 * max(values, default=0.0)
        return np.asarray(np.diag(self.std) @ V[:, kept] * np.sqrt(values[kept]))


@holding_arrays
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
        At nodes (`fem.forces`), kept in the order of their kinds: for equilibrium and motion. Linear
        equations take `InternalDamping` of them, which is linear at each speed, and refuse the others.
    calibration
        What a fit to readings found of its parameters, None without one; equal rotors may differ in it.

    Raises
    ------
    ValueError
        With one sentence that says which element, disc or support is impossible, and why.
    """

    length: FloatArray
    outer_diameter: FloatArray
    inner_diameter: FloatArray = 0.0  # type: ignore[assignment]
    youngs_modulus: FloatArray = STEEL_MODULUS  # type: ignore[assignment]
    density: FloatArray = STEEL_DENSITY  # type: ignore[assignment]
    discs: Sequence[Disc] = ()
    supports: Sequence[Support] = ()
    stations: Mapping[str, int] = field(default_factory=dict)
    poisson_ratio: FloatArray = STEEL_POISSON  # type: ignore[assignment]
    material_damping: FloatArray = 0.0  # type: ignore[assignment]
    model: Model = Model()
    forces: Sequence[NodeForce] = ()
    calibration: Calibration | None = None

    def __post_init__(self) -> None:
        n = max(1, *(np.size(getattr(self, name)) for name in _PER_ELEMENT))
        for name, (low, high, limit) in _PER_ELEMENT.items():
            array = np.empty(n)
            try:
                array[:] = getattr(self, name)
            except (TypeError, ValueError):
                raise ValueError(f"{name} must be a number, or one for each of {n} elements") from None
            read_only(array)
            object.__setattr__(self, name, array)
            self._every((low < array) & (array < high), name, limit)
        least = f"1/{SHORTEST} of its longer neighbour's at least, for float64 (join the two)"
        beside = np.hstack((0.0, self.length, 0.0))
        self._every(SHORTEST * self.length >= np.maximum(beside[:-2], beside[2:]), "length", least)
        thinner = self.inner_diameter < self.outer_diameter
        self._every(thinner, "inner_diameter", "smaller than outer_diameter")
        for name, kind in (("discs", Disc), ("supports", Support), ("forces", NodeForce)):
            items = tuple(getattr(self, name))
            for i, item in enumerate(items, start=1):
                if not isinstance(item, kind):
                    raise ValueError(f"{name[:-1]} {i} must be a {kind.__name__}, not {item!r}")
                self._node(item.node, f"{name[:-1]} {i}: ")
            object.__setattr__(self, name, items)
        object.__setattr__(self, "forces", tuple(sorted(self.forces, key=code_of)))
        stations = {
            str(name): self._node(node, f"station {name!r}: ") for name, node in self.stations.items()
        }
        object.__setattr__(self, "stations", stations)

    def _every(self, right: BoolArray, name: str, limit: str) -> None:
        """Refuse the first element that is not right."""
        if not right.all():
            i = np.argmin(right)
            raise ValueError(f"element {i + 1}: {name} must be {limit}, not {getattr(self, name)[i]}")

    __hash__ = None  # type: ignore[assignment]  # compared by value, and arrays have no hash

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rotor):
            return NotImplemented
        names = {*self.__match_args__} - {"calibration"}
        return all(np.array_equal(vars(self)[name], vars(other)[name]) for name in names)

    def __repr__(self) -> str:
        forces = f", {counted(len(self.forces), 'force')}" if self.forces else ""
        return (
            f"Rotor({counted(self.n_elements, 'element')}, {self.positions[-1]:.4g} m, "
            f"{self.total_mass:.4g} kg, {counted(len(self.discs), 'disc')}, "
            f"{counted(len(self.supports), 'support')}{forces})"
        )

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
                raise ValueError(
                    f"no station is called {name_or_number!r}{did_you_mean(name_or_number, self.stations)} "
                    f"(stations: {', '.join(self.stations) or 'none'}); "
                    f"give one of these or a node number from 1 to {self.n_nodes}"
                )
            name_or_number = int(name_or_number)
        return self._node(name_or_number)

    def _node(self, number: int, of: str = "") -> int:
        node = whole(number, f"{of}a node number")
        if not 1 <= node <= self.n_nodes:
            raise ValueError(f"{of}node {node} does not exist: the rotor has nodes 1 to {self.n_nodes}")
        return node

    @property
    def n_elements(self) -> int:
        """Number of shaft elements."""
        return len(self.length)

    @property
    def n_nodes(self) -> int:
        """Number of nodes, one more than elements."""
        return len(self.length) + 1

    @cached_property
    def positions(self) -> FloatArray:
        """Axial position of each node from the left end, m, shape (n + 1,)."""
        positions = np.array([0.0, *self.length]).cumsum()
        read_only(positions)
        return positions

    @cached_property
    def area(self) -> FloatArray:
        """Cross-section of each element, m², shape (n,)."""
        area = math.pi / 4 * (self.outer_diameter**2 - self.inner_diameter**2)
        read_only(area)
        return area

    @cached_property
    def second_moment(self) -> FloatArray:
        """Second moment of area of each element about a diameter, m⁴, shape (n,)."""
        second_moment = self.area * (self.outer_diameter**2 + self.inner_diameter**2) / 16
        read_only(second_moment)
        return second_moment

    @property
    def shear_modulus(self) -> FloatArray:
        """G = E / (2 (1 + ν)) of each element, Pa, shape (n,)."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def shear_coefficient(self) -> FloatArray:
        """Cowper's κ of each element, a circle or a circular ring, shape (n,).

        κ = 6 (1 + ν)(1 + m²)² / ((7 + 6 ν)(1 + m²)² + (20 + 12 ν) m²), m = inner by outer diameter
        (G. R. Cowper, J. Appl. Mech. 33 (1966) 335).
        """
        nu, m2 = self.poisson_ratio, (self.inner_diameter / self.outer_diameter) ** 2
        ring = (1 + m2) ** 2
        return 6 * (1 + nu) * ring / ((7 + 6 * nu) * ring + (20 + 12 * nu) * m2)

    @cached_property
    def symmetric(self) -> bool:
        """Whether every support is rotationally symmetric, so that one complex coordinate is enough."""
        return all(support.symmetric for support in self.supports)

    @cached_property
    def constant(self) -> bool:
        """Whether no support depends on speed."""
        return all(support.constant for support in self.supports)

    @property
    def knots(self) -> FloatArray:
        """Speeds at which a table of a support may change its slope, rad/s, ascending."""
        return np.unique([speed for support in self.supports for speed in support.speeds])

    @property
    def linear(self) -> Rotor:
        """The rotor without any of its forces, internal damping included."""
        return replace(self, forces=()) if self.forces else self

    @property
    def total_mass(self) -> float:
        """Mass of shaft and discs, kg."""
        shaft = self.density * self.area @ self.length
        return float(shaft) + sum(disc.mass for disc in self.discs)


_ABOVE_ZERO = 0.0, math.inf, "finite and greater than zero"
_FROM_ZERO = -math.ulp(0.0), math.inf, "finite and not negative"
_PER_ELEMENT = {
    "length": _ABOVE_ZERO,
    "outer_diameter": _ABOVE_ZERO,
    "inner_diameter": _FROM_ZERO,
    "youngs_modulus": _ABOVE_ZERO,
    "density": _FROM_ZERO,
    "poisson_ratio": (-1.0, math.nextafter(0.5, 1.0), "finite and above -1, at most 0.5"),
    "material_damping": _FROM_ZERO,
}
"""What is given for each element: between which values, and their words."""


def refined(rotor: Rotor, times: int) -> Rotor:
    """The same rotor with each element cut into equal parts; nodes are renumbered.

    Parameters
    ----------
    rotor
        Whose elements are cut.
    times
        Into how many parts, 1 or more.

    Raises
    ------
    ValueError
        If `times` is below 1.
    """

    def moved(node: int) -> int:
        return times * (node - 1) + 1

    new: dict[str, Any] = {name: np.repeat(getattr(rotor, name), times) for name in _PER_ELEMENT}
    new["length"] /= times
    for name in ("discs", "supports", "forces"):
        new[name] = [replace(item, node=moved(item.node)) for item in getattr(rotor, name)]
    return replace(rotor, **new, stations={name: moved(node) for name, node in rotor.stations.items()})


@dataclass(frozen=True)
class Sensor:
    """A probe at a node that reads the deflection in one direction.

    Attributes
    ----------
    node
        Number, from 1, or name of a station.
    angle
        Of its direction from x with the rotation, degrees.

    Raises
    ------
    ValueError
        If the angle is not finite.
    """

    node: str | int
    angle: float = 0.0

    def __post_init__(self) -> None:
        angle = number(self.angle, f"sensor at {self.node!r}: angle", signed=True)
        object.__setattr__(self, "angle", angle)

    def __str__(self) -> str:
        return f"{self.node} at {self.angle:g}°" if self.angle else str(self.node)

    @property
    def radians(self) -> float:
        """The angle in rad."""
        return math.radians(self.angle)


SensorLike = str | int | tuple[str | int, float] | Sensor


def as_sensor(sensor: SensorLike, rotor: Rotor) -> Sensor:
    """A sensor from a node, a station, a pair (node, angle in degrees) or a Sensor.

    Parameters
    ----------
    sensor
        What names it.
    rotor
        The rotor it stands at.

    Raises
    ------
    ValueError
        If there is no such node, or it is none of these.
    """
    if isinstance(sensor, tuple) and len(sensor) != 2:
        raise ValueError(f"a sensor is a node or a pair (node, angle in degrees), not {sensor!r}")
    if not isinstance(sensor, Sensor):
        sensor = Sensor(*(sensor if isinstance(sensor, tuple) else (sensor,)))
    rotor.node(sensor.node)
    return sensor


def label(sensor: SensorLike) -> str | int:
    """Name of a sensor in tables: as given, or "5 at 45°".

    Parameters
    ----------
    sensor
        As `as_sensor` takes it.

    Returns
    -------
    Node or station, with its angle where that is not 0.
    """
    if isinstance(sensor, tuple):
        sensor = Sensor(*sensor)
    return str(sensor) if isinstance(sensor, Sensor) else sensor
