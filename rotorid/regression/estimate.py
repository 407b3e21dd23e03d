"""Estimate of a regression: values, covariance, intervals, and what the data do not determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rotorid.base.answer import COLUMNS, Answer, Answered, Column
from rotorid.base.arrays import FloatArray
from rotorid.base.json import cell, plain
from rotorid.base.text import error_figures, percent, sentence, table
from rotorid.regression.undetermined_combinations import (
    Combination,
    combination_words,
    echelon,
    only_determined,
)


class Uncertain:
    """Standard deviations, intervals and correlations of values with a covariance matrix.

    Attributes
    ----------
    values
        Shape (n,); NaN where the data do not determine one.
    covariance
        Shape (n, n), NaN where not determined; None where errors are unknown.
    dof, errors_stated
        Degrees of freedom; whether the covariance comes from errors that the user stated (normal intervals)
        and not from the residuals (Student's t).
    """

    values: FloatArray
    covariance: FloatArray | None
    dof: int
    errors_stated: bool

    @property
    def std(self) -> FloatArray | None:
        """Standard deviations (n,), NaN where not determined; None where errors are unknown."""
        return None if self.covariance is None else np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def coverage_factor(self) -> float | None:
        """Half width of the 95 % interval in standard deviations; None where there is no interval."""
        return coverage_factor(None if self.errors_stated else self.dof)

    @property
    def ci95(self) -> FloatArray | None:
        """95 % intervals, shape (n, 2); None where errors are unknown."""
        std, factor = self.std, self.coverage_factor
        if std is None or factor is None:
            return None
        return np.stack((self.values - factor * std, self.values + factor * std), axis=1)

    @property
    def correlation(self) -> FloatArray | None:
        """Correlation matrix (n, n); None where errors are unknown."""
        if self.covariance is None:
            return None
        std = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(*[np.where(std > 0, std, 1.0)] * 2))


def parameter_columns(names: Sequence[str], numbers: Uncertain) -> tuple[Column, ...]:
    """Parameter, value, std and the 95 % interval: one row a parameter, NaN where unknown."""
    unknown = np.full(len(names), np.nan)
    std, ci95 = numbers.std, numbers.ci95
    low, high = (unknown, unknown) if ci95 is None else ci95.T
    return (
        Column("parameter", names),
        Column("value", numbers.values),
        Column("std", unknown if std is None else std),
        Column("ci95_low", low),
        Column("ci95_high", high),
    )


def parameter_text(names: Sequence[str], numbers: Uncertain, why: Mapping[str, str]) -> str:
    """A table of the parameters: estimate, ±, 95 % interval, and why there is none."""
    lines = [["parameter", "estimate", "±", "%", "95 %: from", "to", ""]]
    for name, value, std, *ends in zip(*(c.values for c in parameter_columns(names, numbers)), strict=True):
        digits = value_digits(value, std)
        texts = [f"{x:.{digits}g}" for x in (value, *ends)]
        share = percent(std / abs(value)) if value else ""
        reason = "" if np.isnan(value) else why.get(name, "")
        error = "" if np.isnan(std) else error_figures(std)
        cells = [name, texts[0], error, share, *texts[1:], reason]
        lines.append(["" if text == "nan" else text for text in cells])
    filled = [column for column in zip(*lines, strict=True) if any(column[1:])]
    shown = table([list(line) for line in zip(*filled, strict=True)], width=COLUMNS).splitlines()
    blank = np.flatnonzero(np.isnan(numbers.values)).tolist()
    wide = max((len(names[k]) for k in blank), default=0)
    for k in blank:  # the words stand beside the name, where a number would begin
        shown[k + 1] = f"  {names[k]:<{wide}}  {why.get(names[k], 'not determined')}"
    return "\n".join(shown)


def parameter_dict(names: Sequence[str], numbers: Uncertain) -> dict[str, Any]:
    """Value, std and ci95 of each parameter by name, as JSON types; what is unknown is None."""
    return {
        name: {"value": value, "std": std, "ci95": None if low is None else [low, high]}
        for name, value, std, low, high in zip(
            *(cell(column.values) for column in parameter_columns(names, numbers)), strict=True
        )
    }


@dataclass(frozen=True, eq=False)
class Estimate(Answered, Uncertain):
    """Parameters estimated from `K θ = Y`, and what the data do not say about them.

    Attributes
    ----------
    names
        Of the n parameters.
    values
        Shape (n,); NaN for a parameter that the data do not determine.
    solution
        Shape (n,); the solution of smallest (column-scaled) norm, equal to `values` at full rank.
    covariance
        Shape (n, n), or None where errors are unknown; NaN rows for parameters that are not determined.
    residuals
        Y − K θ, shape (m,).
    dof
        Degrees of freedom, m − rank (rows of zero weight not counted).
    rank, condition_number, singular_values
        Of the row-weighted, column-scaled matrix.
    errors_stated
        Whether the covariance comes from errors that the user stated (normal intervals) and not from the
        residuals (Student's t).
    chi_square
        Weighted sum of squared residuals over the stated variances; None without stated errors.
    row_space
        Combinations of the parameters that the data determine: rows that span them all, shape (rank, n).
    solution_covariance
        Of `solution`, shape (n, n): right for combinations that the data determine; None where errors are
        unknown.
    curved
        What a nonlinear model determines instead of its parameters, such as products; None: linear
        combinations.
    """

    names: tuple[str, ...]
    values: FloatArray
    solution: FloatArray
    covariance: FloatArray | None
    residuals: FloatArray
    dof: int
    rank: int
    condition_number: float
    singular_values: FloatArray
    errors_stated: bool
    chi_square: float | None
    row_space: FloatArray
    solution_covariance: FloatArray | None
    curved: tuple[Combination, ...] | None = None

    @property
    def full_rank(self) -> bool:
        """Whether the data determine every parameter."""
        return self.rank == len(self.names)

    @cached_property
    def combinations(self) -> tuple[Combination, ...]:
        """What the data determine instead, where they do not determine every parameter (else empty).

        Those of a nonlinear model, where they have been found (`curved`). Otherwise a basis of the row space
        of K in reduced echelon form; combinations of a single parameter are left out, for that parameter is
        determined.
        """
        if self.full_rank:
            return ()
        if self.curved is not None:
            return self.curved
        basis = echelon(self.row_space)
        return tuple(self._combination(row) for row in basis if np.count_nonzero(row) > 1)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters that the data do not determine."""
        return tuple(n for n, v in zip(self.names, self.values, strict=True) if np.isnan(v))

    def describe_rank(self) -> str:
        """Say in words what the data determine."""
        if self.full_rank:
            n, condition = len(self.names), self.condition_number
            who = "the parameter is" if n == 1 else f"all {n} parameters are"
            return f"{who} determined (condition number {condition:.3g})"
        words = only_determined(self.names, self.undetermined, [c.words for c in self.combinations])
        return f"{words} (rank {self.rank} of {len(self.names)})"

    def _combination(self, row: FloatArray) -> Combination:
        cov = self.solution_covariance
        std = None if cov is None else float(np.sqrt(max(float(row @ cov @ row), 0.0)))
        return Combination(combination_words(row, self.names), float(row @ self.solution), std, row)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        return plain(
            {
                "parameters": parameter_dict(self.names, self),
                "rank": self.rank,
                "condition_number": self.condition_number,
                "identifiable": self.full_rank,
                "unidentifiable": [] if self.full_rank else [self.describe_rank()],
                "combinations": {c.words: {"value": c.value, "std": c.std} for c in self.combinations},
                "residual_rms": np.sqrt(np.mean(self.residuals**2)),
            }
        )

    def misfit(self, chance: float = 1e-3) -> str:
        """Words where residuals so large are less probable than this for the stated errors; else none."""
        from scipy.special import chdtrc

        if self.chi_square is None or self.dof < 1 or chdtrc(self.dof, self.chi_square) > chance:
            return ""
        ratio = float(np.sqrt(self.chi_square / self.dof))
        more = f"{ratio:.2g} times as large as" if ratio >= 2 else f"{100 * (ratio - 1):.2g} % larger than"
        return f"residuals are {more} the stated errors explain"

    @property
    def answer(self) -> Answer:
        """Values ± standard deviations, intervals, and what is not determined."""
        return self.told()

    def told(self, at_bounds: Sequence[str] = (), why: Mapping[str, str] | None = None) -> Answer:
        """The answer with words beside parameters: that they stand at a bound, or what a prior says."""
        notes = [words] if (words := self.misfit(1.0)) else []
        if self.covariance is None and self.dof <= 0:
            notes.append("no intervals: no errors are stated and there are no more equations than parameters")
        beside = {**(why or {}), **dict.fromkeys(at_bounds, "at its bound")}
        lines = [parameter_text(self.names, self, beside)]
        lines += [f"  {c.line()}" for c in self.combinations]
        return Answer(sentence(self.describe_rank()), "\n".join(lines), notes=tuple(notes))


def coverage_factor(dof: float | None) -> float | None:
    """Half width of a 95 % interval in standard deviations.

    Parameters
    ----------
    dof
        Degrees of freedom of the variance; None for a stated (known) variance.

    Returns
    -------
    1.96 for a known variance, Student's t otherwise, None at dof = 0, where no interval exists.
    """
    from scipy.special import ndtri, stdtrit

    if dof is None:
        return float(ndtri(0.975))
    return float(stdtrit(dof, 0.975)) if dof > 0 else None


def value_digits(value: float, std: float | None) -> int:
    """Significant digits of a value that show two of its standard deviation, from six to ten."""
    if std is None or not (std > 0 and np.isfinite(std)) or value == 0:
        return 6
    return int(np.clip(2 + np.floor(np.log10(abs(value))) - np.floor(np.log10(std)), 6, 10))
