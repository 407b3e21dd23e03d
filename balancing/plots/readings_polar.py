"""Picture of the runs of one sensor at one speed: each reading with its 95 % region, and what it changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.plots.amplitude_bars import unit
from balancing.plots.correction_polar import on_paper, polar_axes, quiet_radii
from balancing.solvers.error_propagation import region_edge
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import COLORS, MARKERS, QUIET, TEXT
from rotorid.base.text import cut, figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.data.trials import Trials


def readings(
    trials: Trials, covariance: FloatArray, first: str | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the readings of one sensor at one speed in polar axes.

    Parameters
    ----------
    trials
        Runs at one speed by one sensor.
    covariance
        Of their means, shape (R, 1, 1, 2, 2).
    first
        The baseline, from whose tip a dotted line goes to each other run; None: there is none yet.
    ax
        Polar axes; None: of a new figure.

    Raises
    ------
    ValueError
        For axes that are not polar.
    """
    polar = polar_axes(ax, trials.labels.phases_on_paper, "readings", 4.4)
    values, labels = trials.mean[:, 0, 0], trials.labels
    edges = region_edge(values, covariance[:, 0, 0], None, 120)
    start = None if first is None else values[trials.runs.index(first)]
    angles, sizes = labels.vibration(values)[1], labels.vibration(values)[0]
    for r, run in enumerate(trials.runs):
        color, marker = (
            ("0.35", "s") if run == first else (COLORS[r % len(COLORS)], MARKERS[r % len(MARKERS)])
        )
        label = f"{cut(run, 24)}: {figures(sizes[r])} at {angles[r]:.0f}°"
        tip = on_paper(labels.vibration, np.array([0, values[r]]))
        polar.plot(tip[0][[1, 1]], tip[1], color=color, marker=marker, markevery=[1], ms=6, lw=2, label=label)
        polar.plot(*on_paper(labels.vibration, edges[r]), color=color, lw=1)
        if start is not None and run != first:
            change = on_paper(labels.vibration, np.array([start, values[r]]))
            polar.plot(*change, color=color, lw=1.2, ls=":")
    polar.set_rlim(0, 1.12 * float(np.abs(edges).max()) * labels.vibration_scale or 1.0)
    quiet_radii(polar, angles, sizes)
    where = f"{trials.sensors[0]} at {labels.speed_words(float(trials.speeds[0]))}{unit(labels)}"
    polar.set_title(f"{where}\nphase as {labels.phase}", fontsize="medium", pad=10)
    polar.plot([], [], color=QUIET, lw=1, label="closed lines: 95 % of one reading")
    polar.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), fontsize=TEXT, frameon=False, ncols=2)
    return polar
