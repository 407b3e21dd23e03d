"""All methods on [F], starts far off, options."""

import numpy as np
import pytest
from timedomain_cases import (
    CHAIN_ERRORS,
    CHAIN_OPTIMUM,
    chain,
    chain_record,
    decay,
    decay_record,
)

from rotorid.base.choices import names
from rotorid.identify.fit_records import METHODS, fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record


@pytest.mark.parametrize("method", names(METHODS))
def test_three_masses_with_each_method(method):
    found = fit(chain(), chain_record(), method=method)
    assert found.converged
    assert found.values == pytest.approx(CHAIN_OPTIMUM, rel=1e-7)
    assert found.std == pytest.approx(CHAIN_ERRORS, rel=0.05)
    if method in ("gauss-newton", "quasilinearization"):
        assert found.iterations <= 6
    # the record is rounded to five digits, whatever the size of a value
    assert len(found.warnings) == 1
    assert "the outputs have different errors" in found.warnings[0]


@pytest.mark.parametrize("integrator", ["dop853", "lsoda"])
def test_three_masses_with_error_control(integrator):
    found = fit(chain(), chain_record(), integrator=integrator)
    assert found.integrator == integrator
    assert found.values == pytest.approx(CHAIN_OPTIMUM, rel=1e-7)


def test_the_best_of_several_starts_counts():
    t = np.linspace(0, 10, 101)
    model = ode_model({}, outputs={"y": "sin(w*t)"}, estimate={"w": 5.0}, bounds={"w": (0.5, 8.0)})
    record = Record(t, {"y": np.sin(2 * t)})
    one = fit(model, record)
    assert not one.reliable
    found = fit(model, record, starts=12)
    assert found.values == pytest.approx([2.0], abs=1e-8)
    assert found.warnings == ()


def test_another_minimum_that_is_as_good_is_said():
    """y = a² t does not tell the sign of a."""
    t = np.linspace(0.1, 3, 30)
    model = ode_model({}, outputs={"y": "a**2*t"}, estimate={"a": 1.0}, bounds={"a": (-5.0, 5.0)})
    noise = 0.01 * np.random.default_rng(0).standard_normal(30)
    found = fit(model, Record(t, {"y": 4 * t + noise}), starts=8)
    assert abs(found.values[0]) == pytest.approx(2.0, rel=0.01)
    other = f"another start ends at a = {-found.values[0]:.6g}, which describes the record nearly as well"
    assert found.warnings == (other,)


def test_robust_loss_resists_gross_errors():
    record = decay_record()
    x = record.outputs["x"].copy()
    x[[5, 17, 30]] += 3.0
    bad = Record(record.t, {"x": x})
    assert np.abs(fit(decay(), bad).values - [0.8, 2.0]).max() > 0.05
    assert np.abs(fit(decay(), bad, loss="huber").values - [0.8, 2.0]).max() < 0.02


def test_measured_input():
    model = ode_model({"x": "-a*x + b*u"}, initial={"x": 0.0}, inputs=["u"], estimate={"a": 1.0, "b": 1.0})
    t = np.linspace(0, 5, 51)
    record = Record(t, {"x": 1.5 / 4 * (2 * t - 1 + np.exp(-2 * t))}, {"u": t})
    for method in names(METHODS):
        assert fit(model, record, method=method).values == pytest.approx([2.0, 1.5], rel=1e-6)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "newton"}, "method 'newton' is not known"),
        ({"start": {"z": 1.0}}, "z is no parameter"),
        ({"starts": 0}, "at least 1"),
        ({"loss": "square"}, "loss 'square' is not known"),
    ],
)
def test_bad_options(options, words):
    with pytest.raises(ValueError, match=words):
        fit(decay(), decay_record(), **options)


def test_bad_records():
    t = np.arange(3.0)
    with pytest.raises(ValueError, match="no output of the model"):
        fit(decay(), Record(t, {"z": t}))
    with pytest.raises(ValueError, match="no samples"):
        fit(decay(), Record(t))
    with pytest.raises(ValueError, match="no samples"):
        fit(decay(), Record(t, {"x": np.full(3, np.nan)}))
    with pytest.raises(ValueError, match="at least one record"):
        fit(decay(), [])
    with pytest.raises(ValueError, match="for all measured outputs, or for none"):
        fit(decay(), [Record(t, {"x": t}), Record(t, {"x": t}, sigma={"x": 1.0})])
