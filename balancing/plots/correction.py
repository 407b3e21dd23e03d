"""Pictures of a correction: weights, and vibration before and after."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from balancing.plots.polar import draw_line, from_zero, of_plane, polar_axes, turning, unit
from balancing.regions import reach
from balancing.tables import INVISIBLE
from rotorid.base.plot_style import QUIET, STYLES, TEXT, legend_above, legend_below, new_figure, plain
from rotorid.base.text import cut

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.check_run import CheckComparison
    from balancing.correction import Correction
    from balancing.mount import Mounted

_NAMED, _SPEEDS, _LETTERS = 40, 12, 70
"""Readings that have room for the names of their sensors; speeds that have; letters of a title's line."""
_REGIONS = "95 % regions: closed lines, or smaller than the marks"


def draw_correction(c: Correction, ax: Axes | None = None) -> Figure | Axes:
    """A new figure with all pictures; on polar axes the weights, on others the amplitudes."""
    if ax is None:
        return correction_figure(c)
    polar = ax.name == "polar"
    if polar:
        weights(c, ax)
    else:
        amplitudes(c, [ax])
    legend_above(ax, height=-0.08 if polar else -0.3, title=turning(c.labels), title_fontsize=TEXT)
    return ax


def correction_figure(
    c: Correction,
    check: CheckComparison | None = None,
    below: Callable[[Axes], object] | None = None,
) -> Figure:
    """A new figure: the weights, and all amplitudes before and after.

    Parameters
    ----------
    c
        The correction.
    check
        A check run: what was achieved (of several runs: in the last).
    below
        Draws something else than the amplitudes.
    """
    figure = new_figure(8.6)
    grid = figure.add_gridspec(2, height_ratios=[5, 6])
    polar = weights(c, figure.add_subplot(grid[0], projection="polar"), check)
    lower = figure.add_subfigure(grid[1])
    if below is None:
        amplitudes(c, axes := lower.subplots(2, sharex=True), check)
    else:
        below(axes := lower.add_subplot())
    words = c.sentence() if check is None else check.headline
    figure.suptitle(textwrap.fill(words, _LETTERS), fontsize="medium", fontweight="bold", parse_math=False)
    legend_below(figure, [polar, *np.atleast_1d(axes)], title=turning(c.labels))
    return figure


def residual_figure(
    result: Correction, mounted: Mounted | None = None, check: CheckComparison | None = None
) -> Figure:
    """A new figure of readings before and after (with pieces, in a check run), and what is left by itself."""
    figure = new_figure(4.2, 5.8)
    amplitudes(result, axes := figure.subplots(2, sharex=True), check, mounted)
    legend_below(figure, axes)
    return figure


def weights(c: Correction, ax: Axes | None = None, check: CheckComparison | None = None) -> Axes:
    """Polar picture of the correction weights with 95 % regions, largest weights and forbidden arcs.

    With check runs what was mounted in the last of them, too.
    """
    labels, shown, limits = c.labels, c.labels.weight, c.limits
    polar = polar_axes(ax, labels.angles_on_paper, f"Weights on the bare rotor, {labels.weight_in}")
    largest = np.abs(c.weights).max()
    styles: dict[str, tuple[str, float]] = {}
    for p, (plane, place) in enumerate(zip(c.planes, c.places(c.planes, c.weights), strict=True)):
        name = f"{cut(plane, 24)}: {labels.weight_at(c.weights[p])}"
        name += f", or remove at {place:.1f}°" if plane in c.remove else ""
        draw_line(polar, shown, [0, c.weights[p]], lw=2, label=name, **of_plane(p))
        lines = []
        if c.region_known:
            lines.append((c.region([p]).edge(181), STYLES[p % 4], 1.2, _REGIONS))
        if check is not None and plane in check.planes:
            there = check.weights[-1, check.planes.index(plane)]
            draw_line(polar, shown, [there], "o", mfc="white", ms=9, mew=1.5, color=of_plane(p)["color"])
        if limits is not None:
            arcs = [(limits.max_weight[p], 0.0, 2 * np.pi, "--", 0.9, "dashed circles: largest weights")]
            arcs += [
                (largest, *arc, "-", 5, "thick arcs: nothing can be mounted") for arc in limits.forbidden[p]
            ]
            lines += [
                (size * np.exp(1j * np.linspace(start, start + width, 181)), *look)
                for size, start, width, *look in arcs
                if np.isfinite(size)
            ]
        for line, style, thick, words in lines:
            draw_line(polar, shown, line, style, lw=thick, color=of_plane(p)["color"], alpha=0.6)
            styles[words] = style, thick
    for words, (style, thick) in styles.items():
        polar.plot([], [], style, lw=thick, color=QUIET, label=words)
    if check is not None:
        words = f"circles: mounted in run {cut(check.runs[-1], 24)!r}"
        polar.plot([], [], "o", mfc="white", color=QUIET, label=words)
    # a region far larger than the weights would hide them: it may leave the picture
    from_zero(polar, shown, c.weights, 4 * largest * labels.weight_scale or 1.0)
    return polar


