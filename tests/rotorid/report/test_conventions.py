"""Figures and words of the balancing sheet: angles, phases, bars."""

import numpy as np
import pytest

from balancing.data.conventions import Labels
from rotorid.report import conventions
from rotorid.report.balance_figures import ROWS_SHOWN, residual_figure


def test_only_the_largest_readings_of_many_are_drawn():
    rows = [
        {
            "speed_rpm": 1000.0 + k,
            "sensor": "A",
            "before": 1.0 + k,
            "after": 0.5,
            "within_95": None,
            "limit": None,
        }
        for k in range(ROWS_SHOWN + 30)
    ]
    ax = residual_figure(rows, "µm pp").axes[0]
    assert len(ax.get_yticks()) == ROWS_SHOWN
    assert min(bar.get_width() for bar in ax.patches) == 31.0
    assert len(residual_figure(rows[:3], "").axes[0].get_yticks()) == 3


@pytest.mark.parametrize("rotation", ["clockwise", "counter-clockwise"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
@pytest.mark.parametrize("key", [0.0, 130.0])
def test_the_weight_of_the_figure_stands_where_its_angle_says(rotation, angles, key):
    from matplotlib.patches import Circle

    labels = Labels(rotation=rotation, angles=angles)
    ax = conventions.rotor_figure(labels, {"A": 30.0, "B": 120.0}, key).axes[0]
    weight = next(p for p in ax.patches if isinstance(p, Circle) and p.radius < 0.5)
    ccw = 1 if rotation == "counter-clockwise" else -1
    same = 1 if angles == "with rotation" else -1
    expected = (ccw * key + ccw * same * 60.0) % 360
    assert np.degrees(np.angle(complex(*weight.center))) % 360 == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("phase", "peak"), [("lag", 60.0), ("lead", 300.0)])
def test_the_peak_of_the_figure_stands_where_the_phase_says(phase, peak):
    line = conventions.phase_figure(Labels(phase=phase)).axes[0].lines[0]
    turn, reading = line.get_data()
    inside = (turn >= 0) & (turn < 360)
    found = turn[inside][np.argmax(reading[inside])]
    assert found == pytest.approx(peak, abs=1.2)


def test_words_of_the_conventions():
    said = dict(conventions.words(Labels(phase="lag", angles="against rotation"), {}, None))
    assert said["Rotation"].startswith("the job does not say which way the rotor turns")
    assert "against the rotation" in said["Angles of weights"]
    assert said["Phase"].startswith("lag: the angle by which the rotor turns from the pulse")
    assert "not stated" in said["Sensors"]
    labels = Labels(rotation="clockwise", view="free end", clock=True, vibration_unit="mm_s_rms")
    said = dict(conventions.words(labels, {"A": 30.0}, 90.0))
    assert said["Rotation"] == "clockwise seen from the free end."
    assert "clockwise seen from the free end, which is with the rotation" in said["Angles of weights"]
    assert said["Sensors"].startswith("A at 30°")
    assert said["Key phasor"].startswith("at 90° from x")
    assert said["Vibration"] == "in mm/s rms (rms), the part that turns with the rotor (1×)."
    turned = dict(conventions.words(Labels(angles="against rotation"), {"A": 30.0}, 90.0))
    assert turned["Sensors"].startswith("A at 330°")
    assert turned["Key phasor"].startswith("at 270° from x")
