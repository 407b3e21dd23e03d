"""Trade-off of masses at given nodes: the rotor's frequencies exactly, or its shapes, or how much of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import fem
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, FloatArray, IndexArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, numbered, rows
from rotorid.base.text import counted
from rotorid.reduction.equivalent.equivalent_masses_formula_50 import Normalisation, equivalent_masses
from rotorid.reduction.equivalent.frequency_matching import MOST, matching_masses
from rotorid.reduction.equivalent.plane_at_rest import mass_nodes, plane_at_rest
from rotorid.reduction.equivalent.small_model_modes import mac, natural_frequencies
from rotorid.reduction.placement_result import ALIKE

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class TradeOff(Answered):
    """Alternative masses at the same nodes: rows r, each an n-mass model with the same compliance.

    Attributes
    ----------
    nodes
        Where the masses stand, n of them.
    names
        Of the rows: regressions by number of modes and row weights, and sets that match all frequencies.
    matching
        Whether a row has the rotor's n frequencies exactly, by `matching_masses`; shape (r,).
    masses
        kg, shape (r, n).
    frequencies
        rad/s, shape (r, n); NaN where a mode does not vibrate.
    relative_error
        Against the rotor's frequencies, shape (r, n).
    mac
        Mode k of the model with mode k of the rotor, shape (r, n); NaN where a mode does not vibrate.
    condition
        Condition number of each regression, shape (r,); NaN for matching sets.
    complete
        Whether matching sets were searched: up to three masses, and then these are all.
    rotor_frequencies, rotor_shapes
        Of the rotor's plane at rest: rad/s (n,), and at the nodes (n, n).
    rotor
        The rotor itself.
    warnings
        What a user should know before choosing.
    """

    nodes: tuple[int, ...]
    names: tuple[str, ...]
    matching: BoolArray
    masses: FloatArray
    frequencies: FloatArray
    relative_error: FloatArray
    mac: FloatArray
    condition: FloatArray
    complete: bool
    rotor_frequencies: FloatArray
    rotor_shapes: FloatArray
    rotor: fem.Rotor
    warnings: tuple[str, ...]

    @property
    def traps(self) -> IndexArray:
        """Matching rows whose smallest MAC is below 0.9: the frequencies are right, the shapes are not."""
        return np.flatnonzero(self.matching & (self.mac.min(axis=1) < ALIKE))

    def to_frame(self) -> pd.DataFrame:
        """One row per alternative: masses, frequencies, errors, MAC, condition number."""
        masses = [Column(f"mass_{node}_kg", self.masses[:, i]) for i, node in enumerate(self.nodes)]
        modes = zip(
            numbered("frequency_{}_rad_s", self.frequencies),
            numbered("relative_error_{}", self.relative_error),
            numbered("mac_{}", self.mac),
            strict=True,
        )
        return frame(
            (
                Column("model", self.names),
                Column("matching", self.matching),
                *masses,
                *(column for mode in modes for column in mode),
                Column("condition_number", self.condition),
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: the nodes, the rotor's frequencies, and a document per alternative."""
        return plain(
            {
                "nodes": self.nodes,
                "rotor_frequencies_rad_s": self.rotor_frequencies,
                "matching_sets_complete": self.complete,
                "alternatives": rows(
                    (
                        Column("model", self.names),
                        Column("matching", self.matching),
                        Column("masses_kg", self.masses),
                        Column("natural_frequencies_rad_s", self.frequencies),
                        Column("relative_error", self.relative_error),
                        Column("mac", self.mac),
                        Column("condition_number", self.condition),
                    )
                ),
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """Which alternative to take, and the trap in words; behind it a few lines per alternative."""
        lines = []
        for r, name in enumerate(self.names):
            lines.append(f"{name}: " + ", ".join(f"{m:.2f}" for m in self.masses[r]) + " kg")
            errors = "  ".join(_cell(round(100 * e, 4) + 0.0, "+10.4f") for e in self.relative_error[r])
            lines.append(f"    error, %  {errors}")
            lines.append("    MAC       " + "  ".join(_cell(value, "10.4f") for value in self.mac[r]))
        return Answer(
            self._verdict(),
            warnings=self.warnings,
            notes=self._trap(),
            tables=("\n".join(lines),),
            more="each alternative of masses",
        )

    def _trap(self) -> tuple[str, ...]:
        """What frequencies alone lead to."""
        n, count = len(self.nodes), int(self.matching.sum())
        if n == 1:
            return ()
        if not self.complete:
            said = f"masses that match all frequencies are searched for up to {MOST} masses only"
        elif not count:
            said = f"no set of positive masses at these nodes has all {n} frequencies"
        else:
            said = (
                f"{counted(count, 'different set')} of masses {'has' if count == 1 else 'have'} the rotor's "
                f"{n} frequencies exactly: frequencies alone are a trap, they do not say where the mass is"
            )
        if self.traps.size:
            told = "; ".join(f"{self.names[r]} has MAC {self._worst(r)}" for r in self.traps)
            said += f". Do not use {'this one' if self.traps.size == 1 else 'these'}: {told}"
        return (said,)

    def _verdict(self) -> str:
        if len(self.nodes) == 1:
            return "One mass has no shape to compare: its MAC is always 1."
        physical = np.flatnonzero((self.masses > 0).all(axis=1))
        if not physical.size:
            return "No model here has positive masses: choose other nodes."
        best = int(physical[self.mac[physical].min(axis=1).argmax()])
        if self.mac[best].min() < ALIKE:
            return (
                f"None of these models moves like the rotor in all {len(self.nodes)} modes (the closest has "
                f"MAC {self._worst(best)}): choose other nodes, such as by rank_nodes."
            )
        return (
            f"Closest in shape: {self.names[best]}, smallest MAC {self._worst(best)}, largest frequency "
            f"error {100 * np.abs(self.relative_error[best]).max():.2f} %."
        )

    def _worst(self, r: int | np.intp) -> str:
        return f"{self.mac[r].min():.4f} in mode {self.mac[r].argmin() + 1}"


def trade_off(
    rotor: fem.Rotor,
    nodes: Sequence[int | str],
    *,
    normalise: Normalisation = "first",
    speed: float | None = None,
) -> TradeOff:
    """Put regressions over 1 … n modes beside all masses that match the rotor's n frequencies exactly.

    Parameters
    ----------
    rotor
        On supports; of its plane x at rest, see `reduce`.
    nodes
        Different node numbers or names of stations, n of them.
    normalise
        As in `equivalent_masses`. The rows of each regression are weighted equally (the book) and relatively.
    speed
        Where tables of supports are read, rad/s; by default their lowest common speed.

    Raises
    ------
    ValueError
        For nodes that do not exist or repeat, a rotor free to move, or with fewer than n modes.

    Notes
    -----
    Regressions that these modes do not determine are left out and named in `warnings`. [S] 1.10.
    """
    at = mass_nodes(rotor, nodes)
    n = len(at)
    plane, said = plane_at_rest(rotor, speed)
    alpha = fem.compliance(plane, at)
    full = fem.critical_speeds(plane, n)
    shapes = full.shapes[np.array(at) - 1]
    names, masses, condition, lost = _regressions(alpha, full.frequencies, shapes, normalise)
    sets = matching_masses(alpha, full.frequencies) if n <= MOST else np.empty((0, n))
    names += [f"matching set {i + 1}" for i in range(len(sets))]
    matching = np.arange(len(names)) >= len(masses)
    m = np.concatenate((np.array(masses).reshape(-1, n), sets))
    pairs = [natural_frequencies(alpha, row) for row in m]
    frequencies = np.array([omega for omega, _ in pairs]).reshape(-1, n)
    agreement = np.array([_paired(model, shapes) for _, model in pairs]).reshape(-1, n)
    agreement[np.isnan(frequencies)] = np.nan
    return TradeOff(
        nodes=at,
        names=tuple(names),
        matching=matching,
        masses=m,
        frequencies=frequencies,
        relative_error=frequencies / full.frequencies - 1.0,
        mac=agreement,
        condition=np.concatenate((condition, np.full(len(sets), np.nan))),
        complete=n <= MOST,
        rotor_frequencies=full.frequencies,
        rotor_shapes=shapes,
        rotor=rotor,
        warnings=(*said, *full.warnings, *lost, *_unphysical(names, m)),
    )


def _regressions(
    alpha: FloatArray, omega: FloatArray, shapes: FloatArray, normalise: Normalisation
) -> tuple[list[str], list[FloatArray], list[float], list[str]]:
    """Names, masses and condition numbers of the regressions, and what is said of those left out."""
    names: list[str] = []
    masses: list[FloatArray] = []
    condition: list[float] = []
    lost: list[str] = []
    choices: tuple[Literal["equal", "relative"], ...] = ("equal", "relative")
    for k in range(1, len(omega) + 1):
        for weights in choices[: 1 if k == 1 else 2]:  # one mode: the weight of all rows is the same
            name = f"regression, {counted(k, 'mode')}" + (f", {weights} rows" if k > 1 else "")
            try:
                fit = equivalent_masses(alpha, omega[:k], shapes[:, :k], normalise=normalise, rows=weights)
            except ValueError as problem:
                lost.append(f"{name}: left out, {problem}")
                continue
            if not fit.full_rank:
                lost.append(f"{name}: left out, {fit.describe_rank()}")
                continue
            names.append(name)
            masses.append(fit.solution)
            condition.append(fit.condition_number)
    return names, masses, condition, lost


def _paired(model: FloatArray, reference: FloatArray) -> FloatArray:
    """MAC of mode k with mode k, shape (n,); 0 for a rotor's mode that does not move these nodes."""
    still = ~reference.any(axis=0)
    return np.where(still, 0.0, np.diag(mac(model, np.where(still, 1.0, reference))))


def _unphysical(names: list[str], masses: FloatArray) -> list[str]:
    return [
        f"{name}: a mass of {row.min():.4g} kg is not positive, no physical model"
        for name, row in zip(names, masses, strict=True)
        if row.min() <= 0
    ]


def _cell(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else f"{'none':>10}"