def amplitudes(
    c: Correction,
    axes: Sequence[Axes],
    check: CheckComparison | None = None,
    mounted: Mounted | None = None,
) -> None:
    """Amplitudes before and after for every speed and sensor, with 95 % of a check run where known.

    With a check run (of several: the last) those before, predicted with what was mounted, and achieved. On a
    second one of the axes again, in the scale of what is left.
    """
    labels, result = c.labels, mounted or c
    vectors = [c.before, result.after, np.full_like(c.before, np.nan)]
    covariance, sensors, speeds = c.after_covariance, c.sensors, c.speeds
    if check is not None:
        vectors = [check.before, check.predicted[-1], check.achieved[-1]]
        covariance, sensors, speeds = check.covariance[-1], check.sensors, check.speeds
    before, after, achieved = (np.abs(z).ravel() * labels.vibration_scale for z in vectors)
    within = reach(np.nan_to_num(covariance)).ravel() * labels.vibration_scale
    S, C = len(speeds), len(sensors)
    places = np.arange(S * C) + np.repeat(np.arange(S), C) * 0.8
    beside = places - 0.17 * (check is not None)  # dots and stars hide each other otherwise
    for ax in axes:
        ax.bar(places, before, color="0.86", edgecolor="0.5", label="before")
        ax.vlines(beside, (after - within).clip(min=0.0), after + within, color="black")
        label = f"predicted{', with 95 % of a check run' if within.any() else ''}"
        ax.plot(beside, after, "o", color="black", ms=4.5, label=label)
        if check is not None:
            ax.plot(places + 0.2, achieved, "*", color="black", ms=9, mec="white", mew=0.5, label="achieved")
        elif c.limits is not None and np.isfinite(c.limits.residual).any():
            limit = c.limits.residual.ravel() * labels.vibration_scale
            ax.hlines(limit, places - 0.45, places + 0.45, color="black", lw=2.2, label="limit")
        plain(ax)
        ax.grid(visible=False, axis="x")
        ax.set(ylim=(0, None), ylabel=f"vibration{unit(labels)}")
    if len(axes) > 1:
        left = max(np.nanmax([*after + within, *achieved]), INVISIBLE * before.max()) or 1.0
        axes[1].set(ylim=(0, 1.08 * left), ylabel=f"what is left{unit(labels)}")
    names = [cut(name, 24) for name in sensors] * S if S * C <= _NAMED else []
    axes[-1].set_xticks(places[: len(names)], names, rotation=90, fontsize=TEXT, parse_math=False)
    every = slice(None, None, -(-S // _SPEEDS))
    upper = axes[0].secondary_xaxis("top")
    numbers = list(map(labels.speed_number, speeds[every]))
    upper.set_xticks(places.reshape(S, C).mean(axis=1)[every], numbers, fontsize=TEXT)
    upper.set_xlabel(f"speed, {labels.speed_in}", fontsize=TEXT)
