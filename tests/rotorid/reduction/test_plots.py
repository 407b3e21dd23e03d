"""Pictures of reductions hold what the results hold, and their texts do not cover one another."""

from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from documents import check_hygiene
from fem_rotors import rotor23

from rotorid.base.text import RPM
from rotorid.reduction import compare_methods, reduce
from rotorid.reduction.plots import (
    HATCHES,
    plot_methods,
    plot_placement,
    plot_reduction,
    plot_running,
    plot_stability,
)

mpl.use("Agg")


@pytest.fixture(autouse=True)
def closed():
    """No figure outlives its test."""
    from matplotlib import pyplot as plt

    yield
    plt.close("all")


def boxes(texts):
    figure = texts[0].figure
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    return [text.get_window_extent(renderer) for text in texts if text.get_text()]


def texts_of(ax):
    return [text for text in ax.texts if text.get_text()]


def curves_of(ax):
    return [line for line in ax.get_lines() if len(line.get_xdata()) > 2]


def legend_of(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def apart(texts):
    found = boxes(texts)
    return not any(a.overlaps(b) for i, a in enumerate(found) for b in found[:i])


def test_shapes_of_the_model_stand_on_those_of_the_rotor():
    reduction = reduce(rotor23(), (7, 12, 18), 2)
    ax = plot_reduction(reduction)
    modes = reduction.rotor_modes
    scale = np.abs(modes.shapes).max(axis=0)
    curves = [line for line in ax.get_lines() if len(line.get_xdata()) > 100]
    points = [line for line in ax.get_lines() if line.get_linestyle() == "None"]
    assert len(curves) == len(points) == 3
    for k in range(3):
        x, y = curves[k].get_data()
        at = np.searchsorted(x, modes.positions - 1e-9)
        np.testing.assert_allclose(x[at], modes.positions, atol=1e-9)
        np.testing.assert_allclose(y[at], modes.shapes[:, k] / scale[k], atol=1e-9)
        np.testing.assert_allclose(points[k].get_xdata(), reduction.positions)
        np.testing.assert_allclose(points[k].get_ydata(), reduction.shapes[:, k] / scale[k])
    assert ax.get_xlabel() == "position, m"


def test_bars_of_the_methods_hold_errors_and_mac():
    methods = compare_methods(reduce(rotor23(), (7, 12, 18)))
    ax = plot_methods(methods)
    for i, row in enumerate(methods.rows):
        errors = np.array([bar.get_height() for bar in ax.containers[i]])
        np.testing.assert_allclose(errors, 100 * row.relative_error, rtol=1e-9)
        assert {bar.get_hatch() for bar in ax.containers[i]} == {HATCHES[i]}
        for k in range(3):
            assert f"MAC {row.mac[k]:.4f}" in ax.texts[3 * i + k].get_text()
    assert ax.get_yscale() == "linear"
    assert ax.get_ylim()[0] <= 0 < ax.get_ylim()[1]
    assert legend_of(ax) == [row.name for row in methods.rows]
    low, high = ax.get_ylim()
    assert low < -8.2
    assert high > 7.5
    assert apart(texts_of(ax))


def placement(**changes):
    """Four choices, the last without a physical model."""
    fields = {
        "nodes": np.array([[3, 11], [4, 10], [7, 12], [1, 2]]),
        "masses": np.array([[318.0, 146.0], [95.0, 208.0], [134.0, 197.0], [-5.0, 900.0]]),
        "frequencies": np.ones((4, 2)),
        "error": np.array([0.003, 0.011, 0.08, np.nan]),
        "mac": np.array([0.06, 0.99, 0.97, np.nan]),
        "condition": np.array([24.0, 17.0, 18.0, 900.0]),
        "considered": 4,
        "check": 2,
        "named": {"best_by_frequency": 0, "best_by_mac": 1, "compromise": 1, "book_rule": 2},
        "rotor": rotor23(),
    }
    return SimpleNamespace(**fields | changes)


def test_the_map_holds_every_physical_choice_and_its_names():
    ax = plot_placement(placement())
    points = ax.collections[0].get_offsets()
    np.testing.assert_allclose(points, [(0.03, 8.0), (0.01, 1.1), (0.94, 0.3)])
    np.testing.assert_allclose(ax.collections[0].get_array(), [18.0, 17.0, 24.0])
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert ax.figure.axes[1].get_ylabel() == "condition number of the regression"
    check_hygiene(ax.figure, unitless=["condition number of the regression"])


def running():
    speeds = np.linspace(0.0, 300.0, 61)
    shape = np.array([[1.0, 0.5], [0.5, 2.0]])
    full = (speeds**2 / np.abs(100.0**2 - speeds**2 + 200j * 10))[:, None, None] * shape * 1e-3 + 0j
    small = full * (1.0 + 0.03 * speeds / 300.0)[:, None, None]
    near = np.abs(speeds - 100.0) <= 10.0
    return SimpleNamespace(
        speeds=speeds, full=full, small=small, nodes=(7, 18), sensors=(7, 18), criticals=np.array([100.0]),
        bands=0.1, left_out=[(90.0, 110.0)], excluded=near | (speeds == 0),
    )  # fmt: skip


def test_both_responses_and_their_difference_over_speed():
    cost = running()
    ax = plot_running(cost)
    full, small = ax.get_lines()[:2]
    np.testing.assert_allclose(full.get_ydata(), np.abs(cost.full[1:, 1, 1]))
    np.testing.assert_allclose(small.get_ydata(), np.abs(cost.small[1:, 1, 1]))
    assert legend_of(ax) == ["full rotor", "2-mass model", "left out, ±10 % of a critical speed"]
    assert "µm per g·mm" in ax.get_ylabel()
    below = ax.figure.axes[1]
    # nothing is drawn that neither legend nor axes name, such as a line at a limit
    assert (len(ax.get_lines()), len(below.get_lines())) == (2, 1)
    difference = curves_of(below)[0]
    np.testing.assert_allclose(difference.get_ydata(), 3.0 * cost.speeds[1:] / 300.0, rtol=1e-9)
    np.testing.assert_allclose(difference.get_xdata(), RPM * cost.speeds[1:])
    assert below.get_xlabel() == "speed, rpm"
    assert (below.get_yscale(), below.get_ylim()) == ("linear", (0.0, pytest.approx(3.75)))
    check_hygiene(ax.figure)
    for panel in (ax, below):
        band = panel.patches[0].get_path().get_extents(panel.patches[0].get_patch_transform())
        assert (band.x0, band.x1) == pytest.approx((90.0 * RPM, 110.0 * RPM))
    low, high = ax.get_ylim()
    assert low > 0
    assert high > np.abs(cost.small).max()


def stability(**changes):
    speeds = np.linspace(0.0, 400.0, 41)
    fields = {
        "speeds": speeds,
        "full_decrement": 0.01 * (1 - speeds / 200.0),
        "small_decrement": 0.01 * (1 - speeds / 210.0),
        "full": SimpleNamespace(threshold=200.0),
        "small": SimpleNamespace(threshold=210.0),
        "nodes": (7, 12, 18),
    }
    return SimpleNamespace(**fields | changes)


def test_decrements_and_thresholds_of_both_models():
    cost = stability()
    ax = plot_stability(cost)
    labels = ["full rotor, unstable from 1910 rpm", "3-mass model, unstable from 2005 rpm"]
    assert legend_of(ax) == labels
    lines = {line.get_label(): line for line in ax.get_lines()}
    np.testing.assert_array_equal(lines[labels[0]].get_ydata(), cost.full_decrement)
    np.testing.assert_array_equal(lines[labels[1]].get_ydata(), cost.small_decrement)
    marks = [line.get_xdata()[0] for line in ax.get_lines() if list(line.get_ydata()) == [0.0]]
    assert marks == pytest.approx([200.0 * RPM, 210.0 * RPM])
    check_hygiene(ax.figure, unitless=["smallest logarithmic decrement\n(below 0 a motion grows)"])
    assert ax.get_ylim()[0] < cost.full_decrement.min()
