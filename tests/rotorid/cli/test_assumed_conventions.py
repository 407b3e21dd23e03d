"""What nobody says about phases and angles: said first, with the other answer beside it; the runs are asked.

One machine, Y = Y₀ + W T, is written down by a shop with its own instrument and its own degree tape, and read
without a word about either, or with the wrong one.
"""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import write_csv

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.files import write_influence

RNG = np.random.default_rng(15)
SPEEDS, SENSORS, PLANES = (1200, 1800), ("A", "B"), ("left", "right")
W = RNG.normal(size=(2, 2, 2)) + 1j * RNG.normal(size=(2, 2, 2))
BEST = np.array([3.1 * np.exp(0.9j), 2.2 * np.exp(-1.7j)])
"""What balances it, with the rotation."""
Y0 = -W @ BEST

ON_AXIS = [{}, {"left": (3, 0)}, {"right": (4, 180)}]
OFF_AXIS = [{}, {"left": (3, 40)}, {"right": (4, 250)}]
TELLING = [*OFF_AXIS, {"left": (3, 150)}, {"right": (4, 10)}]


def shop(folder, runs, phase="lead", angles="with", noise=0.0, seed=0):
    """Write runs and weights; the angles of `runs` are those on the shop's tape."""
    turn, sign = (1 if angles == "with" else -1), (1 if phase == "lead" else -1)
    rng = np.random.default_rng(seed)
    readings = [["run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"]]
    weights = [["run", "plane", "mass_g", "angle_deg"]]
    for r, mounted in enumerate(runs):
        T = [mounted.get(p, (0, 0)) for p in PLANES]
        T = np.array([m * np.exp(1j * turn * np.radians(a)) for m, a in T])
        weights += [[f"r{r}", p, float(m), float(a)] for p, (m, a) in mounted.items()]
        for s, c in np.ndindex(2, 2):
            y = Y0[s, c] + W[s, c] @ T
            y *= 1 + noise * complex(*rng.normal(size=2))
            place = f"r{r}", SPEEDS[s], SENSORS[c]
            readings.append([*place, float(abs(y)), float(sign * np.degrees(np.angle(y)) % 360)])
    write_csv(folder / "runs.csv", readings)
    write_csv(folder / "weights.csv", weights)
    return folder / "runs.csv", folder / "weights.csv"


def on_the_tape(rows, angles):
    """Printed weights as they stand on the rotor."""
    turn = 1 if angles == "with" else -1
    return np.array([row["mass"] * np.exp(1j * turn * np.radians(row["angle_deg"])) for row in rows])


def said(phase=None, angles=None):
    words = () if phase is None else ("--phase", phase)
    return words if angles is None else (*words, "--angles", f"{angles} rotation")


