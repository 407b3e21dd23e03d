"""Gauss–Newton: how many steps it takes, and what it says at their end."""

import numpy as np
import pytest

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record


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


@pytest.mark.parametrize("tolerance", [0.3, 0.03, 1e-4, 1e-6])
def test_epsilon_ends_at_the_first_step_or_integral_below_it(tolerance):
    """[F] step 5: Δβ < ε, or I(β) < ε."""
    every, found = decaying(0.2), decaying(0.2, tolerance=tolerance)
    steps = np.abs(np.diff(every.history[:, 0]))
    first = next(k for k, step in enumerate(steps, 1) if step < tolerance or every.integrals[k] < tolerance)
    assert found.iterations == first
    assert found.stopped_by == ("step" if steps[first - 1] < tolerance else "cost")
    np.testing.assert_array_equal(found.history[:, 0], every.history[: first + 1, 0])
    assert f"is below {tolerance:g}" in found.message
    assert found.to_dict()["stopped_by"] == found.stopped_by


def test_the_integral_has_its_step():
    """I(β) of [F]: the sum of squares times Δt = 0.1, the exact first sample apart."""
    found = decaying(0.2)
    t, x = found.records[0].t, found.simulations[0].x[:, 0]
    r = x - found.records[0].outputs["x"]
    assert found.integrals[-1] == pytest.approx(0.1 * float(r[1:] @ r[1:]), rel=1e-12)
    assert len(found.integrals) == len(found.history) == found.iterations + 1
    assert len(t) == 41


def test_a_stop_far_from_the_minimum_is_no_estimate():
    coarse, fine = decaying(0.01, tolerance=0.45), decaying(0.01, tolerance=1e-5)
    assert (coarse.converged, coarse.std) == (False, None)
    assert "the next step still matters; lower --tolerance" in coarse.message
    assert coarse.summary().startswith("No estimates: the values are where the search stopped.")
    assert fine.converged
    assert abs(fine.values[0] - decaying(0.01).values[0]) < 0.1 * fine.std[0]


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, float("nan")])
def test_a_tolerance_is_a_part(tolerance):
    with pytest.raises(ValueError, match="the tolerance is a number above 0"):
        decaying(0.0, tolerance=tolerance)


def test_without_a_tolerance_the_step_ends_it():
    assert decaying(0.01).stopped_by == "step"
    assert straight_line(max_iterations=1).stopped_by is None
