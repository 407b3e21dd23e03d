"""Picture of a study of machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import look, plain
from rotorid.study.machine_counts import EDGES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.base.arrays import FloatArray


def draw_machines(ax: Axes, shares: FloatArray) -> None:
    """Machines below a ratio to the limit, from shares between `EDGES`, as built and at last, (2, 600)."""
    plain(ax)
    curves = shares if (shares[0] != shares[1]).any() else shares[:1]
    for k, (share, name) in enumerate(zip(curves, ("as built", "after the last correction"), strict=False)):
        ax.stairs(100 * np.cumsum(share), EDGES, baseline=None, label=name, **look(k))
    seen = EDGES[1:][curves.any(axis=0)]
    ax.axvline(1.0, color="black", linewidth=0.8, label="limit")
    ax.set(xscale="log", xlim=(min(0.9, *seen) / 1.2, max(1.1, *seen) * 1.2), ylim=(0, 101))
    ax.set(xlabel="largest reading over its limit", ylabel="machines below, %")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.legend(frameon=False)
