"""Style of all pictures: colours, line styles, axes.

A picture is at most `WIDTH` wide and no letter of it smaller than `TEXT`: then it stands in a page as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from rotorid.base.text import RPM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axes._base import _AxesBase
    from matplotlib.figure import Figure

# Okabe and Ito: told apart by every eye.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
BLUE, VERMILION = COLORS[:2]
STYLES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
WIDTH, TEXT = 7.0, 9.0
"""Inches, of the widest picture; points, of the smallest letters."""
GRID, QUIET, DARK = "#e4e7eb", "#6b7480", "#4a5360"
BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}
"""Behind words that stand on curves."""
ABOVE_SCALE = 4.2
"""Room, in letters, between axes and a legend above their second scale."""


def new_axes(size: tuple[float, float] = (WIDTH, 4.2), **options: Any) -> Axes:  # noqa: ANN401  of matplotlib
    """Make axes of a new figure, size in inches; options as for `add_subplot`."""
    from matplotlib import pyplot as plt

    ax: Axes = plt.figure(figsize=size, layout="constrained").add_subplot(**options)
    return ax


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure, size in inches; it needs no screen."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def on_figure(
    draw: Callable[[Axes], object],
    width: float = WIDTH,
    height: float = 4.2,
    **options: Any,  # noqa: ANN401  of matplotlib
) -> Figure:
    """A new figure, size in inches, with what a function draws on its axes; options as for `add_subplot`."""
    figure = new_figure(height, width)
    draw(figure.add_subplot(**options))
    return figure


def look(k: int, points: int | None = None) -> dict[str, Any]:
    """Colour and style of curve k: neighbours differ by their style too, in black and white.

    With the number of its points given, also marks where they are few, or more curves than line styles.
    """
    style: dict[str, Any] = {"color": COLORS[k % len(COLORS)], "linestyle": STYLES[k % len(STYLES)]}
    if points and (points < 12 or k >= len(STYLES)):
        style |= {"marker": MARKERS[k % len(MARKERS)], "markevery": max(points // 8, 1)}
    return style


def note(
    ax: Axes,
    text: str,
    at: tuple[float, float],
    shift: tuple[float, float] = (0.0, 0.0),
    **options: Any,  # noqa: ANN401  of matplotlib
) -> None:
    """Small words at a place of the data, moved by so many points; options as for `annotate`."""
    ax.annotate(text, at, xytext=shift, textcoords="offset points", **{"fontsize": TEXT, **options})


def legend_above(
    ax: Axes,
    columns: int = 3,
    height: float = 1.0,
    **options: Any,  # noqa: ANN401  of matplotlib
) -> None:
    """A legend that hides nothing, above the axes; below them where its height is negative."""
    ax.legend(
        loc="upper center" if height < 0 else "lower center",
        bbox_to_anchor=(0.5, height),
        ncols=columns,
        frameon=False,
        fontsize=TEXT,
        **options,
    )


def legend_below(figure: Figure, axes: Iterable[Axes], columns: int = 2, **options: Any) -> None:  # noqa: ANN401
    """One legend for several axes, below all of them; what two of them name alike stands there once."""
    shown: dict[str, Any] = {}
    for ax in axes:
        shown |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    options |= {"loc": "outside lower center", "ncols": columns, "frameon": False}
    figure.legend([*shown.values()], [*shown], fontsize=TEXT, title_fontsize=TEXT, **options)


def plain(ax: Axes) -> None:
    """A grid behind the curves, no box."""
    ax.grid(color=GRID, linewidth=0.8)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def plain_numbers(ax: _AxesBase) -> None:
    """1, 2, 5, 10 instead of powers of ten on a logarithmic vertical axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = ax.get_ylim()
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 500 * low else (1.0,)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())


def second_scale(ax: Axes, unit: float = RPM, label: str = "speed, rad/s", side: str = "top") -> None:
    """A second scale, of values in this unit, above the axes or right of them."""
    axis = "x" if side == "top" else "y"
    make: Callable[..., _AxesBase] = getattr(ax, f"secondary_{axis}axis")
    scale = make(side, functions=(lambda x: x / unit, lambda x: x * unit))
    scale.tick_params(labelsize=TEXT)
    getattr(scale, f"set_{axis}label")(label, fontsize=TEXT)
