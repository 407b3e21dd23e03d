"""Campbell diagram with logarithmic decrements, and the map of critical speeds over bearing stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.orbits import DIRECTION_NAMES
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    ABOVE_SCALE,
    BOX,
    COLORS,
    DARK,
    MARKERS,
    QUIET,
    VERMILION,
    WARNING,
    WIDTH,
    legend_above,
    look,
    new_axes,
    new_figure,
    note,
    plain,
    plain_numbers,
    rad_s_above,
    scale_beside,
    shade_operating,
    shade_unstable,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem.campbell import Campbell
    from fem.speed_map import SpeedMap

_HIGHEST = 3.0  # logarithmic decrements above it are not drawn to scale
_PALE = 0.35
_STYLES: dict[str, dict[str, Any]] = {
    "forward": {"linestyle": "-", "marker": "^", "fillstyle": "full"},
    "backward": {"linestyle": "--", "marker": "v", "fillstyle": "none"},
    "mixed": {"linestyle": ":", "marker": "D", "fillstyle": "none"},
}
_CRITICAL: dict[str, Any] = {"marker": "o", "color": "black", "markerfacecolor": "#F0E442", "markersize": 9}


def campbell_figure(campbell: Campbell, operating: tuple[float, float] | None = None) -> Figure:
    """Make a figure of a Campbell diagram over its logarithmic decrements; unstable speeds are hatched."""
    figure = new_figure(7.4)
    above, below = figure.subplots(2, sharex=True, height_ratios=(5, 3))
    draw_campbell(campbell, above, operating)
    draw_log_decrements(campbell, below, operating)
    above.set_xlabel("")
    above.tick_params(labelbottom=False)
    return figure


def draw_campbell(
    campbell: Campbell, ax: Axes | None = None, operating: tuple[float, float] | None = None
) -> Axes:
    """Draw whirl frequencies over speed, with the 1× line; unstable speeds are hatched.

    Forward whirl is a solid line with filled triangles that point up, backward whirl a dashed one with open
    triangles that point down, neither (a straight line) a dotted one: told apart in black and white too.
    Where a mode is heavily damped its line is pale. The range of operating speeds, rad/s, is shaded.
    """
    ax = new_axes((WIDTH, 4.8)) if ax is None else ax
    frequencies = campbell.frequencies * RPM
    top = 1.06 * float(np.nanmax(frequencies, initial=1e-9))
    end = min(float(campbell.speeds.max()) * RPM, top)
    _draw_curves(ax, campbell, frequencies)
    ax.plot([0, end], [0, end], color="black", linewidth=1.3)
    ax.set(ylim=(0, top), xlabel="speed, rpm", ylabel="whirl frequency, rpm")
    criticals = [(speed * RPM, decrement) for speed, decrement in campbell.criticals if speed * RPM <= end]
    speeds = np.array([speed for speed, _ in criticals])
    ax.plot(speeds, speeds, linestyle="", zorder=6, **_CRITICAL)
    note(ax, "1×", (end, end), (4, -2), va="top", fontsize=11)
    _label_criticals(ax, criticals)
    shade_operating(ax, operating)
    shade_unstable(ax, _ranges(campbell), "unstable")
    plain(ax)
    rad_s_above(ax)
    scale_beside(ax, 60.0, "whirl frequency, Hz")
    _legend(ax, campbell, marked=bool(criticals))
    return ax


def draw_log_decrements(campbell: Campbell, ax: Axes, operating: tuple[float, float] | None = None) -> Axes:
    """Draw logarithmic decrements over speed, with the limit of stability, as `draw_campbell` draws modes.

    Values above 3 are cut off.
    """
    decrements = campbell.log_decrements
    _draw_curves(ax, campbell, decrements)
    high = float(np.clip(1.1 * np.nanmax(decrements, initial=0.1), 0.1, _HIGHEST))
    low = min(1.2 * float(np.nanmin(decrements, initial=0.0)), -0.12 * high)
    ax.set(ylim=(max(low, -_HIGHEST), high), xlabel="speed, rpm", ylabel="logarithmic decrement")
    ax.axhline(0.0, color="black", linewidth=1.1)
    ax.axhspan(-1e3, 0.0, facecolor=VERMILION, alpha=0.10, hatch="///", edgecolor=VERMILION, linewidth=0)
    note(ax, "unstable", (0.01, 0.02), xycoords="axes fraction", color=WARNING)
    plain(ax)
    shade_unstable(ax, _ranges(campbell))
    shade_operating(ax, operating)
    return ax


def draw_speed_map(
    chart: SpeedMap, ax: Axes | None = None, operating: tuple[float, float] | None = None
) -> Axes:
    """Draw critical speeds over the stiffness of the supports, both logarithmic.

    Speeds that are not positive are left out; the range of operating speeds, rad/s, is shaded.
    """
    ax = new_axes((WIDTH, 5)) if ax is None else ax
    for mode, curve in enumerate(chart.speeds.T):
        drawn = curve > 0
        stiffness, speeds = chart.stiffness[drawn], curve[drawn] * RPM
        ax.plot(stiffness, speeds, linewidth=2, label=f"critical speed {mode + 1}", **look(mode))
    ax.set(xscale="log", yscale="log")
    low, high = ax.get_ylim()
    for i, (name, stiffness, speeds) in enumerate(chart.own):
        x, y = (stiffness, speeds * RPM) if speeds.size else (np.repeat(stiffness[:1], 2), [low, high])
        marker = MARKERS[i % len(MARKERS)] if speeds.size else ""
        ax.plot(x, y, color=DARK, linestyle=(0, (1, 1.5)), linewidth=1.3, marker=marker, markersize=5,
                markerfacecolor="white", label=name)  # fmt: skip
    ax.set_ylim(low, high)
    if operating is not None:
        first, last = operating
        ax.axhspan(first * RPM, last * RPM, color="black", alpha=0.07, linewidth=0, label="operating range")
    ax.set(xlabel="stiffness of each support, N/m", ylabel="critical speed, rpm (both log)")
    plain(ax)
    ax.grid(which="minor", color="#f0f2f5", linewidth=0.5)
    scale_beside(ax, RPM, "critical speed, rad/s")
    for scale in (ax, *ax.child_axes):
        plain_numbers(scale)
    legend_above(ax)
    return ax


def _ranges(campbell: Campbell) -> list[tuple[float, float]]:
    return [(window.first, window.last) for window in campbell.windows]


def _drawn(campbell: Campbell) -> list[int]:
    """Modes that have a frequency somewhere."""
    return np.flatnonzero(np.isfinite(campbell.frequencies).any(axis=0)).tolist()


def _draw_curves(ax: Axes, campbell: Campbell, values: FloatArray) -> None:
    """Curves in stretches of one direction and of light or heavy damping; the mode's number at the end."""
    speeds, S = campbell.speeds * RPM, campbell.speeds.size
    step = max(S // 8, 1)
    ends = []
    for k in _drawn(campbell):
        color, way = COLORS[k % len(COLORS)], np.sign(campbell.direction[:, k])
        heavy = campbell.log_decrements[:, k] > campbell.heavy
        breaks = np.flatnonzero((np.diff(way) != 0) | (np.diff(heavy) != 0)) + 1
        for start, stop in pairwise([0, *breaks.tolist(), S]):
            part = slice(start, min(stop + 1, S))  # reaches to the next stretch: the curve has no gaps
            ax.plot(speeds[part], values[part, k], color=color, linewidth=1.8, markersize=6,
                    markevery=(3 * k % step, step), alpha=_PALE if heavy[start] else 1.0,
                    **_STYLES[DIRECTION_NAMES[way[start]]])  # fmt: skip
        if np.isfinite(values[-1, k]):
            ends.append((float(values[-1, k]), str(k + 1), color))
    first, last = float(speeds.min()), float(speeds.max())
    room = 0.12 * (last - first) or 0.05 * last or 1.0
    ax.set_xlim(0.0 if first < 0.3 * last else first - room / 4, last + room)
    for height, text, color in ends:
        note(ax, text, (last, height), (5 + 11 * (int(text) % 2), 0), va="center", color=color,
             fontweight="bold", annotation_clip=True)  # fmt: skip


def _label_criticals(ax: Axes, criticals: Sequence[tuple[float, float]]) -> None:
    """Speed, rpm, and logarithmic decrement beside each mark; of close ones on both sides of the 1× line."""
    room = 0.06 * ax.get_ylim()[1]
    last, crowd = -np.inf, 0
    for speed, decrement in sorted(criticals):
        crowd = crowd + 1 if speed - last < room else 0
        last = speed
        words = f"{speed:.0f} rpm, δ = {round(decrement, 2) + 0.0:.2f}"
        start = speed < 0.25 * ax.get_xlim()[1]
        right = start or (crowd % 2 == 0 and speed < 0.75 * ax.get_xlim()[1])
        down = 5 + 13 * (crowd if start else crowd // 2)
        place: dict[str, Any] = {"va": "top", "ha": "left"} if right else {"va": "bottom", "ha": "right"}
        shift = (9, -down) if right else (-9, down)
        note(ax, words, (speed, speed), shift, bbox=BOX, zorder=7, **place)


def _legend(ax: Axes, campbell: Campbell, *, marked: bool) -> None:
    from matplotlib.lines import Line2D

    drawn = _drawn(campbell)
    names = {DIRECTION_NAMES[way] for way in np.unique(np.sign(campbell.direction[:, drawn])).tolist()}
    handles: list[Any] = [
        Line2D([], [], color=QUIET, markersize=6, label=f"{name} whirl", **style)
        for name, style in _STYLES.items()
        if name in names
    ]
    if (campbell.log_decrements[:, drawn] > campbell.heavy).any():
        words = f"pale: decrement above {campbell.heavy:g}"
        handles.append(Line2D([], [], color=QUIET, linewidth=1.8, alpha=_PALE, label=words))
    if marked:
        handles.append(Line2D([], [], linestyle="", label="damped critical speed", **_CRITICAL))
    handles += [shade for shade in ax.patches if not str(shade.get_label()).startswith("_")]
    legend_above(ax, handles=handles, borderaxespad=ABOVE_SCALE)
