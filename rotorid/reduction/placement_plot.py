"""The map of all places of the masses: frequency error over loss of shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import COLORS
from rotorid.base.text import counted
from rotorid.reduction.plots import LINE, SAME_SHAPE, SMALLEST_ERROR

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction.placement_result import Placement


def plot_placement(placement: Placement, ax: Axes | None = None) -> Axes:
    """Draw all choices of places: largest frequency error over 1 − smallest MAC, both logarithmic.

    Choices that give no physical model are left out. A colour bar for the condition number is added.
    """
    from matplotlib.colors import LogNorm

    from rotorid.base.plot_style import TEXT, WIDTH, new_axes, plain, plain_numbers

    axes = new_axes((WIDTH, 5.6)) if ax is None else ax
    plain(axes)
    axes.set(xscale="log", yscale="log")
    ranked = np.isfinite(placement.error) & np.isfinite(placement.mac) & (placement.masses > 0).all(axis=1)
    axes.set(
        xlabel=f"loss of the worst shape, 1 − MAC (at least {SAME_SHAPE:g}, log)",
        ylabel=f"largest frequency error\nof {counted(placement.check, 'mode')}, % (log)",
    )
    n, all_of_them = placement.nodes.shape[1], placement.considered
    left_out = all_of_them - int(np.count_nonzero(ranked))
    title = f"{all_of_them} choices of {counted(n, 'node')}" + (
        f", {left_out} without physical model" if left_out else ""
    )
    if not ranked.any():
        axes.set_title(title, fontsize="medium")
        axes.text(
            0.5, 0.5, "no choice gives a physical model", transform=axes.transAxes, ha="center", color=LINE
        )
        return axes
    x = np.maximum(1 - placement.mac, SAME_SHAPE)
    y = np.maximum(100 * placement.error, SMALLEST_ERROR)
    condition = np.where(np.isfinite(placement.condition), placement.condition, np.nan)
    low, high = max(float(np.nanmin(condition[ranked])), 1.0), float(np.nanmax(condition[ranked]))
    unlike = high > 1.05 * low
    order = np.flatnonzero(ranked)[::-1]  # the best on top
    points = axes.scatter(
        x[order],
        y[order],
        s=16 if order.size > 300 else 34,
        c=condition[order],
        cmap="viridis_r",
        norm=LogNorm(low, high if unlike else 2 * low),
        alpha=0.85,
        linewidths=0,
        zorder=2,
    )
    if unlike:
        bar = axes.figure.colorbar(points, ax=axes, label="condition number of the regression", pad=0.02)
        plain_numbers(bar.ax)
    plain_numbers(axes)
    front = np.asarray(placement.pareto, dtype=int)
    axes.step(
        x[front], y[front], where="pre", color=COLORS[1], linewidth=1.4, zorder=3,
        label="trade-off: no other choice is better in both",
    )  # fmt: skip
    axes.plot(x[front], y[front], "o", color=COLORS[1], markersize=5, markerfacecolor="none", zorder=3.5)
    _named(placement, x, y, axes)
    axes.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1, frameon=False, fontsize=TEXT, markerscale=0.8,
        title=title, title_fontproperties={"size": "medium"},
    )  # fmt: skip
    return axes


def _named(placement: Placement, x: FloatArray, y: FloatArray, axes: Axes) -> None:
    """Mark the choices that have a name; one with several names is marked once."""
    names = (
        ("best by frequency", placement.best_by_frequency, "s", COLORS[0]),
        ("best by MAC", placement.best_by_mac, "^", COLORS[3]),
        ("compromise", placement.compromise, "D", COLORS[4]),
        ("the book's rule", placement.book, "*", COLORS[5]),
    )
    marked: dict[int, tuple[list[str], str, str]] = {}
    for name, row, marker, color in names:
        if row is not None and np.isfinite(placement.error[row]) and (placement.masses[row] > 0).all():
            marked.setdefault(int(row), ([], marker, color))[0].append(name)
    for row, (words, marker, color) in marked.items():
        nodes = ", ".join(map(str, placement.nodes[row]))
        word = "node" if len(placement.nodes[row]) == 1 else "nodes"
        masses = ", ".join(f"{m:.0f}" for m in placement.masses[row])
        axes.plot(
            x[row],
            y[row],
            marker,
            color=color,
            markersize=17 if marker == "*" else 10,
            markeredgecolor="black",
            markeredgewidth=1.2,
            linestyle="none",
            zorder=6,
            label=f"{' and '.join(words)}: {word} {nodes} ({masses} kg), "
            f"{100 * placement.error[row]:.3g} %, MAC {placement.mac[row]:.4f}",
        )
