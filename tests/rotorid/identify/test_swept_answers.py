"""Answers of modes while the speed changes: by DOP853, by the closed form, for a held speed; their slopes."""

import numpy as np
import pytest
from run_ups import example
from scipy.integrate import solve_ivp

from rotorid.identify.answers import SteadyAnswers, swept_answers

OMEGA, ZETA = np.array([100.0, 150.0]), np.array([0.02, 0.03])
Q = np.concatenate((OMEGA, ZETA))
SWEEPS = [(30.0, 5.0), (230.0, -8.0)]


def integrated(angle, speed, rate, time, rtol=1e-11):
    """Vectors (n, 2), from steady motion as far as the first order of the rate, by DOP853."""

    def slope(t, y):
        force = (speed(t) ** 2 - 1j * rate(t)) * np.exp(1j * angle(t))
        return np.concatenate((y[2:], OMEGA**2 * (force - y[:2]) - 2 * ZETA * OMEGA * y[2:]))

    w, a = speed(0.0), rate(0.0)
    s = OMEGA * (-ZETA + 1j * np.sqrt(1 - ZETA**2))
    f = w**2 - 1j * a
    z1, z2 = (f / p - 2 * w * a / p**2 + f * 1j * a / p**3 for p in (1j * w - s, 1j * w - s.conj()))
    root = s - s.conj()
    z0, v0 = (z1 - z2) / root, (s * z1 - s.conj() * z2) / root
    start = np.concatenate((OMEGA**2 * z0, OMEGA**2 * v0))
    found = solve_ivp(slope, (0, time[-1]), start, method="DOP853", rtol=rtol, atol=100 * rtol, t_eval=time)
    return found.y[:2].T * np.exp(-1j * angle(time))[:, None]


def off(found, exact):
    return np.abs(found - exact).max(axis=0) / np.abs(exact).max(axis=0)


@pytest.mark.full
def test_an_acceleration_that_changes():
    """A coast-down, Ω = 250 e^{−t/20}: read often enough the spline is it."""
    time = np.linspace(0, 30, 2000)
    speed = 250 * np.exp(-time / 20)
    exact = integrated(
        lambda t: 5000 * (1 - np.exp(-t / 20)),
        lambda t: 250 * np.exp(-t / 20),
        lambda t: -12.5 * np.exp(-t / 20),
        time,
        rtol=1e-8,
    )
    assert off(swept_answers(time, speed).basis(Q)[0][:, :2], exact).max() < 1e-4


@pytest.mark.parametrize(("first", "rate"), SWEEPS)
def test_the_closed_form_is_the_same(first, rate):
    """But for how it begins, which is forgotten."""
    time = np.linspace(0, 24, 300)
    modes = zip(OMEGA, ZETA, strict=True)
    exact = np.transpose([w**2 * example.swept(w, z, first, rate, time) for w, z in modes])
    found = swept_answers(time, first + rate * time).basis(Q)[0][:, :2]
    late = time > 12
    assert off(found[late], exact[late]).max() < 1e-5


def test_a_sweep_that_hardly_changes_is_steady():
    """The difference falls with the rate."""
    speed, left = np.linspace(95, 105, 50), []
    for rate in (0.2, 0.02):
        found = swept_answers((speed - 95) / rate, speed).basis(Q)[0]
        left.append(off(found, SteadyAnswers(speed, speed**2 + 0j).basis(Q)[0])[0])
    assert left[1] == pytest.approx(left[0] / 10, rel=0.1)
    held = np.full(20, 95.0)
    found, slopes = swept_answers(np.linspace(0, 20, 20), held).basis(Q)
    steady, flat = SteadyAnswers(held, held**2 + 0j).basis(Q)
    np.testing.assert_allclose(found, steady, rtol=1e-9)
    np.testing.assert_allclose(slopes, flat, rtol=1e-7, atol=1e-7 * np.abs(flat).max())


@pytest.mark.parametrize(("first", "rate"), SWEEPS)
def test_slopes_are_those_of_the_answers(first, rate):
    time = np.linspace(0, 24, 60)
    answers = swept_answers(time, first + rate * time)
    slopes = answers.basis(Q)[1]
    for j in range(4):
        step = 1e-5 * Q[j] * np.eye(4)[j]
        by_difference = (answers.basis(Q + step)[0] - answers.basis(Q - step)[0])[:, j % 2] / (2 * step[j])
        assert np.abs(by_difference - slopes[:, j]).max() < 1e-6 * np.abs(slopes[:, j]).max()


def test_some_rows_and_other_speeds():
    time = np.linspace(0, 24, 60)
    answers = swept_answers(time, 30 + 5 * time)
    rows = np.array([3, 40, 7])
    np.testing.assert_allclose(answers.take(rows).basis(Q)[0], answers.basis(Q)[0][rows], rtol=1e-12)
    between = answers.at(np.array([80.0, 120.0]))
    np.testing.assert_allclose(between.time, [10.0, 18.0])


def test_what_cannot_be_followed_is_refused():
    with pytest.raises(ValueError, match="5 times"):
        swept_answers(np.arange(4.0), np.arange(1.0, 5.0))
    with pytest.raises(ValueError, match="--acceleration 0"):
        swept_answers(np.linspace(0, 1e5, 10), np.linspace(10.0, 400.0, 10))
