"""First trial weights: amount against the formula, angle against simulated signals and a rotor model."""

from dataclasses import replace
from math import degrees, pi, radians

import numpy as np
import pytest
from balancing_data import stored
from cases import each_of
from fem_rotors import rotor23

from balancing import Labels
from balancing.computed import model_influence
from balancing.plots import draw_trial_weight as plot
from balancing.trial_weight import (
    GRAVITY,
    expected_lag,
    opposing_angle,
    trial_from_coefficients,
    trial_from_force,
)

RPM3000 = 100 * pi
GRAMS = Labels(weight_unit="g", weight_scale=1e3)


def test_amount_makes_a_tenth_of_the_load():
    load = 500 * GRAVITY
    found = trial_from_force("A", RPM3000, 0.2, load)
    assert found.load == load
    # 490.3325 N / (0.2 m · 98696.04 s⁻²)
    assert found.amount == pytest.approx(0.02484054, rel=1e-6)
    assert found.amount * 0.2 * RPM3000**2 == pytest.approx(0.1 * load)
    assert trial_from_force("A", RPM3000, 0.2, 2500, fraction=0.05).amount == pytest.approx(125 / 19739.2088)


@pytest.mark.parametrize(
    ("speed", "radius", "load", "fraction", "words"),
    [
        (RPM3000, 0.0, 5e3, 0.1, "radius must be a finite number above 0, not 0"),
        (RPM3000, 0.2, 10.0, 0, "fraction of the load must be"),
    ],
)
def test_impossible_forces(speed, radius, load, fraction, words):
    with pytest.raises(ValueError, match=words):
        trial_from_force("A", speed, radius, load, fraction=fraction)


def simulated_phase(heavy, eta, zeta, sensor, key):
    """Phase lead of what an instrument reads: one mode, both directions alike, sampled in time."""
    omega = 2.0
    response = eta**2 / (1 - eta**2 + 2j * zeta * eta)
    t = np.linspace(0, 2 * pi / omega, 720, endpoint=False)  # from the pulse of the key phasor
    mark = key + omega * t
    place = response * np.exp(1j * (mark + heavy))  # x + i y of the shaft
    read = (place * np.exp(-1j * sensor)).real
    return np.angle(np.sum(read * np.exp(-1j * omega * t)))


@pytest.mark.parametrize("eta", [0.4, 1.0, 1.7])
def test_angle_is_opposite_to_the_heavy_spot_in_a_simulation(eta):
    rng = np.random.default_rng(3)
    for heavy, sensor, key in rng.uniform(-pi, pi, (5, 3)):
        phase = simulated_phase(heavy, eta, 0.08, sensor, key)
        lag = np.arctan2(2 * 0.08 * eta, 1 - eta**2)
        angle = opposing_angle(phase, lag, sensor - key)
        assert 0 <= angle < 2 * pi
        assert abs(np.exp(1j * angle) + np.exp(1j * heavy)) < 1e-9


@pytest.mark.parametrize(
    ("options", "expected", "reach"),
    [
        ({"where": "below"}, 45, 45),
        ({"where": "at"}, 90, 0),
        ({"where": "above"}, 135, 45),
        ({"degrees": 37}, 37, None),
    ],
)
def test_lags(options, expected, reach):
    lag = expected_lag(**options)
    assert degrees(lag.expected) == pytest.approx(expected)
    assert reach is None or degrees(lag.reach) == pytest.approx(reach)


@pytest.mark.parametrize("wrong", [{}, {"degrees": 400}, {"where": "near"}])
def test_lags_that_are_none(wrong):
    with pytest.raises(ValueError, match=r"critical speed|lag"):
        expected_lag(**wrong)


@pytest.mark.parametrize(("angle", "key"), [(0.0, 0.0), (50.0, 0.0), (-30.0, 70.0)])
def test_angle_by_the_model_and_by_the_lag_agree_below_the_critical_speed(angle, key):
    known = model_influence(rotor23(), {"mid": 12}, {"s": (12, angle)}, [60.0], key_phasor=key)
    Y = known.W[..., 0] * 2.0 * np.exp(1j * radians(130))
    found = trial_from_coefficients(known.rebased(Y), "mid", share=0.5)
    assert degrees(found.angle) == pytest.approx(310)
    assert found.amount == pytest.approx(1.0)  # half of the unbalance halves the reading
    assert found.expected == pytest.approx(Y / 2)
    guessed = opposing_angle(np.angle(Y[0, 0]), 0.0, radians(angle - key))
    assert degrees(guessed) == pytest.approx(310)


