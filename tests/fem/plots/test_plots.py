import dataclasses
import subprocess
import sys
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from documents import check_hygiene
from fem_rotors import rotor23, uniform

import fem
from fem import Peak, Peaks, Window, draw_rotor
from fem.peaks import smooth_curves
from fem.plots.campbell import campbell_figure, draw_speed_map
from fem.plots.response import bode_figure, draw_orbits, draw_polar, influence_figure, polar_figure
from fem.plots.rotor import radii, surface
from rotorid.base.plot_style import new_axes
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
    )
    ax = draw_rotor(rotor)
    boxes = [patch.get_bbox().bounds for patch in ax.patches]
    np.testing.assert_allclose(boxes[1], (0.1, -60.0, 0.3, 120.0))
    np.testing.assert_allclose(boxes[3], (0.1, -40.0, 0.3, 80.0))
    assert labels(ax) == ["mass, 10 to 30 kg", "bearing", "damped bearing"]
    masses, stiff, damped = ax.collections
    assert masses.get_sizes()[1] == pytest.approx(3 * masses.get_sizes()[0])
    np.testing.assert_allclose(stiff.get_offsets(), [[0.0, -25.0]])
    np.testing.assert_allclose(damped.get_offsets(), [[0.6, -30.0]])
    assert ax.get_xlabel() == "position, m"
    assert ax.get_ylabel() == "radius, mm"
    ax.figure.canvas.draw()


def test_mode_shapes_are_drawn_over_the_rotor():
    modes = fem.critical_speeds(rotor23(1e4), n=3)
    ax = new_axes()
    assert plot(modes, ax) is ax
    lines = ax.get_lines()[1:4]
    for line, shape in zip(lines, modes.shapes.T, strict=True):
        x, y = line.get_data()
        assert np.abs(y).max() == pytest.approx(1.0)
        at_nodes = np.interp(modes.positions, x, y)
        np.testing.assert_allclose(at_nodes / at_nodes[0], shape / shape[0], rtol=1e-9)
    assert len(ax.patches) == 23
    assert sum("rad/s" in label for label in labels(ax)) == 3
    assert {"mass, 21 to 30 kg", "damped bearing"} <= set(labels(ax))
    ax.figure.canvas.draw()


def test_amplitudes_over_speed():
    rotor = rotor23(2e4)
    speeds = np.linspace(1, 700, 50)
    response = fem.unbalance_response(rotor, {12: 1e-3}, speeds)
    ax = plot(response)
    assert labels(ax)[:2] == ["node 2", "node 22"]
    np.testing.assert_allclose(ax.get_lines()[0].get_ydata(), 1e6 * np.abs(response.at(2)))
    assert labels(plot(response, nodes=[5])) == ["node 5"]
    ax.figure.canvas.draw()


def turbine():
    return fem.Rotor(
        [0.2, 0.3, 0.3, 0.2],
        0.08,
        discs=[fem.Disc(3, 40.0, 1.25, 0.7, "wheel"), fem.Disc(2, 5.0)],
        supports=[
            fem.Support(1, 1e7, 1e3),
            fem.Support(5, ((1e7, 0), (0, 2e7)), pedestal=fem.Pedestal(100, 1e8)),
            fem.Support(3, 1e5, 1e2, kind="seal"),
        ],
        stations={"wheel": 3},
    )


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


def test_forces_that_are_not_linear_are_drawn_where_they_stand():
    film = {"length": 0.03, "diameter": 0.05, "clearance": 5e-5, "viscosity": 0.02}
    forces = [fem.JournalBearing(1, **film), fem.Stop(2, stiffness=1e6), fem.JournalBearing(3, **film)]
    rotor = fem.Rotor([0.4, 0.6], [0.05, 0.08], forces=forces)
    ax = draw_rotor(rotor)
    assert labels(ax) == ["journal bearing", "stop"]
    places = [marks.get_offsets().tolist() for marks in ax.collections]
    assert places == [[[0.0, -25.0], [1.0, -40.0]], [[0.4, -40.0]]]


