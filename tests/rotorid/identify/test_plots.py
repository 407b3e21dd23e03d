"""Pictures hold what the results hold, in the units of their tables."""

from dataclasses import replace

import numpy as np
import pytest
from documents import check_hygiene
from matplotlib.figure import Figure

from rotorid import read_harmonic_model, read_measurements
from rotorid.commands.modes import ModesOptions, modes
from rotorid.identify import identify
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.plots import figure_identification
from rotorid.identify.plots_records import draw_parameters, draw_residuals, draw_signal
from rotorid.identify.records import Record


def named(figure, start):
    """The axes whose vertical axis is called so."""
    return [ax for ax in figure.axes if ax.get_ylabel().startswith(start)]


def points(ax):
    """Measured points of axes, with the ends of their error bars."""
    bars = [container for container in ax.containers if container.has_yerr]
    return [(bar[0].get_xydata(), np.array([e[:, 1] for e in bar[2][0].get_segments()])) for bar in bars]


def test_amplitudes_and_phases_in_the_units_of_the_table(tmp_path):
    """A test in Hz whose outputs are read in mm and µm pp, with stated errors."""
    (tmp_path / "model.toml").write_text(
        'equations = ["(10*p**2 + alpha*p + c)*X = F", "(20*p**2 + c2)*V = F"]\n'
        'estimate = ["c", "alpha", "c2"]\n[errors]\namplitude_percent = 5\nphase_deg = 3\n'
    )
    f = np.array([0.8, 1.2, 1.7, 2.2])
    s = 2j * np.pi * f
    X, V = 10.2 / (10 * s**2 + 60 * s + 1000), np.abs(10 / (20 * s**2 + 12500))
    rows = np.stack([f, 10 + 0 * f, 1e3 * abs(X), np.degrees(np.angle(X)), 2e6 * V, 0 * f], 1)
    head = "frequency_Hz,F_re,X_amplitude_mm,X_phase_deg,V_amplitude_um_pp,V_phase_deg"
    np.savetxt(tmp_path / "data.csv", rows, "%.17g", ",", header=head, comments="")
    file = read_harmonic_model(tmp_path / "model.toml")
    result = identify(file.model, read_measurements(tmp_path / "data.csv", file))
    part = result.experiments.take([0, 2])
    assert (part.axis.word, part.units["V"].word) == ("frequency, Hz", "µm pp")
    figure = figure_identification(result)
    mm, um = named(figure, "amplitude")
    assert [ax.get_ylabel() for ax in (mm, um)] == ["amplitude, mm peak", "amplitude, µm pp"]
    for ax, name, scale, size in ((mm, "X", 1e3, 1e3 * abs(X)), (um, "V", 2e6, 2e6 * V)):
        ((measured, ends),) = points(ax)
        np.testing.assert_allclose(measured, np.stack((f, size), 1))
        np.testing.assert_allclose(ends, np.stack((0.9 * size, 1.1 * size), 1))
        x, y = ax.get_lines()[-1].get_data()
        assert (x[0], x[-1]) == (pytest.approx(0.8), pytest.approx(2.2))
        predicted = scale * np.abs(result.predicted[name])
        np.testing.assert_allclose(np.interp(f, x, y), predicted, rtol=1e-9)
    (phases, ends), _ = points(named(figure, "phase")[0])
    np.testing.assert_allclose(phases[:, 1], np.degrees(np.angle(X)))
    np.testing.assert_allclose(ends - phases[:, 1:], np.tile([-6.0, 6.0], (4, 1)))
    check_hygiene(figure, unitless=("", "output"))


# Modes


def curves(ax):
    return [line.get_xydata() for line in ax.lines if len(line.get_xydata()) > 500]


