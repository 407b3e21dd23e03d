"""Picture of a type of machines: coefficients over their mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.solvers.error_propagation import region_edge
from rotorid.base.plot_style import legend_below, look, new_figure, note, plain
from rotorid.base.rpm import rpm_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.workflows.fleet.type_records import KnownType

MOST = 4
"""Sensors and planes that are shown."""


def type_picture(known: KnownType) -> Figure:
    """Coefficients of all machines over their mean, a field for each plane and sensor, with 95 % regions."""
    kind = known.kind
    W = kind.coefficients(kind.groups.mean) / kind.mean
    odd = [(record.machine, record.W / kind.mean) for record, _ in kind.odd]
    whole = (kind.effects.new_group + kind.effects.within) * kind.widening
    n = np.arange(kind.mean.size)
    pairs = whole.reshape(len(n), 2, len(n), 2)[n, :, n].reshape(*kind.mean.shape, 2, 2)
    edges = region_edge(np.ones_like(kind.mean), pairs / (np.abs(kind.mean) ** 2)[..., None, None], None, 90)
    sensors, planes = kind.sensors[:MOST], kind.planes[:MOST]
    figure = new_figure(2.6 * len(planes) + 0.8)
    axes = figure.subplots(len(planes), len(sensors), sharex=True, sharey=True, squeeze=False)
    for (p, c), ax in np.ndenumerate(axes):
        plain(ax)
        for s, speed in enumerate(kind.speeds):
            style = look(s)
            dots = 100 * (W[:, s, c, p] - 1)
            ax.plot(dots.real, dots.imag, ".", color=style["color"], label=f"machines, {rpm_text(speed)}")
            edge = 100 * (edges[s, c, p] - 1)
            ax.plot(
                edge.real, edge.imag, **style, linewidth=1.2, label=f"95 % of machines, {rpm_text(speed)}"
            )
            for name, other in odd:
                far = 100 * (other[s, c, p] - 1)
                ax.plot(far.real, far.imag, "x", color=style["color"], label="odd, left out")
                if s == 0:
                    note(ax, name, (far.real, far.imag), (4, 4))
        ax.set_title(f"{planes[p]} on {sensors[c]}", fontsize="medium")
        ax.set_aspect("equal", adjustable="box")
    for ax in axes[-1]:
        ax.set_xlabel("along the mean, % of it")
    for ax in axes[:, 0]:
        ax.set_ylabel("across, % of it")
    legend_below(figure, axes.flat)
    figure.set_layout_engine("compressed")  # no gaps between square fields
    return figure
