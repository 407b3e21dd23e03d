"""What a fit says about itself: never a wrong answer with a small interval."""

import numpy as np
import pytest
from repetitions import FULL
from timedomain_cases import (
    chain,
    chain_record,
    decay,
    decay_record,
    fitzhugh_nagumo,
    fitzhugh_nagumo_record,
)

from rotorid.base.choices import names
from rotorid.identify.fit_records import METHODS, fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record


def right_or_said(found, truth):
    """Whether the truth is within five standard deviations, or there are no intervals and words why."""
    if found.std is None:
        return not found.reliable and len(found.warnings) > 0
    return bool((np.abs(found.values - truth) < 5 * found.std).all())


@pytest.mark.parametrize("method", ["levenberg-marquardt", "gauss-newton"])
def test_three_masses_from_far_off(method):
    found = fit(chain(), chain_record(), method=method, start={"c1": 1.0, "m1": 1.0, "m2": 100.0})
    assert right_or_said(found, [0.14, 12.0, 28.0])


STARTS = [(1.0, 1.0, 1.0), (0.5, 0.5, 5.0), (0.0, 1.5, 0.5)]


@pytest.mark.full
@pytest.mark.parametrize("start", STARTS if FULL else STARTS[:1])
def test_fitzhugh_nagumo_from_far_off(start):
    found = fit(
        fitzhugh_nagumo(),
        fitzhugh_nagumo_record(),
        start=dict(zip("abc", start, strict=True)),
        max_iterations=20,
    )
    assert right_or_said(found, [0.2, 0.2, 3.0])


def test_stated_errors_that_do_not_explain_the_residuals():
    found = fit(decay(), decay_record(n=401, error=0.015, sigma={"x": 0.01}))
    assert found.std is not None
    assert any("intervals are too narrow" in text for text in found.warnings)
    worse = fit(decay(), decay_record(error=0.05, sigma={"x": 0.01}))
    assert worse.std is None
    assert any("times as large as the stated errors explain" in text for text in worse.warnings)


def test_parameter_at_its_bound():
    found = fit(decay(bounds={"a": (0.0, 0.7)}), decay_record())
    assert found.at_bounds == ("a",)
    assert found.values[0] == 0.7
    assert any("stands at its bound" in text for text in found.warnings)
    assert "at its bound" in found.summary()


@pytest.mark.parametrize("method", names(METHODS))
def test_only_a_combination_is_determined(method):
    model = ode_model({"x": "-(a + b)*x"}, initial={"x": 2.0}, estimate={"a": 0.3, "b": 0.3})
    found = fit(model, decay_record(), method=method)
    assert np.isnan(found.values).all()
    (known,) = found.estimate.combinations
    assert known.words == "a + b"
    assert known.value == pytest.approx(0.8, abs=0.02)
    assert any("a + b" in text for text in found.warnings)


def test_correlated_residuals():
    rng, noise = np.random.default_rng(2), [0.0]
    for e in 0.01 * rng.standard_normal(200):
        noise.append(0.8 * noise[-1] + e)
    t = np.linspace(0.0, 4.0, 201)
    found = fit(decay(), Record(t, {"x": 2 * np.exp(-0.8 * t) + np.array(noise)}))
    assert found.autocorrelation == pytest.approx(0.7, abs=0.1)
    assert any("Durbin–Watson" in text for text in found.warnings)
    white = fit(decay(), decay_record(n=201))
    assert white.warnings == ()


def test_gauss_newton_that_does_not_converge_gives_no_interval():
    t = np.linspace(-1.0, 1.0, 21)
    model = ode_model({}, outputs={"y": "atan(10*a)+0*t"}, estimate={"a": 1.0})
    found = fit(model, Record(t, {"y": np.zeros(21)}), method="gauss-newton", max_iterations=5)
    assert not found.converged
    assert found.std is None
    assert "no intervals are given" in found.warnings[0]
    # not for the reason that there are no more equations than parameters: there are
    assert found.estimate.dof == 20
    assert "no more equations" not in found.summary()


def test_as_many_readings_as_parameters_give_no_interval_and_say_why():
    model = ode_model({}, outputs={"y": "a+0*t"}, estimate={"a": 1.0})
    found = fit(model, Record(np.array([1.0]), {"y": np.array([2.0])}))
    assert found.values == pytest.approx([2.0])
    assert found.estimate.dof == 0
    assert found.std is None
    assert "no intervals: no errors are stated and there are no more equations" in found.summary()
