"""Pictures of the inverse problem. Nothing is shown or saved here: every function draws on axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import fem

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rotorid.reduction import Reduction


def plot_reduction(reduction: Reduction, ax: Axes | None = None) -> Axes:
    """Draw the shapes of the n-mass model (markers) over the rotor's (lines) and the rotor itself.

    Parameters
    ----------
    reduction
        What to draw.
    ax
        Where; default new axes.
    """
    from fem.plots import COLORS, draw_rotor, new_axes

    axes = new_axes() if ax is None else ax
    full = reduction.rotor_modes
    index = np.array(reduction.nodes) - 1
    scale = np.abs(full.shapes).max(axis=0)
    draw_rotor(reduction.rotor, axes, height=0.22)
    for k in range(len(reduction.frequencies)):
        color = COLORS[k % len(COLORS)]
        f, g = reduction.frequencies[k], reduction.rotor_frequencies[k]
        label = f"mode {k + 1}: {_rpm(f)} (rotor {_rpm(g)})"
        axes.plot(full.positions, full.shapes[:, k] / scale[k], color=color)
        axes.plot(
            full.positions[index],
            reduction.shapes[:, k] / scale[k],
            "o",
            color=color,
            mec="white",
            label=label,
        )
    for node, mass in zip(reduction.nodes, reduction.masses.solution, strict=True):
        x = fem_position(reduction.rotor, node)
        axes.axvline(x, color="0.6", lw=0.8, ls=":")
        axes.annotate(
            f"{mass:.0f} kg",
            (x, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3),
            textcoords="offset points",
            ha="center",
            fontsize=9,
        )
    axes.set(xlabel="position, m", ylabel="mode shape, largest = 1", ylim=(-1.25, 1.25))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, frameon=False)
    axes.set_title(f"{len(reduction.nodes)}-mass model (points) and rotor (lines)", pad=22)
    return axes


def fem_position(rotor: fem.Rotor, node: int) -> float:
    """Position of a node, m."""
    return float(rotor.positions[node - 1])


def _rpm(omega: float) -> str:
    return f"{omega * 30 / np.pi:.0f} rpm" if np.isfinite(omega) else "none"
