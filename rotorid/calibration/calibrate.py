"""Numbers of a rotor from readings of runs, critical speeds and modes together: one least-squares fit.

Rows of all data, each divided by its error, and of what is known beforehand go through the nonlinear driver
of `rotorid.regression` with exact derivatives. χ² of data and priors together, m + p − n degrees of freedom,
tells whether the model explains the data.

Numbers that are taken as exact, but may be off by a standard deviation each, move the estimate: with K the
derivatives of data and priors by the estimated numbers and H those by the exact ones, times their deviations,
the estimate is off by −K⁺ H δ, δ ~ N(0, 1), so that its covariance is (KᵀK)⁻¹ + (K⁺H)(K⁺H)ᵀ ("consider
covariance", Schmidt 1966).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fem import Calibration, Rotor, is_reading
from fem.parameters import with_parameters
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.calibration.frequencies import MeasuredFrequencies
from rotorid.calibration.readings import ReadingRows, RunReadings
from rotorid.calibration.result import LEVEL, CalibratedRotor
from rotorid.calibration.unknowns import Unknown, as_they_stand, check_different
from rotorid.regression import solution
from rotorid.regression.nonlinear import NonlinearEstimate, nonlinear_least_squares
from rotorid.regression.prior import Prior, effect, prior_rows
from rotorid.regression.search import search_from

ASIDE = 0.7
"""Relative distance of the two side starts, along what the data see least."""
LIMIT = 40
"""Evaluations of a search from one of several starts."""
SAME = 1e-3
"""Relative, besides three standard deviations: nearer ends of searches are one."""
AS_WELL = 4.0
"""Of χ²: other numbers that explain the data so nearly as well are reported."""


class _Equations:
    """Residuals of all data at the numbers θ (n,), in standard deviations, and their derivatives."""

    def __init__(
        self,
        rotor: Rotor,
        unknowns: Sequence[Unknown],
        readings: Sequence[RunReadings],
        frequencies: Sequence[MeasuredFrequencies],
    ) -> None:
        self.rotor, self.readings, self.frequencies = rotor, readings, frequencies
        self.paths = [unknown.path for unknown in unknowns]
        self.rows: list[ReadingRows] = []
        self.last: dict[int, tuple[FloatArray, ComplexArray]] = {}
        self.size = 0

    def values(self, theta: FloatArray) -> dict[str, float]:
        return dict(zip(self.paths, theta.tolist(), strict=True))

    def weigh(self, theta: FloatArray) -> None:
        """Take the errors of the readings as they are at these numbers."""
        self.rows = [data.rows(self.coefficients(data, theta)) for data in self.readings]

    def coefficients(self, data: RunReadings, theta: FloatArray) -> ComplexArray:
        """Of these readings at these numbers; a search asks for the last ones again."""
        at, W = self.last.get(id(data), (None, None))
        if at is None or W is None or not np.array_equal(at, theta):
            W = data.coefficients(self.rotor, self.values(theta))[0]
            self.last[id(data)] = theta.copy(), W
        return W

    def residual(self, theta: FloatArray) -> FloatArray:
        values = self.values(theta)
        try:
            parts = [rows.residual(self.coefficients(rows.data, theta))[0] for rows in self.rows]
            parts += [data.residual(self.rotor, values) for data in self.frequencies]
        except (ValueError, np.linalg.LinAlgError):
            if not self.size:
                raise
            return np.full(self.size, np.inf)  # no rotor: the search shortens its step
        residuals = np.concatenate(parts)
        self.size = residuals.size
        return residuals

    def jacobian(self, theta: FloatArray) -> FloatArray:
        return self.by(self.paths, self.values(theta))

    def by(self, paths: Sequence[str], values: dict[str, float]) -> FloatArray:
        """Derivatives by any numbers that have values."""
        parts = [rows.jacobian(*rows.data.coefficients(self.rotor, values, paths)) for rows in self.rows]
        parts += [data.jacobian(self.rotor, values, paths) for data in self.frequencies]
        return np.vstack(parts)


def calibrate(
    rotor: Rotor,
    unknowns: Sequence[Unknown],
    readings: Sequence[RunReadings] = (),
    frequencies: Sequence[MeasuredFrequencies] = (),
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
    readings, frequencies
        The data, of any mixture.
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
    if not unknowns or not (readings or frequencies):
        raise ValueError("a calibration needs data and at least one unknown number")
    for path in (unknown.path for unknown in unknowns if is_reading(unknown.path)):
        sensors = [sensor for data in readings for sensor in data.trials.sensors]
        probes = [f"probe[{sensor}].{what}" for sensor in sensors for what in ("angle", "gain")]
        if path not in (*probes, "key_phasor.angle") or not readings:
            raise ValueError(f"no data have readings of {path}: {', '.join(probes) or 'there are no runs'}")
    check_different(rotor, [unknown.path for unknown in unknowns])
    equations = _Equations(rotor, unknowns, readings, frequencies)
    names = tuple(unknown.label for unknown in unknowns)
    limits = [unknown.limits(rotor) for unknown in unknowns]
    ends = np.array(limits, dtype=float)
    lower, upper = (
        np.where(np.isnan(end), fill, end) for end, fill in zip(ends.T, (-np.inf, np.inf), strict=True)
    )
    first = np.clip([unknown.first(rotor) for unknown in unknowns], lower, upper)
    prior = prior_rows(names, {unknown.label: unknown.prior for unknown in unknowns if unknown.prior})
    for modes in frequencies:
        modes.check(rotor, equations.values(first), equations.paths)
    equations.weigh(first)
    equations.residual(first)

    def solve(begin: FloatArray, *, near: bool = False) -> NonlinearEstimate:
        return nonlinear_least_squares(
            equations.residual,
            equations.jacobian,
            begin,
            names=names,
            sigma_stated=True,
            bounds=dict(zip(names, limits, strict=True)),
            near=near,
            prior=prior,
        )

    free = np.array([unknown.prior is None for unknown in unknowns]) & (first != 0)
    searched = _searches(equations, prior, first, lower, upper, free) if side_starts and free.any() else []
    fit = solve(searched[0] if searched else first)
    equations.weigh(fit.estimate.solution)
    fit = solve(fit.estimate.solution, near=True)
    return _judged(equations, unknowns, prior, exact, fit, searched)


def _searches(
    equations: _Equations,
    prior: Prior,
    first: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    free: BoolArray,
) -> list[FloatArray]:
    """Ends within the bounds of three searches, the lowest first: from the start, and beside its end.

    Beside: along the relative change of the numbers without a prior that moves the rows least.
    """
    residual, jacobian = prior.beside(equations.residual, equations.jacobian)

    def search(begin: FloatArray) -> list[tuple[float, FloatArray]]:
        begin = np.clip(begin, lower, upper)
        if not np.isfinite(residual(begin)).all():
            return []
        end = search_from(residual, begin, jacobian, limit=LIMIT)
        inside = end is not None and (lower <= end[1]).all() and (end[1] <= upper).all()
        return [end] if end is not None and inside else []

    ends = search(first)
    if ends:
        at = ends[0][1]
        weak = np.linalg.svd(jacobian(at)[:, free] * at[free])[2][-1]
        step = np.zeros(at.size)
        step[free] = ASIDE * weak / np.abs(weak).max() * at[free]
        ends += search(at - step) + search(at + step)
    return [end for _, end in sorted(ends, key=lambda end: end[0])]


def _judged(
    equations: _Equations,
    unknowns: Sequence[Unknown],
    prior: Prior,
    exact: Sequence[Unknown],
    fit: NonlinearEstimate,
    searched: Sequence[FloatArray],
) -> CalibratedRotor:
    """The rotor with these numbers, and whether the model explains the data."""
    from scipy.special import chdtrc

    theta = fit.estimate.solution
    K, r = equations.jacobian(theta), equations.residual(theta)
    values = equations.values(theta)
    bare = [
        rows.bare(*rows.data.coefficients(equations.rotor, values, equations.paths))
        for rows in equations.rows
    ]
    spent = sum(each.rank for each in bare) + sum(modes.scales for modes in equations.frequencies)

    def mismatch(theta: FloatArray) -> float:
        return float(np.sum(equations.residual(theta) ** 2) + np.sum(prior.residual(theta) ** 2))

    chi_square = mismatch(theta)
    dof = r.size + len(prior) - spent - fit.estimate.rank
    chance = float(chdtrc(dof, chi_square)) if dof > 0 else 1.0
    misfit = chance < LEVEL
    times = max(chi_square / dof, 1.0) if misfit else 1.0
    covariance = fit.estimate.solution_covariance
    covariance = np.zeros((theta.size,) * 2) if covariance is None else times * np.nan_to_num(covariance)
    off = [(number.path, *number.prior) for number in exact if number.prior]
    if off:
        H = equations.by([path for path, *_ in off], values | {path: value for path, value, _ in off})
        H = np.vstack((H * [std for *_, std in off], np.zeros((len(prior), len(off)))))
        moved = solution(prior.below(K), H)
        covariance = covariance + moved @ moved.T
    to = as_they_stand(equations.rotor, values)
    lack = _lack_of_fit(equations, theta) if misfit else {}
    speeds, sensors = sorted({speed for speed, _ in lack}), sorted({sensor for _, sensor in lack})
    calibration = Calibration(
        names=tuple(equations.paths),
        values=theta,
        covariance=to @ covariance @ to.T,
        speeds=np.array(speeds),
        sensors=tuple(sensors),
        lack_of_fit=np.array([[lack.get((v, c), 0.0) for c in sensors] for v in speeds]),
        needs_trial_run=misfit or not (fit.converged and fit.estimate.full_rank),
    )
    determined = ~np.isnan(fit.values)
    same = 3 * np.sqrt(np.diag(covariance)) + SAME * np.abs(theta)
    return CalibratedRotor(
        rotor=replace(with_parameters(equations.rotor, values), calibration=calibration),
        unknowns=tuple(unknowns),
        fit=fit,
        covariance=covariance,
        prior=effect(prior, K, r, theta, stated=True, at_bounds=fit.at_bounds),
        jacobian=K,
        chi_square=chi_square,
        dof=dof,
        chance=chance,
        exact=tuple(number.label for number in exact),
        unbalance=tuple(each.u for each in bare),
        unbalance_std=tuple(each.std(covariance, times) for each in bare),
        readings=tuple(equations.readings),
        stated=all(rows.stated for rows in equations.rows),
        searches=max(len(searched), 1),
        other_ends=tuple(
            end
            for end in searched
            if (np.abs(end - theta) > same)[determined].any() and mismatch(end) < chi_square + AS_WELL
        ),
    )


def _lack_of_fit(equations: _Equations, theta: FloatArray) -> dict[tuple[float, str], float]:
    """What the model leaves of what weights do beyond the errors, by speed and sensor: relative deviations.

    The mean over all readings of a job counts as two more rows of each speed and sensor.
    """
    lack: dict[tuple[float, str], float] = {}
    for rows in equations.rows:
        data, W = rows.data, equations.coefficients(rows.data, theta)
        left, u = rows.raw(W), rows.residual(W)[2]
        bare = np.einsum("scq,q->sc", W[..., len(data.nodes) :], u)
        left = left + bare[:, None]
        square = (np.abs(left) ** 2 / 2 - rows.variance.reshape(*left.shape, 2).mean(axis=3)).sum(axis=1)
        effects = np.abs(bare[:, None] + rows.effect(W)) if data.modelled else np.abs(rows.effect(W))
        size, share = np.maximum((effects**2).sum(axis=1), np.finfo(float).tiny), 2 / left.shape[1]
        mean = max(float(square.sum() / size.sum()), 0.0)
        relative = np.sqrt((share * mean + np.maximum(square, 0.0) / size) / (1 + share))
        for (s, c), value in np.ndenumerate(relative):
            key = float(data.trials.speeds[s]), data.trials.sensors[c]
            lack[key] = max(lack.get(key, 0.0), float(value))
    return lack
