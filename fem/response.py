"""Synchronous response to unbalance, and influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from fem.eigen import fine_mesh_warning
from fem.matrices import assemble, ignored_inertia
from fem.receptance import ComplexArray, receptance
from fem.rotor import RPM, FloatArray, Rotor

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Method = Literal["fast", "exact"]


@dataclass(frozen=True, eq=False)
class Response:
    """Vibration of every node, z = Z e^{iωt} with z = x + i y, under a given unbalance.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    amplitudes
        Complex amplitudes Z, m, shape (S, N); positive phase = lead.
    unbalance
        What was mounted, `{node: m r e^{iφ}}`, kg·m.
    rotor
        The rotor.
    warnings
        What the reader must know.
    """

    speeds: FloatArray
    amplitudes: ComplexArray
    unbalance: Mapping[int, complex]
    rotor: Rotor
    warnings: tuple[str, ...] = ()

    def at(self, node: str | int) -> ComplexArray:
        """Complex amplitude of one node (number or station) over speed, m, shape (S,)."""
        return self.amplitudes[:, self.rotor.node(node) - 1]

    def to_dict(self, sensors: Sequence[str | int] | None = None) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid response`; of all nodes by default."""
        sensors = list(range(1, self.rotor.n_nodes + 1) if sensors is None else sensors)
        Z = self.amplitudes[:, [self.rotor.node(sensor) - 1 for sensor in sensors]]
        return {
            "speeds_rad_s": self.speeds.tolist(),
            "sensors": sensors,
            "amplitude_m": np.abs(Z).T.tolist(),
            "phase_deg": phase_degrees(Z).T.tolist(),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and node."""
        import pandas as pd

        S, N = self.amplitudes.shape
        return pd.DataFrame(
            {
                "speed_rad_s": np.repeat(self.speeds, N),
                "node": np.tile(np.arange(1, N + 1), S),
                "amplitude_m": np.abs(self.amplitudes).ravel(),
                "phase_deg": phase_degrees(self.amplitudes).ravel(),
            }
        )

    def summary(self) -> str:
        """The highest peak and where it is, as text."""
        amplitude = np.abs(self.amplitudes)
        k, i = np.unravel_index(int(np.argmax(amplitude)), amplitude.shape)
        lines = [
            f"Unbalance response at {_range(self.speeds)}, {self.rotor.n_nodes} nodes",
            f"largest amplitude {1e6 * amplitude[k, i]:.4g} µm at node {i + 1}, "
            f"{self.speeds[k]:.6g} rad/s = {self.speeds[k] * RPM:.6g} rpm",
        ]
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])

    def plot(self, ax: Axes | None = None, nodes: Sequence[str | int] | None = None) -> Axes:
        """Draw amplitude over speed at some nodes; by default stations or supports, and the largest."""
        from fem.plots import draw_response

        return draw_response(self, ax, nodes)


@dataclass(frozen=True, eq=False)
class InfluenceCoefficients:
    """Vibration at sensors per unit of unbalance in planes.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    sensors, planes
        Nodes or station names as they were asked for, lengths C and P.
    W
        Complex, m per kg·m, shape (S, C, P); Z = W U, positive phase = lead.
    warnings
        What the reader must know.
    """

    speeds: FloatArray
    sensors: tuple[str | int, ...]
    planes: tuple[str | int, ...]
    W: ComplexArray
    warnings: tuple[str, ...] = ()

    def to_frame(self) -> pd.DataFrame:
        """One row per speed, sensor and plane: the influence table of INTERFACE.md."""
        import pandas as pd

        S, C, P = self.W.shape
        return pd.DataFrame(
            {
                "speed_rad_s": np.repeat(self.speeds, C * P),
                "sensor": [sensor for sensor in self.sensors for _ in self.planes] * S,
                "plane": list(self.planes) * (S * C),
                "influence_m_per_kg_m": np.abs(self.W).ravel(),
                "phase_deg": phase_degrees(self.W).ravel(),
            }
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid influence`; the units stand once."""
        keys = ("speed", "sensor", "plane", "influence", "phase")
        units = {"speed": "rad/s", "influence": "m/(kg·m)", "phase": "deg, lead"}
        rows = self.to_frame().set_axis(list(keys), axis=1).to_dict("records")
        return {"rows": rows, "units": units, "warnings": list(self.warnings)}

    def summary(self) -> str:
        """A table at one speed, or the range of sizes over many, as text."""
        lines = [
            f"Influence coefficients at {_range(self.speeds)}: {len(self.sensors)} sensors, "
            f"{len(self.planes)} planes",
            f"{'sensor':>12}{'plane':>12}{'µm per g·mm':>14}{'phase lead, deg':>17}",
        ]
        if self.speeds.size > 1:
            lines[1] = f"{'sensor':>12}{'plane':>12}{'µm per g·mm, least':>20}{'largest':>12}{'at rad/s':>12}"
        for c, sensor in enumerate(self.sensors):
            for p, plane in enumerate(self.planes):
                size = np.abs(self.W[:, c, p])
                k = int(np.argmax(size))
                line = f"{sensor!s:>12}{plane!s:>12}"
                if self.speeds.size > 1:
                    line += f"{size.min():20.4g}{size[k]:12.4g}{self.speeds[k]:12.6g}"
                else:
                    line += f"{size[0]:14.4g}{phase_degrees(self.W[:, c, p])[0]:17.2f}"
                lines.append(line)
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the size of each influence coefficient over speed; return the axes."""
        from fem.plots import draw_influence

        return draw_influence(self, ax)


def unbalance_response(
    rotor: Rotor,
    unbalance: Mapping[str | int, complex] | Mapping[int, complex] | Mapping[str, complex],
    speeds: ArrayLike,
    *,
    method: Method = "fast",
) -> Response:
    """Compute the synchronous vibration of all nodes.

    The force is U ω² e^{iωt}. Model: complex coordinate, conservative shaft, damped isotropic supports.

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
        If the undamped rotor runs exactly at a critical speed, for impossible input, or for a mesh too
        fine for float64.
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
    # The matrices are real: one complex load is two real ones.
    loads = np.zeros((2 * rotor.n_nodes, 2))
    at = [2 * (node - 1) for node in masses]
    loads[at, 0], loads[at, 1] = U.real, U.imag
    used = np.flatnonzero(loads.any(axis=0))
    if not used.size:
        used = np.array([0])
    Z, warnings = _solve(rotor, 2 * np.arange(rotor.n_nodes), loads[:, used], speeds, method)
    return Response(speeds, _frozen(Z @ np.array([1.0, 1j])[used]), masses, rotor, warnings)


def influence(
    rotor: Rotor,
    planes: Sequence[str | int],
    sensors: Sequence[str | int],
    speeds: ArrayLike,
    *,
    method: Method = "fast",
) -> InfluenceCoefficients:
    """Compute influence coefficients W: vibration at sensors per unbalance in planes, [S] (33).

    Parameters
    ----------
    rotor
        The rotor.
    planes, sensors
        Node numbers, from 1, or names of stations.
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
    loads = np.zeros((2 * rotor.n_nodes, len(planes)))
    loads[[2 * (rotor.node(plane) - 1) for plane in planes], np.arange(len(planes))] = 1.0
    rows = np.array([2 * (rotor.node(sensor) - 1) for sensor in sensors], dtype=np.intp)
    W, warnings = _solve(rotor, rows, loads, speeds, method)
    return InfluenceCoefficients(speeds, sensors, planes, _frozen(W), warnings)


def phase_degrees(Z: ComplexArray) -> FloatArray:
    """Phase as lead, 0 ≤ phase < 360 degrees."""
    phase = np.mod(np.degrees(np.angle(Z)), 360.0)
    return np.where(phase >= 360.0, 0.0, phase)


def _range(speeds: FloatArray) -> str:
    if speeds.size == 1:
        return f"{speeds[0]:.6g} rad/s"
    return f"{speeds.size} speeds from {speeds.min():.6g} to {speeds.max():.6g} rad/s"


def _solve(
    rotor: Rotor, rows: np.ndarray[Any, np.dtype[np.intp]], loads: FloatArray, speeds: FloatArray, method: str
) -> tuple[ComplexArray, tuple[str, ...]]:
    if method not in ("fast", "exact"):
        raise ValueError(f'method must be "fast" or "exact", not {method!r}')
    H, warnings, rounding = receptance(rotor, assemble(rotor), rows, loads, speeds, method == "exact")
    H *= (speeds * speeds)[:, None, None]
    return H, (*ignored_inertia(rotor), *fine_mesh_warning(rotor, rounding), *warnings)


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
