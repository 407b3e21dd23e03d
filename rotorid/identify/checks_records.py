"""What must be known of a fit to time records before its numbers are used: five checks, the worst first.

The model does not describe the record; residuals are correlated; they point at an offset, a drift, hum or a
wrong initial value; the integration is not exact; the times cannot be as they are stated. A series is one
output of one record; each is judged by itself, as outputs may have other units. What residuals may hold
beside noise is a column c beside the sensitivities J: its part outside them, c⊥, takes (c⊥ᵀr)²/c⊥ᵀc⊥ of the
sum of squares. So hum is looked for in a periodogram that gives back what the parameters have taken of a
sinusoid, beside a resonance most of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.combinations_records import combined
from rotorid.identify.ode import SimulationError
from rotorid.identify.record_residuals import RTOL, Iterations, Problem, at
from rotorid.identify.simulation import STEPWISE, simulate
from rotorid.regression import gain, least_squares, solution
from rotorid.regression.estimate import Estimate
from rotorid.regression.normal_matrix import normal_matrix
from rotorid.regression.prior import effect
from rotorid.regression.search import RCOND

FEWEST, LAGS = 20, 10
"""Samples below which nothing can be said of correlations; neighbours that are looked at."""
UNEXPLAINED, FEW_UNEXPLAINED, LINE, MISFIT = 0.05, 0.2, 0.5, 4.0
"""Shares of a series' variance in residuals that are not white, in too few of them to tell, and of these in a
line of the spectrum, and χ² per degree of freedom, above which a record is not described."""
CHANCE = 1e-6
"""Probability below which residuals or what takes a share of them are no noise."""
SHARE, FAR = 0.3, 5.0
"""Of the variance, or standard deviations of a parameter: what a cause takes or moves if it is named."""
HINT = (
    "a local minimum or an unsuitable model; try other starting values, bounds or several "
    "starts. No intervals are given"
)
Candidate = tuple[FloatArray, str, bool]
"""Columns (m, q), what to do ({0}: size of the first), and whether only noise may be left."""


class Correlation(NamedTuple):
    """Of residuals with those some samples later.

    Of neighbours, the probability of such correlations up to the tenth neighbour in white residuals (Box and
    Pierce 1970), how many times too narrow intervals are, with correlations that fade as the first, and by
    what they are multiplied: by 1 where the residuals may be white, or it does not matter.
    """

    neighbours: float
    probability: float
    factor: float
    widening: float


def judge(problem: Problem, path: Iterations, loss: str, poor: str | None = None) -> dict[str, Any]:
    """The estimate of a fit, without intervals where these would mislead, and all else that `Fit` says of it.

    `poor` is its `misfit`, if that is known.
    """
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
    seen = None if len(r) < FEWEST or rounding_only(problem, r) else _correlation(problem, r)
    poor = misfit(problem, estimate.dof, r, loss) if poor is None or prior else poor
    cause, wrong = causes(problem, theta, J, r, seen) if seen and path.converged and linear else ("", False)
    change, integration = _integration(problem, estimate, J)
    words += [integration, poor, cause, path.bound_warning]
    if path.converged:
        estimate, local = combined(problem, estimate)
        words += [local, "" if estimate.full_rank or poor else estimate.describe_rank()]
    words += [] if prior is None else prior.warnings
    words += [] if poor else _errors_words(problem, estimate, r, seen, linear)
    words += _times_words(problem, theta)
    sound = path.converged and not poor and not wrong and not problem.prior.ridge
    widening = 1.0 if seen is None else seen.widening
    if not sound or widening > 1:
        estimate = _widened(estimate, widening if sound else None)
    return judged | {
        "estimate": estimate,
        "reliable": sound and widening == 1,
        "warnings": words,
        "integration_change": change,
        "autocorrelation": seen and seen.neighbours,
        "prior": prior,
        "normal_matrix": normal_matrix(estimate.names, path.regression[0] if path.regression else J),
    }


def misfit(problem: Problem, dof: int, r: FloatArray, loss: str) -> str:
    """Words where the model does not describe the record: intervals would be wrong."""
    if not problem.data.any():
        return "the record is zero throughout: a sensor without a signal?"
    if dof <= 0 or rounding_only(problem, r):
        return ""
    if problem.stated:
        ratio = float(r @ r) / dof
        if loss == "linear" and ratio > MISFIT and _chance(float(r @ r), dof) < CHANCE:
            return f"residuals are {np.sqrt(ratio):.2g} times as large as the stated errors explain: {HINT}"
        return ""
    for _, name, rows in problem.series:
        data, part = problem.data[rows], r[rows]
        if loss != "linear":  # without outliers
            limit = 3 * 1.4826 * float(np.median(np.abs(part)))
            part = np.clip(part, -limit, limit)
        share = float(part @ part) / max(float(np.sum((data - data.mean()) ** 2)), 1e-300)
        left = f"the model leaves {100 * share:.2g} % of the variance of {name}"
        if len(part) < FEWEST:
            if share > FEW_UNEXPLAINED and len(part) > 2 and np.ptp(data) > 0:
                return f"{left}, in too few samples to tell whether that is noise; if not, {HINT}"
        elif _correlated([part]).probability < CHANCE:
            if share > UNEXPLAINED:
                return f"{left}, and not as noise: {HINT}"
            power = np.abs(np.fft.rfft(part - part.mean())[1:]) ** 2
            if np.convolve(power, np.ones(3), "same").max() > LINE * power.sum():
                return f"{left}, most of it at one frequency: {HINT}; state the errors if it is interference"
    return ""


def rounding_only(problem: Problem, r: FloatArray) -> bool:
    """Whether nothing but rounding is left."""
    return bool(np.linalg.norm(r) <= 1e-7 * np.linalg.norm(problem.data))


def _correlation(problem: Problem, r: FloatArray) -> Correlation:
    """Over all series, each in its own unit."""
    return _correlated([r[rows] for *_, rows in problem.series])


def _correlated(series: list[FloatArray]) -> Correlation:
    parts = [part / (float(np.sqrt(np.mean(part**2))) or 1.0) for part in series]
    total, size = sum(float(part @ part) for part in parts), sum(map(len, parts))
    lags = range(1, 1 + min(LAGS, max(1, min(len(part) for part in parts) // 5)))
    rho = np.array([sum(float(part[k:] @ part[:-k]) for part in parts) for k in lags]) / (total or 1.0)
    first, probability = float(rho[0]), _chance(size * float(rho @ rho), len(rho))
    factor = float(np.sqrt((1 + first) / (1 - first))) if 0 < first < 1 else 1.0
    return Correlation(first, probability, factor, factor if probability < 1e-4 and factor > 1.2 else 1.0)


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
    from scipy.special import chdtrc, fdtrc

    t = problem.vector([np.tile(x.t[:, None], len(problem.model.outputs)) for x in problem.records])
    t, series = (t / problem.scale)[:, None], np.zeros((len(r), len(problem.series)))
    for j, (*_, rows) in enumerate(problem.series):
        series[rows, j] = problem.scale[rows]
    candidates = [*_hum(problem, t[:, 0], series, J, r)]
    if seen.probability < 1e-2:
        candidates += [
            (series, "the residuals have an offset (estimate it: [nuisance] offset = true)", False),
            (series * t, "the residuals drift (estimate it: [nuisance] drift = true)", False),
        ]
        candidates += _initial_values(problem, theta)
    G = gain(J, rcond=RCOND) if candidates else J.T  # what the parameters take of y is J G y
    named: list[tuple[float, float, str]] = []
    for columns, words, alone in candidates:
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        C = columns / size
        outside, q = C - J @ (G @ C), C.shape[1]
        free = len(r) - round(float(np.sum(G.T * J))) - q
        if free < 3 or np.linalg.norm(outside, axis=0).min() < 1e-6 or np.linalg.cond(outside) > 1e8:
            continue
        amount = solution(outside, -r)
        rest = r + outside @ amount
        taken, left = float(r @ r - rest @ rest), float(rest @ rest) / free
        white = rounding_only(problem, rest)
        after = Correlation(0.0, 1.0, 1.0, 1.0) if white else _correlation(problem, rest)
        spread = max(left * after.factor**2, 1.0 if problem.stated else 1e-300)
        probability = chdtrc(q, taken / spread) if problem.stated else fdtrc(q, free, taken / spread / q)
        move, error = G @ (C @ amount), np.sqrt(spread * (G**2).sum(axis=1))
        shift = float(np.max(np.abs(move) / np.maximum(error, 1e-300)))
        # a line beside others is rather a vibration that the model does not describe
        noise = not alone or after.probability >= CHANCE
        if probability < CHANCE and noise and (taken >= SHARE * float(r @ r) or shift >= FAR):
            named.append((taken, shift, words.format(amount[0] / size[0])))
    named = [
        one for one in sorted(named, reverse=True) if one[0] > 0.9 * max(named)[0]
    ]  # as good as the best
    if not named:
        return "", False
    wrong, moved = all(shift > FAR for _, shift, _ in named), max(shift for _, shift, _ in named)
    which, share = "; or ".join(words for *_, words in named), 100 * named[0][0] / float(r @ r)
    off = f", and move a parameter by {moved:.2g} standard deviations" if moved > 1 else ""
    end = ". No intervals are given" if wrong else ""
    return f"{which}: that would take {share:.2g} % of the residuals' variance{off}{end}", wrong


def _hum(
    problem: Problem, t: FloatArray, series: FloatArray, J: FloatArray, r: FloatArray
) -> Iterator[Candidate]:
    """The frequency of a sinusoid that takes most of a series' residuals, with all parameters free."""
    Q = np.linalg.svd(J, full_matrices=False)[0]
    best, frequency, span = 0.0, 0.0, 1.0
    for *_, rows in problem.series:
        times, size = t[rows], problem.scale[rows]
        n = len(times)
        if n < FEWEST:
            continue
        even = np.linspace(times[0], times[-1], n)
        parts = np.column_stack([r, Q])[rows] * size[:, None]
        waves = np.fft.rfft([np.interp(even, times, part) for part in parts.T], 4 * n)[:, 4:]
        c, s, a, b = waves[0].real, waves[0].imag, waves[1:].real, waves[1:].imag
        half = float(size @ size) / 2
        cc, ss, cs = half - (a * a).sum(axis=0), half - (b * b).sum(axis=0), -(a * b).sum(axis=0)
        det = cc * ss - cs**2
        power = np.where(det > 1e-3 * half**2, (ss * c**2 - 2 * cs * c * s + cc * s**2) / det, 0.0)
        if power.max() > best:
            best, span = float(power.max()), float(times[-1] - times[0])
            frequency = (4 + int(np.argmax(power))) / (4 * n) * (n - 1) / span
    if best < 20.0 * float(r @ r) / len(r):  # of noise (c⊥ᵀr)² over the mean square is χ² of two
        return
    for mains in (50.0, 60.0):
        whole = mains * max(1, round(frequency / mains))
        frequency = whole if abs(whole - frequency) < 0.5 / span else frequency
    phase = 2 * np.pi * frequency * t[:, None]
    yield (
        np.hstack([series * np.cos(phase), series * np.sin(phase)]),
        f"the residuals hum with {frequency:.5g} Hz (if that is interference, estimate it: "
        f"[nuisance] hum_Hz = {frequency:.5g})",
        True,
    )


