"""Picture of a type of machines: coefficients over their mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing import region_edge
from rotorid.base.plot_style import legend_below, look, new_figure, plain
from rotorid.base.text import rpm_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.fleet.machine_type import MachineType

_MOST = 4
"""Sensors and planes that are shown."""


def type_figure(kind: MachineType) -> Figure:
    """Coefficients of all machines over their mean, a field for each plane and sensor, with 95 % regions."""
    mean, effects = kind.mean, kind.effects
    machines = 100 * (kind.coefficients(effects.groups) / mean - 1)
    n = mean.size
    pairs = np.einsum("ninj->nij", (effects.new_group + effects.within).reshape(n, 2, n, 2))
    relative = pairs.reshape(*mean.shape, 2, 2) / (np.abs(mean) ** 2)[..., None, None]
    edges = 100 * region_edge(np.zeros_like(mean), relative * kind.widening, 91)
    shape = min(len(kind.planes), _MOST), min(len(kind.sensors), _MOST)
    figure = new_figure(2.6 * shape[0] + 0.8)
    axes = figure.subplots(*shape, sharex=True, sharey=True, squeeze=False)
    for (p, c), ax in np.ndenumerate(axes):
        plain(ax)
        for s, speed in enumerate(map(rpm_text, kind.speeds)):
            style, dots, edge = look(s), machines[:, s, c, p], edges[s, c, p]
            ax.plot(dots.real, dots.imag, ".", color=style["color"], label=f"machines, {speed}")
            ax.plot(edge.real, edge.imag, **style, label=f"95 % of machines, {speed}")
        for record, _ in kind.odd:
            other = 100 * (record.W / mean - 1)[:, c, p]
            ax.plot(other.real, other.imag, "x", color="black", label=f"odd: {record.machine}")
        ax.set_title(f"{kind.planes[p]} on {kind.sensors[c]}", fontsize="medium")
        ax.set(aspect="equal", xlabel="along the mean, % of it", ylabel="across, % of it")
        ax.label_outer()
    legend_below(figure, axes.flat)
    figure.set_layout_engine("compressed")  # no gaps between square fields
    return figure
