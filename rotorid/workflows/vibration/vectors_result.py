"""Result of `vectors`: the runs table, what the tacho showed, pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM
from rotorid.base.text import counted, listing
from rotorid.commands.outcome import Delivered

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.tables.waveforms.waveforms import Waveforms
    from rotorid.waveforms.vectors import Vectors

Picture = Literal["tacho", "orbit", "waterfall"]


@dataclass(frozen=True, eq=False, kw_only=True)
class VectorsOfRecords(Delivered):
    """Vectors of records, and these."""

    found: tuple[Vectors, ...]
    waveforms: Waveforms
    columns: tuple[Column, ...]
    picture: Picture

    @property
    def warnings(self) -> tuple[str, ...]:
        """Of all records, each with its run where there are several."""
        many = len(self.found) > 1
        said = [
            f"run {each.run!r}: {word}" if many else word for each in self.found for word in each.warnings
        ]
        labels = self.waveforms.labels
        if self.waveforms.unstated:
            said.append("nothing states whether phases lead or lag: lead is written (--phase)")
        if not labels.vibration_unit:
            said.append("nothing states the unit of the records: amplitudes are their numbers (--unit)")
        return tuple(said)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the jitter in degrees of a turn."""
        tachos = [each.tacho for each in self.found]
        return {
            "conventions": {
                "phase": self.waveforms.labels.phase,
                "unit": self.waveforms.labels.vibration_unit,
            },
            "rows": rows(self.columns),
            "tacho": {
                "pulses": sum(len(each.times) for each in tachos),
                "missing": sum(len(each.missing) for each in tachos),
                "double": sum(len(each.double) for each in tachos),
                "jitter": max(each.jitter_deg for each in tachos),
            },
            "runs": [
                {
                    "run": each.run,
                    "steady": each.steady,
                    "lowest_speed_rad_s": each.range[0],
                    "highest_speed_rad_s": each.range[1],
                    "turns": each.tacho.turns[-1] - each.tacho.turns[0],
                    "jitter_deg": each.tacho.jitter_deg,
                }
                for each in self.found
            ],
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """The runs table."""
        return frame(self.columns)

    @property
    def answer(self) -> Answer:
        """What was read, and the vectors: those of steady records, else what the table has."""
        first, labels = self.found[0], self.waveforms.labels
        orders, sensors = (
            listing((f"{k}×" for k in first.orders), "and"),
            counted(len(first.sensors), "sensor"),
        )
        head = f"{orders} of {sensors} in {counted(len(self.found), 'record')}; phases {labels.phase}."
        told = "\n".join(map(_course, self.found))
        return Answer(head, f"{told}\n\n{text(self.columns, width=COLUMNS)}", warnings=self.warnings)

    def figure(self) -> Figure:
        """The picture that was asked for, of the first record.

        Orbits are those of its first two sensors, where 1× is largest; spectra those of the first.
        """
        from rotorid.waveforms.waveform_pictures import figure_of

        return figure_of(self.picture, self.waveforms.records[0], self.found[0])


def _course(found: Vectors) -> str:
    """How the speed of a record runs, and over how many turns its vectors are means."""
    low, high = found.range * RPM
    if found.steady:
        return f"{found.run}: {(low + high) / 2:.1f} rpm, {found.turns[0]:.0f} turns"
    instants = (
        f"{counted(len(found.times), 'instant')} of {found.turns.min():.0f} to {found.turns.max():.0f} turns"
    )
    return f"{found.run}: {low:.0f} to {high:.0f} rpm, {instants}"