def test_a_campbell_diagram_tells_directions_apart_without_colour():
    figure = campbell_figure(whirl([(380.95, 0.3), (421.05, 0.19)]), operating=(600, 700))
    above, below = figure.axes[:2]
    lines = above.get_lines()
    looks = [(line.get_linestyle(), line.get_marker(), line.get_fillstyle()) for line in lines[:4]]
    assert looks == [
        ("--", "v", "none"), ("-", "^", "full"), (":", "D", "none"), ("-", "^", "full"),
    ]  # fmt: skip
    np.testing.assert_allclose(lines[0].get_ydata(), RPM * whirl().frequencies[:, 0])
    np.testing.assert_allclose(np.diff(lines[4].get_data(), axis=0), 0.0)
    marks = next(line for line in lines if line.get_linestyle() == "None")
    np.testing.assert_allclose(marks.get_xdata(), RPM * np.array([380.95, 421.05]))
    words = sorted((text for text in above.texts if "δ" in text.get_text()), key=lambda text: text.xy)
    assert [text.get_text() for text in words] == ["3638 rpm, δ = 0.30", "4021 rpm, δ = 0.19"]
    (first, low), (second, high) = (text.xy for text in words)  # below their marks, and not over each other
    assert (low < first, high <= second, high - low >= 0.0499 * above.get_ylim()[1]) == (True, True, True)
    assert above.get_ylabel() == "whirl frequency, rpm"
    assert below.get_xlabel() == "speed, rpm"
    assert below.get_ylabel() == "logarithmic decrement"
    np.testing.assert_allclose(below.get_lines()[1].get_ydata(), whirl().log_decrements[:, 1])
    assert below.get_ylim()[0] < -0.1
    assert "unstable" in {text.get_text() for text in below.texts}
    for ax in (above, below):
        band = next(patch for patch in ax.patches if patch.get_label() == "operating range")
        assert (band.get_x(), band.get_width()) == pytest.approx((600 * RPM, 100 * RPM))
    check_hygiene(figure, unitless=["logarithmic decrement"])


def test_bode_shows_amplitude_phase_peaks_and_the_operating_range():
    speeds = np.linspace(10, 300, 200)
    Z = 1e-5 * speeds**2 / (150.0**2 - speeds**2 + 2j * 0.05 * 150 * speeds)
    above, below = bode_figure(
        readings_of(speeds, Z, -Z, windows=(Window(290.0, 300.0, begins=True, ends=False),)),
        ["A", "B"],
        [peaks_at(150.4, 270.0), peaks_at(152.0)],
        operating=(200, 250),
    ).axes[:2]
    steady = speeds < 290
    np.testing.assert_allclose(above.get_lines()[0].get_ydata()[steady], 1e6 * np.abs(Z[steady]))
    assert np.isnan(above.get_lines()[0].get_ydata()[~steady]).all()
    # every sensor's own peaks are marked, on both of its curves, where they are
    for ax in (above, below):
        marks = ax.get_lines()[2:4]
        for line, expected in zip(marks, ([150.4, 270.0], [152.0]), strict=True):
            np.testing.assert_allclose(line.get_xdata() / RPM, expected)
        assert len({line.get_marker() for line in marks}) == 2
        hatched = [patch for patch in ax.patches if patch.get_hatch()]
        assert [(p.get_x(), p.get_width()) for p in hatched] == [pytest.approx((290 * RPM, 10 * RPM))]
    assert {"operating range", "unstable: no steady state"} < set(labels(above))
    phase = below.get_lines()[0].get_ydata()
    assert phase[0] == pytest.approx(-0.38, abs=0.05)  # undamped below, half a turn behind above
    assert phase[steady][-1] == pytest.approx(-176.0, abs=0.5)
    assert above.get_lines()[0].get_linestyle() != above.get_lines()[1].get_linestyle()
    assert (above.get_ylabel(), below.get_ylabel()) == ("amplitude, µm peak (log)", "phase (lead), degrees")
    assert below.get_xlabel() == "speed, rpm"
    check_hygiene(above.figure)


