"""Pictures of what a reduction costs in running: response and stability of both models over speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import BLUE, VERMILION, note
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction.dynamics.response_comparison import ResponseCost
    from rotorid.reduction.dynamics.stability_comparison import StabilityCost


CLOSE = 8.0
"""Difference, %, up to which the small model follows the rotor well."""
DARK, LINE = "#2f3640", "#6b7480"
FULL, SMALL = BLUE, VERMILION
DASHED = (0, (4, 2))


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
    above.plot(speeds, full[moving], color=FULL, linewidth=2.4, label="full rotor")
    above.plot(
        speeds,
        small[moving],
        color=SMALL,
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
    below.set_ylim(0.0, 1.25 * max(CLOSE, float(shown.max(initial=0.0))))
    below.axhline(CLOSE, color=SMALL, linewidth=1.0, linestyle=":", zorder=1)
    note(below, f"{CLOSE:g} %", (0.0, CLOSE), (4, 2), xycoords=("axes fraction", "data"), color=SMALL)
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
        ("full rotor", cost.full_decrement, cost.full_threshold, FULL, "-", 2.4),
        (f"{len(cost.nodes)}-mass model", cost.small_decrement, cost.small_threshold, SMALL, DASHED, 1.7),
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
    axes.axhspan(low, 0.0, color=SMALL, alpha=0.07, linewidth=0, zorder=0)
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
