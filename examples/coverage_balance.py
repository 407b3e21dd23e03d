"""Are the regions of the correction weights honest? Simulated jobs whose truth is known.

Run `python examples/coverage_balance.py [jobs]`. Two planes, four sensors, three speeds; 3 % and 2° of error
in every reading of every run (a baseline and two trial runs); the unbalance stands in the two planes. For
each class of condition numbers and trial weights it prints how many jobs are refused (they count nowhere
else), the share of 95 % regions that contain the true weights, of readings of a check run within their 95 %
bands, and of jobs with the warning of `balancing.correction.region_coverage`. Then the shares by how clearly
the readings show the weakest combination of the planes, which is what that warning goes by.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from balancing import Influence, ReadingErrors, Trials, UndeterminedError, correct, estimate_influence
from balancing.correction.region_coverage import LEAST_SQUARES_LEVELS, WEIGHTED_LEVELS, clearness, optimism
from balancing.data.errors import reading_covariance
from balancing.solvers.effective_variance import effective_variance
from balancing.solvers.error_propagation import prediction_covariance
from balancing.solvers.likelihood import evaluate, hessian, jacobian, problem_of
from rotorid.regression import stretch

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Range = tuple[float, float]

ERRORS = ReadingErrors(amplitude=0.03, phase=np.deg2rad(2.0))
SPEEDS, SENSORS, PLANES = np.array([100.0, 150.0, 200.0]), ("s1", "s2", "s3", "s4"), ("A", "B")
CONDITIONS: tuple[Range, ...] = ((1.0, 10.0), (10.0, 30.0), (30.0, 100.0))
EFFECTS: tuple[Range, ...] = ((0.3, 1.0), (0.1, 0.3), (0.03, 0.1))
METHODS = ("least-squares", "weighted")


class Rotor(NamedTuple):
    """The truth: coefficients (12, 2), weights that balance it (2,), its vibration (12,)."""

    W: ComplexArray
    D: ComplexArray
    Y: ComplexArray


@dataclass
class Tally:
    """What came of the jobs of a class; lists run over the jobs that were not refused."""

    jobs: int = 0
    refused: int = 0
    lost: int = 0  # the weighted fit did not converge
    inside: dict[str, list[bool]] = field(default_factory=lambda: {m: [] for m in METHODS})
    bands: dict[str, list[float]] = field(default_factory=lambda: {m: [] for m in METHODS})
    warned: dict[str, list[bool]] = field(default_factory=lambda: {m: [] for m in METHODS})
    other: dict[str, list[bool]] = field(default_factory=dict)  # regions of other covariances, weighted fit
    clear: list[tuple[float, float]] = field(default_factory=list)  # ρ/√N and t


def rotor(rng: np.random.Generator, condition: float) -> Rotor:
    """A random rotor whose column-scaled coefficients have this condition number."""
    n = len(SPEEDS) * len(SENSORS)
    Q = np.linalg.qr(_complex_normal(rng, (n, 2)))[0]
    angle = np.arctan(1 / condition)
    mix = np.array([[np.cos(angle), np.cos(angle)], [np.sin(angle), -np.sin(angle)]])
    W = Q @ mix * np.exp(2j * np.pi * rng.random(2))
    D = _complex_normal(rng, 2)
    return Rotor(W, D, -W @ D)


def measured(rng: np.random.Generator, Y: ComplexArray) -> ComplexArray:
    """Readings with independent normal errors of amplitude and phase."""
    amplitude, phase = rng.standard_normal((2, *Y.shape))
    return np.asarray(Y * (1 + ERRORS.amplitude * amplitude) * np.exp(1j * ERRORS.phase * phase))


def trial_runs(rng: np.random.Generator, true: Rotor, effect: Range) -> Trials:
    """Baseline and two trial runs; weights change the (root mean square) vibration by a share in `effect`."""
    share = _log_uniform(rng, effect, 2)
    size = share * np.linalg.norm(true.Y) / np.linalg.norm(true.W, axis=0)
    T = np.diag(size * np.exp(2j * np.pi * rng.random(2)))
    weights = np.vstack((np.zeros(2), T))
    exact = true.Y + weights @ true.W.T
    readings = measured(rng, exact).reshape(3, len(SPEEDS), len(SENSORS))
    return Trials(("baseline", "trial A", "trial B"), SPEEDS, SENSORS, PLANES, readings, weights, ERRORS)


def one_job(rng: np.random.Generator, condition: Range, effect: Range, tally: Tally) -> None:
    """Simulate a job from the trial runs to the check run."""
    true = rotor(rng, float(_log_uniform(rng, condition, 1)[0]))
    trials = trial_runs(rng, true, effect)
    tally.jobs += 1
    try:
        influence = estimate_influence(trials)
        plain = correct(influence)
    except UndeterminedError:
        tally.refused += 1
        return
    assert plain.covariance is not None
    assert plain.after_covariance is not None
    W, Y, channels = _stacked(influence)
    fit = effective_variance(W, Y, channels)
    tally.lost += not fit.converged
    band = reading_covariance(fit.residual, ERRORS) + prediction_covariance(fit.weights, channels)
    found = {
        "least-squares": (plain.weights, plain.covariance, plain.after.ravel(), plain.after_covariance),
        "weighted": (fit.weights, fit.covariance, fit.residual, band),
    }
    for method, (D, covariance, after, bands) in found.items():
        tally.inside[method].append(bool(_distance(D - true.D, covariance) < chdtri(4, 0.05)))
        check = measured(rng, true.Y + true.W @ D)
        each = [_distance(d[None], c) for d, c in zip(check - after, bands.reshape(-1, 2, 2), strict=True)]
        tally.bands[method].append(float(np.mean(np.array(each) < chdtri(2, 0.05))))
        tally.warned[method].append(bool(optimism(W, channels[:, 2:, 2:], PLANES, method=method)))
    x = stretch(fit.weights - true.D)
    for name, information in other_information(W, Y, channels, fit.weights).items():
        tally.other.setdefault(name, []).append(bool(x @ information @ x < chdtri(4, 0.05)))
    ratio, clear = clearness(W, channels[:, 2:, 2:])
    tally.clear.append((ratio / np.sqrt(len(W)), clear))


def other_information(
    W: ComplexArray, Y: ComplexArray, channels: FloatArray, D: ComplexArray
) -> dict[str, FloatArray]:
    """Inverses of covariances that one might take for that of the weighted fit, each (4, 4)."""
    problem = problem_of(W, Y, channels, np.ones(len(W)))
    at = evaluate(problem, stretch(D))
    J = jacobian(problem, at)[0]
    measured_rows = problem.W.swapaxes(1, 2) @ np.linalg.inv(prediction_covariance(D, channels)) @ problem.W
    return {
        "W as measured": measured_rows.sum(axis=0),
        "adjusted W": J.T @ J,
        "Hessian": hessian(problem, at),
    }


def simulate(jobs: int, condition: Range, effect: Range, seed: int = 1) -> Tally:
    """So many jobs of a class."""
    rng = np.random.default_rng([seed, int(10 * condition[1]), int(1000 * effect[1])])
    tally = Tally()
    for _ in range(jobs):
        one_job(rng, condition, effect, tally)
    return tally


def _stacked(influence: Influence) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    assert influence.baseline is not None
    assert influence.covariance is not None
    n = influence.covariance.shape[-1]
    return influence.W.reshape(-1, 2), influence.baseline.ravel(), influence.covariance.reshape(-1, n, n)


def _distance(difference: ComplexArray, covariance: FloatArray) -> float:
    x = stretch(difference)
    return float(x @ np.linalg.solve(covariance, x))


def _complex_normal(rng: np.random.Generator, shape: tuple[int, ...] | int) -> ComplexArray:
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def _log_uniform(rng: np.random.Generator, limits: Range, n: int) -> FloatArray:
    low, high = np.log(limits)
    return np.asarray(np.exp(rng.uniform(low, high, n)))


def _percent(values: Sequence[float] | NDArray[np.bool_]) -> str:
    return f"{100 * np.mean(values):.1f}" if len(values) else "–"


def main(jobs: int = 2000) -> None:
    """Print the tables."""
    print(f"{jobs} jobs per class; per cent of the jobs that were not refused")
    print("                                    95 % regions     check-run bands   warned")
    print("condition  effect      refused   least sq.  weighted   l.s.  weighted   l.s.  weighted")
    tallies = []
    for condition in CONDITIONS:
        for effect in EFFECTS:
            tally = simulate(jobs, condition, effect)
            tallies.append(tally)
            inside, bands, warned = (
                [_percent(kind[m]) for m in METHODS] for kind in (tally.inside, tally.bands, tally.warned)
            )
            place = f"{condition[0]:3.0f}–{condition[1]:<4.0f}  {effect[0]:5.0%}–{effect[1]:<5.0%}"
            regions = f"{inside[0]:>8}  {inside[1]:>8}  {bands[0]:>6}  {bands[1]:>8}"
            print(f"{place} {tally.refused:6d}   {regions}  {warned[0]:>6}  {warned[1]:>8}")
    print("\nweighted, regions by other covariances (classes as above)")
    for name in tallies[0].other:
        print(f"  {name:<14}" + "".join(f"{_percent(t.other.get(name, [])):>7}" for t in tallies))
    print(f"\nweighted fits that did not converge: {sum(t.lost for t in tallies)}")
    clear = np.array([c for t in tallies for c in t.clear])
    for column, method, levels in ((0, METHODS[0], LEAST_SQUARES_LEVELS), (1, METHODS[1], WEIGHTED_LEVELS)):
        inside_all = np.array([i for t in tallies for i in t.inside[method]])
        edges = [-np.inf, *(limit for limit, _ in levels), np.inf]
        print(f"\n{method}, by {('ρ/√N', 'clearness t')[column]} of the weakest combination of the planes")
        for low, high in pairwise(edges):
            pick = (clear[:, column] >= low) & (clear[:, column] < high)
            print(f"  {low:5.2f} … {high:5.2f}: {_percent(inside_all[pick]):>5} of {pick.sum()} jobs")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
