import subprocess
import sys
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from documents import check_hygiene
from fem_rotors import rotor23

import fem
from fem import Peak, Peaks, Window, draw_rotor
from fem.plots.campbell import campbell_figure, draw_speed_map
from fem.plots.response import bode_figure, draw_orbits, draw_polar, influence_figure
from rotorid.base.text import RPM
from rotorid.plots import plot

mpl.use("Agg")


@pytest.fixture(autouse=True)
def _closed_figures():
    from matplotlib import pyplot as plt

    yield
    plt.close("all")


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_drawing_is_to_scale_and_shows_bores_masses_and_supports():
    rotor = fem.Rotor(
        [0.1, 0.3, 0.2],
        [0.05, 0.12, 0.06],
        [0.0, 0.08, 0.0],
        discs=[fem.Disc(2, 10.0), fem.Disc(3, 30.0)],
        supports=[fem.Support(1, 1e7), fem.Support(4, 1e7, 1e3)],
        forces=[fem.Stop(2, stiffness=1e6)],
    )
    ax = draw_rotor(rotor)
    boxes = [patch.get_bbox().bounds for patch in ax.patches]
    np.testing.assert_allclose(boxes[1], (0.1, -60.0, 0.3, 120.0))
    np.testing.assert_allclose(boxes[3], (0.1, -40.0, 0.3, 80.0))
    assert labels(ax) == ["mass, 10 to 30 kg", "bearing", "damped bearing", "stop"]
    masses, *marks = ax.collections
    assert masses.get_sizes()[1] == pytest.approx(3 * masses.get_sizes()[0])
    places = [mark.get_offsets().tolist() for mark in marks]
    assert places == [[[0.0, -25.0]], [[pytest.approx(0.6), -30.0]], [[0.1, -60.0]]]
    check_hygiene(ax.figure)


def whirl(criticals=()):
    speeds = np.linspace(0, 1000, 11)
    columns = [400 - 0.05 * speeds, 400 + 0.05 * speeds, np.where(speeds < 300, np.nan, 900.0)]
    return SimpleNamespace(
        speeds=speeds,
        frequencies=np.stack(columns, axis=1),
        log_decrements=np.stack([0.3 + 0 * speeds, 0.4 - 0.5e-3 * speeds, 2 + 0 * speeds], axis=1),
        direction=np.stack([-1 + 0 * speeds, 1 + 0 * speeds, np.where(speeds < 600, 0.0, 1.0)], axis=1),
        criticals=criticals,
        windows=(),
        std=None,
        heavy=6.0,
    )


def test_a_campbell_diagram_tells_directions_apart_without_colour():
    figure = campbell_figure(whirl([(380.95, 0.3), (421.05, 0.19), (800, 2.0)]), operating=(600, 700))
    above, below = figure.axes[:2]
    lines = above.get_lines()
    looks = [(line.get_linestyle(), line.get_marker(), line.get_fillstyle()) for line in lines[:4]]
    assert looks == [
        ("--", "v", "none"), ("-", "^", "full"), (":", "D", "none"), ("-", "^", "full"),
    ]  # fmt: skip
    np.testing.assert_allclose(lines[0].get_ydata(), RPM * whirl().frequencies[:, 0])
    np.testing.assert_allclose(np.diff(lines[4].get_data(), axis=0), 0.0)
    marks, hollow = [line for line in lines if line.get_linestyle() == "None"]
    np.testing.assert_allclose(marks.get_xdata(), RPM * np.array([380.95, 421.05]))
    assert (hollow.get_markerfacecolor(), *hollow.get_xdata()) == ("none", RPM * 800)
    words = sorted((text for text in above.texts if "δ" in text.get_text()), key=lambda text: text.xy)
    texts = [text.get_text() for text in words]
    assert texts == ["3638 rpm, δ = 0.3", "4021 rpm, δ = 0.19", "7639 rpm, δ = 2"]
    np.testing.assert_allclose(below.get_lines()[1].get_ydata(), whirl().log_decrements[:, 1])
    assert below.get_ylim()[0] < -0.1
    for ax in (above, below):
        band = next(patch for patch in ax.patches if patch.get_label() == "operating range")
        assert (band.get_x(), band.get_width()) == pytest.approx((600 * RPM, 100 * RPM))
    check_hygiene(figure, unitless=["logarithmic decrement"])


