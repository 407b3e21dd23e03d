"""Figures and words of the balancing sheet: angles, phases, bars."""

import numpy as np
import pytest

from balancing.data.conventions import Labels
from rotorid.report import conventions_explained
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
    ax = conventions_explained.rotor_figure(labels, {"A": 30.0, "B": 120.0}, key).axes[0]
    weight = next(p for p in ax.patches if isinstance(p, Circle) and p.radius < 0.5)
    ccw = 1 if rotation == "counter-clockwise" else -1
    same = 1 if angles == "with rotation" else -1
    expected = (ccw * key + ccw * same * 60.0) % 360
    assert np.degrees(np.angle(complex(*weight.center))) % 360 == pytest.approx(expected, abs=1e-6)


def turned(degrees, expected):
    """Whether angles are the same, whole turns apart."""
    return (np.asarray(degrees) - expected + 180) % 360 - 180 == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("rotation", ["clockwise", "counter-clockwise"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_angles_sensors_and_key_phasor_of_the_figure(rotation, angles):
    labels = Labels(rotation=rotation, angles=angles)
    ccw = 1 if rotation == "counter-clockwise" else -1
    same = 1 if angles == "with rotation" else -1
    places = {"A": 30.0, "B": 120.0, "C": 390.0, "front": 200.0, "middle": 200.0, "very long name": 200.0}
    ax = conventions_explained.rotor_figure(labels, places, 130.0).axes[0]
    texts = {text.get_text(): complex(*text.get_position()) for text in ax.texts if text.get_text()}
    for degrees in (90, 180, 270):
        at = texts[f"{degrees}°"]
        on_paper = np.exp(1j * np.radians(ccw * 130.0 + ccw * same * degrees))
        assert abs(np.angle(at / on_paper)) < 0.03
    assert turned(np.degrees(np.angle(texts["mark\n0°"])), ccw * 130.0)
    stated = {"A\nC": 30.0, "B": 120.0, "front …\nvery long n…": 200.0}
    for words, angle in stated.items():
        at = texts[f"{words}\n{same * angle % 360:g}°"]
        assert turned(np.degrees(np.angle(at)), ccw * angle)
    # probes look at the shaft from there, the key phasor at the mark
    probes = [line for line in ax.lines if line.get_linewidth() == 6]
    begin, end = (np.array([complex(*line.get_xydata()[k]) for line in probes]) for k in (0, 1))
    assert turned(np.degrees(np.angle(begin)), ccw * np.array([30.0, 120.0, 200.0]))
    assert turned(np.degrees(np.angle(end)), ccw * np.array([30.0, 120.0, 200.0]))
    assert (np.abs(begin) > 1).all()
    assert (np.abs(end) > np.abs(begin)).all()
    assert {line.get_color() for line in probes} == {"black"}
    (key,) = [complex(*line.get_xydata()[0]) for line in ax.lines if line.get_markerfacecolor() == "white"]
    assert abs(key) > 1
    assert turned(np.degrees(np.angle(key)), ccw * 130.0)
    assert "x" in texts
    # the arrows: of the rotation, then of the angle that is counted
    arrows = [text for text in ax.texts if not text.get_text() and np.hypot(*text.xy) < 1]
    ways = [np.sign(np.angle(complex(*a.xy) / complex(*a.get_position()))) for a in arrows]
    assert ways == [ccw, ccw * same]
    ends = np.degrees(np.angle([complex(*a.xy) for a in arrows]))
    assert turned(ends[1], ccw * 130.0 + ccw * same * 60.0)


def test_sensors_without_a_place_are_drawn_once_and_away_from_the_key_phasor():
    for key in (None, 0.0, 90.0, 225.0):
        ax = conventions_explained.rotor_figure(Labels(), {}, key).axes[0]
        (probe,) = [line for line in ax.lines if line.get_linewidth() == 6]
        assert probe.get_color() == "0.55"
        at = np.degrees(np.angle(complex(*probe.get_xydata()[0])))
        assert abs((at - (key or 0.0) + 180) % 360 - 180) >= 60
        texts = [text.get_text() for text in ax.texts]
        assert "sensor, place\nnot stated" in texts
        assert ("x" in texts) == bool(key)


@pytest.mark.parametrize(("phase", "begin", "end"), [("lag", 360.0, 420.0), ("lead", 300.0, 360.0)])
def test_the_arrow_of_the_phase_goes_from_the_first_to_the_second(phase, begin, end):
    """A lag is from the pulse to the peak, a lead from the peak to the pulse."""
    ax = conventions_explained.phase_figure(Labels(phase=phase)).axes[0]
    (arrow,) = [text for text in ax.texts if not text.get_text()]
    assert (arrow.get_position()[0], arrow.xy[0]) == (begin, end)
    said = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert said[f"phase 60° ({phase})"] == (begin + end) / 2
    pulses = [line for line in ax.lines if len(line.get_xdata()) == 5]
    assert [line.get_xdata()[2] for line in pulses] == [0.0, 360.0]
    peak = begin if phase == "lead" else end
    assert any(list(line.get_xdata()) == [peak, peak] for line in ax.lines)


@pytest.mark.parametrize(
    ("vibration", "weight", "words"),
    [
        ("um_pp", "g", ("in µm pp (from peak to peak)", "in g, at the radius of the plane.")),
        ("um", "g_mm", ("in µm peak (peak amplitude)", "in g·mm: mass times radius.")),
        ("", "g", ("in the unit of the runs, which is not stated.", "in g,")),
        ("bar", "g", ("in bar, as the runs give it.", "in g,")),
    ],
)
def test_units_in_words(vibration, weight, words):
    said = dict(conventions_explained.words(Labels(vibration_unit=vibration, weight_unit=weight), {}, None))
    assert said["Vibration"].startswith(words[0])
    assert said["Weights"].startswith(words[1])


@pytest.mark.parametrize(("phase", "peak"), [("lag", 60.0), ("lead", 300.0)])
def test_the_peak_of_the_figure_stands_where_the_phase_says(phase, peak):
    line = conventions_explained.phase_figure(Labels(phase=phase)).axes[0].lines[0]
    turn, reading = line.get_data()
    inside = (turn >= 0) & (turn < 360)
    found = turn[inside][np.argmax(reading[inside])]
    assert found == pytest.approx(peak, abs=1.2)


def test_words_of_the_conventions():
    said = dict(conventions_explained.words(Labels(phase="lag", angles="against rotation"), {}, None))
    assert said["Rotation"].startswith("the job does not say which way the rotor turns")
    assert "against the rotation" in said["Angles of weights"]
    assert said["Phase"].startswith("lag: the angle by which the rotor turns from the pulse")
    assert "not stated" in said["Sensors"]
    labels = Labels(rotation="clockwise", view="free end", clock=True, vibration_unit="mm_s_rms")
    said = dict(conventions_explained.words(labels, {"A": 30.0}, 90.0))
    assert said["Rotation"] == "clockwise seen from the free end."
    assert "clockwise seen from the free end, which is with the rotation" in said["Angles of weights"]
    assert said["Sensors"].startswith("A at 30°")
    assert said["Key phasor"].startswith("at 90° from x")
    assert said["Vibration"] == "in mm/s rms (rms), the part that turns with the rotor (1×)."
    turned = dict(conventions_explained.words(Labels(angles="against rotation"), {"A": 30.0}, 90.0))
    assert turned["Sensors"].startswith("A at 330°")
    assert turned["Key phasor"].startswith("at 270° from x")


def test_a_figure_of_readings_holds_before_after_their_reach_and_limits():
    rows = [
        {"speed_rpm": speed, "sensor": sensor, "before": before, "after": after, "within_95": reach,
         "limit": limit}
        for speed, sensor, before, after, reach, limit in (
            (1000.0, "A", 10.0, 4.0, 1.0, None),
            (1000.0, "B", 12.0, 2.0, 3.0, 6.0),
            (3000.0, "A", 20.0, 5.0, 2.0, 7.0),
        )
    ]  # fmt: skip
    figure = residual_figure(rows, "µm pp")
    ax = figure.axes[0]
    assert [bar.get_width() for bar in ax.patches] == [10.0, 12.0, 20.0]
    # readings of one speed stand together, those of the next further below
    y = [bar.get_y() + bar.get_height() / 2 for bar in ax.patches]
    assert y == pytest.approx([0.0, 1.0, 2.5])
    assert ax.get_yticks().tolist() == pytest.approx(y)
    assert [label.get_text() for label in ax.get_yticklabels()] == ["A", "B", "A"]
    low, high = ax.get_ylim()
    assert high < 0 < 2.5 < low
    assert {t.get_text(): t.get_position()[1] for t in ax.texts} == pytest.approx(
        {"1000 rpm": 0.0, "3000 rpm": 2.5}
    )
    assert [line.get_xdata().tolist() for line in ax.lines] == [[4.0, 2.0, 5.0]]
    # an amplitude reaches to 0 at least
    ends = [(segment[0][0], segment[1][0]) for segment in ax.collections[0].get_segments()]
    assert ends == [(3.0, 5.0), (0.0, 5.0), (3.0, 7.0)]
    limits = next(c for c in ax.collections if c.get_label() == "limit")
    assert [segment[0][0] for segment in limits.get_segments()] == [6.0, 7.0]
    assert [segment[:, 1].mean() for segment in limits.get_segments()] == pytest.approx([1.0, 2.5])
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["before", "predicted with 95 % of a check run", "limit"]
    assert (ax.get_xlabel(), ax.get_xscale()) == ("amplitude, µm pp", "linear")
    for row in rows:
        row["within_95"] = row["limit"] = None
    assert len(figure.axes) == 1
    rows[1]["after"] = 13.0
    grown = residual_figure(rows, "")
    names = [text.get_text() for text in grown.legends[0].get_texts()]
    assert names == ["before", "predicted", "perhaps no better than before"]
    assert [line.get_mfc() for line in grown.axes[0].lines] == ["black", "white"]
    rows[0]["after"], rows[1]["after"], rows[2]["after"] = 0.4, 0.9, 0.5  # too small to be read beside 20
    plain, closer = residual_figure(rows, "").axes
    assert (plain.get_xlabel(), plain.get_xscale()) == ("amplitude", "linear")
    assert (closer.get_xlabel(), closer.get_xscale()) == ("what is left", "linear")
    assert closer.lines[0].get_xdata().tolist() == [0.4, 0.9, 0.5]
    assert 0.9 < closer.get_xlim()[1] < 1.1
    assert plain.get_xlim()[1] > 20
