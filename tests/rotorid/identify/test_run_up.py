"""Modes of run-ups and run-downs: exact vectors, drawn ones, slow roll, vectors between, what is not told."""

from dataclasses import replace

import numpy as np
import pytest
from run_ups import drawn

from balancing import Labels
from rotorid.identify.modes import (
    constant_vectors,
    fit_sweep,
)
from rotorid.identify.modes_result import Readings


def found(modes):
    return modes.fit.estimate.solution


def truth(rotor):
    return np.concatenate((rotor.omega, rotor.zeta))


@pytest.mark.parametrize(("rate", "first"), [(20.0, 8), (300.0, 25), (-100.0, 8)])
def test_exact_vectors_give_the_exact_modes(rate, first):
    """The first vectors are left out, so that how the motion began is forgotten."""
    rotor, sweep = drawn(rate=rate, noise=0.0)
    late = sweep.take(np.arange(first, len(sweep.speeds)))
    modes = fit_sweep(replace(late, covariances=None))
    np.testing.assert_allclose(found(modes)[:2], rotor.omega, rtol=1e-6)
    np.testing.assert_allclose(found(modes)[2:], rotor.zeta, rtol=1e-6 if abs(rate) < 200 else 3e-6)
    off = modes.steady.fit.estimate.solution[:2] / rotor.omega - 1
    assert (np.sign(off) == np.sign(rate)).all()
    run_out, _ = constant_vectors(modes)
    np.testing.assert_allclose(run_out, rotor.run_out, atol=1e-3 * np.abs(rotor.run_out).max())


def test_without_stated_errors_the_residuals_tell_them():
    rotor, sweep = drawn()
    modes = fit_sweep(replace(sweep, covariances=None))
    assert modes.same == "size everywhere"
    assert (np.abs(found(modes) - truth(rotor)) < 4 * modes.fit.std).all()


def test_times_may_be_unknown():
    _, sweep = drawn()
    modes = fit_sweep(replace(sweep, time=None))
    assert modes.steady is None
    again = fit_sweep(sweep, steady=True)
    np.testing.assert_allclose(found(modes), found(again), rtol=1e-12)


def test_vectors_that_lack_are_left_out():
    rotor, sweep = drawn()
    vectors, covariances = sweep.vectors.copy(), sweep.covariances.copy()
    vectors[::9, 0] = np.nan
    covariances[::9, 0] = np.nan
    modes = fit_sweep(replace(sweep, vectors=vectors, covariances=covariances))
    assert (np.abs(found(modes) - truth(rotor)) < 4 * modes.fit.std).all()
    assert modes.warnings == ()


def test_a_band_chooses_a_mode():
    rotor, sweep = drawn()
    band = (0.75 * rotor.omega[0], 1.3 * rotor.omega[0])
    modes = fit_sweep(sweep, bands=[band])
    value, std = found(modes)[0], modes.fit.std[0]
    assert abs(value - rotor.omega[0]) < 4 * std + 1e-3 * value


def test_a_sweep_without_a_resonance_has_no_peak():
    rotor, sweep = drawn()
    slow = sweep.take(np.flatnonzero(sweep.speeds < 0.6 * rotor.omega[0]))
    with pytest.raises(ValueError, match="no peak stands"):
        fit_sweep(slow)


def test_noise_alone_is_no_mode():
    random = np.random.default_rng(3)
    time = np.linspace(0, 30, 200)
    for stated in (True, False):
        Z = 1e-6 * (5 + random.standard_normal((200, 2, 2)) @ (1, 1j))
        own = np.broadcast_to(1e-12 * np.eye(2), (200, 2, 2, 2)) if stated else None
        sweep = Readings("a", time, 30 + 10 * time, ("x", "y"), Z, own, Labels())
        with pytest.raises(ValueError, match="no peak stands"):
            fit_sweep(sweep)
