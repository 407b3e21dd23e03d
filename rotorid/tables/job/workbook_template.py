"""Template: an empty Excel workbook to fill in at the machine, with headers, explanations, allowed values."""

from __future__ import annotations

import math
from dataclasses import replace

from rotorid.base.text import sentence
from rotorid.tables.job.job_from_excel import OPTIONAL
from rotorid.tables.job.job_keys import ERRORS, JOB, PLANE, SENSOR
from rotorid.tables.job.workbook_sheets import NAMES
from rotorid.tables.reader import units, value_kinds
from rotorid.tables.reader.excel_pages import Choice, Line, Page, book_bytes
from rotorid.tables.reader.settings_keys import Key, Kind

_NOTE = Key("note", Kind(value_kinds.TEXT.read, allowed="anything"), "remarks; nobody computes with them")
_RARE = ("holes_deg", "hole_names", "step_g", "node", "angle_deg")
"""Keys of planes and sensors for which the form has no column; one may be added."""
_RUN = Key("run", value_kinds.TEXT, "name of the run: one start of the machine with the same weights on it")
_TABLES = {
    "runs": (
        _RUN,
        Key("speed_rpm", value_kinds.ABOVE_ZERO, "speed", units.SPEED),
        Key("sensor", value_kinds.TEXT, "name of the sensor; every run needs every sensor at every speed"),
        Key(
            "amplitude_um_pp amplitude_mm_s_rms amplitude_g_rms amplitude",
            value_kinds.number(0.0),
            "amplitude at the running speed (1x): the end of the name is the unit, _pp is peak to peak, _rms "
            "root mean square, neither is peak; the name amplitude alone is for readings without a unit",
            units.VIBRATION,
        ),
        Key("phase_deg", value_kinds.TURN, "phase; the sheet settings says whether it leads or lags"),
        _NOTE,
    ),
    "weights": (
        _RUN,
        Key("plane", value_kinds.TEXT, "name of the plane in which the weight was during this run"),
        Key(
            "mass_g unbalance_g_mm",
            value_kinds.ABOVE_ZERO,
            "the weight; every weight that is mounted during a run has a row, also one that stays in from an "
            "earlier run, and a run without weights has none",
            units.WEIGHT,
        ),
        Key(
            "angle_deg",
            value_kinds.TURN,
            "angle from the mark on the rotor; the sheet settings says in which direction it counts",
        ),
        _NOTE,
    ),
    "planes": (
        Key(
            "plane",
            value_kinds.TEXT,
            "name of a plane of the sheet weights; without settings it needs no row",
        ),
        *(key for key in PLANE if key.names[0] not in _RARE),
        _NOTE,
    ),
    "sensors": (
        Key(
            "sensor", value_kinds.TEXT, "name of a sensor of the sheet runs; without settings it needs no row"
        ),
        *(key for key in SENSOR if key.names[0] not in _RARE),
        _NOTE,
    ),
}
_SETTINGS = (
    *(key for key in JOB if "enum" in key.kind.schema or key.name == "speed_tolerance_percent"),
    *(replace(key, name=f"errors.{key.name}") for key in ERRORS),
)
_TO_CHOOSE = {"phase": "lead or lag?", "angles": "which way?"}
"""Values that are none of the choices are refused until somebody chooses."""
_COMMON = (
    *("rpm", "Hz", "rad_s", "mm", "m", "in", "g", "kg", "mg", "oz", "lb", "g_mm", "oz_in"),
    *("um_pp", "um", "um_rms", "mm_s_rms", "mm_s", "mil_pp", "in_s", "g_rms", "m_s2"),
)
"""Units that the lists of names in the headers offer."""
_HOW: tuple[Line, ...] = (
    ("How to fill in this workbook",),
    ("1. Sheet runs: one row per run, speed and sensor; the first run without any trial weight.",),
    ("2. Sheet weights: what was mounted in which plane during which run.",),
    ("3. Sheet settings: choose phase and angles as your instrument and your rotor count them.",),
    ("4. Sheets planes and sensors: limits, holes and radii, where there are any; they may stay empty.",),
    ("5. rotorid balance job.xlsx   (--output sheet.xlsx: the same workbook with results)",),
    ("The units are in the names of the columns: choose another name from the list of the header's cell.",),
    ("Names stay text (1 is a name). Type numbers with the decimal sign of your spreadsheet program:",),
    ("where it makes a date of 1.5, it expects a comma.",),
    ("This sheet is not read.",),
)
_EXAMPLE_RUNS: tuple[Line, ...] = (
    ("run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"),
    ("initial", 3000, "1", 7.2, 238),
    ("initial", 3000, "2", 13.5, 296),
    ("trial in plane 1", 3000, "1", 4.9, 114),
    ("trial in plane 1", 3000, "2", 9.2, 347),
    ("trial in plane 2", 3000, "1", 4.0, 79),
    ("trial in plane 2", 3000, "2", 12.0, 292),
)
_EXAMPLE_WEIGHTS: tuple[Line, ...] = (
    ("run", "plane", "mass_g", "angle_deg"),
    ("trial in plane 1", "1", 2.5, 0),
    ("trial in plane 2", "2", 2.5, 0),
)


