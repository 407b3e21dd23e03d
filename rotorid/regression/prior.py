"""What is known of parameters beside the data: a prior, or a ridge; both are more measured rows.

A prior θ_j = v ± s of a parameter is the row θ_j / s = v / s beside rows that are divided by their errors. A
ridge λ is a prior towards v whose s nobody knows: s = 1 / (√λ |K_j|) with K_j the column of θ_j, so that
|K θ − Y|² + λ Σ |K_j|² (θ_j − v_j)² is minimised: it multiplies the diagonal of KᵀK by 1 + λ, whatever units
there are. [Q] 2.3 asks for regularisation where its information matrix (2.28) is ill-conditioned, and leaves
open which.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.json import plain
from rotorid.base.text import percent
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import least_squares, solution
from rotorid.regression.search import RCOND, Function

FAR = 3.0
"""Standard deviations between a prior and the data from which on they contradict each other."""
SILENT = 1e-6
"""Share of the data below which they say nothing of a parameter."""


@dataclass(frozen=True, eq=False)
class PriorRows:
    """Rows of a prior or a ridge, to stand below those of the data.

    Attributes
    ----------
    names
        Of all n parameters.
    place, value, std
        Indices of the p parameters that have a row, the values there, and their deviations.
    ridge
        λ; 0 for a prior, whose deviations are known.
    """

    names: tuple[str, ...]
    place: IntArray
    value: FloatArray
    std: FloatArray
    ridge: float = 0.0

    def __len__(self) -> int:
        return len(self.place)

    def residual(self, theta: FloatArray) -> FloatArray:
        """Residuals (p,) at the parameters (n,)."""
        return np.asarray((theta[self.place] - self.value) / self.std)

    def below(self, K: FloatArray, r: FloatArray, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives (m, n) and residuals (m,) of the data, and those of these rows below them."""
        own = np.eye(len(self.names))[self.place] / self.std[:, None]
        return np.vstack((K, own)), np.append(r, self.residual(theta))

    def beside(self, residual: Function, jacobian: Function) -> tuple[Function, Function]:
        """The same for functions of the parameters (n,)."""
        return (
            lambda theta: np.append(residual(theta), self.residual(theta)),
            lambda theta: self.below(jacobian(theta), np.zeros(0), theta)[0],
        )


@dataclass(frozen=True)
class Prior:
    """What is known by name, or a ridge towards the start.

    Attributes
    ----------
    known
        Value and standard deviation, in the unit of the parameter.
    ridge
        λ of all parameters; 0: none.

    Raises
    ------
    ValueError
        A prior and a ridge, deviations or a λ that are not above 0.
    """

    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    ridge: float = 0.0

    def __post_init__(self) -> None:
        if self.known and self.ridge:
            raise ValueError("--ridge or [prior], not both: a ridge is a prior that nobody knows")
        if not (np.isfinite(self.ridge) and self.ridge >= 0):
            raise ValueError(f"--ridge takes a number above 0, such as 0.01, not {self.ridge:g}")
        for name, (value, std) in self.known.items():
            if not (np.isfinite(value) and np.isfinite(std) and std > 0):
                raise ValueError(f"the prior of {name} needs a value and a standard deviation above 0")

    def rows(self, names: Sequence[str], start: FloatArray, K: FloatArray) -> PriorRows:
        """Rows for these parameters (n,), of which a ridge takes the start and the columns of K there."""
        value, std = np.array([self.known.get(name, (0.0, np.inf)) for name in names]).T
        if self.ridge:
            with np.errstate(divide="ignore"):
                value, std = start, 1.0 / (np.sqrt(self.ridge) * np.linalg.norm(K, axis=0))
        place = np.flatnonzero(np.isfinite(std))
        return PriorRows(tuple(names), place, value[place], std[place], self.ridge)


NO_PRIOR = Prior()


