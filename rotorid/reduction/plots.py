"""Pictures of a reduced rotor. Nothing is shown or saved here: every function draws on axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

import fem
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import COLORS, VERMILION
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction.guyan_irs_serep_result import Methods
    from rotorid.reduction.result import Reduction


MOST_MODES = 6
"""Modes that one picture still tells apart."""
SMALLEST_ERROR = 1e-4
"""Frequency errors, %, below which a bar has no length."""
SAME_SHAPE = 1e-6
"""Values of 1 − MAC below this are drawn as this."""
ALIKE = 0.9
"""Below this MAC two shapes are not those of one mode."""
WRITTEN = 16
"""Bars that still have room for a number at their ends."""
DARK, LINE = "#2f3640", "#6b7480"


def plot_reduction(reduction: Reduction, ax: Axes | None = None) -> Axes:
    """Draw the shapes of the n-mass model (points) over the rotor's (lines) and the rotor itself.

    Without a rotor the measured shapes stand beside those of the model, place by place.

    Parameters
    ----------
    reduction
        What to draw; of many modes the first six.
    ax
        Where; default new axes.
    """
    from fem.plots import draw_rotor, new_axes
    from fem.plots.mode_shapes import smooth_shapes
    from rotorid.base.plot_style import MARKERS, STYLES

    axes = new_axes((10, 5.6)) if ax is None else ax
    rotor, full, n = reduction.rotor, reduction.rotor_modes, len(reduction.frequencies)
    if rotor is None or full is None:
        return _measured(reduction, axes)
    index = np.array([int(node) for node in reduction.nodes]) - 1
    scale = np.abs(full.shapes).max(axis=0)
    draw_rotor(rotor, axes, height=0.22)
    x, curves = smooth_shapes(full)
    shown = min(n, MOST_MODES)
    lowest = 1.12
    for k in range(shown):
        color, marker = COLORS[k % len(COLORS)], MARKERS[k % len(MARKERS)]
        axes.plot(x, curves[:, k] / scale[k], STYLES[k % len(STYLES)], color=color, linewidth=1.8, zorder=5)
        points = _along(reduction.shapes[:, k], full.shapes[index, k]) / scale[k]
        if not np.isfinite(reduction.frequencies[k]):
            axes.plot([], [], marker, color=color, label=f"mode {k + 1}: does not vibrate")
            continue
        lowest = max(lowest, 1.08 * float(np.abs(points).max()))
        axes.plot(
            full.positions[index],
            points,
            marker,
            color=color,
            markeredgecolor="white",
            markersize=9,
            zorder=6,
            label=_words(reduction, k),
        )
    axes.axhline(0.0, color=LINE, linewidth=0.8, zorder=3)
    lines = _masses_above(reduction, rotor, axes)
    axes.set(xlabel="position, m", ylabel="mode shape, rotor's largest = 1", ylim=(-lowest, lowest))
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=1 if shown == 1 else 2, frameon=False,
        fontsize="small", markerscale=0.75,
    )  # fmt: skip
    some = "" if shown == n else f", first {shown} of {n} modes"
    axes.set_title(f"{n}-mass model (points) and rotor (lines){some}", pad=10 + 12 * lines)
    return axes


def _words(reduction: Reduction, k: int) -> str:
    """Frequency, error and MAC of a mode, where the rotor's is known."""
    f, error = reduction.frequencies[k], reduction.relative_error[k]
    text = f"mode {k + 1}: {f:.5g} rad/s ({f * RPM:.0f} rpm"
    if not np.isfinite(error):
        return f"{text})"
    return f"{text}, {_percent(100 * error)} %), MAC {reduction.mac[k]:.4f}"


def _along(shape: FloatArray, reference: FloatArray) -> FloatArray:
    """A shape scaled by least squares to another one."""
    factor = float(shape @ reference / (shape @ shape))
    return np.asarray(shape * (factor if abs(factor) > 1e-12 else 1.0))


