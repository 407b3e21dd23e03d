"""The direct problem: amplitudes and natural modes of a model with given parameters, exact or as if read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray, significant
from rotorid.base.text import ROUNDING, listing
from rotorid.identify.amplitudes import AmplitudeErrors, Experiments, experiments
from rotorid.identify.operator_model import HarmonicModel, natural_modes, reference_amplitude

SINGULAR = 1e9
"""Terms that cancel to a determinant so many times smaller leave no amplitude that is sure to six digits."""


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
    w, e = np.asarray(frequencies, dtype=np.float64), len(model.outputs)
    inputs = np.array([[given.get(name, 0) for name in model.inputs]] * len(w), dtype=np.complex128)
    varying = {name: np.full(len(w), given[name].real) for name in model.varying}
    if not inputs.any() and not model.has_constant_terms:
        raise ValueError(
            f"nothing excites the model: give the amplitude of {listing(model.inputs) or 'an input'}"
        )
    with np.errstate(all="ignore"):
        A = model.matrices(theta, w, varying)[:, :, :e]
        sizes = model.sizes(theta, w, varying)[:, :, :e]
    # a bound, in any units, of the relative change of the determinant with that of its terms
    for one, matrix, size in zip(w, A, sizes, strict=True):
        sure = np.isfinite(size).all() and np.linalg.matrix_rank(matrix, 0.0) == e
        if not sure or (np.abs(np.linalg.inv(matrix)).T * size).sum() >= SINGULAR:
            why = "a resonance without damping" if one else "nothing holds it at rest"
            raise ValueError(f"at {one:.6g} rad/s the model has no amplitude: {why}")
    Z = model.forced(theta, w, inputs, False, varying)[0]
    for part in (Z.real, Z.imag):
        part[np.abs(part) < ROUNDING * np.abs(Z)] = 0.0
    signals = dict(zip((*model.inputs, *model.outputs), np.hstack((inputs, Z)).T, strict=True))
    return experiments(model, w, {**signals, **varying}, free=False)


def free_vibration(model: HarmonicModel, theta: FloatArray, given: Mapping[str, complex]) -> Experiments:
    """All natural frequencies and shapes, whose first amplitude that is no node is 1; without damping.

    Raises
    ------
    ValueError
        For a model that a term without an amplitude excites, or that has no natural frequency.
    """
    model.check_square()
    varying = {name: np.array([given[name].real]) for name in model.varying}
    z, shapes = natural_modes(model.dynamic_stiffness(theta, varying)[0])
    if model.has_constant_terms or not len(z):
        raise ValueError("the model has no natural frequency, or an excitation of its own")
    signals = dict(zip(model.outputs, shapes / [v[reference_amplitude(v)] for v in shapes.T], strict=True))
    signals |= {name: np.repeat(values, len(z)) for name, values in varying.items()}
    return experiments(model, np.sqrt(z), signals, free=True)


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
