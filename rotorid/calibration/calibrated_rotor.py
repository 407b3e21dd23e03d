"""A calibrated rotor: its numbers with their errors, what the data determine, whether the model explains them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.model.rotor import Rotor
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import range_text
from rotorid.base.text import counted, listing, percent
from rotorid.calibration.run_readings import RunReadings
from rotorid.calibration.unknowns import Unknown
from rotorid.regression.estimate import parameter_columns, parameter_dict, parameter_text
from rotorid.regression.nonlinear import NonlinearEstimate
from rotorid.regression.prior import PriorEffect
from rotorid.regression.undetermined_combinations import combination_words

if TYPE_CHECKING:
    import pandas as pd

SEEN = 3.0
"""Times that data must tell a combination better than what is known beforehand, to be named as seen."""
LITTLE = 0.1
"""Share of the data below which a number is known by its prior only."""
TERM = 0.3
"""Of the largest term of a combination, relative to what is known of each: smaller ones are not named."""
CORRELATED = 0.9
GUESS = 0.2
"""Of a number without a prior, for the size of a combination."""


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
    unbalance
        Of each set of runs the unbalances of its nodes, kg·m, then the amplitudes of its bows, m.
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
    unbalance: tuple[ComplexArray, ...]
    readings: tuple[RunReadings, ...]
    stated: bool
    other_ends: tuple[FloatArray, ...]

    errors_stated = True

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
    def ci95(self) -> FloatArray:
        """95 % intervals (n, 2)."""
        return np.stack((self.values - 1.96 * self.std, self.values + 1.96 * self.std), axis=1)

    @property
    def explained(self) -> bool:
        """Whether the model explains the data within their errors."""
        return not (self.rotor.calibration and self.rotor.calibration.needs_trial_run)

    @cached_property
    def seen(self) -> tuple[str, ...]:
        """Combinations that the data see much better than what is known beforehand, in words, the best first."""
        scale = np.array(
            [u.prior[1] if u.prior else GUESS * abs(v) or 1.0 for u, v in zip(self.unknowns, self._all, strict=True)]
        )
        K = self.jacobian * scale
        squares, vectors = np.linalg.eigh(K.T @ K)
        found = []
        for square, vector in zip(squares[::-1], vectors.T[::-1], strict=True):
            if square < SEEN**2:
                break
            largest = int(np.argmax(np.abs(vector)))
            kept = np.where(np.abs(vector) >= TERM * abs(vector[largest]), vector / scale, 0.0)
            found.append(combination_words(np.round(kept / kept[largest], 3), self.names))
        return tuple(found)

    @property
    def _all(self) -> FloatArray:
        return self.found.estimate.solution

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        found = list(self.found.end_warnings)
        if self.chance < 1 and not self.explained and self.found.converged:
            times = np.sqrt(self.chi_square / self.dof)
            errors = "the stated errors explain" if self.stated else "the assumed errors explain"
            found.append(
                f"the model does not explain the data: what is left is {times:.2g} times what {errors}; intervals "
                "are that much wider, and balancing with it needs a trial run: free more numbers, state larger "
                "errors, or look for what the model lacks (a bow, a bearing, a loose part)"
            )
        if self.prior is not None:
            found += self.prior.warnings
        if self.other_ends:
            values = listing(f"{n} = {v:.4g}" for n, v in zip(self.names, self.other_ends[0], strict=True))
            found.append(f"other numbers explain the data as well: {values}")
        return tuple(found)

    @property
    def _why(self) -> dict[str, str]:
        return {} if self.prior is None else self.prior.why

    @property
    def weak(self) -> tuple[str, ...]:
        """Numbers of which the data say next to nothing: the prior stays."""
        if self.prior is None:
            return ()
        pairs = zip(self.prior.rows.own, self.prior.share, strict=True)
        return tuple(name for name, share in pairs if share < LITTLE)

    @property
    def answer(self) -> Answer:
        """Whether the model explains the data; the numbers; what the data see."""
        n, seen = len(self.names), len(self.seen)
        fits = "explains" if self.explained else "does not explain"
        first = f"The model {fits} the data (χ² {self.chi_square:.4g}, {counted(self.dof, 'degree')} of freedom)."
        speeds = [speed for data in self.readings for speed in data.trials.speeds.tolist()]
        at = f" at {range_text(min(speeds), max(speeds))}" if speeds else ""
        if seen < n:
            which = f"{counted(seen, 'combination')} of the {counted(n, 'number')}"
            first += f"\nThe data{at} see {which} well" + (f": {listing(self.seen[:3], 'and')}" if seen else "")
            first += ", …." if seen > 3 else "."
        notes = []
        if self.weak:
            notes.append(f"the data say less than {percent(LITTLE)} % of {listing(self.weak, 'and')}: the priors stay")
        pairs = self._pairs()
        if pairs:
            notes.append(f"known better together than alone: {listing(pairs, 'and')}")
        found = [parameter_text(self.names, self, self._why)]  # type: ignore[arg-type]
        found += [text(table, width=100) for table in (self._unbalance_columns(),) if table]
        return Answer(first, "\n\n".join(found), self.warnings, tuple(notes))

    def _pairs(self) -> list[str]:
        """Strongly correlated numbers, and their combination that is known."""
        std = np.where(self.std > 0, self.std, np.inf)
        r = np.triu(self.covariance / np.outer(std, std), 1)
        order = np.argsort(-np.abs(r), axis=None)[:2]
        found = []
        for i, j in zip(*np.unravel_index(order, r.shape), strict=True):
            if abs(r[i, j]) > CORRELATED:
                row = np.zeros(len(self.names))
                row[i], row[j] = 1.0, -np.sign(r[i, j]) * std[i] / std[j]
                value, spread = row @ self._all, np.sqrt(max(row @ self.covariance @ row, 0.0))
                found.append(f"{combination_words(np.round(row, 9), self.names)} = {value:.4g} ± {spread:.2g}")
        return found

    def _unbalance_columns(self) -> tuple[Column, ...]:
        """What the bare rotor's readings say of its unbalances and bows."""
        found = [
            (f"node {node}" if k < len(data.unbalance) else f"bow {k - len(data.unbalance) + 1}", value)
            for data, u in zip(self.readings, self.unbalance, strict=True)
            for k, (node, value) in enumerate(zip((*data.unbalance, *[0] * data.bow), u, strict=True))
        ]
        if not found:
            return ()
        values = np.array([value for _, value in found])
        units = ["m" if name.startswith("bow") else "kg·m" for name, _ in found]
        return (
            Column("unbalance", [name for name, _ in found], str),
            Column("size", np.abs(values), "{:.4g}".format),
            Column("unit", units, str),
            Column("angle_deg", np.degrees(np.angle(values)) % 360, "{:.1f}".format, "angle, °"),
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per number: value, standard deviation, 95 % interval, share of the data."""
        return frame((*parameter_columns(self.names, self), self._share_column()))  # type: ignore[arg-type]

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
        parameters = parameter_dict(self.names, self)  # type: ignore[arg-type]
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
                "seen": self.seen,
                "residual_rms": np.sqrt(np.mean(r**2)),
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.dof,
                "probability": self.chance,
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
