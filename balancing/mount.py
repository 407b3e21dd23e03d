"""Pieces in holes that make a correction: chosen for all planes together, the fewest that are enough.

A set of pieces is enough where every reading passes its limit in a check run (`balancing.verdict`: all of its
95 % region is within); without limits, where the bound of the root mean square of a check run is at most the
larger of 1.2 times that of the exact weights and a fifth of the present vibration. Errors of a check run with
pieces are those with the exact weights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from balancing.correction import Correction
from balancing.holes import Holes, Mounting, equal_together
from balancing.influence import Influence, match_speeds
from balancing.pieces import FEW, LITTLE, Discrete, solve_discrete
from balancing.regions import LEVEL
from balancing.tables import (
    covariance_column,
    largest_readings,
    reading_columns,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_columns,
)
from balancing.trials import Trials
from balancing.verdict import largest
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import figures

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
    after_covariance
        Of a reading in a check run around it, (S, C, 2, 2); NaN where errors are unknown.
    check_rms
        Root mean square below which 95 of 100 check runs stay; NaN where errors are unknown.
    on_top_of
        Run whose weights stay mounted; None: everything is removed before.
    """

    correction: Correction
    holes: tuple[Holes | None, ...]
    discrete: Discrete
    after: ComplexArray
    after_covariance: FloatArray
    check_rms: float
    on_top_of: str | None = None

    @property
    def weights(self) -> ComplexArray:
        """What the pieces of each plane add up to, (P,)."""
        return self.discrete.weights

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units and conventions."""
        c, labels = self.correction, self.correction.labels
        actions = Column("action", [_action(c, plane) for plane in c.planes])
        residuals = (
            *reading_columns(labels, c.speeds, c.sensors),
            *vector_columns(labels, "after", self.after),
            covariance_column(
                labels, "after_covariance", self.after_covariance if c.errors_known else None, self.after.size
            ),
        )
        after = labels.vibration(self.after)[0]
        return plain(
            {
                "planes": rows((*weight_columns(labels, c.planes, self.weights), actions)),
                "on_top_of": self.on_top_of,
                "warnings": [],
                "holes": rows(_columns(self)),
                "residuals": rows(residuals),
                "rms_after": rms(after),
                "max_after": after.max(),
                "pieces": self.discrete.pieces,
                "fewer": rows(self._ladder()),
            }
        )

    def _ladder(self) -> tuple[Column, ...]:
        """What fewer pieces would leave."""
        left = [self.correction.labels.vibration(one.residual)[0] for one in self.discrete.fewer]
        return (
            Column("pieces", [one.pieces for one in self.discrete.fewer]),
            Column("rms_after", [rms(size) for size in left]),
            Column("max_after", [size.max() for size in left]),
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per hole that gets something: plane, action, hole, angle_deg, mass, unit, pieces."""
        return frame(_columns(self))

    @property
    def answer(self) -> Answer:
        """What goes into which hole and what it leaves; then hole by hole."""
        c, labels = self.correction, self.correction.labels
        unit, columns = labels.vibration_in, _columns(self)
        used = columns[0].values
        old, new, free = (labels.vibration(z)[0] for z in (c.before, self.after, c.after))
        left = f"rms {three_figures(rms(old))} → {small(rms(new), old.max())} {unit}".rstrip()
        first = "Mount or remove these pieces:" if c.remove else "Mount these pieces:"
        first = first if c.sound else "These pieces would leave"
        stays = "" if self.on_top_of is None else f", beside what is mounted in run {self.on_top_of!r}"
        lines = [f"Pieces in {labels.weight_in}{stays}:", *self._in_planes(columns)]
        if labels.assumed:
            taken = " and ".join(labels.assumed)
            lines.append(
                f"For {taken} as assumed: if that is otherwise, state it and choose the pieces anew."
            )
        largest = largest_readings(labels, c.speeds, c.sensors, c.before, self.after)
        lines += ["", f"Largest left{largest}", *self._fewer_words()]
        return Answer(
            f"{first} {left} (with any weights {small(rms(free), old.max())}).",
            "\n".join(lines),
            tables=(f"Hole by hole:\n{text(columns, left=2)}",) if used else (),
            more="hole by hole",
        )

    def in_holes(self) -> str:
        """What is in which hole of each plane, in a line."""
        planes = map(str.strip, self._in_planes(_columns(self)))
        return f"{' · '.join(planes)}, in {self.correction.labels.weight_in}"

    def _in_planes(self, columns: Sequence[Column]) -> list[str]:
        shown = list(zip(*(column.values for column in columns), strict=True))
        lines = []
        for plane in self.correction.planes:
            rows_ = [row for row in shown if row[0] == plane]
            words = [f"{figures(row[4])} at {row[3]:.1f}°" for row in rows_ if row[2] == _ANY]
            words += equal_together((row[6] or figures(row[4]), row[2]) for row in rows_ if row[2] != _ANY)
            gone = " (remove)" if plane in self.correction.remove else ""
            lines.append(f"  {plane}{gone}: {'; '.join(words) or 'nothing'}")
        return lines

    def _fewer_words(self) -> list[str]:
        """The ladder: what fewer pieces would leave, and what none less is enough for."""
        labels, unit = self.correction.labels, self.correction.labels.vibration_in
        each = [
            f"{one.pieces} → {three_figures(rms(labels.vibration(one.residual)[0]))} {unit}".rstrip()
            for one in self.discrete.fewer
        ]
        lines = [f"With fewer pieces: {', '.join(each)}."] if each else []
        if not self.discrete.enough:
            lines.append("No set of pieces is enough: this one leaves hardly more than the best.")
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
    W = c.influence.W.reshape(-1, len(planes))
    Y = c.before
    there: dict[str, complex] = {}
    if on_top:
        there = dict(zip(c.mounted.planes, c.mounted.weights.tolist(), strict=True))
        unnamed = [p for p, h in each.items() if h and there.get(p) and not h.taken.any()]
        if unnamed:
            raise ValueError(
                f"the holes in which weights of run {c.mounted.run!r} stand are not named, and must stay "
                f'free: taken = {{ "3" = 10 }} (hole and weight) in [planes.{unnamed[0]}] of the job'
            )
        today = influence if baseline is None else influence.rebased(baseline)
        at = match_speeds(c.speeds, today.speeds)
        Y = Y + today.W[at] @ np.array([there.get(plane, 0.0) for plane in today.planes])
    rows_ = c.row_weights
    if c.method == "weighted" and c.errors_known:
        variance = np.trace(c.after_covariance, axis1=-2, axis2=-1).ravel()
        rows_ = (1.0 if rows_ is None else rows_) / np.sqrt(np.maximum(variance, 1e-6 * variance.max()))
    stays = np.array([there.get(plane, 0.0) for plane in planes], dtype=complex)
    discrete = solve_discrete(
        W,
        Y.ravel(),
        each,
        _enough(c, Y, bound := _bound(c)),
        wanted=c.weights - stays,
        method="minmax" if c.method == "minmax" else "least-squares",
        row_weights=rows_,
        limits=c.limits,
    )
    after = Y + (W @ discrete.weights).reshape(Y.shape)
    run = c.mounted.run if on_top and any(there.values()) else None
    check_rms = bound(after) if c.errors_known else np.nan
    return Mounted(c, tuple(each.values()), discrete, after, c.after_covariance, check_rms, run)


