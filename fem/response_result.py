"""Results of the synchronous response: vibration, bearing forces, influence coefficients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.model.rotor import Rotor, Support
from fem.model.sensors import SensorLike, as_sensor, label
from fem.windows import Window, within
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IndexArray, read_only
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM, phase_deg, range_text, rpm_text
from rotorid.base.tables import Column as Told
from rotorid.base.tables import Table
from rotorid.base.text import counted, figures

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Response(Answered):
    """Vibration of every node, z = x + i y = F e^{iωt} + b̄ e^{−iωt}, under a given unbalance.

    On rotationally symmetric supports b = 0: orbits are circles, x = Re F e^{iωt}, y = Im F e^{iωt}. On
    others they are ellipses: x = Re X e^{iωt} with X = F + b, y = Re Y e^{iωt} with Y = −i (F − b).

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
        return np.asarray(self.amplitudes + self.backward)

    @property
    def y(self) -> ComplexArray:
        """Complex amplitudes of the deflection in y, m, shape (S, K)."""
        return np.asarray(-1j * (self.amplitudes - self.backward))

    @property
    def major(self) -> FloatArray:
        """Longer half axis of each orbit, m, shape (S, K)."""
        return np.asarray(np.abs(self.amplitudes) + np.abs(self.backward))

    @property
    def minor(self) -> FloatArray:
        """Shorter half axis, m, shape (S, K); negative where the orbit runs against the rotation."""
        return np.asarray(np.abs(self.amplitudes) - np.abs(self.backward))

    def column(self, node: str | int) -> int:
        """Which column of the amplitudes belongs to a node.

        Raises
        ------
        ValueError
            If there is no such node, or it was not kept.
        """
        number = self.rotor.node(node)
        found = np.flatnonzero(self.nodes == number)
        if not found.size:
            raise ValueError(f"node {number} was not kept: name it in nodes=…")
        return int(found[0])

    def at(self, sensor: SensorLike) -> ComplexArray:
        """Complex amplitude that a sensor reads over speed, m, shape (S,).

        A node or station means the direction x; (node, angle) or a `Sensor` any other.
        """
        sensor = as_sensor(sensor, self.rotor)
        i, turn = self.column(sensor.node), np.exp(1j * sensor.radians)
        return np.asarray(self.amplitudes[:, i] * turn.conj() + self.backward[:, i] * turn)

    def readings(self, sensors: Sequence[SensorLike]) -> ComplexArray:
        """`at` for each sensor, shape (S, C)."""
        return np.stack([self.at(sensor) for sensor in sensors], axis=1)

    def bearing_forces(self) -> BearingForces:
        """Forces that the rotor exerts on its supports, in the order of `rotor.supports`."""
        X, Y = self.x, self.y
        forces = np.empty((2, self.speeds.size, len(self.rotor.supports)), dtype=complex)
        for k, support in enumerate(self.rotor.supports):
            i = self.column(support.node)
            motion = np.stack((X[:, i], Y[:, i]), axis=1)
            D = support.dynamic_stiffness(self.speeds)
            forces[:, :, k] = np.einsum("sij,sj->is", D, motion)
        read_only(forces)
        return BearingForces(self.speeds, self.rotor.supports, forces[0], forces[1], self.steady)

    def to_dict(self, sensors: Sequence[SensorLike] | None = None) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid response`; all nodes in x by default."""
        sensors = self.nodes.tolist() if sensors is None else sensors
        Z = np.array([self.at(sensor) for sensor in sensors]).reshape(len(sensors), -1)
        return plain(
            {
                "speeds_rad_s": self.speeds,
                "sensors": [label(sensor) for sensor in sensors],
                "amplitude_m": np.abs(Z),
                "phase_deg": phase_deg(Z),
                "unstable_speeds": [window.to_dict() for window in self.windows],
                "warnings": self.warnings,
            }
        )

    def to_frame(self) -> pd.DataFrame:
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
        return frame(columns)

    @property
    def answer(self) -> Answer:
        """The highest peak of a steady response and where it is."""
        said = f"Unbalance response at {speed_range(self.speeds)}, {self.rotor.n_nodes} nodes."
        return Answer(f"{said}\n{self.highest}", warnings=self.warnings)

    @property
    def highest(self) -> str:
        """The largest amplitude in a sentence."""
        k = largest_at(self.largest, self.steady)
        if k is None:
            return "No steady response at any of these speeds."
        size, node = 1e6 * self.largest[k], self.largest_node[k]
        return f"Largest amplitude {size:.4g} µm peak at node {node}, {rpm_text(self.speeds[k])}."


@dataclass(frozen=True, eq=False)
class BearingForces:
    """Forces of the rotor on its supports, Re (x, y) e^{iωt}.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    supports
        What is loaded, length B.
    x, y
        Complex amplitudes, N, shape (S, B).
    steady
        At which speeds they exist, shape (S,).
    """

    speeds: FloatArray
    supports: Sequence[Support]
    x: ComplexArray
    y: ComplexArray
    steady: BoolArray

    @property
    def largest(self) -> FloatArray:
        """Largest force during a turn, N, shape (S, B)."""
        F, b = (self.x + 1j * self.y) / 2, (self.x - 1j * self.y) / 2
        return np.asarray(np.abs(F) + np.abs(b))

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and support."""
        S, B = self.x.shape
        return frame(
            (
                Column("speed_rad_s", np.repeat(self.speeds, B)),
                Column("node", [support.node for support in self.supports] * S),
                Column("support", [support.name for support in self.supports] * S),
                *self._forces(),
                Column("largest_N", self.largest.ravel()),
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON: one list over speed for each support."""
        forces = {column.name: np.asarray(column.values).reshape(self.x.shape).T for column in self._forces()}
        nodes = [support.node for support in self.supports]
        return plain({"speeds_rad_s": self.speeds, "nodes": nodes, **forces})

    def _forces(self) -> tuple[Column, ...]:
        return (*polar("force_x_N", "phase_x_deg", self.x), *polar("force_y_N", "phase_y_deg", self.y))

    def summary(self) -> str:
        """The largest force on each support, as text."""
        names = [support.name or f"node {support.node}" for support in self.supports]
        return largest_text("support", names, "force, N", self.largest, self.speeds, self.steady)


@dataclass(frozen=True, eq=False)
class InfluenceCoefficients(Answered):
    """Vibration at sensors per unit of unbalance in planes.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    sensors, planes
        Sensors and planes as they were asked for, lengths C and P.
    W
        Complex, m per kg·m, shape (S, C, P); Z = W U, positive phase = lead.
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

    def to_frame(self) -> pd.DataFrame:
        """One row per speed, sensor and plane: the influence table of INTERFACE.md."""
        return frame(self._columns("speed_rad_s", "influence_m_per_kg_m", "phase_deg"))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid influence`; the units stand once."""
        return plain(
            {
                "rows": rows(self._columns("speed", "influence", "phase")),
                "units": {"speed": "rad/s", "influence": "m/(kg·m)", "phase": "deg, lead"},
                "unstable_speeds": [window.to_dict() for window in self.windows],
                "warnings": self.warnings,
            }
        )

    def _columns(self, speed: str, influence: str, phase: str) -> tuple[Column, ...]:
        S, C, P = self.W.shape
        return (
            Column(speed, np.repeat(self.speeds, C * P)),
            Column("sensor", [label(sensor) for sensor in self.sensors for _ in self.planes] * S),
            Column("plane", list(self.planes) * (S * C)),
            *polar(influence, phase, self.W),
        )

    def tables(self) -> tuple[Table, ...]:
        """Where the coefficients are largest, if there is a steady response; and all of them."""
        _, C, P = self.W.shape
        steady = ~within(self.windows, self.speeds)
        one = (
            Told("speed_rad_s", np.repeat(self.speeds, C * P), "{:.6g}".format, "rows.*.speed"),
            Told(
                "sensor", [label(sensor) for sensor in self.sensors for _ in self.planes] * self.speeds.size
            ),
            Told("plane", list(self.planes) * (self.speeds.size * C)),
            Told("influence_m_per_kg_m", np.abs(self.W).ravel(), "{:.4g}".format, "rows.*.influence"),
            Told("phase_deg", phase_deg(self.W).ravel(), "{:.2f}".format, "rows.*.phase"),
        )
        every = Table("influence coefficients", one)
        if not steady.any():
            return (every,)
        sizes, speeds = np.abs(self.W[steady]).reshape(-1, C * P), self.speeds[steady]
        largest = sizes.argmax(axis=0)
        columns = [
            Told("sensor", [str(label(sensor)) for sensor in self.sensors for _ in self.planes]),
            Told("plane", [str(plane) for plane in self.planes] * C),
            Told("µm per g·mm", sizes.max(axis=0), "{:.4g}".format),
        ]
        if speeds.size == 1:
            columns.append(Told("phase lead, deg", phase_deg(self.W[steady].ravel()), "{:.2f}".format))
        else:
            columns.append(Told("at rpm", speeds[largest] * RPM, "{:.6g}".format))
            columns.append(Told("rad/s", speeds[largest], "{:.6g}".format))
            columns.append(Told("least", sizes.min(axis=0), "{:.4g}".format))
        return (Table("largest influence coefficients", tuple(columns)), every)

    def sentence(self) -> str:
        """Of what they are, and the largest."""
        return self.answer.judgement

    @property
    def answer(self) -> Answer:
        """Where the coefficients are largest, and over many speeds how small they get."""
        _, C, P = self.W.shape
        steady = ~within(self.windows, self.speeds)
        said = (
            f"Influence coefficients of {counted(C, 'sensor')} and {counted(P, 'plane')} at "
            f"{speed_range(self.speeds)}."
        )
        if not steady.any():
            return Answer(f"{said} None has a meaning: there is no steady response.", warnings=self.warnings)
        sizes, speeds = np.abs(self.W[steady]).reshape(-1, C * P), self.speeds[steady]
        largest = sizes.argmax(axis=0)
        columns = [
            Column("sensor", [label(sensor) for sensor in self.sensors for _ in self.planes], str),
            Column("plane", list(self.planes) * C, str),
            Column("largest", sizes.max(axis=0), "{:.4g}".format, "µm per g·mm"),
        ]
        if speeds.size == 1:
            columns.append(
                Column("phase", phase_deg(self.W[steady].ravel()), "{:.2f}".format, "phase lead, deg")
            )
        else:
            columns.append(Column("rpm", speeds[largest] * RPM, "{:.6g}".format, "at rpm"))
            columns.append(Column("rad/s", speeds[largest], "{:.6g}".format))
            columns.append(Column("least", sizes.min(axis=0), "{:.4g}".format, "least"))
        said += f"\nThe largest is {sizes.max():.4g} µm per g·mm."
        return Answer(said, text(columns, left=2), self.warnings)


def largest_at(size: FloatArray, steady: BoolArray) -> int | None:
    """Where a size is largest of all that exist, both of shape (S,); None if none does."""
    return int(np.argmax(np.where(steady, size, -1.0))) if steady.any() else None


def largest_text(
    what: str, names: Sequence[str], size: str, values: FloatArray, speeds: FloatArray, steady: BoolArray
) -> str:
    """The largest of values, shape (S, n), of each name and its speed, as a table; `size` with its unit."""
    where = [largest_at(column, steady) for column in values.T]
    found = [None if k is None else column[k] for k, column in zip(where, values.T, strict=True)]
    rpm = [None if k is None else speeds[k] * RPM for k in where]
    shown = Column("largest", found, figures, f"largest {size}")
    return text((Column(what, names, str), shown, Column("rpm", rpm, "{:.1f}".format, "at rpm")))


def polar(size: str, phase: str, Z: ComplexArray) -> tuple[Column, Column]:
    """Two columns of a table: size, and phase as lead, 0 ≤ phase < 360 degrees."""
    return Column(size, np.abs(Z).ravel()), Column(phase, phase_deg(Z).ravel())


def speed_range(speeds: FloatArray) -> str:
    """A speed, or how many from where to where, as text."""
    if speeds.size == 1:
        return f"{rpm_text(speeds[0])} ({speeds[0]:.6g} rad/s)"
    return f"{speeds.size} speeds from {range_text(speeds.min(), speeds.max())}"
