"""The extra `rotorid[fast]`: it does what the ordinary way does, and its absence changes nothing."""

import numpy as np
import pytest
from repetitions import FULL

from rotorid.timedomain.fit import fit
from rotorid.timedomain.integration import taylor
from rotorid.timedomain.integration.simulate import SimulationError, simulate
from rotorid.timedomain.models.ode_model import ode_model
from rotorid.timedomain.models.record import Record

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
def test_drawn_models_in_drawn_units_are_integrated_as_without_it(monkeypatch):
    monkeypatch.setattr(taylor, "WORK", 1)
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
        with taylor.learning([model]):
            for _ in range(2):
                found = simulate(model, 1.0 * model.start, record)
        compiled += found.method == "taylor"
        for ours, theirs in ((found.x, slow.x), (found.S, slow.S)):
            limit = 1e-7 * np.abs(theirs).max(axis=0)
            assert (np.abs(ours - theirs).max(axis=0) <= limit).all(), rates
    assert compiled >= (20 if FULL else 3)


@pytest.mark.parametrize("rate", ["-a*x - b*x**3 - 0.1*v", "-a*x - b*x**3 - 0.1*v*abs(v)"])
def test_fits_are_the_same_with_and_without(rate, monkeypatch):
    rates, t = {"x": "v", "v": rate}, np.linspace(0.0, 10.0, 101)
    truth = simulate(model_of(rates), [1.0, 0.5, 0.2], t, sensitivities=False).x
    noise = 1e-3 * np.random.default_rng(0).standard_normal(truth.shape)
    record = Record(t, dict(zip(("x", "v"), (truth + noise).T, strict=True)))
    slow = fit(model_of(rates), record)
    assert slow.integrator == "dop853"  # a first fit compiles nothing
    monkeypatch.setattr(taylor, "WORK", 100)
    quick = fit(model_of(rates), record)
    assert quick.integrator == ("dop853" if "abs" in rate else "taylor")
    np.testing.assert_allclose(quick.values, slow.values, rtol=1e-8)
    np.testing.assert_allclose(quick.std, slow.std, rtol=1e-6)
    assert quick.warnings == slow.warnings
    with monkeypatch.context() as patch:
        patch.setitem(__import__("sys").modules, "heyoka", None)
        without = fit(model_of(rates), record)
    np.testing.assert_array_equal(without.values, slow.values)


def test_what_diverges_says_the_same(monkeypatch):
    monkeypatch.setattr(taylor, "WORK", 1)
    t = np.linspace(0.0, 0.9, 10)
    model = ode_model({"x": "a*x**2"}, initial={"x": 1.0}, estimate={"a": 1.0})
    with taylor.learning([model]):
        for theta in (0.5, 0.6):
            found = simulate(model, [theta], t)
            np.testing.assert_allclose(found.x[:, 0], 1 / (1 - theta * t), rtol=1e-9)
        assert found.method == "taylor"
        with pytest.raises(SimulationError, match=r"diverges: at t = 0\.8"):
            simulate(model, [1.25], t)


def test_a_pulse_is_not_stepped_over(monkeypatch):
    monkeypatch.setattr(taylor, "WORK", 1)
    model = ode_model({"x": "a*exp(-((t - 5)/0.05)**2) - x"}, initial={"x": 0.0}, estimate={"a": 1.0})
    t = np.linspace(0.0, 10.0, 101)
    slow = simulate(model, [1.0], t)
    with taylor.learning([model]):
        for _ in range(2):
            found = simulate(model, [1.0], t)
    assert (slow.method, found.method) == ("dop853", "taylor")
    np.testing.assert_allclose(found.x, slow.x, atol=1e-9)


def test_a_simulation_gives_the_same_bytes_however_often(monkeypatch):
    """Also after fits that have compiled the model."""
    monkeypatch.setattr(taylor, "WORK", 100)
    t = np.linspace(0.0, 10.0, 101)
    model = model_of({"x": "v", "v": "-a*x - b*x**3 - 0.1*v"})
    first = simulate(model, [1.0, 0.5, 0.2], t)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(first.x.shape)
    record = Record(t, dict(zip(("x", "v"), (first.x + noise).T, strict=True)))
    assert fit(model, record).integrator == "taylor"
    again = [simulate(model, [1.0, 0.5, 0.2], t) for _ in range(4)]
    assert {(one.method, one.S.tobytes()) for one in again} == {(first.method, first.S.tobytes())}
