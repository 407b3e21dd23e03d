"""Runs tables with standard deviations of each reading, and what `rotorid vectors` writes beside them."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from balancing import ReadingErrors, reading_of
from rotorid.files import read_trials

MEASURED = [
    [*RUNS[0], "amplitude_std_um_pp", "phase_std_deg"],
    *([*row, 0.05 + 0.01 * k, 0.4 + 0.1 * k] for k, row in enumerate(RUNS[1:])),
]
VECTORS = [
    [
        *MEASURED[0],
        "time_s",
        "turns",
        "overall_um_pp",
        "gap_um",
        "order2_amplitude_um_pp",
        "order2_phase_deg",
    ],
    *([*row, 1.5 * k, 120, 15.0, -250.0, 0.8, 12.0] for k, row in enumerate(MEASURED[1:])),
]
VECTORS[0] += ["order0.5_amplitude_um_pp", "order0.5_phase_deg"]
for line in VECTORS[1:]:
    line += ["", ""]  # what does not count may be missing


@pytest.fixture
def read(tmp_path):
    def run(runs=MEASURED, weights=WEIGHTS, **options):
        files = write_csv(tmp_path / "runs.csv", runs), write_csv(tmp_path / "weights.csv", weights)
        return read_trials(*files, **options)

    return run


@pytest.mark.parametrize("phase", ["lead", "lag"])
def test_a_deviation_is_along_and_across_its_reading(read, phase):
    covariance = read(phase=phase).covariance[:, :, 0, :, 0]
    for k, (_, _, _, amplitude, degrees) in enumerate(RUNS[1:]):
        along, across = 0.5e-6 * (0.05 + 0.01 * k), 0.5e-6 * amplitude * math.radians(0.4 + 0.1 * k)
        u = cmath.rect(1, math.radians(degrees) * (1 if phase == "lead" else -1))
        turn = np.array([[u.real, -u.imag], [u.imag, u.real]])
        expected = turn @ np.diag([along**2, across**2]) @ turn.T
        np.testing.assert_allclose(covariance[..., k // 2, k % 2], expected, rtol=1e-9)


def test_nothing_is_assumed_then(read):
    assert reading_of(read()).source == "measured"
    assert reading_of(read(RUNS)).source == "assumed"
    assert read(RUNS).covariance is None
    assert reading_of(read(errors=ReadingErrors(0.01))).source == "stated"


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("amplitude_std_um_pp", 0, "a standard deviation above 0: nothing is measured exactly"),
        ("amplitude_std_um_pp", "", "a number"),
    ],
)
def test_none_is_zero_negative_or_missing(read, column, value, words):
    problems = complaints(read, replaced(MEASURED, 4, column, value))
    the_only(problems, "runs.csv", 4, column, str(value), words)


@each_of("change", [("amplitude_std_um_pp", "note"), ("phase_std_deg", "note"), ("std_um_pp", "std_mm_s")])
def test_both_or_neither_in_the_unit_of_the_amplitude(read, change):
    header = [name.replace(*change) for name in MEASURED[0]]
    assert [problem.row for problem in complaints(read, [header, *MEASURED[1:]])] == [1]


def test_check_runs_and_slow_roll_read_them(job, folder):
    def table(name, speed, amplitude=None):
        rows = ([name, speed, row[2], amplitude or row[3], *row[4:]] for row in VECTORS[1:3])
        write_csv(folder / f"{name}.csv", [VECTORS[0], *rows])

    write_csv(folder / "runs.csv", VECTORS)
    table("check", 1000)
    table("slow", 100, 0.5)
    plain, slow = (job(f'check = "check.csv"\n{more}') for more in ("", 'slow_roll = "slow.csv"\n'))
    np.testing.assert_array_equal(slow.trials.covariance, plain.trials.covariance)
    np.testing.assert_array_equal(slow.check.covariance, plain.check.covariance)
    np.testing.assert_allclose(np.abs(slow.slow_roll), 0.25e-6)
