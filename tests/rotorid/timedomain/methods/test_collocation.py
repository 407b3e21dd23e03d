"""Linear equations by collocation, against closed forms."""

import numpy as np
import pytest
from scipy.linalg import expm

from rotorid.timedomain.integration.simulate import SimulationError
from rotorid.timedomain.methods.collocation import solve_linear


@pytest.mark.parametrize("varying", [False, True])
@pytest.mark.parametrize("scale", [0.3, 30.0])
def test_drawn_systems_agree_with_the_exponential(scale, varying):
    rng = np.random.default_rng(3)
    for n in (1, 3, 5):
        A = scale * (rng.standard_normal((n, n)) - np.eye(n))
        B, first = rng.standard_normal((n, 2)), rng.standard_normal((n, 2))
        t = np.cumsum(rng.uniform(0.02, 0.2, 9))

        def equations(at, A=A, B=B):
            slow = 1 + 0.5 * np.sin(at) if varying else np.ones_like(at)
            return slow[..., None, None] * A if varying else A, slow[..., None, None] * B

        found, curve = solve_linear(equations, t, first)
        inner = np.linspace(t[0], t[-1], 23)
        for times, values in ((t, found), (inner, curve(inner)), (t, curve(t))):
            # time runs as the integral of the factor
            clock = times - t[0] + (0.5 * (np.cos(t[0]) - np.cos(times)) if varying else 0.0)
            whole = np.block([[A, B], [np.zeros((2, n + 2))]])
            exact = np.stack([(expm(s * whole) @ np.vstack([first, np.eye(2)]))[:n] for s in clock])
            np.testing.assert_allclose(values, exact, atol=3e-8 * np.abs(exact).max())


def test_what_varies_too_fast_or_grows_beyond_bounds_is_said():
    first, t = np.ones((1, 1)), np.linspace(0.0, 1.0, 3)
    with pytest.raises(SimulationError, match="too fast"):
        solve_linear(lambda at: (np.zeros((1, 1)), np.cos(1e7 * at)[..., None, None]), t, first)
    with pytest.raises(SimulationError, match="no finite solution"):
        solve_linear(lambda at: (np.eye(1), np.zeros((*at.shape, 1, 1))), np.arange(1000.0), first)
