"""The weighted fit within limits against global searches of its own objective."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import Limits
from balancing.solvers import correction_methods, likelihood, weighted_limits
from balancing.solvers.correction_methods import fit_weights
from rotorid.regression import stretch
from tests.helpers.limited_problems import global_search, problem
from tests.helpers.repetitions import FULL

# a single start ends in another minimum, or stops before any, in most of the few
SEEDS = range(200) if FULL else (1, 8, 15, 24, 39, 44, 47, 58, 95, 127, 162)
TRIES = 15 if FULL else 6


@pytest.fixture
def quick(monkeypatch):
    """No covariances."""
    monkeypatch.setattr(correction_methods, "sampled_covariance", lambda *_, **__: None)


@pytest.mark.full
@pytest.mark.parametrize("seed", SEEDS)
def test_no_global_search_finds_better_weights(quick, seed):
    stack, fit = problem(seed)
    found = fit_weights(stack, "weighted")
    D, limits = found.weights, stack.limits
    assert (np.abs(D) <= limits.max_weight).all()
    assert (np.abs(stack.Y + stack.W @ D) <= limits.residual.ravel() * (1 + 1e-12)).all()
    reached = likelihood.evaluate(fit, stretch(D)).objective
    assert reached <= global_search(stack, fit, TRIES) * (1 + 1e-6) + 1e-9
    assert found.gap is None
    assert not any("settle" in words for words in found.warnings)


def test_one_plane_against_a_scan_of_its_disc(quick):
    stack, fit = problem(47)
    most = stack.limits.max_weight[0]

    def scan(D):
        values = [likelihood.evaluate(fit, stretch(d[None])).objective for d in D.ravel()]
        return min(values), D.ravel()[int(np.argmin(values))]

    edge = most * np.exp(1j * np.radians(np.arange(0, 360, 0.5)))
    inside, _ = scan(np.outer(np.linspace(0, 0.99, 15), edge[::6]))
    _, near = scan(edge)
    closer, _ = scan(near * np.exp(1j * np.radians(np.linspace(-0.5, 0.5, 501))))
    reached = likelihood.evaluate(fit, stretch(fit_weights(stack, "weighted").weights)).objective
    assert reached <= inside
    assert 0.999 * closer < reached <= closer


def test_chi_square_is_that_of_the_answer(quick):
    stack, fit = problem(24)
    found = fit_weights(stack, "weighted")
    assert found.chi_square == pytest.approx(likelihood.evaluate(fit, stretch(found.weights)).objective)
    assert found.dof == 2 * stack.W.shape[0] - 2 * stack.W.shape[1]


def test_steps_that_do_not_settle_are_told(quick, monkeypatch):
    monkeypatch.setattr(weighted_limits, "STEPS", 1)
    found = fit_weights(problem(24)[0], "weighted")
    assert any("did not settle" in words for words in found.warnings)


def test_planes_that_must_stay_empty(quick):
    stack, _ = problem(15)
    stack = correction_methods.replace(stack, explained=lambda D: True)  # with three planes and with one
    arcs = (((0.0, 2 * np.pi),), (), ())
    limits = Limits(np.array([np.inf, 0.0, np.inf]), np.full((1, 7), np.inf), arcs)
    found = fit_weights(correction_methods.replace(stack, limits=limits), "weighted")
    assert (found.weights[:2] == 0).all()
    only = correction_methods.replace(
        stack,
        W=stack.W[:, 2:],
        channels=stack.channels[:, [0, 1, 6, 7]][..., [0, 1, 6, 7]],
        limits=None,
        planes=("C",),
    )
    np.testing.assert_allclose(found.weights[2], fit_weights(only, "weighted").weights[0], rtol=1e-4)
