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
    model
        The equations.
    estimate, K, Y
        The regression: its unknowns, rows (m, u) and (m,).
    used, left_out
        Which real rows of the experiments these are, (n, 2·equations); the others in words.
    fixed
        1 for each of all unknowns that others are given relative to, else 0.
    groups
        Unknowns that may all be multiplied by one factor; of these only ratios are determined.
    system, words, recovery
        The combinations (q,) that the data determine as functions of the parameters, in words, and the
        parameters from them.
    values, gain
        Parameters (n,), NaN where undetermined, and their change per change of the combinations (n, q); what
        stands alone in the equations is known without a real solution, too.
    """

    model: HarmonicModel
    estimate: Estimate
    K: FloatArray
    Y: FloatArray
    used: BoolArray
    left_out: tuple[str, ...]
    fixed: FloatArray
    groups: tuple[IntArray, ...]
    system: System
    words: tuple[str, ...]
    recovery: Recovery
    values: FloatArray
    gain: FloatArray


def linear_fit(model: HarmonicModel, experiments: Experiments) -> LinearFit:
    """Regression of the equations, and the parameters that follow.

    Raises
    ------
    ValueError
        If a signal of the model was measured nowhere or no complete row remains.
    """
    K, Y, used, left_out = build_rows(model, experiments)
    groups, fixed = _relative(model, K, Y, np.nonzero(used)[1] // 2)
    kept, known = np.flatnonzero(fixed == 0), K @ fixed
    names = [model.combinations.words[i] for i in kept]
    alike = len({*names}) < len(names)  # in six digits
    estimate = least_squares(K[:, kept], Y - known, names=None if alike else names, rcond=RCOND)
    solution = fixed.copy()
    solution[kept] = estimate.solution
    picks = np.eye(len(kept)) if estimate.full_rank else np.array(echelon(estimate.row_space))
    picks = picks.reshape(-1, len(kept))[: 0 if len(groups) and not fixed.any() else None]
    whole, below = np.zeros((2, len(picks), len(fixed)))
    whole[:, kept] = picks
    for group in groups:
        rows = np.flatnonzero(whole[:, group].any(axis=1))
        below[np.ix_(rows, group)] = fixed[group]
    spread, to_monomials = estimate.solution_covariance, np.pad(model.combinations.rows, ((0, 0), (1, 0)))
    under = below @ to_monomials
    under[~below.any(axis=1), 0] = 1.0
    system = System(
        names=model.parameters,
        exponents=model.exponents,
        matrix=whole @ to_monomials,
        values=whole @ solution,
        covariance=None if spread is None else picks @ spread @ picks.T,
        below=under,
    )
    words = []
    for pick, top, bottom in zip(whole, system.matrix, under, strict=True):
        if bottom[0] == 1.0 and np.count_nonzero(pick) == 1:
            words.append(model.combinations.words[int(np.argmax(pick != 0))])
        elif bottom[0] == 1.0:
            words.append(sum_words(_polynomial(model, top)))
        else:
            words.append(ratio_words(_polynomial(model, top), _polynomial(model, bottom)))
    recovery = recover(system)
    values, change = recovery.values.copy(), recovery.gain.copy()
    for i, name in enumerate(words if not recovery.solutions else ()):
        if name in model.parameters:
            j = model.parameters.index(name)
            values[j], change[j] = system.values[i], np.eye(len(words))[i]
    return LinearFit(
        model,
        estimate,
        K[:, kept],
        Y - known,
        used,
        left_out,
        fixed,
        groups,
        system,
        tuple(words),
        recovery,
        values,
        change,
    )


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


def reasons(fit: LinearFit) -> tuple[str, ...]:
    """Why parameters have no one value, in words."""
    model, recovery, words = fit.model, fit.recovery, []
    if recovery.undetermined.any():
        lost = [name for name, out in zip(model.parameters, recovery.undetermined, strict=True) if out]
        words.append(only_determined(model.parameters, lost, fit.words))
    for group in fit.groups:
        loose = [model.combinations.words[i] for i in group]
        if set(loose) <= set(model.parameters):
            words.append(
                f"every multiple of {listing(loose, 'and')} fits, for no known term that is not zero stands "
                "in their equations: no experiment of this kind tells more than ratios; make one of them "
                "known"
            )
    if not fit.estimate.full_rank:
        words.append(
            f"these experiments determine {fit.estimate.rank} of the {len(fit.estimate.names)} combinations "
            "that the model could show"
        )
    return (*words, *recovery.reasons)
