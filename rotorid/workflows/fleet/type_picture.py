"""Picture of a type of machines: coefficients over their mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.solvers.error_propagation import region_edge
from rotorid.base.plot_style import legend_below, look, new_figure, note, plain
from rotorid.base.rpm import rpm_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing.coefficients.machine_type import MachineType
    from rotorid.base.arrays import ComplexArray

MOST = 4
"""Sensors and planes that are shown."""


def type_picture(kind: MachineType) -> Figure:
    """Coefficients of all machines over their mean, a field for each plane and sensor, with 95 % regions."""
    mean, effects = kind.mean, kind.effects

    def off(W: ComplexArray) -> ComplexArray:
        """From the mean, % of it."""
        return 100 * (W / mean - 1)

    machines, odd = off(kind.coefficients(effects.groups)), [(r.machine, off(r.W)) for r, _ in kind.odd]
    n = mean.size
    pairs = np.einsum("ninj->nij", (effects.new_group + effects.within).reshape(n, 2, n, 2))
    relative = pairs.reshape(*mean.shape, 2, 2) / (np.abs(mean) ** 2)[..., None, None]
    edges = 100 * region_edge(np.zeros_like(mean), relative, len(kind.machines) - 1, 90)
    sensors, planes = kind.sensors[:MOST], kind.planes[:MOST]
    figure = new_figure(2.6 * len(planes) + 0.8)
    axes = figure.subplots(len(planes), len(sensors), sharex=True, sharey=True, squeeze=False)
    for (p, c), ax in np.ndenumerate(axes):
        plain(ax)
        for s, speed in enumerate(map(rpm_text, kind.speeds)):
            style, dots, edge = look(s), machines[:, s, c, p], edges[s, c, p]
            ax.plot(dots.real, dots.imag, ".", color=style["color"], label=f"machines, {speed}")
            ax.plot(edge.real, edge.imag, **style, linewidth=1.2, label=f"95 % of machines, {speed}")
            for name, other in odd:
                at = float(other[s, c, p].real), float(other[s, c, p].imag)
                ax.plot(*at, "x", color=style["color"], label="odd, left out")
                if s == 0:
                    note(ax, name, at, (4, 4))
        ax.set_title(f"{planes[p]} on {sensors[c]}", fontsize="medium")
        ax.set_aspect("equal", adjustable="box")
    for ax in axes[-1]:
        ax.set_xlabel("along the mean, % of it")
    for ax in axes[:, 0]:
        ax.set_ylabel("across, % of it")
    legend_below(figure, axes.flat)
    figure.set_layout_engine("compressed")  # no gaps between square fields
    return figure
