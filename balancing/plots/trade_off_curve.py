"""Pictures of a trade-off and of choices of planes. Nothing here is ever shown or saved: the caller does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.plots.amplitude_bars import unit
from balancing.plots.correction_polar import of_plane
from rotorid.base.plot_style import COLORS, QUIET, TEXT, legend_below, new_figure, plain
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.correction.best_planes import Subsets
    from balancing.correction.trade_off import TradeOff

_SHOWN = 10
"""Choices of planes in one picture."""


def draw_trade_off(t: TradeOff, ax: Axes | None = None) -> Figure | Axes:
    """Draw the curve; without `ax` a new figure that also holds the weights of the planes."""
    return overview(t) if ax is None else curve(t, ax)


def overview(t: TradeOff) -> Figure:
    """A new figure: the residual, its end on a larger scale, and the weights, over the total weight."""
    fig = new_figure(7.6)
    upper, closer, lower = fig.subplots(3, 1, sharex=True, height_ratios=[1.5, 1, 1])
    for ax in (upper, closer):
        curve(t, ax)
        ax.set_xlabel("")
        ax.get_legend().remove()
    last = -1 if t.knee is None else t.knee
    top = 1.3 * max(float(t.largest[last]), float(t.rms[last])) * t.labels.vibration_scale
    closer.set_ylim(0, top or None)
    closer.set(title="", ylabel=f"larger scale{unit(t.labels)}")
    planes(t, lower)
    legend_below(fig, (upper, lower))
    return fig


def curve(t: TradeOff, ax: Axes) -> Axes:
    """Residual over total weight, rms and largest amplitude, the knee marked."""
    scale, vibration = t.labels.vibration_scale, t.labels.vibration_in
    x = t.totals * t.labels.weight_scale
    shown = {"max": ("largest", t.largest, COLORS[1]), "rms": ("rms", t.rms, COLORS[0])}
    for kind, (name, values, colour) in shown.items():
        main = kind == t.criterion
        made = "made, weighted, as small as possible" if t.weighted else "made as small as possible"
        label = f"{name} ({made})" if main else f"{name} at the same weights"
        look: dict[str, Any] = {"ls": "-", "marker": "o"} if main else {"ls": ":"}
        ax.plot(x, values * scale, ms=4, lw=1.6, color=colour, label=label, **look)
    if t.knee is not None:
        y = shown[t.criterion][1][t.knee] * scale
        ax.axvline(x[t.knee], color=QUIET, lw=0.8, ls="--", zorder=1)
        text = f"knee: {figures(x[t.knee], 3)} {t.labels.weight_in}, {figures(y, 3)} {vibration}".rstrip()
        ax.plot(x[t.knee], y, "o", ms=11, mfc="none", mec="black", mew=1.4, zorder=4, label=text)
    ax.set_ylim(bottom=0)
    ax.set_xlim(left=0)
    ax.set_ylabel(f"vibration after{unit(t.labels)}")
    ax.set_xlabel(_total(t))
    ax.set_title("What more weight takes away", fontsize="medium")
    ax.legend(fontsize=TEXT, frameon=False)
    plain(ax)
    return ax


def planes(t: TradeOff, ax: Axes) -> Axes:
    """Size of the weight in each plane over the total weight."""
    x, mass = t.totals * t.labels.weight_scale, t.labels.weight(t.weights)[0]
    for p, plane in enumerate(t.planes):
        ax.plot(x, mass[:, p], **of_plane(p), ms=4, lw=1.2, label=f"weight in {plane}")
    if t.knee is not None:
        ax.axvline(x[t.knee], color=QUIET, lw=0.8, ls="--", zorder=1)
    ax.set_ylim(bottom=0)
    ax.set_xlabel(_total(t))
    ax.set_ylabel(f"weight, {t.labels.weight_in}" if t.labels.weight_in else "weight")
    plain(ax)
    return ax


def choices(found: Subsets, ax: Axes) -> Axes:
    """What each choice of planes leaves, the best first: predicted, and in a check run with its errors."""
    shown, scale = min(len(found.planes), _SHOWN), found.labels.vibration_scale
    at = np.arange(shown)
    bars: dict[str, Any] = {"color": "0.86", "edgecolor": "0.5", "lw": 0.6}
    ax.barh(at, found.expected[:shown] * scale, 0.7, **bars, label="rms expected in a check run")
    ax.plot(found.rms[:shown] * scale, at, "o", color="black", ms=5, label="rms predicted")
    ax.plot(found.largest[:shown] * scale, at, ">", color="black", ms=5, label="largest predicted")
    ax.set_yticks(at, [", ".join(names) for names in found.planes[:shown]], fontsize=TEXT)
    ax.set_ylim(shown - 0.5, -0.5)
    ax.set_xlim(left=0)
    ax.set_xlabel(f"vibration{unit(found.labels)}; before: rms {figures(found.rms_before * scale, 3)}")
    ax.set_title(f"The best {shown} of {found.choices} choices of planes", fontsize="medium")
    plain(ax)
    ax.grid(visible=False, axis="y")
    return ax


def _total(t: TradeOff) -> str:
    words = t.labels.weight_in
    return f"total weight of all planes{f', {words}' if words else ''}"
