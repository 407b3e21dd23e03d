"""Pictures of a correction: weights, and vibration before and after. Nothing is ever shown or saved here.

In every polar picture of weights the rotor turns counter-clockwise, or as the job says it turns seen from the
stated end; angles are written as the job counts them, so with "against rotation" (or lag phases) the numbers
run clockwise and the picture stays the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from balancing.data.result_columns import rms
from balancing.plots.amplitude_bars import amplitudes, left_is_small, sizes_of, unit
from balancing.solvers.error_propagation import region_edge
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import COLORS, MARKERS, QUIET, STYLES, TEXT, legend_below, new_figure
from rotorid.base.text import capital, cut, figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

    from balancing.correction.check_run_result import CheckComparison
    from balancing.correction.correction_result import Correction
    from balancing.data.conventions import Labels
    from balancing.data.trials import Trials

_NAME = 24
"""Letters of a name in the legend."""
_NOTHING = 1e-9
"""Share of the vibration before that is nothing to a reader."""


def draw_correction(c: Correction, ax: Axes | None = None) -> Figure | Axes:
    """A new figure with all pictures; on polar axes the weights, on others the amplitudes."""
    if ax is None:
        return overview(c)
    drawn = corrections(c, ax) if ax.name == "polar" else amplitudes(c, ax)
    below = (0.5, -0.08) if ax.name == "polar" else (0.5, -0.3)
    drawn.legend(loc="upper center", bbox_to_anchor=below, fontsize=TEXT, title=turning(c.labels))
    return drawn


def overview(
    c: Correction,
    trials: Trials | None = None,
    check: CheckComparison | None = None,
    below: Callable[[Axes], object] | None = None,
) -> Figure:
    """A new figure: weights, what they do to the largest reading, and all amplitudes before and after.

    The runs show trial weights and what they did, a check run what was achieved; `below` draws something else
    than the amplitudes.
    """
    fig = new_figure(8.6)
    grid = fig.add_gridspec(3, 2, height_ratios=[1.45, 1, 0.8])
    left = corrections(c, fig.add_subplot(grid[0, 0], projection="polar"), trials)
    right = vectors(c, fig.add_subplot(grid[0, 1], projection="polar"), trials)
    closely = below is None and left_is_small(*sizes_of(c, check))
    lower = fig.add_subplot(grid[1, :] if closely else grid[1:, :])
    if below is None:
        amplitudes(c, lower, check, fig.add_subplot(grid[2, :], sharex=lower) if closely else None)
    else:
        below(lower)
    legend_below(fig, (left, right, lower), title=turning(c.labels))
    fig.suptitle(_headline(c, check), fontsize="medium", fontweight="bold")
    return fig


def corrections(c: Correction, ax: Axes | None = None, trials: Trials | None = None) -> Axes:
    """Polar picture of the correction weights with 95 % regions and largest weights; trial weights hollow."""
    polar = polar_axes(ax, c.labels.angles_on_paper, "vectors")
    regions = None
    if c.plane_covariance is not None:
        regions = region_edge(c.weights, c.plane_covariance, c.dof, 180)
    mass, angle = c.labels.weight(c.weights)
    at = c.places(c.planes, c.weights)
    for p, plane in enumerate(c.planes):
        label = f"{cut(plane, _NAME)}: {figures(mass[p])} {c.labels.weight_in} at {angle[p]:.1f}°"
        label += f", or remove at {at[p]:.1f}°" if plane in c.remove else ""
        tip = np.deg2rad([angle[p], angle[p]]), [0, mass[p]]
        polar.plot(*tip, **of_plane(p), lw=2.0, markevery=[1], ms=6, zorder=4, label=label)
        if regions is not None:
            around = on_paper(c.labels.weight, regions[p])
            polar.plot(*around, color=COLORS[p % len(COLORS)], ls=STYLES[p % len(STYLES)], lw=1.2, zorder=5)
    reach = float(mass.max()) or np.finfo(float).tiny
    for _, p, weight in _trial_runs(c, trials):
        polar.plot(*on_paper(c.labels.weight, weight), **of_plane(p), mfc="none", ls="none", ms=8, zorder=5)
        reach = max(reach, abs(weight) * c.labels.weight_scale)
    if _trial_runs(c, trials):
        polar.plot([], [], "o", color=QUIET, mfc="none", ms=8, label="hollow: trial weights, runs with them")
    if regions is not None:
        polar.plot([], [], color=QUIET, lw=1.2, label="closed lines: 95 % regions")
        # a region far larger than the weights would hide them: it may leave the picture
        reach = max(reach, min(float(np.abs(regions).max()) * c.labels.weight_scale, 2.5 * reach))
    _largest_weights(polar, c, reach)
    polar.set_rlim(0, 1.15 * reach)
    quiet_radii(polar, angle, mass)
    polar.set_title(f"Weights on the bare rotor, {c.labels.weight_in}", fontsize="medium", pad=10)
    return polar


def of_plane(p: int) -> dict[str, Any]:
    """Colour and marker of a plane."""
    return {"color": COLORS[p % len(COLORS)], "marker": MARKERS[p % len(MARKERS)]}


def on_paper(
    shown: Callable[[ComplexArray], tuple[FloatArray, FloatArray]], z: ComplexArray | complex
) -> tuple[FloatArray, FloatArray]:
    """Angles, rad, and radii of vectors as `Labels.weight` or `Labels.vibration` writes them."""
    size, angle = (np.atleast_1d(v) for v in shown(np.asarray(z)))
    return np.unwrap(np.deg2rad(angle)), size


def _trial_runs(c: Correction, trials: Trials | None) -> list[tuple[ComplexArray, int, complex]]:
    """Readings (S, C) of the runs with a weight in a plane, its index, and the weight."""
    if trials is None:
        return []
    readings = np.nanmean(trials.readings, axis=0)
    return [
        (readings[r], c.planes.index(trials.planes[k]), complex(trials.weights[r, k]))
        for r, k in np.argwhere(trials.weights)
        if trials.planes[k] in c.planes
    ]


def _largest_weights(polar: PolarAxes, c: Correction, reach: float) -> None:
    """Dashed circles of the largest weights, and arcs where nothing can be mounted."""
    if c.limits is None:
        return
    label = "thick arcs: nothing can be mounted"
    for p, arcs in enumerate(c.limits.forbidden):
        for start, width in arcs:
            along = np.exp(1j * np.linspace(start, start + width, 91))
            theta, _ = on_paper(c.labels.weight, along)
            radius = np.full(91, (1.03 + 0.03 * p) * reach)
            polar.plot(theta, radius, color=COLORS[p % len(COLORS)], lw=4, solid_capstyle="butt", label=label)
            label = "_"
    turn, label = np.linspace(0.0, 2 * np.pi, 181), "dashed: largest weights"
    for p, limit in enumerate(c.limits.max_weight * c.labels.weight_scale):
        if np.isfinite(limit):
            colour = COLORS[p % len(COLORS)]
            polar.plot(turn, np.full_like(turn, limit), ls="--", lw=0.9, color=colour, label=label)
            label = "_"


def turning(labels: Labels) -> str:
    """How angles count and how the rotor turns in the picture."""
    return f"{labels.turning_in_words()} ({'↺' if labels.drawn_sign > 0 else '↻'})"


def vectors(c: Correction, ax: Axes | None = None, trials: Trials | None = None) -> Axes:
    """Polar picture of the largest reading: before, in every run with trial weights, and predicted after."""
    polar = polar_axes(ax, c.labels.phases_on_paper, "vectors")
    s, k = np.unravel_index(int(np.argmax(np.abs(c.before))), c.before.shape)
    start = c.before[s, k]
    for readings, p, _ in _trial_runs(c, trials):
        assert trials is not None
        at = int(np.argmin(np.abs(trials.speeds - c.speeds[s]))), trials.sensors.index(c.sensors[k])
        theta, size = on_paper(c.labels.vibration, np.array([start, readings[at]]))
        polar.plot(theta, size, **of_plane(p), mfc="none", ls=":", lw=1.4, markevery=[1], ms=8, zorder=5)
    theta, size = on_paper(c.labels.vibration, np.array([0, start]))
    polar.plot(theta[[1, 1]], size, "s-", color="0.7", mec="0.3", lw=2.2, markevery=[1], ms=7, zorder=3)
    if c.after_covariance is not None:
        around = region_edge(c.after[s, k], c.after_covariance[s, k], c.dof, 180)
        polar.plot(*on_paper(c.labels.vibration, around), color="black", lw=1.0)
    polar.plot(*on_paper(c.labels.vibration, c.after[s, k]), "o", color="black", ms=5, zorder=4)
    polar.set_rlim(bottom=0)
    quiet_radii(polar, np.rad2deg(theta[1:]), size[1:])
    where = f"{c.sensors[k]} at {c.labels.speed_words(c.speeds[s])}{unit(c.labels)}"
    polar.set_title(f"{where}\nphase as {c.labels.phase}", fontsize="medium", pad=10)
    return polar


def _headline(c: Correction, check: CheckComparison | None) -> str:
    """The judgement and how much better it becomes."""
    scale, unit = c.labels.vibration_scale, c.labels.vibration_in
    values, word = [c.before, c.after], capital(c.decision.word)
    if check is not None:
        values = [check.before, check.predicted[-1], check.achieved[-1]]
        word = {True: "As predicted", False: "Not as predicted", None: "Check run"}[check.explained]
    sizes = [rms(z) * scale if rms(z) > _NOTHING * rms(c.before) else 0.0 for z in values]
    words = [f"{figures(size, 3)} {unit}".rstrip() for size in sizes]
    told = zip(words, ("before", "predicted", "achieved"), strict=False)
    return f"{word}: rms {', '.join(' '.join(pair) for pair in told)}"


def polar_axes(ax: Axes | None, sign: int, what: str, height: float = 5) -> PolarAxes:
    """The axes, or those of a new figure: angles grow counter-clockwise where `sign` is +1.

    Raises
    ------
    ValueError
        For axes that are not polar; begins with `what` is drawn.
    """
    if ax is None:
        ax = new_figure(height, 5).add_subplot(projection="polar")
    if ax.name != "polar":
        raise ValueError(f"{what} are drawn in polar axes: make them with projection='polar'")
    polar = cast("PolarAxes", ax)
    polar.set_theta_zero_location("E")
    polar.set_theta_direction(1 if sign > 0 else -1)
    polar.tick_params(labelsize=TEXT, pad=0)
    polar.grid(color="#CCCCCC", lw=0.6)
    return polar


def quiet_radii(ax: PolarAxes, angle: FloatArray, size: FloatArray) -> None:
    """Put the numbers of the radii where no vector of note points."""
    from matplotlib.ticker import MaxNLocator

    ax.yaxis.set_major_locator(MaxNLocator(4, prune="lower"))
    candidates = np.arange(15, 360, 30)
    busy = angle[size > 0.05 * max(float(size.max()), np.finfo(float).tiny)]
    if busy.size:
        gap = np.abs((candidates[:, None] - busy + 180) % 360 - 180).min(axis=1)
        ax.set_rlabel_position(float(candidates[int(np.argmax(gap))]))
