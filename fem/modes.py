"""Critical speeds and mode shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.eigen import fine_mesh_warning, finite_modes, lowest_modes
from fem.matrices import assemble, ignored_inertia
from fem.rotor import RPM, FloatArray, Rotor, whole

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest critical speeds of a rotor, and its shapes there.

    Attributes
    ----------
    frequencies
        Critical speeds, which are the natural frequencies as long as the model has no gyroscopic effect,
        rad/s, ascending, shape (n,); 0 for a rigid-body motion.
    shapes
        Lateral deflection of each node in each mode, shape (N, n), scaled to 1 at the first node, or to
        the largest value 1 where the first node is a node of the mode.
    slopes
        dw/dx of these shapes at the nodes, 1/m per unit of deflection in m, shape (N, n).
    rotor
        The rotor.
    warnings
        What the reader must know.
    """

    frequencies: FloatArray
    shapes: FloatArray
    slopes: FloatArray
    rotor: Rotor
    warnings: tuple[str, ...] = ()

    @property
    def positions(self) -> FloatArray:
        """Axial position of each node, m, shape (N,)."""
        return self.rotor.positions

    @property
    def rpm(self) -> FloatArray:
        """Critical speeds in revolutions per minute, shape (n,)."""
        return self.frequencies * RPM

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid critical`."""
        return {
            "critical_speeds_rad_s": self.frequencies.tolist(),
            "critical_speeds_rpm": self.rpm.tolist(),
            "positions_m": self.positions.tolist(),
            "mode_shapes": self.shapes.T.tolist(),
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per node: number, position and the deflection in each mode."""
        import pandas as pd

        columns: dict[str, Any] = {"node": range(1, self.rotor.n_nodes + 1), "position_m": self.positions}
        columns |= {f"mode_{k}": shape for k, shape in enumerate(self.shapes.T, start=1)}
        return pd.DataFrame(columns)

    def summary(self) -> str:
        """Critical speeds as text."""
        lines = ["mode     rad/s         rpm          Hz"]
        for k, omega in enumerate(self.frequencies, start=1):
            note = "  rigid body" if omega == 0 else ""
            lines.append(
                f"{k:4d}{omega:12.4f}{omega * RPM:12.2f}{omega / (2 * np.pi):12.4f}{note}",
            )
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the mode shapes over the rotor with its supports and masses; return the axes."""
        from fem.plots import draw_modes

        return draw_modes(self, ax)


def critical_speeds(rotor: Rotor, n: int = 3) -> Modes:
    """Compute the n lowest critical speeds and mode shapes of the undamped rotor.

    Support damping and moments of inertia of discs play no part in this model; the latter is said in
    `warnings`. Reference: [S] task 9.1.

    Parameters
    ----------
    rotor
        The rotor; without enough supports its rigid-body motions come first, with frequency 0.
    n
        How many, from 1.

    Returns
    -------
    Modes
        Frequencies in rad/s and shapes.

    Raises
    ------
    ValueError
        If the model has fewer than n modes, nothing that moves has mass, or the mesh is too fine for
        float64.
    """
    n = whole(n, "the number of critical speeds")
    A = assemble(rotor)
    available = finite_modes(A)
    if not 1 <= n <= available:
        raise ValueError(
            f"{n} critical speeds cannot be found: the model has 1 to {available}; "
            "choose n in this range, or divide the shaft into more elements"
        )
    spectrum = lowest_modes(rotor, A, n)
    warnings = ignored_inertia(rotor) + fine_mesh_warning(rotor, spectrum.rounding)
    rigid = int(np.count_nonzero(spectrum.squares == 0))
    if rigid:
        motions = "motion" if rigid == 1 else "motions"
        warnings += (
            f"the supports leave {rigid} rigid-body {motions} of the rotor free; "
            f"{'it comes' if rigid == 1 else 'they come'} first, with critical speed 0",
        )
    frequencies = np.sqrt(np.maximum(spectrum.squares, 0.0))
    scale = _scale(spectrum.vectors[0::2])
    shapes, slopes = spectrum.vectors[0::2] / scale, spectrum.vectors[1::2] / scale
    for array in (frequencies, shapes, slopes):
        array.flags.writeable = False
    return Modes(frequencies, shapes, slopes, rotor, warnings)


def _scale(shapes: FloatArray) -> FloatArray:
    """First entry of each column, or its largest where the first is zero, shape (n,)."""
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    return np.asarray(np.where(np.abs(shapes[0]) > 1e-6 * np.abs(largest), shapes[0], largest))
