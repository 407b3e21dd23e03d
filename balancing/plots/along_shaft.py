"""Pictures along the shaft: tolerances, residual unbalances within them, and unbalance of a single run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.plots.polar import on_paper, turning
from balancing.regions import region_edge
from rotorid.base.plot_style import BLUE, TEXT, new_figure, note, plain
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.iso21940 import Tolerance
    from balancing.unbalance import Unbalance
    from balancing.verdict import Verdict

_GRAM_MM = 1e6
_APART, _ROUND = 2.6, 8
"""Distance of stations in lengths of the longest vector; of more stations less."""

Place = tuple[str, str]
"""Kind (plane, bearing or whole) and name."""


def draw_tolerance(t: Tolerance, ax: Axes | None = None) -> Axes:
    """The permissible unbalance of the planes and bearings in their order, or of the whole, g·mm."""
    ends = () if t.bearing_limits is None else t.bearing_limits
    limits = dict(zip(_places(t), [*t.limits, *ends], strict=False))
    ax, _ = _bars(ax, limits or {("whole", "rotor"): t.total}, _GRAM_MM, t)
    title = f"G{t.grade:g}, whole rotor: {figures(t.total * _GRAM_MM)} g·mm"
    ax.set(ylabel="permissible residual unbalance, g·mm", title=title)
    return ax


def draw_verdict(v: Verdict, ax: Axes | None = None, t: Tolerance | None = None) -> Axes:
    """The residual unbalance of each plane, its 95 % and its limit, on a logarithmic scale.

    Hollow where it is not decidable, a square where it fails.

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
    sizes = [size * scale for row in rows.values() for size in (row.low or row.size, row.limit) if size > 0]
    top = max(sizes)
    bottom = float(10 ** np.floor(np.log10(np.clip(0.3 * min(sizes), 1e-5 * top, 0.1 * top))))
    for x, row in enumerate(rows[place] for place in order):
        size, angle = (float(value) for value in v.labels.weight(row.value))
        at, text = (x - 0.3, max(size, bottom)), f"{figures(size, 2)} at {angle:.0f}°"
        if row.low is not None and row.high is not None:
            ax.vlines(at[0], max(row.low * scale, bottom), row.high * scale, color="black", label="95 %")
            # where 0 is within, the angle is not known either
            text = text if row.low else f"up to {figures(row.high * scale, 2)}"
        mark = "s" if row.verdict == "fail" else "o"
        face = "white" if row.verdict == "not decidable" else BLUE
        ax.plot(*at, mark, color="black", mfc=face, clip_on=False, label="residual unbalance")
        note(ax, f"{text}\n{row.verdict}", at, (8, 3))
    name = f"residual unbalance, {v.labels.weight_in} (log scale)"
    title = f"Residual unbalance and tolerance ({v.source}): {v.overall}"
    ax.set(yscale="log", ylim=(bottom, 4 * top), ylabel=name, title=title)
    ax.yaxis.set_major_formatter("{x:g}")
    return ax


def _places(t: Tolerance) -> list[Place]:
    return [*(("plane", name) for name in t.planes), ("bearing", "A"), ("bearing", "B")]


def _bars(
    ax: Axes | None, limits: Mapping[Place, float], scale: float, t: Tolerance | None
) -> tuple[Axes, list[Place]]:
    """A bar for each limit, in the order along the shaft where it is known; that order."""
    at: dict[Place, float] = {}
    if t is not None and t.positions is not None and t.bearings is not None:
        at = dict(zip(_places(t), [*t.positions, *t.bearings], strict=True))
    ax, order = ax or new_figure(4.2).add_subplot(), sorted(limits, key=lambda place: at.get(place, 0.0))
    names = [" ".join(place) + (f"\n{at[place] * 1e3:.6g} mm" if at else "") for place in order]
    sizes = [limits[place] * scale for place in order]
    bars = ax.bar(names, sizes, color="0.93", edgecolor="black", label="permissible")
    ax.bar_label(bars, [figures(size) for size in sizes], fontsize=TEXT)
    plain(ax)
    ax.set_xlabel("along the shaft, not to scale", fontsize=TEXT)
    return ax, order


def draw_unbalance(found: Unbalance, ax: Axes | None = None) -> Axes:
    """Draw the vector of each station with its 95 % region where it is determined; else grey.

    All have the scale of the vertical axis, 0° is to the right, and the rotor is seen from the end from which
    it turns counter-clockwise, or from the one that the job states.
    """
    labels, Q = found.labels, len(found.stations)
    sizes, angles = labels.weight(found.unbalance)
    longest = float(sizes.max()) or 1.0
    places = np.arange(Q) * _APART * longest * min(1.0, _ROUND / Q)
    ax = ax or new_figure(min(2.0 + 7.0 / Q, 5.0)).add_subplot()
    ax.axhline(0, color="0.8", lw=4, zorder=0)
    tips = on_paper(labels, found.unbalance * labels.weight_scale)
    look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.004}
    ax.quiver(places, 0 * places, tips.real, tips.imag, color=np.where(found.determined, BLUE, "0.6"), **look)
    for q in np.flatnonzero(found.determined & np.isfinite(found.covariance).all()):
        block = found.covariance[2 * q : 2 * q + 2, 2 * q : 2 * q + 2]
        edge = on_paper(labels, region_edge(found.unbalance[q], block, 91) * labels.weight_scale)
        ax.plot(places[q] + edge.real, edge.imag, color="black", lw=1)
    title = "blue: determined, with 95 % regions; grey: not determined by the readings"
    ax.set_title(title, fontsize=TEXT)
    plain(ax)
    ends = -_APART / 2 * longest, places[-1] + _APART / 2 * longest
    ax.set(aspect="equal", xlim=ends, ylim=(-1.15 * longest, 1.15 * longest))
    ax.set_ylabel(f"unbalance, {labels.weight_in}")
    ax.set_xlabel(f"stations in their order, {labels.weight_in}; {turning(labels)}", fontsize=TEXT)
    between, each = "\n" if Q <= _ROUND else "  ", zip(found.stations, sizes, angles, strict=True)
    words = [between.join((name, figures(size, 3), f"{angle:.0f}°")) for name, size, angle in each]
    ax.set_xticks(places, words, rotation=90 * (Q > _ROUND))
    return ax
