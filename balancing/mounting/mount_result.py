"""Pieces in holes: result, text, and JSON types in the job's units and conventions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.correction.correction_result import Correction
from balancing.data.result_columns import (
    covariance_column,
    largest_readings,
    reading_columns,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_columns,
)
from balancing.mounting.discrete_weights import Discrete
from balancing.mounting.holes import equal_together
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import counted, figures

if TYPE_CHECKING:
    import pandas as pd

    from balancing.mounting.holes import Holes, Mounting

_ANY = "any"
"""Hole of a plane that takes any weight at any angle."""
_COUNTED = {"minmax": "the largest", "weighted": "every reading counted by its error"}
AGAINST = 3.0
"""Pieces that weigh more than this times what they make are said to act against each other."""


@dataclass(frozen=True, eq=False)
class Mounted(Answered):
    """Pieces in holes that leave the least vibration.

    Attributes
    ----------
    correction
        The continuous one, in the same planes.
    holes
        Of each plane; None: any weight at any angle.
    found
        Pieces of each plane, and how near the optimum they are known to be.
    after
        Predicted vibration with them, (S, C).
    after_covariance
        Of a reading in a check run around it, (S, C, 2, 2); None where errors are unknown.
    on_top_of
        Run whose weights stay mounted; None: everything is removed before.
    """

    correction: Correction
    holes: tuple[Holes | None, ...]
    found: Discrete
    after: ComplexArray
    after_covariance: FloatArray | None
    on_top_of: str | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Planes in which pieces act mostly against each other, for a gain that may be nothing."""
        labels, said = self.correction.labels, []
        for plane, chosen in zip(self.correction.planes, self.found.mountings, strict=True):
            if chosen is None:
                continue
            total, made = float(chosen.amounts.sum()), abs(chosen.vector)
            if total > AGAINST * made:
                said.append(
                    f"plane {plane}: pieces of {labels.weight_words(total)} together make "
                    f"{labels.weight_words(made)}, they act against each other: state a "
                    "stock, or fewer pieces per hole, if fewer would do"
                )
        return tuple(said)

    @property
    def weights(self) -> ComplexArray:
        """What the pieces of each plane add up to, (P,)."""
        return self.found.weights

    @property
    def plane_by_plane(self) -> float:
        """How many times as much the nearest pieces of each plane by itself leave; not finite: unknown."""
        found = self.found
        known = found.objective > 0 and all(h is not None for h in self.holes)
        return found.rounded_objective / found.objective if known else np.nan

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's units and conventions."""
        c, labels = self.correction, self.correction.labels
        actions = Column("action", [_action(c, plane) for plane in c.planes])
        residuals = (
            *reading_columns(labels, c.speeds, c.sensors),
            *vector_columns(labels, "after", self.after),
            covariance_column(labels, "after_covariance", self.after_covariance, self.after.size),
        )
        after = labels.vibration(self.after)[0]
        return plain(
            {
                "planes": rows((*weight_columns(labels, c.planes, self.weights), actions)),
                "on_top_of": self.on_top_of,
                "warnings": self.warnings,
                "holes": rows(_columns(self)),
                "residuals": rows(residuals),
                "rms_after": rms(after),
                "max_after": after.max(),
                "pieces": self.found.pieces,
                "best": self._best(),
                "proven": self.found.proven,
                "gap": self.found.gap,
                "plane_by_plane": self.plane_by_plane,
            }
        )

    def _best(self) -> dict[str, Any] | None:
        """What more pieces would leave; None where these are the best."""
        best = self.found.best
        if best is None:
            return None
        ratio = self.found.objective / best.objective if best.objective > 0 else None
        left = self.correction.labels.vibration(best.residual)[0]
        return {
            "pieces": best.pieces,
            "objective_ratio": ratio,
            "rms_after": rms(left),
            "max_after": left.max(),
        }

    def _certificate(self) -> str:
        """How sure the choice is."""
        if self.found.gap:
            return f"A better choice, if there is one, is better by at most {100 * self.found.gap:.2g} %."
        if not self.found.proven:
            return "Fewer pieces may do as well: there was no time to know (--split-seconds)."
        if self.found.best:
            return "No fewer pieces do as well, and no other choice of so many is better (proven)."
        return "No other choice of pieces is better (proven)."

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
            said = " and ".join(labels.assumed)
            lines.append(f"For {said} as assumed: if that is otherwise, state it and choose the pieces anew.")
        largest = largest_readings(labels, c.speeds, c.sensors, c.before, self.after)
        lines += ["", f"Largest predicted{largest}", self._proof()]
        return Answer(
            f"{first} {left} (with any weights {small(rms(free), old.max())}).",
            "\n".join(lines),
            self.warnings,
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
            own = [row for row in shown if row[0] == plane]
            words = [f"{figures(row[4])} at {row[3]:.1f}°" for row in own if row[2] == _ANY]
            words += equal_together((row[6] or figures(row[4]), row[2]) for row in own if row[2] != _ANY)
            gone = " (remove)" if plane in self.correction.remove else ""
            nothing = "nothing" if self._best() else "nothing; no pieces that it can take make it better"
            lines.append(f"  {plane}{gone}: {'; '.join(words) or nothing}")
        return lines

    def _proof(self) -> str:
        said, best = [self._certificate()], self._best()
        if best:
            few, ratio = counted(self.found.pieces, "piece"), best["objective_ratio"]
            times = "what" if ratio is None else f"{ratio:.3g} times what"
            how = _COUNTED.get(self.correction.method, "rms")
            said.insert(0, f"{few}: {times} {best['pieces']} would leave (--best), {how}.")
        if 1 <= self.plane_by_plane < np.inf:
            said.append(
                f"Plane by plane the nearest pieces would leave {self.plane_by_plane:.3g} times as much."
            )
        return "\n".join(said)


def _action(correction: Correction, plane: str) -> str:
    return "remove" if plane in correction.remove else "add"


def _columns(m: Mounted) -> tuple[Column, ...]:
    """A row for each hole that gets something; one without hole for a plane where any angle is possible."""
    c, labels = m.correction, m.correction.labels
    places: list[tuple[str, str, complex, str]] = []
    for plane, holes, mounting, weight in zip(c.planes, m.holes, m.found.mountings, m.weights, strict=True):
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
