"""The extra `rotorid[fast]`: machine code does what Python does, and its absence changes nothing."""

import math

import numpy as np
import pytest
from repetitions import FULL

from rotorid.timedomain.fit import fit
from rotorid.timedomain.integration import compiled_steps
from rotorid.timedomain.integration.simulate import SimulationError, simulate
from rotorid.timedomain.models.model import ode_model
from rotorid.timedomain.models.record import Record

pytest.importorskip("llvmlite", reason="the extra rotorid[fast] (llvmlite) is not installed")

PARTS = (
    "x", "v", "a", "b", "t", "u", "2.5", "-3", "(1/3)", "x**2", "v**3", "x**-2", "abs(v)", "sign(x)",
    "sin(x)", "cos(t)", "tan(v)", "exp(-x)", "log(2 + x**2)", "sqrt(1 + v**2)", "tanh(v)", "sinh(a)",
    "cosh(b)", "asin(x/9)", "acos(v/9)", "atan(x)", "(1 + x**2)**b", "(x**2)**(1/3)", "1/(2 + u)",
)  # fmt: skip


def drawn_rate(rng):
    words = [str(rng.choice(PARTS))]
    for _ in range(int(rng.integers(1, 6))):
        words += [str(rng.choice(["+", "-", "*"])), str(rng.choice(PARTS))]
    return " ".join(words)


def model_of(rates, **options):
    return ode_model(rates, initial={"x": 0.4, "v": "c"}, estimate={"a": 0.5, "b": 1.2, "c": -0.3}, **options)


def counted(model):
    """The model, as it is integrated from the second time on."""
    model.machine["runs"] = 1
    return model


def without(monkeypatch):
    def missing(source):
        raise ImportError

    monkeypatch.setattr(compiled_steps, "Machine", missing)


def test_drawn_models_are_integrated_as_without_it(monkeypatch):
    rng, compiled = np.random.default_rng(1), 0
    t = np.linspace(0.0, 1.0, 6)
    for _ in range(60 if FULL else 8):
        rates = {"x": drawn_rate(rng), "v": drawn_rate(rng)}
        record = Record(t, {}, {"u": np.sin(3 * t)})
        quick = counted(model_of(rates, inputs=["u"]))
        try:
            slow = simulate(model_of(rates, inputs=["u"]), quick.start, record, method="dop853", rtol=1e-12)
        except SimulationError:
            continue
        found = simulate(quick, quick.start, record, method="dop853", rtol=1e-11)
        compiled += quick.machine.get("run") is not None
        rough = any(word in " ".join(rates.values()) for word in ("abs", "sign", "(1/3)"))
        for ours, theirs in ((found.x, slow.x), (found.S, slow.S)):
            tolerance = (1e-5 if rough else 1e-8) * max(1.0, np.abs(theirs).max())
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance, err_msg=str(rates))
    assert compiled > 3


def test_the_translated_rates_are_those_of_python():
    rng = np.random.default_rng(2)
    for _ in range(10):
        model = model_of({"x": drawn_rate(rng), "v": drawn_rate(rng)}, inputs=["u"])
        space = {name: getattr(math, name) for name in dir(math) if name[0] != "_"}
        space |= {"Array": None, "RealAbs": abs, "RealSign": np.sign}
        exec(model.source(), space)
        z, out = rng.standard_normal(8), np.zeros(8)
        q = np.append(model.start, 0.7)
        space["rates"](0.3, z, q, out)
        np.testing.assert_allclose(out, model.augmented(0.3, z, model.start, np.array([0.7])), rtol=1e-13)


def test_a_fit_is_the_same_with_and_without(monkeypatch):
    model_data = {"x": "v", "v": "-a*x - b*x**3 - 0.1*v"}
    t = np.linspace(0.0, 10.0, 101)
    truth = simulate(model_of(model_data), [1.0, 0.5, 0.2], t, sensitivities=False).x
    noise = 1e-3 * np.random.default_rng(0).standard_normal(truth.shape)
    record = Record(t, dict(zip(("x", "v"), (truth + noise).T, strict=True)))
    model = model_of(model_data)
    quick = fit(model, record)
    assert model.machine["run"] is not None
    without(monkeypatch)
    other = model_of(model_data)
    slow = fit(other, record)
    assert other.machine.get("run") is None
    np.testing.assert_allclose(quick.values, slow.values, rtol=1e-8)
    np.testing.assert_allclose(quick.std, slow.std, rtol=1e-6)
    assert quick.warnings == slow.warnings


@pytest.mark.parametrize("rate", ["x**2", "exp(x)", "a*x*1e3"])
def test_what_diverges_says_the_same(rate, monkeypatch):
    t = np.linspace(0.0, 5.0, 11)
    words = []
    for quick in (True, False):
        if not quick:
            without(monkeypatch)
        model = counted(ode_model({"x": rate}, initial={"x": 1.0}, estimate={"a": 1.0}))
        with pytest.raises(SimulationError) as error:
            simulate(model, [1.0], t, method="dop853")
        words.append(str(error.value))
    assert words[0] == words[1]
