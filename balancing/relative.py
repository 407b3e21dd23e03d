"""A correction relative to trial weights whose masses or places nobody knows.

Runs fit y = Y₀ + W T with T = 1 for such a weight, whatever it is. W is its effect then, and the correction D
the factor by which to change it: |D| times as heavy, arg D further with the rotation. Its errors are those of
the factor. A mass that is known makes a mass of |D|; where all angles are known, T has them, and D too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from balancing.correction import Correction
from balancing.tables import degrees
from balancing.trials import TRIAL_WEIGHTS, Relative
from rotorid.base.arrays import FloatArray
from rotorid.base.tables import Column, text
from rotorid.base.text import figures


@dataclass(frozen=True, eq=False)
class RelativeCorrection(Correction):
    """A correction whose weights are multiples of the trial weight of their plane.

    Attributes
    ----------
    relative
        What is known of these trial weights.
    """

    relative: Relative = Relative(True, {}, "")  # noqa: RUF009

    @property
    def masses(self) -> FloatArray:
        """Masses of the weights in the unit of the trial weights, (P,); NaN: not known."""
        return np.abs(self.weights) * [self.relative.sizes[plane] for plane in self.planes]

    @property
    def turns(self) -> FloatArray:
        """How far to move the trial weights, degrees as the job counts them, -180 … 180, (P,)."""
        return np.asarray((self.places(self.planes, self.weights) + 180) % 360 - 180)

    def _place(self, turn: float, sign: int) -> str:
        if not self.relative.angle:
            return degrees(turn)
        turn *= sign
        return f"{abs(turn):.0f}° {'with' if turn >= 0 else 'against'} the rotation"

    def _what(self) -> str:
        if len(self.planes) > 1:
            return "Change the trial weights as the table says"
        place = self._place(float(self.turns[0]), self.labels.angle_sign)
        times = figures(float(np.abs(self.weights[0])), 3)
        if self.relative.angle and not self.remove:
            return f"Move the trial weight by {place} and take {times} times as much"
        start = f"{place} from its place" if self.relative.angle else f"at {place}"
        return f"{'Remove' if self.remove else 'Mount'} {times} {TRIAL_WEIGHTS}, {start}"

    @property
    def parts(self) -> None:
        """Weights that are multiples of different trial weights have no static part."""

    def _weights_text(self) -> str:
        labels, columns = self.labels, [Column("plane", self.planes)]
        columns.append(Column("times", np.abs(self.weights), lambda times: figures(times, 3)))
        if not np.isnan(self.masses).all():
            columns.append(Column(self.relative.unit.replace("_", "·"), self.masses, figures))
        columns.append(Column("place", [self._place(turn, labels.angle_sign) for turn in self.turns]))
        if self.region_known:
            sizes, angles = self.half_widths()
            turns = [
                "not determined" if np.isnan(a) else f"± {figures(float(np.degrees(a)), 2)}°" for a in angles
            ]
            columns += [Column("95 %", sizes, lambda w: f"± {figures(w, 2)}"), Column("", turns)]
        for other in self.others:
            sign = labels.angle_sign * (1 if other.rows[0]["angles"] == labels.angle_words else -1)
            turned = [self._place((place + 180) % 360 - 180, sign) for place in other.places]
            columns.append(Column(f"if {other.words}", turned))
        start = "places count from it" if self.relative.angle else labels.turning_in_words()
        taken = f" ({' and '.join(labels.assumed)} assumed)" if labels.assumed else ""
        caption = f"Times the trial weight, instead of it; {start}; phases as {labels.phase}{taken}."
        return f"{text(columns)}\n{caption}"

    def _weight_columns(self) -> tuple[Column, ...]:
        columns = {column.heading: column for column in super()._weight_columns()}
        nothing = np.full(len(self.planes), np.nan)
        new = {
            "times_trial": np.abs(self.weights),
            "times_trial_std": np.array(columns["mass_std"].values),
            "turn_deg": self.turns if self.relative.angle else nothing,
            "mass": self.masses,
            "mass_std": self.masses * columns["mass_std"].values / np.abs(self.weights),
            "unit": [self.relative.unit] * len(self.planes),
        }
        if self.relative.angle:
            new |= {"angle_deg": nothing, "remove_at_deg": nothing}
        columns |= {name: Column(name, values) for name, values in new.items()}
        last = [columns.pop(name) for name in ("covariance", "action", "remove_at_deg")]
        return (*columns.values(), *last)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what only a known trial weight would tell is None."""
        unknown = {"mounted_in_last_run": None, "add_to_mounted": None}
        relative = ["mass", "angle"] if self.relative.angle else ["mass"]
        return super().to_dict() | unknown | {"relative_to_trial_weight": relative}


def relative_to(result: Correction, relative: Relative) -> RelativeCorrection:
    """A correction of runs whose weights are multiples of trial weights, told as such.

    Parameters
    ----------
    result
        The correction.
    relative
        `Trials.relative` of the runs.

    Returns
    -------
    RelativeCorrection
        Whose JSON has times_trial and turn_deg of every plane.
    """
    fields = {name: getattr(result, name) for name in Correction.__dataclass_fields__}
    return RelativeCorrection(**fields, relative=relative)
