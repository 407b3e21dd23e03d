"""Residual against total weight: its ends, its optimality, its knee, its picture."""

import json

import numpy as np
import pytest
from balancing_data import complex_normal
from helpers.limited_problems import minmax_cone, weight_budget_cone

from balancing import Labels, UndeterminedError
from balancing.correction.trade_off import knee, trade_off
from rotorid.plots import plot

LABELS = Labels(vibration_unit="um_pp", vibration_scale=2e6, weight_unit="g", weight_scale=1e3)


def case(seed=0, N=12, P=3):
    """Two planes act nearly alike."""
    rng = np.random.default_rng(seed)
    W = complex_normal(rng, (N, P))
    W[:, 1] = 1.5 * W[:, 0] + 0.2 * complex_normal(rng, N)
    return W, -W @ complex_normal(rng, P) + 0.1 * complex_normal(rng, N), rng.uniform(0.5, 2, N)


@pytest.mark.parametrize("criterion", ["rms", "max"])
def test_the_ends_and_the_shape_of_the_curve(criterion):
    W, Y, w = case()
    found = trade_off(W, Y, "ABC", criterion=criterion, row_weights=w)
    assert len(found.totals) == 15
    assert not found.weights[0].any()
    np.testing.assert_allclose(found.rms[0], np.sqrt(np.mean(np.abs(Y) ** 2)), rtol=1e-12)
    np.testing.assert_allclose(found.largest[0], np.abs(Y).max(), rtol=1e-12)
    if criterion == "rms":
        best = -np.linalg.lstsq(w[:, None] * W, w * Y, rcond=None)[0]
        np.testing.assert_allclose(found.weights[-1], best, rtol=1e-9)
        np.testing.assert_allclose(
            found.objective[-1], np.sqrt(np.mean(np.abs(w * (Y + W @ best)) ** 2)), rtol=1e-9
        )
    else:
        np.testing.assert_allclose(found.objective[-1], minmax_cone(W, Y, row_weights=w).objective, rtol=1e-7)
    assert (np.diff(found.totals) > 0).all()
    assert (np.diff(found.objective) < 0).all()
    # convex: the slope only rises (the last pieces of a flat end to the accuracy of the solver)
    slope = np.diff(found.objective) / np.diff(found.totals)
    assert (np.diff(slope) > -1e-5 * abs(slope[0])).all()
    np.testing.assert_allclose(found.totals, np.abs(found.weights).sum(axis=1), rtol=1e-12)
    after = np.abs(Y + found.weights @ W.T)
    np.testing.assert_allclose(found.largest, after.max(axis=1), rtol=1e-12)
    np.testing.assert_allclose(found.rms, np.sqrt(np.mean(after**2, axis=1)), rtol=1e-12)


def test_points_in_between_are_optimal():
    """Karush, Kuhn and Tucker: each weight stands against its gradient, all these gradients alike in size."""
    W, Y, w = case(seed=5, P=4)
    found = trade_off(W, Y, "ABCD", row_weights=w)
    A, y = w[:, None] * W, w * Y
    partial = 0
    for D in found.weights[1:-1]:
        r = y + A @ D
        gradient = A.conj().T @ r / np.linalg.norm(r)
        used = np.abs(D) > 0
        price = np.abs(gradient).max()
        np.testing.assert_allclose(
            gradient[used], -price * D[used] / np.abs(D[used]), atol=2e-4 * np.linalg.norm(A, axis=0).max()
        )
        partial += not used.all()
    # the budget leaves planes empty somewhere, exactly
    assert partial > 0


def test_points_stand_where_the_curve_is_long():
    """The best correction needs many times the weight that takes away most: equal steps would miss that."""
    rng = np.random.default_rng(4)
    a = complex_normal(rng, 8)
    W = np.column_stack((a, a + 0.003 * complex_normal(rng, 8)))
    found = trade_off(W, -a + 0.1 * complex_normal(rng, 8), "AB")
    assert found.totals[-1] > 12
    down = -np.diff(found.objective) / (found.objective[0] - found.objective[-1])
    across = np.diff(found.totals) / found.totals[-1]
    assert np.hypot(across, down).max() < 0.3
    assert found.totals[found.knee] < 2