def template_bytes() -> bytes:
    """An empty workbook for a balancing job.

    Returns
    -------
    bytes
        Sheets runs, weights, planes, sensors and settings to fill in, with comments on their headers and
        lists of allowed values; a sheet notes with all explanations and an example.
    """
    pages = [_form(title, columns) for title, columns in _TABLES.items()]
    return book_bytes([*pages, _settings(), _notes()], "runs")


def _form(title: str, keys: tuple[Key, ...]) -> Page:
    names = [key.names[0] for key in keys]
    return Page(
        title,
        [tuple(names)],
        names=NAMES,
        explained={name: f"{_about(key)} {_allowed(key)}" for name, key in zip(names, keys, strict=True)},
        choices={name: found for name, key in zip(names, keys, strict=True) if (found := _choice(key))},
        cell_choices={
            (1, place): Choice(_names(key), strict=False)
            for place, key in enumerate(keys, start=1)
            if key.units is not None
        },
    )


def _names(key: Key) -> tuple[str, ...]:
    """Common names of a column, in its units."""
    return tuple(name for name, unit in key.variants.items() if unit is None or unit.name in _COMMON)


def _choice(key: Key) -> Choice | None:
    """What a cell may hold, of the schema of its key."""
    schema = key.kind.schema
    if "enum" in schema:
        return Choice(tuple(schema["enum"]))
    if schema.get("type") == "boolean":
        return Choice(("yes", "no"))
    if schema.get("type") not in ("number", "integer"):
        return None
    return Choice(low=schema.get("minimum", 0.0), high=schema.get("maximum", math.inf))


def _about(key: Key) -> str:
    return sentence(key.about.replace("`", ""))


def _allowed(key: Key) -> str:
    return f"Allowed: {key.kind.allowed}."


def _settings() -> Page:
    rows: list[Line] = [
        (key.name, _TO_CHOOSE.get(key.name, ""), f"{_about(key)} {_allowed(key)}") for key in _SETTINGS
    ]
    found = {(row, 2): _choice(key) for row, key in enumerate(_SETTINGS, start=2)}
    return Page(
        "settings",
        [("key", "value", OPTIONAL), *rows],
        names=NAMES,
        explained={"key": "What is set; further keys may be added.", "value": "Its value, or blank."},
        cell_choices={place: choice for place, choice in found.items() if choice is not None},
    )


_MORE = (
    "Further sheets that may be added: check (readings of the check run, the columns of runs) and "
    "check_weights (what was mounted then, the columns of weights; without it the pieces of --split "
    "where there are holes, else the proposed weights);",
    "slow_roll (columns sensor, amplitude, phase_deg, optional speed_rpm: subtracted from all readings); "
    "influence (coefficients, as --save-influence writes them).",
    "Repeated readings: a column repeat in runs (1, 2, ...). Holes with names or at any angle: holes_deg and "
    "hole_names in planes. Where the key phasor stands: key_phasor.angle_deg in settings.",
)


def _notes() -> Page:
    """All explanations in one place, and the example of Brüel & Kjær's application note 17-227."""
    tables = {**_TABLES, "settings": _SETTINGS}
    rows: list[Line] = [
        (title, key.names[0], _about(key), key.kind.allowed, ", ".join(_names(key)))
        for title, keys in tables.items()
        for key in keys
    ]
    return Page(
        "notes",
        [
            *_HOW,
            (),
            ("sheet", "column or key", "meaning", "allowed values", "other names of the column"),
            *rows,
            (),
            *((words,) for words in _MORE),
            (),
            ("Example, sheet runs: corrections are 2.95 g at 50.2° in plane 1 and 2.84 g at 278.1° in 2",),
            *_EXAMPLE_RUNS,
            (),
            ("Example, sheet weights",),
            *_EXAMPLE_WEIGHTS,
        ],
    )
