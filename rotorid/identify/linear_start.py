"""Where output error starts: equation error, K θ = Y of [S] (9), and the parameters from its combinations.

Measured amplitudes stand in K, so that their errors bias the estimate: it is the answer only where a model
cannot predict. All rows count alike, as in the lessons, and what they leave tells their errors.

The combinations are polynomials in the parameters, which Newton's method solves from many drawn starts, so
that all solutions are found: parameters may be exchanged. Weighted by their errors the combinations then
refine each, and refuse those that they contradict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rotorid.base.arrays import BoolArray, FloatArray, IntArray
from rotorid.base.text import listing
from rotorid.identify.amplitudes import Experiments
from rotorid.identify.combinations import (
    ONE,
    Monomial,
    Polynomial,
    sum_words,
    times,
    why_several,
)
from rotorid.identify.operator_model import HarmonicModel, products_of_powers
from rotorid.regression import least_squares, solution
from rotorid.regression.estimate import Estimate, echelon, only_determined

RCOND = 1e-11
"""Columns are merged exactly beforehand; what is left below this comes from too few different experiments."""
ROUNDING = 1e-13
"""A part of a row that is smaller than this share of its terms is what rounding leaves of zero."""
GAUGE = 0.7318
"""Value given to a parameter that nothing determines while the others are solved for."""
SAME = 1e-6
"""Relative difference below which two solutions are one; also of what is nearly real."""
STARTS, STEPS = 64, 50
"""Of Newton's method, which finds 308 of 310 solutions of drawn systems from 48; steps at most, also of the
refinement, which ends where nothing is gained."""
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class System:
    """Combinations `matrix @ monomials(θ) = values`.

    Attributes
    ----------
    names
        Of the n parameters.
    exponents
        Of the monomials (m, n); the first row, of zeros, is 1.
    matrix
        (q, m).
    values, covariance
        (q,), and (q, q) or None.
    """

    names: tuple[str, ...]
    exponents: FloatArray
    matrix: FloatArray
    values: FloatArray
    covariance: FloatArray | None

    def combinations(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (q,) at the parameters (n,), and their derivatives (q, n)."""
        monomials, slopes = products_of_powers(self.exponents, theta)
        return self.matrix @ monomials, self.matrix @ slopes


class Recovery(NamedTuple):
    """Parameters recovered from combinations.

    Attributes
    ----------
    solutions
        All real ones, (n,) each; complete, also where `undetermined` says that a value is arbitrary.
    undetermined
        (n,) mask: parameters that the combinations do not fix at all.
    values
        Parameters with one value in all solutions; NaN for the others.
    gain
        (n, q): change of the parameters per change of the combinations; NaN rows where nobody knows.
    reasons
        In words, why there are several solutions or none.
    """

    solutions: tuple[FloatArray, ...]
    undetermined: BoolArray
    values: FloatArray
    gain: FloatArray
    reasons: tuple[str, ...] = ()


class Rows(NamedTuple):
    """Real rows K (m, u), Y (m,); which of the experiments' (n, 2·equations) these are; others in words.

    Real and imaginary parts of each equation stand in turn.
    """

    K: FloatArray
    Y: FloatArray
    used: BoolArray
    left_out: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class LinearFit:
    """What linear regression gives.

    Attributes
    ----------
    estimate, rows
        The regression.
    system, words, recovery
        The combinations (q,) that the data determine as functions of the parameters, in words, and the
        parameters from them; what stands alone in the equations is known without a real solution, too.
    reasons
        Why parameters have no one value, in words.
    """

    estimate: Estimate
    rows: Rows
    system: System
    words: tuple[str, ...]
    recovery: Recovery
    reasons: tuple[str, ...]


