"""What residuals tell: hum by name, misfit, unequal precision, and what nonlinear models determine."""

import time

import numpy as np
import pytest
from repetitions import FULL
from timedomain_cases import decay, decay_record

from rotorid.files import read_ode_model
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import SimulationError, ode_model, with_nuisance
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

T = np.linspace(0.0, 4.0, 501)
TRUTH = np.array([100.0, 0.4])


def text(result):
    return " ".join(result.warnings)


def oscillator(position="1", speed="0", nuisance=(False, False, []), **start):
    outputs, factors = with_nuisance({"x": "x"}, *nuisance)
    return ode_model(
        {"x": "v", "v": "-k*x - c*v"},
        initial={"x": position, "v": speed},
        outputs=outputs,
        estimate={"k": 90.0, "c": 0.5} | start | dict.fromkeys(factors, 0.0),
    )


def record(seed, position="1", speed="0", extra=0.0, error=0.01, unit=1.0):
    x = simulate(oscillator(position, speed), TRUTH, T, sensitivities=False).y[:, 0]
    return Record(unit * T, {"x": x + error * np.random.default_rng(seed).standard_normal(len(T)) + extra})


def within(result):
    std = result.std
    return std is not None and bool((np.abs(result.values[:2] - TRUTH) < 5 * std[:2]).all())


HUM = np.sqrt(2 * 0.002 * 0.2) * np.sin(2 * np.pi * 50 * T + 1.0)
"""0.2 % of the variance."""


@pytest.mark.parametrize(
    ("changes", "free"),
    [
        ({"extra": HUM}, {"nuisance": (False, False, [50])}),
        ({"extra": 0.03}, {"nuisance": (True, False, [])}),
        ({"extra": 0.03 * T}, {"nuisance": (False, True, [])}),
        ({"extra": 0.02 + 0.03 * T + HUM}, {"nuisance": (True, True, [50.0])}),
        ({"speed": "0.5"}, {"speed": "v_0", "v_0": 1.0}),
        ({"position": "1.05"}, {"position": "x_0", "x_0": 1.0}),
    ],
)
def test_what_the_model_leaves_out_is_no_noise_until_it_is_estimated(changes, free):
    for seed in range(3):
        data = record(seed, **changes)
        result = fit(oscillator(), data)
        if free == {"nuisance": (False, False, [50])}:
            assert "[nuisance] hum_Hz = 50)" in text(result)
            assert result.std is None or within(result)
        else:
            assert not result.reliable
            assert "residuals are not random" in text(result) or "No intervals" in text(result)
        with_it = fit(oscillator(**free), data)
        assert within(with_it)
        assert with_it.warnings == ()


def test_noise_is_blamed_on_nothing():
    """White noise, and noise that follows itself: nothing is proposed; white noise keeps its intervals."""
    for seed in range(60 if FULL else 12):
        plain = fit(oscillator(), record(seed))
        assert within(plain)
        assert "residuals" not in text(plain)
        following = fit(oscillator(), record(seed, extra=0.01 * autoregressive(0.9, seed, len(T))))
        assert "hum" not in text(following)


def autoregressive(rho, seed, n):
    """Errors of unit variance that follow each other."""
    error = np.random.default_rng(seed).standard_normal(n)
    for i in range(1, n):
        error[i] = rho * error[i - 1] + np.sqrt(1 - rho**2) * error[i]
    return error


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.7])
def test_intervals_hold_where_residuals_follow_each_other(rho):
    model = ode_model({"x": "-a*x + b"}, initial={"x": 0.0}, estimate={"a": 0.6, "b": 0.8})
    t, hits, reliable, count = np.linspace(0.0, 6.0, 200), np.zeros(2), 0, 60
    for seed in range(count):
        x = 1.25 * (1 - np.exp(-0.8 * t)) + 0.01 * autoregressive(rho, seed, 200)
        result = fit(model, Record(t, {"x": x}))
        low, high = result.ci95.T
        hits += (low < [0.8, 1.0]) & (high > [0.8, 1.0])
        reliable += result.reliable
    assert (hits >= 0.87 * count).all()  # three standard deviations less than 95 %
    assert reliable == count if rho == 0 else reliable <= 0.05 * count
    if rho == 0.7:
        assert result.autocorrelation == pytest.approx(0.7, abs=0.2)
        assert "Durbin–Watson" in text(result)


