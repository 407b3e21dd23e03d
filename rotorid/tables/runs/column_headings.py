"""Headings of readings as instruments and people write them: which column it is, its unit, its sensor.

`Speed (rpm)`, `1X Ampl [µm pp]`, `Phase lag (°)`, `A_phase_deg`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rotorid.tables.reader import units
from rotorid.tables.reader.columns import REMARKS
from rotorid.tables.reader.units import UnitError, UnitReader, one_of

READING = ("amplitude", "phase")
LONGEST = 100
"""Of a heading, or a cell, that is read here: searching longer ones would take the square of their length."""
MEASURED: dict[str, UnitReader] = {
    "speed": one_of(units.SPEED),
    "amplitude": units.vibration,
    "phase": one_of(units.ANGLE),
}
_NEEDED = {"run", "speed", "sensor", *READING}
_TIDY = re.compile(r"(?:(speed|amplitude|phase)(?:_(.*))?|run|sensor|repeat)")
_BESIDE = re.compile(r"(?:amplitude|phase)_std(?:_|$)|order")
"""What `rotorid vectors` writes beside the readings."""
_AMPLITUDE, _PHASE = r"amplitude|ampl|amp|magnitude|mag", r"phase angle|phase|phs"
_ROLES = {
    stem: re.compile(rf"(?<![^\W\d_])(?:{words})(?![^\W\d_])", re.IGNORECASE)
    for stem, words in {
        "vector": rf"(?:{_AMPLITUDE})\W+(?:{_PHASE})|vector",
        "amplitude": _AMPLITUDE,
        "phase": _PHASE,
        "speed": "speed|rpm",
        "sensor": "sensor|probe|channel|point|transducer",
        "run": "run",
        "repeat": "repeat",
    }.items()
}
_FILLERS = {"name", "no", "nr", "number", "id", "shaft", "rotor", "machine", "running", "nominal", "measured"}
_BRACKETS = re.compile(r"[(\[]([^)\]]*)[)\]]")
_ORDER = re.compile(r"(?<![^\W_])(?<!\.)([0-9]+(?:\.[0-9]+)?)[xX×](?![^\W_])")
_PROBE_Y = re.compile(r"(?<![^\W_])[0-9]+[yY](?![^\W_])")
_DIRECTION = re.compile(r"(?<![^\W\d_])(lag|lead)(?:ging|ing)?(?![^\W\d_])", re.IGNORECASE)
_SWING = re.compile(
    r"[\s_.,-]*(?:(?P<pp>pp|p-p|pk[-_]?pk|peak[ -](?:to[ -])?peak)|(?P<rms>rms)|(?P<peak>pk|0-pk|0-p|peak))$",
    re.IGNORECASE,
)
_SPELLINGS = {
    "r_min": "rpm",
    "1_min": "rpm",
    "hz": "Hz",
    **dict.fromkeys(("°", "º", "degree", "degrees"), "deg"),
    **{"mils": "mil", "micron": "um", "microns": "um", "ips": "in_s", "m_s²": "m_s2", "mm_s²": "mm_s2"},
}


@dataclass(frozen=True)
class Heading:
    """What the heading of a column says.

    Attributes
    ----------
    index, name
        Its place, and its name in the file.
    stem
        Of the column of a runs table; `vector` for amplitude and phase in one cell, the order of another
        harmonic (`2X`), `note` of what stays as it is; empty: unknown.
    unit
        As it is written.
    sensor
        What is left of the name beside these.
    tidy
        Whether it is a name of a runs table already.
    """

    index: int
    name: str
    stem: str = ""
    unit: str = ""
    sensor: str = ""
    tidy: bool = False


def read_unit(stem: str, text: str) -> tuple[str, str]:
    """The name in this project of a unit as people write it, `um_pp` of `µm pk-pk`; and `lag` or `lead`.

    Raises
    ------
    UnitError
        Where it is no unit of the quantity. Labels stand only in names such as `amplitude_div`.
    """
    direction, plain = "", text.strip()
    if len(plain) > LONGEST:
        raise UnitError(f"a unit, not {len(plain)} characters")
    if stem == "phase":
        direction = " and ".join(sorted({word.casefold() for word in _DIRECTION.findall(plain)}))
        plain = _DIRECTION.sub("", plain).strip(" ,;/")
    swing = _SWING.search(plain) if stem == "amplitude" else None
    base = units.spelt(plain[: swing.start()] if swing else plain).replace(" ", "_")
    folded = base.casefold()
    base = _SPELLINGS.get(folded, base if stem == "amplitude" and not base.isupper() else folded)
    if not plain:
        return "", direction
    if stem != "amplitude":
        return MEASURED[stem](base).name, direction
    if f"{base}_pp" not in units.VIBRATION:
        units.vibration(units.spelt(plain))
        raise UnitError(
            f"a unit of vibration, such as um pp or mm/s rms, not {plain!r} (a label: amplitude_div)"
        )
    return (f"{base}_{swing.lastgroup}" if swing and swing.lastgroup != "peak" else base), ""


def readable(stem: str, text: str) -> bool:
    """Whether a text is a unit of the quantity, or nothing."""
    try:
        read_unit(stem, text)
    except UnitError:
        return False
    return True


def read_headings(header: Sequence[str], named: Mapping[str, str]) -> list[Heading]:
    """What the headings of a table say; `named` are names of a runs table by names that the file has."""
    probes = any(_PROBE_Y.search(name) for name in header)  # 1X beside 1Y is a probe, else an order
    return [_heading(Heading(i, name), named.get(name, name), probes=probes) for i, name in enumerate(header)]


def looks_like_header(cells: Sequence[str], named: Mapping[str, str]) -> bool:
    """Whether cells are surely the header of a runs table: most of its columns, or run and speed."""
    stems = {heading.stem for heading in read_headings(cells, named)}
    stems |= set(READING) if "vector" in stems else set()
    return len(stems & _NEEDED) > len(_NEEDED) / 2 or {"run", "speed"} <= stems


def _heading(unknown: Heading, name: str, *, probes: bool) -> Heading:
    if len(name) > LONGEST:
        return unknown
    if name.casefold().startswith(REMARKS) or _BESIDE.match(name):
        return replace(unknown, stem="note")
    if (tidy := _TIDY.fullmatch(name)) is not None:
        return replace(unknown, stem=tidy[1] or tidy[0], unit=tidy[2] or "", tidy=True)
    order = None if probes else _ORDER.search(name)
    if order is not None and order[1] != "1":
        return replace(unknown, stem=f"{order[1]}X")
    name = name if order is None else name.replace(order[0], " ")
    inside, outside = " ".join(_BRACKETS.findall(name)).strip(), _BRACKETS.sub(" ", name)
    for stem, role in _ROLES.items():
        if match := role.search(outside):
            rpm = "rpm" if match[0].casefold() == "rpm" else ""
            rest = _bare(outside[: match.start()]), f"{rpm} {_bare(outside[match.end() :])}".strip()
            return _with_rest(replace(unknown, stem=stem), *rest, inside)
    if inside and readable("amplitude", inside):
        return replace(unknown, unit=inside, sensor=_bare(outside))
    return replace(unknown, sensor=unknown.name)


def _with_rest(heading: Heading, before: str, after: str, inside: str) -> Heading:
    """A heading with the unit that stands after its word or in brackets; the rest is the sensor."""
    quantity = "amplitude" if heading.stem == "vector" else heading.stem
    if quantity not in MEASURED:
        after, inside = f"{after} {inside}", ""
    for unit in (f"{after} {inside}", f"{inside} {after}"):  # um (pp), pp (um)
        if after.strip() and quantity in MEASURED and readable(quantity, unit):
            after, inside = "", unit.strip()
    words = [word for word in f"{before} {after}".split() if word.casefold() not in ("vibration", "vib")]
    if quantity not in READING and any(word.casefold().strip(".#") not in _FILLERS for word in words):
        return Heading(heading.index, heading.name, sensor=heading.name)
    return replace(heading, unit=inside, sensor=" ".join(words) if quantity in READING else "")


def _bare(text: str) -> str:
    """Part of a name without the signs that join it to the rest."""
    return text.strip(" _-.:,;/|&")
