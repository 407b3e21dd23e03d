"""Pictures of tolerances, of residual unbalances within them, and of trial weights.

Nothing is ever shown or saved here. Planes and bearings stand in their order along the shaft. In polar
pictures the rotor turns counter-clockwise, or as the job says; angles are written as the job counts them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.plots.correction_polar import of_plane, polar_axes, turning
from rotorid.base.plot_style import COLORS, MARKERS, TEXT, legend_below, new_figure, note, plain
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.correction.limit_check import Judgement
    from balancing.correction.verdict import Verdict
    from balancing.iso21940 import Tolerance
    from balancing.trial_weight_result import TrialWeight

_GRAM_MM = 1e6


def tolerance_line(t: Tolerance, ax: Axes | None = None) -> Axes:
    """The rotor with the permissible unbalance of its planes and bearings, or of the whole, g·mm."""
    ends: Sequence[float] = () if t.bearing_limits is None else t.bearing_limits.tolist()
    limits = {("plane", name): float(u) for name, u in zip(t.planes, t.limits, strict=True)}
    limits |= {("bearing", name): u for name, u in zip("AB", ends, strict=False)}
    limits = limits or {("whole", "rotor"): t.total}
    ax = _rotor(ax, {key: u * _GRAM_MM for key, u in limits.items()}, t)
    ax.set_ylabel("permissible residual unbalance, g·mm")
    ax.set_title(f"G{t.grade:g}, whole rotor: {figures(t.total * _GRAM_MM)} g·mm", fontsize="medium")
    return ax


def residuals(v: Verdict, ax: Axes | None = None, t: Tolerance | None = None) -> Axes:
    """The rotor with the residual unbalance of each plane, its 95 % and its limit, on a logarithmic scale.

    Raises
    ------
    ValueError
        For a verdict without planes.
    """
    scale, kinds = v.labels.weight_scale, ("plane", "bearing") if v.labels.unbalances else ("plane",)
    rows = {(str(row.kind), row.name): row for row in v.rows if row.kind in kinds}
    if not any(kind == "plane" for kind, _ in rows):
        raise ValueError("this verdict has no planes to draw: give a tolerance")
    ax = _rotor(ax, {key: row.limit * scale for key, row in rows.items()}, t)
    sizes = [size * scale for row in rows.values() for size in (row.low or row.size, row.limit) if size > 0]
    bottom = float(10 ** np.floor(np.log10(max(0.7 * min(sizes), 1e-5 * max(sizes)))))
    for at, key in enumerate(sorted(rows, key=lambda key: _position(key, t))):
        _residual(ax, at, rows[key], v, bottom)
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_ylim(bottom, 4 * max(sizes))
    ax.set_ylabel(f"residual unbalance, {v.labels.weight_in} (log scale)")
    ax.set_title(f"Residual unbalance and tolerance ({v.source}): {v.overall}", fontsize="medium")
    return ax


def _residual(ax: Axes, at: int, row: Judgement, v: Verdict, bottom: float) -> None:
    """One residual with its 95 % and its verdict: hollow where not decidable, square where it fails."""
    size, angle = (float(value) for value in v.labels.weight(row.value))
    if row.low is not None and row.high is not None:
        ends = np.maximum(np.array([row.low, row.high]) * v.labels.weight_scale, bottom)
        ax.vlines(at - 0.3, *ends, color="black", lw=1.4, label="95 %")
    failed = int(row.verdict == "fail")
    face = "white" if row.verdict == "not decidable" else COLORS[failed]
    look: dict[str, Any] = {"color": COLORS[failed], "mfc": face, "ms": 6, "label": "residual unbalance"}
    ax.plot(at - 0.3, max(size, bottom), MARKERS[failed], **look)
    text = f"{figures(size, 2)} at {angle:.0f}°"
    if row.low == 0 and row.high is not None:  # then the angle is not known either
        text = f"up to {figures(row.high * v.labels.weight_scale, 2)}"
    note(ax, f"{text}\n{row.verdict}", (at - 0.3, max(size, bottom)), (8, -2), va="bottom")


def _position(key: tuple[str, str], t: Tolerance | None) -> float:
    """Of a plane or bearing along the shaft, m; 0: not known."""
    kind, name = key
    if t is None or t.positions is None or t.bearings is None:
        return 0.0
    return float(t.bearings["AB".index(name)] if kind == "bearing" else t.positions[t.planes.index(name)])


def _rotor(ax: Axes | None, limits: Mapping[tuple[str, str], float], t: Tolerance | None) -> Axes:
    """The shaft with its planes and bearings (kind and name) in their order, and a bar for each limit."""
    ax = ax or new_figure(4.2).add_subplot()
    order = sorted(limits, key=lambda key: _position(key, t))
    x, shaft = np.arange(len(order)), ax.get_xaxis_transform()
    ax.bar(x, [limits[key] for key in order], 0.84, color="0.93", edgecolor="black", label="permissible")
    ax.plot([-0.6, len(order) - 0.4], [-0.08] * 2, color="0.6", lw=5, transform=shaft, clip_on=False)
    symbols: dict[str, dict[str, Any]] = {
        "bearing": {"marker": "^", "ms": 12, "y": -0.125},
        "plane": {"marker": "s", "ms": 15, "y": -0.08},
    }
    names = []
    for at, key in enumerate(order):
        note(ax, figures(limits[key]), (at, limits[key]), (0, 3), ha="center")
        look = dict(symbols.get(key[0], symbols["plane"]))
        y = look.pop("y")
        ax.plot(at, y, **look, mfc="0.9", mec="black", transform=shaft, clip_on=False)
        known = t is not None and t.positions is not None and t.bearings is not None
        names.append(f"{' '.join(key)}\n{_position(key, t) * 1e3:.6g} mm" if known else " ".join(key))
    ax.set_xticks(x, names, fontsize=TEXT)
    ax.tick_params(axis="x", length=0, pad=36)
    ax.set_xlabel("along the shaft, not to scale", fontsize=TEXT)
    ax.set_xlim(-0.6, len(order) - 0.4)
    plain(ax)
    ax.grid(visible=False, axis="x")
    return ax


def trial_figure(found: Sequence[TrialWeight]) -> Figure:
    """A new figure with every trial weight."""
    figure = new_figure(4.8, 5.2)
    polar = figure.add_subplot(projection="polar")
    for k, one in enumerate(found):
        trial_arrow(one, polar, k)
    legend_below(figure, [polar], title=turning(found[0].labels))
    return figure


def trial_arrow(t: TrialWeight, ax: Axes | None = None, k: int = 0) -> Axes:
    """The trial weight as arrow k, and an arc of the angles among which the best one is.

    Raises
    ------
    ValueError
        For a trial weight without an angle.
    """
    if t.angle is None:
        raise ValueError(
            "this trial weight has no angle to draw: give the phase of the initial reading and the lag"
        )
    polar = polar_axes(ax, t.labels.angles_on_paper, "trial weights", 6)
    size, angle = t.labels.weight(t.amount * np.exp(1j * t.angle))
    theta, radius = np.deg2rad(float(angle)), float(size)
    label = f"{t.plane}: {radius:.4g} {t.labels.weight_in} at {float(angle):.0f}°"
    polar.plot([theta, theta], [0, radius], **of_plane(k), lw=2.2, markevery=[1], ms=7, label=label)
    if t.angle_reach:
        arc = theta + np.linspace(-t.angle_reach, t.angle_reach, 91)
        reach = f"the best angle is within ± {np.degrees(t.angle_reach):.0f}°"
        polar.plot(
            arc, np.full_like(arc, radius), color=COLORS[k % len(COLORS)], lw=4.0, alpha=0.4, label=reach
        )
    polar.set_rlim(0, max(polar.get_rmax() if k else 0.0, 1.2 * radius))
    polar.set_title(f"Trial weight, {t.labels.weight_in}", fontsize="medium", pad=10)
    return polar
