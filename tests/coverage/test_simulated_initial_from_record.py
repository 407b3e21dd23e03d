"""Intervals of fits that begin at a record: drawn records."""

import numpy as np
import pytest
from repetitions import FULL

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

TIMES, NOISE = np.linspace(0.0, 3.0, 16), 0.05
TRUTH = np.array([4.0, 0.4, 1.0, 0.5])
"""k, d, and the first x and v."""


def oscillator(x, v):
    given = {"outputs": {"x": "x", "v": "v"}, "estimate": {"k": 3.5, "d": 0.3}}
    return ode_model({"x": "v", "v": "-k*x - d*v"}, initial={"x": x, "v": v}, **given)


@pytest.mark.parametrize("sigma", [NOISE, None])
def test_intervals_hold_with_the_error_of_the_start(sigma):
    """Errors are as large as stated; with the first sample taken for the state, as in [F], far fewer hold."""
    n, inside, squares, naive = 400 if FULL else 200, [], [], []
    exact = simulate(oscillator(1.0, 0.5), TRUTH[:2], TIMES, sensitivities=False).y
    for seed in range(n):
        y = exact + NOISE * np.random.default_rng(seed).standard_normal(exact.shape)
        columns = dict(zip("xv", y.T, strict=True))
        record = Record(TIMES, columns, sigma=sigma and dict.fromkeys("xv", sigma))
        fitted = fit(oscillator("record", "record"), record)
        assert fitted.reliable
        low, high = fitted.ci95.T
        inside.append((low <= TRUTH) & (high >= TRUTH))
        squares.append(((fitted.values - TRUTH) / fitted.std) ** 2)
        if seed < n / 4 and (ends := fit(oscillator(*map(float, y[0])), record).estimate.ci95) is not None:
            naive.append((ends[:, 0] <= TRUTH[:2]) & (TRUTH[:2] <= ends[:, 1]))
    # four standard deviations of a share of n, and of a mean of n squares
    assert np.mean(inside, axis=0) == pytest.approx(np.full(4, 0.95), abs=4 * np.sqrt(0.95 * 0.05 / n))
    assert np.mean(squares, axis=0) == pytest.approx(np.ones(4), abs=4 * np.sqrt(2 / n) * 1.1)
    assert len(naive) > n / 8
    assert (np.mean(naive, axis=0) < 0.8).all()
