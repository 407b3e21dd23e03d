"""Reductions of the rotor of [S] task 9.1 by formula (50), with full-precision inputs."""

import re

import numpy as np
import pytest
from book_task_9 import (
    COMPLIANCE,
    FREQUENCIES,
    SHAPES,
)
from cases import each_of
from fem_rotors import rotor23

import fem
from rotorid.files import read_rotor
from rotorid.reduction import (
    equivalent_masses,
    natural_frequencies,
    reduce,
    reduce_measured,
    small_model,
)
from rotorid.samples import sample_data


@pytest.fixture(scope="module")
def rotor():
    return read_rotor(sample_data() / "rotor23.csv")


@pytest.mark.parametrize(("modes", "condition"), [(1, 63.2), (2, 18.3), (3, 1.4)])
def test_full_precision_masses_and_frequencies(rotor, modes, condition):
    """Condition numbers with columns scaled; unscaled they are 64, 20 and 1.8."""
    reduction = reduce(rotor, (7, 12, 18), modes)
    np.testing.assert_allclose(reduction.compliance, COMPLIANCE, rtol=1e-7)
    exact = equivalent_masses(COMPLIANCE, FREQUENCIES[:modes], SHAPES[:, :modes])
    # the inputs have 9 digits; condition 64 turns them into 7
    np.testing.assert_allclose(reduction.masses.values, exact.values, rtol=1e-5)
    expected, _ = natural_frequencies(COMPLIANCE, exact.values)
    np.testing.assert_allclose(reduction.frequencies, expected, rtol=1e-6)
    np.testing.assert_allclose(reduction.positions, np.array([0.655, 1.34, 2.105]) + 0.318, atol=1e-9)
    assert round(reduction.masses.condition_number, 1) == condition
    assert any("ill-conditioned" in w for w in reduction.warnings) == (modes == 1)
    frame = reduction.to_frame()
    assert frame["table"].tolist() == ["masses"] * 3 + ["modes"] * 3
    np.testing.assert_allclose(frame["mass_kg"][:3].astype(float), reduction.masses.values)
    np.testing.assert_allclose(frame["frequency_rad_s"][3:].astype(float), reduction.frequencies)
    assert frame["mass_kg"][3:].isna().all()


def test_modes_that_were_not_measured_or_do_not_vibrate_are_said(rotor):
    """Places are numbered, or named."""
    few = reduce_measured(COMPLIANCE, FREQUENCIES[:2], SHAPES[:, :2], nodes=("fan", "wheel", 18))
    assert few.to_dict()["nodes"] == ["fan", "wheel", 18]
    last = few.to_frame().iloc[-1]
    assert last["frequency_rad_s"] == few.frequencies[2]
    assert last[["rotor_frequency_rad_s", "relative_error", "mac"]].isna().all()
    assert reduce_measured(COMPLIANCE, FREQUENCIES[:2], SHAPES[:, :2]).nodes == (1, 2, 3)
    odd = reduce(rotor, (2, 3, 4), 1)
    still = np.count_nonzero(~np.isfinite(odd.frequencies))
    assert still
    assert odd.answer.numbers.count("does not vibrate") == still
    for wrong in (("fan", "wheel"), ("fan", "fan", 18)):
        with pytest.raises(ValueError, match="3 different names of places"):
            reduce_measured(COMPLIANCE, FREQUENCIES[:2], SHAPES[:, :2], nodes=wrong)


@each_of(
    ("nodes", "options", "message"),
    [
        ((), {}, "different nodes"),
        ((7, 7, 18), {}, "different nodes"),
        ((7, 12, 30), {}, "node 30 does not exist"),
        ((0, 12), {}, "node 0 does not exist"),
        ((7.5, 12), {}, "whole number"),
        ((7, 12), {"modes": 3}, "can use 1 … 2 modes"),
        ((7, 12), {"modes": 0}, "can use 1 … 2 modes"),
        ((7, 12), {"modes": 1.5}, "whole number"),
        ((7, 12), {"modes": np.nan}, "whole number"),
        ((7, 12), {"speed": np.nan}, "must be finite"),
        ((7, 12), {"normalise": "middle"}, "normalise must be"),
        ((7, 12), {"rows": "heavy"}, "rows must be"),
    ],
)
def test_bad_choices_are_refused(nodes, options, message):
    with pytest.raises(ValueError, match=message):
        reduce(rotor23(), nodes, **options)


