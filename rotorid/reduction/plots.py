"""Pictures of a reduced rotor. Nothing is shown or saved here: every function draws on axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.plot_style import (
    ABOVE_SCALE,
    BLUE,
    COLORS,
    DARK,
    MARKERS,
    QUIET,
    TEXT,
    VERMILION,
    WIDTH,
    legend_above,
    look,
    new_axes,
    plain,
    plain_numbers,
    second_scale,
)
from rotorid.base.text import RPM, counted
from rotorid.reduction.masses import like
from rotorid.reduction.placement import NAMED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction.comparison import StabilityCost
    from rotorid.reduction.condensation import Methods
    from rotorid.reduction.placement import Placement
    from rotorid.reduction.reduce import Reduction


MOST_MODES = 6
"""Modes that one picture still tells apart."""
SMALLEST_ERROR, SAME_SHAPE = 1e-4, 1e-6
"""Frequency errors, %, and values of 1 − MAC, below which these are drawn as these."""
HATCHES = ("", "////", "....", "xxxx")
"""Bars that differ without colour."""
FULL: dict[str, Any] = {"color": BLUE, "linewidth": 2.4}
SMALL: dict[str, Any] = {"color": VERMILION, "linewidth": 1.7, "linestyle": (0, (4, 2))}
"""The full rotor and its small model where both are curves."""


def plot_reduction(reduction: Reduction, ax: Axes | None = None) -> Axes:
    """Draw the shapes of the n-mass model (points) over the rotor's (lines) and the rotor itself.

    Without a rotor the lines join the measured places. Of many modes the first six are drawn.
    """
    from fem import draw_rotor
    from fem.plots import smooth_shapes

    axes = ax or new_axes((WIDTH, 5.0))
    rotor, full, n = reduction.rotor, reduction.rotor_modes, len(reduction.nodes)
    shapes, curves, x = reduction.shapes, reduction.rotor_shapes, np.arange(n, dtype=float)
    labels, along = [f"{mass:.3g} kg".replace("-", "−") for mass in reduction.masses.solution], x
    scale = np.abs(curves).max(axis=0)
    axes.set(xlabel="place of the mass", ylabel="mode shape, largest = 1")
    if rotor is not None and full is not None:
        at = np.array(reduction.nodes, dtype=int) - 1
        draw_rotor(rotor, axes, height=0.22)
        x, shapes, scale = rotor.positions[at], like(shapes, full.shapes[at]), np.abs(full.shapes).max(axis=0)
        along, curves = smooth_shapes(full)
        axes.set_xlabel("position, m")
    else:
        axes.set_xticks(x, [str(node) for node in reduction.nodes])
    shown = min(n, MOST_MODES, curves.shape[1])
    points = shapes[:, :shown] / scale[:shown]
    points[:, np.isnan(reduction.frequencies[:shown])] = np.nan
    for k, (f, error) in enumerate(
        zip(reduction.frequencies[:shown], reduction.relative_error, strict=False)
    ):
        words = f"{f * RPM:.0f} rpm ({f:.5g} rad/s" if np.isfinite(f) else "does not vibrate"
        if np.isfinite(f):
            words += f", {_percent(100 * error)} %), MAC {reduction.mac[k]:.4f}"
        axes.plot(along, curves[:, k] / scale[k], **look(k), linewidth=1.8, zorder=5)
        (mark,) = axes.plot(x, points[:, k], MARKERS[k], color=COLORS[k], label=f"mode {k + 1}: {words}")
        mark.set(markeredgecolor="white", markersize=9, zorder=6)
    axes.secondary_xaxis("top").set_xticks(x, labels, rotation=45, fontsize=TEXT)
    axes.axhline(0.0, color=QUIET, linewidth=0.8, zorder=3)
    height = max(1.12, 1.08 * float(np.nan_to_num(np.abs(points)).max()))
    axes.set(ylim=(-height, height), yticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
    axes.set_title(f"{n}-mass model (points) and {reduction.source} (lines)", pad=10)
    legend_above(axes, 1, -0.15, markerscale=0.75)
    return axes


def plot_methods(methods: Methods, ax: Axes | None = None) -> Axes:
    """Draw frequency errors of methods of reduction as bars, with sign, and with the MAC of each shape.

    Of many modes the first six are drawn.
    """
    axes = ax or new_axes((WIDTH, 5.0))
    plain(axes)
    n, width = min(len(methods.nodes), MOST_MODES), 0.84 / len(methods.rows)
    for i, row in enumerate(methods.rows):
        x = np.arange(n) + (i - (len(methods.rows) - 1) / 2) * width
        errors = 100 * row.relative_error[:n]
        bars = axes.bar(
            x,
            np.nan_to_num(errors),
            0.92 * width,
            label=row.name,
            color=COLORS[i],
            hatch=HATCHES[i],
            edgecolor="white",
            linewidth=0,
        )
        texts = [
            f"{_percent(error)}, MAC {agreement:.4f}"
            for error, agreement in zip(errors, row.mac, strict=False)
        ]
        axes.bar_label(bars, texts, padding=3, rotation=90, fontsize=TEXT)
    axes.axhline(0.0, color=DARK, linewidth=0.8)
    axes.margins(y=0.9)
    ticks = [f"mode {k + 1}\n{f * RPM:.0f} rpm" for k, f in enumerate(methods.rotor_frequencies[:n])]
    axes.set_xticks(range(n), ticks)
    axes.set_ylabel("frequency error, %")
    title = f"reduced to nodes {', '.join(map(str, methods.nodes))}"
    legend_above(axes, len(methods.rows), title=title, title_fontsize="medium")
    return axes


def _percent(error: float) -> str:
    """An error in %, short."""
    return "none" if np.isnan(error) else f"{error:+.2g}".replace("-", "−")


def plot_placement(placement: Placement, ax: Axes | None = None) -> Axes:
    """Draw all choices of places: largest frequency error over 1 − smallest MAC, both logarithmic.

    Choices that give no physical model are left out. A colour bar for the condition number is added.
    """
    from matplotlib.colors import LogNorm

    axes = ax or new_axes((WIDTH, 5.6))
    plain(axes)
    ranked = np.flatnonzero(np.isfinite(placement.error))[::-1]  # the best on top
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=f"loss of the worst shape, 1 − MAC (at least {SAME_SHAPE:g}, log)",
        ylabel=f"largest frequency error\nof {counted(placement.check, 'mode')}, % (log)",
    )
    left_out = placement.considered - ranked.size
    title = f"{placement.considered} choices of {counted(placement.check, 'node')}"
    title += f", {left_out} without physical model" if left_out else ""
    if not ranked.size:
        axes.set_title(title, fontsize="medium")
        return axes
    x, y = np.maximum(1 - placement.mac, SAME_SHAPE), np.maximum(100 * placement.error, SMALLEST_ERROR)
    condition, low = placement.condition[ranked], float(placement.condition[ranked].min())
    scale = LogNorm(low, max(float(condition.max()), 1.05 * low))
    points = axes.scatter(x[ranked], y[ranked], 20, condition, cmap="viridis_r", norm=scale, zorder=2)
    bar = axes.figure.colorbar(points, ax=axes, label="condition number of the regression", pad=0.02)
    plain_numbers(bar.ax)
    plain_numbers(axes)
    rows = {row for row in placement.named.values() if row is not None and row in ranked}
    for k, row in enumerate(sorted(rows), start=2):
        names = " and ".join(NAMED[key] for key, other in placement.named.items() if other == row)
        nodes = ", ".join(map(str, placement.nodes[row]))
        text = f"{names}: {nodes}, {100 * placement.error[row]:.3g} %, MAC {placement.mac[row]:.4f}"
        (mark,) = axes.plot(x[row], y[row], MARKERS[k], color=COLORS[k], label=text)
        mark.set(markersize=10, markeredgecolor="black", zorder=6)
    legend_above(axes, 1, 0.8, title=title, title_fontsize="medium")
    return axes


def plot_stability(cost: StabilityCost, ax: Axes | None = None) -> Axes:
    """Draw the smallest logarithmic decrement of both models over speed; below 0 a motion grows.

    Where one grows without oscillating, the curve is at the bottom.
    """
    axes = ax or new_axes((WIDTH, 4.2))
    plain(axes)
    finite = np.concatenate((cost.full_decrement, cost.small_decrement))
    finite = finite[np.isfinite(finite)]
    far = 20 * np.median(np.abs(finite)) if finite.any() else 1.0  # beyond nothing matters
    low, high = np.clip([finite.min(initial=-1e-9), finite.max(initial=1e-9)], -far, far) * 1.1
    low -= 0.1 * high  # 0 is in sight with room below
    for name, decrement, threshold, style in (
        ("full rotor", cost.full_decrement, cost.full.threshold, FULL),
        (f"{len(cost.nodes)}-mass model", cost.small_decrement, cost.small.threshold, SMALL),
    ):
        words = name if threshold is None else f"{name}, unstable from {threshold * RPM:.0f} rpm"
        axes.plot(cost.speeds * RPM, np.where(np.isneginf(decrement), low, decrement), **style, label=words)
        if threshold is not None:
            axes.plot([threshold * RPM], [0.0], "o", color=style["color"], ms=9, zorder=6)
    axes.axhline(0.0, color=DARK, linewidth=0.9)
    label = "smallest logarithmic decrement\n(below 0 a motion grows)"
    axes.set(xlabel="speed, rpm", ylabel=label, ylim=(low, high))
    axes.margins(x=0.01)
    second_scale(axes)
    legend_above(axes, 2, borderaxespad=ABOVE_SCALE)
    return axes
