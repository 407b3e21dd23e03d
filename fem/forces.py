"""Forces at nodes that are not linear: films, seals, springs, stops; their data, laws and derivatives.

A law is F(z, z', Ω) with z = x + i y. In a frame that is turned by n = exp(iβ), components along n and across
it being those of z n̄, a force f n has the derivatives by x and y that `law` writes from those of f along n
and across it.

**Film of a short journal bearing or squeeze-film damper (Ocvirk).** With h = c − x cos θ − y sin θ and
a = x' + Ω y / 2, b = y' − Ω x / 2, Reynolds' equation without flow around the journal gives the pressure,
summed over the length,

    P(θ) = η L³ (a cos θ + b sin θ) / h³,

positive on the half circle around α = atan2(b, a). With R = D / 2 and θ = β + φ, the film being the half
circle around β (there φ runs from −π/2 to π/2), and p + i q = z n̄ / c, u + i w = (a + i b) n̄, the force on
the journal, F = −R ∫ P exp(iθ) dθ, is F n̄ = −C (u I₁ + w I₂ + i (u I₂ + w I₃)), C = η L³ R / c³, with

    I₁, I₂, I₃ = ∫ (cos² φ, sin φ cos φ, sin² φ) / (1 − p cos φ − q sin φ)³ dφ
               = ½ J_pp, ½ J_pq, ½ J_qq  of  J = ∫ dφ / (1 − p cos φ − q sin φ).

With k² = 1 − p² − q²: J = (2 / k) atan2(k, −p), J_p = (2 + p J) / k², J_q = q (2 p / (1 − q²) + J) / k²,
and so on by differentiation. Where the film is that of positive pressure, β = α, the force does not change
with β alone, since the pressure is zero at both ends. Where it is bound to the line of centres, β = atan2(−x,
y), so that p = 0 and q = |z| / c, the ends count, ∂(F n̄)/∂β = −i C w ((1 − q)⁻³ − (1 + q)⁻³)
= −2 i C w q (3 + q²) (1 − q²)⁻³, and β changes with the displacement along n, by −1 / |z|.

That film is the textbook's: where the line of centres turns faster than the fluid, u < 0, its pressure would
pull, and the force along the line of centres keeps the sign that it has below: |u| I₂ in place of u I₂ there,
which adds 2 C u I₂ (i n) to the force.

**Stop.** With n = z / |z|, the normal force N = k (|z| − gap) + c |z|', not below 0, and the slip
s = Im(z' n̄) + Ω R: F = −N (1 + i µ tanh(s / v₀)) n.

**Seal, spring, internal damping.** F = −A z − B z' with complex functions A and B of |z|² and Ω.

Sources: F. W. Ocvirk, NACA TN 2808 (1952); for the film of positive pressure G. Adiletta, A. R. Guido, C.
Rossi, Nonlinear Dynamics 10 (1996) 251; R. F. Beatty, J. Vib. Acoust. Stress Reliab. Des. 107 (1985) 151, for
a stop with Coulomb friction, here with damping, and smooth around no slip; others at their classes.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from rotorid.base.arrays import FloatArray, IndexArray, attachment, number
from rotorid.base.choices import Method, one_of
from rotorid.base.compiled import compiled_part

Film = Literal["pressure", "line of centres"]
"""Where a journal's film carries: where its pressure is positive, or on the half circle that the line of
centres bounds, on the side where a steady journal's pressure is positive (the textbook's π film)."""


def check_numbers(item: Any, what: str) -> None:  # noqa: ANN401
    """Make plain floats of the fields of that type of a frozen dataclass: finite and not negative."""
    for each in fields(item):
        if each.type == "float":
            value = number(getattr(item, each.name), f"{what}: {each.name}")
            if value < 1e-30 and each.name in getattr(item, "above_zero", ()):
                raise ValueError(f"{what}: {each.name} must be above 0, not {value:g}")
            object.__setattr__(item, each.name, value)


@dataclass(frozen=True)
class NodeForce:
    """A force at a node: what all kinds have; their numbers are finite and not negative.

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
        check_numbers(self, attachment(self))

    @property
    def parameters(self) -> Sequence[float]:
        """Its wall and its numbers, in SI, in the order in which the law takes them."""
        return self.wall, *(getattr(self, each.name) for each in fields(self) if each.type == "float")

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

    above_zero = ("length", "diameter", "clearance", "viscosity")

    @property
    def parameters(self) -> Sequence[float]:
        """Its wall, C, whether of the line of centres, the spring's stiffness, whether it turns."""
        C = self.viscosity * self.length**3 * self.diameter / 2 / self.clearance**3
        by_line = getattr(self, "film", "") == "line of centres"
        spring = getattr(self, "centring_stiffness", 0.0)
        return self.clearance, C, by_line, spring, isinstance(self, JournalBearing)


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

    above_zero = ("clearance",)


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

    above_zero = ("stiffness", "slip_speed")


