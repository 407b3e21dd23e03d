"""Figures of a response at sensors: amplitude and phase over speed, polar curves, orbits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem.model.sensors import SensorLike, as_sensor, label
from fem.plots.bode import draw_bode, draw_polar
from fem.plots.orbit_paths import draw_orbits
from rotorid.base.plot_style import on_figure
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
) -> Figure:
    """Make a figure as `draw_readings` draws it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    axes = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    draw_readings(response, sensors, peaks, axes, operating=operating)
    return figure


def draw_readings(
    response: Response,
    sensors: Sequence[SensorLike],
    peaks: Sequence[Peaks],
    axes: Sequence[Axes],
    *,
    operating: tuple[float, float] | None = None,
    factors: bool = True,
) -> None:
    """Draw amplitude and phase of sensors, marked where that with the largest reading has its peaks.

    `factors`: amplification factors are written at the marks.
    """
    Z = response.readings(sensors)
    marks = []
    if peaks:
        loudest = int(np.argmax(np.abs(Z[response.steady]).max(axis=0, initial=0.0)))
        for peak in peaks[loudest].peaks:
            known = factors and peak.amplification is not None
            factor = f", AF {peak.amplification:.1f}" if known else ""
            marks.append((peak.speed, f"{peak.speed * RPM:.0f} rpm{factor}"))
    draw_bode(
        response.speeds,
        Z,
        _labels(sensors),
        (axes[0], axes[1]),
        peaks=marks,
        operating=operating,
        windows=response.windows,
    )


def polar_figure(response: Response, sensors: Sequence[SensorLike]) -> Figure:
    """Make a figure of the readings as curves in the plane, as `draw_polar`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 7.5), layout="constrained")
    ax = figure.add_subplot(projection="polar")
    draw_polar(response.speeds, response.readings(sensors), _labels(sensors), ax, windows=response.windows)
    return figure


def orbits_figure(response: Response, sensors: Sequence[SensorLike], k: int) -> Figure:
    """Make a figure of the orbits of the sensors' nodes at speed k, from 0, of the response."""
    names = list(dict.fromkeys(as_sensor(place, response.rotor).node for place in sensors))
    index = [response.column(name) for name in names]
    labels = [f"node {name}" if isinstance(name, int) else name for name in names]
    title = f"{response.speeds[k] * RPM:.0f} rpm = {response.speeds[k]:.5g} rad/s"
    x, y = response.x[k, index], response.y[k, index]
    return on_figure(lambda ax: draw_orbits(x, y, labels, ax, title=title), 7.5, 7.0)


def _labels(sensors: Sequence[SensorLike]) -> list[str]:
    return [str(label(sensor)) for sensor in sensors]
