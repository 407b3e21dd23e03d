"""Jobs: job files, workbooks, jobs without a job file, rotor models and check runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cases import each_of
from pump_job import assert_same
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_book, write_csv

from balancing import estimate_influence
from fem import Sensor
from rotorid.files import job_from_files, read_job, read_rotor, read_trials, write_influence

LINES = """
phase = "lag"
angles = "against rotation"
speed_tolerance_percent = 1
[errors]
amplitude_percent = 2
phase_deg = 3
floor = 0.1
[planes.1]
[sensors.A]
"""
SETTINGS = [
    ["key", "value", "comment"],
    ["phase", "lag", None],
    ["angles", "against rotation", "as on the wheel"],
    ["speed_tolerance_percent", 1, None],
    ["errors.amplitude_percent", 2, None],
    ["errors.phase_deg", 3, None],
    ["errors.floor", 0.1, None],
]
SHEETS = {"runs": RUNS, "weights": WEIGHTS, "settings": SETTINGS, "planes": [["plane"], ["1"]]}


@pytest.fixture
def book(tmp_path):
    def read(**sheets):
        return read_job(write_book(tmp_path / "job.xlsx", {**SHEETS, **sheets}))

    return read


def test_a_job_file_and_a_workbook_that_say_the_same(job, book, folder):
    read = job(LINES)
    trials, errors = read.trials, read.trials.errors
    assert (trials.labels.phase, trials.labels.angles) == ("lag", "against rotation")
    assert (errors.amplitude, errors.phase) == (0.02, math.radians(3))
    assert errors.floor == pytest.approx(0.05e-6, rel=1e-15)
    assert read.files == tuple(folder / name for name in ("job.toml", "runs.csv", "weights.csv"))
    plain = read_trials(folder / "runs.csv", folder / "weights.csv")
    np.testing.assert_array_equal(trials.readings, plain.readings.conj())
    sheets = book(sensors=[["sensor"]], Sheet1=[], Notes=[["anything"]]).trials
    assert_same(sheets, trials)
    assert sheets.errors == trials.errors


def test_arguments_replace_what_the_job_says(job, folder):
    trials = job(LINES, phase="lead", angles="with rotation", amplitude_error_percent=5.0).trials
    assert (trials.labels.phase, trials.labels.angles) == ("lead", "with rotation")
    assert (trials.errors.amplitude, trials.errors.phase) == (0.05, math.radians(3))
    files = [folder / "runs.csv", folder / "weights.csv"]
    read = job_from_files(files, phase="lag", angles="against rotation", amplitude_error_percent=2.0)
    np.testing.assert_array_equal(read.trials.weights, job(LINES).trials.weights)
    assert (read.files, read.trials.errors.amplitude) == (tuple(files), 0.02)
    for wrong in ([], files[:1], files * 2):
        with pytest.raises(ValueError, match="give a job"):
            job_from_files(wrong)
    with pytest.raises(TypeError, match="run_error_percent"):
        job(LINES, run_error_percent=2)


@pytest.fixture
def stored(folder):
    influence = estimate_influence(read_trials(folder / "runs.csv", folder / "weights.csv"))
    write_influence(folder / "influence.csv", influence)
    write_csv(folder / "now.csv", RUNS[:3])
    return influence


def test_stored_coefficients(folder, stored, job):
    beside = 'runs = "now.csv"\ninfluence = "influence.csv"\n'
    for read in (
        job_from_files([folder / "now.csv"], influence=folder / "influence.csv"),
        job("[planes.2]\nmax_mass_g = 3\n", beside),
    ):
        np.testing.assert_allclose(read.influence.W, stored.W, rtol=1e-14)
        assert read.influence.labels == read.trials.labels
        assert folder / "influence.csv" in read.files
    assert tuple(read.planes) == ("1", "2")
    np.testing.assert_array_equal(read.limits.max_weight, [np.inf, 0.003])


def test_coefficients_beside_a_job_stand_in_it(folder, job):
    job()
    found = complaints(job_from_files, [folder / "job.toml"], influence="w.csv")
    the_only(found, "job.toml", None, "influence", None, 'influence = "w.csv" in the job')


@each_of(
    ("row", "column", "value", "where", "words"),
    [
        (2, "sensor", "C", "sensor", "sensor 'C', which the readings have; there are A and B"),
        (2, "speed_rpm", 1100, "speed", "speed '1100 rpm', which the readings have; there are 1000 rpm"),
        (1, "amplitude_um_pp", "amplitude_mm_s", "influence", "amplitude 'mm_s', which the readings have"),
    ],
)
def test_coefficients_that_do_not_fit(folder, stored, row, column, value, where, words):
    path = write_csv(folder / "now.csv", replaced(RUNS[:2], row, column, value))
    found = complaints(job_from_files, [path], influence=folder / "influence.csv")
    the_only(found, "influence.csv", None, where, None, f"coefficients for {words}")


@each_of(
    ("old", "new", "key", "value", "words"),
    [
        ('phase = "lag"', 'phase = "leading"', "phase", "leading", "'lead' or 'lag' (did you mean 'lead'?)"),
        ("[planes.1]", "[planes.3]", "planes.3", "3", "one of the job's planes, 1 and 2"),
        ("[planes.1]", "[planes.P2]\n[planes.1]", "planes.P2", "P2", "no trial weight in plane 'P2'"),
        ("[sensors.A]", "[sensors.a]", "sensors.a", "a", "sensors, A and B (did you mean 'A'?)"),
        ('runs = "runs.csv"', "", "runs", None, "a job, which names the runs table"),
        ('weights = "weights.csv"', "", "weights", None, "a weights table, or an influence table"),
        (LINES, "[errors]\nphase_deg = 0\n", "errors", None, "an error above 0"),
        (LINES, 'check_weights = "w.csv"\n', "check_weights", "w.csv", "the check runs too"),
    ],
)
def test_bad_jobs(job, old, new, key, value, words):
    text = 'runs = "runs.csv"\nweights = "weights.csv"\n' + LINES
    the_only(complaints(job, "", text.replace(old, new, 1)), "job.toml", None, key, value, words)


def test_problems_of_all_files_at_once(job, folder):
    write_csv(folder / "runs.csv", replaced(RUNS, 2, "phase_deg", "x"))
    write_csv(folder / "weights.csv", replaced(WEIGHTS, 2, "mass_g", 0))
    assert [p.file.rpartition("/")[2] for p in complaints(job)] == ["runs.csv", "weights.csv"]
    found = complaints(job, LINES.replace('phase = "lag"', 'phase = "lagg"').replace("= 3", '= "x"'))
    assert [p.column for p in found] == ["phase", "errors.phase_deg"]
    for name, words in (("runs.csv", "a job: a .toml file"), ("none.toml", "a file that exists")):
        the_only(complaints(read_job, folder / name), name, None, None, None, words)


@each_of(
    ("row", "column", "value", "shown", "words"),
    [
        (5, "key", None, "", "the name of a key"),
        (5, "key", "phase", "phase", "each key once (row 2 has it too)"),
        (5, "key", "planes.1.holes_deg.x", "a table", "a number: angles of the holes"),
    ],
)
def test_bad_settings_of_a_workbook(book, row, column, value, shown, words):
    found = complaints(book, settings=replaced(SETTINGS, row, column, value), planes=[["plane"]])
    at = "key" if shown in ("", value) and column == "key" else "value"
    problem = the_only(found, "job.xlsx", row, at, shown, words)
    assert "sheet 'settings'" in problem.file


@each_of(
    ("sheets", "row", "column", "value", "words"),
    [
        ({"weightss": [["x"]]}, None, None, "weightss", "did you mean 'weights'?"),
        ({"planes": [["plane"], ["1"], ["1"]]}, 3, "plane", "1", "each plane once (row 2 has it too)"),
        ({"runs": []}, None, None, None, "a sheet 'runs'"),
    ],
)
def test_bad_sheets_of_a_workbook(book, sheets, row, column, value, words):
    the_only(complaints(book, **sheets), "job.xlsx", row, column, value, words)


SHAFT = [
    ["length_m", "diameter_m", "support_stiffness_N_per_m"],
    [0.2, 0.05, 1e7],
    [0.2, 0.05, 0],
    [0.2, 0.05, 0],
    [0, 0.05, 1e7],
]
MODEL = """rotor = "rotor.toml"
[planes.1]
station = "disc"
[planes.2]
node = 3
[sensors.A]
node = 1
angle_deg = 45
[sensors.B]
station = "disc"
"""


@pytest.fixture
def rotor(folder):
    write_csv(folder / "shaft.csv", SHAFT)
    text = 'shaft = "shaft.csv"\n[[station]]\nname = "disc"\nnode = 2\n'
    (folder / "rotor.toml").write_text(text, encoding="utf-8")
    return read_rotor(folder / "rotor.toml")


def test_a_rotor_with_planes_and_sensors(job, folder, rotor):
    read = job(MODEL)
    assert (read.rotor, read.plane_nodes) == (rotor, {"1": 2, "2": 3})
    assert read.sensor_places == {"A": Sensor(1, 45.0), "B": Sensor(2, 0.0)}
    assert read.files[-2:] == (folder / "rotor.toml", folder / "shaft.csv")
    assert job('angles = "against rotation"\n' + MODEL).sensor_places["A"] == Sensor(1, -45.0)
    more = job(MODEL + "[planes.3]\nnode = 4\nmax_mass_g = 3\n")  # which only the model knows
    np.testing.assert_array_equal(more.limits.max_weight, [np.inf, np.inf, 0.003])
    write_csv(folder / "runs.csv", RUNS[:3])  # and a job that rests on its model: no weights
    radii = MODEL.replace("[planes.2]", "radius_mm = 100\n[planes.2]\nradius_mm = 50")
    for text, unit in ((MODEL, "g_mm"), (radii, "g")):
        read = job(text, 'runs = "runs.csv"\n')
        assert (read.trials.planes, read.trials.labels.weight_unit) == ((), unit)


@each_of(
    ("old", "new", "key", "value", "words"),
    [
        ('"disc"', '"dics"', "planes.1.station", "dics", "(did you mean 'disc'?); its stations are"),
        ("node = 1", "node = 7", "sensors.A.node", "7", "a node of the rotor model, from 1 to 4"),
    ],
)
def test_bad_models(job, rotor, old, new, key, value, words):
    the_only(complaints(job, MODEL.replace(old, new, 1)), "job.toml", None, key, value, words)


CHECK = [RUNS[0], ["check", 1003, "B", 1.5, 20], ["check", 1003, "A", 2.0, 30]]
CHECK_WEIGHTS = [WEIGHTS[0], ["check", "2", 1.5, 90]]
CHECKED = 'check = "check.csv"\n'
MOUNTED = CHECKED + 'check_weights = "mounted.csv"\n'


@pytest.fixture
def checked(job, folder):
    """Reads the job with a check run."""

    def read(lines=MOUNTED, check=CHECK, mounted=CHECK_WEIGHTS):
        write_csv(folder / "check.csv", check)
        write_csv(folder / "mounted.csv", mounted)
        return job(lines)

    return read


def test_check_runs(checked, folder):
    """In the job's order of nothing but names: speeds are those of the job, units convert."""
    read = checked(CHECKED)
    assert (read.check.sensors, read.check.planes, read.check_mounted) == (("B", "A"), (), False)
    np.testing.assert_array_equal(read.check.speeds, read.trials.speeds)
    alone = checked(CHECKED, [row[1:] for row in CHECK]).check  # the only run need not be named
    assert alone.runs == ("check",)
    np.testing.assert_array_equal(alone.readings, read.check.readings)
    nothing = checked(mounted=CHECK_WEIGHTS[:1]).check  # a weights table without rows says so
    assert (nothing.planes, nothing.weights.any()) == (("1", "2"), False)
    again = checked(check=replaced(CHECK, 1, "amplitude_um_pp", "amplitude_mm"))
    np.testing.assert_allclose(again.check.readings, 2e3 * read.check.readings)
    assert (again.check.labels, again.check.planes) == (again.trials.labels, ("1", "2"))
    np.testing.assert_allclose(again.check.weights, [[0, 1.5e-3j]], atol=1e-18)
    assert again.check_mounted
    assert again.files[-2:] == (folder / "check.csv", folder / "mounted.csv")


