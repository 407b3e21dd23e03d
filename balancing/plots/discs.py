"""Correction planes as discs: holes, what goes into them, drawn to scale. Nothing is shown or saved here.

A disc is seen from the end from which the rotor turns counter-clockwise, or, with `clockwise`, from the other
end. Angles are written as the job counts them. Where material is removed everything that is mounted or taken
away stands at the angle of the equivalent added weight + 180°.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from balancing.data.conventions import Labels
from balancing.mounting.holes import Holes, Mounting
from rotorid.base.text import figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.correction.correction_result import Correction
    from balancing.mounting.mount_result import Mounted

_HOLES, _NUMBERS, _TICKS, _TEXTS, _SIDE, _EDGE = 0.84, 0.66, 1.11, 1.25, 1.8, 1.6
_LARGEST = 0.13
"""Radius of the largest weight's circle, of the disc's."""
_CLOSE = 0.3
"""Angle, rad, between weights whose texts would touch."""
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
    clockwise: bool = False,
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
    clockwise
        Whether the disc is seen from the end from which the rotor turns clockwise.
    """
    from matplotlib.patches import Circle

    turn = -1.0 if remove else 1.0
    amounts = np.zeros(0) if mounting is None else mounting.amounts
    put = (
        []
        if holes is None
        else [(complex(a * np.exp(1j * holes.angles[h]))) for h, a in enumerate(amounts) if a]
    )
    put += [complex(w) for w in loose]
    largest = max([abs(w) for w in put] + ([] if holes is None else list(holes.taken)), default=0.0) or 1.0
    _prepare(ax, clockwise)
    ax.add_patch(Circle((0, 0), 1.0, fc="white", ec="black", lw=1.4))
    ax.plot(0, 0, "+", color="black", ms=7, mew=0.9)
    _dial(ax, labels, clockwise)
    where = [turn * w for w in put]
    reach = _room(where)
    if holes is not None:
        _draw_holes(ax, holes, turn, reach / np.sqrt(largest), clockwise)
    for w in where:
        _draw_weight(ax, w, reach * np.sqrt(abs(w) / largest), clockwise, remove)
    _write_weights(ax, where, labels, clockwise, remove=remove, angles=bool(len(loose)))
    made = sum(put, 0j) if put else None
    if weight is not None and made is not None and abs(weight - made) <= _NOTHING * abs(weight):
        made = None  # one arrow says it all
    _vectors(ax, weight, made, tolerance, clockwise)
    words = textwrap.fill(f"{plane}: {'take away' if remove else 'add'}", 34)
    ax.set_title(words, fontsize="medium", fontweight="bold")
    lines = _words(weight, made, tolerance, labels, remove)
    ax.text(0, -_EDGE + 0.02, "\n".join(lines), ha="center", va="top", fontsize="small")
    return ax


