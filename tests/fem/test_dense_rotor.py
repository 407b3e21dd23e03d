"""The judge itself: the dense reference solution against closed forms, and against what ROSS answered."""

import dense_rotor
import numpy as np
import pytest
import ross_rotors

import fem

STIFF = 1e16  # N/m, against the shaft's own 1e8: error of the first frequencies about 1e-8


def shaft(n, *, supports, **others):
    return fem.Rotor(np.full(n, 1.0 / n), 0.1, density=7850.0, supports=supports, **others)


def test_simply_supported_timoshenko_beam_has_the_frequencies_of_the_closed_form():
    ends = [fem.Support(1, STIFF), fem.Support(3, STIFF)]
    rotor = shaft(2, supports=ends, model=fem.Model(shear=True, rotary_inertia=True))
    found = dense_rotor.whirl(rotor, 0.0)[0].imag[0:6:2]
    assert found == pytest.approx([1261.04906, 4877.35161, 10437.66019], rel=1e-7)


def test_free_bernoulli_beam_converges_as_the_fourth_power():
    exact = np.array([2892.9744, 7974.59535, 15633.39539])
    error = {}
    for n in (12, 24):
        found = dense_rotor.whirl(shaft(n, supports=[]), 0.0)[0].imag
        error[n] = found[found > 100][0:6:2] / exact - 1
    assert error[24].max() < 1e-4
    assert error[12] / error[24] == pytest.approx(16, rel=0.06)


def test_gyroscopic_splitting_of_a_rotating_simply_supported_beam_is_that_of_the_closed_form():
    # Rayleigh beam, mode 1: (1 + r) ω² − 2 r Ω ω − ω₀² = 0 with r = I π² / (A L²), both signs of ω.
    ends = [fem.Support(1, STIFF), fem.Support(33, STIFF)]
    rotor = shaft(32, supports=ends, model=fem.Model(rotary_inertia=True, gyroscopic=True))
    r, speed, still = np.pi**2 * 0.1**2 / 16, 3000.0, 1276.18775
    roots = np.sort(np.abs(np.roots([1 + r, -2 * r * speed, -(still**2)])))
    lam, X, Y = dense_rotor.whirl(rotor, speed)
    assert lam.imag[:2] == pytest.approx(roots, rel=1e-6)
    turns = dense_rotor.direction(X, Y)[:, 1:-1]
    assert (turns[0] == -1).all()
    assert (turns[1] == 1).all()


def test_rotating_damping_makes_whirl_unstable_above_the_closed_forms_threshold():
    # A massless shaft with one mass in the middle: c_i = β k, unstable above ω₀ (1 + c_e / c_i).
    k, m, beta, outer = 48 * 2.1e11 * np.pi / 64 * 0.02**4, 20.0, 2e-5, 30.0
    rotor = fem.Rotor(
        [0.5, 0.5],
        0.02,
        density=0.0,
        discs=[fem.Disc(2, m)],
        supports=[fem.Support(1, STIFF), fem.Support(3, STIFF), fem.Support(2, 0.0, outer)],
        material_damping=beta,
    )
    threshold = np.sqrt(k / m) * (1 + outer / (beta * k))
    growth = [dense_rotor.whirl(rotor, f * threshold)[0][:2].real.max() for f in (0.999, 1.001)]
    assert growth[0] < 0 < growth[1]


def test_higher_precision_agrees_with_float64_where_that_is_exact_and_repairs_it_where_it_is_not():
    ends = [fem.Support(1, 1e7, 1e3), fem.Support(5, 2e7, 2e3)]
    rotor = shaft(4, supports=ends, discs=[fem.Disc(3, 50.0)])
    lam = dense_rotor.whirl(rotor, 0.0)[0][0]
    assert abs(dense_rotor.polished(rotor, 0.0, lam * 1.001)[0] / lam - 1) < 1e-12
    plain = dense_rotor.response(rotor, {3: 1e-3j}, 200.0)
    higher = dense_rotor.response(rotor, {3: 1e-3j}, 200.0, np.longdouble)
    assert np.abs(np.array(plain) - np.array(higher)).max() < 1e-12 * np.abs(plain).max()


@pytest.mark.parametrize("data", ross_rotors.NO_SHEAR, ids=ross_rotors.label)
def test_ross_answers_without_shear(data):
    # The same cubic elements: only rounding differs (measured: 2e-10; log decrements 2e-8 of 1e-4).
    rotor = ross_rotors.build(data)
    for answer in data["answers"]:
        _compare(rotor, data, answer, modes=1e-9, response=1e-9)


@pytest.mark.parametrize("data", ross_rotors.SHEAR, ids=ross_rotors.label)
def test_ross_extrapolated_answers_with_shear(data):
    rotor = ross_rotors.build(data)
    for answer in data["answers"]:
        # Ten times its own error estimate: an estimate, not a bound; below 1e-6 in any case.
        modes, response = (max(1e-8, 10 * answer[f"error_{of}"]) for of in ("wd", "response"))
        assert max(modes, response) <= 2e-6
        _compare(rotor, data, answer, min(modes, 1e-6), min(response, 1e-6))


def _compare(rotor, data, answer, modes, response):
    lam, X, Y = dense_rotor.whirl(rotor, answer["speed"])
    oscillates = lam.imag > 0.1 * np.abs(lam)  # the others were left out
    lam, X, Y = lam[oscillates], X[oscillates], Y[oscillates]
    expected = ross_rotors.eigenvalues(answer)
    found = [int(np.argmin(np.abs(lam - value))) for value in expected]
    assert sorted(found) == list(range(len(expected)))  # no mode missed, none found twice
    assert np.abs(lam[found] - expected).max() < modes * np.abs(expected).max()
    assert lam[found].imag == pytest.approx(expected.imag, rel=modes)
    for k, word in zip(found, answer["direction"], strict=True):
        if word in "FB":  # ROSS says M where nodes whirl in different directions
            size = np.hypot(np.abs(X[k]), np.abs(Y[k]))
            turns = dense_rotor.direction(X[k], Y[k])[size > 1e-3 * size.max()]
            assert (turns == {"F": 1, "B": -1}[word]).all()
    Z = np.array(dense_rotor.response(rotor, ross_rotors.unbalance(data), answer["speed"]))
    assert np.abs(Z - ross_rotors.amplitudes(answer)).max() < response * np.abs(Z).max()
