"""Jobs that several tests of balancing use."""

from dataclasses import replace
from math import pi

import numpy as np

from balancing import Gaussian, Influence, Labels, Limits, ReadingErrors, Trials, tolerance

GRAM = 1e-3
ERRORS = ReadingErrors(amplitude=0.01, phase=0.01)


def polar(amplitude, degrees):
    return amplitude * np.exp(1j * np.deg2rad(degrees))


def job(readings, weights, *, labels=None, speeds=(100.0,), sensors=None, planes=None, runs=None, **more):
    """Trials from readings (…, R, S, C) or (R, C) at one speed, and weights (R, P)."""
    readings, weights = np.asarray(readings, dtype=complex), np.asarray(weights, dtype=complex)
    if readings.ndim == 2:
        readings = readings[:, None, :]
    R, P = weights.shape
    return Trials(
        runs=runs or tuple(f"run {r}" for r in range(R)),
        speeds=np.asarray(speeds, dtype=float),
        sensors=sensors or tuple(f"s{c}" for c in range(readings.shape[-1])),
        planes=planes or tuple("ABCDEFGHIJKLMN"[:P]),
        readings=readings,
        weights=weights,
        labels=labels or Labels(vibration_unit="", weight_unit="g", weight_scale=1 / GRAM),
        **more,
    )


def bruel_kjaer(**options):
    """Application note 17-227, two planes; trial weights removed."""
    readings = [
        [polar(7.2, 238), polar(13.5, 296)],
        [polar(4.9, 114), polar(9.2, 347)],
        [polar(4.0, 79), polar(12.0, 292)],
    ]
    return job(readings, [[0, 0], [2.5 * GRAM, 0], [0, 2.5 * GRAM]], **options)


def synthetic(rng, *, planes=2, sensors=4, speeds=3, weights=None, **options):
    """An exact linear rotor: trials, its W (S, C, P) and Y₀ (S, C)."""
    W = complex_normal(rng, (speeds, sensors, planes)) * 1e3
    Y0 = complex_normal(rng, (speeds, sensors))
    if weights is None:
        weights = np.vstack((np.zeros(planes), np.eye(planes))) * GRAM
    readings = Y0 + np.einsum("scp,rp->rsc", W, weights)
    made = job(readings, weights, speeds=100.0 * np.arange(1, speeds + 1), **options)
    return made, W, Y0


def complex_normal(rng, shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def noisy(rng, Y, errors, shape=()):
    """Readings with radial, tangential and floor errors, drawn without using the code under test."""
    unit = Y / np.abs(Y)
    radial, tangential = rng.standard_normal((2, *shape, *Y.shape))
    floor = complex_normal(rng, (*shape, *Y.shape)) * errors.floor
    return Y + unit * np.abs(Y) * (errors.amplitude * radial + 1j * errors.phase * tangential) + floor


def stored(W, baseline=None, speeds=None, *, planes=None, labels=None):
    """Coefficients (S, C, P) as they are read from a file, without errors."""
    W = np.asarray(W, dtype=complex)
    S, C, P = W.shape
    baseline = np.full((S, C), np.nan) if baseline is None else baseline
    speeds = 100.0 * np.arange(1, S + 1) if speeds is None else speeds
    names = tuple(f"s{c}" for c in range(C)), tuple(planes or "ABCDEFGH"[:P])
    return Influence(speeds, *names, W, baseline, Gaussian.none(S, C, P), labels or Labels())


def rms(z):
    return float(np.sqrt(np.mean(np.abs(z) ** 2)))


def limits_by_name(influence, *, max_weight=None, residual=None, forbidden=None):
    """Limits of a correction, by the names of planes and sensors."""
    max_weight, residual, forbidden = max_weight or {}, residual or {}, forbidden or {}
    free = np.full(len(influence.speeds), np.inf)
    return Limits(
        np.array([max_weight.get(name, np.inf) for name in influence.planes]),
        np.column_stack(
            [np.broadcast_to(residual.get(name, free), free.shape) for name in influence.sensors]
        ),
        tuple(tuple(forbidden.get(name, ())) for name in influence.planes),
    )


def rigid(limit, **options):
    """A tolerance of `limit` kg·m in each of the planes A and B."""
    return tolerance(2 * limit * 100 * pi / 2.5e-3, 100 * pi, 2.5, planes={"A": None, "B": None}, **options)


def check_run(made, W, residual, errors=ERRORS):
    readings = np.einsum("scp,p->sc", W, residual)[None]
    return replace(
        made, runs=("check",), readings=readings, weights=np.zeros((1, 0)), planes=(), errors=errors
    )