def readings_of(speeds, *Z, windows=()):
    return SimpleNamespace(speeds=speeds, readings=lambda sensors: np.stack(Z, axis=1), windows=windows)


def peaks_at(*speeds):
    return Peaks(tuple(Peak(speed, 1e-5, None, None, 10.0, None, None) for speed in speeds), None)


def test_polar_goes_round_at_resonance():
    speeds = np.linspace(10, 300, 200)
    Z = 1e-5 * speeds**2 / (150.0**2 - speeds**2 + 2j * 0.05 * 150 * speeds)
    ax = draw_polar(speeds, Z[:, None], ["A"])
    angle, size = ax.get_lines()[0].get_data()
    np.testing.assert_allclose(size * np.exp(1j * np.asarray(angle)), 1e6 * Z, rtol=1e-9)
    assert labels(ax) == ["A"]
    written = [float(text.get_text()) for text in ax.texts]
    assert written == sorted(written)
    assert any(1300 < speed < 1560 for speed in written)
    assert all(speed % 1 == 0 for speed in written[1:-1])
    assert "µm" in ax.get_title()
    # each mark stands where the curve is at the speed written beside it
    for text in ax.texts:
        z = 1e6 * np.interp(float(text.get_text()), speeds * RPM, Z)
        assert text.xy[1] * np.exp(1j * text.xy[0]) == pytest.approx(z, rel=0.01)
    check_hygiene(ax.figure)


def test_orbits_have_a_start_and_a_direction():
    ax = draw_orbits([2e-6, 1e-6, 1e-6], [-1e-6j, 1e-6j, 1e-6], ["a", "b", "c"], title="3000 rpm")
    curves = ax.get_lines()[:3]
    x, y = curves[0].get_data()
    np.testing.assert_allclose((x[0], y[0], x[60], y[60]), (2, 0, 0, 1), atol=1e-12)
    assert ax.get_legend().get_title().get_text().startswith("3000 rpm")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x, µm peak", "y, µm peak")
    assert ax.get_aspect() == 1.0
    check_hygiene(ax.figure)


def test_a_polar_curve_turns_little_from_step_to_step():
    rotor = rotor23(2e4)
    response = fem.unbalance_response(rotor, {12: 1e-3}, np.linspace(60.0, 700.0, 33))

    def bend(speeds, Z):
        steps = np.diff(Z)
        turn = np.abs(np.degrees(np.angle(steps[1:] / steps[:-1])))
        return turn[np.minimum(abs(steps[1:]), abs(steps[:-1])) > 0.01 * np.abs(Z).max()].max()

    assert bend(response.speeds, response.at(12)) > 60
    angle, size = polar_figure(response, [12]).axes[0].get_lines()[0].get_data()
    assert bend(None, size * np.exp(1j * np.asarray(angle))) < 12
    fine = smooth_curves(response, [12])
    assert set(response.speeds) <= set(fine.speeds)
    assert fine.speeds.size < 400
    np.testing.assert_allclose(fine.at(12), fem.unbalance_response(rotor, {12: 1e-3}, fine.speeds).at(12))


def test_many_modes_are_told_apart_without_colour():
    shapes = plot(fem.critical_speeds(rotor23(), n=6))
    looks = [(line.get_linestyle(), line.get_marker()) for line in shapes.get_lines()[1:7]]
    assert len(set(looks)) == 6
    check_hygiene(shapes.figure)
    check_hygiene(plot(fem.speed_map(rotor23(1e4), n=3)).figure)


def chart(stiffness, speeds):
    return SimpleNamespace(stiffness=stiffness, speeds=speeds)


