"""Orbits of shaft centres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fem.orbits import DIRECTION_NAMES, orbits
from rotorid.base.plot_style import COLORS, MARKERS, STYLES, TEXT, WIDTH, legend_above, new_axes, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TITLE = "mark: where the shaft's centre is as the phase mark passes the x axis; rotation anticlockwise"
MOST_ORBITS = 4
"""That one picture tells apart."""


def draw_orbits(
    x: ArrayLike, y: ArrayLike, labels: Sequence[str], ax: Axes | None = None, *, title: str = ""
) -> Axes:
    """Draw orbits: a mark where the phase mark passes, an arrow in the direction of motion.

    Forward whirl (with the rotation, anticlockwise) is a solid line, backward whirl a dashed one.

    Parameters
    ----------
    x, y
        Complex peak amplitudes of the two directions, m, shape (n,): x(t) = Re(x e^{iωt}).
    labels
        Of the orbits, length n.
    ax
        Axes to draw into; new ones if None.
    title
        Above the legend, such as the speed.
    """
    ax = new_axes((WIDTH, 6)) if ax is None else ax
    turn = np.linspace(0.0, 2 * np.pi, 241)
    X, Y = np.atleast_1d(np.asarray(x, complex)), np.atleast_1d(np.asarray(y, complex))
    ways = orbits(X, Y).direction
    for k, (a, b, label, way) in enumerate(zip(X, Y, labels, ways.tolist(), strict=True)):
        color, marker = COLORS[k % MOST_ORBITS], MARKERS[k % len(MARKERS)]
        path = 1e6 * np.real(np.stack((a, b))[:, None] * np.exp(1j * turn))
        style, word = STYLES[1] if way < 0 else STYLES[0], "straight" if way == 0 else DIRECTION_NAMES[way]
        ax.plot(*path, style, color=color, linewidth=1.7, label=f"{label}, {word}",
                marker=marker, markevery=[0], markersize=9, markeredgecolor="white")  # fmt: skip
        arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 1.6, "mutation_scale": 16}
        ax.annotate("", xy=tuple(path[:, 40]), xytext=tuple(path[:, 34]), arrowprops=arrow)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="x, µm", ylabel="y, µm")
    ax.margins(0.08)
    plain(ax)
    ax.axhline(0, color="#9aa2ad", linewidth=0.7, zorder=0.5)
    ax.axvline(0, color="#9aa2ad", linewidth=0.7, zorder=0.5)
    legend_above(ax, 2, title=f"{title}\n{_TITLE}".strip(), title_fontsize=TEXT)
    return ax
