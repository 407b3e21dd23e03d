"""Numbers of a rotor from readings of runs: one least-squares fit.

Rows of all data, each divided by its error, and of what is known beforehand go through the nonlinear driver
of `rotorid.regression` with exact derivatives. χ² of data and priors together, m + p − n degrees of freedom,
tells whether the model explains the data.

Numbers that are taken as exact, but may be off by a standard deviation each, move the estimate: with K the
derivatives of data and priors by the estimated numbers and H those by the exact ones, times their deviations,
the estimated numbers differ from the true ones by K⁺ H δ, δ ~ N(0, 1), so that their covariance is
(KᵀK)⁻¹ + (K⁺H)(K⁺H)ᵀ ("consider covariance", Schmidt 1966). The rotor keeps that of both together: what the
estimate makes of wrong exact numbers largely cancels in what weights do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag
from scipy.special import chdtrc

from fem import Calibration, Rotor, is_reading
from fem.parameters import with_parameters
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.calibration.result import LEVEL, CalibratedRotor
from rotorid.calibration.rows_of_runs import ReadingRows, RunReadings
from rotorid.calibration.unknowns import Unknown, as_they_stand, check_different
from rotorid.regression import solution
from rotorid.regression.nonlinear import NonlinearEstimate, nonlinear_least_squares, search_from
from rotorid.regression.prior import Prior, effect, prior_rows

ASIDE = 0.7
"""Relative distance of the two side starts, along what the data see least."""
LIMIT = 40
"""Evaluations of a search from one of several starts."""
SAME = 1e-3
"""Relative, besides three standard deviations: nearer ends of searches are one."""
TINY = 1e-9
"""Mean χ² that is none: no degree of freedom is left."""
AS_WELL = 4.0
"""Of χ²: other numbers that explain the data so nearly as well are reported."""
LATEST = 3
"""Numbers at which coefficients are kept: accepted, tried, and those before."""


class _Equations:
    """Residuals of all data at the numbers θ (n,), in standard deviations, and their derivatives."""

    def __init__(self, rotor: Rotor, paths: Sequence[str], readings: Sequence[RunReadings]) -> None:
        self.rotor, self.paths, self.readings = rotor, paths, readings
        self.rows: list[ReadingRows] = []
        self.size = 0
        self._coefficients = lru_cache(LATEST)(self._computed)

    def _computed(self, *theta: float) -> list[tuple[ComplexArray, ComplexArray]]:
        values = dict(zip(self.paths, theta, strict=True))
        return [data.coefficients(self.rotor, values, self.paths) for data in self.readings]

    def at(self, theta: FloatArray) -> list[tuple[ReadingRows, ComplexArray, ComplexArray]]:
        """Of all data: rows, coefficients at these numbers, and their derivatives."""
        each = self._coefficients(*theta.tolist())
        return [(rows, *both) for rows, both in zip(self.rows, each, strict=True)]

    def weigh(self, theta: FloatArray) -> None:
        """Take the errors of the readings as they are at these numbers."""
        each = self._coefficients(*theta.tolist())
        self.rows = [data.rows(W) for data, (W, _) in zip(self.readings, each, strict=True)]

    def residual(self, theta: FloatArray) -> FloatArray:
        try:
            parts = [rows.residual(W)[0] for rows, W, _ in self.at(theta)]
        except (ValueError, np.linalg.LinAlgError):
            if not self.size:
                raise
            return np.full(self.size, np.inf)  # no rotor: the search shortens its step
        residuals = np.concatenate(parts)
        self.size = residuals.size
        return residuals

    def jacobian(self, theta: FloatArray) -> FloatArray:
        return np.vstack([rows.jacobian(W, dW) for rows, W, dW in self.at(theta)])


def calibrate(
    rotor: Rotor,
    unknowns: Sequence[Unknown],
    readings: Sequence[RunReadings],
    *,
    exact: Sequence[Unknown] = (),
    side_starts: bool = True,
) -> CalibratedRotor:
    """Estimate numbers of a rotor, with their errors and what the data do not determine.

    Parameters
    ----------
    rotor
        As it is believed to be.
    unknowns
        Its n unknown numbers.
    readings
        The data, of one machine in one or several states.
    exact
        Numbers that are taken as the rotor has them; the deviations of their priors widen the errors of the
        estimate.
    side_starts
        Search also from 70 % beside where the first search ends, to both sides, along what the data see
        least of the numbers without a prior.

    Raises
    ------
    ValueError
        Without data or unknowns, for unknowns that the rotor does not have, and data that it cannot show.
    """
    if not unknowns or not readings:
        raise ValueError("a calibration needs data and at least one unknown number")
    equations = _Equations(rotor, [unknown.path for unknown in unknowns], readings)
    sensors = [sensor for data in readings for sensor in data.trials.sensors]
    shown = [f"probe[{sensor}].{what}" for sensor in sensors for what in ("angle", "gain")]
    shown.append("key_phasor.angle")
    if lost := [path for path in equations.paths if is_reading(path) and path not in shown]:
        raise ValueError(f"no data have readings of {lost[0]}: {', '.join(shown)}")
    check_different(rotor, equations.paths)
    names = tuple(unknown.label for unknown in unknowns)
    prior = prior_rows(names, {unknown.label: unknown.prior for unknown in unknowns if unknown.prior})
    bounds = np.array([unknown.limits(rotor) for unknown in unknowns], dtype=float)
    bounds = np.where(np.isnan(bounds), (-np.inf, np.inf), bounds)
    first = np.clip([unknown.first(rotor) for unknown in unknowns], *bounds.T)
    equations.weigh(first)
    equations.residual(first)

    def solve(begin: FloatArray, *, near: bool = False) -> NonlinearEstimate:
        return nonlinear_least_squares(
            equations.residual,
            equations.jacobian,
            begin,
            names=names,
            sigma_stated=True,
            bounds=bounds,
            near=near,
            prior=prior,
        )

    free = np.flatnonzero([unknown.prior is None for unknown in unknowns] & (first != 0))
    ends = _searches(equations, prior, first, bounds, free) if side_starts and free.size else []
    fit = solve(ends[0] if ends else first)
    equations.weigh(fit.estimate.solution)
    fit = solve(fit.estimate.solution, near=True)
    return _judged(equations, unknowns, prior, exact, fit, ends)


def _searches(
    equations: _Equations, prior: Prior, first: FloatArray, bounds: FloatArray, free: IntArray
) -> list[FloatArray]:
    """Ends within the bounds of three searches, the lowest first: from the start, and beside its end.

    Beside: along the relative change of the numbers without a prior, `free`, that moves the rows least.
    """
    residual, jacobian = prior.beside(equations.residual, equations.jacobian)
    lower, upper = bounds.T

    def search(begin: FloatArray) -> list[tuple[float, FloatArray]]:
        end = search_from(residual, np.clip(begin, lower, upper), jacobian, limit=LIMIT)
        return [end] if end is not None and ((lower <= end[1]) & (end[1] <= upper)).all() else []

    ends = search(first)
    if ends:
        at, step = ends[0][1], np.zeros(len(first))
        weak = np.linalg.svd(jacobian(at)[:, free] * at[free])[2][-1]
        step[free] = ASIDE * weak / np.abs(weak).max() * at[free]
        ends += search(at - step) + search(at + step)
    return [end for _, end in sorted(ends, key=lambda end: end[0])]


def _judged(
    equations: _Equations,
    unknowns: Sequence[Unknown],
    prior: Prior,
    exact: Sequence[Unknown],
    fit: NonlinearEstimate,
    ends: Sequence[FloatArray],
) -> CalibratedRotor:
    """The rotor with these numbers, and whether the model explains the data."""
    theta, rotor, rows = fit.estimate.solution, equations.rotor, equations.rows
    K, r = equations.jacobian(theta), equations.residual(theta)
    values = dict(zip(equations.paths, theta.tolist(), strict=True))
    bare = [each.bare(W, dW) for each, W, dW in equations.at(theta)]
    spent = sum(each.rank for each in bare)

    def mismatch(theta: FloatArray) -> float:
        return float(np.sum(equations.residual(theta) ** 2) + np.sum(prior.residual(theta) ** 2))

    chi_square, dof = mismatch(theta), r.size + len(prior) - spent - fit.estimate.rank
    chance, covariance = _of_errors(equations, prior, fit, chi_square)
    times = max(chi_square / dof, 1.0) if chance < LEVEL else 1.0
    off = {number.path: number.prior for number in exact if number.prior}
    std = np.array([std for _, std in off.values()])
    every = values | {path: value for path, (value, _) in off.items()}
    parts = [each.jacobian(*each.data.coefficients(rotor, every, [*off])) for each in rows]
    H = np.vstack((*parts, np.zeros((len(prior), len(off))))) * std
    moved = np.vstack((-solution(prior.below(K), H), np.diag(std)))
    joint = block_diag(times * covariance, np.zeros((len(off),) * 2)) + moved @ moved.T
    covariance = joint[: theta.size, : theta.size]
    to = as_they_stand(rotor, every)
    lack = _lack_of_fit(equations, theta) if chance < LEVEL else 0.0
    explained = chance >= LEVEL and fit.converged and fit.estimate.full_rank
    calibration = Calibration(
        names=tuple(every),
        values=np.array([*every.values()]),
        covariance=to @ joint @ to.T,
        lack_of_fit=lack,
        needs_trial_run=not explained,
    )
    same = 3 * np.sqrt(np.diag(covariance)) + SAME * np.abs(theta)
    same[np.isnan(fit.values)] = np.inf
    others = [end for end in ends if (np.abs(end - theta) > same).any()]
    return CalibratedRotor(
        rotor=replace(with_parameters(rotor, values), calibration=calibration),
        unknowns=tuple(unknowns),
        fit=fit,
        covariance=covariance,
        prior=effect(prior, K, r, theta, at_bounds=fit.at_bounds),
        jacobian=K,
        chi_square=chi_square,
        dof=dof,
        chance=chance,
        explained=explained,
        lack_of_fit=lack,
        exact=tuple(number.label for number in exact),
        unbalance=tuple(each.u for each in bare),
        unbalance_std=tuple(each.std(covariance, times) for each in bare),
        readings=tuple(equations.readings),
        stated=all(each.stated for each in rows),
        searches=max(len(ends), 1),
        other_ends=tuple(end for end in others if mismatch(end) < chi_square + AS_WELL),
    )


def _of_errors(
    equations: _Equations, prior: Prior, fit: NonlinearEstimate, chi_square: float
) -> tuple[float, FloatArray]:
    """How likely so large a χ² is, and the covariance (n, n), 0 where not determined.

    Errors E ε and priors' ones make G⁺ E ε of the numbers, and leave (1 − G G⁺) E ε of the rows, whose χ² is
    that of g χ²(ν) of the same mean and variance; mean over what errors between runs may be.
    """
    theta = fit.estimate.solution
    estimated = fit.estimate.solution_covariance
    free = np.flatnonzero(np.zeros(theta.size) if estimated is None else ~np.isnan(np.diag(estimated)))
    G = prior.below(equations.jacobian(theta))[:, free]
    every = [rows.spreads(W) for rows, W, _ in equations.at(theta)]
    count, covariance = max(map(len, every)), np.zeros((theta.size,) * 2)
    chances = []
    for k in range(count):
        E = block_diag(*(each[k % len(each)] for each in every), np.eye(len(prior)))
        moved = solution(G, E)
        covariance[np.ix_(free, free)] += moved @ moved.T / count
        left = E - G @ moved
        A = left @ left.T if len(left) < len(left.T) else left.T @ left
        mean, square = np.trace(A), np.sum(A**2)
        chances.append(float(chdtrc(mean**2 / square, chi_square * mean / square)) if mean > TINY else 1.0)
    return float(np.mean(chances)), covariance


def _lack_of_fit(equations: _Equations, theta: FloatArray) -> float:
    """What the model leaves of what weights do beyond the errors: relative rms over speeds and sensors.

    The mean over all readings of a job counts as two more rows of each speed and sensor.
    """
    relative = []
    for rows, W, _ in equations.at(theta):
        bare = np.einsum("scq,q->sc", W[..., len(rows.data.nodes) :], rows.residual(W)[2])[:, None]
        left = rows.raw(W) + bare
        square = (np.abs(left) ** 2 / 2 - rows.variance).sum(axis=1)
        size = np.maximum((np.abs(bare + rows.effect(W)) ** 2).sum(axis=1), np.finfo(float).tiny)
        mean, share = max(float(square.sum() / size.sum()), 0.0), 2 / left.shape[1]
        relative.append(np.ravel(share * mean + np.maximum(square, 0.0) / size) / (1 + share))
    return float(np.sqrt(np.concatenate(relative).mean()))
