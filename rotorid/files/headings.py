"""Headings as instruments and people write them: the quantity of a column, its unit, its sensor.

`Speed (rpm)`, `1X Ampl [µm pp]`, `Phase lag (°)`, `A_phase_deg`, `Bearing 1 mils`, `DE deg`; in a weights
table `Weight [g]`, `Angle`, `Hole`, `Clock`. A table may have two rows of headings, the upper one with
names over several columns.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rotorid.base.choices import suggest
from rotorid.files import units
from rotorid.files.cells import MOST_ABOVE
from rotorid.files.columns import REMARKS
from rotorid.files.units import UnitError, UnitReader, one_of

READING = ("amplitude", "phase")
LONGEST = 100
"""Of a heading, or a cell, that is read here: searching longer ones would take the square of their length."""
_RUN = "run|test|trial|state|condition|step|measurement"
_NEEDED = {"run", "speed", "sensor", *READING}
_AMPLITUDE, _PHASE = r"amplitude|ampl|amp|magnitude|mag", r"phase angle|phase|phs|ph|phi|φ"


def _words(**words: str) -> dict[str, re.Pattern[str]]:
    """Patterns of whole words, in the order in which they are looked for."""
    return {
        stem.rstrip("_"): re.compile(rf"(?<![^\W\d_])(?:{of})(?![^\W\d_])", re.IGNORECASE)
        for stem, of in words.items()
    }


_READINGS = _words(
    vector=rf"(?:{_AMPLITUDE})\W+(?:{_PHASE})|vector",
    amplitude=_AMPLITUDE,
    phase=rf"{_PHASE}|lag|lead|angle",
)
_OTHERS = _words(
    speed="speed|rpm|cpm|frequency|freq",
    sensor="sensor|probe|channel|point|transducer|bearing",
    run=_RUN,
    repeat="repeat",
)
_QUANTITY = _words(amplitude="vibration|vib|velocity|displacement|severity")
"""Says the quantity where nothing else does."""
_WEIGHTS = _words(
    clock="o['’]?clock|clock",
    angle="angle|angular position|location|direction|phase",
    hole="hole|blade|vane|position|pos",
    plane="plane",
    action="action",
    unit="unit",
    pieces="pieces",
    mass="unbalance|imbalance|weight|mass|wt|amount",
    run=_RUN,
)
_TIDY = {
    False: re.compile(r"(?:(speed|amplitude|phase)(?:_(.*))?|run|sensor|repeat)"),
    True: re.compile(
        r"(?:(mass|unbalance|angle)(?:_(?!clock)(.*))?|run|plane|hole|clock|action|unit|pieces)"
    ),
}
DEVIATION = re.compile(r"(?:amplitude|phase)_std(?:_|$)")
_BESIDE = re.compile(
    r"order|time_s|turns|overall|gap(?:_|$)|.*\bcoeff|.*\boverall\b|date|time(?:\b|stamp)|remark|operator|temp",
    re.IGNORECASE,
)
"""What `rotorid vectors` and instruments write beside the readings."""
_BESIDE_WEIGHTS = re.compile("date|time|remark|operator", re.IGNORECASE)
_FILLERS = re.compile(
    "(?:|name|no|nr|number|id|shaft|rotor|machine|running|rotational|nominal|measurement|measuring|run|measured"
    "|position|vibration|vib|balance|balancing|trial|correction|of)",
    re.IGNORECASE,
)
_BRACKETS = re.compile(r"[(\[]([^)\]]*)[)\]]")
_ORDER = re.compile(r"(?<![^\W_])(?<!\.)([0-9]+(?:\.[0-9]+)?)[xX×](?![^\W_])")
_PROBE_Y = re.compile(r"(?<![^\W_])[0-9]+[yY](?![^\W_])")
_DIRECTION = re.compile(r"(?<![^\W\d_])(lag|lead)(?:ging|ing)?(?![^\W\d_])", re.IGNORECASE)
_SWINGS = r"(?P<pp>pp|p-p|pk[-_]?pk|peak[ -](?:to[ -])?peak)|(?P<rms>rms)|(?P<peak>pk|0-pk|0-p|peak)"
_SWING = re.compile(rf"[\s_.,-]*(?:{_SWINGS})$", re.IGNORECASE)
_AT_END = re.compile(
    rf"(?<![^\W_])(?:(?P<angle>°|deg|degrees?)|(?:mils?|[uµμ]m|microns?|(?:mm|in)[/_]s(?:ec)?|ips)"
    rf"(?:[\s_.,-]*(?:{_SWINGS}))?)$",
    re.IGNORECASE,
)
"""A unit that says what it measures: of a phase, or of a vibration."""
_BOTH_AT_END = re.compile(
    r"(?<![^\W_])((?:mils?|[uµμ]m|(?:mm|in)/s(?:ec)?|ips)[^/@<∠]*?\s*[/@<∠]\s*(?:°|deg|degrees?))$",
    re.IGNORECASE,
)
_SPELLINGS = {
    other: unit
    for unit, others in {
        "rpm": "r_min 1_min cpm",
        "Hz": "hz",
        "deg": "° º degree degrees",
        "mil": "mils",
        "um": "micron microns",
        "in_s": "ips",
        "m_s2": "m_s²",
        "mm_s2": "mm_s²",
        "g": "gram grams gr gm gms",
        "oz": "ounce ounces",
        "lb": "lbs pound pounds",
    }.items()
    for other in others.split()
}


@dataclass(frozen=True)
class Heading:
    """What the heading of a column says.

    Attributes
    ----------
    index, name
        Its place, and its name in the file.
    stem
        Of the column of a runs or weights table; `vector` for amplitude and phase in one cell, the order of
        another harmonic (`2X`), `note` of what stays as it is; empty: unknown.
    unit
        As it is written.
    sensor
        What is left of the name beside these; in a weights table the plane.
    tidy
        Whether it is a name of such a table already.
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
    if not plain:
        return "", direction
    swing = _SWING.search(plain) if stem == "amplitude" else None
    base = units.spelt(plain[: swing.start()] if swing else plain).replace(" ", "_").removesuffix("ec")
    folded = base.casefold()
    if stem in ("mass", "unbalance"):
        parts = re.split("[_-]", re.sub(r"^(g|oz)\.?(mm|in)$", r"\1_\2", folded))
        return units.weight("_".join(_SPELLINGS.get(part, part) for part in parts if part)).name, ""
    base = _SPELLINGS.get(folded, base if stem == "amplitude" and not base.isupper() else folded)
    if stem != "amplitude":
        reader: UnitReader = one_of(units.SPEED if stem == "speed" else units.ANGLE)
        return reader(base).name, direction
    if f"{base}_pp" not in units.VIBRATION:
        units.vibration(units.spelt(plain))
        raise UnitError(
            f"a unit of vibration, such as um pp or mm/s rms, not {plain!r} (a label: amplitude_div)"
        )
    return (f"{base}_{swing.lastgroup}" if swing and swing.lastgroup != "peak" else base), ""


