"""Pictures of a motion: over time with spectrum, orbits with phase marks, run-up beside steady response."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import ComplexArray
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
_MARKED = 0.3
"""Of the largest vector: smaller ones have no speed written beside them."""


def motion_figure(motion: MotionRun) -> Figure:
    """Of each node x and y over time, and beside them the spectrum of the last part."""
    shown = range(min(len(motion.nodes), _PANELS))
    figure = new_figure(1.2 + 1.9 * len(shown))
    axes = np.atleast_2d(figure.subplots(len(shown), 2, sharex="col", width_ratios=[3, 2]))
    for row, (over_time, lines) in enumerate(axes):
        z = 1e6 * motion.z[:, row]
        for k, (name, values) in enumerate((("x", z.real), ("y", z.imag))):
            over_time.plot(motion.time, values, label=name, linewidth=0.7, color=look(k)["color"])
        over_time.set_ylabel(f"node {motion.nodes[row]}, µm")
        _draw_spectrum(motion, row, lines)
        plain(over_time)
        plain(lines)
    axes[-1, 0].set_xlabel("time, s")
    legend_below(figure, [axes[0, 0]])
    return figure


def orbits_figure(motion: MotionRun) -> Figure:
    """Of each node the last turns, a dot at each turn, and the clearance circle of its bearing."""
    shown = range(min(len(motion.nodes), _PANELS))
    columns = min(2, len(shown))
    rows = -(-len(shown) // columns)
    figure = new_figure(0.9 + 3.2 * rows)
    walls = {force.node: 1e6 * force.wall for force, _ in motion.bearings}
    for i in shown:
        ax = figure.add_subplot(rows, columns, i + 1)
        _draw_orbit(motion, i, ax)
        if wall := walls.get(motion.nodes[i]):
            ax.axhline(0, color=QUIET, linewidth=0.5)
            ax.axvline(0, color=QUIET, linewidth=0.5)
            turn = wall * np.exp(1j * np.linspace(0, 2 * np.pi, 181))
            ax.plot(turn.real, turn.imag, color=DARK, linewidth=1.2)
            note(ax, "clearance", (0.0, wall), (0, 2), color=DARK, ha="center")
        ax.set(xlabel="x, µm", ylabel="y, µm", title=f"node {motion.nodes[i]}")
        ax.set_aspect("equal", adjustable="datalim")
        plain(ax)
    legend_below(figure, figure.axes)
    return figure


def bode_figure(motion: MotionRun) -> Figure:
    """Synchronous part of the deflection in x of a run-up over speed, beside the steady response."""
    figure = new_figure(5.2)
    above, below = figure.subplots(2, sharex=True, height_ratios=[3, 2])
    for i, (speed, X, steady_at, steady) in enumerate(_beside(motion)):
        color, name = look(i)["color"], f"node {motion.nodes[i]}"
        for at, value, style, words in (
            (speed, X, "-", name),
            (steady_at, steady, ":", f"{name}, steady, linear"),
        ):
            above.plot(at * RPM, 1e6 * np.abs(value), style, color=color, label=words)
            phase = np.degrees(np.unwrap(np.angle(value)))
            if value is X and steady.size:  # as many turns as the steady response, at the end
                phase -= 360 * np.round((phase[-1] - np.degrees(np.unwrap(np.angle(steady)))[-1]) / 360)
            below.plot(at * RPM, phase, style, color=color)
    above.set(ylabel="1× of x, µm", ylim=(0, None))
    below.set(xlabel="speed, rpm", ylabel="phase lead, °")
    for ax in (above, below):
        plain(ax)
    legend_below(figure, [above])
    return figure


def polar_figure(motion: MotionRun) -> Figure:
    """The same as vectors in the plane, with a few speeds."""
    figure = new_figure(5.6, 6.0)
    ax = figure.add_subplot()
    for i, (speed, X, _, steady) in enumerate(_beside(motion)):
        color, name = look(i)["color"], f"node {motion.nodes[i]}"
        ax.plot(1e6 * X.real, 1e6 * X.imag, "-", color=color, label=name)
        ax.plot(1e6 * steady.real, 1e6 * steady.imag, ":", color=color, label=f"{name}, steady, linear")
        for k in _marked(X) if i == 0 else []:
            at = (1e6 * X[k].real, 1e6 * X[k].imag)
            ax.plot(*at, "o", color=color, markersize=4)
            note(ax, f"{speed[k] * RPM:.4g} rpm", at, (4, 3), bbox=BOX)
    ax.axhline(0, color=GRID)
    ax.axvline(0, color=GRID)
    ax.set(xlabel="1× of x, cosine, µm", ylabel="sine, with phase lead upwards, µm")
    ax.set_aspect("equal", adjustable="datalim")
    plain(ax)
    legend_below(figure, [ax])
    return figure


FIGURES: Mapping[str, Callable[[MotionRun], Figure]] = {
    "motion": motion_figure,
    "orbits": orbits_figure,
    "bode": bode_figure,
    "polar": polar_figure,
}
"""By what a picture shows."""


def _draw_spectrum(motion: MotionRun, i: int, ax: Axes) -> None:
    """Amplitude of what whirls with the rotation and against it, over orders, or Hz where nothing turns."""
    k = motion.time.size // 2 if motion.speeds[0] == motion.speeds[1] else 0
    z = motion.z[k:, i] - motion.z[k:, i].mean()
    weight = np.hanning(z.size + 2)[1:-1]
    lines = 2e6 * np.abs(np.fft.fft(weight * z)) / weight.sum() / 2
    frequency = np.fft.fftfreq(z.size, motion.time[1] - motion.time[0])
    turns = motion.speeds[1] / (2 * np.pi) if motion.speeds[0] == motion.speeds[1] else 0.0
    largest = _LARGEST_ORDER if turns else _LARGEST_ORDER * max(motion.speeds) / (2 * np.pi) / 2
    order = frequency / (turns or 1.0)
    for sign, words, style in ((1, "with the rotation", look(0)), (-1, "against it", look(1))):
        part = (sign * order > 0) & (sign * order < (largest or np.inf))
        shown = np.argsort(sign * order[part])
        ax.plot(sign * order[part][shown], lines[part][shown], label=words, **{**style, "linewidth": 1.0})
    ax.set_ylabel("amplitude, µm")
    ax.set_ylim(0, None)
    if i == min(len(motion.nodes), _PANELS) - 1:
        ax.set_xlabel("frequency, cycles a turn" if turns else "frequency, Hz")
    if i == 0:
        ax.legend(frameon=False, fontsize="small")


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


def _beside(motion: MotionRun) -> list[tuple[np.ndarray, ComplexArray, np.ndarray, ComplexArray]]:
    """Of each node: speeds and synchronous part, speeds and steady response of the linear rotor, in x."""
    first, last = motion.speeds
    if first == last:
        raise ValueError("at a constant speed there is no curve over speed: --run-up has one")
    speed, X = synchronous_part(motion)
    at, _, response = steady_linear(motion.system, np.linspace(min(first, last), max(first, last), _STEADY))
    columns = [motion.system.index(node)[0] for node in motion.nodes]
    return [(speed, X[:, i], at, response[:, column]) for i, column in enumerate(columns)][:_PANELS]


def _marked(X: ComplexArray, count: int = 9) -> list[int]:
    """Places evenly along a curve, where it is far from the centre."""
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(X)))])
    places = np.searchsorted(way, np.linspace(0, way[-1], count)).clip(0, X.size - 1)
    return [int(k) for k in places if abs(X[k]) > _MARKED * np.abs(X).max()]
