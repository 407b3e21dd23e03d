"""Errors of the inputs of formula (50), and what they do to masses and frequencies.

The inputs, compliances, frequencies, shapes and stiffnesses of seals, are changed and masses and frequencies
computed anew: of one input for a question, of each in turn for the sensitivity, of all at random by their
stated errors for ±.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.rpm import RPM
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import error_figures
from rotorid.reduction.masses import Normalisation, RowWeights, design, natural_frequencies
from rotorid.regression import gain

DRAWS = 2000
"""Of inputs with their errors."""
STEP = 1e-5
"""Relative, of an input, for derivatives by central differences."""


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
            if not (np.isfinite(value).all() and (value >= 0).all() and (value < 1).all()):
                raise ValueError(
                    f"errors of {field.name} must be shares from 0 to below 1, such as 0.013 for 1.3 %; "
                    f"got {value}"
                )
            object.__setattr__(self, field.name, value)


@dataclass(frozen=True, eq=False)
class Inputs:
    """Inputs of formula (50): compliance (n, n), frequencies (k,), shapes (n, k), seals (n,), and choices."""

    alpha: FloatArray
    omega: FloatArray
    U: FloatArray
    springs: FloatArray
    normalise: Normalisation
    rows: RowWeights

    @property
    def names(self) -> tuple[str, ...]:
        """Of the P inputs: "alpha12" (α12 and α21), "omega1", "U31" (mass 3 in mode 1), "c2"."""
        n, k = self.U.shape
        mark = "," if n > 9 else ""
        return (
            *(f"alpha{i + 1}{mark}{j + 1}" for i in range(n) for j in range(i, n)),
            *(f"omega{j + 1}" for j in range(k)),
            *(f"U{i + 1}{mark}{j + 1}" for i in range(n) for j in range(k)),
            *(f"c{i + 1}" for i in range(n)),
        )

    def recomputed(self, changes: FloatArray) -> FloatArray:
        """Masses and frequencies, (S, 2, n), with the inputs changed by relative `changes`, (S, P)."""
        n, k = self.U.shape
        i, j = np.triu_indices(n)
        a, w, u, c = np.split(changes, np.cumsum([len(i), k, n * k]), axis=1)
        factors = np.ones((len(changes), n, n))
        factors[:, i, j] = factors[:, j, i] = 1 + a
        alpha, springs = self.alpha * factors, self.springs * (1 + c)
        shapes = self.U * (1 + u.reshape(-1, n, k))
        how: dict[str, Any] = {"normalise": self.normalise, "rows": self.rows}
        B, D = design(alpha, self.omega * (1 + w), shapes, seal_stiffness=springs, **how)
        out = np.full((len(changes), 2, n), np.nan)
        fine = np.isfinite(B).all(axis=(1, 2)) & np.isfinite(D).all(axis=1)
        out[fine, 0] = (gain(B[fine]) @ D[fine][..., None])[..., 0].real
        for s in np.flatnonzero(fine):
            out[s, 1] = natural_frequencies(alpha[s], out[s, 0], seal_stiffness=springs[s])[0]
        return out

    def change(self, changes: Mapping[str, float]) -> FloatArray:
        """Relative changes of named inputs as a row (1, P); alpha21 is alpha12. ValueError for others."""
        row = np.zeros((1, len(self.names)))
        for given, value in changes.items():
            i, mark, j = given.removeprefix("alpha").partition(",")
            turned = f"alpha{j},{i}" if mark else f"alpha{i[::-1]}"
            name = turned if given.startswith("alpha") and given not in self.names else given
            if name not in self.names:
                hint = did_you_mean(given, self.names)
                raise ValueError(f"there is no input {given!r}{hint}: choose among {', '.join(self.names)}")
            if not np.isfinite(value):
                raise ValueError(f"the change of {given} must be finite; got {value}")
            row[0, self.names.index(name)] = value
        return row

    def deviations(self, errors: InputErrors) -> FloatArray:
        """Relative standard deviation of every input, (P,)."""
        n, k = self.U.shape
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
                raise ValueError(
                    f"errors of {name} must be one number or have shape {shape}; got {given.shape}"
                )
            full = np.array(np.broadcast_to(given, shape))
            if name == "shapes" and given.ndim == 0 and self.normalise == "first":
                full[0] = 0.0
            parts.append(full.ravel())
        return np.concatenate(parts)

    def errors(self, stated: InputErrors) -> MassErrors:
        """What stated errors do, by recomputed draws; NaN where a mode is lost in some of them."""
        sigma = self.deviations(stated)
        changes = np.random.default_rng(0).normal(size=(DRAWS, sigma.size)) * sigma
        draws = self.recomputed(np.concatenate((np.zeros((1, sigma.size)), changes)))
        exact, draws = draws[0], draws[1:]
        lost = np.asarray(np.isnan(draws).any(axis=0))
        low, high = np.quantile(np.where(np.isnan(draws), 0.0, draws), (0.15866, 0.84134), axis=0)
        masses, frequencies = np.where(lost, np.nan, (high - low) / 2)
        warnings = []
        if modes := [f"omega{k + 1}" for k in np.flatnonzero(lost[1])]:
            warnings.append(
                "some of the drawn inputs give masses that are not positive, and then no "
                f"{modes[0]}: these errors do not determine {', '.join(modes)}"
            )
        wild = np.flatnonzero(np.logical_not(masses < np.abs(exact[0])))
        if wild.size:
            names = ", ".join(f"m{i + 1}" for i in wild)
            warnings.append(f"a standard deviation is as large as the mass: {names} cannot be relied on")
        return MassErrors(masses, frequencies, tuple(warnings))

    def sensitivity(self) -> FloatArray:
        """Relative standard deviation of each mass, (n,), per that of all compliances and shapes alike.

        Ordinates at the first mass are exact, and all inputs independent.
        """
        used: BoolArray = np.not_equal(self.deviations(InputErrors(compliance=0.5, shapes=0.5)), 0.0)
        n, k = self.U.shape
        used[n * (n + 1) // 2 + k : n * (n + 1) // 2 + 2 * k] = False
        steps = STEP * np.eye(used.size)[used]
        masses = self.recomputed(np.concatenate((steps, -steps, np.zeros((1, used.size)))))[:, 0]
        half = len(steps)
        slopes = (masses[:half] - masses[half:-1]) / (2 * STEP)
        with np.errstate(divide="ignore"):
            return np.asarray(np.linalg.norm(slopes, axis=0) / np.abs(masses[-1]))


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


@dataclass(frozen=True, eq=False)
class Shift(Answered):
    """What given changes of the inputs do.

    Attributes
    ----------
    masses, frequencies
        Changes, kg and rad/s, shape (n,) each.
    """

    masses: FloatArray
    frequencies: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain({"masses_kg": self.masses, "frequencies_rad_s": self.frequencies})

    @property
    def answer(self) -> Answer:
        """What each mass and frequency changes by."""
        masses = ", ".join(f"{change:+.4g}" for change in self.masses)
        speeds = ", ".join(f"{change * RPM:+.4g}" for change in self.frequencies)
        return Answer(
            f"The changed inputs move the masses by {masses} kg and the frequencies by {speeds} rpm."
        )
