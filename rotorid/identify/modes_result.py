"""Modes fitted to amplitudes: frequencies, damping and shapes with errors, and what speaks against them.

At every point X = Σ_r R_r g_r + a g_∞ + b g_0: all points have the same ω_r and ζ_r, on which the answers g_r
depend; g_∞ and g_0 are those of modes above and below the range. R, a and b are linear and eliminated: with
the whitened columns K = Q (T; 0) only the rows of Qᵀ x below T count, and the slopes of these by ω_r and ζ_r
are −Qᵀ K' c, c = T⁻¹ Qᵀ x above (variable projection, Kaufman 1975). So the search has two parameters a mode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from balancing import Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import listing
from rotorid.identify.amplitudes import AmplitudeErrors, inverse_roots, real_matrices
from rotorid.identify.answers import Answers
from rotorid.regression import stack
from rotorid.regression.nonlinear import NonlinearEstimate

LARGEST = 10.0
"""No relative error of a shape is larger: amplitudes that are 0 within it count as that share of it."""
RARE, EXACT = 1e-3, 1e-3
"""Probability below which chance explains nothing; a share of a shape that nobody minds."""
ALONE = 30.0
"""Half-widths of a mode beyond which all readings but one tell nothing of its peak."""
ASIDE = 4.0
"""Standard deviations across the phase of its mode beyond which a probe may stand 90° apart."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Vectors of some sensors over frequency or speed, of one run.

    Attributes
    ----------
    run
        Its name.
    time
        Rising, s, shape (N,), while the speed changes; None: nobody says.
    speeds
        Or frequencies, rad/s, (N,).
    sensors
        Names, length C.
    vectors
        Complex, in the unit of the readings inside, phase lead, (N, C); NaN where there is none.
    covariances
        Of their real and imaginary parts, (N, C, 2, 2); None: not stated.
    labels
        Units and conventions to print them in.
    shares
        Standard deviations of all amplitudes, as a share, and of all phases, rad, instead of covariances.
    """

    run: str
    time: FloatArray | None
    speeds: FloatArray
    sensors: tuple[str, ...]
    vectors: ComplexArray
    covariances: FloatArray | None = None
    labels: Labels = field(default_factory=Labels)
    shares: tuple[float, float] | None = None

    def take(self, rows: IntArray, columns: IntArray | slice = slice(None)) -> Readings:
        """Some of the vectors, by rising time, of some sensors."""
        return replace(
            self,
            time=None if self.time is None else self.time[rows],
            speeds=self.speeds[rows],
            sensors=tuple(np.array(self.sensors)[columns].tolist()),
            vectors=self.vectors[rows][:, columns],
            covariances=None if self.covariances is None else self.covariances[rows][:, columns],
        )

    @property
    def noise(self) -> FloatArray:
        """Standard deviation of the vectors of each sensor, (C,), by differences of neighbours in speed."""
        second = np.diff(self.vectors[np.argsort(self.speeds, kind="stable")], 2, axis=0)
        return np.asarray(np.nanmedian(np.abs(second), axis=0) / np.sqrt(6 * np.log(2)))

    def roots(self, amplitudes: ComplexArray) -> FloatArray:
        """Inverse roots of the covariances at these amplitudes (N, C), (N, C, 2, 2)."""
        errors = None if self.shares is None else AmplitudeErrors(*self.shares)
        return inverse_roots(amplitudes, errors, self.covariances)


def projected(
    basis: tuple[ComplexArray, ComplexArray], vectors: ComplexArray, root: FloatArray
) -> tuple[FloatArray, FloatArray, ComplexArray, FloatArray]:
    """What modes explain of vectors (N, C), by the inverse roots of their covariances (N, C, 2, 2).

    Parameters
    ----------
    basis
        Answers (N, k + 2), and their slopes by ω_r and ζ_r (N, 2k).
    vectors, root
        The readings, NaN where there is none.

    Returns
    -------
    What R, a and b do not explain (m,), its slopes by ω_r and ζ_r (m, 2k), R, a and b (C, k + 2), and their
    covariances, (C, k + 2, 2, k + 2, 2).
    """
    from scipy.linalg import lapack

    columns, slopes = basis
    size, parts = 2 * columns.shape[1], []
    for x, over in zip(vectors.T, np.swapaxes(root, 0, 1), strict=True):
        seen = ~np.isnan(x)

        def real(each: Iterable[ComplexArray], over: FloatArray = over[seen]) -> FloatArray:
            return np.array([np.einsum("nij,nj->ni", over, stack(z).reshape(-1, 2)).ravel() for z in each]).T

        triangle, tau, *_ = lapack.dgeqrf(
            real(z * c for c in columns[seen].T for z in (1, 1j)), overwrite_a=1
        )
        y = lapack.dormqr("L", "T", triangle, tau, real([x[seen]]), 64)[0][:, 0]
        inverse = np.linalg.inv(np.triu(triangle[:size]))
        linear = (inverse @ y[:size]).reshape(-1, 2) @ (1, 1j)
        turned = real((slopes[seen] * np.tile(linear[:-2], 2)).T)
        turned = lapack.dormqr("L", "T", triangle, tau, turned, 64 * turned.shape[1], overwrite_c=1)[0]
        spread = (inverse @ inverse.T).reshape(size // 2, 2, -1, 2)
        parts.append((y[size:], -turned[size:], linear, spread))
    rest, by_q, factors, spreads = zip(*parts, strict=True)
    return np.concatenate(rest), np.concatenate(by_q), np.array(factors), np.array(spreads)


@dataclass(frozen=True, eq=False)
class FittedModes:
    """Modes from amplitudes.

    Attributes
    ----------
    readings, answers
        What was fitted, by rising frequency, and what modes answer to the excitation there.
    fit
        ω_r in rad/s, then ζ_r.
    root
        Inverse roots of the covariances of the readings, (N, C, 2, 2).
    ends
        First and last frequency around each resonance, rad/s.
    same
        What errors that are not stated were taken to be the same in.
    steady
        Of a sweep: the same as if every speed had been held.
    """

    readings: Readings
    answers: Answers
    fit: NonlinearEstimate
    root: FloatArray
    ends: tuple[tuple[float, float], ...]
    same: str
    steady: FittedModes | None = None

    @cached_property
    def values(self) -> FloatArray:
        """ω_r in rad/s and ζ_r, and their standard deviations, (4, k); NaN where these are unknown."""
        std = (
            np.full_like(self.fit.values, np.nan) if self.fit.estimate.std is None else self.fit.estimate.std
        )
        return np.vstack((self.fit.estimate.solution, std)).reshape(4, -1)

    @cached_property
    def unit(self) -> float:
        """Variance of residuals where no errors are stated, else 1; NaN where nothing is left to show it."""
        estimate = self.fit.estimate
        left = max(float(estimate.residuals @ estimate.residuals), 1e-300)
        return 1.0 if estimate.errors_stated else left / estimate.dof if estimate.dof > 0 else np.nan

    def _linear(self, q: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """R, a and b (C, k + 2), and their covariances but for `unit`."""
        return projected(self.answers.basis(q), self.readings.vectors, self.root)[2:]

    def curve(self, omega: FloatArray) -> ComplexArray:
        """The fitted amplitudes at frequencies between the readings, (m,): (m, P)."""
        q = self.fit.estimate.solution
        return self.answers.at(omega).basis(q)[0] @ self._linear(q)[0].T

    def predicted(self, columns: Callable[[FloatArray], ComplexArray]) -> tuple[ComplexArray, FloatArray]:
        """Sums of R, a and b, weighted by columns (m, k + 2) of q: (m, P), and covariances of their parts.

        NaN covariances, (m, P, 2, 2), where errors are unknown.
        """
        q, covariance = self.fit.estimate.solution, self.fit.estimate.covariance

        def sums(q: FloatArray) -> ComplexArray:
            return columns(q) @ self._linear(q)[0].T

        steps = 1e-6 * np.diag(np.maximum(np.abs(q), 1e-4))
        slopes = np.stack([(sums(q + d) - sums(q - d)) / (2 * d.sum()) for d in steps], axis=-1)
        by_q = np.stack((slopes.real, slopes.imag), axis=-2)
        of_q = np.full((q.size, q.size), np.nan) if covariance is None else np.nan_to_num(covariance)
        rows = np.swapaxes(real_matrices(columns(q)), 1, 2)
        linear = np.einsum("miaj,pajbk,mnbk->mpin", rows, self._linear(q)[1], rows)
        return sums(q), by_q @ of_q @ np.swapaxes(by_q, -1, -2) + self.unit * linear

    def _residues(self) -> tuple[ComplexArray, FloatArray]:
        """R (k, P), and covariances of their parts but for `unit`, (k, P, 2, 2)."""
        linear, spread = self._linear(self.fit.estimate.solution)
        return linear.T[:-2], np.einsum("piaib->ipab", spread)[:-2]

    def by_noise(self) -> FloatArray:
        """Bound for the probability that noise alone makes each mode, (k,)."""
        from scipy.special import chdtrc

        residues, spread = self._residues()
        parts = np.stack((residues.real, residues.imag), axis=-1)
        size = np.einsum("kpi,kpij,kpj->k", parts, np.linalg.inv(spread), parts) / self.unit
        return np.asarray((self.fit.estimate.dof + 1) * chdtrc(2 * parts.shape[1] + 2, size))

    @cached_property
    def undetermined(self) -> tuple[str, ...]:
        """Why there are no modes to go on with, in words: at most one clause a mode."""
        words, by_noise = [] if self.fit.converged else [self.fit.message], self.by_noise()
        speeds = self.readings.speeds
        intervals = self.fit.estimate.std is not None
        for mode, ((low, high), values) in enumerate(zip(self.ends, self.values.T, strict=True)):
            omega, zeta, error, other = values
            near = speeds[(3 * low - 2 * high <= speeds) & (speeds <= 3 * high - 2 * low)]
            name = f"mode {mode + 1} ({self.readings.labels.speed_words(omega)})"
            if by_noise[mode] > RARE:
                words.append(f"{name} is no more than noise: say in --bands where modes are")
            elif np.unique(np.abs(speeds - omega))[1] > ALONE * abs(zeta) * omega:
                words.append(
                    f"{name} stands on one frequency, perhaps a wild reading: measure closer by, or say in "
                    "--bands where modes are"
                )
            elif intervals and not 2 * error < high - low:
                words.append(f"these readings do not tell frequency and damping of mode {mode + 1}")
            elif not near.min() < omega < near.max():  # in a fast sweep it stands beside its peak
                words.append(f"{name} is read on one side only")
            elif zeta + 2 * np.nan_to_num(other) < 0:
                words.append(f"the damping of mode {mode + 1} is negative ({zeta:.2g}): phases must be leads")
        return tuple(words)

    @cached_property
    def _misfit(self) -> tuple[str, ...]:
        """Why what is left is more than errors: its size, where these are stated, else its course."""
        from scipy.special import ndtr

        estimate = self.fit.estimate
        words = [why] if (why := estimate.misfit()) else []
        if not estimate.errors_stated:
            gap = np.nan_to_num(self.readings.vectors - self.curve(self.readings.speeds))
            left = self.root @ np.stack((gap.real, gap.imag), -1)[..., None]
            trend = (left[:-1] * left[1:]).sum() / max((left**2).sum(), 1e-300) * np.sqrt(gap.size)
            if (np.abs(gap) > 1e-9 * np.nanmax(np.abs(self.readings.vectors))).any() and ndtr(-trend) < RARE:
                words.append(
                    "what is left of the amplitudes is no noise: it changes slowly with the frequency"
                )
        return tuple(f"{why}; or another mode is in the range (--bands)" for why in words)

    @property
    def explains(self) -> bool:
        """Whether the modes are determined and leave no more than errors."""
        return not (self.undetermined or self._misfit)

    @cached_property
    def _shapes(self) -> tuple[FloatArray, FloatArray, tuple[str, ...], tuple[str, ...]]:
        """Real shapes and relative standard deviations, independent from point to point; warnings, notes.

        Probes 90° apart read a mode that whirls a quarter turn after each other: such residues are turned.
        """
        residues, spread = self._residues()
        points, modes, spread = np.array(self.readings.sensors), np.arange(len(residues)), self.unit * spread
        trace, size = np.trace(spread, axis1=2, axis2=3), np.abs(residues)
        first = (size >= 0.5 * size.max(axis=1, keepdims=True)).argmax(axis=1)
        beside = residues / (residues / size)[modes, first][:, None]
        aside = np.abs(beside.imag) > np.fmax(np.abs(beside.real), ASIDE * np.sqrt(trace))
        way = np.where(aside, 1j, 1.0)
        way = way * np.exp(-0.5j * np.angle(((way * residues) ** 2 / trace).sum(axis=1)))[:, None]
        parts, turn = way * residues, real_matrices(way)[:, :, 0]
        along = np.einsum("kpi,kpij,kpj->kp", turn, spread, turn)
        shape = np.copysign(np.fmax(np.abs(parts.real), np.sqrt(along) / LARGEST), parts.real)
        std = np.sqrt(along) / np.abs(shape)
        lost = (parts.imag**2).sum(axis=1) / (shape**2).sum(axis=1)  # of the real parts, of second order
        bent = lost > np.maximum(EXACT, np.median(std, axis=1) / 2)
        warnings = (
            f"mode {mode + 1} is complex: phases scatter by {np.degrees(lost[mode] ** 0.5):.2g}°; its real "
            "shape is not exact (heavy damping, or another mode beside it)"
            for mode in modes[bent]
        )
        notes = (
            f"mode {mode + 1} whirls: {listing(points[aside[mode]], 'and')} a quarter turn from "
            f"{points[first[mode]]}, as probes 90° apart read it"
            for mode in modes[aside.any(axis=1) & ~bent]
        )
        no_node = (np.abs(shape) >= 0.1 * np.abs(shape).max(axis=1, keepdims=True)).argmax(axis=1)
        return shape / shape[modes, no_node][:, None], std, tuple(warnings), tuple(notes)

    @property
    def shapes(self) -> FloatArray:
        """Real shapes (k, P); the first point that is no node of a mode has 1."""
        return self._shapes[0]

    @property
    def shape_std(self) -> FloatArray:
        """Relative standard deviations (k, P), independent from point to point; NaN where unknown."""
        return self._shapes[1]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        return (*self.undetermined, *self._misfit, *(() if self.undetermined else self._shapes[2]))

    @property
    def notes(self) -> tuple[str, ...]:
        """Which probes read a whirl, and what errors are taken for."""
        unstated = f"errors are not stated: the same {self.same}, as what is left of the amplitudes shows"
        return (*self._shapes[3], *self.fit.estimate.answer.notes, *[unstated] * bool(self.same))

    def file_table(self, speed: str = "frequency_rad_s", scale: float = 1.0) -> Table:
        """The table of modes that `reduce` and `identify` read, a row per mode and point.

        Raises
        ------
        ValueError
            Where a mode is not determined, for a part would look like all.
        """
        if self.undetermined:
            raise ValueError(f"there is no table of modes: {self.undetermined[0]}")
        points, k = self.readings.sensors, len(self.ends)
        omega, zeta, error, other = np.repeat(self.values, len(points), axis=1)
        columns = {
            "mode": np.repeat(np.arange(1, k + 1), len(points)),
            speed: scale * omega,
            "node": points * k,
            "shape": self.shapes.ravel(),
            "damping_percent": 100 * zeta,
        }
        if not np.isnan(error).any() and not np.isnan(self.shape_std).any():
            columns["frequency_std_percent"] = 100 * error / omega
            columns["shape_std_percent"] = 100 * self.shape_std.ravel()
            columns["damping_std_percent"] = 100 * other / np.abs(zeta)
        return Table("modes", tuple(Column(name, values) for name, values in columns.items()))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        estimate, modes = self.fit.estimate, []
        if self.undetermined:
            estimate = replace(estimate, values=estimate.values * np.nan, covariance=None)
        else:
            modes = self.file_table().records
        return dict(plain({**estimate.to_dict(), "modes": modes, "warnings": self.warnings}))
