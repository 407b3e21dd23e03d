"""Pieces in holes that make a correction: chosen for all planes together, the fewest that are enough.

Where groups hold planes together (`balancing.groups`), the pieces of each are the nearest to its weight.

A set of pieces is enough where every reading passes its limit in a check run (`balancing.pass_or_fail`: all
of its 95 % region is within); without limits, where the bound of the root mean square of a check run is at
most the larger of 1.2 times that of the exact weights and a fifth of the present vibration. Errors of a
check run with pieces are those with the exact weights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.linalg import norm
from numpy.typing import ArrayLike

from balancing.correction_result import Correction
from balancing.groups import PIECES
from balancing.holes import Holes, contents, equal_together
from balancing.influence import Influence, in_order, match_speeds
from balancing.mount_decision import HARDLY_BELOW
from balancing.pass_or_fail import largest
from balancing.piece_search import FEW, LITTLE, Discrete, solve_discrete
from balancing.printed_readings import (
    covariance_column,
    largest_readings,
    reading_columns,
    rms,
    small,
    three_figures,
    vector_columns,
)
from balancing.regions import LEVEL
from balancing.trials import Trials
from balancing.weights_and_prediction import rms_change
from balancing.what_if import check_readings
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import capital, figures

if TYPE_CHECKING:
    import pandas as pd

_ANY = "any"
"""Hole of a plane that takes any weight at any angle."""


@dataclass(frozen=True, eq=False)
class Mounted(Answered):
    """Pieces in holes that leave the least vibration.

    Attributes
    ----------
    correction
        The continuous one, in the same planes.
    holes
        Of each plane; None: any weight at any angle.
    discrete
        Pieces of each plane, and what fewer would leave.
    after
        Predicted vibration with them, (S, C).
    check_rms
        Root mean square below which 95 of 100 check runs stay; NaN where errors are unknown.
    on_top_of
        Run whose weights stay mounted; None: everything is removed before.
    """

    correction: Correction
    holes: tuple[Holes | None, ...]
    discrete: Discrete
    after: ComplexArray
    check_rms: float
    on_top_of: str | None = None

    @property
    def weights(self) -> ComplexArray:
        """What the pieces of each plane add up to, (P,)."""
        return self.discrete.weights

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units and conventions."""
        c, labels = self.correction, self.correction.labels
        covariance = c.after_covariance if c.errors_known else None

        residuals = (
            *reading_columns(labels, c.speeds, c.sensors),
            *vector_columns(labels, "after", self.after),
            covariance_column(labels, "after_covariance", covariance, self.after.size),
        )
        return plain(
            {
                "planes": records(c.work_columns(c.planes, self.weights)[:-1]),
                "on_top_of": self.on_top_of,
                "warnings": [],
                "holes": records(_columns(self)),
                "residuals": records(residuals),
                **self._left(self.discrete),
                "rms_after_95": self.check_rms * labels.vibration_scale,
            }
        )

    def _left(self, discrete: Discrete) -> dict[str, Any]:
        """Number of pieces and the vibration that they leave, as JSON types."""
        after = self.after + self.correction.influence.W @ (discrete.weights - self.weights)
        size = self.correction.labels.vibration(after)[0]
        return {"pieces": discrete.pieces, "rms_after": rms(size), "max_after": size.max()}

    def to_frame(self) -> pd.DataFrame:
        """One row per hole that gets something: plane, action, hole, angle_deg, mass, unit, pieces."""
        return frame(_columns(self))

    @property
    def answer(self) -> Answer:
        """What goes into which hole and what it leaves; then hole by hole."""
        c, labels = self.correction, self.correction.labels
        unit, left = labels.vibration_in, rms_change(labels, c.before, self.after)
        free = small(*(rms(readings) * labels.vibration_scale for readings in (c.after, c.before)))
        first = "Mount or remove these pieces:" if c.remove else "Mount these pieces:"
        if not c.sound or self.check_rms > HARDLY_BELOW * rms(c.before):
            first = "These pieces would leave"
        if c.errors_known:
            most = figures(self.check_rms * labels.vibration_scale, 2)
            left += f"; a check run stays below {most} in ≥ 95 of 100"
        run = self.on_top_of
        stays = (
            "with all trial weights taken off" if run is None else f"beside what is mounted in run {run!r}"
        )
        lines = [
            f"Pieces in {labels.weight_in}, {stays}:",
            *(f"  {line}" for line in self.in_planes()),
            f"{capital(labels.turning_in_words())}: {self._first_holes()}.",
            *(
                []
                if self.discrete.enough
                else [f"No set of pieces is enough: these are the fewest that leave {FEW} times the least."]
            ),
            "",
            f"Largest left{largest_readings(labels, c.speeds, c.sensors, c.before, self.after)}",
            f"Weights at any angle: {c.in_words()}; rms {free} {unit}".rstrip() + ".",
        ]
        fewer = map(self._left, self.discrete.fewer)
        less = [f"{one['pieces']} → {three_figures(one['rms_after'])}" for one in fewer]
        lines += [f"With fewer pieces, rms{unit and f' in {unit}'}: {', '.join(less)}."] if less else []
        return Answer(
            f"{first} {left}.",
            "\n".join(lines),
            tables=(f"Hole by hole:\n{text(_columns(self), left=2)}",) if self.weights.any() else (),
            more="hole by hole",
            to_mount=True,
        )

    def _first_holes(self) -> str:
        """Where numbers of holes begin and which way they rise, plane by plane where they differ."""
        c, words = self.correction, dict[str, str]()
        for plane, holes in zip(c.planes, self.holes, strict=True):
            if holes is not None:
                at = c.places([plane] * len(holes.names), np.exp(1j * holes.angles)).tolist()[:2]
                each = (f"{name} at {angle:.4g}°" for name, angle in zip(holes.names, at, strict=False))
                words[plane] = ", ".join(each)
        if len({*words.values()}) == 1:
            return f"holes {min(words.values())}"
        return "; ".join(f"holes of {plane} {each}" for plane, each in words.items())

    def in_holes(self) -> str:
        """What is in which hole of each plane, in a line."""
        return f"{' · '.join(self.in_planes())}, in {self.correction.labels.weight_in}"

    def in_planes(self) -> list[str]:
        """What is in which hole of each plane, plane by plane."""
        lines, every = [], records(_columns(self))
        for plane in self.correction.planes:
            here = [
                (row["pieces"] or f"{row['mass']:.4g}", row["hole"], f"{row['angle_deg']:.1f}°")
                for row in every
                if row["plane"] == plane
            ]
            words = [f"{mass} at {angle}" for mass, hole, angle in here if hole == _ANY]
            words += equal_together((mass, hole) for mass, hole, _ in here if hole != _ANY)
            removed = " (remove)" if plane in self.correction.remove else ""
            lines.append(f"{plane}{removed}: {'; '.join(words) or 'nothing'}")
        return lines


