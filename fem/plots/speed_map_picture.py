"""Undamped critical speed map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import (
    DARK,
    MARKERS,
    WIDTH,
    legend_above,
    look,
    new_axes,
    plain,
    plain_numbers,
    scale_beside,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.speed_map import SpeedMap


def draw_speed_map(
    chart: SpeedMap, ax: Axes | None = None, operating: tuple[float, float] | None = None
) -> Axes:
    """Draw critical speeds over the stiffness of the supports, both logarithmic.

    Speeds that are not positive are left out; the range of operating speeds, rad/s, is shaded.
    """
    ax = new_axes((WIDTH, 5)) if ax is None else ax
    k = chart.stiffness
    for mode, curve in enumerate(chart.speeds.T):
        seen = curve > 0
        ax.plot(k[seen], curve[seen] * RPM, linewidth=2, label=f"critical speed {mode + 1}", **look(mode))
    ax.set(xscale="log", yscale="log")
    low, high = ax.get_ylim()
    for i, (label, own, at) in enumerate(chart.own):
        x, y = (own, at * RPM) if at.size else (np.repeat(own[:1], 2), np.array([low, high]))
        marker = MARKERS[i % len(MARKERS)] if at.size else ""
        ax.plot(x, y, color=DARK, linestyle=(0, (1, 1.5)), linewidth=1.3, marker=marker, markersize=5,
                markerfacecolor="white", label=label)  # fmt: skip
    ax.set_ylim(low, high)
    if operating is not None:
        ax.axhspan(operating[0] * RPM, operating[1] * RPM, color="#000000", alpha=0.07, linewidth=0,
                   label="operating range")  # fmt: skip
    ax.set(xlabel="stiffness of each support, N/m", ylabel="critical speed, rpm (both log)")
    plain(ax)
    ax.grid(which="minor", color="#f0f2f5", linewidth=0.5)
    scale_beside(ax, RPM, "critical speed, rad/s")
    for scale in (ax, *ax.child_axes):
        plain_numbers(scale)
    legend_above(ax)
    return ax
