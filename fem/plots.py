"""Pictures of rotors, mode shapes and responses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem.rotor import FloatArray, Rotor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path

    from fem.modes import Modes
    from fem.response import InfluenceCoefficients, Response

# Okabe and Ito: told apart by every eye.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_STYLES = ("-", "--", "-.", ":")
_SHAFT, _EDGE, _HOLE, _MASS, _SUPPORT = "#d9dde3", "#6b7480", "#ffffff", "#4a5360", "#2f3640"


def draw_rotor(rotor: Rotor, ax: Axes | None = None, height: float | None = None) -> Axes:
    """Draw a rotor: sections and bores to scale, masses and supports.

    Lengths are in m, radii in mm. A mass is a point of an area in proportion to it; a support is a triangle
    that holds the shaft at its tip, coloured if it has damping.

    Parameters
    ----------
    rotor
        The rotor.
    ax
        Axes to draw into; new ones if None.
    height
        If given, the rotor is scenery: its largest radius is drawn this high, in the units of the vertical
        axis, and labels, limits and legend are left to the caller.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn into.
    """
    ax = new_axes((10, 3.2)) if ax is None else ax
    largest = float(rotor.outer_diameter.max()) / 2
    scale = 1e3 if height is None else height / largest
    _shaft(rotor, ax, scale)
    _attachments(rotor, ax, scale)
    span = float(rotor.positions[-1])
    ax.set_xlim(-0.02 * span, 1.02 * span)
    ax.spines[["top", "right"]].set_visible(False)
    if height is None:
        top = 1e3 * largest
        ax.set(xlabel="position, m", ylabel="radius, mm", ylim=(-1.7 * top, 1.35 * top))
        if rotor.discs or rotor.supports:
            _legend_above(ax)
    return ax


def draw_modes(modes: Modes, ax: Axes | None = None) -> Axes:
    """Draw mode shapes, each to its largest value 1, over the rotor with its supports and masses."""
    ax = new_axes() if ax is None else ax
    rotor = modes.rotor
    draw_rotor(rotor, ax, height=0.22)
    x, curves = _smooth(modes)
    for k, (omega, curve) in enumerate(zip(modes.frequencies, curves.T, strict=True)):
        speed = f"{omega:.5g} rad/s = {omega * 30 / np.pi:.5g} rpm" if omega else "rigid body"
        ax.plot(
            x,
            curve / np.abs(curve).max(),
            color=COLORS[k % len(COLORS)],
            linestyle=_STYLES[k % len(_STYLES)],
            linewidth=2.2,
            zorder=5,
            label=f"{k + 1}: {speed}",
        )
    ax.axhline(0.0, color=_EDGE, linewidth=0.8, zorder=3)
    ax.set(xlabel="position, m", ylabel="deflection, largest = 1", ylim=(-1.12, 1.12))
    _legend_above(ax)
    return ax


def draw_response(response: Response, ax: Axes | None, nodes: Sequence[str | int] | None) -> Axes:
    """Draw amplitude over speed at some nodes."""
    amplitude = np.abs(response.amplitudes)
    if nodes is None:
        # Where a machine is measured, and where it moves most.
        named_nodes: list[str | int] = [*response.rotor.stations]
        named_nodes = named_nodes or [support.node for support in response.rotor.supports]
        nodes = list(dict.fromkeys([*named_nodes, int(np.argmax(amplitude.max(axis=0))) + 1]))
    named = [f"node {node}" if isinstance(node, int) else str(node) for node in nodes]
    curves = amplitude[:, [response.rotor.node(node) - 1 for node in nodes]]
    return _over_speed(ax, response.speeds, 1e6 * curves, named, "amplitude, µm")


def draw_influence(influence: InfluenceCoefficients, ax: Axes | None) -> Axes:
    """Draw the size of each influence coefficient over speed."""
    S = influence.speeds.size
    named = [f"sensor {sensor}, plane {plane}" for sensor in influence.sensors for plane in influence.planes]
    # 1 m per kg·m is 1 µm per g·mm.
    curves = np.abs(influence.W).reshape(S, -1)
    return _over_speed(ax, influence.speeds, curves, named, "influence, µm per g·mm")


def _over_speed(
    ax: Axes | None, speeds: FloatArray, curves: FloatArray, labels: Sequence[str], ylabel: str
) -> Axes:
    ax = new_axes() if ax is None else ax
    n = len(COLORS)
    order = np.argsort(speeds, kind="stable")
    marker = "o" if speeds.size < 12 else None
    for k, (curve, label) in enumerate(zip(curves.T, labels, strict=True)):
        style = _STYLES[k // n % len(_STYLES)]
        ax.plot(
            speeds[order],
            curve[order],
            style,
            color=COLORS[k % n],
            marker=marker,
            linewidth=1.6,
            label=label,
        )
    positive = curves[curves > 0]
    if positive.size and positive.max() > 30 * positive.min():
        ax.set_yscale("log")
        ax.set_ylim(bottom=max(positive.min() / 2, positive.max() * 1e-6))
    ax.set(xlabel="speed, rad/s", ylabel=ylabel)
    ax.margins(x=0.01)
    ax.grid(color="#e4e7eb", linewidth=0.8)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize="small")
    return ax


def _smooth(modes: Modes, points: int = 12) -> tuple[FloatArray, FloatArray]:
    """Shapes between the nodes, as the elements' own cubics have them."""
    t = np.linspace(0.0, 1.0, points, endpoint=False)[None, :, None]
    L = modes.rotor.length[:, None, None]
    w, slope = modes.shapes[:, None, :], L * modes.slopes[:-1, None, :]
    end_slope = L * modes.slopes[1:, None, :]
    curve = (
        w[:-1] * (1 - 3 * t**2 + 2 * t**3)
        + w[1:] * (3 * t**2 - 2 * t**3)
        + slope * (t - 2 * t**2 + t**3)
        + end_slope * (t**3 - t**2)
    )
    x = (modes.positions[:-1, None] + modes.rotor.length[:, None] * t[0, :, 0]).ravel()
    return np.append(x, modes.positions[-1]), np.vstack((curve.reshape(x.size, -1), modes.shapes[-1:]))


