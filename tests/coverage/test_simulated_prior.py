"""Intervals with a prior: parameters drawn from it."""

from dataclasses import replace

import numpy as np
from repetitions import FULL

from rotorid.identify import AmplitudeErrors, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record

T = np.linspace(0.0, 3.0, 25)


DRAWS = 200 if FULL else 120


def covered(found, truth):
    low, high = found.ci95.T
    return (low <= truth) & (truth <= high)


def rates(hits):
    """Share of hits, and 3.5 standard deviations of a share of 95 %."""
    return np.mean(hits, axis=0), 3.5 * np.sqrt(0.05 * 0.95 / len(hits))


def test_intervals_cover_parameters_drawn_from_their_prior():
    outputs = {"x": "u0/k + (x0 - u0/k)*exp(-k*t)"}
    model = ode_model({}, outputs=outputs, estimate={"k": 1.0, "x0": 2.0, "u0": 0.5})
    known = {"k": (1.0, 0.05), "u0": (0.5, 0.03)}
    rng = np.random.default_rng(7)
    silent, warned = [], 0
    for _ in range(DRAWS):
        k, u0 = rng.normal(1.0, 0.05), rng.normal(0.5, 0.03)
        x = u0 / k + (2.0 - u0 / k) * np.exp(-k * T) + 0.05 * rng.standard_normal(25)
        data = Record(T, {"x": x}, sigma={"x": 0.05})
        found = fit(replace(model, prior=known), data)
        warned += bool(found.warnings)
        if not found.warnings:
            silent.append(covered(found.estimate, np.array([k, 2.0, u0])))
    share, room = rates(silent)
    assert (np.abs(share - 0.95) < room).all(), share
    assert warned <= 0.03 * DRAWS


def test_output_error_covers_parameters_drawn_from_their_prior():
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    rng, w = np.random.default_rng(11), np.array([9.0, 10.0, 11.0, 12.0])
    errors = AmplitudeErrors(relative=0.05, phase=0.05)
    silent, warned, shares = [], 0, []
    for _ in range(DRAWS):
        c, b = rng.normal(1000, 20), rng.normal(20, 0.5)
        X = 10 / (c - 10 * w**2 + 1j * b * w)
        noise = np.exp(0.05 * (rng.standard_normal(4) + 1j * rng.standard_normal(4)))
        data = experiments(model, w, {"X": X * noise, "F": 10.0}, errors=errors)
        found = identify(model, data, prior={"c": (1000.0, 20.0), "b": (20.0, 0.5)})
        shares.append(found.prior.share)
        warned += bool(found.warnings)
        if not found.warnings:
            silent.append(covered(found, np.array([c, b])))
    assert 0.2 < np.mean(shares, axis=0)[1] < 0.8  # the prior matters, and so do the data
    share, room = rates(silent)
    assert (np.abs(share - 0.95) < room).all(), share
    assert warned <= 0.04 * DRAWS
