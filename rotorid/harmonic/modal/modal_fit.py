"""The search for modes: from the peaks and their circles, with errors at the fitted amplitudes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.harmonic.modal.modal_readings import Answers, Readings
from rotorid.harmonic.modal.modal_result import FittedModes
from rotorid.identify.amplitude_residuals import TRUSTED, whitening
from rotorid.identify.amplitudes import AmplitudeErrors, Experiments
from rotorid.regression.nonlinear import Bounds, NonlinearEstimate, nonlinear_least_squares

PROMINENCE, SKIRT = 1.4, 4.0
"""A mode's peak stands so many times above its valleys; its circle is fitted down to this fraction of it."""
UNSTATED = {
    "share of every amplitude": AmplitudeErrors(1.0, 1.0),
    "size everywhere": AmplitudeErrors(floor=1.0),
}
"""What errors are the same in, if none are stated: the first, if the readings do not speak for the other."""
CLEARLY = 3.0
"""By so much more likely (logarithm, of as many readings as are spare) the other must be."""
ROUNDS = 3
"""With errors at the measured amplitudes, then at the fitted ones."""


def fit_modes(
    experiments: Experiments,
    points: Sequence[str],
    answers: Answers,
    bands: Sequence[tuple[float, float]] | None = None,
    around: Sequence[tuple[float, float]] | None = None,
    start: FloatArray | None = None,
) -> FittedModes:
    """Fit modes to amplitudes around resonances.

    Parameters
    ----------
    experiments
        Harmonic tests with their errors; where none are stated, see `UNSTATED`.
    points
        Names of the signals.
    answers
        Of modes to what excites them, experiment by experiment.
    bands
        Frequencies around each resonance, rad/s: one mode in each, and nothing else counts. None: around
        each peak, and everything counts.
    around
        The same where everything counts; None: `peak_bands`.
    start
        ω_r and ζ_r to begin with; None: of the circle in each.

    Raises
    ------
    ValueError
        Where there is no peak, bands overlap, and where readings are fewer than unknowns.
    """
    omega, read = experiments.frequencies, ~np.isnan(experiments.table(points)).all(axis=1)
    if bands is not None:
        read &= np.any([(omega >= low) & (omega <= high) for low, high in bands], axis=0)
    if not read.any():
        raise ValueError("there are no readings in --bands")
    order = np.flatnonzero(read)[np.argsort(omega[read], kind="stable")]
    experiments, answers = experiments.take(order), answers.take(order)
    omega, Z = experiments.frequencies, experiments.table(points)
    H = (Z.T / answers.reference).T
    sections = sorted(bands or around or peak_bands(omega, H))
    if bands is not None and any(low < high for (_, high), (low, _) in pairwise(sections)):
        raise ValueError("--bands overlap: each holds one mode")
    rows = [np.flatnonzero((omega >= low) & (omega <= high)) for low, high in sections]
    spare = np.count_nonzero(~np.isnan(Z), axis=0) - len(rows) - 2
    if min(spare) < 0 or sum(spare) < len(rows) or min(len(np.unique(omega[row])) for row in rows) < 3:
        raise ValueError(
            f"too few readings: every resonance needs 3 frequencies, and every point {len(rows) + 2} (one a "
            "mode and two for modes beyond the range), and one more for the frequencies and damping"
        )
    q = np.transpose([_circle(omega[row], H[row]) for row in rows]).ravel() if start is None else start
    names = [f"{letter}{mode}" for letter in "ωζ" for mode in range(1, len(rows) + 1)]
    ends = tuple((float(omega[row[0]]), float(omega[row[-1]])) for row in rows)
    # −ω with −ζ is the same mode, and far from its readings a mode is another's neighbour
    limits = [*((low / 2, 2 * high) for low, high in ends), *[answers.damping] * len(ends)]
    bounds = dict(zip(names, limits, strict=True))
    kinds = [experiments.errors] if experiments.stated else [*UNSTATED.values()]
    found = [
        _search(replace(experiments, errors=errors), points, answers, q, bounds, experiments.stated)
        for errors in kinds
    ]
    best = found[0] if found[-1][0] < found[0][0] + CLEARLY else found[-1]
    _, fit, readings, left = best
    trend = np.vdot(left[:-1], left[1:]).real / np.vdot(left, left).real * np.sqrt(2 * left.size)
    same = "" if experiments.stated else list(UNSTATED)[found.index(best)]
    i, p = divmod(int(np.abs(left).argmax()), len(points))
    worst = points[p], float(omega[i]), float(np.abs(left[i, p]))
    return FittedModes(tuple(points), fit, ends, float(trend), worst, same, experiments, readings)


