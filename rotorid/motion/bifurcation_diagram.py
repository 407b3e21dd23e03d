"""Bifurcation diagram: amplitudes over speed of stable and unstable periodic motions, bifurcations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import (
    BOX,
    COLORS,
    DARK,
    MARKERS,
    WIDTH,
    legend_above,
    new_axes,
    note,
    plain,
    rad_s_above,
)
from rotorid.base.rpm import RPM
from rotorid.motion.continuation import BRANCH, DOUBLING, FOLD, HOPF, TORUS
from rotorid.motion.periodic_table import Readings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_KINDS = (FOLD, DOUBLING, TORUS, HOPF, BRANCH)


def draw_bifurcations(readings: Readings, ax: Axes | None = None) -> Axes:
    """Draw the amplitude of the first sensor, µm, over speed, rpm.

    Stable motions are solid, unstable ones dashed; arrows show where the motion jumps at a fold.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn into.
    """
    ax = new_axes((WIDTH, 4.6)) if ax is None else ax
    colors = dict(zip(dict.fromkeys(b.kind for b in readings.motion.branches), COLORS, strict=False))
    named: set[str] = set()
    for branch, along, at in zip(readings.motion.branches, readings.along, readings.at, strict=True):
        order = np.argsort(
            [*range(len(branch.points)), *(b.after - 0.5 for b in branch.bifurcations)], kind="stable"
        )
        speeds = np.array([*branch.speeds, *(b.point.orbit.speed for b in branch.bifurcations)])[order] * RPM
        sizes = 1e6 * np.concatenate([along[:, 0], at[:, 0]])[order]
        stable = np.array([*branch.stable, *(None for _ in branch.bifurcations)])[order]
        for steady, style in ((True, "-"), (False, "--")):
            there = stable == steady
            near = np.append(there[1:], False) | np.append(False, there[:-1])
            shown = there | ((stable == None) & near)  # noqa: E711  of each element
            label = f"{branch.kind}, {'stable' if steady else 'unstable'}"
            ax.plot(
                speeds,
                np.where(shown, sizes, np.nan),
                style,
                color=colors[branch.kind],
                linewidth=1.6,
                clip_on=False,
                label="" if label in named or not there.any() else label,
            )
            named |= {label} if there.any() else set()
        for bifurcation, size in zip(branch.bifurcations, at, strict=True):
            ax.plot(
                bifurcation.point.orbit.speed * RPM,
                1e6 * size[0],
                MARKERS[_KINDS.index(bifurcation.kind)],
                color=DARK,
                markersize=5,
                zorder=3,
                label="" if bifurcation.kind in named else bifurcation.kind,
            )
            named.add(bifurcation.kind)
    for speed, before, after in readings.jumps:
        ax.annotate(
            "",
            (speed * RPM, 1e6 * after[0]),
            (speed * RPM, 1e6 * before[0]),
            arrowprops={"arrowstyle": "->", "color": DARK, "linewidth": 1.1, "shrinkA": 4, "shrinkB": 1},
        )
        up = after[0] > before[0]
        middle = (speed * RPM, 5e5 * (before[0] + after[0]))
        where = {"rotation": 90, "va": "center", "ha": "right", "bbox": BOX}
        note(ax, "jump up" if up else "jump down", middle, (-3, 0), color=DARK, **where)
    ax.set(xlabel="speed, rpm", ylabel=f"amplitude at {readings.labels[0]}, µm")
    ax.set_ylim(bottom=0.0)
    plain(ax)
    rad_s_above(ax)
    legend_above(ax, height=1.12)
    return ax
