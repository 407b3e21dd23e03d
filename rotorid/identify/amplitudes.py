"""Measured amplitudes, what was excited, what was read, and how well; what a model leaves of them.

Residuals are the stretched differences of amplitudes, along and across each amplitude, over their errors:
stated, or relative to the amplitude. Of a free vibration the predicted mode most like the measured shape is
compared: its frequency, and its amplitudes relative to the first measured one. The frequency counts with its
error, or else with that of this amplitude.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.base.text import Shown
from rotorid.identify.operator_model import (
    HarmonicModel,
    mode_slopes,
    natural_modes,
    nearest_mode,
    reference_amplitude,
)
from rotorid.regression.prior import Function

RAD_PER_S = Shown("frequency, rad/s")
THIN = 0.01
"""An error ellipse is at least this share as thin as long: no direction of a reading is exact."""
SMALL = 1e-3
"""An amplitude counts as at least this share of its signal's median when errors are relative to it."""
ROUNDING = 1e-9
"""Share of an amplitude below which its imaginary part is rounding."""
TRUSTED = 3.0
"""A predicted amplitude farther than this factor from the measured one does not set the weight."""
BLOCK = 4096
"""Rows whose equations are solved together."""


@dataclass(frozen=True)
class AmplitudeErrors:
    """Errors of one measured amplitude, one standard deviation each.

    Attributes
    ----------
    relative
        Of the amplitude, as a fraction (0.02 = 2 %).
    phase
        Radians.
    floor
        In the unit of the amplitudes; added in every direction.
    """

    relative: float = 0.0
    phase: float = 0.0
    floor: float = 0.0

    def __post_init__(self) -> None:
        values = (self.relative, self.phase, self.floor)
        if not all(np.isfinite(v) and v >= 0 for v in values) or not any(values):
            raise ValueError(
                f"errors of amplitudes are finite, not negative, and one greater than zero; got {values}"
            )

    def covariance(self, amplitudes: ComplexArray, real: BoolArray | bool = False) -> FloatArray:
        """Covariance of real and imaginary part, shape (…, 2, 2), for amplitudes (…).

        The error along the amplitude is √((relative·|Z|)² + floor²), across it √((phase·|Z|)² + floor²).
        Where `real` (free vibration) there is no imaginary part and its variance is zero.
        """
        turn = real_matrices(np.exp(1j * np.angle(amplitudes)))
        shares = np.multiply.outer(np.abs(amplitudes) ** 2, (self.relative**2, self.phase**2))
        covariance = turn * (shares + self.floor**2)[..., None, :] @ np.swapaxes(turn, -1, -2)
        covariance[np.broadcast_to(real, np.shape(amplitudes))] *= np.diag([1.0, 0.0])
        return np.asarray(covariance)

    def drawn(self, amplitudes: ComplexArray, rng: np.random.Generator) -> ComplexArray:
        """Readings (n,) of amplitudes (n,): normal errors along and across each, of that covariance."""
        size = np.abs(amplitudes)
        along, across = np.hypot(np.outer((self.relative, self.phase), size), self.floor)
        along, across = rng.standard_normal((2, len(size))) * (along, across)
        return np.asarray(amplitudes + np.exp(1j * np.angle(amplitudes)) * (along + 1j * across))


def real_matrices(z: ComplexArray) -> FloatArray:
    """How complex factors (…) act on real and imaginary parts, (…, 2, 2)."""
    return np.stack((np.stack((z.real, -z.imag), -1), np.stack((z.imag, z.real), -1)), -2)


def inverse_roots(
    amplitudes: ComplexArray, errors: AmplitudeErrors | None, covariances: FloatArray | None = None
) -> FloatArray:
    """Inverse roots of covariances of amplitudes (n, C), shape (n, C, 2, 2), rows along and across each.

    The covariances are given or those of errors, which are None where only relative sizes count.

    Raises
    ------
    ValueError
        For an error of zero.
    """
    size = np.abs(amplitudes)
    floor = SMALL * np.array(
        [np.median(one[~np.isnan(one)]) if np.nansum(one) else 1 / SMALL for one in size.T]
    )
    z = np.asarray(np.where(size >= floor, amplitudes, floor), dtype=complex)
    if covariances is None:
        covariances = (errors or AmplitudeErrors(1.0, 1.0)).covariance(z)
    turn = real_matrices(z.conj() / np.abs(z))
    turned = turn @ np.nan_to_num(covariances, nan=1.0) @ np.swapaxes(turn, -1, -2)
    low, high = np.moveaxis(np.linalg.eigvalsh(turned), -1, 0)
    if (high <= 0).any():
        raise ValueError(
            "an error of zero is stated for a measured amplitude: repeat the reading or state one"
        )
    thin = (THIN**2 * high - low).clip(0)  # without a step: digits often differ by a hundredth
    turned = turned + thin[..., None, None] * np.eye(2)
    return np.linalg.inv(np.linalg.cholesky(turned)) @ turn


