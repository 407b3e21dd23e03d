"""Synchronous response to unbalance, and influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fem.growth_check import growing_warning, surely_stable
from fem.matrices.bands import Matrices, assemble, ignored_inertia
from fem.model.rotor import Rotor
from fem.model.sensors import SensorLike, as_sensors
from fem.solvers.eigen import fine_mesh_warning
from fem.solvers.receptance import receptance
from fem.vibration import BearingForces, InfluenceCoefficients, Response, phase_degrees
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray

__all__ = ["BearingForces", "InfluenceCoefficients", "Response", "influence", "phase_degrees"]
__all__ += ["unbalance_response"]

Method = Literal["fast", "exact"]


def unbalance_response(
    rotor: Rotor,
    unbalance: Mapping[str | int, complex] | Mapping[int, complex] | Mapping[str, complex],
    speeds: ArrayLike,
    *,
    method: Method = "fast",
) -> Response:
    """Compute the synchronous vibration of all nodes.

    The force is U ω² e^{iωt} on z = x + i y. The equations are those of the whole rotor as described: shaft
    with what its `Model` takes into account and its material damping, supports of any kind at the
    running speed, pedestals.

    Parameters
    ----------
    rotor
        The rotor.
    unbalance
        `{node or station: m r e^{iφ}}`, kg·m, φ with the rotation from the mark.
    speeds
        rad/s, one or many, not negative.
    method
        "fast" (modes with static corrections; error far below 1e-6) or "exact" (banded equations solved at
        every speed: a check).

    Raises
    ------
    ValueError
        If the undamped rotor runs exactly at a critical speed, for impossible input, at a speed outside a
        bearing table, or for a mesh too fine for float64.
    """
    speeds = _checked_speeds(speeds)
    masses: dict[int, complex] = {}
    for key, value in dict(unbalance).items():
        node, amount = rotor.node(key), complex(value)
        if not np.isfinite(amount):
            raise ValueError(f"the unbalance at node {node} must be finite, not {amount}")
        masses[node] = masses.get(node, 0j) + amount
    if not masses:
        raise ValueError("no unbalance is given: name at least one node")
    U = np.array(list(masses.values()))
    A = assemble(rotor)
    # The matrices are real: one complex load is two real ones.
    loads = np.zeros((A.size, 2))
    at = [A.deflection(node) for node in masses]
    loads[at, 0], loads[at, 1] = U.real, U.imag
    used = np.flatnonzero(loads.any(axis=0))
    if not used.size:
        used = np.array([0])
    F, b, warnings = _solve(rotor, A, A.deflections, loads[:, used], speeds, method)
    factors = np.array([1.0, 1j])[used]
    backward = np.zeros(F.shape[:2], dtype=complex) if b is None else b @ factors
    return Response(speeds, _frozen(F @ factors), masses, rotor, warnings, _frozen(backward))


def influence(
    rotor: Rotor,
    planes: Sequence[str | int],
    sensors: Sequence[SensorLike],
    speeds: ArrayLike,
    *,
    method: Method = "fast",
) -> InfluenceCoefficients:
    """Compute influence coefficients W: vibration at sensors per unbalance in planes, [S] (33).

    Parameters
    ----------
    rotor
        The rotor.
    planes
        Node numbers, from 1, or names of stations.
    sensors
        The same, for sensors that read x, or pairs (node, angle) or `Sensor` objects, angle in degrees from
        x with the rotation.
    speeds
        rad/s, one or many, not negative.
    method
        As in `unbalance_response`.

    Raises
    ------
    ValueError
        As `unbalance_response`.
    """
    speeds = _checked_speeds(speeds)
    planes, sensors = tuple(planes), tuple(sensors)
    if not planes or not sensors:
        raise ValueError("name at least one plane and one sensor")
    A = assemble(rotor)
    loads = np.zeros((A.size, len(planes)))
    loads[[A.deflection(rotor.node(plane)) for plane in planes], np.arange(len(planes))] = 1.0
    places = as_sensors(sensors, rotor)
    rows = np.array([A.deflection(rotor.node(sensor.node)) for sensor in places], dtype=np.intp)
    W, b, warnings = _solve(rotor, A, rows, loads, speeds, method)
    turn = np.exp(1j * np.array([sensor.radians for sensor in places]))[:, None]
    if b is not None:
        W = W * turn.conj() + b * turn
    elif any(sensor.angle for sensor in places):
        W = W * turn.conj()
    return InfluenceCoefficients(speeds, sensors, planes, _frozen(W), warnings)


def _solve(
    rotor: Rotor,
    A: Matrices,
    rows: IndexArray,
    loads: FloatArray,
    speeds: FloatArray,
    method: str,
) -> tuple[ComplexArray, ComplexArray | None, tuple[str, ...]]:
    if method not in ("fast", "exact"):
        raise ValueError(f'method must be "fast" or "exact", not {method!r}')
    F, b, warnings, rounding = receptance(rotor, A, rows, loads, speeds, method == "exact")
    force = (speeds * speeds)[:, None, None]
    F *= force
    if b is not None:
        b *= force
    if not surely_stable(rotor):
        size = np.abs(F).max(axis=(1, 2)) + (0.0 if b is None else np.abs(b).max(axis=(1, 2)))
        warnings = (*warnings, *growing_warning(rotor, speeds, size))
    return F, b, (*ignored_inertia(rotor), *fine_mesh_warning(rotor, rounding), *warnings)


def _checked_speeds(speeds: ArrayLike) -> FloatArray:
    try:
        array = np.atleast_1d(np.array(speeds, dtype=float))
    except (TypeError, ValueError):
        raise ValueError("speeds must be numbers in rad/s") from None
    if array.ndim != 1 or not array.size:
        raise ValueError("speeds must be one number or a list of at least one")
    if not (np.isfinite(array) & (array >= 0)).all():
        raise ValueError("speeds must be finite and not negative, in rad/s")
    array.flags.writeable = False
    return array


def _frozen(array: ComplexArray) -> ComplexArray:
    array.flags.writeable = False
    return array
