"""The direct problem: amplitudes and natural modes of a model with given parameters, exact or as if read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray, significant
from rotorid.base.text import ROUNDING, listing
from rotorid.identify.amplitudes import AmplitudeErrors, Experiments, experiments
from rotorid.identify.operator_model import HarmonicModel, eigenvalues, natural_modes, reference_amplitude

DUST, CHANGE = 1e-13, 1e-4
"""Where so small a relative change of parameters and frequency changes amplitudes so much, there are none."""


def forced_vibration(
    model: HarmonicModel, theta: FloatArray, frequencies: Sequence[float], given: Mapping[str, complex]
) -> Experiments:
    """Exact amplitudes of a model with parameters (n,) at frequencies, rad/s.

    `given` are the varying quantities and amplitudes of the inputs (0 if absent), alike at all frequencies.

    Raises
    ------
    ValueError
        Where nothing excites the model, and at a resonance without damping.
    """
    model.check_square()
    inputs = np.array([[given.get(name, 0) for name in model.inputs]], dtype=np.complex128)
    varying = {name: np.array([given[name].real]) for name in model.varying}
    if not inputs.any() and not model.has_constant_terms:
        raise ValueError(
            f"nothing excites the model: give the amplitude of {listing(model.inputs) or 'an input'}"
        )
    other, amplitudes = theta * (1 + DUST * np.random.default_rng(0).choice((-1, 1), len(theta))), []
    for w in np.array(frequencies, dtype=float):
        try:
            with np.errstate(all="ignore"):
                Z = model.forced(theta, np.array([w]), inputs, varying=varying)[0][0]
                off = model.forced(other, np.array([w * (1 + DUST)]), inputs, varying=varying)[0][0] - Z
        except np.linalg.LinAlgError:
            off = Z = np.full(len(model.outputs), np.nan)
        if not np.abs(off).max() <= CHANGE * np.abs(Z).max():
            why = "a resonance without damping" if w else "nothing holds it at rest"
            raise ValueError(f"at {w:.6g} rad/s the model has no amplitude: {why}")
        for part in (Z.real, Z.imag):
            part[np.abs(part) < ROUNDING * np.abs(Z)] = 0.0
        amplitudes.append(Z)
    signals = dict(zip((*model.inputs, *model.outputs), (*inputs[0], *np.transpose(amplitudes)), strict=True))
    rows = {name: np.repeat(values, len(amplitudes)) for name, values in varying.items()}
    return experiments(model, frequencies, {**signals, **rows}, free=False)


def free_vibration(
    model: HarmonicModel, theta: FloatArray, given: Mapping[str, complex], digits: int | None = None
) -> tuple[Experiments, FloatArray]:
    """All natural frequencies and shapes, whose first amplitude that is no node is 1; without damping.

    With `digits` z = ω² is rounded to so many significant ones first, as [S] lessons 7 and 8 do, and the
    shapes follow from all equations but the first. Beside: coefficients of the frequency polynomial in z,
    the highest first, which is 1.

    Raises
    ------
    ValueError
        For a model that a term without an amplitude excites, or that has no natural frequency.
    """
    model.check_square()
    varying = {name: np.array([given[name].real]) for name in model.varying}
    A = model.dynamic_stiffness(theta, varying)[0]
    z, shapes = natural_modes(A)
    if model.has_constant_terms or not len(z):
        raise ValueError("the model has no natural frequency, or an excitation of its own")
    if digits is not None:
        z = significant(z, digits)
        at = [np.tensordot(one ** np.arange(len(A)), A, axes=1) for one in z]
        shapes = np.transpose([[1.0, *np.linalg.solve(S[1:, 1:], -S[1:, 0])] for S in at])
    signals = dict(zip(model.outputs, shapes / [v[reference_amplitude(v)] for v in shapes.T], strict=True))
    signals |= {name: np.repeat(values, len(z)) for name, values in varying.items()}
    every = eigenvalues(A)[0]
    return experiments(model, np.sqrt(z), signals, free=True), np.real(
        np.poly(every[np.isfinite(every)])
    ).astype(float)


def as_read(
    exact: Experiments,
    outputs: Sequence[str],
    errors: AmplitudeErrors | None = None,
    digits: int | None = None,
    seed: int = 0,
) -> Experiments:
    """Outputs as instruments show them: with errors drawn, then each part rounded to significant digits.

    So are natural frequencies; inputs and frequencies of excitation stay exact.
    """
    rng, signals, w = np.random.default_rng(seed), dict(exact.signals), exact.frequencies
    for name in outputs:
        z = signals[name] if errors is None else errors.drawn(signals[name], rng)
        if digits is not None:
            z = significant(z.real, digits) + 1j * significant(z.imag, digits)
        signals[name] = z
    if digits is not None:
        w = np.where(exact.free, significant(w, digits), w)
    return replace(exact, signals=signals, frequencies=w, errors=errors)
