"""Correction planes as discs: holes and what goes into them, drawn to scale.

A disc is seen from the end from which the rotor turns counter-clockwise, or from the one that the job states.
Angles are written as the job counts them. Where material is removed everything that is mounted or taken away
stands at the angle of the equivalent added weight + 180°.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle, Wedge

from balancing.conventions import Labels
from balancing.holes import Holes, Mounting
from balancing.plots.polar import on_paper, turn_sign
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.plot_style import TEXT, new_figure
from rotorid.base.text import cut, figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.mount import Mounted

_HOLES, _NUMBERS, _TEXTS, _ARROW, _SIDE, _EDGE = 0.84, 0.61, 1.08, 0.52, 1.85, 1.55
"""Radii of holes, their numbers, what stands around the disc and the longest arrow; half of the picture."""
_CROWD = 32
"""Holes of which each has its number."""


def draw_disc(  # noqa: PLR0913
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
    turn, minus = (-1.0, "−") if remove else (1.0, "")
    weights, texts = [complex(w) for w in loose], [minus + text for text in words]
    if not words:
        texts = [f"{minus}{labels.weight_words(abs(w))}\n{labels.weight(turn * w)[1]:.1f}°" for w in weights]
    if holes is not None and mounting is not None:
        for h in np.flatnonzero(mounting.amounts).tolist():
            weights.append(complex(mounting.amounts[h] * np.exp(1j * holes.angles[h])))
            texts.append(f"{holes.names[h]}: {minus}{_pieces(holes, mounting, h, labels.weight_scale)}")
    at, taken = turn * on_paper(labels, weights), np.zeros(0) if holes is None else holes.taken
    scale = _largest_circle(at) / np.sqrt(max([*np.abs(at), *taken, 0.0]) or 1.0)
    nothing = " nothing" if mounting is not None and not weights else f", {labels.weight_in}"
    title = f"{cut(plane, 20)}: {'take away' if remove else 'add'}{nothing}"
    ax.set_title(title, fontsize="medium", fontweight="bold")
    ax.axis("off")
    ax.set(aspect="equal", xlim=(-_SIDE, _SIDE), ylim=(-_EDGE, _EDGE))
    ax.text(-_SIDE, 0.9 * _EDGE, f"{turn_sign(labels)} rotation", fontsize=TEXT)
    _circle(ax, 0j, 1.0, fc="white")
    ax.plot(0.965, 0, "<", color="black", ms=9)
    for start, width in forbidden:
        _hatch(ax, labels.drawn([start, start + width]) + (np.pi if remove else 0.0))
    if holes is not None:
        _draw_holes(ax, holes, turn * on_paper(labels, np.exp(1j * holes.angles)), scale)
    for place in at:
        look: dict[str, Any] = {"fc": "white", "hatch": "xxx"} if remove else {"fc": "0.2"}
        _circle(ax, _HOLES * place / abs(place), scale * np.sqrt(abs(place)), **look)
    _write_around(ax, at, texts, labels)
    lines = _draw_arrows(ax, weight, sum(weights) if weights else None, tolerance, labels)
    lines = [f"like adding, {line}" if remove else line for line in lines]
    lines += ["hatched arcs: nothing goes there"] if forbidden else []
    ax.text(0, -_EDGE, "\n".join(lines), ha="center", va="top", fontsize=TEXT)
    return ax


def mounted_discs(m: Mounted) -> Figure:
    """A new figure of all planes and their holes; planes without show the weight where it stands."""
    c = m.correction
    figure, axes = _discs(len(c.planes), c.labels)
    for p, (plane, weight) in enumerate(zip(c.planes, c.weights.tolist(), strict=True)):
        draw_disc(
            axes[p],
            plane,
            m.holes[p],
            m.discrete.mountings[p],
            c.labels,
            remove=plane in c.remove,
            weight=weight,
            loose=() if m.discrete.mountings[p] is not None or weight == 0 else (weight,),
            forbidden=() if c.limits is None else c.limits.forbidden[p],
        )
    return figure


def weight_figure(
    labels: Labels,
    weight: complex,
    *ways: Sequence[complex],
    holes: Holes | None = None,
    mounting: Mounting | None = None,
    remove: bool = False,
    words: Sequence[str] = (),
) -> Figure:
    """A new figure with a disc for each of several ways to place one weight; see `draw_disc`."""
    several = ways or ((),)
    figure, axes = _discs(len(several), labels)
    for k, loose in enumerate(several):
        title = "weight" if len(several) == 1 else f"solution {k + 1}"
        options: dict[str, Any] = {"remove": remove, "weight": weight, "loose": loose, "words": words}
        draw_disc(axes[k], title, holes, mounting, labels, **options)
    return figure


def _discs(count: int, labels: Labels) -> tuple[Figure, list[Axes]]:
    """A new figure with axes for so many discs, two in a row, under what holds for all."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = new_figure(3.75 * rows + 0.5, 3.5 * max(columns, 1.3))
    figure.suptitle(seen_from(labels), fontsize=TEXT)
    return figure, [figure.add_subplot(rows, columns, k + 1) for k in range(count)]


