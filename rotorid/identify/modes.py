"""Modes from amplitudes around resonances, with which [S] lesson 7 begins, and from run-ups and run-downs.

The search begins at the peaks and their circles; errors are those of the fitted amplitudes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray
from rotorid.identify.amplitudes import evaluated_once, trusted
from rotorid.identify.answers import Answers, SteadyAnswers, swept_answers
from rotorid.identify.modes_result import RARE, FittedModes, Readings, projected
from rotorid.regression.nonlinear import NonlinearEstimate, nonlinear_least_squares

PROMINENCE, SKIRT = 1.4, 4.0
"""A mode's peak stands so many times above its valleys; its circle is fitted down to this fraction of it."""
CLEARLY = 3.0
"""By so much more likely (logarithm, of as many readings as are spare) errors must be of one size."""
ROUNDS = 3
"""With errors at the measured amplitudes, then at the fitted ones."""
NOISE = 5.0
"""Standard deviations of a vector that are no peak."""
SLOWEST = 3
"""So many vectors of the slowest are the run-out, where peaks are looked for."""
Bands = Sequence[tuple[float, float]]


def fit_modes(
    readings: Readings, answers: Answers, bands: Bands | None = None, around: Bands | None = None
) -> FittedModes:
    """Fit modes to amplitudes around resonances.

    Parameters
    ----------
    readings
        With their errors; where none are stated, these are one share of every amplitude or one size.
    answers
        Of modes to what excites them, reading by reading.
    bands
        Frequencies around each resonance, rad/s: one mode in each, and nothing else counts. None: around
        each peak, and everything counts.
    around
        The same where everything counts; None: `peak_bands`.

    Raises
    ------
    ValueError
        Where there is no peak, bands overlap, and where readings are fewer than unknowns.
    """
    w, read = readings.speeds, ~np.isnan(readings.vectors).all(axis=1)
    if bands is not None:
        read &= np.any([(w >= low) & (w <= high) for low, high in bands], axis=0)
    if not read.any():
        raise ValueError("there are no readings in --bands")
    order = np.flatnonzero(read)[np.argsort(w[read], kind="stable")]
    readings, answers = readings.take(order), answers.take(order)
    omega, Z = readings.speeds, readings.vectors
    H = (Z.T / answers.excitation).T
    sections = sorted(bands or around or peak_bands(omega, H))
    if any(low < high for (_, high), (low, _) in pairwise(sections if bands else ())):
        raise ValueError("--bands overlap: each holds one mode")
    rows = [np.flatnonzero((omega >= low) & (omega <= high)) for low, high in sections]
    spare = np.count_nonzero(~np.isnan(Z), axis=0) - len(rows) - 2
    if min(spare) < 0 or sum(spare) < len(rows) or min(len(np.unique(omega[row])) for row in rows) < 3:
        raise ValueError(
            f"too few readings: every resonance needs 3 frequencies, and every point {len(rows) + 2} (one a "
            "mode and two for modes beyond the range), and one more for the frequencies and damping"
        )
    q = np.transpose([_circle(omega[row], H[row]) for row in rows]).ravel()
    ends = tuple((float(omega[row[0]]), float(omega[row[-1]])) for row in rows)
    stated = readings.covariances is not None or readings.shares is not None
    share = _search(readings, answers, q, ends, stated=stated)
    if stated:
        return FittedModes(readings, answers, *share[1:], ends, "")
    size = replace(readings, covariances=np.broadcast_to(np.eye(2), (*Z.shape, 2, 2)))
    other = _search(size, answers, q, ends, stated=False)
    if other[0] >= share[0] + CLEARLY:
        return FittedModes(readings, answers, *other[1:], ends, "size everywhere")
    return FittedModes(readings, answers, *share[1:], ends, "share of every amplitude")


