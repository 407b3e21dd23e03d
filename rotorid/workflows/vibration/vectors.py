"""`vectors`: 1× and other orders of records of an instrument, as the runs table that `balance` reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from rotorid.commands.outcome import command, phase, provenance
from rotorid.commands.quantities import Names, Speeds, names, one_of, speeds
from rotorid.workflows.vibration.vectors_result import Picture, VectorsOfRecords

if TYPE_CHECKING:
    from rotorid.base.words import Phase
    from rotorid.waveforms.record import Edge

EDGES = ("leading", "trailing", "rising", "falling", "centre")


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
        Vectors at these (rad/s, or 900,1200rpm), where a run-up passes them first; default: one for a steady
        speed, else as many as are independent.
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


@command
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
    from rotorid.tables.waveforms.vectors_of_records import find_each, vectors_columns
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
        speeds=None if options.speeds is None else speeds(options.speeds),
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


def _orders(given: str | Sequence[int] | None) -> list[int] | None:
    """Read "1,2": 1× first, which every runs table has."""
    if given is None:
        return None
    parts = [part.strip() for part in given.split(",")] if isinstance(given, str) else [str(k) for k in given]
    if not all(part.isdecimal() and 0 < int(part) <= 20 for part in parts):
        raise ValueError(f"--orders takes whole numbers from 1 to 20 with commas between them, not {given!r}")
    return sorted({1, *map(int, parts)})
