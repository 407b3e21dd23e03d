"""A reduced rotor beside the rotor itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import fem
from rotorid.estimate import Estimate
from rotorid.reduction.vibration import mac

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

RAD_S_TO_RPM = 30.0 / np.pi


@dataclass(frozen=True, eq=False)
class Reduction:
    """An n-mass model of a rotor beside the rotor itself.

    Attributes
    ----------
    nodes, positions
        Where the masses stand: node numbers and m from the left end, shape (n,).
    modes
        How many modes of the rotor the regression used.
    masses
        The `Estimate` of formula (50), kg.
    sensitivity
        Relative standard deviation of each mass per relative standard deviation of the inputs, shape (n,).
    compliance
        m/N, shape (n, n).
    frequencies, shapes
        Of the n-mass model: rad/s (n,), and at the masses (n, n), scaled to fit the rotor's.
    rotor_frequencies, rotor_shapes
        Of the rotor's plane at rest: rad/s (n,), and at the masses (n, n).
    rotor_modes
        The rotor's modes at every node, to draw.
    warnings
        What a user should know before trusting the model.
    """

    rotor: fem.Rotor
    nodes: tuple[int, ...]
    positions: FloatArray
    modes: int
    masses: Estimate
    sensitivity: FloatArray
    compliance: FloatArray
    frequencies: FloatArray
    shapes: FloatArray
    rotor_modes: fem.Modes
    rotor_shapes: FloatArray
    warnings: tuple[str, ...]

    @property
    def rotor_frequencies(self) -> FloatArray:
        """The rotor's first n natural frequencies, rad/s."""
        return self.rotor_modes.frequencies

    @property
    def relative_error(self) -> FloatArray:
        """Of each frequency against the rotor's, shape (n,)."""
        return np.asarray(self.frequencies / self.rotor_frequencies - 1.0)

    @property
    def mac_matrix(self) -> FloatArray:
        """MAC of the model's modes (rows) with the rotor's (columns) at the masses, (n, n)."""
        return mac(self.shapes, self.rotor_shapes)

    @property
    def mac(self) -> FloatArray:
        """MAC of each mode with the rotor's mode of the same number, shape (n,)."""
        return np.asarray(np.diag(self.mac_matrix))

    @property
    def equations_of_motion(self) -> fem.Motion:
        """M x'' + K x = f of the small model: masses, and the inverse of the compliance.

        The displacement of the mass at node 7 is `x7`. There is no damping: what a rotor's bearings and its
        surroundings take out is for the user to add, or to estimate (`rotorid.timedomain.second_order`).
        """
        K = np.linalg.inv(self.compliance)
        n = len(self.nodes)
        names = tuple(f"x{node}" for node in self.nodes)
        return fem.Motion(np.diag(self.masses.solution), np.zeros((n, n)), (K + K.T) / 2, names, 0.0)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, the keys of INTERFACE.md (`rotorid reduce`)."""
        return {
            "nodes": list(self.nodes),
            "positions_m": self.positions.tolist(),
            "modes": self.modes,
            "masses_kg": self.masses.solution.tolist(),
            "masses_std_kg": None if self.masses.std is None else _floats(self.masses.std),
            "mass_sensitivity": self.sensitivity.tolist(),
            "compliance_m_per_N": self.compliance.tolist(),
            "natural_frequencies_rad_s": _floats(self.frequencies),
            "rotor_frequencies_rad_s": self.rotor_frequencies.tolist(),
            "relative_error": _floats(self.relative_error),
            "mac": _floats(self.mac),
            "condition_number": self.masses.condition_number,
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """First a row per mass (`table` is "masses"), then a row per mode ("modes").

        Masses have node, position and mass; modes have number, frequencies, error and MAC. Cells of the other
        kind are blank.
        """
        import pandas as pd

        n = len(self.nodes)
        masses = pd.DataFrame(
            {"node": self.nodes, "position_m": self.positions, "mass_kg": self.masses.solution}
        )
        modes = pd.DataFrame(
            {
                "mode": np.arange(1, n + 1),
                "frequency_rad_s": self.frequencies,
                "rotor_frequency_rad_s": self.rotor_frequencies,
                "relative_error": self.relative_error,
                "mac": self.mac,
            }
        )
        modes.index += n
        frame = pd.concat((masses, modes), axis=1).astype({"node": "Int64", "mode": "Int64"})
        frame.insert(0, "table", ["masses"] * n + ["modes"] * n)
        return frame

    def summary(self) -> str:
        """Text for an engineer."""
        std = self.masses.std
        lines = [f"Warning: {w}" for w in self.warnings]
        lines.append(f"{len(self.nodes)} equivalent masses from the first {self.modes} mode(s), formula (50)")
        for i, node in enumerate(self.nodes):
            spread = "" if std is None else f" ± {_plain(std[i])}"
            mass = self.masses.solution[i]
            lines.append(f"  node {node:>3}  at {self.positions[i]:7.3f} m   {mass:10.3f} kg{spread}")
        total = self.masses.solution.sum()
        lines.append(f"  together {total:.1f} kg of the rotor's {self.rotor.total_mass:.1f} kg")
        lines.append("mode   n-mass model            rotor                   error      MAC")
        for k, (f, g) in enumerate(zip(self.frequencies, self.rotor_frequencies, strict=True)):
            error = self.relative_error[k]
            lines.append(
                f"{k + 1:>4}   {_speed(f)}   {_speed(g)}   {100 * error:+7.3f} %  {self.mac[k]:.5f}"
                if np.isfinite(f)
                else f"{k + 1:>4}   {'does not vibrate':<21}   {_speed(g)}"
            )
        lines.append(f"condition number of the regression {self.masses.condition_number:.3g}")
        if std is not None:
            lines.append(
                "± is one standard deviation from the regression's residuals (model error, not measurement)"
            )
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the shapes of both models over the rotor; returns the axes."""
        from rotorid.plots import plot_reduction

        return plot_reduction(self, ax)


def _speed(omega: float) -> str:
    return f"{omega:9.4f} rad/s {omega * RAD_S_TO_RPM:7.1f}/min"


def _plain(value: float) -> str:
    """Two significant digits, never as a power of ten."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    places = 1 - int(np.floor(np.log10(abs(value))))
    return f"{round(value, places):.{max(places, 0)}f}"


def _floats(values: FloatArray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]
