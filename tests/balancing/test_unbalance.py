"""Unbalance at any stations from a single run."""

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


def test_more_stations_than_readings_by_the_smallest_unbalance(rotor):
    W = coefficients(rotor, EVERY, [100.0, 400.0])
    U = 1e-3 * complex_normal(np.random.default_rng(2), 24)
    found = estimate_unbalance(W, W @ U, names=list(EVERY))
    np.testing.assert_allclose(found.residual, 0, atol=1e-9 * np.abs(W @ U).max())
    assert (found.method, found.rank) == ("minimum-norm", 8)
    np.testing.assert_allclose(found.unbalance, np.linalg.pinv(W) @ W @ U, atol=1e-9 * np.abs(U).max())
    np.testing.assert_allclose(found.resolution @ U, found.unbalance, atol=1e-9)
    assert "the readings determine 8 of 24 independent combinations" in found.words()


def test_which_station_is_determined():
    covariance = np.tile(np.diag([0.04, 0.04]), (2, 1, 1))
    W, names = [[2.0, 0, 0], [0, 3.0, 3.0]], ["A", "B", "C"]
    grams = Labels(weight_unit="g_mm", weight_scale=1e6)
    found = estimate_unbalance(W, [2.0, 6.0], names=names, errors=drawn(covariance), labels=grams)
    np.testing.assert_allclose(found.unbalance, [1, 1, 1], rtol=1e-14)
    assert found.determined.tolist() == [True, False, False]
    np.testing.assert_allclose(found.own_share, [1, 0.5, 0.5], rtol=1e-14)
    assert "determined: A; not determined: B (mixed most with C) and C (mixed most with B)" in found.words()
    np.testing.assert_allclose(found.std, [0.1, np.nan, np.nan], rtol=0.1)
    reach = np.hypot(*next(li for li in plot(found).lines if np.ptp(li.get_ydata()) > 0).get_xydata().T)
    assert reach.max() == pytest.approx(1e6 * (1 + 2.4477 * 0.1), rel=0.05)


def test_readings_that_no_unbalance_here_explains():
    W, Y = np.array([[1.0], [1.0], [1.0]]), np.array([1.0, 2.0, 3.0])
    covariance = np.tile(0.01 * np.eye(2), (3, 1, 1))
    found = estimate_unbalance(W, Y, errors=drawn(covariance))
    [words] = found.warnings
    assert words.endswith("unbalance elsewhere, wrong coefficients or a nonlinear rotor are likely reasons")
    assert estimate_unbalance(W, 2 * W[:, 0], errors=drawn(covariance)).warnings == ()


def test_from_a_run_with_a_weight_mounted(rotor):
    """The same weights as `correct`, with the opposite sign; what is mounted is no unbalance of the rotor."""
    speeds, mounted = np.array([100.0, 130.0, 400.0]), 5e-4 * np.exp(1j)
    U = {4: 2e-3, 12: 1e-3j, 20: -1e-3}
    Y = readings(rotor, U | {4: 2e-3 + mounted}, speeds).reshape(1, 3, 4)
    model = model_influence(rotor, THREE, SENSORS, speeds, relative_error=0.01)
    errors = ReadingErrors(0.02, 0.02)
    run = Trials(("now",), speeds, tuple(SENSORS), ("a",), Y, [[mounted]], errors, Labels("um", 1e6))
    found, weights = unbalance_of_run(model, run), correct(model, run)
    np.testing.assert_allclose(found.unbalance, list(U.values()), rtol=1e-4)
    np.testing.assert_allclose(found.unbalance, -weights.weights, rtol=1e-4)
    assert (found.method, found.rank, found.determined.all()) == ("least-squares", 3, True)
    assert (found.stations, found.labels.vibration_unit) == (("a", "b", "c"), "um")
    assert (found.std > 0).all()
    assert (found.std <= np.sqrt(np.diag(weights.covariance).reshape(-1, 2).mean(axis=1)) * 1.001).all()


BAD = [
    ({"W": [[1.0, np.nan]]}, ValueError, "must be finite"),
    ({"Y": [1.0, 2.0]}, ValueError, r"coefficients \(readings, planes\)"),
    ({"W": [[0.0, 0.0]]}, UndeterminedError, "no station has an effect on any reading"),
]


@each_of(("change", "kind", "words"), BAD)
def test_what_cannot_be(change, kind, words):
    arguments = {"W": [[1.0, 2.0]], "Y": [1.0]} | change
    with pytest.raises(kind, match=words):
        estimate_unbalance(**arguments)
