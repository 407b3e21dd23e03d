"""A large model: 20 masses, 60 unknowns, 40 frequencies."""

import numpy as np
import pytest
from harmonic_cases import simulate

from rotorid.identify import identify
from rotorid.identify.amplitudes import AmplitudeErrors
from rotorid.identify.equations import harmonic_model

N = 20
ERRORS = AmplitudeErrors(relative=0.001, phase=0.001)


def equations():
    """Mass i between springs and dampers i and i + 1; the last one ends at mass 20; force on mass 1."""
    rows = []
    for i in range(1, N + 1):
        right = f" + (b{i + 1}*p + c{i + 1})*(X{i} - X{i + 1})" if i < N else ""
        left = f"(b{i}*p + c{i})*(X{i} - X{i - 1})" if i > 1 else "(b1*p + c1)*X1"
        rows.append(f"m{i}*p**2*X{i} + {left}{right} = {'F' if i == 1 else '0'}")
    return rows


@pytest.fixture(scope="module")
def chain():
    names = [f"{kind}{i}" for kind in "mcb" for i in range(1, N + 1)]
    model = harmonic_model(equations(), estimate=names)
    assert model.combinations.words
    i = np.arange(N)
    truth = np.concatenate((10 + np.sin(i), 1e5 * (1 + 0.3 * np.cos(i)), 200 + 50 * np.sin(2 * i)))
    return model, truth, np.linspace(5.0, 190.0, 40)


def test_sixty_unknowns_from_exact_readings(chain):
    model, truth, w = chain
    data = simulate(model, truth, w, {"F": 1000.0})
    linear = identify(model, data)
    np.testing.assert_allclose(linear.values, truth, rtol=1e-6)
    assert linear.estimate.rank == 60


def test_output_error_of_sixty_unknowns(chain):
    model, truth, w = chain
    data = simulate(model, truth, w, {"F": 1000.0}, ERRORS, np.random.default_rng(4), stated=ERRORS)
    linear = identify(model, data)
    found = identify(model, data)
    away = np.abs(found.values - truth) / found.std
    assert np.sqrt(np.mean(away**2)) == pytest.approx(1.0, abs=0.3)
    assert (away < 4.5).all()
    # at 0.1 % the weighted linear estimate is as good: they differ by less than what either does not know
    assert (np.abs(found.values - linear.values) < 2 * found.std).all()
