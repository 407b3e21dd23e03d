"""Correction planes as discs: holes, what goes into them, drawn to scale. Nothing is shown or saved here.

A disc is seen from the end from which the rotor turns counter-clockwise, or from the one that the job states.
Angles are written as the job counts them. Where material is removed everything that is mounted or taken away
stands at the angle of the equivalent added weight + 180°.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.data.conventions import Labels
from balancing.mounting.holes import Holes, Mounting
from rotorid.base.plot_style import TEXT, new_figure
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.mounting.mount_result import Mounted

_HOLES, _NUMBERS, _TICKS, _TEXTS, _SIDE, _EDGE = 0.84, 0.61, 1.06, 1.1, 1.85, 1.55
_LARGEST = 0.13
"""Radius of the largest weight's circle, of the disc's."""
_CLOSE = 0.3
"""Angle, rad, between weights whose texts would touch."""
_CROWD = 32
"""Holes of which each has its number."""
_NOTHING = 1e-9
_ARROW = 0.52
"""Length of the longest arrow, of the disc's radius."""


def disc(  # noqa: PLR0913
    ax: Axes,
    plane: str,
    holes: Holes | None,
    mounting: Mounting | None,
    labels: Labels,
    *,
    remove: bool = False,
    weight: complex | None = None,
    tolerance: float | None = None,
    loose: Sequence[complex] = (),
    words: Sequence[str] = (),
    forbidden: Sequence[tuple[float, float]] = (),
) -> Axes:
    """Draw one plane: rotation, mark, numbered holes, weights (area by mass), and what they are to make.

    Parameters
    ----------
    ax
        Where; ordinary axes.
    plane
        Its name, for the title.
    holes
        None: a plane without holes.
    mounting
        What goes into them; None: nothing.
    labels
        Units and conventions to print in.
    remove
        Whether material is taken away: at the equivalent weight's angle + 180°.
    weight
        Wanted weight (equivalent added), kg or kg·m: the open arrow.
    tolerance
        Permissible residual in the same unit: a circle around the tip of the wanted weight.
    loose
        Further weights at any angles, in one place each.
    words
        What they are; default: how heavy, and at which angle.
    forbidden
        First angle and width, rad with the rotation, of arcs where no weight can stand (hatched).
    """
    from matplotlib.patches import Circle

    turn, clockwise = -1.0 if remove else 1.0, labels.drawn_sign < 0
    put, said = [], []
    if holes is not None and mounting is not None:
        for h in np.flatnonzero(mounting.amounts):
            put.append(complex(mounting.amounts[h] * np.exp(1j * holes.angles[h])))
            said.append(_pieces(holes, mounting, int(h), labels))
    put += [complex(w) for w in loose]
    said += words or [labels.weight_words(abs(w)) for w in loose]
    largest = max([abs(w) for w in put] + ([] if holes is None else list(holes.taken)), default=0.0) or 1.0
    _prepare(ax, clockwise)
    ax.add_patch(Circle((0, 0), 1.0, fc="white", ec="black", lw=1.4))
    ax.plot(0, 0, "+", color="black", ms=7, mew=0.9)
    where = [turn * w for w in put]
    _dial(ax, labels, clockwise, where)
    reach = _room(where)
    if holes is not None:
        _draw_holes(ax, holes, mounting, turn, reach / np.sqrt(largest), clockwise)
    for w in where:
        _draw_weight(ax, w, reach * np.sqrt(abs(w) / largest), clockwise, remove)
    _draw_forbidden(ax, forbidden, turn, clockwise)
    said = [f"{'−' * remove}{text}" for text in said]
    _write_weights(ax, where, said, labels if len(loose) > len(words) else None, clockwise)
    made = sum(put, 0j) if put else None
    if weight is not None and made is not None and abs(weight - made) <= _NOTHING * abs(weight):
        made = None  # one arrow says it all
    _vectors(ax, weight, made, tolerance, clockwise)
    title = textwrap.fill(f"{plane}: {'take away' if remove else 'add'}", 34)
    ax.set_title(title, fontsize="medium", fontweight="bold")
    lines = _words(weight, made, tolerance, labels, remove)
    lines += ["hatched arcs: nothing goes there"] if forbidden else []
    ax.text(0, -_EDGE + 0.02, "\n".join(lines), ha="center", va="top", fontsize=TEXT)
    return ax


