"""What speaks against an answer is said: misfit, units, signs; and nothing speaks against a right one."""

from dataclasses import replace

import numpy as np
import pytest
from harmonic_cases import chain, simulate
from repetitions import FULL

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.linear_start import passive_elements

TWO = ["(m1*p**2 + b1*p)*X1 + k1*X1 + k2*(X1 - X2) = F", "(m2*p**2 + b2*p)*X2 + k2*(X2 - X1) = 0"]
ONE = ["(m*p**2 + b*p + k)*X1 = F"]
NOISE = AmplitudeErrors(0.01, 0.01)


def drawn(seed, masses=2, noise=NOISE, stated=False):
    """A drawn chain of known masses, its springs and dampers, and its readings."""
    rng, (equations, names) = np.random.default_rng(seed), chain(masses)
    known = {name: rng.uniform(2, 10) for name in names[:masses]}
    stiffness = 10 ** rng.uniform(3.5, 4.5, masses)
    truth = np.concatenate((rng.uniform(0.02, 0.1, masses) * np.sqrt(stiffness * 5), stiffness))
    model, w = (
        harmonic_model(equations, known=known, estimate=names[masses:]),
        np.sort(rng.uniform(5, 150, 14)),
    )
    data = simulate(model, truth, w, {"F": 1.0}, noise, rng, stated=noise if stated else None)
    return model, truth, data


def warnings(seeds, change=None, **options):
    """Of drawn chains, after a change of their data."""
    texts = []
    for seed in range(seeds):
        model, _, data = drawn(seed, **options)
        model, data = change(model, data) if change else (model, data)
        texts.append(" ".join(identify(model, data).warnings))
    return texts


@pytest.mark.parametrize("stated", [False, True])
def test_a_right_model_is_left_alone(stated):
    assert not any(warnings(12, stated=stated))


@pytest.mark.full
@pytest.mark.parametrize("size", [0.01, 0.05])
def test_noise_is_not_blamed_on_the_model_and_intervals_cover(size):
    inside = []
    for seed in range(200 if FULL else 30):
        model, truth, data = drawn(seed, noise=AmplitudeErrors(size, size))
        result = identify(model, data)
        assert not result.warnings, (seed, result.warnings)
        inside.append((result.ci95[:, 0] <= truth) & (truth <= result.ci95[:, 1]))
    assert np.mean(inside) > 0.85, (np.mean(inside), len(inside))


@pytest.mark.full
def test_noise_is_not_taken_for_a_wrong_sign():
    texts = warnings(8, noise=AmplitudeErrors(0.2, 0.2))
    assert sum("unless they are as noisy as that" in text for text in texts) >= 6, texts
    assert not any("no passive" in text for text in texts), texts


@pytest.mark.parametrize("stated", [False, True])
def test_one_mass_for_the_data_of_two(stated):
    one = harmonic_model(ONE, estimate=["m", "b", "k"])
    texts = warnings(10, lambda m, d: (one, d), stated=stated)
    words = "" if stated else "the model leaves "
    assert sum(bool(text) and words in text for text in texts) >= (10 if stated else 8), texts


def test_frequencies_in_hertz_and_phases_of_the_other_sign():
    def hertz(model, data):
        return model, replace(data, frequencies=data.frequencies / (2 * np.pi))

    def lags(model, data):
        return model, replace(data, signals={n: np.conj(z) for n, z in data.signals.items()})

    assert all(warnings(8, hertz, masses=1))
    texts = warnings(6, lags, stated=True)
    assert all("negative, which no passive spring, damper or mass is: a sign" in t for t in texts), texts


def test_signs_where_damping_is_known_and_where_bounds_allow_them():
    w = np.linspace(10, 60, 8)
    known = harmonic_model(ONE, known={"b": 40.0}, estimate=["m", "k"])
    data = simulate(known, np.array([5.0, 5e3]), w, {"F": 1.0})
    data.signals["X1"][:] = np.conj(data.signals["X1"])
    assert any("the sign of phases is wrong" in text for text in identify(known, data).warnings)
    model = harmonic_model(ONE, estimate=["m", "b", "k"])
    data = simulate(model, np.array([5.0, 40.0, 5e3]), w, {"F": -1.0})
    data.signals["F"][:] = 1.0
    (warning,) = identify(model, data).warnings
    assert warning.startswith("m = -5, b = -40 and k = -5000 negative, which no passive")
    assert identify(model, data, bounds=dict.fromkeys(model.parameters, (None, None))).warnings == ()


@pytest.mark.parametrize(
    ("equations", "estimate", "elements"),
    [
        (TWO, ["m1", "b1", "k1", "k2"], {"m1": 2, "b1": 1, "k1": 0, "k2": 0}),
        ([f"-({TWO[0].split(' =')[0]}) = -F", TWO[1]], ["m1", "k2"], {}),
        (["(m*p**2 + c - kn)*X + kc*Y = F", "(m*p**2 + c)*Y - kc*X = 0"], ["c", "kn", "kc"], {"c": 0}),
        (["(T1*T2*p**2 + T1*p + 1)*X = F"], ["T1", "T2"], {}),
        (["(m*p**2 + b*p + c)*X = (b*p + c)*Z"], ["m", "b", "c"], {"m": 2, "b": 1, "c": 0}),
        (["k*X = F", "a*X = Y"], ["k", "a"], {}),  # Y excites: nothing is predicted
    ],
)
def test_what_is_a_passive_element(equations, estimate, elements):
    names = ("m1", "m2", "b1", "b2", "k1", "k2", "m", "c")
    known = {n: 1.0 for n in names if n not in estimate and n in " ".join(equations)}
    assert passive_elements(harmonic_model(equations, known=known, estimate=estimate)) == elements


@pytest.mark.parametrize(("dust", "dof"), [(0.0, 0), (3e-16, 0), (1e-6, 1)])
def test_what_rounding_leaves_is_no_degree_of_freedom(dust, dof):
    """An undamped model, one reading: the imaginary row holds by itself, but for rounding."""
    model = harmonic_model(["(m*p**2 + c)*X = F"], known={"m": 10.0}, estimate=["c"])
    result = identify(
        model, experiments(model, [20.0], {"F": 1.0, "X": 2.5e-4 * (1 + 1j * dust)}, free=False)
    )
    assert result.value("c") == pytest.approx(8000.0)
    assert result.dof == dof
    assert (result.ci95 is None) == (result.std is None) == ("no intervals" in result.summary()) == (dof == 0)


def test_undamped_rows_that_one_force_cannot_tell_apart():
    """Without damping the first row is not told from itself plus a share of the second."""
    whole = ["(m11*p**2 + k11)*X + (m12*p**2 + k12)*Y = F", "(m12*p**2 + k12)*X + (m22*p**2 + k22)*Y = 0"]
    names, w = ["m11", "k11", "m12", "k12", "m22", "k22"], np.linspace(3, 60, 12)
    model = harmonic_model(whole, estimate=names)
    data = simulate(model, np.array([5.0, 9e3, 0.5, -4e3, 3.0, 6e3]), w, {"F": 1.0})
    np.testing.assert_allclose(identify(model, data).values[:2], [5.0, 9e3], rtol=1e-6)
    apart = [whole[0], whole[1].replace("m12", "m21").replace("k12", "k21")]
    assert not identify(harmonic_model(apart, estimate=[*names, "m21", "k21"]), data).identifiable
