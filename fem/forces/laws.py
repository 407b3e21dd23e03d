"""One function for the law of every kind of `fem.model.node_forces`, for code that is compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fem.forces.short_film import short_film
from fem.forces.stop import stop
from fem.model.node_forces import (
    CubicSpring,
    InternalDamping,
    JournalBearing,
    MuszynskaSeal,
    NodeForce,
    ShortFilm,
    SqueezeFilm,
    Stop,
)
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.compiled import compiled_part

_FILM, _SEAL, _SPRING, _STOP, _INTERNAL = range(5)
_CODES = {
    JournalBearing: _FILM,
    SqueezeFilm: _FILM,
    MuszynskaSeal: _SEAL,
    CubicSpring: _SPRING,
    Stop: _STOP,
    InternalDamping: _INTERNAL,
}
_WIDTH = 7  # of the longest list of parameters


def tables(forces: Sequence[NodeForce]) -> tuple[IndexArray, FloatArray]:
    """Code of the law of each force, shape (f,), and its parameters, shape (f, 7), as `law` takes them."""
    codes = np.array([_CODES[type(force)] for force in forces], dtype=np.intp)
    values = np.zeros((len(forces), _WIDTH))
    for row, force in zip(values, forces, strict=True):
        if isinstance(force, ShortFilm):
            C = force.viscosity * force.length**3 * force.diameter / 2 / force.clearance**3
            by_line = getattr(force, "film", "") == "line of centres"
            centred = getattr(force, "centring_stiffness", 0.0)
            row[:5] = C, force.clearance, isinstance(force, JournalBearing), by_line, centred
        else:
            row[: len(force.parameters)] = force.parameters
    return codes, values


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
    if code == _FILM:
        short_film(v[0], v[1], x, y, vx, vy, omega * v[2], v[3] > 0.0, out)
        for i in range(2):
            out[i, 5] *= v[2]
            out[i, 0] -= v[4] * (x if i == 0 else y)
            out[i, 1 + i] -= v[4]
        return
    if code == _STOP:
        stop(v, x, y, vx, vy, omega, out)
        return
    # F = −A z − B z' with complex functions of |z| and Ω, and their derivatives by |z|² and Ω
    z, dz, e2 = complex(x, y), complex(vx, vy), x * x + y * y
    A, B, A_e, B_e, A_o, B_o = 0j, 0j, 0j, 0j, 0j, 0j
    if code == _SPRING:
        A, A_e = v[0] + v[1] * e2 + 0j, v[1] + 0j
    elif code == _INTERNAL:
        A, B, A_o = -1j * omega * v[0], v[0] + 0j, -1j * v[0]
    else:
        K0, D0, m, tau0, c, n, b = v[0], v[1], v[2], v[3], v[4], v[5], v[6]
        E = e2 / (c * c)
        if not E < 1.0:
            out[:, :] = math.nan
            return
        e = math.sqrt(E)
        stiffer = (1.0 - E) ** -n
        K, D, tau = K0 * stiffer, D0 * stiffer, tau0 * (1.0 - e) ** b
        grow = n / (1.0 - E) / (c * c)  # of K and D by |z|²
        less = -0.5 * b * tau / ((1.0 - e) * e) / (c * c) if e > 0.0 else 0.0  # of τ by |z|²
        s = tau * omega
        A, B = K - m * s * s - 1j * s * D, D - 2j * s * m
        A_s, B_s = -2.0 * m * s - 1j * D, -2j * m
        A_e = grow * (K - 1j * s * D) + A_s * less * omega
        B_e = grow * D + B_s * less * omega
        A_o, B_o = A_s * tau, B_s * tau
    F, F_e, F_o = -A * z - B * dz, -A_e * z - B_e * dz, -A_o * z - B_o * dz
    by_x, by_y = 2.0 * x * F_e - A, 2.0 * y * F_e - 1j * A
    out[0, 0], out[1, 0] = F.real, F.imag
    out[0, 1], out[1, 1] = by_x.real, by_x.imag
    out[0, 2], out[1, 2] = by_y.real, by_y.imag
    out[0, 3], out[1, 3] = -B.real, -B.imag
    out[0, 4], out[1, 4] = B.imag, -B.real
    out[0, 5], out[1, 5] = F_o.real, F_o.imag
