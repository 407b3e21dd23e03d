"""What must be known of a fit to time records before its numbers are used: a few checks, the worst first.

A series is one output of one record; each is judged by itself, as outputs may have other units. What
residuals may hold beside noise, an offset, a drift, hum or a wrong initial value, is a column c beside the
sensitivities J: its part outside them, c⊥, takes (c⊥ᵀr)²/c⊥ᵀc⊥ of the sum of squares. So hum is looked for
in a periodogram that gives back what the parameters have taken of a sinusoid, beside a resonance most of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.identify.combinations_records import combined
from rotorid.identify.ode import SimulationError
from rotorid.identify.record_residuals import RTOL, Iterations, Problem, at
from rotorid.identify.simulation import STEPWISE, simulate
from rotorid.regression import gain, least_squares, solution
from rotorid.regression.estimate import Estimate
from rotorid.regression.normal_matrix import NormalMatrix, normal_matrix
from rotorid.regression.prior import PriorEffect, effect
from rotorid.regression.search import RCOND

FEWEST, LAGS = 20, 10
"""Samples below which nothing can be said of correlations; neighbours that are looked at."""
UNEXPLAINED, FEW_UNEXPLAINED, LINE, MISFIT = 0.05, 0.2, 0.5, 4.0
"""Shares of a series' variance in residuals that are not white, in too few of them to tell, and of these in a
line of the spectrum, and χ² per degree of freedom, above which a record is not described."""
CHANCE = 1e-6
"""Probability below which residuals or what takes a share of them are no noise."""
PEAK = 10.0
"""Height of a peak of the periodogram over the noise that is worth a test."""
SHARE, FAR = 0.3, 5.0
"""Of the variance, or standard deviations of a parameter: what a cause takes or moves if it is named."""
HINT = (
    "a local minimum or an unsuitable model; try other starting values, bounds or several "
    "starts. No intervals are given"
)


@dataclass(frozen=True, eq=False)
class Judgement:
    """The estimate, without intervals where these would mislead (not `reliable`), and what was noticed."""

    estimate: Estimate
    reliable: bool
    warnings: tuple[str, ...]
    integration_change: FloatArray | None
    autocorrelation: float | None
    prior: PriorEffect | None
    normal_matrix: NormalMatrix | None


def judge(problem: Problem, path: Iterations, loss: str, poor: str | None = None) -> Judgement:
    """Look at convergence, bounds, rank, integration error and residuals of a fit; `poor` is its `misfit`."""
    estimate, theta = path.estimate, path.estimate.solution
    words = ["" if path.converged else f"{path.message}; no intervals are given"]
    try:
        _, J = problem.evaluate(theta)
    except SimulationError as error:
        words.append(f"the model cannot be simulated with the result: {error}")
        return Judgement(_widened(estimate, None), False, tuple(filter(None, words)), None, None, None, None)
    r, linear = estimate.residuals, loss == "linear"
    prior = effect(problem.prior, J, r, theta, stated=problem.stated, at_bounds=path.at_bounds)
    if prior is not None:
        if prior.alone:  # in the words of the nonlinear model, not of its tangents
            alone = at(least_squares(J, -r, names=estimate.names, sigma=1.0, rcond=RCOND), theta, r)
            prior = replace(prior, alone=combined(problem, alone)[0].describe_rank())
        estimate, r = prior.apart(estimate, stated=problem.stated), prior.best  # of the data alone
    seen = correlation(problem, r)
    poor = misfit(problem, estimate.dof, r, loss) if poor is None or prior else poor
    cause, wrong = causes(problem, theta, J, r, seen) if path.converged and linear else ("", False)
    change = _integration_change(problem, theta, J)
    words += [_integration_words(estimate, change), poor, cause, path.bound_warning]
    if path.converged:
        estimate, local = combined(problem, estimate)
        words += [local, "" if estimate.full_rank or poor else estimate.describe_rank()]
    words += [] if prior is None else prior.warnings
    if not poor:
        words += [_unequal_words(problem, r) if linear else "", _correlated_words(seen)]
        words.append(_against_stated(estimate))
    words += [_too_fast(problem, theta), _begins_later(problem)]
    sound = path.converged and not poor and not wrong and not problem.prior.ridge
    widening = 1.0 if seen is None else seen.widening
    if not sound or widening > 1:
        estimate = _widened(estimate, widening if sound else None)
    return Judgement(
        estimate=estimate,
        reliable=sound and widening == 1,
        warnings=tuple(filter(None, words)),
        integration_change=change,
        autocorrelation=seen and seen.neighbours,
        prior=prior,
        normal_matrix=normal_matrix(estimate.names, path.regression[0] if path.regression else J),
    )


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
    for name, data, part in zip(
        problem.series_names, problem.split(problem.data), problem.split(r), strict=True
    ):
        kept = part
        if loss != "linear":  # without outliers
            limit = 3 * 1.4826 * float(np.median(np.abs(part)))
            kept = np.clip(part, -limit, limit)
        share = float(kept @ kept) / max(float(np.sum((data - data.mean()) ** 2)), 1e-300)
        left = f"the model leaves {100 * share:.2g} % of the variance of {name}"
        if len(part) < FEWEST:
            if share > FEW_UNEXPLAINED and len(part) > 2 and np.ptp(data) > 0:
                return f"{left}, in too few samples to tell whether that is noise; if not, {HINT}"
        elif _correlation([kept]).probability < CHANCE:
            if share > UNEXPLAINED:
                return f"{left}, and not as noise: {HINT}"
            power = np.abs(np.fft.rfft(kept - kept.mean())[1:]) ** 2
            if np.convolve(power, np.ones(3), "same").max() > LINE * power.sum():
                return f"{left}, most of it at one frequency: {HINT}; state the errors if it is interference"
    return ""


# -- correlated residuals


class Correlation(NamedTuple):
    """Of residuals with those some samples later.

    Of neighbours, the probability of such correlations up to the tenth neighbour in white residuals (Box and
    Pierce 1970), and how many times too narrow intervals are, with correlations that fade as the first.
    """

    neighbours: float
    probability: float
    factor: float

    @property
    def widening(self) -> float:
        """By what intervals are multiplied; 1 where the residuals may be white, or it does not matter."""
        return self.factor if self.probability < 1e-4 and self.factor > 1.2 else 1.0


def correlation(problem: Problem, r: FloatArray) -> Correlation | None:
    """Over all series, each in its own unit; None where there is nothing to say."""
    if len(r) < FEWEST or rounding_only(problem, r):
        return None
    return _correlation(problem.split(r))


def rounding_only(problem: Problem, r: FloatArray) -> bool:
    """Whether nothing but rounding is left."""
    return bool(np.linalg.norm(r) <= 1e-7 * np.linalg.norm(problem.data))


def _correlation(series: list[FloatArray]) -> Correlation:
    parts = [part / (float(np.sqrt(np.mean(part**2))) or 1.0) for part in series]
    total, size = sum(float(part @ part) for part in parts), sum(map(len, parts))
    lags = range(1, 1 + min(LAGS, max(1, min(len(part) for part in parts) // 5)))
    rho = np.array([sum(float(part[k:] @ part[:-k]) for part in parts) for k in lags]) / (total or 1.0)
    first = float(rho[0])
    factor = float(np.sqrt((1 + first) / (1 - first))) if 0 < first < 1 else 1.0
    return Correlation(first, _chance(size * float(rho @ rho), len(rho)), factor)


def _correlated_words(seen: Correlation | None) -> str:
    if seen is None or not seen.probability < 1e-4:
        return ""
    longer = f": intervals were made {seen.widening:.2g} times as wide" if seen.widening > 1 else ""
    return (
        "the residuals are not random: those of neighbouring samples are correlated "
        f"({seen.neighbours:.2f}, Durbin–Watson {2 - 2 * seen.neighbours:.2f}){longer}. Either the noise is, "
        "or the model does not quite describe the record, or this is a local minimum (try several starts)"
    )


def _chance(chi_square: float, dof: int) -> float:
    """Probability of a larger χ²."""
    from scipy.special import chdtrc

    return float(chdtrc(dof, chi_square))


# -- causes


def causes(
    problem: Problem, theta: FloatArray, J: FloatArray, r: FloatArray, seen: Correlation | None
) -> tuple[str, bool]:
    """Words about what residuals point at, and whether intervals without it would be wrong.

    Parameters
    ----------
    problem, theta
        What was fitted, and the minimum (n,).
    J, r, seen
        Sensitivities (m, n) and residuals (m,) there, and their `correlation`.
    """
    if seen is None:
        return "", False
    candidates = _hum(problem, J, r)
    if seen.probability < 1e-2:
        candidates += [*_offset_and_drift(problem), *_initial_values(problem, theta)]
    G = gain(J, rcond=RCOND) if candidates else J.T
    tested = [_tested(problem, J, G, r, *candidate) for candidate in candidates]
    named = sorted((one for one in tested if one is not None), reverse=True)
    named = [one for one in named if one[0] > 0.9 * named[0][0]]  # as good as the best
    if not named:
        return "", False
    wrong, moved = all(shift > FAR for _, shift, _ in named), max(shift for _, shift, _ in named)
    which = "; or ".join(words for *_, words in named)
    share = 100 * named[0][0] / float(r @ r)
    off = f", and move a parameter by {moved:.2g} standard deviations" if moved > 1 else ""
    end = ". No intervals are given" if wrong else ""
    return f"{which}: that would take {share:.2g} % of the residuals' variance{off}{end}", wrong


def _tested(
    problem: Problem, J: FloatArray, G: FloatArray, r: FloatArray, C: FloatArray, words: str, alone: bool
) -> tuple[float, float, str] | None:
    """What columns (m, q) take of the residuals, how far they move a parameter, and words.

    None for what chance may give, what the parameters give, and beside what is no noise if it has to be
    alone. G is the gain of J: J G y is what the parameters take of y.
    """
    from scipy.special import chdtrc, fdtrc

    size = np.maximum(np.linalg.norm(C, axis=0), 1e-300)
    C = C / size
    outside = C - J @ (G @ C)
    q, free = C.shape[1], len(r) - round(float(np.sum(G.T * J))) - C.shape[1]
    if free < 3 or np.linalg.norm(outside, axis=0).min() < 1e-6 or np.linalg.cond(outside) > 1e8:
        return None
    amount = solution(outside, -r)
    rest = r + outside @ amount
    taken, left = float(r @ r - rest @ rest), correlation(problem, rest)
    spread = float(rest @ rest) / free * (1.0 if left is None else left.factor**2)
    spread = max(spread, 1.0 if problem.stated else 1e-300)
    probability = chdtrc(q, taken / spread) if problem.stated else fdtrc(q, free, taken / spread / q)
    # a line beside others is rather a vibration that the model does not describe
    if not probability < CHANCE or (alone and left and left.probability < CHANCE):
        return None
    move, error = G @ (C @ amount), np.sqrt(spread * (G**2).sum(axis=1))
    shift = float(np.max(np.abs(move) / np.maximum(error, 1e-300)))
    if taken < SHARE * float(r @ r) and shift < FAR:
        return None
    return taken, shift, words.format(amount[0] / size[0])


Candidate = tuple[FloatArray, str, bool]
"""Columns (m, q), what to do ({0}: size of the first), and whether only noise may be left."""


def _series_columns(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Times of the rows (m, 1), and a constant of each series (m, g)."""
    t = problem.vector([np.tile(x.t[:, None], len(problem.model.outputs)) for x in problem.records])
    w = problem.vector([np.ones_like(data) for data in problem.measured])
    which = np.repeat(np.arange(len(problem.series)), [*problem.series.values()])
    return (t / w)[:, None], (which[:, None] == np.arange(len(problem.series))) * w[:, None]


