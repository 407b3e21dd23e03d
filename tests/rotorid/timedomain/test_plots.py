"""Pictures of fits to time records: they show what the result holds."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from rotorid.samples import sample_data
from rotorid.tables import read_ode_model, read_record
from rotorid.timedomain.fit import fit
from rotorid.timedomain.models.ode_model import ode_model
from rotorid.timedomain.models.record import Record
from rotorid.timedomain.plots import (
    draw_iterations,
    draw_records,
    draw_residuals,
    draw_sensitivities,
    figure_fit,
)

FOLDER = sample_data() / "fit" / "quasilinearization"


@pytest.fixture(scope="module")
def result():
    model = read_ode_model(FOLDER / "model.toml")
    return fit(model, read_record(FOLDER / "record_noisy.csv", model))


def test_everything_is_drawn(result):
    figure = figure_fit(result)
    assert len(figure.axes) == 4
    assert all(axes.lines and axes.get_title() for axes in figure.axes)
    figure.canvas.draw()


def test_points_are_the_record_and_lines_pass_through_the_model(result):
    axes = Figure().add_subplot()
    draw_records(result, axes)
    points, line = axes.lines[0], axes.lines[1]
    np.testing.assert_array_equal(points.get_ydata(), result.records[0].outputs["y1"])
    t, y = line.get_data()
    assert len(t) > 600
    np.testing.assert_allclose(np.interp(result.records[0].t, t, y), result.simulations[0].y[:, 0], atol=1e-8)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["y1", "y2"]


def test_residuals_sensitivities_and_iterations(result):
    axes = Figure().add_subplot()
    draw_residuals(result, axes)
    record, run = result.records[0], result.simulations[0]
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), run.y[:, 1] - record.outputs["y2"])
    axes = Figure().add_subplot()
    draw_sensitivities(result, axes)
    effect = 0.01 * abs(result.values[0]) * np.hypot(*run.y_theta[:, :, 0].T)
    t, drawn = axes.lines[0].get_data()
    np.testing.assert_allclose(drawn[np.isin(t, run.t)], effect, rtol=1e-6, atol=1e-12)
    axes = Figure().add_subplot()
    draw_iterations(result, axes)
    assert len(axes.lines[0].get_ydata()) == result.iterations + 1
    assert axes.lines[0].get_ydata()[-1] == 1.0


def test_inputs_missing_samples_and_several_records():
    model = ode_model({"x": "-a*x + u"}, initial={"x": 0.0}, estimate={"a": 0.7}, inputs=["u"])
    t = np.linspace(0, 5, 21)
    x = 1 - np.exp(-t)
    x[4] = np.nan
    one = Record(t, {"x": x}, {"u": np.ones(21)})
    two = Record(t, {"x": 2 * x}, {"u": np.full(21, 2.0)})
    figure = figure_fit(fit(model, [one, two]))
    figure.canvas.draw()
    assert len(figure.axes[0].lines) == 4


def test_a_result_without_trajectories_says_so(result):
    figure = figure_fit(replace(result, simulations=()))
    figure.canvas.draw()
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert sum("diverge" in text for text in texts) == 2
