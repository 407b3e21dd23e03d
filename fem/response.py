"""Synchronous response to unbalance, and influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fem.api684_peaks import UNLIMITED, Peaks, find_peaks
from fem.growth_check import judge
from fem.matrices.banded_matrices import Matrices, assemble, ignored_inertia
from fem.model.rotor import Rotor
from fem.model.sensors import SensorLike, as_sensor, as_sensors
from fem.response_result import BearingForces, InfluenceCoefficients, Response
from fem.solvers.eigen import fine_mesh_warning
from fem.solvers.receptance import Receptance, prepare
from fem.solvers.synchronous_banded import rounding_warning
from rotorid.base.arrays import ComplexArray, FloatArray, read_only
from rotorid.base.checks import checked_speeds

__all__ = ["BearingForces", "InfluenceCoefficients", "Response", "influence", "response_peaks"]
__all__ += ["unbalance_response"]
Unbalance = Mapping[str | int, complex] | Mapping[int, complex] | Mapping[str, complex]
"""`{node or station: m r e^{iφ}}`, kg·m."""


def unbalance_response(
    rotor: Rotor,
    unbalance: Unbalance,
    speeds: ArrayLike,
    *,
    nodes: Sequence[int] | None = None,
) -> Response:
    """Compute the synchronous vibration of all nodes, or of some.

    The force is U ω² e^{iωt} on z = x + i y. The equations are those of the whole rotor as described: shaft
    with what its `Model` takes into account and its material damping, supports of any kind at the
    running speed, pedestals. Modes with static corrections have an error far below 1e-6; where they lose
    digits, banded equations are solved.

    Parameters
    ----------
    rotor
        The rotor.
    unbalance
        `{node or station: m r e^{iφ}}`, kg·m, φ with the rotation from the mark.
    speeds
        rad/s, one or many, not negative.
    nodes
        Numbers of the nodes to keep; by default all. Few of them take little memory at many speeds.

    Raises
    ------
    ValueError
        If the undamped rotor runs exactly at a critical speed, for impossible input, at a speed outside a
        bearing table, or for a mesh too fine for float64.
    """
    speeds = checked_speeds(speeds)
    if speeds.size > 1 and speeds[0] == 0 and (np.diff(speeds) > 0).all():
        rest = all(not support.speeds or support.speeds[0] == 0 for support in rotor.supports)
        if rest:
            every = range(1, rotor.n_nodes + 1) if nodes is None else nodes
            return response_from_rest(rotor, unbalance, speeds, every)
    kept = np.array(range(1, rotor.n_nodes + 1) if nodes is None else [rotor.node(n) for n in nodes])
    masses: dict[int, complex] = {}
    for key, value in dict(unbalance).items():
        node, amount = rotor.node(key), complex(value)
        if not np.isfinite(amount):
            raise ValueError(f"the unbalance at node {node} must be finite, not {amount}")
        masses[node] = masses.get(node, 0j) + amount
    if not masses:
        raise ValueError("no unbalance is given: name at least one node")
    A = assemble(rotor)
    loads, factors = _loads(A, masses)
    ready = prepare(rotor, A, A.deflections, loads, speeds)

    def solve(speeds: FloatArray) -> Response:
        F, b = (np.zeros((speeds.size, kept.size), dtype=complex) for _ in range(2))
        largest, where = np.empty(speeds.size), np.empty(speeds.size, dtype=np.intp)
        doubts = []
        for part, found in ready.parts(speeds):
            force = (speeds[part] ** 2)[:, None]
            forward = force * (found.F @ factors)
            backward = np.zeros_like(forward) if found.b is None else force * (found.b @ factors)
            size = np.abs(forward) + np.abs(backward)
            F[part], b[part] = forward[:, kept - 1], backward[:, kept - 1]
            largest[part], where[part] = size.max(axis=1), size.argmax(axis=1) + 1
            doubts.append(found.doubt)
        said = (*_model_warnings(ready), *rounding_warning(doubts))
        read_only(F, b, largest, where)
        return Response(speeds, F, masses, rotor, said, b, largest, where, kept, solve)

    return judged(solve(speeds))


def response_from_rest(
    rotor: Rotor, unbalance: Unbalance, speeds: ArrayLike, nodes: Sequence[int]
) -> Response:
    """`unbalance_response`, also of a free rotor at rest: without rotation there is no force.

    Parameters
    ----------
    rotor, unbalance, nodes
        As there.
    speeds
        rad/s, ascending.
    """
    omega = checked_speeds(speeds)
    known = all(not support.speeds or support.speeds[0] == 0 for support in rotor.supports)
    if omega[0] > 0 or omega.size < 2 or not known:
        return unbalance_response(rotor, unbalance, omega, nodes=nodes)
    moving = unbalance_response(rotor, unbalance, omega[1:], nodes=nodes)
    rest = np.zeros((1, len(nodes)), dtype=complex)
    return replace(
        moving,
        speeds=omega,
        amplitudes=np.concatenate((rest, moving.amplitudes)),
        backward=np.concatenate((rest, moving.backward)),
        largest=np.insert(moving.largest, 0, 0.0),
        largest_node=np.insert(moving.largest_node, 0, 1),
    )


def response_peaks(
    response: Response,
    sensor: SensorLike,
    *,
    operating: tuple[float, float] | None = None,
) -> Peaks:
    """Find the peaks of one reading, evaluated by the model between the speeds of the response.

    Parameters
    ----------
    response
        At speeds between which no peak is hidden; those without a steady response do not count.
    sensor
        Where it is read.
    operating
        As in `find_peaks`.

    Raises
    ------
    ValueError
        As `find_peaks`.
    """
    place = as_sensor(sensor, response.rotor)

    def reading(speed: float) -> float:
        try:
            return float(np.abs(response.solve(np.array([speed])).at(place)[0]))
        except ValueError:
            return UNLIMITED  # undamped, and critical

    speeds, size = response.speeds, np.abs(response.at(place))
    counted = response.steady & (speeds > 0)
    edges = np.flatnonzero(np.diff(counted, prepend=False, append=False))
    runs = [slice(start, end) for start, end in zip(edges[::2], edges[1::2], strict=True) if end - start > 2]
    found = [find_peaks(speeds[run], size[run], reading, operating=operating) for run in runs]
    return Peaks(tuple(peak for part in found for peak in part.peaks), operating)


def _loads(A: Matrices, masses: Mapping[int, complex]) -> tuple[FloatArray, ComplexArray]:
    """Real load vectors of an unbalance, and their factors: one complex load is two real ones."""
    U = np.array(list(masses.values()))
    loads = np.zeros((A.size, 2))
    at = [A.deflection(node) for node in masses]
    loads[at, 0], loads[at, 1] = U.real, U.imag
    used = np.flatnonzero(loads.any(axis=0)) if U.any() else [0]
    return loads[:, used], np.array([1.0, 1j])[used]


def judged(response: Response) -> Response:
    """The response with the ranges of speed in which it does not exist."""
    windows, said = judge(response.rotor, response.speeds)
    before = {window.said() for window in response.windows} | {*said}
    kept = tuple(text for text in response.warnings if text not in before)
    return replace(response, windows=windows, warnings=(*kept, *said))


def influence(
    rotor: Rotor,
    planes: Sequence[str | int],
    sensors: Sequence[SensorLike],
    speeds: ArrayLike,
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

    Raises
    ------
    ValueError
        As `unbalance_response`.
    """
    speeds = checked_speeds(speeds)
    planes, sensors = tuple(planes), tuple(sensors)
    if not planes or not sensors:
        raise ValueError("name at least one plane and one sensor")
    A = assemble(rotor)
    loads = np.zeros((A.size, len(planes)))
    loads[[A.deflection(rotor.node(plane)) for plane in planes], np.arange(len(planes))] = 1.0
    places = as_sensors(sensors, rotor)
    rows = np.array([A.deflection(rotor.node(sensor.node)) for sensor in places], dtype=np.intp)
    turn = np.exp(1j * np.array([sensor.radians for sensor in places]))[:, None]
    ready = prepare(rotor, A, rows, loads, speeds)
    W = np.empty((speeds.size, rows.size, len(planes)), dtype=complex)
    doubts = []
    for part, found in ready.parts(speeds):
        reading = found.F * turn.conj()
        if found.b is not None:
            reading += found.b * turn
        W[part] = (speeds[part] ** 2)[:, None, None] * reading
        doubts.append(found.doubt)
    windows, said = judge(rotor, speeds)
    warnings = (*_model_warnings(ready), *rounding_warning(doubts), *said)
    read_only(W)
    return InfluenceCoefficients(speeds, sensors, planes, W, warnings, windows)


def _model_warnings(ready: Receptance) -> tuple[str, ...]:
    return (*ignored_inertia(ready.rotor), *fine_mesh_warning(ready.rotor, ready.rounding))