def test_import_loads_neither_matplotlib_nor_scipy():
    code = "import sys, fem; print([m for m in ('matplotlib', 'scipy', 'pandas') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_drawing_holds_everything_and_its_marks_touch_the_rotor():
    rotor = dataclasses.replace(
        turbine(), discs=[fem.Disc(1, 40.0, 1.25, 0.7, "wheel"), fem.Disc(4, 5.0)], stations={"wheel": 1}
    )
    ax = draw_rotor(rotor, planes=[2], sensors=[1, 4])
    radius, width = 250.0, np.sqrt(12 * 0.075 / 40)  # of the solid disc, mm and m
    room = 0.02 * (1.0 + width / 2)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert (left, right) == pytest.approx((-width / 2 - room, 1.0 + room))
    assert low < -radius
    assert high > radius
    lines = {
        each.get_label(): each.get_segments() for each in ax.collections if hasattr(each, "get_segments")
    }
    ((plane,),) = ([segment.tolist() for segment in lines[name]] for name in ("correction plane",))
    assert [x for x, _ in plane] == pytest.approx([0.2, 0.2])
    assert sorted(y for _, y in plane) == pytest.approx(
        [-(high - 0.2 * (high - low)), high - 0.2 * (high - low)]
    )
    assert plane[1][1] > radius
    # a sensor looks at the disc at node 1, and at the shaft at node 4, from below
    for segment, (x, y) in zip(lines["sensor"], ((0.0, -radius), (0.8, -40.0)), strict=True):
        assert segment[:, 0] == pytest.approx([x, x])
        assert sorted(segment[:, 1]) == pytest.approx([low + 0.2 * (high - low), y])
    tips = next(c for c in ax.collections if len(c.get_offsets()) == 2 and not c.get_label().startswith("d"))
    np.testing.assert_allclose(tips.get_offsets(), [[0.0, -radius], [0.8, -40.0]])


def test_the_shaft_at_a_step_is_as_thick_as_its_thicker_element():
    rotor = fem.Rotor([0.1, 0.1, 0.1], [0.05, 0.12, 0.06], discs=[fem.Disc(4, 40.0, 1.25, 0.7)])
    np.testing.assert_allclose(radii(rotor), [0.025, 0.06, 0.06, 0.03])
    np.testing.assert_allclose(surface(rotor), [0.025, 0.06, 0.06, 0.25])


def test_mode_shapes_between_nodes_are_those_of_a_beam():
    rotor = fem.Rotor([0.25] * 4, 0.05, supports=[fem.Support(1, 1e13), fem.Support(5, 1e13)])
    modes = fem.critical_speeds(rotor, n=2)
    ax = plot(modes)
    for k, line in enumerate(ax.get_lines()[1:3], start=1):
        x, y = line.get_data()
        assert (len(x), x[0], x[-1]) == (4 * 12 + 1, 0.0, 1.0)
        expected = np.sin(k * np.pi * np.asarray(x))
        assert np.abs(y * np.sign(y[6] * expected[6]) - expected).max() < 0.01 * k
    words = [text for text in labels(ax) if "rpm" in text]
    for k, omega in enumerate(modes.frequencies):
        assert f"{k + 1}: {omega * 30 / np.pi:.5g} rpm = {omega:.5g} rad/s" in words[k]
    low, high = ax.get_ylim()
    assert low < -1
    assert high > 1


@pytest.mark.parametrize("turns", [-2, 0, 1, 3])
def test_the_phase_is_a_lag_within_a_turn(turns):
    speeds = np.linspace(10.0, 300.0, 100)
    lag = np.radians(np.linspace(-20.0, -170.0, 100)) + 2 * np.pi * turns
    phase = bode_figure(readings_of(speeds, np.exp(1j * lag)), ["A"]).axes[1].get_lines()[0].get_ydata()
    np.testing.assert_allclose(phase, np.linspace(-20.0, -170.0, 100), atol=1e-9)


def test_the_arrow_of_an_orbit_follows_the_motion():
    for x, y in ((2e-6, -1e-6j), (2e-6, 1e-6j)):
        ax = draw_orbits([x], [y], ["a"])
        path = np.array(ax.get_lines()[0].get_data())
        (arrow,) = ax.texts
        begin, end = (np.array(place) for place in (arrow.get_position(), arrow.xy))
        turn = np.linspace(0.0, 2 * np.pi, 241)
        np.testing.assert_allclose(
            path, 1e6 * np.real([x * np.exp(1j * turn), y * np.exp(1j * turn)]), atol=1e-9
        )
        at = [int(np.argmin(np.hypot(*(path - place[:, None])))) for place in (begin, end)]
        assert 0 < at[1] - at[0] < 30
    (line,) = [
        each for each in draw_orbits([1e-6], [0.0], ["a"]).get_lines() if each.get_label() == "a, straight"
    ]
    assert line.get_linestyle() == "-"