def _search(
    readings: Readings, answers: Answers, q: FloatArray, ends: Bands, *, stated: bool
) -> tuple[float, NonlinearEstimate, FloatArray]:
    """Likelihood (its logarithm but for a constant), fit, and inverse roots of the readings' covariances."""
    names = [f"{letter}{mode}" for letter in "ωζ" for mode in range(1, len(ends) + 1)]
    # −ω with −ζ is the same mode, and far from its readings a mode is another's neighbour
    limits = [*((low / 2, 2 * high) for low, high in ends), *[answers.damping] * len(ends)]
    amplitudes = Z = readings.vectors
    for turn in range(ROUNDS):
        root = readings.roots(amplitudes)

        def both(q: FloatArray, root: FloatArray = root) -> tuple[AnyArray, ...]:
            return projected(answers.basis(q), Z, root)

        fit = nonlinear_least_squares(
            *evaluated_once(both),
            q,
            names=names,
            sigma_stated=stated,
            bounds=limits,
            near=turn > 0,
        )
        q = fit.estimate.solution
        amplitudes = trusted(answers.basis(q)[0] @ both(q)[2].T, Z)
    r, size = fit.estimate.residuals, np.abs(np.linalg.det(root[~np.isnan(Z)]))
    likely = np.log(size).mean() - np.log(np.fmax(r @ r, 1e-300))
    return float(likely * fit.estimate.dof / 2), fit, root


def peak_bands(
    omega: FloatArray, H: ComplexArray, noise: FloatArray | float = 0.0
) -> list[tuple[float, float]]:
    """Frequencies around each peak of all points together, each point in its own size.

    Parameters
    ----------
    omega
        Rising, rad/s, (n,).
    H
        Responses (n, P).
    noise
        Size (P,) of what in these is no peak.

    Raises
    ------
    ValueError
        Where there is no peak.
    """
    from scipy.signal import find_peaks

    size = np.hypot(np.abs(H), noise) / np.nanmax(np.abs(H), axis=0)
    level = np.log(np.nanmean(size**2, axis=1)) / 2
    peaks = find_peaks(level, prominence=np.log(PROMINENCE))[0]
    if not len(peaks):
        raise ValueError(
            f"no peak stands {PROMINENCE:g} times above both its sides: measure on both sides of the "
            "resonance, or say with --bands where it is"
        )
    valleys = [0, *(a + int(level[a:b].argmin()) for a, b in pairwise(peaks)), len(omega) - 1]
    sections = []
    for peak, (first, last) in zip(peaks, pairwise(valleys), strict=True):
        rows = np.arange(first, last + 1)
        near = omega[rows[(level[rows] > level[peak] - np.log(SKIRT)) | (np.abs(rows - peak) < 2)]]
        sections.append((float(near[0]), float(near[-1])))
    return sections


def _circle(omega: FloatArray, H: ComplexArray) -> tuple[float, float]:
    """ω_r and ζ_r of the circles through responses (n, P): H (s − ω²) = c + a ω² with s = ω_r² (1 + 2 i ζ_r).

    It is linear in s, which all points share, and in c and a of each (Kennedy and Pancu, 1947).
    """
    H = H[:, ~np.isnan(H).all(axis=0)]
    H, v = np.where(np.isnan(H), np.nanmean(H, axis=0), H), omega**2
    line = np.vander(v / v.mean(), 2)
    rest = H - line @ (np.linalg.pinv(line) @ H)
    s = np.vdot(rest, H * v[:, None]) / (np.vdot(rest, rest).real or 1.0)
    if not v[0] < s.real < v[-1]:
        return float(omega[np.abs(H).sum(axis=1).argmax()]), 0.01
    damping = s.imag / (2 * s.real)
    return float(np.sqrt(s.real)), float(np.copysign(np.clip(abs(damping), 1e-6, 0.5), damping))


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
        around = peak_bands(sweep.speeds[order], Z - slow, NOISE * sweep.noise)
    while True:
        fit = fit_modes(sweep, answers, bands, around)
        noise = fit.by_noise()
        if not around or len(around) == 1 or noise.max() <= RARE:
            return fit
        del around[int(noise.argmax())]


def constant_vectors(fit: FittedModes) -> tuple[ComplexArray, FloatArray]:
    """What no speed changes: run-out, and modes far below. Vectors and deviations of either part (C,)."""
    k = len(fit.ends)
    vectors, covariances = fit.predicted(lambda q: np.eye(k + 2, dtype=complex)[-1:] * q[0] ** 2)
    return vectors[0], np.sqrt(np.trace(covariances[0], axis1=1, axis2=2) / 2)
