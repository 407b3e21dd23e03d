"""Measured against predicted amplitudes: residuals over their errors, and their Jacobian.

Residuals are the stretched differences of amplitudes, along and across each amplitude, over their errors:
stated, or relative to the amplitude. Of a free vibration the predicted mode most like the measured shape is
compared: its frequency, and its amplitudes relative to the first measured one. The frequency counts with its
error, or else with that of this amplitude.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.operator_model import (
    HarmonicModel,
    mode_slopes,
    natural_modes,
    nearest_mode,
    reference_amplitude,
)

THIN = 0.01
"""An error ellipse is at least this share as thin as long: no direction of a reading is exact."""
SMALL = 1e-3
"""An amplitude counts as at least this share of its signal's median when errors are relative to it."""
TRUSTED = 3.0
"""A predicted amplitude farther than this factor from the measured one does not set the weight."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Residuals of one set of experiments against one model.

    Attributes
    ----------
    model, experiments
        Model and data.
    measured
        Outputs (n, e), NaN where not measured.
    inputs
        (n, inputs).
    forced, free
        Indices of the forced experiments that can be predicted, and of the free vibrations.
    whiten
        Inverse root of each reading's covariance, (n, e, 2, 2).
    experiment
        Index of the experiment of each residual.
    left_out, warnings
        In words.
    """

    model: HarmonicModel
    experiments: Experiments
    measured: ComplexArray
    inputs: ComplexArray
    forced: IntArray
    free: IntArray
    whiten: FloatArray
    experiment: IntArray
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]
    _last: dict[bytes, tuple[FloatArray, FloatArray]] = field(default_factory=dict)

    @property
    def depends_on_prediction(self) -> bool:
        """Whether the errors grow with the amplitude, so that the prediction should set them."""
        return any(name not in self.experiments.covariances for name in self.model.outputs)

    def residual(self, theta: FloatArray) -> FloatArray:
        """(Predicted − measured) over the errors; NaN where the model has no answer (resonance, no mode)."""
        return self._both(theta)[0]

    def jacobian(self, theta: FloatArray) -> FloatArray:
        """Derivatives of the residuals, (rows, parameters)."""
        return self._both(theta)[1]

    def reweighted(self, theta: FloatArray) -> Comparison:
        """The same with errors at the amplitudes predicted by θ, where these are near the measured ones."""
        predicted, _ = self.predict(theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(predicted) / np.abs(self.measured)
        near = (ratio < TRUSTED) & (ratio > 1 / TRUSTED)
        whiten, _ = whitening(self.experiments, self.model.outputs, np.where(near, predicted, self.measured))
        return replace(self, whiten=whiten, _last={})

    def predict(self, theta: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Amplitudes (n, e) and natural frequencies (n,), NaN where there are none."""
        Z, frequencies = (
            np.full(self.measured.shape, np.nan, dtype=complex),
            np.full(len(self.measured), np.nan),
        )
        if len(self.forced):
            Z[self.forced] = self._forced(theta, False)[0]
        for i, _, _, mode in self._modes(theta):
            if mode is not None:
                shape = self.measured[i].real
                reference = reference_amplitude(shape)
                frequencies[i] = np.sqrt(mode[0])
                Z[i] = mode[1] / mode[1][reference] * shape[reference]
        return Z, frequencies

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
        return float(np.sqrt(np.mean(shares))) if shares else float("nan")

    def _both(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = theta.tobytes()
        if key not in self._last:
            self._last.clear()
            n = len(theta)
            try:
                with np.errstate(all="ignore"):
                    parts = [*self._forced_rows(theta), *self._free_rows(theta)]
                self._last[key] = np.concatenate([r for r, _ in parts]), np.concatenate([J for _, J in parts])
            except np.linalg.LinAlgError:
                rows = len(self.experiment)
                self._last[key] = np.full(rows, np.nan), np.full((rows, n), np.nan)
        return self._last[key]

    def _row(self, chosen: IntArray) -> dict[str, FloatArray]:
        return {name: values[chosen] for name, values in self.experiments.varying.items()}

    def _forced(self, theta: FloatArray, slopes: bool) -> tuple[ComplexArray, ComplexArray]:
        w, loads = self.experiments.frequencies[self.forced], self.inputs[self.forced]
        return self.model.forced(theta, w, loads, slopes, self._row(self.forced))

    def _forced_rows(self, theta: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        if len(self.forced):
            Z, dZ = self._forced(theta, True)
            seen = ~np.isnan(self.measured[self.forced])
            root = self.whiten[self.forced][seen]
            gap, slope = (Z - self.measured[self.forced])[seen], dZ[seen]
            r = np.einsum("kij,kj->ki", root, np.stack((gap.real, gap.imag), -1))
            J = root @ np.stack((slope.real, slope.imag), 1)
            yield r.reshape(-1), J.reshape(-1, len(theta))

    def _modes(
        self, theta: FloatArray
    ) -> Iterator[tuple[int, FloatArray, FloatArray, tuple[float, FloatArray] | None]]:
        """Dynamic stiffness, its derivatives and the mode most like each free vibration."""
        for k, i in enumerate(self.free):
            if not k or self.model.varying:
                A, dA = self.model.dynamic_stiffness(theta, self._row(np.array([i])))
                z, v = natural_modes(A)
            w, shape = float(self.experiments.frequencies[i]), self.measured[i].real
            yield int(i), A, dA, nearest_mode(z, v, w, shape)

    def _free_rows(self, theta: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        for i, A, dA, mode in self._modes(theta):
            shape, omega = self.measured[i].real, float(self.experiments.frequencies[i])
            reference = reference_amplitude(shape)
            others = np.flatnonzero(~np.isnan(shape) & (np.arange(len(shape)) != reference))
            if mode is None or mode[1][reference] == 0:
                raise np.linalg.LinAlgError("the model has no such mode")
            v = mode[1] / mode[1][reference]
            dz, dv = mode_slopes(A, dA, mode[0], v, reference)
            root, over = np.sqrt(mode[0]), self.whiten[i, :, 0, 0]
            # without an error of its own the frequency has the relative one of the reference amplitude
            share, white = over[reference] * abs(shape[reference]) / omega, np.diag(over[others])
            if self.experiments.frequency_std is not None:
                share = 1 / self.experiments.frequency_std[i]
                # then the error of the reference is one of all that is given relative to it
                common = shape[others] / (shape[reference] * over[reference])
                whole = np.diag(over[others] ** -2) + np.outer(common, common)
                white = np.linalg.inv(np.linalg.cholesky(whole))
            r = np.concatenate(([(root - omega) * share], white @ (v * shape[reference] - shape)[others]))
            yield r, np.vstack((dz / (2 * root) * share, shape[reference] * white @ dv[others]))


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
    given: BoolArray = np.asarray(~np.isnan(measured))
    factors = model.multipliers(experiments.frequencies, experiments.varying)
    known = ~np.isnan(inputs).any(axis=1) & ~np.isnan(factors).any(axis=1) | experiments.free
    usable = known & given.any(axis=1)
    forced, free = (np.flatnonzero(usable & kind) for kind in (~experiments.free, experiments.free))
    hidden = ~given.any(axis=0)
    left_out = [f"{model.outputs[j]} is measured nowhere" for j in np.flatnonzero(hidden)]
    for i, name in enumerate(experiments.names):
        lost = [o for o, g in zip(model.outputs, given[i] | hidden, strict=True) if not g]
        if not known[i]:
            what = "input or varying quantity" if model.varying else "input"
            left_out.append(f"experiment {name}: left out, for not every {what} is known")
        elif not usable[i]:
            left_out.append(f"experiment {name}: left out, for no amplitude is measured")
        elif lost:
            left_out.append(f"experiment {name}: {', '.join(lost)} not measured")
    if not usable.any():
        raise ValueError("no reading can be compared with a prediction: " + "; ".join(left_out))
    whiten, warnings = whitening(experiments, model.outputs, measured)
    readings = given.sum(axis=1)
    experiment = np.concatenate((np.repeat(forced, 2 * readings[forced]), np.repeat(free, readings[free])))
    return Comparison(
        model, experiments, measured, inputs, forced, free, whiten, experiment, tuple(left_out), warnings
    )


def whitening(
    experiments: Experiments, outputs: tuple[str, ...], amplitudes: ComplexArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """Inverse root of the covariance of each reading, (n, e, 2, 2), rows along and across; and warnings."""
    whiten, warnings = np.zeros((len(experiments), len(outputs), 2, 2)), []
    for j, name in enumerate(outputs):
        z = np.where(np.isnan(amplitudes[:, j]), 1.0, amplitudes[:, j])
        size = np.abs(z)
        floor = SMALL * float(np.median(size)) or 1.0
        z = np.where(size < floor, floor, z)
        u = z / np.abs(z)
        turn = np.stack((np.stack((u.real, u.imag), -1), np.stack((-u.imag, u.real), -1)), -2)
        turned = turn @ _covariance(experiments, name, z) @ np.swapaxes(turn, -1, -2)
        trace = np.trace(turned, axis1=-2, axis2=-1)
        if (trace <= 0).any():
            raise ValueError(
                "an error of zero is stated for a measured amplitude: repeat the reading or state one"
            )
        low, high = np.moveaxis(np.linalg.eigvalsh(turned), -1, 0)
        thin = np.sqrt(np.clip(low, 0, None) / high) < THIN
        if (thin & ~experiments.free).any():
            warnings.append(
                f"the stated errors of {name} make one direction of it exact: it counts with a "
                f"{THIN:.0%} share of the other's error"
            )
        turned = turned + (thin * THIN**2 * trace)[:, None, None] * np.eye(2)
        whiten[:, j] = np.linalg.inv(np.linalg.cholesky(turned)) @ turn
    return whiten, tuple(warnings)


def _covariance(experiments: Experiments, name: str, z: ComplexArray) -> FloatArray:
    if name in experiments.covariances:
        return np.asarray(experiments.covariances[name], dtype=np.float64)
    if experiments.errors is not None:
        return experiments.errors.covariance(z)
    if experiments.covariances:
        raise ValueError(f"errors are known for some outputs but not for {name}: state them with [errors]")
    return np.asarray((np.abs(z) ** 2)[:, None, None] * np.eye(2))
