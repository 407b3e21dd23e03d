"""Pictures of fits that are hard to draw: unlike sizes, several records, single samples, no rank."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from rotorid.timedomain.fit import fit
from rotorid.timedomain.models.ode_model import ode_model
from rotorid.timedomain.models.record import Record
from rotorid.timedomain.plots import FAR, draw_iterations, figure_fit

T = np.linspace(0, 3, 31)


def words(axes):
    """All words of all legends of axes."""
    legends = [axes.get_legend(), *(a for a in axes.artists if hasattr(a, "get_texts"))]
    return [text.get_text() for legend in legends if legend for text in legend.get_texts()]


def drawn(result):
    figure = figure_fit(result)
    figure.canvas.draw()
    return figure.axes


def sensitivity(axes):
    return next(a for a in axes if a.get_title().startswith("sensitivity"))


def test_outputs_of_very_different_size_are_drawn_over_their_largest_value():
    rates = {"x": "-a*x", "z": "-b*z"}
    model = ode_model(rates, initial={"x": 300.0, "z": 1.2e-4}, estimate={"a": 0.8, "b": 0.5})
    noise = 0.01 * np.random.default_rng(1).normal(size=(2, 31))
    record = Record(T, {"x": 300 * (np.exp(-T) + noise[0]), "z": 1.2e-4 * (np.exp(-T / 2) + noise[1])})
    axes = drawn(fit(model, record, weigh=True))
    assert axes[0].get_ylabel() == "output / largest value"
    assert words(axes[0])[1].startswith("z (1.2e-04")
    assert sensitivity(axes).get_ylabel() == "change of outputs / largest value\n(root sum of squares)"
    points = [line.get_ydata() for line in axes[0].lines[::2]]
    assert [max(abs(y)) for y in points] == pytest.approx([1, 1])
    assert "own rms" in axes[1].get_ylabel()
    assert [np.sqrt(np.mean(line.get_ydata() ** 2)) for line in axes[1].lines[:2]] == pytest.approx([1, 1])
    assert [word.split(" (rms ")[0] for word in words(axes[1])] == ["x", "z"]


def test_the_legend_names_the_records_by_mark_and_line():
    model = ode_model({"x": "-a*x + u"}, initial={"x": 0.0}, estimate={"a": 0.7}, inputs=["u"])
    records = [
        Record(T, {"x": k * (1 - np.exp(-T))}, {"u": np.full(31, k)}, name=f"runs/run_{k}.csv")
        for k in (1.0, 2.0)
    ]
    axes = drawn(fit(model, records))
    assert sorted(words(axes[0])) == ["run_1.0.csv", "run_2.0.csv", "x"]
    assert sensitivity(axes).get_ylabel() == "change of outputs\n(root sum of squares)"
    keys = axes[0].get_legend().legend_handles[-2:]
    lines = axes[0].lines
    assert [key.get_marker() for key in keys] == [lines[0].get_marker(), lines[2].get_marker()]
    assert [key.get_linestyle() for key in keys] == [lines[1].get_linestyle(), lines[3].get_linestyle()]


def test_small_sensitivities_are_seen_on_a_logarithmic_axis():
    outputs = {"x": "x + 0.001*b*cos(5*t)"}
    model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, outputs=outputs, estimate={"a": 0.8, "b": 0.9})
    axes = drawn(fit(model, Record(T, {"x": np.exp(-T) + 0.001 * np.cos(5 * T)})))[2]
    assert axes.get_yscale() == "log"
    low, high = axes.get_ylim()
    assert low == pytest.approx(1e-4 * high / 2)
    assert all(low < max(line.get_ydata()) < high for line in axes.lines)
    assert all((line.get_ydata() > 0).all() for line in axes.lines)


def test_a_single_sample_has_plain_axes_and_words():
    model = ode_model({"x": "-a*x"}, initial={"x": "2 + sign(a)"}, estimate={"a": 0.5})
    result = fit(model, Record(np.array([2.0]), {"x": np.array([2.0])}))
    axes = drawn(result)
    assert all(a.yaxis.get_offset_text().get_text() == "" for a in axes)
    assert "no output depends" in axes[2].texts[0].get_text()
    assert "determined" in axes[3].texts[0].get_text()
    near = replace(result.simulations[0], y=np.array([[2.0 + 1e-10]]))
    axes = drawn(replace(result, simulations=(near,)))
    low, high = axes[0].get_ylim()
    assert low < 1.9
    assert high > 2.1
    assert axes[0].yaxis.get_offset_text().get_text() == ""


def test_what_is_not_determined_has_no_iterations():
    model = ode_model({"x": "-(a + b)*x"}, initial={"x": "x0"}, estimate={"a": 0.3, "b": 0.4, "x0": 0.8})
    axes = drawn(fit(model, Record(T, {"x": np.exp(-T) + 0.01 * np.cos(9 * T)})))[3]
    assert sorted(words(axes)) == ["a: not determined", "b: not determined", "x0"]
    assert len(axes.lines) == 2


@pytest.mark.parametrize(("first", "top"), [(4e4, 4e4), (1e300, FAR)])
def test_the_end_of_a_long_way_is_readable(first, top):
    model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.8})
    result = fit(model, Record(T, {"x": np.exp(-T)}))
    axes = Figure().add_subplot()
    draw_iterations(replace(result, history=np.array([[first], [-50.0], [1.3], [1.0]])), axes)
    assert axes.get_yscale() == "symlog"
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [top, -50, 1.3, 1])
    end = axes.transAxes.inverted().transform(axes.transData.transform([(2, 1.3), (3, 1.0)]))
    assert end[0, 1] - end[1, 1] > 0.01


def test_a_last_value_of_zero_is_said():
    model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.8})
    result = fit(model, Record(T, {"x": np.exp(-T)}))
    axes = Figure().add_subplot()
    draw_iterations(replace(result, history=np.array([[4.0], [2.0], [0.0]])), axes)
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [1, 0.5, 0])
    assert words(axes) == ["a / 4 (ends at 0)"]


def test_many_outputs_and_records_are_counted():
    names = [f"x{i}" for i in range(10)]
    model = ode_model(
        {"s": "-a*s"}, initial={"s": 1.0}, outputs=dict.fromkeys(names, "s"), estimate={"a": 0.8}
    )
    records = [Record(T, {name: np.exp(-T) for name in names}) for _ in range(10)]
    seen = words(drawn(fit(model, records))[0])
    assert "and 2 more" in seen
    assert "and 2 more records" in seen
    assert "record 8" in seen


def test_rounding_errors_are_not_enlarged():
    outputs = {"x": "x0", "z": "k"}
    estimate = {"x0": 1.0, "k": 2e-6}
    model = ode_model({"s": "-s"}, initial={"s": 1.0}, outputs=outputs, estimate=estimate)
    result = fit(model, Record(np.array([0.0, 1]), {"x": np.array([2.0, 2.1]), "z": np.full(2, 1e-6)}))
    run = result.simulations[0]
    y = np.column_stack([run.y[:, 0], 1e-6 + np.array([1e-21, -1e-21])])
    axes = drawn(replace(result, simulations=(replace(run, y=y),)))[1]
    assert np.abs(axes.lines[1].get_ydata()).max() < 1e-12
    assert words(axes)[1].endswith(": rounding)")
