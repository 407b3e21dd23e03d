"""Jobs: job files, workbooks, and jobs without a job file."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_book, write_csv

from balancing import correct, estimate_influence
from rotorid.files import job_from_files, read_job, read_trials, write_influence

JOB = """
runs = "runs.csv"
weights = "weights.csv"
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
def folder(tmp_path):
    write_csv(tmp_path / "runs.csv", RUNS)
    write_csv(tmp_path / "weights.csv", WEIGHTS)
    return tmp_path


@pytest.fixture
def job(folder):
    def read(text=JOB, **options):
        (folder / "job.toml").write_text(text, encoding="utf-8")
        return read_job(folder / "job.toml", **options)

    return read


@pytest.fixture
def book(tmp_path):
    def read(**sheets):
        return read_job(write_book(tmp_path / "job.xlsx", {**SHEETS, **sheets}))

    return read


def same(a, b):
    assert (a.runs, a.sensors, a.planes, a.labels, a.errors) == (
        b.runs,
        b.sensors,
        b.planes,
        b.labels,
        b.errors,
    )
    for name in ("speeds", "readings", "weights"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_a_job_file(job, folder):
    read = job()
    trials = read.trials
    assert (trials.labels.phase, trials.labels.angles) == ("lag", "against rotation")
    assert read.conventions.speed_tolerance_percent == 1
    assert (trials.errors.amplitude, trials.errors.phase) == (0.02, math.radians(3))
    assert trials.errors.floor == pytest.approx(0.05e-6, rel=1e-15)
    assert read.influence is None
    assert read.files == tuple(folder / name for name in ("job.toml", "runs.csv", "weights.csv"))
    plain = read_trials(folder / "runs.csv", folder / "weights.csv")
    np.testing.assert_array_equal(trials.readings, plain.readings.conj())


def test_a_workbook_is_the_same_job(job, book):
    same(book().trials, job().trials)
    same(book(sensors=[["sensor"]], Sheet1=[], Notes=[["anything"]]).trials, job().trials)


def test_defaults(job, folder):
    trials = job('runs = "runs.csv"\nweights = "weights.csv"').trials
    same(trials, read_trials(folder / "runs.csv", folder / "weights.csv"))
    assert trials.errors is None


def test_options_replace_what_the_job_says(job):
    trials = job(phase="lead", angles="with rotation", amplitude_error_percent=5.0).trials
    assert (trials.labels.phase, trials.labels.angles) == ("lead", "with rotation")
    assert (trials.errors.amplitude, trials.errors.phase) == (0.05, math.radians(3))
    with pytest.raises(ValueError, match="phase must be 'lead' or 'lag', not 'late'"):
        job(phase="late")
    with pytest.raises(ValueError, match="errors of a reading must be finite numbers ≥ 0"):
        job(amplitude_error_percent=-1.0)


def test_jobs_without_a_job_file(job, folder):
    files = [folder / "runs.csv", folder / "weights.csv"]
    read = job_from_files(files, phase="lag", angles="against rotation", amplitude_error_percent=2.0)
    np.testing.assert_array_equal(read.trials.weights, job().trials.weights)
    assert read.files == tuple(files)
    assert read.trials.errors.amplitude == 0.02
    for wrong in ([], files[:1], files * 2):
        with pytest.raises(ValueError, match="give a job"):
            job_from_files(wrong)


@pytest.fixture
def stored(folder):
    influence = estimate_influence(read_trials(folder / "runs.csv", folder / "weights.csv"))
    write_influence(folder / "influence.csv", influence)
    write_csv(folder / "now.csv", RUNS[:3])
    return influence


def test_stored_coefficients(folder, stored, job):
    for read in (
        job_from_files([folder / "now.csv"], influence=folder / "influence.csv"),
        job('runs = "now.csv"\ninfluence = "influence.csv"'),
    ):
        np.testing.assert_allclose(read.influence.W, stored.W, rtol=1e-14)
        assert read.influence.labels == read.trials.labels
        assert folder / "influence.csv" in read.files
        again = correct(read.influence, baseline=read.trials).weights
        np.testing.assert_allclose(again, correct(stored).weights, rtol=1e-12)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("sensor", "C", "coefficients for sensor 'C', which the readings have; there are A and B"),
        ("speed_rpm", 1100, "coefficients for speed '1100 rpm', which the readings have; there are 1000 rpm"),
        (
            "amplitude_um_pp",
            None,
            "coefficients for amplitude 'mm_s', which the readings have; there are um_pp",
        ),
    ],
)
def test_coefficients_that_do_not_fit(folder, stored, column, value, words):
    table = [RUNS[0], RUNS[1]]
    changed = replaced(table, 2, column, value) if value else replaced(table, 1, column, "amplitude_mm_s")
    path = write_csv(folder / "now.csv", changed)
    found = complaints(job_from_files, [path], influence=folder / "influence.csv")
    assert [p.expected[: len(words)] for p in found] == [words]