def _pieces(holes: Holes, mounting: Mounting, h: int, labels: Labels) -> str:
    """What goes into a hole: "2 × 150 g·mm"; the unit of an unbalance has a line of its own."""
    sizes = np.asarray(holes.pieces) * labels.weight_scale
    several = zip(mounting.counts[h], sizes, strict=True) if len(sizes) else ()
    parts = [f"{n} × {size:.4g}" if n > 1 else f"{size:.4g}" for n, size in several if n]
    parts = parts or [f"{mounting.amounts[h] * labels.weight_scale:.4g}"]
    return f"{' + '.join(parts)}{chr(10) if labels.unbalances else ' '}{labels.weight_in}"


def _draw_forbidden(ax: Axes, arcs: Sequence[tuple[float, float]], turn: float, clockwise: bool) -> None:
    """Hatched parts of the rim."""
    from matplotlib.patches import Wedge

    for start, width in arcs:
        ends = np.degrees([start, start + width]) + (180.0 if turn < 0 else 0.0)
        ends = -ends[::-1] if clockwise else ends
        look: dict[str, Any] = {"fc": "white", "ec": "0.35", "hatch": "xxxx", "lw": 0.8}
        ax.add_patch(Wedge((0, 0), 1.0, *ends, width=0.32, zorder=1, **look))


