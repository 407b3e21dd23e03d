"""Documents of results, compared, and pictures of results, inspected."""

import re

import pytest

WIDEST, SMALLEST = 7.0, 9.0  # inches, points
SLACK = 1.5  # pixels


def same(found, printed):
    """The same document but for the provenance, numbers to 1e-9."""
    assert plain(found, "provenance") == plain(printed, "provenance")


def plain(value, *left_out):
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items() if key not in left_out}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return pytest.approx(value, rel=1e-9, abs=1e-12)
    return value


def check_hygiene(figure, *, unitless=()):
    """What every picture keeps: its size, letters, names of axes with their units, legends, nothing cut off.

    `unitless`: names of axes that count or compare and have no unit ("node"); words on an axis need none.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    assert figure.get_figwidth() <= WIDEST + 1e-9, f"{figure.get_figwidth():g} in wide"
    hidden = undrawn(figure)
    written = [text for text in figure.findobj(is_text) if text not in hidden]
    small = {
        text.get_text(): text.get_fontsize() for text in written if text.get_fontsize() < SMALLEST - 1e-9
    }
    assert not small, f"letters below {SMALLEST:g} pt: {small}"
    cut = [text.get_text() for text in written if not _inside(text.get_window_extent(renderer), figure.bbox)]
    assert not cut, f"cut off at the edge: {cut}"
    found = legends_of(figure)
    assert len(found) <= 1, f"{len(found)} legends"
    for ax in _axes(figure):
        if ax.axison and ax.get_visible():
            _check_names(ax, unitless)


def legends_of(figure):
    """Every legend, of the figure, its parts and its axes."""
    from matplotlib.legend import Legend

    return [legend for legend in figure.findobj(Legend) if legend.get_visible()]


def _axes(figure):
    """Those of insets and of second scales too."""
    from matplotlib.axes._base import _AxesBase

    return list(dict.fromkeys(figure.findobj(_AxesBase)))


def is_text(artist):
    from matplotlib.text import Text

    return isinstance(artist, Text) and artist.get_visible() and bool(artist.get_text().strip())


def undrawn(figure):
    """Texts that are not drawn: of hidden axes, and of ticks outside the limits; ticks know no axes."""
    found = set()
    for ax in _axes(figure):
        every = {
            label for axis in _each(ax) for tick in axis.majorTicks + axis.minorTicks for label in _of(tick)
        }
        if not ax.get_visible():
            found |= every | set(ax.findobj(is_text))
        elif ax.axison:
            found |= every - {label for axis in _each(ax) for label in _drawn(axis)}
        else:
            found |= every | {text for axis in _each(ax) for text in (axis.label, axis.offsetText)}
    return found


def _each(ax):
    return tuple(ax._axis_map.values())


def _of(tick):
    return tick.label1, tick.label2


def _drawn(axis):
    """Labels of the ticks of an axis that are drawn."""
    ticks = axis._update_ticks() if axis.get_visible() else []
    return [label for tick in ticks for label in _of(tick) if label.get_visible()]


def _inside(box, frame):
    return (
        box.x0 >= frame.x0 - SLACK
        and box.y0 >= frame.y0 - SLACK
        and box.x1 <= frame.x1 + SLACK
        and box.y1 <= frame.y1 + SLACK
    )


def _check_names(ax, unitless):
    """Numbers along an axis say what of and in which unit: "speed, rpm"; those of polar axes in its title."""
    if ax.name == "polar":
        assert _has_unit(ax.get_title(), unitless), f"polar axes {ax.get_title()!r}: no unit"
        return
    for axis in (ax.xaxis, ax.yaxis):
        words = [label.get_text() for label in _drawn(axis) if label.get_text()]
        if words and not all(re.search(r"[A-Za-z]{2}", word.replace("mathdefault", "")) for word in words):
            name = axis.label.get_text()
            assert _has_unit(name, unitless), f"axis {name!r} with the numbers {words}: no unit"


def _has_unit(name, unitless):
    return bool(re.search(r",\s", name)) or name in unitless or bool(re.search(r"[%°]", name))
