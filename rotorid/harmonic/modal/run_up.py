"""Run-ups and run-downs: vectors at many speeds, slow roll, and the modes that explain them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from balancing import Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.unit_words import Shown, speed_axis
from rotorid.harmonic.modal.modal_fit import fit_modes, peak_bands
from rotorid.harmonic.modal.modal_readings import Answers, SteadyAnswers
from rotorid.harmonic.modal.modal_result import RARE, FittedModes
from rotorid.harmonic.modal.swept_answers import swept_answers
from rotorid.identify.amplitudes import Experiments

NOISE = 5.0
"""Standard deviations of a vector that are no peak."""
SAME = 1e-9
"""So much beyond its ends a speed is still one of a sweep."""
SLOWEST = 3
"""So many vectors of the slowest are the run-out, where peaks are looked for."""
NEIGHBOURS = 7
"""So many vectors around a speed lie on a parabola, but for what modes explain."""


@dataclass(frozen=True, eq=False)
class SweepVectors:
    """Vectors of one run while the speed changes.

    Attributes
    ----------
    run
        Its name.
    time
        Rising, s, shape (N,); None: nobody says.
    speeds
        rad/s, (N,).
    sensors
        Names, length C.
    vectors
        Complex, in the unit of the readings inside, phase lead, (N, C); NaN where there is none.
    covariances
        Of their real and imaginary parts, (N, C, 2, 2); None: not stated.
    labels
        Units and conventions to print them in.
    """

    run: str
    time: FloatArray | None
    speeds: FloatArray
    sensors: tuple[str, ...]
    vectors: ComplexArray
    covariances: FloatArray | None
    labels: Labels

    def take(self, rows: IntArray) -> SweepVectors:
        """Some of the vectors, by rising time."""
        time, own = self.time, self.covariances
        return replace(
            self,
            time=None if time is None else time[rows],
            speeds=self.speeds[rows],
            vectors=self.vectors[rows],
            covariances=None if own is None else own[rows],
        )

    @property
    def mirrored(self) -> SweepVectors:
        """With phases of the other sign."""
        own = self.covariances
        turned = None if own is None else own * [[1.0, -1.0], [-1.0, 1.0]]
        return replace(self, vectors=self.vectors.conj(), covariances=turned)

    @property
    def experiments(self) -> Experiments:
        """As a fit takes them."""
        stated = self.covariances
        if stated is not None:  # of what was not read any
            stated = np.where(np.isnan(self.vectors)[..., None, None], np.eye(2), stated)
        labels = self.labels
        return Experiments(
            tuple(f"{speed:.6g}" for speed in self.speeds),
            self.speeds,
            dict(zip(self.sensors, self.vectors.T, strict=True)),
            np.zeros(len(self.speeds), dtype=bool),
            covariances={}
            if stated is None
            else dict(zip(self.sensors, np.swapaxes(stated, 0, 1), strict=True)),
            axis=speed_axis("speed", labels.speed_unit),
            units=dict.fromkeys(self.sensors, Shown(labels.vibration_in, labels.vibration_scale)),
        )

    @property
    def noise(self) -> FloatArray:
        """Standard deviation of each vector, (N, C): stated, or by differences of neighbours in speed."""
        if self.covariances is not None:
            return np.asarray(np.sqrt(np.trace(self.covariances, axis1=-2, axis2=-1)))
        second = np.diff(self.vectors[np.argsort(self.speeds, kind="stable")], 2, axis=0)
        return np.tile(np.nanmedian(np.abs(second), axis=0) / np.sqrt(6 * np.log(2)), (len(self.speeds), 1))


@dataclass(frozen=True, eq=False)
class SweepModes:
    """Modes of a sweep with its acceleration, and those of a steady fit beside.

    Attributes
    ----------
    fit
        With the acceleration, if it is known.
    steady
        As if every speed had been held; None: `fit` is that.
    """

    fit: FittedModes
    steady: FittedModes | None


def fit_sweep(
    sweep: SweepVectors, *, steady: bool = False, bands: Sequence[tuple[float, float]] | None = None
) -> SweepModes:
    """Fit modes to the vectors of a sweep.

    Parameters
    ----------
    sweep
        Its times tell the acceleration.
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
        return SweepModes(_fit(sweep, held, bands), None)
    fit = _fit(sweep, swept_answers(sweep.time, sweep.speeds), bands)
    beside = fit_modes(sweep.experiments, sweep.sensors, held, bands, fit.ends, fit.fit.estimate.solution)
    return SweepModes(fit, beside)


def _fit(sweep: SweepVectors, answers: Answers, bands: Sequence[tuple[float, float]] | None) -> FittedModes:
    """Modes around the peaks, but for those that are no more than noise."""
    around = None if bands else _peaks(sweep)
    while True:
        fit = fit_modes(sweep.experiments, sweep.sensors, answers, bands, around)
        if not around or len(around) == 1 or fit.by_noise.max() <= RARE:
            return fit
        del around[int(fit.by_noise.argmax())]


def _peaks(sweep: SweepVectors) -> list[tuple[float, float]]:
    """Speeds around each peak of what differs from the slowest vectors."""
    order = np.argsort(sweep.speeds, kind="stable")
    Z = sweep.vectors[order]
    slow = [own[~np.isnan(own)][:SLOWEST].mean() for own in Z.T]
    return peak_bands(sweep.speeds[order], Z - slow, NOISE * sweep.noise[order])


