import dataclasses
import subprocess
import sys
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from fem_rotors import rotor23, uniform

import fem
from fem.plots import campbell_figure, draw_bode, draw_orbits, draw_polar, draw_speed_map, new_axes

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
    ax = fem.draw_rotor(rotor)
    boxes = [patch.get_bbox().bounds for patch in ax.patches]
    np.testing.assert_allclose(boxes[1], (0.1, -60.0, 0.3, 120.0))
    np.testing.assert_allclose(boxes[3], (0.1, -40.0, 0.3, 80.0))
    assert labels(ax) == ["masses, 10 to 30 kg", "support", "damped support"]
    masses, stiff, damped = ax.collections
    assert masses.get_sizes()[1] == pytest.approx(3 * masses.get_sizes()[0])
    np.testing.assert_allclose(stiff.get_offsets(), [[0.0, -25.0]])
    np.testing.assert_allclose(damped.get_offsets(), [[0.6, -30.0]])
    assert ax.get_xlabel() == "position, m"
    assert ax.get_ylabel() == "radius, mm"
    ax.figure.canvas.draw()


def test_drawing_as_scenery_leaves_labels_alone():
    ax = new_axes()
    assert fem.draw_rotor(rotor23(), ax, height=0.5) is ax
    assert ax.get_legend() is None
    assert ax.get_ylabel() == ""
    assert max(patch.get_height() for patch in ax.patches) == pytest.approx(1.0)


def test_mode_shapes_are_drawn_over_the_rotor():
    modes = fem.critical_speeds(rotor23(1e4), n=3)
    ax = new_axes()
    assert modes.plot(ax) is ax
    lines = ax.get_lines()[:3]
    for line, shape in zip(lines, modes.shapes.T, strict=True):
        x, y = line.get_data()
        assert np.abs(y).max() == pytest.approx(1.0)
        at_nodes = np.interp(modes.positions, x, y)
        np.testing.assert_allclose(at_nodes / at_nodes[0], shape / shape[0], rtol=1e-9)
    assert len(ax.patches) == 23
    assert sum("rad/s" in label for label in labels(ax)) == 3
    assert {"masses, 21 to 30 kg", "damped supports"} <= set(labels(ax))
    ax.figure.canvas.draw()


def test_rigid_modes_are_named():
    assert "1: rigid body" in labels(fem.critical_speeds(uniform(6), n=3).plot())


def test_amplitudes_over_speed():
    rotor = rotor23(2e4)
    speeds = np.linspace(1, 700, 50)
    response = fem.unbalance_response(rotor, {12: 1e-3}, speeds)
    ax = response.plot()
    assert labels(ax)[:2] == ["node 2", "node 22"]
    np.testing.assert_allclose(ax.get_lines()[0].get_ydata(), 1e6 * np.abs(response.at(2)))
    assert labels(response.plot(nodes=[5])) == ["node 5"]
    W = fem.influence(rotor, [7], [2, 22], speeds)
    ax = W.plot()
    assert labels(ax) == ["sensor 2, plane 7", "sensor 22, plane 7"]
    np.testing.assert_allclose(ax.get_lines()[1].get_ydata(), np.abs(W.W[:, 1, 0]))
    ax.figure.canvas.draw()
    assert fem.influence(rotor, [7], [2], 100.0).plot().get_lines()[0].get_marker() == "o"


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


def test_a_disc_without_mass_is_no_mass():
    light = dataclasses.replace(turbine(), discs=[fem.Disc(3, 40.0, 1.25, 0.7, "wheel"), fem.Disc(2, 0.0)])
    assert not [text for text in labels(fem.draw_rotor(light)) if text.startswith("mass")]