def trusted(predicted: ComplexArray, measured: ComplexArray) -> ComplexArray:
    """Predicted amplitudes (n, C), where these are near the measured ones, else those: errors are of them."""
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.abs(np.log(np.abs(predicted) / np.abs(measured)))
    return np.where(far < np.log(TRUSTED), predicted, measured)


@dataclass(frozen=True, eq=False)
class Experiments:
    """Harmonic tests and free vibrations: n experiments.

    Attributes
    ----------
    names
        Of the experiments.
    frequencies
        Shape (n,), rad/s: of excitation, or natural.
    signals
        Complex amplitudes (n,) by the name they have in the model, inputs too; NaN where not measured.
    free
        Shape (n,): free vibration (natural frequency and shape: no input, real amplitudes).
    errors
        Stated errors of the measured outputs; None: not stated. Inputs count as exact.
    covariances
        From repeated readings: by signal (n, 2, 2), real and imaginary part; before `errors`.
    varying
        Known quantities (n,) that change from row to row, by name; NaN where unknown.
    frequency_std
        Standard deviations of the frequencies (n,), rad/s; None: exact.
    axis, units
        How people see frequencies, and the amplitudes of signals that are not in the unit of the model.
    rounding
        Covariances, as in `covariances`, that the digits in which readings are written give them; they widen
        intervals where no errors are stated. The key "" is that of natural frequencies, (n,) variances.
    """

    names: tuple[str, ...]
    frequencies: FloatArray
    signals: Mapping[str, ComplexArray]
    free: BoolArray
    errors: AmplitudeErrors | None = None
    covariances: Mapping[str, FloatArray] = field(default_factory=dict)
    varying: Mapping[str, FloatArray] = field(default_factory=dict)
    frequency_std: FloatArray | None = None
    axis: Shown = RAD_PER_S
    units: Mapping[str, Shown] = field(default_factory=dict)
    rounding: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (n := len(self.names)):
            raise ValueError("there are no experiments")
        parts = [
            ((n,), {"frequencies": self.frequencies, **self.signals}),
            ((n, 2, 2), self.covariances),
        ]
        for shape, columns in parts:
            for what, values in columns.items():
                if np.shape(values) != shape or np.isinf(values).any():
                    raise ValueError(f"{what}: {n} finite values are needed (NaN: not measured)")
        if not (np.asarray(self.frequencies) >= 0).all():
            raise ValueError(f"frequencies must be finite and not negative; got {self.frequencies.tolist()}")

    def __len__(self) -> int:
        return len(self.names)

    @property
    def stated(self) -> bool:
        """Whether errors of the amplitudes are stated or known from repeated readings."""
        return self.errors is not None or bool(self.covariances)

    def covariance(self, name: str) -> FloatArray:
        """Covariance of an amplitude's real and imaginary part, (n, 2, 2); zero where nothing is stated."""
        if name in self.covariances:
            return np.asarray(self.covariances[name], dtype=float)
        if self.errors is None:
            return np.zeros((len(self), 2, 2))
        return self.errors.covariance(np.nan_to_num(self.table([name])[:, 0]), self.free)

    def take(self, index: ArrayLike) -> Experiments:
        """Some of the experiments, by index or by a mask (n,)."""
        chosen = np.arange(len(self))[np.asarray(index)]
        parts: dict[str, Any] = {"names": tuple(self.names[i] for i in chosen)}
        for key in ("frequencies", "free", "frequency_std"):
            values = getattr(self, key)
            parts[key] = None if values is None else values[chosen]
        for key in ("signals", "covariances", "varying", "rounding"):
            parts[key] = {name: values[chosen] for name, values in getattr(self, key).items()}
        return replace(self, **parts)

    def table(self, names: Sequence[str]) -> ComplexArray:
        """Amplitudes of some signals, (n, signals), NaN where not measured."""
        whole = np.full((len(self), len(names)), np.nan, dtype=complex)
        for j, name in enumerate(names):
            whole[:, j] = self.signals.get(name, np.nan)
        return whole