def linear_fit(model: HarmonicModel, rows: Rows) -> LinearFit:
    """Regression of the equations, and the parameters that follow.

    Unknowns that may all be multiplied by one factor, for the right sides of their rows are 0, are estimated
    as ratios to one of them, which is 1 in the rows.

    Raises
    ------
    ValueError
        If every multiple of some unknowns fits and none of them, a single product, can be the reference.
    """
    names, monomials, reasons = [*model.combinations.words], [ONE, *model.monomials], list[str]()
    unknowns, exponents = np.pad(model.combinations.rows, ((0, 0), (1, 0))), model.exponents
    kept, m = np.ones(len(names), dtype=bool), len(monomials)
    for loose in _scaled_together(model, rows):
        words = (
            f"every multiple of {listing([names[i] for i in loose], 'and')} fits, for no known term that is "
        )
        words += "not zero stands in their equations"
        reference = _reference(rows.K, loose, unknowns)
        if reference is None:
            raise ValueError(f"{words}: make one of them known (the others are then relative to it)")
        reasons.append(f"{words}: no experiment of this kind tells more than ratios; make one of them known")
        at = int(np.flatnonzero(unknowns[reference])[0])
        ratios = np.zeros((len(unknowns), m))
        ratios[loose] = unknowns[loose, :m] / unknowns[reference, at]
        unknowns[loose] = 0
        unknowns = np.hstack((unknowns, ratios))
        exponents = np.vstack((exponents, exponents[:m] - exponents[at]))
        inverse = tuple((name, -power) for name, power in monomials[at])
        monomials += [times(above, inverse) for above in monomials[:m]]
        kept[reference] = False
        for i in loose:
            names[i] = sum_words(_polynomial(monomials, unknowns[i]))
    rows = rows._replace(K=rows.K[:, kept], Y=rows.Y - rows.K[:, ~kept].sum(axis=1))
    names, unknowns = [name for name, one in zip(names, kept, strict=True) if one], unknowns[kept]
    alike = len({*names}) < len(names)  # in six digits
    estimate = least_squares(rows.K, rows.Y, names=None if alike else names, rcond=RCOND)
    picks = np.eye(len(names)) if estimate.full_rank else np.array(echelon(estimate.row_space))
    picks = picks.reshape(-1, len(names))
    matrix, spread = picks @ unknowns, estimate.solution_covariance
    system = System(
        names=model.parameters,
        exponents=exponents,
        matrix=matrix,
        values=picks @ estimate.solution,
        covariance=None if spread is None else picks @ spread @ picks.T,
    )
    words_of = [
        names[alone[0]] if len(alone := np.flatnonzero(pick)) == 1 else sum_words(_polynomial(monomials, row))
        for pick, row in zip(picks, matrix, strict=True)
    ]
    recovery = recover(system)
    for i, name in enumerate(words_of if not recovery.solutions else ()):
        if name in model.parameters:
            j = model.parameters.index(name)
            recovery.values[j], recovery.gain[j] = system.values[i], np.eye(len(words_of))[i]
    if recovery.undetermined.any():
        lost = np.array(model.parameters)[recovery.undetermined].tolist()
        reasons.append(only_determined(model.parameters, lost, words_of))
    if not estimate.full_rank:
        reasons.append(
            f"these experiments determine {estimate.rank} of the {len(names)} combinations that the model "
            "could show"
        )
    return LinearFit(estimate, rows, system, tuple(words_of), recovery, (*reasons, *recovery.reasons))