def influence(W, **options):
    W = np.asarray(W, dtype=complex)
    known = stored(W, speeds=np.array([RPM3000]), planes=("left", "right"), labels=GRAMS)
    return replace(known, sensors=("a", "b"), **{"baseline": READINGS, **options})


COEFFICIENTS = [[[4.0, 1j], [1.0, -2.0]]]
READINGS = np.array([[1.0 + 1j, 0.5j]]) * 0.05


def test_sensitivity_changes_the_largest_reading_by_the_share():
    found = trial_from_coefficients(influence(COEFFICIENTS), "left", share=0.4)
    assert abs(found.expected[0, 0] - READINGS[0, 0]) == pytest.approx(0.4 * abs(READINGS[0, 0]))
    assert found.amount == pytest.approx(0.4 * abs(READINGS[0, 0]) / 4)
    assert found.warnings == ()
    # no other angle leaves less, rms
    turn = np.exp(1j * np.linspace(0, 2 * pi, 721))
    left = [np.linalg.norm(READINGS[0] + np.array([4, 1]) * found.amount * z) for z in turn]
    assert np.linalg.norm(found.expected) <= min(left) + 1e-12


def test_no_reading_changes_by_more_than_the_share_of_the_largest():
    # the plane acts on the largest reading ("a") hardly, and much on the other one
    found = trial_from_coefficients(influence([[[0.1, 1.0], [8.0, 1.0]]]), "left", share=0.4)
    change = np.abs(found.expected - READINGS)
    assert change[0] == pytest.approx(0.4 * abs(READINGS[0, 0]) * np.array([0.1 / 8, 1.0]))
    assert "changes sensor 'b' at 3000 rpm by 40 % of the largest reading" in found.basis


def test_a_trial_radius_of_its_own():
    W = influence(COEFFICIENTS)
    usual = trial_from_coefficients(W, "left", radius=0.2)
    outside = trial_from_coefficients(W, "left", radius=0.2, trial_radius=0.25)
    assert (outside.amount, outside.force) == pytest.approx((0.8 * usual.amount, usual.force))
    assert outside.expected == pytest.approx(usual.expected)


@each_of(
    ("options", "words"),
    [
        ({"share": 3.0}, "would read more than the largest reading"),
        ({"radius": 0.2, "load": 100.0}, "% of the load, more than 25 %"),
    ],
)
def test_weights_too_small_or_too_large_are_named(options, words):
    assert words in trial_from_coefficients(influence(COEFFICIENTS), "left", **options).warnings[0]


def test_limit_cuts_what_follows_from_the_share():
    W = influence(COEFFICIENTS)
    cut = trial_from_coefficients(W, "left", limit=0.006)
    assert cut.amount == 0.006
    assert "would need more than the largest weight of plane 'left'" in cut.warnings[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"plane": "middle"}, "no plane 'middle'; the planes are 'left', 'right'"),
        ({"influence": influence(COEFFICIENTS, baseline=np.full((1, 2), np.nan))}, "readings are lacking"),
        ({"influence": influence([[[0.0, 1.0], [0.0, 1.0]]])}, "plane 'left' acts on no reading"),
    ],
)
def test_what_cannot_be_is_refused(options, words):
    with pytest.raises(ValueError, match=words):
        trial_from_coefficients(**{"influence": influence(COEFFICIENTS), "plane": "left", **options})


def test_force_with_an_angle_in_the_conventions_of_the_job():
    labels = Labels(weight_unit="g", weight_scale=1e3, angles="against rotation")
    options = {"phase": radians(30), "lag": expected_lag("below")}
    found = trial_from_force("A", RPM3000, 0.2, 500 * GRAVITY, labels=labels, **options)
    assert degrees(found.angle) == pytest.approx(255)  # 30 + 45 + 180
    document = found.to_dict()
    assert [document[key] for key in ("angle_deg", "angle_reach_deg", "force_percent")] == pytest.approx(
        [105, 45, 10]
    )
    arrow = plot(found).lines[0]
    assert (arrow.get_xdata()[1], arrow.get_ydata()[1]) == pytest.approx((radians(105), 24.84), abs=0.005)
    with pytest.raises(ValueError, match="needs both the phase"):
        trial_from_force("A", RPM3000, 0.2, 5 * GRAVITY, phase=1.0)
