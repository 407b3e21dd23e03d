"""Numbers of a rotor from readings of runs, critical speeds and modes together, K θ = Y step by step.

Rows of all data, each divided by its error, and of what is known beforehand go through the nonlinear driver
of `rotorid.regression` with exact derivatives. χ² of data and priors together, m + p − n degrees of freedom,
tells whether the model explains the data: a model that lacks something pulls the numbers away from what is
known of them as well as leaving residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fem import Calibration, Rotor, is_reading
from fem.parameters import with_parameters
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.calibration.calibrated_rotor import LEVEL, CalibratedRotor
from rotorid.calibration.frequencies import MeasuredFrequencies
from rotorid.calibration.held_numbers import HeldNumbers, held_numbers
from rotorid.calibration.run_readings import ReadingRows, RunReadings
from rotorid.calibration.unknowns import Unknown, as_they_stand, check_different
from rotorid.regression.nonlinear import NonlinearEstimate, nonlinear_least_squares
from rotorid.regression.prior import Prior, effect, prior_rows
from rotorid.regression.search import search_from

SPREAD, ASIDE = 0.3, 0.7
"""Relative, of starting values without a prior: drawn ones, and along what the data see least."""
LIMIT, MORE = 40, 3
"""Evaluations of a search from one of several starts, and so many times more starts until one explains."""
SAME = 1e-3
"""Relative, besides three standard deviations: nearer ends of searches are one."""
AS_WELL = 4.0
"""Of χ²: other numbers that explain the data so nearly as well are told."""


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
            if not self.known:
                raise
            return np.full(self.known, np.inf)  # no rotor: the search shortens its step
        found = np.concatenate(parts)
        self.known = found.size
        return found

    known = 0

    @property
    def besides(self) -> int:
        """How many numbers are found besides: of unbalances, bows and scales of shapes."""
        complex_ones = sum(len(data.unbalance) + data.bow for data in self.readings)
        return 2 * complex_ones + sum(modes.scales for modes in self.frequencies)

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
    held: Sequence[Unknown] = (),
    starts: int = 3,
    seed: int = 0,
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
    held
        Numbers that are taken as they stand, with priors of what they might be off by: the data are asked
        whether they contradict that.
    starts
        Searches: from the starting values; from 70 % beside where that ends, to both sides, along what the
        data see least of the numbers without a prior; from others drawn by priors (or 30 % of the value).
        Three times as many, while no end explains the data.
    seed
        Of the drawn starts.

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
    first = np.array([unknown.first(rotor) for unknown in unknowns])
    first = np.clip(first, *_ends(limits))
    known = {unknown.label: unknown.prior for unknown in unknowns if unknown.prior}
    prior = prior_rows(names, known)
    for modes in frequencies:
        modes.check(rotor, equations.values(first), equations.paths)
    equations.weigh(first)
    equations.residual(first)
    begin, others = _best_start(equations, unknowns, prior, first, starts, seed)
    bounds = dict(zip(names, limits, strict=True))

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

    found = solve(begin)
    equations.weigh(found.estimate.solution)
    found = solve(found.estimate.solution, near=True)
    return _judged(equations, unknowns, prior, held, found, others)


def _ends(limits: Sequence[tuple[float | None, float | None]]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper ends (n,), infinite where there is none."""
    ends = np.array(limits, dtype=float)
    return np.where(np.isnan(ends[:, 0]), -np.inf, ends[:, 0]), np.where(
        np.isnan(ends[:, 1]), np.inf, ends[:, 1]
    )


def _best_start(
    equations: _Equations,
    unknowns: Sequence[Unknown],
    prior: Prior,
    first: FloatArray,
    starts: int,
    seed: int,
) -> tuple[FloatArray, list[FloatArray]]:
    """Where the lowest of several short searches ends, and the ends of all that stay inside the bounds."""
    from scipy.special import chdtrc

    random = np.random.default_rng(seed)
    residual, jacobian = prior.beside(equations.residual, equations.jacobian)
    spread = np.array([unknown.prior[1] if unknown.prior else 0.0 for unknown in unknowns])
    spread = np.where(spread > 0, spread, SPREAD * np.abs(first))
    lower, upper = _ends([unknown.limits(equations.rotor) for unknown in unknowns])
    free = np.array([unknown.prior is None for unknown in unknowns]) & (first != 0)
    dof = max(residual(first).size - first.size - equations.besides, 1)
    ends: list[tuple[float, FloatArray]] = []
    aside: list[FloatArray] = []
    for k in range(MORE * starts if starts > 1 else 0):
        if k >= starts and ends and chdtrc(dof, 2 * min(cost for cost, _ in ends)) >= LEVEL:
            break
        begin = first + (spread * random.uniform(-1.0, 1.0, first.size) if k else 0.0)
        if k == 1 and ends and free.any():
            at = ends[0][1]
            by = ASIDE * _least_seen(jacobian(at), at, free)
            aside = [at - by, at + by]
        begin = np.clip(aside.pop() if aside else begin, lower, upper)
        if np.isfinite(residual(begin)).all():
            end = search_from(residual, begin, jacobian, limit=LIMIT)
            inside = end is not None and (lower <= end[1]).all() and (end[1] <= upper).all()
            ends += [end] if end is not None and inside else []
    ends.sort(key=lambda end: end[0])
    return (ends[0][1] if ends else first), [end for _, end in ends]


