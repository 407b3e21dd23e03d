"""Jobs that together say all that a job can say, and whether two jobs say the same: for workbooks."""

from __future__ import annotations

import csv
import dataclasses
import datetime
import io
import json
import re
import tomllib
import zipfile
from collections.abc import Mapping

import numpy as np
import openpyxl
from tables_data import RUNS

from rotorid.files.cells import Shown
from rotorid.files.job_excel import template_bytes
from rotorid.files.job_keys import TABLES
from rotorid.files.settings import Settings

SAMPLES = (
    "turbo_job/job",
    "turbo_job/checked",
    "turbo_job/holes",
    "bk_two_plane/job",
    "left_in/job",
    "left_in/unknown",
    "index/machine",
    "rk4/job",
    "model_job/job",
)
CHECK = [RUNS[0], *[["check", 1000, s, a, p] for s, a, p in (("A", 0.3, 17), ("B", 0.7, 301.5))]]
SLOW = [RUNS[0], *[["slow", 200, s, a, p] for s, a, p in (("A", 0.35, 40), ("B", 0.1, 355))]]
HEAD = 'runs = "runs.csv"\nweights = "weights.csv"\n'
PARTS = {
    "conventions": 'phase = "lag"\nangles = "clockwise"\nrotation = "counter-clockwise"\nview = "free end"\n',
    "tolerance and errors": (
        "speed_tolerance_percent = 0.7\n[errors]\namplitude_percent = 1.5\nphase_deg = 0.3\nfloor = 1e-3\n"
    ),
    "limits": (
        'angles = "against rotation"\n'
        "[planes.1]\nmax_mass_oz = 0.7\nforbidden_deg = [[-30.5, 20], [300, 340]]\n"
        "[planes.2]\nmax_mass_g = 3\nuse = false\nforbidden_deg = [[1e-5, 7]]\n"
        '[sensors.A]\nlimit = { "1000" = 4.5 }\nweight = 2\n[sensors.B]\nlimit = 6\n'
    ),
    "machine": 'machine = "007"\nmachine_type = "fan-132"\ndate = 2026-03-17\n',
    "sheet": '[sheet]\nplace = "hall 3"\nengineer = "N. N."\nzero = "top"\n',
    "weights of speeds": 'speed_weights = { "1000" = 0.5 }\n',
    "holes": (
        "[planes.1]\nholes_deg = [-30, 0, 7.25]\nhole_names = ['A', '2', 'C 3']\navailable_g = [5, 2.5]\n"
        "per_hole = 2\nstock = [4, 1]\ntaken = { A = 2.5, '2' = 5 }\n"
        "[planes.2]\nholes = 12\nfirst_hole_deg = 15\nstep_g = 0.1\nremove = true\nmax_mass_kg = 0.02\n"
    ),
    "one hole, one piece": (
        "[planes.2]\nholes_deg = [7.5]\nhole_names = ['7']\navailable_g = [5]\nstock = [3]\n"
    ),
    "radii": (
        "[planes.1]\nradius_mm = 120\ntrial_radius_in = 3.3\nmax_unbalance_g_mm = 700\n"
        "[planes.2]\nradius_m = 0.1\n"
    ),
    "slow-roll file": 'slow_roll = "slow.csv"\n[errors]\namplitude_percent = 2\n',
    "check run": 'check = "check.csv"\n',
    "check run with nothing mounted": 'check = "check.csv"\ncheck_weights = "check_weights.csv"\n',
    "stored coefficients": 'influence = "influence.csv"\nphase = "lag"\n',
    "model": (
        'rotor = "rotor.csv"\n[key_phasor]\nangle_deg = 30\n'
        "[planes.1]\nnode = 2\n[sensors.A]\nnode = 1\nangle_deg = 45\n"
    ),
}
ROTOR = [
    ["length_m", "diameter_m", "support_stiffness_N_per_m"],
    [0.3, 0.05, 1e7],
    [0.3, 0.05, 0],
    [0, 0.05, 1e7],
]
_NOT_SAID = ("files", "warnings")
"""Where something was read from, and what was said about it."""
_ROUNDED = ("limits", "holes")
"""May have been converted by the command line, whose limits have units of their own."""
_ROUNDING = 4e-16


def differences(a, b):
    """Names of what is not the same in two jobs, such as `trials.readings`, first things first.

    Numbers are the same to the last digit, limits (which the command line may have converted) within
    4e-16 of their size.
    """
    return tuple(_unlike(a, b, ""))


def _parts(value):
    """Kind, form of the names and parts of what has parts."""
    if dataclasses.is_dataclass(value):
        names = (field.name for field in dataclasses.fields(value) if field.name not in _NOT_SAID)
        return type(value), ".{}", {name: getattr(value, name) for name in names}
    if isinstance(value, Settings):
        return Mapping, ".{}", {key: part for key, part in value if key not in TABLES}
    if isinstance(value, Mapping):
        return Mapping, ".{}", dict(value)
    if isinstance(value, (tuple, list)):
        return list, "[{}]", dict(enumerate(value, start=1))
    return None


