"""Recovered parameters: their spread beside that of simulated readings."""

import numpy as np
from repetitions import FULL

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments


def test_recovered_parameters_have_the_spread_that_simulation_shows():
    """Task 6.1 with small errors of amplitude and phase: standard deviations of T1 and T2."""
    equation = "(T0*T1*T2*p**3 + (T0 + T1)*T2*p**2 + T2*p + K)*S = (T1*T2*p**2 + T2*p)*F"
    model = harmonic_model([equation], known={"T0": 1.0, "K": 10.0}, estimate=["T1", "T2"])
    w, load = np.array([1.0, 2.0]), {"F": np.ones(2, dtype=complex)}
    true = model.predict(np.array([0.5, 0.8]), w, load)["S"]
    errors = AmplitudeErrors(2e-3, 2e-3)
    rng = np.random.default_rng(4)
    found = []
    n = 400 if FULL else 200
    for _ in range(n):
        noise = rng.standard_normal((2, 2)) * 2e-3
        noisy = true * (1 + noise[0] + 1j * noise[1])
        found.append(identify(model, experiments(model, w, {**load, "S": noisy}, errors=errors)))
    scatter = np.std([f.values for f in found], axis=0, ddof=1)
    stated = np.mean([f.std for f in found], axis=0)
    # 9 % of 400 draws, whose deviation has a spread of 3.5 %
    np.testing.assert_allclose(stated, scatter, rtol=1.8 / np.sqrt(n))
