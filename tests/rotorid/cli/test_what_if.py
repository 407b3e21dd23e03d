"""`rotorid balance --weights` and `[zones]` of a job."""

import numpy as np
import pytest
from balance_sheets import turbo_job

from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"
BK = sample_data() / "bk_two_plane" / "job.toml"
PRINTED = "1=2.951@50.2; 2=2.844g@278.1°"


def rows(name, size, phase):
    return f"{name},3000,s1,{size[0]},{phase[0]}\n{name},3000,s2,{size[1]},{phase[1]}\n"


def test_weights_that_a_note_prints_leave_nothing(cli):
    """Brüel & Kjær 17-227."""
    ran = cli("balance", BK, "--errors", "2,1", "--weights", PRINTED)
    assert ran.out.startswith("Better on the bare rotor: rms 10.8 → 0.00")
    assert "1 2.951 g at 50.2°; 2 2.844 g at 278.1°" in ran.out
    found = cli("balance", BK, "--errors", "2,1", "--weights", PRINTED, "--json").json
    usual = cli("balance", BK, "--errors", "2,1", "--json").json
    assert found["rms_after_95"] == pytest.approx(usual["rms_after_95"], rel=1e-2)
    assert cli("balance", BK, "--weights", "1=2.951@230.2").out.startswith("Worse")


def test_pieces_that_a_package_prints(cli, tmp_path):
    """Huang's gas turbine in hsbalance: five pieces of 142 g make 640.2 g at 73.6°, which leave nothing."""
    W = np.array([[0.085, 0.05], [0.053, 0.071]]) * np.exp(1j * np.radians([[27, 82], [57, 15]]))
    Y = np.array([32, 105]) * np.exp(1j * np.radians([357, 346]))
    runs = "run,speed_rpm,sensor,amplitude,phase_deg\n"
    for name, readings in (("base", Y), ("t1", Y + 500 * W[:, 0]), ("t2", Y + 500 * W[:, 1])):
        runs += rows(name, np.abs(readings), np.degrees(np.angle(readings)) % 360)
    (tmp_path / "runs.csv").write_text(runs)
    (tmp_path / "weights.csv").write_text("run,plane,mass_g,angle_deg\nt1,A,500,0\nt2,E,500,0\n")
    pieces = "A=142g@37.5+142@52.5+0.142kg@75+142@97.5+142@105; E=1122.836g@165.2"
    ran = cli("balance", tmp_path / "runs.csv", tmp_path / "weights.csv", "--weights", pieces)
    assert "A 640.2 g at 73.6°; E 1123 g at 165.2°" in ran.out
    assert float(ran.out.split(" → ")[1].split()[0]) < 0.2


def test_pieces_in_holes_are_judged_as_those_of_split(cli):
    job = TURBO / "holes.toml"
    split = cli("balance", job, "--split", "--json").json["mounting"]
    holes = {}
    for row in split["holes"]:
        holes.setdefault(row["plane"], []).append(f"{row['mass']}#{row['hole']}")
    given = ";".join(f"{plane}={'+'.join(each)}" for plane, each in holes.items())
    found = cli("balance", job, "--weights", given, "--limit", "5", "--json").json
    assert found["rms_after"] == pytest.approx(split["rms_after"])
    assert found["verdict"]["verdict"] in ("pass", "not decidable")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--weights", "left=3"), "'3': a weight at an angle or in a hole, such as"),
        (("--weights", "lft=3@4"), "did you mean 'left'?"),
        (("--weights", "left=1g@4"), "converts only with --radius or radius_mm"),
        (("--weights", "left=3#9"), "no hole 9 in plane 'left': the job states none"),
        (("--weights", "left=-3@9"), "a value above 0"),
        (("--weights", "left=3@4", "--ridge", "0.1"), "--ridge means nothing with --weights"),
    ],
)
def test_what_is_refused(cli, options, words):
    ran = cli("balance", TURBO / "job.toml", *options)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert words in ran.err


def test_a_check_run_counts_with_refine_or_not_at_all(cli):
    given = "--weights", "left=423@168.9", "--json"
    jobs = ("job.toml",), ("checked.toml",), ("checked.toml", "--refine")
    plain, ignored, counted = (cli("balance", TURBO / job[0], *job[1:], *given).json for job in jobs)
    assert plain["residuals"] == ignored["residuals"] != counted["residuals"]


