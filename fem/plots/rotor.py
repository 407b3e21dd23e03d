"""Pictures along the rotor: its sections, discs and supports; mode shapes; the static line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.forces import kind_of
from fem.rotor import Disc, Rotor, SensorLike, as_sensor, label
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import (
    COLORS,
    DARK,
    MARKERS,
    QUIET,
    STYLES,
    WIDTH,
    legend_above,
    look,
    new_axes,
    note,
    plain,
)
from rotorid.base.rpm import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fem.static import StaticDeflection
    from fem.undamped import Modes

_SUPPORT = "#2f3640"
_TIP = ((0, 0), (-0.8, -1), (0.8, -1))  # a triangle that touches the shaft from below


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
    bearing is a triangle that holds the shaft at its tip, coloured if it has damping, with a thick edge if it
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
    plane_nodes = [rotor.node(plane) for plane in planes]
    sensor_nodes = [rotor.node(as_sensor(sensor, rotor).node) for sensor in sensors]
    ax = new_axes((WIDTH, 2.8)) if ax is None else ax
    solid = [disc for disc in rotor.discs if disc.mass > 0 and disc.polar_inertia > 0]
    points = [disc for disc in rotor.discs if disc.mass > 0 and not disc.polar_inertia]
    largest = float(max([rotor.outer_diameter.max() / 2, *(_radius(disc) for disc in solid)]))
    scale = 1e3 if height is None else height / largest
    span = float(rotor.positions[-1])
    edges = [0.0, span]
    if solid:
        x, widths = _positions(rotor, solid), np.maximum([_width(disc) for disc in solid], 0.004 * span)
        edges += [*(x - widths / 2), *(x + widths / 2)]
        radius = scale * np.array([_radius(disc) for disc in solid])
        words = f"disc{_s(solid)}, {_masses_text(solid)}"
        ax.bar(x, 2 * radius, widths, -radius, color="#aab3bf", edgecolor=DARK, linewidth=0.9, zorder=0.8,
               label=words)  # fmt: skip
    for diameter, color, layer, style in (
        (rotor.outer_diameter, "#d9dde3", 1.0, "-"),
        (rotor.inner_diameter, "white", 1.5, (0, (4, 2))),
    ):
        there = diameter > 0
        left, length, d = rotor.positions[:-1][there], rotor.length[there], scale * diameter[there]
        ax.bar(left, d, length, -d / 2, align="edge", color=color, edgecolor=QUIET, linewidth=0.7,
               zorder=layer, linestyle=style)  # fmt: skip
    if points:
        masses = np.array([disc.mass for disc in points])
        words = f"mass{'es' if len(points) > 1 else ''}, {_masses_text(points)}"
        ax.scatter(_positions(rotor, points), np.zeros(masses.size), s=130 * masses / masses.max(),
                   label=words, color=DARK, edgecolor="white", linewidth=0.8, zorder=4)  # fmt: skip
    _draw_supports(rotor, ax, scale)
    ax.set_xlim(min(edges) - 0.02 * span, max(edges) + 0.02 * span)
    ax.spines[["top", "right"]].set_visible(False)
    if height is None:
        top = 1e3 * largest
        ax.set(xlabel="position, m", ylabel="radius, mm", ylim=(-1.9 * top, (1.55 if planes else 1.35) * top))
    low, high = ax.get_ylim()
    inside = 0.13 * (high - low)
    for kind, color, names, nodes in (
        ("correction plane", COLORS[1], planes, plane_nodes),
        ("sensor", COLORS[0], [label(sensor) for sensor in sensors], sensor_nodes),
    ):
        if not nodes:
            continue
        at, plane = np.array(nodes) - 1, kind != "sensor"
        x, end = rotor.positions[at], high - inside if plane else low + inside
        other = np.full(len(at), -end) if plane else -1e3 * surface(rotor)[at]
        style = (0, (5, 2, 1, 2)) if plane else "-"
        ax.vlines(x, np.minimum(other, end), np.maximum(other, end), color=color, linestyle=style,
                  linewidth=1.2, zorder=5, label=f"{kind}{_s(nodes)}")  # fmt: skip
        for place, name, row in sorted(zip(x.tolist(), names, range(len(at)), strict=True)):
            shift = 3 + 11 * (row % 2 if len(at) > 4 else 0)
            below: dict[str, Any] = {"ha": "center", "va": "bottom" if plane else "top", "color": color}
            note(ax, str(name), (place, end), (0, shift if plane else -shift), **below)
        if not plane:
            ax.scatter(x, other, marker="^", s=46, color=color, edgecolor="white", linewidth=0.6, zorder=5.5)
    if height is None and ax.get_legend_handles_labels()[0]:
        legend_above(ax, marker_scale=0.7)
    return ax


def draw_modes(modes: Modes, ax: Axes | None = None) -> Axes:
    """Draw mode shapes, each to its largest value 1, over the rotor with its supports and masses."""
    ax = new_axes() if ax is None else ax
    draw_rotor(modes.rotor, ax, height=0.22)
    x, curves = smooth_shapes(modes)
    for k, (omega, curve) in enumerate(zip(modes.frequencies, curves.T, strict=True)):
        words = f"{k + 1}: {omega * RPM:.5g} rpm = {omega:.5g} rad/s" if omega else f"{k + 1}: rigid body"
        if omega and modes.direction[k] != "forward":
            words += f", {modes.direction[k]}"
        style: dict[str, Any] = {"linewidth": 2.2, "zorder": 5, **look(k)}
        if k >= len(STYLES):
            style |= {"marker": MARKERS[k % len(MARKERS)], "markevery": (k, 24), "markeredgecolor": "white"}
        ax.plot(x, curve / np.abs(curve).max(), label=words, **style)
    ax.axhline(0.0, color=QUIET, linewidth=0.8, zorder=3)
    ax.set(xlabel="position, m", ylabel="deflection, largest = 1", ylim=(-1.12, 1.12))
    legend_above(ax, 2, marker_scale=0.6)
    return ax


def smooth_shapes(modes: Modes, points: int = 12) -> tuple[FloatArray, FloatArray]:
    """Shapes between the nodes, as the elements' own cubics have them.

    Returns
    -------
    Positions, m, `points` in each element and the last node, shape (n,); the shapes there, shape (n, modes).
    """
    from scipy.interpolate import CubicHermiteSpline

    parts = np.linspace(0.0, 1.0, points, endpoint=False)
    within = modes.positions[:-1, None] + modes.rotor.length[:, None] * parts
    x = np.append(within, modes.positions[-1])
    return x, np.asarray(CubicHermiteSpline(modes.positions, modes.shapes, modes.slopes)(x))


def draw_deflection(deflection: StaticDeflection, ax: Axes | None = None) -> Axes:
    """Draw the static deflection in x and y along the rotor; return the axes."""
    ax = new_axes((WIDTH, 3.2)) if ax is None else ax
    positions, largest = deflection.rotor.positions, deflection.deflection.max()
    for k, (name, values) in enumerate((("x", deflection.x), ("y", deflection.y))):
        if np.abs(values).max() > 1e-9 * largest:
            ax.plot(positions, 1e6 * values, marker=MARKERS[k], markersize=4, label=name, **look(k))
    ax.set(xlabel="position, m", ylabel="static deflection, µm")
    plain(ax)
    legend_above(ax)
    return ax


def radii(rotor: Rotor) -> FloatArray:
    """Radius of the shaft at each node, the larger of its two elements, m, shape (N,)."""
    left, right = np.insert(rotor.outer_diameter, 0, 0.0), np.append(rotor.outer_diameter, 0.0)
    return np.asarray(np.maximum(left, right) / 2)


def surface(rotor: Rotor) -> FloatArray:
    """Outermost radius at each node, discs included, m, shape (N,)."""
    outer = radii(rotor)
    for disc in rotor.discs:
        if disc.mass > 0:
            outer[disc.node - 1] = max(outer[disc.node - 1], _radius(disc))
    return outer


def _radius(disc: Disc) -> float:
    """Radius of the solid disc of the same mass and moments of inertia, m."""
    return math.sqrt(2 * disc.polar_inertia / disc.mass)


def _width(disc: Disc) -> float:
    """Width of the same solid disc, m."""
    return math.sqrt(max(12 * (disc.diametral_inertia - disc.polar_inertia / 2) / disc.mass, 0.0))


def _positions(rotor: Rotor, discs: Iterable[Disc]) -> FloatArray:
    return np.asarray(rotor.positions[[disc.node - 1 for disc in discs]])


def _masses_text(discs: Iterable[Disc]) -> str:
    masses = sorted(disc.mass for disc in discs)
    low, high = f"{masses[0]:.3g} kg", f"{masses[-1]:.3g} kg"
    return low if low == high else f"{masses[0]:.3g} to {high}"


def _s(items: Sequence[object]) -> str:
    return "s" if len(items) > 1 else ""


def _draw_supports(rotor: Rotor, ax: Axes, scale: float) -> None:
    """Bearings, seals and forces that are not linear; those that look alike have one name."""
    groups: dict[tuple[str, str], list[int]] = {}
    for support in rotor.supports:
        damped = "damped " if support.kind == "bearing" and np.any(np.asarray(support.damping) != 0) else ""
        noun = damped + ("support" if support.kind == "bearing" else support.kind)
        groups.setdefault((noun, "" if support.pedestal is None else " on pedestal"), []).append(support.node)
    for force in rotor.forces:
        groups.setdefault((kind_of(force).replace("_", " "), ""), []).append(force.node)
    colors = {"support": _SUPPORT, "damped support": COLORS[4], "seal": COLORS[5]}
    for number, ((noun, standing), nodes) in enumerate(groups.items()):
        at = np.array(nodes) - 1
        x, radius = rotor.positions[at], scale * (surface(rotor) if "seal" in noun else radii(rotor))[at]
        holds = noun.endswith(("support", "bearing", "film"))
        style: dict[str, Any] = {
            "marker": _TIP if holds else "s" if "seal" in noun else "D",
            "s": 200 if holds else 60,
            "facecolor": colors.get(noun, COLORS[number % len(COLORS)]),
            "edgecolor": _SUPPORT,
            "linewidth": 2.6 if standing else 1.0,
            "zorder": 4,
        }
        ax.scatter(x, -radius, label=f"{noun}{_s(at)}{standing}{_s(at) if standing else ''}", **style)
        if "seal" in noun:
            ax.scatter(x, radius, **style)