def seen_from(labels: Labels) -> str:
    """From which end the discs are seen and how angles count, in words."""
    way = "clockwise" if labels.drawn_sign < 0 else "counter-clockwise"
    return (
        f"Seen from the end from which the rotor turns {way};\n"
        f"angles from the mark (triangle) {labels.side} the rotation"
    )


def _pieces(holes: Holes, mounting: Mounting, h: int, scale: float) -> str:
    """What goes into a hole: "2 × 150 + 50"."""
    parts = [
        f"{n} × ".removeprefix("1 × ") + f"{size * scale:.4g}"
        for n, size in zip(mounting.counts[h], holes.pieces, strict=False)
        if n
    ]
    return " + ".join(parts) or f"{mounting.amounts[h] * scale:.4g}"


def _circle(ax: Axes, centre: complex, radius: float, **look: Any) -> None:  # noqa: ANN401
    """A circle around a place of the picture."""
    ax.add_patch(Circle((centre.real, centre.imag), radius, ec="black", **look))


def _hatch(ax: Axes, ends: FloatArray) -> None:
    """A part of the rim, rad."""
    ax.add_patch(Wedge((0, 0), 1.0, *np.degrees(np.sort(ends)), width=0.32, fc="white", hatch="xxxx"))


def _draw_holes(ax: Axes, holes: Holes, ways: ComplexArray, scale: float) -> None:
    """Numbered circles; hatched, radius scale × √weight, where something is mounted already."""
    count = len(ways)
    for h, way in enumerate(ways):
        _circle(ax, _HOLES * way, min(0.05, _HOLES / count), fc="white")
        if holes.taken[h] > 0:
            _circle(ax, _HOLES * way, scale * np.sqrt(holes.taken[h]), fc="0.85", hatch="////")
        if h % (count // (_CROWD + 1) + 1) == 0:
            inside = (_NUMBERS - 0.14 * (h % 2) * (count > _CROWD // 2)) * way
            ax.text(inside.real, inside.imag, holes.names[h], ha="center", va="center", fontsize=TEXT)


def _write_around(ax: Axes, at: ComplexArray, texts: Sequence[str], labels: Labels) -> None:
    """Twelve texts around the disc: of the weights that stand there, else the degrees."""
    sectors = np.round(np.angle(at) * 6 / np.pi + 1e-6) % 12
    for sector in range(12):
        several = Counter(texts[k] for k in np.flatnonzero(sectors == sector).tolist())
        text = "\n".join(f"{n} × {what}" if n > 1 else what for what, n in several.items())
        way = _TEXTS * np.exp(1j * np.pi * sector / 6)
        ax.text(
            way.real,
            way.imag,
            text or f"{30 * sector * labels.angles_on_paper % 360}°",
            ha=("right", "center", "left")[round(way.real) + 1],
            va=("top", "center", "bottom")[round(way.imag) + 1],
            fontsize=TEXT,
            fontweight="bold" if text else "normal",
        )


def _draw_arrows(
    ax: Axes, wanted: complex | None, made: complex | None, tolerance: float | None, labels: Labels
) -> list[str]:
    """What is wanted and made, the tolerance around the first; in words."""
    if wanted is not None and made is not None and np.isclose(made, wanted, rtol=1e-9, atol=0.0):
        made = None  # one arrow says it all
    longest, lines = max(abs(wanted or 0.0), abs(made or 0.0)) or 1.0, []
    for name, vector, face in ("wanted", wanted, "white"), ("made", made, "black"):
        if vector is not None:
            lines.append(f"{name} ({face}): {labels.weight_at(vector)}")
            tip = _ARROW / longest * on_paper(labels, vector)
            arrow = {"width": 0.8, "headwidth": 7, "headlength": 9, "fc": face}
            ax.annotate("", (tip.real, tip.imag), (0, 0), arrowprops=arrow)
    if wanted is not None and made is not None:
        error = figures(abs(made - wanted) * labels.weight_scale, 2)
        lines[-1] += f"\nerror: {error} {labels.weight_in}"
    if wanted is not None and tolerance is not None:
        lines[-1] += f"\npermissible (dotted): {labels.weight_words(tolerance)}"
        centre = complex(_ARROW / longest * on_paper(labels, wanted))
        _circle(ax, centre, _ARROW / longest * tolerance, fill=False, ls=":")
    return lines


def _largest_circle(at: ComplexArray) -> float:
    """Radius of the largest weight: neighbours do not cover each other, as far as possible."""
    ways = at / np.abs(at)
    apart = np.abs(ways[:, None] - ways)
    return float(np.clip(0.5 * _HOLES * apart[apart > 1e-6].min(initial=2.0), 0.055, 0.13))
