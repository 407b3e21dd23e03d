"""Jobs on which the program was found wrong, and what it should say of them (tests/data/balance_cases)."""

from pathlib import Path

import numpy as np
import pytest

JOBS = Path(__file__).parents[2] / "data/balance_cases"


def vectors(rows):
    return np.array([row["mass"] * np.exp(1j * np.radians(row["angle_deg"])) for row in rows])


def first(ran):
    return " ".join(ran.out.split("\n\n")[0].split())


def test_a_run_that_is_better_than_what_is_promised_stays(cli):
    """The support softens: run 5 reads 0.04 in/s with its 40 g."""
    said = first(cli("balance", JOBS / "already_better/job.toml"))
    assert said.startswith("Do not mount these weights: leave those of run '5' where they are, with which")
    assert "The runs do not fit one linear machine" in said


def test_amplitudes_and_phases_in_each_others_columns_are_asked_about(cli):
    outcome = cli("balance", JOBS / "exchanged/job.toml")
    assert (outcome.code, outcome.out, outcome.err.count("?")) == (2, "", 1)
    assert "are they exchanged?" in outcome.err


def test_the_region_of_planes_that_act_nearly_alike_holds_the_truth(cli):
    ran = cli("balance", JOBS / "near_alike/job.toml")
    assert "planes 'A' and 'B' together do what" in ran.out
    rows = cli("balance", JOBS / "near_alike/job.toml", "--json").json["corrections"]
    truth = np.array([10.7, 11.9]) * np.exp(1j * np.radians([56, 109]))
    for row, off in zip(rows, vectors(rows) - truth, strict=True):
        distance = np.linalg.solve(row["covariance"], [off.real, off.imag]) @ [off.real, off.imag]
        assert distance < 6  # 95 %


@pytest.mark.parametrize("options", [[], ["--split"], ["--refine"], ["--refine", "--split"]])
def test_pieces_that_were_mounted_as_proposed_are_done(cli, options):
    """They read what was predicted of them: as predicted, done, and nothing is mounted again."""
    folder = JOBS / "pieces_checked"
    pieces = cli("balance", folder / "job.toml", "--split", "--json").json["mounting"]["holes"]
    assert {(row["plane"], row["hole"], round(row["mass"], 6)) for row in pieces} == {
        ("P1", "1", 4),
        ("P1", "6", 8),
        ("P2", "3", 4),
    }
    ran = cli("balance", folder / "checked.toml", *options)
    said = first(ran)
    assert ("--refine" in options) or said.startswith("As predicted: ")
    assert "Done" in said
    assert "by --split: P1: 4.000 in hole 1; 8.000 in hole 6 · P2: 4.000 in hole 3" in said
    assert "Mount" not in ran.out


def test_weighted_readings_and_a_largest_weight_have_the_best_place(cli):
    """About 167°, where χ² is least; a loop of fixed steps ended at 184°."""
    folder = JOBS / "weighted_limit"
    errors = ("--amplitude-error", "10", "--phase-error", "0.3", "--max-mass", "2.1007779985187103g")
    job = (folder / "runs.csv", folder / "weights.csv", "--method", "weighted", *errors)
    found = cli("balance", *job, "--json").json
    assert found["chi_square"] < 33
    assert found["corrections"][0]["angle_deg"] == pytest.approx(166.7, abs=1)
    assert found["corrections"][0]["mass"] == pytest.approx(2.1007779985, rel=1e-6)
    assert "certified" not in cli("balance", *job, "--table").out


def test_pairs_of_weights_as_runs(cli):
    """A static and a couple run separate the planes; one of them alone does not, and says what would."""
    folder = JOBS / "pair"
    rows = cli("balance", folder / "runs.csv", folder / "weights.csv", "--json").json["corrections"]
    truth = np.array([500.4, 435.8]) * np.exp(1j * np.radians([251.6, 45.8]))
    np.testing.assert_allclose(vectors(rows), truth, atol=1.5)
    ran = cli("balance", folder / "runs_s.csv", folder / "weights_s.csv")
    assert ran.code == 2
    assert "add runs with a weight in only one of them" in ran.err


@pytest.mark.parametrize("runs", ["blank.csv", "na.csv"])
def test_phases_that_are_missing_are_no_zeros(cli, runs):
    ran = cli("balance", JOBS / "no_phase" / runs, JOBS / "no_phase/weights.csv")
    assert ran.code == 2
    assert "column phase_deg" in ran.err
