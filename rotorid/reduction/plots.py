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
from rotorid.base.text import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction.comparison import ResponseCost, StabilityCost
    from rotorid.reduction.condensation import Methods
    from rotorid.reduction.placement import Placement
    from rotorid.reduction.reduce import Reduction


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
DASHED = (0, (4, 2))


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
    errors, mac = (np.array([getattr(row, of) for row in methods.rows]) for of in ("relative_error", "mac"))
    above, below = new_pair(6.0, (1, 1)) if axes is None else axes
    n = min(len(methods.nodes), MOST_MODES)
    errors, losses = 100 * errors[:, :n], np.maximum(1 - mac[:, :n], 0.0)
    _bars(above, errors, names, [[_percent(e) for e in row] for row in errors])
    _bars(below, losses, names, [["none" if np.isnan(x) else f"{1 - x:.4f}" for x in row] for row in losses])
    above.set_ylabel("frequency error, %")
    below.set_ylabel("1 − MAC at the masses\n(written: MAC)")
    if np.nanmax(losses, initial=0.0) > 1 - ALIKE:
        below.axhline(1 - ALIKE, color=DARK, linewidth=1.0, linestyle="--", zorder=3)
        at: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "color": DARK, "bbox": BOX}
        note(below, f"MAC {ALIKE:g}: above, another shape", (0.0, 1 - ALIKE), (4, 4), **at)
    ticks = [f"mode {k + 1}\n{methods.rotor_frequencies[k] * RPM:.0f} rpm" for k in range(n)]
    below.set_xticks(range(n), ticks)
    where = ", ".join(map(str, methods.nodes))
    some = "" if n == len(methods.nodes) else f", first {n} of {len(methods.nodes)} modes"
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


