"""A wrong minimum, hum beside a resonance, times in the wrong unit: told first, or not answered wrongly."""

import time

import numpy as np
import pytest

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import SimulationError, ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

T = np.linspace(0.0, 6.0, 300)
TRUTH = np.array([100.0, 0.4, 1.0])


def oscillator(**start):
    return ode_model(
        {"x": "v", "v": "-k*x - d*v"},
        initial={"x": "x0", "v": 0.0},
        outputs={"x": "x"},
        estimate={"k": 90.0, "d": 0.3, "x0": 0.8} | start,
    )


def swinging(seed, extra=0.0, t=T):
    x = simulate(oscillator(), TRUTH, T, sensitivities=False).y[:, 0]
    return Record(t, {"x": x + 0.02 * np.random.default_rng(seed).standard_normal(len(T)) + extra})


def hum(seed, size):
    rng = np.random.default_rng(100 + seed)
    return size * np.sin(2 * np.pi * 1.5915 * rng.uniform(0.75, 1.35) * T + rng.uniform(0, 6))


def silent_and_wrong(found):
    held = found.ci95 is not None and ((found.ci95[:, 0] < TRUTH) & (found.ci95[:, 1] > TRUTH)).all()
    return found.ci95 is not None and not held and not found.warnings


def test_hum_beside_a_resonance_is_said_where_it_can_be_seen():
    """The parameters take most of it: the periodogram gives back what they took."""
    silent = sum(silent_and_wrong(fit(oscillator(), swinging(seed, hum(seed, 0.04)))) for seed in range(20))
    assert silent <= 2
    assert any("hum with" in w for w in fit(oscillator(), swinging(0, hum(0, 0.12))).warnings)
    quiet = [fit(oscillator(), swinging(seed)) for seed in range(20)]
    assert not any("hum" in w for found in quiet for w in found.warnings)


def test_a_far_start_is_left_for_another_that_describes_the_record():
    far = oscillator(k=5000.0)
    assert not fit(far, swinging(0), starts=1).described
    found = fit(far, swinging(0))
    assert found.described
    assert (np.abs(found.values - TRUTH) < 5 * found.std).all()
    assert any("from another of" in w and "--start" in w for w in found.warnings)
    assert fit(oscillator(), swinging(0)).warnings == ()


def test_a_misfit_is_told_before_what_is_determined():
    """Only a ratio is determined, and the place is a wrong one: that comes first."""
    model = ode_model(
        {"x": "v", "v": "-k*x/m - 0.4*v"},
        initial={"x": 1.0, "v": 0.0},
        outputs={"x": "x"},
        estimate={"k": 150.0, "m": 1.0},
    )
    found = fit(model, swinging(0), starts=1)
    assert found.summary().startswith("NO intervals: the model leaves")
    assert "determined" not in found.summary().splitlines()[0]
    assert found.std is None
    assert all(c.std is None for c in found.estimate.combinations)


def test_times_in_ms_under_seconds_are_suspected():
    found = fit(oscillator(), swinging(0, t=1000 * T))
    assert any("in seconds, and not in ms?" in w for w in found.warnings)
    model = ode_model({"x": "v", "v": "-w**2*sin(x)"}, initial={"x": 1, "v": 0}, estimate={"w": 10.0})
    with pytest.raises(SimulationError, match="in seconds, and not in ms"):
        simulate(model, [1e5], np.linspace(0.0, 6000.0, 200), integrator="dop853")


def test_the_clock_ends_no_search(monkeypatch):
    """Evaluations are counted: a slow machine answers as a quick one."""
    once = fit(oscillator(), swinging(0)).values
    clock = iter(range(0, 10**9, 1000))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(clock)))
    np.testing.assert_array_equal(fit(oscillator(), swinging(0)).values, once)
