"""What residuals point at: offset, drift and hum of the sensors, and wrong initial values.

Each of them is a column beside the sensitivities to the parameters. It is named where it takes more of the
residuals than chance would let it, counting neighbouring residuals that are still correlated without it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rotorid import expressions
from rotorid.base.arrays import FloatArray
from rotorid.regression import gain, solution
from rotorid.regression.search import RCOND
from rotorid.timedomain.integration.simulate import SimulationError, simulate
from rotorid.timedomain.methods.least_squares_problem import Problem
from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.residual_tests import correlation, rounding_only

CHANCE = 1e-6
"""Probability of a column's share by chance, above which it is not named."""
SHARE = 0.3
"""Of the residuals' variance, from which on a column is named even if no parameter depends on it much."""
FAR = 5.0
"""Standard deviations by which a column has to move a parameter so that intervals without it are wrong."""
MAINS = (50.0, 60.0)
AS_GOOD = 0.9
"""Causes that take this share of what the best one takes are named with it."""


@dataclass(frozen=True, eq=False)
class _Cause:
    """Columns (m, q), what to do ({0}: size of the first), and whether only noise may be left."""

    columns: FloatArray
    words: str
    alone: bool = False


@dataclass(frozen=True)
class _Found:
    taken: float
    shift: float
    words: str


def causes(problem: Problem, theta: FloatArray, J: FloatArray, r: FloatArray) -> tuple[tuple[str, ...], bool]:
    """Words about what residuals point at, and whether intervals without it would be wrong.

    Parameters
    ----------
    problem, theta
        What was fitted, and the minimum (n,).
    J, r
        Sensitivities (m, n) and residuals (m,) there.
    """
    if rounding_only(problem, r):
        return (), False
    seen = correlation(problem, r)
    if seen is not None and seen.probability > 1e-2:
        return (), False
    candidates = (*_of_sensors(problem, r), *_of_initial_values(problem, theta))
    G = gain(J, rcond=RCOND)
    tested = [_test(problem, J, G, r, cause) for cause in candidates]
    found = sorted((one for one in tested if one is not None), key=lambda one: -one.taken)
    named = [one for one in found if one.taken > AS_GOOD * found[0].taken]
    if not named:
        return (), False
    wrong = all(one.shift > FAR for one in named)
    moved = max(one.shift for one in named)
    off = f", and move a parameter by {moved:.2g} standard deviations" if moved > 1 else ""
    which = "; or ".join(one.words for one in named)
    share = 100 * named[0].taken / float(r @ r)
    end = ". No intervals are given" if wrong else ""
    return (f"{which}: that would take {share:.2g} % of the residuals' variance{off}{end}",), wrong


def _test(problem: Problem, J: FloatArray, G: FloatArray, r: FloatArray, cause: _Cause) -> _Found | None:
    """What the columns take of the residuals; None for what chance may give, or what the parameters give.

    G is the gain of J: J G y is what the parameters take of y.
    """
    C = cause.columns / np.maximum(np.linalg.norm(cause.columns, axis=0), 1e-300)
    own = C - J @ (G @ C)
    rank = round(float(np.sum(G.T * J)))
    q, free = C.shape[1], len(r) - rank - C.shape[1]
    if free < 3 or np.linalg.norm(own, axis=0).min() < 1e-6 or np.linalg.cond(own) > 1e8:
        return None
    amount = solution(own, -r)
    rest = r + own @ amount
    taken = float(r @ r - rest @ rest)
    left = correlation(problem, rest)
    spread = float(rest @ rest) / free * (1.0 if left is None else left.factor**2)
    spread = max(spread, 1.0) if problem.stated else spread
    # a probability of F, or with stated errors of χ²
    from scipy.special import chdtrc, fdtrc

    ratio = taken / max(spread, 1e-300)
    probability = chdtrc(q, ratio) if problem.stated else fdtrc(q, free, ratio / q)
    if not probability < CHANCE or (cause.alone and left is not None and left.probability < CHANCE):
        return None
    move = G @ (C @ amount)
    error = np.sqrt(spread * (G**2).sum(axis=1))
    shift = float(np.max(np.abs(move) / np.maximum(error, 1e-300)))
    if taken < SHARE * float(r @ r) and shift < FAR:
        return None
    first = amount[0] / max(float(np.linalg.norm(cause.columns[:, 0])), 1e-300)
    return _Found(taken, shift, cause.words.format(first))


