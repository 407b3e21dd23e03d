"""What must be known of a fit to time records before its numbers are used, the worst first.

The model does not describe the record; its residuals are no noise, or hum; times cannot be as stated. A
series is one output of one record. A column c beside the sensitivities J takes (c⊥ᵀr)²/c⊥ᵀc⊥ of the sum of
squares, with c⊥ its part outside them. So hum is looked for in a periodogram that gives back what the
parameters have taken of a sinusoid, beside a resonance most of it.

Where records do not determine every parameter: the outputs depend on them by the coefficients of the
equations alone, in dx/dt = −(a + b) x + g h u by a + b and g h. A coefficient, or a product or quotient of
two, is determined where its gradient stands in the row space of the sensitivities.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.expression_functions import Compiled, jacobian, usual
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.record_least_squares import Iterations, Problem
from rotorid.identify.records import inputs_of
from rotorid.identify.simulation import STEPWISE
from rotorid.regression import gain, least_squares
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import JACOBIAN_RCOND, normal_matrix
from rotorid.regression.prior import effect

FEWEST, LAGS = 20, 10
"""Samples below which nothing can be said of correlations; neighbours that are looked at."""
UNEXPLAINED, MISFIT = 0.05, 4.0
"""Share of a series' variance in residuals that are not white, and χ² per degree of freedom, above which a
record is not described."""
CHANCE = 1e-6
"""Probability below which residuals or what takes a share of them are no noise."""
SHARE, FAR = 0.3, 5.0
"""Of the variance, or standard deviations of a parameter: what hum takes or moves if it is named."""
SUSPECT = 0.05
"""Probability of such correlations below which intervals are widened, with or without words."""
HINT = (
    "a local minimum or an unsuitable model; try other starting values, bounds or several "
    "starts. No intervals are given"
)


def judge(problem: Problem, path: Iterations, loss: str) -> dict[str, Any]:
    """The estimate of a fit, without intervals where these would mislead, and what else `Fit` says of it."""
    estimate, theta, linear = path.estimate, path.estimate.solution, loss == "linear"
    words = ["" if path.converged else f"{path.message}; no intervals are given"]
    try:
        r, J = estimate.residuals, problem.jacobian(theta)
    except SimulationError as error:
        words.append(f"the model cannot be simulated with the result: {error}")
        nothing = dict.fromkeys(("autocorrelation", "prior", "normal_matrix", "poor"))
        return nothing | {"estimate": _widened(estimate, None), "reliable": False, "warnings": words}
    prior = effect(problem.prior, J, r, theta, at_bounds=path.at_bounds)
    if prior is not None:
        if prior.alone:  # in the words of the nonlinear model, not of its tangents
            alone = least_squares(J, -r, names=estimate.names, sigma=1.0, rcond=JACOBIAN_RCOND).at(theta, r)
            prior = replace(prior, alone=combined(problem, alone).describe_rank())
        estimate, r = prior.apart(estimate), -prior.data.residuals  # of the data alone
    seen = len(r) >= FEWEST and not _rounding_only(problem, r)
    rho, chance, factor = _correlated(problem, r) if seen else (None, 1.0, 1.0)
    poor = misfit(problem, estimate, r, loss)
    cause, wrong = _hum(problem, J, r) if seen and path.converged and linear else ("", False)
    words += [poor, cause, path.bound_warning]
    if problem.integrator in STEPWISE:
        words.append(f"± do not count what a step of {problem.integrator} from sample to sample is off")
    if path.converged:
        estimate = combined(problem, estimate)
        words += ["" if estimate.full_rank or poor else estimate.describe_rank()]
    words += [] if prior is None else prior.warnings
    if ordered := rho is not None and chance < 1e-4 and not poor:
        words.append(
            "the residuals are not random: those of neighbouring samples are correlated "
            f"({rho:.2f}, Durbin–Watson {2 - 2 * rho:.2f})"
            + (f": intervals were made {factor:.2g} times as wide" if factor > 1.05 else "")
            + ". Either the noise is, or the model does not quite describe the record (initial values? an "
            "offset or drift, [nuisance]?), or this is a local minimum (try several starts)"
        )
    words += [] if poor else [*_errors_words(problem, estimate, r, linear)]
    sound = path.converged and not poor and not wrong and not problem.prior.ridge
    return {
        # too few samples to say that they are correlated may well make intervals too narrow
        "estimate": _widened(estimate, (factor if chance < SUSPECT else 1.0) if sound else None),
        "reliable": sound and not ordered,
        "poor": bool(poor),
        "warnings": [*words, _fast(problem, theta)],
        "autocorrelation": rho,
        "prior": prior,
        "normal_matrix": normal_matrix(estimate.names, path.regression[0] if path.regression else J),
    }


def misfit(problem: Problem, estimate: Estimate, r: FloatArray, loss: str) -> str:
    """Words where the model does not describe the record: intervals would be wrong."""
    if not problem.data.any():
        return "the record is zero throughout: a sensor without a signal?"
    if estimate.dof <= 0 or _rounding_only(problem, r):
        return ""
    if problem.stated:
        far = loss == "linear" and r @ r > MISFIT * estimate.dof
        why = estimate.misfit() if far else ""
        return f"{why}: {HINT}" if why else ""
    for name, rows in problem.series:
        data, part = problem.data[rows], r[rows]
        if loss != "linear":  # without outliers
            limit = 3 * 1.4826 * np.median(np.abs(part))
            part = np.clip(part, -limit, limit)
        share = part @ part / max(np.sum((data - data.mean()) ** 2), 1e-300)
        left = f"the model leaves {100 * share:.2g} % of the variance of {name}"
        if len(part) < FEWEST:
            if share > 4 * UNEXPLAINED and len(part) > 2 and np.ptp(data) > 0:
                return f"{left}, in too few samples to tell whether that is noise; if not, {HINT}"
        elif _correlated(problem, r, [rows])[1] < CHANCE:
            power = np.abs(np.fft.rfft(part - part.mean())[1:]) ** 2
            if share > UNEXPLAINED:
                return f"{left}, and not as noise: {HINT}"
            if np.convolve(power, np.ones(3), "same").max() > 0.5 * power.sum():
                return f"{left}, most of it at one frequency: {HINT}; state the errors if it is interference"
    return ""


def _rounding_only(problem: Problem, r: FloatArray) -> bool:
    """Whether nothing but rounding is left."""
    return bool(np.linalg.norm(r) <= 1e-7 * np.linalg.norm(problem.data))


def _correlated(problem: Problem, r: FloatArray, only: Sequence[slice] = ()) -> tuple[float, float, float]:
    """Correlation of neighbours over all series, each in its own unit; the probability that the ten before
    predict white residuals so well (F test); and how many times too narrow intervals are, with correlations
    that fade as the first.
    """
    from scipy.linalg import solve_toeplitz
    from scipy.special import betainc

    parts = [r[rows] for rows in only or [rows for _, rows in problem.series]]
    size, most = sum(map(len, parts)), min(LAGS, max(1, min(map(len, parts)) // 5))
    sums = [np.correlate(np.append(part, np.zeros(most)), part) for part in parts]
    rho = np.sum([len(x) / (c[0] or 1.0) * c[1:] for x, c in zip(parts, sums, strict=True)], axis=0) / size
    factor = max(1.0, np.sqrt((1 + rho[0]) / (1 - rho[0])))
    left = 1 - rho @ solve_toeplitz([1, *rho[:-1]], rho)
    return float(rho[0]), float(betainc(size / 2, most / 2, max(left, 0))), float(factor)


def _hum(problem: Problem, J: FloatArray, r: FloatArray) -> tuple[str, bool]:
    """Words where a sinusoid takes much of the residuals, and whether it moves a parameter far.

    Its frequency is that which takes most of one series with all parameters free. Of A, the transforms of an
    orthonormal basis of J, P = (n − Σ|A|²)/2 and Z = ΣA²/2: a sinusoid outside them takes
    (P|w|² + Re Z* w²)/(P² − |Z|²) of residuals with the transform w.
    """
    from scipy.special import fdtrc

    t, (Q, R) = problem.by_time([record.t for record in problem.records]), np.linalg.qr(J)
    Q, G = Q.T, gain(R, rcond=JACOBIAN_RCOND)
    # of noise it is χ² of two
    best, frequency, span, series = 20 * float(r @ r) / len(r), 0.0, 1.0, slice(0)
    for _, rows in problem.series:
        times, size, n = t[rows], problem.scale[rows], rows.stop - rows.start
        if n < FEWEST:
            continue
        even, half = np.linspace(times[0], times[-1], n), size @ size / 2
        w, P, Z = np.array([0.0, half, 0.0])
        for column in (*Q, r):  # sums over those before
            P, Z = P - np.abs(w) ** 2 / 2, Z + np.square(w) / 2
            w = np.fft.rfft(np.interp(even, times, size * column[rows]), 4 * n)[4:]
        det = P**2 - np.abs(Z) ** 2
        power = (P * np.abs(w) ** 2 + (Z.conj() * w**2).real) / np.where(det > 1e-3 * half**2, det, np.inf)
        if power.max() > best:
            best, span, series = float(power.max()), float(np.ptp(times)), rows
            frequency = (4 + int(np.argmax(power))) / (4 * n) * (n - 1) / span
    for mains in (50.0, 60.0):
        whole = mains * max(1, round(frequency / mains))
        if abs(whole - frequency) < 0.5 / span:
            frequency = whole
    C, waves = np.zeros((len(r), 2)), np.exp(2j * np.pi * frequency * t[series])
    C[series] = problem.scale[series, None] * np.column_stack((waves.real, waves.imag))
    outside, free = C - Q.T @ (Q @ C), len(r) - len(Q) - 2
    amount, _, _, lengths = np.linalg.lstsq(outside, -r, rcond=None)
    if not frequency or free < 3 or lengths[1] <= 1e-6 * np.abs(C).max():
        return "", False
    rest = r + outside @ amount
    taken, left = float(r @ r - rest @ rest), max(float(rest @ rest) / free, 1e-300)
    _, white, factor = _correlated(problem, rest, [series])
    spread = max(left * factor**2, 1.0 * problem.stated)
    error = np.maximum(np.sqrt(spread * (G**2).sum(axis=1)), 1e-300)
    share, shift = taken / float(r @ r), float(np.max(np.abs(G @ (Q @ (C @ amount))) / error))
    # a line beside others is rather a vibration that the model does not describe
    if white < CHANCE or max(share / SHARE, shift / FAR) < 1 or fdtrc(2, free, taken / spread / 2) >= CHANCE:
        return "", False
    off = f", and move a parameter by {shift:.2g} standard deviations" if shift > 1 else ""
    return (
        f"the residuals hum with {frequency:.5g} Hz (if that is interference, estimate it: [nuisance] hum_Hz "
        f"= {frequency:.5g}): that would take {100 * share:.2g} % of the residuals' variance{off}"
        + ". No intervals are given"
        * (shift > FAR)
    ), shift > FAR


def _errors_words(problem: Problem, estimate: Estimate, r: FloatArray, linear: bool) -> Iterator[str]:
    """Where errors are unequal, or not as stated."""
    sizes = {
        words: np.sqrt(np.mean((r[rows] / problem.scale[rows]) ** 2))
        for words, rows in problem.series
        if rows.stop - rows.start >= FEWEST
    }
    alike = problem.stated or _rounding_only(problem, r) or not sizes
    if linear and not alike and max(sizes.values()) >= 2 * min(sizes.values()):
        yield (
            f"the outputs have different errors ({', '.join(f'{n} {s:.2g}' for n, s in sizes.items())}), "
            "but the intervals hold for equal ones. Stated with --sigma, precise outputs count for more"
        )
    if why := estimate.misfit():
        yield f"{why}: intervals are too narrow, or the model does not quite describe the record"


def _fast(problem: Problem, theta: FloatArray) -> str:
    """Words where vibrations about the first states are faster than samples can tell."""
    model, record, n = problem.model, problem.records[0], len(problem.model.states)
    A = model.f(record.t[0], model.x0(theta)[:, 0], theta, inputs_of(model, record)[0])[:, 1 : 1 + n]
    if len(record) < 3 or not n or not np.isfinite(A).all():
        return ""
    fastest, most = np.abs(np.linalg.eigvals(A).imag).max(), np.pi / np.median(np.diff(record.t))
    if fastest <= most:
        return ""
    return (
        f"the model can vibrate with {fastest:.4g} rad/s, faster than half the sampling rate ({most:.4g} "
        "rad/s): slower vibrations may describe the record as well. Are the times in seconds, and not in ms?"
    )


def _widened(estimate: Estimate, factor: float | None) -> Estimate:
    """With standard deviations so many times as large; None: without any."""

    def wider(value: Any, power: int = 1) -> Any:  # noqa: ANN401 - a number or an array
        return None if factor is None or value is None else value * factor**power

    return replace(
        estimate,
        covariance=wider(estimate.covariance, 2),
        solution_covariance=wider(estimate.solution_covariance, 2),
        curved=estimate.curved and tuple(replace(one, std=wider(one.std)) for one in estimate.curved),
    )


# -- what records determine


def combined(problem: Problem, estimate: Estimate) -> Estimate:
    """The estimate with combinations that hold for the nonlinear model, else those near its values."""
    theta, names, rank = estimate.solution, np.array(estimate.names), estimate.rank
    if estimate.full_rank:
        return estimate
    scale = np.where(theta == 0, 1.0, np.abs(theta))
    null = np.linalg.svd(estimate.row_space * scale)[2][rank:]
    rows = [scale * (names == name) for name in names if name not in estimate.undetermined]
    chosen = []
    by = problem.model.symbols[1 + len(problem.model.states) :][: len(theta)]
    for expression in _coefficients(problem.model, by):
        if len(rows) == rank:
            break
        table = Compiled(by, jacobian([expression], by), (1 + len(by),)).one(theta.tolist())
        value, slope = float(table[0]), table[1:]
        gradient = slope * scale / np.linalg.norm(slope * scale)
        independent = np.linalg.matrix_rank([*rows, gradient], tol=1e-6) > len(rows)
        if independent and np.linalg.norm(null @ gradient) <= 1e-5:
            rows.append(gradient)
            words = str(usual(expression)).replace("**", "^").replace("*", "·")  # such as a·b^2/c
            chosen.append(estimate.combination(words, value, slope))
    if len(rows) < rank:
        tangents = estimate.combinations
        chosen = [replace(c, words=f"(near these values) {c.words}", std=None) for c in tangents]
    return replace(estimate, curved=tuple(chosen))


def _coefficients(model: OdeModel, parameters: list[Any]) -> Iterator[Any]:
    """Coefficients of the equations, the simple ones first, then products and quotients of two."""
    import sympy

    varying = {*model.symbols} - {*parameters}
    parts = set()
    for expression in (*model.rates, *model.observed, *model.initial, *model.inertia):
        expanded = sympy.expand(expression)
        powers = [e for e in expanded.atoms(sympy.Function, sympy.Pow) if e.free_symbols & varying]
        written = sympy.collect(expanded, [*powers, *varying])
        for node in sympy.preorder_traversal(written):
            part = node.as_independent(*varying, as_Add=False)[0] if node.is_Mul else node
            if part.free_symbols and not part.free_symbols & varying:
                factors = sympy.Mul.make_args(sympy.factor_terms(sympy.together(part)))
                parts.add(sympy.Mul(*(f for f in factors if not f.is_number)))
    single = sorted(parts, key=lambda e: (sympy.count_ops(e), str(e)))
    yield from single
    for a, b in combinations(single[:24], 2):
        yield from (a * b, a / b)
