"""Pictures along the rotor: sections, discs and supports; mode shapes, deflected shapes, the static line."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.forces import kind_of
from fem.rotor import Rotor, SensorLike, as_sensor, label
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.base.plot_style import (
    COLORS,
    DARK,
    QUIET,
    WIDTH,
    legend_above,
    look,
    new_axes,
    note,
)
from rotorid.base.text import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.response import Response
    from fem.undamped import Modes

_TIP = ((0, 0), (-0.8, -1), (0.8, -1))  # a triangle that touches the shaft from below
_PARTS = 12  # points of a smooth shape in each element


def draw_rotor(
    rotor: Rotor,
    ax: Axes | None = None,
    height: float | None = None,
    *,
    planes: Sequence[str | int] = (),
    sensors: Sequence[SensorLike] = (),
) -> Axes:
    """Draw a rotor: sections, bores and discs to scale, concentrated masses and supports.

    Lengths are in m, radii in mm. A disc with moments of inertia is drawn as the solid steel-like disc
    that has the same mass and moments; a mass without them is a point of an area in proportion to it. A
    bearing is a triangle that holds the shaft at its tip, dark if nothing damps it, with a thick edge if it
    stands on a pedestal; a seal is a square above and below the shaft. Forces that are not linear have marks
    below it: films a triangle, others a diamond.

    Parameters
    ----------
    rotor
        The rotor.
    ax
        Axes to draw into; new ones if None.
    height
        If given, the rotor is scenery: its largest radius is drawn this high, in the units of the vertical
        axis, and labels, limits and legend are left to the caller.
    planes, sensors
        Correction planes and sensors to mark: nodes or names of stations; sensors also with their angle.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn into.

    Raises
    ------
    ValueError
        If a plane or sensor is no node of the rotor.
    """
    at_planes = [rotor.node(plane) - 1 for plane in planes]
    at_sensors = [rotor.node(as_sensor(sensor, rotor).node) - 1 for sensor in sensors]
    ax = ax or new_axes((WIDTH, 2.8))
    positions, outside = rotor.positions, surface(rotor)
    top = 1e3 * outside.max() if height is None else height
    scale = top / outside.max()
    at, mass, radius, width = _discs(rotor)
    points, width = radius == 0, np.maximum(width, 0.004 * positions[-1])
    for left, length, diameter, color, layer, name in (
        (positions[:-1], rotor.length, rotor.outer_diameter, "#d9dde3", 1.0, ""),
        (positions[:-1], rotor.length, rotor.inner_diameter, "white", 1.5, ""),
        (positions[at] - width / 2, width, 2 * radius, "#aab3bf", 0.8, f"disc, {_kg(mass[~points])}"),
    ):
        if (there := diameter > 0).any():
            d = scale * diameter[there]
            ax.bar(left[there], d, length[there], -d / 2, align="edge", color=color, edgecolor=QUIET,
                   linewidth=0.7, zorder=layer, label=name)  # fmt: skip
    if points.any():
        size = 130 * mass[points] / mass[points].max()
        ax.scatter(positions[at[points]], 0 * size, s=size, label=f"mass, {_kg(mass[points])}", color=DARK,
                   edgecolor="white", linewidth=0.8, zorder=4)  # fmt: skip
    _draw_supports(rotor, ax, scale)
    ax.margins(x=0.02)
    ax.spines[["top", "right"]].set_visible(False)
    if height is None:
        ax.set(xlabel="position, m", ylabel="radius, mm", ylim=(-2.2 * top, 2.0 * top))
    low, high = ax.get_ylim()
    inside, below = 0.2 * (high - low), -scale * outside[at_sensors]
    above = np.full(len(planes), inside - high)
    for words, names, nodes, starts, end, color, line in (
        ("correction plane", planes, at_planes, above, high - inside, COLORS[1], (0, (5, 2, 1, 2))),
        ("sensor", [*map(label, sensors)], at_sensors, below, low + inside, COLORS[0], "-"),
    ):
        if nodes:
            ax.vlines(positions[nodes], starts, end, label=words, color=color, linestyle=line, linewidth=1.2,
                      zorder=5)  # fmt: skip
        for row, k in enumerate(np.argsort(nodes)):
            shift = np.copysign(12 if row % 2 and len(nodes) > 4 else 2, end)  # of many in two rows
            va = "bottom" if end > 0 else "top"
            note(ax, str(names[k]), (positions[nodes[k]], end), (0, shift), ha="center", va=va, color=color)
    if sensors:
        ax.scatter(positions[at_sensors], below, marker="^", s=46, color=COLORS[0], edgecolor="white",
                   linewidth=0.6, zorder=5.5)  # fmt: skip
    if height is None and ax.get_legend_handles_labels()[0]:
        legend_above(ax, markerscale=0.7)
    return ax


def draw_modes(modes: Modes, ax: Axes | None = None) -> Axes:
    """Draw mode shapes, each to its largest value 1, over the rotor with its supports and masses."""
    ax = _over_rotor(modes.rotor, ax, 1.0, "deflection, largest = 1")
    x, curves = smooth_shapes(modes)
    for k, (omega, way) in enumerate(zip(modes.frequencies, modes.direction, strict=True)):
        words = f"{omega * RPM:.5g} rpm = {omega:.5g} rad/s" if omega else "rigid body"
        if omega and way != "forward":
            words += f", {way}"
        shape = curves[:, k] / np.abs(curves[:, k]).max()
        ax.plot(x, shape, label=f"{k + 1}: {words}", linewidth=2.2, zorder=5, **look(k, x.size))
    legend_above(ax, 2, markerscale=0.6)
    return ax


def smooth_shapes(modes: Modes) -> tuple[FloatArray, FloatArray]:
    """Shapes between the nodes, as the elements' own cubics have them.

    Returns
    -------
    Positions, m, twelve in each element and the last node, shape (n,); the shapes there, shape (n, modes).
    """
    from scipy.interpolate import CubicHermiteSpline

    nodes = np.arange(modes.positions.size)
    x = np.interp(np.arange(_PARTS * nodes[-1] + 1) / _PARTS, nodes, modes.positions)
    return x, CubicHermiteSpline(modes.positions, modes.shapes, modes.slopes)(x)


def draw_deflected_shape(response: Response, k: int, ax: Axes | None = None) -> Axes:
    """Draw the deflected shape of the rotor at speed k, from 0, of a response.

    The longer half axis of each node's orbit, µm peak, times the cosine of its phase less that of the node
    that moves most, over the rotor.
    """
    size, phase, rotor = 1e6 * response.major[k], np.angle(response.amplitudes[k]), response.rotor
    shape = size * np.cos(phase - phase[np.argmax(size)])
    words = f"deflection at {response.speeds[k] * RPM:.0f} rpm, µm peak"
    ax = _over_rotor(rotor, ax, float(size.max()), words)
    ax.plot(rotor.positions[response.nodes - 1], shape, "o-", color=COLORS[0], markersize=4, zorder=5)
    legend_above(ax, 2, markerscale=0.6)
    return ax


def radii(rotor: Rotor) -> FloatArray:
    """Radius of the shaft at each node, the larger of its two elements, m, shape (N,)."""
    beside = np.pad(rotor.outer_diameter, 1)
    return np.maximum(beside[:-1], beside[1:]) / 2


def surface(rotor: Rotor) -> FloatArray:
    """Outermost radius at each node, discs included, m, shape (N,)."""
    outer, (at, _, radius, _) = radii(rotor), _discs(rotor)
    np.maximum.at(outer, at, radius)
    return outer


def _discs(rotor: Rotor) -> tuple[IndexArray, FloatArray, FloatArray, FloatArray]:
    """Node, from 0, mass, kg, radius and width, m, of solid discs of the same moments; points have 0."""
    rows = [(d.node - 1, d.mass, d.polar_inertia, d.diametral_inertia) for d in rotor.discs if d.mass > 0]
    node, mass, polar, diametral = np.array(rows).reshape(-1, 4).T
    width = np.sqrt(np.maximum(12 * (diametral - polar / 2) / mass, 0.0))
    return node.astype(np.intp), mass, np.sqrt(2 * polar / mass), width


def _kg(masses: FloatArray) -> str:
    texts = [f"{mass:.3g}" for mass in np.sort(masses)]
    return f"{' to '.join(dict.fromkeys(texts[:1] + texts[-1:]))} kg"


def _over_rotor(rotor: Rotor, ax: Axes | None, largest: float, ylabel: str) -> Axes:
    """Axes for curves up to this size over the rotor as scenery."""
    ax = draw_rotor(rotor, ax or new_axes(), height=0.22 * largest)
    ax.axhline(0.0, color=QUIET, linewidth=0.8, zorder=3)
    ax.set(xlabel="position, m", ylabel=ylabel, ylim=(-1.12 * largest, 1.12 * largest))
    return ax


def _draw_supports(rotor: Rotor, ax: Axes, scale: float) -> None:
    """Bearings, seals and forces that are not linear; those that look alike have one name."""
    groups = defaultdict(list)
    for s in rotor.supports:
        words = f"{'damped ' if s.damped else ''}{s.kind}{' on pedestal' if s.pedestal else ''}"
        groups[words].append(s.node - 1)
    for force in rotor.forces:
        groups[kind_of(force).replace("_", " ")].append(force.node - 1)
    for number, (words, at) in enumerate(groups.items(), start=4):
        seal, holds = "seal" in words, "bearing" in words or "film" in words
        sides, radius = ((-1, 1), surface(rotor)) if seal else ((-1,), radii(rotor))
        marker: Any = _TIP if holds else "s" if seal else "D"
        color = DARK if words.startswith("bearing") else COLORS[number % len(COLORS)]
        ax.scatter(np.tile(rotor.positions[at], len(sides)), scale * np.outer(sides, radius[at]), label=words,
                   marker=marker, s=200 if holds else 60, facecolor=color, edgecolor="black",
                   linewidth=1.8 if "pedestal" in words else 1.0, zorder=4)  # fmt: skip
