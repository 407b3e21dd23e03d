"""Figures of the sheets: what stands in them, looked up before they become elements of a page."""

import matplotlib as mpl
import numpy as np
from fem_rotors import rotor23

import fem
from fem.plots.response import bode_figure

mpl.use("Agg")


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_the_response_is_marked_at_the_peaks_of_every_reading():
    rotor, speeds = rotor23(2e4), np.linspace(50.0, 700.0, 400)
    response = fem.unbalance_response(rotor, {12: 1e-3}, speeds)
    places = [2, 12]
    peaks = [fem.response_peaks(response, place) for place in places]
    figure = bode_figure(response, places, peaks, operating=(200.0, 250.0))
    above, below = figure.axes[:2]
    for line, place in zip(above.get_lines(), places, strict=False):
        np.testing.assert_allclose(line.get_ydata(), 1e6 * np.abs(response.at(place)))
    for line, found in zip(above.get_lines()[2:], peaks, strict=False):
        marked = line.get_xdata() * np.pi / 30
        np.testing.assert_allclose(marked, [peak.speed for peak in found.peaks], atol=1.7)
    peaks_written = {text.get_text().partition("\n")[0] for text in above.texts}
    assert peaks_written == {"1291 rpm", "3614 rpm", "5171 rpm"}
    assert {"2", "12"} <= set(legend(above))
    assert below.get_legend() is None
