"""Figures of a response at sensors: amplitude and phase over speed, polar curves, orbits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem.model.sensors import SensorLike, as_sensor, label
from fem.parameter_bands import NORMAL_95
from fem.peak_refinement import smooth_curves
from fem.plots.bode import draw_bode, draw_polar
from fem.plots.drawing import draw_rotor
from fem.plots.orbit_paths import MOST_ORBITS, draw_orbits
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    COLORS,
    MARKERS,
    QUIET,
    legend_above,
    look,
    new_axes,
    new_figure,
    on_figure,
    shade_bands,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem.api684_peaks import Peaks
    from fem.response_result import Response


def bode_figure(
    response: Response,
    sensors: Sequence[SensorLike],
    peaks: Sequence[Peaks] = (),
    *,
    operating: tuple[float, float] | None = None,
    factors: bool = True,
    figure: Figure | None = None,
    std: FloatArray | None = None,
) -> Figure:
    """Make a figure of the amplitude and phase of sensors over speed, each marked at its peaks.

    `factors`: amplification factors are written at the marks. `figure`: what to draw on instead of a new one.
    `std`: standard deviations of the amplitudes, m, shape (S, C): 95 % are shaded.
    """
    figure = new_figure(6.0) if figure is None else figure
    Z = response.readings(sensors)
    above, _ = draw_bode(
        response.speeds,
        Z,
        _labels(sensors),
        figure.subplots(2, sharex=True, height_ratios=(3, 2)),
        peaks=peaks,
        factors=factors,
        operating=operating,
        windows=response.windows,
    )
    if std is not None:
        middle = np.where(response.steady[:, None], 1e6 * np.abs(Z), np.nan)
        half = NORMAL_95 * 1e6 * std
        colors = (look(k)["color"] for k in range(len(sensors)))
        shade_bands(above, response.speeds * RPM, middle, half, colors)
        above.set_ylim(top=max(above.get_ylim()[1], 1.05 * np.nanmax(middle + half, initial=0.0)))
    return figure


def polar_figure(response: Response, sensors: Sequence[SensorLike]) -> Figure:
    """Make a figure of the readings as smooth curves in the plane, as `draw_polar`."""
    fine = smooth_curves(response, sensors)
    Z, labels = fine.readings(sensors), _labels(sensors)
    return on_figure(
        lambda ax: draw_polar(
            fine.speeds, Z, labels, ax, marks=max(2, 14 // len(labels)), windows=fine.windows
        ),
        height=7.2,
        projection="polar",
    )


def orbits_figure(response: Response, sensors: Sequence[SensorLike], k: int) -> Figure:
    """Make a figure of the orbits of the sensors' nodes at speed k, from 0, of the response.

    Above them is the rotor with their places. Of more than four, the four largest are drawn.
    """
    rotor = response.rotor
    places = list(dict.fromkeys(as_sensor(place, rotor).node for place in sensors))
    order = np.argsort([-response.major[k, response.column(name)] for name in places], kind="stable")
    names = [places[i] for i in sorted(order[:MOST_ORBITS])]
    index = [response.column(name) for name in names]
    some = "" if len(names) == len(places) else f", the {MOST_ORBITS} largest orbits of {len(places)}"
    omega = response.speeds[k]
    title = f"at {omega * RPM:.0f} rpm = {omega:.5g} rad/s, a stable speed{some}"
    figure = new_figure(7.4)
    above, below = figure.subplots(2, height_ratios=(1, 3))
    draw_rotor(rotor, above, height=1.0)
    for part in above.collections:
        part.set_color(QUIET)
    for i, name in enumerate(names):
        place = rotor.positions[rotor.node(name) - 1]
        color, marker = COLORS[i], MARKERS[i]
        above.plot([place, place], [-1.3, 1.3], color=color, marker=marker, markersize=8, zorder=6)
    above.set(xlabel="position, m", yticks=[], ylim=(-1.5, 1.5))
    above.spines["left"].set_visible(False)
    labels = [f"node {name}" if isinstance(name, int) else name for name in names]
    draw_orbits(response.x[k, index], response.y[k, index], labels, below, title=title)
    return figure


def draw_deflected_shape(response: Response, k: int, ax: Axes | None = None) -> Axes:
    """Draw the deflected shape of the rotor at speed k, from 0, of a response of all nodes.

    The larger half axis of each node's orbit, µm peak, with the sign of its motion in the phase of the node
    that moves most, over the rotor.
    """
    ax = new_axes() if ax is None else ax
    amplitude, phase = response.major[k], np.angle(response.amplitudes[k])
    shape = 1e6 * amplitude * np.where(np.cos(phase - phase[np.argmax(amplitude)]) < 0, -1.0, 1.0)
    largest = float(np.abs(shape).max())
    draw_rotor(response.rotor, ax, height=0.22 * largest)
    ax.plot(response.rotor.positions[response.nodes - 1], shape, color=COLORS[0], linewidth=2.2, marker="o",
            markersize=4, zorder=5)  # fmt: skip
    ax.axhline(0.0, color=QUIET, linewidth=0.8, zorder=3)
    omega = response.speeds[k]
    ax.set(
        xlabel="position, m",
        ylabel=f"deflection at {omega * RPM:.0f} rpm, µm peak",
        ylim=(-1.12 * largest, 1.12 * largest),
    )
    legend_above(ax, 2, marker_scale=0.6)
    return ax


def _labels(sensors: Sequence[SensorLike]) -> list[str]:
    return [str(label(sensor)) for sensor in sensors]
