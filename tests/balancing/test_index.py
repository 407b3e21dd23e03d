"""Rotor and arbor apart: closed forms, the truth of drawn runs, printed cases, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from balancing import (
    ReadingErrors,
    Trials,
    UndeterminedError,
    correct,
    machine_influence,
    rotor_and_arbor,
    with_arbor,
)
from rotorid.commands.balance import balance
from rotorid.samples import sample_data

S, C, P = 2, 3, 2


def drawn(index_deg, weights, rng):
    """Runs, and (A, R, W) that they are made of."""
    A, R, W = (rng.standard_normal((S, C, *more, 2)) @ [1, 1j] for more in ((), (), (P,)))
    T, turn = np.array(weights, dtype=complex), np.exp(1j * np.radians(index_deg))
    Y = A + (R + np.einsum("scp,rp->rsc", W, T)) * turn[:, None, None]
    names = tuple(f"run {r}" for r in range(len(T)))
    errors, index = ReadingErrors(floor=0.01), np.radians(index_deg)
    return Trials(names, [100.0, 200.0], "XYZ", "12", Y, T, errors, index=index), (A, R, W)


def test_two_positions_give_the_closed_form_and_its_errors():
    trials, (A, R, W) = drawn([0, 180, 0, 90], [[0, 0], [0, 0], [2, 0], [0, 1j]], np.random.default_rng(1))
    both, Y = rotor_and_arbor(trials), trials.mean
    np.testing.assert_allclose(both.rotor.baseline, (Y[0] - Y[1]) / 2, atol=1e-12)
    np.testing.assert_allclose(both.arbor.baseline, (Y[0] + Y[1]) / 2, atol=1e-12)
    np.testing.assert_allclose(both.rotor.W, W, atol=1e-12)
    for part in both:  # half of the sum of two readings whose floor is 0.01 in every direction
        np.testing.assert_allclose(part.channels()[0, 0, :2, :2], 0.01**2 / 2 * np.eye(2), atol=1e-9)
    assert np.abs(R - both.rotor.baseline).max() < 1e-12 > np.abs(A - both.arbor.baseline).max()


def test_spare_runs_at_any_index_find_the_truth_and_weights_mend_the_rotor_alone():
    weights = [[0, 0]] * 4 + [[1, 0], [0, 1j], [1, 1]]
    trials, (A, R, W) = drawn([20, 110, 200, 290, 65, 245, 300], weights, np.random.default_rng(2))
    both = rotor_and_arbor(trials)
    np.testing.assert_allclose(both.arbor.baseline, A, atol=1e-12)
    np.testing.assert_allclose(both.rotor.baseline, R, atol=1e-12)
    document = (result := with_arbor(correct(both.rotor, method="least-squares"), both)).to_dict()
    best = np.linalg.lstsq(W.reshape(-1, P), -R.ravel(), rcond=None)[0]
    np.testing.assert_allclose(result.weights, best, atol=1e-12)
    its = [row["mass"] for row in document["arbor_unbalance"]]
    least = correct(both.arbor).weights
    np.testing.assert_allclose(its, np.abs(least), atol=1e-12)


@pytest.mark.parametrize(
    ("readings", "arbor", "rotor"),
    [
        ([0.0, 15.0], 7.5, 7.5),  # Coats 6200HS, manual p. 22: the error is half of what it shows at 180°
        ([0.0, 60.0], 30.0, 30.0),  # the same of light truck wheels, g
        ([140.0, 60.0], 100.0, 40.0),  # Universal Balancing: 10 kg on a seat 10 µm off read 100 g·mm
    ],
)
def test_printed_cases_of_a_calibrated_machine(readings, arbor, rotor):
    index, Y = np.array([0, np.pi]), np.array(readings)[:, None, None]
    bare = np.zeros((2, 0), dtype=complex)
    trials = Trials(("a", "b"), [100.0], ("left",), (), Y, bare, ReadingErrors(0.01, 0.01), index=index)
    both = rotor_and_arbor(trials, machine_influence(trials))
    result = with_arbor(correct(both.rotor), both)
    unbalances = [abs(part.weights[0]) for part in result.unbalances]
    np.testing.assert_allclose(unbalances, [rotor, arbor], rtol=1e-12)
    assert np.abs(result.weights[0] + result.unbalances[0].weights[0]) < 1e-12


def test_what_does_not_tell_rotor_and_arbor_apart_is_refused():
    rng = np.random.default_rng(3)
    for index, weights, words in (
        ([0, 360, 0, 0], [[0, 0], [0, 0], [1, 0], [0, 1]], "one index only"),
        ([0, 180, 90], [[0, 0], [1, 0], [0, 1]], "two runs without weights"),
    ):
        with pytest.raises(UndeterminedError, match=words):
            rotor_and_arbor(drawn(index, weights, rng)[0])
    trials, _ = drawn([0, 180], [[0, 0], [1, 0]], rng)
    stored = replace(machine_influence(trials), planes=("1", "2", "3"))
    with pytest.raises(ValueError, match="without weights"):
        rotor_and_arbor(trials, stored)


def machine(folder, rows, angles="with rotation", more=""):
    """A job of a calibrated machine with these rows."""
    head = "run,speed_rpm,sensor,amplitude_g_mm,phase_deg,index_deg"
    (folder / "runs.csv").write_text("\n".join([head, *rows]))
    (folder / "job.toml").write_text(f'runs = "runs.csv"\nangles = "{angles}"\n{more}')
    return folder / "job.toml"


def test_the_drawn_impeller_and_its_arbor_are_told_apart():
    outcome = balance(sample_data() / "index" / "job.toml")
    assert outcome.answer.judgement.startswith("Mount these weights on the rotor: ")
    assert "run-out" in outcome.answer.numbers
    truth = {"rotor": [(13.62, 323.3), (13.69, 79.5)], "arbor": [(4.463, 147.5), (2.186, 305.3)]}
    for part, its in truth.items():
        for row, (mass, angle) in zip(outcome.to_dict()[f"{part}_unbalance"], its, strict=True):
            assert abs(row["mass"] - mass) < 2.5 * row["mass_std"]
            assert abs(row["angle_deg"] - angle) < 2.5 * row["angle_std_deg"]


@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_unbalances_of_a_machine_count_as_the_angles_of_weights(tmp_path, angles):
    A, R = 20 * np.exp(1j * np.radians(30)), 50 * np.exp(1j * np.radians(100))
    shown = {turn: A + R * np.exp(1j * np.radians(turn)) for turn in (0, 90)}
    rows = [f"{k},900,left,{abs(z):.9f},{np.degrees(np.angle(z)):.9f},{k}" for k, z in shown.items()]
    outcome = balance(machine(tmp_path, rows, angles, "[planes.left]\nremove = true\n"))
    document = outcome.to_dict()
    assert outcome.answer.judgement.startswith("Remove this material from the rotor: ")
    assert document["corrections"][0]["remove_at_deg"] == pytest.approx(100)
    for key, size, angle in (("rotor_unbalance", 50, 100), ("arbor_unbalance", 20, 30)):
        assert document[key][0]["mass"] == pytest.approx(size)
        assert document[key][0]["angle_deg"] == pytest.approx(angle)


@pytest.mark.parametrize(
    ("more", "rows", "words"),
    [
        ("", ["a,900,left,1,0,0", "a,900,right,1,0,9"], "row 3.*one index a run"),
        ("", ["a,900,left,1,0,0", "b,900,left,1,0,"], "row 3, column index_deg"),
        ("", ["a,900,left,1,0,0", "b,900,left,2,0,360"], "one index only"),
        ('check = "runs.csv"', ["a,900,left,1,0,0", "b,900,left,2,0,180"], "further run"),
    ],
)
def test_an_index_that_cannot_be_is_refused(tmp_path, more, rows, words):
    with pytest.raises(ValueError, match=words):
        balance(machine(tmp_path, rows, more=more))
