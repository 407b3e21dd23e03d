"""Unbalance of a single run at its stations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import BLUE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.unbalance_result import Unbalance


def unbalance_bars(found: Unbalance, ax: Axes | None = None) -> Axes:
    """Draw the size of the unbalance at each station: filled, ± 1.96 std, where determined; else open.

    Parameters
    ----------
    found
        The unbalance.
    ax
        None: those of a new figure.
    """
    from matplotlib.figure import Figure

    if ax is None:
        ax = Figure(figsize=(7.0, 3.6), layout="constrained").add_subplot()
    labels, x, sure = found.labels, np.arange(len(found.stations)), found.determined
    size = labels.weight(found.unbalance)[0]
    for those, colour, label in ((sure, BLUE, "determined"), (~sure, "none", "not determined")):
        if those.any():
            ax.bar(x[those], size[those], 0.7, color=colour, edgecolor=BLUE, label=label)
    if found.std is not None and sure.any():
        error = 1.96 * found.std[sure] * labels.weight_scale
        ax.errorbar(x[sure], size[sure], yerr=error, fmt="none", ecolor="black", capsize=2, lw=1.2)
    ax.set_xticks(x, found.stations, rotation=0 if len(x) < 12 else 90)
    ax.set_xlabel("station")
    ax.set_ylabel(f"unbalance, {labels.weight_in}")
    ax.set_title(f"Unbalance of a single run, {found.method}")
    ax.legend(frameon=False)
    return ax
