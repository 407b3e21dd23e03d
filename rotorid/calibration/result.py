"""A calibrated rotor: numbers with their errors, what the data determine, whether the model explains them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem import Rotor
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.text import listing, percent
from rotorid.calibration.rows_of_runs import RunReadings
from rotorid.calibration.unknowns import Unknown
from rotorid.regression.estimate import combination_words
from rotorid.regression.nonlinear import NonlinearEstimate
from rotorid.regression.prior import PriorEffect

LEVEL = 0.01
"""Probability of as large a contradiction by chance, below which the model does not explain the data."""
SEEN, VAGUE = 1 / 3, 2 / 3
"""Deviations, in those known before: a combination below the first is seen, a number above the second not."""
TERM = 0.3
"""Of the largest term of a combination, relative to what is known of each: smaller ones are not named."""
GUESS = 0.2
"""Of a number without a prior, in place of its deviation."""


@dataclass(frozen=True, eq=False)
class CalibratedRotor:
    """Numbers of a rotor that explain the data best.

    Attributes
    ----------
    rotor
        With these numbers, and `calibration`: their covariance and the lack of fit.
    unknowns
        What was estimated, n.
    fit
        The estimate and how it was reached.
    covariance
        Of the numbers, (n, n): larger by χ² over its degrees of freedom where the model does not explain the
        data, and by what numbers taken as exact may be off.
    prior
        What was known beforehand did; None: nothing was.
    jacobian
        Derivatives of the data's rows, (m, n), per standard deviation.
    chi_square, dof, chance
        Of data and priors together, and the probability of a larger χ².
    explained
        Whether the model explains the data within their errors.
    lack_of_fit
        What it leaves of what weights do beyond the errors, relative rms; 0 where it explains them.
    exact
        Names of numbers that were taken as the rotor file has them, whose usual errors widen the covariance.
    unbalance
        Of each set of runs the unbalances of its nodes, kg·m, then the amplitudes of its bows, m; NaN where
        its readings do not determine one.
    unbalance_std
        Of each one standard deviation in one direction.
    readings
        Those sets.
    stated
        Whether the errors of all readings were stated or measured, not assumed.
    searches
        From how many starting values a search came to an end.
    other_ends
        Other numbers (n,) that explain the data as well.
    """

    rotor: Rotor
    unknowns: tuple[Unknown, ...]
    fit: NonlinearEstimate
    covariance: FloatArray
    prior: PriorEffect | None
    jacobian: FloatArray
    chi_square: float
    dof: int
    chance: float
    explained: bool
    lack_of_fit: float
    exact: tuple[str, ...]
    unbalance: tuple[ComplexArray, ...]
    unbalance_std: tuple[FloatArray, ...]
    readings: tuple[RunReadings, ...]
    stated: bool
    searches: int
    other_ends: tuple[FloatArray, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers."""
        return self.fit.estimate.names

    @property
    def values(self) -> FloatArray:
        """The numbers (n,), NaN where neither data nor priors determine one."""
        return self.fit.values

    @property
    def std(self) -> FloatArray:
        """One standard deviation (n,); NaN at a bound and where not determined."""
        of_fit = self.fit.estimate.std
        return np.where(
            np.isnan(np.nan if of_fit is None else of_fit), np.nan, np.sqrt(np.diag(self.covariance))
        )

    @property
    def data_share(self) -> FloatArray:
        """How much of what is known of each number comes from the data, (n,): 1 without a prior."""
        shares = (
            {} if self.prior is None else dict(zip(self.prior.rows.parameters, self.prior.share, strict=True))
        )
        return np.array([shares.get(name, 1.0) for name in self.names])

    @property
    def wished(self) -> BoolArray:
        """Which numbers were asked for (n,); the others are not known exactly either."""
        return np.array([not unknown.beside for unknown in self.unknowns])

    @property
    def bare(self) -> list[str]:
        """Of what `unbalance` is, one set of runs after the other."""
        return [
            name
            for data in self.readings
            for name in [f"node {n}" for n in data.unbalance] + [f"bow {k + 1}" for k in range(data.bow)]
        ]

    @property
    def undetermined(self) -> str:
        """Why no rotor has these numbers, in words, or nothing."""
        if not self.fit.converged:
            return self.fit.message
        return "" if self.fit.estimate.full_rank else self.fit.estimate.describe_rank()

    @property
    def seen(self) -> str:
        """Of wished numbers that the data do not tell apart, the combinations that they do tell, in words."""
        best = self.fit.estimate.solution
        prior = [unknown.prior for unknown in self.unknowns]
        size = np.array([p[1] if p else GUESS * abs(v) or 1.0 for p, v in zip(prior, best, strict=True)])
        K = self.jacobian * size
        C = np.linalg.inv(K.T @ K + np.eye(len(size)))  # in units of what is known
        weak = np.flatnonzero(self.wished & (np.diag(C) > VAGUE**2))
        if not weak.size:
            return ""
        variances, vectors = np.linalg.eigh(C[np.ix_(weak, weak)])
        names = [self.names[k] for k in weak]
        combinations = []
        for vector in vectors.T[variances < SEEN**2]:
            largest = int(np.argmax(np.abs(vector)))
            kept = np.where(np.abs(vector) >= TERM * abs(vector[largest]), vector / size[weak], 0.0)
            combinations.append(combination_words(np.round(kept / kept[largest], 2), names))
        verb = "is" if len(combinations) == 1 else "are"
        only = f"only {listing(combinations, 'and')} {verb} seen" if combinations else "nothing is seen"
        return f"of {listing(names, 'and')} {only}"

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        warnings = [*filter(None, (self.undetermined, self.fit.bound_warning))]
        if self.chance < LEVEL and self.fit.converged:
            times, errors = np.sqrt(self.chi_square / self.dof), "stated" if self.stated else "assumed"
            lack = f" ({percent(self.lack_of_fit)} % of what weights do)" if self.lack_of_fit else ""
            warnings.append(
                f"what is left is {times:.2g} times what the {errors} errors explain{lack}: intervals are "
                "that much wider, and balancing with this rotor needs a trial run; free more numbers, state "
                "larger errors, or look for what the model lacks (a bow, a bearing, a loose part)"
            )
        if self.prior is not None:
            warnings += self.prior.warnings
        values = np.concatenate((*self.unbalance, [0]))
        if unseen := [name for name, u in zip(self.bare, values, strict=False) if np.isnan(u)]:
            warnings.append(
                f"these readings do not determine the unbalance of {listing(unseen, 'and')}: name fewer"
            )
        if self.other_ends:
            other = listing(f"{n} = {v:.4g}" for n, v in zip(self.names, self.other_ends[0], strict=True))
            warnings.append(f"other numbers explain the data as well: {other}")
        return tuple(warnings)
