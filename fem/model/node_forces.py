"""Forces at nodes that are not linear: films, seals, springs, stops; a new kind goes here.

Their laws, F(x, y, x', y', Ω) with derivatives, are in `fem.forces`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.checks import attachment, number
from rotorid.base.registry import Method, names
from rotorid.base.suggestions import one_of

Film = Literal["pressure", "line of centres"]
"""Where a journal's film carries: where its pressure is positive, or on the half circle that the line of
centres bounds, on the side where a steady journal's pressure is positive (the textbook's π film)."""


@dataclass(frozen=True)
class NodeForce:
    """What all of them have; their numbers are finite and not negative.

    Attributes
    ----------
    node, name
        From 1; for messages and drawings.

    Raises
    ------
    ValueError
        If the node is no whole number from 1 up, or a value is impossible; the message says which.
    """

    node: int
    name: str = ""

    above_zero: ClassVar[tuple[str, ...]] = ()
    """Numbers that must be so, 1e-30 at least."""

    def __post_init__(self) -> None:
        what = attachment(self)
        for item in fields(self):
            if item.type != "float":
                continue
            value = number(getattr(self, item.name), f"{what}: {item.name}")
            if value < 1e-30 and item.name in self.above_zero:
                raise ValueError(f"{what}: {item.name} must be above 0, not {value:g}")
            object.__setattr__(self, item.name, value)

    @property
    def parameters(self) -> FloatArray:
        """Its numbers in SI in the order in which the law takes them."""
        return np.array([getattr(self, item.name) for item in fields(self) if item.type == "float"])

    @property
    def mass(self) -> float:
        """Inertia that it adds at its node, kg: that of a seal's fluid."""
        return float(getattr(self, "fluid_mass", 0.0))

    @property
    def wall(self) -> float:
        """From the centre to where its law ends, m: its clearance; infinite without one."""
        return float(getattr(self, "clearance", np.inf))


@dataclass(frozen=True)
class ShortFilm(NodeForce):
    """A film that is short along the shaft: up to half the diameter; a longer one carries less than it says.

    Attributes
    ----------
    node, name
        As of `NodeForce`.
    length, diameter, clearance, viscosity
        Along the shaft, and of the journal; radial, m; Pa·s.
    """

    length: float = 0.0
    diameter: float = 0.0
    clearance: float = 0.0
    viscosity: float = 0.0

    above_zero: ClassVar[tuple[str, ...]] = ("length", "diameter", "clearance", "viscosity")


@dataclass(frozen=True)
class JournalBearing(ShortFilm):
    """A short plain journal bearing (Ocvirk), its film where the rotor's weight and motion put it.

    Attributes
    ----------
    node, name, length, diameter, clearance, viscosity
        As of `ShortFilm`.
    film
        Where it carries, see `Film`.
    """

    film: Film = "pressure"

    def __post_init__(self) -> None:
        super().__post_init__()
        one_of(self.film, "film", get_args(Film))


@dataclass(frozen=True)
class SqueezeFilm(ShortFilm):
    """A short squeeze-film damper, its film where the pressure is positive; its ring does not turn.

    Attributes
    ----------
    node, name, length, diameter, clearance, viscosity
        As of `ShortFilm`.
    centring_stiffness
        N/m, of the spring that centres it; 0 for none.
    """

    centring_stiffness: float = 0.0


@dataclass(frozen=True)
class MuszynskaSeal(NodeForce):
    """An annular seal after Muszynska: its fluid turns at τ Ω, the less the more eccentric the shaft is.

    K = K₀ (1 − e²)⁻ⁿ, D = D₀ (1 − e²)⁻ⁿ, τ = τ₀ (1 − e)ᵇ with e = |z| / clearance, and, z = x + iy,

        F = −(K − m τ² Ω² − i τ Ω D) z − (D − 2 i τ Ω m) z' − m z''.

    With both exponents 0 its coefficients are constant. Sources: A. Muszynska, J. Sound Vib. 110 (1986) 443;
    A. Muszynska, D. E. Bently, J. Sound Vib. 143 (1990) 103.

    Attributes
    ----------
    node, name, stiffness, damping, fluid_mass
        As of `NodeForce`; K₀ N/m, D₀ N·s/m, m kg.
    swirl_ratio
        τ₀, fluid's mean speed by the shaft's, about 0.5 or less.
    clearance
        m.
    stiffness_exponent, swirl_exponent
        n, from 0.5 to 3 in print, and b, from 0 to 1.
    """

    stiffness: float = 0.0
    damping: float = 0.0
    fluid_mass: float = 0.0
    swirl_ratio: float = 0.0
    clearance: float = 0.0
    stiffness_exponent: float = 2.0
    swirl_exponent: float = 0.5

    above_zero: ClassVar[tuple[str, ...]] = ("clearance",)


@dataclass(frozen=True)
class CubicSpring(NodeForce):
    """A spring with a cubic part: F = −(k + k₃ |z|²) z.

    Attributes
    ----------
    node, name, stiffness, cubic_stiffness
        As of `NodeForce`; k, N/m, and k₃, N/m³.
    """

    stiffness: float = 0.0
    cubic_stiffness: float = 0.0


@dataclass(frozen=True)
class Stop(NodeForce):
    """A ring around the shaft that it rubs on beyond a gap, with dry friction.

    Normal force k (|z| − gap) + c |z|', not below 0; friction µ times it against the slip v = v_t + Ω R, as
    tanh(v / v₀).

    Attributes
    ----------
    node, name, gap, stiffness, damping
        As of `NodeForce`; m; N/m and N·s/m of the contact.
    friction, diameter
        µ; 2 R of the shaft where it rubs, m.
    slip_speed
        v₀, m/s, below which friction grows with the slip.
    """

    gap: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    diameter: float = 0.0
    slip_speed: float = 0.01

    above_zero: ClassVar[tuple[str, ...]] = ("stiffness", "slip_speed")


@dataclass(frozen=True)
class InternalDamping(NodeForce):
    """Damping that turns with the shaft, as of a shrink fit: F = −c (z' − i Ω z).

    Source: A. L. Kimball, Gen. Electr. Rev. 27 (1924) 244.

    Attributes
    ----------
    node, name, damping
        As of `NodeForce`; c, N·s/m.
    """

    damping: float = 0.0


FORCES: tuple[Method[Any], ...] = (
    Method("journal_bearing", "a short plain journal bearing (Ocvirk)", JournalBearing),
    Method("squeeze_film", "a short squeeze-film damper", SqueezeFilm),
    Method("annular_seal", "an annular seal after Muszynska", MuszynskaSeal),
    Method("cubic_spring", "a spring with a cubic part", CubicSpring),
    Method("stop", "a ring that the shaft rubs on beyond a gap", Stop),
    Method("internal_damping", "damping that turns with the shaft", InternalDamping),
)
"""Kinds of forces as rotor files name them."""


def kind_of(force: NodeForce) -> str:
    """Its name in `FORCES`.

    Raises
    ------
    ValueError
        For what is none of them.
    """
    for method in FORCES:
        if type(force) is method.function:
            return method.name
    raise ValueError(f"{attachment(force)} is no force: one of {', '.join(names(FORCES))} is")


def in_order(forces: Iterable[NodeForce]) -> tuple[NodeForce, ...]:
    """Sorted by `kind_of`, as files have them; of one kind as they are."""
    return tuple(sorted(forces, key=lambda force: names(FORCES).index(kind_of(force))))