@dataclass(frozen=True)
class InternalDamping(NodeForce):
    """Damping that turns with the shaft, as of a shrink fit: F = −c (z' − i Ω z), linear at each speed.

    Source: A. L. Kimball, Gen. Electr. Rev. 27 (1924) 244.

    Attributes
    ----------
    node, name, damping
        As of `NodeForce`; c, N·s/m.
    """

    damping: float = 0.0

    @property
    def parameters(self) -> Sequence[float]:
        """Those of a seal whose fluid turns with the shaft, without a wall."""
        return math.inf, 0.0, self.damping, 0.0, 1.0


FORCES: tuple[Method[Any], ...] = (
    Method("journal_bearing", "a short plain journal bearing (Ocvirk)", JournalBearing),
    Method("squeeze_film", "a short squeeze-film damper", SqueezeFilm),
    Method("annular_seal", "an annular seal after Muszynska", MuszynskaSeal),
    Method("cubic_spring", "a spring with a cubic part", CubicSpring),
    Method("stop", "a ring that the shaft rubs on beyond a gap", Stop),
    Method("internal_damping", "damping that turns with the shaft", InternalDamping),
)
"""Kinds of forces as rotor files name them, in the order in which rotors keep and `law` numbers them."""
_SQUEEZE, _SPRING, _STOP = 1, 3, 4
_WALL = 1e-14  # of 1 − ε², below which it is rounding


def kind_of(force: NodeForce) -> str:
    """Name of the kind of a force, as in `FORCES`.

    Raises
    ------
    ValueError
        For what is none of them.
    """
    return FORCES[code_of(force)].name


def code_of(force: NodeForce) -> int:
    """Number of the kind of a force, its place in `FORCES`; ValueError as `kind_of`."""
    return [method.function for method in FORCES].index(type(force))


def tables(forces: Sequence[NodeForce]) -> tuple[IndexArray, FloatArray]:
    """Code of the law of each force, shape (f,), and its parameters, shape (f, 8), as `law` takes them."""
    values = [[*force.parameters, *7 * (0.0,)][:8] for force in forces]
    return np.array([code_of(force) for force in forces], dtype=np.intp), np.reshape(values, (-1, 8))


@compiled_part
def law(
    code: int, v: FloatArray, x: float, y: float, vx: float, vy: float, omega: float, out: FloatArray
) -> None:
    """Force of one kind at a node and its derivatives.

    Parameters
    ----------
    code, v
        Of `tables`.
    x, y, vx, vy, omega
        Of the node, m and m/s, and of the shaft, rad/s.
    out
        Written: (F_x, F_y) in N and their derivatives by x, y, x', y' and Ω, shape (2, 6); NaN on or beyond
        the wall.
    """
    z, dz, e2 = complex(x, y), complex(vx, vy), x * x + y * y
    inside = 1.0 - e2 / (v[0] * v[0])
    if not inside > _WALL:
        out[:, :] = math.nan
        return
    if code <= _SQUEEZE:
        parts = _film(v, z, dz, omega, inside)
    elif code == _STOP:
        parts = _stop(v, z, dz, omega)
    else:
        if code == _SPRING:
            A, B, F_e, F_o = v[1] + v[2] * e2 + 0j, 0j, -v[2] * z, 0j
        else:
            c, K0, D0, m, tau0, _, n, b = v
            stiffer, e = inside**-n, math.sqrt(e2) / c
            K, D, tau = K0 * stiffer, D0 * stiffer, tau0 * (1.0 - e) ** b
            s = tau * omega
            A, B = K - m * s * s - 1j * s * D, D - 2j * s * m
            F_s = (2.0 * m * s + 1j * D) * z + 2j * m * dz
            # by |z|², of which 1 − e and 1 − e² are functions, and by Ω
            less = 0.5 * b * s / ((1.0 - e) * e) if e > 0.0 else 0.0
            F_e = -(less * F_s + n / inside * ((K - 1j * s * D) * z + D * dz)) / (c * c)
            F_o = tau * F_s
        parts = 1 + 0j, -A * z - B * dz, 2.0 * x * F_e - A, 2.0 * y * F_e - 1j * A, -B, -1j * B, F_o
    turn, F, along, across, along_v, across_v, by_omega = parts
    cos, sin = turn.real, turn.imag
    by_x, by_y = cos * along - sin * across, sin * along + cos * across
    by_vx, by_vy = cos * along_v - sin * across_v, sin * along_v + cos * across_v
    for i, value in enumerate((F, by_x, by_y, by_vx, by_vy, by_omega)):
        turned = turn * value
        out[0, i], out[1, i] = turned.real, turned.imag


