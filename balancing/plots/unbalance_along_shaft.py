"""Unbalance of a single run: a vector at each station, as they stand along the shaft."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.plots.correction_polar import turning
from balancing.solvers.error_propagation import region_edge
from rotorid.base.plot_style import BLUE, TEXT, legend_above, new_figure, plain
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from balancing.unbalance_result import Unbalance

_APART = 2.6
"""Distance of the vectors of neighbouring stations, in lengths of the longest."""


def unbalance_vectors(found: Unbalance, ax: Axes | None = None) -> Axes:
    """Draw the vector of each station with its 95 % region: filled where determined; else open.

    All have the scale of the vertical axis, 0° is to the right, and the rotor is seen from the end from which
    it turns counter-clockwise, or from the one that the job states.
    """
    labels, sure, Q = found.labels, found.determined, len(found.stations)
    ax = ax or new_figure(min(2.0 + 7.0 / Q, 5.0)).add_subplot()
    longest = float(np.abs(found.unbalance).max()) * labels.weight_scale or 1.0
    centres = np.arange(Q) * _APART * longest
    ax.axhline(0, color="0.8", lw=4, zorder=0)
    circle = longest * np.exp(1j * np.linspace(0, 2 * np.pi, 91))

    def on_paper(z: Any) -> Any:  # noqa: ANN401
        return np.abs(z) * np.exp(1j * labels.drawn(np.angle(z))) * labels.weight_scale

    for q, (x, tip) in enumerate(zip(centres, on_paper(found.unbalance), strict=True)):
        ax.plot(x + circle.real, circle.imag, color="0.8", lw=0.8)
        name = "determined, with its 95 % region" if sure[q] else "open: not determined by the readings"
        look: dict[str, Any] = {"mfc": BLUE, "ls": "-"} if sure[q] else {"mfc": "white", "ls": ":"}
        ax.plot([x, x + tip.real], [0, tip.imag], "o", color=BLUE, markevery=[1], lw=2, label=name, **look)
        if sure[q] and found.covariance is not None:
            block = found.covariance[2 * q : 2 * q + 2, 2 * q : 2 * q + 2]
            edge = on_paper(region_edge(found.unbalance[q : q + 1], block[None], None, 90)[0])
            ax.plot(x + edge.real, edge.imag, color="black", lw=1.0)
    ax.set_aspect("equal")
    ax.set_xlim(centres[0] - _APART / 2 * longest, centres[-1] + _APART / 2 * longest)
    told = zip(found.stations, *labels.weight(found.unbalance), strict=True)
    ax.set_xticks(centres, [f"{name}\n{figures(size, 3)}\n{angle:.0f}°" for name, size, angle in told])
    ax.set_xlabel(f"stations in their order, {labels.weight_in}; {turning(labels)}", fontsize=TEXT)
    ax.set_ylabel(f"unbalance, {labels.weight_in}")
    plain(ax)
    ax.grid(visible=False, axis="x")
    handles, names = ax.get_legend_handles_labels()
    shown = dict(zip(names, handles, strict=True))
    legend_above(ax, 2, handles=list(shown.values()), labels=list(shown))
    return ax
