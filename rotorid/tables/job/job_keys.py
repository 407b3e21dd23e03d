"""Keys of a job, told once: of a job file, and of the sheets settings, planes and sensors of a workbook."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from rotorid.files import units, value_kinds
from rotorid.files.conventions import (
    DEFAULT_TOLERANCE,
    LARGEST_TOLERANCE,
    PHASES,
    ROTATIONS,
    STATED_ANGLES,
    VIEWS,
    StatedErrors,
)
from rotorid.files.settings_keys import Key, Kind
from rotorid.files.toml_file import Section
from rotorid.files.value_kinds import ABOVE_ZERO, FLAG, TEXT, TURN, number, plain_number

TABLES = ("runs", "weights", "influence", "check", "check_weights", "slow_roll")
"""Keys of a job file that name tables; the sheets of a workbook that are such tables."""
WEIGHTS = "weights"
"""In place of a table of `check_weights`: the weights were mounted, although there are holes for pieces."""
READINGS = ("runs", "check", "slow_roll")
"""Those that are runs tables."""
ZEROS = ("right", "top")
RADIUS = {name: units.LENGTH[name] for name in ("mm", "m", "in")}
MOST_HOLES = 1000
SAME_DEG = 1e-4
Pair = tuple[float, float]
_ANY_NUMBER = r"([+-]?[0-9]+(?:[.,][0-9]+)?)"
_PAIR = re.compile(rf"{_ANY_NUMBER}\s*(?:-|\N{{EN DASH}}|\.\.|:|to)\s*{_ANY_NUMBER}")
_PAIRS = "pairs [from, to] of different angles from -360 to 360 degrees, such as [[20, 60], [300, 340]]"
_DEG = "angles of the holes in degrees, such as holes_deg = [0, 30, 75]"
_AVAILABLE = "weights of which each can be mounted, such as available_g = [5, 10, 20]"
_TAKEN = 'weights that are in holes already, by number or name of the hole, such as { "3" = 10 }'
_STOCK = "how many there are of each available weight, such as stock = [4, 4, 2]"


def named_tables(settings: Mapping[str, Any]) -> dict[str, str]:
    """The files of `TABLES` that a job names, by key; vectors at slow speed and `WEIGHTS` are none."""
    named = {key: settings.get(key) for key in TABLES}
    if named["check_weights"] == WEIGHTS:
        del named["check_weights"]
    return {key: name for key, name in named.items() if isinstance(name, str)}


def _arcs(section: Section, key: str) -> tuple[Pair, ...] | None:
    pairs = _pairs(section.take(key))
    if pairs is None:
        section.complain(key, f"{_PAIRS}, in a sheet 20-60; 300-340")
    elif any((last - first) % 360.0 == 0.0 for first, last in pairs):
        section.complain(key, f"{_PAIRS} (use = false leaves a plane out)")
    elif covers_circle(pairs):
        section.complain(key, "arcs that leave some angle free; use = false leaves a plane out")
    else:
        return pairs
    return None


def _pairs(value: object) -> tuple[Pair, ...] | None:
    if isinstance(value, str):
        matches = [_PAIR.fullmatch(part.strip()) for part in value.split(";") if part.strip()]
        value = [[float(m[1].replace(",", ".")), float(m[2].replace(",", "."))] for m in matches if m]
        if len(value) < len(matches):
            return None
    if not isinstance(value, list) or not value:
        return None
    if all(_is_angle(item) for item in value):
        value = [value]
    if not all(isinstance(pair, list) and len(pair) == 2 and all(map(_is_angle, pair)) for pair in value):
        return None
    return tuple((float(first), float(last)) for first, last in value)


def _is_angle(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 360.0


def covers_circle(pairs: Iterable[Pair]) -> bool:
    """Whether arcs (degrees, from → to) together leave no arc of the circle free."""
    pairs = list(pairs)
    edges = sorted({angle % 360.0 for pair in pairs for angle in pair})
    for edge, following in zip(edges, [*edges[1:], edges[0] + 360.0], strict=True):
        middle = (edge + following) / 2
        if not any((middle - first) % 360.0 < (last - first) % 360.0 for first, last in pairs):
            return False
    return True


def _degrees(section: Section, key: str) -> tuple[float, ...] | None:
    """Listed angles of holes: within one turn, different and ascending."""
    degrees = _ANGLES.read(section, key)
    wrong = "" if degrees is None else _wrong_order(degrees)
    if degrees is not None and len(degrees) > MOST_HOLES:
        section.complain(key, f"at most {MOST_HOLES} holes, not {len(degrees)}", value=False)
    elif wrong:
        section.complain(key, wrong)
    else:
        return tuple(degrees or ())
    return None


def _wrong_order(degrees: Sequence[float]) -> str:
    """What is expected of angles of holes where they are not so; else nothing."""
    beyond = [angle for angle in degrees if abs(angle) > 360.0]
    if beyond:
        return f"angles from -360 to 360 degrees, not {beyond[0]:g}: {_DEG}"
    order = sorted(range(len(degrees)), key=lambda k: degrees[k] % 360.0)
    for k, following in zip(order, [*order[1:], order[0]], strict=True):
        gap = (degrees[following] - degrees[k]) % 360.0
        if following != k and min(gap, 360.0 - gap) < SAME_DEG:
            a, b = sorted((k, following))
            return f"each hole once; numbers {a + 1} ({degrees[a]:g}) and {b + 1} ({degrees[b]:g}) are one"
    for k in range(1, len(degrees)):
        if degrees[k] < degrees[k - 1]:
            return (
                f"angles in ascending order, because holes are numbered in the order of the list; number "
                f"{k + 1} ({degrees[k]:g}) follows {degrees[k - 1]:g} (a list may begin below zero: "
                "[-30, 0, 30]; hole_names gives holes other names)"
            )
    return ""


def _stock(section: Section, key: str) -> tuple[int, ...] | None:
    values = _COUNTS.read(section, key)
    wrong = [value for value in values or () if value < 0 or value != int(value)]
    if wrong:
        section.complain(key, f"whole numbers of 0 or more, not {wrong[0]:g}: {_STOCK}")
    elif values and not any(values):
        section.complain(key, f"at least one weight: {_STOCK}")
    elif values:
        return tuple(int(value) for value in values)
    return None


def _hole_names(section: Section, key: str) -> tuple[str, ...] | None:
    value = section.take(key)
    if isinstance(value, str):
        value = [part.strip() for part in value.split(";") if part.strip()]
    given = value if isinstance(value, list) else []
    plain = [word for word in given if isinstance(word, (str, int)) and not isinstance(word, bool)]
    words = [str(word).strip() for word in plain]
    if not words or not all(words) or len(words) < len(given) or len(set(words)) < len(words):
        section.complain(key, 'a different name for each hole, such as ["A", "B", "C"]')
        return None
    return tuple(words)


def _place(section: Section, _: str) -> int | str | None:
    """`node` (a number) or `station` (a name) of the rotor model."""
    node, station = section.take("node"), section.take("station")
    if node is not None and station is not None:
        section.complain("station", "either node or station, not both")
    elif node is not None:
        whole = isinstance(node, (int, float)) and not isinstance(node, bool)
        if whole and math.isfinite(node) and node == int(node) and node >= 1:
            return int(node)
        section.complain("node", "a node of the rotor model, a whole number from 1 (or station, a name)")
    elif isinstance(station, str) and station.strip():
        return station.strip()
    else:
        section.complain("station", "the name of a station of the rotor model, in quotes")
    return None


def by_speed(what: str, example: str, *, above_zero: bool, alone: bool) -> Kind:
    """A table, or a text, of numbers by speed (texts in the job's unit); "" stands for all speeds.

    Parameters
    ----------
    what
        What each number is, for messages.
    example
        What is expected where it is something else.
    above_zero
        Whether zero is wrong.
    alone
        Whether it may be one number, for all speeds.
    """

    def plain(value: object, *, above_zero: bool) -> float | None:
        found = plain_number(value, comma=True)
        return None if found is None or found < 0 or (above_zero and found == 0) else found

    def read(section: Section, key: str) -> dict[str, float] | None:
        value = section.take(key)
        single = None if isinstance(value, (str, dict)) or not alone else plain(value, above_zero=above_zero)
        if single is not None:
            return {"": single}
        value = value_kinds.entries(
            section, key, value, f'{example}, in a sheet "3000: 20; 4500: 30"', "speed"
        )
        if not isinstance(value, dict) or not value:
            if key not in section.refused:
                section.complain(key, example)
            return None
        found = {}
        for speed, entry in value.items():
            size = plain(entry, above_zero=above_zero)
            if plain(speed, above_zero=True) is None:
                section.complain(key, f"speeds above 0, not {speed!r}: {example}")
            elif size is None:
                section.complain(key, f"{what}, not {entry!r} at speed {speed}")
            else:
                found[speed] = size
        return found

    one = {"type": "number", "exclusiveMinimum" if above_zero else "minimum": 0}
    table = {"type": "object", "additionalProperties": one, "minProperties": 1}
    forms = [*([one] if alone else []), table, {"type": "string"}]
    allowed = f"{'a number, or ' if alone else ''}3000: 20; 4500: 30"
    return Kind(read, {"anyOf": forms}, allowed, example.rpartition("such as ")[2], "words")


def _file(section: Section, key: str) -> str | None:
    name = section.text(key)
    if name is not None and not name.isprintable():
        expected = (
            "the name of a file, without control characters: in double quotes TOML takes \\ for the "
            "beginning of one; write / in its place, or put the name in single quotes"
        )
        section.complain(key, expected)
        return None
    return name


def _files(section: Section, key: str) -> str | tuple[str, ...] | None:
    value = section.take(key)
    if not isinstance(value, list):
        return _file(section, key)
    if not value or not all(isinstance(name, str) and name.strip() and name.isprintable() for name in value):
        section.complain(key, 'the names of files, one a run: ["as found.csv", "trial.csv"]')
        return None
    return tuple(name.strip() for name in value)


def _errors(section: Section, key: str) -> StatedErrors | None:
    said = _STATED.read(section, key)
    if said is None or said.section.refused:
        return None
    given = {name: value for name, value in said.items() if value is not None}
    if not any(value or name.startswith("run_") for name, value in given.items()):
        expected = (
            "an error above 0 (amplitude_percent, phase_deg or floor); leave [errors] out if it is unknown"
        )
        section.missing(key, expected)
        return None
    return StatedErrors(**given)


def _slow_roll(section: Section, key: str) -> Any:  # noqa: ANN401  a file's name, or vectors
    value = section.take(key)
    if isinstance(value, str) and value.strip():
        return FILE.read(section, key)
    if isinstance(value, dict) and value:
        return _VECTORS.read(section, key)
    expected = (
        "a table of vectors, [slow_roll.SENSOR] with amplitude and phase_deg, or a runs table of one run at "
        'slow speed, slow_roll = "slow.csv"'
    )
    section.complain(key, expected, value=not isinstance(value, dict))
    return None


_PAIR_SCHEMA = {"type": "array", "items": TURN.schema, "minItems": 2, "maxItems": 2}
_ARCS = Kind(
    _arcs,
    {"anyOf": [{"type": "array", "items": _PAIR_SCHEMA, "minItems": 1}, _PAIR_SCHEMA, {"type": "string"}]},
    "20 to 60; 300 to 340",
    "[[20, 60], [300, 340]]",
    "name",
)
_ANGLES = value_kinds.numbers(_DEG, "0; 30; 75")
_COUNTS = value_kinds.numbers(_STOCK, "4; 4; 2")
_NAMES = Kind(
    _hole_names,
    {"anyOf": [{"type": "array", "items": {"type": ["string", "integer"]}, "minItems": 1}, TEXT.schema]},
    "A; B; C",
    '["A", "B", "C"]',
    "name",
)
_PLACE = Kind(_place, {"type": ["integer", "string"]}, "a number, or a name")
FILE = Kind(_file, TEXT.schema, cell="name")
FILES = Kind(
    _files, {"anyOf": [TEXT.schema, {"type": "array", "items": TEXT.schema, "minItems": 1}]}, cell="name"
)
FORBIDDEN = Key(
    "forbidden_deg",
    _ARCS,
    "arcs from … to … where nothing may be mounted",
    default=(),
)
_PLACES = (Key("node station", _PLACE, "where it is in the rotor model, by number or by name"),)
LARGEST = Key(
    "max_mass_g max_unbalance_g_mm",
    ABOVE_ZERO,
    "largest weight that may be mounted, in any unit of a mass or unbalance",
    units.WEIGHT,
)
_PLANE = (
    LARGEST,
    Key("radius_mm", ABOVE_ZERO, "radius of the corrections; converts masses and unbalances", RADIUS),
    Key("trial_radius_mm", ABOVE_ZERO, "radius of the trial weights, where it is another", RADIUS),
    Key("use", FLAG, "whether the plane is used", default=True),
    Key("remove", FLAG, "whether material is taken away (drilled, ground) instead of added", default=False),
    FORBIDDEN,
    *_PLACES,
)
HOLES = (
    Key(
        "holes",
        value_kinds.whole("the number of holes, equally spaced", 1, MOST_HOLES),
        "a number of equally spaced holes",
    ),
    Key("first_hole_deg", TURN, "angle of the first of them, default 0", default=0.0),
    Key("holes_deg", replace(_ANGLES, read=_degrees), "or the angles of the holes"),
    Key("hole_names", _NAMES, "names of the holes instead of the numbers 1, 2, …"),
    Key(
        "available_g available_g_mm",
        value_kinds.numbers(_AVAILABLE, "5; 10; 20", above_zero=True),
        "weights, in any unit, of which each can be mounted in a hole",
        units.WEIGHT,
    ),
    Key("step_g step_g_mm", ABOVE_ZERO, "or any weight in such steps", units.WEIGHT),
    Key(
        "per_hole",
        value_kinds.whole("how many weights one hole takes", 1, 100),
        "how many weights one hole takes, default 1",
        default=1,
    ),
    Key(
        "taken",
        value_kinds.by_name(_TAKEN, "3: 10; 5: 20"),
        "weights that are in holes already, by number or name of the hole",
        default={},
    ),
    Key("stock", replace(_COUNTS, read=_stock), "how many there are of each available weight"),
)
PLANE = (*_PLANE, *HOLES)
_LIMIT = "an amplitude above 0 in the unit of the readings"
SENSOR = (
    Key(
        "limit",
        by_speed(
            _LIMIT,
            f'{_LIMIT}, or a table of them by speed, such as {{ "3000" = 20, "4500" = 30 }}',
            above_zero=True,
            alone=True,
        ),
        "largest amplitude, in the unit of the readings; or by speed",
        default={},
    ),
    Key(
        "weight",
        number(0.0),
        "weight in the fit, default 1; 0: the sensor counts only for its limit",
        default=1.0,
    ),
    Key("angle_deg", TURN, "where the sensor points, from the model's x, in the job's angle direction"),
    *_PLACES,
)
ERRORS = (
    Key("amplitude_percent", number(0.0), "one standard deviation of an amplitude, percent of it"),
    Key("phase_deg", number(0.0), "one standard deviation of a phase, degrees"),
    Key("floor", number(0.0), "one standard deviation at amplitude 0, in the unit of the readings"),
    Key("run_percent", number(0.0), "what changes from run to run, one standard deviation, percent"),
    Key("run_floor", number(0.0), "the same at amplitude 0, in the unit of the readings"),
    Key("placement_deg", number(0.0), "one standard deviation of the angle of a mounted weight, degrees"),
    Key("placement_percent", number(0.0), "one standard deviation of its mass, percent"),
    Key("drift_percent", number(0.0), "how far readings drift from the first run to the last, percent"),
)
_STATED = value_kinds.table(ERRORS)
KEY_PHASOR = (
    Key(
        "angle_deg",
        TURN,
        "where it stands, from the model's x, in the job's angle direction",
        required="the direction of the key phasor, degrees from the model's x",
    ),
)
VECTOR = (
    Key(
        "amplitude",
        number(0.0),
        "at slow speed, in the unit of the readings; or `amplitude_<unit>`",
        units.vibration,
        required="the amplitude at slow speed, in the unit of the readings",
    ),
    Key(
        "phase_deg",
        TURN,
        "counted as the readings count it",
        required="the phase at slow speed, counted as the readings count it",
    ),
)
_VECTORS = value_kinds.named(VECTOR)
COLUMNS = (
    Key("run", TEXT, "name in the file of the column `run`, and so on"),
    Key("speed_rpm", TEXT, "or another unit of a speed", units.SPEED),
    Key("sensor", TEXT, "not where each sensor has columns of its own"),
    Key("amplitude", TEXT, "or, with its unit, `amplitude_um_pp` and the like", units.vibration),
    Key("phase_deg", TEXT, "or `phase_rad`", units.ANGLE),
    Key("repeat", TEXT, "of repeated readings"),
)
SHEET = (
    Key("machine", value_kinds.LABEL, "what was balanced; default: `machine` of the job", default=""),
    Key("place", value_kinds.LABEL, "where it stands", default=""),
    Key("date", value_kinds.DATE, "when it was balanced; default: `date` of the job"),
    Key("engineer", value_kinds.LABEL, "who balanced it", default=""),
    Key("instrument", value_kinds.LABEL, "with what, its number", default=""),
    Key(
        "zero",
        value_kinds.choice(ZEROS),
        "where 0° stands in the polar plots of the sheet; default: right, analysers have it at the top",
        default="right",
    ),
)
JOB = (
    Key(
        "runs",
        FILES,
        "the runs table, relative to the job file; or a folder, or a list of files, with one run each",
    ),
    Key("weights", FILE, "the weights table"),
    Key("influence", FILE, "stored coefficients instead of trial runs, or beside them"),
    Key("rotor", FILE, "a rotor table or file: coefficients are computed"),
    Key("check", FILE, "runs table of a check run, with the proposed weights mounted"),
    Key(
        "check_weights",
        FILE,
        "weights table of the check run, where others were mounted than proposed: the pieces of `--split` "
        'where there are holes, else the weights; `"weights"`: these, although there are holes',
    ),
    Key(
        "slow_roll",
        Kind(_slow_roll, {"anyOf": [FILE.schema, _VECTORS.schema]}, cell="name"),
        "a runs table of one run at slow speed, to be subtracted from every reading; or "
        "`[slow_roll.SENSOR]`, see below",
    ),
    Key("key_phasor", value_kinds.table(KEY_PHASOR), "where the key phasor stands, see below"),
    Key(
        "speed_weights",
        by_speed(
            "a weight of 0 or more",
            'a table of weights by speed, such as { "3000" = 2, "4500" = 0.5 }',
            above_zero=False,
            alone=False,
        ),
        "weights of the speeds in the fit, 0: only for the limits",
        default={},
    ),
    Key(
        "phase",
        value_kinds.choice(PHASES),
        "whether a positive phase leads or lags; most instruments show lag, the angle that the rotor turns "
        "from the pulse to the positive peak; unstated: lead, the answer says so and what lag gives",
    ),
    Key(
        "angles",
        value_kinds.choice(STATED_ANGLES),
        "how angles on the rotor count: with rotation, against rotation, or clockwise or counter-clockwise "
        "with `rotation`; unstated: with rotation, named so where an angle other than 0° and 180° is written",
    ),
    Key(
        "rotation",
        value_kinds.choice(ROTATIONS),
        "how the rotor turns, seen from the same end as the angles",
    ),
    Key("view", value_kinds.choice(VIEWS), "the end from which that is seen"),
    Key(
        "speed_tolerance_percent",
        number(0.0, LARGEST_TOLERANCE),
        f"speeds of different runs that differ by less count as one, default {DEFAULT_TOLERANCE:g}",
        default=DEFAULT_TOLERANCE,
    ),
    Key("speed_rpm", ABOVE_ZERO, "the speed of runs tables without a column of speeds", units.SPEED),
    Key(
        "errors",
        replace(_STATED, read=_errors),
        "one standard deviation of a reading, see below; unstated and unmeasured ones are assumed (2 % and "
        "2° of a reading, 2 % from run to run) and named so; the digits in which readings are written count",
    ),
    Key("columns", value_kinds.table(COLUMNS), "other names of the columns of runs tables, see below"),
    Key("planes", value_kinds.named(PLANE), "see below", default={}),
    Key("sensors", value_kinds.named(SENSOR), "see below", default={}),
    Key("machine", value_kinds.LABEL, "its name or serial number, for `rotorid fleet`", default=""),
    Key("machine_type", value_kinds.LABEL, "its type, for the same", default=""),
    Key("date", value_kinds.DATE, "when it was balanced, for the same"),
    Key("sheet", value_kinds.table(SHEET), "the head of the balancing sheet and its polar plots, see below"),
)
CELLS = {name: key.kind.cell for keys in (JOB, PLANE, SENSOR) for key in keys for name in key.names}
CELLS["station"] = "name"
"""How a cell of each key is taken."""
