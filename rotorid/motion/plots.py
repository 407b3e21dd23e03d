"""Pictures of motion: over time with spectrum, orbits, a run-up, journals in their bearings, bifurcations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.plot_style import (
    BOX,
    COLORS,
    DARK,
    MARKERS,
    TEXT,
    VERMILION,
    legend_above,
    legend_below,
    look,
    new_figure,
    note,
    plain,
    second_scale,
)
from rotorid.base.text import RPM, rpm_text
from rotorid.motion.run import MotionRun
from rotorid.motion.steady import steady_linear, synchronous_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.base.arrays import ComplexArray, FloatArray
    from rotorid.motion.branches import Branch
    from rotorid.motion.equilibrium import Equilibrium

_PANELS, _TURNS, _ORDERS = 6, 12, 4.0
"""Nodes that are drawn, turns of an orbit, orders of a spectrum."""
_NOTHING = 1e-6
"""µm, and all below is rounding: an axis that holds nothing more goes to 1 µm."""
CIRCLE = np.array([part(np.linspace(0, 2 * np.pi, 181)) for part in (np.cos, np.sin)])
_LOWEST_PHASE = -315.0
"""Degrees; phases stand from here on through a whole turn."""


def motion_figure(motion: MotionRun) -> Figure:
    """Of each node x and y over time, and at a constant speed the spectrum of the second half beside them."""
    shown, turn = _shown(motion), motion.speeds[0] / (2 * np.pi)
    figure, widths = new_figure(1.2 + 1.7 * len(shown)), [3, 2][: 1 + (motion.speeds[0] == motion.speeds[1])]
    axes = figure.subplots(len(shown), len(widths), sharex="col", width_ratios=widths, squeeze=False)
    for i, row in zip(shown, axes, strict=True):
        for k, (name, values) in enumerate((("x", motion.z[:, i].real), ("y", motion.z[:, i].imag))):
            row[0].plot(motion.time, 1e6 * values, label=name, linewidth=0.7, color=COLORS[k])
        row[0].set_ylabel(f"node {motion.nodes[i]}, µm")
        for ax in row[1:]:
            z = motion.z[len(motion.z) // 2 :, i]
            fade = np.hanning(len(z) + 2)[1:-1]
            lines = np.fft.fftshift(np.abs(np.fft.fft(fade * (z - z.mean())))) / fade.sum()
            frequency = np.fft.fftshift(np.fft.fftfreq(len(z), motion.time[1])) / (turn or 1.0)
            ax.plot(frequency, 1e6 * lines, linewidth=1.0, color=COLORS[0])
            ax.set(ylabel="amplitude, µm", ylim=(0, None), xlim=(-_ORDERS, _ORDERS) if turn else None)
        for ax in row:
            plain(ax)
            if np.abs(ax.get_ylim()).max() < _NOTHING:
                ax.set_ylim(-1.0 if ax is row[0] else 0.0, 1.0)
                note(ax, "no motion", (0.5, 0.5), xycoords="axes fraction", ha="center", bbox=BOX)
    against = f"{'cycles a turn' if turn else 'Hz'}, backward < 0"
    for ax, label in zip(axes[-1], ("time, s", against), strict=False):
        ax.set_xlabel(label)
    legend_below(figure, [axes[0, 0]], title=_left_out(motion))
    return figure


def orbits_figure(motion: MotionRun) -> Figure:
    """Of each node the last turns, a dot at each turn, and the clearance circle of its bearing."""
    shown, angle = _shown(motion), motion.turned
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure = new_figure(0.9 + 3.2 * rows)
    walls = {i: 1e6 * force.wall for force, i in motion.bearings}
    k = int(np.searchsorted(angle, angle[-1] - 2 * np.pi * _TURNS))
    marks = 2 * np.pi * np.arange(np.ceil(angle[k] / (2 * np.pi)), angle[-1] / (2 * np.pi))
    for place, i in enumerate(shown, start=1):
        ax = figure.add_subplot(rows, columns, place)
        z = 1e6 * motion.z[k:, i]
        ax.plot(z.real, z.imag, linewidth=0.9, color=COLORS[0])
        if marks.size:
            at = np.interp(marks, angle[k:], z)
            ax.plot(at.real, at.imag, "o", markersize=4, color=VERMILION, label="once a turn")
        ax.set(xlabel="x, µm", ylabel="y, µm", title=f"node {motion.nodes[i]}")
        ax.set_aspect("equal", adjustable="datalim")
        ax.locator_params(nbins=6)
        plain(ax)
        if i in walls:
            part = ax
            if 5 * np.abs(z - z[0]).max() < walls[i]:  # else it would be a dot in its clearance
                part = _whole_clearance(ax, (0.72, 0.66, 0.26, 0.26), z)
                ax.margins(0.5)
            part.plot(*walls[i] * CIRCLE, color=DARK, label="clearance")
    legend_below(figure, figure.axes, title=_left_out(motion))
    return figure


def bode_figure(motion: MotionRun) -> Figure:
    """Synchronous part of the deflection in x of a run-up over speed, beside the steady response.

    Raises
    ------
    ValueError
        At a constant speed.
    """
    first, last = motion.speeds
    if first == last:
        raise ValueError("at a constant speed there is no curve over speed: --run-up has one")
    figure = new_figure(5.2)
    above, below = figure.subplots(2, sharex=True, height_ratios=[3, 2])
    steady = steady_linear(motion.system, np.linspace(min(first, last), max(first, last), 1000))
    speeds, _, response = (np.array(each) for each in zip(*steady, strict=True))
    response = response[:, [motion.system.index(node)[0] for node in motion.nodes]]
    run = synchronous_part(motion)
    for k, i in enumerate(_shown(motion)):
        for (speed, X), style, label in (
            ((speeds, response), ":", ""),
            (run, "-", f"node {motion.nodes[i]}"),
        ):
            drawn = {"linestyle": style, "color": look(k)["color"], "label": label}
            above.plot(speed * RPM, 1e6 * np.abs(X[:, i]), **drawn)
            phase = (np.angle(X[:, i], deg=True) - _LOWEST_PHASE) % 360 + _LOWEST_PHASE
            phase[1:][np.abs(np.diff(phase)) > 180] = np.nan  # where it begins anew
            below.plot(speed * RPM, phase, **drawn)
    above.plot([], [], ":", color=DARK, label="dotted: steady, of the linear rotor")
    above.set(ylabel="1× of x, µm", ylim=(0, None))
    below.set(xlabel="speed, rpm", ylabel="phase lead, °", yticks=range(-270, 1, 90))
    for ax in (above, below):
        plain(ax)
    legend_below(figure, [above], 3, title=_left_out(motion))
    return figure


FIGURES: Mapping[str, Callable[[MotionRun], Figure]] = {
    "motion": motion_figure,
    "orbits": orbits_figure,
    "bode": bode_figure,
}
"""By what a picture shows."""


def _shown(motion: MotionRun) -> list[int]:
    """Columns of nodes that are drawn, those of bearings first of all."""
    bearings = [i for _, i in motion.bearings]
    return sorted(sorted(range(len(motion.nodes)), key=lambda i: i not in bearings)[:_PANELS])


def _left_out(motion: MotionRun) -> str | None:
    """That not every node is drawn; None where every one is."""
    count = len(motion.nodes)
    return f"{_PANELS} of {count} nodes, those of bearings first" if count > _PANELS else None


def _whole_clearance(ax: Axes, place: tuple[float, float, float, float], *paths: ComplexArray) -> Axes:
    """Small axes for a whole clearance circle, with where the paths are in it."""
    whole = ax.inset_axes(place, aspect="equal")
    for k, path in enumerate(paths):
        whole.plot(path.real, path.imag, marker=".", markersize=2, **look(k))
    whole.set_title("clearance", fontsize=TEXT)
    whole.axis("off")
    return whole


def draw_journals(resting: Sequence[Equilibrium], labels: Sequence[str], ax: Axes) -> None:
    """Draw the path of each journal in its clearance circle over speed, with load and rotation.

    Parameters
    ----------
    resting
        Equilibria at ascending speeds.
    labels
        Of the bearings.
    ax
        Drawn into.
    """
    Z = np.array([at.position / [one.wall for one in at.bearings] for at in resting])
    marked = np.unique(np.linspace(0, len(resting) - 1, 5).round().astype(int)).tolist()
    whole = _whole_clearance(ax, (1.05, 0.5, 0.4, 0.4), *Z.T)
    for k, (path, label) in enumerate(zip(Z.T, labels, strict=True)):
        ax.plot(path.real, path.imag, marker="o", label=label, markersize=4, markevery=marked, **look(k))
    for part in (ax, whole):
        part.plot(*CIRCLE, color=DARK)
    x, y = ((part.min() + part.max()) / 2 for part in (Z.real, Z.imag))
    reach = 0.7 * max(np.ptp(Z.real), np.ptp(Z.imag), 0.1)  # the paths fill the axes, not the circle
    ax.set(aspect="equal", xlim=(x - reach, x + reach), ylim=(y - reach, y + reach))
    for i in marked:
        note(ax, rpm_text(resting[i].speed), (Z[i, 0].real, Z[i, 0].imag), (9.0, 0.0), va="center")
    load = resting[-1].load.sum()
    where = f"load towards {np.degrees(np.angle(load)):.0f}° from x" if load else "no load"
    ax.set(xlabel="x by clearance", ylabel="y by clearance")
    ax.set_title(f"{where}; rotation anticlockwise", fontsize=TEXT)
    ax.legend(frameon=False, fontsize=TEXT, loc="upper left", bbox_to_anchor=(1.03, 0.4))
    plain(ax)


def draw_bifurcations(branches: Sequence[Branch], directions: FloatArray, label: str, ax: Axes) -> None:
    """Draw the amplitude of the first sensor, µm, over speed, rpm.

    Stable motions are solid, unstable ones dashed; arrows show where the motion jumps at a fold.

    Parameters
    ----------
    branches
        Of periodic motion.
    directions, label
        Unit vectors of what the sensors read, shape (k, n), and the name of the first.
    ax
        Drawn into.
    """
    from rotorid.motion.branches import KINDS, amplitudes, jumps

    colors = dict(zip(dict.fromkeys(b.kind for b in branches), COLORS, strict=False))
    for branch in branches:
        speeds = np.array([orbit.speed for orbit in branch.orbits]) * RPM
        sizes = 1e6 * amplitudes(branch.orbits, directions)[:, 0]
        kinds = np.array([orbit.bifurcation for orbit in branch.orbits])
        stable = np.array([orbit.stable for orbit in branch.orbits])
        for word, style, part in (("stable", "-", stable | (kinds != "")), ("unstable", "--", ~stable)):
            if (part & (kinds == "")).any():
                (line,) = ax.plot(speeds, np.where(part, sizes, np.nan), style, color=colors[branch.kind])
                line.set(label=f"{branch.kind}, {word}", marker="" if len(speeds) > 1 else "o")
        for kind, marker in zip(KINDS, MARKERS, strict=False):
            if (at := kinds == kind).any():
                ax.plot(speeds[at], sizes[at], marker, color=DARK, markersize=5, zorder=3, label=kind)
    for speed, before, after in jumps(branches, directions):
        tip, tail = ((speed * RPM, 1e6 * size[0]) for size in (after, before))
        ax.annotate("", tip, tail, arrowprops={"arrowstyle": "->", "color": DARK, "shrinkA": 4})
    ax.set(xlabel="speed, rpm", ylabel=f"amplitude at {label}, µm")
    ax.set_ylim(bottom=-0.04 * ax.get_ylim()[1])  # a branch at rest stands above the axis
    plain(ax)
    second_scale(ax)
    pairs = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    legend_above(ax, height=1.12, handles=list(pairs.values()), labels=list(pairs))