def _initial_values(problem: Problem, theta: FloatArray) -> Iterator[Candidate]:
    """Known initial values, each of every record by itself, by differences."""
    for number, (model, record) in enumerate(zip(problem.models, problem.records, strict=True)):
        where = f" of {record.name}" if len(problem.records) > 1 else ""
        for i in model.known_initial:
            tables = [np.zeros_like(data) for data in problem.measured]
            step = 1e-4 * (float(np.abs(problem.runs[number].x[:, i]).max()) or 1.0)
            begin = (*model.initial[:i], model.initial[i] + step, *model.initial[i + 1 :])
            try:
                run, moved = (
                    simulate(one, theta, record, sensitivities=False)
                    for one in (model, replace(model, initial=begin))
                )
            except SimulationError:
                continue
            tables[number] = (moved.y - run.y) / step
            column, name, value = problem.vector(tables)[:, None], model.states[i], float(model.initial[i])
            if column.any():
                yield (
                    column,
                    f"the residuals contradict the initial value {value:.4g} of {name}{where}, about "
                    f"{value:.6g} + ({{0:.3g}}) would suit them (estimate it: [initial] {name} = "
                    f'"{name}_0", with {name}_0 in [estimate])',
                    False,
                )


# -- errors of the outputs, of the integration and of the times


