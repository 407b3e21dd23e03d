"""Figures of the balancing sheet: each plane from its end, and vibration before and after."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.rpm import RPM
from rotorid.base.unit_words import speed_words
from rotorid.report.conventions_explained import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Correction
    from balancing.mounting.holes import Holes
    from balancing.mounting.mount_result import Mounted

ROWS_SHOWN = 60
"""Readings in one figure; beyond that the largest ones are shown."""
_WIDTH, _REACH, _TALL = 3.4, (1.95, 2.15), 1.42
"""Of a picture of a plane: inches on paper; half its width (of two, of more planes) and height in radii."""


def plane_figure(
    result: Correction,
    plane: str,
    *,
    holes: Holes | None = None,
    mounted: Mounted | None = None,
    tolerance: float | None = None,
) -> Figure:
    """Draw one plane with what goes into it; material to remove is drawn as a crossed circle.

    Parameters
    ----------
    result
        The correction.
    plane
        One of its planes.
    holes
        Of the plane, where nothing was chosen for them.
    mounted
        Pieces in the holes of all planes, or None: the weight is drawn where it stands.
    tolerance
        Permissible residual, kg or kg·m.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    from balancing.plots.discs import disc

    p = result.planes.index(plane)
    labels = result.labels
    wanted, mounting = complex(result.weights[p]), None
    if mounted is not None:
        holes, mounting = mounted.holes[p], mounted.found.mountings[p]
        if mounted.on_top_of is not None and result.to_add is not None and result.mounted is not None:
            wanted = complex(result.to_add[result.mounted[1].index(plane)])
    loose = (wanted,) if mounting is None and wanted != 0 else ()
    if mounted is not None and mounting is None and mounted.weights[p] != 0:
        loose = (complex(mounted.weights[p]),)
    with mpl.rc_context({"font.size": 10.0}):
        arcs = () if result.limits is None else result.limits.forbidden[p]
        lines = 1 + 2 * (mounted is not None) + (tolerance is not None) + bool(arcs)
        reach = _REACH[len(result.planes) > 2]
        axes = _WIDTH * _TALL / reach
        height = axes + 0.37 + 0.15 * lines  # a title above the axes, lines of text below
        figure = Figure(figsize=(_WIDTH, height))
        ax = figure.add_axes((0.0, 1 - (axes + 0.25) / height, 1.0, axes / height))
        disc(
            ax,
            plain(plane),
            holes,
            mounting,
            labels,
            remove=plane in result.remove,
            weight=wanted,
            tolerance=tolerance,
            loose=loose,
            forbidden=arcs,
            clockwise=labels.drawn_sign < 0,
        )
        ax.set(xlim=(-reach, reach), ylim=(-_TALL, _TALL))
    return figure


def residual_figure(rows: Sequence[dict[str, Any]], unit: str, speed_unit: str = "rpm") -> Figure:
    """Draw readings before (bars) and after (dots with 95 %), and limits (thick lines), one below the other.

    Parameters
    ----------
    rows
        `residuals` of `rotorid.report.balance_data.sheet_data`; of more than `ROWS_SHOWN` the largest.
    unit
        Of the amplitudes, in words.
    speed_unit
        Of the speeds, as in a column's name.
    """
    from matplotlib.figure import Figure

    from balancing.plots.amplitude_bars import before_and_after, left_is_small

    if len(rows) > ROWS_SHOWN:
        largest = sorted(range(len(rows)), key=lambda i: -max(rows[i]["before"], rows[i]["after"]))
        rows = [rows[i] for i in sorted(largest[:ROWS_SHOWN])]
    figure = Figure(figsize=(5.8, 1.0 + 0.145 * len(rows)), layout="constrained")
    ax = figure.add_subplot()
    speeds = [row["speed_rpm"] for row in rows]
    step = [0.0] + [0.5 * (b != a) for a, b in pairwise(speeds)]
    y = np.arange(len(rows)) + np.cumsum(step)
    old, new = (np.array([row[key] for row in rows]) for key in ("before", "after"))
    reach = np.array([row["within_95"] for row in rows], dtype=float)
    known = bool(np.isfinite(reach).all())
    label = "predicted with 95 % of a check run" if known else "predicted"
    closer = None
    if left_is_small((old, new), reach if known else None):
        parts = figure.add_gridspec(1, 2, width_ratios=[1.5, 1])
        ax.set_subplotspec(parts[0])
        closer = figure.add_subplot(parts[1], sharey=ax)
        closer.tick_params(axis="y", length=0, labelleft=False)
        closer.set_xlabel(f"what is left, {plain(unit)}" if unit else "what is left")
    before_and_after(
        ax,
        y,
        (old, new),
        closer=closer,
        reach=reach if known else None,
        limit=np.array([row["limit"] for row in rows], dtype=float),
        after=label,
        lying=True,
    )
    ax.set_yticks(y, [_short(row["sensor"]) for row in rows], fontsize="small")
    for speed in dict.fromkeys(speeds):
        first = y[speeds.index(speed)]
        words = speed_words(speed / RPM, speed_unit)
        ax.text(1.01, first, words, transform=ax.get_yaxis_transform(), va="center")
    ax.set_xlim(left=0)
    ax.set_ylim(y[-1] + 0.7, -0.7)
    ax.set_xlabel(f"amplitude, {plain(unit)}" if unit else "amplitude")
    ax.tick_params(axis="y", length=0)
    ax.spines[["top", "right"]].set_visible(False)
    shown = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    order = [name for name in ("before", label, "perhaps no better than before", "limit") if name in shown]
    figure.legend(
        [shown[name] for name in order],
        order,
        loc="outside upper left",
        ncols=3,
        fontsize="small",
        frameon=False,
    )
    return figure


def _short(name: str) -> str:
    """Beginning and end of a long name: sensors often differ in their last letters."""
    import textwrap

    lines = textwrap.wrap(name, 26)
    return plain("\n".join([*lines[:2], "…"] if len(lines) > 3 else lines))
