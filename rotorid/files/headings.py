"""Headings as instruments and people write them: the quantity of a column, its unit, its sensor.

`Speed (rpm)`, `1X Ampl [µm pp]`, `Phase lag (°)`, `A_phase_deg`, `Bearing 1 mils`, `DE deg`; in a weights
table `Weight [g]`, `Angle`, `Hole`, `Clock`. Some words of a heading say what the column holds, those at its
end are a unit, and what is left names the sensor. A table may have two rows of headings, the upper one
with names over several columns, and a row of units.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from rotorid.base.choices import suggest
from rotorid.files import units
from rotorid.files.columns import REMARKS
from rotorid.files.units import UnitError, one_of

READING, WEIGHT = ("amplitude", "phase"), ("mass", "angle")
LONGEST = 100
"""Of a heading, or a cell, that is read here: searching longer ones would take the square of their length."""
_OF_RUNS = {
    "mounted": "weight weights wt mass correction",
    "amplitude": "amplitude ampl amp magnitude mag",
    "phase": "phase phs ph phi φ lag lead lagging leading angle",
    "vector": "vector",
    "speed": "speed rpm cpm frequency freq",
    "sensor": "sensor probe channel point transducer bearing",
    "run": "run",
    "step": "test trial state condition step measurement",
    "repeat": "repeat",
    "vibration": "vibration vib velocity displacement severity",
}
_OF_WEIGHTS = {
    "clock": "clock o",
    "angle": "angle angular location direction phase",
    "hole": "hole position pos",
    "blade": "blade vane",
    "plane": "plane",
    "action": "action",
    "unit": "unit",
    "pieces": "pieces",
    "mass": "unbalance imbalance weight mass wt amount",
    "run": "run",
    "step": "test trial state condition step measurement",
}
"""Words for what a column holds; the first kind of which a heading has one counts."""
_ROLES = {
    weights: {stem: frozenset(words.split()) for stem, words in of.items()}
    for weights, of in ((False, _OF_RUNS), (True, _OF_WEIGHTS))
}
_LETTERS = re.compile(r"([^\W\d_]+)")
_FILLERS = frozenset(
    _LETTERS.findall(
        "name no nr number id test shaft rotor machine running rotational nominal measurement measuring run "
        "measured position vibration vib balance balancing trial correction of"
    )
)
_NO_NAMES = {
    False: frozenset[str]().union(*(_ROLES[False][stem] for stem in (*READING, "vector", "vibration"))),
    True: _FILLERS.union(*_ROLES[True].values()),
}
"""Words of which no sensor's or plane's name consists."""
_TIDY = {
    False: re.compile(r"(?:(speed|amplitude|phase|index(?=_(?:deg|rad)$))(?:_(.*))?|run|sensor|repeat)"),
    True: re.compile(
        r"(?:(mass|unbalance|angle)(?:_(?!clock)(.*))?|run|plane|hole|clock|action|unit|pieces)"
    ),
}
_BESIDE = {
    False: re.compile(
        r"(?:amplitude|phase)_std(?:_|$)|order|time_s|turns|overall|gap(?:_|$)|.*\bcoeff|.*\boverall\b|date"
        r"|time(?:\b|stamp)|remark|operator|temp",
        re.IGNORECASE,
    ),
    True: re.compile("date|time|remark|operator", re.IGNORECASE),
}
"""What `rotorid vectors` and instruments write beside the readings."""
_BRACKETS = re.compile(r"[(\[]([^)\]]*)[)\]]")
_SIGNS = " _-.:,;/|&'’"
"""They join the parts of a name."""
_ORDER = re.compile(r"(?<![^\W_])(?<!\.)([0-9]+(?:\.[0-9]+)?)[xX×](?![^\W_])")
_PROBE_Y = re.compile(r"(?<![^\W_])[0-9]+[yY](?![^\W_])")
_DIRECTION = re.compile(r"(?<![^\W\d_])(lag|lead)(?:ging|ing)?(?![^\W\d_])", re.IGNORECASE)
_SWINGS = r"(?P<pp>pp|p-p|pk[-_]?pk|peak[ -](?:to[ -])?peak)|(?P<rms>rms)|(?P<peak>pk|0-pk|0-p|peak)"
_SWING = re.compile(rf"[\s_.,-]*(?:{_SWINGS})$", re.IGNORECASE)
_BEHIND = re.compile(
    rf"[\s_]*(?<![^\W_])({re.sub('[?]P<[a-z]+>', '?:', _SWINGS)}|lag|lead)(?![^\W_])", re.IGNORECASE
)
"""Words of a unit that may stand elsewhere in a heading."""
_STARTS = re.compile(r"(?:^|(?<=[\s_.,;:]))(?=[^\s_])")
"""Of a word."""
_DIGITS = frozenset("0123456789.,+-")
BOTH_UNITS = re.compile(r"(.*?)\s*[/@<∠,;&]?\s*((?:°|deg|rad).*)", re.IGNORECASE)
_SURE = re.compile(r"(?:mil|um|mm_s|in_s)(?:_pp|_rms)?(?:@deg)?|deg")
"""Units that say what they measure without a word for it."""
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
MEASURED = ("speed", *READING, "mass")
"""Quantities whose cells are numbers, maybe with a unit; an angle of a weight may have other forms."""


@dataclass(frozen=True)
class Heading:
    """What the heading of a column says.

    Attributes
    ----------
    index, name
        Its place, and its name in the file.
    stem
        Of the column of a runs or weights table; `vector` for amplitude and phase in one cell, the order of
        another harmonic (`2X`), `mounted` for weights in a runs table, `note` of what stays as it is; empty:
        unknown.
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

    Of a `vector` it is that of its amplitude, `um_pp@`, or of both, `um_pp@deg`.

    Raises
    ------
    UnitError
        Where it is no unit of the quantity. Labels stand only in names such as `amplitude_div`.
    """
    direction, plain = "", text.strip()
    if len(plain) > LONGEST:
        raise UnitError(f"a unit, not {len(plain)} characters")
    if stem == "vector":
        both = BOTH_UNITS.fullmatch(plain)
        size, angle = both.groups() if both else (plain, "")
        angle, direction = read_unit("phase", angle)
        return f"{read_unit('amplitude', size)[0]}@{angle}", direction
    if stem == "phase":
        direction = " and ".join(sorted({word.casefold() for word in _DIRECTION.findall(plain)}))
        plain = _DIRECTION.sub("", plain).strip(" ,;/")
    if not plain:
        return "", direction
    swing = _SWING.search(plain) if stem == "amplitude" else None
    base = units.spelt(plain[: swing.start()] if swing else plain).replace(" ", "_").removesuffix("ec")
    folded = base.casefold()
    if stem == "mass":
        parts = re.split("[_-]", re.sub(r"^(g|oz)\.?(mm|in)$", r"\1_\2", folded))
        return units.weight("_".join(_SPELLINGS.get(part, part) for part in parts if part)).name, ""
    base = _SPELLINGS.get(folded, base if stem == "amplitude" and not base.isupper() else folded)
    if stem != "amplitude":
        return one_of(units.SPEED if stem == "speed" else units.ANGLE)(base).name, direction
    if f"{base}_pp" not in units.VIBRATION:
        units.vibration(plain)
        raise UnitError(
            f"a unit of vibration, such as um pp or mm/s rms, not {plain!r} (a label: amplitude_div)"
        )
    return (f"{base}_{swing.lastgroup}" if swing and swing.lastgroup != "peak" else base), ""


@lru_cache
def readable(stem: str, text: str) -> bool:
    """Whether a text is a unit of the quantity, or nothing."""
    try:
        read_unit(stem, text)
    except UnitError:
        return False
    return True


def read_headings(header: Sequence[str], *, weights: bool = False) -> list[Heading]:
    """What the headings of a runs table, or of a weights table, say."""
    probes = weights or any(_PROBE_Y.search(name) for name in header)  # 1X beside 1Y is no order
    headings = [_heading(Heading(i, name), probes=probes, weights=weights) for i, name in enumerate(header)]
    # beside a column Run one such as Condition says something else
    step = "note" if any(heading.stem == "run" for heading in headings) else "run"
    return [replace(heading, stem=step) if heading.stem == "step" else heading for heading in headings]


def find_header(
    rows: Sequence[Sequence[str]], *, weights: bool = False
) -> tuple[int, int, Sequence[str]] | None:
    """Where the header of a runs or weights table surely stands: its first and last row, and its names.

    That is the row with most of its columns, or several that make one: names over the columns of each
    sensor, `Bearing 1` over `mils` and `deg`, and a row of units.
    """
    for at, cells in enumerate(rows):
        names, last = cells, at
        for below in rows[at + 1 : at + 3]:
            if (both := _as_one(names, below, weights=weights)) is None:
                break
            names, last = both, last + 1
        stems = {heading.stem for heading in read_headings(names, weights=weights)}
        stems |= set(READING) if "vector" in stems else set()
        runs = {"run", "speed"} <= stems or len(stems & {"run", "speed", "sensor", *READING}) > 2
        if {"plane", "mass"} <= stems if weights else runs:
            return at, last, names
    return None


def _as_one(upper: Sequence[str], lower: Sequence[str], *, weights: bool) -> list[str] | None:
    """The names of two rows of headings, or of headings and units; None where the lower row is neither."""
    names, group, sure = list[str](), "", False
    width = max(len(upper), len(lower))
    above, below = (
        read_headings([*row, *[""] * (width - len(row))], weights=weights) for row in (upper, lower)
    )
    for head, heading in zip(above, below, strict=True):
        text = re.sub(r"[(\[](.*)[)\]]", r"\1", heading.name.strip(" -"))
        quantity = {"": "amplitude", "angle": "phase"}.get(head.stem, head.stem)
        fits = bool(text) and quantity in (*MEASURED, "vector") and readable(quantity, text)
        if re.fullmatch("[0-9.,+][0-9.,+-]*", text):
            return None
        if heading.stem in (WEIGHT if weights else READING) and not heading.sensor and not head.stem:
            sure = sure or bool(head.name if fits else group and head.name in ("", group))
            group = head.name or group
            names.append(f"{group} {heading.name.strip('-')}".strip())
            continue
        group = ""
        sure = sure or (fits and bool(head.name))
        if not text or head.stem in ("note", "mounted"):
            names.append(head.name)
        elif not head.name:
            names.append(heading.name)
        elif not fits and (head.stem not in MEASURED or text[0] in _DIGITS):
            return None
        elif not head.unit or not readable(quantity, head.unit):
            names.append(f"{head.name} ({text})")
        elif fits and read_unit(quantity, head.unit) == read_unit(quantity, text):
            names.append(head.name)
        else:
            names.append(f"{quantity} ({head.unit}, {text})")  # explained as no unit
    filled = [*filter(None, names)]
    return names if sure and len({*filled}) == len(filled) else None


def _heading(heading: Heading, *, probes: bool, weights: bool) -> Heading:
    name = heading.name
    if len(name) > LONGEST or name.startswith("//"):  # a line that was taken out
        return heading
    if name.casefold().startswith(REMARKS) or _BESIDE[weights].match(name):
        return replace(heading, stem="note")
    if (tidy := _TIDY[weights].fullmatch(name)) is not None:
        stem = (tidy[1] or tidy[0]).replace("unbalance", "mass")
        return replace(heading, stem=stem, unit=tidy[2] or "", tidy=True)
    order = None if probes else _ORDER.search(name)
    if order is not None and order[1] != "1":
        return replace(heading, stem=f"{order[1]}X")
    plain = _BRACKETS.sub(" ", name if order is None else name.replace(order[0], " "))
    inside = " ".join([*_BRACKETS.findall(name), *_BEHIND.findall(plain)]).strip()
    words = {word.casefold() for word in _LETTERS.findall(plain)}
    heading = _by_words(heading, words, _BEHIND.sub(" ", plain), inside, weights=weights)
    if heading.stem or weights:
        return heading
    if inside and readable("speed", inside):
        return replace(heading, stem="speed", unit=inside)
    if inside and readable("amplitude", inside):
        return replace(heading, unit=inside, sensor=_BEHIND.sub(" ", plain).strip(_SIGNS))
    return replace(heading, sensor=name)


def _by_words(heading: Heading, words: set[str], outside: str, inside: str, *, weights: bool) -> Heading:
    """What the words of a heading say that it is, or else its unit; as it is where neither says it."""
    roles, pair = _ROLES[weights], {*WEIGHT} if weights else {*READING, "vector"}
    stems = [stem for stem, of in roles.items() if words & of]
    if "mounted" in stems:
        return replace(heading, stem="mounted")
    if {*READING} <= {*stems}:
        stems.insert(0, "vector")
    by_unit, clear = _by_unit(outside, inside, weights=weights)
    if not stems and suggest(_without_unit(by_unit, outside, inside)[0].strip(_SIGNS), READING):
        return heading  # a word for the quantity, misspelt
    if by_unit in stems or not pair & {*stems}:
        stems = [*filter(None, [by_unit]), *stems]
    for stem in stems:
        quantity = "amplitude" if stem == "vibration" else stem
        rest, unit = _without_unit(quantity, outside, inside)
        if quantity in pair:
            no_names = _NO_NAMES[weights]
            cut = ("\0" if part.casefold() in no_names else part for part in _LETTERS.split(rest))
            parts = [part.strip(_SIGNS) for part in "".join(cut).split("\0")]
            if weights and not unit:  # what stands behind the word can be nothing else
                unit = parts.pop()
            sensor = " ".join(filter(None, parts))
            return replace(heading, stem=quantity, unit=unit or clear, sensor=sensor)
        left = {word.strip(f"#{_SIGNS}").casefold() for word in re.split(r"[\s_]+", rest)}
        if left <= roles[stem] | _FILLERS | {"", "angle" if weights else ""}:
            return replace(heading, stem=stem, unit=unit)
    return replace(heading, stem=stems[0]) if weights and stems else heading


def _by_unit(outside: str, inside: str, *, weights: bool) -> tuple[str, str]:
    """What a column holds as the unit at the end says, and that unit; empty where it may be another."""
    for stem in WEIGHT if weights else ("vector", *READING):
        unit = _without_unit(stem, outside, inside)[1]
        long = stem == "mass" and len(unit) > 1  # grams, not g
        if readable(stem, unit) and (long or _SURE.fullmatch(read_unit(stem, unit)[0])):
            return stem, unit
    return "", ""


def _without_unit(stem: str, outside: str, inside: str) -> tuple[str, str]:
    """A heading without the unit at its end, and that unit: what stands in brackets, or more."""
    whole = " ".join(f"{outside} {inside}".split())
    if stem in (*MEASURED, "angle", "vector"):
        for start in (match.start() for match in _STARTS.finditer(whole)):
            unit = whole[start:]
            if len(unit) >= len(inside) and readable(stem, unit):
                return whole[:start], unit
        return outside, inside
    return whole, ""
