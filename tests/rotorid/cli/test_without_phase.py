"""`rotorid balance` of runs without phases: every way in which tables lack them, and what is refused."""

import cmath
import shutil

import pytest

from rotorid.samples import sample_data

READ = (8.0, 11.05, 3.82, 15.09)
ROWS = [f"{run},1480,fan,{a}" for run, a in zip("0123", READ, strict=True)]
WEIGHTS = "run,plane,mass_g,angle_deg\n" + "".join(f"{k + 1},P,4.5,{120 * k}\n" for k in range(3))
HEAD = "run,speed_rpm,sensor,amplitude_mm_s"
TABLES = {
    "no column": [HEAD, *ROWS],
    "blank": [f"{HEAD},phase_deg", *(f"{row}," for row in ROWS)],
    "zero": [f"{HEAD},phase_deg", *(f"{row},0" for row in ROWS)],
    "a column for each sensor": [
        "Run;Speed (rpm);Fan (mm/s pk);Motor (mm/s pk)",
        *(f"{run};1480;{a};{2 * a:.2f}" for run, a in zip("0123", READ, strict=True)),
    ],
}


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "weights.csv").write_text(WEIGHTS)
    return tmp_path


def document(cli, *words):
    return cli("balance", *words, "--json").json


@pytest.mark.parametrize("name", TABLES)
def test_a_table_without_phases_in_any_layout(name, files, cli):
    (files / "runs.csv").write_text("\n".join(TABLES[name]) + "\n")
    made = document(cli, "runs.csv", "weights.csv")
    assert made["method"] == "without phase"
    assert made["corrections"][0]["mass"] == pytest.approx(4.77, abs=0.01)
    assert made["corrections"][0]["angle_deg"] == pytest.approx(91.6, abs=0.05)
    assert made["conventions"]["assumed"] == []
    assert made["conventions"]["phase"] is None
    assert (made["next_run"] is None) == (made["judgement"]["word"] == "mount")
    assert any("all phases are 0" in words for words in made["warnings"]) == (name == "zero")


def test_some_phases_are_an_error(files, cli):
    rows = [f"{HEAD},phase_deg", f"{ROWS[0]},", *(f"{row},30" for row in ROWS[1:])]
    (files / "runs.csv").write_text("\n".join(rows) + "\n")
    ran = cli("balance", "runs.csv", "weights.csv")
    assert ran.code == 2
    assert "row 2, column phase_deg" in ran.err


def test_options_without_meaning_are_refused_in_one_message(files, cli):
    (files / "runs.csv").write_text("\n".join(TABLES["no column"]) + "\n")
    words = [
        "--weights",
        "P=1@2",
        "--coefficients",
        "measured",
        "--method",
        "minmax",
        "--grade",
        "G2.5",
        "--limit",
        "3",
        "--refine",
    ]
    ran = cli("balance", "runs.csv", "weights.csv", *words)
    message = ran.err
    assert ran.code == 2
    for word in ("--weights", "--coefficients", "--method", "--grade", "--limit", "--refine"):
        assert word in message
    assert message.count("\n") == 1


def test_a_largest_weight_pictures_and_pages(files, cli):
    (files / "runs.csv").write_text("\n".join(TABLES["no column"]) + "\n")
    at = ("runs.csv", "weights.csv", "--max-mass", "4g", "--errors", "5,5")
    made = document(cli, *at)
    assert made["corrections"][0]["mass"] == pytest.approx(4.0)
    assert made["errors"] == {"amplitude_percent": 5.0, "origin": "stated"}
    assert made["rms_after"] > 1.0
    files_of = ("--plot", "p.svg", "--report", "p.html", "--output", "w.csv")
    assert "Mount 4 g at 91.6° in plane 'P'" in cli("balance", *at, *files_of).out
    assert "solution 1" in (files / "p.svg").read_text()
    assert "Mount 4 g" in (files / "p.html").read_text()
    assert (files / "w.csv").read_text().startswith("solution,plane,mass")
    assert "no influence coefficients" in cli("balance", *at, "--output", "w.json").err


