"""A calibrated rotor: numbers with their errors, what the data determine, whether the model explains them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fem import Rotor
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import range_text
from rotorid.base.text import capital, counted, error_figures, listing, percent
from rotorid.calibration.readings import RunReadings
from rotorid.calibration.unknowns import Unknown
from rotorid.regression.estimate import Uncertain, parameter_columns, parameter_dict, parameter_text
from rotorid.regression.nonlinear import NonlinearEstimate
from rotorid.regression.prior import PriorEffect
from rotorid.regression.undetermined_combinations import combination_words

if TYPE_CHECKING:
    import pandas as pd

LEVEL = 0.01
"""Probability of as large a contradiction by chance, below which the model does not explain the data."""
SEEN, VAGUE = 1 / 3, 2 / 3
"""Deviations, in those known before: a combination below the first is seen, a number above the second not."""
TERM = 0.3
"""Of the largest term of a combination, relative to what is known of each: smaller ones are not named."""
GUESS = 0.2
"""Of a number without a prior, in place of its deviation."""


@dataclass(frozen=True, eq=False)
class CalibratedRotor(Answered):
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
        return self.fit.names

    @property
    def values(self) -> FloatArray:
        """The numbers (n,), NaN where neither data nor priors determine one."""
        return self.fit.values

    @property
    def std(self) -> FloatArray:
        """One standard deviation (n,); NaN at a bound and where not determined."""
        of_fit = np.full(len(self.names), np.nan) if self.fit.std is None else self.fit.std
        return np.where(np.isnan(of_fit), np.nan, np.sqrt(np.diag(self.covariance)))

    @property
    def explained(self) -> bool:
        """Whether the model explains the data within their errors."""
        return not (self.rotor.calibration and self.rotor.calibration.needs_trial_run)

    @property
    def lack_of_fit(self) -> float:
        """What the model leaves of what weights do beyond the errors, relative rms; 0 where it explains."""
        lack = self.rotor.calibration.lack_of_fit if self.rotor.calibration else np.zeros(0)
        return float(np.sqrt(np.mean(lack**2))) if lack.size else 0.0

    @property
    def undetermined(self) -> str:
        """Why no rotor has these numbers, in words, or nothing."""
        if not self.fit.converged:
            return self.fit.message
        return "" if self.fit.estimate.full_rank else self.fit.estimate.describe_rank()

    @cached_property
    def seen(self) -> str:
        """Of wished numbers that the data do not tell apart, the combinations that they do tell, in words."""
        best = self.fit.estimate.solution
        prior = [unknown.prior for unknown in self.unknowns]
        size = np.array([p[1] if p else GUESS * abs(v) or 1.0 for p, v in zip(prior, best, strict=True)])
        K = self.jacobian * size
        C = np.linalg.inv(K.T @ K + np.eye(len(size)))  # in units of what is known
        weak = np.flatnonzero(self._wished & (np.diag(C) > VAGUE**2))
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
        warnings = list(self.fit.end_warnings)
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
        if unseen := [name for name, u in self._bare if np.isnan(u)]:
            warnings.append(
                f"these readings do not determine the unbalance of {listing(unseen, 'and')}: name fewer"
            )
        if self.other_ends:
            values = listing(f"{n} = {v:.4g}" for n, v in zip(self.names, self.other_ends[0], strict=True))
            warnings.append(f"other numbers explain the data as well: {values}")
        return tuple(warnings)

    @property
    def answer(self) -> Answer:
        """Whether the model explains the data; the wished numbers; what the data do not tell."""
        fits = "explains" if self.explained else "does NOT explain"
        chi = f"χ² {self.chi_square:.4g} with {counted(self.dof, 'degree')} of freedom"
        first = [f"The model {fits} the data ({chi})."]
        speeds = [speed for data in self.readings for speed in data.trials.speeds.tolist()]
        if self.seen:
            at = f"at {range_text(min(speeds), max(speeds))} " if speeds else ""
            first.append(capital(f"{at}{self.seen}."))
        why = {} if self.prior is None else self.prior.why
        beside = ~self._wished
        tables = [parameter_text(*self._part(which), why) for which in (~beside, beside) if which.any()]
        if columns := self._unbalance_columns():
            tables.append(text(columns, width=COLUMNS))
        more = "what else is not known exactly" if beside.any() else "unbalance"
        notes = []
        if self.searches > 1:
            notes.append(f"searched from {self.searches} starting values")
        if self.exact:
            exact = counted(len(self.exact), "number")
            notes.append(f"± count what {exact} taken as exact may be off")
        return Answer(
            "\n".join(first),
            tables[0],
            self.warnings,
            tuple(notes),
            tables=tuple(tables[1:]),
            more=more if tables[1:] else "",
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per number: value, standard deviation, 95 % interval, share of the data."""
        share = Column("data_share", np.array([self._shares.get(name, 1.0) for name in self.names]))
        return frame((*parameter_columns(*self._part(np.ones(len(self.names), dtype=bool))), share))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; None where not determined."""
        estimate = self.fit.estimate
        names, every = self._part(np.ones(len(self.names), dtype=bool))
        parameters = parameter_dict(names, every)
        for name, unknown in zip(names, self.unknowns, strict=True):
            share = self._shares.get(name, 1.0)
            parameters[name] |= {"path": unknown.path, "prior": unknown.prior, "data_share": share}
        return plain(
            {
                "parameters": parameters,
                "rank": estimate.rank,
                "condition_number": estimate.condition_number,
                "identifiable": estimate.full_rank,
                "unidentifiable": [] if estimate.full_rank else [estimate.describe_rank()],
                "combinations": {c.words: {"value": c.value, "std": c.std} for c in estimate.combinations},
                "correlation": every.correlation,
                "seen": self.seen or None,
                "residual_rms": np.sqrt(np.mean(estimate.residuals**2)),
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.dof,
                "probability": self.chance,
                "exact": self.exact,
                "explained": self.explained,
                "lack_of_fit": self.lack_of_fit,
                "unbalance": rows(self._unbalance_columns()) if self._bare else [],
                "warnings": self.warnings,
            }
        )

    @property
    def _wished(self) -> BoolArray:
        return np.array([not unknown.beside for unknown in self.unknowns])

    @property
    def _shares(self) -> dict[str, float]:
        prior = self.prior
        return {} if prior is None else dict(zip(prior.rows.own, prior.share.tolist(), strict=True))

    def _part(self, which: BoolArray) -> tuple[tuple[str, ...], Uncertain]:
        """Names of some of the numbers, and these with their errors."""
        part = Uncertain()
        part.values, part.errors_stated, part.dof = self.values[which], True, 0
        part.covariance = np.where(np.isnan(self.std), np.nan, self.covariance)[np.ix_(which, which)]
        return tuple(name for name, taken in zip(self.names, which, strict=True) if taken), part

    @property
    def _bare(self) -> list[tuple[str, complex]]:
        """Unbalances of nodes, kg·m, and bows, m, of all sets of runs; NaN where not determined."""
        return [
            (f"node {node}" if k < len(data.unbalance) else f"bow {k - len(data.unbalance) + 1}", value)
            for data, u in zip(self.readings, self.unbalance, strict=True)
            for k, (node, value) in enumerate(zip((*data.unbalance, *[0] * data.bow), u, strict=True))
        ]

    def _unbalance_columns(self) -> tuple[Column, ...]:
        """What the bare rotor's readings say of its unbalances and bows."""
        if not self._bare:
            return ()
        names, values = zip(*self._bare, strict=True)
        return (
            Column("unbalance", names, str),
            Column("size", np.abs(values), "{:.4g}".format),
            Column("std", np.concatenate(self.unbalance_std), error_figures, "±"),
            Column("unit", ["m" if name.startswith("bow") else "kg·m" for name in names], str),
            Column("angle_deg", np.degrees(np.angle(values)) % 360, "{:.1f}".format, "angle, °"),
        )
