"""Pictures of vibration over speed: amplitude and phase, polar curves, influence coefficients, orbits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fem.orbits import DIRECTION_NAMES, orbits
from fem.peaks import smooth_curves
from fem.plots.campbell import shade_operating, shade_unstable
from fem.plots.rotor import draw_rotor
from fem.rotor import SensorLike, as_sensor, label
from fem.stability import Window, within
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.base.plot_style import (
    ABOVE_SCALE,
    BOX,
    COLORS,
    DARK,
    MARKERS,
    STYLES,
    TEXT,
    WIDTH,
    legend_above,
    legend_below,
    look,
    new_axes,
    new_figure,
    note,
    on_figure,
    plain,
    second_scale,
)
from rotorid.base.text import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    from fem.peaks import Peaks
    from fem.response import InfluenceCoefficients, Response
    from fem.rotor import Rotor


def draw_response(
    response: Response, ax: Axes | None = None, nodes: Sequence[str | int] | None = None
) -> Axes:
    """Draw amplitude over speed at some nodes: the longer half axis of their orbits.

    By default at the named stations, or else at the supports.
    """
    if nodes is None:
        nodes = [*response.rotor.stations] or [support.node for support in response.rotor.supports]
    labels = [f"node {node}" for node in nodes]
    curves = 1e6 * response.major[:, [response.column(node) for node in nodes]]
    return _amplitudes(ax, response, curves, labels, "amplitude, µm peak")


def influence_figure(influence: InfluenceCoefficients, rotor: Rotor) -> Figure:
    """Size and phase of the influence coefficients over speed below the rotor: a row for each sensor."""
    names = [label(sensor) for sensor in influence.sensors]
    figure = new_figure(2.4 + 2.1 * len(names))
    grid = figure.add_gridspec(1 + len(names), 2)
    draw_rotor(rotor, figure.add_subplot(grid[0, :]), planes=influence.planes, sensors=influence.sensors)
    labels = [f"plane {plane}" for plane in influence.planes]
    for c, name in enumerate(names):
        sizes, phases = (figure.add_subplot(grid[1 + c, k]) for k in (0, 1))
        W, words = influence.W[:, c], f"sensor {name}\nµm per g·mm"
        _amplitudes(sizes, influence, W, labels, words).legend_ = None
        _phases(phases, influence, W, labels)
    legend_below(figure, (sizes,), 3)
    return figure


def bode_figure(
    response: Response,
    sensors: Sequence[SensorLike],
    peaks: Sequence[Peaks] = (),
    *,
    operating: tuple[float, float] | None = None,
) -> Figure:
    """Make a figure of the amplitude and phase of sensors over speed.

    Parameters
    ----------
    response
        Without a steady state speeds are hatched, and nothing is drawn there.
    sensors
        Nodes or stations, in x, or with an angle.
    peaks
        Of each sensor, to mark on its curves; none if empty.
    operating
        Range of operating speeds, rad/s, shaded.
    """
    figure = new_figure(6.0)
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    omega, Z, labels = response.speeds, response.readings(sensors), [str(label(each)) for each in sensors]
    shade_operating(above, operating)
    shade_operating(below, operating)
    _amplitudes(above, response, 1e6 * Z, labels, "amplitude, µm peak").set_xlabel("")
    _phases(below, response, Z, labels)
    for k, each in enumerate(peaks):
        places = np.array([peak.speed for peak in each.peaks]) * RPM
        for line in (above.get_lines()[k], below.get_lines()[k]):
            height = np.interp(places, line.get_xdata(), line.get_ydata())
            line.axes.plot(places, height, MARKERS[k % len(MARKERS)], color=line.get_color(), markersize=7)
    written: list[float] = []  # of peaks too close for two words the largest
    for peak in sorted((peak for each in peaks for peak in each.peaks), key=lambda peak: -peak.amplitude):
        if all(abs(peak.speed - speed) > 0.06 * np.ptp(omega) for speed in written):
            written.append(peak.speed)
            factor = "" if peak.amplification is None else f"\nAF {peak.amplification:.1f}"
            at, words = (peak.speed * RPM, 0.0), f"{peak.speed * RPM:.0f} rpm{factor}"
            across = ("data", "axes fraction")
            note(above, words, at, (3, 5), xycoords=across, rotation=90, va="bottom", bbox=BOX)
            for ax in (above, below):
                ax.axvline(at[0], color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
    return figure


def draw_polar(
    speeds: ArrayLike,
    readings: ArrayLike,
    labels: Sequence[str],
    ax: Axes | None = None,
    *,
    marks: int = 6,
    windows: Sequence[Window] = (),
) -> Axes:
    """Draw readings as curves in the plane (Nyquist): distance is amplitude, angle is phase lead.

    Parameters
    ----------
    speeds
        rad/s, shape (S,), ascending.
    readings
        Complex peak amplitudes, m, positive phase = lead, shape (S, C).
    labels
        Of the readings, length C.
    ax
        Polar axes; new ones if None.
    marks
        About how many speeds to write along each curve.
    windows
        Ranges without a steady response, which are left out.
    """
    ax = new_axes((WIDTH, 6.6), projection="polar") if ax is None else ax
    omega, Z = np.asarray(speeds, float), 1e6 * np.asarray(readings, complex)
    Z = np.where(within(windows, omega)[:, None], np.nan, Z)
    room, marked = 0.08 * np.nanmax(np.abs(Z)), np.zeros(0)
    for k, (reading, name) in enumerate(zip(Z.T, labels, strict=True)):
        ax.plot(np.angle(reading), np.abs(reading), linewidth=1.6, label=name, **look(k))
        there, color = np.flatnonzero(~np.isnan(reading)), COLORS[k % len(COLORS)]
        way = np.cumsum(np.abs(np.diff(reading[there], prepend=0)))  # along it a resonance gets its share
        for i in there[np.searchsorted(way, np.linspace(way[0], way[-1], marks + 1))] if there.size else ():
            if (np.abs(marked - (z := reading[i])) < room).any():
                continue
            marked, angle = np.append(marked, z), np.angle(z)
            ax.plot(angle, abs(z), MARKERS[k % len(MARKERS)], color=color, markersize=6, zorder=4)
            outwards = (20 * np.cos(angle), 11 * np.sin(angle))
            words = f"{omega[i] * RPM:.0f}"
            note(ax, words, (angle, abs(z)), outwards, ha="center", va="center", color=color, bbox=BOX)
    ax.grid(color="#d0d5dc", linewidth=0.8)
    ax.set_title("amplitude, µm peak, over phase lead, degrees; marks: speed, rpm", fontsize=TEXT)
    legend_above(ax, height=-0.08)
    return ax


def polar_figure(response: Response, sensors: Sequence[SensorLike]) -> Figure:
    """Make a figure of the readings as smooth curves in the plane, as `draw_polar`."""
    fine, labels = smooth_curves(response, sensors), [str(label(sensor)) for sensor in sensors]
    Z, marks = fine.readings(sensors), max(2, 14 // len(labels))
    return on_figure(
        lambda ax: draw_polar(fine.speeds, Z, labels, ax, marks=marks, windows=fine.windows),
        height=7.2,
        projection="polar",
    )


def draw_orbits(
    x: ArrayLike, y: ArrayLike, labels: Sequence[str], ax: Axes | None = None, *, title: str = ""
) -> Axes:
    """Draw orbits: a mark where the phase mark passes, an arrow in the direction of motion.

    Forward whirl (with the rotation, anticlockwise) is a solid line, backward whirl a dashed one.

    Parameters
    ----------
    x, y
        Complex peak amplitudes of the two directions, m, shape (n,): x(t) = Re(x e^{iωt}).
    labels
        Of the orbits, length n.
    ax
        Axes to draw into; new ones if None.
    title
        Above the legend, such as the speed.
    """
    ax = new_axes((WIDTH, 6)) if ax is None else ax
    turn, motions = np.exp(1j * np.linspace(0.0, 2 * np.pi, 241)), np.stack((x, y), axis=1)
    for k, (motion, name) in enumerate(zip(motions, labels, strict=True)):
        way, color = float(orbits(*motion).direction), COLORS[k % len(COLORS)]
        path = 1e6 * np.real(np.multiply.outer(motion, turn))
        ax.plot(*path, STYLES[way < 0], color=color, linewidth=1.7, marker=MARKERS[k % len(MARKERS)],
                label=f"{name}, {DIRECTION_NAMES[way] if way else 'straight'}", markevery=[0],
                markersize=9, markeredgecolor="white")  # fmt: skip
        arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 1.6, "mutation_scale": 16}
        ax.annotate("", xy=tuple(path[:, 40]), xytext=tuple(path[:, 34]), arrowprops=arrow)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="x, µm peak", ylabel="y, µm peak")
    ax.margins(0.08)
    plain(ax)
    words = "mark: where the shaft's centre is as the phase mark passes the x axis; rotation anticlockwise"
    legend_above(ax, 2, title=f"{title}\n{words}".strip(), title_fontsize=TEXT)
    return ax


def orbits_figure(response: Response, sensors: Sequence[SensorLike], k: int) -> Figure:
    """Make a figure of the orbits of the sensors' nodes at speed k, from 0, of the response."""
    omega = response.speeds[k]
    places = list(dict.fromkeys(as_sensor(sensor, response.rotor).node for sensor in sensors))
    at, labels = [response.column(place) for place in places], [f"node {place}" for place in places]
    title = f"at {omega * RPM:.0f} rpm = {omega:.5g} rad/s, a stable speed"
    x, y = response.x[k, at], response.y[k, at]
    return on_figure(lambda ax: draw_orbits(x, y, labels, ax, title=title), height=6.0)