SPEEDS = np.linspace(10, 300, 200)
RESONANCE = 1e-5 * SPEEDS**2 / (150.0**2 - SPEEDS**2 + 2j * 0.05 * 150 * SPEEDS)


def test_bode_shows_amplitude_phase_peaks_and_the_operating_range():
    windows = (Window(290.0, 300.0, begins=True, ends=False),)
    above, below = bode_figure(
        readings_of(SPEEDS, RESONANCE, -RESONANCE, windows=windows),
        ["A", "B"],
        [peaks_at(150.4, 270.0), peaks_at(152.0)],
        operating=(200, 250),
    ).axes[:2]
    steady = SPEEDS < 290
    np.testing.assert_allclose(above.get_lines()[0].get_ydata()[steady], 1e6 * np.abs(RESONANCE[steady]))
    assert np.isnan(above.get_lines()[0].get_ydata()[~steady]).all()
    # every sensor's own peaks are marked, on both of its curves, where they are
    for ax in (above, below):
        marks = ax.get_lines()[2:4]
        for line, expected in zip(marks, ([150.4, 270.0], [152.0]), strict=True):
            np.testing.assert_allclose(line.get_xdata() / RPM, expected)
        hatched = [patch for patch in ax.patches if patch.get_hatch()]
        assert [(p.get_x(), p.get_width()) for p in hatched] == [pytest.approx((290 * RPM, 10 * RPM))]
    assert {"operating range", "unstable: no steady state"} < set(labels(above))
    phase = below.get_lines()[0].get_ydata()
    assert phase[0] == pytest.approx(-0.38, abs=0.05)  # undamped below, half a turn behind above
    assert phase[steady][-1] == pytest.approx(-176.0, abs=0.5)
    check_hygiene(above.figure)


def readings_of(speeds, *Z, windows=()):
    return SimpleNamespace(speeds=speeds, readings=lambda sensors: np.stack(Z, axis=1), windows=windows)


def peaks_at(*speeds):
    return Peaks(tuple(Peak(speed, 1e-5, None, None, 10.0, None, None) for speed in speeds), None)


def test_polar_goes_round_at_resonance():
    ax = draw_polar(SPEEDS, RESONANCE[:, None], ["A"])
    angle, size = ax.get_lines()[0].get_data()
    np.testing.assert_allclose(size * np.exp(1j * np.asarray(angle)), 1e6 * RESONANCE, rtol=1e-9)
    assert any(1300 < float(text.get_text()) < 1560 for text in ax.texts)
    # each mark stands where the curve is at the speed written beside it
    for text in ax.texts:
        z = 1e6 * np.interp(float(text.get_text()), SPEEDS * RPM, RESONANCE)
        assert text.xy[1] * np.exp(1j * text.xy[0]) == pytest.approx(z, rel=0.01)
    check_hygiene(ax.figure)


@pytest.mark.parametrize("y", [-1e-6j, 1e-6j])
def test_orbits_have_a_start_and_an_arrow_along_the_motion(y):
    ax = draw_orbits([2e-6, 1e-6], [y, 0.0], ["a", "b"], title="3000 rpm")
    path = np.array(ax.get_lines()[0].get_data())
    turn = np.exp(1j * np.linspace(0.0, 2 * np.pi, 241))
    np.testing.assert_allclose(path, 1e6 * np.real([2e-6 * turn, y * turn]), atol=1e-9)
    arrow = ax.texts[0]
    ends = (np.array(place)[:, None] for place in (arrow.get_position(), arrow.xy))
    first, last = (int(np.argmin(np.hypot(*(path - place)))) for place in ends)
    assert 0 < last - first < 30
    assert "b, straight" in {line.get_label() for line in ax.get_lines()}
    assert ax.get_legend().get_title().get_text().startswith("3000 rpm")
    assert ax.get_aspect() == 1.0
    check_hygiene(ax.figure)


