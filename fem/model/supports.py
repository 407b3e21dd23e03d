"""Bearings, seals and the pedestals under them: the kinds of supports; a new kind goes here."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.checks import attachment, number
from rotorid.base.registry import Method, find

ROUNDED = 5e-6  # relative error of a speed that was written with six digits: it does not end a table
Matrix2 = tuple[tuple[float, float], tuple[float, float]]
Coefficient = float | Matrix2  # isotropic, or ((xx, xy), (yx, yy))
Pair = float | tuple[float, float]  # in both directions, or in x and in y
KINDS = (
    Method("bearing", "pushes back and brakes: its own stiffness and damping are not negative", 0.0),
    Method("seal", "may push outwards or drive, and is left out of maps over bearing stiffness", -math.inf),
)
"""Kinds of supports, with the lowest diagonal entry of their stiffness and damping."""


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
        object.__setattr__(self, "mass", number(self.mass, "pedestal: mass"))
        for name in ("stiffness", "damping"):
            object.__setattr__(self, name, _pair(getattr(self, name), f"pedestal: {name}"))
        if min(self.xy("stiffness")) <= 0:
            raise ValueError("pedestal: stiffness must be above 0 in x and y; leave out a rigid pedestal")

    def xy(self, name: Literal["stiffness", "damping"]) -> tuple[float, float]:
        """Stiffness or damping in x and in y."""
        value = getattr(self, name)
        return value if isinstance(value, tuple) else (value, value)

    @property
    def symmetric(self) -> bool:
        """Whether both directions are equal."""
        return not isinstance(self.stiffness, tuple) and not isinstance(self.damping, tuple)


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
        signed = find(KINDS, self.kind, f"{what}: kind").function < 0
        if self.pedestal is not None and not isinstance(self.pedestal, Pedestal):
            raise ValueError(f"{what}: pedestal must be a Pedestal, not {self.pedestal!r}")
        object.__setattr__(self, "speeds", _speeds(self.speeds, what))
        for name in ("stiffness", "damping"):
            value = _coefficients(getattr(self, name), len(self.speeds), f"{what}: {name}", signed)
            object.__setattr__(self, name, value)
        tilting = number(self.tilting_stiffness, f"{what}: tilting_stiffness")
        object.__setattr__(self, "tilting_stiffness", tilting)

    @property
    def constant(self) -> bool:
        """Whether stiffness and damping are the same at all speeds."""
        return not self.speeds

    @property
    def symmetric(self) -> bool:
        """Whether no direction differs: kxx = kyy, kxy = −kyx, the same for damping and pedestal."""
        tables = self._tables
        alike = np.array_equal(tables[..., 0, 0], tables[..., 1, 1])
        turned = np.array_equal(tables[..., 0, 1], -tables[..., 1, 0])
        return alike and turned and (self.pedestal is None or self.pedestal.symmetric)

    @property
    def plain(self) -> bool:
        """Whether one stiffness and one damping are all: isotropic, constant, on the ground."""
        return (
            self.constant
            and self.pedestal is None
            and not isinstance(self.stiffness, tuple)
            and not isinstance(self.damping, tuple)
        )

    @property
    def coupled(self) -> bool:
        """Whether any stiffness or damping couples x and y."""
        return bool(self._tables[..., (0, 1), (1, 0)].any())

    @property
    def damped(self) -> bool:
        """Whether it has any damping, that of the pedestal included."""
        return bool(self._tables[1].any()) or (
            self.pedestal is not None and max(self.pedestal.xy("damping")) > 0
        )

    def at(self, omega: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrices at speeds in rad/s, each of shape (…, 2, 2), without the pedestal.

        Raises
        ------
        ValueError
            Outside the table, but for the rounding of six digits: it is never extrapolated.
        """
        omega = np.asarray(omega, dtype=float)
        if self.constant:
            k, c = self._tables[:, 0]
            shape = (*omega.shape, 2, 2)
            return np.broadcast_to(k, shape), np.broadcast_to(c, shape)
        first, last = self.speeds[0], self.speeds[-1]
        slack = ROUNDED * last
        if omega.size and not (omega.min() >= first - slack and omega.max() <= last + slack):
            outside = omega.min() if omega.min() < first - slack else omega.max()
            raise ValueError(
                f"support{f' {self.name!r}' if self.name else ''} at node {self.node}: its table holds "
                f"{first:.6g} to {last:.6g} rad/s, not {float(outside):.6g} rad/s; it is not extrapolated, "
                "extend the table or stay inside"
            )
        columns = self._tables.swapaxes(0, 1).reshape(len(self.speeds), 8).T
        flat = np.stack([np.interp(omega, self.speeds, column) for column in columns], axis=-1)
        both = flat.reshape(*omega.shape, 2, 2, 2)
        return both[..., 0, :, :], both[..., 1, :, :]

    def dynamic_stiffness(self, omega: ArrayLike, speed: ArrayLike | None = None) -> ComplexArray:
        """Force per deflection of the rotor's node at frequencies ω, pedestal included, shape (…, 2, 2).

        k + iωc in series with the pedestal's k − ω² m + iωc. Stiffness and damping are those at the
        rotor's `speed`, rad/s; None: at the frequency itself (synchronous).
        """
        bearing, stand = self.dynamic_parts(omega, speed)
        if stand is None:
            return bearing
        return np.asarray(bearing - bearing @ np.linalg.solve(bearing + stand, bearing))

    def dynamic_parts(
        self, omega: ArrayLike, speed: ArrayLike | None = None
    ) -> tuple[ComplexArray, ComplexArray | None]:
        """What `dynamic_stiffness` puts in series: bearing and pedestal, (…, 2, 2) each; None: the ground."""
        omega = np.asarray(omega, dtype=float)
        k, c = self.at(omega if speed is None else np.broadcast_to(np.asarray(speed, float), omega.shape))
        bearing = np.asarray(k + 1j * omega[..., None, None] * c)
        if self.pedestal is None:
            return bearing, None
        stand = np.zeros((*omega.shape, 2, 2), dtype=complex)
        for i in (0, 1):
            stand[..., i, i] = (
                self.pedestal.xy("stiffness")[i]
                - omega * omega * self.pedestal.mass
                + 1j * omega * self.pedestal.xy("damping")[i]
            )
        return bearing, stand

    @cached_property
    def _tables(self) -> FloatArray:
        """Stiffness and damping at the speeds of the table, or one entry, shape (2, n, 2, 2)."""
        both = ((v if self.speeds else (v,)) for v in (self.stiffness, self.damping))
        return np.array([[_full(entry) for entry in entries] for entries in both])


