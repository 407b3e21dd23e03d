"""Pictures of reductions hold what the results hold, and their texts do not cover one another."""

import dataclasses
from itertools import pairwise
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from documents import check_hygiene
from fem_rotors import rotor23, uniform
from matplotlib.figure import Figure

import fem
from rotorid.base.rpm import RPM
from rotorid.plots import plot
from rotorid.reduction import reduce, trade_off
from rotorid.reduction.dynamics.comparison_plots import plot_running, plot_stability
from rotorid.reduction.equivalent.mass_uncertainty import InputErrors
from rotorid.reduction.guyan_irs_serep import compare_methods
from rotorid.reduction.placement_plot import plot_placement
from rotorid.reduction.plots import HATCHES, plot_changes, plot_methods, plot_reduction, plot_trade_off

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
    labels = " ".join(legend_of(ax))
    assert "1291 rpm (135.24 rad/s, −0.0034 %), MAC 1.0000" in labels
    assert "mode 3: 10211 rpm" in labels
    assert [text.get_text() for text in texts_of(ax)] == ["134 kg", "197 kg", "157 kg"]
    assert ax.get_xlabel() == "position, m"


def test_masses_at_neighbouring_nodes_are_written_apart():
    reduction = reduce(rotor23(), (2, 4, 5, 11, 12, 13, 22), 5)
    ax = plot_reduction(reduction)
    assert len(texts_of(ax)) == 7
    assert apart([*texts_of(ax), ax.title])
    assert "first 6 of 7 modes" in ax.get_title()
    given = plot_reduction(reduction, ax)
    assert given is ax


def test_modes_that_do_not_vibrate_are_named_and_have_no_points():
    ax = plot_reduction(reduce(rotor23(), (2, 3, 4), 1))
    assert "mode 3: does not vibrate" in legend_of(ax)
    low, high = ax.get_ylim()
    drawn = [line.get_ydata() for line in ax.get_lines() if line.get_linestyle() == "None"]
    assert all(low < y < high for line in drawn for y in line)


def test_bars_of_the_methods_hold_errors_and_mac():
    methods = compare_methods(rotor23(), (7, 12, 18))
    above, below = plot_methods(methods)
    for i, row in enumerate(methods.rows):
        errors = np.array([bar.get_height() for bar in above.containers[i]])
        np.testing.assert_allclose(errors, 100 * row.relative_error, rtol=1e-9)
        losses = np.array([bar.get_y() + bar.get_height() for bar in below.containers[i]])
        np.testing.assert_allclose(losses, np.maximum(1 - row.mac, 0.0), rtol=1e-6)
        assert {bar.get_hatch() for bar in above.containers[i]} == {HATCHES[i]}
    assert {ax.get_yscale() for ax in (above, below)} == {"linear"}
    assert all(ax.get_ylim()[0] <= 0 < ax.get_ylim()[1] for ax in (above, below))
    assert legend_of(above) == [row.name for row in methods.rows]
    written = [text.get_text() for text in texts_of(above)]
    assert written.count("0") == 4  # SEREP three times, and the first mode of IRS
    assert {"+7.5", "−8.1", "+0.00058"} <= set(written)
    assert "0.9879" in [text.get_text() for text in texts_of(below)]
    low, high = above.get_ylim()
    assert low < -8.2
    assert high > 7.5
    assert [tick.get_text().split("\n")[0] for tick in below.get_xticklabels()] == [
        "mode 1",
        "mode 2",
        "mode 3",
    ]
    assert apart(texts_of(above))
    assert apart(texts_of(below))


def test_many_modes_and_failed_methods_are_drawn():
    above, below = plot_methods(compare_methods(rotor23(), (2, 4, 7, 11, 12, 18, 22), modes=4))
    assert "first 6 of 7 modes" in above.get_legend().get_title().get_text()
    assert apart(texts_of(above))
    assert apart(texts_of(below))
    stiff = uniform(8, supports=[fem.Support(1, 1e16), fem.Support(9, 1e16)])
    failed = compare_methods(stiff, (1, 5))
    assert failed.row("SEREP").M is None
    above, below = plot_methods(failed)
    assert [text.get_text() for text in texts_of(above)].count("none") == 2


