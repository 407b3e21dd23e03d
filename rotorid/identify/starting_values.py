"""Starting values of output error where amplitudes are hidden: equations hold best with them, by projection.

Of each experiment's equations only what no hidden amplitude can change is looked at (variable projection,
Golub and Pereyra 1973). That has few local minima: the search begins at random sizes of the parameters, which
keep their signs, and ends where several starts have come to the same end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.combinations import CONSTANT
from rotorid.identify.linear_start import passive_elements
from rotorid.identify.operator_model import HarmonicModel
from rotorid.regression.nonlinear import search_from

SEARCHES, AGAIN, BEST = 60, 6, 3
"""Random starts at most; enough of them with one end; how many ends are handed on."""
DECADES = 1.5
"""How far from their typical size parameters begin."""


def starting_values(
    model: HarmonicModel, experiments: Experiments, start: Mapping[str, float]
) -> list[FloatArray]:
    """At most `BEST` starting values (n,), the best first; those given by name are kept.

    Raises
    ------
    ValueError
        Where no experiment has all amplitudes that others have, or nothing is found.
    """
    names = model.parameters
    theta = np.array([start.get(name, np.nan) for name in names])
    open_ = np.flatnonzero(np.isnan(theta))
    if not len(open_):
        return [theta]
    projected, scale = _projected(model, experiments)
    passive = passive_elements(model)
    either = np.array([names[j] not in passive for j in open_])
    rng = np.random.default_rng(0)
    ends: list[tuple[float, FloatArray]] = []
    for _ in range(SEARCHES):
        size = scale[open_] * np.where(either, rng.choice((-1.0, 1.0), len(open_)), 1.0)

        def whole(x: FloatArray, size: FloatArray = size) -> FloatArray:
            full = theta.copy()
            full[open_] = size * 10.0**x
            return full

        begin = rng.uniform(-DECADES, DECADES, len(open_))
        end = search_from(lambda x, whole=whole: projected(whole(x)), begin, limit=60)  # type: ignore[misc]
        if end is not None and end[1].max() < 4 * DECADES:
            ends = sorted([*ends, (end[0], whole(end[1]))], key=lambda one: one[0])
        if ends and sum(cost < 1.01 * ends[0][0] + 1e-14 for cost, _ in ends) >= AGAIN:
            break
    if not ends:
        missing = ", ".join(names[j] for j in open_)
        raise ValueError(f"no start was found: give starting values of {missing}")
    apart: list[FloatArray] = []
    for _, point in ends:
        if len(apart) < BEST and not any(np.allclose(point, other, rtol=1e-3) for other in apart):
            apart.append(point)
    return apart


def _projected(
    model: HarmonicModel, experiments: Experiments
) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """What the equations leave beside hidden amplitudes, over their known terms; sizes of parameters (n,)."""
    names = (*model.outputs, *model.inputs, CONSTANT)
    table = np.column_stack((experiments.table(names[:-1]), np.ones(len(experiments))))
    seen = np.asarray(~np.isnan(table).all(axis=0))
    complete = ~np.isnan(table[:, seen]).any(axis=1)
    if not complete.any():
        raise ValueError(
            f"no experiment has every amplitude: give starting values of {', '.join(model.parameters)}"
        )
    data, table = experiments.take(complete), table[complete]
    typical = float(np.median(np.abs(table[:, : len(model.outputs)][:, seen[: len(model.outputs)]])))
    force = np.abs(model.multipliers(data.frequencies, data.varying))
    force = force * np.where(seen, np.abs(table), typical)[:, model.column]
    size = (force * np.abs(model.coefficients[:, 0])).max(axis=1)
    size[size == 0] = 1.0

    def projected(theta: FloatArray) -> FloatArray:
        A = model.matrices(theta, data.frequencies, data.varying)
        A = np.where(data.free[:, None, None], A.real, A)  # no odd powers of p
        v = np.einsum("nes,ns->ne", A[:, :, seen], table[:, seen])
        Q = np.linalg.qr(A[:, :, ~seen])[0]
        r = (v - np.einsum("neh,nfh,nf->ne", Q, Q.conj(), v)) / size[:, None]
        return np.concatenate((r.real.ravel(), r.imag.ravel()))

    alone = np.abs(model.exponents).sum(axis=1, keepdims=True) == 1
    slopes = np.abs(model.coefficients) @ (alone & (model.exponents == 1))
    sizes, middle = np.median(force, axis=0)[:, None] * slopes, np.median(size)
    return projected, np.array([middle / np.median(x[x > 0]) if x.any() else 1.0 for x in sizes.T])
