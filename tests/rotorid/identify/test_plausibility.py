"""What speaks against an answer is said: misfit, units, signs; and nothing speaks against a right one."""

from dataclasses import replace

import numpy as np
import pytest
from repetitions import FULL

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.linear_start import passive_elements

TWO = ["(m1*p**2 + b1*p)*X1 + k1*X1 + k2*(X1 - X2) = F", "(m2*p**2 + b2*p)*X2 + k2*(X2 - X1) = 0"]
ONE = ["(m*p**2 + b*p + k)*X1 = F"]
NOISE = AmplitudeErrors(0.01, 0.01)


def drawn(seed, masses):
    """A drawn chain of one or two masses, and the true springs and dampers; the masses are known."""
    rng = np.random.default_rng(seed)
    equations = TWO if masses == 2 else [TWO[0].replace(" + k2*(X1 - X2)", "")]
    known = {f"m{i + 1}": rng.uniform(2, 10) for i in range(masses)}
    truth = {f"k{i + 1}": 10 ** rng.uniform(3.5, 4.5) for i in range(masses)}
    truth |= {f"b{i + 1}": rng.uniform(0.02, 0.1) * np.sqrt(truth[f"k{i + 1}"] * 5) for i in range(masses)}
    return harmonic_model(equations, known=known, estimate=list(truth)), truth, rng


def readings(seed, masses, noise=NOISE, stated=True):
    """A drawn chain and its readings."""
    model, truth, rng = drawn(seed, masses)
    w = np.sort(rng.uniform(5, 150, 14))
    z = model.predict(np.array(list(truth.values())), w, {"F": np.ones(14, dtype=complex)})
    for name, exact in z.items():
        size, turn = rng.standard_normal((2, 14))
        z[name] = exact * (1 + noise.relative * size) * np.exp(1j * noise.phase * turn)
    return model, experiments(model, w, {"F": 1.0, **z}, free=False, errors=noise if stated else None)


def spoken(seeds, masses, change, stated):
    """Warnings for drawn models after a change of the data."""
    found = []
    for seed in range(seeds):
        model, data = readings(seed, masses, stated=stated)
        model, data = change(model, data)
        found.append(" ".join(identify(model, data).warnings))
    return found


@pytest.mark.parametrize("stated", [False, True])
def test_a_right_model_is_left_alone(stated):
    quiet = spoken(12, 2, lambda m, d: (m, d), stated)
    assert not any(quiet), quiet


@pytest.mark.full
@pytest.mark.parametrize("size", [0.01, 0.05])
def test_noise_is_not_blamed_on_the_model_and_intervals_cover(size):
    """Two masses, errors not stated: intervals contain the truth, and no draw blames the model."""
    inside = []
    for seed in range(200 if FULL else 30):
        model, data = readings(seed, 2, AmplitudeErrors(size, size), stated=False)
        found = identify(model, data)
        assert not found.warnings, (seed, found.warnings)
        truth = np.array(list(drawn(seed, 2)[1].values()))
        inside.append((found.ci95[:, 0] <= truth) & (truth <= found.ci95[:, 1]))
    assert np.mean(inside) > 0.85, (np.mean(inside), len(inside))


@pytest.mark.full
def test_noise_is_not_taken_for_a_wrong_sign():
    noisy = [readings(seed, 2, AmplitudeErrors(0.2, 0.2), stated=False) for seed in range(8)]
    words = [" ".join(identify(m, d).warnings) for m, d in noisy]
    assert sum("unless they are as noisy as that" in text for text in words) >= 6, words
    assert not any("no passive" in text for text in words), words


@pytest.mark.parametrize("stated", [False, True])
def test_one_mass_for_the_data_of_two(stated):
    one = harmonic_model(ONE, estimate=["m", "b", "k"])
    said = spoken(10, 2, lambda m, d: (one, d), stated)
    assert sum(map(bool, said)) >= (10 if stated else 8), said
    if not stated:
        assert sum("the model leaves " in text for text in said) >= 8, said


def test_frequencies_in_hertz():
    wrong = lambda m, d: (m, replace(d, frequencies=d.frequencies / (2 * np.pi)))  # noqa: E731
    said = spoken(8, 1, wrong, False)
    assert all(said)