def test_zones_before_predicted_and_of_the_check_run(cli, tmp_path):
    boundaries = "[zones]\nboundaries_um_rms = [1.76776695297, 10, 15]\n"  # 5, 28.3 and 42.4 µm pp
    own = '[sensors."probe 1"]\nzones_um_pp = [0.1, 0.5, 20]\n'
    path = turbo_job(tmp_path, boundaries + own, "checked.toml")
    found = cli("balance", path, "--json", "--report", tmp_path / "sheet.html").json
    rows = zip(found["zones"]["readings"], found["residuals"], found["check"]["readings"], strict=True)
    for zones, predicted, check in rows:
        limits = (0.1, 0.5, 20) if zones["sensor"] == "probe 1" else (5, 20 * 2**0.5, 30 * 2**0.5)
        sizes = {"now": predicted["before"], "predicted": predicted["after"], "check": check["achieved"]}
        assert {key: "ABCD"[sum(size > one for one in limits)] for key, size in sizes.items()} == {
            key: zones[key] for key in sizes
        }
    now, predicted, most, check = found["zones"]["worst"].values()
    more = f" (95 %: {most})" if most > predicted else ""
    said = f"Zone D now, {predicted} predicted{more}, {check} in the check run: the worst of 20 readings"
    assert now == "D"
    assert said in " ".join(cli("balance", path).out.split())
    assert "Zone D now" in (tmp_path / "sheet.html").read_text()
    what_if = cli("balance", turbo_job(tmp_path, boundaries), "--weights", "left=423@168.9")
    assert "Zone D now, C predicted" in what_if.out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("boundaries_mm_s_rms = [2.3, 4.5, 7.1]", "converts to um_pp"),
        ("boundaries_um = [5, 3, 7]", "three boundaries in rising order"),
    ],
)
def test_zones_that_cannot_be(cli, tmp_path, text, words):
    ran = cli("balance", turbo_job(tmp_path, f"[zones]\n{text}\n"))
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert words in ran.err


def test_a_check_run_typed_as_a_run_is_named_with_its_place(cli, tmp_path):
    """The page of a newcomer: the run with the proposed weights in runs.csv, without its weights."""
    runs = (BK.parent / "runs.csv").read_text() + rows("check", (0.4, 0.5), (10, 20)).replace(",s", ",")
    (tmp_path / "runs.csv").write_text(runs)
    (tmp_path / "weights.csv").write_text((BK.parent / "weights.csv").read_text())
    ran = cli("balance", tmp_path / "runs.csv", tmp_path / "weights.csv")
    said = ran.out + ran.err
    assert 'a check run goes into a table of its own, check = "check.csv"' in " ".join(said.split())
    assert "e+0" not in said
    assert "in run 'check'" in " ".join(said.split())


def test_errors_between_runs_are_told_as_they_were_stated(cli, tmp_path):
    path = turbo_job(tmp_path, "run_percent = 1\nrun_floor = 0.25\n")
    said = " ".join(cli("balance", path, "--table").out.split())
    assert "from run to run: 1 %, 0.25 µm pp (stated)" in said


def test_weights_beyond_what_the_job_allows_are_warned_of(cli, tmp_path):
    limits = "[planes.left]\nmax_unbalance_g_mm = 400\nforbidden_deg = [[160, 175]]\n"
    job = turbo_job(tmp_path, limits)
    beyond = "423 g·mm at 168.9° in plane 'left' is more than the largest weight there, 400 g·mm"
    arc = "423 g·mm at 168.9° in plane 'left' stands where the job forbids weights (forbidden_deg)"
    given = "--weights", "left=423@168.9"
    assert cli("balance", job, *given, "--json").json["warnings"][:2] == [beyond, arc]
    assert "is more than the largest weight" in " ".join(cli("balance", job, *given).out.split())
    assert cli("balance", job, "--weights", "left=400@175;right=999@170", "--json").json["warnings"] == []


def test_weights_of_a_plane_add_however_they_are_written(cli):
    job = TURBO / "holes.toml"
    one = cli("balance", job, "--weights", "left=150#1+150#2; right=5@20", "--json").json
    assert (
        cli("balance", job, "--weights", "left=150#1; right=5@20; left=150#2", "--json").json["weights"]
        == (one["weights"])
    )
    assert "there is no hole 13 in plane 'left': holes are 1 to 12" in (
        cli("balance", job, "--weights", "left=3#13").err
    )


def test_after_a_check_run_the_weights_are_still_those_of_the_bare_rotor(cli):
    first = cli("balance", TURBO / "checked.toml", "--weights", "left=400@170").out.partition("\n")[0]
    assert "on the bare rotor" in first
