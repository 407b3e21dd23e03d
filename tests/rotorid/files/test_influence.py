"""Stored influence coefficients: tables for people, and JSON that keeps what is known of their errors."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, synthetic
from cases import each_of
from tables_data import RUNS, complaints, replaced, the_only, write_csv

from balancing import (
    Labels,
    ReadingErrors,
    correct,
    estimate_influence,
)
from rotorid.files import job_from_files, read_influence, read_trials, write_influence
from rotorid.files.influence import influence_table
from rotorid.regression import stretch

HEADER = ["speed_rpm", "sensor", "plane", "influence_um_pp_per_g", "phase_deg"]
TABLE = [
    HEADER,
    [1000, "A", "1", 2.0, 90],
    [1000, "A", "2", 1.0, 0],
    [1000, "B", "1", 0.5, 180],
    [1000, "B", "2", 4.0, 270],
]
ERRORS = ReadingErrors(amplitude=0.03, phase=np.radians(2.0), floor=1e-7)
LABELS = Labels("um_pp", 2e6, "g", 1e3)


@pytest.fixture
def stored(tmp_path):
    def read(table=TABLE, **options):
        return read_influence(write_csv(tmp_path / "influence.csv", table), **options)

    return read


def round_trip(path, influence, **options):
    write_influence(path, influence)
    return read_influence(path, **options)


def test_meaning(stored):
    influence = stored()
    assert (influence.sensors, influence.planes) == (("A", "B"), ("1", "2"))
    np.testing.assert_allclose(influence.speeds, [1000 * math.pi / 30], rtol=1e-15)
    np.testing.assert_allclose(influence.W, np.array([[[2j, 1], [-0.5, -4j]]]) * 0.5e-6 / 1e-3, rtol=1e-15)
    assert (influence.has_baseline, influence.known_errors) == (False, False)
    np.testing.assert_array_equal(stored(phase="lag").W, influence.W.conj())
    np.testing.assert_array_equal(stored(angles="against rotation").W, influence.W)
    assert influence_table(influence).headings == [*HEADER[:4], "phase_lead_deg"]


@each_of("suffix, phase, angles", [(".csv", "lag", "against rotation"), (".xlsx", "lag", "with rotation")])
def test_a_table_comes_back_with_one_standard_deviation(tmp_path, folder, suffix, phase, angles):
    """Its own phase counts, whatever the job says."""
    files = folder / "runs.csv", folder / "weights.csv"
    influence = estimate_influence(read_trials(*files, phase=phase, angles=angles, errors=ERRORS))
    again = round_trip(tmp_path / f"influence{suffix}", influence, angles=angles)
    for stated in (again, read_influence(tmp_path / f"influence{suffix}", phase="lead", angles=angles)):
        np.testing.assert_allclose(stated.W, influence.W, rtol=1e-13)
    assert (again.sensors, again.planes) == (influence.sensors, influence.planes)
    assert again.labels == influence.labels
    both = (np.einsum("scii->sci", each.channels())[..., 2:] for each in (again, influence))
    new, old = (each.reshape(*influence.W.shape, 2) for each in both)
    np.testing.assert_allclose(new[..., 0], new[..., 1])
    np.testing.assert_allclose(new.mean(axis=-1), old.mean(axis=-1), rtol=1e-12)


def test_balance_writes_measured_coefficients_for_people_and_without_loss(folder, cli):
    runs, weights = folder / "runs.csv", folder / "weights.csv"
    influence = estimate_influence(read_trials(runs, weights))
    for name in ("fan influence.csv", "w.json"):
        assert cli("balance", runs, weights, "--output", folder / name).code == 0
        np.testing.assert_allclose(read_influence(folder / name).W, influence.W, rtol=1e-13)


@each_of(
    ("row", "column", "value", "words"),
    [
        (1, HEADER[3], "influence", "influence_<vibration unit>_per_<weight unit>"),
        (2, HEADER[3], -1, "a coefficient of 0 or more"),
        (2, "phase_deg", 400, "from -360 to 360 degrees"),
        (2, "speed_rpm", 0, "a speed above 0"),
    ],
)
def test_bad_columns_and_cells(stored, row, column, value, words):
    found = complaints(stored, replaced(TABLE, row, column, value))
    the_only(found, "influence.csv", row, value if row == 1 else column, str(value), words)


def test_gaps_and_repeats(stored):
    words = "a coefficient of sensor 'B' and plane '1' at 1000 rpm"
    the_only(complaints(stored, TABLE[:3] + TABLE[4:]), "influence.csv", None, "plane", None, words)
    the_only(complaints(stored, [*TABLE, TABLE[2]]), "influence.csv", 6, "plane", "2", "(row 3 has the same)")


NOW = "run,speed_rpm,sensor,amplitude_in_s,phase_deg\nas found,2419,prop,0.37,165\n"
FORMS = {
    "as documented": "speed_rpm,sensor,plane,influence_g_per_in_s,phase_deg\n2419,prop,spinner,45.9,309\n",
    "vector": "speed_rpm,sensor,plane,Sensitivity [g per ips]\n2419,prop,spinner,45.9 @ 309°\n",
}


@each_of(
    ("form", "phase", "angles"),
    [
        (form, phase, angles)
        for form in FORMS
        for phase, angles in (("lead", "with rotation"), ("lag", "against rotation"))
    ],
)
def test_the_weight_per_vibration_is_that_of_the_handbook(tmp_path, form, phase, angles):
    (tmp_path / "runs.csv").write_text(NOW)
    (tmp_path / "influence.csv").write_text(FORMS[form], encoding="utf-8")
    stored = tmp_path / "influence.csv"
    job = job_from_files([tmp_path / "runs.csv"], influence=stored, phase=phase, angles=angles)
    size, angle = job.influence.labels.weight(-job.trials.readings[0, 0, 0] / job.influence.W[0, :, 0])
    np.testing.assert_allclose([size, angle], [[0.37 * 45.9], [294.0]], rtol=1e-9)
    assert (job.influence.labels.weight_unit, job.influence.planes) == ("g", ("spinner",))


def test_an_angle_against_the_rotation_of_phases_that_lead(tmp_path):
    (tmp_path / "i.csv").write_text(FORMS["as documented"])
    found = read_influence(tmp_path / "i.csv", phase="lead", angles="against rotation").W[0, 0, 0]
    np.testing.assert_allclose(1 / found, 0.0459 / 0.0254 * np.exp(-1j * np.radians(309)), rtol=1e-12)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("600,A,P,2,90\n600,B,P,2,90\n", "one sensor, one plane and no errors"),
        ("600,A,P,0,90\n", "a weight above 0"),
    ],
)
def test_of_several_it_would_be_no_influence(tmp_path, rows, words):
    (tmp_path / "i.csv").write_text("speed_rpm,sensor,plane,influence_oz_per_mil,phase_deg\n" + rows)
    with pytest.raises(ValueError, match=words):
        read_influence(tmp_path / "i.csv")


def assert_same_columns(one, other):
    """As covariances of all readings together; the columns themselves may be turned."""
    F, G = (stretch(each.columns().reshape(len(each.columns()), -1, 1))[..., 0] for each in (one, other))
    np.testing.assert_allclose(F.T @ F, G.T @ G, atol=1e-12 * np.abs(G.T @ G).max())


@each_of(("job", "phase"), [("stated", "lag"), ("estimated", "lead"), ("assumed", "lag")])
def test_json_keeps_everything_that_is_known_of_errors(tmp_path, job, phase):
    labels = replace(LABELS, phase=phase)
    made, W, Y0 = synthetic(np.random.default_rng(6), labels=labels, errors=ERRORS, sensors=2, speeds=2)
    rng = np.random.default_rng(7)
    if job != "assumed":
        T = np.vstack((made.weights, made.weights))
        Y = (Y0 + np.einsum("scp,rp->rsc", W, T)) * (1 + 0.03 * complex_normal(rng, (len(T), 1, 1)))
        Y *= 1 + 0.01 * complex_normal(rng, (len(T), 2, 2))
        made = replace(made, runs=tuple("abcdefgh"[: len(T)]), weights=T, readings=Y)
    influence = estimate_influence(made if job == "stated" else replace(made, errors=None))
    again = round_trip(tmp_path / "influence.json", influence)
    old, new = influence.run_errors, again.run_errors
    np.testing.assert_array_equal(new.sizes, old.sizes)
    np.testing.assert_allclose(new.probability, old.probability, rtol=1e-12)
    assert (new.origin, new.evenly, new.level) == (old.origin, old.evenly, pytest.approx(old.level))
    assert (again.reading, again.labels) == (influence.reading, labels)
    assert_same_columns(again, influence)
    stored = correct(again)
    np.testing.assert_allclose(stored.weights, correct(influence).weights, rtol=1e-7)
    # the same reading read again, from a table of one run; another one has errors of its own
    bare = replace(
        made, runs=made.runs[:1], planes=(), readings=influence.baseline[None],
        weights=np.zeros((1, 0)), errors=None,
    )  # fmt: skip
    size = abs(stored.draws).max()
    np.testing.assert_allclose(correct(again, bare).draws, stored.draws, rtol=1e-6, atol=1e-9 * size)
    other = correct(again, replace(bare, readings=bare.readings * (1 + 1e-6)))
    assert abs(other.draws - stored.draws).max() > 1e-3 * size


def test_a_job_takes_its_sensors_and_speeds_in_its_own_order(stored, tmp_path):
    fast = [[2000, *row[1:3], 3 * row[3], row[4]] for row in TABLE[1:]]
    whole = stored([*TABLE, *fast])
    now = write_csv(tmp_path / "now.csv", [RUNS[0], *(["now", 2004, *row[2:]] for row in RUNS[2:0:-1])])
    job = job_from_files([now], influence=tmp_path / "influence.csv")
    assert job.influence.sensors == job.trials.sensors == ("B", "A")
    np.testing.assert_allclose(job.influence.W, whole.W[1:, ::-1], rtol=1e-14)


def put(key, value):
    return lambda document: document["influence"].update({key: value})


@each_of(
    ("change", "words"),
    [
        (lambda document: document.update(schema_version=99), "needs a newer rotorid"),
        (put("run_errors", {"sizes": [], "probability": [], "level": 0, "evenly": 0}), "probabilities"),
    ],
)
def test_bad_json_is_one_message(tmp_path, change, words):
    made = synthetic(np.random.default_rng(1), sensors=1, speeds=1)[0]
    path = tmp_path / "influence.json"
    write_influence(path, estimate_influence(replace(made, labels=LABELS, errors=ERRORS)))
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    assert words in complaints(read_influence, path)[0].expected


def test_stored_conventions_hold_for_the_readings_unless_others_are_stated(folder):
    trials = read_trials(folder / "runs.csv", folder / "weights.csv", phase="lag", angles="against rotation")
    write_influence(folder / "influence.json", estimate_influence(trials))
    expected = correct(estimate_influence(trials)).weights
    turned = [RUNS[0], *([*row[:4], 360 - row[4]] for row in RUNS[1:3])]
    for phase, runs, words in (
        (None, RUNS[:3], "nothing states the conventions of the readings"),
        ("lag", RUNS[:3], ""),
        ("lead", turned, ""),
    ):
        now = write_csv(folder / "now.csv", runs)
        read = job_from_files([now], influence=folder / "influence.json", phase=phase)
        c = correct(read.influence, read.trials)
        np.testing.assert_allclose(c.weights, expected, rtol=1e-9)
        assert c.to_dict()["conventions"]["angles"] == "against rotation"
        assert any(words in w for w in c.warnings) or not words


def test_a_table_that_states_no_phase_counts_as_the_readings_do_and_says_so(folder):
    trials = read_trials(folder / "runs.csv", folder / "weights.csv", phase="lag")
    write_influence(folder / "w.csv", estimate_influence(trials))
    now = write_csv(folder / "now.csv", RUNS[:3])
    for heading, phase, words in (("_lag_", "lag", 0), ("_", "lag", 1), ("_", "lead", 0)):
        (folder / "w.csv").write_text((folder / "w.csv").read_text().replace("phase_lag_", f"phase{heading}"))
        warned = job_from_files([now], influence=folder / "w.csv", phase=phase, angles="with").trials.warnings
        assert sum("w.csv: those of the readings are used" in each for each in warned) == words
