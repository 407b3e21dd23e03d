"""Slow-roll vectors: read strictly, subtracted from all readings before everything else."""

from __future__ import annotations

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, complaints, replaced, the_only, write_csv

SLOW = [RUNS[0], ["slow", 150, "B", 1.5, -80], ["slow", 150, "A", 2.0, 35]]


def polar(size, degrees):
    return size * np.exp(1j * np.radians(degrees))


S = np.array([polar(1e-6, 35), polar(0.75e-6, -80)])
"""Peak amplitudes, m, of the vectors above (µm peak to peak)."""


@pytest.fixture
def slow(job, folder):
    """Reads the job with a runs table of a slow run."""

    def read(table=SLOW, lines=""):
        write_csv(folder / "slow.csv", table)
        return job(f'slow_roll = "slow.csv"\n{lines}')

    return read


def test_vectors_are_subtracted_from_every_run(job, slow):
    plain, read = job().trials, slow()
    np.testing.assert_allclose(read.trials.readings, plain.readings - S, rtol=1e-12)
    np.testing.assert_allclose(read.slow_roll, S, rtol=1e-12)
    assert read.trials.warnings == plain.warnings == ()
    lag = slow(lines='phase = "lag"\n')
    np.testing.assert_allclose(lag.slow_roll, np.conj(S), rtol=1e-12)


def test_a_slow_run_is_a_runs_table_of_one_run(slow, folder):
    read = slow()
    np.testing.assert_allclose(read.slow_roll, S, rtol=1e-12)
    assert folder / "slow.csv" in read.files
    other = slow(replaced(SLOW, 1, "amplitude_um_pp", "amplitude_um"))
    np.testing.assert_allclose(other.slow_roll, 2 * S, rtol=1e-12)
    np.testing.assert_array_equal(slow([line[1:] for line in SLOW]).slow_roll, slow().slow_roll)
    (words,) = slow([SLOW[0], *([line[0], 600, *line[2:]] for line in SLOW[1:])]).trials.warnings
    assert words.startswith("the slow-roll vectors were read at 600 rpm, which is not slow against 1000 rpm")


def test_vectors_at_every_speed_of_the_job(job, slow, folder):
    write_csv(folder / "runs.csv", [*RUNS, *([line[0], 2000, *line[2:]] for line in RUNS[1:])])
    by_speed = [["slow", rpm, c, rpm / 1000, 0] for rpm in (1998, 500, 1001) for c in "AB"]
    write_csv(folder / "check.csv", [RUNS[0], *(["check", 2003, *line[2:]] for line in by_speed[1::-1])])
    read, plain = slow([SLOW[0], *by_speed], 'check = "check.csv"\n'), job()
    expected = np.array([[0.5005e-6] * 2, [0.999e-6] * 2])
    np.testing.assert_allclose(read.slow_roll, expected, rtol=1e-12)
    np.testing.assert_allclose(read.trials.readings, plain.trials.readings - expected, rtol=1e-12)
    np.testing.assert_allclose(read.check.readings, 0, atol=1e-18)
    words = (
        "one slow speed, whose vectors hold for all speeds, or vectors at every speed of the job: 1000 rpm"
    )
    the_only(complaints(slow, [SLOW[0], *by_speed[:4]]), "slow.csv", None, "speed", None, words)


def test_a_sensor_without_a_vector(slow):
    read = slow(SLOW[:2])
    np.testing.assert_allclose(read.slow_roll, [0, S[1]], rtol=1e-12)
    (words,) = read.trials.warnings
    assert words.startswith("there is no slow-roll vector for 'A'")
    assert slow([*SLOW[:2], ["slow", 150, "A", 0, 0]]).trials.warnings == ()


def test_errors_are_those_of_the_measured_amplitude(slow):
    """2 % of what was measured: what the vectors had in it stands in the floor of the difference."""
    read = slow(lines="[errors]\namplitude_percent = 2\nphase_deg = 1\nfloor = 0.1\n")
    expected = np.hypot(0.05e-6, 0.02 * 1e-6)
    assert (read.trials.errors.amplitude, read.trials.errors.phase) == (0.02, np.radians(1))
    assert read.trials.errors.floor == pytest.approx(expected, rel=1e-12)


@each_of(
    ("table", "where", "value", "words"),
    [
        (replaced(SLOW, 1, "amplitude_um_pp", "amplitude_mm_s"), "amplitude", "mm_s", "the job has: um_pp"),
        (
            [*SLOW, *(["again", *line[1:]] for line in SLOW[1:])],
            "run",
            "again",
            "are 'slow' and 'again'",
        ),
    ],
)
def test_bad_slow_runs(slow, table, where, value, words):
    the_only(complaints(slow, table), "slow.csv", None, where, value, words)
