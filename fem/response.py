"""Synchronous response of a rotor: to unbalance, as influence coefficients, and the orbits of its nodes.

Under loads f that turn with the rotor z = x + i y = F e^{iωt} + b̄ e^{−iωt}, so that x = Re X e^{iωt} with
X = F + b and y = Re Y e^{iωt} with Y = −i (F − b). In one plane with the bands of `fem.assembly`

    (K − ω² (M − G)) F + [D (F, b)]₁ = f,        (K − ω² (M + G) + 2 i ω B) b + [D (F, b)]₂ = 0:

material damping takes no part in forward whirl, which does not strain the turning shaft periodically. The
supports D couple both; where they are rotationally symmetric, b = 0.

The fast way takes the receptance H of the rotor on constant springs k, without damping, from its modes up to
four times the highest speed and adds the static contribution of all others as a power series in ω², which
gains a factor of 16 or more with each term. What the supports do besides these springs changes it by a
matrix of low rank: their forces g obey (1 + (D − k) H) g = −(D − k) H f. Uniform material damping, B = β K,
makes the backward equation the conservative one at the complex ω² / (1 + 2 i ω β).

The exact way factors the band of both planes at each speed. It takes over where the fast one loses digits:
next to a resonance of the rotor on springs, where 1 + (D − k) H is almost singular, and where it does not
apply. Both solve the same equations and lose digits with the fourth power of the number of elements, because
the entries of K are rounded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fem.assembly import (
    Matrices,
    WholeBand,
    assemble,
    both_planes,
    free_motions,
    ignored_inertia,
    multiply,
    supported,
)
from fem.orbits import orbits, probe
from fem.result import Result, holding_arrays
from fem.rotor import Rotor, SensorLike, Support, as_sensor, label
from fem.stability import Window, judge, within
from fem.undamped import (
    Pencil,
    fine_mesh_warning,
    finite_modes,
    lowest_modes,
    one_plane,
)
from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray, checked_speeds
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, phase_deg, range_text, rpm_text

UnbalanceLike = Mapping[str | int, complex] | Mapping[int, complex] | Mapping[str, complex]
"""`{node or station: m r e^{iφ}}`, kg·m."""
NEAR = (
    1e-8  # |ω² − λ| / λ where the fast formula has lost half of the digits, and an undamped rotor its limit
)
PIVOT = 1e-4  # of the equations of the supports: below, four digits are lost
_STIFF = 1e6  # times the lowest λ: above, few digits of a mode are sure
_DIGITS = 1e-12  # of the static contribution of the modes left out, to which their series goes


@holding_arrays
class Response(Result):
    """Vibration of every node, z = x + i y = F e^{iωt} + b̄ e^{−iωt}, under a given unbalance.

    On rotationally symmetric supports b = 0: orbits are circles, x = Re F e^{iωt}, y = Im F e^{iωt}. On
    others they are ellipses: x = Re X e^{iωt} with X = F + b, y = Re Y e^{iωt} with Y = −i (F − b).
    All amplitudes are peak values, half of peak to peak.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    amplitudes
        Forward complex amplitudes F, m, of the K nodes kept, shape (S, K); positive phase = lead.
    unbalance
        What was mounted, `{node: m r e^{iφ}}`, kg·m.
    rotor
        The rotor.
    warnings
        What the reader must know.
    backward
        Complex amplitudes b, m, shape (S, K).
    largest, largest_node
        Longest half axis of all nodes' orbits, m, and the number of that node, shape (S,).
    nodes
        Numbers of the nodes kept, by default all, shape (K,).
    solve
        The same at other speeds of the range, rad/s, ascending; not judged for stability.
    windows
        Ranges of speed in which no steady response exists: amplitudes there are never reached.
    """

    speeds: FloatArray
    amplitudes: ComplexArray
    unbalance: Mapping[int, complex]
    rotor: Rotor
    warnings: tuple[str, ...]
    backward: ComplexArray
    largest: FloatArray
    largest_node: IndexArray
    nodes: IndexArray
    solve: Callable[[FloatArray], Response] = field(repr=False)
    windows: tuple[Window, ...] = ()

    @property
    def steady(self) -> BoolArray:
        """At which speeds a steady response exists, shape (S,)."""
        return ~within(self.windows, self.speeds)

    @property
    def x(self) -> ComplexArray:
        """Complex amplitudes of the deflection in x, m, shape (S, K)."""
        return self.amplitudes + self.backward

    @property
    def y(self) -> ComplexArray:
        """Complex amplitudes of the deflection in y, m, shape (S, K)."""
        return -1j * (self.amplitudes - self.backward)

    @property
    def major(self) -> FloatArray:
        """Longer half axis of each orbit, m, shape (S, K)."""
        return abs(self.amplitudes) + abs(self.backward)

    @property
    def minor(self) -> FloatArray:
        """Shorter half axis, m, shape (S, K); negative where the orbit runs against the rotation."""
        return abs(self.amplitudes) - abs(self.backward)

    def column(self, node: str | int) -> int:
        """Which column of the amplitudes belongs to a node.

        Raises
        ------
        ValueError
            If there is no such node, or it was not kept.
        """
        number = self.rotor.node(node)
        if number not in self.nodes:
            raise ValueError(f"node {number} was not kept: name it in nodes=…")
        return int(np.argmax(self.nodes == number))

    def at(self, sensor: SensorLike) -> ComplexArray:
        """Complex amplitude that a sensor reads over speed, m peak, shape (S,).

        A node or station means the direction x; (node, angle) or a `Sensor` any other.
        """
        sensor = as_sensor(sensor, self.rotor)
        i = self.column(sensor.node)
        return probe(self.x[:, i], self.y[:, i], sensor.radians)

    def readings(self, sensors: Sequence[SensorLike]) -> ComplexArray:
        """`at` for each sensor, shape (S, C)."""
        return np.array([self.at(sensor) for sensor in sensors]).reshape(-1, self.speeds.size).T

    def bearing_forces(self) -> BearingForces:
        """Forces that the rotor exerts on its supports, in the order of `rotor.supports`."""
        supports, xy = self.rotor.supports, np.array((self.x, self.y))
        forces = np.zeros((2, self.speeds.size, len(supports)), complex)
        for b, support in enumerate(supports):
            D, at = support.dynamic_stiffness(self.speeds), self.column(support.node)
            forces[..., b] = np.einsum("sij,js->is", D, xy[..., at])
        return BearingForces(self.speeds, supports, *forces)

    def to_dict(self, sensors: Sequence[SensorLike] | None = None) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid response`; all nodes in x by default."""
        sensors = self.nodes.tolist() if sensors is None else sensors
        Z = self.readings(sensors).T
        return plain(
            {
                "speeds_rad_s": self.speeds,
                "sensors": [label(sensor) for sensor in sensors],
                "amplitude_m": abs(Z),
                "phase_deg": phase_deg(Z),
                "unstable_speeds": [window.to_dict() for window in self.windows],
                "warnings": self.warnings,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """One row per speed and node: the reading in x; where x and y differ, also y and the orbit."""
        S, K = self.amplitudes.shape
        columns = [
            Column("speed_rad_s", np.repeat(self.speeds, K)),
            Column("node", np.tile(self.nodes, S)),
            *polar("amplitude_m", "phase_deg", self.x),
        ]
        if not self.rotor.symmetric:
            columns += [
                *polar("amplitude_y_m", "phase_y_deg", self.y),
                Column("major_axis_m", self.major.ravel()),
                Column("minor_axis_m", self.minor.ravel()),
            ]
        return (Table("unbalance response, peak values", tuple(columns)),)

    def sentence(self) -> str:
        """The highest peak of a steady response and where it is."""
        return f"Unbalance response at {speed_range(self.speeds)}, {self.nodes.size} nodes. {self.highest}"

    @property
    def highest(self) -> str:
        """The largest amplitude in a sentence."""
        if not self.steady.any():
            return "No steady response at any of these speeds."
        k = np.argmax(self.largest * self.steady)
        where = f"node {self.largest_node[k]}, {rpm_text(self.speeds[k])}"
        return f"Largest amplitude {1e6 * self.largest[k]:.4g} µm peak at {where}."


@holding_arrays
class BearingForces(Result):
    """Forces of the rotor on its supports, Re (x, y) e^{iωt}.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    supports
        What is loaded, length B.
    x, y
        Complex amplitudes, N, shape (S, B).
    """

    speeds: FloatArray
    supports: Sequence[Support]
    x: ComplexArray
    y: ComplexArray

    @property
    def largest(self) -> FloatArray:
        """Largest force during a turn, N, shape (S, B)."""
        return orbits(self.x, self.y).major

    def tables(self) -> tuple[Table, ...]:
        """One row per speed and support."""
        S, B = self.x.shape
        columns = (
            Column("speed_rad_s", np.repeat(self.speeds, B)),
            Column("node", [support.node for support in self.supports] * S),
            Column("support", [support.name for support in self.supports] * S),
            *polar("force_x_N", "phase_x_deg", self.x),
            *polar("force_y_N", "phase_y_deg", self.y),
            Column("largest_N", self.largest.ravel()),
        )
        return (Table("forces on the supports, peak values", columns),)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON: one list over speed for each support."""
        nodes = [support.node for support in self.supports]
        forces = {
            column.heading: np.array(column.values).reshape(self.x.shape).T
            for column in self.tables()[0].columns[3:-1]
        }
        return plain({"speeds_rad_s": self.speeds, "nodes": nodes, **forces})

    def sentence(self) -> str:
        """Number of coefficients and their speeds, in one sentence."""
        return f"Forces on {counted(len(self.supports), 'support')} at {speed_range(self.speeds)}."


@holding_arrays
class InfluenceCoefficients(Result):
    """Vibration at sensors per unit of unbalance in planes.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    sensors, planes
        Sensors and planes as they were asked for, lengths C and P.
    W
        Complex, m per kg·m, shape (S, C, P); Z = W U, positive phase = lead, Z in peak values.
    warnings
        What the reader must know.
    windows
        As in `Response`.
    """

    speeds: FloatArray
    sensors: tuple[SensorLike, ...]
    planes: tuple[str | int, ...]
    W: ComplexArray
    warnings: tuple[str, ...] = ()
    windows: tuple[Window, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid influence`; the units stand once."""
        keys = ("speed", "sensor", "plane", "influence", "phase")
        return plain(
            {
                "rows": [dict(zip(keys, row, strict=True)) for row in self.tables()[-1].rows],
                "units": {"speed": "rad/s", "influence": "m/(kg·m)", "phase": "deg, lead"},
                "unstable_speeds": [window.to_dict() for window in self.windows],
                "warnings": self.warnings,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """Where they are largest, if there is a steady response; and the influence table of INTERFACE.md."""
        S, C, P = self.W.shape
        sensors = [label(sensor) for sensor in self.sensors for _ in self.planes]
        planes, steady = list(self.planes) * C, ~within(self.windows, self.speeds)
        columns = (
            Column("speed_rad_s", np.repeat(self.speeds, C * P)),
            Column("sensor", sensors * S),
            Column("plane", planes * S),
            *polar("influence_m_per_kg_m", "phase_lead_deg", self.W),
        )
        every = Table("influence coefficients", columns)
        if not steady.any():
            return (every,)
        W, speeds = self.W[steady].reshape(-1, C * P), self.speeds[steady]
        at = abs(W).argmax(axis=0)
        size, phase = polar("µm per g·mm", "phase lead, deg", W[at, np.arange(C * P)])
        largest = (
            Column("sensor", list(map(str, sensors))),
            Column("plane", list(map(str, planes))),
            replace(size, shown="{:.4g}".format),
            replace(phase, shown="{:.2f}".format),
            Column("at rpm", speeds[at] * RPM, "{:.6g}".format),
            Column("least", abs(W).min(axis=0), "{:.4g}".format),
        )
        return (Table("largest influence coefficients", largest), every)

    def sentence(self) -> str:
        """Number of amplitudes and the largest of them, in one sentence."""
        _, C, P = self.W.shape
        first, *rest = self.tables()
        largest = "None has a meaning: there is no steady response."
        if rest:
            largest = f"The largest is {max(first.columns[2].values):.4g} µm per g·mm."
        what = f"Influence coefficients of {counted(C, 'sensor')} and {counted(P, 'plane')}"
        return f"{what} at {speed_range(self.speeds)}. {largest}"


def polar(size: str, phase: str, Z: ComplexArray) -> tuple[Column, Column]:
    """Two columns of a table: size, and phase as lead, 0 ≤ phase < 360 degrees.

    Parameters
    ----------
    size, phase
        Headings of the columns.
    Z
        Complex amplitudes, any shape, positive phase = lead.

    Returns
    -------
    Size in the unit of Z, and phase in degrees.
    """
    return Column(size, abs(Z).ravel()), Column(phase, phase_deg(Z).ravel())


def speed_range(speeds: FloatArray) -> str:
    """A speed, or how many from where to where, as text."""
    if speeds.size == 1:
        return f"{rpm_text(speeds[0])} ({speeds[0]:.6g} rad/s)"
    return f"{speeds.size} speeds from {range_text(speeds.min(), speeds.max())}"


def unbalance_response(
    rotor: Rotor,
    unbalance: UnbalanceLike,
    speeds: ArrayLike,
    *,
    nodes: Sequence[int] | None = None,
) -> Response:
    """Compute the synchronous vibration of all nodes, or of some.

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
    nodes
        Numbers of the nodes to keep; by default all. Few of them take little memory at many speeds.

    Raises
    ------
    ValueError
        If the undamped rotor runs exactly at a critical speed, for impossible input, at a speed outside a
        bearing table, or for a mesh too fine for float64.

    Notes
    -----
    Beside the same equations in 18 digits the error is rounding of the stiffness matrix, relative to the
    largest amplitude about 1e-12 times the amplification factor at 23 elements. It grows with the fourth
    power of their number: measured at 230 are 1e-8 between and 2e-7 to 6e-6 at resonances, where the
    amplification is 70 to 900. A warning says where the mesh is too fine for six digits.
    """
    speeds = checked_speeds(speeds)
    every = range(1, rotor.n_nodes + 1)
    kept = np.array([rotor.node(n) for n in (every if nodes is None else nodes)])
    masses: dict[int, complex] = {}
    for key, value in dict(unbalance).items():
        node, amount = rotor.node(key), complex(value)
        if not np.isfinite(amount):
            raise ValueError(f"the unbalance at node {node} must be finite, not {amount}")
        masses[node] = masses.get(node, 0j) + amount
    if not masses:
        raise ValueError("no unbalance is given: name at least one node")
    U, phasors = np.array(list(masses.values())), np.array([1.0, 1j])
    weights = np.column_stack((U.real, U.imag))  # one complex load is two real ones
    receptance = Receptance(rotor, every, list(masses), weights, speeds)

    def solve(speeds: FloatArray) -> Response:
        both = np.zeros((2, speeds.size, kept.size), dtype=complex)
        largest, where = np.empty(speeds.size), np.empty(speeds.size, dtype=np.intp)
        running = np.where(speeds > 0, speeds, speeds.max())  # at rest there is no force
        for part, H in receptance.parts(running):
            Z = speeds[part] ** 2 * np.einsum("pabs,b->pas", H, phasors)
            both[: len(Z), part] = Z[:, kept - 1].swapaxes(1, 2)
            size = abs(Z).sum(axis=0)
            largest[part], where[part] = size.max(axis=0), size.argmax(axis=0) + 1
        warnings = receptance.warnings
        return Response(speeds, both[0], masses, rotor, warnings, both[1], largest, where, kept, solve)

    return judged(solve(speeds))


def judged(response: Response) -> Response:
    """The response with the ranges of speed in which it does not exist."""
    windows, texts = judge(response.rotor, response.speeds)
    others = response.solve(response.speeds.max(keepdims=True)).warnings
    return replace(response, windows=windows, warnings=(*others, *texts))


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
    places, at = [as_sensor(sensor, rotor) for sensor in sensors], [rotor.node(plane) for plane in planes]
    turn = np.exp(1j * np.array([sensor.radians for sensor in places]))[:, None, None]
    ways = np.array([turn.conj(), turn])
    nodes = [rotor.node(sensor.node) for sensor in places]
    receptance = Receptance(rotor, nodes, at, np.eye(len(at)), speeds)
    W = np.empty((len(sensors), len(planes), speeds.size), dtype=complex)
    for part, H in receptance.parts(speeds):
        H *= ways[: len(H)] * speeds[part] ** 2
        H.sum(axis=0, out=W[..., part])
    windows, texts = judge(rotor, speeds)
    return InfluenceCoefficients(
        speeds, sensors, planes, W.transpose(2, 0, 1), (*receptance.warnings, *texts), windows
    )


def unit_loads(A: Matrices, unknowns: IndexArray) -> FloatArray:
    """A load 1 on each of these unknowns, (size, m).

    Parameters
    ----------
    A
        Matrices of the rotor.
    unknowns
        From 0, shape (m,).

    Returns
    -------
    Shape (size, m).
    """
    return np.asarray(np.arange(A.size)[:, None] == unknowns, float)


class Receptance:
    """Deflections of nodes (a,) under real loads on others that turn with the rotor: weights, (others, b).

    Ready for any speed up to the largest of those given, rad/s. With `exact` the banded equations are solved
    at every speed instead of at the few where the fast way loses digits.
    """

    def __init__(
        self,
        rotor: Rotor,
        nodes: Sequence[int],
        loaded: Sequence[int],
        weights: FloatArray,
        speeds: FloatArray,
        exact: bool = False,
    ) -> None:
        self.rotor, self.A = rotor, (A := assemble(rotor))
        self.unknowns = A.deflections[np.subtract(nodes, 1)]
        self.loads = unit_loads(A, A.deflections[np.subtract(loaded, 1)]) @ weights
        at, beta = supported(rotor, speeds[:: 1 + speeds.size // 16]), rotor.material_damping
        springs, self.planes, self.beta = at.springs, at.planes, float(beta[0])
        self.springs = np.array([*springs.values()])
        tilting = any(support.tilting_stiffness for support in rotor.supports)
        self.exact = exact or bool(at.planes == 2 and ((beta != beta[0]).any() or (beta[0] and tilting)))
        held = A.deflections[[node - 1 for node in at.nodes]]
        places, units, top = np.append(self.unknowns, held), unit_loads(A, held), float(speeds.max())

        def series(whirl: int, columns: FloatArray) -> Series:
            return Series(one_plane(rotor, A, whirl, springs.items()), places, columns, top)

        forward = np.hstack((self.loads, units))
        try:
            self.series = [series(1, forward)]
        except ValueError:  # free, and M − G is negative in a rigid motion
            self.exact, self.series = True, [series(0, forward)]
        if at.planes == 2:
            self.series.append(series(-1, units))
        self.warnings = (*ignored_inertia(rotor), *fine_mesh_warning(rotor, self.series[0].modes.rounding))

    def parts(self, speeds: FloatArray) -> Iterator[tuple[slice, ComplexArray]]:
        """Some speeds at a time, rad/s: receptances F, or F and b, shape (planes, a, b, S)."""
        stiffness = supported(self.rotor, speeds).stiffness
        # as many as stay in the cache of the processor
        step = max(64, 12_288 // (self.unknowns.size * self.loads.shape[1]))
        for start in range(0, speeds.size, step):
            part = slice(start, start + step)
            omega = speeds[part]
            H, lost = self._fast(omega, stiffness[part])
            if lost.any():
                H[..., lost] = self._exact(omega[lost])
            yield part, H

    def _fast(self, omega: FloatArray, D: ComplexArray) -> tuple[ComplexArray, BoolArray]:
        """Receptances from the series, (planes, a, b, S), and at which speeds they lose digits."""
        a, s, planes, b = self.unknowns.size, self.springs.size, self.planes, self.loads.shape[1]
        change, H = D[..., :planes, :planes].transpose(2, 3, 1, 0).copy(), []
        lost = np.full(omega.size, self.exact)
        for p, series in enumerate(self.series):
            stiffer: AnyArray | float = 1.0 + 2j * self.beta * omega if p * self.beta else 1.0
            change[p, p] -= self.springs[:, None] * stiffer
            whole, near = series.at(omega * omega / stiffer)
            H.append(whole / stiffer if p else whole)
            lost |= near
        # What loads, and unit forces at the supports, make the supports do: in the end, what loads do.
        system = np.concatenate([change[:, p, :, None] * each[a:] for p, each in enumerate(H)], axis=2)
        system = system.reshape(planes * s, b + planes * s, omega.size)
        for k, row in enumerate(system):
            row[b + k] += 1.0
            lost |= ~(abs(row[b + k]) >= PIVOT)
            row *= 1 / row[b + k]
            for other in {*range(len(system))} - {k}:
                system[other] -= system[other, b + k] * row
        F = np.zeros((planes, a, b, omega.size), complex)
        F[0] = H[0][:a, :b]
        for k, force in enumerate(system[:, :b]):
            for i, row in enumerate(H[k // s][:a, k % s - s]):  # one by one they stay in the cache
                F[k // s, i] -= row * force
        return F, lost

    @cached_property
    def _band(self) -> WholeBand:
        return WholeBand(both_planes(self.rotor))

    def _exact(self, omega: FloatArray) -> ComplexArray:
        """Receptance by LU factors of the whole band, without modes.

        With one mode φ alone F = φ (φᵀ f) / (λ − ω²): then |Fᴴ f| / (Fᴴ M F) is the distance of λ from ω², or
        what damping makes of it.
        """
        A, band, loads = self.A, self._band, self.loads
        planes, b = band.P.planes, loads.shape[1]
        rhs = np.zeros((band.size, b), dtype=complex)
        rhs[::planes] = loads  # F and b alternate
        X = np.array([band.factor(1j * speed, speed)(rhs) for speed in omega.tolist()])
        X = X.reshape(-1, A.size, planes, b).swapaxes(0, 1)
        inertia = (X.conj() * multiply(A.mass, X.reshape(A.size, -1)).reshape(X.shape)).real.sum(axis=(0, 2))
        work = abs(np.einsum("ib,isb->sb", loads, X[:, :, 0]))
        wrong = ~(work >= NEAR * omega[:, None] ** 2 * inertia).all(axis=1)
        if free_motions(self.rotor, {support.node for support in self.rotor.supports}):
            wrong |= omega == 0
        if wrong.any():
            raise ValueError(
                "the undamped rotor stands exactly at its critical speed "
                f"{omega[np.argmax(wrong)]:.10g} rad/s, where the amplitude has no limit; give a support "
                "damping or choose another speed"
            )
        return X[self.unknowns].transpose(2, 0, 3, 1)


class Series:
    """Receptance of the conservative rotor between unknowns and columns of loads, for speeds up to `top`.

    Its modes up to four times this speed, at least, and powers of ω² for the contribution of the others.
    """

    def __init__(self, whole: Pencil, unknowns: IndexArray, columns: FloatArray, top: float) -> None:
        from scipy.linalg.lapack import dpbtrs

        m, available = 12, finite_modes(whole)
        while True:
            m = min(m, available)
            modes = lowest_modes(whole, m)
            size = abs(modes.squares + modes.shift)
            highest = top * top + modes.shift
            if m == available or highest < size[-1] / 16:
                break
            m *= 2
        # Of what is stiff beside its mass, rounding has the mass: the series needs none.
        kept = int(np.count_nonzero(size <= max(16 * highest, _STIFF * size[0])))
        self.modes = modes = modes.only(slice(kept))
        ratio = highest / size[min(kept, m - 1)]
        V, signs, R = modes.vectors, np.where(modes.squares < 0, -1, 1), columns
        MV = multiply(whole.mass, V) * signs
        factors = [V[unknowns][:, None] * (columns.T @ V * signs)]
        needed = 1 if kept == available else math.ceil(math.log(_DIGITS, max(ratio, _DIGITS)))
        for _ in range(needed):
            R = dpbtrs(modes.factor, R)[0]
            R = R - V @ (MV.T @ R)  # rounding must not bring the modes back
            factors.append(R[unknowns][..., None])
            R = multiply(whole.mass, R)
        self.factors = np.concatenate(factors, axis=2)  # (rows, columns, modes and powers)
        self.squares = modes.squares[:, None]
        # Rigid motions have λ = 0 without rounding.
        self.margin = NEAR * (abs(self.squares) + modes.shift) * (self.squares != 0)

    def at(self, squared: AnyArray) -> tuple[AnyArray, BoolArray]:
        """Receptance where ω² is given, shape (rows, columns, S); nonsense where the second is true."""
        gap = self.squares - squared
        near: BoolArray = (abs(gap) <= self.margin).any(axis=0)
        gap[:, near] = 1.0
        rows, columns, n = self.factors.shape
        powers = np.vander(squared + self.modes.shift, n - len(gap), increasing=True).T
        terms = np.concatenate((1 / gap, powers))
        return (self.factors.reshape(-1, n) @ terms).reshape(rows, columns, -1), near
