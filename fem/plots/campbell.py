"""Campbell diagram with logarithmic decrements, and the map of critical speeds over bearing stiffness."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.campbell import HEAVY
from fem.orbits import DIRECTION_NAMES
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    COLORS,
    QUIET,
    VERMILION,
    legend_above,
    look,
    new_axes,
    new_figure,
    note,
    plain,
    plain_numbers,
    second_scale,
)
from rotorid.base.text import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem.campbell import Campbell
    from fem.critical_speed_map import SpeedMap
    from fem.stability import Window

_HIGHEST = 3.0  # logarithmic decrements above it are not drawn to scale
_PALE = 0.35
_STYLES: dict[float, dict[str, Any]] = {
    1.0: {"linestyle": "-", "marker": "^", "fillstyle": "full"},
    -1.0: {"linestyle": "--", "marker": "v", "fillstyle": "none"},
    0.0: {"linestyle": ":", "marker": "D", "fillstyle": "none"},
}


def shade_unstable(ax: Axes, windows: Iterable[Window]) -> None:
    """Hatch ranges of speed in which the rotor is unstable, on axes in rpm."""
    for k, window in enumerate(windows):
        band = ax.axvspan(
            window.first * RPM,
            window.last * RPM,
            label="" if k else "unstable: no steady state",
            alpha=0.14,
        )
        band.set(facecolor=VERMILION, hatch="///", edgecolor=VERMILION, linewidth=0.6)


def shade_operating(ax: Axes, operating: tuple[float, float] | None) -> None:
    """Shade the range of operating speeds, rad/s, if there is one, on axes in rpm."""
    if operating is not None:
        first, last = operating
        ax.axvspan(first * RPM, last * RPM, color="black", alpha=0.1, label="operating range")


def campbell_figure(campbell: Campbell, operating: tuple[float, float] | None = None) -> Figure:
    """Make a figure of a Campbell diagram over its logarithmic decrements; unstable speeds are hatched."""
    figure = new_figure(7.4)
    above, below = figure.subplots(2, sharex=True, height_ratios=(5, 3))
    draw_campbell(campbell, above, operating).set_xlabel("")
    draw_log_decrements(campbell, below, operating)
    return figure


def draw_campbell(
    campbell: Campbell, ax: Axes | None = None, operating: tuple[float, float] | None = None
) -> Axes:
    """Draw whirl frequencies over speed, with the 1× line; unstable speeds are hatched.

    Forward whirl is a solid line with filled triangles that point up, backward whirl a dashed one with open
    triangles that point down, neither (a straight line) a dotted one: told apart in black and white too.
    Where a mode is heavily damped its line is pale. The range of operating speeds, rad/s, is shaded.
    """
    ax = ax or new_axes()
    speeds, frequencies = campbell.speeds * RPM, campbell.frequencies * RPM
    top = 1.15 * float(np.nanmax(frequencies, initial=1e-9))
    end = min(speeds.max(), top)
    _draw_curves(ax, campbell, frequencies)
    ax.plot([0, end], [0, end], color="black", linewidth=1.3)
    ax.set(ylim=(-0.08 * top, top), xlabel="speed, rpm", ylabel="whirl frequency, rpm")
    note(ax, "1×", (end, end), (0, 4), ha="right", fontweight="bold")
    _mark_criticals(ax, campbell.criticals, top)
    for way in np.unique(campbell.direction[np.isfinite(frequencies)]):
        ax.plot([], [], color=QUIET, label=f"{DIRECTION_NAMES[way]} whirl", **_STYLES[way])
    if (campbell.log_decrements > campbell.heavy).any():
        ax.plot([], [], color=QUIET, alpha=_PALE, label=f"pale: decrement above {campbell.heavy:g}")
    shade_operating(ax, operating)
    shade_unstable(ax, campbell.windows)
    plain(ax)
    second_scale(ax, 60.0, "whirl frequency, Hz", "right")
    legend_above(ax)
    return ax


def draw_log_decrements(campbell: Campbell, ax: Axes, operating: tuple[float, float] | None = None) -> Axes:
    """Draw logarithmic decrements over speed, with the limit of stability, as `draw_campbell` draws modes.

    Values above 3 are cut off.
    """
    decrements = campbell.log_decrements
    _draw_curves(ax, campbell, decrements)
    high = min(1.1 * np.nanmax(decrements, initial=0.1), _HIGHEST)
    low = max(1.2 * np.nanmin(decrements, initial=-0.1 * high), -_HIGHEST)
    ax.set(ylim=(low, high), xlabel="speed, rpm", ylabel="logarithmic decrement")
    ax.axhline(0.0, color="black", linewidth=1.1)
    ax.axhspan(low, 0.0, color=VERMILION, alpha=0.10, hatch="///", linewidth=0)
    note(ax, "unstable", (0.01, 0.02), xycoords="axes fraction", color=VERMILION)
    plain(ax)
    shade_operating(ax, operating)
    return ax


def draw_speed_map(
    chart: SpeedMap, ax: Axes | None = None, operating: tuple[float, float] | None = None
) -> Axes:
    """Draw critical speeds over the stiffness of the supports, both logarithmic.

    Speeds that are not positive are left out; the range of operating speeds, rad/s, is shaded.
    """
    ax = ax or new_axes()
    for mode, curve in enumerate(chart.speeds.T):
        speeds = np.where(curve > 0, curve * RPM, np.nan)
        ax.plot(chart.stiffness, speeds, linewidth=2, label=f"critical speed {mode + 1}", **look(mode))
    if operating:
        first, last = operating
        ax.axhspan(first * RPM, last * RPM, color="black", alpha=0.07, label="operating range")
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="stiffness of each support, N/m",
        ylabel="critical speed, rpm (log)",
    )
    plain(ax)
    second_scale(ax, RPM, "critical speed, rad/s", "right")
    for scale in (ax, *ax.child_axes):
        plain_numbers(scale)
    legend_above(ax)
    return ax


def _draw_curves(ax: Axes, campbell: Campbell, values: FloatArray) -> None:
    """Curves in stretches of one direction and of light or heavy damping; the mode's number at the end."""
    speeds, S = campbell.speeds * RPM, campbell.speeds.size
    step, last = max(S // 8, 1), speeds[-1]
    opaque = np.where(campbell.log_decrements > campbell.heavy, _PALE, 1.0)
    for k, (way, alpha, curve) in enumerate(zip(campbell.direction.T, opaque.T, values.T, strict=True)):
        color = COLORS[k % len(COLORS)]
        breaks = np.flatnonzero(np.diff(2 * way + alpha)) + 1
        for start, stop in pairwise([0, *breaks, S]):
            part = slice(start, stop + 1)  # reaches to the next stretch: the curve has no gaps
            ax.plot(speeds[part], curve[part], color=color, linewidth=1.8, alpha=alpha[start],
                    markevery=(3 * k % step, step), **_STYLES[way[start]])  # fmt: skip
        note(ax, str(k + 1), (last, curve[-1]), (4 + 8 * (k % 6), 0), va="center", color=color,
             fontweight="bold", annotation_clip=True)  # fmt: skip
    ax.set_xlim(0.0, 1.16 * last or 1.0)


def _mark_criticals(ax: Axes, criticals: Sequence[tuple[float, float]], top: float) -> None:
    """Circles, hollow without a peak; their words stand below the 1× line in its first part, then above."""
    from matplotlib.patheffects import withStroke

    for heavy, label in enumerate(("damped critical speed", f"no peak: δ > {HEAVY}")):
        these = [speed * RPM for speed, delta in criticals if (delta > HEAVY) == heavy]
        if these:
            face = "none" if heavy else "#F0E442"
            ax.plot(these, these, "o", color="black", mfc=face, ms=9, zorder=6, label=label)
    middle, gap, white = np.mean(ax.get_xlim()), 0.05 * top, [withStroke(linewidth=2.5, foreground="white")]
    marked = {f"{speed * RPM:.0f} rpm, δ = {delta:z.2g}": speed * RPM for speed, delta in criticals}
    for side, ha, va in ((-1, "left", "top"), (1, "right", "bottom")):
        used: list[float] = []
        for own, words in sorted(((side * speed, words) for words, speed in marked.items()), reverse=True):
            if own >= side * middle:
                height = own
                while any(abs(other - height) < gap for other in used):
                    height += gap / 4  # clear of the curves of other modes, and of other words
                used += [own, height]
                at = side * own, side * height
                note(ax, words, at, (-9 * side, 5 * side), ha=ha, va=va, zorder=7, path_effects=white)
