"""Uncertainty of the masses of formula (50) and of the small model's frequencies, from errors of the inputs.

All of this is first order (derivatives: `rotorid.reduction.equivalent.mass_sensitivity`); the result compares
it with exact recomputation and says where it is poor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, text
from rotorid.base.rpm import RPM
from rotorid.base.text import error_figures
from rotorid.reduction.equivalent.changed_inputs import Shift, labels, units
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import (
    Normalisation,
    RowWeights,
    equivalent_masses,
)
from rotorid.reduction.equivalent.mass_sensitivity import (
    InputErrors,
    Inputs,
    input_index,
    inputs,
    standard_deviations,
)
from rotorid.reduction.equivalent.small_model_modes import natural_frequencies

if TYPE_CHECKING:
    import pandas as pd


__all__ = ["InputErrors", "MassUncertainty", "Shift", "mass_uncertainty"]

POOR = 0.1
"""First order is called poor where exact recomputation differs by more than this share."""

ROUNDING = 1e-12
"""A derivative by a relative change below this share of the value is rounding, and counts as zero."""


@dataclass(frozen=True, eq=False)
class MassUncertainty(Answered):
    """Equivalent masses and frequencies of the small model with what stated input errors do to them.

    Attributes
    ----------
    masses, masses_std, masses_covariance
        kg, shapes (n,), (n,), (n, n).
    frequencies, frequencies_std, frequencies_covariance
        Of the small model, rad/s, shapes (n,), (n,), (n, n); NaN where a mode does not vibrate.
    contributions
        By input ("alpha12", "omega1", "U31": mass 3 in mode 1, "c2"): its part of each variance, shape
        (2, n), of masses, kg², and of frequencies, (rad/s)².
    gradients
        By input: change per unit relative change, shape (2, n), of masses and of frequencies.
    nonlinearity
        Share by which first order misses exact recomputation at one standard deviation, (2, n).
    condition_number
        Of the regression.
    drawn
        Where first order is poor: half of what 68 % of 2000 exact recomputations with drawn inputs span, of
        masses and of frequencies, shape (2, n); else None.
    warnings
        Where first order is poor, and masses that are not known even in sign.
    """

    masses: FloatArray
    masses_covariance: FloatArray
    frequencies: FloatArray
    frequencies_covariance: FloatArray
    contributions: Mapping[str, FloatArray]
    gradients: Mapping[str, FloatArray]
    nonlinearity: FloatArray
    condition_number: float
    drawn: FloatArray | None
    warnings: tuple[str, ...]
    _problem: Inputs = field(repr=False)

    @property
    def masses_std(self) -> FloatArray:
        """Standard deviations of the masses, kg, shape (n,)."""
        return np.asarray(np.sqrt(np.diag(self.masses_covariance)))

    @property
    def frequencies_std(self) -> FloatArray:
        """Standard deviations of the model's frequencies, rad/s, shape (n,)."""
        return np.asarray(np.sqrt(np.diag(self.frequencies_covariance)))

    @property
    def sensitivity(self) -> FloatArray:
        """Standard deviation of each mass over its value, shape (n,), first order; not by the stated errors.

        Per unit relative standard deviation of every compliance (symmetric) and every shape ordinate except
        those at the first mass, all independent.
        """
        n, k = self._problem.U.shape
        compliances, ordinates = n * (n + 1) // 2, n * (n + 1) // 2 + k
        used = np.r_[0:compliances, ordinates + k : ordinates + n * k]
        change = np.array([self.gradients[name][0] for name in self._problem.names])
        with np.errstate(divide="ignore"):
            return np.asarray(np.linalg.norm(change[used], axis=0) / np.abs(self.masses))

    def shift(self, changes: Mapping[str, float]) -> Shift:
        """Predict what given relative changes of inputs do, such as {"alpha12": 0.013}.

        Raises
        ------
        ValueError
            For an input that does not exist, or a change that is not finite.
        """
        names = self._problem.names
        e = np.zeros(len(names))
        for name, value in changes.items():
            at = input_index(name, names)
            if not np.isfinite(value):
                raise ValueError(f"the change of {name} must be finite; got {value}")
            e[at] = value
        first = np.tensordot(e, np.array([self.gradients[name] for name in names]), axes=1)
        exact = self._problem.exact(e[None])[0] - np.array([self.masses, self.frequencies])
        now = np.array([self.masses, self.frequencies])
        n, rough = len(self.masses), (_differ(first, exact, now) > POOR).ravel()
        which = [
            f"{label} {f:+.4g} instead of {x:+.4g} {unit}"
            for label, unit, f, x, bad in zip(
                labels(n), units(n), first.ravel(), exact.ravel(), rough, strict=True
            )
            if bad
        ]
        text = f"first order is poor for changes of this size: {', '.join(which)}; use the exact values"
        said = (text,) if which else ()
        return Shift(first[0], first[1], exact[0], exact[1], said)

    def to_frame(self) -> pd.DataFrame:
        """A row per mass and per frequency: value, std, nonlinearity, and the share of each input."""
        n = len(self.masses)
        std = np.concatenate((self.masses_std, self.frequencies_std))
        variance = np.where(std > 0, std, np.nan) ** 2
        parts = {name: part.ravel() for name, part in self.contributions.items() if part.any()}
        return frame(
            (
                Column("quantity", labels(n)),
                Column("unit", units(n)),
                Column("value", np.concatenate((self.masses, self.frequencies))),
                Column("std", std),
                Column("nonlinearity", self.nonlinearity.ravel()),
                *(Column(name, part / variance) for name, part in parts.items()),
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        return plain(
            {
                "masses_kg": self.masses,
                "masses_std_kg": self.masses_std,
                "natural_frequencies_rad_s": self.frequencies,
                "natural_frequencies_std_rad_s": self.frequencies_std,
                "drawn": None
                if self.drawn is None
                else {
                    "masses_std_kg": self.drawn[0],
                    "natural_frequencies_std_rad_s": self.drawn[1],
                },
                "nonlinearity": {
                    "masses": self.nonlinearity[0],
                    "natural_frequencies": self.nonlinearity[1],
                },
                "contributions": {
                    name: {"masses_kg2": part[0], "natural_frequencies_rad2_s2": part[1]}
                    for name, part in self.contributions.items()
                    if part.any()
                },
                "condition_number": self.condition_number,
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """What the errors do to masses and frequencies; behind it the inputs that make up most of each."""
        n, first = len(self.masses), np.array((self.masses_std, self.frequencies_std))
        masses, speeds = first if self.drawn is None else self.drawn
        known = (", ".join(map(error_figures, row)) for row in (masses, speeds * RPM))
        said = "By the stated errors the masses are ± {} kg, the frequencies ± {} rpm".format(*known)
        if lost := [
            label for label, size in zip(labels(n), (*masses, *speeds), strict=True) if np.isnan(size)
        ]:
            said += (
                ". Some of the drawn inputs give masses that are not positive, and then no "
                f"{lost[0]}: these errors do not determine {', '.join(lost)}"
            )
        parts = {name: part.ravel() for name, part in self.contributions.items()}
        shares = []
        for q, std in enumerate(first.ravel()):
            top = sorted(parts, key=lambda name: -parts[name][q])[:3]
            known_parts = [(name, 100 * parts[name][q] / std**2) for name in top] if std > 0 else []
            shares.append(", ".join(f"{name} {share:.0f} %" for name, share in known_parts if share >= 1))
        columns = (
            Column("quantity", labels(n), str, ""),
            Column("value", (*self.masses, *self.frequencies), "{:.6g}".format),
            Column("std", first.ravel(), error_figures, "±"),
            Column("unit", units(n), str, ""),
            Column("shares", shares, str, "of the variance"),
        )
        more = "which inputs make up the errors"
        return Answer(f"{said}.", warnings=self.warnings, tables=(text(columns),), more=more)


def mass_uncertainty(
    compliance: ArrayLike,
    frequencies: ArrayLike,
    shapes: ArrayLike,
    errors: InputErrors,
    *,
    seal_stiffness: ArrayLike = 0.0,
    normalise: Normalisation = "first",
    rows: RowWeights = "equal",
) -> MassUncertainty:
    """Say what stated errors of the inputs do to the masses of (50) and to the small model's frequencies.

    Parameters
    ----------
    compliance, frequencies, shapes, seal_stiffness, normalise, rows
        As in `equivalent_masses`.
    errors
        Relative standard deviations of the inputs.

    Raises
    ------
    ValueError
        As in `equivalent_masses`; for masses that the modes do not determine, or errors whose shape does not
        fit.

    Notes
    -----
    First order, by analytic derivatives; checked by exact recomputation at plus and minus one standard
    deviation of each input alone, and of all inputs together in the direction that moves each mass and each
    frequency most. The larger difference is `nonlinearity`; above 10 % `warnings` say so, and the standard
    deviations give no more than the order of magnitude: take `drawn` instead.

    Examples
    --------
    >>> found = mass_uncertainty([[2e-8, 1e-8], [1e-8, 2e-8]], [1e3], [[1.0], [1.0]], InputErrors(0.01))
    >>> print(found.masses_std.round(3))
    [0.509 0.509]
    """
    how: dict[str, Any] = {"seal_stiffness": seal_stiffness, "normalise": normalise, "rows": rows}
    problem = inputs(compliance, frequencies, shapes, **how)
    estimate = equivalent_masses(compliance, frequencies, shapes, **how)
    if not estimate.full_rank:
        raise ValueError(
            f"there is no uncertainty of masses that are not determined: {estimate.describe_rank()}; use "
            "more modes or other nodes"
        )
    sigma = standard_deviations(errors, problem)
    model, x = natural_frequencies(problem.alpha, estimate.values, seal_stiffness=problem.springs)
    base, G = np.array([estimate.values, model]), problem.gradients(estimate.values, model, x)
    G = np.where(np.abs(G) <= ROUNDING * np.abs(base), 0.0, G)
    spread = G * sigma[:, None, None]
    covariance = [spread[:, q].T @ spread[:, q] for q in (0, 1)]
    std = np.sqrt(np.einsum("pqi,pqi->qi", spread, spread))
    bent = _nonlinearity(problem, sigma, base, spread, std)
    return MassUncertainty(
        masses=base[0],
        masses_covariance=covariance[0],
        frequencies=base[1],
        frequencies_covariance=covariance[1],
        contributions=dict(zip(problem.names, spread**2, strict=True)),
        gradients=dict(zip(problem.names, G, strict=True)),
        nonlinearity=bent,
        condition_number=estimate.condition_number,
        drawn=_drawn(problem, sigma) if (bent > POOR).any() else None,
        warnings=tuple(_warnings(base, std, bent, estimate.condition_number)),
        _problem=problem,
    )


def _drawn(problem: Inputs, sigma: FloatArray) -> FloatArray:
    """Half of the span of the middle 68 % of exact recomputations, (2, n); NaN where a mode is often lost."""
    found = problem.exact(np.random.default_rng(0).normal(size=(2000, len(sigma))) * sigma)
    lost = np.isnan(found).any(axis=0)
    low, high = np.quantile(np.where(np.isnan(found), 0.0, found), (0.15866, 0.84134), axis=0)
    return np.asarray(np.where(lost, np.nan, (high - low) / 2))


def _nonlinearity(
    p: Inputs, sigma: FloatArray, base: FloatArray, spread: FloatArray, std: FloatArray
) -> FloatArray:
    """Share by which first order misses exact recomputation at one standard deviation, (2, n)."""
    n, used = base.shape[1], np.flatnonzero(sigma)
    if not used.size:
        return np.zeros((2, n))
    with np.errstate(invalid="ignore", divide="ignore"):
        worst = np.nan_to_num(spread / std, nan=0.0, posinf=0.0).reshape(len(sigma), 2 * n).T
    steps = np.concatenate((np.diag(sigma)[used], worst * sigma))
    up, down = p.exact(steps) - base, p.exact(-steps) - base
    alone = (up[: len(used)] + down[: len(used)]) / 2  # second order of each input
    curved = np.sqrt((alone**2).sum(axis=0))
    q = np.arange(2 * n)
    together = [change[len(used) :].reshape(2 * n, 2 * n)[q, q].reshape(2, n) for change in (up, down)]
    missed = np.maximum.reduce([np.abs(together[0] - std), np.abs(together[1] + std), curved])
    return _differ(std, std + missed, base)


def _differ(first: FloatArray, exact: FloatArray, values: FloatArray) -> FloatArray:
    """|exact − first| as a share of first, or of 1e-5 of the value if that is larger; NaN becomes inf."""
    share = np.abs(exact - first) / np.maximum(np.maximum(np.abs(first), 1e-5 * np.abs(values)), 1e-300)
    return np.where(np.isnan(share) & np.isfinite(values), np.inf, np.nan_to_num(share, posinf=np.inf))


def _warnings(base: FloatArray, std: FloatArray, bent: FloatArray, condition: float) -> list[str]:
    n, said = base.shape[1], []
    every = np.array(labels(n))
    poor = [
        f"{label} ({min(100 * b, 999):.0f} %)"
        for label, b in zip(every, bent.ravel(), strict=True)
        if b > POOR
    ]
    if poor:
        said.append(
            "first order is poor for errors of this size (the regression has condition number "
            f"{condition:.3g}): within one standard deviation it misses {', '.join(poor)} of the change; "
            "take those of drawn inputs instead"
        )
    wild = every[:n][std[0] >= np.abs(base[0])]
    if wild.size:
        said.append(f"a standard deviation is as large as the mass: {', '.join(wild)} cannot be relied on")
    minus = every[:n][base[0] <= 0]
    if minus.size:
        verb = "is" if minus.size == 1 else "are"
        said.append(f"{', '.join(minus)} {verb} not positive: no physical model")
    omega = base[1][np.isfinite(base[1])]
    if omega.size < n:
        said.append("with these masses the model has modes that do not vibrate; they have no uncertainty")
    if (np.diff(omega) <= 1e-6 * omega[1:]).any():
        said.append("two frequencies of the model coincide: their standard deviations mean nothing")
    return said