MEASURED = ("speed", *READING)


def readable(stem: str, text: str) -> bool:
    """Whether a text is a unit of the quantity, or nothing."""
    try:
        read_unit(stem, text)
    except UnitError:
        return False
    return True


def read_headings(header: Sequence[str], *, weights: bool = False) -> list[Heading]:
    """What the headings of a runs table, or of a weights table, say."""
    probes = any(_PROBE_Y.search(name) for name in header)  # 1X beside 1Y is a probe, else an order
    headings = [_heading(Heading(i, name), probes=probes, weights=weights) for i, name in enumerate(header)]
    plain = [h for h in headings if h.stem == "run" and re.search("run", h.name, re.IGNORECASE)]
    if len(plain) == 1:  # beside it a column such as Condition says something else
        headings = [replace(h, stem="note") if h.stem == "run" and h is not plain[0] else h for h in headings]
    return headings


def looks_like_header(cells: Sequence[str], *, weights: bool) -> bool:
    """Whether cells are surely the header of a table: most of its columns; of runs, run and speed."""
    stems = {heading.stem for heading in read_headings(cells, weights=weights)}
    if weights:
        return {"plane", "mass"} <= stems
    stems |= set(READING) if "vector" in stems else set()
    return len(stems & _NEEDED) > len(_NEEDED) / 2 or {"run", "speed"} <= stems


