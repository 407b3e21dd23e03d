"""Balancing examples that others have published."""

import numpy as np
import pytest
from balancing_data import GRAM, bruel_kjaer, feese_grazier, job, polar

from balancing import Influence, Labels, correct, estimate_influence


def shown(correction):
    return [(row["mass"], row["angle_deg"]) for row in correction.to_dict()["corrections"]]


def test_two_planes_of_application_note_17_227():
    c = correct(estimate_influence(bruel_kjaer()))
    (m1, a1), (m2, a2) = shown(c)
    assert m1 == pytest.approx(2.951, rel=1e-3)
    assert a1 == pytest.approx(50.2, abs=0.05)
    assert m2 == pytest.approx(2.844, rel=1e-3)
    assert a2 == pytest.approx(278.1, abs=0.05)
    assert np.abs(c.after).max() < 1e-12


def test_one_plane_of_application_note_17_227():
    trials = job([[polar(3.4, 116)], [polar(1.8, 42)]], [[0], [2 * GRAM]])
    c = correct(estimate_influence(trials))
    [(mass, angle)] = shown(c)
    assert mass == pytest.approx(2.012, rel=1e-3)
    assert angle == pytest.approx(329.2, abs=0.05)


def test_over_determined_example_of_goodman():
    """Goodman's weights minimise |Y + W D|, as the corrections here do."""
    W = np.array([[[3, -2], [5, -2], [5, -3]]])
    Y = np.array([[1, -1, 0]])
    influence = Influence(np.array([100.0]), ("1", "2", "3"), ("A", "B"), W, labels=Labels())
    best = correct(influence, Y)
    np.testing.assert_allclose(best.weights, [0.8095, 1.476], rtol=2e-4)
    # and it is a minimum: no small change of a weight makes the sum of squares smaller
    for step in (1e-3, -1e-3, 1e-3j, -1e-3j):
        for direction in ([1, 0], [0, 1]):
            moved = best.weights + step * np.array(direction)
            assert np.linalg.norm(Y[0] + W[0] @ moved) > np.linalg.norm(best.after)


def test_trial_weights_left_in_of_feese_and_grazier():
    c = correct(estimate_influence(feese_grazier()), method="least-squares")
    (m1, a1), (m2, a2) = shown(c)
    assert m1 == pytest.approx(15.33, rel=2e-3)
    assert a1 == pytest.approx(2.9, abs=0.1)
    assert m2 == pytest.approx(6.617, rel=2e-3)
    assert a2 == pytest.approx(112.9, abs=0.1)
    assert c.mounted is not None
    assert c.mounted[0] == "run 2"
    np.testing.assert_allclose(c.to_add + c.mounted[2], c.weights, rtol=1e-12)
    text = c.summary()
    assert "weights for the bare rotor" in text
    line = next(line for line in text.splitlines() if line.startswith("  A "))
    (mass, *_), (angle, *_) = c.labels.weight(c.to_add)
    assert line.endswith(f"  {mass:.3f} at {angle:.1f}°")
    assert "add if 'run 2' stays" in text


@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_one_physical_job_in_every_convention(phase, angles):
    """The labels turn the numbers round; the weights stay where they are on the rotor."""
    labels = Labels("mm_s", 1e3, "g", 1e3, phase, angles)
    c = correct(estimate_influence(bruel_kjaer(labels=labels)))
    (m1, a1), (m2, a2) = shown(c)
    sign = 1 if angles == "with rotation" else -1
    assert (m1, m2) == pytest.approx((2.951, 2.844), rel=1e-3)
    assert a1 == pytest.approx(sign * 50.19 % 360, abs=0.01)
    assert a2 == pytest.approx(sign * 278.12 % 360, abs=0.01)
    first = c.to_dict()["residuals"][0]
    assert first["before"] == pytest.approx(7200)
    assert first["before_phase_deg"] == pytest.approx(238 if phase == "lead" else 122)
    assert c.to_dict()["conventions"]["phase"] == phase
    assert c.to_dict()["conventions"]["angles"] == angles
