"""Numbers far outside, and models without states: every method answers, or says in words why not."""

import numpy as np
import pytest
from repetitions import FULL

from rotorid.base.registry import names
from rotorid.timedomain.fit import fit
from rotorid.timedomain.methods.fit_methods import METHODS
from rotorid.timedomain.models.ode_model import ode_model
from rotorid.timedomain.models.record import Record

RATES = ("-a*x", "a*x", "exp(a*x) - b", "-a*x**3 + b", "b/(x - a)", "a*sinh(b*x)", "-x**a", "log(x)*a + t*b")
SIZES = (0.0, 0.5, 1.0, 1.5, -3.0, 2.0, 40.0, 1e5, 1e-12, 1e-300, 1e150, 1e300)


def drawn(seed):
    """A model of one state and a record, with numbers of any size."""
    rng = np.random.default_rng(seed)

    def number():
        return float(rng.choice(SIZES))

    initial = {"x": "b" if rng.random() < 0.3 else number()}
    model = ode_model(
        {"x": str(rng.choice(RATES))},
        initial=initial,
        outputs={"y": str(rng.choice(["x", "x", "1e300*x", "exp(x)", "x*b"]))},
        estimate={"a": number(), "b": number()},
    )
    t = np.cumsum(rng.uniform(0.5, 1.5, 8)) * rng.choice([1e-6, 1.0, 1.0, 1e6])
    y = rng.standard_normal(8) * rng.choice([1e-200, 1.0, 1.0, 1e100, 1e200])
    sigma = {"y": float(rng.choice([1e-3, 0.1, 1e-200, 1e200]))} if rng.random() < 0.3 else None
    return model, Record(t, {"y": y}, sigma=sigma)


@pytest.mark.full
@pytest.mark.parametrize("method", names(METHODS))
def test_numbers_of_any_size_are_answered_or_refused_in_words(method):
    answered, refused = 0, []
    for seed in range(400 if FULL else 16):
        model, record = drawn(seed)
        try:
            found = fit(model, record, method=method, max_iterations=20, max_seconds=5.0)
        except np.linalg.LinAlgError as error:  # a ValueError, but no words
            raise AssertionError(f"seed {seed}") from error
        except ValueError as error:
            refused.append(str(error))
            continue
        answered += 1
        found.summary()
        found.to_dict()
        assert found.converged or found.std is None, f"seed {seed}"
    assert answered > 3
    assert all(len(words) > 20 and "array" not in words for words in refused)


@pytest.mark.parametrize("method", names(METHODS))
@pytest.mark.parametrize("integrator", ["auto", "expm", "lsoda", "rk4"])
def test_a_curve_without_states_is_fitted_by_every_method(method, integrator):
    model = ode_model({}, outputs={"y": "a*exp(-b*t) + c"}, estimate={"a": 1.5, "b": 0.5, "c": 0.0})
    t = np.linspace(0.0, 5.0, 21)
    y = 2.0 * np.exp(-0.8 * t) + 0.3 + 1e-3 * np.cos(9.0 * t)
    if (method, integrator) == ("quasilinearization", "rk4"):
        with pytest.raises(ValueError, match="quasilinearization integrates"):
            fit(model, Record(t, {"y": y}), method=method, integrator=integrator)
        return
    found = fit(model, Record(t, {"y": y}), method=method, integrator=integrator)
    np.testing.assert_allclose(found.values, [2.0, 0.8, 0.3], rtol=0.02)
    assert found.converged
