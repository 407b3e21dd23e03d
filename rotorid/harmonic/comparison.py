"""Measured against predicted amplitudes: residuals over their errors, and their Jacobian."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.natural_frequencies import mode_slopes, natural_modes, nearest_mode
from rotorid.harmonic.operator_model import HarmonicModel

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
    forced
        Indices of the forced experiments that can be predicted; their compared readings are `seen` (f, e).
    free
        Indices of the free vibrations that can be compared.
    whiten
        Inverse root of each reading's covariance, (n, e, 2, 2).
    rows
        (experiment, output, part) of each residual.
    experiment
        Index of its experiment.
    left_out, warnings
        In words.
    """

    model: HarmonicModel
    experiments: Experiments
    measured: ComplexArray
    inputs: ComplexArray
    forced: IntArray
    seen: BoolArray
    free: IntArray
    whiten: FloatArray
    rows: tuple[tuple[str, str, str], ...]
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
        n, e = self.measured.shape
        Z, frequencies = np.full((n, e), np.nan, dtype=complex), np.full(n, np.nan)
        w = self.experiments.frequencies
        if len(self.forced):
            Z[self.forced] = self.model.forced(
                theta, w[self.forced], self.inputs[self.forced], False, self._rows(self.forced)
            )[0]
        for i, (_, _, z, v) in zip(self.free, self._modes(theta), strict=True):
            shape = self.measured[i].real
            mode = nearest_mode(z, v, float(self.experiments.frequencies[i]), shape)
            if mode is not None:
                reference = reference_amplitude(shape)
                frequencies[i] = np.sqrt(mode[0])
                Z[i] = mode[1] / mode[1][reference] * shape[reference]
        return Z, frequencies

    def _both(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = theta.tobytes()
        if key not in self._last:
            self._last.clear()
            try:
                with np.errstate(all="ignore"):
                    parts = [self._forced(theta), *self._free(theta)]
            except np.linalg.LinAlgError:
                parts = [(np.full(len(self.rows), np.nan), np.full((len(self.rows), len(theta)), np.nan))]
            self._last[key] = (np.concatenate([r for r, _ in parts]), np.concatenate([J for _, J in parts]))
        return self._last[key]

    def _forced(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        if not len(self.forced):
            return np.zeros(0), np.zeros((0, len(theta)))
        w = self.experiments.frequencies[self.forced]
        Z, dZ = self.model.forced(theta, w, self.inputs[self.forced], varying=self._rows(self.forced))
        root = self.whiten[self.forced][self.seen]
        gap = (Z - self.measured[self.forced])[self.seen]
        slope = dZ[self.seen]
        r = np.einsum("kij,kj->ki", root, np.stack((gap.real, gap.imag), -1))
        J = root @ np.stack((slope.real, slope.imag), 1)
        return r.reshape(-1), J.reshape(-1, len(theta))

    def _rows(self, chosen: IntArray) -> dict[str, FloatArray]:
        """Known quantities that change from row to row, of some experiments."""
        return {name: values[chosen] for name, values in self.experiments.varying.items()}

    def _modes(self, theta: FloatArray) -> Iterator[tuple[FloatArray, FloatArray, FloatArray, FloatArray]]:
        """Dynamic stiffness, its derivatives and its modes for each free vibration."""
        for k, i in enumerate(self.free):
            if not k or self.model.varying:
                A, dA = self.model.dynamic_stiffness(theta, self._rows(np.array([i])))
                z, v = natural_modes(A)
            yield A, dA, z, v

    def _free(self, theta: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        parts = []
        for i, (A, dA, z, v) in zip(self.free, self._modes(theta), strict=True):
            shape, omega = self.measured[i].real, float(self.experiments.frequencies[i])
            reference = reference_amplitude(shape)
            others = np.flatnonzero(~np.isnan(shape) & (np.arange(len(shape)) != reference))
            mode = nearest_mode(z, v, omega, shape)
            if mode is None or mode[1][reference] == 0:
                raise np.linalg.LinAlgError("the model has no such mode")
            w = mode[1] / mode[1][reference]
            dz, dw = mode_slopes(A, dA, mode[0], w, reference)
            root = np.sqrt(mode[0])
            over = self.whiten[i, :, 0, 0]
            # without an error of its own the frequency has the relative one of the reference amplitude
            share, white = over[reference] * abs(shape[reference]) / omega, np.diag(over[others])
            if self.experiments.frequency_std is not None:
                share = 1 / self.experiments.frequency_std[i]
                # then the error of the reference is one of all that is told relative to it
                common = shape[others] / (shape[reference] * over[reference])
                own = np.diag(over[others] ** -2) + np.outer(common, common)
                white = np.linalg.inv(np.linalg.cholesky(own))
            r = np.concatenate(([(root - omega) * share], white @ (w * shape[reference] - shape)[others]))
            J = np.vstack((dz / (2 * root) * share, shape[reference] * white @ dw[others]))
            parts.append((r, J))
        return parts


def compare(model: HarmonicModel, experiments: Experiments) -> Comparison:
    """Set up a comparison, with errors at the measured amplitudes.

    Raises
    ------
    ValueError
        If equations and outputs differ in number, no reading can be compared, or errors are stated for some
        outputs only.
    """
    model.check_square()
    outputs = model.outputs
    measured, inputs = experiments.table(outputs), experiments.table(model.inputs)
    given: BoolArray = np.asarray(~np.isnan(measured))
    factors = model.multipliers(experiments.frequencies, experiments.varying)
    known = ~np.isnan(inputs).any(axis=1) & ~np.isnan(factors).any(axis=1)
    forced = np.flatnonzero(~experiments.free & known & given.any(axis=1))
    free = np.flatnonzero(experiments.free & (given.sum(axis=1) > 0))
    left_out = _left_out(experiments, model, given, np.asarray(known))
    if not len(forced) and not len(free):
        raise ValueError("no reading can be compared with a prediction: " + "; ".join(left_out))
    whiten, warnings = whitening(experiments, outputs, measured)
    rows = [
        (i, outputs[j], part)
        for i in forced
        for j in np.flatnonzero(given[i])
        for part in ("amplitude", "phase")
    ]
    for i in free:
        reference = reference_amplitude(measured[i].real)
        rows.append((i, outputs[reference], "frequency"))
        rows += [(i, outputs[j], "shape") for j in np.flatnonzero(given[i]) if j != reference]
    return Comparison(
        model=model,
        experiments=experiments,
        measured=measured,
        inputs=inputs,
        forced=forced,
        seen=given[forced],
        free=free,
        whiten=whiten,
        rows=tuple((experiments.names[i], name, part) for i, name, part in rows),
        experiment=np.array([i for i, _, _ in rows], dtype=np.int64),
        left_out=left_out,
        warnings=warnings,
    )


def _left_out(
    experiments: Experiments, model: HarmonicModel, given: BoolArray, known: BoolArray
) -> tuple[str, ...]:
    hidden = np.asarray(~given.any(axis=0))
    words = [f"{o} is measured nowhere" for o, lost in zip(model.outputs, hidden, strict=True) if lost]
    for i, name in enumerate(experiments.names):
        if not known[i] and not experiments.free[i]:
            what = "input or varying quantity" if model.varying else "input"
            words.append(f"experiment {name}: left out, for not every {what} is known")
        elif not given[i].any():
            words.append(f"experiment {name}: left out, for no amplitude is measured")
        elif not given[i].all():
            missing = [o for o, g in zip(model.outputs, given[i] | hidden, strict=True) if not g]
            words += [f"experiment {name}: {', '.join(missing)} not measured"] if missing else []
    return tuple(words)


def reference_amplitude(shape: FloatArray) -> int:
    """The first measured amplitude that is no node of the mode."""
    size = np.nan_to_num(np.abs(shape))
    return int(np.flatnonzero(size >= 0.1 * size.max())[0])


def whitening(
    experiments: Experiments, outputs: tuple[str, ...], amplitudes: ComplexArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """Inverse root of the covariance of each reading, (n, e, 2, 2), rows along and across; and warnings."""
    n = len(experiments)
    whiten = np.zeros((n, len(outputs), 2, 2))
    warnings = []
    for j, name in enumerate(outputs):
        z = np.where(np.isnan(amplitudes[:, j]), 1.0, amplitudes[:, j])
        size = np.abs(z)
        floor = SMALL * float(np.median(size)) or 1.0
        z = np.where(size < floor, floor, z)
        covariance = _covariance(experiments, name, z)
        thin = _spread(covariance, z)
        if (thin[~experiments.free] < THIN).any():
            warnings.append(
                f"the stated errors of {name} make one direction of it exact: it counts with a "
                f"{THIN:.0%} share of the other's error"
            )
        whiten[:, j] = _inverse_root(covariance, z)
    return whiten, tuple(warnings)


def _covariance(experiments: Experiments, name: str, z: ComplexArray) -> FloatArray:
    if name in experiments.covariances:
        return np.asarray(experiments.covariances[name], dtype=np.float64)
    if experiments.errors is not None:
        return experiments.errors.covariance(z)
    if experiments.covariances:
        raise ValueError(f"errors are known for some outputs but not for {name}: state them with [errors]")
    return np.asarray((np.abs(z) ** 2)[:, None, None] * np.eye(2))


def _turned(covariance: FloatArray, z: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Rows along and across each amplitude (n, 2, 2), and the covariance in them."""
    u = z / np.abs(z)
    turn = np.stack((np.stack((u.real, u.imag), -1), np.stack((-u.imag, u.real), -1)), -2)
    return turn, turn @ covariance @ np.swapaxes(turn, -1, -2)


def _spread(covariance: FloatArray, z: ComplexArray) -> FloatArray:
    """Smaller over larger standard deviation of each reading."""
    low, high = np.moveaxis(np.linalg.eigvalsh(covariance), -1, 0)
    return np.asarray(np.sqrt(np.clip(low, 0, None) / np.where(high > 0, high, 1.0)))


def _inverse_root(covariance: FloatArray, z: ComplexArray) -> FloatArray:
    turn, own = _turned(covariance, z)
    trace = np.trace(own, axis1=-2, axis2=-1)
    if (trace <= 0).any():
        raise ValueError(
            "an error of zero is stated for a measured amplitude: repeat the reading or state one"
        )
    own = own + (THIN**2 * trace)[:, None, None] * np.eye(2) * (_spread(covariance, z) < THIN)[:, None, None]
    return np.asarray(np.linalg.inv(np.linalg.cholesky(own)) @ turn)