def new_axes(size: tuple[float, float] = (10, 5)) -> Axes:
    """Make axes of a new figure, size in inches."""
    from matplotlib import pyplot as plt

    _, ax = plt.subplots(figsize=size, layout="constrained")
    return ax


def _shaft(rotor: Rotor, ax: Axes, scale: float) -> None:
    """Rectangles of the elements; a bore is a lighter band with dashed edges."""
    x, outer, inner = rotor.positions, scale * rotor.outer_diameter / 2, scale * rotor.inner_diameter / 2
    ax.bar(
        x[:-1],
        2 * outer,
        rotor.length,
        -outer,
        align="edge",
        color=_SHAFT,
        edgecolor=_EDGE,
        linewidth=0.7,
        zorder=1,
    )
    hollow = inner > 0
    if hollow.any():
        ax.bar(
            x[:-1][hollow],
            2 * inner[hollow],
            rotor.length[hollow],
            -inner[hollow],
            align="edge",
            color=_HOLE,
            edgecolor=_EDGE,
            linewidth=0.6,
            linestyle=(0, (4, 2)),
            zorder=1.5,
        )


def _attachments(rotor: Rotor, ax: Axes, scale: float) -> None:
    x = rotor.positions
    radius = (
        scale * np.maximum(np.append(rotor.outer_diameter, 0.0), np.insert(rotor.outer_diameter, 0, 0.0)) / 2
    )
    heavy = [disc for disc in rotor.discs if disc.mass > 0]
    if heavy:
        largest = max(disc.mass for disc in heavy)
        smallest = min(disc.mass for disc in heavy)
        masses = f"{smallest:.3g} kg" if smallest == largest else f"{smallest:.3g} to {largest:.3g} kg"
        ax.scatter(
            [x[disc.node - 1] for disc in heavy],
            [0.0] * len(heavy),
            s=[130 * disc.mass / largest for disc in heavy],
            color=_MASS,
            edgecolor="white",
            linewidth=0.8,
            zorder=4,
            label=f"{'mass' if len(heavy) == 1 else 'masses'}, {masses}",
        )
    for label, face, damped in (("support", _SUPPORT, False), ("damped support", COLORS[4], True)):
        nodes = [s.node - 1 for s in rotor.supports if (s.damping > 0) == damped]
        if nodes:
            ax.scatter(
                x[nodes],
                -radius[nodes],
                marker=_triangle(),
                s=260,
                facecolor=face,
                edgecolor=_SUPPORT,
                linewidth=1.2,
                zorder=4,
                label=label + ("s" if len(nodes) > 1 else ""),
            )


def _triangle() -> Path:
    """A support standing on the ground, its tip at the point drawn."""
    from matplotlib.path import Path

    return Path([(0, 0), (-0.7, -1.1), (-0.95, -1.1), (0.95, -1.1), (0.7, -1.1), (0, 0)], closed=True)


def _legend_above(ax: Axes) -> None:
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize="small")
