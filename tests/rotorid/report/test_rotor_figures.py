"""Figures of the sheets: what stands in them, looked up before they become elements of a page."""

import matplotlib as mpl
import numpy as np
import pytest
from fem_rotors import rotor23
from matplotlib.lines import Line2D

import fem
from rotorid.reduction import compare_methods, reduce
from rotorid.report import rotor_figures

mpl.use("Agg")


@pytest.fixture
def drawn(monkeypatch):
    """Figures that were drawn, in order."""
    figures = []
    monkeypatch.setattr(rotor_figures, "inline_svg", lambda figure, _: figures.append(figure) or "")
    return figures


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_bars_of_the_methods_differ_without_colour_and_their_numbers_stand_upright(drawn):
    methods = compare_methods(rotor23(), (7, 12, 18))
    rotor_figures.methods_picture(methods)
    (figure,) = drawn
    for axes in figure.axes:
        hatches = [{bar.get_hatch() for bar in container} for container in axes.containers]
        assert all(len(own) == 1 for own in hatches)
        assert len({own.pop() for own in hatches}) == len(methods.rows)
        numbers = [text for text in axes.texts if not text.get_text().startswith("MAC")]
        assert len(numbers) == 3 * len(methods.rows)
        assert {text.get_rotation() for text in numbers} == {90.0}
    assert legend(figure.axes[0]) == [row.name for row in methods.rows]


def test_shapes_have_a_legend_of_the_curves_alone(drawn):
    modes = fem.critical_speeds(rotor23(1e4), 3)
    rotor_figures.modes_picture(modes)
    rotor_figures.reduction_picture(reduce(rotor23(), (7, 12, 18), 2), "three masses")
    shapes, reduction = (figure.axes[0] for figure in drawn)
    assert [words.partition(":")[0] for words in legend(shapes)] == ["1", "2", "3"]
    handles = dict(zip(*shapes.get_legend_handles_labels()[::-1], strict=True))
    left = {words for words, handle in handles.items() if not isinstance(handle, Line2D)}
    assert left
    assert not left & set(legend(shapes))
    assert not any("mass" in words or "support" in words for words in legend(reduction))
    assert reduction.get_ylabel() == "mode shape, largest = 1"


def test_the_response_is_marked_at_the_peaks_of_every_reading(drawn):
    rotor, speeds = rotor23(2e4), np.linspace(50.0, 700.0, 400)
    response = fem.unbalance_response(rotor, {12: 1e-3}, speeds)
    places = [2, 12]
    peaks = [fem.response_peaks(response, place) for place in places]
    rotor_figures.bode_picture(response, places, peaks, (200.0, 250.0))
    above, below = drawn[0].axes[:2]
    for line, place in zip(above.get_lines(), places, strict=False):
        np.testing.assert_allclose(line.get_ydata(), 1e6 * np.abs(response.at(place)))
    for line, found in zip(above.get_lines(), peaks, strict=False):
        marked = line.get_xdata()[line.get_markevery()] * np.pi / 30
        np.testing.assert_allclose(marked, [peak.speed for peak in found.peaks], atol=1.7)
    assert {text.get_text() for text in above.texts} == {"1291 rpm", "3614 rpm", "5171 to 5188 rpm"}
    assert {"2", "12"} <= set(legend(above))
    assert below.get_legend() is None


def test_planes_are_called_what_stands_at_them_and_many_sensors_are_left_out(drawn):
    rotor = rotor23()
    rotor_figures.rotor_picture(rotor, [7, 12], [(2, 45.0), (22, 0.0)], "unbalance")
    rotor_figures.rotor_picture(rotor, [], [2, 7, 12, 18], "unbalance")
    rotor_figures.rotor_picture(rotor, [], [2, 7, 12, 18, 22], "unbalance")
    some, four, many = (legend(figure.axes[0]) for figure in drawn)
    assert "unbalance" in some
    assert not any(words.startswith("correction plane") for words in some)
    assert [any(words.startswith("sensor") for words in each) for each in (some, four, many)] == [
        True, True, False,
    ]  # fmt: skip
