"""Equation error, K θ = Y of [S] (9): linear regression of the equations with the measured amplitudes.

Measured amplitudes stand in K, so that their errors bias the estimate: it is where output error starts, and
the answer only where a model cannot predict. All rows count alike, as in the lessons, and what they leave
tells their errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray, IntArray
from rotorid.base.text import listing
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.combinations import Polynomial, only_determined, ratio_words, sum_words
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.recovery import Recovery, System, recover
from rotorid.regression import least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.undetermined_combinations import echelon

RCOND = 1e-11
"""Columns are merged exactly beforehand; what is left below this comes from too few different experiments."""
ROUNDING = 1e-13
"""A part of a row that is smaller than this share of its terms is what rounding leaves of zero."""


@dataclass(frozen=True, eq=False)
class LinearFit:
    """What linear regression gives.

    Attributes
    ----------
    estimate, K, Y
        The regression: its unknowns, rows (m, u) and (m,).
    used, left_out
        Which real rows of the experiments these are, (n, 2·equations); the others in words.
    fixed
        1 for each of all unknowns that others are given relative to, else 0.
    system, words, recovery
        The combinations (q,) that the data determine as functions of the parameters, in words, and the
        parameters from them; what stands alone in the equations is known without a real solution, too.
    reasons
        Why parameters have no one value, in words.
    """

    estimate: Estimate
    K: FloatArray
    Y: FloatArray
    used: BoolArray
    left_out: tuple[str, ...]
    fixed: FloatArray
    system: System
    words: tuple[str, ...]
    recovery: Recovery
    reasons: tuple[str, ...]


def linear_fit(model: HarmonicModel, experiments: Experiments) -> LinearFit:
    """Regression of the equations, and the parameters that follow.

    Raises
    ------
    ValueError
        If a signal of the model was measured nowhere or no complete row remains.
    """
    K, Y, used, left_out = build_rows(model, experiments)
    combos = model.combinations
    groups, fixed = _relative(model, K, Y, np.nonzero(used)[1] // 2)
    kept, right = np.flatnonzero(fixed == 0), Y - K @ fixed
    names = [combos.words[i] for i in kept]
    alike = len({*names}) < len(names)  # in six digits
    estimate = least_squares(K[:, kept], right, names=None if alike else names, rcond=RCOND)
    picks = np.eye(len(kept)) if estimate.full_rank else np.array(echelon(estimate.row_space))
    picks = picks.reshape(-1, len(kept))[: 0 if groups and not fixed.any() else None]
    whole, below = np.zeros((2, len(picks), len(fixed)))
    whole[:, kept] = picks
    for group in groups:
        below[np.ix_(whole[:, group].any(axis=1), group)] = fixed[group]
    spread, to_monomials = estimate.solution_covariance, np.pad(combos.rows, ((0, 0), (1, 0)))
    under = below @ to_monomials
    under[~below.any(axis=1), 0] = 1.0
    system = System(
        names=model.parameters,
        exponents=model.exponents,
        matrix=whole @ to_monomials,
        values=picks @ estimate.solution,
        covariance=None if spread is None else picks @ spread @ picks.T,
        below=under,
    )
    words = []
    for pick, top, bottom in zip(whole, system.matrix, under, strict=True):
        plain, alone = bottom[0] == 1.0, np.flatnonzero(pick)
        if plain and len(alone) == 1:
            words.append(combos.words[alone[0]])
        else:
            above, beneath = (_polynomial(model, row) for row in (top, bottom))
            words.append(sum_words(above) if plain else ratio_words(above, beneath))
    recovery = recover(system)
    for i, name in enumerate(words if not recovery.solutions else ()):
        if name in model.parameters:
            j = model.parameters.index(name)
            recovery.values[j], recovery.gain[j] = system.values[i], np.eye(len(words))[i]
    reasons = []
    if recovery.undetermined.any():
        lost = np.array(model.parameters)[recovery.undetermined].tolist()
        reasons.append(only_determined(model.parameters, lost, words))
    for group in groups:
        loose = [combos.words[i] for i in group]
        if {*loose} <= {*model.parameters}:
            reasons.append(
                f"every multiple of {listing(loose, 'and')} fits, for no known term that is not zero stands "
                "in their equations: no experiment of this kind tells more than ratios; make one of them "
                "known"
            )
    if not estimate.full_rank:
        reasons.append(
            f"these experiments determine {estimate.rank} of the {len(kept)} combinations that the model "
            "could show"
        )
    reasons += recovery.reasons
    parts = K[:, kept], right, used, left_out, fixed, system, tuple(words), recovery, tuple(reasons)
    return LinearFit(estimate, *parts)


def build_rows(
    model: HarmonicModel, experiments: Experiments
) -> tuple[FloatArray, FloatArray, BoolArray, tuple[str, ...]]:
    """Real rows K (m, u), Y (m,) at the measured amplitudes; which these are; what was left out, in words.

    They are the marked ones of each experiment's (n, 2·equations), real and imaginary parts in turn. Raises
    as `linear_fit`.
    """
    names, n, equations = (*model.outputs, *model.inputs), len(experiments), len(model.equations)
    measured = experiments.table(names)
    for name, values in zip(names, measured.T, strict=True):
        if np.isnan(values).all():
            raise ValueError(
                f"the {'input' if name in model.inputs else 'signal'} {name} of the model is not among the "
                f"measurements (they have {', '.join(experiments.signals) or 'none'}); measure it, or make "
                "it known or a parameter"
            )
    factors = model.multipliers(experiments.frequencies, experiments.varying)
    factors[np.ix_(experiments.free, model.power % 2 == 1)] = 0  # in free vibration p² = −ω²
    phi = factors * np.column_stack((measured, np.ones(n)))[:, model.column]
    of_equation = np.eye(equations)[model.equation]
    lost = np.isnan(phi) @ of_equation > 0
    phi[np.isnan(phi)] = 0
    # (n, equations, u + 1): K and Y side by side, and the sizes of what they are sums of
    both = np.column_stack((model.of_unknowns, -model.coefficients[:, 0]))
    whole = np.einsum("nf,fe,fu->neu", phi, of_equation, both)
    size = ROUNDING * np.einsum("nf,fe,fu->neu", np.abs(phi), of_equation, np.abs(both)).sum(axis=2)
    parts = np.stack((whole.real, whole.imag), axis=2)
    # rows of zeros say nothing and are no degrees of freedom (undamped models)
    used = ~lost[:, :, None] & (np.abs(parts) > size[:, :, None, None]).any(axis=3)
    used[experiments.free, :, 1] = False
    if not used.any():
        raise ValueError(
            "no equation can be used: in every experiment an amplitude that it needs was not measured or is 0"
        )
    table, left_out = dict(zip(names, measured.T, strict=True)) | dict(experiments.varying), []
    for i, e in np.argwhere(lost):
        parts_of = (f for f in model.features if f.equation == e)
        needed = dict.fromkeys(name for f in parts_of for name in (f.signal, *dict(f.varying)) if name)
        missing = ", ".join(name for name in needed if np.isnan(table[name][i]))
        left_out.append(f"experiment {experiments.names[i]}, equation {e + 1} ({missing} not measured)")
    return parts[used][:, :-1], parts[used][:, -1], used.reshape(n, -1), tuple(left_out)


def _relative(
    model: HarmonicModel, K: FloatArray, Y: FloatArray, equation: IntArray
) -> tuple[tuple[IntArray, ...], FloatArray]:
    """Groups of unknowns that may all be multiplied by one factor, for the right sides of their rows are 0.

    Regression would find zero for them, a wrong answer. Equations are linked by the unknowns that they share.
    Beside: 1 for the first unknown of each group that is surely not zero, to which others are relative.
    """
    from scipy.sparse.csgraph import connected_components

    holds = np.zeros((len(model.equations), K.shape[1]), dtype=bool)
    np.logical_or.at(holds, model.equation, model.of_unknowns != 0)
    known = np.bincount(equation, Y != 0, len(holds)) > 0
    groups, fixed = [], np.zeros(K.shape[1])
    count, part = connected_components(holds @ holds.T)
    for k in range(count):
        group = np.flatnonzero(holds[part == k].any(axis=0))
        if known[part == k].any() or not len(group):
            continue
        scale = np.linalg.norm(K[:, group], axis=0)
        share = np.abs(np.linalg.svd(K[:, group] / np.where(scale == 0, 1.0, scale))[2][-1])
        fixed[group[np.argmax(share > 0.1 * share.max())]] = 1.0
        groups.append(group)
    # where each unknown is alone with its factor, nothing is given relative to another
    return tuple(groups), np.zeros_like(fixed) if fixed.all() else fixed


def _polynomial(model: HarmonicModel, row: FloatArray) -> Polynomial:
    return {model.monomials[j - 1]: Fraction(float(f"{row[j]:.6g}")) for j in np.flatnonzero(row)}
