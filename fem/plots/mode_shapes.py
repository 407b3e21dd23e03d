"""Mode shapes over the rotor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fem.plots.drawing import EDGE, draw_rotor
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import MARKERS, STYLES, legend_above, look, new_axes
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.modes_result import Modes


def draw_modes(modes: Modes, ax: Axes | None = None) -> Axes:
    """Draw mode shapes, each to its largest value 1, over the rotor with its supports and masses."""
    ax = new_axes() if ax is None else ax
    rotor = modes.rotor
    draw_rotor(rotor, ax, height=0.22)
    x, curves = smooth_shapes(modes)
    for k, (omega, curve) in enumerate(zip(modes.frequencies, curves.T, strict=True)):
        speed = f"{omega * RPM:.5g} rpm = {omega:.5g} rad/s" if omega else "rigid body"
        if omega and modes.direction[k] != "forward":
            speed += f", {modes.direction[k]}"
        drawn: dict[str, Any] = {"linewidth": 2.2, "zorder": 5, **look(k)}
        if k >= len(STYLES):
            drawn |= {"marker": MARKERS[k % len(MARKERS)], "markevery": (k, 24), "markeredgecolor": "white"}
        ax.plot(x, curve / np.abs(curve).max(), label=f"{k + 1}: {speed}", **drawn)
    ax.axhline(0.0, color=EDGE, linewidth=0.8, zorder=3)
    ax.set(xlabel="position, m", ylabel="deflection, largest = 1", ylim=(-1.12, 1.12))
    legend_above(ax, 2, marker_scale=0.6)
    return ax


def smooth_shapes(modes: Modes, points: int = 12) -> tuple[FloatArray, FloatArray]:
    """Shapes between the nodes, as the elements' own cubics have them.

    Returns
    -------
    Positions, m, `points` in each element and the last node, shape (n,); the shapes there, shape (n, modes).
    """
    from scipy.interpolate import CubicHermiteSpline

    parts = np.linspace(0.0, 1.0, points, endpoint=False)
    within = modes.positions[:-1, None] + modes.rotor.length[:, None] * parts
    x = np.append(within, modes.positions[-1])
    return x, np.asarray(CubicHermiteSpline(modes.positions, modes.shapes, modes.slopes)(x))