def find_header(
    rows: Sequence[Sequence[str]], *, weights: bool = False
) -> tuple[int, int, Sequence[str]] | None:
    """Where the header of a runs or weights table surely stands: its first and last row, and its names.

    Rows make one header where a name in the upper one stands over several columns, `Bearing 1` over `mils`
    and `deg`, and where the lower one has units.
    """
    for at, cells in enumerate(rows[:MOST_ABOVE]):
        last, names, below = at, cells, rows[at + 1 :]
        both = None if weights or not below else _joined(cells, below[0])
        if both is not None and looks_like_header(both, weights=False):
            last, names = at + 1, both
        elif not looks_like_header(cells, weights=weights):
            continue
        units_below = None if last + 1 >= len(rows) else _with_units(names, rows[last + 1], weights=weights)
        return (at, last, names) if units_below is None else (at, last + 1, units_below)
    return None


def _with_units(names: Sequence[str], below: Sequence[str], *, weights: bool) -> list[str] | None:
    """Names with the units of the row below them; None where that row holds something else."""
    joined, sure = [*names], False
    for heading, cell in zip(read_headings(names, weights=weights), below, strict=False):
        text, stem = cell.strip("()[] "), heading.stem
        if text in ("", "-") or stem == "note":
            continue
        quantity = "amplitude" if stem in ("", "vector") else "phase" if stem == "angle" else stem
        known = quantity in (*MEASURED, "mass") and readable(quantity, text)
        if not known and (stem not in (*MEASURED, "mass") or re.match("[0-9.,+-]", text)):
            return None
        sure = sure or known
        if not heading.unit:
            joined[heading.index] = f"{heading.name} ({text})"
        elif not (known and read_unit(quantity, heading.unit) == read_unit(quantity, text)):
            joined[heading.index] = f"{quantity} ({heading.unit}, {text})"  # explained as no unit
    return joined if sure else None


def _joined(upper: Sequence[str], lower: Sequence[str]) -> list[str] | None:
    """The names of two rows of headings; None where no upper name stands over several lower ones."""
    names, group, several = list[str](), "", False
    for above, heading in zip([*upper, *[""] * len(lower)], read_headings(lower), strict=False):
        if re.fullmatch(r"-*[0-9.,+][0-9.,+-]*", heading.name):
            return None
        reading = heading.stem in READING and not heading.sensor
        several = several or (reading and bool(group) and above in ("", group))
        group = (above or group) if reading else ""
        names.append(f"{group if reading else above} {heading.name.strip('-')}".strip())
    filled = [*filter(None, names)]
    return names if several and len(set(filled)) == len(filled) else None


def _heading(unknown: Heading, *, probes: bool, weights: bool) -> Heading:
    name = unknown.name
    if len(name) > LONGEST or name.startswith("//"):  # a line that was taken out
        return unknown
    beside = not weights and (DEVIATION.match(name) or _BESIDE.match(name))
    if beside or name.casefold().startswith(REMARKS):
        return replace(unknown, stem="note")
    if (tidy := _TIDY[weights].fullmatch(name)) is not None:
        stem = (tidy[1] or tidy[0]).replace("unbalance", "mass")
        return replace(unknown, stem=stem, unit=tidy[2] or "", tidy=True)
    order = None if probes or weights else _ORDER.search(name)
    if order is not None and order[1] != "1":
        return replace(unknown, stem=f"{order[1]}X")
    name = name if order is None else name.replace(order[0], " ")
    inside, outside = " ".join(_BRACKETS.findall(name)).strip(), _BRACKETS.sub(" ", name).strip()
    if weights:
        return _of_weights(unknown, outside, inside)
    whole = f"{outside} {inside}".strip()
    if both := _BOTH_AT_END.search(whole):
        return replace(unknown, stem="vector", unit=both[1], sensor=_bare(whole[: both.start()]))
    unit = _AT_END.search(whole)
    for words in (_READINGS, {} if unit else _OTHERS, _QUANTITY):
        for stem, role in words.items():
            if match := role.search(outside):
                heading = _with_rest(replace(unknown, stem=stem), outside, match, inside)
                if heading.stem and not (words is _QUANTITY and unit and unit["angle"]):
                    return heading
    return _by_unit(unknown, outside, inside, unit)


