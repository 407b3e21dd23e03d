"""Where output error begins: values with which the equations hold best, amplitudes that are hidden apart."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.parameter_combinations import CONSTANT
from rotorid.harmonic.plausibility import passive_elements
from rotorid.harmonic.unmeasured_amplitudes import hidden_outputs
from rotorid.regression.search import search_from

SEARCHES, AGAIN, BEST = 60, 4, 3
"""Random starts at most; enough of them with one end; how many ends are handed on."""
DECADES = 1.5
"""How far from their typical size parameters begin."""


def starting_values(
    model: HarmonicModel, experiments: Experiments, start: Mapping[str, float] | ArrayLike
) -> list[FloatArray]:
    """Starting values; those not given make the equations hold best for some hidden amplitudes.

    Of each experiment's equations only what no hidden amplitude can change is looked at (variable projection,
    Golub and Pereyra 1973). That has few local minima: the search begins at random sizes of the parameters,
    which keep their signs, and ends where several starts have come to the same end.

    Parameters
    ----------
    model, experiments
        Equations and data.
    start
        By name, or (n,) in the model's order; NaN where there is none.

    Returns
    -------
    At most `BEST` of shape (n,), the best first.

    Raises
    ------
    ValueError
        For unknown names, a wrong number of values, or where nothing is found.
    """
    names, theta = model.parameters, _given(model.parameters, start)
    open_ = np.flatnonzero(np.isnan(theta))
    if not len(open_):
        return [theta]
    projected, scale = _projected(model, experiments)
    passive = passive_elements(model)
    either = np.array([names[j] not in passive for j in open_])
    rng = np.random.default_rng(0)
    ends: list[tuple[float, FloatArray]] = []

    def whole(size: FloatArray, x: FloatArray) -> FloatArray:
        full = theta.copy()
        full[open_] = size * 10.0**x
        return full

    def residual(size: FloatArray, x: FloatArray) -> FloatArray:
        return projected(whole(size, x))

    for _ in range(SEARCHES):
        size = scale[open_] * np.where(either, rng.choice((-1.0, 1.0), len(open_)), 1.0)
        begin = rng.uniform(-DECADES, DECADES, len(open_))
        end = search_from(partial(residual, size), begin, limit=60)
        if end is not None and end[1].max() < 4 * DECADES:
            ends = sorted([*ends, (end[0], whole(size, end[1]))], key=lambda one: one[0])
        if ends and sum(cost < 1.01 * ends[0][0] + 1e-14 for cost, _ in ends) >= AGAIN:
            break
    if not ends:
        missing = ", ".join(names[j] for j in open_)
        raise ValueError(f"no start was found: give starting values of {missing}")
    apart: list[FloatArray] = []
    for _, point in ends:
        if not any(np.allclose(point, other, rtol=1e-3) for other in apart):
            apart.append(point)
    return apart[:BEST]


def _given(names: tuple[str, ...], start: Mapping[str, float] | ArrayLike) -> FloatArray:
    """The starting values (n,), NaN where there is none."""
    if isinstance(start, Mapping):
        wrong = [name for name in start if name not in names]
        if wrong:
            raise ValueError(f"a start is given for {wrong[0]!r}, which is not estimated: {', '.join(names)}")
        theta = np.array([start.get(name, np.nan) for name in names], dtype=np.float64)
    else:
        theta = np.array(start, dtype=np.float64)
    if theta.shape != (len(names),):
        raise ValueError(f"{len(names)} starting values are needed, for {', '.join(names)}; got {start!r}")
    return theta


def _projected(
    model: HarmonicModel, experiments: Experiments
) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """What the equations leave beside hidden amplitudes, over their known terms; sizes of parameters (n,).

    ValueError where no experiment has all other amplitudes.
    """
    hidden, names = hidden_outputs(model, experiments), (*model.outputs, *model.inputs)
    lost = [j for j, name in enumerate(names) if name in hidden]
    columns = [j for j in range(1 + len(names)) if j not in lost]
    table = np.column_stack((experiments.table(names), np.ones(len(experiments))))[:, columns]
    complete = ~np.isnan(table).any(axis=1)
    if not complete.any():
        raise ValueError(
            f"no experiment has every amplitude: give starting values of {', '.join(model.parameters)}"
        )
    data, table = experiments.take(complete), table[complete]
    sizes = {(*names, CONSTANT)[j]: np.abs(values) for j, values in zip(columns, table.T, strict=True)}
    typical = np.median([size for name, size in sizes.items() if name in model.outputs])
    factors = np.abs(model.multipliers(data.frequencies, data.varying))
    known, own = np.zeros(len(table)), dict[str, list[float]]()
    for f, factor in zip(model.features, factors.T, strict=True):
        force = factor * sizes.get(f.signal, typical)
        for monomial, x in f.exact.items():
            if not monomial:
                known = np.maximum(known, abs(float(x)) * force)
            elif len(monomial) == 1:
                own.setdefault(monomial[0][0], []).append(abs(float(x)) * float(np.median(force)))
    known[known == 0] = 1.0

    def projected(theta: FloatArray) -> FloatArray:
        A = model.matrices(theta, data.frequencies, data.varying)
        A = np.where(data.free[:, None, None], A.real, A)  # no odd powers of p
        v = np.einsum("nes,ns->ne", A[:, :, columns], table)
        Q = np.linalg.qr(A[:, :, lost])[0]
        r = (v - np.einsum("neh,nfh,nf->ne", Q, Q.conj(), v)) / known[:, None]
        return np.concatenate((r.real.ravel(), r.imag.ravel()))

    force = float(np.median(known))
    scale = [force / np.median(own[n]) if np.any(own.get(n)) else 1.0 for n in model.parameters]
    return projected, np.array(scale)
