"""Measured against predicted amplitudes: residuals over their errors, and their Jacobian.

Residuals are the stretched differences of amplitudes, along and across each amplitude, over their errors:
stated, or relative to the amplitude. Of a free vibration the predicted mode most like the measured shape is
compared: its frequency, and its amplitudes relative to the first measured one. The frequency counts with its
error, or else with that of this amplitude.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.identify.amplitudes import Experiments, inverse_roots, trusted
from rotorid.identify.operator_model import (
    HarmonicModel,
    mode_slopes,
    natural_modes,
    nearest_mode,
    reference_amplitude,
)
from rotorid.regression.search import Function, together

ROUNDING = 1e-9
"""Share of an amplitude below which its imaginary part is rounding."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Residuals of one set of experiments against one model.

    Attributes
    ----------
    model, experiments
        Model and data.
    measured
        Outputs (n, e), NaN where not measured.
    forced, free
        Indices of the forced experiments that can be predicted, and of the free vibrations.
    rows
        Which parts of the readings count, along and across each amplitude, (n, e, 2). Parts that no
        parameter moves, the imaginary ones of a model without damping, do not: they say nothing of errors.
    whiten
        Inverse root of each reading's covariance, (n, e, 2, 2).
    left_out
        In words.
    """

    model: HarmonicModel
    experiments: Experiments
    measured: ComplexArray
    forced: IntArray
    free: IntArray
    rows: BoolArray
    whiten: FloatArray
    left_out: tuple[str, ...]

    @cached_property
    def _functions(self) -> tuple[Function, Function]:
        return together(self._both)

    def residual(self, theta: FloatArray) -> FloatArray:
        """(Predicted − measured) over the errors; NaN where the model has no answer (resonance, no mode)."""
        return self._functions[0](theta)

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Derivatives of the residuals, (rows, parameters)."""
        return self._functions[1](theta)

    def reweighted(self, theta: FloatArray) -> Comparison:
        """The same with errors at the amplitudes predicted by θ, where these are near the measured ones."""
        size = trusted(self.predict(theta)[0], self.measured)
        return replace(self, whiten=whitening(self.experiments, self.model.outputs, size))

    def predict(self, theta: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Amplitudes (n, e) and natural frequencies (n,), NaN where there are none."""
        amplitudes, frequencies = self._answers(theta)
        return amplitudes[..., 0], frequencies[:, 0]

    def left(self, theta: FloatArray) -> float:
        """Root mean square of what the model leaves of each output's readings and of natural frequencies.

        Relative to the root mean square of the readings; NaN where nothing is predicted.
        """
        predicted, natural = self.predict(theta)
        gap = np.abs(predicted - self.measured) ** 2
        size = np.where(np.isnan(gap), 0.0, np.abs(self.measured) ** 2).sum(axis=0)
        shares = (np.nansum(gap, axis=0)[size > 0] / size[size > 0]).tolist()
        if len(self.free):  # a mode that the model does not have is left whole
            away = natural[self.free] / self.experiments.frequencies[self.free] - 1
            shares.append(float(np.mean(np.nan_to_num(away, nan=1.0) ** 2)))
        return float(np.sqrt(np.mean(shares))) if shares else np.nan

    def _answers(self, theta: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Amplitudes and natural frequencies, behind each its derivatives by θ, (n, e, 1 + n), (n, 1 + n)."""
        data, varying, forced = self.experiments, self.experiments.varying, self.forced
        amplitudes = np.full((*self.measured.shape, 1 + len(theta)), np.nan, dtype=complex)
        frequencies = np.full(amplitudes[:, 0].shape, np.nan)
        inputs, rows = data.table(self.model.inputs)[forced], {n: v[forced] for n, v in varying.items()}
        Z, dZ = self.model.forced(theta, data.frequencies[forced], inputs, rows)
        amplitudes[forced] = np.concatenate((Z[..., None], dZ), axis=-1)
        for k, i in enumerate(self.free):
            if not k or varying:
                A, dA = self.model.dynamic_stiffness(theta, {n: v[[i]] for n, v in varying.items()})
                modes = natural_modes(A)
            shape = self.measured[i].real
            mode = nearest_mode(*modes, float(data.frequencies[i]), shape)
            reference = reference_amplitude(shape)
            if mode is not None and mode[1][reference]:
                omega, v = np.sqrt(mode[0]), mode[1] / mode[1][reference] * shape[reference]
                dz, dv = mode_slopes(A, dA, mode[0], v, reference)
                amplitudes[i] = np.column_stack((v, dv))
                frequencies[i] = (omega, *dz / (2 * omega))
        return amplitudes, frequencies

    def _both(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals and their derivatives."""
        try:
            with np.errstate(all="ignore"):
                gap, frequency = self._answers(theta)
        except np.linalg.LinAlgError:
            nothing = np.full((np.count_nonzero(self.rows) + len(self.free), 1 + len(theta)), np.nan)
            return nothing[:, 0], nothing[:, 1:]
        gap[..., 0] -= self.measured
        frequency[:, 0] -= self.experiments.frequencies
        both = self.whiten @ np.stack((gap.real, gap.imag), axis=-2)
        for i in self.free:
            over, shape, rows = self.whiten[i, :, 0, 0], self.measured[i].real, self.rows[i, :, 0]
            reference, std = reference_amplitude(shape), self.experiments.frequency_std
            # without an error of its own the frequency has the relative one of the reference amplitude
            size = over[reference] * abs(shape[reference])
            frequency[i] *= size / self.experiments.frequencies[i] if std is None else 1 / std[i]
            if std is not None:  # then the error of the reference is one of all that is given relative to it
                common = (over * shape)[rows] / size
                square = common @ common
                share = (1 - 1 / np.sqrt(1 + square)) / square if square else 0.0
                both[i, rows, 0] -= share * np.outer(common, common @ both[i, rows, 0])
        every = np.concatenate((both[self.rows], frequency[self.free]))
        return every[:, 0], every[:, 1:]


def compare(model: HarmonicModel, experiments: Experiments) -> Comparison:
    """Set up a comparison, with errors at the measured amplitudes.

    Raises
    ------
    ValueError
        If equations and outputs differ in number, no reading can be compared, or errors are stated for some
        outputs only.
    """
    model.check_square()
    measured, inputs = experiments.table(model.outputs), experiments.table(model.inputs)
    given = np.asarray(~np.isnan(measured))
    factors = model.multipliers(experiments.frequencies, experiments.varying)
    known = ~np.isnan(inputs).any(axis=1) & ~np.isnan(factors).any(axis=1) | experiments.free
    usable = known & given.any(axis=1)
    hidden = ~given.any(axis=0)
    left_out = [f"{model.outputs[j]} is measured nowhere" for j in np.flatnonzero(hidden)]
    what = "input or varying quantity" if model.varying else "input"
    for i, name in enumerate(experiments.names):
        lost = [o for o, g in zip(model.outputs, given[i] | hidden, strict=True) if not g]
        if not known[i]:
            left_out.append(f"experiment {name}: left out, for not every {what} is known")
        elif lost or not usable[i]:
            left_out.append(f"experiment {name}: {', '.join(lost) or 'everything'} not measured")
    if not usable.any():
        raise ValueError("no reading can be compared with a prediction: " + "; ".join(left_out))
    forced, free = (np.flatnonzero(usable & kind) for kind in (~experiments.free, experiments.free))
    rows = np.repeat((given & known[:, None])[:, :, None], 2, axis=2)
    rows[free, :, 1] = False
    rows[free, [reference_amplitude(shape.real) for shape in measured[free]], 0] = False
    if not (model.power % 2).any():
        real = (inputs.imag == 0).all(axis=1)[:, None]
        rows[..., 1] &= ~(real & (np.abs(measured.imag) <= ROUNDING * np.abs(measured)))
    whiten = whitening(experiments, model.outputs, measured)
    return Comparison(model, experiments, measured, forced, free, rows, whiten, tuple(left_out))


def whitening(experiments: Experiments, outputs: tuple[str, ...], amplitudes: ComplexArray) -> FloatArray:
    """Inverse root of the covariance of each reading, (n, e, 2, 2), rows along and across."""
    whiten = np.zeros((len(experiments), len(outputs), 2, 2))
    for j, name in enumerate(outputs):
        known, errors = experiments.covariances, experiments.errors
        if known and errors is None and name not in known:
            raise ValueError(
                f"errors are known for some outputs but not for {name}: state them with [errors]"
            )
        whiten[:, j] = inverse_roots(
            amplitudes[:, [j]], errors, known[name][:, None] if name in known else None
        )[:, 0]
    return whiten
