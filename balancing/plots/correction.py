"""Pictures of a correction: weights, and vibration before and after."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.plots.discs import disc_axes, disc_height, draw_plane
from balancing.plots.polar import draw_line, from_zero, of_plane, polar_axes, turning, unit
from balancing.printed_readings import INVISIBLE
from balancing.regions import reach
from rotorid.base.plot_style import STYLES, TEXT, legend_below, new_figure, plain
from rotorid.base.text import cut

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.check_run import CheckComparison
    from balancing.choice_of_pieces import Mounted
    from balancing.correction_result import Correction
    from balancing.trials import Trials
    from balancing.trim_after_check_run import LeftToDo

_NAMED, _SPEEDS, _LETTERS = 40, 12, 70
"""Readings that have room for the names of their sensors; speeds that have; letters of a title's line."""
_BESIDE = 0.3
"""From one mark to the next, of a bar 0.8 wide."""
_DOT: dict[str, Any] = {"marker": "o", "color": "black", "ms": 4.5}
_HOLLOW: dict[str, Any] = {"marker": "o", "color": "0.45", "ms": 4.5, "mfc": "white"}
_STAR: dict[str, Any] = {"marker": "*", "color": "black", "ms": 9, "mec": "white", "mew": 0.5}
_PREDICTED = "predicted, with 95 % of a check run"
_REGIONS = "95 % regions, or smaller than the marks"
_LARGEST = "dashed circles: largest weights"
_ARCS = "thick arcs: nothing can be mounted"


def correction_figure(
    c: Correction,
    mounted: Mounted | None = None,
    check: CheckComparison | None = None,
    left: LeftToDo | None = None,
) -> Figure:
    """A new figure: the weights, and all amplitudes before and after.

    Parameters
    ----------
    c, mounted
        The correction, and pieces that make it: then discs with their holes.
    check, left
        A check run (of several the last), and what is left to do: the trim is drawn, or what is mounted.
    """
    pieces = mounted if left is None else left.pieces
    high = 3.9 if pieces is None else disc_height(len(c.planes))
    figure = new_figure(high + 4.9)
    grid = figure.add_gridspec(2, height_ratios=[high, 4.9])
    upper, lower = (figure.add_subfigure(grid[k]) for k in range(2))
    polar = []
    if pieces is None:
        polar.append(weights(c, upper.add_subplot(projection="polar"), left))
    else:
        for ax, plane in zip(disc_axes(upper, len(c.planes), c.labels), c.planes, strict=True):
            draw_plane(ax, pieces.correction, plane, pieces)
    amplitudes(c, axes := lower.subplots(2, sharex=True), check, mounted, left)
    words = (left or mounted or c).answer.judgement.splitlines()[0]
    words = textwrap.fill(words, _LETTERS, max_lines=2, placeholder=" …")
    figure.suptitle(words, fontsize="medium", fontweight="bold", parse_math=False)
    title = turning(c.labels) if polar else None  # discs say it
    legend_below(figure, [*polar, *axes], title=title)
    return figure


def residual_figure(
    result: Correction,
    mounted: Mounted | None = None,
    check: CheckComparison | None = None,
    left: LeftToDo | None = None,
) -> Figure:
    """A new figure of readings before and after (with pieces, in a check run), and what is left by itself."""
    figure = new_figure(4.2, 5.8)
    amplitudes(result, axes := figure.subplots(2, sharex=True), check, mounted, left)
    legend_below(figure, axes)
    return figure


