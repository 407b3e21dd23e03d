"""Keys of a waveforms file: records, the tacho, channels with their units, and how vectors are written."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

from rotorid.base.text import listing
from rotorid.files import units, value_kinds
from rotorid.files.conventions import PHASES
from rotorid.files.settings_keys import Key, Kind
from rotorid.files.toml_file import Section
from rotorid.files.value_kinds import ABOVE_ZERO, TEXT, number
from rotorid.waveforms.record import Edge

_FREQUENCY = {name: units.SPEED[name] for name in ("Hz", "rad_s")}
_ORDERS = "orders above 0, such as orders = [1, 2]"
_RECORDS = 'files by the names of their runs, such as { BASE = "base.wav" }, or a list of files'


def _unit(section: Section, key: str) -> units.Unit | None:
    text = section.text(key)
    try:
        return None if text is None else units.vibration(text)
    except units.UnitError as error:
        section.complain(key, str(error))
        return None


def _records(section: Section, key: str) -> dict[str, str] | None:
    """Files by run."""
    value = section.take(key)
    if isinstance(value, list) and all(isinstance(file, str) for file in value):
        value = by_stem(value, section, key)
    if isinstance(value, dict) and value and all(isinstance(file, str) and file for file in value.values()):
        return value
    section.complain(key, _RECORDS, value=False)
    return None


def by_stem(files: list[str], section: Section, key: str) -> dict[str, str]:
    """Files by their names without suffix, which are those of the runs."""
    stems = [Path(file).stem for file in files]
    twice = [file for file, stem in zip(files, stems, strict=True) if stems.count(stem) > 1]
    if twice:
        expected = f"files of different names, which are those of the runs, not {listing(twice, 'and')}"
        section.complain(key, f'{expected}; or [records] with RUN = "FILE"', value=False)
    return dict(zip(stems, files, strict=True))


_UNIT = Kind(_unit, TEXT.schema, "a unit of vibration", "um", cell="name")
CHANNEL = (
    Key("channel", TEXT, "its name in the records, default that of the sensor; in a WAV file `1`, `2`, …"),
    Key("unit", _UNIT, "unit of its numbers after `scale`, peak values: `um`, `mm_s`, `g`, … or any label"),
    Key("scale", number(), "how much of the unit one number of the record is, default 1", default=1.0),
    Key("high_pass_Hz", ABOVE_ZERO, "corner of an AC coupling (Butterworth), taken off again", _FREQUENCY),
    Key("high_pass_order", value_kinds.whole("its order", 1, 10), "its order, default 1", default=1),
    Key("delay_ms", number(0.0), "delay of an anti-alias filter, taken off again", units.TIME),
)
WAVEFORMS = (
    Key("tacho", TEXT, "channel of the tacho"),
    Key("pulses", value_kinds.whole("pulses", 1, 10_000), "pulses a turn, default 1", default=1),
    Key(
        "edge",
        value_kinds.choice(get_args(Edge)),
        'what of the mark is angle 0, default `"leading"`: where it begins, whatever its polarity',
        default="leading",
    ),
    Key("tacho_level", number(), "where an edge is, in numbers of the record; default: half-way"),
    Key("phase", value_kinds.choice(PHASES), "whether phases that are written lead or lag, as in a job"),
    Key("unit", _UNIT, "unit of all channels that state none"),
    Key("amplitude", _UNIT, "unit in which vectors are written, default that of the first channel"),
    Key("orders", value_kinds.numbers(_ORDERS, "1; 2", above_zero=True), "orders, default 1"),
    Key("rate_Hz", ABOVE_ZERO, "samples a second, where the records do not say"),
    Key(
        "speeds_rpm",
        value_kinds.numbers("speeds, such as speeds_rpm = [900, 1200]", "900; 1200", above_zero=True),
        "speeds at which vectors are wanted",
        units.SPEED,
    ),
    Key(
        "records",
        Kind(
            _records, {"anyOf": [{"type": "object"}, {"type": "array", "items": TEXT.schema}]}, header="[{}]"
        ),
        f"{_RECORDS}, relative to this file",
    ),
    Key("channels", value_kinds.named(CHANNEL), "sensors by name, default all channels but the tacho's"),
)
