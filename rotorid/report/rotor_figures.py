"""Figures of the sheets of rotors: wide as a page, legible on a telephone, told apart without colour."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotorid.base.plot_style import legend_above
from rotorid.plots import plot
from rotorid.report.page import inline_svg

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fem import Rotor, SensorLike
    from rotorid.reduction import Methods, Placement, Reduction, ResponseCost, StabilityCost

WIDTH, LETTERS = 6.0, 9.0
"""Inches and points."""
MARKED = 4
"""Sensors whose names have room below a rotor."""


@dataclass(frozen=True)
class Drawing:
    """A figure of a sheet: its element, and the words below it."""

    svg: Markup
    caption: str


def sketch(height: float, draw: Callable[[Figure], object], caption: str) -> Drawing:
    """Make a figure of this height in inches, let it be drawn on, and put it into a sheet."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({"font.size": LETTERS, "hatch.linewidth": 0.6}):
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        draw(figure)
        return Drawing(inline_svg(figure, caption), caption)


def whole(height: float, result: StabilityCost | Placement, caption: str) -> Drawing:
    """A result as its own plot draws it."""
    return sketch(height, lambda figure: plot(result, figure.add_subplot()), caption)


def rotor_picture(
    rotor: Rotor, planes: Sequence[str | int], sensors: Sequence[SensorLike], meaning: str
) -> Drawing:
    """The rotor to scale, with a few sensors; `meaning` says what stands at the planes."""

    def draw(figure: Figure) -> None:
        from fem import draw_rotor

        marked = sensors if len(sensors) <= MARKED else ()
        axes = draw_rotor(rotor, figure.add_subplot(), planes=planes, sensors=marked)
        legend = axes.get_legend()
        for text in () if legend is None else legend.get_texts():
            if text.get_text().startswith("correction plane"):
                text.set_text(meaning)

    return sketch(2.9, draw, "The rotor, lengths and radii to scale (the two axes differ).")


def reduction_picture(result: Reduction, words: str) -> Drawing:
    """Shapes of the small model over those it was made from."""

    def draw(figure: Figure) -> None:
        axes = plot(result, figure.add_subplot())
        _curves_only(axes, 1, below=result.rotor is not None)
        axes.set_ylabel("mode shape, largest = 1")

    return sketch(3.9, draw, f"Mode shapes of {words}.")


def methods_picture(methods: Methods) -> Drawing:
    """What methods of reduction lose, as hatched bars."""
    return sketch(
        4.0,
        lambda figure: plot(methods, figure.add_subplot()),
        "What each method loses: errors of frequencies.",
    )


def running_picture(response: ResponseCost) -> Drawing:
    """Response of both models, and their difference."""

    def draw(figure: Figure) -> None:
        from rotorid.reduction.plots import plot_running

        above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
        plot_running(response, [above, below])
        above.set_ylabel("largest influence\ncoefficient, µm per g·mm")
        below.set_ylabel("difference, %")

    return sketch(4.8, draw, "Response of both models, and their difference in % of the rotor's.")


def stability_picture(stability: StabilityCost) -> Drawing:
    """Smallest logarithmic decrement of both models over speed."""
    return whole(3.6, stability, "Smallest logarithmic decrement over speed; below 0 a motion grows.")


def placement_picture(placement: Placement) -> Drawing:
    """All ranked choices of nodes."""
    caption = "All ranked choices: largest error of a frequency over the largest 1 − MAC."
    return whole(4.4, placement, caption)


def _curves_only(axes: Axes, columns: int, below: bool = False) -> None:
    """A legend of the curves alone: what the rotor is made of is told by its own drawing."""
    from matplotlib.lines import Line2D

    pairs = [
        pair for pair in zip(*axes.get_legend_handles_labels(), strict=True) if isinstance(pair[0], Line2D)
    ]
    handles, labels = zip(*pairs, strict=True)
    legend_above(axes, columns, 0.75, -0.14 if below else 1.0, handles=handles, labels=labels)
