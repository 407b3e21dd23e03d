"""Figures and words of the balancing sheet: angles and phases."""

import numpy as np
import pytest

from balancing import Labels
from rotorid.report import conventions_explained


def turned(degrees, expected):
    """Whether angles are the same, whole turns apart."""
    return (np.asarray(degrees) - expected + 180) % 360 - 180 == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("rotation", ["clockwise", "counter-clockwise"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_angles_sensors_and_key_phasor_of_the_figure(rotation, angles):
    labels = Labels(rotation=rotation, angles=angles)
    ccw = 1 if rotation == "counter-clockwise" else -1
    same = 1 if angles == "with rotation" else -1
    ax = conventions_explained.rotor_figure(labels, {"A": 30.0, "B": 120.0}, 130.0).axes[0]
    texts = {text.get_text(): complex(*text.get_position()) for text in ax.texts if text.get_text()}
    for words, angle in {"mark\n0°": 130.0, "90°": 130.0 + same * 90, "270°": 130.0 + same * 270}.items():
        assert np.angle(texts[words] / np.exp(1j * np.radians(ccw * angle))) == pytest.approx(0, abs=0.03)
    for sensor, angle in {"A": 30.0, "B": 120.0}.items():
        at = texts[f"{sensor}\n{same * angle % 360:g}°"]
        assert turned(np.degrees(np.angle(at)), ccw * angle)
    # probes look at the shaft from there, the key phasor at the mark
    probes = [line for line in ax.lines if line.get_linewidth() == 6]
    begin = np.array([complex(*line.get_xydata()[0]) for line in probes])
    assert turned(np.degrees(np.angle(begin)), ccw * np.array([30.0, 120.0]))
    (key,) = [complex(*line.get_xydata()[0]) for line in ax.lines if line.get_markerfacecolor() == "white"]
    assert turned(np.degrees(np.angle(key)), ccw * 130.0)
    # the arrows: of the rotation, then of the angle that is counted
    arrows = [text for text in ax.texts if not text.get_text() and np.hypot(*text.xy) < 1]
    ways = [np.sign(np.angle(complex(*a.xy) / complex(*a.get_position()))) for a in arrows]
    assert ways == [ccw, ccw * same]
    assert turned(np.degrees(np.angle(complex(*arrows[1].xy))), ccw * 130.0 + ccw * same * 60.0)


@pytest.mark.parametrize(("phase", "peak"), [("lag", 60.0), ("lead", 300.0)])
def test_the_peak_of_the_figure_stands_where_the_phase_says(phase, peak):
    line = conventions_explained.phase_figure(Labels(phase=phase)).axes[0].lines[0]
    turn, reading = line.get_data()
    inside = (turn >= 0) & (turn < 360)
    found = turn[inside][np.argmax(reading[inside])]
    assert found == pytest.approx(peak, abs=1.2)
