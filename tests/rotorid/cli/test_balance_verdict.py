"""`rotorid balance` with a tolerance, limits, and check runs that refine."""

from __future__ import annotations

import numpy as np
import pytest

from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"
BK = sample_data() / "bk_two_plane" / "job.toml"
GRADE = ("--grade", "G2.5", "--rotor-mass", "50kg", "--service-speed", "3000rpm")


def test_limits_of_a_check_run_are_judged(cli):
    found = cli("balance", TURBO / "checked.toml", "--limit", "2", "--json")
    assert found.code == 0, found.err
    verdict = found.json["verdict"]
    assert verdict["verdict"] == "pass"
    tight = cli("balance", TURBO / "checked.toml", "--limit", "0.7", "--json").json["verdict"]
    assert tight["verdict"] == "fail"
    failing = [r for r in tight["rows"] if r["verdict"] == "fail"]
    assert {r["speed_rpm"] for r in failing} <= {4950, 5400}


def test_tolerance_of_planes(cli):
    two = ("--planes", "left,right")
    found = cli("balance", TURBO / "checked.toml", *two, *GRADE, "--json")
    assert found.code == 0, found.err
    rows = found.json["verdict"]["rows"]
    assert [r["name"] for r in rows if r["kind"] == "plane"] == ["left", "right"]
    # 2.5 mm/s · 50 kg / 314.16 rad/s = 397.9 g·mm, shared
    assert [r["limit"] for r in rows if r["kind"] == "plane"] == pytest.approx([198.94, 198.94], abs=0.01)
    assert "verdict" not in cli("balance", TURBO / "job.toml", "--json").json


def test_masses_need_radii(cli):
    outcome = cli("balance", BK, *GRADE)
    assert outcome.code == 2
    assert "radius_mm" in outcome.err


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--grade", "G3", *GRADE[2:]), "G2.5"),
        (GRADE[:2], "together"),
        (
            ("--grade", "G2.5", "--rotor-mass", "heavy", "--service-speed", "3000rpm"),
            "expected a number, such as 500kg",
        ),
    ],
)
def test_bad_tolerances(cli, args, words):
    outcome = cli("balance", BK, *args)
    assert outcome.code == 2
    assert words in outcome.err


def test_a_grade_is_for_two_planes(cli):
    outcome = cli("balance", TURBO / "job.toml", *GRADE)
    assert outcome.code == 2
    assert "one or two planes" in outcome.err


def test_check_runs_refine_the_coefficients(cli):
    plain = cli("balance", TURBO / "checked.toml", "--json").json
    refined = cli("balance", TURBO / "checked.toml", "--refine", "--json")
    assert refined.code == 0, refined.err
    found = refined.json
    for a, b in zip(plain["residuals"], found["residuals"], strict=True):  # the errors of the prediction
        assert np.trace(b["after_covariance"]) < 0.5 * np.trace(a["after_covariance"])
    assert found["mounted_in_last_run"]["run"] == "check"
    for mounted, add, total in zip(
        found["mounted_in_last_run"]["weights"], found["add_to_mounted"], found["corrections"], strict=True
    ):
        z = [w["mass"] * np.exp(1j * np.deg2rad(w["angle_deg"])) for w in (mounted, add, total)]
        assert z[0] + z[1] == pytest.approx(z[2], abs=1e-6)
    outcome = cli("balance", TURBO / "job.toml", "--refine")
    assert outcome.code == 2
    assert "no check runs" in outcome.err


def test_pieces_do_not_go_with_ridge(cli):
    outcome = cli("balance", TURBO / "holes.toml", "--split", "--ridge", "0.1")
    assert (outcome.code, "would undo" in outcome.err) == (2, True)


def test_the_judgement_is_that_of_the_check_run_where_there_is_one(cli):
    text = cli("balance", TURBO / "checked.toml").out
    assert text.startswith("Trim; rms 0.413 → 0.316 µm pp, below 0.33 in 95 of 100 check runs. ")
    first, table = " ".join(text.partition("\n\n")[0].split()), text.split("\n\n")[1]
    assert first.endswith("As predicted: with the weights rms 28.4 → 0.413 µm pp (0.382 predicted).")
    assert "Mount these weights" not in text
    assert "add 13.65 g·mm at 154.5°" in table
    bare = "left      423.0  168.9°"
    assert bare not in text
    assert bare in cli("balance", TURBO / "checked.toml", "--table").out
    refined = cli("balance", TURBO / "checked.toml", "--refine").out
    assert refined.startswith("Trim; ")
    assert "add 13.65 g·mm at 154.5°" in refined
    assert "Mount" not in refined


def test_limits_lead_the_prediction(cli):
    assert cli("balance", TURBO / "job.toml", "--limit", "2").out.startswith("Pass (prediction): 20 of 20 ")