@pytest.mark.parametrize("runs", [ON_AXIS, OFF_AXIS], ids=["0 and 180", "other angles"])
@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("angles", ["with", "against"])
def test_one_of_both_answers_is_right(cli, tmp_path, runs, phase, angles):
    """Whatever the shop does: with nothing said, the right numbers stand in one of the two columns."""
    files = shop(tmp_path, runs, phase, angles)
    document = cli("balance", *files, "--json").json
    assumed = ["phase"] if runs is ON_AXIS else ["phase", "angles"]
    assert document["conventions"]["assumed"] == assumed
    other = document["other_readings"]
    assert {row["if"] for row in other} == {"lag" if runs is ON_AXIS else "lag or against"}
    together = (phase == "lead") == (angles == "with")
    right = document["corrections"] if together else other
    np.testing.assert_allclose(on_the_tape(right, angles), BEST, rtol=1e-6)
    wrong = other if together else document["corrections"]
    assert np.abs(on_the_tape(wrong, angles) - BEST).max() > 0.1 * np.abs(BEST).max()
    if runs is ON_AXIS:
        for one, two in zip(document["corrections"], other, strict=True):
            assert two["mass"] == pytest.approx(one["mass"], rel=1e-9)
            assert (one["angle_deg"] + two["angle_deg"] + 180) % 360 == pytest.approx(180, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("errors", [(), ("--errors", "2,1.15")])
def test_redundant_runs_contradict_a_wrong_word(cli, tmp_path, seed, errors):
    """Stated or assumed, phase or angles: the first warning names it, with both χ²."""
    files = shop(tmp_path, TELLING, "lag", "with", noise=0.02, seed=seed)
    for given, own, other in (
        ((None, "with"), "lead", "lag"),
        (("lead", "with"), "lead", "lag"),
        (("lag", "against"), "lag", "lead"),
        (("lead", None), "with rotation", "against rotation"),
    ):
        outcome = cli("balance", *files, *said(*given), *errors, "--json")
        if outcome.code == 2:  # the wrong word may make a trial weight seem without effect: told all the same
            assert f"these runs contradict '{own}'" in outcome.err
            continue
        test = outcome.json["convention_test"]
        assert test["verdict"] == "contradicted"
        assert test["chi_square"] > 10 * test["chi_square_other"]
        assert outcome.json["warnings"][0].startswith(f"these runs contradict '{own}'")
        assert f"'{other}' fits" in outcome.json["warnings"][0]
        assert outcome.json["judgement"]["word"] == "do not mount"
        text = cli("balance", *files, *said(*given), *errors).out
        assert text.startswith(f"Do not mount these weights: these runs contradict '{own}'")
        if given[0] is None:
            right = on_the_tape(outcome.json["other_readings"], "with")
            np.testing.assert_allclose(right, BEST, atol=0.1 * np.abs(BEST).max())


@pytest.mark.parametrize("assumed", [True, False])
def test_a_check_run_is_asked_too(cli, tmp_path, assumed):
    """Weights mounted as proposed, in the wrong place: the check run says why."""
    shop(tmp_path, ON_AXIS, "lag", noise=0.01)
    text = 'runs = "runs.csv"\nweights = "weights.csv"\n' + ("" if assumed else 'phase = "lead"\n')
    job = tmp_path / "job.toml"
    job.write_text(text, encoding="utf-8")
    proposed = cli("balance", job, "--json").json["corrections"]
    mounted = {row["plane"]: (row["mass"], row["angle_deg"]) for row in proposed}
    (tmp_path / "later").mkdir()
    checked, _ = shop(tmp_path / "later", [mounted], "lag", noise=0.01, seed=9)
    checked.rename(tmp_path / "check.csv")
    job.write_text(text + 'check = "check.csv"\n', encoding="utf-8")
    document = cli("balance", job, "--json").json
    assert document["convention_test"]["verdict"] == "contradicted"
    assert document["warnings"][0].startswith("these runs contradict 'lead'")
    first = " ".join(cli("balance", job).out.partition("\n\n")[0].split())
    assert first.startswith("Take off what is mounted; the bare rotor had")
    assert "Not as predicted: " in first


def test_stored_coefficients(cli, tmp_path):
    """A table that states its phase keeps it; the readings of the day are what may be otherwise."""
    files = shop(tmp_path, OFF_AXIS, "lag")
    stored = tmp_path / "stored.csv"
    given = BalanceOptions(phase="lag", angles="with rotation")
    write_influence(stored, balance(files, given).influence)
    assert "phase_lag_deg" in stored.read_text(encoding="utf-8")
    document = cli("balance", files[0], "--influence", stored, "--json")
    assert document.code == 2  # three runs that differ, and no weights
    day, _ = shop(tmp_path, [{}], "lag")
    document = cli("balance", day, "--influence", stored, "--json").json
    assert document["conventions"]["assumed"] == ["phase"]
    assert document["conventions"]["phase"] == "lag"
    np.testing.assert_allclose(on_the_tape(document["corrections"], "with"), BEST, rtol=1e-6)
    expected = cli("balance", day, "--influence", stored, "--phase", "lead", "--json").json["corrections"]
    for row, other in zip(expected, document["other_readings"], strict=True):
        assert (other["mass"], other["angle_deg"]) == pytest.approx((row["mass"], row["angle_deg"]))