def build_rows(model: HarmonicModel, experiments: Experiments) -> Rows:
    """Rows at the measured amplitudes.

    Raises
    ------
    ValueError
        If a signal of the model was measured nowhere or no complete row remains.
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
    left_out = (
        f"experiment {experiments.names[i]}, equation {e + 1}: an amplitude in it is not measured"
        for i, e in np.argwhere(lost)
    )
    return Rows(parts[used][:, :-1], parts[used][:, -1], used.reshape(n, -1), tuple(left_out))


def _scaled_together(model: HarmonicModel, rows: Rows) -> list[IntArray]:
    """Groups of unknowns that may all be multiplied by one factor, for the right sides of their rows are 0.

    Regression would find zero for them, a wrong answer. Equations are linked by the unknowns that they share.
    """
    from scipy.sparse.csgraph import connected_components

    holds = np.zeros((len(model.equations), rows.K.shape[1]), dtype=bool)
    np.logical_or.at(holds, model.equation, model.of_unknowns != 0)
    fixed = np.bincount(np.nonzero(rows.used)[1] // 2, rows.Y != 0, len(holds)) > 0
    count, part = connected_components(holds @ holds.T)
    groups = [
        np.flatnonzero(holds[part == k].any(axis=0)) for k in range(count) if not fixed[part == k].any()
    ]
    return [group for group in groups if len(group)]


def _reference(K: FloatArray, group: IntArray, unknowns: FloatArray) -> int | None:
    """The first unknown of a group that is a single product and surely not zero, if others are beside it."""
    scale = np.linalg.norm(K[:, group], axis=0)
    share = np.abs(np.linalg.svd(K[:, group] / np.where(scale == 0, 1.0, scale))[2][-1])
    single = (unknowns[group] != 0).sum(axis=1) == 1
    fit = group[single & (share > 0.1 * share.max())]
    return int(fit[0]) if len(fit) and len(group) > 1 else None


def _polynomial(monomials: Sequence[Monomial], row: FloatArray) -> Polynomial:
    return {monomials[int(j)]: Fraction(float(f"{row[j]:.6g}")) for j in np.flatnonzero(row)}


def several(solutions: Sequence[FloatArray]) -> BoolArray:
    """Which parameters (n,) differ between solutions."""
    table = np.array(solutions)
    return np.asarray(np.ptp(table, axis=0) > SAME * np.abs(table).max(axis=0))


def recover(system: System) -> Recovery:
    """Solve for the parameters."""
    n, q = len(system.names), len(system.values)
    gain, values = np.full((n, q), np.nan), np.full(n, np.nan)
    if not q:
        return Recovery((), np.ones(n, dtype=bool), values, gain)
    J = system.combinations(np.random.default_rng(5).uniform(0.6, 1.7, n))[1]  # at a general point
    size = np.linalg.norm(J, axis=1, keepdims=True)
    seen = least_squares(J / np.where(size > 0, size, 1.0), np.zeros(q), rcond=1e-9)
    # of those that are open the last are fixed, one per dimension of the null space
    free = sorted({int(np.flatnonzero(row)[0]) for row in echelon(seen.row_space)})
    undetermined, weight, solutions = np.isnan(seen.values), _weights(system), list[FloatArray]()
    refined = [_refined(system, start, free, weight) for start in _candidates(system, free)]
    fits = sorted(((_misfit(system, end), end) for end in refined), key=lambda one: one[0])
    for misfit, theta in fits:
        again = any(np.allclose(theta, other, rtol=SAME, atol=0) for other in solutions)
        if misfit <= max(1.0, 3 * fits[0][0]) and np.isfinite(misfit) and not again:
            solutions.append(theta)
    if not solutions:
        reason = "no real values of the parameters give the estimated combinations"
        return Recovery((), undetermined, values, gain, (reason,))
    solutions.sort(key=lambda theta: [-float(f"{x:.6g}") for x in theta])  # not by what rounding leaves
    lost = several(solutions) | undetermined
    gain[free] = solution(weight @ system.combinations(solutions[0])[1][:, free], weight, rcond=1e-13)
    gain[undetermined] = np.nan
    reasons = why_several(solutions, system.names, np.flatnonzero(lost & ~undetermined).tolist())
    values = np.where(lost, np.nan, solutions[0])
    return Recovery(tuple(solutions), undetermined, values, gain, tuple(reasons))


def _candidates(system: System, free: list[int]) -> list[FloatArray]:
    """Ends (n,) of Newton's method from drawn sizes and signs of the free unknowns, the others at `GAUGE`.

    The sizes are drawn around those at which every monomial is as large as its combination.
    """
    rng, E, theta = np.random.default_rng(0), system.exponents, np.full((STARTS, len(system.names)), GAUGE)
    i, k = np.nonzero(system.matrix * E.any(axis=1) * system.values[:, None])
    logs = np.log(np.abs(system.values[i] / system.matrix[i, k]))
    logs -= np.log(GAUGE) * np.delete(E[k], free, axis=1).sum(axis=1)
    size, shape = np.exp(np.linalg.pinv(E[k][:, free]) @ logs), (STARTS, len(free))
    theta[:, free] = size * rng.choice((-1.0, 1.0), shape) * 10.0 ** rng.uniform(-1.0, 1.0, shape)
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            monomials = np.prod(theta[:, None] ** E, axis=2)
            J = (system.matrix @ (monomials[:, :, None] * E / theta[:, None]))[:, :, free] * size
            length = np.linalg.norm(J, axis=2, keepdims=True)
            left = (system.values - monomials @ system.matrix.T)[:, :, None] / length
            step = (np.linalg.pinv(np.nan_to_num(J / length, posinf=0.0, neginf=0.0)) @ left)[:, :, 0]
            theta[:, free] += size * step
            theta[theta == 0] = TINY  # at 0 slopes are 0 / 0
            near = np.abs(size * step) < SAME * np.fmax(np.abs(theta[:, free]), SAME * size)
            if near.all():
                break
    theta[:, free] = np.where(np.abs(theta[:, free]) < SAME * SAME * size, 0.0, theta[:, free])
    ends = list[FloatArray]()
    for one in theta[near.all(axis=1)]:
        if not any(np.allclose(one, other, rtol=SAME, atol=0) for other in ends):
            ends.append(one)
    return ends


def _weights(system: System) -> FloatArray:
    """Matrix that makes the errors of the combinations independent and of size one (relative if unknown)."""
    if system.covariance is None:
        return np.diag(1.0 / np.where(system.values != 0, np.abs(system.values), 1.0))
    scale = np.maximum(np.sqrt(np.diag(system.covariance)), 1e-14 * np.abs(system.values) + 1e-100)
    shares = system.covariance / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
    return np.linalg.inv(np.linalg.cholesky(shares)) / scale


def _refined(system: System, theta: FloatArray, free: list[int], weight: FloatArray) -> FloatArray:
    """Least squares of all combinations from a solution (n,) of some, by Gauss–Newton steps."""
    best, lowest = theta, np.inf
    for _ in range(STEPS):
        with np.errstate(all="ignore"):
            values, J = system.combinations(theta)
            left = weight @ (system.values - values)
        if not left @ left < lowest:
            break
        best, lowest, theta = theta, float(left @ left), theta.copy()
        theta[free] += solution(weight @ J[:, free], left, rcond=1e-13)
    return best


def _misfit(system: System, theta: FloatArray) -> float:
    """Largest error of a combination in units of what rounding and four standard deviations allow."""
    size = np.abs(system.matrix) @ np.abs(products_of_powers(system.exponents, theta)[0])
    size += np.abs(system.values) + 1e-300
    std = 0.0 if system.covariance is None else np.sqrt(np.diag(system.covariance))
    error = np.abs(system.combinations(theta)[0] - system.values)
    return float(np.nan_to_num(error / (1e-6 * size + 4 * std), nan=np.inf).max())


def passive_elements(model: HarmonicModel) -> dict[str, int]:
    """Parameters that stand as a mass (2), damper (1) or spring (0): the power of p.

    Such a one multiplies one power of p and a symmetric matrix of the outputs that is positive semidefinite.
    """
    e, kinds_of = len(model.equations), dict[str, int]()
    for j, name in enumerate(model.parameters if len(model.outputs) == e else ()):
        (m, *others) = np.flatnonzero(model.exponents[:, j])
        used = np.flatnonzero(model.coefficients[:, m])
        kinds = {*model.power[used].tolist()}
        alone = not others and np.abs(model.exponents[m]).sum() == model.exponents[m, j] == 1
        if not alone or len(kinds) > 1 or not kinds <= {0, 1, 2}:
            continue
        S = np.zeros((e, len(model.signals) + 1))
        S[model.equation[used], model.column[used]] = model.coefficients[used, m]
        S = S[:, :e]
        passive = S.any() and (S == S.T).all() and np.linalg.eigvalsh(S)[0] >= -1e-9 * np.abs(S).max()
        if passive and not any(model.features[f].varying for f in used):
            (kinds_of[name],) = kinds
    return kinds_of
