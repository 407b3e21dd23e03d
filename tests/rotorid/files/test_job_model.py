"""Jobs with a rotor model, and with check runs."""

from __future__ import annotations

import numpy as np
import pytest
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from balancing import compare_check, correct, estimate_influence
from fem import Sensor
from rotorid.files import read_job, read_rotor, read_trials, write_influence

SHAFT = [
    ["length_m", "diameter_m", "support_stiffness_N_per_m"],
    [0.2, 0.05, 1e7],
    [0.2, 0.05, 0],
    [0.2, 0.05, 0],
    [0, 0.05, 1e7],
]
ROTOR = 'shaft = "shaft.csv"\n[[station]]\nname = "disc"\nnode = 2\n'
TABLES = 'runs = "runs.csv"\nweights = "weights.csv"\n'
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
CHECK = [RUNS[0], ["check", 1003, "B", 1.5, 20], ["check", 1003, "A", 2.0, 30]]
CHECK_WEIGHTS = [WEIGHTS[0], ["check", "2", 1.5, 90]]


@pytest.fixture
def folder(tmp_path):
    write_csv(tmp_path / "runs.csv", RUNS)
    write_csv(tmp_path / "weights.csv", WEIGHTS)
    write_csv(tmp_path / "shaft.csv", SHAFT)
    write_csv(tmp_path / "check.csv", CHECK)
    write_csv(tmp_path / "mounted.csv", CHECK_WEIGHTS)
    (tmp_path / "rotor.toml").write_text(ROTOR, encoding="utf-8")
    return tmp_path


@pytest.fixture
def job(folder):
    def read(text):
        (folder / "job.toml").write_text(text, encoding="utf-8")
        return read_job(folder / "job.toml")

    return read


def test_a_rotor_with_planes_and_sensors(job, folder):
    read = job(TABLES + MODEL)
    assert read.rotor == read_rotor(folder / "rotor.toml")
    assert read.plane_nodes == {"1": 2, "2": 3}
    assert read.sensor_places == {"A": Sensor(1, 45.0), "B": Sensor(2, 0.0)}
    assert read.files[-2:] == (folder / "rotor.toml", folder / "shaft.csv")
    against = job('angles = "against rotation"\n' + TABLES + MODEL)
    assert against.sensor_places == {"A": Sensor(1, -45.0), "B": Sensor(2, 0.0)}
    assert tuple(read.planes) == ("1", "2")


def test_a_job_that_rests_on_its_model(job, folder):
    """No weights, no coefficients: planes of the job file, unbalances, or masses where radii are known."""
    write_csv(folder / "runs.csv", RUNS[:3])
    text = 'runs = "runs.csv"\n' + MODEL
    read = job(text.replace('station = "disc"', 'station = "disc"\nmax_unbalance_g_mm = 50', 1))
    assert tuple(read.planes) == ("1", "2")
    assert read.trials.planes == ()
    assert (read.trials.labels.weight_unit, read.trials.labels.weight_scale) == ("g_mm", 1e6)
    np.testing.assert_allclose(read.limits.max_weight, [5e-5, np.inf])
    with_radii = text.replace("[planes.2]", "radius_mm = 100\n[planes.2]\nradius_mm = 50")
    read = job(with_radii)
    assert read.radii == {"1": 0.1, "2": 0.05}
    assert read.trials.labels.weight_unit == "g"


def test_a_plane_that_only_the_model_knows(job):
    read = job(TABLES + MODEL + "[planes.3]\nnode = 4\nmax_mass_g = 3\n")
    assert tuple(read.planes) == ("1", "2", "3")
    assert read.trials.planes == ("1", "2")
    np.testing.assert_array_equal(read.limits.max_weight, [np.inf, np.inf, 0.003])
    assert read.limits_of(read.trials.planes).any is False


def test_planes_of_stored_coefficients(job, folder):
    influence = estimate_influence(read_trials(folder / "runs.csv", folder / "weights.csv"))
    write_influence(folder / "influence.csv", influence)
    write_csv(folder / "now.csv", RUNS[:3])
    read = job('runs = "now.csv"\ninfluence = "influence.csv"\n[planes.2]\nmax_mass_g = 3\n')
    assert tuple(read.planes) == ("1", "2")
    np.testing.assert_array_equal(read.limits.max_weight, [np.inf, 0.003])


BAD_MODELS = [
    (
        'station = "disc"',
        'station = "dics"',
        "planes.1.station",
        "dics",
        "(did you mean 'disc'?); its stations are",
    ),
    ("node = 3", "node = 5", "planes.2.node", "5", "a node of the rotor model, from 1 to 4"),
    ("node = 1", "node = 7", "sensors.A.node", "7", "a node of the rotor model, from 1 to 4"),
    ('"rotor.toml"', "3", "rotor", "3", "a text in quotes"),
]


