"""Picture of journal bearings: loci of the journals, stability map, stiffness and damping over speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem.static import GRAVITY
from rotorid.base.plot_style import (
    DARK,
    VERMILION,
    legend_above,
    legend_below,
    look,
    new_figure,
    note,
    plain,
    plain_numbers,
)
from rotorid.base.rpm import RPM, rpm_text
from rotorid.motion.linear_coefficients import coefficients
from rotorid.motion.stability_map import always_stable_above, critical_mass

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.motion.equilibrium import Equilibrium

_MARKED = 5
"""Speeds that are marked on a locus."""


def bearings_figure(found: Sequence[Equilibrium], labels: Sequence[str], threshold: float | None) -> Figure:
    """Loci and stability map above a row of stiffness and damping for each bearing.

    Parameters
    ----------
    found
        At ascending speeds.
    labels
        Of the bearings, b of them.
    threshold
        Speed at which the rotor loses stability, rad/s, if it does.
    """
    figure = new_figure(3.6 + 2.2 * len(labels))
    grid = figure.add_gridspec(1 + len(labels), 2, height_ratios=[3.4, *[2.2] * len(labels)])
    locus, chart = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    draw_loci(found, labels, locus)
    draw_stability_map(found, chart)
    K, C = coefficients(found)
    rpm = np.array([at.speed for at in found]) * RPM
    walled = [k for k, force in enumerate(found[0].system.forces) if np.isfinite(force.wall)]
    for row, (k, label) in enumerate(zip(walled, labels, strict=True), start=1):
        for column, (values, sign, unit) in enumerate(((K / 1e6, "k", "MN/m"), (C / 1e3, "c", "kN·s/m"))):
            ax = figure.add_subplot(grid[row, column])
            for j, name in enumerate(("xx", "xy", "yx", "yy")):
                ax.plot(rpm, values[:, k].reshape(-1, 4)[:, j], label=sign + name, **look(j))
            if threshold is not None:
                ax.axvline(threshold * RPM, color=VERMILION, linewidth=0.8)
                side = 1 if 2 * threshold * RPM < rpm[0] + 1.4 * rpm[-1] else -1
                style = {"color": VERMILION, "ha": "left" if side > 0 else "right"}
                note(ax, "threshold", (threshold * RPM, ax.get_ylim()[1]), (2 * side, -9), **style)
            ax.set(xlabel="speed, rpm" if row == len(labels) else "", ylabel=f"{label}\n{sign}, {unit}")
            plain(ax)
            if row == 1:
                legend_above(ax, 4, handlelength=1.6, columnspacing=1.0)
    legend_below(figure, (locus,), 3, title="journals in the clearance circle and in the stability map")
    return figure


def draw_loci(found: Sequence[Equilibrium], labels: Sequence[str], ax: Axes) -> None:
    """Path of each journal in its clearance circle over speed, with the direction of its load."""
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
    ax.plot(turn.real, turn.imag, color=DARK)
    Z = np.array([at.position / [one.wall for one in at.bearings] for at in found])
    marked = np.unique(np.linspace(0, len(found) - 1, _MARKED).round().astype(int)).tolist()
    for k, label in enumerate(labels):
        ax.plot(
            Z[:, k].real, Z[:, k].imag, label=label, marker="o", markersize=4, markevery=marked, **look(k)
        )
    for end in (0, -1):
        side = 1 if end == 0 and abs(Z[0, 0]) < 0.6 else -1  # where neither wall nor the other speed is
        shift, words = (7.0 * side, 0.0), rpm_text(found[end].speed)
        note(
            ax,
            words,
            (Z[end, 0].real, Z[end, 0].imag),
            shift,
            ha="left" if side > 0 else "right",
            va="center",
        )
    load = found[-1].load.sum()
    if load:
        tip = 0.32 * load / abs(load)
        style = {"arrowstyle": "-|>", "color": DARK}
        ax.annotate("", (-0.4 + tip.real, 0.45 + tip.imag), (-0.4, 0.45), arrowprops=style)
        note(ax, "load", (-0.4, 0.45), (0, 4), color=DARK, ha="center")
    ax.annotate("", (0.36, 0.6), (0.52, 0.4), arrowprops={**style, "connectionstyle": "arc3,rad=0.25"})
    note(ax, "Ω", (0.46, 0.54), (2, 2), color=DARK)
    ax.set(xlabel="x by clearance", ylabel="y by clearance", aspect="equal")
    plain(ax)


def draw_stability_map(found: Sequence[Equilibrium], ax: Axes) -> None:
    """Critical mass number of a rigid rotor over eccentricity, and where the bearings are over speed.

    The mass that a bearing carries is its load by gravity.
    """
    e = np.linspace(0.01, always_stable_above() - 1e-5, 400)
    M = critical_mass(e)[0]
    ax.plot(e, M, color=DARK)
    ax.fill_between(e, M, 1e3, color=VERMILION, alpha=0.14, linewidth=0)
    E = np.array([at.eccentricity for at in found])
    walls = np.array([one.wall for one in found[0].bearings])
    numbers = walls * np.array([[at.speed] for at in found]) ** 2 / GRAVITY
    marked = np.unique(np.linspace(0, len(found) - 1, _MARKED).round().astype(int)).tolist()
    for k in np.flatnonzero(np.isfinite(found[0].sommerfeld)):
        ax.plot(E[:, k], numbers[:, k], marker="o", markersize=4, markevery=marked, **look(int(k)))
    note(ax, "a rigid rotor\nis unstable", (0.08, 20.0), color=VERMILION)
    ax.set(xlim=(0, 1), ylim=(min(0.5, numbers.min()), max(100.0, 2 * numbers.max())), yscale="log")
    ax.set(xlabel="eccentricity by clearance", ylabel="mass number m c Ω² / W")
    plain_numbers(ax)
    plain(ax)
