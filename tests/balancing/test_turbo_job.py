"""The sample job: corrections from its sheet, mounted on the simulated rotor that made the sheet."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from balancing import correct, estimate_influence
from rotorid.files import read_job

JOB = Path(__file__).resolve().parents[2] / "sample_data" / "turbo_job"


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_job", JOB / "make_job.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def correction():
    return correct(estimate_influence(read_job(JOB / "job.toml").trials), method="least-squares")


def test_the_tables_are_what_the_script_makes(maker, tmp_path):
    maker.main(tmp_path)
    for name in ("runs.csv", "weights.csv", "check.csv", "check_weights.csv"):
        assert (tmp_path / name).read_text() == (JOB / name).read_text()


def test_the_sheet_does_not_show_the_unbalance(maker):
    text = (JOB / "runs.csv").read_text() + (JOB / "weights.csv").read_text() + (JOB / "job.toml").read_text()
    for size in np.abs(maker.true_unbalance()) / maker.G_MM:
        assert f"{size:.1f}" not in text


def test_a_check_run_on_the_true_rotor(maker, correction):
    """At least 50 times smaller than before, and nothing grows."""
    before, after = np.abs(maker.simulate(np.zeros(3))), np.abs(maker.simulate(correction.weights))
    assert before.max() >= 50 * after.max()
    assert (after < before).all()


def test_the_check_run_differs_from_its_prediction_as_stated(maker, correction):
    exact = maker.simulate(correction.weights)
    shown = [maker.as_read(z) for z in exact.ravel()]
    read = np.array([float(a) * maker.UM_PP * np.exp(1j * np.deg2rad(float(p))) for a, p in shown])
    difference = read - correction.after.ravel()
    vector = np.stack((difference.real, difference.imag), axis=-1)
    stated = correction.after_covariance.reshape(-1, 2, 2)
    distance = np.einsum("ni,nij,nj->n", vector, np.linalg.inv(stated), vector)
    assert distance.max() < 13.82  # χ² with 2 degrees of freedom, 99.9 %
    assert 17.9 < distance.sum() < 73.4  # with 40, from 0.1 % to 99.9 %


def test_the_corrections_lie_within_their_errors_of_those_without_rounding(maker, correction):
    from fem import influence

    speeds = np.array(maker.SPEEDS_RPM) * np.pi / 30
    W = influence(maker.true_rotor(), list(maker.PLANES.values()), list(maker.SENSORS.values()), speeds).W
    ideal = np.linalg.lstsq(W.reshape(-1, 3), -maker.simulate(np.zeros(3)).ravel(), rcond=None)[0]
    d = (correction.weights - ideal).view(float)
    assert d @ np.linalg.solve(correction.covariance, d) < 22.46  # χ² with 6, 99.9 %
    # and that says something: the errors are small beside the weights (rounding is stated, and counted again)
    assert (correction.mass_std < 0.14 * np.abs(correction.weights)).all()
    assert correction.warnings == ()


def test_the_default_says_that_there_is_unbalance_outside_the_planes(maker, correction):
    found = correct(estimate_influence(read_job(JOB / "job.toml").trials))
    assert found.method == "weighted"
    [words] = found.warnings
    assert "unbalance elsewhere" in words
    after = np.abs(maker.simulate(found.weights))
    assert np.abs(maker.simulate(np.zeros(3))).max() >= 50 * after.max()
    d = (found.weights - correction.weights).view(float)
    assert d @ np.linalg.solve(found.covariance, d) < 22.46  # χ² with 6, 99.9 %
