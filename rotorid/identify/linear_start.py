"""Equation error, K θ = Y of [S] (9): linear regression of the equations with the measured amplitudes.

Measured amplitudes stand in K, so that their errors bias the estimate: it is where output error starts, and
the answer only where a model cannot predict. All rows count alike, as in the lessons. With stated errors a
row's error is Σ A_s δZ_s with the coefficients A_s at the estimate, plus that of the frequency; inputs are
exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.base.text import listing
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.combinations import Polynomial, only_determined, ratio_words, sum_words
from rotorid.identify.operator_model import HarmonicModel
from rotorid.identify.recovery import Recovery, System, recover
from rotorid.regression import gain, least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.undetermined_combinations import echelon

RCOND = 1e-11
"""Columns are merged exactly beforehand; what is left below this comes from too few different experiments."""
ROUNDING = 1e-13
"""A part of a row that is smaller than this share of its terms is what rounding leaves of zero."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Equations of all experiments, and which of their real rows are used.

    Attributes
    ----------
    K, Y
        (n, 2·equations, u) and (n, 2·equations), real and imaginary parts in turn; zero where left out.
    used
        (n, 2·equations).
    constants, coefficients
        (features,) and (features, u): a feature's coefficient is constants + coefficients @ u.
    multipliers
        (n, features), p^k with what varies from row to row.
    left_out, warnings
        In words.
    """

    K: FloatArray
    Y: FloatArray
    used: BoolArray
    constants: FloatArray
    coefficients: FloatArray
    multipliers: ComplexArray
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]

    def real_rows(self) -> tuple[FloatArray, FloatArray]:
        """Used rows K (m, u), Y (m,)."""
        return self.K[self.used], self.Y[self.used]


@dataclass(frozen=True, eq=False)
class LinearFit:
    """What linear regression gives.

    Attributes
    ----------
    model, rows
        The equations, and their rows.
    estimate, K, Y
        The regression: its unknowns, rows (m, u) and (m,).
    solution
        Of all unknowns, those that the others are given relative to included (as 1).
    fixed
        (u,): 1 for these, else 0.
    picks
        Combinations of its unknowns that the data determine, (q, u).
    groups
        Unknowns that may all be multiplied by one factor; of these only ratios are determined.
    system, words, recovery
        The combinations (q,) as functions of the parameters, in words, and the parameters from them.
    values, gain
        Parameters (n,), NaN where undetermined, and their change per change of the combinations (n, q); what
        stands alone in the equations is known without a real solution, too.
    """

    model: HarmonicModel
    rows: Rows
    estimate: Estimate
    K: FloatArray
    Y: FloatArray
    solution: FloatArray
    fixed: FloatArray
    picks: FloatArray
    groups: tuple[IntArray, ...]
    system: System
    words: tuple[str, ...]
    recovery: Recovery
    values: FloatArray
    gain: FloatArray


def linear_fit(
    model: HarmonicModel,
    experiments: Experiments,
    rows: Rows | None = None,
) -> LinearFit:
    """Regression of the equations, and the parameters that follow.

    Raises
    ------
    ValueError
        If a signal of the model was measured nowhere or no complete row remains.
    """
    rows = rows or build_rows(model, experiments)
    groups = _groups(model, rows)
    fixed = _as_one(rows, groups)
    kept, every = np.flatnonzero(fixed == 0), np.arange(len(fixed))
    estimate, solution = _regress(model, experiments, rows, fixed)
    K, Y = rows.real_rows()
    picks = np.eye(len(kept)) if estimate.full_rank else np.array(echelon(estimate.row_space))
    picks = picks.reshape(-1, len(kept))[: 0 if len(groups) and not fixed.any() else None]
    whole = np.zeros((len(picks), len(fixed)))
    whole[:, kept] = picks
    below = np.zeros_like(whole)
    for group in groups:
        below[whole[:, group].any(axis=1)] = np.where(np.isin(every, group), fixed, 0.0)
    spread = estimate.solution_covariance
    covariance = None if spread is None else picks @ spread @ picks.T
    to_monomials = model.combinations.rows
    above, under, values = whole @ to_monomials, below @ to_monomials, whole @ solution
    system = System(model.parameters, model.exponents[1:], above, values, covariance, under)
    words = tuple(
        model.combinations.words[int(np.argmax(pick != 0))]
        if not bottom.any() and np.count_nonzero(pick) == 1
        else ratio_words(_polynomial(model, top), _polynomial(model, bottom))
        if bottom.any()
        else sum_words(_polynomial(model, top))
        for pick, top, bottom in zip(whole, above, under, strict=True)
    )
    recovery = recover(system)
    found, change = recovery.values, recovery.gain
    for i, name in enumerate(words if not recovery.solutions else ()):
        if name in model.parameters:
            j = model.parameters.index(name)
            found[j], change[j] = values[i], np.eye(len(words))[i]
    return LinearFit(
        model=model,
        rows=rows,
        estimate=estimate,
        K=K[:, kept],
        Y=Y - K @ fixed,
        solution=solution,
        fixed=fixed,
        picks=picks,
        groups=groups,
        system=system,
        words=words,
        recovery=recovery,
        values=found,
        gain=change,
    )


def build_rows(model: HarmonicModel, experiments: Experiments) -> Rows:
    """Evaluate the model's equations at the measured amplitudes; ValueError as in `linear_fit`."""
    measured = (*model.outputs, *model.inputs)
    for name in measured:
        if np.isnan(experiments.table([name])).all():
            given = ", ".join(experiments.signals) or "none"
            kind = "input" if name in model.inputs else "signal"
            raise ValueError(
                f"the {kind} {name} of the model is not among the measurements (they have {given}); "
                "measure it, or make it known or a parameter"
            )
    combos, n, equations = model.combinations, len(experiments), len(model.equations)
    factors = model.multipliers(experiments.frequencies, experiments.varying)
    odd = model.power % 2 == 1
    warnings: tuple[str, ...] = ()
    if experiments.free.any() and odd.any():
        factors[np.ix_(experiments.free, odd)] = 0
        warnings = (
            "in free vibration p**2 = -omega**2: terms with odd powers of p (damping) are left out there",
        )
    constants, C = model.coefficients[:, 0], model.coefficients[:, 1:][:, combos.pivots] / combos.scales
    amplitudes = np.column_stack((experiments.table(measured), np.ones(n)))
    phi = factors * amplitudes[:, model.column]
    of_equation = np.eye(equations)[model.equation]
    lost = np.isnan(phi) @ of_equation > 0
    phi = np.where(np.isnan(phi), 0, phi)
    both = np.column_stack((C, -constants))
    # (n, equations, u + 1): K and Y side by side, and the sizes of what they are sums of
    whole = np.einsum("nf,fe,fu->neu", phi, of_equation, both)
    sizes = ROUNDING * np.einsum("nf,fe,fu->neu", np.abs(phi), of_equation, np.abs(both)).sum(axis=2)
    parts = np.stack((whole.real, whole.imag), axis=2)
    parts[lost] = 0
    # rows of zeros say nothing and are no degrees of freedom (undamped models)
    used = ~lost[:, :, None] & (np.abs(parts) > sizes[:, :, None, None]).any(axis=3)
    used[experiments.free, :, 1] = False
    if not used.any():
        raise ValueError(
            "no equation can be used: in every experiment an amplitude that it needs was not measured or is 0"
        )
    table = dict(zip(measured, amplitudes.T, strict=False)) | dict(experiments.varying)
    left_out = []
    for i, e in np.argwhere(lost):
        own = (f for f in model.features if f.equation == e)
        needed = dict.fromkeys(name for f in own for name in (f.signal, *dict(f.varying)) if name)
        names = ", ".join(name for name in needed if np.isnan(table[name][i]))
        left_out.append(f"experiment {experiments.names[i]}, equation {e + 1} ({names} not measured)")
    flat = parts.reshape(n, 2 * equations, -1)
    used = used.reshape(n, -1)
    return Rows(flat[:, :, :-1], flat[:, :, -1], used, constants, C, factors, tuple(left_out), warnings)


