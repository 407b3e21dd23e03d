"""Tables with drawn errors: intervals of what is identified from them."""

import numpy as np
from repetitions import FULL

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.direct_problem import as_read, forced_vibration


def test_stated_errors_cover_the_truth():
    """95 % of the intervals of output error hold the truth; two parameters, a third shorter: 81 %."""
    tables = 200 if FULL else 100
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    errors, truth = AmplitudeErrors(0.02, np.deg2rad(1.0)), np.array([1000.0, 10.0])
    exact = forced_vibration(model, truth, [8.0, 9.5, 10.0, 11.0], {"F": 10.0})
    inside = []
    for seed in range(tables):
        data = as_read(exact, ["X"], errors, seed=seed)
        low, high = identify(model, data, start={"c": 1000.0, "b": 10.0}).ci95.T
        inside.append((low <= truth) & (truth <= high))
    shares = np.mean(inside, axis=0)
    assert np.all(np.abs(shares - 0.95) < 3 * np.sqrt(0.95 * 0.05 / tables)), shares