def test_import_loads_neither_matplotlib_nor_scipy():
    code = "import sys, fem; print([m for m in ('matplotlib', 'scipy', 'pandas') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_drawing_holds_everything_and_its_marks_touch_the_rotor():
    discs = [fem.Disc(1, 40.0, 1.25, 0.7, "wheel"), fem.Disc(4, 5.0)]
    rotor = fem.Rotor([0.2, 0.3, 0.3, 0.2], 0.08, discs=discs, supports=[fem.Support(5, 1e7)])
    ax = draw_rotor(rotor, planes=[2], sensors=[1, 4])
    radius, width = 250.0, np.sqrt(12 * 0.075 / 40)  # of the solid disc, mm and m
    assert ax.get_xlim()[0] < -width / 2
    low, high = ax.get_ylim()
    end = high - 0.2 * (high - low)
    assert low < -radius < radius < end
    lines = {
        mark.get_label(): mark.get_segments() for mark in ax.collections if hasattr(mark, "get_segments")
    }
    np.testing.assert_allclose(np.sort(lines["correction plane"][0], axis=0), [[0.2, -end], [0.2, end]])
    # a sensor looks at the disc at node 1, and at the shaft at node 4, from below
    for segment, (x, y) in zip(lines["sensor"], ((0.0, -radius), (0.8, -40.0)), strict=True):
        np.testing.assert_allclose(np.sort(segment, axis=0), [[x, low + 0.2 * (high - low)], [x, y]])


def test_mode_shapes_between_nodes_are_those_of_a_beam():
    rotor = fem.Rotor([0.25] * 4, 0.05, supports=[fem.Support(1, 1e13), fem.Support(5, 1e13)])
    modes = fem.critical_speeds(rotor, n=2)
    ax = plot(modes)
    words = [text for text in labels(ax) if "rpm" in text]
    for k, line in enumerate(ax.get_lines()[1:3], start=1):
        x, y = line.get_data()
        assert (len(x), x[0], x[-1]) == (4 * 12 + 1, 0.0, 1.0)
        expected = np.sin(k * np.pi * np.asarray(x))
        assert np.abs(y * np.sign(y[6] * expected[6]) - expected).max() < 0.01 * k
        assert f"{k}: {modes.frequencies[k - 1] * RPM:.5g} rpm" in words[k - 1]
    check_hygiene(ax.figure)


@pytest.mark.parametrize("turns", [-2, 0, 1, 3])
def test_the_phase_is_a_lag_within_a_turn(turns):
    speeds = np.linspace(10.0, 300.0, 100)
    lag = np.radians(np.linspace(-20.0, -170.0, 100)) + 2 * np.pi * turns
    phase = bode_figure(readings_of(speeds, np.exp(1j * lag)), ["A"]).axes[1].get_lines()[0].get_ydata()
    np.testing.assert_allclose(phase, np.linspace(-20.0, -170.0, 100), atol=1e-9)


def test_influence_has_a_row_for_each_sensor_with_size_and_phase():
    rotor = rotor23(2e4)
    W = fem.influence(rotor, [7, 12], [2, 22], np.linspace(50, 700, 40))
    figure = influence_figure(W, rotor)
    for c, (size, phase) in enumerate(zip(figure.axes[1::2], figure.axes[2::2], strict=True)):
        assert size.get_ylabel().startswith(f"sensor {(2, 22)[c]}")
        for p in (0, 1):
            drawn, lag = (np.asarray(ax.get_lines()[p].get_ydata()) for ax in (size, phase))
            steady = ~np.isnan(drawn)
            found = drawn[steady] * np.exp(1j * np.radians(lag[steady]))
            np.testing.assert_allclose(found, W.W[steady, c, p], rtol=1e-9)


def test_a_speed_map_is_in_rpm_with_its_band():
    k = np.geomspace(1e5, 1e9, 9)
    second = np.array([-1.0, 0.0, 0.5, 30.0, 60.0, 90.0, 120.0, 140.0, np.nan])
    speeds = np.stack([100 * np.sqrt(k / (k + 1e7)), second], axis=1)
    ax = draw_speed_map(SimpleNamespace(stiffness=k, speeds=speeds), operating=(70, 80))
    drawn = ax.get_lines()[1].get_ydata()
    np.testing.assert_allclose(drawn[2:8], second[2:8] * RPM)
    assert np.isnan(np.delete(drawn, range(2, 8))).all()
    (band,) = ax.patches
    assert (band.get_y(), band.get_height()) == pytest.approx((70 * RPM, 10 * RPM))