def mount(
    correction: Correction,
    influence: Influence,
    baseline: Trials | ArrayLike | None,
    holes: Mapping[str, Holes],
    *,
    on_top: bool = False,
) -> Mounted:
    """Choose the fewest pieces, for all planes together, that are enough.

    Parameters
    ----------
    correction
        The continuous correction; its method decides what "least" means (by errors: rows count by the inverse
        of the errors of a check run).
    influence, baseline
        As they were given to `correct`.
    holes
        By plane; planes without get any weight at any angle.
    on_top
        Whether what is mounted in the last run stays, and pieces are added to it; otherwise it is removed.

    Raises
    ------
    ValueError
        Where no plane has holes, nothing that can be mounted keeps the limits, or weights stay in holes that
        nobody names (`Holes.taken`).
    """
    c, planes = correction, correction.planes
    each = {plane: holes.get(plane) for plane in planes}
    if not any(each.values()):
        raise ValueError("no plane has holes: holes = N or holes_deg = [...] in [planes.NAME] of the job")
    W, Y = c.influence.W.reshape(-1, len(planes)), c.before
    mounted = c.mounted.weights * on_top
    there = in_order(mounted, c.mounted.planes, planes)
    unnamed = [p for (p, h), w in zip(each.items(), there, strict=True) if w and h and not h.taken.any()]
    if unnamed:
        raise ValueError(
            f"the holes in which weights of run {c.mounted.run!r} stand are not named, and must stay "
            f'free: taken = {{ "3" = 10 }} (hole and weight) in [planes.{unnamed[0]}] of the job'
        )
    if mounted.any():
        today = influence.rebased(baseline)
        loads = in_order(mounted, c.mounted.planes, today.planes)
        Y = Y + today.W[match_speeds(c.speeds, today.speeds)] @ loads
    counts = c.row_weights
    if c.method == "weighted" and c.errors_known:
        variance = np.trace(c.after_covariance, axis1=-2, axis2=-1).ravel()
        counts = (1.0 if counts is None else counts) / np.sqrt(variance.clip(1e-6 * variance.max()))
    bound, limits, rows = _bound(c), c.limits, (W, Y.ravel())
    wanted = c.weights - there
    together = c.unknowns is not None and c.unknowns.constrained
    if together:
        rows, counts = (np.eye(len(planes), dtype=complex), -wanted), None
        limits = limits and replace(limits, residual=np.full((1, len(planes)), np.inf))
    discrete = solve_discrete(
        *rows,
        each,
        _enough(c, Y, bound, PIECES * float(norm(wanted)) if together else np.inf, wanted),
        wanted=wanted,
        method="minmax" if c.method == "minmax" and not together else "least-squares",
        row_weights=counts,
        limits=limits,
    )
    after = Y + (W @ discrete.weights).reshape(Y.shape)
    check_rms = bound(after) if c.errors_known else np.nan
    return Mounted(
        c, tuple(each.values()), discrete, after, check_rms, c.mounted.run if mounted.any() else None
    )


