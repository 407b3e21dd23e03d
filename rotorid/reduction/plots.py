"""Pictures of a reduced rotor. Nothing is shown or saved here: every function draws on axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

import fem
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    BLUE,
    BOX,
    COLORS,
    MARKERS,
    STYLES,
    TEXT,
    VERMILION,
    WIDTH,
    legend_above,
    new_axes,
    new_pair,
    note,
    plain,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction.equivalent.changed_inputs import Shift
    from rotorid.reduction.equivalent.frequency_shape_trade_off import TradeOff
    from rotorid.reduction.equivalent.mass_uncertainty import MassUncertainty
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
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++")
"""Bars that differ without colour."""
DARK, LINE = "#2f3640", "#6b7480"


def plot_reduction(reduction: Reduction, ax: Axes | None = None) -> Axes:
    """Draw the shapes of the n-mass model (points) over the rotor's (lines) and the rotor itself.

    Without a rotor the measured shapes stand beside those of the model, place by place. Of many modes the
    first six are drawn.
    """
    from fem import draw_rotor
    from fem.plots import smooth_shapes

    axes = new_axes((WIDTH, 5.0)) if ax is None else ax
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
    legend_above(axes, 1, 0.75, -0.15)
    some = "" if shown == n else f", first {shown} of {n} modes"
    axes.set_title(f"{n}-mass model (points) and rotor (lines){some}", pad=10 + 12 * lines)
    return axes


def _words(reduction: Reduction, k: int) -> str:
    """Frequency, error and MAC of a mode, where the rotor's is known."""
    f, error = reduction.frequencies[k], reduction.relative_error[k]
    text = f"mode {k + 1}: {f * RPM:.0f} rpm ({f:.5g} rad/s"
    if not np.isfinite(error):
        return f"{text})"
    return f"{text}, {_percent(100 * error)} %), MAC {reduction.mac[k]:.4f}"


def _along(shape: FloatArray, reference: FloatArray) -> FloatArray:
    """A shape scaled by least squares to another one."""
    factor = float(shape @ reference / (shape @ shape))
    return np.asarray(shape * (factor if abs(factor) > 1e-12 else 1.0))


def _measured(reduction: Reduction, axes: Axes) -> Axes:
    """Measured shapes (hollow) and those of the model (full) at the masses."""
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
        half = 0.0095 * span * len(text)
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
            fontsize=TEXT,
            color=DARK if mass > 0 else VERMILION,
        )
    return len(ends)


def plot_methods(methods: Methods, axes: Sequence[Axes] | None = None) -> tuple[Axes, Axes]:
    """Draw what methods of reduction lose: frequency errors with their sign, and 1 − MAC, as bars.

    Two axes, for the errors and for the shapes; of many modes the first six are drawn.
    """
    names = [row.name for row in methods.rows]
    errors, mac = ([getattr(row, what) for row in methods.rows] for what in ("relative_error", "mac"))
    return _compared(methods, names, np.array(errors), np.array(mac), axes)


def plot_trade_off(choices: TradeOff, axes: Sequence[Axes] | None = None) -> tuple[Axes, Axes]:
    """Draw what other masses at the same nodes lose, as `plot_methods` draws methods."""
    return _compared(choices, choices.names, choices.relative_error, choices.mac, axes)


def _compared(
    rows: Methods | TradeOff,
    names: Sequence[str],
    errors: FloatArray,
    mac: FloatArray,
    axes: Sequence[Axes] | None,
) -> tuple[Axes, Axes]:
    """Bars of frequency errors and of 1 − MAC, shapes (rows, n) each, both on linear scales with their 0."""
    above, below = new_pair(6.0, (1, 1)) if axes is None else axes
    n = min(len(rows.nodes), MOST_MODES)
    errors, losses = 100 * errors[:, :n], np.maximum(1 - mac[:, :n], 0.0)
    _bars(above, errors, names, [[_percent(e) for e in row] for row in errors])
    _bars(below, losses, names, [["none" if np.isnan(x) else f"{1 - x:.4f}" for x in row] for row in losses])
    above.set_ylabel("frequency error, %")
    below.set_ylabel("1 − MAC at the masses\n(written: MAC)")
    if np.nanmax(losses, initial=0.0) > 1 - ALIKE:
        below.axhline(1 - ALIKE, color=DARK, linewidth=1.0, linestyle="--", zorder=3)
        at: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "color": DARK, "bbox": BOX}
        note(below, f"MAC {ALIKE:g}: above, another shape", (0.0, 1 - ALIKE), (4, 4), **at)
    ticks = [f"mode {k + 1}\n{rows.rotor_frequencies[k] * RPM:.0f} rpm" for k in range(n)]
    below.set_xticks(range(n), ticks)
    where = ", ".join(map(str, rows.nodes))
    some = "" if n == len(rows.nodes) else f", first {n} of {len(rows.nodes)} modes"
    title = f"reduced to nodes {where}{some}"
    legend_above(above, 4 if max(map(len, names)) < 25 else 2, title=title, title_fontsize="medium")
    return above, below