@compiled_part
def _film(v: FloatArray, z: complex, dz: complex, omega: float, k2: float) -> tuple[complex, ...]:
    """Of a film and its centring spring: n, F n̄, its derivatives along n and across by z, by z', and by Ω."""
    c, C, line_of_centres, spring, turns = v[0], v[1], v[2] > 0.0, v[3], 0.5 * v[4]
    flow = dz - 1j * turns * omega * z
    n = cmath.rect(1.0, cmath.phase(-1j * z if line_of_centres else flow))
    place, flow = z / c * n.conjugate(), flow * n.conjugate()
    p, q, u, w = place.real, place.imag, flow.real, flow.imag

    k, r = math.sqrt(k2), 1.0 / k2  # J and its derivatives times −C / 2
    J = -C / k * math.atan2(k, -p)
    d = 1.0 / (1.0 - q * q)
    ends = -2.0 * C * q * (3.0 + q * q) * d * d * d
    Jp = (p * J - C) * r
    Jq = q * (J - C * p * d) * r
    Jpp = (J + 3.0 * p * Jp) * r
    Jpq = (p * Jq + 2.0 * q * Jp) * r
    Jqq = (J + 3.0 * q * Jq - C * p * (1.0 + q * q) * d * d) * r
    Jppp = (4.0 * Jp + 5.0 * p * Jpp) * r
    Jppq = (Jq + 3.0 * p * Jpq + 2.0 * q * Jpp) * r
    Jpqq = (p * Jqq + 2.0 * Jp + 4.0 * q * Jpq) * r
    Jqqq = (p * ends + 4.0 * Jq + 5.0 * q * Jqq) * r

    by_u, by_w = complex(Jpp, Jpq), complex(Jpq, Jqq)
    by_p = u * complex(Jppp, Jppq) + w * complex(Jppq, Jpqq)
    by_q = u * complex(Jppq, Jpqq) + w * complex(Jpqq, Jqqq)
    if line_of_centres and q > 0.0:
        by_p -= 1j * w * ends / q
        if u < 0.0:
            by_u = by_u.conjugate()
            by_p += 2j * Jpq * complex(w, u) / q
            by_q -= 2j * u * Jpqq
    # the flow changes with the place and with Ω
    along = by_p / c - turns * omega * by_w - spring
    across = by_q / c + turns * omega * by_u - 1j * spring
    by_omega = turns * c * (q * by_u - p * by_w)
    return n, u * by_u + w * by_w - spring * c * place, along, across, by_u, by_w, by_omega


@compiled_part
def _stop(v: FloatArray, z: complex, dz: complex, omega: float) -> tuple[complex, ...]:
    """Force of a stop with its derivatives, as `_film` returns them; zeros without contact."""
    _, gap, k, c, friction, diameter, v0, _ = v
    r = abs(z)
    n = z / r if r > gap else 0j
    speed = dz * n.conjugate()
    N = k * (r - gap) + c * speed.real
    if not N > 0.0:
        return 0j, 0j, 0j, 0j, 0j, 0j, 0j
    f = math.tanh((speed.imag + omega * diameter / 2.0) / v0)
    push = complex(-1.0, -friction * f)  # F n̄ = N push
    by_slip = complex(0.0, -friction * N * (1.0 - f * f) / v0)
    # along an arc n turns, and z' n̄ the other way
    by_arc = (c * speed.imag * push - speed.real * by_slip + 1j * N * push) / r
    return n, N * push, k * push, by_arc, c * push, by_slip, diameter / 2.0 * by_slip
