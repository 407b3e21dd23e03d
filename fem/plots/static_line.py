"""Static deflection along the rotor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.static import StaticDeflection


def draw_deflection(found: StaticDeflection, ax: Axes | None = None) -> Axes:
    """Draw the deflection in x and y along the rotor; return the axes."""
    ax = new_axes((10, 4)) if ax is None else ax
    for name, values in (("x", found.x), ("y", found.y)):
        if np.abs(values).max() > 1e-9 * found.deflection.max():
            ax.plot(found.rotor.positions, 1e6 * values, marker=".", label=name)
    ax.set(xlabel="position, m", ylabel="static deflection, µm")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    return ax