def _full(entry: Coefficient) -> FloatArray:
    return np.array(entry) if isinstance(entry, tuple) else entry * np.eye(2)


def _pair(value: object, what: str) -> Pair:
    if not hasattr(value, "__len__") or isinstance(value, str):
        return number(value, what)
    if len(value) != 2:
        raise ValueError(f"{what} must be a number or a pair (x, y), not {value!r}")
    x, y = (number(entry, f"{what} in {axis}") for entry, axis in zip(value, "xy", strict=True))  # type: ignore[call-overload]
    return x if x == y else (x, y)


def _speeds(speeds: Iterable[float], what: str) -> tuple[float, ...]:
    try:
        values = tuple(float(speed) for speed in speeds)
    except (TypeError, ValueError):
        raise ValueError(f"{what}: speeds must be a list of numbers in rad/s, not {speeds!r}") from None
    if not values:
        return values
    array = np.array(values)
    if len(values) < 2 or not np.isfinite(array).all() or array[0] < 0 or (np.diff(array) <= 0).any():
        raise ValueError(f"{what}: speeds must be at least two, not negative and ascending, in rad/s")
    return values


def _coefficients(value: Any, n: int, what: str, signed: bool) -> object:  # noqa: ANN401
    """One canonical coefficient, or n of them for a table."""
    if not n:
        return _coefficient(value, what, signed)
    if isinstance(value, str) or not hasattr(value, "__len__") or _is_matrix(value):
        return (_coefficient(value, what, signed),) * n
    if len(value) != n:
        raise ValueError(f"{what} has {len(value)} values for {n} speeds; give one for each speed, or one")
    return tuple(_coefficient(entry, f"{what} {i}", signed) for i, entry in enumerate(value, start=1))


def _is_matrix(value: ArrayLike) -> bool:
    try:
        return np.shape(value) == (2, 2)
    except ValueError:  # entries of different shape: a table of numbers and matrices
        return False


def _coefficient(value: Any, what: str, signed: bool) -> Coefficient:  # noqa: ANN401
    if isinstance(value, str) or not hasattr(value, "__len__"):
        return number(value, what, signed=signed)
    if not _is_matrix(value):
        raise ValueError(f"{what} must be a number or 2 × 2, ((xx, xy), (yx, yy)), not {value!r}")
    (xx, xy), (yx, yy) = (
        tuple(
            number(entry, f"{what} {name}", signed=signed or name in ("xy", "yx"))
            for entry, name in zip(row, names, strict=True)
        )
        for row, names in zip(value, (("xx", "xy"), ("yx", "yy")), strict=True)
    )
    if xx == yy and xy == yx == 0 and (xx >= 0 or signed):
        return xx
    return ((xx, xy), (yx, yy))
