"""Errors of a reading: stated, from repeated readings, and how the two combine.

A reading Y has a standard deviation `amplitude`·|Y| along itself (radial), `phase`·|Y| across it
(tangential), and `floor` in both directions, added in quadrature.

Rules:

1. Stated errors hold as they are (normal intervals), unless repeated readings contradict them: where the
   repeats scatter more than the stated errors explain (χ² test, 99 %), the stated errors are multiplied by
   the ratio found, the intervals become Student's with the degrees of freedom of the repeats, and a warning
   says so. An amplitude or phase error that was not stated (zero) is taken from the repeats, if they show
   one. Repeats that scatter *less* change nothing: they do not show what they have in common
   (calibration, rounding, the phase mark).
2. Without stated errors repeated readings give them: relative radial and tangential scatter, pooled over all
   repeated groups, Student's with the degrees of freedom of one direction.
3. Without both, the residuals of over-determined runs give one relative error, alike in both directions
   (`balancing.coefficients.influence`).
4. Otherwise 2 % and 2° are assumed, and named so.

Deviations of each reading that the instrument measured (`Trials.covariance`) count as stated errors do, and
add to them where both are there. Readings that have none beside others that do (a check run typed by hand)
have the root mean square of theirs.

The mean of n repeats has 1/n of the variance of one reading. The digits in which a reading is written add an
error that repeats do not make smaller. What changes from run to run: `balancing.coefficients.run_errors`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from balancing.data.trials import ReadingErrors, Trials
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray

Source = Literal[
    "stated", "repeats", "stated, enlarged by repeats", "measured", "residuals", "assumed", "unknown"
]

ASSUMED = ReadingErrors(amplitude=0.02, phase=float(np.deg2rad(2.0)))
"""Of a reading, where nothing says more."""

CONTRADICTION = 0.99
"""Level of the test by which repeated readings overrule stated errors."""

EQUAL = 1e-12
"""Relative differences below this are rounding of the arithmetic, not errors of readings."""


@dataclass(frozen=True)
class ErrorModel:
    """Errors of a single reading and where they come from.

    Attributes
    ----------
    errors
        None: unknown (stored coefficients without errors). Where they are measured, their root mean square:
        each reading has its own.
    dof
        Degrees of freedom of the estimated errors; None for stated and measured errors (taken as known).
    source
        In words.
    warnings
        What the user should know.
    """

    errors: ReadingErrors | None = None
    dof: float | None = None
    source: Source = "unknown"
    warnings: tuple[str, ...] = field(default=())


def reading_covariance(readings: ArrayLike, errors: ReadingErrors) -> FloatArray:
    """Covariance of real and imaginary part of single readings.

    Parameters
    ----------
    readings
        Complex, any shape.
    errors
        One standard deviation of a reading.

    Returns
    -------
    Shape (…, 2, 2).
    """
    z = np.asarray(readings, dtype=complex)
    size = np.abs(z)
    floor = errors.floor**2
    return turned(z, (errors.amplitude * size) ** 2 + floor, (errors.phase * size) ** 2 + floor)


def turned(z: ComplexArray, radial: FloatArray, tangential: FloatArray) -> FloatArray:
    """Covariances (…, 2, 2) from variances along z and across."""
    size = np.abs(z)
    unit = np.where(size > 0, z, 1.0) / np.where(size > 0, size, 1.0)
    c, s = unit.real, unit.imag
    out = np.empty((*z.shape, 2, 2))
    out[..., 0, 0] = radial * c**2 + tangential * s**2
    out[..., 1, 1] = radial * s**2 + tangential * c**2
    out[..., 0, 1] = out[..., 1, 0] = (radial - tangential) * c * s
    return out


def symmetric(covariance: FloatArray) -> FloatArray:
    """Covariances (…, n, n) without the rounding that makes them differ from their transposes."""
    return np.asarray((covariance + np.swapaxes(covariance, -1, -2)) / 2)


def inverse_root(covariance: FloatArray, least: float) -> FloatArray:
    """R (n, n) with C⁻¹ = R Rᵀ; scaled variances count as no less than `least` of the largest."""
    std = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(symmetric(covariance / np.outer(std, std)))
    return np.asarray(vectors / np.sqrt(np.maximum(values, least * values[-1])) / std[:, None])


def mean_variance(covariance: FloatArray) -> FloatArray:
    """Mean variance of both directions, (…), of covariances (…, 2, 2)."""
    return np.asarray(np.trace(covariance, axis1=-2, axis2=-1) / 2)


def hermitian(covariance: FloatArray) -> ComplexArray:
    """S[p, q] = E[dz_p conj(dz_q)] / 2 from covariances (N, 2P, 2P); half: the variance in one direction."""
    N, n, _ = covariance.shape
    C = covariance.reshape(N, n // 2, 2, n // 2, 2)
    real = C[:, :, 0, :, 0] + C[:, :, 1, :, 1]
    imaginary = C[:, :, 1, :, 0] - C[:, :, 0, :, 1]
    return np.asarray((real + 1j * imaginary) / 2)


def mean_covariance(trials: Trials, model: ErrorModel | None) -> FloatArray:
    """Covariance (R, S, C, 2, 2) of the means of repeated readings; without a model that of their digits."""
    rounding = _rounding(trials)
    return rounding if model is None else covariance_beside_digits(trials, model) + rounding


def covariance_beside_digits(
    trials: Trials, model: ErrorModel, near: ComplexArray | None = None
) -> FloatArray:
    """Covariance (R, S, C, 2, 2) of the means of repeated readings, but for their digits.

    Parameters
    ----------
    trials
        The readings.
    model
        Their errors; zero where they are not known.
    near
        What they should be, (R, S, C), of which errors are so many percent; None: their means.
    """
    count, own = trials.repeats[..., None, None], trials.covariance
    found = np.zeros((*trials.repeats.shape, 2, 2))
    if model.errors is not None and (own is None or model.source != "measured"):
        found = reading_covariance(trials.mean if near is None else near, model.errors) / count
    if own is not None:
        found = found + np.moveaxis(np.nansum(own, axis=2), (0, 1), (-2, -1)) / count**2
    return found


def _rounding(trials: Trials) -> FloatArray:
    """Variance of uniform errors of half the last digit of amplitude and phase."""
    mean = trials.mean
    if trials.steps is None:
        return np.zeros((*mean.shape, 2, 2))
    amplitude, phase = np.nanmean(trials.steps, axis=1) / np.sqrt(12.0)
    return turned(mean, amplitude**2, (phase * np.abs(mean)) ** 2)


def error_model(trials: Trials) -> ErrorModel:
    """Apply rules 1, 2 and 4 of this module to the stated errors and the repeated readings of a job."""
    stated = trials.errors
    if stated is not None:
        return _checked_by_repeats(trials, stated)
    said: tuple[str, ...] = ()
    if trials.covariance is not None:
        contradiction = _contradiction(trials, None)
        if contradiction is None:
            variance = np.nanmean(trials.covariance[[0, 1], [0, 1]])
            return ErrorModel(ReadingErrors(floor=float(np.sqrt(variance))), source="measured")
        said = (
            f"repeated readings scatter {contradiction[0]:.2g} times as much as the measured standard "
            "deviations: their scatter was added",
        )
    scatter = _scatter(trials)
    if scatter is None:
        return ErrorModel(ASSUMED, source="assumed", warnings=said)
    radial, tangential, dof = scatter
    if max(radial, tangential) < EQUAL:
        words = "all repeated readings are equal to the last digit: they say nothing about the errors"
        return ErrorModel(ASSUMED, source="assumed", warnings=(*said, words))
    if min(radial, tangential) < EQUAL:  # read in whole degrees, say
        equal, other = ("amplitudes", "phases") if radial < EQUAL else ("phases", "amplitudes")
        said += (f"all repeated {equal} are equal: their error is taken to be that of the {other}",)
        radial = tangential = max(radial, tangential)
    return ErrorModel(ReadingErrors(amplitude=radial, phase=tangential), dof, "repeats", said)


def _groups(trials: Trials) -> tuple[ComplexArray, ComplexArray, IntArray]:
    """Deviations (K, G) of repeated readings from their means (NaN where none), means (G,), counts (G,)."""
    many = trials.repeats > 1
    mean = trials.mean[many]
    return trials.readings[:, many] - mean, mean, trials.repeats[many]


def _scatter(trials: Trials) -> tuple[float, float, int] | None:
    """Pooled relative radial and tangential standard deviation and their degrees of freedom."""
    deviation, mean, count = _groups(trials)
    used = np.abs(mean) > 0
    deviation, mean, count = deviation[:, used], mean[used], count[used]
    dof = int(np.sum(count - 1))
    if dof == 0:
        return None
    relative = deviation / mean
    radial = np.sqrt(np.nansum(relative.real**2) / dof)
    tangential = np.sqrt(np.nansum(relative.imag**2) / dof)
    return float(radial), float(tangential), dof


def _contradiction(trials: Trials, stated: ReadingErrors | None) -> tuple[float, int] | None:
    """How many times more repeats scatter than stated and measured errors explain; degrees of freedom."""
    from scipy.special import chdtri

    deviation, mean, count = _groups(trials)
    size = np.abs(mean)
    unit = np.where(size > 0, mean, 1.0) / np.where(size > 0, size, 1.0)
    along, covariance = deviation / unit, np.zeros((*size.shape, 2, 2))
    if stated is not None:
        covariance += reading_covariance(size, stated)
    if trials.covariance is not None:
        own = np.nanmean(trials.covariance[..., trials.repeats > 1], axis=2)
        turn = np.array([[unit.real, -unit.imag], [unit.imag, unit.real]])
        covariance += np.einsum("jig,jkg,klg->gil", turn, own, turn)
    chi_square, dof = 0.0, 0
    for part, variance in ((along.real, covariance[..., 0, 0]), (along.imag, covariance[..., 1, 1])):
        known = variance > 0
        chi_square += float(np.nansum(part[:, known] ** 2 / variance[known]))
        dof += int(np.sum(count[known] - 1))
    if dof == 0 or chi_square <= float(chdtri(dof, 1 - CONTRADICTION)):
        return None
    return float(np.sqrt(chi_square / dof)), dof


def _checked_by_repeats(trials: Trials, stated: ReadingErrors) -> ErrorModel:
    errors, degrees, warnings = stated, None, list[str]()
    contradiction = _contradiction(trials, stated)
    if contradiction is not None:
        ratio, dof = contradiction
        errors = ReadingErrors(stated.amplitude * ratio, stated.phase * ratio, stated.floor * ratio)
        degrees = dof
        warnings.append(
            f"repeated readings scatter {ratio:.2g} times as much as the stated errors: "
            "the errors were enlarged accordingly"
        )
    scatter = _scatter(trials)
    if scatter is not None and stated.floor == 0:
        # an error that was left out is not zero if the repeats show it
        for kind, found in (("amplitude", scatter[0]), ("phase", scatter[1])):
            if getattr(stated, kind) == 0 and found > EQUAL:
                errors, degrees = replace(errors, **{kind: found}), min(scatter[2], degrees or scatter[2])
                shown = f"{100 * found:.2g} %" if kind == "amplitude" else f"{np.degrees(found):.2g}°"
                warnings.append(
                    f"no {kind} error is stated; repeated readings scatter by {shown}, which is used"
                )
    source: Source = "stated" if degrees is None else "stated, enlarged by repeats"
    return ErrorModel(errors, degrees, source, tuple(warnings))