def test_a_speed_map_is_in_rpm_with_its_band():
    k = np.geomspace(1e5, 1e9, 9)
    known = np.array([-1.0, 0.0, 0.5, 30.0, 60.0, 90.0, 120.0, 140.0, np.nan])
    speeds = np.stack([100 * np.sqrt(k / (k + 1e7)), known], axis=1)
    ax = draw_speed_map(chart(k, speeds), operating=(70, 80))
    low, high = ax.get_ylim()
    first, second = ax.get_lines()[:2]
    np.testing.assert_allclose(second.get_ydata()[2:8], known[2:8] * 30 / np.pi)
    assert np.isnan(np.delete(second.get_ydata(), range(2, 8))).all()
    assert low < first.get_ydata().min()
    (band,) = ax.patches
    assert band.get_y() == pytest.approx(70 * 30 / np.pi)
    assert band.get_y() + band.get_height() == pytest.approx(80 * 30 / np.pi)
    ax.figure.canvas.draw()
    (right,) = ax.child_axes
    assert right.get_ylim() == pytest.approx((low * np.pi / 30, high * np.pi / 30))


def test_curves_of_a_campbell_diagram_go_on_where_the_direction_changes():
    above = campbell_figure(whirl()).axes[0]
    mixed, forward = above.get_lines()[2:4]
    # neither direction up to 500 rad/s, forward from 600 on: the first stretch reaches to the second
    assert mixed.get_xdata()[-1] == forward.get_xdata()[0] == 600.0 * RPM
    assert forward.get_xdata()[-1] == 1000.0 * RPM
    numbers = {text.get_text(): text.xy for text in above.texts if text.get_text() in ("1", "2", "3")}
    for name, frequency in (("1", 350.0), ("2", 450.0), ("3", 900.0)):
        assert numbers[name] == pytest.approx((1000 * RPM, frequency * RPM))


def test_influence_has_a_row_for_each_sensor_with_size_and_phase():
    rotor, speeds = rotor23(2e4), np.linspace(50, 700, 40)
    W = fem.influence(rotor, [7, 12], [2, 22], speeds)
    figure = influence_figure(W, rotor)
    sizes, phases = figure.axes[1::2], figure.axes[2::2]
    assert [ax.get_ylabel().split("\n")[0] for ax in sizes] == ["sensor 2", "sensor 22"]
    for c, (size, phase) in enumerate(zip(sizes, phases, strict=True)):
        for p in (0, 1):
            steady = ~np.isnan(size.get_lines()[p].get_ydata())
            np.testing.assert_allclose(size.get_lines()[p].get_ydata()[steady], np.abs(W.W[steady, c, p]))
            lag = np.radians(phase.get_lines()[p].get_ydata()[steady])
            np.testing.assert_allclose(np.exp(1j * lag), np.exp(1j * np.angle(W.W[steady, c, p])), atol=1e-12)
            assert -2 * np.pi <= np.median(lag) <= 1e-6
        styles = {(line.get_color(), line.get_linestyle()) for line in size.get_lines()}
        assert len(styles) == 2
    [legend] = figure.legends
    assert [text.get_text() for text in legend.get_texts()][:2] == ["plane 7", "plane 12"]


def test_phase_without_damping_is_zero_or_half_a_turn_of_lag():
    rotor = uniform(6)
    figure = influence_figure(fem.influence(rotor, [2, 5], [1, 4], np.linspace(10, 2e4, 80)), rotor)
    lags = np.concatenate([line.get_ydata() for ax in figure.axes[2::2] for line in ax.get_lines()])
    assert set(np.round(lags).tolist()) <= {-360, -180, 0}
