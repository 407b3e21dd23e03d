"""Polar pictures of a correction: vibration before and after, weights. Nothing is ever shown or saved here.

In every polar picture of weights the rotor turns counter-clockwise, or as the job says it turns seen from the
stated end; angles are written as the job counts them, so with "against rotation" (or lag phases) the numbers
run clockwise and the picture stays the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import COLORS, VERMILION
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.projections.polar import PolarAxes

    from balancing.correction.correction_result import Correction


# Okabe and Ito: told apart with every kind of colour vision
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
SPEEDS_SHOWN = 6


def draw_correction(c: Correction, ax: Axes | None = None) -> Figure | Axes:
    """Draw the corrections and the vibration before and after.

    Parameters
    ----------
    c
        The correction.
    ax
        None: a new figure with all pictures. Polar axes: the corrections only. Other axes: the amplitudes
        before and after only.

    Returns
    -------
    The new figure, or `ax`.
    """
    if ax is None:
        return overview(c)
    return corrections(c, ax) if ax.name == "polar" else amplitudes(c, ax)


def overview(c: Correction) -> Figure:
    """A new figure: corrections, vibration vectors at each speed, and amplitudes before and after."""
    from matplotlib.figure import Figure

    S = min(len(c.speeds), SPEEDS_SHOWN)
    columns = min(S, 3)
    width = max(columns, 2)
    rows = -(-S // columns)
    fig = Figure(figsize=(4.0 * width, 4.6 + 4.0 * rows), layout="constrained")
    top, vectors = cast("list[SubFigure]", fig.subfigures(2, 1, height_ratios=[4.6, 4.0 * rows]))
    grid = top.add_gridspec(1, 2, width_ratios=[1, max(width - 1, 1.2)])
    corrections(c, top.add_subplot(grid[0], projection="polar"))
    amplitudes(c, top.add_subplot(grid[1]))
    # the largest ones, where there are more speeds than room
    largest = np.sort(np.argsort(-np.abs(c.before).max(axis=1), kind="stable")[:S])
    for place, s in enumerate(largest):
        ax = vectors.add_subplot(rows, columns, place + 1, projection="polar")
        vibration(c, int(s), ax, legend=False)
    handles, names = vectors.axes[0].get_legend_handles_labels()
    vectors.legend(
        handles, names, loc="outside lower center", ncols=min(len(names), 2 * columns), fontsize="small"
    )
    title = f"Vibration before (open) and predicted after (filled){_unit(c)}, phase as {c.labels.phase}"
    vectors.suptitle(title, fontsize="medium")
    return fig


def corrections(c: Correction, ax: Axes | None = None) -> Axes:
    """Polar picture of the correction weights, one arrow per plane, with 95 % regions and largest weights."""
    polar = polar_axes(ax, c.labels.angles_on_paper, "vectors")
    mass, angle = c.labels.weight(c.weights)
    regions = _regions(c)
    for p, plane in enumerate(c.planes):
        _arrow(polar, np.deg2rad(angle[p]), mass[p], COLORS[p % len(COLORS)], MARKERS[p % len(MARKERS)])
        label = f"{plane}: {figures(mass[p])} {c.labels.weight_in} at {angle[p]:.1f}°"
        polar.plot([], [], color=COLORS[p % len(COLORS)], marker=MARKERS[p % len(MARKERS)], label=label)
        if regions is not None:
            size, around = c.labels.weight(regions[p])
            colour = COLORS[p % len(COLORS)]
            polar.plot(np.unwrap(np.deg2rad(around)), size, color=colour, lw=1.0, zorder=2)
    largest = max(float(mass.max()), np.finfo(float).tiny)
    if regions is not None:
        # a region far larger than the weights would hide them: it may leave the picture
        reach = float(np.abs(regions).max()) * c.labels.weight_scale
        largest = max(largest, min(reach, 2.5 * largest))
    _largest_weights(polar, c, largest)
    polar.set_rlim(0, 1.15 * largest)
    _quiet_radii(polar, angle, mass)
    polar.set_title(f"Correction weights on the bare rotor, {c.labels.weight_in}", fontsize="medium", pad=14)
    polar.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.08),
        fontsize="small",
        title=_legend_words(c, regions),
        title_fontsize="small",
    )
    return polar


def _regions(c: Correction) -> ComplexArray | None:
    """Boundary (P, n) of the 95 % region of each weight; None where errors are unknown."""
    from balancing.solvers.error_propagation import region_edge

    covariance = c.plane_covariance
    return None if covariance is None else region_edge(c.weights, covariance, c.dof, 180)


def _largest_weights(polar: PolarAxes, c: Correction, reach: float) -> None:
    """Dashed circles of the largest weights, and arcs where nothing can be mounted."""
    if c.limits is None:
        return
    for p, arcs in enumerate(c.limits.forbidden):
        for start, width in arcs:
            along = c.labels.weight(np.exp(1j * np.linspace(start, start + width, 91)))[1]
            polar.plot(
                np.unwrap(np.deg2rad(along)),
                np.full(91, (1.03 + 0.03 * p) * reach),
                color=COLORS[p % len(COLORS)],
                lw=4.0,
                alpha=0.45,
                solid_capstyle="butt",
            )
    turn = np.linspace(0.0, 2 * np.pi, 181)
    for p, limit in enumerate(c.limits.max_weight * c.labels.weight_scale):
        if np.isfinite(limit):
            polar.plot(turn, np.full_like(turn, limit), ls="--", lw=0.9, color=COLORS[p % len(COLORS)])


def _legend_words(c: Correction, regions: ComplexArray | None) -> str:
    """What the lines of the polar picture mean."""
    words = [f"{c.labels.turning_in_words()} ({'↺' if c.labels.drawn_sign > 0 else '↻'})"]
    if regions is not None:
        words.append("closed lines: 95 % regions")
    if c.limits is not None and np.isfinite(c.limits.max_weight).any():
        words.append("dashed: largest weights")
    if c.limits is not None and any(c.limits.forbidden):
        words.append("thick arcs: nothing can be mounted")
    return "\n".join(words)


def vibration(c: Correction, speed: int = 0, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Polar picture of the vibration vectors at one speed (index), before and after, one per sensor."""
    polar = polar_axes(ax, c.labels.phases_on_paper, "vectors")
    old, old_phase = (v[speed] for v in c.labels.vibration(c.before))
    new, new_phase = (v[speed] for v in c.labels.vibration(c.after))
    for k, sensor in enumerate(c.sensors):
        colour, marker = COLORS[k % len(COLORS)], MARKERS[(k + k // len(COLORS)) % len(MARKERS)]
        polar.plot(
            np.deg2rad([old_phase[k], new_phase[k]]), [old[k], new[k]], color=colour, lw=0.8, ls=":", zorder=2
        )
        polar.plot(np.deg2rad(old_phase[k]), old[k], marker, mec=colour, mfc="white", mew=1.6, ms=8, zorder=3)
        polar.plot(np.deg2rad(new_phase[k]), new[k], marker, color=colour, ms=5, zorder=4, clip_on=False)
        polar.plot([], [], marker=marker, color=colour, ls="none", label=sensor)
    polar.set_rlim(0, 1.15 * max(float(max(old.max(), new.max())), np.finfo(float).tiny))
    _quiet_radii(polar, old_phase, old)
    polar.set_title(rpm_text(c.speeds[speed]), fontsize="medium")
    if legend:
        polar.legend(loc="upper right", bbox_to_anchor=(0.08, 1.12), fontsize="x-small", frameon=True)
    return polar


def amplitudes(c: Correction, ax: Axes | None = None) -> Axes:
    """Amplitudes before and after for every speed and sensor, with 95 % of a check run where known."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(8, 4), layout="constrained").add_subplot()
    old, new = (np.abs(z).ravel() * c.labels.vibration_scale for z in (c.before, c.after))
    S, C = c.before.shape
    x = np.arange(S * C) + np.repeat(np.arange(S), C) * 0.8
    known = c.after_covariance is not None
    before_and_after(
        ax,
        x,
        (old, new),
        reach=c.within(c.after_covariance) if known else None,
        limit=None if c.limits is None else c.limits.residual.ravel() * c.labels.vibration_scale,
        after="predicted after, 95 % of a check run" if known else "predicted after",
    )
    ax.set_ylim(bottom=0)
    ax.margins(x=0.01)
    _name_bars(ax, c, x)
    ax.set_ylabel(f"amplitude{_unit(c)}")
    ax.set_title("Vibration before and after", fontsize="medium")
    ax.legend(fontsize="small", loc="upper left", bbox_to_anchor=(0, -0.22), ncols=2, frameon=False)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def before_and_after(
    ax: Axes,
    at: FloatArray,
    sizes: tuple[FloatArray, FloatArray],
    *,
    reach: FloatArray | None,
    limit: FloatArray | None,
    after: str,
    lying: bool = False,
    colors: tuple[str, str] = (COLORS[0], VERMILION),
) -> None:
    """Draw amplitudes before (bars) and after (dots with 95 %), and their limits (thick lines).

    Parameters
    ----------
    ax
        Along whose x (`lying`: y) the readings stand.
    at
        Place of each reading, (N,).
    sizes
        Before and after, (N,) each. Where some are far smaller than others, the scale is linear up to the
        small ones and logarithmic from there.
    reach
        Half widths of 95 % intervals, (N,); None: not known.
    limit
        Largest amplitude of each reading, (N,), not finite for none; None: none has one.
    after
        What the dots are, in words.
    lying
        Whether the bars lie.
    colors
        Of the dots and of the limits.
    """
    old, new = sizes
    axis = ax.xaxis if lying else ax.yaxis
    (ax.barh if lying else ax.bar)(at, old, 0.8, color="0.86", edgecolor="0.5", lw=0.6, label="before")
    there = np.zeros(0, dtype=int) if limit is None else np.flatnonzero(np.isfinite(limit))
    if limit is not None and there.size:
        lines = ax.vlines if lying else ax.hlines
        lines(limit[there], at[there] - 0.45, at[there] + 0.45, color=colors[1], lw=2.2, label="limit")
    error = None if reach is None else [np.minimum(reach, new), reach]
    places: dict[str, Any] = (
        {"x": new, "y": at, "xerr": error} if lying else {"x": at, "y": new, "yerr": error}
    )
    ax.errorbar(**places, fmt="o", ms=4, color=colors[0], capsize=2, lw=1.2, label=after)
    top = float(max(old.max(), new.max()))
    if top > 0 and min(new.min(), old[old > 0].min(initial=top)) < top / 20:
        linear = 10.0 ** np.floor(np.log10(max(float(new.min()), top / 300)))
        (ax.set_xscale if lying else ax.set_yscale)("symlog", linthresh=linear)
        axis.set_major_formatter("{x:g}")


def _name_bars(ax: Axes, c: Correction, x: FloatArray) -> None:
    """Sensors under their bars (where they fit) and speeds under each group."""
    S, C = c.before.shape
    if S * C <= 40:
        long = max(map(len, c.sensors)) > 3 or S * C > 24
        ax.set_xticks(x, list(c.sensors) * S, rotation=90 if long else 0, fontsize="x-small")
    else:
        ax.set_xticks([])
    middle = x.reshape(S, C).mean(axis=1)
    every = -(-S // 12)
    upper = ax.secondary_xaxis("top")
    upper.set_xticks(middle[::every], [f"{v * RPM:.5g}" for v in c.speeds[::every]], fontsize="small")
    upper.tick_params(length=0)
    upper.set_xlabel("speed, rpm", fontsize="small")
    upper.spines["top"].set_visible(False)


def polar_axes(ax: Axes | None, sign: int, what: str, height: float = 5) -> PolarAxes:
    """The axes, or those of a new figure: angles grow counter-clockwise where `sign` is +1.

    Raises
    ------
    ValueError
        For axes that are not polar; begins with `what` is drawn.
    """
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(5, height), layout="constrained").add_subplot(projection="polar")
    if ax.name != "polar":
        raise ValueError(f"{what} are drawn in polar axes: make them with projection='polar'")
    polar = cast("PolarAxes", ax)
    polar.set_theta_zero_location("E")
    polar.set_theta_direction(1 if sign > 0 else -1)
    polar.tick_params(labelsize="small")
    polar.grid(color="#CCCCCC", lw=0.6)
    return polar


def _arrow(ax: PolarAxes, theta: float, radius: float, colour: str, marker: str) -> None:
    ax.plot([theta, theta], [0, radius], color=colour, lw=2.2, solid_capstyle="round", zorder=3)
    ax.plot(theta, radius, marker, color=colour, ms=8, zorder=4)


def _quiet_radii(ax: PolarAxes, angle: FloatArray, size: FloatArray) -> None:
    """Put the numbers of the radii where no vector of note points."""
    from matplotlib.ticker import MaxNLocator

    ax.yaxis.set_major_locator(MaxNLocator(4, prune="lower"))
    candidates = np.arange(15, 360, 30)
    busy = angle[size > 0.05 * max(float(size.max()), np.finfo(float).tiny)]
    if busy.size:
        gap = np.abs((candidates[:, None] - busy + 180) % 360 - 180).min(axis=1)
        ax.set_rlabel_position(float(candidates[int(np.argmax(gap))]))


def _unit(c: Correction) -> str:
    return f", {c.labels.vibration_in}" if c.labels.vibration_in else ""
