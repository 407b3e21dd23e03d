"""Slow-roll vectors: read strictly, subtracted from all readings before everything else."""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from balancing import ReadingErrors, Trials, correct, estimate_influence
from balancing.errors import reading_covariance
from rotorid.files import read_job
from rotorid.files.further_runs import subtract_slow_roll

TABLES = 'runs = "runs.csv"\nweights = "weights.csv"\n'
VECTORS = """[slow_roll.A]
amplitude = 2.0
phase_deg = 35
[slow_roll.B]
amplitude = 1.5
phase_deg = -80
"""
SLOW = [RUNS[0], ["slow", 150, "B", 1.5, -80], ["slow", 150, "A", 2.0, 35]]
FILE = TABLES + 'slow_roll = "slow.csv"\n'


def polar(size, degrees):
    return size * np.exp(1j * np.radians(degrees))


S = np.array([polar(1e-6, 35), polar(0.75e-6, -80)])
"""Peak amplitudes, m, of the vectors above (µm peak to peak)."""


@pytest.fixture
def folder(tmp_path):
    write_csv(tmp_path / "runs.csv", RUNS)
    write_csv(tmp_path / "weights.csv", WEIGHTS)
    write_csv(tmp_path / "slow.csv", SLOW)
    return tmp_path


@pytest.fixture
def job(folder):
    def read(text):
        (folder / "job.toml").write_text(text, encoding="utf-8")
        return read_job(folder / "job.toml")

    return read


def test_vectors_are_subtracted_from_every_run(job):
    plain = job(TABLES).trials
    read = job(TABLES + VECTORS)
    np.testing.assert_allclose(read.trials.readings, plain.readings - S, rtol=1e-12)
    np.testing.assert_allclose(read.slow_roll, S, rtol=1e-12)
    assert read.trials.warnings == plain.warnings == ()


def test_in_the_conventions_and_units_of_the_readings(job):
    lag = job('phase = "lag"\n' + TABLES + VECTORS)
    np.testing.assert_allclose(lag.slow_roll, np.conj(S), rtol=1e-12)
    mil = VECTORS.replace("amplitude = 2.0", "amplitude_mil = 0.1")
    np.testing.assert_allclose(job(TABLES + mil).slow_roll, [polar(2.54e-6, 35), S[1]], rtol=1e-12)


def test_they_cancel_in_the_coefficients_and_not_in_the_weights(job):
    plain, read = (estimate_influence(job(text).trials) for text in (TABLES, TABLES + VECTORS))
    np.testing.assert_allclose(read.W, plain.W, rtol=1e-9)
    shift = correct(read).weights - correct(plain).weights
    np.testing.assert_allclose(shift, np.linalg.solve(plain.W[0], S), rtol=1e-9)


def test_a_slow_run_is_a_runs_table_of_one_run(job, folder):
    read = job(FILE)
    np.testing.assert_allclose(read.slow_roll, S, rtol=1e-12)
    assert folder / "slow.csv" in read.files
    np.testing.assert_allclose(read.trials.readings, job(TABLES + VECTORS).trials.readings, rtol=1e-12)
    write_csv(folder / "slow.csv", replaced(SLOW, 1, "amplitude_um_pp", "amplitude_um"))
    np.testing.assert_allclose(job(FILE).slow_roll, 2 * S, rtol=1e-12)


def test_repeated_slow_readings_are_averaged(job, folder):
    lines = [[*line[:3], 3.0 * k, *line[4:], k] for line in SLOW[1:] for k in (1, 2)]
    write_csv(folder / "slow.csv", [[*SLOW[0], "repeat"], *lines])
    np.testing.assert_allclose(np.abs(job(FILE).slow_roll), 2.25e-6, rtol=1e-12)


