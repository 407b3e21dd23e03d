"""Errors of the inputs of formula (50), and what they do to masses and frequencies.

The inputs, compliances, frequencies, shapes and stiffnesses of seals, are drawn at random by their stated
errors, and masses and frequencies computed anew.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.rpm import RPM
from rotorid.base.text import error_figures
from rotorid.reduction.masses import design, natural_frequencies, solve_many

if TYPE_CHECKING:
    from rotorid.reduction.reduce import Reduction

DRAWS = 2000
"""Of inputs with their errors."""
NAMES = ("m", "omega")


@dataclass(frozen=True, eq=False)
class InputErrors:
    """Relative standard deviations of the inputs of formula (50): 0.013 is 1.3 %. All are independent.

    Attributes
    ----------
    compliance
        Scalar, or of α_11, α_12 … α_1n, α_22 …, shape (n (n + 1) / 2,).
    frequencies
        Scalar or (k,).
    shapes
        Scalar or (n, k). A scalar leaves the ordinates at the first mass exact where shapes are scaled there
        (normalise="first"): they are 1 by definition.
    seal_stiffness
        Scalar or (n,).

    Raises
    ------
    ValueError
        For errors that are negative, not finite, or 1 and more.
    """

    compliance: ArrayLike = 0.0
    frequencies: ArrayLike = 0.0
    shapes: ArrayLike = 0.0
    seal_stiffness: ArrayLike = 0.0

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = np.array(getattr(self, field.name), dtype=float)
            if not ((value >= 0) & (value < 1)).all():
                raise ValueError(
                    f"errors of {field.name} must be shares from 0 to below 1, such as 0.013 for 1.3 %; "
                    f"got {value}"
                )
            object.__setattr__(self, field.name, value)


def recomputed(result: Reduction, changes: FloatArray) -> FloatArray:
    """Masses and frequencies, (S, 2, n), with the inputs changed by relative `changes`, (S, P)."""
    n, k = len(result.nodes), result.modes
    i, j = np.triu_indices(n)
    a, w, u, c = np.split(changes, np.cumsum([len(i), k, n * k]), axis=1)
    factors = np.ones((len(changes), n, n))
    factors[:, i, j] = factors[:, j, i] = 1 + a
    alpha, springs = result.compliance * factors, result.seal_stiffness * (1 + c)
    shapes = result.rotor_shapes[:, :k] * (1 + u.reshape(-1, n, k))
    how: dict[str, Any] = {"normalise": result.normalise, "rows": result.rows}
    B, D = design(alpha, result.rotor_frequencies[:k] * (1 + w), shapes, seal_stiffness=springs, **how)
    masses, _ = solve_many(B, D)
    out = np.full((len(changes), 2, n), np.nan)
    fine = np.isfinite(masses).all(axis=1)
    omega, _ = natural_frequencies(alpha[fine], masses[fine], seal_stiffness=springs[fine])
    out[fine] = np.stack((masses[fine], omega), axis=1)
    return out


def deviations(result: Reduction, errors: InputErrors) -> FloatArray:
    """Relative standard deviation of every input, (P,)."""
    n, k = len(result.nodes), result.modes
    sizes = {
        "compliance": (n * (n + 1) // 2,),
        "frequencies": (k,),
        "shapes": (n, k),
        "seal_stiffness": (n,),
    }
    parts = []
    for name, shape in sizes.items():
        given = np.asarray(getattr(errors, name))
        if given.shape not in ((), shape):
            raise ValueError(f"errors of {name} must be one number or have shape {shape}; got {given.shape}")
        full = np.array(np.broadcast_to(given, shape))
        if name == "shapes" and given.ndim == 0 and result.normalise == "first":
            full[0] = 0.0
        parts.append(full.ravel())
    return np.concatenate(parts)


def errors_by_draws(result: Reduction, stated: InputErrors) -> MassErrors:
    """What stated errors do, by recomputed draws; NaN where a mode is lost in some of them."""
    sigma = deviations(result, stated)
    changes = np.random.default_rng(0).normal(size=(DRAWS, sigma.size)) * sigma
    exact, *draws = recomputed(result, np.concatenate((np.zeros((1, sigma.size)), changes)))
    low, high = np.quantile(draws, (0.15866, 0.84134), axis=0)  # NaN where any draw is
    std = (high - low) / 2
    warnings = [
        f"the stated errors do not determine {NAMES[i]}{j + 1}: it may be off by as much as it is, or drawn masses "
        "are not positive"
        for i, j in np.argwhere(~(std < np.abs(exact)))
    ]
    return MassErrors(*std, tuple(warnings))


@dataclass(frozen=True, eq=False)
class MassErrors(Answered):
    """What stated errors of the inputs do: one standard deviation, half of what 68 % of the draws span.

    Attributes
    ----------
    masses, frequencies
        kg and rad/s, shape (n,) each; NaN where some of the drawn inputs give no such mode.
    warnings
        Masses that are not known even in sign.
    """

    masses: FloatArray
    frequencies: FloatArray
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        return plain(
            {
                "masses_std_kg": self.masses,
                "natural_frequencies_std_rad_s": self.frequencies,
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """What the errors do to masses and frequencies."""
        masses, speeds = (", ".join(map(error_figures, row)) for row in (self.masses, self.frequencies * RPM))
        words = f"By the stated errors the masses are ± {masses} kg, the frequencies ± {speeds} rpm."
        return Answer(words, warnings=self.warnings)