BAD_JOBS = [
    ('phase = "lag"', 'phase = "leading"', "phase", "leading", "'lead' or 'lag' (did you mean 'lead'?)"),
    (
        'angles = "against rotation"',
        'angles = "with"',
        "angles",
        "with",
        "'with rotation', 'against rotation', 'clockwise' or 'counter-clockwise'",
    ),
    (
        "speed_tolerance_percent = 1",
        "speed_tolerance_percent = -1",
        "speed_tolerance_percent",
        "-1",
        "0 or more",
    ),
    (
        "speed_tolerance_percent = 1",
        "speed_tolerance = 1",
        "speed_tolerance",
        "1",
        "'speed_tolerance_percent'?",
    ),
    ("amplitude_percent = 2", 'amplitude_percent = "two"', "errors.amplitude_percent", "two", "a number"),
    (
        "amplitude_percent = 2",
        "amplitude_percent = inf",
        "errors.amplitude_percent",
        "inf",
        "a finite number",
    ),
    ("floor = 0.1", "floor = -1", "errors.floor", "-1", "a number of 0 or more"),
    ("[planes.1]", "[planes.3]", "planes.3", "3", "one of the job's planes, 1 and 2"),
    ("[sensors.A]", "[sensors.a]", "sensors.a", "a", "one of the job's sensors, A and B (did you mean 'A'?)"),
    ("[planes.1]", "[planes.1]\nmax_mas_g = 2", "planes.1.max_mas_g", "2", "did you mean 'max_mass_g'?"),
    ('runs = "runs.csv"', "", "runs", None, "the runs table"),
    ('weights = "weights.csv"', "", "weights", None, "a weights table, or an influence table"),
]


@pytest.mark.parametrize(("old", "new", "key", "value", "words"), BAD_JOBS)
def test_bad_jobs(job, old, new, key, value, words):
    assert old in JOB
    the_only(complaints(job, JOB.replace(old, new, 1)), "job.toml", None, key, value, words)


def test_errors_that_are_all_zero(job):
    text = 'runs = "runs.csv"\nweights = "weights.csv"\n[errors]\nphase_deg = 0\n'
    the_only(complaints(job, text), "job.toml", None, "errors", None, "an error above 0")


def test_problems_of_all_files_at_once(job, folder):
    write_csv(folder / "runs.csv", replaced(RUNS, 2, "phase_deg", "x"))
    write_csv(folder / "weights.csv", replaced(WEIGHTS, 2, "mass_g", 0))
    assert [p.file.rpartition("/")[2] for p in complaints(job)] == ["runs.csv", "weights.csv"]
    found = complaints(job, JOB.replace('phase = "lag"', 'phase = "lagg"').replace("= 3", '= "x"'))
    assert [p.column for p in found] == ["phase", "errors.phase_deg"]


def test_missing_files_of_a_job(job, folder):
    (folder / "weights.csv").unlink()
    the_only(complaints(job), "weights.csv", None, None, None, "a file that exists")


def test_what_is_no_job(folder):
    the_only(complaints(read_job, folder / "runs.csv"), "runs.csv", None, None, None, "a job: a .toml file")
    the_only(complaints(read_job, folder / "none.toml"), "none.toml", None, None, None, "a file that exists")


BAD_SETTINGS = [
    (2, "value", "leading", "leading", "'lead' or 'lag'"),
    (2, "key", "phas", "lag", "did you mean 'phase'?"),
    (5, "key", "errors.amplitude", "2", "did you mean 'amplitude_percent'?"),
    (5, "value", -2, "-2", "0 or more"),
    (5, "key", None, "", "the name of a key"),
    (5, "key", "phase", "phase", "each key once (row 2 has it too)"),
    (5, "key", "phase.x", "phase.x", "no parts of phase"),
    (5, "key", "planes.1.holes_deg.x", "a table", "a number: angles of the holes"),
    (5, "key", "runs", "2", "a text in quotes"),
]


@pytest.mark.parametrize(("row", "column", "value", "shown", "words"), BAD_SETTINGS)
def test_bad_settings_of_a_workbook(book, row, column, value, shown, words):
    found = complaints(book, settings=replaced(SETTINGS, row, column, value), planes=[["plane"]])
    at = "key" if shown in ("", value) and column == "key" else "value"
    problem = the_only(found, "job.xlsx", row, at, shown, words)
    assert "sheet 'settings'" in problem.file


def test_bad_sheets_of_a_workbook(book, tmp_path):
    the_only(
        complaints(book, weightss=[["x"]]), "job.xlsx", None, None, "weightss", "did you mean 'weights'?"
    )
    found = complaints(book, settings=[["a", "b"], [1, 2]])
    the_only(found, "job.xlsx", 1, "key", None, "the columns key and value")
    found = complaints(book, planes=[["plane", "available_g"], ["1", 20]])
    the_only(found, "job.xlsx", 2, "available_g", "20", "the holes of the plane too")
    found = complaints(book, planes=[["plane"], ["1"], ["1"]])
    the_only(found, "job.xlsx", 3, "plane", "1", "each plane once (row 2 has it too)")
    for sensors in ([["name"], ["A"]], [["name"]]):
        found = complaints(book, sensors=sensors)
        the_only(found, "job.xlsx", 1, "sensor", None, "a column sensor; the columns are name")
    path = write_book(tmp_path / "none.xlsx", {"weights": WEIGHTS})
    the_only(complaints(read_job, path), "none.xlsx", None, None, None, "a sheet 'runs'")
    found = complaints(book, settings=[["key", "value"], ["planes", 3]], planes=[["plane"], ["1"]])
    the_only(found, "job.xlsx", 2, "key", "planes", "each key once")