def test_phases_of_the_other_sign():
    wrong = lambda m, d: (m, replace(d, signals={n: np.conj(z) for n, z in d.signals.items()}))  # noqa: E731
    said = spoken(6, 2, wrong, True)
    assert all("negative, which no passive spring, damper or mass is: a sign" in t for t in said), said


def test_known_damping_and_phases_of_the_other_sign():
    model = harmonic_model(["(m*p**2 + b*p + k)*X = F"], known={"b": 40.0}, estimate=["m", "k"])
    w = np.linspace(10, 60, 8)
    x = model.predict(np.array([5.0, 5e3]), w, {"F": np.ones(8, dtype=complex)})["X"]
    found = identify(model, experiments(model, w, {"F": 1.0, "X": np.conj(x)}, free=False))
    assert any("the sign of phases is wrong" in text for text in found.warnings)


def test_a_force_of_the_other_sign_and_bounds_that_allow_it():
    model = harmonic_model(["(m*p**2 + b*p + k)*X = F"], estimate=["m", "b", "k"])
    w = np.linspace(10, 60, 8)
    x = model.predict(np.array([5.0, 40.0, 5e3]), w, {"F": -np.ones(8, dtype=complex)})["X"]
    data = experiments(model, w, {"F": 1.0, "X": x}, free=False)
    (warning,) = identify(model, data).warnings
    assert warning.startswith("m = -5, b = -40 and k = -5000 negative, which no passive")
    allowed = dict.fromkeys(model.parameters, (None, None))
    assert identify(model, data, bounds=allowed).warnings == ()


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
    names = {"m1": 1.0, "m2": 1.0, "b1": 1.0, "b2": 1.0, "k1": 1.0, "k2": 1.0, "m": 1.0, "c": 1.0}
    known = {n: x for n, x in names.items() if n not in estimate and n in " ".join(equations)}
    assert passive_elements(harmonic_model(equations, known=known, estimate=estimate)) == elements


@pytest.mark.parametrize("dust", [0.0, 1e-17, 3e-16])
def test_what_rounding_leaves_is_no_degree_of_freedom(dust):
    """An undamped model, one reading: the imaginary row holds by itself, but for rounding."""
    model = harmonic_model(["(m*p**2 + c)*X = F"], known={"m": 10.0}, estimate=["c"])
    found = identify(
        model,
        experiments(model, [20.0], {"F": 1.0, "X": 2.5e-4 * (1 + 1j * dust)}, free=False),
    )
    assert found.value("c") == pytest.approx(8000.0)
    assert (found.dof, found.ci95, found.std) == (0, None, None)
    assert "no intervals" in found.summary()


def test_an_imaginary_part_beyond_rounding_is_one():
    model = harmonic_model(["(m*p**2 + c)*X = F"], known={"m": 10.0}, estimate=["c"])
    data = experiments(model, [20.0], {"F": 1.0, "X": 2.5e-4 * (1 + 1e-6j)}, free=False)
    assert identify(model, data).dof == 1


def test_undamped_rows_that_one_force_cannot_tell_apart():
    whole = ["(m11*p**2 + k11)*X + (m12*p**2 + k12)*Y = F", "(m12*p**2 + k12)*X + (m22*p**2 + k22)*Y = 0"]
    names = ["m11", "k11", "m12", "k12", "m22", "k22"]
    model = harmonic_model(whole, estimate=names)
    w = np.linspace(3, 60, 12)
    z = model.predict(np.array([5.0, 9e3, 0.5, -4e3, 3.0, 6e3]), w, {"F": np.ones(12, dtype=complex)})
    # without damping one force cannot tell the first row from itself plus a share of the second
    apart = [whole[0], whole[1].replace("m12", "m21").replace("k12", "k21")]
    other = harmonic_model(apart, estimate=[*names, "m21", "k21"])
    found = identify(other, experiments(other, w, {"F": 1.0, **z}, free=False))
    assert not found.identifiable
    np.testing.assert_allclose(identify(model, experiments(model, w, {"F": 1.0, **z}, free=False)).values[:2],
                               [5.0, 9e3], rtol=1e-6)  # fmt: skip
