"""Correction planes as discs: holes and what goes into them, drawn to scale.

A disc is seen from the end from which the rotor turns counter-clockwise, or from the one that the job states.
Angles are written as the job counts them. Where material is removed everything that is mounted or taken away
stands at the angle of the equivalent added weight + 180°.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Circle, Wedge

from balancing.conventions import Labels
from balancing.holes import Holes, Mounting, contents
from balancing.plots.polar import on_paper, turn_sign
from rotorid.base.arrays import ComplexArray
from rotorid.base.plot_style import TEXT, new_figure
from rotorid.base.text import cut

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from balancing.choice_of_pieces import Mounted
    from balancing.correction_result import Correction

_HOLES, _NUMBERS, _TEXTS, _SIDE, _EDGE = 0.84, 0.63, 1.08, 1.95, 1.42
"""Radii of holes, their numbers, what stands around the disc; half of the picture."""
_LINE, _NUMBERED = 0.22, 16
"""Height of a line of text below; holes that all have their numbers."""
ROW = 3.6
"""Inches, of a row of discs."""


def draw_disc(  # noqa: PLR0913
    ax: Axes,
    plane: str,
    holes: Holes | None,
    mounting: Mounting | None,
    labels: Labels,
    *,
    remove: bool = False,
    weight: complex = 0j,
    loose: Sequence[complex] = (),
    forbidden: Sequence[tuple[float, float]] = (),
    zero: complex = 1.0,
) -> Axes:
    """Draw one plane: rotation, mark, numbered holes, weights (area by mass); in words what they are to make.

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
        Wanted weight (equivalent added), kg or kg·m.
    loose
        Further weights at any angles, in one place each.
    forbidden
        First angle and width, rad with the rotation, of arcs where no weight can stand (hatched).
    zero
        Where 0° stands: 1 to the right, 1j at the top.
    """
    sign, minus = (-1.0, "−") if remove else (1.0, "")
    weights, taken = [*loose], np.zeros(1) if holes is None else holes.taken
    texts = [f"{minus}{labels.weight_words(abs(w))}\n{labels.weight(sign * w)[1]:.1f}°" for w in loose]
    if holes is not None and mounting is not None:
        for h, made, words in contents(holes, mounting, labels.weight_scale):
            weights.append(made)
            texts.append(f"{holes.names[h]}: {minus}{words}")
    at = sign * zero * on_paper(labels, weights)
    scale = min(0.1, _HOLES * np.pi / len(taken)) / np.sqrt(max([*np.abs(at), *taken]) or 1.0)
    what = f"{'take away' if remove else 'add'}, {labels.weight_in}"
    title = f"{cut(plane, 20)}: {'nothing' if mounting is not None and not weights else what}"
    ax.set_title(title, fontsize="medium", fontweight="bold", parse_math=False)
    ax.axis("off")
    ax.set(aspect="equal", xlim=(-_SIDE, _SIDE), ylim=(-_EDGE, _EDGE))
    _circle(ax, 0j, 1.0, fc="white")
    turned = float(np.degrees(np.angle(zero)))
    mark = 0.95 * zero
    ax.plot(mark.real, mark.imag, marker=(3, 0, turned + 90.0), color="black", ms=8)
    for start, width in forbidden:
        ends = (
            np.degrees(np.sort(labels.drawn_sign * np.array([start, start + width])))
            + 180.0 * remove
            + turned
        )
        ax.add_patch(Wedge((0, 0), 1.0, *ends, width=0.32, fc="white", hatch="xxxx"))
    if holes is not None:
        _draw_holes(ax, holes, sign * zero * on_paper(labels, np.exp(1j * holes.angles)), scale)
    look: dict[str, Any] = {"fc": "white", "hatch": "xxx"} if remove else {"fc": "0.2"}
    for place in at:
        _circle(ax, _HOLES * place / abs(place), scale * np.sqrt(abs(place)), **look)
    _write_around(ax, at, texts, labels, zero)
    vectors = {"wanted": weight, "made": sum(weights)}
    if np.isclose(weight, sum(weights), rtol=1e-9, atol=0.0):
        del vectors["made"]
    like = "like adding, " if remove else ""
    lines = [f"{like}{name}: {labels.weight_at(vector)}" for name, vector in vectors.items() if vector]
    lines = [f"{turn_sign(labels)} rotation", *lines, *["grey: there already"] * bool(taken.any())]
    bottom = -_EDGE - _LINE * len(lines)
    ax.set_ylim(bottom, _EDGE)
    _write(ax, 1j * bottom, "\n".join(lines), va="bottom")
    return ax


def draw_plane(
    ax: Axes,
    c: Correction,
    plane: str,
    mounted: Mounted | None = None,
    holes: Holes | None = None,
    zero: complex = 1.0,
) -> Axes:
    """One plane of a correction with the pieces in its holes, or with the weight where it stands.

    Parameters
    ----------
    ax
        Where; ordinary axes.
    c, plane
        A correction and one of its planes.
    mounted
        Pieces in holes; None: none were chosen.
    holes
        Of the plane, where none were chosen for them.
    zero
        Where 0° stands: 1 to the right, 1j at the top.
    """
    p, mounting = c.planes.index(plane), None
    wanted = loose = c.weights[p]
    if mounted is not None:
        holes, mounting = mounted.holes[p], mounted.discrete.mountings[p]
        loose = mounted.weights[p] if mounting is None else 0.0
        if mounted.on_top_of is not None:
            wanted = c.to_add[c.mounted.planes.index(plane)]
    return draw_disc(
        ax,
        plane,
        holes,
        mounting,
        c.labels,
        remove=plane in c.remove,
        weight=complex(wanted),
        loose=[complex(loose)] if loose else [],
        forbidden=c.limits.forbidden[p] if c.limits else (),
        zero=zero,
    )


def weight_figure(
    labels: Labels,
    weight: complex,
    *ways: Sequence[complex],
    holes: Holes | None = None,
    mounting: Mounting | None = None,
    remove: bool = False,
    titles: Sequence[str] = (),
) -> Figure:
    """A new figure with a disc for each of several ways to place one weight; see `draw_disc`."""
    several = ways or ((),)
    figure = new_figure(disc_height(len(several)), 3.5 * (2 if len(several) > 1 else 1.3))
    axes = disc_axes(figure, len(several), labels)
    for k, (ax, loose) in enumerate(zip(axes, several, strict=True), start=1):
        title = titles[k - 1] if titles else f"solution {k}" if len(several) > 1 else "weight"
        draw_disc(ax, title, holes, mounting, labels, remove=remove, weight=weight, loose=loose)
    return figure


def disc_height(count: int) -> float:
    """Inches that so many discs want, two in a row."""
    return ROW * -(-count // 2) + 0.5


def disc_axes(figure: Figure | SubFigure, count: int, labels: Labels) -> list[Axes]:
    """Axes for so many discs, two in a row, under what holds for all, in `disc_height`."""
    columns, rows = min(count, 2), -(-count // 2)
    way = "clockwise" if labels.drawn_sign < 0 else "counter-clockwise"
    words = (
        f"Seen from the end from which the rotor turns {way};\n"
        f"angles from the mark (triangle) {labels.side} the rotation"
    )
    figure.suptitle(words, fontsize=TEXT)
    return [figure.add_subplot(rows, columns, k + 1, anchor="N") for k in range(count)]


def _circle(ax: Axes, centre: complex, radius: float, **look: Any) -> None:  # noqa: ANN401
    """A circle around a place of the picture."""
    ax.add_patch(Circle((centre.real, centre.imag), radius, ec="black", **look))


def _write(ax: Axes, at: complex, text: str, **look: Any) -> None:  # noqa: ANN401
    """Text at a place of the picture, around it unless told otherwise."""
    ax.text(
        at.real, at.imag, text, **{"ha": "center", "va": "center", **look}, fontsize=TEXT, parse_math=False
    )


def _draw_holes(ax: Axes, holes: Holes, ways: ComplexArray, scale: float) -> None:
    """Circles, some numbered; hatched, radius scale × √weight, where something is mounted already."""
    count = len(ways)
    for h, (way, taken) in enumerate(zip(ways, holes.taken, strict=True)):
        _circle(ax, _HOLES * way, min(0.05, _HOLES / count), fc="white")
        if taken:
            _circle(ax, _HOLES * way, scale * np.sqrt(taken), fc="0.85", hatch="////")
        if h % (count // (_NUMBERED + 1) + 1) == 0:
            _write(ax, _NUMBERS * way, holes.names[h])


def _write_around(ax: Axes, at: ComplexArray, texts: Sequence[str], labels: Labels, zero: complex) -> None:
    """Twelve texts around the disc: of the weights that stand there, else the degrees."""
    first = round(np.angle(zero) * 6 / np.pi)
    sectors = np.round(np.angle(at) * 6 / np.pi + 1e-6) % 12
    for sector in range(12):
        text = "\n".join(texts[k] for k in np.flatnonzero(sectors == sector).tolist())
        way = _TEXTS * np.exp(1j * np.pi * sector / 6)
        _write(
            ax,
            way,
            text or f"{30 * (sector - first) * labels.angles_on_paper % 360}°",
            ha=("right", "center", "left")[round(way.real) + 1],
            va=("top", "center", "bottom")[round(way.imag) + 1],
            fontweight="bold" if text else "normal",
        )