def plot_running(running: ResponseCost, ax: Sequence[Axes] | None = None) -> Axes:
    """Draw the unbalance response of full rotor and small model over speed, and below it their difference.

    Of the response the largest influence coefficient at each speed; its axes are returned.
    """
    from rotorid.base.plot_style import ABOVE_SCALE, legend_above, new_pair, plain, rad_s_above

    each = (running.full, running.small, running.small - running.full)
    full, small, difference = (np.abs(values).max(axis=(1, 2)) for values in each)
    above, below = new_pair(5.6) if ax is None else ax
    moving = running.speeds > 0
    speeds = running.speeds[moving] * RPM
    above.plot(speeds, full[moving], color=BLUE, linewidth=2.4, label="full rotor")
    above.plot(
        speeds,
        small[moving],
        color=VERMILION,
        linestyle=DASHED,
        linewidth=1.7,
        label=f"{len(running.nodes)}-mass model",
    )
    sizes = np.concatenate((full[moving], small[moving]))
    sizes = sizes[np.isfinite(sizes) & (sizes > 0)]
    if sizes.size:
        above.set_yscale("log")
        above.set_ylim(max(sizes.min() / 2, sizes.max() * 1e-6), sizes.max() * 2)
    # 1 m per kg·m is 1 µm per g·mm.
    above.set(ylabel="largest of all influence\ncoefficients, µm per g·mm (log)")
    for panel in (above, below):
        plain(panel)
        panel.margins(x=0.01)
        _bands(running, panel)
    rad_s_above(above)
    legend_above(above, borderaxespad=ABOVE_SCALE)
    above.tick_params(labelbottom=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        percent = 100 * difference / full
    below.plot(speeds, percent[moving], color=DARK, linewidth=1.6)
    # On a scale of what counts: where the small model is left out, the difference may leave the picture.
    shown = percent[moving & ~running.excluded & np.isfinite(percent)]
    below.set_ylim(0.0, 1.25 * max(1.0, float(shown.max(initial=0.0))))
    below.set(xlabel="speed, rpm", ylabel="difference, % of the\nrotor's largest entry")
    return above


def _bands(running: ResponseCost, ax: Axes) -> None:
    """Shade what is left out around critical speeds, and mark these."""
    low, high = float(running.speeds[0]), float(running.speeds[-1])
    bands: list[tuple[float, float]] = []
    for start, end in sorted(running.left_out):
        if bands and start <= bands[-1][1]:  # one shade where bands overlap
            bands[-1] = bands[-1][0], max(end, bands[-1][1])
        else:
            bands.append((start, end))
    inside = [(max(a, low), min(b, high)) for a, b in bands if b > low and a < high]
    for k, (a, b) in enumerate(inside):
        words = None if k else f"left out, ±{100 * running.bands:.3g} % of a critical speed"
        ax.axvspan(a * RPM, b * RPM, color="#000000", alpha=0.1, linewidth=0, label=words)
    for critical in running.criticals.tolist():
        if low <= critical <= high:
            ax.axvline(critical * RPM, color=LINE, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)


def plot_stability(cost: StabilityCost, ax: Axes | None = None) -> Axes:
    """Draw the smallest logarithmic decrement of both models over speed; below 0 a motion grows."""
    from rotorid.base.plot_style import ABOVE_SCALE, WIDTH, legend_above, new_axes, plain, rad_s_above

    axes = new_axes((WIDTH, 4.2)) if ax is None else ax
    plain(axes)
    models = (
        ("full rotor", cost.full_decrement, cost.full.threshold, BLUE, "-", 2.4),
        (f"{len(cost.nodes)}-mass model", cost.small_decrement, cost.small.threshold, VERMILION, DASHED, 1.7),
    )
    known = np.concatenate([decrement[np.isfinite(decrement)] for _, decrement, *_ in models])
    if known.size == 0:
        axes.text(0.5, 0.5, "nothing oscillates", transform=axes.transAxes, ha="center", color=LINE)
    for name, decrement, threshold, color, style, width in models:
        text = f"{name}, unstable from {threshold * RPM:.0f} rpm" if threshold is not None else name
        axes.plot(
            cost.speeds * RPM,
            np.where(np.isfinite(decrement), decrement, np.nan),
            color=color,
            linestyle=style,
            linewidth=width,
            marker="o" if cost.speeds.size < 12 else None,
            label=text,
        )
        if threshold is not None:
            axes.axvline(threshold * RPM, color=color, linewidth=1.0, linestyle=(0, (2, 2)), zorder=1)
            mark: dict[str, Any] = {"color": color, "markeredgecolor": "white", "markersize": 9, "zorder": 6}
            axes.plot([threshold * RPM], [0.0], "o" if style == "-" else "s", **mark)
    low, high = _limits(known)
    axes.set_ylim(low, high)
    for name, decrement, _, color, *_ in models:
        gone = np.isneginf(decrement)
        if gone.any():
            axes.plot(
                cost.speeds[gone] * RPM,
                np.full(np.count_nonzero(gone), low),
                "v",
                color=color,
                markersize=5,
                clip_on=False,
                label=f"{name} runs away without oscillating",
            )
    axes.axhspan(low, 0.0, color=VERMILION, alpha=0.07, linewidth=0, zorder=0)
    axes.axhline(0.0, color=DARK, linewidth=0.9)
    note(axes, "below 0: a motion grows", (0.0, 0.0), (6, 6), xycoords="axes fraction", color=DARK)
    axes.set(xlabel="speed, rpm", ylabel="smallest logarithmic decrement")
    axes.margins(x=0.01)
    rad_s_above(axes)
    legend_above(axes, 2, borderaxespad=ABOVE_SCALE)
    return axes


def _limits(known: FloatArray) -> tuple[float, float]:
    """Limits of the axis: 0 is in sight with room below; far above the usual size nothing is of interest."""
    if known.size == 0:
        return -1.0, 1.0
    far = 20 * float(np.median(np.abs(known)))
    bottom, top = min(0.0, float(known.min())), max(0.0, float(known.max()))
    if far > 0:
        bottom, top = max(bottom, -far), min(top, far)
    span = max(top - bottom, 1e-9)
    return bottom - 0.14 * span, top + 0.08 * span
