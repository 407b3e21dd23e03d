"""Picture of journal bearings: loci of the journals, and stability map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem import GRAVITY
from rotorid.base.plot_style import (
    DARK,
    VERMILION,
    legend_below,
    look,
    new_figure,
    note,
    plain,
    plain_numbers,
)
from rotorid.base.rpm import rpm_text
from rotorid.motion.stability_map import always_stable_above, critical_mass

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.motion.equilibrium import Equilibrium


def bearings_figure(found: Sequence[Equilibrium], labels: Sequence[str]) -> Figure:
    """Loci of the bearings, of some labels, and stability map, over ascending speeds."""
    figure = new_figure(4.2)
    locus, chart = figure.subplots(1, 2)
    marked = np.unique(np.linspace(0, len(found) - 1, 5).round().astype(int)).tolist()
    style = [look(k) | {"marker": "o", "markersize": 4, "markevery": marked} for k in range(len(labels))]
    _draw_loci(found, labels, style, locus)
    _draw_stability_map(found, style, chart)
    legend_below(figure, (locus,), 3, title="journals in the clearance circle and in the stability map")
    return figure


def _draw_loci(
    found: Sequence[Equilibrium], labels: Sequence[str], style: Sequence[dict[str, Any]], ax: Axes
) -> None:
    """Path of each journal in its clearance circle over speed, with the directions of load and rotation."""
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    ax.plot(turn.real, turn.imag, color=DARK)
    Z = np.array([at.position / [one.wall for one in at.bearings] for at in found])
    for path, label, own in zip(Z.T, labels, style, strict=True):
        ax.plot(path.real, path.imag, label=label, **own)
    for end in (0, -1):
        inwards = end == 0 and abs(Z[0, 0]) < 0.6  # where neither wall nor the other speed is
        shift, side = ((7.0, 0.0), "left") if inwards else ((-7.0, 0.0), "right")
        at = (Z[end, 0].real, Z[end, 0].imag)
        note(ax, rpm_text(found[end].speed), at, shift, ha=side, va="center")
    arrow = {"arrowstyle": "-|>", "color": DARK}
    load = found[-1].load.sum()
    tip = 0.32 * load / (abs(load) or 1.0)
    ax.annotate("", (-0.4 + tip.real, 0.45 + tip.imag), (-0.4, 0.45), arrowprops=arrow)
    note(ax, "load" if load else "no load", (-0.4, 0.45), (0, 4), color=DARK, ha="center")
    ax.annotate("", (0.36, 0.6), (0.52, 0.4), arrowprops={**arrow, "connectionstyle": "arc3,rad=0.25"})
    note(ax, "Ω", (0.46, 0.54), (2, 2), color=DARK)
    ax.set(xlabel="x by clearance", ylabel="y by clearance", aspect="equal")
    plain(ax)


def _draw_stability_map(found: Sequence[Equilibrium], style: Sequence[dict[str, Any]], ax: Axes) -> None:
    """Critical mass number of a rigid rotor over eccentricity, and where the bearings are over speed.

    The mass that a bearing carries is its load by gravity.
    """
    e = np.linspace(0.01, always_stable_above() - 1e-5, 400)
    M = critical_mass(e)[0]
    ax.plot(e, M, color=DARK)
    ax.fill_between(e, M, 1e3, color=VERMILION, alpha=0.14, linewidth=0)
    low, high = 0.5, 100.0
    for k in np.flatnonzero(np.isfinite(found[0].sommerfeld)).tolist():
        numbers = found[0].bearings[k].wall * np.array([at.speed for at in found]) ** 2 / GRAVITY
        ax.plot([at.eccentricity[k] for at in found], numbers, **style[k])
        low, high = min(low, 0.7 * numbers.min()), max(high, 2 * numbers.max())
    note(ax, "a rigid rotor\nis unstable", (0.08, 20.0), color=VERMILION)
    ax.set(xlim=(0, 1), ylim=(low, high), yscale="log")
    ax.set(xlabel="eccentricity by clearance", ylabel="mass number m c Ω² / W")
    plain_numbers(ax)
    plain(ax)