def _by_unit(unknown: Heading, outside: str, inside: str, unit: re.Match[str] | None) -> Heading:
    """A heading without a word for what it is: its unit says it, at its end or in brackets."""
    whole = f"{outside} {inside}".strip()
    sensor = _bare(whole[: unit.start()]) if unit else ""
    if unit and suggest(sensor, READING) is None:  # else a word for the quantity, misspelt
        return replace(unknown, stem="phase" if unit["angle"] else "amplitude", unit=unit[0], sensor=sensor)
    if inside and readable("speed", inside):
        return replace(unknown, stem="speed", unit=inside)
    if inside and readable("amplitude", inside):
        return replace(unknown, unit=inside, sensor=_bare(outside))
    return replace(unknown, sensor=unknown.name)


def _with_rest(heading: Heading, outside: str, match: re.Match[str], inside: str) -> Heading:
    """A heading with the unit that stands after its word or in brackets; the rest is the sensor."""
    kept = match[0] if match[0].casefold() in ("rpm", "cpm", "lag", "lead") else ""
    before, after = _bare(outside[: match.start()]), f"{kept} {_bare(outside[match.end() :])}".strip()
    quantity = "amplitude" if heading.stem == "vector" else heading.stem
    if quantity not in MEASURED:
        after, inside = f"{after} {inside}", ""
    for unit in (f"{after} {inside}", f"{inside} {after}"):  # um (pp), pp (um)
        if after.strip() and quantity in MEASURED and readable(quantity, unit):
            after, inside = "", unit.strip()
    if quantity in READING and not inside and (at_end := _AT_END.search(after)):  # velocity DE mm/s
        after, inside = after[: at_end.start()], at_end[0]
    words = [word for word in f"{before} {after}".split() if word.casefold() not in ("vibration", "vib")]
    if quantity not in READING and any(not _FILLERS.fullmatch(word.strip(".#")) for word in words):
        return Heading(heading.index, heading.name, sensor=heading.name)
    return replace(heading, unit=inside, sensor=" ".join(words) if quantity in READING else "")


def _of_weights(unknown: Heading, outside: str, inside: str) -> Heading:
    """A heading of a weights table; a number of degrees is an angle, whatever it is called."""
    for stem, role in _WEIGHTS.items():
        if match := role.search(outside):
            after = _bare(outside[match.end() :])
            unit = inside or ("" if _FILLERS.fullmatch(after) else after)
            if stem == "hole" and unit and readable("phase", unit):
                stem = "angle"
            unit = unit if stem in ("mass", "angle") else ""
            return replace(unknown, stem=stem, unit=unit, sensor=_bare(outside[: match.start()]))
    whole = f"{outside} {inside}".strip()
    at_end = _AT_END.search(whole)
    if at_end and at_end["angle"]:
        return replace(unknown, stem="angle", unit="deg", sensor=_bare(whole[: at_end.start()]))
    if readable("mass", whole) and _SPELLINGS.get(whole.casefold(), whole) != whole:  # Grams
        return replace(unknown, stem="mass", unit=whole)
    return replace(unknown, stem="note") if _BESIDE_WEIGHTS.match(unknown.name) else unknown


def _bare(text: str) -> str:
    """Part of a name without the signs that join it to the rest."""
    return text.strip(" _-.:,;/|&")
