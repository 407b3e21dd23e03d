"""Unbalance at any stations from a single run."""

from itertools import pairwise

import numpy as np
import pytest
from balancing_data import complex_normal
from cases import each_of
from exact_solutions import exactly
from fem_rotors import rotor23

import fem
from balancing import (
    Labels,
    ReadingErrors,
    Trials,
    UndeterminedError,
    correct,
    estimate_unbalance,
    model_influence,
    unbalance_of_run,
)
from balancing.errors import reading_covariance
from balancing.plots import draw_unbalance as plot

THREE = {"a": 4, "b": 12, "c": 20}
EVERY = {f"n{node}": node for node in range(1, 25)}
SENSORS = {"s3": 3, "s9": 9, "s15": 15, "s21": 21}


@pytest.fixture(scope="module")
def rotor():
    return rotor23(damping=2e4)


def readings(rotor, U, speeds):
    """Of an exact response, (N,), stacked speed by speed."""
    response = exactly(fem.unbalance_response, rotor, U, speeds)
    return np.array([response.at(node) for node in SENSORS.values()]).T.ravel()


def drawn(covariance, n=400):
    """Errors of readings (n, N) with covariances (N, 2, 2)."""
    z = np.random.default_rng(0).standard_normal((n, len(covariance), 2))
    e = np.einsum("nij,dnj->dni", np.linalg.cholesky(covariance), z)
    return e[..., 0] + 1j * e[..., 1]


def coefficients(rotor, planes, speeds):
    return model_influence(rotor, planes, SENSORS, speeds).W.reshape(-1, len(planes))


def test_three_stations_are_recovered_exactly(rotor):
    U = np.array([2e-3, 1e-3 * np.exp(2j), -3e-3j])
    speeds = [100.0, 130.0, 400.0]
    Y = readings(rotor, dict(zip(THREE.values(), U, strict=True)), speeds)
    found = estimate_unbalance(coefficients(rotor, THREE, speeds), Y, names=list(THREE))
    np.testing.assert_allclose(found.unbalance, U, rtol=1e-5)
    assert (found.method, found.rank, found.warnings) == ("least-squares", 3, ())
    assert found.determined.all()
    assert found.words() == "the readings determine all 3 stations"
    np.testing.assert_allclose(found.resolution, np.eye(3), atol=1e-9)


def test_more_stations_than_readings_by_the_smallest_unbalance(rotor):
    speeds = [100.0, 400.0]
    W = coefficients(rotor, EVERY, speeds)
    rng = np.random.default_rng(2)
    U = 1e-3 * complex_normal(rng, 24)
    Y = W @ U
    found = estimate_unbalance(W, Y, names=list(EVERY))
    np.testing.assert_allclose(found.residual, 0, atol=1e-9 * np.abs(Y).max())
    assert found.method == "minimum-norm"
    assert found.rank == 8 < 24
    others = np.linalg.svd(W)[2][8:].conj().T  # what no reading shows
    np.testing.assert_allclose(W @ others, 0, atol=1e-12 * np.abs(W).max())
    assert np.abs(others.conj().T @ found.unbalance).max() < 1e-9 * np.linalg.norm(found.unbalance)
    for _ in range(20):
        other = found.unbalance + others @ (1e-4 * complex_normal(rng, 16))
        np.testing.assert_allclose(W @ other, Y, atol=1e-9 * np.abs(Y).max())
        assert np.linalg.norm(other) > np.linalg.norm(found.unbalance)
    np.testing.assert_allclose(found.resolution @ U, found.unbalance, atol=1e-9)
    assert "the readings determine 8 of 24 independent combinations" in found.words()


def test_words_say_which_station_is_determined():
    found = estimate_unbalance([[2.0, 0, 0], [0, 3.0, 3.0]], [2.0, 6.0], names=["A", "B", "C"])
    np.testing.assert_allclose(found.unbalance, [1, 1, 1], rtol=1e-14)
    assert found.determined.tolist() == [True, False, False]
    np.testing.assert_allclose(found.own_share, [1, 0.5, 0.5], rtol=1e-14)
    assert found.words() == (
        "the readings determine 2 of 3 independent combinations of the stations; determined: A; "
        "not determined: B (mixed most with C) and C (mixed most with B)"
    )


def test_std_only_where_the_station_is_determined():
    covariance = np.tile(np.diag([0.04, 0.04]), (2, 1, 1))
    found = estimate_unbalance([[2.0, 0, 0], [0, 3.0, 3.0]], [2.0, 6.0], errors=drawn(covariance))
    np.testing.assert_allclose(found.std, [0.1, np.nan, np.nan], rtol=0.1)


