"""`correct` with its methods: what each promises, with limits, weights of readings, and refusals."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from repetitions import FULL

from balancing import (
    Labels,
    Limits,
    ReadingErrors,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
    unbalance,
)
from balancing.correction import correction_words
from balancing.solvers import correction_methods
from balancing.solvers.effective_variance import effective_variance
from fem import rotor as supports
from rotorid.base.registry import Method
from rotorid.reduction import guyan_irs_serep as reduction

ERRORS = ReadingErrors(0.02, 0.02)
S, C, P = 3, 4, 2


def job(seed=0, errors=ERRORS, outside=0.0, effect=0.6):
    rng = np.random.default_rng(seed)

    def normal(*shape):
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    W, D = normal(S, C, P), normal(P)
    Y = -W @ D + outside * normal(S, C)
    T = np.vstack((np.zeros(P), effect * np.eye(P)))
    true = Y + np.einsum("scp,rp->rsc", W, T)
    noise = 0.02 * normal(P + 1, S, C) if errors is not None else 0
    return Trials(
        ("base", "one", "two"),
        np.array([100.0, 150.0, 200.0]),
        ("a", "b", "c", "d"),
        ("left", "right"),
        true * (1 + noise),
        T,
        errors,
        Labels(),
    ), D


def test_weighted_is_the_effective_variance_fit():
    trials, _ = job()
    influence = estimate_influence(trials)
    found = correct(influence, method="weighted")
    direct = effective_variance(
        influence.W.reshape(-1, P), influence.baseline.ravel(), influence.covariance.reshape(-1, 6, 6)
    )
    np.testing.assert_allclose(found.weights, direct.weights, rtol=1e-9)
    assert found.chi_square == pytest.approx(direct.chi_square)
    assert found.fit_dof == 2 * S * C - 2 * P


@pytest.mark.full
def test_truth_lies_in_the_weighted_region():
    hits = 0
    for seed in range(200):
        trials, D = job(seed, effect=1.5)
        found = correct(estimate_influence(trials), method="weighted")
        d = (found.weights - D).view(float)
        hits += d @ np.linalg.solve(found.covariance, d) < 9.488  # χ² with 4, 95 %
    assert 180 <= hits <= 199  # 190 ± 3.1


def test_unbalance_outside_the_planes_is_said_by_the_weighted_fit():
    trials, D = job(outside=0.5, effect=1.5)
    found = correct(estimate_influence(trials), method="weighted")
    assert any("unbalance elsewhere" in w for w in found.warnings)
    d = (found.weights - D).view(float)
    assert d @ np.linalg.solve(found.covariance, d) < 18.47  # χ² with 4, 99.9 %
    assert (found.mass_std < 0.2 * np.abs(D)).all()


def test_weighted_without_errors():
    trials, _ = job(errors=None)
    influence = replace(estimate_influence(trials), covariance=None, common=None, errors=None)
    with pytest.raises(ValueError, match="needs errors of the readings"):
        correct(influence, method="weighted")
    rows = np.ones((S, C))
    rows[0] = 3.0
    found = correct(influence, method="weighted", row_weights=rows)
    assert found.covariance is None
    assert any("count by the weights" in w for w in found.warnings)


def test_row_weights_are_those_of_a_weighted_least_squares_problem():
    trials, _ = job(outside=0.5)
    influence = estimate_influence(trials)
    rows = np.random.default_rng(1).uniform(0.2, 2, (S, C))
    found = correct(influence, row_weights=rows, method="least-squares")
    w = rows.ravel()
    W, Y = influence.W.reshape(-1, P), influence.baseline.ravel()
    direct = np.linalg.lstsq(w[:, None] * W, -w * Y, rcond=None)[0]
    np.testing.assert_allclose(found.weights, direct, rtol=1e-9)


def test_covariance_with_row_weights_is_that_of_repeated_jobs():
    rows = np.random.default_rng(1).uniform(0.2, 2, (S, C))
    weights, stated = [], []
    rng = np.random.default_rng(9)
    trials, _ = job(3, outside=0.3, effect=2.0)
    exact = trials.mean
    n = 400 if FULL else 200
    for _ in range(n):
        noise = 0.02 * (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape))
        again = Trials(
            trials.runs,
            trials.speeds,
            trials.sensors,
            trials.planes,
            exact * (1 + noise),
            trials.weights,
            ERRORS,
        )
        found = correct(estimate_influence(again), row_weights=rows, method="least-squares")
        weights.append(found.weights.view(float))
        stated.append(found.covariance)
    seen = np.cov(np.array(weights).T)
    ratio = np.sqrt(np.diag(seen) / np.diag(np.mean(stated, axis=0)))
    assert (np.abs(ratio - 1) < 1.8 / np.sqrt(n)).all()  # 0.09 for 400 draws: 3.5 %


@pytest.mark.parametrize("method", ["weighted", "least-squares"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_limit_that_barely_binds_keeps_the_errors_of_what_is_not_bound(method, seed):
    """Unbalance outside the planes: most of the ± is what explains it, with a limit and without."""
    trials, _ = job(seed, outside=0.5, effect=1.5)
    influence = estimate_influence(trials)

    def widths(share):
        most = {"left": share * abs(free.weights[0])}
        limits = Limits.of(S, influence.sensors, influence.planes, max_weight=most)
        found = correct(influence, method=method, limits=limits)
        assert bool(found.active) == (share < 1)
        return np.concatenate((found.mass_std, found.angle_std))

    free = correct(influence, method=method)
    unlimited = np.concatenate((free.mass_std, free.angle_std))
    np.testing.assert_allclose(widths(1.001), unlimited, rtol=1e-6)
    barely = widths(0.9999) / unlimited
    assert 0.5 < barely[0] < 0.7  # half of the machines need less than the limit: sqrt(1/2 - 1/(2 pi)) = 0.58
    np.testing.assert_allclose(barely[1:], 1, atol=0.15)


@pytest.fixture
def few_draws(monkeypatch):
    """Errors of weights that are drawn come from 100 draws instead of 400."""
    draws = 400 if FULL else 100
    few = functools.partial(correction_methods.sampled_covariance, draws=draws)
    monkeypatch.setattr(correction_methods, "sampled_covariance", few)


@pytest.mark.usefixtures("few_draws")
def test_limits_of_each_method_are_kept():
    trials, _ = job()
    influence = estimate_influence(trials)
    free = {m: correct(influence, method=m) for m in ("least-squares", "weighted", "minmax")}
    limits = Limits.of(
        S,
        influence.sensors,
        influence.planes,
        max_weight={"left": 0.8 * abs(free["least-squares"].weights[0])},
        forbidden={"right": [(np.angle(free["least-squares"].weights[1]) - 0.2, 0.5)]},
    )
    for method, before in free.items():
        found = correct(influence, method=method, limits=limits)
        assert abs(found.weights[0]) <= limits.max_weight[0] * (1 + 1e-9)
        turn = np.mod(np.angle(found.weights[1]) - limits.forbidden[1][0][0], 2 * np.pi)
        assert turn >= 0.5 - 1e-6 or turn <= 1e-6 or turn >= 2 * np.pi - 1e-6
        assert found.covariance is not None
        assert np.isfinite(found.covariance).all()
        assert len(found.active) == 2
        if method == "least-squares":
            assert np.linalg.norm(found.after) > np.linalg.norm(before.after)
    loose = Limits.of(S, influence.sensors, influence.planes, max_weight={"left": 100.0})
    same = correct(influence, method="weighted", limits=loose)
    np.testing.assert_allclose(same.weights, free["weighted"].weights, rtol=1e-9)


@pytest.mark.full
def test_weighted_with_limits_is_the_constrained_optimum_and_passes_without_a_jump():
    from scipy.optimize import minimize

    from balancing.solvers import likelihood
    from rotorid.regression import stretch

    trials, _ = job(5, effect=1.2)
    influence = estimate_influence(trials)
    free = correct(influence, method="weighted")
    problem = likelihood.problem_of(
        influence.W.reshape(-1, P),
        influence.baseline.ravel(),
        influence.covariance.reshape(-1, 6, 6),
        np.ones(S * C),
    )
    for share in (0.99999, 0.9, 0.5):
        most = share * abs(free.weights[0])
        limits = Limits.of(S, influence.sensors, influence.planes, max_weight={"left": most})
        found = correct(influence, method="weighted", limits=limits)
        best = minimize(
            lambda d: likelihood.evaluate(problem, d).objective,
            stretch(free.weights),
            jac=lambda d: 2 * likelihood.gradient(problem, likelihood.evaluate(problem, d)),
            constraints={"type": "ineq", "fun": lambda d, m=most: m**2 - d[0] ** 2 - d[1] ** 2},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        )
        np.testing.assert_allclose(stretch(found.weights), best.x, rtol=1e-4, atol=1e-5)
        if share > 0.999:
            np.testing.assert_allclose(found.weights, free.weights, rtol=1e-3)
        assert any("largest weight" in words for words in found.active)


def test_ridge_answers_where_planes_act_alike():
    trials, _ = job(errors=None)
    twin = np.array(trials.mean)
    twin[2] = twin[0] + 1.5 * (twin[1] - twin[0])
    alike = Trials(trials.runs, trials.speeds, trials.sensors, trials.planes, twin, trials.weights)
    influence = estimate_influence(alike)
    with pytest.raises(UndeterminedError):
        correct(influence)
    soft = correct(influence, strength=0.01)
    assert soft.method == "ridge"
    assert soft.rank == 1
    assert np.isfinite(soft.weights).all()
    cut = correct(influence, keep=1)
    assert cut.method == "truncated"
    # what is left of the vibration is the part that the one effect of both planes cannot undo
    only = correct(influence, planes=["left"], method="least-squares")
    np.testing.assert_allclose(cut.after, only.after, rtol=1e-9)


def test_what_cannot_be():
    trials, _ = job()
    influence = estimate_influence(trials)
    with pytest.raises(ValueError, match="method 'magic' is not known"):
        correct(influence, method="magic")
    with pytest.raises(ValueError, match="choose one"):
        correct(influence, strength=0.1, keep=1)
    with pytest.raises(ValueError, match="least squares without limits only"):
        correct(influence, strength=0.1, method="minmax")
    with pytest.raises(ValueError, match="shape"):
        correct(influence, row_weights=np.ones(3))
    with pytest.raises(ValueError, match="all readings have the weight 0"):
        correct(influence, row_weights=np.zeros((S, C)))


@pytest.mark.parametrize(
    "options",
    [{"method": m} for m in ("least-squares", "weighted", "minmax")] + [{"strength": 0.05}, {"keep": 1}],
)
def test_a_reading_of_weight_zero_is_as_if_it_were_not_there(options):
    trials, _ = job(outside=0.2)
    rows = np.ones((S, C))
    rows[:, 3] = 0
    found = correct(estimate_influence(trials), row_weights=rows, **options)
    fewer = Trials(
        trials.runs,
        trials.speeds,
        trials.sensors[:3],
        trials.planes,
        trials.mean[..., :3],
        trials.weights,
        ERRORS,
        Labels(),
    )
    direct = correct(estimate_influence(fewer), **options)
    np.testing.assert_allclose(found.weights, direct.weights, rtol=1e-6)
    assert found.condition_number == pytest.approx(direct.condition_number)
    if options.get("method") != "minmax":  # else from draws of more readings
        np.testing.assert_allclose(found.covariance, direct.covariance, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("method", ["least-squares", "weighted", "minmax"])
def test_planes_must_be_told_apart_by_readings_that_count(method):
    trials, _ = job()
    rows = np.zeros((S, C))
    rows[0, 0] = 1
    with pytest.raises(UndeterminedError, match="at least 2 readings"):
        correct(estimate_influence(trials), row_weights=rows, method=method)


def test_a_method_is_one_entry(monkeypatch):
    mine = Method(
        "mine",
        "the answer is that of least squares",
        correction_methods.find(correction_methods.METHODS, "least-squares", "").function,
    )
    for module in (correction_methods, correction_words):
        monkeypatch.setattr(module, "METHODS", (*correction_methods.METHODS, mine))
    trials, _ = job()
    influence = estimate_influence(trials)
    found = correct(influence, method="mine")
    np.testing.assert_array_equal(found.weights, correct(influence, method="least-squares").weights)
    assert found.to_dict()["method"] == "mine"
    assert "Mine: the answer is that of least squares." in " ".join(found.answer.whole().split())


@pytest.mark.parametrize(
    "known",
    [
        correction_methods.METHODS,
        correction_methods.VARIANTS,
        unbalance.METHODS,
        reduction.METHODS,
        supports.KINDS,
    ],
)
def test_each_entry_of_a_registry_has_a_name_of_its_own_and_a_clause(known):
    assert len({each.name for each in known}) == len(known)
    assert all(each.about and not each.about.endswith(".") for each in known)