def _offset_and_drift(problem: Problem) -> Iterator[Candidate]:
    t, series = _series_columns(problem)
    yield series, "the residuals have an offset (estimate it: [nuisance] offset = true)", False
    yield series * t, "the residuals drift (estimate it: [nuisance] drift = true)", False


def _hum(problem: Problem, J: FloatArray, r: FloatArray) -> list[Candidate]:
    """The frequency of a sinusoid that takes most of a series' residuals, with all parameters free."""
    t, series = _series_columns(problem)
    Q = np.linalg.svd(J, full_matrices=False)[0]
    best, frequency, span = 0.0, 0.0, 1.0
    for column in series.T:
        rows = column != 0
        n, times = int(rows.sum()), t[rows, 0]
        if n < FEWEST:
            continue
        even = np.linspace(times[0], times[-1], n)
        parts = np.column_stack([r, Q])[rows] * column[rows, None]
        waves = np.fft.rfft([np.interp(even, times, part) for part in parts.T], 4 * n)[:, 4:]
        (c, s), (a, b) = (waves[0].real, waves[0].imag), (waves[1:].real, waves[1:].imag)
        half = float(column[rows] @ column[rows]) / 2
        cc, ss, cs = half - (a * a).sum(axis=0), half - (b * b).sum(axis=0), -(a * b).sum(axis=0)
        det = cc * ss - cs**2
        power = np.where(det > 1e-3 * half**2, (ss * c**2 - 2 * cs * c * s + cc * s**2) / det, 0.0)
        if power.max() > best * float(r @ r):
            best, span = float(power.max() / (r @ r)), float(times[-1] - times[0])
            frequency = (4 + int(np.argmax(power))) / (4 * n) * (n - 1) / span
    if best < 2 * PEAK / len(r):  # (c⊥ᵀr)² over the mean square of the residuals is χ² of noise
        return []
    for mains in (50.0, 60.0):
        whole = mains * max(1, round(frequency / mains))
        frequency = whole if abs(whole - frequency) < 0.5 / span else frequency
    phase = 2 * np.pi * frequency * t
    words = (
        f"the residuals hum with {frequency:.5g} Hz (if that is interference, estimate it: "
        f"[nuisance] hum_Hz = {frequency:.5g})"
    )
    return [(np.hstack([series * np.cos(phase), series * np.sin(phase)]), words, True)]