def _measured(reduction: Reduction, axes: Axes) -> Axes:
    """Measured shapes (hollow) and those of the model (full) at the masses."""
    from rotorid.base.plot_style import COLORS, MARKERS, legend_above, plain

    n, k = reduction.rotor_shapes.shape
    x = np.arange(n)
    for mode in range(min(k, MOST_MODES)):
        scale = np.abs(reduction.rotor_shapes[:, mode]).max()
        color, marker = COLORS[mode % len(COLORS)], MARKERS[mode % len(MARKERS)]
        axes.plot(x, reduction.rotor_shapes[:, mode] / scale, marker, color=color, mfc="white", ms=12)
        if np.isfinite(reduction.frequencies[mode]):
            axes.plot(
                x, reduction.shapes[:, mode] / scale, f"{marker}:", color=color, ms=6,
                label=_words(reduction, mode),
            )  # fmt: skip
    plain(axes)
    axes.axhline(0.0, color=LINE, linewidth=0.8)
    labels = [
        f"{node}\n{mass:.4g} kg"
        for node, mass in zip(reduction.nodes, reduction.masses.solution, strict=True)
    ]
    axes.set_xticks(x, labels)
    axes.set_xlim(-0.4, n - 0.6)
    axes.set(xlabel="place of the mass", ylabel="mode shape, largest measured = 1 (hollow: measured)")
    legend_above(axes, 1 if k == 1 else 2)
    return axes


def _masses_above(reduction: Reduction, rotor: fem.Rotor, axes: Axes) -> int:
    """Write each mass above its node, in as many lines as keep them apart; returns how many."""
    span = float(rotor.positions[-1])
    ends: list[float] = []  # right end of the last text in each line
    nodes = [int(node) for node in reduction.nodes]
    for node, mass in sorted(zip(nodes, reduction.masses.solution, strict=True)):
        place = float(rotor.positions[node - 1])
        text = f"{mass:.3g} kg" if abs(mass) < 999.5 else f"{mass:.0f} kg"
        text = text.replace("-", "−")
        half = 0.0075 * span * len(text)
        line = next((i for i, end in enumerate(ends) if place - half > end), len(ends))
        ends[line : line + 1] = [place + half]
        axes.axvline(place, color=LINE, linewidth=0.8, linestyle=":", zorder=2)
        axes.annotate(
            text,
            (place, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3 + 12 * line),
            textcoords="offset points",
            ha="center",
            fontsize="small",
            color=DARK if mass > 0 else VERMILION,
        )
    return len(ends)


