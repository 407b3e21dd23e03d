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