def _bars(ax: Axes, tops: FloatArray, names: Sequence[str], texts: Sequence[Sequence[str]]) -> None:
    """Groups of bars by mode from 0, a colour and a hatch per row, a text at the end of each."""
    count, n = tops.shape
    width = 0.84 / count
    plain(ax)
    ax.grid(visible=False, axis="x")
    ax.axhline(0.0, color=DARK, linewidth=0.8)
    ax.margins(y=0.3)
    for i, name in enumerate(names):
        x = np.arange(n) + (i - (count - 1) / 2) * width
        color, hatch = COLORS[i % len(COLORS)], HATCHES[i % len(HATCHES)]
        for bar in ax.bar(x, np.nan_to_num(tops[i]), 0.92 * width, label=name, color=color, hatch=hatch):
            bar.set(edgecolor="white", linewidth=0)
        for place, end, text in zip(x, np.nan_to_num(tops[i]), texts[i], strict=True):
            down = text.startswith("−")
            shift, va = ((0, -3), "top") if down else ((0, 3), "bottom")
            note(ax, text, (float(place), float(end)), shift, ha="center", va=va, rotation=90, color=DARK)


def _percent(error: float) -> str:
    """An error in %, short; what has no bar is 0."""
    if np.isnan(error):
        return "none"
    if abs(error) < SMALLEST_ERROR:
        return "0"
    text = f"{error:+.2g}" if abs(error) < 99.5 or abs(error) >= 1e4 else f"{error:+.0f}"
    return text.replace("-", "−")


def plot_changes(reduction: Reduction, shift: Shift | None, ax: Axes | None = None) -> Axes:
    """Draw what errors and changes of the inputs do to each mass and frequency, all on one scale in percent.

    Parameters
    ----------
    reduction
        Masses and frequencies, with what stated errors do to them, if errors were stated.
    shift
        What given changes do; None: were none asked for.
    ax
        Where; default new axes.
    """
    axes = new_axes((WIDTH, 4.6)) if ax is None else ax
    n = len(reduction.nodes)
    values = _both(reduction.masses.solution, reduction.frequencies)
    percent = 100 / np.abs(np.where(values == 0, np.nan, values))
    places = -np.arange(2.0 * n) - np.repeat([0.0, 0.5], n)
    names = [f"node {node}" if isinstance(node, int) else node for node in reduction.nodes]
    names += [f"mode {k + 1}" for k in range(n)]
    rows = [f"{name}:  {_short(value)}" for name, value in zip(names, values, strict=True)]
    if reduction.uncertainty is not None:
        std = _draw_errors(reduction.uncertainty, percent, places, axes)
        rows = [f"{row} ± {_short(spread, 2)}" for row, spread in zip(rows, std, strict=True)]
    if shift is not None:
        exact = _draw_shift(shift, percent, places, axes)
        rows = [f"{row} → {_short(value)}" for row, value in zip(rows, values + exact, strict=True)]
    units = ["kg"] * n + ["rpm"] * n
    axes.set_yticks(places, [f"{row} {unit}" for row, unit in zip(rows, units, strict=True)])
    axes.axvline(0.0, color=DARK, linewidth=0.9, zorder=1)
    axes.set(xlabel="deviation from the value on the left, %")
    plain(axes)
    axes.grid(visible=False, axis="y")
    legend_above(axes, 1)
    return axes


def _draw_errors(known: MassUncertainty, percent: FloatArray, places: FloatArray, axes: Axes) -> FloatArray:
    """Intervals of one standard deviation, by first order and, where that is poor, drawn; the first."""
    std = _both(known.masses_std, known.frequencies_std)
    line: dict[str, Any] = {"linestyle": "", "markersize": 6, "capsize": 4}
    words = "± one standard deviation, first order"
    axes.errorbar(0 * places, places, xerr=std * percent, color=DARK, marker="o", label=words, **line)
    if known.drawn is not None:
        half = _both(*known.drawn) * percent
        line |= {"color": BLUE, "marker": "s", "label": "68 % of inputs drawn, recomputed"}
        axes.errorbar(np.where(np.isfinite(half), 0.0, np.nan), places - 0.25, xerr=half, **line)
    return std


def _draw_shift(shift: Shift, percent: FloatArray, places: FloatArray, axes: Axes) -> FloatArray:
    """Values after a change, recomputed and by first order; the change recomputed."""
    exact = _both(shift.exact_masses, shift.exact_frequencies)
    line: dict[str, Any] = {"linestyle": "", "markersize": 9, "zorder": 4}
    axes.plot(exact * percent, places, "D", color=VERMILION, label="after the change", **line)
    first, words = _both(shift.masses, shift.frequencies), "after it, predicted by first order"
    axes.plot(first * percent, places, "o", color="black", fillstyle="none", label=words, **line)
    return exact


def _both(masses: FloatArray, frequencies: FloatArray) -> FloatArray:
    """Masses, kg, and frequencies, rpm, one after the other."""
    return np.concatenate((masses, frequencies * RPM))


def _short(value: float, digits: int = 4) -> str:
    """So many digits, or all before the point; none of what does not vibrate."""
    if np.isnan(value):
        return "none"
    return f"{value:.{digits}g}" if abs(value) < 10**digits - 0.5 else f"{value:.0f}"