def row_covariance(model: HarmonicModel, experiments: Experiments, rows: Rows, u: FloatArray) -> FloatArray:
    """Covariance of each experiment's real rows, (n, 2·equations, 2·equations), at unknowns (u,)."""
    n, equations = len(experiments), len(model.equations)
    terms = rows.multipliers * (rows.constants + rows.coefficients @ u)
    of_equation = np.eye(equations)[model.equation]
    total = np.zeros((n, 2 * equations, 2 * equations))
    slope = np.zeros((n, equations), dtype=complex)  # by the logarithm of the frequency
    for s, name in enumerate(model.outputs):
        a = (terms * (model.column == s)) @ of_equation
        moved = (terms * (model.column == s) * model.power) @ of_equation
        slope += moved * np.nan_to_num(experiments.table([name]))
        tall = np.stack((np.stack((a.real, -a.imag), -1), np.stack((a.imag, a.real), -1)), 2)
        tall = tall.reshape(n, 2 * equations, 2)
        total += tall @ experiments.covariance(name) @ np.swapaxes(tall, 1, 2)
    if experiments.frequency_std is not None:
        relative = experiments.frequency_std / experiments.frequencies
        own = np.stack((slope.real, slope.imag), axis=2).reshape(n, -1) * relative[:, None]
        total += own[:, :, None] * own[:, None, :]
    return total