def right_angles(ax: Axes) -> MultipleLocator:
    """Ticks of degrees on a vertical axis: not more than eight, of a quarter turn if possible."""
    from matplotlib.ticker import MultipleLocator

    size = np.ptp(ax.get_ylim())
    return MultipleLocator(next(step for step in (15, 30, 45, 90, 180, 360, 1e9) if size / step <= 8))


def _over_speed(
    ax: Axes,
    result: Response | InfluenceCoefficients,
    readings: AnyArray,
    labels: Sequence[str],
    value: Callable[[AnyArray], FloatArray],
) -> None:
    """A value of the readings, shape (S, C), over speed, where there is a steady state and motion."""
    order, windows = np.argsort(result.speeds, kind="stable"), result.windows
    omega = result.speeds[order]
    for k, (reading, name) in enumerate(zip(readings[order].T, labels, strict=True)):
        there, curve = ~within(windows, omega) & (reading != 0), np.full(omega.size, np.nan)
        curve[there] = value(reading[there])
        ax.plot(omega * RPM, curve, label=name, linewidth=1.6, **look(k, omega.size))
    shade_unstable(ax, windows)
    ax.set_xlabel("speed, rpm")
    ax.margins(0.03, 0.1)  # whole marks at the ends
    plain(ax)


def _amplitudes(
    ax: Axes | None,
    result: Response | InfluenceCoefficients,
    readings: AnyArray,
    labels: Sequence[str],
    ylabel: str,
) -> Axes:
    """Sizes over speed, in logarithms where they span much, with a legend above."""
    ax = new_axes() if ax is None else ax
    _over_speed(ax, result, readings, labels, np.abs)
    least, most = ax.dataLim.minposy, ax.dataLim.y1
    if most > 30 * least:
        ax.set(yscale="log", ylim=(max(least / 2, 1e-6 * most), None))
        ylabel += " (log)"
    ax.set_ylabel(ylabel)
    second_scale(ax)
    legend_above(ax, borderaxespad=ABOVE_SCALE)
    return ax


def _phases(
    ax: Axes, result: Response | InfluenceCoefficients, readings: ComplexArray, labels: Sequence[str]
) -> None:
    _over_speed(ax, result, readings, labels, _lag)
    ax.set_ylabel("phase (lead), degrees")
    ax.yaxis.set_major_locator(right_angles(ax))


def _lag(reading: ComplexArray) -> FloatArray:
    """Phase without jumps, degrees, the middle of the curve between -360 and 0: a lag, as engineers read it.

    Half a turn, as without damping, is a lag and no jump: rounding has no say in it.
    """
    phase = np.unwrap(np.degrees(np.angle(reading * np.exp(1e-6j)) - 1e-6), discont=180.1, period=360)
    turns = np.median(phase) / 360 if phase.size else 0.0
    return np.asarray(phase - 360 * np.ceil(np.round(turns, 4)))
