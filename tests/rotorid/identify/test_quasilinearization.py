"""Quasilinearization; the tables of [Q] are in tests/book."""

import numpy as np
import pytest
from timedomain_cases import book_model, book_record, decay, decay_record

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record


def test_truth_in_seven_iterations_with_error_control():
    found = fit(book_model(), book_record(), method="quasilinearization")
    assert found.converged
    assert found.iterations <= 7
    assert found.values == pytest.approx([1.0, -1.0, -1.0], abs=1e-8)
    assert found.warnings == ()


def test_unknown_initial_value_agrees_with_the_default_method():
    record = decay_record()
    one = fit(decay(), record, method="quasilinearization")
    other = fit(decay(), record)
    assert one.values == pytest.approx(other.values, rel=1e-7)
    assert one.std == pytest.approx(other.std, rel=1e-5)


def test_several_records_and_gaps():
    record = decay_record()
    x = record.outputs["x"].copy()
    x[3:9] = np.nan
    pair = [record, Record(record.t, {"x": x}, name="second")]
    one, other = (fit(decay(), pair, method=m) for m in ("quasilinearization", "gauss-newton"))
    assert len(one.estimate.residuals) == 2 * 41 - 6
    assert one.values == pytest.approx(other.values, rel=1e-7)


@pytest.mark.parametrize("integrator", ["heun", "sequential-heun"])
def test_uneven_times_are_the_steps_of_heun(integrator):
    """At the minimum the trajectory is the solution by the same scheme."""
    record = decay_record()
    uneven = Record(np.delete(record.t, [3, 4, 10]), {"x": np.delete(record.outputs["x"], [3, 4, 10])})
    found = fit(decay(), uneven, method="quasilinearization", integrator=integrator)
    np.testing.assert_allclose(found.trajectories[-1][0], found.simulations[0].x, rtol=1e-7)
    assert found.converged


def test_curve_without_states():
    t = np.linspace(0, 3, 30)
    model = ode_model({}, outputs={"y": "b*exp(-a*t)"}, estimate={"a": 0.7, "b": 1.5})
    record = Record(t, {"y": 2 * np.exp(-0.9 * t)})
    assert fit(model, record, method="quasilinearization").values == pytest.approx([0.9, 2.0], abs=1e-9)


def test_divergence_is_said():
    model = ode_model({"x": "a*x**2"}, initial={"x": 1.0}, estimate={"a": 5.0})
    record = Record(np.linspace(0, 1, 21), {"x": np.ones(21)})
    with pytest.raises(ValueError, match="diverge"):
        fit(model, record, method="quasilinearization")


def test_what_it_does_not_know():
    with pytest.raises(ValueError, match="no robust loss"):
        fit(decay(), decay_record(), method="quasilinearization", loss="huber")
    with pytest.raises(ValueError, match="heun"):
        fit(decay(), decay_record(), method="quasilinearization", integrator="rk4")


def test_a_tolerance_ends_it():
    """At the first step that moves no parameter by more."""
    every = fit(book_model(), book_record(), method="quasilinearization")
    found = fit(book_model(), book_record(), method="quasilinearization", tolerance=0.01)
    steps = np.abs(np.diff(every.history, axis=0)).max(axis=1)
    first = next(k for k, step in enumerate(steps, 1) if step < 0.01 or every.integrals[k] < 0.01)
    assert found.iterations == first < every.iterations
    assert found.stopped_by in ("step", "cost")
    assert every.stopped_by == "step"


def test_tables_of_the_iterations():
    """Parameters and I(beta) by iteration, and each state over time by iteration, as tables 2.2 and 2.3."""
    found = fit(book_model(), book_record(), method="quasilinearization", integrator="sequential-heun")
    iterations, x1, x2 = found.tables()
    assert iterations.headings == ["iteration", "theta1", "theta2", "theta3", "I(β)"]
    np.testing.assert_array_equal([row[1:4] for row in iterations.rows], found.history)
    assert (x1.name, x2.name) == ("x1 by iteration", "x2 by iteration")
    np.testing.assert_array_equal([row[2] for row in x2.rows], found.trajectories[1][0][:, 1])
    r = found.simulations[0].y - np.column_stack([*found.records[0].outputs.values()])
    assert found.integrals[-1] == pytest.approx(np.sum(r**2) * np.pi / 30, rel=1e-3)