def test_vectors_at_every_speed_of_the_job(job, folder):
    more = [[line[0], 2000, *line[2:]] for line in RUNS[1:]]
    write_csv(folder / "runs.csv", [*RUNS, *more])
    plain = job(TABLES).trials
    by_speed = [["slow", rpm, c, rpm / 1000, 0] for rpm in (1998, 500, 1001) for c in "AB"]
    write_csv(folder / "slow.csv", [SLOW[0], *by_speed])
    read = job(FILE)
    expected = np.array([[0.5005e-6] * 2, [0.999e-6] * 2])
    np.testing.assert_allclose(read.slow_roll, expected, rtol=1e-12)
    np.testing.assert_allclose(read.trials.readings, plain.readings - expected, rtol=1e-12)
    write_csv(folder / "slow.csv", [SLOW[0], *by_speed[:4]])
    words = (
        "one slow speed, whose vectors hold for all speeds, or vectors at every speed of the job: 1000 rpm"
    )
    the_only(complaints(job, FILE), "slow.csv", None, "speed", None, words)


def test_the_check_run_is_corrected_too(job, folder):
    write_csv(folder / "check.csv", [RUNS[0], ["check", 1003, "B", 1.5, -80], ["check", 1003, "A", 4.0, 35]])
    read = job(TABLES + 'check = "check.csv"\n' + VECTORS)
    assert read.check.sensors == ("B", "A")
    np.testing.assert_allclose(read.check.readings[0, 0, 0], [0, S[0]], atol=1e-18)


def test_a_sensor_without_a_vector(job):
    only_b = "[slow_roll.B]" + VECTORS.split("[slow_roll.B]")[1]
    read = job(TABLES + only_b)
    np.testing.assert_allclose(read.slow_roll, [0, S[1]], rtol=1e-12)
    (words,) = read.trials.warnings
    assert words.startswith("there is no slow-roll vector for 'A': what is read there is used as it is")
    nothing = "[slow_roll.A]\namplitude = 0\nphase_deg = 0\n"
    assert job(TABLES + nothing + only_b).trials.warnings == ()


def test_a_vector_larger_than_readings(job):
    read = job(TABLES + VECTORS.replace("amplitude = 2.0", "amplitude = 4.5"))
    (words,) = read.trials.warnings
    assert words.startswith(
        "the slow-roll vector of sensor 'A', 4.5 µm pp, is larger than its reading in run 'trial 2' at "
        "1000 rpm, 4 µm pp: check its unit"
    )
    (words,) = job(TABLES + VECTORS.replace("amplitude = 2.0", "amplitude = 8")).trials.warnings
    assert "4 µm pp, and than 2 other readings: check" in words


def test_a_slow_run_that_is_not_slow(job, folder):
    write_csv(
        folder / "slow.csv", [[*line[:1], 600, *line[2:]] if k else line for k, line in enumerate(SLOW)]
    )
    (words,) = job(FILE).trials.warnings
    assert words.startswith("the slow-roll vectors were read at 600 rpm, which is not slow against 1000 rpm")


def test_errors_are_those_of_the_measured_amplitude(job):
    """2 % of what was measured: what the vectors had in it stands in the floor of the difference."""
    errors = "[errors]\namplitude_percent = 2\nphase_deg = 1\nfloor = 0.1\n"
    read = job(TABLES + errors + VECTORS)
    expected = np.hypot(0.05e-6, 0.02 * 1e-6)
    assert (read.trials.errors.amplitude, read.trials.errors.phase) == (0.02, np.radians(1))
    assert read.trials.errors.floor == pytest.approx(expected, rel=1e-12)
    (words,) = read.trials.warnings
    assert words.endswith("of the slow-roll vectors, up to 2 µm pp, they add 0.04 µm pp to the floor")


