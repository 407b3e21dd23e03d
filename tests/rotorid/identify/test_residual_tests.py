"""Residuals that are not noise, outputs of unequal precision, and what nonlinear models determine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

OSCILLATOR = {"x": "v", "v": "-w**2*x"}
AT_REST = {"x": 1.0, "v": 0.0}


def decays(seed, a_error=0.002, b_error=0.1):
    """Two outputs of very unequal precision, the second one seldom measured."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 201)
    x = np.exp(-0.8 * t) + a_error * rng.standard_normal(201)
    q = np.full(201, np.nan)
    q[::10] = np.exp(-0.4 * t[::10]) + b_error * rng.standard_normal(21)
    model = ode_model({"x": "-a*x", "q": "-b*q"}, initial={"x": 1.0, "q": 1.0}, estimate={"a": 0.5, "b": 0.5})
    return model, Record(t, {"x": x, "q": q})


def test_sinusoid_left_over_below_a_large_trend():
    t = 0.2 * np.arange(100)
    y = np.cos(7.85398 * t) + 5 * t + 0.02 * np.random.default_rng(0).standard_normal(100)
    model = ode_model(OSCILLATOR, initial=AT_REST, outputs={"y": "x + r*t"}, estimate={"w": 8.1, "r": 1.0})
    found = fit(model, Record(t, {"y": y}), starts=1)
    assert not found.reliable
    assert found.std is None
    assert "at one frequency" in found.summary()
    better = fit(model, Record(t, {"y": y}))
    assert better.reliable
    assert abs(better.values[0] - 7.85398) < 4 * better.std[0]


def test_outputs_of_unequal_precision_are_said_and_count_as_stated():
    model, record = decays(0)
    plain = fit(model, record)
    assert "the outputs have different errors" in " ".join(plain.warnings)
    stated = fit(model, replace(record, sigma={"x": 0.002, "q": 0.1}))
    assert stated.warnings == ()
    assert stated.std[0] < 0.2 * plain.std[0]


def test_output_in_a_small_unit_that_the_model_does_not_describe():
    t = np.linspace(0.0, 4.0, 41)
    rng = np.random.default_rng(1)
    record = Record(
        t,
        {"temp": 300 * np.exp(-0.8 * t) + 0.3 * rng.standard_normal(41), "disp": 1e-4 * np.sin(5 * t)},
    )
    model = ode_model(
        {"x": "-a*x", "q": "-b*q"},
        initial={"x": 1.0, "q": 1.0},
        outputs={"temp": "300*x", "disp": "1e-4*q"},
        estimate={"a": 0.5, "b": 0.5},
    )
    found = fit(model, record)
    assert not found.reliable
    assert "variance of disp" in " ".join(found.warnings)


def decay_record(seed=0):
    t = np.linspace(0.0, 4.0, 41)
    return Record(t, {"x": 2 * np.exp(-0.8 * t) + 0.02 * np.random.default_rng(seed).standard_normal(41)})


def test_product_is_what_the_record_determines():
    for start in ({"a": 0.5, "b": 1.0}, {"a": 0.1, "b": 3.0}):
        model = ode_model({"x": "-a*b*x"}, initial={"x": "x0"}, estimate={**start, "x0": 1.0})
        found = fit(model, decay_record())
        assert [c.words for c in found.estimate.combinations] == ["a·b"]
        product = found.estimate.combinations[0]
        assert product.value == pytest.approx(0.8, abs=4 * product.std)
        assert product.std < 0.01
        assert np.isnan(found.values[:2]).all()


def test_ratio_and_sum_are_what_the_record_determines():
    t = np.linspace(0.0, 8.0, 81)
    record = Record(t, {"x": np.cos(2 * t) + 0.01 * np.random.default_rng(2).standard_normal(81)})
    ratio = ode_model(
        {"x": "v", "v": "-k*x/m"}, initial=AT_REST, outputs={"x": "x"}, estimate={"m": 2.0, "k": 7.5}
    )
    found = fit(ratio, record)
    only = found.estimate.combinations[0]
    assert only.words == "k/m"
    assert only.value == pytest.approx(4.0, abs=4 * only.std)
    total = ode_model(
        {"x": "v", "v": "-(k + c)*x"}, initial=AT_REST, outputs={"x": "x"}, estimate={"k": 1.0, "c": 2.8}
    )
    only = fit(total, record).estimate.combinations[0]
    assert only.words == "c + k"
    assert only.value == pytest.approx(4.0, abs=4 * only.std)


def test_a_combination_is_named_as_the_equations_have_it():
    t, noise = np.linspace(0.0, 3.0, 31), 0.01 * np.random.default_rng(3).standard_normal(31)
    model = ode_model({}, outputs={"y": "(a**2 + b)*t"}, estimate={"a": 1.0, "b": 2.0})
    (only,) = fit(model, Record(t, {"y": 3 * t + noise})).estimate.combinations
    assert only.words == "a^2 + b"
    assert abs(only.value - 3.0) < 4 * only.std