UNBALANCE = ["run", "plane", "unbalance_g_mm", "angle_deg"]
TWICE = [CHECK[0], *([row[0], speed, *row[2:]] for speed in (997, 1003) for row in CHECK[1:])]


@each_of(
    ("check", "mounted", "file", "column", "value", "words"),
    [
        (replaced(CHECK, 3, "sensor", "C"), [], "check.csv", "sensor", "C", "what the job has: A and B"),
        (
            replaced(CHECK, 1, "amplitude_um_pp", "amplitude_mm_s"),
            [],
            "check.csv",
            "amplitude",
            "mm_s",
            "what the job has: um_pp, or a unit that converts to it",
        ),
        (TWICE, [], "check.csv", "speed", "1003 rpm", "each speed of the job once"),
        (CHECK, [WEIGHTS[0], ["check", "3", 1, 0]], "mounted.csv", "plane", "3", "what the job has: 1 and 2"),
        (CHECK, [UNBALANCE, *CHECK_WEIGHTS[1:]], "mounted.csv", "weight", "g_mm", "what the job has: g, or"),
    ],
)
def test_check_runs_that_do_not_fit(checked, check, mounted, file, column, value, words):
    found = complaints(checked, MOUNTED if mounted else CHECKED, check, mounted or CHECK_WEIGHTS)
    the_only(found, file, None, column, value, words)
