"""Modes fitted to amplitudes: frequencies, damping and shapes with errors, and what speaks against them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import counted, error_figures, listing
from rotorid.harmonic.modal.modal_readings import Readings
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.checks_amplitudes import misfit
from rotorid.identify.operator_model import reference_amplitude
from rotorid.regression.nonlinear import NonlinearEstimate

if TYPE_CHECKING:
    import pandas as pd

LARGEST = 10.0
"""No relative error of a shape is larger: amplitudes that are 0 within it are told as that share of it."""
RARE, EXACT = 1e-3, 1e-3
"""Probability below which chance explains nothing; a share of a shape that nobody minds."""


@dataclass(frozen=True, eq=False)
class FittedModes(Answered):
    """Modes from amplitudes.

    Attributes
    ----------
    points
        Where amplitudes were read, length P.
    fit
        ω_r in rad/s, then ζ_r.
    ends
        First and last frequency around each resonance, rad/s.
    trend
        Correlation of neighbouring residuals, in its standard deviations.
    worst
        Point and frequency (rad/s) of the largest residual, and it over its error.
    same
        What errors that are not stated were taken to be the same in.
    experiments, readings
        What was fitted, by rising frequency, and the same under its excitation, whitened.
    """

    points: tuple[str, ...]
    fit: NonlinearEstimate
    ends: tuple[tuple[float, float], ...]
    trend: float
    worst: tuple[str, float, float]
    same: str
    experiments: Experiments
    readings: Readings

    @cached_property
    def unit(self) -> float:
        """Variance of residuals where no errors are stated, else 1; NaN where nothing is left to tell it."""
        estimate = self.fit.estimate
        if estimate.errors_stated or estimate.dof < 1:
            return 1.0 if estimate.errors_stated else np.nan
        return float(np.fmax(estimate.residuals @ estimate.residuals, 1e-300) / estimate.dof)

    @cached_property
    def residues(self) -> tuple[ComplexArray, FloatArray]:
        """R_r, (k, P), and covariances of their parts at these ω_r and ζ_r, (k, P, 2, 2), but for `unit`."""
        return self._residues(self.readings)

    def predicted(self, columns: Callable[[FloatArray], ComplexArray]) -> tuple[ComplexArray, FloatArray]:
        """Sums of R, a and b, weighted by columns (m, k + 2) of q: (m, P), and covariances of their parts.

        NaN covariances, (m, P, 2, 2), where errors are unknown.
        """
        readings, estimate = self.readings, self.fit.estimate

        def sums(q: FloatArray) -> ComplexArray:
            return np.asarray(columns(q) @ np.transpose(readings.each(2, q)))

        q = estimate.solution
        steps = 1e-6 * np.diag(np.maximum(np.abs(q), 1e-4))
        slopes = np.stack([(sums(q + d) - sums(q - d)) / (2 * d.sum()) for d in steps], axis=-1)
        by_q = np.stack((slopes.real, slopes.imag), axis=-2)
        unknown = np.full((q.size, q.size), np.nan)
        own = unknown if self.fit.estimate.covariance is None else np.nan_to_num(self.fit.estimate.covariance)
        rows = np.stack((columns(q), 1j * columns(q)), axis=-1)
        rows = np.stack((rows.real, rows.imag), axis=1)
        linear = np.einsum("miaj,pajbk,mnbk->mpin", rows, np.array(readings.each(3, q)), rows)
        return sums(q), by_q @ own @ np.swapaxes(by_q, -1, -2) + self.unit * linear

    def _residues(self, readings: Readings) -> tuple[ComplexArray, FloatArray]:
        k, q = len(self.ends), self.fit.estimate.solution
        return np.transpose(readings.each(2, q))[:k], np.einsum("piaib->ipab", readings.each(3, q))[:k]

    def _by_chance(self, readings: Readings) -> FloatArray:
        """Bound for the probability of each mode's residues in such readings, if there is no such mode."""
        from scipy.special import chdtrc

        residues, spread = self._residues(readings)
        parts = np.stack((residues.real, residues.imag), axis=-1)
        size = np.einsum("kpi,kpij,kpj->k", parts, np.linalg.inv(spread), parts) / self.unit
        return np.asarray((self.fit.estimate.dof + 1) * chdtrc(2 * len(self.points) + 2, size))

    @cached_property
    def by_noise(self) -> FloatArray:
        """Bound for the probability that noise alone makes each mode, (k,)."""
        return self._by_chance(self.readings)

    def told_at(self, omega: float) -> str:
        """A frequency in the unit of the table."""
        return f"{self.experiments.axis.scale * omega:.5g} {self.experiments.axis.word.rpartition(', ')[2]}"

    @cached_property
    def undetermined(self) -> tuple[str, ...]:
        """Why there are no modes to go on with, in words."""
        found = [] if self.fit.converged else [self.fit.message]
        chance = self.by_noise
        std = np.zeros_like(self.fit.values) if self.fit.std is None else self.fit.std
        told = np.vstack((self.fit.estimate.solution, std)).reshape(4, -1).T
        for mode, ((omega, zeta, error, other), (low, high)) in enumerate(
            zip(told, self.ends, strict=True), 1
        ):
            if chance[mode - 1] > RARE:
                found.append(
                    f"mode {mode} ({self.told_at(omega)}) is no more than noise: say in --bands "
                    "where modes are"
                )
            elif not 2 * error < high - low:
                found.append(f"these readings do not tell frequency and damping of mode {mode}")
            elif self._by_chance(self.readings.without(omega, len(told) + 2))[mode - 1] > RARE:
                found.append(
                    f"mode {mode} ({self.told_at(omega)}) stands on one frequency, perhaps a wild reading: "
                    "measure closer by, or say in --bands where modes are"
                )
            elif not self._on_both_sides(omega, low, high):
                found.append(f"mode {mode} ({self.told_at(omega)}) is read on one side only")
            elif zeta + 2 * other < 0:
                found.append(f"the damping of mode {mode} is negative ({zeta:.2g}): phases must be leads")
        return tuple(found)

    def _on_both_sides(self, omega: float, low: float, high: float) -> bool:
        """Whether there are readings below and above, at a peak or near: in a fast sweep it stands beside."""
        read, more = self.readings.answers.omega, 2 * (high - low)
        near = read[(low - more <= read) & (read <= high + more)]
        return bool(near.min() < omega < near.max())

    @property
    def explains(self) -> bool:
        """Whether the modes are determined and leave no more than errors."""
        return not (self.undetermined or self._misfits)

    @cached_property
    def parts(self) -> tuple[FloatArray, FloatArray]:
        """Residues along and across the common phase of their mode, and their variances, (2, k, P) each."""
        residues, spread = self.residues
        phase = np.angle((residues**2 / np.trace(spread, axis1=2, axis2=3)).sum(axis=1)) / 2
        turn = np.array([[np.cos(phase), np.sin(phase)], [-np.sin(phase), np.cos(phase)]])
        turned = residues * np.exp(-1j * phase[:, None])
        variances = np.einsum("aik,kpij,ajk->akp", turn, self.unit * spread, turn)
        least = np.fmax(np.abs(turned.real), np.sqrt(variances[0]) / LARGEST)
        return np.stack((np.copysign(least, turned.real), turned.imag)), variances

    @property
    def shapes(self) -> FloatArray:
        """Real shapes (k, P); the first point that is no node of a mode has 1."""
        return np.array([s / s[reference_amplitude(s)] for s in self.parts[0][0]])

    @property
    def shape_std(self) -> FloatArray:
        """Relative standard deviations (k, P), independent from point to point; NaN where unknown."""
        return np.asarray(np.sqrt(self.parts[1][0]) / np.abs(self.parts[0][0]))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        from scipy.special import chdtrc

        (along, across), (_, variances) = self.parts
        lost = (across**2).sum(axis=1) / (along**2).sum(axis=1)  # of the real parts, of second order
        chance = chdtrc(max(len(self.points) - 1, 1), (across**2 / variances).sum(axis=1))
        minded = np.maximum(EXACT, np.median(self.shape_std, axis=1) / 2)
        return (
            *self.undetermined,
            *(f"{why}; or another mode is in the range (--bands)" for why in self._misfits),
            *(
                f"mode {mode + 1} is complex: phases scatter by {np.degrees(lost[mode] ** 0.5):.2g}°, more "
                "than errors explain; its real shape is not exact (heavy damping, or another mode beside it)"
                for mode in np.flatnonzero((chance < RARE) & (lost > minded))
            ),
        )

    @property
    def _misfits(self) -> list[str]:
        """Why what is left is more than errors."""
        from scipy.special import ndtr

        misfits, (point, omega, size) = [*misfit(self.fit.estimate)], self.worst
        more = size > 1e-9 * np.nanmax(np.abs(self.readings.Z))  # than the rounding of exact data
        if more and (self.fit.estimate.dof + 1) * np.exp(-(size**2) / self.unit / 2) < RARE:
            off = size / self.unit**0.5
            misfits.append(
                f"{point} at {self.told_at(omega)} is {off:.2g} standard deviations off: a wild reading"
            )
        if not self.fit.estimate.errors_stated and ndtr(-self.trend) < RARE:
            misfits.append("what is left of the amplitudes is no noise: it changes slowly with the frequency")
        return misfits

    def columns(self) -> tuple[Column, ...]:
        """The table of modes that `reduce` and `identify` read, a row per mode and point."""
        P, k = len(self.points), len(self.ends)
        omega, zeta = np.repeat(self.fit.estimate.solution, P).reshape(2, -1)
        told = [
            Column("mode", np.repeat(np.arange(1, k + 1), P)),
            Column("frequency_rad_s", omega),
            Column("node", self.points * k),
            Column("shape", self.shapes.ravel()),
            Column("damping_percent", 100 * zeta),
        ]
        if self.fit.std is not None and not np.isnan(self.shape_std).any():
            errors = np.repeat(self.fit.std, P).reshape(2, -1)
            told.append(Column("frequency_std_percent", 100 * errors[0] / omega))
            told.append(Column("shape_std_percent", 100 * self.shape_std.ravel()))
            told.append(Column("damping_std_percent", 100 * errors[1] / np.abs(zeta)))
        return tuple(told)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        estimate, modes = self.fit.estimate, [] if self.undetermined else rows(self.columns())
        if self.undetermined:
            estimate = replace(estimate, values=estimate.values * np.nan, covariance=None)
        return plain({**estimate.to_dict(), "modes": modes, "warnings": self.warnings})

    def to_frame(self) -> pd.DataFrame:
        """The table of modes; ValueError where one is not determined, for a part would look like all."""
        if self.undetermined:
            raise ValueError(f"there is no table of modes: {self.undetermined[0]}")
        return frame(self.columns())

    @property
    def answer(self) -> Answer:
        """Frequencies and damping with their errors, shapes, and what speaks against them."""
        estimate = self.fit.estimate
        if self.undetermined:
            return Answer("Not every mode is determined: no table of modes.", "", self.warnings)
        axis = self.experiments.axis
        told = [f"{axis.scale * omega:.5g}" for omega in estimate.solution[: len(self.ends)]]
        shapes = [Column("point", self.points, str)]
        for mode, (shape, std) in enumerate(zip(self.shapes, self.shape_std, strict=True), 1):
            shapes.append(Column(f"shape {mode}", shape, "{:.4g}".format))
            shapes.append(Column("±", np.abs(shape) * std, error_figures))
        notes = ["ω in rad/s, ζ of critical damping", *estimate.told().notes]
        if self.same:
            notes.append(
                f"errors are not stated: the same {self.same}, as what is left of the amplitudes shows"
            )
        return Answer(
            f"{counted(len(told), 'mode')}: {listing(told, 'and')} {axis.word.rpartition(', ')[2]}.",
            f"{estimate.told().found}\n\n{text(shapes, width=COLUMNS)}",
            self.warnings,
            tuple(notes),
        )
