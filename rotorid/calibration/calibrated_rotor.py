"""A calibrated rotor: numbers with their errors, what the data determine, whether the model explains them."""

from __future__ import annotations

from collections.abc import Mapping
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
from rotorid.base.text import capital, counted, error_figures, listing
from rotorid.calibration.held_numbers import HeldNumbers
from rotorid.calibration.run_readings import RunReadings
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
    found
        The estimate and how it was found.
    covariance
        Of the numbers, (n, n); where the model does not explain the data, larger by χ² over its degrees of
        freedom.
    prior
        What was known beforehand did; None: nothing was.
    jacobian
        Derivatives of the data's rows, (m, n), per standard deviation.
    chi_square, dof, chance
        Of data and priors together, and the probability of a larger χ².
    held
        What the data say of numbers that were taken as they stand; None: of none.
    unbalance
        Of each set of runs the unbalances of its nodes, kg·m, then the amplitudes of its bows, m; NaN where
        its readings do not determine one.
    unbalance_std
        Of each one standard deviation in one direction.
    readings
        Those sets.
    stated
        Whether the errors of all readings were stated or measured, not assumed.
    other_ends
        Other numbers (n,) that explain the data as well.
    """

    rotor: Rotor
    unknowns: tuple[Unknown, ...]
    found: NonlinearEstimate
    covariance: FloatArray
    prior: PriorEffect | None
    jacobian: FloatArray
    chi_square: float
    dof: int
    chance: float
    held: HeldNumbers | None
    unbalance: tuple[ComplexArray, ...]
    unbalance_std: tuple[FloatArray, ...]
    readings: tuple[RunReadings, ...]
    stated: bool
    other_ends: tuple[FloatArray, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers."""
        return self.found.names

    @property
    def values(self) -> FloatArray:
        """The numbers (n,), NaN where neither data nor priors determine one."""
        return self.found.values

    @property
    def std(self) -> FloatArray:
        """One standard deviation (n,); NaN at a bound and where not determined."""
        own = self.found.std
        unknown = np.full(len(self.names), np.nan) if own is None else own
        return np.where(np.isnan(unknown), np.nan, np.sqrt(np.diag(self.covariance)))

    @property
    def explained(self) -> bool:
        """Whether the model explains the data within their errors."""
        return not (self.rotor.calibration and self.rotor.calibration.needs_trial_run)

    @property
    def not_found(self) -> str:
        """Why no rotor has these numbers, in words, or nothing."""
        if not self.found.converged:
            return self.found.message
        return "" if self.found.estimate.full_rank else self.found.estimate.describe_rank()

    @cached_property
    def seen(self) -> str:
        """Of wished numbers that the data do not tell apart, the combinations that they do tell, in words."""
        prior = [unknown.prior for unknown in self.unknowns]
        size = np.array([p[1] if p else GUESS * abs(v) or 1.0 for p, v in zip(prior, self._all, strict=True)])
        K = self.jacobian * size
        C = np.linalg.inv(K.T @ K + np.eye(len(size)))  # in units of what is known
        wished = np.array([not unknown.beside for unknown in self.unknowns])
        weak = np.flatnonzero(wished & (np.diag(C) > VAGUE**2))
        if not weak.size:
            return ""
        variances, vectors = np.linalg.eigh(C[np.ix_(weak, weak)])
        names = [self.names[k] for k in weak]
        told = []
        for vector in vectors.T[variances < SEEN**2]:
            largest = int(np.argmax(np.abs(vector)))
            kept = np.where(np.abs(vector) >= TERM * abs(vector[largest]), vector / size[weak], 0.0)
            told.append(combination_words(np.round(kept / kept[largest], 2), names))
        only = (
            f"only {listing(told, 'and')} {'is' if len(told) == 1 else 'are'} seen"
            if told
            else "nothing is seen"
        )
        return f"of {listing(names, 'and')} {only}"

    @property
    def _every(self) -> BoolArray:
        return np.ones(len(self.names), dtype=bool)

    @property
    def _all(self) -> FloatArray:
        return self.found.estimate.solution

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        found = list(self.found.end_warnings)
        if self.chance < LEVEL and self.found.converged:
            times = np.sqrt(self.chi_square / self.dof)
            errors = "the stated errors explain" if self.stated else "the assumed errors explain"
            found.append(
                f"what is left is {times:.2g} times what {errors}: intervals are that much wider, and "
                "balancing with this rotor needs a trial run; free more numbers, state larger errors, or "
                "look for what the model lacks (a bow, a bearing, a loose part)"
            )
        if self.held is not None and self.held.chance < LEVEL and self.found.converged:
            trial = "" if self.chance < LEVEL else "; balancing with this rotor needs a trial run"
            found.append(self.held.words + trial)
        if self.prior is not None:
            found += self.prior.warnings
        if unseen := [name for name, u in self._bare if np.isnan(u)]:
            found.append(
                f"these readings do not determine the unbalance of {listing(unseen, 'and')}: name fewer"
            )
        if self.other_ends:
            values = listing(f"{n} = {v:.4g}" for n, v in zip(self.names, self.other_ends[0], strict=True))
            found.append(f"other numbers explain the data as well: {values}")
        return tuple(found)

    @property
    def _why(self) -> dict[str, str]:
        return {} if self.prior is None else self.prior.why

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
        wished = np.array([not unknown.beside for unknown in self.unknowns])
        tables = [parameter_text(*self._part(which), self._why) for which in (wished, ~wished) if which.any()]
        tables += [text(columns, width=COLUMNS) for columns in (self._unbalance_columns(),) if columns]
        more = "what else is not known exactly" if not wished.all() else "unbalance"
        return Answer(
            "\n".join(first),
            tables[0],
            self.warnings,
            tables=tuple(tables[1:]),
            more=more if tables[1:] else "",
        )

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
        found = self._bare
        if not found:
            return ()
        values = np.array([value for _, value in found])
        std = np.concatenate(self.unbalance_std)
        units = ["m" if name.startswith("bow") else "kg·m" for name, _ in found]
        return (
            Column("unbalance", [name for name, _ in found], str),
            Column("size", np.abs(values), "{:.4g}".format),
            Column("std", std, error_figures, "±"),
            Column("unit", units, str),
            Column("angle_deg", np.degrees(np.angle(values)) % 360, "{:.1f}".format, "angle, °"),
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per number: value, standard deviation, 95 % interval, share of the data."""
        return frame((*parameter_columns(*self._part(self._every)), self._share_column()))

    def _share_column(self) -> Column:
        share: Mapping[str, float] = (
            {} if self.prior is None else dict(zip(self.prior.rows.own, self.prior.share, strict=True))
        )
        return Column("data_share", np.array([share.get(name, 1.0) for name in self.names]))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; None where not determined."""
        calibration, estimate = self.rotor.calibration, self.found.estimate
        assert calibration is not None
        shares = dict(zip(self.names, self._share_column().values, strict=True))
        parameters = parameter_dict(*self._part(self._every))
        for name, unknown in zip(self.names, self.unknowns, strict=True):
            parameters[name] |= {"path": unknown.path, "prior": unknown.prior, "data_share": shares[name]}
        r = estimate.residuals
        return plain(
            {
                "parameters": parameters,
                "rank": estimate.rank,
                "condition_number": estimate.condition_number,
                "identifiable": estimate.full_rank,
                "unidentifiable": [] if estimate.full_rank else [estimate.describe_rank()],
                "combinations": {c.words: {"value": c.value, "std": c.std} for c in estimate.combinations},
                "correlation": self._part(self._every)[1].correlation,
                "seen": self.seen or None,
                "residual_rms": np.sqrt(np.mean(r**2)),
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.dof,
                "probability": self.chance,
                "held": None
                if self.held is None
                else {
                    "probability": self.held.chance,
                    "away": dict(zip(self.held.names, self.held.away, strict=True)),
                },
                "explained": self.explained,
                "lack_of_fit": [
                    {"speed_rad_s": speed, "sensor": sensor, "relative": value}
                    for speed, row in zip(calibration.speeds, calibration.lack_of_fit, strict=True)
                    for sensor, value in zip(calibration.sensors, row, strict=True)
                ],
                "unbalance": rows(self._unbalance_columns()) if self._unbalance_columns() else [],
                "warnings": self.warnings,
            }
        )