def test_drawing_tells_bearings_seals_pedestals_planes_and_sensors_apart():
    ax = fem.draw_rotor(turbine(), planes=["wheel", 2], sensors=[(1, 45.0)])
    assert sorted(labels(ax)) == [
        "correction planes", "damped support", "disc, 40 kg", "mass, 5 kg", "seal", "sensor",
        "support on a pedestal",
    ]  # fmt: skip
    texts = {text.get_text(): text.xy for text in ax.texts}
    assert set(texts) == {"wheel", "2", "1 at 45°"}
    assert texts["wheel"][0] == pytest.approx(0.5)
    wheel = ax.patches[0].get_bbox().bounds
    # The solid disc of the same mass and moments: R² = 2 I_p / m, w² = 12 (I_d − I_p / 2) / m.
    np.testing.assert_allclose(wheel[2:], (np.sqrt(12 * 0.075 / 40), 2e3 * 0.25))
    seal = next(c for c in ax.collections if c.get_label() == "seal")
    np.testing.assert_allclose(seal.get_offsets(), [[0.5, -250.0]])
    assert ax.get_ylabel() == "radius, mm"
    ax.figure.canvas.draw()
    with pytest.raises(ValueError, match="no station is called 'whel'"):
        fem.draw_rotor(turbine(), planes=["whel"])


def whirl():
    speeds = np.linspace(0, 1000, 11)
    columns = [400 - 0.05 * speeds, 400 + 0.05 * speeds, np.where(speeds < 300, np.nan, 900.0)]
    return SimpleNamespace(
        speeds=speeds,
        frequencies=np.stack(columns, axis=1),
        log_decrements=np.stack([0.3 + 0 * speeds, 0.4 - 0.5e-3 * speeds, 2 + 0 * speeds], axis=1),
        direction=np.stack([-1 + 0 * speeds, 1 + 0 * speeds, np.where(speeds < 600, 0.0, 1.0)], axis=1),
    )


def test_a_campbell_diagram_tells_directions_apart_without_colour():
    figure = campbell_figure(whirl(), [(380.95, 0.3), (421.05, 0.19)], operating=(600, 700))
    above, below = figure.axes[:2]
    lines = above.get_lines()
    looks = [(line.get_linestyle(), line.get_marker(), line.get_fillstyle()) for line in lines[:4]]
    assert looks == [
        ("--", "v", "none"), ("-", "^", "full"), (":", "D", "none"), ("-", "^", "full"),
    ]  # fmt: skip
    np.testing.assert_allclose(lines[0].get_ydata(), whirl().frequencies[:, 0])
    np.testing.assert_allclose(np.diff(lines[4].get_data(), axis=0), 0.0)
    assert labels(above) == ["forward whirl", "backward whirl", "mixed whirl", "damped critical speed"]
    assert {"1×", "3638 rpm, δ = 0.30", "4021 rpm, δ = 0.19", "1", "2", "3"} <= {
        t.get_text() for t in above.texts
    }
    marks = next(line for line in lines if line.get_linestyle() == "None")
    np.testing.assert_allclose(marks.get_xdata(), [380.95, 421.05])
    assert above.get_ylabel() == "whirl frequency, rad/s"
    assert below.get_xlabel() == "speed, rad/s"
    assert below.get_ylabel() == "logarithmic decrement"
    np.testing.assert_allclose(below.get_lines()[1].get_ydata(), whirl().log_decrements[:, 1])
    assert below.get_ylim()[0] < -0.1
    assert "unstable" in {text.get_text() for text in below.texts}
    figure.canvas.draw()


def test_a_campbell_diagram_holds_all_frequencies_speeds_and_decrements():
    above, below = campbell_figure(whirl()).axes[:2]
    assert above.get_ylim()[0] == 0
    assert 900 < above.get_ylim()[1] < 1.5 * 900
    for axes in (above, below):
        assert axes.get_xlim()[0] == 0
        assert 1000 < axes.get_xlim()[1] < 1.2 * 1000
    # decrements from 2 down to −0.1, those above 3 cut off
    assert -0.5 < below.get_ylim()[0] < -0.1
    assert 2 < below.get_ylim()[1] < 2.5
    heavy = whirl()
    heavy.log_decrements[:, 2] = 20.0
    assert campbell_figure(heavy).axes[1].get_ylim()[1] == pytest.approx(3.0)
    # the 1× line ends where the speeds or the frequencies end, whichever is first
    assert above.get_lines()[4].get_xdata()[-1] == pytest.approx(1.06 * 900)
    slow = whirl()
    slow.speeds = slow.speeds / 2
    assert campbell_figure(slow).axes[0].get_lines()[4].get_xdata()[-1] == pytest.approx(500.0)


