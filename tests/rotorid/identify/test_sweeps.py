"""Modes of run-ups and run-downs, and what they are fitted by: answers while the speed changes."""

from dataclasses import replace

import numpy as np
import pytest
from run_ups import drawn, example
from scipy.integrate import solve_ivp

from balancing import Labels
from rotorid.identify.answers import SteadyAnswers, swept_answers
from rotorid.identify.modes import constant_vectors, fit_sweep
from rotorid.identify.modes_result import Readings

OMEGA, ZETA = np.array([100.0, 150.0]), np.array([0.02, 0.03])
Q = np.concatenate((OMEGA, ZETA))
SWEEPS = [(30.0, 5.0), (230.0, -8.0)]


@pytest.mark.full
def test_an_acceleration_that_changes():
    """A coast-down, Ω = 250 e^{−t/20}, read often enough, beside DOP853 from steady motion."""
    time = np.linspace(0, 30, 2000)

    def slope(t, y):
        speed = 250 * np.exp(-t / 20)
        force = (speed**2 + 1j * speed / 20) * np.exp(1j * (5000 - 20 * speed))
        return np.concatenate((y[2:], OMEGA**2 * (force - y[:2]) - 2 * ZETA * OMEGA * y[2:]))

    found = swept_answers(time, 250 * np.exp(-time / 20)).basis(Q)[0][:, :2]
    z = OMEGA**2 * 250.0**2 / (OMEGA**2 - 250.0**2 + 500j * ZETA * OMEGA)
    start = np.concatenate((z, 250j * z))
    exact = solve_ivp(slope, (0, 30), start, "DOP853", time, rtol=1e-8, atol=1e-6).y[:2].T
    exact *= np.exp(-1j * 5000 * (1 - np.exp(-time / 20)))[:, None]
    late = time > 6  # how it begins is forgotten
    assert (abs(found - exact)[late].max(axis=0) < 1e-4 * abs(exact).max(axis=0)).all()


@pytest.mark.parametrize(("first", "rate"), SWEEPS)
def test_the_closed_form_is_the_same(first, rate):
    """But for how it begins, which is forgotten."""
    time = np.linspace(0, 24, 300)
    modes = zip(OMEGA, ZETA, strict=True)
    exact = np.transpose([w**2 * example.swept(w, z, first, rate, time) for w, z in modes])[time > 12]
    answers = swept_answers(time, first + rate * time).basis(Q)[0][time > 12, :2]
    assert (abs(answers - exact).max(axis=0) < 1e-5 * abs(exact).max(axis=0)).all()


def test_a_held_speed_is_steady():
    held = np.full(20, 95.0)
    answers, slopes = swept_answers(np.linspace(0, 20, 20), held).basis(Q)
    steady, flat = SteadyAnswers(held, held**2 + 0j).basis(Q)
    np.testing.assert_allclose(answers, steady, rtol=1e-9)
    np.testing.assert_allclose(slopes, flat, rtol=1e-7, atol=1e-7 * abs(flat).max())


@pytest.mark.parametrize(("first", "rate"), SWEEPS)
def test_slopes_are_those_of_the_answers(first, rate):
    time = np.linspace(0, 24, 60)
    answers = swept_answers(time, first + rate * time)
    values, slopes = answers.basis(Q)
    for j, step in enumerate(1e-5 * np.diag(Q)):
        numeric = (answers.basis(Q + step)[0] - answers.basis(Q - step)[0])[:, j % 2] / (2 * step[j])
        assert abs(numeric - slopes[:, j]).max() < 1e-6 * abs(slopes[:, j]).max()
    rows = np.array([3, 40, 7])
    np.testing.assert_allclose(answers.take(rows).basis(Q)[0], values[rows], rtol=1e-12)
    between = answers.at(first + rate * np.array([10.0, 18.0]))
    np.testing.assert_allclose(between.time, [10.0, 18.0])


def test_what_cannot_be_followed_is_refused():
    with pytest.raises(ValueError, match="5 times"):
        swept_answers(np.arange(4.0), np.arange(1.0, 5.0))
    with pytest.raises(ValueError, match="--acceleration 0"):
        swept_answers(np.linspace(0, 1e5, 10), np.linspace(10.0, 400.0, 10))


def solution(modes):
    return modes.fit.estimate.solution


@pytest.mark.parametrize(("rate", "first"), [(20.0, 8), (300.0, 25), (-100.0, 8)])
def test_exact_vectors_give_the_exact_modes(rate, first):
    """The first vectors are left out, so that how the motion began is forgotten."""
    rotor, sweep = drawn(rate=rate, noise=0.0)
    modes = fit_sweep(replace(sweep.take(np.arange(first, len(sweep.speeds))), covariances=None))
    np.testing.assert_allclose(solution(modes)[:2], rotor.omega, rtol=1e-6)
    np.testing.assert_allclose(solution(modes)[2:], rotor.zeta, rtol=3e-6)
    off = modes.steady.fit.estimate.solution[:2] / rotor.omega - 1
    assert (np.sign(off) == np.sign(rate)).all()
    run_out, _ = constant_vectors(modes)
    np.testing.assert_allclose(run_out, rotor.run_out, atol=1e-3 * abs(rotor.run_out).max())


def lacking(sweep):
    vectors, covariances = sweep.vectors.copy(), sweep.covariances.copy()
    vectors[::9, 0] = covariances[::9, 0] = np.nan
    return replace(sweep, vectors=vectors, covariances=covariances)


@pytest.mark.parametrize(
    ("changed", "same"), [(lambda s: replace(s, covariances=None), "size everywhere"), (lacking, None)]
)
def test_errors_that_are_not_stated_and_vectors_that_lack(changed, same):
    rotor, sweep = drawn()
    modes = fit_sweep(changed(sweep))
    truth = np.concatenate((rotor.omega, rotor.zeta))
    assert (abs(solution(modes) - truth) < 4 * modes.fit.estimate.std).all()
    assert modes.warnings == ()
    assert same is None or modes.same == same


def test_without_times_the_motion_counts_as_steady():
    _, sweep = drawn()
    modes = fit_sweep(replace(sweep, time=None))
    assert modes.steady is None
    np.testing.assert_allclose(solution(modes), solution(fit_sweep(sweep, steady=True)), rtol=1e-12)


def test_a_band_chooses_a_mode():
    rotor, sweep = drawn()
    modes = fit_sweep(sweep, bands=[(0.75 * rotor.omega[0], 1.3 * rotor.omega[0])])
    value, std = solution(modes)[0], modes.fit.estimate.std[0]
    assert abs(value - rotor.omega[0]) < 4 * std + 1e-3 * value


def without_resonance():
    rotor, sweep = drawn()
    return sweep.take(np.flatnonzero(sweep.speeds < 0.6 * rotor.omega[0]))


def noise_alone(stated):
    time = np.linspace(0, 30, 200)
    Z = 1e-6 * (5 + np.random.default_rng(3).standard_normal((200, 2, 2)) @ (1, 1j))
    covariances = np.broadcast_to(1e-12 * np.eye(2), (200, 2, 2, 2)) if stated else None
    return Readings("a", time, 30 + 10 * time, ("x", "y"), Z, covariances, Labels())


@pytest.mark.parametrize("sweep", [without_resonance(), noise_alone(True), noise_alone(False)])
def test_what_has_no_resonance_has_no_peak(sweep):
    with pytest.raises(ValueError, match="no peak stands"):
        fit_sweep(sweep)