def test_errors_and_changes_are_drawn_in_percent_of_the_masses_and_frequencies():
    errors = InputErrors(compliance=0.013, shapes=0.01, frequencies=0.001)
    reduction = reduce(rotor23(), (7, 12, 18), 2, errors=errors)
    shift, known = reduction.what_if({"alpha12": 0.013, "U31": -0.003}), reduction.uncertainty
    ax = plot_changes(reduction, shift)
    values = np.concatenate((reduction.masses.solution, reduction.frequencies))
    std = np.concatenate((known.masses_std, known.frequencies_std))
    first, drawn = (bars[2][0].get_segments() for bars in ax.containers)
    np.testing.assert_allclose([segment[1][0] for segment in first], 100 * std / values)
    np.testing.assert_allclose([segment[0][0] for segment in first], -100 * std / values)
    half = np.concatenate(known.drawn) / values
    ends = [segment[1][0] for segment in drawn if len(segment) == 2 and np.isfinite(segment).all()]
    np.testing.assert_allclose(ends, 100 * half[np.isfinite(half)])
    points = {line.get_label(): line.get_xdata() for line in ax.get_lines()}
    exact = np.concatenate((shift.exact_masses, shift.exact_frequencies))
    np.testing.assert_allclose(points["after the change"], 100 * exact / values)
    linear = np.concatenate((shift.masses, shift.frequencies))
    np.testing.assert_allclose(points["after it, predicted by first order"], 100 * linear / values)
    rows = [tick.get_text() for tick in ax.get_yticklabels()]
    assert rows[0] == "node 7:  134.2 ± 11 → 131.3 kg"
    assert rows[3].startswith("mode 1:  1291 ± 1.4 → ")
    assert rows[5].endswith(" rpm")
    check_hygiene(ax.figure)
    alone = plot_changes(dataclasses.replace(reduction, uncertainty=None), shift)
    assert legend_of(alone) == ["after the change", "after it, predicted by first order"]
    assert alone.get_yticklabels()[0].get_text() == "node 7:  134.2 → 131.3 kg"


def test_other_masses_are_drawn_as_methods_are():
    choices = trade_off(rotor23(), (7, 12, 18))
    above, below = plot_trade_off(
        choices, Figure(figsize=(7.0, 6.0), layout="constrained").subplots(2, sharex=True)
    )
    for r in range(len(choices.names)):
        errors = [bar.get_height() for bar in above.containers[r]]
        np.testing.assert_allclose(errors, 100 * choices.relative_error[r], atol=1e-9)
        losses = [bar.get_height() for bar in below.containers[r]]
        np.testing.assert_allclose(losses, np.maximum(1 - choices.mac[r], 0.0), atol=1e-12)
    assert legend_of(above) == list(choices.names)
    assert choices.traps.size  # their bars cross the line below which shapes are others
    assert "MAC 0.9: above, another shape" in {text.get_text() for text in below.texts}
    check_hygiene(above.figure, unitless=["1 − MAC at the masses\n(written: MAC)"])


def placement(**changes):
    """Four choices, the last without a physical model."""
    fields = {
        "nodes": np.array([[3, 11], [4, 10], [7, 12], [1, 2]]),
        "masses": np.array([[318.0, 146.0], [95.0, 208.0], [134.0, 197.0], [-5.0, 900.0]]),
        "frequencies": np.ones((4, 2)),
        "error": np.array([0.003, 0.011, 0.08, np.nan]),
        "mac": np.array([0.06, 0.99, 0.97, np.nan]),
        "condition": np.array([24.0, 17.0, 18.0, 900.0]),
        "pareto": np.array([0, 1]),
        "considered": 4,
        "check": 2,
        "best_by_frequency": 0,
        "best_by_mac": 1,
        "compromise": 1,
        "book": 2,
        "rotor": rotor23(),
    }
    return SimpleNamespace(**fields | changes)


def test_the_map_holds_every_physical_choice_and_its_names():
    ax = plot_placement(placement())
    points = ax.collections[0].get_offsets()
    np.testing.assert_allclose(points, [(0.03, 8.0), (0.01, 1.1), (0.94, 0.3)])
    np.testing.assert_allclose(ax.collections[0].get_array(), [18.0, 17.0, 24.0])
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert "1 without physical model" in ax.get_legend().get_title().get_text()
    labels = legend_of(ax)
    assert labels[0].startswith("trade-off")
    assert labels[1:] == [
        "best by frequency: nodes 3, 11 (318, 146 kg), 0.3 %, MAC 0.0600",
        "best by MAC and compromise: nodes 4, 10 (95, 208 kg), 1.1 %, MAC 0.9900",
        "the book's rule: nodes 7, 12 (134, 197 kg), 8 %, MAC 0.9700",
    ]
    assert ax.figure.axes[1].get_ylabel() == "condition number of the regression"
    check_hygiene(ax.figure, unitless=["condition number of the regression"])


