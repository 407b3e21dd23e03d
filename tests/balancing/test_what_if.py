"""What given weights leave, zones, and corrections that make it worse where they were not made for."""

import sys
from dataclasses import replace
from functools import partial

import fem_rotors
import numpy as np
import pytest
from balancing_data import GRAM, complex_normal, noisy, rms, synthetic
from repetitions import repetitions

from balancing import (
    Labels,
    ReadingErrors,
    correct,
    estimate_influence,
    mode_made_worse,
    model_influence,
    what_if,
    zones_of,
)
from fem import Support, critical_speeds

ERRORS = ReadingErrors(0.02, 0.02)


@pytest.fixture(scope="module")
def job():
    rng = np.random.default_rng(5)
    exact, W, Y0 = synthetic(rng)
    readings = noisy(rng, exact.readings[0], ERRORS)
    return estimate_influence(replace(exact, readings=readings[None], errors=ERRORS)), W, Y0


def test_weights_of_a_correction_are_predicted_as_by_the_correction(job):
    c = correct(job[0])
    made = what_if(job[0], dict(zip(c.planes, c.weights, strict=True)))
    for name in ("before", "after", "after_covariance", "within", "check_rms"):
        np.testing.assert_allclose(getattr(made, name), getattr(c, name), rtol=1e-12)
    assert made.word == ("better" if c.check_rms <= 0.9 * rms(c.before) else "hardly different")


def test_other_weights_leave_what_the_machine_does(job):
    influence, W, Y0 = job
    D = np.array([0, 3 * GRAM * np.exp(2j)])
    made = what_if(influence, {"B": D[1]}, speeds=influence.speeds[1:])
    true = (Y0 + W @ D)[1:]
    assert np.all(np.abs(made.after - true) < made.within / made.labels.vibration_scale)
    assert made.word == ("better" if rms(true) < rms(Y0[1:]) else "worse")
    rows = made.to_dict()["residuals"]
    assert [row["after"] for row in rows] == pytest.approx(np.abs(made.after).ravel())
    assert what_if(influence, {}).word == "hardly different"
    with pytest.raises(ValueError, match="there is no plane 'C'"):
        what_if(influence, {"C": 1.0})


def test_one_draw_far_off_widens_nothing(job, monkeypatch):
    module, influence = sys.modules["balancing.what_if"], job[0]
    off = complex_normal(np.random.default_rng(1), (100, 100, *influence.baseline.shape))
    off[0, 0] *= 1e4
    monkeypatch.setattr(module, "check_readings", lambda *_: iter(off))
    monkeypatch.setattr(module, "DRAWS", 10_000)
    assert np.abs(module.check_run_spread(influence, np.zeros(2))[0] - np.eye(2)).max() < 0.06


def rigid(relative=0.01, further=1.0):
    """A uniform shaft in rigid bearings, as Xie prints it (Flexible Rotor Dynamic Balancing, Fig. 4.6).

    An unbalance U at 0.1 of its length, balanced as a rigid rotor at 0.4 and 0.6: -2.5 U and 1.5 U.
    """
    shaft = fem_rotors.uniform(20, length=1.0, diameter=0.02, supports=[Support(k, 1e9) for k in (1, 21)])
    first = critical_speeds(shaft, 1).frequencies[0]
    speeds = np.array([0.03, 0.99]) * first
    um = Labels(vibration_unit="um", vibration_scale=1e6, weight_unit="kg_m")
    sensors = {"left": 1, "right": 21}
    planes = model_influence(shaft, {"P1": 9, "P2": 13}, sensors, speeds, relative_error=relative, labels=um)
    U = model_influence(shaft, {"U": 3}, sensors, speeds).W[..., 0] * np.array([[1], [further]])
    return planes, U * 8e-6 / abs(U[1, 1]), 8e-6 / abs(U[1, 1])


