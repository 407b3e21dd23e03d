"""Stored influence coefficients: tables for people, and JSON that keeps what is known of their errors."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, synthetic
from cases import each_of
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

import fem
from balancing import (
    Labels,
    Reading,
    ReadingErrors,
    correct,
    estimate_influence,
    model_influence,
    with_parameters,
)
from rotorid.files import influence_frame, job_from_files, read_influence, read_trials, write_influence
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


def trials(labels=LABELS, errors=ERRORS, **options):
    return synthetic(np.random.default_rng(5), labels=labels, errors=errors, **options)[0]


def round_trip(path, influence, **options):
    write_influence(path, influence)
    return read_influence(path, **options)


def test_meaning(stored):
    influence = stored()
    assert (influence.sensors, influence.planes) == (("A", "B"), ("1", "2"))
    np.testing.assert_allclose(influence.speeds, [1000 * math.pi / 30], rtol=1e-15)
    np.testing.assert_allclose(influence.W, np.array([[[2j, 1], [-0.5, -4j]]]) * 0.5e-6 / 1e-3, rtol=1e-15)
    labels = influence.labels
    assert (labels.vibration_unit, labels.weight_unit, labels.phase) == ("um_pp", "g", "lead")
    assert (influence.has_baseline, influence.known_errors) == (False, False)
    assert list(influence_frame(influence).columns) == [*HEADER[:4], "phase_lead_deg"]


def test_phase_convention_of_the_table_wins_over_that_of_the_job(stored, tmp_path):
    plain = stored()
    np.testing.assert_array_equal(stored(phase="lag").W, plain.W.conj())
    np.testing.assert_array_equal(stored(angles="against rotation").W, plain.W)
    path = tmp_path / "lag.csv"
    path.write_text("# phase = lag\n" + (tmp_path / "influence.csv").read_text())
    for phase in (None, "lead", "lag"):
        influence = read_influence(path, phase=phase)
        np.testing.assert_array_equal(influence.W, plain.W.conj())
        assert influence.labels.phase == phase or phase is None


@each_of(
    ("suffix", "phase", "angles"),
    [
        (".csv", "lead", "against rotation"),
        (".csv", "lag", "with rotation"),
        (".xlsx", "lag", "with rotation"),
    ],
)
def test_a_table_comes_back_with_one_standard_deviation(tmp_path, suffix, phase, angles):
    files = write_csv(tmp_path / "runs.csv", RUNS), write_csv(tmp_path / "weights.csv", WEIGHTS)
    influence = estimate_influence(read_trials(*files, phase=phase, angles=angles, errors=ERRORS))
    again = round_trip(tmp_path / f"influence{suffix}", influence, angles=angles)
    np.testing.assert_allclose(again.speeds, influence.speeds, rtol=1e-14)
    np.testing.assert_allclose(again.W, influence.W, rtol=1e-13)
    for name in ("sensors", "planes", "labels"):
        assert getattr(again, name) == getattr(influence, name)
    both = (np.einsum("scii->sci", each.channels())[..., 2:] for each in (again, influence))
    new, old = (each.reshape(*influence.W.shape, 2) for each in both)
    np.testing.assert_allclose(new[..., 0], new[..., 1])
    np.testing.assert_allclose(new.mean(axis=-1), old.mean(axis=-1), rtol=1e-12)
    assert not again.has_baseline


def test_balance_writes_measured_coefficients_for_people_and_without_loss(tmp_path, cli):
    runs, weights = write_csv(tmp_path / "runs.csv", RUNS), write_csv(tmp_path / "weights.csv", WEIGHTS)
    influence = estimate_influence(read_trials(runs, weights))
    for name in ("fan influence.csv", "w.json"):
        assert cli("balance", runs, weights, "--output", tmp_path / name).code == 0
        np.testing.assert_allclose(read_influence(tmp_path / name).W, influence.W, rtol=1e-13)


def test_names_with_signs_and_readings_without_a_unit_survive(stored, tmp_path):
    influence = stored(replaced([HEADER, [1000, "+X", "-1", 2.0, 90]], 1, HEADER[3], "influence_per_oz_in"))
    assert (influence.labels.vibration_unit, influence.labels.weight_unit) == ("", "oz_in")
    for name in ("a.csv", "a.xlsx"):
        again = round_trip(tmp_path / name, influence)
        assert (again.sensors, again.planes) == (("+X",), ("-1",))
        np.testing.assert_allclose(again.W, influence.W, rtol=1e-14)


@each_of(
    ("row", "column", "value", "words"),
    [
        (1, HEADER[3], "influence", "influence_<vibration unit>_per_<weight unit>"),
        (1, HEADER[3], "influence_um_per_gram", "one of the units kg, g"),
        (1, HEADER[3], "influence_um_pk_per_g", "um_pp (peak to peak)"),
        (2, HEADER[3], -1, "a coefficient of 0 or more"),
        (2, "phase_deg", 400, "an angle from -360 to 360 degrees"),
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
    "angle": "speed_rpm,sensor,plane,Sensitivity (g/in/s),Angle (deg)\n2419,prop,spinner,45.9,309\n",
    "vector": "speed_rpm,sensor,plane,Sensitivity [g per ips]\n2419,prop,spinner,45.9 @ 309°\n",
    "radians": "speed_rpm,sensor,plane,influence_g_per_in_s,phase_rad\n2419,prop,spinner,45.9,5.393067388\n",
    "brackets": "speed_rpm,sensor,plane,Coefficient g/(in/s),angle_deg\n2419,prop,spinner,45.9,309\n",
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
    (tmp_path / "i.csv").write_text("# angles = against rotation\n" + FORMS["as documented"])
    found = read_influence(tmp_path / "i.csv", phase="lead").W[0, 0, 0]
    np.testing.assert_allclose(1 / found, 0.0459 / 0.0254 * np.exp(-1j * np.radians(309)), rtol=1e-12)


def test_an_acceleration_in_g_per_weight_in_g_is_as_before(tmp_path):
    (tmp_path / "i.csv").write_text("speed_rpm,sensor,plane,influence_g_per_g,phase_deg\n600,A,P,2,90\n")
    np.testing.assert_allclose(read_influence(tmp_path / "i.csv").W, [[[2j * 9.80665e3]]], rtol=1e-12)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("600,A,P,2,90\n600,B,P,2,90\n", "one sensor, one plane and no errors"),
        ("600,A,P,2,90\n600,A,Q,2,90\n", "one sensor, one plane and no errors"),
        ("600,A,P,0,90\n", "a weight above 0"),
    ],
)
def test_of_several_it_would_be_no_influence(tmp_path, rows, words):
    (tmp_path / "i.csv").write_text("speed_rpm,sensor,plane,influence_oz_per_mil,phase_deg\n" + rows)
    with pytest.raises(ValueError, match=words):
        read_influence(tmp_path / "i.csv")


def test_a_model_keeps_its_error(tmp_path):
    supports = (fem.Support(1, 1e7, 1e4), fem.Support(5, 1e7, 1e4))
    rotor = fem.Rotor(np.full(4, 0.25), 0.05, supports=supports)
    places = {"A": 2, "B": 4}, {"x": 1, "y": (5, 90.0)}
    model = model_influence(rotor, *places, [100.0, 300.0], relative_error=0.1)
    model = with_parameters(model, 0.2j * model.W[None], 0.1)
    again = round_trip(tmp_path / "influence.json", model)
    covariance = model.channels()
    np.testing.assert_allclose(again.channels(), covariance, rtol=1e-12, atol=1e-14 * covariance.max())
    assert (again.reading, again.labels) == (Reading(), model.labels)
    assert_same_columns(again, model)


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
    assert (new.origin, new.evenly, new.level) == (
        old.origin,
        old.evenly,
        pytest.approx(old.level, rel=1e-14),
    )
    assert (again.reading, again.labels) == (influence.reading, labels)
    np.testing.assert_allclose(again.baseline, influence.baseline, rtol=1e-14)
    std = np.sqrt(np.einsum("scii->sci", influence.channels()))
    scale = std[..., None] * std[..., None, :]
    np.testing.assert_allclose(again.channels() / scale, influence.channels() / scale, atol=1e-13)
    assert_same_columns(again, influence)
    stored, whole = correct(again), correct(influence)
    np.testing.assert_allclose(stored.weights, whole.weights, rtol=1e-7)
    # the same sizes of errors, drawn otherwise
    np.testing.assert_allclose(stored.mass_std, whole.mass_std, rtol=0.25)
    # the same reading read again, from a table of one run
    bare = replace(
        made,
        runs=made.runs[:1],
        planes=(),
        readings=influence.baseline[None],
        weights=np.zeros((1, 0)),
        errors=None,
    )
    later = correct(again, bare)
    np.testing.assert_allclose(later.draws, stored.draws, rtol=1e-6, atol=1e-9 * abs(stored.draws).max())
    # another one has errors of its own
    other = correct(again, replace(bare, readings=bare.readings * (1 + 1e-6)))
    assert abs(other.draws - stored.draws).max() > 1e-3 * abs(stored.draws).max()


def test_a_job_takes_its_sensors_and_speeds_in_its_own_order(stored, tmp_path):
    fast = [[2000, *row[1:3], 3 * row[3], row[4], 0.1] for row in TABLE[1:]]
    whole = stored([[*HEADER, "std_um_pp_per_g"], *([*row, 0.2] for row in TABLE[1:]), *fast])
    now = write_csv(tmp_path / "now.csv", [RUNS[0], *(["now", 2004, *row[2:]] for row in RUNS[2:0:-1])])
    job = job_from_files([now], influence=tmp_path / "influence.csv")
    assert job.influence.sensors == job.trials.sensors == ("B", "A")
    np.testing.assert_array_equal(job.influence.speeds, job.trials.speeds)
    np.testing.assert_allclose(job.influence.W, whole.W[1:, ::-1], rtol=1e-14)
    np.testing.assert_allclose(job.influence.channels(), whole.channels()[1:, ::-1], rtol=1e-14)


def without(key):
    return lambda document: document["influence"].pop(key)


def put(key, value):
    return lambda document: document["influence"].update({key: value})


@each_of(
    ("change", "words"),
    [
        (without("W"), "missing or wrong: 'W'"),
        (lambda document: document.update(schema_version=99), "needs a newer rotorid"),
        (put("W", [[[[1.0]]], [[["x"]]]]), "could not convert"),
        (put("covariance", [[[[-1.0] * 6] * 6]]), "covariance"),
        (put("planes", ["A"]), "shape"),
        (put("run_errors", {"sizes": [], "probability": [], "level": 0, "evenly": 0}), "probabilities"),
        (put("labels", {"phase": "late", "assumed": []}), "phase must be"),
        (put("speeds_rad_s", [None]), "speeds"),
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
