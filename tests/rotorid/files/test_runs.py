"""Runs and weights: what they mean, and every complaint about them."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from cases import each_of
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from balancing import ReadingErrors
from rotorid.files import read_trials
from rotorid.files.job_keys import Errors


@pytest.fixture
def read(tmp_path):
    def run(runs=RUNS, weights=WEIGHTS, **options):
        files = write_csv(tmp_path / "runs.csv", runs), write_csv(tmp_path / "weights.csv", weights)
        return read_trials(*files, **options)

    return run


@pytest.fixture
def bad(read):
    def run(runs=RUNS, weights=WEIGHTS, **options):
        return complaints(read, runs, weights, **options)

    return run


def z(amplitude, degrees):
    return cmath.rect(amplitude, math.radians(degrees))


def test_meaning(read):
    trials = read()
    assert trials.runs == ("initial", "trial 1", "trial 2")
    assert (trials.sensors, trials.planes) == (("A", "B"), ("1", "2"))
    np.testing.assert_allclose(trials.speeds, [1000 * math.pi / 30], rtol=1e-15)
    shown = [[[z(7.2, 238), z(13.5, 296)]], [[z(4.9, 114), z(9.2, 347)]], [[z(4, 79), z(12, 292)]]]
    np.testing.assert_allclose(trials.readings, np.array([shown]) * 0.5e-6, rtol=1e-14)
    np.testing.assert_allclose(trials.weights, [[0, 0], [0.0025, 0], [0, 0.0025]], rtol=1e-15)
    labels = trials.labels
    assert (labels.vibration_unit, labels.weight_unit) == ("um_pp", "g")
    shown = np.reshape(labels.vibration(trials.readings), (2, 6))
    np.testing.assert_allclose(shown.T, [line[3:] for line in RUNS[1:]], rtol=1e-13)


def test_wrong_arguments(read):
    with pytest.raises(ValueError, match="phase must be 'lead' or 'lag', not 'leading'"):
        read(phase="leading")
    with pytest.raises(ValueError, match="angles must be"):
        read(angles="clockwise")
    with pytest.raises(ValueError, match="phase_deg"):
        Errors(phase_deg=-1)


def test_errors_in_the_unit_of_the_readings(read):
    errors = read(errors=Errors(amplitude_percent=2.0, phase_deg=90.0, floor=0.5)).errors
    assert (errors.amplitude, errors.phase) == (0.02, math.pi / 2)
    assert errors.floor == pytest.approx(0.25e-6, rel=1e-15)
    given = ReadingErrors(0.1, 0.2, 3e-6)
    assert read(errors=given).errors is given


def test_repeated_readings(read):
    header = [*RUNS[0], "repeat"]
    rows = [[*line, 1] for line in RUNS[1:]]
    trials = read([header, *rows, ["initial", 1000, "A", 7.4, 238, 2], ["initial", 1000, "A", 7.6, 238, 3]])
    assert trials.readings.shape == (3, 3, 1, 2)
    np.testing.assert_allclose(abs(trials.readings[:, 0, 0, 0]), np.array([7.2, 7.4, 7.6]) * 0.5e-6)
    assert np.isnan(trials.readings[1:, 1:]).all()
    assert np.isfinite(trials.readings[0]).all()


def at_speeds(step):
    return [RUNS[0], *([line[0], 1000 + n // 2 * step, *line[2:]] for n, line in enumerate(RUNS[1:]))]


WRONG = [
    (replaced(RUNS, 3, column, value), 3, column, str(value), words)
    for column, value, words in (
        ("amplitude_um_pp", "", "a number"),
        ("amplitude_um_pp", "1.#QNAN", "a finite number"),
        ("amplitude_um_pp", "1 234", "thousands"),
        ("amplitude_um_pp", "1'234", "thousands"),
        ("amplitude_um_pp", "−5", "minus sign"),
        ("amplitude_um_pp", "١", "a number"),
        ("amplitude_um_pp", "1_000", "a number"),
        ("amplitude_um_pp", "=1+1", "a number"),
        ("amplitude_um_pp", "7.2 um", "a number in um_pp, as the heading says"),
        ("amplitude_um_pp", "1e300", "between 1e-30 and 1e+30 in size"),
        ("amplitude_um_pp", -1, "an amplitude of 0 or more"),
        ("phase_deg", 361, "from -360 to 360 degrees"),
        ("speed_rpm", 0, "a speed above 0"),
        ("sensor", "", "a name"),
        ("run", "", "a name"),
    )
]
WRONG += [
    (replaced(RUNS, 1, old, new), 1, new, new, words)
    for old, new, words in (
        ("speed_rpm", "sped_rpm", "did you mean 'speed_rpm'?"),
        ("speed_rpm", "speed_RPM", "one of the units rpm, rad_s or Hz, not 'RPM' (did you mean 'rpm'?)"),
        ("amplitude_um_pp", "amplitude_um_pk", "um_pp (peak to peak)"),
    )
]
WRONG += [([line[1:] for line in RUNS], 1, "run", None, "a column run")]
WRONG += [
    ([[*RUNS[0], "x"], *([*line, 1] for line in RUNS[1:])], 1, "x", "x", "a known column: run, speed_rpm"),
    ([[*line, line[3]] for line in RUNS], 1, RUNS[0][3], RUNS[0][3], "one column of the amplitude"),
    ([*RUNS, ["trial 2", 1000, "B", 12.5, 290]], 8, "sensor", "B", "(row 7 has the same); repeated readings"),
    (RUNS[:4] + RUNS[5:], None, "sensor", None, "a reading of sensor 'B' in run 'trial 1' at 1000 rpm, as"),
    (at_speeds(4), None, "speed_rpm", None, "3 speeds from 1000 rpm to 1008 rpm form a chain"),
    (RUNS[1:], 1, None, None, "a header row with the names of columns, separated by , or ; or tabs: run"),
]


@each_of("runs, row, column, value, words", WRONG)
def test_one_thing_that_is_wrong_has_one_message(tmp_path, runs, row, column, value, words):
    files = write_csv(tmp_path / "runs.csv", runs), write_csv(tmp_path / "weights.csv", WEIGHTS)
    the_only(complaints(read_trials, *files), "runs.csv", row, column, value, words)


def test_speeds_further_apart_than_the_tolerance(bad, read):
    problems = bad(at_speeds(2), speed_tolerance_percent=0.1)
    assert any(p.column == "speed_rpm" and "its nearest speed is 1000" in p.expected for p in problems)
    close = [*RUNS, *([line[0], 1002, *line[2:]] for line in RUNS[1:])]
    problems = bad(close)
    assert [(p.row, p.value) for p in problems] == [(row, "1002") for row in range(8, 14)]
    assert "one speed: run 'initial' has 1000 as well" in problems[0].expected
    assert len(read(close, speed_tolerance_percent=0).speeds) == 2


def test_all_problems_of_both_files_at_once(bad):
    runs = replaced(replaced(RUNS, 3, "amplitude_um_pp", "x"), 5, "phase_deg", 500)
    places = [(p.row, p.column, p.value) for p in bad(runs, replaced(WEIGHTS, 2, "mass_g", "y"))]
    assert places == [(3, "amplitude_um_pp", "x"), (5, "phase_deg", "500"), (2, "mass_g", "y")]
