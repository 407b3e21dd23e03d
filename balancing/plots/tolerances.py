"""Polar pictures of tolerances, of residual unbalances in them, and of a trial weight.

Nothing is ever shown or saved here. The rotor turns counter-clockwise, or as the
job says; angles are written as the job counts them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.plots.correction_polar import MARKERS, corrections, polar_axes
from rotorid.base.plot_style import COLORS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

    from balancing.correction.correction_result import Correction
    from balancing.correction.verdict import Verdict
    from balancing.iso21940 import Tolerance
    from balancing.trial_weight_result import TrialWeight

_GRAM_MM = 1e6


def polar_figure(draw: Callable[[Axes], object]) -> Figure:
    """A new figure with one polar picture."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 6), layout="constrained")
    draw(figure.add_subplot(projection="polar"))
    return figure


def overview(c: Correction, v: Verdict) -> Figure:
    """A new figure: corrections, and residual unbalance inside or outside its tolerance circles."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7.5), layout="constrained")
    corrections(c, figure.add_subplot(1, 2, 1, projection="polar"))
    residuals(v, figure.add_subplot(1, 2, 2, projection="polar"))
    return figure


def tolerance_circles(t: Tolerance, ax: Axes | None = None) -> Axes:
    """Circles of the permissible residual unbalance of each plane (without planes: of the rotor), g·mm."""
    polar = polar_axes(ax, 1, "tolerance circles", 6)
    circles = dict(zip(t.planes, t.limits * _GRAM_MM, strict=True)) or {"whole rotor": t.total * _GRAM_MM}
    for k, (name, limit) in enumerate(circles.items()):
        _circle(polar, float(limit), k, f"{name}: {limit:.4g} g·mm")
    polar.set_rlim(0, 1.15 * max(circles.values()))
    polar.set_title(f"Permissible residual unbalance, G{t.grade:g}", fontsize="medium", pad=14)
    _legend(polar)
    return polar


def residuals(v: Verdict, ax: Axes | None = None) -> Axes:
    """Residual unbalance of each plane with its 95 % region, inside or outside its tolerance circle.

    Raises
    ------
    ValueError
        For a verdict without planes.
    """
    rows = [row for row in v.rows if row.kind == "plane"]
    if not rows:
        raise ValueError("this verdict has no planes to draw: give a tolerance")
    polar = polar_axes(ax, v.labels.angles_on_paper, "tolerance circles", 6)
    scale = v.labels.weight_scale
    largest = max(max(row.limit, row.size) for row in rows) * scale
    for k, row in enumerate(rows):
        colour = COLORS[k % len(COLORS)]
        size, angle = v.labels.weight(row.value)
        _circle(polar, row.limit * scale, k, f"{row.name}: {row.verdict}")
        polar.plot([np.deg2rad(float(angle))], [float(size)], MARKERS[k % len(MARKERS)], color=colour)
        if row.region is not None:
            reach, around = v.labels.weight(row.region)
            polar.plot(np.unwrap(np.deg2rad(around)), reach, color=colour, lw=1.0)
    polar.set_rlim(0, 1.4 * largest)
    polar.set_title(f"Residual unbalance and tolerance, {v.labels.weight_in}", fontsize="medium", pad=14)
    _legend(polar)
    return polar


def trial_figure(found: Sequence[TrialWeight]) -> Figure:
    """A new figure with `trial_arrow` of each."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5 * len(found), 5.5), layout="constrained")
    for k, one in enumerate(found, start=1):
        trial_arrow(one, figure.add_subplot(1, len(found), k, projection="polar"))
    return figure


def trial_arrow(t: TrialWeight, ax: Axes | None = None) -> Axes:
    """The trial weight as an arrow, and an arc of the angles among which the best one is.

    Raises
    ------
    ValueError
        For a trial weight without an angle.
    """
    if t.angle is None:
        raise ValueError(
            "this trial weight has no angle to draw: give the phase of the initial reading and the lag"
        )
    polar = polar_axes(ax, t.labels.angles_on_paper, "tolerance circles", 6)
    size, angle = t.labels.weight(t.amount * np.exp(1j * t.angle))
    theta, radius = np.deg2rad(float(angle)), float(size)
    polar.plot([theta, theta], [0, radius], color=COLORS[0], lw=2.2)
    label = f"{t.plane}: {radius:.4g} {t.labels.weight_in} at {float(angle):.0f}°"
    polar.plot([theta], [radius], MARKERS[0], color=COLORS[0], label=label)
    if t.angle_reach:
        arc = theta + np.linspace(-t.angle_reach, t.angle_reach, 91)
        polar.plot(arc, np.full_like(arc, radius), color=COLORS[0], lw=4.0, alpha=0.4)
    polar.set_rlim(0, 1.2 * radius)
    polar.set_title(
        f"Trial weight, {t.labels.weight_in}, angles {t.labels.angle_words}", fontsize="medium", pad=14
    )
    _legend(polar)
    return polar


def _circle(polar: PolarAxes, limit: float, k: int, label: str) -> None:
    turn = np.linspace(0.0, 2 * np.pi, 361)
    style = ("-", "--", ":")[k % 3]
    polar.plot(turn, np.full_like(turn, limit), ls=style, lw=1.4, color=COLORS[k % len(COLORS)], label=label)


def _legend(polar: PolarAxes) -> None:
    polar.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), fontsize="small", ncols=2)