def test_a_free_rotor_is_refused(rotor):
    with pytest.raises(ValueError, match="supports at two nodes"):
        reduce(fem.Rotor(rotor.length, rotor.outer_diameter, discs=rotor.discs), (7, 12, 18), 1)


def test_the_plane_at_rest_of_an_anisotropic_gyroscopic_rotor():
    parts = {"discs": [fem.Disc(4, 30.0, 2.0, 1.0), fem.Disc(8, 20.0, 1.0, 0.6)]}
    stand = fem.Pedestal(5.0, (3e8, 1e8), 1e3)
    turning = fem.Rotor(
        [0.1] * 10,
        0.06,
        **parts,
        supports=[
            fem.Support(1, ((2e7, 3e6), (-3e6, 5e7)), 2e3),
            fem.Support(11, [1e7, 3e7], 1e3, speeds=(100.0, 500.0), pedestal=stand),
        ],
        model=fem.Model(shear=True, rotary_inertia=True, gyroscopic=True),
    )
    still = fem.Rotor(
        [0.1] * 10,
        0.06,
        **parts,
        supports=[fem.Support(1, 2e7), fem.Support(11, 1e7, pedestal=fem.Pedestal(5.0, 3e8))],
        model=fem.Model(shear=True, rotary_inertia=True),
    )
    a, b = reduce(turning, [4, 8], 2), reduce(still, [4, 8], 2)
    np.testing.assert_allclose(a.masses.solution, b.masses.solution, rtol=1e-9)
    np.testing.assert_allclose(a.rotor_frequencies, b.rotor_frequencies, rtol=1e-9)
    assert "plane x of the rotor at rest" in a.warnings[0]
    assert "nor masses of pedestals" in a.warnings[0]
    assert "(kxx) is that at 100 rad/s (--speed)" in a.warnings[1]
    assert not any("gyroscopic" in text for text in a.warnings[1:])
    assert not any("(kxx)" in text for text in b.warnings)
    stiffer = reduce(turning, [4, 8], 2, speed=500.0)
    assert (stiffer.rotor_frequencies > a.rotor_frequencies).all()
    assert "(kxx) is that at 500 rad/s (--speed)" in stiffer.warnings[1]
    with pytest.raises(ValueError, match="its table holds 100 to 500"):
        reduce(turning, [4, 8], 2, speed=50.0)


def test_a_mode_of_another_shape_is_said(rotor):
    clumsy = reduce(rotor, [9, 10, 19], 3)
    off, words = (clumsy.mac < 0.9) | (np.abs(clumsy.relative_error) > 0.1), " ".join(clumsy.warnings)
    assert "MAC 0.01" in words
    assert [f"mode {k + 1} by " in words for k in range(3)] == off.tolist()
    assert not any("MAC" in text for text in reduce(rotor, [7, 12, 18], 2).warnings)


def test_masses_that_are_not_positive_say_what_to_do(rotor):
    """Modes that ask for less than nothing: one warning with the way out."""
    wrong = reduce(rotor, [6, 7, 12], 2)
    (warning,) = wrong.warnings
    assert re.match(r"a mass is not positive, -25\d\d kg at node 7: .* --nonnegative$", warning)
    bounded = reduce(rotor, [6, 7, 12], 2, nonnegative=True)
    assert "at the bound 0" in bounded.warnings[0]
    assert "mode 2 does not vibrate" in bounded.warnings[1]
    assert "nan" not in bounded.summary()
    for result, way in ((wrong, "or --nonnegative"), (bounded, "leave out this node")):
        with pytest.raises(ValueError, match=way):
            small_model(rotor, [6, 7, 12], result.masses.solution)