def test_a_campbell_diagram_of_a_rotor(tmp_path):
    rotor = fem.Rotor([0.25] * 4, 0.05, supports=[fem.Support(1, 1e6, 50.0), fem.Support(5, 1e6, 50.0)])
    result = fem.campbell(rotor, np.linspace(0, 400, 9), 2)
    ax = result.plot()
    assert ax.get_title() == ""
    assert "1×" in {text.get_text() for text in ax.texts}


def test_bode_shows_amplitude_phase_peaks_and_the_operating_range():
    speeds = np.linspace(10, 300, 200)
    Z = 1e-5 * speeds**2 / (150.0**2 - speeds**2 + 2j * 0.05 * 150 * speeds)
    above, below = draw_bode(
        speeds, np.stack([Z, -Z], axis=1), ["A", "B"], peaks=[(150.4, "1436 rpm")], operating=(200, 250)
    )
    np.testing.assert_allclose(above.get_lines()[0].get_ydata(), 1e6 * np.abs(Z))
    phase = below.get_lines()[0].get_ydata()
    assert phase[0] == pytest.approx(-0.38, abs=0.05)  # undamped below, half a turn behind above
    assert phase[-1] == pytest.approx(-176.2, abs=0.5)
    assert above.get_lines()[0].get_linestyle() != above.get_lines()[1].get_linestyle()
    assert {"operating range", "1436 rpm"} == {text.get_text() for text in above.texts}
    assert (above.get_ylabel(), below.get_ylabel()) == ("amplitude, µm peak", "phase (lead), degrees")
    assert below.get_xlabel() == "speed, rad/s"
    above.figure.canvas.draw()


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
    assert "µm" in ax.get_xlabel()
    ax.figure.canvas.draw()


def test_orbits_have_a_start_and_a_direction():
    ax = draw_orbits([2e-6, 1e-6, 1e-6], [-1e-6j, 1e-6j, 1e-6], ["a", "b", "c"], title="3000 rpm")
    assert labels(ax) == ["a, forward", "b, backward", "c, straight"]
    curves = ax.get_lines()[::2][:3]
    assert [curve.get_linestyle() for curve in curves] == ["-", "--", "-"]
    x, y = curves[0].get_data()
    np.testing.assert_allclose((x[0], y[0], x[60], y[60]), (2, 0, 0, 1), atol=1e-12)
    assert ax.get_legend().get_title().get_text().startswith("3000 rpm")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x, µm", "y, µm")
    assert ax.get_aspect() == 1.0
    ax.figure.canvas.draw()


def test_a_speed_map_is_logarithmic_and_holds_the_supports():
    k = np.geomspace(1e5, 1e9, 9)
    speeds = np.stack([100 * np.sqrt(k / (k + 1e7)), np.full(9, np.nan)], axis=1)
    ax = draw_speed_map(
        k, speeds, supports=[("DE", [1e7, 2e7], [50, 150]), ("fixed", 1e8, [])], operating=(70, 80)
    )
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    np.testing.assert_allclose(ax.get_lines()[0].get_ydata(), speeds[:, 0] * 30 / np.pi)
    assert labels(ax) == ["critical speed 1", "critical speed 2", "DE", "fixed", "operating range"]
    assert ax.get_lines()[3].get_xdata().tolist() == [1e8, 1e8]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("stiffness of each support, N/m", "critical speed, rpm")
    ax.figure.canvas.draw()


def test_import_loads_neither_matplotlib_nor_scipy():
    code = "import sys, fem; print([m for m in ('matplotlib', 'scipy', 'pandas') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
