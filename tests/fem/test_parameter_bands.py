"""Error bands of a calibrated rotor against rotors drawn from the covariance, which are built by hand."""

from dataclasses import replace

import numpy as np
import pytest
from repetitions import FULL

import fem
from fem.parameter_bands import band, nearest_modes, spread

NAMES = ("bearing[1].kxx", "bearing[2].stiffness.scale", "material.youngs_modulus", "disc[wheel].mass")
VALUES = np.array([4e7, 1.0, 2.1e11, 60.0])
RELATIVE = np.array([[0.03, 0, 0, 0], [-0.02, 0.03, 0, 0], [0.01, 0.005, 0.01, 0], [0, 0, 0.01, 0.02]])
A = RELATIVE * VALUES[:, None]
DRAWS = 800 if FULL else 300
WITHIN = 4 / np.sqrt(2 * DRAWS)  # four standard errors of a standard deviation


def built(values):
    k, scale, modulus, mass = values
    return fem.Rotor(
        [0.15] * 8,
        0.08,
        youngs_modulus=modulus,
        discs=[fem.Disc(4, mass, 1.0, 0.6, "wheel"), fem.Disc(7, 30.0)],
        supports=[
            fem.Support(1, ((k, 0.0), (0.0, 3e7)), 4e3),
            fem.Support(9, ((5e7 * scale, 5e6 * scale), (-5e6 * scale, 5e7 * scale)), 4e3),
        ],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


ROTOR = replace(built(VALUES), calibration=fem.Calibration(NAMES, VALUES, A @ A.T))


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(7)
    return [built(VALUES + A @ rng.normal(size=4)) for _ in range(DRAWS)]


def criticals(rotor):
    return fem.critical_speeds(rotor, 4).frequencies


def amplitudes(rotor, speeds):
    return np.abs(fem.unbalance_response(rotor, {4: 1e-3}, speeds).readings([1, (4, 30.0)]))


def test_critical_speeds_scatter_as_the_band_says(drawn):
    scatter = np.std([criticals(rotor) for rotor in drawn], axis=0)
    np.testing.assert_allclose(spread(ROTOR, criticals), scatter, rtol=WITHIN)


@pytest.mark.full
def test_the_band_does_not_close_at_a_resonance_and_is_said_to_be_rough(drawn):
    fine = np.linspace(150.0, 400.0, 501)
    top = fine[[np.argmax(amplitudes(ROTOR, fine)[:, 1])]]
    std, (said,) = band(ROTOR, "the amplitudes", lambda rotor: amplitudes(rotor, top))
    scatter = np.std([amplitudes(rotor, top)[0, 1] for rotor in drawn])
    assert 0.5 * scatter < std[0, 1] < 3 * scatter
    assert "2 of 2 error bands of the amplitudes are wider than ±30 % and rough" in said


def test_what_is_linear_is_exact_and_complex_values_count_by_size():
    def stiffness(rotor):
        return np.array([rotor.supports[0].stiffness[0][0], 2j * rotor.discs[0].mass])

    std = np.sqrt(np.diag(A @ A.T))
    np.testing.assert_allclose(spread(ROTOR, stiffness), [std[0], 2 * std[3]], rtol=1e-6)


def test_where_no_band_can_be_given_words_say_why():
    assert band(replace(ROTOR, calibration=None), "x", criticals) == (None, ())
    with pytest.raises(ValueError, match="no calibration"):
        spread(replace(ROTOR, calibration=None), criticals)
    wild = fem.Calibration(("bearing[1].kxx",), [4e7], [[2.5e15]])
    std, said = band(replace(ROTOR, calibration=wild), "the critical speeds", criticals)
    assert std is None
    begins = (
        "no error bands of the critical speeds: within the errors of the calibration, support at node 1: "
    )
    assert said[0].startswith(begins)
    std, said = band(ROTOR, "them", lambda rotor: np.zeros(2 + (rotor.discs[0].mass > 60.0)))
    assert std is None
    assert said == ("no error bands of them: within the errors of the calibration, their number changes",)
    contradicted = replace(ROTOR.calibration, needs_trial_run=True)
    std, said = band(replace(ROTOR, calibration=contradicted), "the critical speeds", criticals)
    np.testing.assert_array_equal(std, spread(ROTOR, criticals))
    assert "contradict the model" in said[0]
    assert len(said) == 1


def test_modes_that_exchange_their_numbers_keep_them():
    middle = np.array([[10.0, 11.0, 30.0], [10.0, 21.0, 30.0], [10.0, np.nan, 30.0]])
    np.testing.assert_array_equal(nearest_modes(middle, middle[:, [1, 2, 0]] + 0.9), middle + 0.9)
    np.testing.assert_array_equal(nearest_modes(middle, middle - 2.0), middle - 2.0)
    assert nearest_modes(middle, middle[:, :2]).shape == (3, 2)
