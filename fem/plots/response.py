"""Pictures of vibration over speed: amplitude and phase, polar curves, influence coefficients, orbits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fem.orbits import DIRECTION_NAMES, orbits
from fem.peaks import smooth_curves
from fem.plots.rotor import draw_rotor
from fem.rotor import SensorLike, as_sensor, label
from fem.stability import Window, within
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.plot_style import (
    ABOVE_SCALE,
    BOX,
    COLORS,
    DARK,
    MARKERS,
    QUIET,
    STYLES,
    TEXT,
    WIDTH,
    legend_above,
    legend_below,
    look,
    new_axes,
    new_figure,
    new_pair,
    note,
    on_figure,
    plain,
    rad_s_above,
    shade_operating,
    shade_unstable,
)
from rotorid.base.rpm import RPM
from rotorid.base.text import counted
from rotorid.base.unit_words import Shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    from fem.peaks import Peaks
    from fem.response import InfluenceCoefficients, Response
    from fem.rotor import Rotor

MICROMETRES = Shown("µm peak", 1e6)
_ROWS, _ORBITS = 5, 4  # sensors and orbits that one picture tells apart


def draw_response(
    response: Response, ax: Axes | None = None, nodes: Sequence[str | int] | None = None
) -> Axes:
    """Draw amplitude over speed at some nodes: the longer half axis of their orbits.

    By default at the named stations, or at the supports, and where the rotor moves most.
    """
    amplitude = response.major
    if nodes is None:
        named: list[str | int] = [*response.rotor.stations]
        named = named or [support.node for support in response.rotor.supports]
        largest = np.where(response.steady[:, None], amplitude, 0.0).max(axis=0)
        nodes = list(dict.fromkeys([*named, int(response.nodes[np.argmax(largest)])]))
    labels = [f"node {node}" if isinstance(node, int) else str(node) for node in nodes]
    curves = 1e6 * amplitude[:, [response.column(node) for node in nodes]]
    return _amplitudes(ax, response.speeds, curves, labels, "amplitude, µm peak", response.windows)


def draw_influence(influence: InfluenceCoefficients, ax: Axes | None) -> Axes:
    """Draw the size of each influence coefficient over speed, µm per g·mm (1 m per kg·m)."""
    labels = [
        f"sensor {label(sensor)}, plane {plane}" for sensor in influence.sensors for plane in influence.planes
    ]
    sizes = np.abs(influence.W).reshape(influence.speeds.size, -1)
    return _amplitudes(ax, influence.speeds, sizes, labels, "influence, µm per g·mm", influence.windows)


def influence_figure(influence: InfluenceCoefficients, rotor: Rotor) -> Figure:
    """Size and phase of the influence coefficients over speed below the rotor: a row for each sensor.

    Of many sensors the first five have one; how many have none stands in the legend.
    """
    shown = influence.sensors[:_ROWS]
    figure = new_figure(2.4 + 2.1 * len(shown))
    grid = figure.add_gridspec(1 + len(shown), 2)
    draw_rotor(rotor, figure.add_subplot(grid[0, :]), planes=influence.planes, sensors=influence.sensors)
    order, windows = np.argsort(influence.speeds, kind="stable"), tuple(influence.windows)
    speeds = influence.speeds[order]
    labels = [f"plane {plane}" for plane in influence.planes]
    rows = [[figure.add_subplot(grid[1 + c, k]) for k in (0, 1)] for c in range(len(shown))]
    for c, (sizes, phases) in enumerate(rows):
        W, title = influence.W[order, c], f"sensor {label(shown[c])}\nµm per g·mm"
        _amplitudes(sizes, speeds, np.abs(W), labels, title, windows).get_legend().remove()
        _phases(phases, speeds, W, windows)
        if c < len(shown) - 1:
            sizes.set_xlabel("")
            phases.set_xlabel("")
    left = len(influence.sensors) - len(shown)
    more: dict[str, Any] = {"title": f"{counted(left, 'more sensor')}: only in the table"} if left else {}
    legend_below(figure, (rows[0][0],), 3, **more)
    return figure


def draw_bode(
    speeds: ArrayLike,
    readings: ArrayLike,
    labels: Sequence[str],
    axes: Sequence[Axes] | None = None,
    *,
    peaks: Sequence[Peaks] = (),
    factors: bool = True,
    operating: tuple[float, float] | None = None,
    windows: Sequence[Window] = (),
) -> tuple[Axes, Axes]:
    """Draw amplitude and phase of readings over speed; return both axes.

    Parameters
    ----------
    speeds
        rad/s, shape (S,), ascending.
    readings
        Complex peak amplitudes, m, positive phase = lead, shape (S, C).
    labels
        Of the readings, length C.
    axes
        For the amplitude and for the phase; new ones if None.
    peaks
        Of each reading, to mark on its curves; none if empty.
    factors
        Whether amplification factors are written beside the speeds of the peaks.
    operating
        Range of operating speeds, rad/s, shaded.
    windows
        Ranges without a steady response: hatched, and nothing is drawn there.
    """
    above, below = new_pair(5.8) if axes is None else axes
    omega, Z = np.asarray(speeds, float), np.asarray(readings, complex)
    shade_operating(above, operating)
    _amplitudes(above, omega, 1e6 * np.abs(Z), labels, "amplitude, µm peak", windows)
    _phases(below, omega, Z, windows)
    shade_operating(below, operating)
    above.set_xlabel("")
    above.tick_params(labelbottom=False)
    for k, each in enumerate(peaks):
        places = np.array([peak.speed for peak in each.peaks]) * RPM
        for line in (above.get_lines()[k], below.get_lines()[k]):
            height = np.interp(places, line.get_xdata(), line.get_ydata())
            line.axes.plot(places, height, MARKERS[k % len(MARKERS)], color=line.get_color(), markersize=7)
    for speed, text in _peak_labels(peaks, factors, 0.06 * (omega[-1] - omega[0])):
        at, across = (speed * RPM, 0.0), ("data", "axes fraction")
        note(above, text, at, (3, 5), xycoords=across, rotation=90, va="bottom", bbox=BOX)
        for ax in (above, below):
            ax.axvline(speed * RPM, color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
    return above, below


def bode_figure(
    response: Response,
    sensors: Sequence[SensorLike],
    peaks: Sequence[Peaks] = (),
    *,
    operating: tuple[float, float] | None = None,
    factors: bool = True,
    figure: Figure | None = None,
) -> Figure:
    """Make a figure of the amplitude and phase of sensors over speed, each marked at its peaks.

    `factors`: amplification factors are written at the marks. `figure`: what to draw on instead of a new one.
    """
    figure = new_figure(6.0) if figure is None else figure
    Z, labels = response.readings(sensors), [str(label(sensor)) for sensor in sensors]
    axes = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    options: dict[str, Any] = {"peaks": peaks, "factors": factors, "operating": operating}
    draw_bode(response.speeds, Z, labels, axes, windows=response.windows, **options)
    return figure


def draw_polar(
    speeds: ArrayLike,
    readings: ArrayLike,
    labels: Sequence[str],
    ax: Axes | None = None,
    *,
    marks: int = 6,
    windows: Sequence[Window] = (),
    unit: Shown = MICROMETRES,
    lag: bool = False,
) -> Axes:
    """Draw readings as curves in the plane (Nyquist): distance is amplitude, angle is phase lead.

    Parameters
    ----------
    speeds, readings, labels
        As for `draw_bode`.
    ax
        Polar axes; new ones if None.
    marks
        About how many speeds to write along each curve.
    windows
        Ranges without a steady response, which are left out.
    unit
        Of the amplitudes.
    lag
        Whether angles are written as lags, which grow against the rotation, clockwise.
    """
    ax = new_axes((WIDTH, 6.6), projection="polar") if ax is None else ax
    omega, Z = np.asarray(speeds, float), np.asarray(readings, complex)
    Z = np.where(within(tuple(windows), omega)[:, None], np.nan, Z)
    room, marked = 0.08 * np.nanmax(np.abs(Z)), np.zeros(0, complex)
    for k, (reading, name) in enumerate(zip(Z.T, labels, strict=True)):
        style, there = look(k), ~np.isnan(reading)
        rpm, curve = omega[there] * RPM, reading[there]
        phase = _with_gaps(np.unwrap(np.angle(curve)), there)
        ax.plot(phase, unit.scale * np.abs(reading), linewidth=1.6, label=name, **style)
        for speed in _round_speeds(rpm, curve, marks):
            z = complex(np.interp(speed, rpm, curve))
            if (np.abs(marked - z) < room).any():
                continue
            marked, angle = np.append(marked, z), float(np.angle(z))
            at, color = (angle, unit.scale * abs(z)), style["color"]
            ax.plot(*at, MARKERS[k % len(MARKERS)], color=color, markersize=6, zorder=4)
            outwards = (20 * np.cos(angle), 11 * np.sin(angle))
            note(ax, f"{speed:.0f}", at, outwards, ha="center", va="center", color=color, bbox=BOX)
    ax.grid(color="#d0d5dc", linewidth=0.8)
    way = "phase lag, degrees, against the rotation" if lag else "phase lead, degrees"
    ax.set_title(f"amplitude, {unit.word}, over {way}; marks: speed, rpm", fontsize=TEXT)
    if lag:
        leads = range(0, 360, 45)
        ax.set_xticks(np.radians(leads), [f"{-angle % 360}°" for angle in leads])
    legend_above(ax, height=-0.08)
    ax.set_rlabel_position(22.5)
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
    turn = np.exp(1j * np.linspace(0.0, 2 * np.pi, 241))
    X, Y = np.atleast_1d(np.asarray(x, complex)), np.atleast_1d(np.asarray(y, complex))
    ways = orbits(X, Y).direction.tolist()
    for k, (a, b, name, way) in enumerate(zip(X, Y, labels, ways, strict=True)):
        color, word = COLORS[k % _ORBITS], DIRECTION_NAMES[way] if way else "straight"
        path = 1e6 * np.real(np.stack((a * turn, b * turn)))
        ax.plot(*path, STYLES[way < 0], color=color, linewidth=1.7,
                label=f"{name}, {word}", marker=MARKERS[k % len(MARKERS)], markevery=[0],
                markersize=9, markeredgecolor="white")  # fmt: skip
        arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 1.6, "mutation_scale": 16}
        ax.annotate("", xy=tuple(path[:, 40]), xytext=tuple(path[:, 34]), arrowprops=arrow)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="x, µm peak", ylabel="y, µm peak")
    ax.margins(0.08)
    plain(ax)
    for line in (ax.axhline, ax.axvline):
        line(0, color="#9aa2ad", linewidth=0.7, zorder=0.5)
    words = "mark: where the shaft's centre is as the phase mark passes the x axis; rotation anticlockwise"
    legend_above(ax, 2, title=f"{title}\n{words}".strip(), title_fontsize=TEXT)
    return ax


def orbits_figure(response: Response, sensors: Sequence[SensorLike], k: int) -> Figure:
    """Make a figure of the orbits of the sensors' nodes at speed k, from 0, of the response.

    Of more than four, the four largest are drawn.
    """
    rotor, omega = response.rotor, response.speeds[k]
    places = list(dict.fromkeys(as_sensor(sensor, rotor).node for sensor in sensors))
    columns = np.array([response.column(place) for place in places])
    largest = np.sort(np.argsort(-response.major[k, columns], kind="stable")[:_ORBITS])
    some = "" if len(places) <= _ORBITS else f", the {_ORBITS} largest orbits of {len(places)}"
    title = f"at {omega * RPM:.0f} rpm = {omega:.5g} rad/s, a stable speed{some}"
    labels = [f"node {places[i]}" if isinstance(places[i], int) else str(places[i]) for i in largest]
    x, y = response.x[k, columns[largest]], response.y[k, columns[largest]]
    return on_figure(lambda ax: draw_orbits(x, y, labels, ax, title=title), height=6.0)


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


def right_angles(ax: Axes) -> MultipleLocator:
    """Ticks of degrees on a vertical axis: not more than eight, of a quarter turn if possible."""
    from matplotlib.ticker import MultipleLocator

    low, high = sorted(ax.get_ylim())
    return MultipleLocator(next(step for step in (15, 30, 45, 90, 180, 360, 1e9) if (high - low) / step <= 8))


def _amplitudes(
    ax: Axes | None,
    speeds: FloatArray,
    curves: FloatArray,
    labels: Sequence[str],
    ylabel: str,
    windows: Sequence[Window],
) -> Axes:
    """Curves over ascending speed, in logarithms where they span much, with a legend above."""
    ax = new_axes() if ax is None else ax
    curves = np.where(within(tuple(windows), speeds)[:, None], np.nan, curves)
    order = np.argsort(speeds, kind="stable")
    for k, (curve, name) in enumerate(zip(curves.T, labels, strict=True)):
        ax.plot(speeds[order] * RPM, curve[order], label=name, **_style(k, speeds.size))
    shade_unstable(ax, [(window.first, window.last) for window in windows])
    positive = curves[curves > 0]
    if positive.size and positive.max() > 30 * positive.min():
        ax.set_yscale("log")
        ax.set_ylim(bottom=max(positive.min() / 2, positive.max() * 1e-6))
        ylabel += " (log)"
    ax.set(xlabel="speed, rpm", ylabel=ylabel)
    ax.margins(x=0.01)
    plain(ax)
    rad_s_above(ax)
    legend_above(ax, 2 if max(map(len, labels), default=0) > 25 else 3, borderaxespad=ABOVE_SCALE)
    return ax


def _phases(ax: Axes, speeds: FloatArray, readings: ComplexArray, windows: Sequence[Window]) -> None:
    """Phase without jumps over ascending speeds, each curve moved by whole turns to be a lag."""
    steady = ~within(tuple(windows), speeds)
    for k, reading in enumerate(readings.T):
        there = steady & (np.abs(reading) > 0)
        shown = there | ~steady
        phase = _with_gaps(np.degrees(_lag(reading[there])), there)
        ax.plot(speeds[shown] * RPM, phase[shown], **_style(k, speeds.size))
    shade_unstable(ax, [(window.first, window.last) for window in windows])
    plain(ax)
    ax.margins(x=0.01)
    ax.set(xlabel="speed, rpm", ylabel="phase (lead), degrees")
    ax.yaxis.set_major_locator(right_angles(ax))


def _lag(reading: ComplexArray) -> FloatArray:
    """Phase without jumps, rad, the middle of the curve between -2π and 0: a lag, as engineers read it."""
    if not reading.size:
        return np.zeros(0)
    phase = np.unwrap(np.angle(reading))
    turned = reading * np.exp(-1j * phase[0])
    if (abs(turned.imag) <= 1e-9 * abs(turned)).all():  # no damping: half a turn, which is called a lag
        phase = phase[0] - np.pi * (turned.real < 0)
    return np.asarray(phase - 2 * np.pi * np.ceil(np.round(np.median(phase) / (2 * np.pi), 4)))


def _peak_labels(peaks: Sequence[Peaks], factors: bool, width: float) -> list[tuple[float, str]]:
    """Speed, rad/s, and words of the peaks of all readings; of those closer than `width` the largest one."""
    labels: list[tuple[float, str]] = []
    for peak in sorted((peak for each in peaks for peak in each.peaks), key=lambda peak: -peak.amplitude):
        if all(abs(peak.speed - speed) > width for speed, _ in labels):
            factor = f"\nAF {peak.amplification:.1f}" if factors and peak.amplification is not None else ""
            labels.append((peak.speed, f"{peak.speed * RPM:.0f} rpm{factor}"))
    return labels


def _with_gaps(values: FloatArray, there: BoolArray) -> FloatArray:
    """Values of the places that are there, with NaN at the others."""
    out = np.full(there.shape, np.nan)
    out[there] = values
    return out


def _round_speeds(rpm: FloatArray, curve: ComplexArray, marks: int) -> list[float]:
    """Speeds evenly spaced along a curve, so that a resonance gets its share, in whole rpm."""
    way = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(curve)))))
    speeds = np.interp(np.linspace(0, way[-1], marks + 1), way, rpm)
    speeds[1:-1] = np.clip(np.round(speeds[1:-1]), rpm[0], rpm[-1])
    return list(dict.fromkeys(speeds.tolist()))


def _style(k: int, points: int) -> dict[str, Any]:
    """Colour and style of curve k, with marks where there are few points, or more curves than line styles."""
    style: dict[str, Any] = {"linewidth": 1.6, **look(k)}
    if points < 12 or k >= len(STYLES):
        style |= {"marker": MARKERS[k % len(MARKERS)], "markevery": max(points // 8, 1), "markersize": 6}
    return style
