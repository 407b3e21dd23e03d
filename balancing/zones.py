"""Zones A to D by which ISO 20816 judges vibration: of readings now, predicted, and in a check run.

A boundary belongs to the zone below it. The numbers are those of the machine's class, which the user states;
the standard judges broadband vibration, of which a reading is the part at the speed of rotation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.tables import reading_columns
from balancing.verdict import largest
from rotorid.base.answer import Answer, Answered
from rotorid.base.tables import Column, records, text
from rotorid.base.text import counted

if TYPE_CHECKING:
    from balancing.prediction import Outlook
    from balancing.trials import Trials
    from rotorid.base.arrays import ComplexArray, FloatArray

ZONES = np.array([*"ABCD"])
HEADS = ("now", "predicted", "predicted_95", "check")


@dataclass(frozen=True, eq=False)
class Zones(Answered):
    """Zone of each reading that has boundaries.

    Attributes
    ----------
    places
        Columns speed and sensor.
    letters
        Of the bare rotor ("now"), "predicted", of the largest amplitude in the 95 % region of that
        ("predicted_95") and in the last "check" run; "" where that is not known.
    """

    places: tuple[Column, ...]
    letters: Mapping[str, tuple[str, ...]]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the worst of all readings, and each."""
        worst = {name: max(each) or None for name, each in self.letters.items()}
        return {"worst": worst, "readings": records(self._columns())}

    @property
    def answer(self) -> Answer:
        """The worst zone now and then, in a sentence; then that of each reading."""
        now, predicted, bound, check = map(max, self.letters.values())
        words = f"{now} now, {predicted} predicted" + (f" (95 %: {bound})" if bound > predicted else "")
        words += f", {check} in the check run" if check else ""
        return Answer(
            f"Zone {words}: the worst of {counted(len(self.letters['now']), 'reading')}, at 1× alone.",
            tables=(f"Zones:\n{text(self._columns(), left=2)}",),
            more="zones",
        )

    def _columns(self) -> tuple[Column, ...]:
        return (*self.places, *(Column(name, each) for name, each in self.letters.items() if any(each)))


def zones_of(
    outlook: Outlook,
    boundaries: Mapping[str, Sequence[float]],
    after: ComplexArray | None = None,
    check: Trials | None = None,
) -> Zones:
    """Zones of the readings of an outlook.

    Parameters
    ----------
    outlook
        A correction, or what given weights would leave.
    boundaries
        A/B, B/C and C/D of each sensor that has some, amplitudes as those of the readings.
    after
        Predicted readings (S, C) in place of those of the outlook, as with pieces.
    check
        Check runs at speeds of the outlook, of which the last counts.
    """
    predicted, most = outlook.after if after is None else after, np.full(outlook.before.shape, np.nan)
    if outlook.errors_known:
        most = largest(predicted, outlook.after_covariance)
    read = np.full(most.shape, np.nan)
    for speed, readings in () if check is None else zip(check.speeds, np.abs(check.mean[-1]), strict=True):
        for name, size in zip(check.sensors, readings, strict=True) if check else ():
            read[np.ix_(outlook.speeds == speed, np.array(outlook.sensors) == name)] = size
    names = [name for name in outlook.sensors if name in boundaries]
    limits = np.array([boundaries[name] for name in names])

    def letters(readings: ComplexArray | FloatArray) -> tuple[str, ...]:
        sizes = np.abs(readings[:, [outlook.sensors.index(name) for name in names]])
        above = np.count_nonzero(sizes[..., None] > limits, axis=-1)
        return tuple(np.where(np.isnan(sizes), "", ZONES[above]).ravel().tolist())

    each = zip(HEADS, (outlook.before, predicted, most, read), strict=True)
    places = reading_columns(outlook.labels, outlook.speeds, names)
    return Zones(places, {head: letters(readings) for head, readings in each})