def weights(c: Correction, ax: Axes | None = None, left: LeftToDo | None = None) -> Axes:
    """Polar picture of the correction weights with 95 % regions, largest weights and forbidden arcs.

    After a check run of the trim, or of what is mounted.
    """
    title, word, planes, vectors = "Weights on the bare rotor", "", c.planes, c.weights
    trim = left is not None and left.word == "trim"
    if left is not None:
        c, planes, vectors = left.correction, left.planes, left.trim if trim else left.there
        title, word = (
            ("Trim: to add now", "add ") if trim else (f"Mounted in {cut(left.run, 16)!r}", "mounted ")
        )
    labels, shown = c.labels, c.labels.weight
    polar = polar_axes(ax, labels.angles_on_paper, f"{title}, {labels.weight_in}")
    largest = np.abs(vectors).max()
    for p, (plane, place) in enumerate(zip(planes, c.places(planes, vectors), strict=True)):
        name = f"{cut(plane, 24)}: {word}{labels.weight_at(vectors[p])}"
        name += f", or remove at {place:.1f}°" if plane in c.remove else ""
        draw_line(polar, shown, [0, vectors[p]], lw=2, label=name, **of_plane(p))
        lines = []
        if c.region_known and plane in c.planes and (trim or left is None):
            edge = c.region([c.planes.index(plane)]).edge(181) - (0 if left is None else left.there[p])
            lines.append((edge, STYLES[p % 4], 1.2, _REGIONS))
        if c.limits is not None and plane in c.planes and not trim:
            k = c.planes.index(plane)
            around = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
            if np.isfinite(c.limits.max_weight[k]):
                lines.append((c.limits.max_weight[k] * around, "--", 0.9, _LARGEST))
            for start, width in c.limits.forbidden[k]:
                lines.append((largest * np.exp(1j * np.linspace(start, start + width, 181)), "-", 5, _ARCS))
        for line, style, thick, words in lines:
            look = {"lw": thick, "color": of_plane(p)["color"], "alpha": 0.6}
            draw_line(polar, shown, line, style, label=words, **look)
    # a region far larger than the weights would hide them: it may leave the picture
    from_zero(polar, shown, vectors, 5 * largest * labels.weight_scale or 1.0)
    return polar


def amplitudes(
    c: Correction,
    axes: Sequence[Axes],
    check: CheckComparison | None = None,
    mounted: Mounted | None = None,
    left: LeftToDo | None = None,
) -> None:
    """Amplitudes before and after for every speed and sensor, with 95 % of a check run where known.

    With a check run (of several: the last) those before, predicted with what was mounted, achieved, and
    predicted with the trim. On a second one of the axes again, in the scale of what is left.
    """
    labels, result = c.labels, mounted or c
    # place beside the middle of the bar, vectors, radii of 95 %, look, name
    at: Correction | Trials = c
    before, marks = c.before, [(0.0, result.after, c.within, _DOT, _PREDICTED)]
    if left is not None:
        at, before, unknown = left.check, left.before, np.zeros(left.before.shape)
        marks = [(0.0, at.mean[-1], unknown, _STAR, "achieved")]
        if check is not None:
            within = reach(np.nan_to_num(check.covariance[-1])) * labels.vibration_scale
            marks.append((-_BESIDE, check.predicted[-1], within, _HOLLOW, _PREDICTED))
        if left.word == "trim":
            marks.append((_BESIDE, left.after, left.within, _DOT, "predicted with the trim, with 95 %"))
    S, C = len(at.speeds), len(at.sensors)
    places = np.arange(S * C) + np.repeat(np.arange(S), C) * 0.8
    bars, most = np.abs(before).ravel() * labels.vibration_scale, 0.0
    for ax in axes:
        ax.bar(places, bars, color="0.86", edgecolor="0.5", label="before")
        for aside, vectors, circle, look, name in marks:
            sizes, radii = np.abs(vectors).ravel() * labels.vibration_scale, np.nan_to_num(circle).ravel()
            ax.vlines(places + aside, (sizes - radii).clip(min=0.0), sizes + radii, look["color"])
            label = name if radii.any() else name.partition(", with 95")[0]
            ax.plot(places + aside, sizes, linestyle="", label=label, **look)
            most = max(most, *(sizes + radii))
        if left is None and c.limits is not None and np.isfinite(c.limits.residual).any():
            limit = c.limits.residual.ravel() * labels.vibration_scale
            ax.hlines(limit, places - 0.45, places + 0.45, color="black", lw=2.2, label="limit")
        plain(ax)
        ax.grid(visible=False, axis="x")
        ax.set(ylim=(0, None), ylabel=f"vibration{unit(labels)}")
    top = 1.08 * max(most, INVISIBLE * bars.max()) or 1.0
    axes[1].set(ylim=(0, top), ylabel=f"what is left{unit(labels)}")
    axes[0].figure.align_ylabels(axes)
    names = [cut(name, 24) for name in at.sensors] * S if S * C <= _NAMED else []
    axes[-1].set_xticks(places[: len(names)], names, rotation=90, fontsize=TEXT, parse_math=False)
    every = slice(None, None, -(-S // _SPEEDS))
    upper = axes[0].secondary_xaxis("top")
    numbers = list(map(labels.speed_number, at.speeds[every]))
    upper.set_xticks(places.reshape(S, C).mean(axis=1)[every], numbers, fontsize=TEXT)
    upper.set_xlabel(f"speed, {labels.speed_in}", fontsize=TEXT)
