"""Pictures of a motion: over time with spectrum, orbits with phase marks, run-up beside steady response."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import (
    BOX,
    DARK,
    GRID,
    QUIET,
    VERMILION,
    legend_below,
    look,
    new_figure,
    note,
    plain,
)
from rotorid.base.rpm import RPM
from rotorid.motion.run import MotionRun
from rotorid.motion.start import steady_linear
from rotorid.motion.synchronous_part import synchronous_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TURNS = 12
"""Turns of an orbit that is drawn."""
_LARGEST_ORDER = 4.0
_STEADY = 1000
"""Speeds of the steady response."""
_PANELS = 4
_LOWEST_PHASE = -315.0
"""Degrees; phases stand from here on through a whole turn."""
_STEADY_LABEL = "dotted: steady, of the linear rotor"


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
    figure, panels = _panels(motion)
    walls = {i: 1e6 * force.wall for force, i in motion.bearings}
    for i, ax in panels:
        _draw_orbit(motion, i, ax)
        if wall := walls.get(i):
            ax.axhline(0, color=QUIET, linewidth=0.5)
            ax.axvline(0, color=QUIET, linewidth=0.5)
            turn = wall * np.exp(1j * np.linspace(0, 2 * np.pi, 181))
            ax.plot(turn.real, turn.imag, color=DARK, linewidth=1.2)
            note(ax, "clearance", (0.0, wall), (0, 2), color=DARK, ha="center")
        ax.set(xlabel="x, µm", ylabel="y, µm")
    legend_below(figure, figure.axes)
    return figure


def bode_figure(motion: MotionRun) -> Figure:
    """Synchronous part of the deflection in x of a run-up over speed, beside the steady response."""
    figure = new_figure(5.2)
    above, below = figure.subplots(2, sharex=True, height_ratios=[3, 2])
    run, steady = _synchronous(motion), _steady(motion)
    for k, i in enumerate(_shown(motion)):
        for (speed, X), style, label in ((steady, ":", ""), (run, "-", f"node {motion.nodes[i]}")):
            drawn = {"linestyle": style, "color": look(k)["color"], "label": label}
            above.plot(speed * RPM, 1e6 * np.abs(X[:, i]), **drawn)
            phase = (np.angle(X[:, i], deg=True) - _LOWEST_PHASE) % 360 + _LOWEST_PHASE
            phase[1:][np.abs(np.diff(phase)) > 180] = np.nan  # where it begins anew
            below.plot(speed * RPM, phase, **drawn)
    above.plot([], [], ":", color=DARK, label=_STEADY_LABEL)
    above.set(ylabel="1× of x, µm", ylim=(0, None))
    below.set(xlabel="speed, rpm", ylabel="phase lead, °", yticks=range(-270, 1, 90))
    for ax in (above, below):
        plain(ax)
    legend_below(figure, [above])
    return figure


def polar_figure(motion: MotionRun) -> Figure:
    """The same as vectors in the plane, with a few speeds."""
    figure, panels = _panels(motion)
    (speed, X), (_, steady) = _synchronous(motion), _steady(motion)
    for i, ax in panels:
        run, linear = 1e6 * X[:, i], 1e6 * steady[:, i]
        ax.axhline(0, color=GRID)
        ax.axvline(0, color=GRID)
        ax.plot(linear.real, linear.imag, ":", color=DARK, label=_STEADY_LABEL)
        ax.plot(run.real, run.imag, "-", color=look(0)["color"], label="this motion")
        for k in _apart(run):
            ax.plot(run[k].real, run[k].imag, "o", color=look(0)["color"], markersize=4)
            note(ax, f"{speed[k] * RPM:.4g} rpm", (run[k].real, run[k].imag), (4, 3), bbox=BOX)
        ax.set(xlabel="1× of x, cosine, µm", ylabel="sine, lead upwards, µm")
    legend_below(figure, figure.axes)
    return figure


FIGURES: Mapping[str, Callable[[MotionRun], Figure]] = {
    "motion": motion_figure,
    "orbits": orbits_figure,
    "bode": bode_figure,
    "polar": polar_figure,
}
"""By what a picture shows."""


def _shown(motion: MotionRun) -> list[int]:
    """Columns of nodes that are drawn, those of bearings first of all."""
    bearings = [i for _, i in motion.bearings]
    return sorted(sorted(range(len(motion.nodes)), key=lambda i: i not in bearings)[:_PANELS])


def _panels(motion: MotionRun) -> tuple[Figure, list[tuple[int, Axes]]]:
    """A panel of equal scales for each node."""
    shown = _shown(motion)
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure = new_figure(0.9 + 3.2 * rows)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax in axes[len(shown) :]:
        ax.remove()
    panels = list(zip(shown, axes, strict=False))
    for i, ax in panels:
        ax.set_title(f"node {motion.nodes[i]}")
        ax.set_aspect("equal", adjustable="datalim")
        plain(ax)
    return figure, panels


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


def _draw_orbit(motion: MotionRun, i: int, ax: Axes) -> None:
    from scipy.interpolate import CubicSpline

    angle = motion.turned
    k = int(np.searchsorted(angle, angle[-1] - 2 * np.pi * _TURNS)) if angle[-1] > angle[0] else 0
    z = 1e6 * motion.z[k:, i]
    ax.plot(z.real, z.imag, linewidth=0.9, color=look(0)["color"])
    marks = 2 * np.pi * np.arange(np.ceil(angle[k] / (2 * np.pi)), np.floor(angle[-1] / (2 * np.pi)) + 1)
    if z.size > 3 and marks.size and angle[-1] > angle[k]:
        at = CubicSpline(angle[k:], z)(marks)
        ax.plot(at.real, at.imag, "o", markersize=4, color=VERMILION, label="once a turn")


def _synchronous(motion: MotionRun) -> tuple[FloatArray, ComplexArray]:
    if motion.speeds[0] == motion.speeds[1]:
        raise ValueError("at a constant speed there is no curve over speed: --run-up has one")
    return synchronous_part(motion)


def _steady(motion: MotionRun) -> tuple[FloatArray, ComplexArray]:
    """Speeds and steady response of the linear rotor in x at the nodes."""
    at, _, response = steady_linear(
        motion.system, np.linspace(min(motion.speeds), max(motion.speeds), _STEADY)
    )
    return at, response[:, [motion.system.index(node)[0] for node in motion.nodes]]


def _apart(curve: ComplexArray, count: int = 6) -> list[int]:
    """Places evenly along a curve that are not near each other."""
    way = np.cumsum(np.abs(np.diff(curve, prepend=curve[0])))
    found: list[int] = []
    for k in np.searchsorted(way, np.linspace(0, way[-1], count + 2)[1:-1]):
        if all(abs(curve[k] - curve[other]) > 0.25 * np.abs(curve).max() for other in found):
            found.append(int(k))
    return found