def _bound(c: Correction) -> Callable[[ComplexArray], float]:
    """Root mean square that 95 of 100 check runs stay below around a prediction (S, C)."""
    errors = np.concatenate([*check_readings(c.influence, c.weights)] or [np.zeros((1, *c.after.shape))])
    return lambda left: float(np.quantile(np.sqrt(np.mean(np.abs(left + errors) ** 2, axis=(1, 2))), LEVEL))


def _enough(
    c: Correction, Y: ComplexArray, bound: Callable[[ComplexArray], float], apart: float, wanted: ComplexArray
) -> Callable[[ComplexArray], bool]:
    """Whether weights D (P,), added to what reads Y, leave little enough, not too far from those wanted.

    Limits that not even any weights are sure to keep ask for no more pieces.
    """
    limits = c.limits.residual if c.limits else np.full(Y.shape, np.inf)
    limited = np.isfinite(limits)
    covariance = np.nan_to_num(c.after_covariance)[limited]
    most = max(FEW * bound(c.after), LITTLE * rms(Y))

    def kept(left: ComplexArray) -> bool:
        return bool((largest(left[limited], covariance) <= limits[limited]).all())

    judged = limited.any() and kept(c.after)

    def enough(D: ComplexArray) -> bool:
        left = Y + c.influence.W @ D
        return bool(norm(D - wanted) <= apart) and (kept(left) if judged else bound(left) <= most)

    return enough


def _columns(m: Mounted) -> tuple[Column, ...]:
    """A row for each hole that gets something; one without hole for a plane where any angle is possible."""
    c, labels = m.correction, m.correction.labels
    places = []
    each = zip(c.planes, m.holes, m.discrete.mountings, m.weights.tolist(), strict=True)
    for plane, holes, mounting, weight in each:
        if holes is None or mounting is None:
            places.append((plane, _ANY, weight, ""))
            continue
        for h, vector, words in contents(holes, mounting, labels.weight_scale):
            places.append((plane, holes.names[h], vector, "" if holes.free_amounts else words))
    planes, weights = [place[0] for place in places], np.array([place[2] for place in places])
    _, mass, unit, _, action, _ = c.work_columns(planes, weights)
    return (
        Column("plane", planes, lambda plane: f"{plane} (remove)" if plane in c.remove else plane),
        replace(action, shown=None),
        Column("hole", [place[1] for place in places]),
        Column("angle_deg", np.round(c.places(planes, weights), 9), "{:.1f}°".format, title="angle"),
        mass,
        unit,
        Column("pieces", [place[3] for place in places]),
    )
