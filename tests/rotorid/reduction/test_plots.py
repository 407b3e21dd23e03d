"""Pictures of reductions hold what the results hold, and their texts do not cover one another."""

from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from documents import check_hygiene
from fem_rotors import rotor23

from rotorid.base.text import RPM
from rotorid.reduction import compare_methods, reduce
from rotorid.reduction.plots import plot_methods, plot_placement, plot_reduction, plot_stability

mpl.use("Agg")


@pytest.fixture(autouse=True)
def closed():
    """No figure outlives its test."""
    from matplotlib import pyplot as plt

    yield
    plt.close("all")


def legend_of(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


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
        errors = [bar.get_height() for bar in ax.containers[i]]
        np.testing.assert_allclose(errors, 100 * row.relative_error, rtol=1e-9)
        for k in range(3):
            assert f"MAC {row.mac[k]:.4f}" in ax.texts[3 * i + k].get_text()
    assert len({bar.get_hatch() for bars in ax.containers for bar in bars}) == len(methods.rows)
    assert legend_of(ax) == [row.name for row in methods.rows]
    low, high = ax.get_ylim()
    assert low < -8.2 < 7.5 < high
    ax.figure.canvas.draw()
    boxes = [text.get_window_extent() for text in ax.texts if text.get_text()]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_the_map_holds_every_physical_choice_and_its_names():
    """Four choices, the last without a physical model."""
    ax = plot_placement(SimpleNamespace(
        nodes=np.array([[3, 11], [4, 10], [7, 12], [1, 2]]),
        error=np.array([0.003, 0.011, 0.08, np.nan]),
        mac=np.array([0.06, 0.99, 0.97, np.nan]),
        condition=np.array([24.0, 17.0, 18.0, 900.0]),
        considered=4, check=2, rotor=rotor23(),
        named={"best_by_frequency": 0, "best_by_mac": 1, "compromise": 1, "book_rule": 2},
    ))  # fmt: skip
    points = ax.collections[0]
    np.testing.assert_allclose(points.get_offsets(), [(0.03, 8.0), (0.01, 1.1), (0.94, 0.3)])
    np.testing.assert_allclose(points.get_array(), [18.0, 17.0, 24.0])
    check_hygiene(ax.figure, unitless=["condition number of the regression"])


def test_decrements_and_thresholds_of_both_models():
    speeds = np.linspace(0.0, 400.0, 41)
    full, small = (0.01 * (1 - speeds / w) for w in (200.0, 210.0))
    ax = plot_stability(SimpleNamespace(
        speeds=speeds, full_decrement=full, small_decrement=small, nodes=(7, 12, 18),
        full=SimpleNamespace(threshold=200.0), small=SimpleNamespace(threshold=210.0),
    ))  # fmt: skip
    labels = ["full rotor, unstable from 1910 rpm", "3-mass model, unstable from 2005 rpm"]
    assert legend_of(ax) == labels
    lines = {line.get_label(): line.get_ydata() for line in ax.get_lines()}
    np.testing.assert_array_equal([lines[label] for label in labels], [full, small])
    marks = [line.get_xdata()[0] for line in ax.get_lines() if list(line.get_ydata()) == [0.0]]
    assert marks == pytest.approx([200.0 * RPM, 210.0 * RPM])
    check_hygiene(ax.figure, unitless=["smallest logarithmic decrement\n(below 0 a motion grows)"])
