"""An empty workbook to fill in at the machine: headers, explanations, allowed values, an example."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rotorid.tables.job.workbook_pages import Choice, Page, book_bytes
from rotorid.tables.job.workbook_reading import OPTIONAL
from rotorid.tables.job.workbook_sheets import Line
from rotorid.tables.runs.conventions import DEFAULT_TOLERANCE, PHASES, ROTATIONS, STATED_ANGLES, VIEWS

_POSITIVE = Choice(low=0.0, high=math.inf)
_YES_NO = Choice(("yes", "no"))


@dataclass(frozen=True)
class _Column:
    """A column of a sheet: its meaning, what may stand below it, and other names it may have."""

    name: str
    meaning: str
    allowed: str
    choice: Choice | None = None
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Key:
    """A row of the sheet settings; a value that is none of the choices is refused until somebody chooses."""

    name: str
    meaning: str
    choice: Choice
    value: str = ""


_RUNS = (
    _Column("run", "Name of the run: one start of the machine with the same weights on it.", "text"),
    _Column(
        "speed_rpm",
        "Speed. Change the name of the column for another unit.",
        "a number above 0",
        _POSITIVE,
        ("speed_rpm", "speed_Hz", "speed_rad_s"),
    ),
    _Column("sensor", "Name of the sensor. Every run needs every sensor at every speed.", "text"),
    _Column(
        "amplitude_um_pp",
        "Amplitude at the running speed (1x). The end of the name is the unit: _pp is peak to peak, _rms, "
        "neither is peak; the name amplitude alone is for readings without a known unit.",
        "a number of 0 or more",
        _POSITIVE,
        (
            "amplitude_um_pp",
            "amplitude_um",
            "amplitude_um_rms",
            "amplitude_mm_s_rms",
            "amplitude_mm_s",
            "amplitude_mil_pp",
            "amplitude_in_s",
            "amplitude_g",
            "amplitude_g_rms",
            "amplitude_m_s2",
            "amplitude",
        ),
    ),
    _Column(
        "phase_deg",
        "Phase at the running speed; the sheet settings says whether it leads or lags.",
        "a number from -360 to 360",
        Choice(),
    ),
    _Column("note", "Remarks; nobody computes with them.", "anything"),
)
_WEIGHTS = (
    _Column("run", "Name of a run of the sheet runs.", "text; a run without weights has no row here"),
    _Column("plane", "Name of the plane in which the weight was during this run.", "text"),
    _Column(
        "mass_g",
        "The weight. Change the name of the column for another unit. Every weight that is mounted during a "
        "run has a row, also one that stays in from an earlier run.",
        "a number above 0",
        _POSITIVE,
        ("mass_g", "mass_kg", "mass_mg", "mass_oz", "mass_lb", "unbalance_g_mm", "unbalance_oz_in"),
    ),
    _Column(
        "angle_deg",
        "Angle from the mark on the rotor; the sheet settings says in which direction it counts.",
        "a number from -360 to 360",
        Choice(),
    ),
    _Column("note", "Remarks.", "anything"),
)
_PLANES = (
    _Column("plane", "Name of a plane of the sheet weights.", "text; planes without settings need no row"),
    _Column(
        "radius_mm",
        "Radius of the corrections.",
        "a number above 0, or blank",
        _POSITIVE,
        ("radius_mm", "radius_m", "radius_in"),
    ),
    _Column(
        "trial_radius_mm",
        "Radius of the trial weights, where it is another.",
        "above 0, or blank",
        _POSITIVE,
        ("trial_radius_mm", "trial_radius_m", "trial_radius_in"),
    ),
    _Column(
        "max_mass_g",
        "The largest weight that may be mounted.",
        "above 0, or blank",
        _POSITIVE,
        ("max_mass_g", "max_mass_kg", "max_mass_oz", "max_unbalance_g_mm", "max_unbalance_oz_in"),
    ),
    _Column("forbidden_deg", "Angles at which nothing can be mounted.", "20 to 60; 300 to 340, or blank"),
    _Column("holes", "Number of equally spaced holes.", "a whole number, or blank", Choice(low=1, high=1000)),
    _Column("first_hole_deg", "Angle of hole number 1.", "-360 to 360, or blank (0)", Choice()),
    _Column(
        "available_g",
        "Weights of which each can be mounted in a hole.",
        "5; 10; 20, or blank",
        names=("available_g", "available_kg", "available_oz", "available_g_mm", "available_oz_in"),
    ),
    _Column(
        "per_hole", "How many weights one hole takes.", "a whole number, or blank", Choice(low=1, high=100)
    ),
    _Column("stock", "How many there are of each available weight.", "4; 4; 2, or blank"),
    _Column("taken", "Weights that are in holes already, by number of the hole.", "3: 10; 5: 20, or blank"),
    _Column("remove", "Whether material is taken away (drilled, ground) instead.", "yes or no", _YES_NO),
    _Column("use", "Whether this plane is used; no keeps it out.", "yes or no", _YES_NO),
    _Column("note", "Remarks.", "anything"),
)
_SENSORS = (
    _Column("sensor", "Name of a sensor of the sheet runs.", "text; sensors without settings need no row"),
    _Column("limit", "Largest amplitude that is allowed, in the unit of the readings.", "above 0, or blank"),
    _Column("weight", "How much this sensor counts in the fit.", "0 or more, or blank (1)", _POSITIVE),
    _Column("note", "Remarks.", "anything"),
)
_SETTINGS = (
    _Key(
        "phase",
        "Whether a positive phase leads or lags, to be chosen. Most instruments show lag: the angle that the "
        "rotor turns from the pulse to the positive peak.",
        Choice(PHASES),
        "lead or lag?",
    ),
    _Key(
        "angles",
        "How angles on the rotor count, to be chosen. Clockwise and counter-clockwise need rotation.",
        Choice(STATED_ANGLES),
        "which way?",
    ),
    _Key("rotation", "How the rotor turns, seen from the same end as the angles.", Choice(ROTATIONS)),
    _Key("view", "The end from which that is seen.", Choice(VIEWS)),
    _Key(
        "speed_tolerance_percent",
        f"Speeds of different runs that differ by less count as one. Blank: {DEFAULT_TOLERANCE:g}.",
        Choice(low=0.0, high=20.0),
    ),
    _Key("errors.amplitude_percent", "One standard deviation of an amplitude, percent of it.", _POSITIVE),
    _Key("errors.phase_deg", "One standard deviation of a phase, degrees.", _POSITIVE),
    _Key("errors.floor", "One standard deviation at amplitude 0, in the unit of the readings.", _POSITIVE),
    _Key("errors.run_percent", "What changes from run to run, one standard deviation, percent.", _POSITIVE),
    _Key("errors.run_floor", "The same at amplitude 0, in the unit of the readings.", _POSITIVE),
)
_TABLES = {"runs": _RUNS, "weights": _WEIGHTS, "planes": _PLANES, "sensors": _SENSORS}
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


def _form(title: str, columns: tuple[_Column, ...]) -> Page:
    return Page(
        title,
        [tuple(column.name for column in columns)],
        explained={column.name: f"{column.meaning} Allowed: {column.allowed}." for column in columns},
        choices={column.name: column.choice for column in columns if column.choice is not None},
        cell_choices={
            (1, place): Choice(column.names, strict=False)
            for place, column in enumerate(columns, start=1)
            if column.names
        },
    )


def _settings() -> Page:
    rows: list[Line] = [(key.name, key.value, _explained(key)) for key in _SETTINGS]
    return Page(
        "settings",
        [("key", "value", OPTIONAL), *rows],
        explained={"key": "What is set; further keys may be added.", "value": "Its value, or blank."},
        cell_choices={(row, 2): key.choice for row, key in enumerate(_SETTINGS, start=2)},
    )


def _explained(key: _Key) -> str:
    words = key.choice.texts
    return f"{key.meaning} Allowed: {_listed(words)}" if words else key.meaning


def _listed(words: tuple[str, ...]) -> str:
    return f"{', '.join(words[:-1])} or {words[-1]}"


_MORE = (
    "Further sheets that may be added: check (readings of the check run, the columns of runs) and "
    "check_weights (what was mounted then, the columns of weights; without it the proposed weights);",
    "slow_roll (columns sensor, amplitude, phase_deg, optional speed_rpm: subtracted from all readings); "
    "influence (coefficients, as --save-influence writes them).",
    "Repeated readings: a column repeat in runs (1, 2, ...). Holes with names or at any angle: holes_deg and "
    "hole_names in planes. Where the key phasor stands: key_phasor.angle_deg in settings.",
)


def _notes() -> Page:
    """All explanations in one place, and the example of Brüel & Kjær's application note 17-227."""
    columns: list[Line] = [
        (title, column.name, column.meaning, column.allowed, ", ".join(column.names))
        for title, own in _TABLES.items()
        for column in own
    ]
    keys: list[Line] = [("settings", key.name, _explained(key), "", "") for key in _SETTINGS]
    return Page(
        "notes",
        [
            *_HOW,
            (),
            ("sheet", "column or key", "meaning", "allowed values", "other names of the column"),
            *columns,
            *keys,
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