def _initial_values(problem: Problem, theta: FloatArray) -> Iterator[Candidate]:
    """Known initial values, each of every record by itself."""
    n = len(theta)
    for number, (model, record) in enumerate(zip(problem.models, problem.records, strict=True)):
        if not model.known_initial:
            continue
        try:
            start = np.concatenate([theta, model.x0(theta)[:, 0]])
            run = simulate(
                model.with_free_start, start, record, integrator=problem.integrator, rtol=problem.rtol
            )
        except SimulationError:
            continue
        where = f" of {record.name}" if len(problem.records) > 1 else ""
        for i in model.known_initial:
            tables = [np.zeros_like(data) for data in problem.measured]
            tables[number] = run.y_theta[:, :, n + i]
            column, name = problem.vector(tables)[:, None], model.states[i]
            words = (
                f"the residuals contradict the initial value {start[n + i]:.4g} of {name}{where}, about "
                f"{start[n + i]:.6g} + ({{0:.3g}}) would suit them (estimate it: [initial] {name} = "
                f'"{name}_0", with {name}_0 in [estimate])'
            )
            if column.any():
                yield column, words, False


# -- errors of the outputs


def output_errors(problem: Problem, r: FloatArray, n_parameters: int) -> dict[str, float]:
    """Standard deviation of each output from its residuals; none where only rounding is left."""
    if rounding_only(problem, r):
        return {}
    squares: dict[str, FloatArray] = {}
    for (_, name), part in zip(problem.series, problem.split(problem.plain(r)), strict=True):
        squares[name] = np.append(squares.get(name, ()), part**2)
    share = 1 - min(n_parameters / len(r), 0.9)
    errors = {name: float(np.sqrt(part.mean() / share)) for name, part in squares.items()}
    least = 1e-6 * max(errors.values())  # an output that is met exactly would count for everything
    return {name: max(size, least) for name, size in errors.items()}