def test_a_rigid_correction_makes_the_first_mode_worse_and_says_so():
    planes, Y0, U = rigid()
    c = correct(planes, Y0, speeds=planes.speeds[:1])
    np.testing.assert_allclose(c.weights / U, [-2.5, 1.5], rtol=5e-3)
    after = abs(Y0 + planes.W @ c.weights)[1]
    x = np.sin(np.pi * np.array([0.1, 0.4, 0.6])) @ [1, -2.5, 1.5]
    assert after[1] / 8e-6 == pytest.approx(
        abs(x) / np.sin(0.1 * np.pi), rel=0.02
    )  # 0.309: 8 µm, 0.643: 17 µm
    (said,) = c.decision.elsewhere
    assert "these weights, which were not made for that, make it worse: " in said
    assert f" 8.00 → {after[1] * 1e6:.1f} ± " in said
    assert said in c.answer.judgement
    assert c.to_dict()["judgement"]["worse_elsewhere"] == [said]
    both = correct(planes, Y0)
    assert not both.decision.elsewhere
    assert not any("make it worse" in words for words in both.answer.judgement.splitlines())


@pytest.mark.parametrize(("relative", "further"), [(0.5, 1.0), (0.01, 10.0), (0.01, -10.0)])
def test_what_is_not_clearly_worse_is_not_said_to_be(relative, further):
    """Coefficients that err by half; ten times as much unbalance of the first mode."""
    planes, Y0, _ = rigid(relative, further)
    D = correct(planes, Y0, speeds=planes.speeds[:1], refuse=False).weights
    made = what_if(planes, dict(zip(planes.planes, D, strict=True)), Y0, planes.speeds[:1])
    assert bool(made.worse) == (relative < 0.1 and further < 0)


def test_a_mode_beyond_the_readings_is_only_called_worse_where_it_is():
    """Drawn shafts with unbalance at all nodes or at a few, by a model whose bearings err; the true mode."""
    rng, sensors, found = np.random.default_rng(8), {"l": 3, "r": 18}, []
    for _ in range(repetitions(60)):
        both = 10 ** rng.uniform(6.5, 9, 2) * rng.uniform(0.7, 1.4, (2, 2))
        supports = [[Support(node, size) for node, size in zip((3, 19), K, strict=True)] for K in both]
        shaft, true = (fem_rotors.uniform(20, diameter=0.06, supports=each) for each in supports)
        first, mode = (critical_speeds(each, 1).frequencies[0] for each in (shaft, true))
        speeds, nodes = [rng.uniform(0.2, 0.6) * min(first, mode), 0.98 * mode], rng.choice(19, 2, False) + 2
        W = model_influence(true, {str(k): k for k in range(1, 22)}, sensors, speeds).W
        U = complex_normal(rng, 21) * (rng.random(21) < rng.choice([0.3, 1.0]))
        planes = dict(zip("AB", nodes.tolist(), strict=True))
        c = correct(model_influence(shaft, planes, sensors, speeds[:1]), W[:1] @ U)
        words = mode_made_worse(c, partial(at_nodes, shaft, sensors), planes, {}, 21, first)
        found.append((bool(words), rms(W[1] @ U + W[1][:, nodes - 1] @ c.weights) > rms(W[1] @ U)))
    said, worse = np.array(found).T
    assert said.sum() >= 0.1 * worse.sum() >= 0.3
    assert worse[said].all()


def at_nodes(shaft, sensors, nodes, speeds):
    return model_influence(shaft, nodes, sensors, speeds)


def test_zones_as_they_are_printed():
    """Class II of ISO 10816, 1.12, 2.8 and 7.1 mm/s: a reading of 3.2 is in C; a boundary is below itself."""
    exact, *_ = synthetic(np.random.default_rng(0), sensors=4, speeds=1, planes=1)
    planes = what_if(estimate_influence(exact), {})
    readings = np.array([[3.2, 2.8, 1.12, 7.2j]])
    made = zones_of(planes, dict.fromkeys(planes.sensors, (1.12, 2.8, 7.1)), readings)
    assert made.letters["predicted"] == tuple("CBAD")
    assert made.to_dict()["worst"]["predicted"] == "D"