def constant_vectors(fit: FittedModes) -> tuple[ComplexArray, FloatArray]:
    """What no speed changes: run-out, and modes far below. Vectors (C,) and covariances of their parts."""

    def columns(q: FloatArray) -> ComplexArray:
        return np.asarray(np.eye(q.size // 2 + 2)[-1:] * q[0] ** 2, dtype=complex)

    vectors, covariances = fit.predicted(columns)
    return vectors[0], covariances[0]


def slow_vectors(sweep: SweepVectors, speed: float) -> tuple[ComplexArray, FloatArray]:
    """Mean of the vectors at or below a speed, rad/s: (C,), and covariances of their parts, NaN of one alone.

    Raises
    ------
    ValueError
        For a sensor without a vector there.
    """
    slow = sweep.take(np.flatnonzero(sweep.speeds <= speed))
    count = (~np.isnan(slow.vectors)).sum(axis=0)
    if not count.all():
        raise ValueError(
            f"--slow-roll: sensor {sweep.sensors[int(count.argmin())]!r} has no vector at or below "
            f"{sweep.labels.speed_words(speed)}; the lowest speed is "
            f"{sweep.labels.speed_words(float(sweep.speeds.min()))}"
        )
    mean = np.nanmean(slow.vectors, axis=0)
    if slow.covariances is not None:
        there = ~np.isnan(slow.vectors)[..., None, None]
        return mean, np.where(there, slow.covariances, 0.0).sum(axis=0) / count[:, None, None] ** 2
    off = np.nan_to_num(slow.vectors - mean)
    parts = np.stack((off.real, off.imag), axis=-1)
    free = np.where(count > 1, count - 1.0, np.nan) * count
    return mean, np.einsum("nci,ncj->cij", parts, parts) / free[:, None, None]


def vectors_when_passing(
    sweep: SweepVectors,
    speeds: FloatArray,
    modes: SweepModes | None = None,
    *,
    steady: bool = False,
    bands: Sequence[tuple[float, float]] = (),
) -> tuple[ComplexArray, FloatArray]:
    """Vectors when the sweep passes speeds (M,), rad/s: (M, C), and covariances of their parts.

    Of its modes (None: they are fitted), where these explain it and count everywhere; else what they leave
    of the nearest vectors lies on a parabola.

    Raises
    ------
    ValueError
        For a speed that the sweep does not pass, and for too few vectors near it.
    """
    low, high, words = float(sweep.speeds.min()), float(sweep.speeds.max()), sweep.labels.speed_words
    if len(beyond := speeds[(speeds < low * (1 - SAME)) | (speeds > high * (1 + SAME))]):
        raise ValueError(
            f"--speeds: run {sweep.run!r} goes from {words(low)} to {words(high)}, not to {words(beyond[0])}"
        )
    if modes is None and not bands:
        with suppress(ValueError):
            modes = fit_sweep(sweep, steady=steady)
    fit = None if modes is None or bands or modes.fit.undetermined else modes.fit
    if fit is not None and fit.explains:
        return fit.predicted(lambda q: fit.readings.answers.at(speeds).basis(q)[0])
    known = np.zeros((len(sweep.speeds) + len(speeds), len(sweep.sensors)), dtype=complex)
    if fit is not None:
        every = fit.readings.answers.at(np.concatenate((sweep.speeds, speeds)))
        known = every.basis(q := fit.fit.estimate.solution)[0] @ np.transpose(fit.readings.each(2, q))
    rest = replace(sweep, vectors=sweep.vectors - known[: len(sweep.speeds)])
    shape = len(speeds), len(sweep.sensors)
    vectors, covariances = np.zeros(shape, dtype=complex), np.zeros((*shape, 2, 2))
    for m, c in np.ndindex(shape):
        vectors[m, c], covariances[m, c] = _between(rest, c, float(speeds[m]))
    return vectors + known[len(sweep.speeds) :], covariances


def _between(sweep: SweepVectors, c: int, speed: float) -> tuple[complex, FloatArray]:
    """Vector of a sensor by a parabola through its nearest ones, and the covariance of its parts."""
    seen = np.flatnonzero(~np.isnan(sweep.vectors[:, c]))
    rows = seen[np.argsort(np.abs(sweep.speeds[seen] - speed), kind="stable")[:NEIGHBOURS]]
    if len(rows) < NEIGHBOURS:
        raise ValueError(
            f"--speeds: run {sweep.run!r} has {len(rows)} vectors of sensor {sweep.sensors[c]!r}, and "
            f"{NEIGHBOURS} are needed to find what lies between them"
        )
    x, Z = sweep.speeds[rows] - speed, sweep.vectors[rows, c]
    parabola = np.vander(x / np.abs(x).max(), 3)
    solve = np.linalg.pinv(parabola)
    rest, share = Z - parabola @ (solve @ Z), solve[2]
    scatter = np.vdot(rest, rest).real / (2 * len(rows) - 6)
    if sweep.covariances is None:
        return share @ Z, scatter * (share @ share) * np.eye(2)
    stated = sweep.covariances[rows, c]
    more = max(1.0, 2 * scatter / np.trace(stated, axis1=1, axis2=2).mean())
    return share @ Z, more * np.einsum("n,nij->ij", share**2, stated)
