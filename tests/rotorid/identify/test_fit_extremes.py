"""Numbers far outside, and models without states: every method answers, or says in words why not."""

import numpy as np
import pytest

from rotorid.base.choices import names
from rotorid.identify.fit_records import METHODS, fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record


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
