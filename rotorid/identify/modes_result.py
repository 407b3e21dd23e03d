"""Modes fitted to amplitudes: frequencies, damping and shapes with errors, and what speaks against them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import listing
from rotorid.identify.answers import Answers
from rotorid.identify.modes_readings import Readings, Whitened
from rotorid.regression.nonlinear import NonlinearEstimate

LARGEST = 10.0
"""No relative error of a shape is larger: amplitudes that are 0 within it count as that share of it."""
RARE, EXACT = 1e-3, 1e-3
"""Probability below which chance explains nothing; a share of a shape that nobody minds."""
ASIDE = 4.0
"""Standard deviations across the phase of its mode beyond which a probe may stand 90° apart."""


@dataclass(frozen=True, eq=False)
class FittedModes:
    """Modes from amplitudes.

    Attributes
    ----------
    readings, answers
        What was fitted, by rising frequency, and what modes answer to the excitation there.
    fit
        ω_r in rad/s, then ζ_r.
    whitened
        The readings over their errors.
    ends
        First and last frequency around each resonance, rad/s.
    same
        What errors that are not stated were taken to be the same in.
    """

    readings: Readings
    answers: Answers
    fit: NonlinearEstimate
    whitened: Whitened
    ends: tuple[tuple[float, float], ...]
    same: str

    @cached_property
    def values(self) -> FloatArray:
        """ω_r in rad/s and ζ_r, and their standard deviations, (4, k); NaN where these are unknown."""
        std = self.fit.std
        std = np.full_like(self.fit.values, np.nan) if std is None else std
        return np.vstack((self.fit.estimate.solution, std)).reshape(4, -1)

    @cached_property
    def unit(self) -> float:
        """Variance of residuals where no errors are stated, else 1; NaN where nothing is left to show it."""
        estimate = self.fit.estimate
        if estimate.errors_stated:
            return 1.0
        left = float(np.fmax(estimate.residuals @ estimate.residuals, 1e-300))
        return left / estimate.dof if estimate.dof > 0 else np.nan

    def curve(self, omega: FloatArray) -> ComplexArray:
        """The fitted amplitudes at frequencies between the readings, (m,): (m, P)."""
        return self.whitened.model(self.fit.estimate.solution, self.answers.at(omega))

    def predicted(self, columns: Callable[[FloatArray], ComplexArray]) -> tuple[ComplexArray, FloatArray]:
        """Sums of R, a and b, weighted by columns (m, k + 2) of q: (m, P), and covariances of their parts.

        NaN covariances, (m, P, 2, 2), where errors are unknown.
        """
        q, covariance = self.fit.estimate.solution, self.fit.estimate.covariance
        spread, weights = self.whitened.at(q).spread, columns(q)

        def sums(q: FloatArray) -> ComplexArray:
            return np.asarray(columns(q) @ self.whitened.at(q).linear.T)

        steps = 1e-6 * np.diag(np.maximum(np.abs(q), 1e-4))
        slopes = np.stack([(sums(q + d) - sums(q - d)) / (2 * d.sum()) for d in steps], axis=-1)
        by_q = np.stack((slopes.real, slopes.imag), axis=-2)
        of_q = np.full((q.size, q.size), np.nan) if covariance is None else np.nan_to_num(covariance)
        rows = np.stack((weights, 1j * weights), axis=-1)
        rows = np.stack((rows.real, rows.imag), axis=1)
        linear = np.einsum("miaj,pajbk,mnbk->mpin", rows, spread, rows)
        return sums(q), by_q @ of_q @ np.swapaxes(by_q, -1, -2) + self.unit * linear

    def _residues(self, whitened: Whitened) -> tuple[ComplexArray, FloatArray]:
        """R_r (k, P), and covariances of their parts at these ω_r and ζ_r, (k, P, 2, 2), but for `unit`."""
        _, _, linear, spread = whitened.at(self.fit.estimate.solution)
        return linear.T[:-2], np.einsum("piaib->ipab", spread)[:-2]

    def _by_chance(self, whitened: Whitened) -> FloatArray:
        """Bound for the probability of each mode's residues in such readings, if there is no such mode."""
        from scipy.special import chdtrc

        residues, spread = self._residues(whitened)
        parts = np.stack((residues.real, residues.imag), axis=-1)
        size = np.einsum("kpi,kpij,kpj->k", parts, np.linalg.inv(spread), parts) / self.unit
        return np.asarray((self.fit.estimate.dof + 1) * chdtrc(2 * len(self.readings.sensors) + 2, size))

    @cached_property
    def by_noise(self) -> FloatArray:
        """Bound for the probability that noise alone makes each mode, (k,)."""
        return self._by_chance(self.whitened)

    @cached_property
    def undetermined(self) -> tuple[str, ...]:
        """Why there are no modes to go on with, in words."""
        return (*(() if self.fit.converged else (self.fit.message,)), *self._doubts())

    def _doubts(self) -> Iterator[str]:
        """What is wrong with a mode, at most one clause each."""
        read, values = self.answers.omega, self.values
        values = np.nan_to_num(values) if self.fit.std is None else values
        for mode, (omega, zeta, error, other) in enumerate(values.T):
            (low, high), words = self.ends[mode], f"mode {mode + 1} ({self.readings.words(omega)})"
            near = read[(3 * low - 2 * high <= read) & (read <= 3 * high - 2 * low)]
            if self.by_noise[mode] > RARE:
                yield f"{words} is no more than noise: say in --bands where modes are"
            elif not 2 * error < high - low:
                yield f"these readings do not tell frequency and damping of mode {mode + 1}"
            elif self._by_chance(self.whitened.without(omega, len(self.ends) + 2))[mode] > RARE:
                yield (
                    f"{words} stands on one frequency, perhaps a wild reading: measure closer by, or say in "
                    "--bands where modes are"
                )
            elif not near.min() < omega < near.max():  # in a fast sweep it stands beside its peak
                yield f"{words} is read on one side only"
            elif zeta + 2 * other < 0:
                yield f"the damping of mode {mode + 1} is negative ({zeta:.2g}): phases must be leads"

    @cached_property
    def _misfits(self) -> tuple[str, ...]:
        """Why what is left is more than errors."""
        from scipy.special import ndtr

        estimate, Z, words = self.fit.estimate, self.readings.vectors, []
        words += [why] if (why := estimate.misfit()) else []
        gap = np.nan_to_num(Z - self.whitened.model(estimate.solution))
        left = np.einsum("npij,npj->npi", self.whitened.root, np.stack((gap.real, gap.imag), -1)) @ (1, 1j)
        i, p = np.unravel_index(np.abs(left).argmax(), left.shape)
        size = float(np.abs(left[i, p]))
        more = size > 1e-9 * np.nanmax(np.abs(Z))  # than the rounding of exact data
        if more and (estimate.dof + 1) * np.exp(-(size**2) / self.unit / 2) < RARE:
            words.append(
                f"{self.readings.sensors[p]} at {self.readings.words(float(self.readings.speeds[i]))} is "
                f"{size / self.unit**0.5:.2g} standard deviations off: a wild reading"
            )
        trend = np.vdot(left[:-1], left[1:]).real / np.vdot(left, left).real * np.sqrt(2 * left.size)
        if not estimate.errors_stated and ndtr(-trend) < RARE:
            words.append("what is left of the amplitudes is no noise: it changes slowly with the frequency")
        return tuple(f"{why}; or another mode is in the range (--bands)" for why in words)

    @property
    def explains(self) -> bool:
        """Whether the modes are determined and leave no more than errors."""
        return not (self.undetermined or self._misfits)

    @cached_property
    def _parts(self) -> tuple[FloatArray, FloatArray, tuple[str, ...], tuple[str, ...]]:
        """Residues along and across the phase of their mode, and variances along, (k, P); warnings, notes.

        Probes 90° apart read a mode that whirls a quarter turn after each other: such residues are turned.
        """
        from scipy.special import chdtrc

        residues, spread = self._residues(self.whitened)
        points, modes = self.readings.sensors, np.arange(len(residues))
        trace = np.trace(spread, axis1=2, axis2=3)
        size = np.abs(residues)
        first = (size >= 0.5 * size.max(axis=1, keepdims=True)).argmax(axis=1)
        beside = residues * np.conj(residues[modes, first] / size[modes, first])[:, None]
        aside = np.abs(beside.imag) > np.abs(beside.real)
        aside &= beside.imag**2 > ASIDE**2 * self.unit * trace
        turned = np.where(aside, 1j, 1.0) * residues
        phase = np.angle((turned**2 / trace).sum(axis=1)) / 2
        way = np.where(aside, 1j, 1.0) * np.exp(-1j * phase)[:, None]
        rows = np.stack((np.stack((way.real, -way.imag), -1), np.stack((way.imag, way.real), -1)), -2)
        along, across = self.unit * np.einsum("kpai,kpij,kpaj->akp", rows, spread, rows)
        parts = turned * np.exp(-1j * phase)[:, None]
        shape = np.copysign(np.fmax(np.abs(parts.real), np.sqrt(along) / LARGEST), parts.real)
        lost = (parts.imag**2).sum(axis=1) / (shape**2).sum(axis=1)  # of the real parts, of second order
        chance = chdtrc(max(len(points) - 1, 1), (parts.imag**2 / across).sum(axis=1))
        minded = np.maximum(EXACT, np.median(np.sqrt(along) / np.abs(shape), axis=1) / 2)
        bent = (chance < RARE) & (lost > minded)
        warnings = (
            f"mode {mode + 1} is complex: phases scatter by {np.degrees(lost[mode] ** 0.5):.2g}°, more than "
            "errors explain; its real shape is not exact (heavy damping, or another mode beside it)"
            for mode in modes[bent]
        )
        notes = (
            f"mode {mode + 1} whirls: {listing(np.array(points)[aside[mode]], 'and')} a quarter turn from "
            f"{points[first[mode]]}, as probes 90° apart read it"
            for mode in modes[aside.any(axis=1) & ~bent]
        )
        return shape, along, tuple(warnings), tuple(notes)

    @property
    def shapes(self) -> FloatArray:
        """Real shapes (k, P); the first point that is no node of a mode has 1."""
        along = self._parts[0]
        no_node = np.abs(along) >= 0.1 * np.abs(along).max(axis=1, keepdims=True)
        return np.asarray(along / along[np.arange(len(along)), no_node.argmax(axis=1)][:, None])

    @property
    def shape_std(self) -> FloatArray:
        """Relative standard deviations (k, P), independent from point to point; NaN where unknown."""
        along, variances, *_ = self._parts
        return np.asarray(np.sqrt(variances) / np.abs(along))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        return (*self.undetermined, *self._misfits, *self._parts[2])

    @property
    def notes(self) -> tuple[str, ...]:
        """Which probes read a whirl, and what errors are taken for."""
        unstated = f"errors are not stated: the same {self.same}, as what is left of the amplitudes shows"
        return (*self._parts[3], *self.fit.estimate.told().notes, *[unstated] * bool(self.same))

    def file_table(self, speed: str = "frequency_rad_s", scale: float = 1.0) -> Table:
        """The table of modes that `reduce` and `identify` read, a row per mode and point.

        Raises
        ------
        ValueError
            Where a mode is not determined, for a part would look like all.
        """
        if self.undetermined:
            raise ValueError(f"there is no table of modes: {self.undetermined[0]}")
        points = self.readings.sensors
        k, P = len(self.ends), len(points)
        omega, zeta, error, other = np.repeat(self.values, P, axis=1)
        columns = [
            Column("mode", np.repeat(np.arange(1, k + 1), P)),
            Column(speed, scale * omega),
            Column("node", points * k),
            Column("shape", self.shapes.ravel()),
            Column("damping_percent", 100 * zeta),
        ]
        if not np.isnan(error).any() and not np.isnan(self.shape_std).any():
            columns.append(Column("frequency_std_percent", 100 * error / omega))
            columns.append(Column("shape_std_percent", 100 * self.shape_std.ravel()))
            columns.append(Column("damping_std_percent", 100 * other / np.abs(zeta)))
        return Table("modes", tuple(columns))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        estimate, modes = self.fit.estimate, []
        if self.undetermined:
            estimate = replace(estimate, values=estimate.values * np.nan, covariance=None)
        else:
            table = self.file_table()
            modes = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
        return dict(plain({**estimate.to_dict(), "modes": modes, "warnings": self.warnings}))
