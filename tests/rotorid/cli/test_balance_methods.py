"""`rotorid balance` with methods, limits, models and checks; and what peers answer with silence."""

from __future__ import annotations

import pytest
from balance_sheets import turbo_job

from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"
JOB = TURBO / "job.toml"
METHODS = ("least-squares", "weighted", "minmax")
FEW_DRAWS = [pytest.param(m, marks=pytest.mark.full if m == "weighted" else ()) for m in METHODS]
"""The methods, of which `make test` leaves out the one whose errors are drawn, 4 s for each limit."""


@pytest.fixture
def answers(cli):
    def run(*args):
        outcome = cli("balance", *args, "--json")
        assert outcome.code == 0, outcome.err
        return outcome.json

    return run


def test_limits_that_leave_a_plane_nothing_ask_to_leave_it_out(cli, answers, tmp_path):
    outcome = cli("balance", JOB, "--max-mass", "middle=0")
    assert outcome.code == 2
    assert "leave the plane out" in outcome.err
    without = answers(turbo_job(tmp_path, "[planes.middle]\nuse = false\n"))["corrections"]
    assert without == answers(JOB, "--planes", "left,right")["corrections"]
    circle = cli("balance", turbo_job(tmp_path, "[planes.middle]\nforbidden_deg = [[0, 180], [180, 360]]\n"))
    assert circle.code == 2
    assert "leave plane 'middle' no angle: leave it out" in circle.err


def test_limits_that_cannot_be_met_name_the_conflict_and_the_way_out(cli, tmp_path):
    picture = tmp_path / "no.png"
    outcome = cli("balance", JOB, "--max-mass", "100", "--limit", "5", "--plot", picture)
    assert outcome.code == 2
    assert "cannot be met" in outcome.err
    assert "100 g·mm" in outcome.err
    assert "limit 5 µm pp" in outcome.err
    factor = float(outcome.err.split("relaxing all amplitude limits ")[1].split()[0])
    assert not picture.exists()
    relaxed = cli("balance", JOB, "--max-mass", "100", "--limit", f"{5.01 * factor}")
    assert relaxed.code == 0, relaxed.err
    assert cli("balance", JOB, "--max-mass", "100", "--limit", f"{4.95 * factor}").code == 2


def test_forbidden_angles_run_in_the_direction_of_the_job(answers, tmp_path):
    free = answers(JOB)["corrections"]
    at = free[0]["angle_deg"]
    arc = f"[planes.left]\nforbidden_deg = [[{at - 20:.3f}, {at + 30:.3f}]]\n"
    moved = answers(turbo_job(tmp_path, arc))["corrections"][0]
    ends = [(at - 20) % 360, (at + 30) % 360]
    assert min(abs((moved["angle_deg"] - end + 180) % 360 - 180) for end in ends) < 1e-3

    # the same rotor written against the rotation: mirrored angles, the same place
    rows = (TURBO / "weights.csv").read_text()
    assert ",0\n" in rows  # all trial weights at 0°, the same in both directions
    against = JOB.read_text().replace("with rotation", "against rotation")
    path = turbo_job(tmp_path, "")
    path.write_text(against + f"[planes.left]\nforbidden_deg = [[{-at - 30:.3f}, {-at + 20:.3f}]]\n")
    mirrored = answers(path)["corrections"][0]
    assert mirrored["mass"] == pytest.approx(moved["mass"], rel=1e-6)
    assert (mirrored["angle_deg"] + moved["angle_deg"]) % 360 == pytest.approx(0, abs=1e-3) or (
        mirrored["angle_deg"] + moved["angle_deg"]
    ) % 360 == pytest.approx(360, abs=1e-3)


def test_limit_at_a_speed_left_out_is_watched(answers, tmp_path):
    job = turbo_job(tmp_path, '[sensors."probe 4"]\nlimit = 0.2\n')
    found = answers(job, "--speeds", "1220,3600", "--method", "least-squares")
    assert any("predicted to pass its limit" in w for w in found["warnings"])


@pytest.mark.full
@pytest.mark.parametrize("weights", ['[sensors."probe 4"]\nweight = 0\n', "speed_weights"])
@pytest.mark.parametrize("method", FEW_DRAWS)
def test_weight_zero_counts_only_for_its_limit(answers, cli, tmp_path, method, weights):
    job = turbo_job(tmp_path, "" if weights == "speed_weights" else weights)
    if weights == "speed_weights":
        job.write_text('speed_weights = { "5400" = 0 }\n' + job.read_text())

    def ignored(row):
        return row["speed_rpm"] == 5400 if weights == "speed_weights" else row["sensor"] == "probe 4"

    args = (job, "--method", method)
    free = answers(*args)
    largest = max(r["after"] for r in free["residuals"] if ignored(r))
    limit = 0.97 * largest
    held = answers(*args, "--limit", f"{limit}") if weights == "speed_weights" else None
    held = held or answers(*args, "--limit", f"probe 4={limit}")
    assert all(r["after"] <= limit * (1 + 1e-9) for r in held["residuals"] if ignored(r))
    assert any("largest amplitude" in words for words in held["limits_that_bind"])
    for more in (("--planes", "left,right"), ("--max-mass", "300")):
        assert cli("balance", *args, *more).code == 0