def output_errors(problem: Problem, r: FloatArray, n_parameters: int) -> dict[str, float]:
    """Standard deviation of each output from its residuals; none where only rounding is left."""
    if rounding_only(problem, r):
        return {}
    squares, share = (r / problem.scale) ** 2, 1 - min(n_parameters / len(r), 0.9)
    rows: dict[str, list[FloatArray]] = {}
    for name, _, part in problem.series:
        rows.setdefault(name, []).append(squares[part])
    errors = {name: float(np.sqrt(np.concatenate(parts).mean() / share)) for name, parts in rows.items()}
    least = 1e-6 * max(errors.values())  # an output that is met exactly would count for everything
    return {name: max(size, least) for name, size in errors.items()}


def _errors_words(
    problem: Problem, estimate: Estimate, r: FloatArray, seen: Correlation | None, linear: bool
) -> Iterator[str]:
    """Where errors are unequal, correlated, or not as stated."""
    sizes = {
        words: np.sqrt(np.mean((r[rows] / problem.scale[rows]) ** 2))
        for _, words, rows in problem.series
        if rows.stop - rows.start >= FEWEST
    }
    alike = problem.stated or problem.errors or rounding_only(problem, r) or not sizes
    if linear and not alike and max(sizes.values()) >= 2 * min(sizes.values()):
        yield (
            f"the outputs have different errors ({', '.join(f'{n} {s:.2g}' for n, s in sizes.items())}), "
            "but the intervals hold for equal ones. With --sigma auto precise outputs count for more"
        )
    if seen and seen.probability < 1e-4:
        wide = f": intervals were made {seen.widening:.2g} times as wide" if seen.widening > 1 else ""
        yield (
            "the residuals are not random: those of neighbouring samples are correlated "
            f"({seen.neighbours:.2f}, Durbin–Watson {2 - 2 * seen.neighbours:.2f}){wide}. Either the noise "
            "is, or the model does not quite describe the record, or this is a local minimum (try several "
            "starts)"
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
    finer = ("auto", RTOL)
    if integrator not in STEPWISE:
        finer = problem.integrator, max(problem.rtol / 100, 1e-13)
    missed = problem.residual(theta) - problem.again(*finer, problem.errors).residual(theta)
    change = np.zeros(len(theta))
    if np.linalg.norm(missed) > 1e-14 * np.linalg.norm(problem.data):
        K = problem.prior.below(J)
        change = solution(K, np.append(missed, np.zeros(len(K) - len(J))), rcond=RCOND)
    std = np.full(len(change), np.nan) if estimate.std is None else estimate.std
    limit = np.maximum(1e-8 * np.abs(theta), 0.1 * np.nan_to_num(std))
    words = [
        f"{name} by about {c:.2g}" + ("" if np.isnan(s) else f" (standard deviation {s:.2g})")
        for name, c, s, most in zip(estimate.names, change, std, limit, strict=True)
        if abs(c) > most
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
