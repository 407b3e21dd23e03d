"""Diagnostics of a fit: warnings and notes before its numbers are used."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.regression import gain, least_squares, solution
from rotorid.regression.estimate import Estimate
from rotorid.regression.normal_matrix import NormalMatrix, normal_matrix
from rotorid.regression.prior import PriorEffect, effect
from rotorid.regression.search import RCOND
from rotorid.timedomain.integration.adaptive import shortest_pulse
from rotorid.timedomain.integration.simulate import STEPWISE, SimulationError, inputs_of
from rotorid.timedomain.methods.iteration_history import Path, at
from rotorid.timedomain.methods.least_squares_problem import RTOL, Problem
from rotorid.timedomain.nonlinear_combinations import combined
from rotorid.timedomain.residual_causes import causes, known_initial
from rotorid.timedomain.residual_tests import chance, correlation, misfit, unequal

PROBES = 100_001
"""Times at which pulses are looked for."""
ROUNDING = 1e-14
"""Difference of two integrations, relative to the record, that is none."""
INSENSITIVE = 1e-7
"""Change of the outputs, relative to their size, by a parameter changing by all of itself."""


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


@dataclass(eq=False)
class _Draft:
    """A judgement in the making."""

    estimate: Estimate
    reliable: bool
    warnings: list[str] = field(default_factory=list)
    integration_change: FloatArray | None = None
    prior: PriorEffect | None = None
    normal_matrix: NormalMatrix | None = None

    def note(self, *words: str, spoils: bool = False) -> None:
        """Add warnings, empty ones left out; those that spoil the fit leave no intervals."""
        said = [text for text in words if text]
        self.warnings += said
        self.reliable &= not (said and spoils)


def judge(problem: Problem, path: Path, loss: str) -> Judgement:
    """Look at convergence, bounds, rank, sensitivity, integration error and residuals of a fit."""
    draft = _Draft(path.estimate, path.converged)
    draft.note("" if path.converged else f"{path.message}; no intervals are given", path.bound_warning)
    try:
        _note_sensitivities(draft, problem, path, loss)
    except SimulationError as error:
        draft.note(f"the model cannot be simulated with the result: {error}", spoils=True)
    found = draft.estimate
    if not found.full_rank and path.converged:
        draft.note(found.describe_rank())
    if not problem.data.any():
        draft.note("the record is zero throughout: a sensor without a signal?")
    draft.note(*_integration_words(found, draft.integration_change, problem.model.parameters))
    r = found.residuals if draft.prior is None else draft.prior.best  # of the data alone
    seen = correlation(problem, r)
    poor = misfit(problem, found.dof, r, loss)
    widening = 1.0 if poor or seen is None else seen.widening
    draft.note(poor, spoils=True)
    if not poor:
        draft.note("" if seen is None else seen.words(), *_chi_words(found))
    draft.note(*_aliases(problem, found.solution))
    if draft.reliable:
        draft.note(*_pulses(problem, found.solution), spoils=True)
    draft.note(*_begins_later(problem))
    if not draft.reliable or widening > 1:
        found = _widened(found, widening if draft.reliable else np.nan)
    neighbours = None if seen is None else seen.neighbours
    change, warnings = draft.integration_change, tuple(draft.warnings)
    reliable = draft.reliable and widening == 1
    return Judgement(found, reliable, warnings, change, neighbours, draft.prior, draft.normal_matrix)


def _widened(found: Estimate, factor: float) -> Estimate:
    """With standard deviations so many times as large; NaN: without any."""
    parts = [found.covariance, found.solution_covariance]
    covariances = [None if np.isnan(factor) or C is None else C * factor**2 for C in parts]
    curved = found.curved and tuple(
        replace(one, std=None if np.isnan(factor) or one.std is None else one.std * factor)
        for one in found.curved
    )
    return replace(found, covariance=covariances[0], solution_covariance=covariances[1], curved=curved)


def _note_sensitivities(draft: _Draft, problem: Problem, path: Path, loss: str) -> None:
    """What needs the model simulated at the values found; SimulationError where it cannot be."""
    found, r = draft.estimate, draft.estimate.residuals
    J = problem.jacobian(found.solution)
    s, V = found.singular_values, found.row_space
    # of the step itself where it is known: that of quasilinearization is not about a solution of the model
    own = not len(problem.prior) and len(s) == len(V)
    draft.normal_matrix = normal_matrix(found.names, s[:, None] * V if own else J)
    stated, theta = problem.stated, found.solution
    draft.prior = effect(problem.prior, J, r, theta, stated=stated, at_bounds=path.at_bounds)
    if draft.prior is not None:
        if draft.prior.alone:  # in the words of the nonlinear model, not of its tangents
            alone = at(least_squares(J, -r, names=found.names, sigma=1.0, rcond=RCOND), theta, r)
            draft.prior = replace(draft.prior, alone=combined(problem, alone)[0].describe_rank())
        draft.note(*draft.prior.warnings, spoils=problem.prior.ridge > 0)
        draft.estimate, r = draft.prior.apart(found, stated=stated), draft.prior.best
    if weak := _insensitive(problem, J, found):
        draft.note(f"the record hardly depends on {', '.join(weak)}")
    if path.converged:
        draft.estimate, local = combined(problem, draft.estimate)
        draft.note(local)
    spread = None if problem.stated or loss != "linear" else unequal(problem, J.shape[1], r)
    if spread is not None:
        draft.note(_unequal_words(problem, draft.estimate, J, spread))
    if path.converged and loss == "linear":
        pointed, wrong = causes(problem, found.solution, J, r)
        draft.note(*pointed, spoils=wrong)
    draft.integration_change = _integration_change(problem, draft.estimate, J)


def _begins_later(problem: Problem) -> list[str]:
    """Ask where the known initial values belong, if the record does not begin at 0."""
    model, late = problem.model, [record for record in problem.records if record.t[0] != 0]
    if model.t0 is not None or not late or not known_initial(model):
        return []
    return [
        f"{late[0].name} begins at t = {late[0].t[0]:.6g} s, and the initial values were put there: state "
        'where they belong, t0 = 0 in [initial] (the time 0) or t0 = "first" (the first time of each record)'
    ]


def _insensitive(problem: Problem, J: FloatArray, found: Estimate) -> list[str]:
    size = float(np.linalg.norm(problem.data))
    effect = np.linalg.norm(J, axis=0) * np.maximum(np.abs(found.solution), 1e-12)
    weak = (effect < INSENSITIVE * size) & ~np.isnan(found.values) & (found.solution != 0)
    return [name for name, w in zip(problem.model.parameters, weak, strict=True) if w]


def _integration_change(problem: Problem, found: Estimate, J: FloatArray) -> FloatArray | None:
    """Change of the parameters at a tighter tolerance (n,); None where the solution is exact."""
    used = problem.runs[0].method
    if used in ("expm", "none"):
        return None
    r = problem.residual(found.solution)
    if used in STEPWISE:
        finer = problem.again("auto", RTOL)
    else:
        finer = problem.again(problem.integrator, max(problem.rtol / 100, 1e-13))
    exact = finer.evaluate(found.solution)[0]
    missed = r - exact
    if np.linalg.norm(missed) <= ROUNDING * np.linalg.norm(problem.data):
        return np.zeros(len(found.names))
    K = problem.prior.below(J)
    change: FloatArray = solution(K, np.append(missed, np.zeros(len(K) - len(J))), rcond=RCOND)
    return change


def _integration_words(found: Estimate, change: FloatArray | None, names: tuple[str, ...]) -> list[str]:
    if change is None:
        return []
    size = np.abs(change)
    floor = 1e-8 * np.abs(found.solution)
    limit = floor if found.std is None else np.maximum(floor, 0.1 * np.nan_to_num(found.std))
    words = [
        f"{name} by about {c:.2g}" + ("" if found.std is None else f" (standard deviation {s:.2g})")
        for name, c, s, big in zip(
            names, change, found.std if found.std is not None else change, size > limit, strict=True
        )
        if big
    ]
    return [f"a more accurate integration would change {', '.join(words)}"] if words else []


def _aliases(problem: Problem, theta: FloatArray) -> list[str]:
    """Words where a linear model vibrates faster than evenly spaced samples can tell."""
    for model, record in zip(problem.models, problem.records, strict=True):
        steps = np.diff(record.t)
        if not model.linear_driven or len(steps) < 2 or np.ptp(steps) > 1e-3 * steps.mean():
            continue
        fastest = float(
            np.abs(np.linalg.eigvals(model.matrices(theta)[0, :, : len(model.states)]).imag).max()
        )
        if fastest * steps.mean() > np.pi:
            return [
                f"the model can vibrate with {fastest:.4g} rad/s, faster than half the sampling rate "
                f"({np.pi / steps.mean():.4g} rad/s): slower vibrations may describe the record as well"
            ]
    return []


def _pulses(problem: Problem, theta: FloatArray) -> list[str]:
    """Words where the rates change with the time so fast that an integration may miss it."""
    for model, record, run in zip(problem.models, problem.records, problem.runs, strict=True):
        t = record.t
        if not model.timed or run.method not in ("dop853", "lsoda", "taylor") or len(t) < 2:
            continue
        u, x = inputs_of(model, record)[:1], run.x[:1]
        coarse = np.linspace(t[0], t[-1], 4 * int(np.ceil((t[-1] - t[0]) / shortest_pulse(t))) + 1)
        fine = np.linspace(t[0], t[-1], PROBES)
        at_coarse, at_fine = (
            model.f(times, np.repeat(x, len(times), 0), theta, np.repeat(u, len(times), 0))
            for times in (coarse, fine)
        )
        straight = np.stack([np.interp(fine, coarse, column) for column in at_coarse.T], axis=-1)
        away = np.abs(at_fine - straight).max(axis=0)
        if (away > 0.05 * np.maximum(np.ptp(at_fine, axis=0), 1e-300)).any():
            return [
                f"the rates change within {coarse[1] - coarse[0]:.2g} s of time or less: the integration may "
                "step over that; give the record more times there. No intervals are given"
            ]
    return []


def _unequal_words(problem: Problem, found: Estimate, J: FloatArray, variances: FloatArray) -> str:
    """Plain least squares with errors s_g of each series: the covariance would be Σ s_g² G_g G_gᵀ, G = J⁺."""
    first = np.cumsum([0, *problem.groups[:-1]])
    own = np.repeat(np.sqrt(variances), problem.groups)
    sizes = ", ".join(
        f"{name} {s:.2g}" for name, s in zip(problem.series, problem.plain(own)[first], strict=True)
    )
    words = f"the outputs have different errors ({sizes}), but the intervals hold for equal ones"
    if found.full_rank and found.std is not None and np.isfinite(found.std).all():
        G = gain(J, rcond=RCOND) * own
        ratio = np.sqrt((G * G).sum(axis=1)) / found.std
        words += f"; with their own they would be {ratio.min():.2g} to {ratio.max():.2g} times as wide"
    return f"{words}. With --sigma auto precise outputs count for more"


def _chi_words(found: Estimate) -> list[str]:
    """Whether the residuals are as large as stated errors let one expect."""
    chi_square, dof = found.chi_square, found.dof
    if not found.errors_stated or dof <= 0 or chi_square is None:
        return []
    ratio = np.sqrt(chi_square / dof)
    if chance(chi_square, dof) < 1e-3:
        return [
            f"residuals are {ratio:.2g} times as large as the stated errors explain: intervals are too "
            "narrow, or the model does not quite describe the record"
        ]
    if chance(chi_square, dof) > 1 - 1e-6 and chi_square < dof / 2:
        return [f"residuals are only {ratio:.2g} times as large as the stated errors: these are too large"]
    return []
