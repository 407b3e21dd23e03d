"""Pictures of fits to time records: one panel a signal, and they show what the result holds."""

from dataclasses import replace

import numpy as np
import pytest
from documents import check_hygiene
from matplotlib.figure import Figure

from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.plots_records import (
    draw_parameters,
    draw_residuals,
    draw_signal,
    figure_fit,
)
from rotorid.identify.records import Record
from rotorid.samples import sample_data

FOLDER = sample_data() / "fit"
T = np.linspace(0, 3, 31)
PARAMETERS = ("",)


def result_of(name, record="record.csv", **options):
    model = read_ode_model(FOLDER / name / "model.toml")
    return fit(model, read_record(FOLDER / name / record, model), **options)


@pytest.fixture(scope="module")
def result():
    return result_of("quasilinearization", "record_noisy.csv")


def driven(count, **options):
    """A fit to so many records with an input."""
    model = ode_model({"x": "-a*x + u"}, initial={"x": 0.0}, estimate={"a": 0.7}, inputs=["u"])
    wave = 0.01 * np.sin(40 * T)
    records = [
        Record(
            T, {"x": k * (1 - np.exp(-T)) + wave}, {"u": np.full(31, k)}, name=f"runs/run_{k}.csv", **options
        )
        for k in range(1, count + 1)
    ]
    return fit(model, records)


def drawn(result):
    figure = figure_fit(result)
    check_hygiene(figure, unitless=PARAMETERS)
    above, below = figure.subfigs
    return above, below.axes[0]


def words(above):
    return [text.get_text() for text in above.legends[0].get_texts()]


def test_every_signal_has_a_panel_with_its_residuals_below(result):
    above, _ = drawn(result)
    names = [ax.get_ylabel().split(",")[0] for ax in above.axes]
    assert names == ["y1", "residual", "y2", "residual"]
    assert all("model unit" in ax.get_ylabel() for ax in above.axes)
    assert [ax.get_xlabel() for ax in above.axes] == ["", "", "", "time, s"]


def test_points_are_the_record_and_lines_pass_through_the_model(result):
    axes = Figure().add_subplot()
    draw_signal(result, "y2", axes)
    points, line = axes.lines
    np.testing.assert_array_equal(points.get_ydata(), result.records[0].outputs["y2"])
    t, y = line.get_data()
    assert len(t) > 600
    np.testing.assert_allclose(np.interp(result.records[0].t, t, y), result.simulations[0].y[:, 1], atol=1e-8)


def band(axes):
    """Largest height of the grey band."""
    return axes.collections[0].get_paths()[0].vertices[:, 1].max()


def test_residuals_stand_in_a_band_of_two_standard_deviations(result):
    gap = result.simulations[0].y[:, 1] - result.records[0].outputs["y2"]
    axes = Figure().add_subplot()
    draw_residuals(result, "y2", axes)
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), gap)
    assert band(axes) == pytest.approx(2 * np.sqrt(np.mean(gap**2)))
    stated = replace(result, records=(replace(result.records[0], sigma={"y1": 0.02, "y2": 0.03}),))
    axes = Figure().add_subplot()
    draw_residuals(stated, "y2", axes)
    assert band(axes) == pytest.approx(0.06)
    assert figure_fit(stated).subfigs[0].legends[0].get_title().get_text().endswith("± 2σ")


def test_parameters_have_their_intervals_in_percent_of_their_values(result):
    axes = Figure().add_subplot()
    draw_parameters(result, axes)
    ends = [bar[:, 0] for bar in axes.containers[0][2][0].get_segments()]
    values = result.values[:, None]
    np.testing.assert_allclose(ends, 100 * (result.estimate.ci95 - values) / np.abs(values))


def test_several_records_differ_by_mark_line_and_colour_in_every_panel():
    above, _ = drawn(driven(3))
    assert words(above) == ["run_1.csv", "run_2.csv", "run_3.csv"]
    assert "points: measured, lines: model" in above.legends[0].get_title().get_text()
    signal, residual, entered = above.axes
    keys = above.legends[0].legend_handles
    for get in ("get_color", "get_marker"):
        seen = [getattr(key, get)() for key in keys]
        assert len(set(seen)) == 3
        assert seen == [getattr(line, get)() for line in signal.lines[:3]]
        assert seen == [getattr(line, get)() for line in residual.lines[:3]]
    assert len({line.get_linestyle() for line in signal.lines[3:]}) == 3
    assert [line.get_color() for line in signal.lines[3:]] == [key.get_color() for key in keys]
    assert entered.get_ylabel().startswith("input u")
    assert [line.get_ydata()[0] for line in entered.lines] == [1, 2, 3]
