"""Static deflection along the rotor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import MARKERS, WIDTH, legend_above, look, new_axes, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.static import StaticDeflection


def draw_deflection(found: StaticDeflection, ax: Axes | None = None) -> Axes:
    """Draw the deflection in x and y along the rotor; return the axes."""
    ax = new_axes((WIDTH, 3.2)) if ax is None else ax
    for k, (name, values) in enumerate((("x", found.x), ("y", found.y))):
        if np.abs(values).max() > 1e-9 * found.deflection.max():
            ax.plot(
                found.rotor.positions, 1e6 * values, marker=MARKERS[k], markersize=4, label=name, **look(k)
            )
    ax.set(xlabel="position, m", ylabel="static deflection, µm")
    plain(ax)
    legend_above(ax)
    return ax