@pytest.mark.parametrize(
    "start", [{"a": 0.2, "b": 0.6, "g": 1.0, "h": 2.0}, {"a": 0.5, "b": 0.1, "g": 3.0, "h": 0.3}]
)
def test_a_sum_and_a_product_whatever_the_start(start):
    t, u = np.linspace(0.0, 6.0, 61), np.sin(np.linspace(0.0, 6.0, 61))
    rate = {"x": "-(a + b)*x + g*h*u"}
    model = ode_model(rate, initial={"x": 0.0}, inputs=["u"], estimate=start)
    x = simulate(model, [0.3, 0.5, 2.0, 0.9], Record(t, inputs={"u": u}), sensitivities=False).x[:, 0]
    noise = 0.01 * np.random.default_rng(1).standard_normal(61)
    combinations = fit(model, Record(t, {"x": x + noise}, {"u": u})).estimate.combinations
    assert [c.words for c in combinations] == ["a + b", "g·h"]
    for combination, truth in zip(combinations, (0.8, 1.8), strict=True):
        assert abs(combination.value - truth) < 4 * combination.std


def test_what_a_hidden_state_leaves_is_a_product():
    """Of x' = a y, y' = b x - y with y unseen the scale of y is free: a b is determined."""
    t = np.linspace(0.0, 4.0, 41)
    model = ode_model(
        {"x": "a*y", "y": "-b*x - y"},
        initial={"x": 1.0, "y": 0.0},
        outputs={"x": "x"},
        estimate={"a": 1.0, "b": 3.0},
    )
    x = simulate(model, [2.0, 2.0], t, sensitivities=False).x[:, 0]
    noise = 0.01 * np.random.default_rng(1).standard_normal(41)
    (only,) = fit(model, Record(t, {"x": x + noise})).estimate.combinations
    assert only.words == "a·b"
    assert abs(only.value - 4.0) < 4 * only.std


@pytest.mark.parametrize(
    ("rate", "factor"), [("-a*b/(a + b)*x", 1), ("-(a + b**2)*x", 1), ("-(a*b + 0.1*a)*x", 10)]
)
def test_a_curve_of_values_is_one_combination(rate, factor):
    model = ode_model({"x": rate}, initial={"x": 2.0}, estimate={"a": 1.0, "b": 1.5})
    found = fit(model, decay_record())
    assert found.converged
    assert np.isnan(found.values).all()
    (only,) = found.estimate.combinations
    assert abs(only.value - 0.8 * factor) < 4 * only.std


def test_start_where_the_sensitivity_vanishes_is_left():
    t = 0.5 * np.arange(15)
    model = ode_model({}, outputs={"y": "A**2*t"}, estimate={"A": 0.0})
    data = Record(t, {"y": 4 * t + 0.01 * np.random.default_rng(0).standard_normal(15)})
    assert not fit(model, data, starts=1).reliable
    found = fit(model, data)
    assert abs(found.values[0]) == pytest.approx(2.0, abs=0.01)


def test_every_record_has_its_own_initial_state():
    rng = np.random.default_rng(4)
    records = [
        Record(t, {"x": x0 * np.exp(-0.8 * (t - t[0])) + 0.01 * rng.standard_normal(len(t))}, name=f"run {i}")
        for i, (t, x0) in enumerate([(np.linspace(0, 3, 31), 2.0), (np.linspace(1, 5, 21), 1.0)])
    ]
    model = ode_model({"x": "-a*x"}, initial={"x": "x0"}, estimate={"a": 0.5, "x0": 1.5}, per_record=["x0"])
    for method in ("levenberg-marquardt", "gauss-newton", "quasilinearization"):
        found = fit(model, records, method=method)
        assert found.parameters == ("a", "x0_1", "x0_2")
        assert found.converged
        np.testing.assert_array_less(np.abs(found.values - [0.8, 2.0, 1.0]), 4 * found.std)
    limits = np.array([[-np.inf, np.inf], [0.0, 1.9]])
    bounded = fit(replace(model, bounds=limits), records, start={"x0": 1.0})
    assert bounded.at_bounds == ("x0_1",)
    assert fit(model, records[0]).parameters == ("a", "x0")


def test_dead_sensor():
    model = ode_model({"x": "-a*x"}, initial={"x": "x0"}, estimate={"a": 0.5, "x0": 1.0})
    found = fit(model, Record(0.1 * np.arange(30), {"x": np.zeros(30)}))
    assert "zero throughout" in " ".join(found.warnings)


def following(rho, seed, n=200):
    """A charging curve with errors that follow each other, AR(1)."""
    t, rng = np.linspace(0.0, 6.0, n), np.random.default_rng(seed)
    error = rng.standard_normal(n)
    for i in range(1, n):
        error[i] = rho * error[i - 1] + np.sqrt(1 - rho**2) * error[i]
    return Record(t, {"x": 1.25 * (1 - np.exp(-0.8 * t)) + 0.01 * error})


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.7])
def test_intervals_hold_where_residuals_follow_each_other(rho):
    model = ode_model({"x": "-a*x + b"}, initial={"x": 0.0}, estimate={"a": 0.6, "b": 0.8})
    hits, reliable, count = np.zeros(2), 0, 60
    for seed in range(count):
        found = fit(model, following(rho, seed))
        low, high = found.ci95.T
        hits += (low < [0.8, 1.0]) & (high > [0.8, 1.0])
        reliable += found.reliable
    assert (hits >= 0.87 * count).all()  # three standard deviations less than 95 %
    assert reliable == count if rho == 0 else reliable <= 0.05 * count