def _least_seen(K: FloatArray, theta: FloatArray, free: BoolArray) -> FloatArray:
    """Direction (n,) of relative changes of the free numbers that moves rows the least, in their units."""
    weak = np.linalg.svd(K[:, free] * theta[free])[2][-1]
    found = np.zeros(theta.size)
    found[free] = weak / np.abs(weak).max() * theta[free]
    return found


def _judged(
    equations: _Equations,
    unknowns: Sequence[Unknown],
    prior: Prior,
    held: Sequence[Unknown],
    found: NonlinearEstimate,
    others: Sequence[FloatArray],
) -> CalibratedRotor:
    """The rotor with these numbers, and whether the model explains the data."""
    from scipy.special import chdtrc

    theta = found.estimate.solution
    K, r = equations.jacobian(theta), equations.residual(theta)
    values = equations.values(theta)
    besides = [
        rows.bare(*rows.data.coefficients(equations.rotor, values, equations.paths))
        for rows in equations.rows
    ]
    spent = sum(bare.rank for bare in besides) + sum(modes.scales for modes in equations.frequencies)

    def mismatch(theta: FloatArray) -> float:
        return float(np.sum(equations.residual(theta) ** 2) + np.sum(prior.residual(theta) ** 2))

    chi_square = mismatch(theta)
    dof = r.size + len(prior) - spent - found.estimate.rank
    chance = float(chdtrc(dof, chi_square)) if dof > 0 else 1.0
    tested = _tested(equations, prior, held, theta, K, r) if held else None
    misfit = chance < LEVEL or (tested is not None and tested.chance < LEVEL)
    covariance = found.estimate.solution_covariance
    covariance = np.zeros((theta.size,) * 2) if covariance is None else np.nan_to_num(covariance)
    times = max(chi_square / dof, 1.0) if misfit else 1.0
    covariance = covariance * times
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
        needs_trial_run=misfit or not (found.converged and found.estimate.full_rank),
    )
    known = ~np.isnan(found.values)
    same = 3 * np.sqrt(np.diag(covariance)) + SAME * np.abs(theta)
    apart = [
        end
        for end in others
        if (np.abs(end - theta) > same)[known].any() and mismatch(end) < chi_square + AS_WELL
    ]
    return CalibratedRotor(
        rotor=replace(with_parameters(equations.rotor, values), calibration=calibration),
        unknowns=tuple(unknowns),
        found=found,
        covariance=covariance,
        prior=effect(prior, K, r, theta, stated=True, at_bounds=found.at_bounds),
        jacobian=K,
        chi_square=chi_square,
        dof=dof,
        chance=chance,
        held=tested,
        unbalance=tuple(bare.u for bare in besides),
        unbalance_std=tuple(bare.std(covariance, times) for bare in besides),
        readings=tuple(equations.readings),
        stated=all(rows.stated for rows in equations.rows),
        other_ends=tuple(apart),
    )


def _tested(
    equations: _Equations,
    prior: Prior,
    held: Sequence[Unknown],
    theta: FloatArray,
    K: FloatArray,
    r: FloatArray,
) -> HeldNumbers:
    """Whether data and priors contradict what is held."""
    known = [(number.path, *number.prior) for number in held if number.prior]
    values = equations.values(theta) | {path: value for path, value, _ in known}
    H = equations.by([path for path, *_ in known], values) * np.array([std for *_, std in known])
    H = np.vstack((H, np.zeros((len(prior), len(known)))))
    names = [number.label for number in held if number.prior]
    return held_numbers(names, prior.below(K), H, np.append(r, prior.residual(theta)))


def _lack_of_fit(equations: _Equations, theta: FloatArray) -> dict[tuple[float, str], float]:
    """What the model leaves of what weights do beyond the errors, by speed and sensor: relative deviations.

    The mean over all readings of a job counts as two more rows of each speed and sensor.
    """
    found: dict[tuple[float, str], float] = {}
    for rows in equations.rows:
        data, W = rows.data, equations.coefficients(rows.data, theta)
        left, u = rows.raw(W), rows.residual(W)[2]
        bare = np.einsum("scq,q->sc", W[..., len(data.nodes) :], u)
        left = left + bare[:, None]
        square = (np.abs(left) ** 2 / 2 - rows.variance.reshape(*left.shape, 2).mean(axis=3)).sum(axis=1)
        effect = np.abs(bare[:, None] + rows.effect(W)) if data.modelled else np.abs(rows.effect(W))
        size, share = np.maximum((effect**2).sum(axis=1), np.finfo(float).tiny), 2 / left.shape[1]
        mean = max(float(square.sum() / size.sum()), 0.0)
        relative = np.sqrt((share * mean + np.maximum(square, 0.0) / size) / (1 + share))
        for (s, c), value in np.ndenumerate(relative):
            key = float(data.trials.speeds[s]), data.trials.sensors[c]
            found[key] = max(found.get(key, 0.0), float(value))
    return found
