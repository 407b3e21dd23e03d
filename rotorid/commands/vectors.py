"""`vectors`: 1× and other orders of records of an instrument, as the runs table that `balance` reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

from rotorid.base.json import plain
from rotorid.base.text import RPM, counted, listing
from rotorid.commands.option_values import Speeds, speeds
from rotorid.report.outcome import USUAL, Outcome, command, provenance

if TYPE_CHECKING:
    from rotorid.waveforms.vectors import Vectors

Phase = Literal["lead", "lag"]


@dataclass(frozen=True)
class VectorsOptions:
    """Options of `vectors`.

    Attributes
    ----------
    tacho : NAME
        Channel of the tacho.
    unit : UNIT
        Of the numbers in the records, peak values: um, mm_s, g, V; where neither a channel's name nor the
        waveforms file says.
    phase
        How phases are written; default: as the waveforms file says, else lead.
    orders : LIST
        Default: 1.
    speeds : LIST
        Vectors at these (rad/s, or 900,1200rpm), where a run-up passes them first; default: one for a steady
        speed, else as many as are independent.
    """

    tacho: str | None = None
    unit: str | None = None
    phase: Phase | None = None
    orders: str | Sequence[int] | None = None
    speeds: Speeds | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input": "tacho unit phase",
        "Vectors": "orders speeds",
    }
    to = USUAL


@command
def vectors(records: Sequence[Path | str], options: VectorsOptions | None = None) -> Outcome:
    """1× and other orders of waveforms with a tacho, with ±: the runs table of `balance`.

    Example: rotorid vectors sample_data/waveforms/waveforms.toml --output runs.csv

    Parameters
    ----------
    records : RECORD…
        Records, .csv, .wav, .mat or .npz, a run each; or one waveforms file (.toml).
    options
        What a waveforms file does not say, or instead of it.

    Raises
    ------
    InputError
        For files that cannot be read.
    ValueError
        For records without turns, and options that cannot be.
    """
    from rotorid.files.waveform_jobs import find_each, read_waveforms, vectors_table
    from rotorid.waveforms.plots import figure_vectors

    options = options or VectorsOptions()
    given = {
        "tacho": options.tacho,
        "unit": options.unit,
        "phase": options.phase,
        "orders": _orders(options.orders),
        "speeds_rad_s": None if options.speeds is None else list(speeds(options.speeds)),
    }
    waveforms = read_waveforms([Path(record) for record in records], given)
    each = find_each(waveforms)
    labels = waveforms.labels
    table = vectors_table(each, labels)
    orders, tachos = listing((f"{k}×" for k in each[0].orders), "and"), [one.tacho for one in each]
    many, first = len(each) > 1, waveforms.records[0]
    signal = first.tacho
    assert signal is not None  # find_each refuses records without one
    words = [f"run {one.run!r}: {word}" if many else word for one in each for word in one.warnings]
    if waveforms.unstated:
        words.append("nothing states whether phases lead or lag: lead is written (--phase)")
    if not labels.vibration_unit:
        words.append("nothing states the unit of the records: amplitudes are their numbers (--unit)")
    document = {
        "conventions": {"phase": labels.phase, "unit": labels.vibration_unit},
        "rows": table.records,
        "tacho": {
            "pulses": sum(len(tacho.times) for tacho in tachos),
            "missing": sum(len(tacho.missing) for tacho in tachos),
            "double": sum(len(tacho.double) for tacho in tachos),
            "jitter": max(tacho.jitter_deg for tacho in tachos),
        },
        "runs": [
            {
                "run": one.run,
                "steady": one.steady,
                "lowest_speed_rad_s": one.range[0],
                "highest_speed_rad_s": one.range[1],
                "turns": one.tacho.turns[-1] - one.tacho.turns[0],
                "jitter_deg": one.tacho.jitter_deg,
            }
            for one in each
        ],
        "warnings": words,
    }
    return Outcome(
        result=each,
        sentences=(
            f"{orders} of {counted(len(each[0].sensors), 'sensor')} in {counted(len(each), 'record')}; "
            f"phases {labels.phase}.",
            *map(_course, each),
        ),
        tables=(table,),
        file=table,
        keys=plain(document),
        pictures={
            "Vectors, over the tacho of the first record.": lambda: figure_vectors(
                each, labels, signal, first.rate
            )
        },
        warnings=tuple(words),
        title="Vectors",
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


def _course(one: Vectors) -> str:
    """How the speed of a record runs, and over how many turns its vectors are means."""
    low, high = one.range * RPM
    if one.steady:
        return f"{one.run}: {one.speeds[0] * RPM:.1f} rpm, {one.turns[0]:.0f} turns"
    turns = f"{one.turns.min():.0f} to {one.turns.max():.0f} turns"
    return f"{one.run}: {low:.0f} to {high:.0f} rpm, {counted(len(one.times), 'instant')} of {turns}"