def _bound(c: Correction) -> Callable[[ComplexArray], float]:
    """Root mean square that 95 of 100 check runs stay below around a prediction (S, C)."""
    influence, after = c.influence, c.after
    each = zip(influence.draws(), influence.further(after, c.weights), strict=False)
    drawn = [Y + W @ c.weights + more - after for (Y, W), more in each]
    errors = np.concatenate(drawn) if drawn else np.zeros((1, *after.shape))
    return lambda left: float(np.quantile(np.sqrt(np.mean(np.abs(left + errors) ** 2, axis=(1, 2))), LEVEL))


def _enough(
    c: Correction, Y: ComplexArray, bound: Callable[[ComplexArray], float]
) -> Callable[[ComplexArray], bool]:
    """Whether weights D (P,), added to what reads Y, leave little enough."""
    limits = np.full(Y.shape, np.inf) if c.limits is None else c.limits.residual
    limited = np.isfinite(limits)
    covariance = np.nan_to_num(c.after_covariance)[limited]
    most = max(FEW * bound(c.after), LITTLE * rms(Y))

    def enough(D: ComplexArray) -> bool:
        left = Y + c.influence.W @ D
        if limited.any():
            return bool((largest(left[limited], covariance) <= limits[limited]).all())
        return bound(left) <= most

    return enough


def _action(correction: Correction, plane: str) -> str:
    return "remove" if plane in correction.remove else "add"


def _columns(m: Mounted) -> tuple[Column, ...]:
    """A row for each hole that gets something; one without hole for a plane where any angle is possible."""
    c, labels = m.correction, m.correction.labels
    places: list[tuple[str, str, complex, str]] = []
    for plane, holes, mounting, weight in zip(
        c.planes, m.holes, m.discrete.mountings, m.weights, strict=True
    ):
        if holes is None or mounting is None:
            places.append((plane, _ANY, complex(weight), ""))
            continue
        for h in np.flatnonzero(mounting.amounts > 0):
            vector = mounting.amounts[h] * np.exp(1j * holes.angles[h])
            words = _pieces(holes, mounting, int(h), labels.weight_scale)
            places.append((plane, holes.names[h], vector, words))
    planes = [place[0] for place in places]
    actions = [_action(c, plane) for plane in planes]
    size, angle = labels.weight([place[2] for place in places])
    gone = np.where(np.array(actions) == "remove", 180.0, 0.0)
    return (
        Column("plane", planes, lambda plane: f"{plane} (remove)" if plane in c.remove else plane),
        Column("action", actions),
        Column("hole", [place[1] for place in places], str),
        Column("angle_deg", np.mod(angle + gone, 360), "{:.1f}°".format, "angle"),
        Column("mass", size, figures, labels.weight_in),
        Column("unit", [labels.weight_unit] * len(places)),
        Column("pieces", [place[3] for place in places], str),
    )


def _pieces(holes: Holes, mounting: Mounting, h: int, scale: float) -> str:
    return " + ".join(
        f"{int(count)} × {figures(float(piece) * scale)}" if count > 1 else figures(float(piece) * scale)
        for piece, count in zip(holes.pieces, mounting.counts[h], strict=True)
        if count
    )
