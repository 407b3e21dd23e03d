"""The extra `rotorid[fast]`: it does what the ordinary way does, and its absence changes nothing."""

import numpy as np
import pytest
from repetitions import FULL

from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import SimulationError, simulate

pytest.importorskip("heyoka", reason="the extra rotorid[fast] (heyoka) is not installed")

PARTS = (
    "x", "v", "a", "b", "t", "u", "2.5", "-3", "(1/3)", "x**2", "v**3", "(3 + x)**-2", "sin(x)", "cos(t)",
    "tan(v/9)", "exp(-x)", "log(2 + x**2)", "sqrt(1 + v**2)", "tanh(v)", "sinh(a)", "cosh(b)", "asin(x/9)",
    "acos(v/9)", "atan(x)", "(1 + x**2)**b", "(1 + x**2)**(1/3)", "1/(2 + u)",
)  # fmt: skip
SIZES = (1e-6, 1.0, 1e4)


def drawn_rate(rng):
    words = [str(rng.choice(PARTS))]
    for _ in range(int(rng.integers(1, 5))):
        words += [str(rng.choice(["+", "-", "*"])), str(rng.choice(PARTS))]
    return " ".join(words)


def scaled(rate, size):
    """The rate with a state of another unit: x stands for size*x."""
    return f"{size!r}*({rate})".replace("x", "X").replace("eXp", "exp").replace("X", f"(x/{size!r})")


def model_of(rates, size=1.0, **options):
    estimate = {"a": 0.5, "b": 1.2, "c": -0.3}
    return ode_model(rates, initial={"x": 0.4 * size, "v": "c"}, estimate=estimate, **options)


@pytest.mark.full
def test_drawn_models_in_drawn_units_are_integrated_as_without_it():
    rng, compiled = np.random.default_rng(1), 0
    t = np.linspace(0.5, 1.5, 6)
    for _ in range(40 if FULL else 6):
        size = float(rng.choice(SIZES))
        inside = [drawn_rate(rng) for _ in "xv"]
        rates = {"x": scaled(inside[0], size), "v": scaled(inside[1], size) + f"/{size!r}"}
        record = Record(t, {}, {"u": np.sin(3 * t)})
        model = model_of(rates, size, inputs=["u"])
        try:
            slow = simulate(model, model.start, record, rtol=1e-12)
        except SimulationError:
            continue
        quick = simulate(model, model.start, record, integrator="taylor")
        compiled += quick.integrator == "taylor"
        for ours, theirs in ((quick.x, slow.x), (quick.S, slow.S)):
            limit = 1e-7 * np.abs(theirs).max(axis=0)
            assert (np.abs(ours - theirs).max(axis=0) <= limit).all(), rates
    assert compiled >= (20 if FULL else 3)


RATES = {"x": "v", "v": "-a*x - b*x**3 - 0.1*v"}


def test_fits_are_the_same_with_and_without(monkeypatch):
    t = np.linspace(0.0, 30.0, 301)
    truth = simulate(model_of(RATES), [1.0, 0.5, 0.2], t, sensitivities=False).x
    noise = 1e-3 * np.random.default_rng(0).standard_normal(truth.shape)
    record = Record(t, dict(zip(("x", "v"), (truth + noise).T, strict=True)))
    slow, quick = (fit(model_of(RATES), record, integrator=name) for name in ("dop853", "taylor"))
    assert (slow.integrator, quick.integrator) == ("dop853", "taylor")
    assert fit(model_of(RATES), record).integrator == "taylor"  # by itself, where that is quicker
    np.testing.assert_allclose(quick.values, slow.values, rtol=1e-8)
    np.testing.assert_allclose(quick.std, slow.std, rtol=1e-6)
    assert quick.warnings == slow.warnings
    monkeypatch.setitem(__import__("sys").modules, "heyoka", None)
    monkeypatch.setattr("rotorid.identify.adaptive_steps.find_spec", lambda name: None)
    without = fit(model_of(RATES), record)
    np.testing.assert_array_equal(without.values, slow.values)
    with pytest.raises(ValueError, match="needs heyoka: pip install heyoka"):
        fit(model_of(RATES), record, integrator="taylor")


@pytest.mark.parametrize("rate", ["-a*x - 0.1*v*abs(v)"])
def test_what_it_does_not_know_is_said(rate):
    with pytest.raises(ValueError, match="taylor cannot compile this model"):
        simulate(model_of({"x": "v", "v": rate}), [1.0, 0.5, 0.2], [0.0, 1.0], integrator="taylor")


def test_what_diverges_says_the_same():
    t = np.linspace(0.0, 0.9, 10)
    model = ode_model({"x": "a*x**2"}, initial={"x": 1.0}, estimate={"a": 1.0})
    for theta in (0.5, 0.6):
        run = simulate(model, [theta], t, integrator="taylor")
        np.testing.assert_allclose(run.x[:, 0], 1 / (1 - theta * t), rtol=1e-9)
        assert run.integrator == "taylor"
    with pytest.raises(SimulationError, match=r"diverges: at t = 0\.[89]"):
        simulate(model, [1.25], t, integrator="taylor")


def test_a_pulse_is_not_stepped_over():
    model = ode_model({"x": "a*exp(-((t - 5)/0.05)**2) - x"}, initial={"x": 0.0}, estimate={"a": 1.0})
    t = np.linspace(0.0, 10.0, 101)
    slow, quick = (simulate(model, [1.0], t, integrator=name) for name in ("auto", "taylor"))
    assert (slow.integrator, quick.integrator) == ("dop853", "taylor")
    np.testing.assert_allclose(quick.x, slow.x, atol=1e-9)


@pytest.mark.parametrize("integrator", ["auto", "taylor"])
def test_the_same_input_gives_the_same_bytes_however_often(integrator):
    """Also after other simulations and fits of the model."""
    t = np.linspace(0.0, 10.0, 101)
    model = model_of(RATES)
    first = simulate(model, [1.0, 0.5, 0.2], t, integrator=integrator)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(first.x.shape)
    record = Record(t, dict(zip(("x", "v"), (first.x + noise).T, strict=True)))
    fits = [fit(model, record, integrator=integrator) for _ in range(3)]
    assert len({one.values.tobytes() for one in fits}) == 1
    again = [simulate(model, [1.0, 0.5, 0.2], t, integrator=integrator) for _ in range(30)]
    assert {(one.integrator, one.S.tobytes()) for one in again} == {(first.integrator, first.S.tobytes())}