def _search(
    experiments: Experiments,
    points: Sequence[str],
    answers: Answers,
    q: FloatArray,
    bounds: Bounds,
    stated: bool,
) -> tuple[float, NonlinearEstimate, Readings, ComplexArray]:
    """Likelihood (its logarithm but for a constant), fit, readings, and what is left of these over errors."""
    fitted = Z = experiments.table(points)
    for turn in range(ROUNDS):
        root, _ = whitening(experiments, tuple(points), fitted)
        readings = Readings(answers, Z, root)
        fit = nonlinear_least_squares(
            partial(readings.rows, 0),
            partial(readings.rows, 1),
            q,
            names=list(bounds),
            sigma_stated=stated,
            bounds=bounds,
            near=turn > 0,
        )
        q = fit.estimate.solution
        model = readings.basis(q)[0] @ np.transpose(readings.each(2, q))
        ratio = np.abs(model) / np.abs(Z)
        fitted = np.where((ratio < TRUSTED) & (ratio > 1 / TRUSTED), model, Z)
    r, seen = fit.estimate.residuals, ~np.isnan(Z)
    likelihood = np.log(np.linalg.det(root[seen])).mean() - np.log(np.fmax(r @ r, 1e-300))
    gap = np.nan_to_num(np.stack(((Z - model).real, (Z - model).imag), axis=-1))
    left = np.einsum("npij,npj->npi", root, gap) @ (1, 1j)
    return float(likelihood * fit.estimate.dof / 2), fit, readings, left


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
        Size (n, P) of what in these is no peak.

    Raises
    ------
    ValueError
        Where there is no peak.
    """
    from scipy.signal import find_peaks

    size = np.hypot(np.abs(H), noise) / np.nanmax(np.abs(H), axis=0)
    level = np.log(np.nanmean(size**2, axis=1)) / 2
    found = find_peaks(level, prominence=np.log(PROMINENCE))[0]
    if not len(found):
        raise ValueError(
            f"no peak stands {PROMINENCE:g} times above both its sides: measure on both sides of the "
            "resonance, or say with --bands where it is"
        )
    valleys = [0, *(a + int(level[a:b].argmin()) for a, b in pairwise(found)), len(omega) - 1]
    sections = []
    for peak, (first, last) in zip(found, pairwise(valleys), strict=True):
        rows = np.arange(first, last + 1)
        near = rows[(level[rows] > level[peak] - np.log(SKIRT)) | (np.abs(rows - peak) < 2)]
        sections.append((float(omega[near[0]]), float(omega[near[-1]])))
    return sections


def _circle(omega: FloatArray, H: ComplexArray) -> tuple[float, float]:
    """ω_r and ζ_r of the circles through responses (n, P): H (s − ω²) = c + a ω² with s = ω_r² (1 + 2 i ζ_r).

    It is linear in s, which all points share, and in c and a of each (Kennedy and Pancu, 1947).
    """
    top, bottom = 0j, np.finfo(float).tiny
    for h in H.T:
        seen = ~np.isnan(h)
        v = omega[seen] ** 2
        line = np.stack((np.ones_like(v), v / omega.mean() ** 2), axis=1)
        rest = h[seen] - line @ (np.linalg.pinv(line) @ h[seen])
        top, bottom = top + np.vdot(rest, h[seen] * v), bottom + np.vdot(rest, rest).real
    s = top / bottom
    if not omega[0] ** 2 < s.real < omega[-1] ** 2:
        return float(omega[np.nansum(np.abs(H), axis=1).argmax()]), 0.01
    damping = s.imag / (2 * s.real)
    return float(np.sqrt(s.real)), float(np.copysign(np.clip(abs(damping), 1e-6, 0.5), damping))