def _unequal_words(problem: Problem, r: FloatArray) -> str:
    """Where series of some length have errors of very different size."""
    sizes = {
        name: float(np.sqrt(np.mean(part**2)))
        for name, part in zip(problem.series_names, problem.split(problem.plain(r)), strict=True)
        if len(part) >= FEWEST
    }
    least, most = min(sizes.values(), default=1.0), max(sizes.values(), default=1.0)
    if problem.stated or problem.errors or rounding_only(problem, r) or most < 2 * least:
        return ""
    return (
        f"the outputs have different errors ({', '.join(f'{n} {size:.2g}' for n, size in sizes.items())}), "
        "but the intervals hold for equal ones. With --sigma auto precise outputs count for more"
    )


def _against_stated(estimate: Estimate) -> str:
    """Whether the residuals are as large as stated errors let one expect."""
    chi_square, dof = estimate.chi_square, estimate.dof
    if not estimate.errors_stated or dof <= 0 or chi_square is None:
        return ""
    if why := estimate.misfit():
        return f"{why}: intervals are too narrow, or the model does not quite describe the record"
    ratio = np.sqrt(chi_square / dof)
    if ratio < 0.7 and _chance(chi_square, dof) > 1 - CHANCE:
        return f"residuals are only {ratio:.2g} times as large as the stated errors: these are too large"
    return ""


