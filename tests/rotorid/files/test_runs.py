"""Runs and weights: what they mean, and every complaint about them."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from balancing import ReadingErrors, UndeterminedError, estimate_influence
from rotorid.files import Errors, read_trials


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
    assert (labels.vibration_scale, labels.weight_scale) == (2e6, 1e3)
    amplitude, phase = labels.vibration(trials.readings)
    np.testing.assert_allclose(amplitude.ravel(), [line[3] for line in RUNS[1:]], rtol=1e-14)
    np.testing.assert_allclose(phase.ravel(), [line[4] for line in RUNS[1:]], rtol=1e-13)


def test_conventions_mirror_phases_and_angles_separately(read):
    weights = replaced(WEIGHTS, 2, "angle_deg", 35)
    plain = read(weights=weights)
    lag = read(weights=weights, phase="lag")
    against = read(weights=weights, angles="against rotation")
    np.testing.assert_array_equal(lag.readings, plain.readings.conj())
    np.testing.assert_array_equal(lag.weights, plain.weights)
    np.testing.assert_array_equal(against.weights, plain.weights.conj())
    np.testing.assert_array_equal(against.readings, plain.readings)
    assert lag.labels.phase == "lag"
    assert against.labels.angles == "against rotation"


def test_wrong_arguments(read):
    with pytest.raises(ValueError, match="phase must be 'lead' or 'lag', not 'leading'"):
        read(phase="leading")
    with pytest.raises(ValueError, match="angles must be"):
        read(angles="clockwise")
    with pytest.raises(ValueError, match="speed_tolerance_percent"):
        read(speed_tolerance_percent=math.nan)
    with pytest.raises(ValueError, match="phase_deg"):
        Errors(phase_deg=-1)


def test_errors_in_the_unit_of_the_readings(read):
    errors = read(errors=Errors(amplitude_percent=2.0, phase_deg=90.0, floor=0.5)).errors
    assert (errors.amplitude, errors.phase) == (0.02, math.pi / 2)
    assert errors.floor == pytest.approx(0.25e-6, rel=1e-15)
    given = ReadingErrors(0.1, 0.2, 3e-6)
    assert read(errors=given).errors is given


def test_readings_in_any_or_no_unit_stay_as_they_are(read):
    for name, unit in (("amplitude", ""), ("amplitude_div", "div")):
        trials = read([[*RUNS[0][:3], name, "phase_deg"], *RUNS[1:]])
        assert trials.labels.vibration_unit == unit
        np.testing.assert_allclose(abs(trials.readings[0, 0, 0]), [7.2, 13.5], rtol=1e-15)


def test_columns_in_any_order_and_numbers_as_names(read):
    order = [4, 2, 0, 3, 1]
    shuffled = read([[line[i] for i in order] for line in RUNS])
    np.testing.assert_array_equal(shuffled.readings, read().readings)
    numbered = read(
        [RUNS[0], *([n // 2, *line[1:]] for n, line in enumerate(RUNS[1:]))], [WEIGHTS[0], [1, "1", 2.5, 0]]
    )
    assert numbered.runs == ("0", "1", "2")


def test_several_weights_of_a_plane_add_up_and_trials_stay_in(read):
    weights = [*WEIGHTS, ["trial 2", "1", 2.5, 0], ["trial 2", "1", 2.5, 90]]
    trials = read(weights=weights)
    np.testing.assert_allclose(trials.weights[2], [0.0025 + 0.0025j, 0.0025], rtol=1e-14)


def test_weights_as_unbalance(read):
    trials = read(weights=[["run", "plane", "unbalance_g_mm", "angle_deg"], ["trial 1", "1", 250, 90]])
    np.testing.assert_allclose(trials.weights[1], [250e-6j], rtol=1e-15)
    assert (trials.labels.weight_unit, trials.labels.weight_scale) == ("g_mm", 1e6)


def test_no_weights_table(tmp_path):
    trials = read_trials(write_csv(tmp_path / "runs.csv", RUNS), None)
    assert (trials.planes, trials.weights.shape) == ((), (3, 0))


def test_repeated_readings(read):
    header = [*RUNS[0], "repeat"]
    rows = [[*line, 1] for line in RUNS[1:]]
    trials = read([header, *rows, ["initial", 1000, "A", 7.4, 238, 2], ["initial", 1000, "A", 7.6, 238, 3]])
    assert trials.readings.shape == (3, 3, 1, 2)
    np.testing.assert_allclose(abs(trials.readings[:, 0, 0, 0]), np.array([7.2, 7.4, 7.6]) * 0.5e-6)
    assert np.isnan(trials.readings[1:, 1:]).all()
    assert np.isfinite(trials.readings[0]).all()


def test_speeds_of_different_runs_count_as_one(read):
    runs = [RUNS[0], *([line[0], 1000 + n // 2 * 2, *line[2:]] for n, line in enumerate(RUNS[1:]))]
    trials = read(runs)
    np.testing.assert_allclose(trials.speeds, [1002 * math.pi / 30], rtol=1e-14)
    np.testing.assert_array_equal(trials.readings, read().readings)


def test_speeds_further_apart_than_the_tolerance(bad):
    runs = [RUNS[0], *([line[0], 1000 + n // 2 * 2, *line[2:]] for n, line in enumerate(RUNS[1:]))]
    problems = bad(runs, speed_tolerance_percent=0.1)
    words = (
        "readings of run 'initial' at 1002 rpm, as every run needs at every speed; its nearest speed is 1000"
    )
    assert any(p.column == "speed_rpm" and p.expected.startswith(words) for p in problems)
    assert all("count as one within 0.1 %" in p.expected for p in problems)


def test_a_chain_of_speeds_is_ambiguous(bad):
    runs = [RUNS[0], *([line[0], 1000 + n // 2 * 4, *line[2:]] for n, line in enumerate(RUNS[1:]))]
    words = "1000 rpm, 1004 rpm, 1008 rpm form a chain"
    the_only(bad(runs), "runs.csv", None, "speed_rpm", None, words)


def test_two_near_speeds_in_one_run(bad, read):
    close = [*RUNS, *([line[0], 1002, *line[2:]] for line in RUNS[1:])]
    problems = bad(close)
    assert [(p.row, p.value) for p in problems] == [(row, "1002") for row in range(8, 14)]
    assert "one speed: run 'initial' has 1000 as well" in problems[0].expected
    assert len(read(close, speed_tolerance_percent=0).speeds) == 2


BAD_READINGS = [
    ("amplitude_um_pp", "nan", "a finite number"),
    ("amplitude_um_pp", "", "a number"),
    ("amplitude_um_pp", "7.2 um", "a number in um_pp, as the heading says"),
    ("amplitude_um_pp", -1, "an amplitude of 0 or more"),
    ("phase_deg", "", "a number"),
    ("phase_deg", 361, "a phase from -360 to 360 degrees"),
    ("phase_deg", -400, "a phase from -360 to 360 degrees"),
    ("speed_rpm", 0, "a speed above 0"),
    ("sensor", "", "a name"),
    ("run", "", "a name"),
]


@pytest.mark.parametrize(("column", "value", "words"), BAD_READINGS)
def test_bad_readings(bad, column, value, words):
    the_only(bad(replaced(RUNS, 3, column, value)), "runs.csv", 3, column, str(value), words)


def test_all_problems_of_both_files_at_once(bad):
    runs = replaced(replaced(RUNS, 3, "amplitude_um_pp", "x"), 5, "phase_deg", 500)
    problems = bad(runs, replaced(WEIGHTS, 2, "mass_g", "y"))
    assert [(p.row, p.column, p.value) for p in problems] == [
        (3, "amplitude_um_pp", "x"),
        (5, "phase_deg", "500"),
        (2, "mass_g", "y"),
    ]


def test_360_degrees_are_allowed(read):
    readings = read(replaced(replaced(RUNS, 2, "phase_deg", 360), 3, "phase_deg", -360)).readings
    np.testing.assert_array_equal(readings[0, 0, 0], np.array([7.2, 13.5]) / 2e6)


BAD_COLUMNS = [
    (RUNS, "speed_rpm", "sped_rpm", "sped_rpm", "did you mean 'speed_rpm'?"),
    (
        RUNS,
        "speed_rpm",
        "speed_RPM",
        "speed_RPM",
        "one of the units rpm, rad_s or Hz, not 'RPM' (did you mean 'rpm'?)",
    ),
    (RUNS, "speed_rpm", "speed", "speed", "which is missing"),
    (RUNS, "amplitude_um_pp", "amplitude_um_pk", "amplitude_um_pk", "um_pp (peak to peak)"),
    (RUNS, "amplitude_um_pp", "ampltude_um_pp", "ampltude_um_pp", "did you mean 'amplitude_um_pp'?"),
    (WEIGHTS, "mass_g", "mass_gran", "mass_gran", "a unit of weight: kg, g, mg"),
    (WEIGHTS, "mass_g", "unbalance_gmn", "unbalance_gmn", "did you mean 'g_m'?"),
]


@pytest.mark.parametrize(("table", "old", "new", "value", "words"), BAD_COLUMNS)
def test_misspelt_columns_and_wrong_units(bad, table, old, new, value, words):
    wrong = replaced(table, 1, old, new)
    problems = bad(wrong) if table is RUNS else bad(weights=wrong)
    the_only(problems, "runs.csv" if table is RUNS else "weights.csv", 1, new, value, words)


@pytest.mark.parametrize("column", RUNS[0])
def test_missing_columns_of_runs(bad, column):
    index = RUNS[0].index(column)
    problems = bad([line[:index] + line[index + 1 :] for line in RUNS])
    the_only(problems, "runs.csv", 1, column, None, f"a column {column}")


@pytest.mark.parametrize("column", WEIGHTS[0])
def test_missing_columns_of_weights(bad, column):
    index = WEIGHTS[0].index(column)
    problems = bad(weights=[line[:index] + line[index + 1 :] for line in WEIGHTS])
    the_only(
        problems, "weights.csv", 1, column, None, "mass_" if column == "mass_g" else f"a column {column}"
    )


def test_unknown_and_repeated_columns(bad):
    problems = bad([[*line, "x"] for line in RUNS[:1]] + [[*line, 1] for line in RUNS[1:]])
    the_only(problems, "runs.csv", 1, "x", "x", "a known column: run, speed_rpm")
    problems = bad([[*line, line[3]] for line in RUNS])
    the_only(problems, "runs.csv", 1, "amplitude_um_pp", "amplitude_um_pp", "one column of the amplitude")


def test_mixed_units(bad):
    mixed = [[*RUNS[0], "amplitude_mil_pp"], *([*line, 1] for line in RUNS[1:])]
    words = "one column of the amplitude, and 'amplitude_um_pp' could be it too"
    the_only(bad(mixed), "runs.csv", 1, "amplitude_mil_pp", "amplitude_mil_pp", words)
    both = [[*WEIGHTS[0], "unbalance_g_mm"], *([*line, 1] for line in WEIGHTS[1:])]
    the_only(
        bad(weights=both), "weights.csv", 1, "unbalance_g_mm", "unbalance_g_mm", "one column of the mass"
    )


def test_equal_rows(bad):
    problems = bad([*RUNS, ["trial 2", 1000, "B", 12.5, 290]])
    the_only(
        problems, "runs.csv", 8, "sensor", "B", "(row 7 has the same); repeated readings need a column repeat"
    )
    header, rows = [*RUNS[0], "repeat"], [[*line, 1] for line in RUNS[1:]]
    problems = bad([header, *rows, rows[-1]])
    the_only(problems, "runs.csv", 8, "repeat", "1", "another repeat than in row 7")


def test_a_sensor_missing_in_one_run(bad):
    words = "a reading of sensor 'B' in run 'trial 1' at 1000 rpm, as every run needs at every speed"
    the_only(bad(RUNS[:4] + RUNS[5:]), "runs.csv", None, "sensor", None, words)


def test_a_sensor_that_no_run_has_at_a_speed(bad):
    more = [*RUNS, *([run, 2000, "A", 5, 0] for run in ("initial", "trial 1", "trial 2"))]
    problems = bad(more)
    assert len(problems) == 3
    assert "as every run needs at every speed" in problems[0].expected


BAD_WEIGHTS = [
    ("mass_g", 0, "a weight above 0"),
    ("mass_g", -2, "a weight above 0"),
    ("mass_g", "", "a number"),
    ("angle_deg", "", "a number"),
    ("angle_deg", 720, "an angle from -360 to 360 degrees"),
    ("plane", "", "a name"),
    ("run", "trial1", "a run of the runs table (did you mean 'trial 1'?)"),
    ("run", "", "a name"),
]


@pytest.mark.parametrize(("column", "value", "words"), BAD_WEIGHTS)
def test_bad_weights(bad, column, value, words):
    problems = bad(weights=replaced(WEIGHTS, 3, column, value))
    the_only(problems, "weights.csv", 3, column, str(value), words)


def test_the_same_weight_twice(bad):
    the_only(bad(weights=[*WEIGHTS, WEIGHTS[1]]), "weights.csv", 4, "run", "trial 1", "(row 2 says the same)")


def test_a_weights_table_without_rows_says_that_nothing_was_mounted(read):
    trials = read(weights=WEIGHTS[:1])
    assert (trials.planes, trials.weights.shape) == ((), (3, 0))
    with pytest.raises(UndeterminedError, match="no run has a trial weight, so the effect of none is"):
        estimate_influence(trials)


def test_an_empty_weights_table_is_a_problem(tmp_path):
    (tmp_path / "weights.csv").write_text("")
    found = complaints(read_trials, write_csv(tmp_path / "runs.csv", RUNS), tmp_path / "weights.csv")
    the_only(found, "weights.csv", None, None, None, "the file is empty")


def test_no_header(bad):
    problems = bad(RUNS[1:])
    words = "a header row with the names of columns, separated by , or ; or tabs: run, speed_rpm"
    the_only(problems, "runs.csv", 1, None, None, words)
