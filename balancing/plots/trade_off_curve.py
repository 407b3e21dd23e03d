"""Picture of a trade-off. Nothing here is ever shown or saved: the caller does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from balancing.plots.correction_polar import MARKERS
from rotorid.base.plot_style import COLORS
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.correction.trade_off import TradeOff


def draw_trade_off(t: TradeOff, ax: Axes | None = None) -> Figure | Axes:
    """Draw the curve; without `ax` a new figure that also holds the weights of the planes."""
    return overview(t) if ax is None else curve(t, ax)


def overview(t: TradeOff) -> Figure:
    """A new figure: the residual, and below it the weights of the planes, over the total weight."""
    from matplotlib.figure import Figure

    fig = Figure(figsize=(7, 6), layout="constrained")
    upper, lower = fig.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    curve(t, upper)
    upper.set_xlabel("")
    planes(t, lower)
    return fig


def curve(t: TradeOff, ax: Axes) -> Axes:
    """Residual over total weight, rms and largest amplitude, the knee marked."""
    scale, unit = t.labels.vibration_scale, t.labels.vibration_in
    x = t.totals * t.labels.weight_scale
    shown = {"max": ("largest amplitude", t.largest, COLORS[1]), "rms": ("rms", t.rms, COLORS[0])}
    for kind, (name, values, colour) in shown.items():
        main = kind == t.criterion
        made = "made, weighted, as small as possible" if t.weighted else "made as small as possible"
        label = f"{name} ({made})" if main else f"{name} at the same weights"
        style = "-" if main else ":"
        ax.plot(
            x, values * scale, style, marker="o" if main else None, ms=4, lw=1.6, color=colour, label=label
        )
    if t.knee is not None:
        y = shown[t.criterion][1][t.knee] * scale
        ax.axvline(x[t.knee], color="#7F7F7F", lw=0.8, ls="--", zorder=1)
        text = f"knee: {figures(x[t.knee], 3)} {t.labels.weight_in}, {figures(y, 3)} {unit}".rstrip()
        ax.plot(x[t.knee], y, "o", ms=11, mfc="none", mec="#000000", mew=1.4, zorder=4, label=text)
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)
    ax.set_ylabel(f"amplitude after correction{f', {unit}' if unit else ''}")
    ax.set_xlabel(_total(t))
    ax.set_title("What more weight takes away", fontsize="medium")
    ax.legend(fontsize="small", frameon=False)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def planes(t: TradeOff, ax: Axes) -> Axes:
    """Size of the weight in each plane over the total weight."""
    x, mass = t.totals * t.labels.weight_scale, t.labels.weight(t.weights)[0]
    for p, plane in enumerate(t.planes):
        colour, marker = COLORS[p % len(COLORS)], MARKERS[p % len(MARKERS)]
        ax.plot(x, mass[:, p], color=colour, marker=marker, ms=3.5, lw=1.2, label=plane)
    if t.knee is not None:
        ax.axvline(x[t.knee], color="#7F7F7F", lw=0.8, ls="--", zorder=1)
    ax.set_ylim(bottom=0)
    ax.set_xlabel(_total(t))
    unit = t.labels.weight_in
    ax.set_ylabel(f"weight{f', {unit}' if unit else ''}")
    ax.legend(
        fontsize="x-small",
        frameon=False,
        ncols=-(-len(t.planes) // 4),
        title="plane",
        title_fontsize="x-small",
    )
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def _total(t: TradeOff) -> str:
    unit = t.labels.weight_in
    return f"total weight of all planes{f', {unit}' if unit else ''}"
