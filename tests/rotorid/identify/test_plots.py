"""Pictures of identifications hold what the result holds, in the units of its table."""

import numpy as np
import pytest
from documents import check_hygiene

from rotorid import read_harmonic_model, read_measurements
from rotorid.identify import identify
from rotorid.identify.plots import figure_identification
from rotorid.samples import sample_data

FOLDER = sample_data() / "identify"
UNITLESS = ("", "output")
"""Parameters and outputs, which have names of their own."""


def result_of(task, **options):
    file = read_harmonic_model(FOLDER / task / "model.toml")
    return identify(file.model, read_measurements(FOLDER / task / "data.csv", file), **options)


@pytest.fixture(scope="module")
def two_units(tmp_path_factory):
    """A test in Hz whose outputs are read in mm and µm pp, with stated errors."""
    folder = tmp_path_factory.mktemp("units")
    (folder / "model.toml").write_text(
        'equations = ["(10*p**2 + alpha*p + c)*X = F", "(20*p**2 + c2)*V = F"]\n'
        'estimate = ["c", "alpha", "c2"]\n[errors]\namplitude_percent = 5\nphase_deg = 3\n',
        encoding="utf-8",
    )
    rows = ["frequency_Hz,F_re,X_amplitude_mm,X_phase_deg,V_amplitude_um_pp,V_phase_deg"]
    for f in (0.8, 1.2, 1.7, 2.2):
        s = 2j * np.pi * f
        X, V = 10.2 / (10 * s**2 + 60 * s + 1000), 10 / (20 * s**2 + 12500)
        rows.append(f"{f},10,{1e3 * abs(X)},{np.degrees(np.angle(X))},{2e6 * abs(V)},0")
    (folder / "data.csv").write_text("\n".join(rows), encoding="utf-8")
    file = read_harmonic_model(folder / "model.toml")
    return identify(file.model, read_measurements(folder / "data.csv", file))


def first(result):
    """The axes at the top of its figure."""
    return figure_identification(result).axes[0]


def named(figure, start):
    """The axes whose vertical axis is called so."""
    return [ax for ax in figure.axes if ax.get_ylabel().startswith(start)]


def points(ax):
    """Measured points of axes, with the ends of their error bars."""
    bars = [container for container in ax.containers if container.has_yerr]
    return [
        (bar[0].get_xydata(), np.array([ends[:, 1] for ends in bar[2][0].get_segments()])) for bar in bars
    ]


def test_measured_points_and_fitted_line_agree_with_the_result():
    result = result_of("task_5_1")
    axes = first(result)
    points, crosses, line = axes.get_lines()
    np.testing.assert_allclose(crosses.get_ydata(), np.abs(result.predicted["X"]))
    np.testing.assert_allclose(points.get_ydata(), np.abs(result.experiments.signals["X"]))
    x, y = line.get_data()
    np.testing.assert_allclose(np.interp([10.0, 20.0, 30.0], x, y), np.abs(result.predicted["X"]), rtol=1e-12)


def test_amplitudes_stand_over_frequency_in_the_units_of_the_table(two_units):
    figure = figure_identification(two_units)
    mm, um = named(figure, "amplitude")
    assert [ax.get_ylabel() for ax in (mm, um)] == ["amplitude, mm peak", "amplitude, µm pp"]
    for ax, name, scale in ((mm, "X", 1e3), (um, "V", 2e6)):
        size = scale * np.abs(two_units.experiments.signals[name])
        ((measured, ends),) = points(ax)
        np.testing.assert_allclose(measured, np.stack(([0.8, 1.2, 1.7, 2.2], size), 1))
        np.testing.assert_allclose(ends, np.stack((0.9 * size, 1.1 * size), 1))
        x, y = ax.get_lines()[-1].get_data()
        assert (x[0], x[-1]) == (pytest.approx(0.8), pytest.approx(2.2))
        np.testing.assert_allclose(
            np.interp(measured[:, 0], x, y), scale * np.abs(two_units.predicted[name]), rtol=1e-9
        )
    assert named(figure, "phase")[0].get_xlabel() == "frequency, Hz"
    (phases, ends), _ = points(named(figure, "phase")[0])
    np.testing.assert_allclose(phases[:, 1], np.degrees(np.angle(two_units.experiments.signals["X"])))
    np.testing.assert_allclose(ends - phases[:, 1:], np.tile([-6.0, 6.0], (4, 1)))


def test_free_vibrations_are_points_and_crosses_at_their_frequencies():
    result = result_of("task_7_1")
    lines = first(result).get_lines()
    for name, points, crosses in zip(("X1", "X2", "X3"), lines[::2], lines[1::2], strict=True):
        np.testing.assert_allclose(points.get_xdata(), result.experiments.frequencies)
        np.testing.assert_allclose(points.get_ydata(), np.abs(result.experiments.signals[name]))
        np.testing.assert_allclose(crosses.get_ydata(), np.abs(result.predicted[name]))


def test_units_are_kept_by_a_choice_of_experiments(tmp_path, two_units):
    part = two_units.experiments.take([0, 2])
    assert (part.axis.word, part.units["V"].word) == ("frequency, Hz", "µm pp")
    lines = (FOLDER / "task_5_1" / "data.csv").read_text(encoding="utf-8").splitlines()
    head = (
        lines[0].replace("X_re", "X_re_mm").replace("X_im", "X_im_mm").replace("frequency_rad_s", "speed_rpm")
    )
    (tmp_path / "data.csv").write_text("\n".join([head, *lines[1:]]), encoding="utf-8")
    found = read_measurements(tmp_path / "data.csv", read_harmonic_model(FOLDER / "task_5_1" / "model.toml"))
    assert (len(found), found.axis.word, found.units["X"].word) == (3, "speed, rpm", "mm peak")
    assert found.axis.scale * found.frequencies == pytest.approx([10, 20, 30])


def test_the_picture_in_two_units_is_readable(two_units):
    check_hygiene(figure_identification(two_units), unitless=UNITLESS)
