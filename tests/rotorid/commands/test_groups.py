"""Jobs with groups of planes: the printed answer, a couple alone to its check run, and messages."""

import numpy as np
import pytest
from tables_data import RUNS, complaints, write_book, write_csv

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.files import read_job
from rotorid.samples import sample_data

STATIC_COUPLE = sample_data() / "bk_two_plane" / "static_couple.toml"
COUPLE = '[groups.couple]\nplanes = { 1 = "1@0", 2 = "1@180" }\n'
WEIGHTS = [["run", "plane", "mass_g", "angle_deg"], ["trial 1", "couple", 2.5, 30]]
TURN = np.exp(1j * np.radians(30))


@pytest.fixture
def job(tmp_path):
    """Writes the job of these lines; one trial run, with a couple."""
    write_csv(tmp_path / "runs.csv", RUNS[:5])
    write_csv(tmp_path / "weights.csv", WEIGHTS)

    def write(lines, head='weights = "weights.csv"\nphase = "lead"\nangles = "with rotation"\n'):
        (tmp_path / "job.toml").write_text(f'runs = "runs.csv"\n{head}{lines}', encoding="utf-8")
        return tmp_path / "job.toml"

    return write


def vectors(rows):
    return np.array([row["mass"] * np.exp(1j * np.radians(row["angle_deg"])) for row in rows])


@pytest.mark.parametrize("planes", [None, "1,2"])
def test_trial_weights_in_pairs_give_the_printed_weights(planes):
    """Of Brüel & Kjær 17-227, 2.951 g at 50.2° and 2.844 g at 278.1°, which single weights give too."""
    made = balance(STATIC_COUPLE, BalanceOptions(planes=planes)).to_dict()
    printed = np.array([2.951, 2.844]) * np.exp(1j * np.radians([50.2, 278.1]))
    np.testing.assert_allclose(vectors(made["corrections"]), printed, atol=3e-3)
    parts = [printed.sum() / (1 if planes else 2), np.subtract(*printed) / 2]
    np.testing.assert_allclose(vectors(made["parts"]), parts, atol=5e-3)


def test_a_couple_from_its_run_to_its_check(job, tmp_path):
    """One trial run for two planes; what it does is stored, and a check run counts with it."""
    made = balance(job(COUPLE), BalanceOptions(method="least-squares"))
    Y = np.array([[a * np.exp(1j * np.radians(p)) for *_, a, p in RUNS[k : k + 2]] for k in (1, 3)])
    W = (Y[1] - Y[0]) / (2.5 * TURN)
    wanted = np.array([-1, 1]) * np.vdot(W, Y[0]) / np.vdot(W, W)
    np.testing.assert_allclose(vectors(made.to_dict()["corrections"]), wanted, rtol=1e-9)
    with pytest.raises(ValueError, match="in 'couple' only, which does not tell what '1' would do"):
        balance(job(COUPLE), BalanceOptions(planes="1"))
    (tmp_path / "w.json").write_bytes(made.files[".json"](tmp_path / "w.json"))
    stored = balance(job('influence = "w.json"\n' + COUPLE), BalanceOptions(method="least-squares"))
    np.testing.assert_allclose(vectors(stored.to_dict()["corrections"]), wanted, rtol=1e-9)
    write_csv(tmp_path / "check.csv", [RUNS[0], *(["check", *row[1:]] for row in RUNS[3:5])])
    write_csv(tmp_path / "put.csv", [WEIGHTS[0], ["check", "1", 2.5, 30], ["check", "2", 2.4, 210]])
    checked = balance(job(f'check = "check.csv"\ncheck_weights = "put.csv"\n{COUPLE}')).to_dict()
    assert checked["check"]["mounted"][0]["weights"][0]["plane"] == "couple"
    np.testing.assert_allclose(vectors(checked["left_to_do"]["mounted"]), [2.5 * TURN, -2.4 * TURN])


def test_groups_in_a_workbook_against_the_rotation(tmp_path):
    settings = [["key", "value"], ["angles", "against rotation"], ["groups.couple.planes", "1: 1; 2: 0.5@90"]]
    write_book(tmp_path / "job.xlsx", {"runs": RUNS[:5], "weights": WEIGHTS, "settings": settings})
    read = read_job(tmp_path / "job.xlsx")
    assert read.trials.planes == ("couple",)
    assert read.groups["couple"] == pytest.approx({"1": 1, "2": -0.5j})


@pytest.mark.parametrize(
    ("old", "new", "column", "expected"),
    [
        ("1@180", "0@180", "couple.planes.2", "a ratio other than 0 at an angle from -360"),
        ("groups.couple", "groups.1", "", "names of groups that no plane has, not '1'"),
        ("}\n", '}\n[groups.far]\nplanes = { 3 = "1" }', "far.planes", "planes of the job, 1 and 2, not '3'"),
    ],
)
def test_what_is_wrong_with_a_group_is_said(job, old, new, column, expected):
    (problem,) = complaints(lambda: read_job(job(COUPLE.replace(old, new))))
    assert problem.column == f"groups.{column}".strip(".")
    assert expected in problem.expected