def test_one_plane_in_closed_form():
    """The weight grows along the best one; no other is as good at the same size."""
    rng = np.random.default_rng(3)
    a = complex_normal(rng, 8)
    Y = -0.7j * a + 0.3 * complex_normal(rng, 8)
    best = -np.vdot(a, Y) / np.vdot(a, a)
    found = trade_off(a[:, None], Y, ["A"])
    np.testing.assert_allclose(found.weights[:, 0], found.totals * best / abs(best), atol=1e-6 * abs(best))
    least = np.linalg.norm(Y + a * best) ** 2
    expected = least + np.linalg.norm(a) ** 2 * (found.totals - abs(best)) ** 2
    np.testing.assert_allclose(found.rms, np.sqrt(expected / 8), rtol=1e-6)


def test_the_curve_of_an_exact_plane_is_straight_and_has_no_knee():
    a = complex_normal(np.random.default_rng(3), 8)
    found = trade_off(a[:, None], -2 * a, ["A"], points=5)
    np.testing.assert_allclose(found.objective / found.objective[0], 1 - found.totals / 2, atol=1e-6)
    np.testing.assert_allclose(found.totals, [0, 0.5, 1, 1.5, 2], atol=1e-6)
    assert found.knee is None
    assert found.summary().startswith(
        "There is no clear knee: the last weights pay nearly as well as the first."
    )
    assert found.to_dict()["knee"] is None


@pytest.mark.parametrize("criterion", ["rms", "max"])
def test_the_knee_against_a_fine_curve(criterion):
    """Two planes that act alike: the last weights in them are large and gain little."""
    W, Y, _ = case(seed=1)
    found = trade_off(W, Y, "ABC", criterion=criterion)
    end = found.totals[-1]
    fine = np.linspace(0, end, 101)[1:-1]
    value = [weight_budget_cone(W, Y, t, minmax=criterion == "max").objective for t in fine]
    value = np.array(value) / (1 if criterion == "max" else np.sqrt(len(Y)))
    below = 1 - fine / end - (value - found.objective[-1]) / (found.objective[0] - found.objective[-1])
    # the knee among 15 points lies nearly as far below the straight line as the best of 99
    there = np.interp(found.totals[found.knee], fine, below)
    assert there > 0.97 * below.max()


@pytest.mark.parametrize(
    ("totals", "values", "expected"),
    [
        ([0, 1, 2, 10], [10, 4, 3, 2], 2),
        ([0, 1, 2], [2, 1, 0], None),
        ([0, 1, 2], [2, 0.51, 0], None),
        ([0, 1, 2], [2, 0.49, 0], 1),
        ([0], [3], None),
        ([0, 1], [3, 3], None),
    ],
)
def test_the_rule_of_the_knee(totals, values, expected):
    assert knee(np.array(totals, dtype=float), np.array(values, dtype=float)) == expected


