"""Campbell diagram and logarithmic decrements."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.orbits import DIRECTION_NAMES
from fem.parameter_bands import NORMAL_95
from fem.windows import ranges
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    ABOVE_SCALE,
    BOX,
    COLORS,
    QUIET,
    VERMILION,
    WARNING,
    WIDTH,
    legend_above,
    new_axes,
    new_figure,
    note,
    plain,
    rad_s_above,
    scale_beside,
    shade_bands,
    shade_operating,
    shade_unstable,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem.campbell import Campbell

HIGHEST = 3.0  # log decrements above count as "well damped" and are not drawn to scale
_LOOKS: dict[str, dict[str, Any]] = {
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
    draw_log_decrements(campbell, below)
    shade_unstable(below, ranges(campbell.windows))
    shade_operating(below, operating)
    above.set_xlabel("")
    above.tick_params(labelbottom=False)
    return figure


def draw_campbell(
    campbell: Campbell, ax: Axes | None = None, operating: tuple[float, float] | None = None
) -> Axes:
    """Draw whirl frequencies over speed, with the 1× line; unstable speeds are hatched.

    Forward whirl is a solid line with filled triangles that point up, backward whirl a dashed one with open
    triangles that point down, neither (a straight line) a dotted one: told apart in black and white too. The
    range of operating speeds, rad/s, is shaded.
    """
    ax = new_axes((WIDTH, 4.8)) if ax is None else ax
    top = _highest(campbell)
    _curves(ax, campbell, campbell.frequencies * RPM)
    end = min(float(campbell.speeds.max()) * RPM, top)
    ax.plot([0, end], [0, end], color="black", linewidth=1.3)
    ax.set(xlim=_range(campbell), ylim=(0, top))
    seen = [(speed * RPM, delta) for speed, delta in campbell.criticals if speed * RPM <= end]
    middle = _free(ax.get_xlim()[0], end, [speed for speed, _ in seen])
    note(ax, "1×", (middle, middle), (-4, 5), ha="right", fontsize=11)
    if seen:
        places = np.array([speed for speed, _ in seen])
        ax.plot(places, places, linestyle="", zorder=6, **_CRITICAL)
    _label_criticals(ax, seen)
    shade_operating(ax, operating)
    shade_unstable(ax, ranges(campbell.windows), "unstable")
    plain(ax)
    ax.set(xlabel="speed, rpm", ylabel="whirl frequency, rpm")
    if campbell.std is not None:
        half = NORMAL_95 * RPM * campbell.std
        shade_bands(ax, campbell.speeds * RPM, campbell.frequencies * RPM, half, cycle(COLORS))
    rad_s_above(ax)
    scale_beside(ax, 60.0, "whirl frequency, Hz")
    _legend(ax, campbell, bool(seen))
    return ax


def draw_log_decrements(campbell: Campbell, ax: Axes) -> Axes:
    """Draw logarithmic decrements over speed, with the limit of stability, as `draw_campbell` draws modes.

    Values above 3 are cut off.
    """
    shown = _shown(campbell)
    delta = campbell.log_decrements[:, shown]
    _curves(ax, campbell, campbell.log_decrements)
    finite = delta[np.isfinite(delta)]
    high = float(np.clip(1.1 * finite.max(initial=0.1), 0.1, HIGHEST))
    low = float(min(1.2 * finite.min(initial=0.0), -0.12 * high))
    ax.set(xlim=_range(campbell), ylim=(max(low, -HIGHEST), high))
    ax.axhline(0.0, color="black", linewidth=1.1)
    ax.axhspan(-1e3, 0.0, facecolor=VERMILION, alpha=0.10, hatch="///", edgecolor=VERMILION, linewidth=0)
    note(ax, "unstable", (0.01, 0.02), xycoords="axes fraction", color=WARNING)
    plain(ax)
    ax.set(xlabel="speed, rpm", ylabel="logarithmic decrement")
    return ax


def _range(campbell: Campbell) -> tuple[float, float]:
    first, last = RPM * float(campbell.speeds.min()), RPM * float(campbell.speeds.max())
    room = 0.12 * (last - first) or 0.05 * last or 1.0
    return (0.0 if first < 0.3 * last else first - room / 4), last + room


def _highest(campbell: Campbell) -> float:
    w = campbell.frequencies * RPM
    return 1.06 * float(max(w[np.isfinite(w)].max(initial=0.0), 1e-9))


def _free(low: float, end: float, taken: Sequence[float]) -> float:
    """Place on the 1× line with room from the critical speeds, as high as may be."""
    places = low + np.linspace(0.95, 0.3, 27) * (end - low)
    room = np.abs(places[:, None] - np.array([*taken, np.inf])).min(axis=1)
    wide = np.flatnonzero(room >= 0.1 * (end - low))
    return float(places[wide[0] if wide.size else np.argmax(room)])


def _shown(campbell: Campbell) -> list[int]:
    """Modes that have a frequency somewhere."""
    return np.flatnonzero(np.isfinite(campbell.frequencies).any(axis=0)).tolist()


def _curves(ax: Axes, campbell: Campbell, values: FloatArray) -> None:
    S = campbell.speeds.size
    step = max(S // 8, 1)
    ends = []
    for k in _shown(campbell):
        color = COLORS[k % len(COLORS)]
        way = np.sign(campbell.direction[:, k])
        for start, stop in _runs(way):
            # Each stretch reaches to the next one, so that the curve has no gaps.
            part = slice(start, min(stop + 1, S))
            ax.plot(
                campbell.speeds[part] * RPM,
                values[part, k],
                color=color,
                linewidth=1.8,
                markersize=6,
                markevery=(3 * k % step, step),
                **_LOOKS[DIRECTION_NAMES[way[start]]],
            )
        if np.isfinite(values[-1, k]):
            ends.append((float(values[-1, k]), str(k + 1), color))
    _label_ends(ax, float(campbell.speeds.max()) * RPM, ends)


def _runs(way: FloatArray) -> list[tuple[int, int]]:
    """Stretches of equal direction, (first, one past the last)."""
    breaks = [0, *(np.flatnonzero(np.diff(way) != 0) + 1).tolist(), way.size]
    return list(pairwise(breaks))


def _label_ends(ax: Axes, x: float, ends: list[tuple[float, str, str]]) -> None:
    """Mode numbers right of the curves; close neighbours stand side by side."""
    heights = [value for value, _, _ in ends]
    near = 0.03 * (max(heights, default=1.0) - min(0.0, *heights, 0.0) or 1.0)
    last, column = -np.inf, 0
    for value, text, color in sorted(ends):
        column = column + 1 if value - last < near else 0
        last = value if column == 0 else last
        shift = (5 + 11 * column, 0)
        note(ax, text, (x, value), shift, va="center", color=color, fontweight="bold", annotation_clip=True)


def _label_criticals(ax: Axes, criticals: Sequence[tuple[float, float]]) -> None:
    """Speed, rpm, and log decrement beside each mark; of close ones on the other side of the 1× line."""
    room = 0.06 * (ax.get_ylim()[1] - ax.get_ylim()[0])
    last, crowd = -np.inf, 0
    for speed, delta in sorted(criticals):
        crowd = crowd + 1 if speed - last < room else 0
        last = speed
        text, at, down = f"{speed:.0f} rpm, δ = {delta:.2f}", (speed, speed), 5 + 13 * (crowd // 2)
        if crowd % 2 == 0 and speed < 0.75 * ax.get_xlim()[1]:
            note(ax, text, at, (9, -down), va="top", ha="left", bbox=BOX, zorder=7)
        else:
            note(ax, text, at, (-9, down), va="bottom", ha="right", bbox=BOX, zorder=7)


def _legend(ax: Axes, campbell: Campbell, marked: bool) -> None:
    from matplotlib.lines import Line2D

    ways = np.unique(np.sign(campbell.direction[:, _shown(campbell)]))
    names = {DIRECTION_NAMES[way] for way in ways.tolist()}
    handles = [
        Line2D([], [], color=QUIET, markersize=6, label=f"{name} whirl", **_LOOKS[name])
        for name in _LOOKS
        if name in names
    ]
    if marked:
        handles.append(Line2D([], [], linestyle="", label="damped critical speed", **_CRITICAL))
    shades = [shade for shade in ax.patches if not str(shade.get_label()).startswith("_")]
    legend_above(ax, handles=[*handles, *shades], borderaxespad=ABOVE_SCALE)
