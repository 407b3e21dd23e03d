"""Stored coefficients keep what is known of their errors."""

import json
from dataclasses import replace

import numpy as np
import pytest
from balancing_data import complex_normal, synthetic
from tables_data import complaints, write_csv

import fem
from balancing import (
    Gaussian,
    Labels,
    Reading,
    ReadingErrors,
    Trials,
    correct,
    estimate_influence,
    model_influence,
    with_parameters,
)
from rotorid.files import (
    influence_frame,
    job_from_files,
    read_influence,
    write_influence,
)
from rotorid.regression import stretch

ERRORS = ReadingErrors(amplitude=0.03, phase=np.radians(2.0), floor=1e-7)
LABELS = Labels("um_pp", 2e6, "g", 1e3)


def trials(labels=LABELS, errors=ERRORS, **options):
    return synthetic(np.random.default_rng(5), labels=labels, errors=errors, **options)[0]


def round_trip(path, influence, **options):
    write_influence(path, influence)
    return read_influence(path, **options)


@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("weight", [("g", 1e3), ("g_mm", 1e6)])
def test_covariance_and_errors_come_back(tmp_path, phase, weight):
    labels = replace(LABELS, phase=phase, weight_unit=weight[0], weight_scale=weight[1])
    influence = estimate_influence(trials(labels))
    again = round_trip(tmp_path / "influence.json", influence)
    std = np.sqrt(np.einsum("scii->sci", influence.channels()))
    scale = std[..., None] * std[..., None, :]
    np.testing.assert_allclose(again.channels() / scale, influence.channels() / scale, atol=4e-15)
    np.testing.assert_allclose(again.baseline, influence.baseline, rtol=1e-14)
    np.testing.assert_allclose(again.W, influence.W, rtol=1e-14)
    assert (again.reading.source, again.labels) == ("stated", labels)
    errors = again.reading.errors
    np.testing.assert_allclose(
        [errors.amplitude, errors.phase, errors.floor], [0.03, np.radians(2.0), 1e-7], rtol=1e-15
    )


def test_degrees_of_freedom_and_source(tmp_path):
    rng = np.random.default_rng(3)
    made = trials(errors=None)
    noisy = made.mean * (1 + 0.02 * rng.standard_normal((3, *made.mean.shape)))
    influence = estimate_influence(replace(made, readings=noisy))
    assert influence.reading.source == "repeats"
    again = round_trip(tmp_path / "influence.json", influence)
    assert again.reading[1::2] == influence.reading[1::2]
    assert again.reading.errors.amplitude == pytest.approx(influence.reading.errors.amplitude, rel=1e-15)


def baseline_of(made):
    return Trials(
        made.runs[:1],
        made.speeds,
        made.sensors,
        (),
        made.mean[:1],
        np.zeros((1, 0)),
        made.errors,
        made.labels,
    )


def test_stored_errors_of_a_reading_are_those_of_a_run_that_states_none(tmp_path):
    made = trials()
    influence = estimate_influence(made)
    bare = replace(baseline_of(made), errors=None)
    stored = correct(round_trip(tmp_path / "influence.json", influence), bare)
    assert stored.influence.reading.errors.amplitude == pytest.approx(0.03, rel=1e-15)
    assert stored.influence.reading.source == "stated"
    expected = correct(influence, baseline_of(made))
    np.testing.assert_allclose(stored.mass_std, expected.mass_std, rtol=0.25)  # drawn otherwise


def test_a_model_keeps_its_error(tmp_path):
    supports = (fem.Support(1, 1e7, 1e4), fem.Support(5, 1e7, 1e4))
    rotor = fem.Rotor(np.full(4, 0.25), 0.05, supports=supports)
    model = model_influence(
        rotor, {"A": 2, "B": 4}, {"x": 1, "y": (5, 90.0)}, [100.0, 300.0], relative_error=0.1
    )
    again = round_trip(tmp_path / "influence.json", model)
    np.testing.assert_allclose(again.channels(), model.channels(), rtol=1e-14)
    assert (again.reading, again.labels) == (Reading(), model.labels)
    model = with_parameters(model, 0.2j * model.W[None], 0.1)
    again = round_trip(tmp_path / "influence.json", model)
    covariance = model.channels()
    np.testing.assert_allclose(again.channels(), covariance, rtol=1e-12, atol=1e-14 * covariance.max())
    assert_same_columns(again, model)


def assert_same_columns(one, other):
    """As covariances of all readings together; the columns themselves may be turned."""
    F, G = (stretch(each.columns().reshape(len(each.columns()), -1, 1))[..., 0] for each in (one, other))
    np.testing.assert_allclose(F.T @ F, G.T @ G, atol=1e-12 * np.abs(G.T @ G).max())


