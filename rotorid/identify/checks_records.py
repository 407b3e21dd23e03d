"""What must be known of a fit to time records before its numbers are used: five checks, the worst first.

The model does not describe the record; residuals are correlated; they point at an offset, a drift, hum or a
wrong initial value; the integration is not exact; the times cannot be as they are stated. A series is one
output of one record; each is judged by itself, as outputs may have other units. What residuals may hold
beside noise is a column c beside the sensitivities J: its part outside them, c⊥, takes (c⊥ᵀr)²/c⊥ᵀc⊥ of the
sum of squares. So hum is looked for in a periodogram that gives back what the parameters have taken of a
sinusoid, beside a resonance most of it.

Where records do not determine every parameter: the outputs depend on them by the coefficients of the
equations alone, in dx/dt = −(a + b) x + g h u by a + b and g h. A coefficient, or a product or quotient of
two, is determined where its gradient stands in the row space of the sensitivities, here and at values 20 %
of the parameters away, so that it is no chance of the place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.expression_functions import Compiled, jacobian, usual
from rotorid.identify.ode import OdeModel, SimulationError
from rotorid.identify.record_residuals import RTOL, Iterations, Problem, at
from rotorid.identify.simulation import STEPWISE, simulate
from rotorid.regression import gain, least_squares, solution
from rotorid.regression.estimate import Estimate
from rotorid.regression.normal_matrix import normal_matrix
from rotorid.regression.prior import effect
from rotorid.regression.search import RCOND
from rotorid.regression.undetermined_combinations import Combination

FEWEST, LAGS = 20, 10
"""Samples below which nothing can be said of correlations; neighbours that are looked at."""
UNEXPLAINED, MISFIT = 0.05, 4.0
"""Share of a series' variance in residuals that are not white, and χ² per degree of freedom, above which a
record is not described."""
CHANCE = 1e-6
"""Probability below which residuals or what takes a share of them are no noise."""
SHARE, FAR = 0.3, 5.0
"""Of the variance, or standard deviations of a parameter: what a cause takes or moves if it is named."""
HINT = (
    "a local minimum or an unsuitable model; try other starting values, bounds or several "
    "starts. No intervals are given"
)
Correlation = tuple[float, float, float]
"""Of neighbours; the probability of such correlations up to the tenth neighbour in white residuals (Box and
Pierce 1970); and how many times too narrow intervals are, with correlations that fade as the first."""
Candidate = tuple[FloatArray, str, bool]
"""Columns (m, q), what to do ({0}: size of the first), and whether only noise may be left."""


def judge(problem: Problem, path: Iterations, loss: str) -> dict[str, Any]:
    """The estimate of a fit, without intervals where these would mislead, and what else `Fit` says of it."""
    estimate, theta, linear = path.estimate, path.estimate.solution, loss == "linear"
    words = ["" if path.converged else f"{path.message}; no intervals are given"]
    judged: dict[str, Any] = dict.fromkeys(
        ("integration_change", "autocorrelation", "prior", "normal_matrix")
    )
    try:
        r, J = estimate.residuals, problem.jacobian(theta)
    except SimulationError as error:
        words.append(f"the model cannot be simulated with the result: {error}")
        return judged | {"estimate": _widened(estimate, None), "reliable": False, "warnings": words}
    prior = effect(problem.prior, J, r, theta, stated=problem.stated, at_bounds=path.at_bounds)
    if prior is not None:
        if prior.alone:  # in the words of the nonlinear model, not of its tangents
            alone = at(least_squares(J, -r, names=estimate.names, sigma=1.0, rcond=RCOND), theta, r)
            prior = replace(prior, alone=combined(problem, alone)[0].describe_rank())
        estimate, r = prior.apart(estimate, stated=problem.stated), prior.best  # of the data alone
    seen, factor = None, 1.0
    if len(r) >= FEWEST and not _rounding_only(problem, r):
        seen = _correlation(problem, r)
        factor = seen[2] if seen[1] < 1e-4 and seen[2] > 1.2 else 1.0
    poor = misfit(problem, estimate.dof, r, loss)
    cause, wrong = causes(problem, theta, J, r, seen) if seen and path.converged and linear else ("", False)
    change, integration = _integration(problem, estimate, J)
    words += [integration, poor, cause, path.bound_warning]
    if path.converged:
        estimate, local = combined(problem, estimate)
        words += [local, "" if estimate.full_rank or poor else estimate.describe_rank()]
    words += [] if prior is None else prior.warnings
    words += [] if poor else _errors_words(problem, estimate, r, linear)
    if seen and seen[1] < 1e-4 and not poor:
        words.append(
            "the residuals are not random: those of neighbouring samples are correlated "
            f"({seen[0]:.2f}, Durbin–Watson {2 - 2 * seen[0]:.2f})"
            + (f": intervals were made {factor:.2g} times as wide" if factor > 1 else "")
            + ". Either the noise is, or the model does not quite describe the record, or this is a local "
            "minimum (try several starts)"
        )
    sound = path.converged and not poor and not wrong and not problem.prior.ridge
    return judged | {
        "estimate": _widened(estimate, factor if sound else None),
        "reliable": sound and factor == 1,
        "warnings": [*words, *_times_words(problem, theta)],
        "integration_change": change,
        "autocorrelation": seen and seen[0],
        "prior": prior,
        "normal_matrix": normal_matrix(estimate.names, path.regression[0] if path.regression else J),
    }


def misfit(problem: Problem, dof: int, r: FloatArray, loss: str) -> str:
    """Words where the model does not describe the record: intervals would be wrong."""
    if not problem.data.any():
        return "the record is zero throughout: a sensor without a signal?"
    if dof <= 0 or _rounding_only(problem, r):
        return ""
    if problem.stated:
        ratio = float(r @ r) / dof
        if loss != "linear" or ratio <= MISFIT or _chance(float(r @ r), dof) >= CHANCE:
            return ""
        return f"residuals are {np.sqrt(ratio):.2g} times as large as the stated errors explain: {HINT}"
    for _, name, rows in problem.series:
        data, part = problem.data[rows], r[rows]
        if loss != "linear":  # without outliers
            limit = 3 * 1.4826 * float(np.median(np.abs(part)))
            part = np.clip(part, -limit, limit)
        share = float(part @ part) / max(float(np.sum((data - data.mean()) ** 2)), 1e-300)
        left = f"the model leaves {100 * share:.2g} % of the variance of {name}"
        if len(part) < FEWEST:
            if share > 4 * UNEXPLAINED and len(part) > 2 and np.ptp(data) > 0:
                return f"{left}, in too few samples to tell whether that is noise; if not, {HINT}"
        elif _correlated([part])[1] < CHANCE:
            power = np.abs(np.fft.rfft(part - part.mean())[1:]) ** 2
            line = np.convolve(power, np.ones(3), "same").max() > 0.5 * power.sum()
            if share > UNEXPLAINED:
                return f"{left}, and not as noise: {HINT}"
            if line:
                return f"{left}, most of it at one frequency: {HINT}; state the errors if it is interference"
    return ""


def _rounding_only(problem: Problem, r: FloatArray) -> bool:
    """Whether nothing but rounding is left."""
    return bool(np.linalg.norm(r) <= 1e-7 * np.linalg.norm(problem.data))


def _correlation(problem: Problem, r: FloatArray) -> Correlation:
    """Over all series, each in its own unit."""
    return _correlated([r[rows] for *_, rows in problem.series])


def _correlated(series: list[FloatArray]) -> Correlation:
    parts = [part / (float(np.sqrt(np.mean(part**2))) or 1.0) for part in series]
    size = sum(map(len, parts))
    lags = range(1, 1 + min(LAGS, max(1, min(map(len, parts)) // 5)))
    rho = np.array([sum(float(part[k:] @ part[:-k]) for part in parts) for k in lags]) / size
    factor = np.sqrt((1 + rho[0]) / (1 - rho[0])) if 0 < rho[0] < 1 else 1.0
    return float(rho[0]), _chance(size * float(rho @ rho), len(rho)), float(factor)


def _chance(chi_square: float, dof: int) -> float:
    """Probability of a larger χ²."""
    from scipy.special import chdtrc

    return float(chdtrc(dof, chi_square))


# -- causes


def causes(
    problem: Problem, theta: FloatArray, J: FloatArray, r: FloatArray, seen: Correlation
) -> tuple[str, bool]:
    """Words about what residuals point at, and whether intervals without it would be wrong.

    Parameters
    ----------
    problem, theta
        What was fitted, and the minimum (n,).
    J, r, seen
        Sensitivities (m, n) and residuals (m,) there, and their correlation.
    """
    from scipy.special import fdtrc

    t, series = (
        problem.by_time([record.t for record in problem.records]),
        np.zeros((len(r), len(problem.series))),
    )
    for j, (*_, rows) in enumerate(problem.series):
        series[rows, j] = problem.scale[rows]
    candidates = _hum(problem, t, series, J, r)
    if seen[1] < 1e-2:
        candidates += [
            (series, "the residuals have an offset (estimate it: [nuisance] offset = true)", False),
            (series * t[:, None], "the residuals drift (estimate it: [nuisance] drift = true)", False),
            *_initial_values(problem, theta),
        ]
    G = gain(J, rcond=RCOND) if candidates else J.T  # what the parameters take of y is J G y
    named: list[tuple[float, float, str]] = []
    for columns, words, alone in candidates:
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        C = columns / size
        outside, q = C - J @ (G @ C), C.shape[1]
        free = len(r) - round(float(np.sum(G.T * J))) - q
        if free < 3 or np.linalg.matrix_rank(outside, tol=1e-6) < q:
            continue
        amount = solution(outside, -r)
        rest = r + outside @ amount
        taken, left = float(r @ r - rest @ rest), float(rest @ rest) / free
        _, white, factor = (0.0, 1.0, 1.0) if _rounding_only(problem, rest) else _correlation(problem, rest)
        spread = max(left * factor**2, 1.0 if problem.stated else 1e-300)
        error = np.maximum(np.sqrt(spread * (G**2).sum(axis=1)), 1e-300)
        shift = float(np.max(np.abs(G @ (C @ amount)) / error))
        # a line beside others is rather a vibration that the model does not describe
        noise = white >= CHANCE or not alone
        much = taken >= SHARE * float(r @ r) or shift >= FAR
        if noise and much and fdtrc(q, free, taken / spread / q) < CHANCE:
            named.append((taken, shift, words.format(amount[0] / size[0])))
    if not named:
        return "", False
    # those as good as the best
    most, shifts, texts = zip(
        *sorted((one for one in named if one[0] > 0.9 * max(named)[0]), reverse=True), strict=True
    )
    wrong, share = min(shifts) > FAR, 100 * most[0] / float(r @ r)
    off = f", and move a parameter by {max(shifts):.2g} standard deviations" if max(shifts) > 1 else ""
    end = ". No intervals are given" if wrong else ""
    return f"{'; or '.join(texts)}: that would take {share:.2g} % of the residuals' variance{off}{end}", wrong


def _hum(
    problem: Problem, t: FloatArray, series: FloatArray, J: FloatArray, r: FloatArray
) -> list[Candidate]:
    """The frequency of a sinusoid that takes most of a series' residuals, with all parameters free.

    Of A, the transforms of an orthonormal basis of J, P = (n − Σ|A|²)/2 and Z = ΣA²/2: a sinusoid outside
    them takes (P|w|² + Re Z* w²)/(P² − |Z|²) of residuals with the transform w.
    """
    Q = np.linalg.svd(J, full_matrices=False)[0]
    best, frequency, span = 0.0, 0.0, 1.0
    for *_, rows in problem.series:
        times, size, n = t[rows], problem.scale[rows], rows.stop - rows.start
        if n < FEWEST:
            continue
        even = np.linspace(times[0], times[-1], n)
        parts = np.column_stack([r, Q])[rows] * size[:, None]
        w, *A = np.fft.rfft([np.interp(even, times, part) for part in parts.T], 4 * n)[:, 4:]
        half = float(size @ size) / 2
        P, Z = half - np.sum(np.abs(A) ** 2, axis=0) / 2, np.sum(np.square(A), axis=0) / 2
        det = P**2 - np.abs(Z) ** 2
        power = (P * np.abs(w) ** 2 + (Z.conj() * w**2).real) / np.where(det > 1e-3 * half**2, det, np.inf)
        if power.max() > best:
            best, span = float(power.max()), float(times[-1] - times[0])
            frequency = (4 + int(np.argmax(power))) / (4 * n) * (n - 1) / span
    if best < 20.0 * float(r @ r) / len(r):  # of noise (c⊥ᵀr)² over the mean square is χ² of two
        return []
    for mains in (50.0, 60.0):
        whole = mains * max(1, round(frequency / mains))
        frequency = whole if abs(whole - frequency) < 0.5 / span else frequency
    wave = np.exp(2j * np.pi * frequency * t)[:, None]
    words = (
        f"the residuals hum with {frequency:.5g} Hz (if that is interference, estimate it: "
        f"[nuisance] hum_Hz = {frequency:.5g})"
    )
    return [(np.hstack([series * wave.real, series * wave.imag]), words, True)]


def _initial_values(problem: Problem, theta: FloatArray) -> Iterator[Candidate]:
    """Known initial values, each of every record by itself, by differences."""
    for number, (model, record) in enumerate(zip(problem.models, problem.records, strict=True)):
        where = f" of {record.name}" if len(problem.records) > 1 else ""
        for i in model.known_initial:
            tables = [np.zeros_like(data) for data in problem.measured]
            step = 1e-4 * (float(np.abs(problem.runs[number].x[:, i]).max()) or 1.0)
            begin = (*model.initial[:i], model.initial[i] + step, *model.initial[i + 1 :])
            both = (model, replace(model, initial=begin))
            try:
                y, moved = (simulate(one, theta, record, sensitivities=False).y for one in both)
            except SimulationError:
                continue
            tables[number] = (moved - y) / step
            column, name, value = problem.vector(tables)[:, None], model.states[i], float(model.initial[i])
            words = (
                f"the residuals contradict the initial value {value:.4g} of {name}{where}, about "
                f"{value:.6g} + ({{0:.3g}}) would suit them (estimate it: [initial] {name} = "
                f'"{name}_0", with {name}_0 in [estimate])'
            )
            yield column, words, False


# -- errors of the outputs, of the integration and of the times


def output_errors(problem: Problem, r: FloatArray, n_parameters: int) -> dict[str, float]:
    """Standard deviation of each output from its residuals; none where only rounding is left."""
    if _rounding_only(problem, r):
        return {}
    rows: dict[str, list[FloatArray]] = {}
    for name, _, part in problem.series:
        rows.setdefault(name, []).append(r[part] / problem.scale[part])
    share = 1 - min(n_parameters / len(r), 0.9)
    errors = {name: float(np.sqrt(np.mean(np.concatenate(x) ** 2) / share)) for name, x in rows.items()}
    least = 1e-6 * max(errors.values())  # an output that is met exactly would count for everything
    return {name: max(size, least) for name, size in errors.items()}


def _errors_words(problem: Problem, estimate: Estimate, r: FloatArray, linear: bool) -> Iterator[str]:
    """Where errors are unequal, or not as stated."""
    sizes = {
        words: np.sqrt(np.mean((r[rows] / problem.scale[rows]) ** 2))
        for _, words, rows in problem.series
        if rows.stop - rows.start >= FEWEST
    }
    alike = problem.stated or problem.errors or _rounding_only(problem, r) or not sizes
    if linear and not alike and max(sizes.values()) >= 2 * min(sizes.values()):
        yield (
            f"the outputs have different errors ({', '.join(f'{n} {s:.2g}' for n, s in sizes.items())}), "
            "but the intervals hold for equal ones. With --sigma auto precise outputs count for more"
        )
    if estimate.chi_square is not None and estimate.dof > 0:
        ratio = np.sqrt(estimate.chi_square / estimate.dof)
        if why := estimate.misfit():
            yield f"{why}: intervals are too narrow, or the model does not quite describe the record"
        elif ratio < 0.7 and _chance(estimate.chi_square, estimate.dof) > 1 - CHANCE:
            yield f"residuals are only {ratio:.2g} times as large as the stated errors: these are too large"


def _integration(problem: Problem, estimate: Estimate, J: FloatArray) -> tuple[FloatArray | None, str]:
    """Change of the parameters at a tighter tolerance (n,), None where the solution is exact; and words."""
    theta, integrator = estimate.solution, problem.runs[0].integrator
    if integrator in ("expm", "taylor", "none"):
        return None, ""
    finer = problem.integrator, max(problem.rtol / 100, 1e-13)
    if integrator in STEPWISE:
        finer = "auto", RTOL
    missed = problem.residual(theta) - problem.again(*finer, problem.errors).residual(theta)
    change = solution(problem.prior.below(J), np.append(missed, np.zeros(len(problem.prior))), rcond=RCOND)
    std = np.full(len(change), np.nan) if estimate.std is None else estimate.std
    words = [
        f"{name} by about {c:.2g}" + ("" if np.isnan(s) else f" (standard deviation {s:.2g})")
        for name, x, c, s in zip(estimate.names, theta, change, std, strict=True)
        if abs(c) > max(1e-8 * abs(x), 0.1 * np.nan_to_num(s))
    ]
    return change, f"a more accurate integration would change {', '.join(words)}" if words else ""


def _times_words(problem: Problem, theta: FloatArray) -> Iterator[str]:
    """Where vibrations about the first states are faster than samples can tell, or a record begins late."""
    model, record, n = problem.model, problem.records[0], len(problem.model.states)
    A = model.f(record.t[0], problem.runs[0].x[0], theta, problem.inputs[0][0])[:, 1 : 1 + n]
    if len(record) > 2 and n and np.isfinite(A).all():
        fastest, most = np.abs(np.linalg.eigvals(A).imag).max(), np.pi / np.median(np.diff(record.t))
        if fastest > most:
            yield (
                f"the model can vibrate with {fastest:.4g} rad/s, faster than half the sampling rate "
                f"({most:.4g} rad/s): slower vibrations may describe the record as well. Are the times in "
                "seconds, and not in ms?"
            )
    late = [one for one in problem.records if one.t[0] != 0]
    if model.t0 is None and late and model.known_initial:
        yield (
            f"{late[0].name} begins at t = {late[0].t[0]:.6g} s, and the initial values were put there: "
            'state where they belong, t0 = 0 in [initial] (the time 0) or t0 = "first" (the first time of '
            "each record)"
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


def combined(problem: Problem, estimate: Estimate) -> tuple[Estimate, str]:
    """The estimate with combinations that hold for the nonlinear model, and a warning or nothing."""
    if estimate.full_rank:
        return estimate, ""
    theta, names = estimate.solution, np.array(estimate.names)
    scale = np.where(theta == 0, 1.0, np.abs(theta))
    other = theta + 0.2 * scale * np.linspace(1.0, -0.7, len(theta))
    points, spaces = [theta], [estimate.row_space]
    if np.isfinite(problem.residual(other)).all():
        points.append(other)
        spaces.append(least_squares(problem.jacobian(other), problem.data, rcond=RCOND).row_space)
    problem.residual(theta)  # the problem keeps the runs of the last point
    # tangents, without standard deviations
    near = [replace(c, words=f"(near these values) {c.words}", std=None) for c in estimate.combinations]
    tangents = replace(estimate, curved=tuple(near))
    if len(spaces[-1]) > len(spaces[0]):
        return tangents, (
            f"the record's sensitivity to {', '.join(estimate.undetermined)} (or to a combination) vanishes "
            "at the values found, but not beside them: it may be determined after all; start elsewhere"
        )
    null = [np.linalg.svd(rows * scale)[2][len(rows) :] for rows in spaces]
    rows = [scale * (names == name) for name in names if name not in estimate.undetermined]
    chosen: list[Combination] = []
    by = problem.model.symbols[1 + len(problem.model.states) :][: len(theta)]
    for expression in _candidates(problem.model, by):
        if len(rows) == estimate.rank:
            break
        compiled = Compiled(by, jacobian([expression], by), (1 + len(by),))
        tables = [compiled.one(point.tolist()) for point in points]
        gradients = [table[1:] * scale for table in tables]
        sizes = [float(np.linalg.norm(g)) for g in gradients]
        if not all(
            0 < size < np.inf and np.linalg.norm(N @ g) <= 1e-5 * size
            for N, g, size in zip(null, gradients, sizes, strict=True)
        ):
            continue
        if np.linalg.matrix_rank(np.array([*rows, gradients[0]]), tol=1e-6 * sizes[0]) > len(rows):
            rows.append(gradients[0])
            cov, value, slope = estimate.solution_covariance, tables[0][0], tables[0][1:]
            std = None if cov is None else float(np.sqrt(max(float(slope @ cov @ slope), 0.0)))
            words = str(usual(expression)).replace("**", "^").replace("*", "·")  # such as a·b^2/c
            chosen.append(Combination(words, float(value), std, slope))
    return (replace(estimate, curved=tuple(chosen)) if len(rows) == estimate.rank else tangents), ""


def _candidates(model: OdeModel, parameters: list[Any]) -> Iterator[Any]:
    """Coefficients of the equations, the simple ones first, then products and quotients of two."""
    import sympy

    varying = {*model.symbols} - {*parameters}
    parts: dict[Any, None] = {}
    for expression in (*model.rates, *model.observed, *model.initial, *model.inertia):
        terms: dict[Any, Any] = {}
        """Coefficient of what varies."""
        for term in sympy.Add.make_args(sympy.expand(expression)):
            coefficient, rest = term.as_independent(*varying, as_Add=False)
            terms[rest] = terms.get(rest, 0) + coefficient
        for rest, coefficient in terms.items():
            inside = (part for part in sympy.preorder_traversal(rest) if part.args)
            for part in (sympy.factor_terms(sympy.together(coefficient)), *inside):
                if part.free_symbols and not part.free_symbols & varying:
                    parts[sympy.Mul(*(f for f in sympy.Mul.make_args(part) if not f.is_number))] = None
    single = sorted(parts, key=lambda e: (sympy.count_ops(e), str(e)))
    yield from single
    for a, b in combinations(single[:24], 2):
        yield from (a * b, a / b)