@pytest.mark.full
def test_covariance_is_that_of_drawn_readings():
    rng = np.random.default_rng(4)
    W, U = complex_normal(rng, (8, 3)), np.array([1.0, 2j, -1.5])
    Y = W @ U
    covariance = reading_covariance(Y, ReadingErrors(0.01, 0.04))
    errors = drawn(covariance, 4000)
    found = estimate_unbalance(W, Y, errors=errors)
    root = np.linalg.cholesky(covariance)
    again = []
    for _ in range(4000):
        noise = np.einsum("nij,nj->ni", root, rng.standard_normal((8, 2)))
        each = estimate_unbalance(W, Y + noise[:, 0] + 1j * noise[:, 1], errors=errors)
        again.append(each.unbalance.view(float))
    scale = np.sqrt(np.diag(found.covariance))
    spread = np.cov(np.array(again).T)
    np.testing.assert_allclose(
        spread / np.outer(scale, scale), found.covariance / np.outer(scale, scale), atol=0.15
    )


def smooth(rotor, scale=1e-3):
    x = rotor.positions / rotor.positions[-1]
    return scale * (np.exp(0.5j) + 2j * np.sin(3 * x) - 1.5 * x)


def test_ridge_is_nearer_to_a_smooth_unbalance_than_the_smallest_one(rotor):
    speeds = [80.0, 125.0, 145.0, 400.0, 540.0, 700.0]
    W = coefficients(rotor, EVERY, speeds)
    U = smooth(rotor)
    rng = np.random.default_rng(7)
    sigma = 0.02 * np.median(np.abs(W @ U))
    Y = W @ U + sigma * complex_normal(rng, len(W))
    covariance = np.tile(sigma**2 * np.eye(2), (len(W), 1, 1))
    found = estimate_unbalance(W, Y, method="ridge", errors=drawn(covariance))
    plain = estimate_unbalance(W, Y)
    assert np.linalg.norm(found.unbalance - U) < 0.01 * np.linalg.norm(plain.unbalance - U)
    assert any("use the method" in words for words in plain.warnings)
    assert found.warnings == ()
    assert found.chi_square == pytest.approx(2 * len(W), rel=0.01)
    assert found.own_share.max() < 1


def test_ridge_that_is_given():
    rng = np.random.default_rng(1)
    W, Y = complex_normal(rng, (4, 6)), complex_normal(rng, 4)
    found = estimate_unbalance(W, Y, method="ridge", ridge=0.3)
    level = (0.3 * np.linalg.norm(W, 2)) ** 2
    expected = np.linalg.solve(W.conj().T @ W + level * np.eye(6), W.conj().T @ Y)
    np.testing.assert_allclose(found.unbalance, expected, rtol=1e-12)
    assert found.ridge == 0.3


def test_readings_within_their_errors_show_no_unbalance():
    covariance = np.tile(np.eye(2), (4, 1, 1))
    found = estimate_unbalance(
        np.diag([1.0, 2, 3, 4]), [0.1, 0.1j, 0.1, 0], method="ridge", errors=drawn(covariance)
    )
    assert np.abs(found.unbalance).max() < 1e-9
    assert found.warnings == ("the readings lie within their errors: they show no unbalance at all",)


@pytest.mark.parametrize("method", ["minimum-norm", "ridge"])
def test_readings_that_no_unbalance_here_explains(method):
    W, Y = np.array([[1.0], [1.0], [1.0]]), np.array([1.0, 2.0, 3.0])
    covariance = np.tile(0.01 * np.eye(2), (3, 1, 1))
    found = estimate_unbalance(W, Y, method=method, errors=drawn(covariance))
    [words] = found.warnings
    assert words.endswith("unbalance elsewhere, wrong coefficients or a nonlinear rotor are likely reasons")
    assert estimate_unbalance(W, 2 * W[:, 0], errors=drawn(covariance)).warnings == ()


def test_rows_count_by_their_errors():
    covariance = np.array([np.eye(2), 4 * np.eye(2)])
    found = estimate_unbalance([[1.0], [1.0]], [1.0, 2.0], errors=drawn(covariance))
    assert found.unbalance[0] == pytest.approx((1.0 + 2.0 / 4) / (1 + 1 / 4), rel=0.05)
    assert found.std[0] == pytest.approx(1 / np.sqrt(1 + 1 / 4), rel=0.1)


