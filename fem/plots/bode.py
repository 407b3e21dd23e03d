"""Vibration over speed: amplitudes, Bode and polar plots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fem.model.sensors import label
from fem.plots.drawing import draw_rotor
from fem.windows import Window, ranges, within
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.plot_style import (
    ABOVE_SCALE,
    BOX,
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
    new_pair,
    note,
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

    from fem.api684_peaks import Peak, Peaks
    from fem.model.rotor import Rotor
    from fem.response_result import InfluenceCoefficients, Response


_ROWS = 5
MICROMETRES = Shown("µm peak", 1e6)


def draw_response(
    response: Response, ax: Axes | None = None, nodes: Sequence[str | int] | None = None
) -> Axes:
    """Draw amplitude over speed at some nodes: the longer half axis of their orbits."""
    amplitude = response.major
    if nodes is None:
        # Where a machine is measured, and where it moves most.
        named_nodes: list[str | int] = [*response.rotor.stations]
        named_nodes = named_nodes or [support.node for support in response.rotor.supports]
        largest = np.where(response.steady[:, None], amplitude, 0.0).max(axis=0)
        nodes = list(dict.fromkeys([*named_nodes, int(response.nodes[np.argmax(largest)])]))
    named = [f"node {node}" if isinstance(node, int) else str(node) for node in nodes]
    curves = amplitude[:, [response.column(node) for node in nodes]]
    return _over_speed(ax, response.speeds, 1e6 * curves, named, "amplitude, µm", response.windows)


def draw_influence(influence: InfluenceCoefficients, ax: Axes | None) -> Axes:
    """Draw the size of each influence coefficient over speed."""
    S = influence.speeds.size
    named = [
        f"sensor {label(sensor)}, plane {plane}" for sensor in influence.sensors for plane in influence.planes
    ]
    # 1 m per kg·m is 1 µm per g·mm.
    curves = np.abs(influence.W).reshape(S, -1)
    return _over_speed(ax, influence.speeds, curves, named, "influence, µm per g·mm", influence.windows)


def influence_figure(influence: InfluenceCoefficients, rotor: Rotor) -> Figure:
    """Size and phase of the influence coefficients over speed below the rotor: a row for each sensor.

    Of many sensors the first `_ROWS` have one; how many have none stands in the legend.
    """
    C, planes = min(len(influence.sensors), _ROWS), [f"plane {plane}" for plane in influence.planes]
    figure = new_figure(2.4 + 2.1 * C)
    grid = figure.add_gridspec(1 + C, 2, height_ratios=(2.1, *[2.1] * C))
    draw_rotor(rotor, figure.add_subplot(grid[0, :]), planes=influence.planes, sensors=influence.sensors)
    rows = [[figure.add_subplot(grid[1 + c, k]) for k in (0, 1)] for c in range(C)]
    order, given = np.argsort(influence.speeds, kind="stable"), tuple(influence.windows)
    speeds = influence.speeds[order]
    steady = ~within(given, speeds)
    for c, (sizes, phases) in enumerate(rows):
        W = influence.W[order, c]
        _over_speed(
            sizes, speeds, np.abs(W), planes, f"sensor {label(influence.sensors[c])}\nµm per g·mm", given
        )
        for k, curve in enumerate(W.T):
            seen = steady & (np.abs(curve) > 0)
            phase = _with_gaps(np.degrees(_lag(curve[seen])), seen)
            phases.plot(speeds * RPM, phase, **_look(k, len(planes), speeds, ()))
        shade_unstable(phases, ranges(given))
        plain(phases)
        phases.margins(x=0.01)
        phases.set(xlabel="speed, rpm", ylabel="phase (lead), degrees")
        phases.yaxis.set_major_locator(right_angles(phases))
        if legend := sizes.get_legend():
            legend.remove()
        for ax in rows[c] if c < C - 1 else ():
            ax.set_xlabel("")
    left = len(influence.sensors) - C
    more: dict[str, Any] = {"title": f"{counted(left, 'more sensor')}: only in the table"} if left else {}
    legend_below(figure, (rows[0][0],), 3, **more)
    return figure


def _lag(reading: ComplexArray) -> FloatArray:
    """Phase without jumps, rad, the middle of the curve between -2π and 0: a lag, as engineers read it."""
    if not reading.size:
        return np.zeros(0)
    phase = np.unwrap(np.angle(reading))
    turned = reading * np.exp(-1j * phase[0])
    if (abs(turned.imag) <= 1e-9 * abs(turned)).all():  # no damping: half a turn, which is called a lag
        phase = phase[0] - np.pi * (turned.real < 0)
    return np.asarray(phase - 2 * np.pi * np.ceil(np.round(np.median(phase) / (2 * np.pi), 4)))


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
    _over_speed(
        above, omega, 1e6 * np.abs(Z), labels, "amplitude, µm peak", windows, operating=operating, peaks=peaks
    )
    steady = ~within(tuple(windows), omega)
    for k, reading in enumerate(Z.T):
        seen = steady & (np.abs(reading) > 0)
        phase = np.degrees(_lag(reading[seen]))
        shown = seen | ~steady
        drawn = _look(k, len(labels), omega[shown], peaks)
        below.plot(omega[shown] * RPM, _with_gaps(phase, seen)[shown], **drawn)
    shade_operating(below, operating)
    shade_unstable(below, ranges(windows))
    plain(below)
    below.margins(x=0.01)
    below.set(xlabel="speed, rpm", ylabel="phase (lead), degrees")
    below.yaxis.set_major_locator(right_angles(below))
    above.set_xlabel("")
    above.tick_params(labelbottom=False)
    for speed, text in _together(peaks, factors, 0.06 * (omega[-1] - omega[0])):
        place, across = (speed * RPM, 0.0), ("data", "axes fraction")
        note(above, text, place, (3, 5), xycoords=across, rotation=90, va="bottom", bbox=BOX)
        for ax in (above, below):
            ax.axvline(speed * RPM, color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
    return above, below


def _together(peaks: Sequence[Peaks], factors: bool, width: float) -> list[tuple[float, str]]:
    """Peaks of all readings, those within a width as one: the speed of its largest, rad/s, and its words."""
    groups: list[list[Peak]] = []
    for peak in sorted((peak for each in peaks for peak in each.peaks), key=lambda peak: peak.speed):
        if groups and peak.speed < groups[-1][0].speed + width:
            groups[-1].append(peak)
        else:
            groups.append([peak])
    words = []
    for group in groups:
        known = [peak.amplification for peak in group if peak.amplification is not None]
        factor = f"\nAF {_span(known, '.1f')}" if factors and known else ""
        loudest = max(group, key=lambda peak: peak.amplitude)
        words.append((loudest.speed, f"{_span([peak.speed * RPM for peak in group], '.0f')} rpm{factor}"))
    return words


def _span(values: Sequence[float], form: str) -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"


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
    steady = ~within(tuple(windows), omega)
    omega, Z = omega[steady], Z[steady]
    marked: list[complex] = []
    for k, (reading, named) in enumerate(zip(Z.T, labels, strict=True)):
        curve, phase, size = look(k), np.angle(reading), unit.scale * np.abs(reading)
        read = ~np.isnan(reading)
        phase[read] = np.unwrap(np.angle(reading[read]))
        ax.plot(_with_gaps(phase, steady), _with_gaps(size, steady), linewidth=1.6, label=named, **curve)
        for speed in _along(omega[read] * RPM, reading[read], marks):
            there = complex(np.interp(speed, omega[read] * RPM, reading[read]))
            if any(abs(there - other) < 0.08 * np.nanmax(np.abs(Z)) for other in marked):
                continue
            marked.append(there)
            angle, color = float(np.angle(there)), curve["color"]
            place, marker = (angle, unit.scale * abs(there)), MARKERS[k % len(MARKERS)]
            ax.plot(*place, marker, color=color, markersize=6, zorder=4)
            outwards = (20 * np.cos(angle), 11 * np.sin(angle))
            note(ax, f"{speed:.0f}", place, outwards, ha="center", va="center", color=color, bbox=BOX)
    ax.grid(color="#d0d5dc", linewidth=0.8)
    way = "phase lag, degrees, against the rotation" if lag else "phase lead, degrees"
    ax.set_title(f"amplitude, {unit.word}, over {way}; marks: speed, rpm", fontsize=TEXT)
    if lag:
        leads = range(0, 360, 45)
        ax.set_xticks(np.radians(leads), [f"{-angle % 360}°" for angle in leads])
    legend_above(ax, height=-0.08)
    rays = np.arange(22.5, 360.0, 45.0)
    near = np.abs(np.angle(Z[..., None] * np.exp(-1j * np.radians(rays)))) < np.radians(12)
    ax.set(rlabel_position=rays[np.argmin(near.sum(axis=(0, 1)))])
    return ax


def _with_gaps(values: FloatArray, there: BoolArray) -> FloatArray:
    """Values of the places that are there, with NaN at the others."""
    out = np.full(there.shape, np.nan)
    out[there] = values
    return out


def _along(rpm: FloatArray, curve: ComplexArray, marks: int) -> list[float]:
    """Speeds about evenly spaced along a curve, so that a resonance gets its share, as round as may be."""
    steps = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(curve)))))
    if not steps[-1] > 0:
        return [float(rpm[0])] if rpm.size else []
    taken = []
    for place in np.linspace(0, steps[-1], marks + 1):
        speed = float(np.interp(place, steps, rpm))
        near = [round(speed / unit) * unit for unit in (1000, 500, 100, 50, 10)]
        off = np.abs(np.interp(near, rpm, steps) - place)
        fits = (off < 0.25 * steps[-1] / marks) & (near >= rpm[0]) & (near <= rpm[-1])
        taken.append(float(near[int(np.argmax(fits))]) if fits.any() else speed)
    return list(dict.fromkeys(taken))


def right_angles(ax: Axes) -> MultipleLocator:
    """Ticks of degrees on a vertical axis: not more than eight, of a quarter turn if possible."""
    from matplotlib.ticker import MultipleLocator

    low, high = sorted(ax.get_ylim())
    return MultipleLocator(next(step for step in (15, 30, 45, 90, 180, 360, 1e9) if (high - low) / step <= 8))


def _over_speed(
    ax: Axes | None,
    speeds: FloatArray,
    curves: FloatArray,
    labels: Sequence[str],
    ylabel: str,
    windows: Sequence[Window],
    *,
    operating: tuple[float, float] | None = None,
    peaks: Sequence[Peaks] = (),
) -> Axes:
    ax = new_axes() if ax is None else ax
    curves = np.where(within(tuple(windows), speeds)[:, None], np.nan, curves)
    order = np.argsort(speeds, kind="stable")
    for k, (curve, named) in enumerate(zip(curves.T, labels, strict=True)):
        drawn = _look(k, len(labels), speeds[order], peaks)
        ax.plot(speeds[order] * RPM, curve[order], label=named, **drawn)
    shade_operating(ax, operating)
    shade_unstable(ax, ranges(windows))
    positive = curves[curves > 0]
    if positive.size and positive.max() > 30 * positive.min():
        ax.set_yscale("log")
        ax.set_ylim(bottom=max(positive.min() / 2, positive.max() * 1e-6))
        ylabel += " (log)"
    ax.set(xlabel="speed, rpm", ylabel=ylabel)
    ax.margins(x=0.01)
    plain(ax)
    rad_s_above(ax)
    title: dict[str, Any] = {
        "title": "marks: peaks, with their speed and amplification factor AF",
        "title_fontsize": TEXT,
    }
    columns = 2 if max(map(len, labels), default=0) > 25 else 3
    legend_above(ax, columns, borderaxespad=ABOVE_SCALE, **(title if peaks else {}))
    return ax


def _look(k: int, of: int, speeds: FloatArray, peaks: Sequence[Peaks]) -> dict[str, Any]:
    """Colour and style of curve k over ascending speeds, with marks at its peaks, or where it needs them."""
    drawn: dict[str, Any] = {"linewidth": 1.6, "markersize": 7, "markeredgecolor": "white", **look(k)}
    if peaks and peaks[k].peaks:
        every: Any = [int(np.abs(speeds - peak.speed).argmin()) for peak in peaks[k].peaks]
    elif speeds.size < 12:
        every = 1
    elif of > len(STYLES):
        every = (k * speeds.size // (8 * of), max(speeds.size // 8, 1))
    else:
        return drawn
    return {"marker": MARKERS[k % len(MARKERS)], "markevery": every, **drawn}