def test_hum_beside_a_resonance_is_said_where_it_can_be_seen():
    """The parameters take most of it: the periodogram gives back what they took."""
    silent, model = 0, oscillator(position="x_0", x_0=0.8)

    def hum(seed, size):
        rng = np.random.default_rng(100 + seed)
        return size * np.sin(2 * np.pi * 1.5915 * rng.uniform(0.75, 1.35) * T + rng.uniform(0, 6))

    for seed in range(12):
        result = fit(model, record(seed, error=0.02, extra=hum(seed, 0.04)))
        silent += not result.warnings and result.ci95 is not None and not within(result)
        assert "hum" not in text(fit(model, record(seed, error=0.02)))
    assert silent <= 2
    assert "hum with" in text(fit(model, record(0, error=0.02, extra=hum(0, 0.12))))


def test_a_far_start_is_left_for_another_that_describes_the_record():
    far = oscillator(k=5000.0)
    assert not fit(far, record(0), starts=1).described
    result = fit(far, record(0))
    assert result.described
    assert within(result)
    assert any("from another of" in w and "--start" in w for w in result.warnings)
    assert fit(oscillator(), record(0)).warnings == ()


def test_a_start_where_the_sensitivity_vanishes_is_left():
    t = 0.5 * np.arange(15)
    model = ode_model({}, outputs={"y": "A**2*t"}, estimate={"A": 0.0})
    data = Record(t, {"y": 4 * t + 0.01 * np.random.default_rng(0).standard_normal(15)})
    assert not fit(model, data, starts=1).reliable
    assert abs(fit(model, data).values[0]) == pytest.approx(2.0, abs=0.01)


def test_times_in_ms_under_seconds_are_suspected():
    assert "in seconds, and not in ms?" in text(fit(oscillator(), record(0, unit=1000.0)))
    model = ode_model({"x": "v", "v": "-w**2*sin(x)"}, initial={"x": 1, "v": 0}, estimate={"w": 10.0})
    with pytest.raises(SimulationError, match="in seconds, and not in ms"):
        simulate(model, [1e5], np.linspace(0.0, 6000.0, 200), integrator="dop853")


def test_the_clock_ends_no_search(monkeypatch):
    """Evaluations are counted: a slow machine answers as a quick one."""
    once = fit(oscillator(), record(0)).values
    clock = iter(range(0, 10**9, 1000))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(clock)))
    np.testing.assert_array_equal(fit(oscillator(), record(0)).values, once)


def test_a_file_asks_for_nuisance_terms(tmp_path):
    words = (
        'per_record = []\n[states]\nx = "v"\nv = "-k*x - c*v"\n[initial]\nx = 1\nv = 0\n'
        '[outputs]\nx = "x"\n[estimate]\nk = 90\nc = 0.5\n[nuisance]\noffset = true\nhum_Hz = {hum}\n'
    )
    path = tmp_path / "model.toml"
    path.write_text(words.format(hum="[50, 16.7]"))
    model = read_ode_model(path)
    hums = [f"hum{f}_{wave}_x" for f in ("50", "16_7") for wave in ("cos", "sin")]
    assert model.parameters == ("k", "c", "offset_x", *hums)
    data = record(0, extra=HUM + 0.1)
    assert within(fit(model, [data, data]))
    path.write_text(words.format(hum="-50"))
    with pytest.raises(ValueError, match=r"nuisance\.hum_Hz"):
        read_ode_model(path)


def test_stated_errors_that_do_not_explain_the_residuals():
    result = fit(decay(), decay_record(n=401, error=0.015, sigma={"x": 0.01}))
    assert result.std is not None
    assert "intervals are too narrow" in text(result)
    worse = fit(decay(), decay_record(error=0.05, sigma={"x": 0.01}))
    assert worse.std is None
    assert "times as large as the stated errors explain" in text(worse)


def test_sinusoid_left_over_below_a_large_trend():
    t = 0.2 * np.arange(100)
    y = np.cos(7.85398 * t) + 5 * t + 0.02 * np.random.default_rng(0).standard_normal(100)
    rates, outputs = {"x": "v", "v": "-w**2*x"}, {"y": "x + r*t"}
    model = ode_model(rates, initial={"x": 1, "v": 0}, outputs=outputs, estimate={"w": 8.1, "r": 1.0})
    result = fit(model, Record(t, {"y": y}), starts=1)
    assert (result.reliable, result.std) == (False, None)
    assert "at one frequency" in result.summary()
    better = fit(model, Record(t, {"y": y}))
    assert better.reliable
    assert abs(better.values[0] - 7.85398) < 4 * better.std[0]


