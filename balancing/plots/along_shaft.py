"""Pictures along the shaft: tolerances, residual unbalances within them, and unbalance of a single run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from balancing.plots.polar import arrows, on_paper, turning
from balancing.regions import region_edge
from rotorid.base.plot_style import BLUE, TEXT, new_figure, note, plain, plain_numbers
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.iso21940 import Tolerance
    from balancing.unbalance import Unbalance
    from balancing.verdict import Verdict

_GRAM_MM = 1e6
Place = tuple[str, str]
"""Kind (plane, bearing or whole) and name."""


def draw_tolerance(t: Tolerance, ax: Axes | None = None) -> Axes:
    """The permissible unbalance of the planes and bearings in their order, or of the whole, g·mm."""
    limits = dict(zip(_places(t), [*t.limits, *t.bearing_limits], strict=True))
    ax, _ = _bars(ax, limits or {("whole", "rotor"): t.total}, _GRAM_MM, t)
    title = f"G{t.grade:g}, whole rotor: {figures(t.total * _GRAM_MM)} g·mm"
    ax.set(ylabel="permissible residual unbalance, g·mm", title=title)
    return ax


def draw_verdict(v: Verdict, ax: Axes | None = None, t: Tolerance | None = None) -> Axes:
    """The residual unbalance of each plane, its 95 % and its limit, on a logarithmic scale.

    Hollow where it is not decidable.

    Raises
    ------
    ValueError
        For a verdict without planes.
    """
    scale, kinds = v.labels.weight_scale, ("plane", "bearing") if v.labels.unbalances else ("plane",)
    rows = {(str(row.kind), row.name): row for row in v.rows if row.kind in kinds}
    if not rows:
        raise ValueError("this verdict has no planes to draw: give a tolerance")
    ax, order = _bars(ax, {place: row.limit for place, row in rows.items()}, scale, t)
    sizes = [
        size * scale
        for row in rows.values()
        for size in (row.low or row.size, row.high or 0.0, row.limit)
        if size > 0
    ]
    bottom = max(0.3 * min(sizes), 1e-5 * max(sizes))
    for x, row in enumerate(rows[place] for place in order):
        size, angle = (float(value) for value in v.labels.weight(row.value))
        text = f"{figures(size, 2)} at {angle:.0f}°"
        if row.high is not None:
            ax.vlines(x - 0.3, max((row.low or 0.0) * scale, bottom), row.high * scale, "black", label="95 %")
            # where 0 is within, the angle is not known either
            text = text if row.low else f"up to {figures(row.high * scale, 2)}"
        at = x - 0.3, max(size, bottom)
        face = "white" if row.verdict == "not decidable" else BLUE
        ax.plot(*at, "o", color="black", mfc=face, clip_on=False, label="residual unbalance")
        note(ax, f"{text}\n{row.verdict}", at, (8, 3))
    name = f"residual unbalance, {v.labels.weight_in} (log scale)"
    title = f"Residual unbalance and tolerance ({v.source}): {v.overall}"
    ax.set(yscale="log", ylim=(bottom, 4 * max(sizes)), ylabel=name)
    ax.set_title(title, fontsize="medium")
    plain_numbers(ax)
    return ax


def _places(t: Tolerance) -> list[Place]:
    ends = ("A", "B")[: len(t.bearings)]
    return [*(("plane", name) for name in t.planes), *(("bearing", end) for end in ends)]


def _bars(
    ax: Axes | None, limits: Mapping[Place, float], scale: float, t: Tolerance | None
) -> tuple[Axes, list[Place]]:
    """A bar for each limit, in the order along the shaft where it is known; that order."""
    at: dict[Place, float] = {}
    if t is not None and np.isfinite(t.positions).all():
        at = dict(zip(_places(t), [*t.positions, *t.bearings], strict=True))
    ax, order = ax or new_figure(4.2).add_subplot(), sorted(limits, key=lambda place: at.get(place, 0.0))
    names = [" ".join(place) + (f"\n{at[place] * 1e3:.6g} mm" if at else "") for place in order]
    sizes = [limits[place] * scale for place in order]
    bars = ax.bar(names, sizes, color="0.93", edgecolor="black", label="permissible")
    ax.bar_label(bars, [figures(size) for size in sizes], fontsize=TEXT)
    plain(ax)
    ax.set_xlabel("along the shaft, not to scale", fontsize=TEXT)
    return ax, order


def draw_unbalance(estimate: Unbalance, ax: Axes | None = None) -> Axes:
    """Draw the vector of each station with its 95 % region where it is determined; else grey.

    All have the scale of the vertical axis, 0° is to the right, and the rotor is seen from the end from which
    it turns counter-clockwise, or from the one that the job states.
    """
    labels, Q = estimate.labels, len(estimate.stations)
    sizes, angles = labels.weight(estimate.unbalance)
    edges = np.repeat(estimate.unbalance[:, None], 91, axis=1)
    for q in np.flatnonzero(estimate.determined & np.isfinite(estimate.covariance).all()):
        block = estimate.covariance[2 * q : 2 * q + 2, 2 * q : 2 * q + 2]
        edges[q] = region_edge(estimate.unbalance[q], block, 91)
    tips, edges = (on_paper(labels, each * labels.weight_scale) for each in (estimate.unbalance, edges))
    longest = np.abs(edges).max() or 1.0
    places = np.arange(Q) * 2.6 * longest * min(1.0, 8 / Q)
    ax = ax or new_figure(min(2.0 + 7.0 / Q, 5.0)).add_subplot()
    ax.axhline(0, color="0.8", lw=4, zorder=0)
    arrows(ax, places, tips, np.where(estimate.determined, BLUE, "0.6"))
    ax.plot(places + edges.real.T, edges.imag.T, color="black", lw=1)
    ax.set_title("blue: determined, with 95 % regions; grey: not determined by the readings", fontsize=TEXT)
    plain(ax)
    ends = -1.3 * longest, places[-1] + 1.3 * longest
    ax.set(aspect="equal", xlim=ends, ylim=(-1.15 * longest, 1.15 * longest))
    ax.set_ylabel(f"unbalance, {labels.weight_in}")
    ax.set_xlabel(f"stations in their order, {labels.weight_in}; {turning(labels)}", fontsize=TEXT)
    each = zip(estimate.stations, sizes, angles, strict=True)
    between = "\n" if Q <= 8 else "  "
    words = [between.join((name, figures(size, 3), f"{angle:.0f}°")) for name, size, angle in each]
    ax.set_xticks(places, words, rotation=90 * (Q > 8))
    return ax
