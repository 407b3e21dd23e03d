"""Pictures of identifications hold what the result holds."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from rotorid import read_harmonic_model, read_measurements
from rotorid.harmonic import identify
from rotorid.harmonic.plots import figure_identification, plot_identification
from rotorid.samples import sample_data

FOLDER = sample_data() / "identify"


def result_of(task, **options):
    file = read_harmonic_model(FOLDER / task / "model.toml")
    return identify(file.model, read_measurements(FOLDER / task / "data.csv", file), **options)


def test_measured_points_and_fitted_line_agree_with_the_result():
    result = result_of("task_5_1")
    axes = plot_identification(result)
    points, line = axes.get_lines()
    np.testing.assert_allclose(points.get_ydata(), np.abs(result.experiments.signals["X"]))
    x, y = line.get_data()
    np.testing.assert_allclose(np.interp([10.0, 20.0, 30.0], x, y), np.abs(result.predicted["X"]), rtol=1e-12)


def test_free_vibrations_draw_measured_and_fitted_shapes():
    for options in ({}, {"method": "output-error"}):
        result = result_of("task_7_1", **options)
        axes = plot_identification(result)
        points, line, *_ = axes.get_lines()
        np.testing.assert_allclose(points.get_ydata(), [1, 1.3461538, 1.9230769], atol=1e-6)
        np.testing.assert_allclose(line.get_ydata(), points.get_ydata(), atol=0.01)
        assert "(model 12.2" in axes.get_legend().get_texts()[0].get_text()


def test_a_model_that_predicts_nothing_draws_points_only():
    axes = plot_identification(result_of("section_1_8"))
    assert len(axes.get_lines()) == 2


TASKS = ["task_5_1", "task_1_2", "task_4_1", "task_7_2", "section_1_7", "task_8_2", "task_3_2"]


@pytest.mark.parametrize("task", TASKS)
def test_the_whole_figure_is_drawn(task, tmp_path):
    result = result_of(task)
    figure = figure_identification(result)
    assert isinstance(figure, Figure)
    figure.savefig(tmp_path / "f.png")
    titles = " ".join(axes.get_title() for axes in figure.axes)
    assert "residuals" in titles
    has_map = result.correlation is not None and int(np.isfinite(result.values).sum()) > 1
    assert ("correlations" in titles) is has_map
    if has_map:
        image = next(image for axes in figure.axes for image in axes.get_images())
        known = np.isfinite(result.values)
        np.testing.assert_allclose(image.get_array(), result.correlation[np.ix_(known, known)])