def test_result_in_the_labels_units():
    labels = Labels(weight_unit="g_mm", weight_scale=1e6, angles="against rotation")
    covariance = np.tile(1e-12 * np.eye(2), (2, 1, 1))
    found = estimate_unbalance(
        np.eye(2), [1e-3, 2e-3j], names=["DE", "NDE"], errors=drawn(covariance), labels=labels
    )
    data = found.to_dict()
    assert [row["unbalance"] for row in data["stations"]] == pytest.approx([1000.0, 2000.0])
    assert [row["angle_deg"] for row in data["stations"]] == pytest.approx([0.0, 270.0])
    assert [row["std"] for row in data["stations"]] == pytest.approx([1.0, 1.0], rel=0.1)
    frame = found.to_frame()
    assert list(frame["station"]) == ["DE", "NDE"]
    assert frame["determined"].all()
    lines = found.answer.brief().splitlines()
    assert lines[0] == "The readings determine all 2 stations (least-squares)."
    assert lines[3].split()[:3] == ["DE", "1000", "0.0°"]
    assert all(len(a) < 110 for a, _ in pairwise(lines))


def test_picture():
    covariance = np.tile(np.diag([0.04, 0.04]), (2, 1, 1))
    labels = Labels(weight_unit="g_mm", weight_scale=1e6)
    found = estimate_unbalance(
        [[2.0, 0, 0], [0, 3.0, 3.0]],
        [2.0, 6j],
        names=["A", "B", "C"],
        errors=drawn(covariance),
        labels=labels,
    )
    ax = plot(found)
    arrows = ax.collections[0]
    assert pytest.approx(np.array([1e6, 1e6j, 1e6j])) == (arrows.U + 1j * arrows.V)
    colors = [tuple(color) for color in arrows.get_facecolors()]
    assert colors[0] != colors[1] == colors[2], "what is not determined is grey"
    [region] = [line for line in ax.lines if np.ptp(line.get_ydata()) > 0]
    reach = np.hypot(*(region.get_xydata() - [1e6, 0]).T)
    assert reach == pytest.approx(np.full(91, 2.4477 * 0.1e6), rel=0.1)
    assert [text.get_text().split()[0] for text in ax.get_xticklabels()] == ["A", "B", "C"]
    assert ax.get_ylabel() == "unbalance, g·mm"
    assert plot(found, ax) is ax


def test_from_a_run_with_a_weight_mounted(rotor):
    """The same weights as `correct`, with the opposite sign; what is mounted is no unbalance of the rotor."""
    speeds = np.array([100.0, 130.0, 400.0])
    U = {4: 2e-3, 12: 1e-3j, 20: -1e-3}
    mounted = 5e-4 * np.exp(1j)
    Y = readings(rotor, U | {4: 2e-3 + mounted}, speeds).reshape(1, 3, 4)
    errors = ReadingErrors(0.02, 0.02)
    model = model_influence(rotor, THREE, SENSORS, speeds, relative_error=0.01)
    run = Trials(("now",), speeds, tuple(SENSORS), ("a",), Y, [[mounted]], errors, Labels("um", 1e6))
    found, weights = unbalance_of_run(model, run), correct(model, run)
    np.testing.assert_allclose(found.unbalance, list(U.values()), rtol=1e-4)
    np.testing.assert_allclose(found.unbalance, -weights.weights, rtol=1e-4)
    assert found.stations == ("a", "b", "c")
    assert (found.labels.vibration_unit, found.labels.weight_unit) == ("um", "kg_m")
    assert (found.std > 0).all()
    assert (found.std <= np.sqrt(np.diag(weights.covariance).reshape(-1, 2).mean(axis=1)) * 1.001).all()
    bare = unbalance_of_run(model, Y[0])
    assert (bare.std > found.std).any()  # 2 % and 2° are assumed, and errors between runs
    assert bare.unbalance[0] == pytest.approx(2e-3 + mounted, rel=0.01)


BAD = [
    ({"W": [[1.0, np.nan]]}, ValueError, "must be finite"),
    ({"Y": [np.inf]}, ValueError, "must be finite"),
    ({"Y": [1.0, 2.0]}, ValueError, r"coefficients \(N, Q\) and readings \(N,\)"),
    ({"W": [[0.0, 0.0]]}, UndeterminedError, "no station has an effect on any reading"),
    ({"method": "best"}, ValueError, "minimum-norm"),
    ({"ridge": 0.1}, ValueError, "no other method has one"),
    ({"method": "ridge", "ridge": 0.0}, ValueError, "ridge > 0"),
    ({"errors": np.eye(2)}, ValueError, "1 errors of each draw"),
    ({"method": "ridge", "errors": np.zeros((9, 1))}, ValueError, "or errors of the readings"),
    ({"names": ["A"]}, ValueError, "2 names of stations"),
]


@each_of(("change", "kind", "words"), BAD)
def test_what_cannot_be(change, kind, words):
    arguments = {"W": [[1.0, 2.0]], "Y": [1.0]} | change
    with pytest.raises(kind, match=words):
        estimate_unbalance(**arguments)
