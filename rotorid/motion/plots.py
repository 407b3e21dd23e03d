"""Pictures of motion: over time with spectrum, orbits, a run-up, journals in their bearings, bifurcations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.plot_style import (
    BOX,
    COLORS,
    DARK,
    MARKERS,
    VERMILION,
    legend_above,
    legend_below,
    look,
    new_figure,
    note,
    plain,
    rad_s_above,
)
from rotorid.base.rpm import RPM, rpm_text
from rotorid.motion.run import MotionRun
from rotorid.motion.steady import steady_linear, synchronous_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.base.arrays import FloatArray
    from rotorid.motion.branches import Branch
    from rotorid.motion.equilibrium import Equilibrium

_PANELS, _TURNS, _LARGEST_ORDER = 4, 12, 4.0
"""Nodes that are drawn, turns of an orbit, orders of a spectrum."""
CIRCLE = np.exp(1j * np.linspace(0, 2 * np.pi, 181))
_LOWEST_PHASE = -315.0
"""Degrees; phases stand from here on through a whole turn."""


def motion_figure(motion: MotionRun) -> Figure:
    """Of each node x and y over time, and at a constant speed the spectrum of the second half beside them."""
    shown, constant = _shown(motion), motion.speeds[0] == motion.speeds[1]
    figure = new_figure(1.2 + 1.9 * len(shown))
    widths = [3, 2] if constant else [1]
    axes = figure.subplots(len(shown), len(widths), sharex="col", width_ratios=widths, squeeze=False)
    for i, row in zip(shown, axes, strict=True):
        for k, (name, values) in enumerate((("x", motion.z[:, i].real), ("y", motion.z[:, i].imag))):
            row[0].plot(motion.time, 1e6 * values, label=name, linewidth=0.7, color=look(k)["color"])
        row[0].set_ylabel(f"node {motion.nodes[i]}, µm")
        if constant:
            _draw_spectrum(motion, i, row[1])
        for ax in row:
            plain(ax)
    axes[-1, 0].set_xlabel("time, s")
    if constant:
        axes[-1, 1].set_xlabel("frequency, cycles a turn" if motion.speeds[0] else "frequency, Hz")
        axes[0, 1].legend(frameon=False, fontsize="small")
    legend_below(figure, [axes[0, 0]])
    return figure


def orbits_figure(motion: MotionRun) -> Figure:
    """Of each node the last turns, a dot at each turn, and the clearance circle of its bearing."""
    shown, angle = _shown(motion), motion.turned
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure = new_figure(0.9 + 3.2 * rows)
    walls = {i: 1e6 * force.wall for force, i in motion.bearings}
    k = int(np.searchsorted(angle, angle[-1] - 2 * np.pi * _TURNS)) if angle[-1] > angle[0] else 0
    marks = 2 * np.pi * np.arange(np.ceil(angle[k] / (2 * np.pi)), np.floor(angle[-1] / (2 * np.pi)) + 1)
    for place, i in enumerate(shown, start=1):
        ax = figure.add_subplot(rows, columns, place)
        z = 1e6 * motion.z[k:, i]
        ax.plot(z.real, z.imag, linewidth=0.9, color=look(0)["color"])
        if angle[-1] > angle[k]:
            at = np.interp(marks, angle[k:], z)
            ax.plot(at.real, at.imag, "o", markersize=4, color=VERMILION, label="once a turn")
        if i in walls:
            ax.plot(walls[i] * CIRCLE.real, walls[i] * CIRCLE.imag, color=DARK, label="clearance")
        ax.set(xlabel="x, µm", ylabel="y, µm", title=f"node {motion.nodes[i]}")
        ax.set_aspect("equal", adjustable="datalim")
        plain(ax)
    legend_below(figure, figure.axes)
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
    speeds, _, response = steady_linear(motion.system, np.linspace(min(first, last), max(first, last), 1000))
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
    legend_below(figure, [above])
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


def _draw_spectrum(motion: MotionRun, i: int, ax: Axes) -> None:
    """Amplitude of what whirls with the rotation and against it, over orders, or Hz where nothing turns."""
    z = motion.z[motion.time.size // 2 :, i]
    weight = np.hanning(z.size + 2)[1:-1]
    lines = 1e6 * np.abs(np.fft.fft(weight * (z - z.mean()))) / weight.sum()
    order = np.fft.fftfreq(z.size, motion.time[1]) / (motion.speeds[0] / (2 * np.pi) or 1.0)
    for sign, label, style in ((1, "with the rotation", look(0)), (-1, "against it", look(1))):
        part = (sign * order > 0) & ((sign * order < _LARGEST_ORDER) | (motion.speeds[0] == 0))
        at = np.argsort(sign * order[part])
        ax.plot(sign * order[part][at], lines[part][at], label=label, **{**style, "linewidth": 1.0})
    ax.set(ylabel="amplitude, µm", ylim=(0, None))


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
    ax.plot(CIRCLE.real, CIRCLE.imag, color=DARK)
    Z = np.array([at.position / [one.wall for one in at.bearings] for at in resting])
    marked = np.unique(np.linspace(0, len(resting) - 1, 5).round().astype(int)).tolist()
    for k, (path, label) in enumerate(zip(Z.T, labels, strict=True)):
        ax.plot(path.real, path.imag, marker="o", label=label, markersize=4, markevery=marked, **look(k))
    for end in (0, -1):
        inwards = end == 0 and abs(Z[0, 0]) < 0.6  # where neither wall nor the other speed is
        shift, side = ((7.0, 0.0), "left") if inwards else ((-7.0, 0.0), "right")
        at = (Z[end, 0].real, Z[end, 0].imag)
        note(ax, rpm_text(resting[end].speed), at, shift, ha=side, va="center")
    arrow = {"arrowstyle": "-|>", "color": DARK}
    load = resting[-1].load.sum()
    tip = 0.32 * load / (abs(load) or 1.0)
    ax.annotate("", (-0.4 + tip.real, 0.45 + tip.imag), (-0.4, 0.45), arrowprops=arrow)
    note(ax, "load" if load else "no load", (-0.4, 0.45), (0, 4), color=DARK, ha="center")
    ax.annotate("", (0.36, 0.6), (0.52, 0.4), arrowprops={**arrow, "connectionstyle": "arc3,rad=0.25"})
    note(ax, "Ω", (0.46, 0.54), (2, 2), color=DARK)
    ax.set(xlabel="x by clearance", ylabel="y by clearance", aspect="equal")
    ax.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.02, 0.5))
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
        speeds, sizes = branch.speeds * RPM, 1e6 * amplitudes(branch.points, directions)[:, 0]
        unstable, marker = ~branch.stable, "" if len(speeds) > 1 else "o"
        near = np.append(unstable[1:], False) | np.append(False, unstable[:-1])  # up to the next stable ones
        for part, word, style in ((~unstable, "stable", "-"), (unstable | near, "unstable", "--")):
            if part.any():
                drawn: dict[str, Any] = {"color": colors[branch.kind], "linewidth": 1.6, "marker": marker}
                drawn["label"] = f"{branch.kind}, {word}"
                ax.plot(speeds, np.where(part, sizes, np.nan), style, clip_on=False, **drawn)
        for orbit, (size, *_) in zip(
            branch.bifurcations, amplitudes(branch.bifurcations, directions), strict=True
        ):
            marker = MARKERS[KINDS.index(orbit.bifurcation)]
            drawn = {"color": DARK, "markersize": 5, "zorder": 3, "label": orbit.bifurcation}
            ax.plot(orbit.speed * RPM, 1e6 * size, marker, **drawn)
    for speed, before, after in jumps(branches, directions):
        tip, tail = ((speed * RPM, 1e6 * size[0]) for size in (after, before))
        ax.annotate("", tip, tail, arrowprops={"arrowstyle": "->", "color": DARK, "shrinkA": 4})
        where: dict[str, Any] = {"rotation": 90, "va": "center", "ha": "right", "bbox": BOX, "color": DARK}
        word = "jump up" if after[0] > before[0] else "jump down"
        note(ax, word, (tip[0], (tip[1] + tail[1]) / 2), (-3, 0), **where)
    ax.set(xlabel="speed, rpm", ylabel=f"amplitude at {label}, µm")
    ax.set_ylim(bottom=0.0)
    plain(ax)
    rad_s_above(ax)
    pairs = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    legend_above(ax, height=1.12, handles=list(pairs.values()), labels=list(pairs))
