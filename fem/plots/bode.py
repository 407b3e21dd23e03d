"""Vibration over speed: amplitudes, Bode and polar plots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fem.model.sensors import label
from fem.plots.drawing import draw_rotor
from fem.windows import Window, within
from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.plot_style import (
    BOX,
    DARK,
    MARKERS,
    legend_above,
    legend_beside,
    look,
    new_axes,
    note,
    plain,
    rpm_above,
    shade_operating,
    shade_unstable,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    from fem.model.rotor import Rotor
    from fem.response_result import InfluenceCoefficients, Response


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
    """The size of each influence coefficient over speed, below the rotor with its planes and sensors."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 8.5), layout="constrained")
    above, below = figure.subplots(2, height_ratios=(2, 3))
    draw_rotor(rotor, above, planes=influence.planes, sensors=influence.sensors)
    draw_influence(influence, below)
    return figure


def draw_bode(
    speeds: ArrayLike,
    readings: ArrayLike,
    labels: Sequence[str],
    axes: tuple[Axes, Axes] | None = None,
    *,
    peaks: Sequence[tuple[float, str]] = (),
    operating: tuple[float, float] | None = None,
    windows: Sequence[Window] = (),
) -> tuple[Axes, Axes]:
    """Draw amplitude and phase of readings over speed.

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
        Speeds to mark, rad/s, each with a text for the amplitude's axes.
    operating
        Range of operating speeds, rad/s, shaded.
    windows
        Ranges without a steady response: hatched, and nothing is drawn there.

    Returns
    -------
    tuple of matplotlib.axes.Axes
        The axes drawn into.
    """
    if axes is None:
        from matplotlib import pyplot as plt

        _, (above, below) = plt.subplots(
            2, figsize=(10, 6.5), sharex=True, layout="constrained", height_ratios=(3, 2)
        )
        axes = above, below
    above, below = axes
    omega, Z = np.asarray(speeds, float), np.asarray(readings, complex)
    _over_speed(above, omega, 1e6 * np.abs(Z), labels, "amplitude, µm peak", windows)
    shade_unstable(below, _ranges(windows), "")
    steady = ~within(tuple(windows), omega)
    for k, reading in enumerate(Z.T):
        seen = steady & (np.abs(reading) > 0)
        phase = np.degrees(np.unwrap(np.angle(reading[seen])))
        if phase.size:
            # The middle of the curve between -360 and 0: a lag, as engineers read it.
            phase -= 360 * np.ceil(np.median(phase) / 360)
        shown = seen | ~steady
        below.plot(omega[shown], _with_gaps(phase, seen)[shown], linewidth=1.6, **look(k, len(labels)))
    plain(below)
    below.margins(x=0.01)
    below.set(xlabel="speed, rad/s", ylabel="phase (lead), degrees")
    below.yaxis.set_major_locator(_right_angles(below))
    above.set_xlabel("")
    above.tick_params(labelbottom=False)
    rpm_above(above)
    across = ("data", "axes fraction")
    if operating is not None:
        middle = (sum(operating) / 2, 1.0)
        note(above, "operating range", middle, (0, -4), xycoords=across, ha="center", va="top", color=DARK)
    for speed, text in peaks:
        note(above, text, (speed, 0.0), (3, 5), xycoords=across, rotation=90, va="bottom", bbox=BOX)
    for ax in axes:
        shade_operating(ax, operating)
        for speed, _ in peaks:
            ax.axvline(speed, color=DARK, linewidth=0.9, linestyle=(0, (2, 2)), zorder=1)
    return axes


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
    speeds, readings, labels
        As for `draw_bode`.
    ax
        Polar axes; new ones if None.
    marks
        About how many speeds to write along each curve.
    windows
        Ranges without a steady response, which are left out.
    """
    if ax is None:
        from matplotlib import pyplot as plt

        _, ax = plt.subplots(figsize=(7.5, 7), layout="constrained", subplot_kw={"projection": "polar"})
    omega, Z = np.asarray(speeds, float), np.asarray(readings, complex)
    steady = ~within(tuple(windows), omega)
    omega, Z = omega[steady], Z[steady]
    marked: list[complex] = []
    for k, (reading, named) in enumerate(zip(Z.T, labels, strict=True)):
        curve, phase, size = look(k), np.unwrap(np.angle(reading)), 1e6 * np.abs(reading)
        ax.plot(_with_gaps(phase, steady), _with_gaps(size, steady), linewidth=1.6, label=named, **curve)
        for i in _along(reading, marks):
            if any(abs(reading[i] - other) < 0.05 * np.abs(Z).max() for other in marked):
                continue
            marked.append(complex(reading[i]))
            place, color = (phase[i], size[i]), curve["color"]
            ax.plot(*place, MARKERS[k % len(MARKERS)], color=color, markersize=5, markeredgecolor="white")
            outwards = (8 * np.cos(phase[i]), 8 * np.sin(phase[i]))
            speed = f"{omega[i] * RPM:.0f}"
            note(
                ax,
                speed,
                place,
                outwards,
                ha="center",
                va="center",
                fontsize="x-small",
                color=color,
                bbox=BOX,
            )
    ax.grid(color="#d0d5dc", linewidth=0.8)
    ax.set_xlabel("amplitude, µm peak, over phase lead in degrees; marks: speed in rpm", labelpad=10)
    legend_above(ax, height=1.06)
    return ax


def _ranges(windows: Sequence[Window]) -> list[tuple[float, float]]:
    return [(window.first, window.last) for window in windows]


def _with_gaps(values: FloatArray, there: BoolArray) -> FloatArray:
    """Values of the places that are there, with NaN at the others."""
    out = np.full(there.shape, np.nan)
    out[there] = values
    return out


def _along(curve: np.ndarray[tuple[int], np.dtype[np.complex128]], marks: int) -> list[int]:
    """Indices about evenly spaced along a curve, so that a resonance gets its share."""
    if curve.size < 2:
        return list(range(curve.size))
    steps = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(curve)))))
    if not steps[-1] > 0:
        return [0]
    wanted = np.linspace(0, steps[-1], marks + 1)
    return sorted({int(np.argmin(np.abs(steps - place))) for place in wanted})


def _right_angles(ax: Axes) -> MultipleLocator:
    from matplotlib.ticker import MultipleLocator

    low, high = ax.get_ylim()
    return MultipleLocator(next(step for step in (15, 30, 45, 90, 180, 360, 1e9) if (high - low) / step <= 8))


def _over_speed(
    ax: Axes | None,
    speeds: FloatArray,
    curves: FloatArray,
    labels: Sequence[str],
    ylabel: str,
    windows: Sequence[Window],
) -> Axes:
    ax = new_axes() if ax is None else ax
    curves = np.where(within(tuple(windows), speeds)[:, None], np.nan, curves)
    shade_unstable(ax, _ranges(windows))
    order = np.argsort(speeds, kind="stable")
    marker = "o" if speeds.size < 12 else None
    for k, (curve, named) in enumerate(zip(curves.T, labels, strict=True)):
        ax.plot(
            speeds[order], curve[order], marker=marker, linewidth=1.6, label=named, **look(k, len(labels))
        )
    positive = curves[curves > 0]
    if positive.size and positive.max() > 30 * positive.min():
        ax.set_yscale("log")
        ax.set_ylim(bottom=max(positive.min() / 2, positive.max() * 1e-6))
    ax.set(xlabel="speed, rad/s", ylabel=ylabel)
    ax.margins(x=0.01)
    plain(ax)
    if max(map(len, labels), default=0) > 20:
        legend_above(ax, columns=2)  # beside, long names would leave no room for the curves
    else:
        legend_beside(ax)
    return ax
