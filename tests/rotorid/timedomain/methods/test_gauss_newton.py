"""Gauss–Newton: how many steps it takes, and what it says at their end."""

import numpy as np
import pytest

from rotorid.timedomain.fit import fit
from rotorid.timedomain.models.ode_model import ode_model
from rotorid.timedomain.models.record import Record


def straight_line(**options):
    """y = a + b t, exact: the first step is the solution, the second is nothing."""
    t = np.linspace(0.0, 1.0, 5)
    model = ode_model({}, outputs={"y": "a + b*t"}, estimate={"a": 1.0, "b": 1.0})
    return fit(model, Record(t, {"y": 2 - 3 * t}), method="gauss-newton", **options)


def test_a_linear_model_takes_one_step_and_one_that_is_nothing():
    found = straight_line()
    assert found.values == pytest.approx([2.0, -3.0], rel=1e-12)
    assert (found.converged, found.iterations) == (True, 2)
    assert found.message == "converged in 2 iterations"
    np.testing.assert_allclose(found.history, [[1.0, 1.0], [2.0, -3.0], [2.0, -3.0]], rtol=1e-12)


def test_too_few_iterations_are_said():
    found = straight_line(max_iterations=1)
    assert (found.converged, found.iterations) == (False, 1)
    assert found.message == "not converged in 1 iteration"


def decaying(noise, **options):
    """x = e^−t, with normal errors of this size; the start is a = 0.5."""
    t = np.linspace(0.0, 4.0, 41)
    y = np.exp(-t) + noise * np.random.default_rng(3).standard_normal(len(t))
    model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 0.5})
    return fit(model, Record(t, {"x": y}), method="gauss-newton", integrator="rk4", **options)


@pytest.mark.parametrize("tolerance", [0.3, 0.03, 1e-3, 1e-6])
def test_a_tolerance_of_the_step_ends_at_the_first_step_below_it(tolerance):
    """Of an exact record: [F] step 5, Δβ < ε, relative to β."""
    every, found = decaying(0.0).history[:, 0], decaying(0.0, tolerance=tolerance)
    steps = np.abs(np.diff(every) / every[1:])
    first = int(np.flatnonzero(steps < tolerance)[0]) + 1
    assert (found.iterations, found.stopped_by) == (first, "step")
    np.testing.assert_array_equal(found.history[:, 0], every[: first + 1])
    assert f"|Δβ| is below {tolerance:g} |β|" in found.message
    assert found.to_dict()["stopped_by"] == "step"


def test_a_tolerance_of_the_sum_of_squares_ends_where_noise_is_left():
    """[F] step 5, I(β) < ε, as a change relative to I(β): the step is still longer."""
    every, found = decaying(0.2), decaying(0.2, tolerance=1e-2)
    change = np.abs(np.diff(every.costs)) / every.costs[1:]
    first = int(np.flatnonzero(change < 1e-2)[0]) + 1
    assert (found.iterations, found.stopped_by) == (first, "cost")
    assert abs(found.history[-1, 0] / found.history[-2, 0] - 1) > 1e-2
    assert "I(β) changes by less than 0.01 of it" in found.message


def test_a_stop_far_from_the_minimum_is_no_estimate():
    coarse, fine = decaying(0.01, tolerance=0.5), decaying(0.01, tolerance=1e-5)
    assert (coarse.converged, coarse.std) == (False, None)
    assert "the next step still matters; lower --tolerance" in coarse.message
    assert coarse.summary().startswith("No estimates: the values are where the search stopped.")
    assert fine.converged
    assert abs(fine.values[0] - decaying(0.01).values[0]) < 0.1 * fine.std[0]


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, 1.0, float("nan")])
def test_a_tolerance_is_a_part(tolerance):
    with pytest.raises(ValueError, match="the tolerance is a number between 0 and 1"):
        decaying(0.0, tolerance=tolerance)


def test_without_a_tolerance_the_step_ends_it():
    assert decaying(0.01).stopped_by == "step"
    assert straight_line(max_iterations=1).stopped_by is None