def experiments(
    model: HarmonicModel,
    frequencies: ArrayLike,
    signals: Mapping[str, ArrayLike | complex],
    *,
    names: Sequence[str] | None = None,
    free: ArrayLike | bool | None = None,
    errors: AmplitudeErrors | None = None,
    covariances: Mapping[str, FloatArray] | None = None,
) -> Experiments:
    """Gather the amplitudes of a model's signals into `Experiments`.

    Parameters
    ----------
    model
        Says which signals are inputs.
    frequencies
        Shape (n,), rad/s.
    signals
        Amplitudes by name, (n,) or one for all experiments; NaN: not measured. The model's varying
        quantities, too.
    names
        Default 1, 2, ….
    free
        Which experiments are free vibrations. Default: those whose inputs are all 0, NaN or absent and whose
        amplitudes are all real, if the model has no term without a signal. Their inputs become 0.
    errors, covariances
        As in `Experiments`.

    Raises
    ------
    ValueError
        For shapes that do not fit and frequencies that are not finite.
    """
    w = np.atleast_1d(np.asarray(frequencies, dtype=float))
    table = {name: np.array(np.broadcast_to(z, w.shape), dtype=complex) for name, z in signals.items()}
    marks = np.full(w.shape, not model.has_constant_terms if free is None else free)
    for name in set(table) & set(model.signals) if free is None else ():
        z = table[name]
        marks &= np.isnan(z) | ((z == 0) if name in model.inputs else (z.imag == 0))
    for name in model.inputs:
        if name in table or marks.any():
            table[name] = np.where(marks, 0, table.get(name, np.nan))
    rows = {name: np.asarray(table.pop(name).real) for name in model.varying if name in table}
    labels = tuple(names or map(str, range(1, len(w) + 1)))
    return Experiments(labels, w, table, marks, errors, dict(covariances or {}), rows)


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

    def reweighted(self, theta: FloatArray) -> Comparison:
        """The same with errors at the amplitudes predicted by θ, where these are near the measured ones."""
        size = trusted(self.predict(theta)[0], self.measured)
        return replace(self, whiten=whitening(self.experiments, self.model.outputs, size))

    def predict(self, theta: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Amplitudes (n, e) and natural frequencies (n,), NaN where there are none."""
        amplitudes, frequencies = self._answers(theta)
        return amplitudes[..., 0], frequencies[:, 0]

    def _answers(self, theta: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Amplitudes and natural frequencies, behind each its derivatives by θ, (n, e, 1 + n), (n, 1 + n)."""
        data, n, varying = self.experiments, len(self.forced), self.experiments.varying
        amplitudes = np.full((*self.measured.shape, 1 + len(theta)), np.nan, dtype=complex)
        frequencies = np.full(amplitudes[:, 0].shape, np.nan)
        inputs = data.table(self.model.inputs)
        for forced in np.array_split(self.forced, range(BLOCK, n, BLOCK)) if n else ():
            rows = {name: value[forced] for name, value in varying.items()}
            Z, dZ = self.model.forced(theta, data.frequencies[forced], inputs[forced], varying=rows)
            amplitudes[forced] = np.append(Z[..., None], dZ, axis=-1)
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

    def residuals(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(Predicted − measured) over the errors, and derivatives (rows, parameters).

        NaN where the model has no answer (resonance, no mode).
        """
        try:
            with np.errstate(all="ignore"):
                gap, frequency = self._answers(theta)
        except np.linalg.LinAlgError:
            nothing = np.full((np.count_nonzero(self.rows) + len(self.free), 1 + len(theta)), np.nan)
            return nothing[:, 0], nothing[:, 1:]
        gap[..., 0] -= self.measured
        frequency[:, 0] -= self.experiments.frequencies
        both = self.whiten @ np.stack((gap.real, gap.imag), axis=-2)
        del gap
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
    given = ~np.isnan(measured)
    factors = model.multipliers(experiments.frequencies, experiments.varying)
    excited = ~np.isnan(inputs).any(axis=1) & ~np.isnan(factors).any(axis=1) | experiments.free
    usable = excited & given.any(axis=1)
    hidden = ~given.any(axis=0)
    left_out = [f"{model.outputs[j]} is measured nowhere" for j in np.flatnonzero(hidden)]
    what = "input or varying quantity" if model.varying else "input"
    for i, name in enumerate(experiments.names):
        lost = [o for o, g in zip(model.outputs, given[i] | hidden, strict=True) if not g]
        if not excited[i]:
            left_out.append(f"experiment {name}: left out, for not every {what} is known")
        elif lost or not usable[i]:
            left_out.append(f"experiment {name}: {', '.join(lost) or 'everything'} not measured")
    if not usable.any():
        raise ValueError("no reading can be compared with a prediction: " + "; ".join(left_out))
    forced, free = (np.flatnonzero(usable & kind) for kind in (~experiments.free, experiments.free))
    rows = np.repeat((given & excited[:, None])[:, :, None], 2, axis=2)
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
        covariances, errors = experiments.covariances, experiments.errors
        if covariances and errors is None and name not in covariances:
            raise ValueError(
                f"errors are known for some outputs but not for {name}: state them with [errors]"
            )
        whiten[:, j] = inverse_roots(
            amplitudes[:, [j]], errors, covariances[name][:, None] if name in covariances else None
        )[:, 0]
    return whiten


def evaluated_once(both: Callable[[FloatArray], tuple[AnyArray, ...]]) -> tuple[Function, Function]:
    """Residuals and Jacobian, which are evaluated in one call, as two functions that remember the last."""

    @lru_cache(1)
    def at(numbers: bytes) -> tuple[AnyArray, ...]:
        return both(np.frombuffer(numbers))

    return lambda x: at(x.tobytes())[0], lambda x: at(x.tobytes())[1]