@pytest.mark.parametrize(
    ("excitation", "share", "tolerance"), [("force", 2e-3, 1e-3), ("unbalance", 0.05, 1e-6)]
)
def test_circles_and_peaks_are_the_closed_form(tmp_path, excitation, share, tolerance):
    """A mass on a spring, and half of it at another point; an unbalance grows as the square of the speed."""

    def moved(w):
        load = w**2 if excitation == "unbalance" else 144.0
        return 1e6 * np.outer(load / (144 - w**2 + 24j * share * w), [1.0, 0.5])

    omega = 12.0 * (1 + share * np.linspace(-4, 5, 15))
    Z = moved(omega)
    head = "frequency_Hz,X1_re_um,X1_im_um,X2_re_um,X2_im_um"
    rows = np.column_stack((omega / 2 / np.pi, Z[:, 0].real, Z[:, 0].imag, Z[:, 1].real, Z[:, 1].imag))
    np.savetxt(tmp_path / "a.csv", rows, "%.17g", ",", header=head, comments="")
    options = ModesOptions(excitation=excitation, bands=[(8.0, 20.0)])
    figure = modes(tmp_path / "a.csv", options).figure()
    check_hygiene(figure)
    circle, peak = figure.axes
    assert circle.get_aspect() == 1.0
    assert (circle.get_xlabel(), circle.get_ylabel()) == ("real part, µm peak", "imaginary part, µm peak")
    assert (peak.get_xlabel(), peak.get_ylabel()) == ("frequency, Hz", "amplitude, µm peak")
    marks = [[line.get_xydata() for line in ax.lines if line.get_marker() != "None"] for ax in (circle, peak)]
    for p, (read, sizes, loop, top) in enumerate(zip(*marks, curves(circle), curves(peak), strict=True)):
        np.testing.assert_allclose(read @ (1, 1j), Z[:, p], rtol=1e-9)
        np.testing.assert_allclose(sizes, np.stack((omega / 2 / np.pi, abs(Z[:, p])), 1), rtol=1e-9)
        between = moved(2 * np.pi * top[:, 0])[:, p]
        np.testing.assert_allclose(loop @ (1, 1j), between, atol=tolerance * np.abs(between).max())
        np.testing.assert_allclose(top[:, 1], np.abs(between), atol=tolerance * np.abs(between).max())


# Records


T = np.linspace(0, 3, 31)


@pytest.fixture(scope="module")
def result():
    """Three records with an input."""
    model = ode_model({"x": "-a*x + u"}, initial={"x": 0.0}, estimate={"a": 0.7}, inputs=["u"])
    noise = 0.01 * np.random.default_rng(1).standard_normal((4, 31))
    return fit(model, [
        Record(T, {"x": k * (1 - np.exp(-T)) + noise[k]}, {"u": np.full(31, k)}, name=f"runs/run_{k}.csv")
        for k in (1, 2, 3)
    ])  # fmt: skip


def test_points_are_the_record_and_lines_pass_through_the_model(result):
    axes = Figure().add_subplot()
    draw_signal(result, "x", axes)
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.records[1].outputs["x"])
    t, y = axes.lines[4].get_data()
    assert len(t) > 600
    np.testing.assert_allclose(np.interp(T, t, y), result.simulations[1].y[:, 0], atol=1e-5)


def test_residuals_stand_in_a_band_of_two_standard_deviations(result):
    gaps = [s.y[:, 0] - r.outputs["x"] for s, r in zip(result.simulations, result.records, strict=True)]
    stated = replace(result, records=tuple(replace(r, sigma={"x": 0.03}) for r in result.records))
    for one, height in ((result, 2 * np.sqrt(np.mean(np.square(gaps)))), (stated, 0.06)):
        axes = Figure().add_subplot()
        draw_residuals(one, "x", axes)
        np.testing.assert_array_equal(axes.lines[1].get_ydata(), gaps[1])
        assert axes.collections[0].get_paths()[0].vertices[:, 1].max() == pytest.approx(height)


def test_parameters_have_their_intervals_in_percent_of_their_values(result):
    axes = Figure().add_subplot()
    draw_parameters(result, axes)
    ends = [bar[:, 0] for bar in axes.containers[0][2][0].get_segments()]
    values = result.values[:, None]
    np.testing.assert_allclose(ends, 100 * (result.estimate.ci95 - values) / np.abs(values))
