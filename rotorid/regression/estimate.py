"""Estimate of a regression: values, covariance, intervals, and what the data do not determine.

Parameters that the data do not determine by themselves are told by their combinations that are determined: a
basis of the row space of K in reduced echelon form, such as "b − 0.5·d".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import AnyArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, rows
from rotorid.base.text import aligned, error_figures, listing, percent, sentence

WORD_TOLERANCE = 1e-7
"""A parameter whose share in the null space is below this is taken as determined."""


@dataclass(frozen=True)
class Combination:
    """A combination of parameters that the data determine.

    Attributes
    ----------
    words
        The combination, such as "b − 0.5·d" or "b*(1 - delta)".
    value, std
        Its estimate and one standard deviation, None where that is unknown.
    """

    words: str
    value: float
    std: float | None

    def line(self) -> str:
        """One line of text: "b − 0.5·d = 3.1 ± 0.2"."""
        return f"{self.words} = {self.value:.6g}" + ("" if self.std is None else f" ± {self.std:.2g}")


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
    def ci95(self) -> FloatArray | None:
        """95 % intervals (n, 2), normal ones of stated errors, else Student's t; None where unknown."""
        from scipy.special import ndtri, stdtrit

        if (std := self.std) is None or not (self.errors_stated or self.dof > 0):
            return None
        factor = ndtri(0.975) if self.errors_stated else stdtrit(self.dof, 0.975)
        return self.values[:, None] + np.outer(factor * std, [-1.0, 1.0])

    @property
    def correlation(self) -> FloatArray | None:
        """Correlation matrix (n, n); None where errors are unknown."""
        if (std := self.std) is None:
            return None
        size = np.where(std > 0, std, 1.0)
        return np.asarray(self.covariance / np.outer(size, size))


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
    for name, value, std, *ends in rows(parameter_columns(names, numbers)):
        digits = 6
        if value and std:  # two digits of the standard deviation show
            first, last = np.floor(np.log10((abs(value), std)))
            digits = int(np.clip(2 + first - last, 6, 10))
        estimate, *interval = ("" if each is None else f"{each:.{digits}g}" for each in (value, *ends))
        error = "" if std is None else error_figures(std)
        share = percent(std / abs(value)) if error and value else ""
        reason = why.get(name, "" if estimate else "not determined")
        lines.append([name, estimate, error, share, *interval, reason])
    filled = [column for column in zip(*lines, strict=True) if any(column[1:])]
    return aligned(filled, width=COLUMNS)


def parameter_dict(names: Sequence[str], numbers: Uncertain) -> dict[str, Any]:
    """Value, std and ci95 of each parameter by name, as JSON types; what is unknown is None."""
    return {
        name: {"value": value, "std": std, "ci95": None if low is None else [low, high]}
        for name, value, std, low, high in rows(parameter_columns(names, numbers))
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
    rank, condition_number
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

        Those of a nonlinear model where they were given (`curved`). Otherwise a basis of the row space of K
        in reduced echelon form; combinations of a single parameter are left out, for that parameter is
        determined.
        """
        if self.full_rank:
            return ()
        if self.curved is not None:
            return self.curved
        return tuple(
            self.combination(combination_words(row, self.names), float(row @ self.solution), row)
            for row in echelon(self.row_space)
            if np.count_nonzero(row) > 1
        )

    def combination(self, words: str, value: float, slope: FloatArray) -> Combination:
        """One of this value and these derivatives (n,) by the parameters, with its standard deviation."""
        cov = self.solution_covariance
        std = None if cov is None else float(np.sqrt((slope @ cov @ slope).clip(0.0)))
        return Combination(words, value, std)

    def at(self, theta: FloatArray, residuals: FloatArray) -> Estimate:
        """Of a step: the estimate of the parameters (n,) where it ends, with the residuals (m,) there."""
        return replace(
            self,
            values=np.where(np.isnan(self.values), np.nan, theta),
            solution=theta,
            residuals=residuals,
            chi_square=float(residuals @ residuals) if self.errors_stated else None,
        )

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
        return f"residuals are {ratio:.3g} times as large as the stated errors explain"

    @property
    def answer(self) -> Answer:
        """Values ± standard deviations, intervals, and what is not determined."""
        return self.answer_with({})

    def answer_with(self, why: Mapping[str, str]) -> Answer:
        """The answer with words beside parameters: that they stand at a bound, or what a prior says."""
        notes = [words] if (words := self.misfit(1.0)) else []
        if self.covariance is None and self.dof <= 0:
            notes.append("no intervals: no errors are stated and there are no more equations than parameters")
        lines = [parameter_text(self.names, self, why), *(f"  {c.line()}" for c in self.combinations)]
        return Answer(sentence(self.describe_rank()), "\n".join(lines), notes=tuple(notes))


def combination_words(coefficients: FloatArray, names: Sequence[str]) -> str:
    """Write a linear combination as an engineer would: "b − 0.5·d"."""
    words = ""
    for c, name in zip(coefficients, names, strict=True):
        if c:
            size = f"{abs(c):.4g}·".removeprefix("1·")
            words += f" {'−' if c < 0 else '+'} {size}{name}"
    return ("−" if words.startswith(" −") else "") + words[3:]


def only_determined(parameters: Sequence[str], lost: Sequence[str], words: Sequence[str]) -> str:
    """Say which parameters and combinations, in words, are determined and which parameters are not."""
    seen = [name for name in parameters if name not in lost]
    seen += [w for w in words if w not in seen and any(name in w for name in lost)]
    verb = "is" if len(seen) == 1 else "are"
    which = f"only {listing(seen, 'and')} {verb} determined" if seen else "nothing is determined"
    itself = "itself is" if len(lost) == 1 else "themselves are"
    return f"{which}; {listing(lost, 'and')} by {itself} not"


def unit_columns(A: AnyArray) -> tuple[AnyArray, FloatArray]:
    """Matrices (…, m, n) with columns of length 1, and these lengths (…, n), 1 for a column of zeros."""
    size = np.linalg.norm(A, axis=-2)
    scale = np.where(size > 0, size, 1.0)
    return A / scale[..., None, :], scale


def echelon(space: FloatArray) -> FloatArray:
    """Reduced row echelon form with clean zeros; columns are compared after scaling to unit length.

    Whole and half numbers that rounding has blurred become exact again.
    """
    A, scale = unit_columns(space)
    pivots: list[int] = []
    for column in range(A.shape[1]):
        if np.linalg.matrix_rank(A[:, [*pivots, column]], WORD_TOLERANCE) > len(pivots):
            pivots.append(column)
    reduced = np.linalg.lstsq(A[:, pivots], A, rcond=None)[0]
    rows = np.where(np.abs(reduced) > WORD_TOLERANCE, reduced, 0.0) * scale / scale[pivots, None]
    near = np.round(2 * rows) / 2
    return np.where(np.isclose(rows, near, WORD_TOLERANCE, WORD_TOLERANCE), near, rows)