def mounted_discs(m: Mounted) -> Figure:
    """A new figure of all planes and their holes; planes without show the weight where it stands."""
    c = m.correction
    columns = min(len(c.planes), 2)
    rows = -(-len(c.planes) // columns)
    fig = new_figure(3.75 * rows + 0.5, 3.5 * max(columns, 1.3))
    for p, plane in enumerate(c.planes):
        wanted, mounting = complex(c.weights[p]), m.found.mountings[p]
        disc(
            fig.add_subplot(rows, columns, p + 1),
            plane,
            m.holes[p],
            mounting,
            c.labels,
            remove=plane in c.remove,
            weight=wanted,
            loose=() if mounting is not None or wanted == 0 else (wanted,),
            forbidden=() if c.limits is None else c.limits.forbidden[p],
        )
    fig.suptitle(seen_from(c.labels), fontsize=TEXT)
    return fig


def placed(
    labels: Labels,
    weight: complex,
    *ways: Sequence[complex],
    holes: Holes | None = None,
    mounting: Mounting | None = None,
    remove: bool = False,
    words: Sequence[str] = (),
) -> Figure:
    """A new figure with a disc for each of several ways to place one weight; see `disc`."""
    several = ways or ((),)
    wide = 3.5 * max(len(several), 1.3)
    fig = new_figure(0.82 * wide / len(several) + 1.3, wide)
    for k, loose in enumerate(several, start=1):
        ax = fig.add_subplot(1, len(several), k)
        title = "weight" if len(several) == 1 else f"solution {k}"
        disc(ax, title, holes, mounting, labels, remove=remove, weight=weight, loose=loose, words=words)
    fig.suptitle(seen_from(labels), fontsize=TEXT)
    return fig


def seen_from(labels: Labels) -> str:
    """From which end the discs are seen and how angles count, in words."""
    way = "clockwise" if labels.drawn_sign < 0 else "counter-clockwise"
    return (
        f"Seen from the end from which the rotor turns {way};\n"
        f"angles from the mark (triangle) {labels.side} the rotation"
    )


def _prepare(ax: Axes, clockwise: bool) -> None:
    ax.set_aspect("equal")
    ax.set(xlim=(-_SIDE, _SIDE), ylim=(-_EDGE, _EDGE))
    ax.axis("off")
    # a small turning arrow in the corner, where no weight's text can stand
    x, y, size = -_SIDE + 0.25, _EDGE - 0.3, 0.15
    around = np.radians(np.linspace(-60, 190, 61))
    around = np.pi - around if clockwise else around
    across, up = x + size * np.cos(around), y + size * np.sin(around)
    ax.plot(across, up, color="black", lw=1.5)
    ax.annotate(
        "",
        (across[-1] - 0.1 * (across[-8] - across[-1]), up[-1] - 0.6 * (up[-8] - up[-1])),
        (across[-8], up[-8]),
        arrowprops={"arrowstyle": "-|>,head_length=0.5,head_width=0.25", "color": "black", "lw": 1.5},
    )
    ax.text(x, y + 0.27, "rotation", ha="center", va="center", fontsize=TEXT)


def _at(z: complex, clockwise: bool) -> tuple[float, float]:
    """Where a vector of the rotor stands in the picture."""
    return z.real, -z.imag if clockwise else z.imag


def _beside(x: float, y: float) -> dict[str, Any]:
    """How a text at a place around the disc is aligned: away from the disc."""
    across = "center" if abs(x) < 0.4 else "left" if x > 0 else "right"
    return {"ha": across, "va": "center" if abs(y) < 0.4 else "bottom" if y > 0 else "top"}


def _dial(ax: Axes, labels: Labels, clockwise: bool, places: Sequence[complex]) -> None:
    """Degrees around the disc as the job counts them, where no weight has its text, and the mark at 0°."""
    for degrees in range(0, 360, 30):
        way = complex(np.exp(1j * np.radians(labels.with_rotation(degrees))))
        (x0, y0), (x1, y1) = _at(way, clockwise), _at(1.03 * way, clockwise)
        ax.plot([x0, x1], [y0, y1], color="black", lw=0.8)
        if all(abs(np.angle(place / way)) > _CLOSE for place in places):
            x, y = _at(_TICKS * way, clockwise)
            ax.text(x, y, f"{degrees}°", **_beside(x, y), fontsize=TEXT, color="0.25")
    ax.plot(0.965, 0, marker=(3, 0, 90), color="black", ms=9, zorder=5)


def _draw_holes(
    ax: Axes, holes: Holes, mounting: Mounting | None, turn: float, scale: float, clockwise: bool
) -> None:
    """Numbered circles; hatched, radius scale × √weight, where something is mounted already."""
    from matplotlib.patches import Circle

    count = len(holes.angles)
    size = min(0.05, 0.8 * np.pi * _HOLES / max(count, 1) / 2)
    for h in range(count):
        way = turn * complex(np.exp(1j * holes.angles[h]))
        centre = _at(_HOLES * way, clockwise)
        ax.add_patch(Circle(centre, size, fc="white", ec="0.3", lw=0.9, zorder=2))
        if holes.taken[h] > 0:
            reach = max(scale * np.sqrt(holes.taken[h]), 0.035)
            ax.add_patch(Circle(centre, reach, fc="0.85", ec="0.3", hatch="////", lw=0.9, zorder=3))
        used = mounting is not None and mounting.amounts[h] > 0
        if count <= _CROWD or h % (count // _CROWD + 1) == 0 or used:
            x, y = _at((_NUMBERS - 0.14 * (h % 2) * (count > _CROWD // 2)) * way, clockwise)
            ax.text(x, y, holes.names[h], ha="center", va="center", fontsize=TEXT)


def _room(places: Sequence[complex]) -> float:
    """Radius of the largest weight's circle: neighbours do not cover each other, as far as possible."""
    angles = np.sort(np.mod(np.angle(places), 2 * np.pi)) if places else np.zeros(0)
    apart = np.diff(angles, append=angles[:1] + 2 * np.pi)
    apart = apart[apart > 1e-6]
    chord = 2 * _HOLES * np.sin(min(float(apart.min(initial=np.pi)), np.pi) / 2)
    return float(np.clip(0.5 * chord, 0.055, _LARGEST))


def _write_weights(
    ax: Axes, places: Sequence[complex], words: Sequence[str], angled: Labels | None, clockwise: bool
) -> None:
    """What stands where: neighbours nearer and farther out in turn, three or more alike in one text."""
    order = sorted(range(len(places)), key=lambda k: float(np.mod(np.angle(places[k]), 2 * np.pi)))
    runs: list[list[int]] = []
    for k in order:
        last = places[runs[-1][-1]] if runs else 0j
        alike = (
            last != 0 and abs(np.angle(places[k] / last)) < _CLOSE and abs(abs(places[k] / last) - 1) < 1e-9
        )
        if alike:
            runs[-1].append(k)
        else:
            runs.append([k])
    single = [run for long in runs for run in ([long] if len(long) > 2 else [[k] for k in long])]
    before, far = 0j, False
    for run in single:
        way = complex(np.exp(1j * np.angle(sum(places[k] for k in run))))
        far = bool(before != 0 and not far and abs(np.angle(way / before)) < _CLOSE)
        before = way
        text = words[run[len(run) // 2]]
        x, y = _at((_TEXTS + 0.2 * far) * way, clockwise)
        text = f"{len(run)} × {text}" if len(run) > 1 else text
        text += "" if angled is None else f"\n{angled.weight(way)[1]:.1f}°"
        ax.text(x, y, text, **_beside(x, y), fontsize=TEXT, fontweight="bold")


def _draw_weight(ax: Axes, place: complex, reach: float, clockwise: bool, remove: bool) -> None:
    """A circle, its area by the mass: filled where added, white with a cross where taken away."""
    from matplotlib.patches import Circle

    way = place / abs(place)
    centre = _at(_HOLES * way, clockwise)
    ax.add_patch(Circle(centre, reach, fc="white" if remove else "0.2", ec="black", lw=1.3, zorder=4))
    if remove:
        arm = reach / np.sqrt(2) * np.array([-1, 1, np.nan, -1, 1])
        ax.plot(centre[0] + arm, centre[1] + arm * [1, 1, 1, -1, -1], color="black", lw=1.0, zorder=5)


def _vectors(
    ax: Axes, weight: complex | None, made: complex | None, tolerance: float | None, clockwise: bool
) -> None:
    """Arrows of the wanted weight (open) and of what is made (filled), the tolerance around the first."""
    from matplotlib.patches import Circle, FancyArrowPatch

    sizes = [abs(w) for w in (weight, made) if w is not None]
    longest = max(sizes, default=0.0)
    if longest == 0:
        return
    looks: tuple[dict[str, Any], ...] = (
        {"fc": "white", "lw": 1.2, "ls": "--", "zorder": 7},
        {"fc": "black", "lw": 2.4, "zorder": 6},
    )
    for value, look in zip((weight, made), looks, strict=True):
        if value:
            tip = _at(_ARROW * value / longest, clockwise)
            head = "-|>,head_length=7,head_width=4"
            ax.add_patch(
                FancyArrowPatch((0, 0), tip, arrowstyle=head, shrinkA=0, shrinkB=0, ec="black", **look)
            )
    if tolerance is not None and weight is not None:
        tip = _at(_ARROW * weight / longest, clockwise)
        ax.add_patch(
            Circle(tip, _ARROW * tolerance / longest, fill=False, ec="black", ls=":", lw=1.3, zorder=8)
        )


def _words(
    weight: complex | None,
    made: complex | None,
    tolerance: float | None,
    labels: Labels,
    remove: bool,
) -> list[str]:
    """What the arrows and the dotted circle are."""
    lines = []
    like = "like adding, " if remove else ""
    for name, value in ((f"{like}wanted (dashed)", weight), (f"{like}made (bold)", made)):
        if value is not None:
            size, angle = (float(v) for v in labels.weight(value))
            lines.append(f"{name}: {figures(size)} {labels.weight_in} at {angle:.1f}°")
    if weight is not None and made is not None:
        lines.append(f"error: {float(labels.weight(made - weight)[0]):.2g} {labels.weight_in}")
    if tolerance is not None:
        allowed = float(labels.weight(tolerance)[0])
        lines.append(f"permissible (dotted): {figures(allowed)} {labels.weight_in}")
    return lines
