"""Drawing of a rotor: sections, discs, supports, correction planes and sensors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.model.node_forces import FORCES, kind_of
from fem.model.rotor import Disc, Rotor, Support
from fem.model.sensors import SensorLike, as_sensor, label
from fem.model.supports import KINDS
from rotorid.base.arrays import FloatArray
from rotorid.base.plot_style import COLORS, DARK, QUIET, WIDTH, legend_above, new_axes, note

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path

SHAFT, HOLE, DISC, SUPPORT = "#d9dde3", "#ffffff", "#aab3bf", "#2f3640"
EDGE, MASS = QUIET, DARK
PLANE, SENSOR = COLORS[1], COLORS[0]


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
    bearing is a triangle that holds the shaft at its tip, coloured if it has damping, on a block if it stands
    on a pedestal; a seal is a comb above and below the shaft. Forces that are not linear have marks of
    their own colour below it: films a triangle, others a diamond.

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
    marks = [
        ("plane", PLANE, [*planes], [rotor.node(plane) for plane in planes]),
        (
            "sensor",
            SENSOR,
            [label(s) for s in sensors],
            [rotor.node(as_sensor(s, rotor).node) for s in sensors],
        ),
    ]
    ax = new_axes((WIDTH, 2.8)) if ax is None else ax
    discs = [disc for disc in rotor.discs if disc.mass > 0 and disc.polar_inertia > 0]
    largest = float(max([rotor.outer_diameter.max() / 2, *(_solid(disc)[0] for disc in discs)]))
    scale = 1e3 if height is None else height / largest
    _discs(rotor, discs, ax, scale)
    _shaft(rotor, ax, scale)
    _masses(rotor, ax)
    for each in KINDS:
        _supports(rotor, [s for s in rotor.supports if s.kind == each.name], each.name, ax, scale)
    _forces(rotor, ax, scale)
    span = float(rotor.positions[-1])
    halves = [(rotor.positions[d.node - 1], max(_solid(d)[1], 0.004 * span) / 2) for d in discs]
    left, right = min([0.0, *(x - w for x, w in halves)]), max([span, *(x + w for x, w in halves)])
    ax.set_xlim(left - 0.02 * span, right + 0.02 * span)
    ax.spines[["top", "right"]].set_visible(False)
    if height is None:
        top = 1e3 * largest
        ax.set(xlabel="position, m", ylabel="radius, mm", ylim=(-1.9 * top, (1.55 if planes else 1.35) * top))
    for kind, color, names, where in marks:
        _marks(rotor, kind, color, names, where, ax)
    if height is None and ax.get_legend_handles_labels()[0]:
        legend_above(ax, marker_scale=0.7)
    return ax


def _solid(disc: Disc) -> tuple[float, float]:
    """Radius and width of the solid disc of the same mass and moments of inertia, m."""
    radius = math.sqrt(2 * disc.polar_inertia / disc.mass)
    width = math.sqrt(max(12 * (disc.diametral_inertia - disc.polar_inertia / 2) / disc.mass, 0.0))
    return radius, width


def _discs(rotor: Rotor, discs: Sequence[Disc], ax: Axes, scale: float) -> None:
    if not discs:
        return
    thinnest = 0.004 * float(rotor.positions[-1])
    shape = np.array([_solid(disc) for disc in discs])
    x = rotor.positions[[disc.node - 1 for disc in discs]]
    radius, width = scale * shape[:, 0], np.maximum(shape[:, 1], thinnest)
    text = f"{'discs' if len(discs) > 1 else 'disc'}, {_masses_text(discs)}"
    ax.bar(x, 2 * radius, width, -radius, color=DISC, edgecolor=MASS, linewidth=0.9, zorder=0.8, label=text)


def _shaft(rotor: Rotor, ax: Axes, scale: float) -> None:
    """Rectangles of the elements; a bore is a lighter band with dashed edges."""
    looks: tuple[dict[str, Any], ...] = (
        {"color": SHAFT, "linewidth": 0.7, "zorder": 1},
        {"color": HOLE, "linewidth": 0.6, "zorder": 1.5, "linestyle": (0, (4, 2))},
    )
    for diameter, drawn in zip((rotor.outer_diameter, rotor.inner_diameter), looks, strict=True):
        there = diameter > 0
        left, length, d = rotor.positions[:-1][there], rotor.length[there], scale * diameter[there]
        ax.bar(left, d, length, -d / 2, align="edge", edgecolor=EDGE, **drawn)


def _masses(rotor: Rotor, ax: Axes) -> None:
    heavy = [disc for disc in rotor.discs if disc.mass > 0 and not disc.polar_inertia]
    if not heavy:
        return
    largest = max(disc.mass for disc in heavy)
    ax.scatter(
        rotor.positions[[disc.node - 1 for disc in heavy]],
        [0.0] * len(heavy),
        s=[130 * disc.mass / largest for disc in heavy],
        color=MASS,
        edgecolor="white",
        linewidth=0.8,
        zorder=4,
        label=f"{'mass' if len(heavy) == 1 else 'masses'}, {_masses_text(heavy)}",
    )


def _masses_text(discs: Iterable[Disc]) -> str:
    masses = sorted(disc.mass for disc in discs)
    one = f"{masses[0]:.3g}" == f"{masses[-1]:.3g}"
    return f"{masses[0]:.3g} kg" if one else f"{masses[0]:.3g} to {masses[-1]:.3g} kg"


def _supports(rotor: Rotor, supports: Sequence[Support], kind: str, ax: Axes, scale: float) -> None:
    radius = scale * (radii(rotor) if kind == "bearing" else surface(rotor))
    groups: dict[tuple[bool, bool], list[int]] = {}
    for support in supports:
        damped = bool(np.any(np.asarray(support.damping) != 0))
        groups.setdefault((support.pedestal is not None, damped), []).append(support.node - 1)
    noun = "support" if kind == "bearing" else kind
    for (standing, damped), nodes in sorted(groups.items()):
        x, y = rotor.positions[nodes], radius[nodes]
        text = f"{'damped ' if damped and kind == 'bearing' else ''}{noun}{'s' if len(nodes) > 1 else ''}"
        if standing:
            text += " on pedestals" if len(nodes) > 1 else " on a pedestal"
        if kind == "seal":
            size, face, width = 170, COLORS[5], 0.8
            marks = [(-y, _comb(-1), text), (y, _comb(1), None)]
        else:
            size, face, width = 760 if standing else 260, COLORS[4] if damped else SUPPORT, 1.2
            marks = [(-y, _on_pedestal() if standing else _triangle(), text)]
        for height, marker, named in marks:
            ax.scatter(
                x,
                height,
                marker=marker,
                s=size,
                facecolor=face,
                edgecolor=SUPPORT,
                linewidth=width,
                zorder=4,
                label=named,
            )


def _forces(rotor: Rotor, ax: Axes, scale: float) -> None:
    """Those that are not linear, where they touch the shaft from below."""
    film, seal = _triangle(), _comb(-1)
    marks: dict[str, Any] = {"journal_bearing": film, "squeeze_film": film, "annular_seal": seal}
    for number, kind in enumerate(method.name for method in FORCES):
        nodes = [force.node - 1 for force in rotor.forces if kind_of(force) == kind]
        if nodes:
            ax.scatter(
                rotor.positions[nodes],
                -scale * radii(rotor)[nodes],
                marker=marks.get(kind, "D"),
                s=200 if kind in marks else 50,
                facecolor=COLORS[number],
                edgecolor=SUPPORT,
                zorder=4.2,
                label=f"{kind.replace('_', ' ')}{'s' if len(nodes) > 1 else ''}",
            )


def radii(rotor: Rotor) -> FloatArray:
    """Radius of the shaft at each node, the larger of its two elements, m, shape (N,)."""
    left, right = np.insert(rotor.outer_diameter, 0, 0.0), np.append(rotor.outer_diameter, 0.0)
    return np.asarray(np.maximum(left, right) / 2)


def surface(rotor: Rotor) -> FloatArray:
    """Outermost radius at each node, discs included, m, shape (N,)."""
    outer = radii(rotor)
    for disc in rotor.discs:
        if disc.mass > 0:
            outer[disc.node - 1] = max(outer[disc.node - 1], _solid(disc)[0])
    return outer


def _marks(
    rotor: Rotor, kind: str, color: str, names: Sequence[str | int], nodes: Sequence[int], ax: Axes
) -> None:
    """A plane is a dashed line through the rotor, named above; a sensor points at it, named below."""
    if not nodes:
        return
    span = float(rotor.positions[-1])
    above = kind == "plane"
    x = rotor.positions[[node - 1 for node in nodes]]
    low, high = ax.get_ylim()
    end = high - 0.13 * (high - low) if above else low + 0.13 * (high - low)
    style = (0, (5, 2, 1, 2)) if above else "-"
    bottom = [-end] * len(x) if above else -1e3 * surface(rotor)[[node - 1 for node in nodes]]
    ax.vlines(
        x,
        np.minimum(bottom, end),
        np.maximum(bottom, end),
        color=color,
        linestyle=style,
        linewidth=1.2,
        zorder=5,
        label=f"{'correction plane' if above else 'sensor'}{'s' if len(x) > 1 else ''}",
    )
    if not above:
        ax.scatter(x, bottom, marker="^", s=46, color=color, edgecolor="white", linewidth=0.6, zorder=5.5)
    last, row = -math.inf, 0
    for place, name in sorted(zip(x.tolist(), names, strict=True), key=lambda pair: pair[0]):
        # Neighbours that would overlap go to a second line.
        row = 1 - row if place - last < 0.035 * span + 0.008 * span * len(str(name)) else 0
        last = place
        shift = (0, (3 + 11 * row) * (1 if above else -1))
        note(ax, str(name), (place, end), shift, ha="center", va="bottom" if above else "top", color=color)


def _triangle() -> Path:
    """A support standing on the ground, its tip at the point drawn."""
    from matplotlib.path import Path

    return Path([(0, 0), (-0.7, -1.1), (-0.95, -1.1), (0.95, -1.1), (0.7, -1.1), (0, 0)], closed=True)


def _on_pedestal() -> Path:
    """The same standing on a block with feet."""
    from matplotlib.path import Path

    triangle = _triangle()
    block = Path(
        [(-0.8, -1.1), (0.8, -1.1), (0.8, -1.7), (0.3, -1.7), (0.55, -2.2), (0.95, -2.2), (-0.95, -2.2),
         (-0.55, -2.2), (-0.3, -1.7), (-0.8, -1.7), (-0.8, -1.1)],
        closed=True,
    )  # fmt: skip
    return Path.make_compound_path(triangle, block)


def _comb(side: int) -> Path:
    """Teeth of a seal that end at the point drawn."""
    from matplotlib.path import Path

    s = side
    points = [(-0.9, 1.0 * s), (-0.9, 0.0), (-0.6, 0.5 * s), (-0.3, 0.0), (0.0, 0.5 * s), (0.3, 0.0),
              (0.6, 0.5 * s), (0.9, 0.0), (0.9, 1.0 * s), (-0.9, 1.0 * s)]  # fmt: skip
    return Path(points, closed=True)