def test_the_floor_covers_the_measured_error_on_average():
    """Over all angles between vibration and run-out: the same mean variance as the measured amplitude has."""
    angles = np.exp(2j * np.pi * np.arange(360) / 360)
    vibration, runout = 3.0 * angles, 5.0
    measured = Trials(
        ("now",), [100.0], ("A",), (), (vibration + runout)[:, None, None, None], np.zeros((1, 0))
    )
    for errors in (ReadingErrors(0.02, 0.02), ReadingErrors(0.02, 0.02, 0.3)):
        stated = Trials(
            measured.runs, [100.0], ("A",), (), measured.readings, measured.weights, errors=errors
        )
        found = subtract_slow_roll(stated, np.array([runout + 0j]))
        assert found.errors is not None
        ours = reading_covariance(vibration, found.errors).mean(axis=0)
        theirs = reading_covariance(vibration + runout, errors).mean(axis=0)
        np.testing.assert_allclose(np.trace(ours), np.trace(theirs), rtol=1e-12)
        np.testing.assert_allclose(found.readings.ravel(), vibration, rtol=1e-12)


BAD = [
    (
        "[slow_roll.A]",
        "[slow_roll.a]",
        "slow_roll.a",
        None,
        "a sensor of the runs table, not 'a' (did you mean 'A'?)",
    ),
    ("amplitude = 2.0", "amplitude = -2", "slow_roll.A.amplitude", "-2", "0 or more"),
    ("amplitude = 2.0", "amplitude_mm_s = 2", "slow_roll.A.amplitude_mm_s", "2", "an amplitude in um_pp"),
    ("amplitude = 2.0", "amplitude_um_pk = 2", "slow_roll.A.amplitude_um_pk", "2", "um (peak)"),
    ("amplitude = 2.0\n", "", "slow_roll.A.amplitude", None, "the amplitude at slow speed"),
    (
        "amplitude = 2.0",
        "amplitude = 2\namplitude_um = 1",
        "slow_roll.A.amplitude_um",
        "1",
        "one key of them",
    ),
    ("phase_deg = 35\n", "", "slow_roll.A.phase_deg", None, "the phase at slow speed"),
    ("phase_deg = 35", "phase_deg = 400", "slow_roll.A.phase_deg", "400", "a number up to 360"),
    (VECTORS, "[slow_roll]\n", "slow_roll", "a table", "a list with at least 1: vectors, [slow_roll.SENSOR]"),
    (VECTORS, "slow_roll = 3\n", "slow_roll", "3", "a table, [slow_roll]: vectors, [slow_roll.SENSOR]"),
    (
        VECTORS,
        'slow_roll = "a\\tslow.csv"\n',
        "slow_roll",
        "a\tslow.csv",
        "without control characters",
    ),
    (VECTORS, 'slow_roll = " "\n', "slow_roll", " ", "a text in quotes: vectors, [slow_roll.SENSOR]"),
]


@pytest.mark.parametrize(("old", "new", "key", "value", "words"), BAD)
def test_bad_vectors(job, old, new, key, value, words):
    assert old in VECTORS
    the_only(complaints(job, TABLES + VECTORS.replace(old, new)), "job.toml", None, key, value, words)


BAD_FILES = [
    (1, "amplitude_um_pp", "amplitude_mm_s", "amplitude", "mm_s", "what the job has: um_pp"),
    (1, "amplitude_um_pp", "amplitude", "amplitude", "no unit", "what the job has: um_pp"),
    (3, "sensor", "C", "sensor", "C", "what the job has: A and B"),
]


@pytest.mark.parametrize(("row", "column", "new", "where", "value", "words"), BAD_FILES)
def test_bad_slow_runs(job, folder, row, column, new, where, value, words):
    write_csv(folder / "slow.csv", replaced(SLOW, row, column, new))
    the_only(complaints(job, FILE), "slow.csv", None, where, value, words)


def test_two_slow_runs(job, folder):
    write_csv(folder / "slow.csv", [*SLOW, *(["again", *line[1:]] for line in SLOW[1:])])
    words = "one run, at slow speed; there are 'slow' and 'again'"
    the_only(complaints(job, FILE), "slow.csv", None, "run", "again", words)
