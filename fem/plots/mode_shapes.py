"""Mode shapes over the rotor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fem.plots.drawing import EDGE, draw_rotor
from rotorid.base.arrays import FloatArray
from rotorid.base.style import COLORS, STYLES, legend_above, new_axes
from rotorid.base.units import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.modes import Modes


def draw_modes(modes: Modes, ax: Axes | None = None) -> Axes:
    """Draw mode shapes, each to its largest value 1, over the rotor with its supports and masses."""
    ax = new_axes() if ax is None else ax
    rotor = modes.rotor
    draw_rotor(rotor, ax, height=0.22)
    x, curves = _smooth(modes)
    for k, (omega, curve) in enumerate(zip(modes.frequencies, curves.T, strict=True)):
        speed = f"{omega:.5g} rad/s = {omega * RPM:.5g} rpm" if omega else "rigid body"
        if omega and modes.direction[k] != "forward":
            speed += f", {modes.direction[k]}"
        ax.plot(
            x,
            curve / np.abs(curve).max(),
            color=COLORS[k % len(COLORS)],
            linestyle=STYLES[k % len(STYLES)],
            linewidth=2.2,
            zorder=5,
            label=f"{k + 1}: {speed}",
        )
    ax.axhline(0.0, color=EDGE, linewidth=0.8, zorder=3)
    ax.set(xlabel="position, m", ylabel="deflection, largest = 1", ylim=(-1.12, 1.12))
    legend_above(ax, marker_scale=0.6)
    return ax


def _smooth(modes: Modes, points: int = 12) -> tuple[FloatArray, FloatArray]:
    """Shapes between the nodes, as the elements' own cubics have them."""
    t = np.linspace(0.0, 1.0, points, endpoint=False)[None, :, None]
    L = modes.rotor.length[:, None, None]
    w, slope = modes.shapes[:, None, :], L * modes.slopes[:-1, None, :]
    end_slope = L * modes.slopes[1:, None, :]
    curve = (
        w[:-1] * (1 - 3 * t**2 + 2 * t**3)
        + w[1:] * (3 * t**2 - 2 * t**3)
        + slope * (t - 2 * t**2 + t**3)
        + end_slope * (t**3 - t**2)
    )
    x = (modes.positions[:-1, None] + modes.rotor.length[:, None] * t[0, :, 0]).ravel()
    return np.append(x, modes.positions[-1]), np.vstack((curve.reshape(x.size, -1), modes.shapes[-1:]))
