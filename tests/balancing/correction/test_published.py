"""Balancing examples that others have published: what is said of them; their numbers are in tests/book."""

import numpy as np
import pytest
from balancing_data import bruel_kjaer, feese_grazier

from balancing import Influence, Labels, correct, estimate_influence


def shown(correction):
    return [(row["mass"], row["angle_deg"]) for row in correction.to_dict()["corrections"]]


def test_two_planes_of_application_note_17_227_are_solved_exactly():
    assert np.abs(correct(estimate_influence(bruel_kjaer())).after).max() < 1e-12


def test_over_determined_example_of_goodman():
    """Goodman's weights minimise |Y + W D|, as the corrections here do."""
    W = np.array([[[3, -2], [5, -2], [5, -3]]])
    Y = np.array([[1, -1, 0]])
    influence = Influence(np.array([100.0]), ("1", "2", "3"), ("A", "B"), W, labels=Labels())
    best = correct(influence, Y)
    # no small change of a weight makes the sum of squares smaller
    for step in (1e-3, -1e-3, 1e-3j, -1e-3j):
        for direction in ([1, 0], [0, 1]):
            moved = best.weights + step * np.array(direction)
            assert np.linalg.norm(Y[0] + W[0] @ moved) > np.linalg.norm(best.after)


def test_trial_weights_left_in_of_feese_and_grazier():
    c = correct(estimate_influence(feese_grazier()), method="least-squares")
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
    sign = 1 if angles == "with rotation" else -1
    plain = correct(estimate_influence(bruel_kjaer()))
    for (mass, angle), (m, a) in zip(shown(c), shown(plain), strict=True):
        assert mass == pytest.approx(m, rel=1e-12)
        assert angle == pytest.approx(sign * a % 360, abs=1e-9)
    first = c.to_dict()["residuals"][0]
    assert first["before"] == pytest.approx(7200)
    assert first["before_phase_deg"] == pytest.approx(238 if phase == "lead" else 122)
    assert c.to_dict()["conventions"]["phase"] == phase
    assert c.to_dict()["conventions"]["angles"] == angles
