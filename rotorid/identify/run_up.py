"""Run-ups and run-downs: vectors at many speeds, slow roll, and the modes that explain them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.identify.answers import Answers, SteadyAnswers, swept_answers
from rotorid.identify.modes import Bands, fit_modes, peak_bands
from rotorid.identify.modes_result import RARE, FittedModes, Readings

NOISE = 5.0
"""Standard deviations of a vector that are no peak."""
SAME = 1e-9
"""So much beyond its ends a speed is still one of a sweep."""
SLOWEST, NEIGHBOURS = 3, 7
"""So many vectors of the slowest are the run-out, where peaks are looked for; so many around a speed lie on
a parabola, but for what modes explain."""


def fit_sweep(sweep: Readings, *, steady: bool = False, bands: Bands | None = None) -> FittedModes:
    """Fit modes to the vectors of a sweep.

    Parameters
    ----------
    sweep
        Its times tell the acceleration; then the modes as if every speed had been held stand beside.
    steady
        The acceleration does not matter, or nobody knows it.
    bands
        As of `fit_modes`.

    Raises
    ------
    ValueError
        As `fit_modes`.
    """
    held = SteadyAnswers(sweep.speeds, (sweep.speeds**2).astype(np.complex128))
    if steady or sweep.time is None:
        return _fit(sweep, held, bands)
    fit = _fit(sweep, swept_answers(sweep.time, sweep.speeds), bands)
    return replace(fit, steady=fit_modes(sweep, held, bands, fit.ends))


def _fit(sweep: Readings, answers: Answers, bands: Bands | None) -> FittedModes:
    """Modes around the peaks of what differs from the slowest vectors, but for those that are noise."""
    around = None
    if not bands:
        order = np.argsort(sweep.speeds, kind="stable")
        Z = sweep.vectors[order]
        slow = [z[~np.isnan(z)][:SLOWEST].mean() for z in Z.T]
        around = peak_bands(sweep.speeds[order], Z - slow, NOISE * sweep.noise[order])
    while True:
        fit = fit_modes(sweep, answers, bands, around)
        noise = fit.by_noise()
        if not around or len(around) == 1 or noise.max() <= RARE:
            return fit
        del around[int(noise.argmax())]


def constant_vectors(fit: FittedModes) -> tuple[ComplexArray, FloatArray]:
    """What no speed changes: run-out, and modes far below. Vectors (C,) and covariances of their parts."""
    k = len(fit.ends)
    vectors, covariances = fit.predicted(lambda q: np.eye(k + 2, dtype=complex)[-1:] * q[0] ** 2)
    return vectors[0], covariances[0]


def slow_vectors(sweep: Readings, speed: float) -> tuple[ComplexArray, FloatArray]:
    """Mean of the vectors at or below a speed, rad/s: (C,), and covariances of their parts, NaN of one alone.

    Raises
    ------
    ValueError
        For a sensor without a vector there.
    """
    slow = sweep.take(np.flatnonzero(sweep.speeds <= speed))
    read = ~np.isnan(slow.vectors)
    count = read.sum(axis=0)
    if not count.all():
        raise ValueError(
            f"--slow-roll: sensor {sweep.sensors[int(count.argmin())]!r} has no vector at or below "
            f"{sweep.labels.speed_words(speed)}; the lowest speed is "
            f"{sweep.labels.speed_words(float(sweep.speeds.min()))}"
        )
    mean, variances = np.nanmean(slow.vectors, axis=0), slow.covariances
    if variances is None:  # as the vectors scatter
        off = slow.vectors - mean
        parts = np.stack((off.real, off.imag), axis=-1)
        free = np.where(count > 1, 1 - 1 / count, np.nan)[:, None, None]
        variances = parts[..., None] * parts[..., None, :] / free
    return mean, np.where(read[..., None, None], variances, 0.0).sum(axis=0) / count[:, None, None] ** 2


def vectors_when_passing(
    sweep: Readings, speeds: FloatArray, modes: FittedModes | None = None
) -> tuple[ComplexArray, FloatArray]:
    """Vectors when the sweep passes speeds (M,), rad/s: (M, C), and covariances of their parts.

    Of the modes, where these explain the sweep; else what they leave of the nearest vectors lies on a
    parabola.

    Raises
    ------
    ValueError
        For a speed that the sweep does not pass, and for too few vectors near it.
    """
    low, high = float(sweep.speeds.min()), float(sweep.speeds.max())
    if len(beyond := speeds[(speeds < low * (1 - SAME)) | (speeds > high * (1 + SAME))]):
        first, last, other = (sweep.labels.speed_words(float(each)) for each in (low, high, beyond[0]))
        raise ValueError(f"--speeds: run {sweep.run!r} goes from {first} to {last}, not to {other}")
    if modes is not None and modes.explains:
        answers = modes.answers.at(speeds)
        return modes.predicted(lambda q: answers.basis(q)[0])
    vectors = np.zeros((len(speeds), len(sweep.sensors)), dtype=complex)
    rest, covariances = sweep.vectors, np.zeros((*vectors.shape, 2, 2))
    if modes is not None:
        vectors, rest = modes.curve(speeds), rest - modes.curve(sweep.speeds)
    for m, c in np.ndindex(vectors.shape):
        seen = np.flatnonzero(~np.isnan(rest[:, c]))
        rows = seen[np.argsort(np.abs(sweep.speeds[seen] - speeds[m]), kind="stable")[:NEIGHBOURS]]
        if len(rows) < NEIGHBOURS:
            raise ValueError(
                f"--speeds: run {sweep.run!r} has {len(rows)} vectors of sensor {sweep.sensors[c]!r}, and "
                f"{NEIGHBOURS} are needed to find what lies between them"
            )
        x = sweep.speeds[rows] - speeds[m]
        parabola = np.vander(x / np.abs(x).max(), 3)
        solve = np.linalg.pinv(parabola)
        left = rest[rows, c] - parabola @ (solve @ rest[rows, c])
        variance = np.vdot(left, left).real / (2 * NEIGHBOURS - 6)
        if sweep.covariances is not None:
            variance = max(variance, np.trace(sweep.covariances[rows, c], axis1=1, axis2=2).mean() / 2)
        vectors[m, c] += solve[2] @ rest[rows, c]
        covariances[m, c] = variance * (solve[2] @ solve[2]) * np.eye(2)
    return vectors, covariances