def _regress(
    model: HarmonicModel, experiments: Experiments, rows: Rows, fixed: FloatArray
) -> tuple[Estimate, FloatArray]:
    """The estimate of the unknowns that are not fixed, and the solution of all of them."""
    kept, words = np.flatnonzero(fixed == 0), model.combinations.words
    names = [words[i] if words.count(words[i]) == 1 else f"{words[i]} [{i + 1}]" for i in kept]
    K, Y = rows.real_rows()
    estimate = least_squares(K[:, kept], Y - K @ fixed, names=names, rcond=RCOND)
    solution = fixed.copy()
    solution[kept] = estimate.solution
    if experiments.stated:
        G, place = gain(K[:, kept], rcond=RCOND), np.nonzero(rows.used)
        errors = row_covariance(model, experiments, rows, solution)
        same = place[0][:, None] == place[0]
        spread = G @ np.where(same, errors[place[0][:, None], place[1][:, None], place[1]], 0.0) @ G.T
        estimate = replace(estimate, solution_covariance=spread, errors_stated=True)
    return estimate, solution


def _groups(model: HarmonicModel, rows: Rows) -> tuple[IntArray, ...]:
    """Groups of regression unknowns that may all be multiplied by one factor: right sides are 0.

    Regression would find zero for them, a wrong answer. Equations are linked by the unknowns that they share.
    """
    from scipy.sparse.csgraph import connected_components

    holds: BoolArray = np.zeros((len(model.equations), rows.coefficients.shape[1]), dtype=bool)
    np.logical_or.at(holds, model.equation, rows.coefficients != 0)
    count, part = connected_components(holds @ holds.T)
    known: BoolArray = np.asarray(rows.Y.reshape(len(rows.Y), -1, 2).any(axis=(0, 2)))
    groups = (
        np.flatnonzero(holds[part == k].any(axis=0)) for k in range(count) if not known[part == k].any()
    )
    return tuple(group for group in groups if len(group))


def _as_one(rows: Rows, groups: Sequence[IntArray]) -> FloatArray:
    """1 for each unknown that others are given relative to, else 0, (u,).

    It is the first of its group that is surely not zero.
    """
    fixed = np.zeros(rows.coefficients.shape[1])
    for group in groups:
        K = rows.real_rows()[0][:, group]
        scale = np.linalg.norm(K, axis=0)
        share = np.abs(np.linalg.svd(K / np.where(scale == 0, 1.0, scale))[2][-1])
        fixed[group[np.argmax(share > 0.1 * share.max())]] = 1.0
    # where each unknown is alone with its factor, nothing is given relative to another
    return np.zeros_like(fixed) if fixed.all() else fixed


def _polynomial(model: HarmonicModel, row: FloatArray) -> Polynomial:
    return {model.monomials[j]: Fraction(float(f"{row[j]:.6g}")) for j in np.flatnonzero(row)}


def reasons(fit: LinearFit, more: str) -> tuple[str, ...]:
    """Why parameters have no one value, in words; `more` says whether other experiments can tell more."""
    model, recovery, estimate = fit.model, fit.recovery, fit.estimate
    words = []
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
    if not estimate.full_rank:
        words.append(
            f"these experiments determine {estimate.rank} of the {len(estimate.names)} combinations that the "
            f"model could show; {more}"
        )
    return (*words, *recovery.reasons)
