"""Every claim of an error in short: of draws with a known truth, the mean of eᵀC⁻¹e over its size is near 1.

A ± that is 1.3 times too small or too large gives 1.7 or 0.59. How often intervals and regions hold is
counted in tests/coverage, which `make test-full` runs.
"""

import coverage_balance
import coverage_fleet
import coverage_identify
import coverage_runup
import numpy as np
import pytest
from helpers.calibration.jobs import Runs, machine

from balancing import (
    Labels,
    ReadingErrors,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
)
from fem.parameters import with_parameters
from rotorid.calibration import Unknown, calibrate
from rotorid.fleet.machine_type import fit_type, update
from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.regression import stretch

RPM = np.pi / 30


def square(error, covariance):
    """eᵀC⁻¹e over its dimension."""
    return error @ np.linalg.solve(covariance, error) / len(error)


def assert_near_one(squares, least=0.6):
    assert 20 <= len(squares) <= 60
    assert least < np.mean(squares) < 1.6, np.mean(squares)


@pytest.mark.parametrize("kind", coverage_balance.KINDS)
def test_weights_of_a_correction(kind):
    rng, squares = np.random.default_rng([30, coverage_balance.KINDS.index(kind)]), []
    while len(squares) < 30:
        job = coverage_balance.draw(rng, "stated", kind, (0.02, 0.02))
        try:
            answer = correct(estimate_influence(job.trials))
        except UndeterminedError:
            continue
        if not answer.warnings:
            squares.append(square(stretch(answer.weights - job.D), answer.covariance))
    assert_near_one(squares)


def test_weights_and_readings_of_a_first_shot():
    weights, readings = [], []
    for seed in range(3):
        rng = np.random.default_rng([31, seed])
        drawn = coverage_fleet.draw(rng, "each coefficient")
        prior = fit_type(drawn.records, *drawn[2:]).influence(Labels())
        P = len(drawn.planes)
        for m in range(50, 62):
            D = coverage_fleet.normal(rng, P)
            Y = coverage_fleet.read(rng, -drawn.W[m] @ D)[None]
            errors = ReadingErrors(coverage_fleet.RUN, coverage_fleet.RUN)
            trials = Trials(("0",), *drawn[2:], Y, np.zeros((1, P), dtype=complex), errors=errors)
            answer = correct(update(prior, trials)[0], refuse=False)
            if answer.warnings:
                continue
            weights.append(square(stretch(answer.weights - D), answer.covariance))
            check = coverage_fleet.read(rng, drawn.W[m] @ (answer.weights - D))
            off = stretch((check - answer.after).ravel()).reshape(-1, 2)
            covariances = answer.after_covariance.reshape(-1, 2, 2)
            readings.append(np.mean([square(*one) for one in zip(off, covariances, strict=True)]))
    assert_near_one(weights, least=0.5)  # draws of machines that differ have long tails: a large covariance
    assert_near_one(readings)


@pytest.mark.parametrize("case", ["task_5_1", "two_masses"])
def test_parameters_of_output_error(case):
    case, rng, squares = getattr(coverage_identify, case)(), np.random.default_rng(32), []
    for _ in range(40):
        found = identify(case.model, coverage_identify.simulate(case, rng), start=case.truth)
        squares.append(square(found.values - list(case.truth.values()), found.covariance))
    assert_near_one(squares)


def test_parameters_with_a_prior():
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    rng, w, squares = np.random.default_rng(33), np.array([9.0, 10.0, 11.0, 12.0]), []
    for _ in range(40):
        c, b = rng.normal(1000, 20), rng.normal(20, 0.5)
        noise = np.exp(0.05 * rng.standard_normal(4) + 0.05j * rng.standard_normal(4))
        X = 10 / (c - 10 * w**2 + 1j * b * w) * noise
        data = experiments(model, w, {"X": X, "F": 10.0}, errors=AmplitudeErrors(relative=0.05, phase=0.05))
        found = identify(model, data, prior={"c": (1000.0, 20.0), "b": (20.0, 0.5)})
        squares.append(square(found.values - [c, b], found.covariance))
    assert_near_one(squares)


def test_parameters_of_records():
    times, truth, rng, squares = np.linspace(0.0, 3.0, 25), [1.0, 2.0], np.random.default_rng(34), []
    model = ode_model({}, outputs={"x": "x0*exp(-k*t)"}, estimate={"k": 1.1, "x0": 1.8})
    exact = truth[1] * np.exp(-truth[0] * times)
    for _ in range(40):
        x = exact + 0.05 * rng.standard_normal(len(times))
        found = fit(model, Record(times, {"x": x}, sigma={"x": 0.05}))
        squares.append(square(found.values - truth, found.estimate.covariance))
    assert_near_one(squares)


def test_numbers_of_a_calibrated_rotor():
    values = {"bearing[1].kxx": 4.4e7, "bearing[2].cyy": 2.2e4, "disc[1].mass": 25.0}
    unknowns = [Unknown(path, start=value) for path, value in values.items()]
    runs, rng, squares = Runs(speeds=(180.0, 300.0), free=False), np.random.default_rng(35), []
    exact, errors = runs.readings(with_parameters(machine(), values)), ReadingErrors(0.02, 0.02)
    for _ in range(20):
        a, b = rng.standard_normal((2, *exact.shape))
        readings = exact * (1 + 0.02 * a) * np.exp(0.02j * b)
        found = calibrate(machine(), unknowns, [runs.data(readings, errors=errors)], side_starts=False)
        squares.append(square(found.values - list(values.values()), found.covariance))
    assert_near_one(squares)


def test_modes_of_a_run_up():
    outcomes = [coverage_runup.one_rotor(np.random.default_rng([36, k]), 60.0) for k in range(20)]
    assert_near_one([np.mean(one.errors**2) for one in outcomes])
