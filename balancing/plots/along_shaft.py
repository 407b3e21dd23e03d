"""Pictures along the shaft: tolerances, and unbalance of a single run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.plots.polar import on_paper, turning
from balancing.regions import region_edge
from rotorid.base.plot_style import BLUE, TEXT, new_figure, plain
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.iso21940 import Tolerance
    from balancing.unbalance import Unbalance

_GRAM_MM = 1e6


def draw_tolerance(t: Tolerance, ax: Axes | None = None) -> Axes:
    """The permissible unbalance of the planes and bearings in their order, or of the whole, g·mm."""
    ends = ("bearing A", "bearing B")[: len(t.bearings)]
    names = [*(f"plane {name}" for name in t.planes), *ends] or ["whole rotor"]
    sizes = np.array([*t.limits, *t.bearing_limits] or [t.total]) * _GRAM_MM
    order = np.argsort([*t.positions, *t.bearings] or [0.0], kind="stable")
    ax = ax or new_figure(4.2).add_subplot()
    bars = ax.bar([names[k] for k in order], sizes[order], color="0.93", edgecolor="black")
    ax.bar_label(bars, [figures(size) for size in sizes[order]], fontsize=TEXT)
    plain(ax)
    ax.set_xlabel("along the shaft, not to scale", fontsize=TEXT)
    title = f"G{t.grade:g}, whole rotor: {figures(t.total * _GRAM_MM)} g·mm"
    ax.set(ylabel="permissible residual unbalance, g·mm", title=title)
    return ax


def draw_unbalance(estimate: Unbalance, ax: Axes | None = None) -> Axes:
    """Draw the vector of each station with its 95 % region where it is determined; else grey.

    All have the scale of the vertical axis, 0° is to the right, and the rotor is seen from the end from which
    it turns counter-clockwise, or from the one that the job states.
    """
    labels, Q = estimate.labels, len(estimate.stations)
    sizes, angles = labels.weight(estimate.unbalance)
    stations = np.arange(Q)
    alone = np.nan_to_num(estimate.covariance).reshape(Q, 2, Q, 2)[stations, :, stations]
    edges = region_edge(estimate.unbalance, alone * estimate.determined[:, None, None], 91)
    tips, edges = (on_paper(labels, each * labels.weight_scale) for each in (estimate.unbalance, edges))
    longest = np.abs(edges).max() or 1.0
    places = np.arange(Q) * 2.6 * longest * min(1.0, 8 / Q)
    ax = ax or new_figure(min(2.0 + 7.0 / Q, 5.0)).add_subplot()
    for place, tip, edge, determined in zip(places, tips, edges, estimate.determined, strict=True):
        color = BLUE if determined else "0.6"
        ax.plot([place, place + tip.real], [0, tip.imag], "o-", color=color, lw=2, ms=4, markevery=[1])
        ax.plot(place + edge.real, edge.imag, color="black", lw=1)
    ax.set_title("blue: determined, within 95 % regions; grey: not determined", fontsize=TEXT)
    plain(ax)
    ends = -1.3 * longest, places[-1] + 1.3 * longest
    ax.set(aspect="equal", xlim=ends, ylim=(-1.15 * longest, 1.15 * longest))
    ax.set_ylabel(f"unbalance, {labels.weight_in}")
    ax.set_xlabel(f"station, {labels.weight_in}, angle; {turning(labels)}", fontsize=TEXT)
    each = zip(estimate.stations, sizes, angles, strict=True)
    between = "\n" if Q <= 8 else "  "
    words = [between.join((name, figures(size, 3), f"{angle:.0f}°")) for name, size, angle in each]
    ax.set_xticks(places, words, rotation=90 * (Q > 8))
    return ax