@pytest.mark.parametrize(
    "changes",
    [
        {"book": None},
        {"book": 3},
        {"error": np.array([0.0, 0.0, 0.0, np.nan]), "mac": np.array([1.0, 1.0, 1.0, np.nan])},
        {"condition": np.ones(4)},
    ],
)
def test_the_map_of_special_cases_is_drawn(changes):
    ax = plot_placement(placement(**changes))
    ax.figure.canvas.draw()
    shown = ax.collections[0].get_offsets()
    assert len(shown) == 3
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert all(left < x < right and low < y < high for x, y in shown)
    assert any("book" in label for label in legend_of(ax)) is (changes.get("book", 2) == 2)
    assert len(ax.figure.axes) == (1 if "condition" in changes else 2)


def test_a_map_without_any_physical_choice_says_so():
    nothing = np.full(4, np.nan)
    ax = plot_placement(
        placement(error=nothing, mac=nothing, pareto=np.array([], dtype=int), best_by_frequency=None,
                  best_by_mac=None, compromise=None)
    )  # fmt: skip
    assert [text.get_text() for text in ax.texts] == ["no choice gives a physical model"]
    assert ax.get_title() == "4 choices of 2 nodes, 4 without physical model"


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
    difference = curves_of(below)[0]
    np.testing.assert_allclose(difference.get_ydata(), 3.0 * cost.speeds[1:] / 300.0, rtol=1e-9)
    np.testing.assert_allclose(difference.get_xdata(), RPM * cost.speeds[1:])
    assert below.get_xlabel() == "speed, rpm"
    assert (below.get_yscale(), below.get_ylim()) == ("linear", (0.0, 10.0))
    check_hygiene(ax.figure)
    for panel in (ax, below):
        band = panel.patches[0].get_path().get_extents(panel.patches[0].get_patch_transform())
        assert (band.x0, band.x1) == pytest.approx((90.0 * RPM, 110.0 * RPM))
    low, high = ax.get_ylim()
    assert low > 0
    assert high > np.abs(cost.small).max()


def test_overlapping_bands_are_shaded_once_and_those_outside_not_at_all():
    cost = running()
    cost.criticals, cost.left_out = np.array([100.0, 104.0, 400.0]), [(90, 110), (93.6, 114.4), (360, 440)]
    ax = plot_running(cost)
    spans = [patch.get_path().get_extents(patch.get_patch_transform()) for patch in ax.patches]
    assert [(span.x0, span.x1) for span in spans] == [pytest.approx((90.0 * RPM, 114.4 * RPM))]
    assert ax.get_xlim()[1] < 360 * RPM


def stability(**changes):
    speeds = np.linspace(0.0, 400.0, 41)
    fields = {
        "speeds": speeds,
        "full_decrement": 0.01 * (1 - speeds / 200.0),
        "small_decrement": 0.01 * (1 - speeds / 210.0),
        "full_threshold": 200.0,
        "small_threshold": 210.0,
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
    check_hygiene(ax.figure, unitless=["smallest logarithmic decrement"])
    assert ax.get_ylim()[0] < cost.full_decrement.min()


def test_a_stable_rotor_shows_where_it_would_be_unstable():
    steady = np.full(41, 0.0036)
    ax = plot_stability(
        stability(full_decrement=steady, small_decrement=steady, full_threshold=None, small_threshold=None)
    )
    assert legend_of(ax) == ["full rotor", "3-mass model"]
    low, high = ax.get_ylim()
    assert low < 0 < 0.0036 < high


def test_what_runs_away_or_does_not_oscillate_is_drawn():
    gone = stability().full_decrement.copy()
    gone[30:] = -np.inf
    ax = plot_stability(stability(full_decrement=gone))
    assert "full rotor runs away without oscillating" in legend_of(ax)
    away = next(line for line in ax.get_lines() if "runs away" in str(line.get_label()))
    np.testing.assert_allclose(away.get_xdata(), RPM * stability().speeds[30:])
    nothing = np.full(41, np.nan)
    ax = plot_stability(
        stability(full_decrement=nothing, small_decrement=nothing, full_threshold=None, small_threshold=None)
    )
    assert "nothing oscillates" in [text.get_text() for text in ax.texts]
    ax.figure.canvas.draw()
    # a well-damped rotor at standstill does not flatten the rest
    tall = stability().full_decrement.copy()
    tall[0] = 500.0
    assert plot_stability(stability(full_decrement=tall)).get_ylim()[1] < 1.0


def test_results_draw_themselves():
    methods = compare_methods(rotor23(), (7, 12, 18))
    above, below = plot(methods)
    assert above.figure is below.figure
    same = plot(dataclasses.replace(methods, warnings=("said",)), (above, below))
    assert same == (above, below)
    assert all(a.get_position().y0 >= b.get_position().y1 for a, b in pairwise((above, below)))