def _of_sensors(problem: Problem, r: FloatArray) -> Iterator[_Cause]:
    """Offset, drift and hum, each of every series."""
    t = problem.vector([np.tile(x.t[:, None], len(problem.model.outputs)) for x in problem.records])
    w = problem.vector([np.ones_like(data) for data in problem.measured])
    t = t / w
    which = np.repeat(np.arange(len(problem.groups)), problem.groups)
    series = (which[:, None] == np.arange(len(problem.groups))) * w[:, None]
    yield _Cause(series, "the residuals have an offset (estimate it: [nuisance] offset = true)")
    yield _Cause(series * t[:, None], "the residuals drift (estimate it: [nuisance] drift = true)")
    lines = [_strongest_line(t[which == i], r[which == i]) for i in range(len(problem.groups))]
    share, frequency = max(lines)
    if share > 0:
        phase = 2 * np.pi * frequency * t[:, None]
        words = (
            f"the residuals hum with {frequency:.5g} Hz (if that is interference, estimate it: "
            f"[nuisance] hum_Hz = {frequency:.5g})"
        )
        # a line beside others is rather a vibration that the model does not describe
        yield _Cause(np.hstack([series * np.cos(phase), series * np.sin(phase)]), words, alone=True)


def _strongest_line(t: FloatArray, r: FloatArray) -> tuple[float, float]:
    """Share of a sinusoid in the residuals' squares, and its frequency, Hz; of the mains where it may be."""
    n = len(t)
    if n < 20 or not r.any():
        return 0.0, 0.0
    span = float(t[-1] - t[0])
    even = np.interp(np.linspace(t[0], t[-1], n), t, r)
    peak = 2 + int(np.argmax(np.abs(np.fft.rfft(even - even.mean())[2:])))
    near = (peak + np.linspace(-1, 1, 41)) / span
    power = np.abs(np.exp(2j * np.pi * near[:, None] * t) @ r) ** 2
    best = float(near[np.argmax(power)])
    for mains in MAINS:
        whole = mains * max(1, round(best / mains))
        if abs(whole - best) < 0.5 / span:
            best = whole
    return 2 * float(power.max()) / (n * float(r @ r)), best


def _of_initial_values(problem: Problem, theta: FloatArray) -> Iterator[_Cause]:
    """Known initial values, each of every record by itself."""
    n = len(theta)
    for number, (model, record) in enumerate(zip(problem.models, problem.records, strict=True)):
        if not (known := known_initial(model)):
            continue
        try:
            start = np.concatenate([theta, model.x0(theta)])
            run = simulate(model.with_free_start, start, record, method=problem.integrator, rtol=problem.rtol)
        except SimulationError:
            continue
        where = f" of {record.name}" if len(problem.records) > 1 else ""
        for i in known:
            tables = [np.zeros_like(data) for data in problem.measured]
            tables[number] = run.y_theta[:, :, n + i]
            column = problem.vector(tables)[:, None]
            name = model.states[i]
            words = (
                f"the residuals contradict the initial value {start[n + i]:.4g} of {name}{where}, about "
                f"{start[n + i]:.6g} + ({{0:.3g}}) would suit them (estimate it: [initial] {name} = "
                f'"{name}_0", with {name}_0 in [estimate])'
            )
            if column.any():
                yield _Cause(column, words)


def known_initial(model: OdeModel) -> list[int]:
    """States whose initial values hold no parameter."""
    parameters = set(model.parameters)
    return [i for i, e in enumerate(model.initial) if not expressions.names(e) & parameters]