# -- the integration and the times


def _integration_change(problem: Problem, theta: FloatArray, J: FloatArray) -> FloatArray | None:
    """Change of the parameters at a tighter tolerance (n,); None where the solution is exact."""
    integrator = problem.runs[0].integrator
    if integrator in ("expm", "taylor", "none"):
        return None
    r, rtol = problem.residual(theta), max(problem.rtol / 100, 1e-13)
    finer = problem.again("auto", RTOL) if integrator in STEPWISE else problem.again(problem.integrator, rtol)
    missed = r - finer.residual(theta)
    if not np.linalg.norm(missed) > 1e-14 * np.linalg.norm(problem.data):
        return np.zeros(len(theta))
    K = problem.prior.below(J)
    change: FloatArray = solution(K, np.append(missed, np.zeros(len(K) - len(J))), rcond=RCOND)
    return change


def _integration_words(estimate: Estimate, change: FloatArray | None) -> str:
    if change is None:
        return ""
    unknown = np.full(len(change), np.nan)
    std = unknown if estimate.std is None else estimate.std
    limit = np.maximum(1e-8 * np.abs(estimate.solution), 0.1 * np.nan_to_num(std))
    words = [
        f"{name} by about {c:.2g}" + ("" if np.isnan(s) else f" (standard deviation {s:.2g})")
        for name, c, s, most in zip(estimate.names, change, std, limit, strict=True)
        if abs(c) > most
    ]
    return f"a more accurate integration would change {', '.join(words)}" if words else ""


def _too_fast(problem: Problem, theta: FloatArray) -> str:
    """Words where small vibrations about the first states are faster than samples can tell."""
    model, record, n = problem.model, problem.records[0], len(problem.model.states)
    A = model.f(record.t[0], problem.runs[0].x[0], theta, problem.inputs[0][0])[:, 1 : 1 + n]
    if len(record) < 3 or not n or not np.isfinite(A).all():
        return ""
    fastest, step = np.abs(np.linalg.eigvals(A).imag).max(), np.median(np.diff(record.t))
    if fastest * step <= np.pi:
        return ""
    return (
        f"the model can vibrate with {fastest:.4g} rad/s, faster than half the sampling rate "
        f"({np.pi / step:.4g} rad/s): slower vibrations may describe the record as well. Are the times in "
        "seconds, and not in ms?"
    )


def _begins_later(problem: Problem) -> str:
    """Ask where the known initial values belong, if the record does not begin at 0."""
    model, late = problem.model, [record for record in problem.records if record.t[0] != 0]
    if model.t0 is not None or not late or not model.known_initial:
        return ""
    return (
        f"{late[0].name} begins at t = {late[0].t[0]:.6g} s, and the initial values were put there: state "
        'where they belong, t0 = 0 in [initial] (the time 0) or t0 = "first" (the first time of each record)'
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
