"""Priors of parameters, and a ridge; both are more measured rows.

A prior θ_j = v ± s is the row θ_j / s = v / s beside rows that are divided by their errors. A ridge λ is a
prior at the start with s = 1 / (√λ |K_j|), K_j the column of θ_j there: it minimises
|K θ − Y|² + λ Σ |K_j|² (θ_j − v_j)², and adds λ times the diagonal of KᵀK at the start to KᵀK. [Q] 2.3
asks for regularisation where its information matrix (2.28) is ill-conditioned, and leaves open which.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np

from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.json import plain
from rotorid.base.text import percent
from rotorid.regression.estimate import Estimate
from rotorid.regression.linear import JACOBIAN_RCOND, least_squares

FAR = 3.0
"""Standard deviations between a prior and the data from which on they contradict each other."""
SILENT = 1e-6
"""Share of the data below which they say nothing of a parameter."""
PriorValues = Mapping[str, tuple[float, float]]
"""Value and standard deviation of parameters, by name, in their units."""
Function = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Prior:
    """Rows below those of the data: value and deviation of p of the n parameters, by `place`.

    `ridge` is λ, or 0 for a prior.
    """

    names: tuple[str, ...]
    place: IntArray
    value: FloatArray
    std: FloatArray
    ridge: float = 0.0

    def __len__(self) -> int:
        return len(self.place)

    @property
    def parameters(self) -> list[str]:
        """Names of the p parameters."""
        return [self.names[j] for j in self.place]

    def residual(self, theta: FloatArray) -> FloatArray:
        """Residuals (p,) at the parameters (n,)."""
        return (theta[self.place] - self.value) / self.std

    def below(self, K: FloatArray) -> FloatArray:
        """Derivatives (m, n) of the data, and those of these rows below them."""
        return np.vstack((K, np.eye(len(self.names))[self.place] / self.std[:, None]))

    def beside(self, residual: Function, jacobian: Function) -> tuple[Function, Function]:
        """Functions of the parameters with these rows."""
        return (
            lambda theta: np.append(residual(theta), self.residual(theta)),
            lambda theta: self.below(jacobian(theta)),
        )


def prior_rows(
    names: tuple[str, ...],
    prior: PriorValues,
    ridge: float = 0.0,
    start: FloatArray | None = None,
    slopes: Function | None = None,
) -> Prior:
    """Rows of a prior, or of a ridge λ at the start (n,), by the derivatives of the data there.

    ValueError for both of them, and a λ that is not above 0.
    """
    if not 0 <= ridge < np.inf or (ridge and prior):
        raise ValueError("--ridge takes a number above 0, such as 0.01, and a model without [prior]")
    value, std = np.array([prior.get(name, (0.0, np.inf)) for name in names]).T
    if ridge and start is not None and slopes is not None:
        with np.errstate(divide="ignore"):
            value, std = start, 1.0 / (np.sqrt(ridge) * np.linalg.norm(slopes(start), axis=0))
    place = np.flatnonzero(np.isfinite(std))
    return Prior(names, place, value[place], std[place], ridge)


@dataclass(frozen=True, eq=False)
class PriorEffect:
    """What a prior or a ridge did to an estimate: `share` and `away` (p,), the rest once.

    `share` is how much of what is known of a parameter comes from the data, 1 − variance / prior variance;
    `away` the standard deviations between the prior and all the rest, NaN where the data say nothing. `alone`
    is what the data alone determine, in words, if that is not everything, `lost` what only the rows
    determine, `data` the step to the best of the data, with what stands at a bound held there. Condition
    numbers and rms are those without and with the prior; a nonlinear model is linearised.
    """

    rows: Prior
    share: FloatArray
    away: FloatArray
    alone: str
    lost: tuple[str, ...]
    data: Estimate
    sizes: dict[str, dict[str, float]]

    @property
    def why(self) -> dict[str, str]:
        """Beside each parameter with a prior, how much of it is from the data."""
        if self.rows.ridge:
            return dict.fromkeys(self.lost, "by the ridge only")
        return dict.fromkeys(self.lost, "through the prior") | {
            name: f"{percent(share)} % from the data" if share >= 0.005 else "by its prior only"
            for name, share in zip(self.rows.parameters, self.share, strict=True)
            if not np.isnan(share)
        }

    @property
    def warnings(self) -> tuple[str, ...]:
        """The prior that all the rest contradicts most; that a ridge has no intervals."""
        rows, far = self.rows, np.nan_to_num(np.abs(self.away))
        if rows.ridge:
            return (f"--ridge {rows.ridge:g} biases the estimate by nobody knows how much: no intervals",)
        if far.max() <= FAR:
            return ()
        i, rest = int(np.argmax(far)), "the data" if len(far) == 1 else "the data and the other priors"
        return (
            f"{rest} contradict the prior {rows.parameters[i]} = {rows.value[i]:.6g} ± "
            f"{rows.std[i]:.2g} by {far[i]:.2g} standard deviations: one of these or the model is wrong",
        )

    def judgement(self, words: str) -> str:
        """What is determined with it, and by the data alone."""
        which = "ridge" if self.rows.ridge else "prior"
        with_it = f"With the {which} {words[0].lower()}{words[1:]}"
        return f"{with_it}\nWithout it {self.alone}." if self.alone else words

    def apart(self, estimate: Estimate) -> Estimate:
        """The estimate with χ² and degrees of freedom of the data alone, however far off the prior is."""
        if self.rows.ridge:
            estimate = replace(estimate, covariance=None, solution_covariance=None)
        chi_square = estimate.chi_square and self.data.chi_square
        return replace(estimate, chi_square=chi_square, dof=self.data.dof)

    def to_dict(self) -> dict[str, Any]:
        """Part of a document, `prior` or `ridge`, as JSON types."""
        rows = self.rows
        each = zip(rows.parameters, rows.value, rows.std, self.share, self.away, strict=True)
        part = {
            "lambda": rows.ridge or None,
            "parameters": {
                name: {"value": value, "std": std, "data_share": share, "deviation": away}
                for name, value, std, share, away in each
            },
            "data_alone": self.alone or None,
            **self.sizes,
        }
        return plain({"ridge" if rows.ridge else "prior": part})


def effect(
    rows: Prior, K: FloatArray, r: FloatArray, theta: FloatArray, at_bounds: Collection[str]
) -> PriorEffect | None:
    """What the rows of a prior did to the estimate (n,); None without any.

    K (m, n) and r (m,) are derivatives and residuals of the data there, over their errors. What stands at a
    bound is held there.
    """
    moves = np.array([name not in at_bounds for name in rows.names])
    if not rows or not moves.any():
        return None
    names = tuple(compress(rows.names, moves))
    alone, both = (
        least_squares(each[:, moves], right, names=names, sigma=1.0, rcond=JACOBIAN_RCOND)
        for each, right in ((K, -r), (rows.below(K), np.zeros(len(K) + len(rows))))
    )
    std = np.full(len(moves), np.nan)
    std[moves] = both.std
    share = (1.0 - (std[rows.place] / rows.std) ** 2).clip(0.0, 1.0)
    rms, full_rms = (float(np.sqrt(np.mean(each**2))) for each in (alone.residuals, r))
    return PriorEffect(
        rows=rows,
        share=share,
        away=rows.residual(theta) / np.sqrt(np.where(share > SILENT, share, np.nan)),
        alone="" if alone.full_rank else alone.describe_rank(),
        lost=tuple(name for name in alone.undetermined if name not in both.undetermined),
        data=alone,
        sizes={
            "condition_number": {"without": alone.condition_number, "with": both.condition_number},
            "residual_rms": {"without": rms, "with": full_rms},
        },
    )