def plot_methods(methods: Methods, axes: Sequence[Axes] | None = None) -> tuple[Axes, Axes]:
    """Draw what methods of reduction lose: frequency errors with their sign, and 1 − MAC, as bars.

    Parameters
    ----------
    methods
        What to draw; of many modes the first six.
    axes
        For the frequency errors and for the shapes; default new ones, one above the other.
    """
    if axes is None:
        from matplotlib import pyplot as plt

        _, (above, below) = plt.subplots(2, figsize=(10, 7), sharex=True, layout="constrained")
    else:
        above, below = axes
    n = min(len(methods.nodes), MOST_MODES)
    errors = 100 * np.array([row.relative_error[:n] for row in methods.rows])
    losses = 1 - np.array([row.mac[:n] for row in methods.rows])
    names = [row.name for row in methods.rows]
    above.set_yscale("symlog", linthresh=SMALLEST_ERROR, linscale=0.6)
    below.set_yscale("log")
    drawn = np.where(np.abs(errors) < SMALLEST_ERROR, 0.0, errors)
    _bars(above, drawn, np.zeros_like(drawn), names, [[_percent(e) for e in row] for row in errors])
    texts = [["none" if np.isnan(x) else f"{1 - x:.5f}" for x in row] for row in losses]
    _bars(below, np.maximum(losses, SAME_SHAPE), np.full_like(losses, SAME_SHAPE), names, texts)
    largest = np.nanmax(np.abs(errors), initial=SMALLEST_ERROR)
    smallest = np.nanmin(errors, initial=0.0)
    above.set_ylim(smallest * 12 if smallest < -SMALLEST_ERROR else -SMALLEST_ERROR, largest * 12)
    above.axhline(0.0, color=DARK, linewidth=0.8)
    _percent_axis(above)
    below.set_ylim(SAME_SHAPE, 8.0)
    below.axhline(1 - ALIKE, color=LINE, linewidth=1.0, linestyle="--", zorder=0.5)
    below.annotate(
        f"MAC {ALIKE:g}: below, another shape",
        (0.0, 1 - ALIKE),
        xycoords=("axes fraction", "data"),
        xytext=(4, 3),
        textcoords="offset points",
        fontsize="x-small",
        color=LINE,
    )
    above.set_ylabel("frequency error, %\n(0: below 0.0001 %)")
    below.set_ylabel("1 − MAC at the masters (bars: MAC)")
    ticks = [f"mode {k + 1}\n{methods.rotor_frequencies[k]:.5g} rad/s" for k in range(n)]
    below.set_xticks(range(n), ticks)
    where = ", ".join(map(str, methods.nodes))
    some = "" if n == len(methods.nodes) else f", first {n} of {len(methods.nodes)} modes"
    above.set_title(f"reduced to nodes {where}{some}", fontsize="medium", pad=26)
    above.legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(names), frameon=False, fontsize="small"
    )
    return above, below


def _bars(
    ax: Axes, tops: FloatArray, bottoms: FloatArray, names: Sequence[str], texts: Sequence[Sequence[str]]
) -> None:
    """Groups of bars by mode, a colour per method, a text at the end of each."""
    from rotorid.base.plot_style import COLORS, plain

    count, n = tops.shape
    width = 0.84 / count
    plain(ax)
    ax.grid(visible=False, axis="x")
    for i, name in enumerate(names):
        x = np.arange(n) + (i - (count - 1) / 2) * width
        top, bottom = np.where(np.isnan(tops[i]), bottoms[i], tops[i]), bottoms[i]
        ax.bar(x, top - bottom, 0.92 * width, bottom, color=COLORS[i % len(COLORS)], label=name)
        for place, end, start, text in zip(x, top, bottom, texts[i], strict=True):
            down = end < start
            ax.annotate(
                text,
                (float(place), float(end)),
                xytext=(0, -2 if down else 2),
                textcoords="offset points",
                ha="center",
                va="top" if down else "bottom",
                rotation=0 if tops.size <= WRITTEN else 90,
                fontsize="x-small",
                color=DARK,
            )


def _percent(error: float) -> str:
    """An error in %, short; what has no bar is 0."""
    if np.isnan(error):
        return "none"
    if abs(error) < SMALLEST_ERROR:
        return "0"
    text = f"{error:+.2g}" if abs(error) < 99.5 or abs(error) >= 1e4 else f"{error:+.0f}"
    return text.replace("-", "−")


def _percent_axis(ax: Axes) -> None:
    """Powers of ten of both signs, every second where there are many, and 0."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    low, high = ax.get_ylim()
    powers = 10.0 ** np.arange(np.log10(SMALLEST_ERROR), 6)
    ticks = np.concatenate((-powers[::-1], [0.0], powers))
    inside = ticks[(ticks >= low) & (ticks <= high)]
    if inside.size > 9:
        even = np.round(np.log10(np.maximum(np.abs(inside), SMALLEST_ERROR))) % 2 == 0
        inside = inside[(even & (np.abs(inside) > SMALLEST_ERROR)) | (inside == 0)]
    ax.yaxis.set_major_locator(FixedLocator(inside.tolist()))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value:+g}".replace("-", "−") if value else "0")
    )