def test_tables_speak_the_units_of_the_job():
    W, Y, _ = case()
    found = trade_off(W * 1e-3, Y * 1e-6, "ABC", labels=LABELS, points=7)
    frame = found.to_frame()
    assert list(frame.columns) == [
        *("total", "rms_after", "max_after", "knee"),
        *("A_mass", "A_angle_deg", "B_mass", "B_angle_deg", "C_mass", "C_angle_deg"),
    ]
    assert len(frame) == 7
    np.testing.assert_allclose(frame["total"], found.totals * 1e3, rtol=1e-12)
    np.testing.assert_allclose(frame[["A_mass", "B_mass", "C_mass"]].sum(axis=1), frame["total"], rtol=1e-12)
    np.testing.assert_allclose(frame["rms_after"], found.rms * 2e6, rtol=1e-12)
    np.testing.assert_allclose(frame["max_after"], found.largest * 2e6, rtol=1e-12)
    assert frame.index[frame["knee"]].tolist() == [found.knee]
    data = json.loads(json.dumps(found.to_dict()))
    assert data["knee"] == found.knee
    assert [w["plane"] for w in data["points"][3]["weights"]] == ["A", "B", "C"]
    assert found.answer.judgement.startswith(f"The knee: {found.totals[found.knee] * 1e3:.3g} of ")
    lines = found.answer.tables[0].splitlines()
    assert lines[0] == "The least rms that a total weight leaves (µm pp)"
    assert [i for i, line in enumerate(lines) if line.endswith("← knee")] == [2 + found.knee]
    assert lines[2].split() == ["0", *lines[2].split()[1:3], "0", "%"]
    assert max(map(len, lines)) <= 80


def test_a_rotor_without_vibration_has_one_point():
    found = trade_off([[1, 0.1], [0.2, 1], [1, 1]], [0, 0, 0], "AB")
    assert found.totals.tolist() == [0.0]
    assert found.knee is None
    assert found.to_frame()["max_after"].tolist() == [0.0]
    assert found.summary().startswith("There is nothing to take away.")


def test_the_picture_holds_the_curve_the_knee_and_the_weights():
    W, Y, _ = case()
    found = trade_off(W * 1e-3, Y * 1e-6, "ABC", labels=LABELS)
    upper, _, lower = plot(found).axes
    curve = next(line for line in upper.lines if line.get_label() == "rms (made as small as possible)")
    np.testing.assert_allclose(curve.get_xdata(), found.totals * 1e3)
    np.testing.assert_allclose(curve.get_ydata(), found.rms * 2e6)
    mark = next(line for line in upper.lines if str(line.get_label()).startswith("knee: "))
    np.testing.assert_allclose(mark.get_xdata(), [found.totals[found.knee] * 1e3])
    np.testing.assert_allclose(mark.get_ydata(), [found.rms[found.knee] * 2e6])
    assert upper.get_ylabel() == "vibration after, µm pp"
    assert lower.get_xlabel() == "total weight of all planes, g"
    for p, plane in enumerate("ABC"):
        line = next(line for line in lower.lines if line.get_label() == f"weight in {plane}")
        np.testing.assert_allclose(line.get_ydata(), np.abs(found.weights[:, p]) * 1e3)
        np.testing.assert_allclose(line.get_xdata(), found.totals * 1e3)


def test_the_picture_in_given_axes_without_units_or_knee():
    from matplotlib.figure import Figure

    a = complex_normal(np.random.default_rng(3), 8)
    labels = Labels(vibration_unit="", weight_unit="")
    found = trade_off(a[:, None], -2 * a, ["A"], criterion="max", points=4, labels=labels)
    ax = Figure().add_subplot()
    assert plot(found, ax) is ax
    assert ax.get_xlabel() == "total weight of all planes"
    assert ax.get_ylabel() == "vibration after"
    assert len(ax.lines) == 2


@pytest.mark.parametrize(
    ("W", "more", "words"),
    [
        ([[1, 0], [0, 1]], {"points": 2}, "at least 3 points"),
        ([[1, 0], [0, 1]], {"criterion": "mean"}, "not of 'mean'"),
        ([[1, np.inf], [0, 1]], {}, "NaN or infinity"),
        ([[1], [0]], {}, "1 different names"),
        ([[1, 0], [0, 1]], {"row_weights": [1, np.nan]}, "row weights must be"),
    ],
)
def test_what_is_refused(W, more, words):
    with pytest.raises(ValueError, match=words):
        trade_off(W, [1, 1], "AB", **more)


def test_dependent_planes_have_no_best_correction_to_end_at():
    with pytest.raises(UndeterminedError, match="planes 'A' and 'B' act alike"):
        trade_off([[1, 2], [2, 4]], [1, 1], "AB")