def discs(
    correction: Correction,
    holes: Mapping[str, Holes] | None = None,
    mountings: Mapping[str, Mounting] | None = None,
    *,
    tolerances: Mapping[str, float] | None = None,
    clockwise: bool = False,
) -> Figure:
    """A new figure with all planes of a correction side by side.

    Parameters
    ----------
    correction
        Its `remove` names the planes where material is taken away.
    holes, mountings
        By plane; planes without holes show the weight where it stands.
    tolerances
        Permissible residual by plane, kg or kg·m.
    clockwise
        See `disc`.
    """
    from matplotlib.figure import Figure

    holes, mountings, tolerances = holes or {}, mountings or {}, tolerances or {}
    planes = correction.planes
    columns = min(len(planes), 3)
    rows = -(-len(planes) // columns)
    fig = Figure(figsize=(4.4 * columns, 4.9 * rows + 0.7), layout="constrained")
    for p, plane in enumerate(planes):
        wanted = complex(correction.weights[p])
        disc(
            fig.add_subplot(rows, columns, p + 1),
            plane,
            holes.get(plane),
            mountings.get(plane),
            correction.labels,
            remove=plane in correction.remove,
            weight=wanted,
            tolerance=tolerances.get(plane),
            loose=() if plane in mountings or wanted == 0 else (wanted,),
            clockwise=clockwise,
        )
    fig.suptitle(seen_from(correction.labels, clockwise), fontsize="medium")
    return fig


def placed(
    labels: Labels,
    weight: complex,
    *ways: Sequence[complex],
    holes: Holes | None = None,
    mounting: Mounting | None = None,
    remove: bool = False,
) -> Figure:
    """A new figure with a disc for each of several ways to place one weight; see `disc`."""
    from matplotlib.figure import Figure

    several = ways or ((),)
    fig = Figure(figsize=(4.6 * len(several) + 0.4, 5.6), layout="constrained")
    for k, loose in enumerate(several, start=1):
        ax = fig.add_subplot(1, len(several), k)
        title = "weight" if len(several) == 1 else f"solution {k}"
        disc(ax, title, holes, mounting, labels, remove=remove, weight=weight, loose=loose)
    fig.suptitle(seen_from(labels).replace("; ", "\n"), fontsize="small")
    return fig


def mounted_discs(m: Mounted) -> Figure:
    """A new figure of what is mounted in the holes of all planes, drawn as the job counts."""
    planes = m.correction.planes
    return discs(
        m.correction,
        {p: h for p, h in zip(planes, m.holes, strict=True) if h is not None},
        {p: k for p, k in zip(planes, m.found.mountings, strict=True) if k is not None},
        clockwise=m.correction.labels.drawn_sign < 0,
    )


def seen_from(labels: Labels, clockwise: bool = False) -> str:
    """From which end the discs are seen and how angles count, in words."""
    way = "clockwise" if clockwise else "counter-clockwise"
    return (
        f"Seen from the end from which the rotor turns {way}; "
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
    ax.text(x, y + 0.27, "rotation", ha="center", va="center", fontsize="x-small")


def _at(z: complex, clockwise: bool) -> tuple[float, float]:
    """Where a vector of the rotor stands in the picture."""
    return z.real, -z.imag if clockwise else z.imag


def _dial(ax: Axes, labels: Labels, clockwise: bool) -> None:
    """Degrees around the disc as the job counts them, and the mark at 0°."""
    for degrees in range(0, 360, 30):
        way = complex(np.exp(1j * np.radians(labels.with_rotation(degrees))))
        (x0, y0), (x1, y1) = _at(way, clockwise), _at(1.03 * way, clockwise)
        ax.plot([x0, x1], [y0, y1], color="black", lw=0.8)
        x, y = _at((_TICKS + 0.02) * way, clockwise)
        ax.text(x, y, f"{degrees}°", ha="center", va="center", fontsize="x-small", color="0.25")
    ax.plot(0.965, 0, marker=(3, 0, 90), color="black", ms=9, zorder=5)


def _draw_holes(ax: Axes, holes: Holes, turn: float, scale: float, clockwise: bool) -> None:
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
        x, y = _at(_NUMBERS * way, clockwise)
        font = "x-small" if count <= 24 else "xx-small"
        ax.text(x, y, holes.names[h], ha="center", va="center", fontsize=font, color="black")


def _room(places: Sequence[complex]) -> float:
    """Radius of the largest weight's circle: neighbours do not cover each other, as far as possible."""
    angles = np.sort(np.mod(np.angle(places), 2 * np.pi)) if places else np.zeros(0)
    apart = np.diff(angles, append=angles[:1] + 2 * np.pi)
    apart = apart[apart > 1e-6]
    chord = 2 * _HOLES * np.sin(min(float(apart.min(initial=np.pi)), np.pi) / 2)
    return float(np.clip(0.5 * chord, 0.055, _LARGEST))


def _write_weights(
    ax: Axes, places: Sequence[complex], labels: Labels, clockwise: bool, *, remove: bool, angles: bool
) -> None:
    """What weighs how much: neighbours nearer and farther out in turn, three or more alike in one text."""
    order = sorted(range(len(places)), key=lambda k: float(np.mod(np.angle(places[k]), 2 * np.pi)))
    runs: list[list[complex]] = []
    for k in order:
        one = places[k]
        last = runs[-1][-1] if runs else 0j
        alike = last != 0 and abs(np.angle(one / last)) < _CLOSE and abs(abs(one / last) - 1) < 1e-9
        if alike:
            runs[-1].append(one)
        else:
            runs.append([one])
    single = [run for long in runs for run in ([long] if len(long) > 2 else [[w] for w in long])]
    before, far = 0j, False
    for run in single:
        way = complex(np.exp(1j * np.angle(sum(run))))
        far = bool(before != 0 and not far and abs(np.angle(way / before)) < _CLOSE)
        before = way
        size, angle = (float(v) for v in labels.weight(abs(run[0]) * way))
        text = f"{'−' if remove else ''}{size:.4g} {labels.weight_in}"
        text = f"{len(run)} × {text}" if len(run) > 1 else text
        x, y = _at((_TEXTS + 0.2 * far) * way, clockwise)
        ax.text(
            x,
            y,
            f"{text}\n{angle:.1f}°" if angles else text,
            ha="center" if abs(x) < 0.4 else "left" if x > 0 else "right",
            va="center" if abs(x) >= 0.4 else "bottom" if y > 0 else "top",
            fontsize="small",
            fontweight="bold",
        )


def _draw_weight(ax: Axes, place: complex, reach: float, clockwise: bool, remove: bool) -> None:
    """A circle, its area by the mass: filled where added, white with a cross where taken away."""
    from matplotlib.patches import Circle

    way = place / abs(place)
    centre = _at(_HOLES * way, clockwise)
    ax.add_patch(Circle(centre, reach, fc="white" if remove else "0.2", ec="black", lw=1.3, zorder=4))
    if remove:
        arm = reach / np.sqrt(2)
        for sign in (1, -1):
            ax.plot(
                [centre[0] - arm, centre[0] + arm],
                [centre[1] - sign * arm, centre[1] + sign * arm],
                color="black",
                lw=1.0,
                zorder=5,
            )


def _vectors(
    ax: Axes, weight: complex | None, made: complex | None, tolerance: float | None, clockwise: bool
) -> None:
    """Arrows of the wanted weight (open) and of what is made (filled), the tolerance around the first."""
    from matplotlib.patches import Circle, FancyArrowPatch

    sizes = [abs(w) for w in (weight, made) if w is not None]
    longest = max(sizes, default=0.0)
    if longest == 0:
        return
    for value, style, width, face in ((weight, "-|>", 1.2, "white"), (made, "-|>", 2.4, "black")):
        if value is None or abs(value) == 0:
            continue
        tip = _at(_ARROW * value / longest, clockwise)
        ax.add_patch(
            FancyArrowPatch(
                (0, 0),
                tip,
                arrowstyle=f"{style},head_length=7,head_width=4",
                shrinkA=0,
                shrinkB=0,
                fc=face,
                ec="black",
                lw=width,
                ls="-" if face == "black" else "--",
                zorder=6 if face == "black" else 7,
            )
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