@pytest.mark.parametrize("command", ["unbalance job.toml --stations 1", "trial-weight job.toml"])
def test_other_commands_need_phases(command, tmp_path, monkeypatch, cli):
    shutil.copytree(sample_data() / "no_phase", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    ran = cli(*command.split())
    assert ran.code == 2
    assert "no phases" in ran.err


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("[sensors.fan]\nlimit_mm_s = 1", "limits of sensors"),
        ("[zones]\nboundaries_mm_s = [1, 2, 3]", "zones"),
    ],
)
def test_parts_of_a_job_without_meaning_are_refused(line, words, tmp_path, cli):
    shutil.copytree(sample_data() / "no_phase", tmp_path, dirs_exist_ok=True)
    job = tmp_path / "job.toml"
    job.write_text(f"{job.read_text()}{line}\n")
    ran = cli("balance", job)
    assert ran.code == 2
    assert words in ran.err


def test_a_further_run_has_its_weight_in_a_hole_that_had_none(tmp_path, cli):
    for name, kept in (("runs.csv", 4), ("weights.csv", 3), ("job.toml", 9)):
        lines = (sample_data() / "no_phase" / name).read_text().splitlines()[:kept]
        (tmp_path / name).write_text("\n".join([*lines, ""]))
    job = tmp_path / "job.toml"
    job.write_text(f"{job.read_text()}[planes.fan]\nholes_deg = [0, 100, 200, 300]\n")
    assert "Make this run: 4.5 g at 200.0° (hole 3) in plane 'fan' alone." in cli("balance", job).out
    assert document(cli, job)["next_run"]["hole"] == "3"


HOLES = "[planes.P]\nholes = 12\navailable_g = [1, 2]\nper_hole = 2\n"


@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_pieces_stand_in_the_holes_of_the_job(angles, files, cli):
    """Angles and holes count as those of the job, whichever way that is."""
    (files / "runs.csv").write_text("\n".join(TABLES["no column"]) + "\n")
    job = f'runs = "runs.csv"\nweights = "weights.csv"\nangles = "{angles}"\n{HOLES}'
    (files / "job.toml").write_text(job)
    assert "In holes: --split." in cli("balance", "job.toml").out
    shown = cli("balance", "job.toml", "--split").out
    assert "In holes of P: 2 × 2 g in hole 4 (90°); error 16 % of this weight." in shown
    made = document(cli, "job.toml", "--split")
    (weight,) = made["corrections"]
    turn = [
        row["mass"] * cmath.exp(1j * cmath.pi * row["angle_deg"] / 180)
        for row in made["mounting"]["P"]["holes"]
    ]
    wanted = weight["mass"] * cmath.exp(1j * cmath.pi * weight["angle_deg"] / 180)
    assert abs(sum(turn) - wanted) < 0.2 * abs(wanted)
    assert all(
        row["angle_deg"] == pytest.approx(30 * (int(row["hole"]) - 1))
        for row in made["mounting"]["P"]["holes"]
    )


def test_material_is_taken_away_at_its_holes(files, cli):
    (files / "runs.csv").write_text("\n".join(TABLES["no column"]) + "\n")
    job = f'runs = "runs.csv"\nweights = "weights.csv"\n{HOLES}remove = true\n'
    (files / "job.toml").write_text(job)
    made = document(cli, "job.toml", "--split")
    angles = {row["hole"]: row["angle_deg"] for row in made["mounting"]["P"]["holes"]}
    assert angles
    assert all(angle == pytest.approx(30 * (int(hole) - 1)) for hole, angle in angles.items())
    assert abs(made["corrections"][0]["angle_deg"] - 271.6) < 0.1
    assert angles.keys() <= {"9", "10", "11"}


def test_pieces_need_holes(files, cli):
    (files / "runs.csv").write_text("\n".join(TABLES["no column"]) + "\n")
    ran = cli("balance", "runs.csv", "weights.csv", "--split")
    assert ran.code == 2
    assert "leave --split (no plane has holes) away" in ran.err
