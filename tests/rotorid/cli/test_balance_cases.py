"""Jobs on which the program was found wrong, and what it should say of them (tests/data/balance_cases)."""

from itertools import product
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
    assert first(ran).startswith("Determined in part: planes 'A' and 'B' together do what")
    assert "Mount" not in ran.out
    rows = cli("balance", JOBS / "near_alike/job.toml", "--json").json["corrections"]
    truth = np.array([10.7, 11.9]) * np.exp(1j * np.radians([56, 109]))
    for row, off in zip(rows, vectors(rows) - truth, strict=True):
        distance = np.linalg.solve(row["covariance"], [off.real, off.imag]) @ [off.real, off.imag]
        assert distance < 6  # 95 %


def test_where_no_set_of_pieces_is_enough_that_is_said_with_how_near_the_best_it_is(cli):
    """Every set that the stock allows is tried: a 4 g and two 8 g in P1, a 4 g and an 8 g in P2."""
    job = JOBS / "pieces_checked/job.toml"
    ran = cli("balance", job, "--split")
    assert "No set of pieces is enough: these are the fewest that leave 1.2 times the least." in ran.out
    size, phase = np.loadtxt(job.with_name("runs.csv"), delimiter=",", skiprows=1, usecols=(3, 4)).T
    y, *trials = (size * np.exp(1j * np.radians(phase))).reshape(3, 2)
    W = (np.array(trials).T - y[:, None]) / 10
    hole = np.exp(1j * np.radians(60 * np.arange(6)))

    def sums(*pieces):
        each = product(*(range(-1, 6) for _ in pieces))  # -1: left out
        sets = [[(p, h) for p, h in zip(pieces, one, strict=True) if h >= 0] for one in each]
        return [
            sum((p * hole[h] for p, h in one), 0j) for one in sets if len({h for _, h in one}) == len(one)
        ]

    D = np.array(list(product(sums(4, 8, 8), sums(4, 8))))
    rms = np.sqrt(np.mean(np.abs(y + D @ W.T) ** 2, axis=1))
    assert cli("balance", job, "--split", "--json").json["mounting"]["rms_after"] < 1.2 * rms.min()


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
    assert ("--refine" in options) or "As predicted: " in said
    assert said.startswith("Done")
    assert "by --split: P1: 4 in hole 1; 8 in hole 6 · P2: 4 in hole 3" in said
    assert "Mount" not in ran.out


def test_weighted_readings_and_a_largest_weight_have_the_best_place(cli):
    """About 167°, where χ² is least; a loop of fixed steps ended at 184°."""
    folder = JOBS / "weighted_limit"
    errors = ("--errors", "10,0.3", "--max-mass", "2.1007779985187103g")
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
    (line,) = ran.err.splitlines()
    assert line.startswith("rotorid: no run separates plane 'TE' from plane 'CE'")
    assert line.endswith("add runs with a weight in only one of them")


@pytest.mark.parametrize("runs", ["blank.csv", "na.csv"])
def test_phases_that_are_missing_are_no_zeros_but_unknown(cli, runs):
    ran = cli("balance", JOBS / "no_phase" / runs, JOBS / "no_phase/weights.csv")
    assert ran.code == 0
    assert first(ran).startswith(
        "Measure again: the amplitudes are impossible: the root mean square of three"
    )


def test_limits_that_no_weights_are_sure_to_keep_ask_for_no_more_pieces(cli):
    """Errors may leave 1.9 mm/s of any weights, the limit is 0.5: it was 12 pieces, 32 g, for 23.5 g."""
    job = JOBS / "uncertain_limits/job.toml"
    ran = cli("balance", job, "--split")
    assert "Not decidable (prediction): 2 of 2 limits open" in first(ran)
    assert "No set of pieces is enough" not in ran.out
    found = cli("balance", job, "--split", "--json").json["mounting"]
    assert found["pieces"] <= 5
    assert found["max_after"] < 0.5


def test_what_is_left_is_that_of_the_last_check_run(cli):
    """Root mean squares 0.361 and 0.112 of two check runs, which are not told as one."""
    ran = cli("balance", JOBS / "two_checks/job.toml")
    assert "As predicted: with the weights rms 2.28 → 0.112 mm/s rms" in first(ran)


def test_a_trim_is_of_pieces_where_the_mounted_ones_are_in_holes(cli, tmp_path):
    """Weights of the last check run at the angles of holes take these; others must be named."""
    for name in ("job.toml", "runs.csv", "weights.csv", "check.csv", "check_weights.csv"):
        (tmp_path / name).write_bytes((JOBS / "two_checks" / name).read_bytes())
    for options in ([], ["--split"]):
        found = cli("balance", tmp_path / "job.toml", *options).out
        assert found.startswith("Trim; ")
        assert "L: 1 in holes 5, 12" in found.partition("Trim with pieces, in g:\n")[2]
    weights = tmp_path / "check_weights.csv"
    weights.write_text(weights.read_text().replace("L,5,240", "L,5,244"))
    for options in ([], ["--split"]):
        ran = cli("balance", tmp_path / "job.toml", *options)
        answer = first(ran)
        assert answer.startswith("Trim; ")
        assert " add " in ran.out
        assert "not as pieces: the holes in which weights of run 'check 2' stand are not named" in answer
