"""Polar pictures: what they share, the readings of trial runs, and trial weights.

In every polar picture of weights the rotor turns counter-clockwise, or as the job says it turns seen from the
stated end; angles are written as the job counts them, so with "against rotation" (or lag phases) the numbers
run clockwise and the picture stays the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from balancing.conventions import Labels
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import COLORS, MARKERS, TEXT, legend_below, new_figure
from rotorid.base.text import cut

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

    from balancing.trial_weight import TrialWeight
    from balancing.without_phase import WithoutPhase

Shown = Callable[[ArrayLike], tuple[FloatArray, FloatArray]]
"""`Labels.weight` or `Labels.vibration`: size and angle in degrees as the job writes them."""


def polar_axes(ax: Axes | None, sign: int, title: str) -> PolarAxes:
    """The axes, or those of a new figure: angles grow counter-clockwise where `sign` is +1.

    Raises
    ------
    ValueError
        For axes that are not polar.
    """
    from matplotlib.ticker import MaxNLocator

    ax = ax or new_figure(5, 5).add_subplot(projection="polar")
    if ax.name != "polar":
        raise ValueError("vectors are drawn in polar axes: make them with projection='polar'")
    polar = cast("PolarAxes", ax)
    polar.set_theta_direction(1 if sign > 0 else -1)
    polar.tick_params(labelsize=TEXT, pad=0)
    polar.yaxis.set_major_locator(MaxNLocator(4, prune="both"))
    polar.set_title(title, fontsize="medium", pad=10)
    return polar


def draw_line(polar: PolarAxes, shown: Shown, vectors: ArrayLike, style: str = "", **look: Any) -> None:  # noqa: ANN401
    """A line through the tips of vectors, with a mark at the last where the style has one."""
    size, angle = shown(vectors)
    polar.plot(np.unwrap(np.deg2rad(angle)), size, style, markevery=[-1], **look)


def of_plane(p: int) -> dict[str, Any]:
    """Colour and marker of a plane."""
    return {"color": COLORS[p % len(COLORS)], "marker": MARKERS[p % len(MARKERS)]}


def from_zero(polar: PolarAxes, shown: Shown, vectors: ArrayLike, most: float = np.inf) -> None:
    """Radii from 0 (to `most` at most), their numbers farthest from the vectors."""
    angles = np.sort(shown(np.atleast_1d(vectors))[1])
    gaps = np.diff([*angles, angles[0] + 360.0])
    polar.set_rlabel_position(float(angles[gaps.argmax()] + 0.45 * gaps.max()))  # beside the grid's lines
    polar.set_rlim(0, min(1.05 * polar.get_rmax(), most), auto=True)


def turning(labels: Labels) -> str:
    """How angles count and how the rotor turns in the picture."""
    return f"{labels.turning_in_words()} ({turn_sign(labels)})"


def turn_sign(labels: Labels) -> str:
    """An arrow that turns as the rotor does in the picture."""
    return "↺" if labels.drawn_sign > 0 else "↻"


def on_paper(labels: Labels, vectors: ArrayLike) -> ComplexArray:
    """Vectors of the rotor as they stand in the picture."""
    z = np.asarray(vectors, dtype=complex)
    return z if labels.drawn_sign > 0 else z.conj()


def unit(labels: Labels) -> str:
    """Unit of the readings, as it stands under the name of an axis, for short axes too."""
    return f",\n{labels.vibration_in}" if labels.vibration_in else ""


def solutions_figure(result: WithoutPhase) -> Figure:
    """Solutions without phase, with what the errors allow of each, and the weights of the runs."""
    labels, planes = result.labels, result.planes
    figure = new_figure(5 * len(planes), 5.4)
    for p, plane in enumerate(planes):
        ax = figure.add_subplot(1, len(planes), p + 1, projection="polar")
        polar = polar_axes(ax, labels.angles_on_paper, f"Plane {cut(plane, 24)!r}, {labels.weight_in}")
        tried = result.trials.weights[:, p]
        for k, one in enumerate(result.solutions[: len(COLORS)]):
            look, (size, angle) = of_plane(k), labels.weight(one.region[::4, p])
            polar.plot(np.deg2rad(angle), size, ".", ms=2, alpha=0.25, color=look["color"])
            name = f"solution {k + 1}: {labels.weight_at(one.weights[p])}"
            draw_line(polar, labels.weight, [0, one.weights[p]], lw=2, label=name, **look)
        size, angle = labels.weight(tried[tried != 0])
        polar.plot(np.deg2rad(angle), size, "o", mfc="white", color="black", label="weights of the runs")
        every = np.array([*tried, *(one.weights[p] for one in result.solutions)])
        from_zero(polar, labels.weight, every, 2.5 * np.abs(tried).max() * labels.weight_scale)
    words = f"dots: where the errors of the readings may put it\n{turning(labels)}"
    legend_below(figure, figure.axes, title=words)
    return figure


def trial_figure(weights: Sequence[TrialWeight]) -> Figure:
    """A new figure with every trial weight."""
    figure = new_figure(4.8, 5.2)
    polar = figure.add_subplot(projection="polar")
    for k, weight in enumerate(weights):
        draw_trial_weight(weight, polar, k)
    legend_below(figure, [polar], title=turning(weights[0].labels))
    return figure


def draw_trial_weight(t: TrialWeight, ax: Axes | None = None, k: int = 0) -> Axes:
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
    labels, weight, look = t.labels, t.amount * np.exp(1j * t.angle), of_plane(k)
    polar = polar_axes(ax, labels.angles_on_paper, f"Trial weight, {labels.weight_in}")
    draw_line(polar, labels.weight, [0, weight], lw=2, label=f"{t.plane}: {labels.weight_at(weight)}", **look)
    if t.angle_reach:
        arc = weight * np.exp(1j * np.linspace(-t.angle_reach, t.angle_reach, 91))
        name = f"the best angle is within ± {np.degrees(t.angle_reach):.0f}°"
        draw_line(polar, labels.weight, arc, color=look["color"], lw=4, alpha=0.4, label=name)
    from_zero(polar, labels.weight, weight)
    return polar
