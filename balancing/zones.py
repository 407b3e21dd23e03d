"""Zones A to D by which ISO 20816 judges vibration: of readings now, predicted, and in a check run.

A boundary belongs to the zone below it. The numbers are those of the machine's class, which the user states;
the standard judges broadband vibration, of which a reading is the part at the speed of rotation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.influence import SPEED_TOLERANCE
from balancing.tables import reading_columns
from balancing.verdict import largest
from rotorid.base.answer import Answer, Answered
from rotorid.base.tables import Column, records, text
from rotorid.base.text import counted

if TYPE_CHECKING:
    from balancing.prediction import Outlook
    from balancing.trials import Trials
    from rotorid.base.arrays import ComplexArray, FloatArray

ZONES = "ABCD"


@dataclass(frozen=True, eq=False)
class Zones(Answered):
    """Zone of each of N readings that has boundaries.

    Attributes
    ----------
    places
        Columns speed and sensor.
    now, predicted, bound, check
        Letters, (N,): of the bare rotor; of the prediction, and of the largest amplitude in its 95 % region,
        "" where errors are unknown; of the last check run, "" where it has no such reading.
    """

    places: tuple[Column, ...]
    now: tuple[str, ...]
    predicted: tuple[str, ...]
    bound: tuple[str, ...]
    check: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the worst of all readings, and each."""
        columns = self._columns()
        worst = {column.heading: max(column.values) or None for column in columns[2:]}
        return {"worst": worst, "readings": records(columns)}

    @property
    def answer(self) -> Answer:
        """The worst zone now and then, in a sentence; then that of each reading."""
        now, predicted, bound, check = map(max, (self.now, self.predicted, self.bound, self.check))
        words = [f"{now} now", f"{predicted} predicted" + (f" (95 %: {bound})" if bound > predicted else "")]
        words += [f"{check} in the check run"] if check else []
        return Answer(
            f"Zone {', '.join(words)}: the worst of {counted(len(self.now), 'reading')}, at 1× alone.",
            tables=(f"Zones:\n{text(self._columns(), left=2)}",),
            more="zones",
        )

    def _columns(self) -> tuple[Column, ...]:
        each = {"now": self.now, "predicted": self.predicted, "predicted_95": self.bound, "check": self.check}
        return (*self.places, *(Column(name, letters) for name, letters in each.items() if any(letters)))


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
        Check runs, of which the last counts.
    """
    predicted = outlook.after if after is None else after
    most = (
        largest(predicted, outlook.after_covariance)
        if outlook.errors_known
        else np.full(predicted.shape, np.nan)
    )
    read = np.full(predicted.shape, np.nan)
    if check is not None:
        for speed, each in zip(check.speeds, check.mean[-1], strict=True):
            same = np.abs(outlook.speeds - speed) <= SPEED_TOLERANCE * outlook.speeds
            for name, reading in zip(check.sensors, each, strict=True):
                read[np.ix_(same, [sensor == name for sensor in outlook.sensors])] = abs(reading)
    judged = [name in boundaries for name in outlook.sensors]
    names = [name for name in outlook.sensors if name in boundaries]
    limits = np.array([boundaries[name] for name in names])

    def letters(readings: ComplexArray | FloatArray) -> tuple[str, ...]:
        sizes = np.abs(readings[:, judged])
        above = np.count_nonzero(sizes[..., None] > limits, axis=-1)
        return tuple(np.where(np.isnan(sizes), "", np.array([*ZONES])[above]).ravel().tolist())

    places = reading_columns(outlook.labels, outlook.speeds, names)
    return Zones(places, *map(letters, (outlook.before, predicted, most, read)))