TWO = {"x": "-a*x", "q": "-b*q"}, {"x": 1.0, "q": 1.0}, {"a": 0.5, "b": 0.5}


def test_outputs_of_unequal_precision_are_said_and_count_as_stated():
    """The second one is seldom measured."""
    t, rng = np.linspace(0.0, 4.0, 201), np.random.default_rng(0)
    x, q = np.exp(-0.8 * t) + 0.002 * rng.standard_normal(201), np.full(201, np.nan)
    q[::10] = np.exp(-0.4 * t[::10]) + 0.1 * rng.standard_normal(21)
    model = ode_model(TWO[0], initial=TWO[1], estimate=TWO[2])
    plain = fit(model, Record(t, {"x": x, "q": q}))
    assert "the outputs have different errors" in text(plain)
    stated = fit(model, Record(t, {"x": x, "q": q}, sigma={"x": 0.002, "q": 0.1}))
    assert stated.warnings == ()
    assert stated.std[0] < 0.2 * plain.std[0]


def test_dead_sensor():
    result = fit(decay(), Record(0.1 * np.arange(30), {"x": np.zeros(30)}))
    assert "zero throughout" in text(result)


OSCILLATING = {"x": 1.0, "v": 0.0}
SINE = np.sin(np.linspace(0.0, 6.0, 61))


@pytest.mark.parametrize(
    ("rates", "initial", "output", "start", "truth", "words"),
    [
        ({"x": "v", "v": "-k*x/m"}, OSCILLATING, "x", {"m": 2.0, "k": 7.5}, {"m": 1.0, "k": 4.0},
         {"k/m": 4.0}),
        ({}, {}, "(a**2 + b)*t", {"a": 1.0, "b": 2.0}, {"a": 1.0, "b": 2.0}, {"a^2 + b": 3.0}),
        ({"x": "-(a + b)*x + g*h*u"}, {"x": 0.0}, "x", {"a": 0.2, "b": 0.6, "g": 1.0, "h": 2.0},
         {"a": 0.3, "b": 0.5, "g": 2.0, "h": 0.9}, {"a + b": 0.8, "g·h": 1.8}),
        # with y unseen its scale is free
        ({"x": "a*y", "y": "-b*x - y"}, {"x": 1.0, "y": 0.0}, "x", {"a": 1.0, "b": 3.0}, {"a": 2.0, "b": 2.0},
         {"a·b": 4.0}),
        ({"x": "-a*b/(a + b)*x"}, {"x": 2.0}, "x", {"a": 1.0, "b": 1.5}, {"a": 1.6, "b": 1.6}, {None: 0.8}),
        ({"x": "-(a*b + 0.1*a)*x"}, {"x": 2.0}, "x", {"a": 1.0, "b": 1.5}, {"a": 1.0, "b": 0.7}, {None: 8.0}),
    ],
    ids=["ratio", "as in the equation", "both", "hidden state", "in series", "a curve"],
)  # fmt: skip
def test_combinations_are_what_the_record_determines(rates, initial, output, start, truth, words):
    options = {"initial": initial, "outputs": {"y": output}, "inputs": ["u"]}
    t = np.linspace(0.0, 6.0, 61)
    exact = ode_model(rates, estimate=truth, **options)
    y = simulate(exact, exact.start, Record(t, inputs={"u": SINE}), sensitivities=False).y[:, 0]
    y = y + 0.01 * np.random.default_rng(1).standard_normal(61)
    result = fit(ode_model(rates, estimate=start, **options), Record(t, {"y": y}, {"u": SINE}))
    assert result.converged
    assert np.isnan(result.values).all()
    combinations = result.estimate.combinations
    assert len(combinations) == len(words)
    for one, (name, value) in zip(combinations, words.items(), strict=True):
        assert name in (None, one.words)
        assert abs(one.value - value) < 4 * one.std


def test_order_that_is_too_slight_for_words_widens_intervals(monkeypatch):
    data = record(0, extra=0.006 * autoregressive(0.6, 0, len(T)))
    wide = fit(oscillator(), data)
    monkeypatch.setattr("rotorid.identify.record_warnings.SUSPECT", 0)
    rho, plain = wide.autocorrelation, fit(oscillator(), data)
    assert wide.reliable
    assert (wide.std / plain.std)[0] ** 2 == pytest.approx((1 + rho) / (1 - rho))