def _unlike(a, b, name):
    mine, other = _parts(a), _parts(b)
    if mine and other and mine[0] is other[0]:
        _, form, parts = mine
        if list(parts) != list(other[2]):
            yield name
            return
        for key, part in parts.items():
            yield from _unlike(part, other[2][key], (name + form.format(key)).removeprefix("."))
    elif isinstance(a, (np.ndarray, float)) and isinstance(b, (np.ndarray, float)):
        rounding = _ROUNDING if name.startswith(_ROUNDED) else 0.0
        if np.shape(a) != np.shape(b) or not np.allclose(a, b, rtol=rounding, atol=0.0, equal_nan=True):
            yield name
    elif isinstance(a, np.ndarray) or isinstance(b, np.ndarray) or a != b:
        yield name


def filled(path, **sheets):
    """The form with rows written into its sheets, below the header; phase and angles are chosen."""
    book = openpyxl.load_workbook(io.BytesIO(template_bytes()))
    keys = [cell.value for cell in book["settings"]["A"]]
    for key, value in (("phase", "lead"), ("angles", "with rotation")):
        book["settings"].cell(keys.index(key) + 1, 2).value = value
    for name, rows in sheets.items():
        sheet = book[name]
        header = [cell.value for cell in sheet[1]]
        for number, row in enumerate(rows, start=2):
            for column, value in row.items():
                sheet.cell(number, header.index(column) + 1).value = value
    book.save(path)
    return path


def rows(table, **renamed):
    """Rows of a table by column."""
    names = [renamed.get(name, name) for name in table[0]]
    return [dict(zip(names, row, strict=True)) for row in table[1:]]


def as_workbook(job, target):
    """A job file with its tables as the workbook that says the same, with numbers as numbers."""
    data = tomllib.loads(job.read_text(encoding="utf-8"))
    book = openpyxl.Workbook()
    book.remove(book.active)
    book.properties.creator = "rotorid"
    for key in TABLES:
        if isinstance(data.get(key), str):
            _append(book.create_sheet(key), _cells(job.parent / data.pop(key)))
    for sheet, key in (("planes", "plane"), ("sensors", "sensor")):
        named = data.pop(sheet, {})
        columns = list(dict.fromkeys(column for own in named.values() for column in own))
        lines = [[_cell(own.get(column)) for column in columns] for own in named.values()]
        rows = [[name, *line] for name, line in zip(named, lines, strict=True)]
        _append(book.create_sheet(sheet), [[key, *columns], *rows])
    settings = [[".".join(parts), _cell(value)] for parts, value in _flat(data, ())]
    _append(book.create_sheet("settings"), [["key", "value"], *settings])
    book.save(target)
    return target


def _append(sheet, lines):
    for number, line in enumerate(lines, start=1):
        for place, value in enumerate(line, start=1):
            if value not in ("", None):
                cell = sheet.cell(number, place)
                cell.value = value
                if isinstance(value, float):
                    cell.value, cell.data_type = repr(float(value)), "n"  # all digits
                if isinstance(value, Shown) and re.fullmatch(r"-?[0-9]+[.][0-9]+", value.text):
                    cell.number_format = "0." + "0" * len(value.text.partition(".")[2])


def _cells(path):
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    comments = [[line] for line in lines if line.startswith("#")]
    header, *rows = csv.reader(line for line in lines if line and not line.startswith("#"))
    texts = [name in ("run", "sensor", "plane", "repeat") for name in header]
    numbers = (
        [cell if text else _number(cell) for cell, text in zip(row, texts, strict=False)] for row in rows
    )
    return [*comments, header, *numbers]


def _number(cell):
    try:
        return Shown(float(cell), cell)
    except ValueError:
        return cell


def _flat(data, above):
    for key, value in data.items():
        part = json.dumps(key) if set(key) & set(".\"'#") else key
        if isinstance(value, dict) and (above or key != "speed_weights"):
            yield from _flat(value, (*above, part))
        else:
            yield (*above, part), value


def _cell(value):
    """A value of a job file as a cell holds it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return "; ".join(f"{key}: {entry}" for key, entry in value.items())
    if isinstance(value, list) and isinstance(value[0], list):
        return "; ".join(f"{first:f} to {last:f}" for first, last in value)
    if isinstance(value, list):
        return "; ".join(map(str, value))
    return str(value) if isinstance(value, datetime.date) else value


def with_stored_values(path, values):
    """The workbook with values stored in its formulas, in order, as Excel stores them."""
    with zipfile.ZipFile(path) as book:
        parts = {name: book.read(name) for name in book.namelist()}
    left = iter(values)
    for name in (name for name in parts if name.startswith("xl/worksheets")):
        parts[name] = re.sub(
            rb"</f><v ?/?>(</v>)?", lambda _: f"</f><v>{next(left)}</v>".encode(), parts[name]
        )
    with zipfile.ZipFile(path, "w") as book:
        for name, data in parts.items():
            book.writestr(name, data)
    assert next(left, None) is None
    return path