@pytest.mark.parametrize(("old", "new", "key", "value", "words"), BAD_MODELS)
def test_bad_models(job, old, new, key, value, words):
    found = complaints(job, TABLES + MODEL.replace(old, new, 1))
    the_only(found, "job.toml", None, key, value, words)


def test_check_runs(job, folder):
    """In the job's order of nothing but names: speeds are those of the job, units convert."""
    read = job(TABLES + 'check = "check.csv"')
    assert (read.check.sensors, read.check.planes, read.check_mounted) == (("B", "A"), (), False)
    np.testing.assert_array_equal(read.check.speeds, read.trials.speeds)
    assert read.files[-1] == folder / "check.csv"
    write_csv(folder / "check.csv", replaced(CHECK, 1, "amplitude_um_pp", "amplitude_mm"))
    again = job(TABLES + 'check = "check.csv"\ncheck_weights = "mounted.csv"\n[errors]\nphase_deg = 2\n')
    np.testing.assert_allclose(again.check.readings, 2e3 * read.check.readings)
    assert again.check.labels == again.trials.labels
    assert again.check_mounted is True
    assert again.check.planes == ("1", "2")
    np.testing.assert_allclose(again.check.weights, [[0, 1.5e-3j]], atol=1e-18)
    assert again.check.errors == again.trials.errors
    assert again.files[-2:] == (folder / "check.csv", folder / "mounted.csv")


def test_a_check_with_nothing_mounted(job, folder):
    """A weights table without rows says so; no weights table stands for the proposed corrections."""
    write_csv(folder / "mounted.csv", CHECK_WEIGHTS[:1])
    read = job(TABLES + 'check = "check.csv"\ncheck_weights = "mounted.csv"')
    assert read.check.planes == ("1", "2")
    assert not read.check.weights.any()
    influence = estimate_influence(read.trials)
    found = compare_check(correct(influence), read.check, influence)
    assert found.as_proposed is False
    np.testing.assert_array_equal(found.predicted[0], found.before)
    plain = compare_check(correct(influence), job(TABLES + 'check = "check.csv"').check, influence)
    assert plain.as_proposed is True
    assert np.abs(plain.predicted).max() < 1e-12 * np.abs(plain.before).max()


BAD_CHECKS = [
    (3, "sensor", "C", "check.csv", "sensor", "C", "what the job has: A and B"),
    (1, "amplitude_um_pp", "amplitude_mm_s", "check.csv", "amplitude", "mm_s", "what the job has: um_pp"),
    (2, "phase_deg", "x", "check.csv", "phase_deg", "x", "a number"),
]


@pytest.mark.parametrize(("row", "column", "value", "file", "where", "shown", "words"), BAD_CHECKS)
def test_bad_check_runs(job, folder, row, column, value, file, where, shown, words):
    write_csv(folder / "check.csv", replaced(CHECK, row, column, value))
    found = complaints(job, TABLES + 'check = "check.csv"')
    the_only(found, file, 2 if value == "x" else None, where, shown, words)


def test_check_runs_at_other_speeds_and_planes(job, folder):
    write_csv(folder / "check.csv", [CHECK[0], *([line[0], 1200, *line[2:]] for line in CHECK[1:])])
    write_csv(folder / "mounted.csv", replaced(CHECK_WEIGHTS, 2, "plane", "3"))
    found = complaints(job, TABLES + 'check = "check.csv"\ncheck_weights = "mounted.csv"')
    assert [(p.column, p.value) for p in found] == [("plane", "3"), ("speed", "1200 rpm")]
    assert "what the job has: 1000 rpm" in found[1].expected
    write_csv(folder / "mounted.csv", [["run", "plane", "unbalance_g_mm", "angle_deg"], *CHECK_WEIGHTS[1:]])
    write_csv(folder / "check.csv", CHECK)
    found = complaints(job, TABLES + 'check = "check.csv"\ncheck_weights = "mounted.csv"')
    the_only(found, "mounted.csv", None, "weight", "g_mm", "what the job has: g, or a unit that converts")
    found = complaints(job, TABLES + 'check_weights = "mounted.csv"')
    the_only(found, "job.toml", None, "check_weights", "mounted.csv", "the check runs too")


def test_two_speeds_of_a_check_run_that_are_one_of_the_job(job, folder):
    lines = [line for speed in (997, 1003) for line in ([row[0], speed, *row[2:]] for row in CHECK[1:])]
    write_csv(folder / "check.csv", [CHECK[0], *lines])
    found = complaints(job, TABLES + 'check = "check.csv"')
    the_only(found, "check.csv", None, "speed", "1003 rpm", "each speed of the job once")
