"""From amplitudes to rows K u = Y: features evaluated, missing amplitudes left out, errors propagated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.parameter_combinations import NAME

COVARIANCE_FLOOR = 1e-10
"""Smallest variance relative to the mean of an experiment: exact rows must not get infinite weight."""
ROUNDING = 1e-13
"""A part of a row that is smaller than this share of its terms is what rounding leaves of zero."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Equations of all experiments, complex, and which of their real rows are used.

    Attributes
    ----------
    K, Y
        (n, equations, u) and (n, equations); zero where left out.
    used
        (n, equations, 2): real and imaginary rows.
    coefficients, constants
        (features, u) and (features,): a feature's coefficient is constants + coefficients @ u.
    powers
        (n, features): (iω)^k.
    left_out, warnings
        In words.
    """

    K: ComplexArray
    Y: ComplexArray
    used: BoolArray
    coefficients: FloatArray
    constants: FloatArray
    powers: ComplexArray
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]

    def real_rows(self) -> tuple[FloatArray, FloatArray, IntArray]:
        """Used real rows K (m, u), Y (m,) and the experiment of each (m,)."""
        K = np.stack((self.K.real, self.K.imag), axis=2)
        Y = np.stack((self.Y.real, self.Y.imag), axis=2)
        experiment = np.broadcast_to(np.arange(len(Y))[:, None, None], self.used.shape)
        return K[self.used], Y[self.used], experiment[self.used]

    def residuals(self, u: FloatArray) -> ComplexArray:
        """Y − K u, (n, equations), NaN where left out."""
        r = self.Y - self.K @ u
        real = np.where(self.used[:, :, 0] | self.used[:, :, 1], r.real, np.nan)
        return np.asarray(real + 1j * np.where(np.isnan(real), np.nan, r.imag))


def build_rows(model: HarmonicModel, experiments: Experiments) -> Rows:
    """Evaluate the model's equations at the measured amplitudes.

    Raises
    ------
    ValueError
        If a signal of the model was measured nowhere or no complete row remains.
    """
    check_signals(model, experiments)
    combos, features = model.combinations, model.features
    n, equations = len(experiments), len(model.equations)
    equation, column, k = model.equation, model.column, model.power
    powers = model.multipliers(experiments.frequencies, experiments.varying)
    warnings: list[str] = []
    if experiments.free.any() and (k % 2).any():
        powers[np.ix_(experiments.free, k % 2 == 1)] = 0
        warnings.append(
            "in free vibration p**2 = -omega**2: terms with odd powers of p (damping) are left out there"
        )
    constants, lifted = model.coefficients[:, 0], model.coefficients[:, 1:]
    C = lifted[:, combos.pivots] / combos.scales
    measured = (*model.outputs, *model.inputs)
    amplitudes = np.column_stack((experiments.table(measured), np.ones(n)))
    table = {**dict(zip(measured, amplitudes.T, strict=False)), **experiments.varying}
    phi = powers * amplitudes[:, column]
    K = np.zeros((n, equations, len(combos.pivots)), dtype=complex)
    Y = np.zeros((n, equations), dtype=complex)
    missing = np.zeros((n, equations), dtype=bool)
    empty = np.zeros((n, equations, 2), dtype=bool)
    left_out: list[str] = []
    for e in range(equations):
        own = equation == e
        lost = np.isnan(phi[:, own])
        missing[:, e] = lost.any(axis=1)
        K[:, e], Y[:, e] = phi[:, own] @ C[own], -phi[:, own] @ constants[own]
        sizes = ROUNDING * np.abs(phi[:, own]) @ np.abs(np.column_stack((C[own], constants[own])))
        for part, row in enumerate((K[:, e].real, K[:, e].imag)):
            right = (Y[:, e].real, Y[:, e].imag)[part]
            empty[:, e, part] = (np.abs(np.column_stack((row, right))) <= sizes).all(axis=1)
        for i in np.flatnonzero(missing[:, e]):
            lost_here = [features[j] for j in np.flatnonzero(own) if np.isnan(phi[i, j])]
            needed = dict.fromkeys(name for f in lost_here for name in (f.signal, *dict(f.varying)) if name)
            names = [name for name in needed if np.isnan(table[name][i])]
            left_out.append(
                f"experiment {experiments.names[i]}, equation {e + 1} ({', '.join(names)} not measured)"
            )
    K[missing], Y[missing] = 0, 0
    used = np.stack((~missing, ~missing & ~experiments.free[:, None]), axis=2)
    # rows of zeros say nothing and are no degrees of freedom (undamped models)
    used &= ~empty
    if not used.any():
        raise ValueError(
            "no equation can be used: in every experiment an amplitude that it needs was not measured or is 0"
        )
    return Rows(K, Y, used, C, constants, powers, tuple(left_out), tuple(warnings))


def check_signals(model: HarmonicModel, experiments: Experiments) -> None:
    """Raise ValueError if the measurements lack a signal of the model or have one that is a known number."""
    for name in model.signals:
        values = experiments.signals.get(name)
        if values is None or np.isnan(np.asarray(values)).all():
            given = ", ".join(experiments.signals) or "none"
            kind = "input" if name in model.inputs else "signal"
            raise ValueError(
                f"the {kind} {name} of the model is not among the measurements (they have {given}); "
                "measure it, make it known or a parameter, or use the method output-error, which predicts it"
            )
    for name in experiments.signals:
        if name in model.known or name in model.parameters:
            what = "known in" if name in model.known else "a parameter of"
            raise ValueError(f"{name} is {what} the model and also measured; remove one of the two")
    for name, values in experiments.signals.items():
        if np.isinf(np.asarray(values)).any():
            raise ValueError(f"the amplitudes {name} must be finite (or NaN: not measured)")


def ask_about_case(model: HarmonicModel, experiments: Experiments) -> None:
    """Raise ValueError for a signal without readings that differs by case only from another name (x2, X2)."""
    words = NAME.findall(" ".join(model.equations))
    for name in model.signals:
        alike = [w for w in words if w != name and w.casefold() == name.casefold()]
        values = np.nan_to_num(experiments.signals.get(name, np.zeros(1)))
        if alike and words.count(name) == 1 and not np.any(values):
            raise ValueError(
                f"is {name} meant to be {alike[0]}? It stands in the equations once and has no readings; "
                f"if it is an amplitude of its own, give it another name"
            )


def row_covariance(model: HarmonicModel, experiments: Experiments, rows: Rows, u: FloatArray) -> FloatArray:
    """Covariance of each experiment's real rows, (n, 2·equations, 2·equations).

    A row's error is Σ A_s δZ_s + Σ Z_s δA_s with the coefficients A_s at u, which have that of the frequency;
    inputs are exact.
    """
    n, equations = rows.Y.shape
    weights = rows.constants + rows.coefficients @ u
    total = np.zeros((n, 2 * equations, 2 * equations))
    slope = np.zeros((n, equations), dtype=complex)
    for s, name in enumerate(model.outputs):
        covariance = experiments.covariance(name)
        own = model.column == s
        a = np.zeros((n, equations), dtype=complex)
        terms = rows.powers[:, own] * weights[own]
        np.add.at(a.T, model.equation[own], terms.T)
        moved = model.power[own] * terms * np.nan_to_num(experiments.table([name]))  # by ω/dω
        np.add.at(slope.T, model.equation[own], moved.T)
        block = np.empty((n, equations, 2, 2))
        block[..., 0, 0] = block[..., 1, 1] = a.real
        block[..., 0, 1], block[..., 1, 0] = -a.imag, a.imag
        tall = block.reshape(n, 2 * equations, 2)
        total += tall @ covariance @ np.swapaxes(tall, 1, 2)
    if experiments.frequency_std is not None:
        relative = experiments.frequency_std / experiments.frequencies
        own = np.stack((slope.real, slope.imag), axis=2).reshape(n, -1) * relative[:, None]
        total += own[:, :, None] * own[:, None, :]
    return total


def whiten(rows: Rows, covariance: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Real rows with unit variance, and the experiment of each."""
    parts, right, experiment = [], [], []
    K = np.stack((rows.K.real, rows.K.imag), axis=2).reshape(len(rows.K), -1, rows.K.shape[2])
    Y = np.stack((rows.Y.real, rows.Y.imag), axis=2).reshape(len(rows.Y), -1)
    used = rows.used.reshape(len(rows.Y), -1)
    for i, mask in enumerate(used):
        if not mask.any():
            continue
        own = covariance[i][np.ix_(mask, mask)]
        typical = float(np.mean(np.diag(own)))
        if typical == 0:
            raise ValueError(
                "an experiment's amplitudes have no stated error; state one (or a floor) for all outputs"
            )
        lower = np.linalg.cholesky(own + COVARIANCE_FLOOR * typical * np.eye(len(own)))
        white = np.linalg.solve(lower, np.column_stack((K[i][mask], Y[i][mask])))
        parts.append(white[:, :-1])
        right.append(white[:, -1])
        experiment.append(np.full(len(own), i))
    return np.concatenate(parts), np.concatenate(right), np.concatenate(experiment)
