"""Trial runs that would tell most, against all subsets and derivatives of the dense rotor."""

import itertools

import numpy as np
import pytest
from helpers.calibration.jobs import Runs, machine

from balancing import ReadingErrors, RunScatter
from fem.parameters import parameter_value, with_parameters
from rotorid.calibration import Unknown
from rotorid.workflows.calibration.calibration_design import design

UNKNOWNS = [
    Unknown("bearing[1].kxx", prior=(4e7, 8e6)),
    Unknown("bearing[2].cyy"),
    Unknown("disc[1].scale", prior=(1.0, 0.01), beside=True),
]
WISHED = ["bearing[1].kxx", "bearing[2].cyy"]


def candidates(**errors):
    runs = Runs(speeds=(140.0, 250.0, 390.0))
    return runs, runs.data(np.ones((3, 3, 4), complex), **errors)


def coefficients(runs, rotor):
    """(S, C, P) by the dense rotor."""
    units = Runs(runs.speeds, runs.sensors, runs.planes, tuple(np.eye(2)), unbalance={})
    return np.moveaxis(units.readings(rotor), 0, -1)


def expected(runs, which, relative, sensors=slice(None)):
    """Covariance of the wished numbers after runs (speed, plane), as the module says it."""
    rotor = machine()
    W = coefficients(runs, rotor)
    sigma = relative * np.sqrt(3 * (abs(W) ** 2 + 0.05 * (abs(W) ** 2).mean(axis=1, keepdims=True)))
    columns, known = [], []
    for unknown in UNKNOWNS:
        value = parameter_value(rotor, unknown.path)
        up, down = (
            coefficients(runs, with_parameters(rotor, {unknown.path: value * s})) for s in (1.001, 0.999)
        )
        columns.append((up - down) / (0.002 * value) / sigma)
        known.append(unknown.prior[1] if unknown.prior else 1e3 * value)
    information = np.diag(1 / np.array(known) ** 2)
    for s, p in which:
        K = np.stack([column[s, sensors, p] for column in columns], axis=-1)
        information = information + (K.conj().T @ K).real
    return np.linalg.inv(information)[:2, :2]


@pytest.mark.full
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_the_chosen_runs_are_the_best_of_all_subsets(n):
    runs, data = candidates(errors=ReadingErrors(0.02, 0.03), run_errors=RunScatter(0.04))
    relative = np.sqrt((0.02**2 + 0.03**2) / 2 + 0.04**2)
    found = design(machine(), UNKNOWNS, WISHED, data, n)
    every = list(itertools.product(range(3), range(2)))
    best = min(itertools.combinations(every, n), key=lambda w: np.linalg.det(expected(runs, w, relative)))
    chosen = [(runs.speeds.index(v), "PQ".index(p)) for v, p in zip(found.speeds, found.planes, strict=True)]
    assert sorted(chosen) == sorted(best)
    after = np.sqrt(np.diag(expected(runs, best, relative)))
    assert found.after == pytest.approx(after, rel=1e-4)
    assert found.before == pytest.approx([8e6, 1e3 * 2e4])
    for c in range(4):
        fewer = np.sqrt(np.diag(expected(runs, best, relative, [k for k in range(4) if k != c])))
        assert found.without[c] == pytest.approx(np.exp(np.log(fewer / after).mean()) - 1, rel=1e-3)


@pytest.mark.parametrize("errors", [None, ReadingErrors(floor=1e-6)])
def test_without_relative_errors_three_percent_are_taken(errors):
    runs, data = candidates(errors=errors)
    found = design(machine(), UNKNOWNS, WISHED, data, 2)
    which = [(runs.speeds.index(v), "PQ".index(p)) for v, p in zip(found.speeds, found.planes, strict=True)]
    assert found.after == pytest.approx(np.sqrt(np.diag(expected(runs, which, 0.03))), rel=1e-4)


@pytest.mark.parametrize("n", [0, 7, -1])
def test_limits(n):
    _, data = candidates()
    with pytest.raises(ValueError, match=f"--design {n}: from 1 to 6 of the 6 candidates can be chosen"):
        design(machine(), UNKNOWNS, WISHED, data, n)