@dataclass(frozen=True, eq=False)
class PriorEffect:
    """What a prior or a ridge did to an estimate.

    Attributes
    ----------
    rows
        The prior.
    share
        (p,): of what is known of each of its parameters, how much comes from the data, 1 − (variance with
        them / variance of the prior). Their sum, and 1 for each parameter without a prior, is the number of
        parameters that the data pay for.
    away
        (p,): standard deviations between the prior and all the rest; NaN where the data say nothing.
    alone, rank
        What the data alone determine, in words, if that is not everything; it holds near the values found.
    condition_numbers, residual_rms
        Of the rows of the data without and with it; a nonlinear model is linearised there.
    """

    rows: PriorRows
    share: FloatArray
    away: FloatArray
    alone: str
    rank: int
    condition_numbers: tuple[float, float]
    residual_rms: tuple[float, float]

    @property
    def why(self) -> dict[str, str]:
        """Beside each parameter, how much of it is from the data, where the prior says anything."""
        only = "by the ridge only" if self.rows.ridge else "by its prior only"
        return {
            name: f"{percent(share)} % from the data" if share >= 0.005 else only
            for name, share in zip(self._names, self.share, strict=True)
            if share < 0.005 or (share < 0.995 and not self.rows.ridge)
        }

    @property
    def warnings(self) -> tuple[str, ...]:
        """Priors that the data contradict; that a ridge has no intervals."""
        if self.rows.ridge:
            (rms, rms_now), (condition, now) = self.residual_rms, self.condition_numbers
            return (
                f"--ridge {self.rows.ridge:g} biases the estimate by nobody knows how much: no intervals. "
                f"Residual rms {rms_now:.3g}, condition number {now:.3g}; without it, linearised, {rms:.3g} "
                f"and {condition:.3g}",
            )
        each = zip(self._names, self.rows.value, self.rows.std, self.away, strict=True)
        return tuple(
            f"the data contradict the prior {name} = {value:.6g} ± {std:.2g} by {abs(away):.2g} standard "
            "deviations: one of them, or the model, is wrong"
            for name, value, std, away in each
            if abs(away) > FAR
        )

    def judgement(self, words: str) -> str:
        """What is determined with it, and by the data alone."""
        if not self.alone:
            return words
        which = "the ridge" if self.rows.ridge else "the prior"
        return f"With {which} {words[0].lower()}{words[1:]}\nWithout it {self.alone}."

    @property
    def _names(self) -> list[str]:
        return [self.rows.names[j] for j in self.rows.place]

    def of_model(self, alone: str) -> PriorEffect:
        """With better words of what the data alone determine than those of the linearised model."""
        return replace(self, alone=alone) if self.alone and alone else self

    def apart(self, found: Estimate, *, stated: bool) -> Estimate:
        """The estimate with χ² and degrees of freedom of the data alone, however far off the prior is."""
        m = len(found.residuals)
        if self.rows.ridge:
            found = replace(found, covariance=None, solution_covariance=None)
        chi_square = m * self.residual_rms[0] ** 2 if stated else None
        return replace(found, errors_stated=stated, chi_square=chi_square, dof=m - self.rank)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        each = zip(self._names, self.rows.value, self.rows.std, self.share, self.away, strict=True)
        keys = ("value", "std", "data_share", "deviation")
        parameters = {name: dict(zip(keys, numbers, strict=True)) for name, *numbers in each}
        (without, with_it), (before, after) = self.condition_numbers, self.residual_rms
        return plain(
            {
                **({"lambda": self.rows.ridge} if self.rows.ridge else {}),
                "parameters": parameters,
                "data_alone": self.alone or None,
                "condition_number": {"without": without, "with": with_it},
                "residual_rms": {"without": before, "with": after},
            }
        )


def prior_dict(found: PriorEffect | None) -> dict[str, Any]:
    """Part of a document: `prior` or `ridge`; empty without any."""
    return {} if found is None else {"ridge" if found.rows.ridge else "prior": found.to_dict()}


def effect(rows: PriorRows, K: FloatArray, r: FloatArray, theta: FloatArray) -> PriorEffect | None:
    """What the rows of a prior did; None without any.

    Parameters
    ----------
    rows
        The prior.
    K, r
        Derivatives (m, n) and residuals (m,) of the data at the estimate, divided by their errors.
    theta
        The estimate (n,).
    """
    if not len(rows):
        return None
    alone = least_squares(K, -r, names=rows.names, sigma=1.0, rcond=RCOND)
    both = least_squares(*rows.below(K, -r, theta), names=rows.names, sigma=1.0, rcond=RCOND)
    assert both.std is not None
    share = np.nan_to_num(1.0 - (both.std[rows.place] / rows.std) ** 2).clip(0.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (theta[rows.place] - rows.value) / (rows.std * np.sqrt(share))
    best = r + K @ solution(K, -r, rcond=RCOND)
    return PriorEffect(
        rows=rows,
        share=share,
        away=np.where(share > SILENT, away, np.nan),
        alone="" if alone.full_rank else alone.describe_rank(),
        rank=alone.rank,
        condition_numbers=(alone.condition_number, both.condition_number),
        residual_rms=(float(np.sqrt(np.mean(best**2))), float(np.sqrt(np.mean(r**2)))),
    )
