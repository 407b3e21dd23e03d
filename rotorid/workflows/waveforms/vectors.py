"""`vectors`: 1× and other orders of records of an instrument, as the runs table that `balance` reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM
from rotorid.base.text import counted, listing
from rotorid.workflows.option_values import Names, Speeds, names, one_of, speeds
from rotorid.workflows.result_provenance import Outcome, phase, provenance, workflow

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing.data.conventions import Phase
    from rotorid.tables.waveforms.waveforms import Waveforms
    from rotorid.waveforms.record import Edge
    from rotorid.waveforms.vectors import Vectors

EDGES = ("leading", "trailing", "rising", "falling", "centre")
Picture = Literal["tacho", "orbit", "waterfall"]


@dataclass(frozen=True)
class VectorsOptions:
    """Options of `vectors`.

    Attributes
    ----------
    tacho : NAME
        Channel of the tacho.
    sensors : LIST
        Channels of the sensors: A,B; default: all others.
    unit : UNIT
        Of the numbers in the records, peak values: um, mm_s, g, V; where neither a channel's name nor the
        waveforms file says.
    amplitude : UNIT
        Of the vectors: um_pp, mm_s_rms; default: the sensors'. A displacement of an accelerometer is
        integrated.
    pulses : N
        Of the tacho a turn; default: 1.
    edge : leading | trailing | rising | falling | centre
        What of a mark is angle 0; default: leading.
    rate : HZ
        Samples a second, where the records do not say.
    phase : lead | lag
        How phases are written; default: as the waveforms file says, else lead.
    orders : LIST
        Default: 1.
    speeds : LIST
        Vectors at these, where a run-up passes them first: 900,1200rpm; default: one for a steady speed, else
        as many as are independent.
    picture : tacho | orbit | waterfall
        What --plot draws of the first record; default: tacho.
    """

    tacho: str | None = None
    sensors: Names | None = None
    unit: str | None = None
    amplitude: str | None = None
    pulses: int | None = None
    edge: Edge | None = None
    rate: float | None = None
    phase: Phase | None = None
    orders: str | Sequence[int] | None = None
    speeds: Speeds | None = None
    picture: Picture = "tacho"


@dataclass(frozen=True, eq=False, kw_only=True)
class VectorsOfRecords(Outcome):
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


@workflow
def vectors(records: Sequence[Path | str], options: VectorsOptions) -> VectorsOfRecords:
    """Find vectors of orders in records of a tacho and sensors.

    Parameters
    ----------
    records
        A run each, or one waveforms file (.toml).
    options
        What a waveforms file does not say, or instead of it.

    Raises
    ------
    InputError
        For files that cannot be read.
    ValueError
        For records without turns, and options that cannot be.
    """
    from rotorid.tables.waveforms.vectors_table import find_each, vectors_columns
    from rotorid.tables.waveforms.waveforms import WaveformWishes, read_waveforms

    if options.edge is not None:
        one_of(options.edge, "--edge", EDGES)
    one_of(options.picture, "--picture", get_args(Picture))
    given = WaveformWishes(
        tacho=options.tacho,
        sensors=names(options.sensors),
        unit=options.unit,
        amplitude=options.amplitude,
        pulses=options.pulses,
        edge=options.edge,
        phase=options.phase,
        orders=_orders(options.orders),
        rate=options.rate,
        speeds=None if options.speeds is None else [*speeds(options.speeds, "--speeds")],
    )
    with phase("reading"):
        waveforms = read_waveforms(records, given)
    with phase("vectors"):
        found = find_each(waveforms)
    return VectorsOfRecords(
        found=found,
        waveforms=waveforms,
        columns=vectors_columns(found, waveforms.labels),
        picture=options.picture,
        provenance=provenance(waveforms.files, options),
    )


def _course(found: Vectors) -> str:
    """How the speed of a record runs, and over how many turns its vectors are means."""
    low, high = found.range * RPM
    if found.steady:
        return f"{found.run}: {(low + high) / 2:.1f} rpm, {found.turns[0]:.0f} turns"
    instants = (
        f"{counted(len(found.times), 'instant')} of {found.turns.min():.0f} to {found.turns.max():.0f} turns"
    )
    return f"{found.run}: {low:.0f} to {high:.0f} rpm, {instants}"


def _orders(given: str | Sequence[int] | None) -> list[int] | None:
    """Read "1,2": 1× first, which every runs table has."""
    if given is None:
        return None
    parts = [part.strip() for part in given.split(",")] if isinstance(given, str) else [str(k) for k in given]
    if not all(part.isdecimal() and 0 < int(part) <= 20 for part in parts):
        raise ValueError(f"--orders takes whole numbers from 1 to 20 with commas between them, not {given!r}")
    return sorted({1, *map(int, parts)})