@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("job", ["stated", "estimated", "assumed"])
def test_storing_keeps_everything_that_is_known_of_errors(tmp_path, phase, job):
    made, W, Y0 = synthetic(
        np.random.default_rng(6), labels=replace(LABELS, phase=phase), errors=ERRORS, sensors=2, speeds=2
    )
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
    assert (new.origin, new.evenly) == (old.origin, old.evenly)
    assert new.level == pytest.approx(old.level, rel=1e-14)
    assert (again.reading.source, again.reading.dof) == (influence.reading.source, influence.reading.dof)
    assert_same_columns(again, influence)
    stored, whole = correct(again), correct(influence)
    np.testing.assert_allclose(stored.weights, whole.weights, rtol=1e-7)
    # the same sizes of errors, drawn otherwise
    np.testing.assert_allclose(stored.mass_std, whole.mass_std, rtol=0.25)
    assert stored.check_rms == pytest.approx(whole.check_rms, rel=0.1)
    # the same reading read again, from a table of one run
    bare = replace(baseline_of(made), readings=influence.baseline[None], errors=None)
    later = correct(again, bare)
    np.testing.assert_allclose(later.draws, stored.draws, rtol=1e-6, atol=1e-9 * abs(stored.draws).max())
    # another one has errors of its own
    other = correct(again, replace(bare, readings=bare.readings * (1 + 1e-6)))
    assert abs(other.draws - stored.draws).max() > 1e-3 * abs(stored.draws).max()


def test_job_with_sensors_in_another_order(tmp_path):
    made = trials()
    influence = estimate_influence(made)
    write_influence(tmp_path / "influence.json", influence)
    lines = [["run", "speed_rad_s", "sensor", "amplitude_um_pp", "phase_deg"]]
    for c in (3, 1):
        size, phase = LABELS.vibration(made.mean[0, 1, c])
        lines.append(["now", 200.4, f"s{c}", float(size), float(phase)])
    write_csv(tmp_path / "now.csv", lines)
    job = job_from_files([tmp_path / "now.csv"], influence=tmp_path / "influence.json")
    assert job.influence.sensors == job.trials.sensors == ("s3", "s1")
    np.testing.assert_array_equal(job.influence.speeds, job.trials.speeds)
    np.testing.assert_allclose(job.influence.W, influence.W[1:2, [3, 1]], rtol=1e-9)
    expected = influence.channels()[1][[3, 1]][None, ..., 2:, 2:]
    np.testing.assert_allclose(
        job.influence.channels()[..., 2:, 2:], expected, rtol=1e-9, atol=1e-12 * abs(expected).max()
    )


def test_without_errors_nothing_is_added(tmp_path):
    known = estimate_influence(trials())
    nothing = np.full(known.baseline.shape, np.nan)
    influence = replace(known, baseline=nothing, errors=Gaussian.none(*known.W.shape))
    columns = ["speed_rpm", "sensor", "plane", "influence_um_pp_per_g", "phase_lead_deg"]
    assert list(influence_frame(influence).columns) == columns
    again = round_trip(tmp_path / "influence.json", influence)
    assert (again.known_errors, again.reading) == (False, Reading())


def test_exact_zero_reading_has_no_correlations(tmp_path):
    made = synthetic(np.random.default_rng(5), sensors=2, speeds=1, labels=LABELS)[0]
    readings = made.readings.copy()
    readings[..., 1] = 0.0
    influence = estimate_influence(replace(made, readings=readings, errors=ReadingErrors(0.02, 0.02)))
    again = round_trip(tmp_path / "influence.json", influence)
    assert not again.channels()[0, 1].any()
    assert again.channels()[0, 0].any()


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize("phase", ["lead", "lag"])
def test_a_table_for_people_has_one_standard_deviation_of_each_coefficient(tmp_path, suffix, phase):
    influence = estimate_influence(trials(replace(LABELS, phase=phase)))
    again = round_trip(tmp_path / f"influence{suffix}", influence)
    np.testing.assert_allclose(again.W, influence.W, rtol=1e-13)
    both = (np.einsum("scii->sci", each.channels())[..., 2:] for each in (again, influence))
    new, old = (each.reshape(*influence.W.shape, 2) for each in both)
    np.testing.assert_allclose(new[..., 0], new[..., 1])
    np.testing.assert_allclose(new.mean(axis=-1), old.mean(axis=-1), rtol=1e-12)
    assert not again.has_baseline
    assert correct(again, baseline_of(trials(replace(LABELS, phase=phase)))).weights.shape == (2,)


def without(key):
    return lambda document: document["influence"].pop(key)


def put(key, value):
    return lambda document: document["influence"].update({key: value})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without("W"), "'W' is missing"),
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
