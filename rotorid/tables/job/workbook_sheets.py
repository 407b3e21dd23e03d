"""A job as sheets of a workbook: numbers as numbers, everything else as it is written.

Nothing is converted: amplitudes, phases and angles are those of the tables, units stay in the names of the
columns, so that reading the sheets computes what reading the files computed, to the last digit.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.tables.job.job_keys import CELLS, FORBIDDEN, TABLES
from rotorid.tables.reader.columns import REMARKS
from rotorid.tables.reader.decimal_numbers import decimal_comma, parse_number
from rotorid.tables.reader.excel_pages import Line
from rotorid.tables.reader.grid import Cell, Grid, Row, Shown, show

if TYPE_CHECKING:
    from rotorid.tables.job.job_as_written import JobTables

TEXT_COLUMNS = ("run", "sensor", "plane", "repeat", "key")
"""Columns of names, in which `1` is text."""
NAMES = {*TEXT_COLUMNS, *(name for name, cell in CELLS.items() if cell in ("name", "words", "date"))}
"""Those, and settings that a spreadsheet would take for a date."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def job_sheets(
    job: JobTables, target: Path, planes: Sequence[str], sensors: Sequence[str]
) -> dict[str, list[Line]]:
    """All sheets of a job, by name, in the order of a workbook.

    Parameters
    ----------
    job
        As it is written.
    target
        The workbook, from which the file of the rotor is named.
    planes, sensors
        Names: each gets a row in its sheet, also where nothing is said about it.

    Raises
    ------
    ValueError
        If the file of the rotor cannot be named from where the workbook is.
    """
    sheets = {name: table_lines(job.tables[name]) for name in TABLES[:2] if name in job.tables}
    for table, key, names in (("planes", "plane", planes), ("sensors", "sensor", sensors)):
        lines = _named(job, table, key, names)
        sheets[table] = [*_comments(job.written.comments.get(table, ())), *lines]
    settings = {k: v for k, v in job.written.settings.items() if k not in ("planes", "sensors")}
    if job.rotor is not None:
        settings["rotor"] = relative(job.rotor, target)
    above = _comments((*job.written.comments.get("settings", ()), *_other_remarks(job, settings)))
    sheets["settings"] = [*above, *_settings(job, settings)]
    sheets |= {name: table_lines(job.tables[name]) for name in TABLES[2:] if name in job.tables}
    return sheets | {title: _padded(rows) for title, rows in job.written.notes.items()}


def relative(file: Path, target: Path) -> str:
    """The name of a file as seen from the folder of another, with `/`.

    Raises
    ------
    ValueError
        If there is no such name.
    """
    try:
        return Path(os.path.relpath(file.resolve(), target.parent.resolve())).as_posix()
    except ValueError:
        raise ValueError(
            f"{target}: the job's rotor is {file}, on another drive than the workbook, which could not find "
            "it again: write the workbook on the drive of the rotor"
        ) from None


def table_lines(grid: Grid) -> list[Line]:
    """A table: comment lines, names of the columns, rows with numbers as numbers."""
    texts = [name in TEXT_COLUMNS or not name or name.casefold().startswith(REMARKS) for name in grid.header]
    numeric = [i for i, text in enumerate(texts) if not text]
    written = (cells[i] for _, cells in grid.rows for i in numeric)
    commas = (cell for cell in written if isinstance(cell, str) and "," in cell)
    comma = decimal_comma(commas, grid.separator)
    lines: list[Line] = [*_comments(grid.comments), grid.header]
    for _, cells in grid.rows:
        lines.append(
            tuple(
                show(cell) if text else number_cell(cell, grid.separator, comma=comma)
                for cell, text in zip(cells, texts, strict=True)
            )
        )
    return lines


def number_cell(cell: Cell, separator: str, *, comma: bool) -> Cell:
    """A number with the digits in which it is written; NotANumber for a text that is none."""
    if not isinstance(cell, str) or not cell:
        return cell
    value = parse_number(cell, comma=comma, separator=separator)
    text = cell.replace(",", ".").rstrip(".")
    if text != show(value) and (value or "e" not in text.lower()):
        return Shown(value, text)  # 12.50 keeps its digits
    whole = value.is_integer() and abs(value) < 1e15 and (value != 0 or math.copysign(1.0, value) > 0)
    return int(value) if whole else value


def _comments(comments: Iterable[str]) -> list[Line]:
    return [(f"# {comment}",) for comment in comments]


def _padded(rows: Sequence[Row]) -> list[Line]:
    """Rows at the places where they stood."""
    lines: list[Line] = []
    for number, cells in rows:
        lines += [()] * (number - 1 - len(lines))
        lines.append(tuple(cells))
    return lines


def _named(job: JobTables, table: str, key: str, names: Sequence[str]) -> list[Line]:
    """Rows of one plane or sensor each: what is said about it, by columns, and remarks."""
    said: Mapping[str, Mapping[str, Any]] = job.written.settings.get(table, {})
    items = [*said, *(name for name in names if name not in said)]
    columns = list(dict.fromkeys(column for section in said.values() for column in section))
    notes = [job.written.remarks.get((table, item), {}) for item in items]
    remarks = list(dict.fromkeys(column for note in notes for column in note))
    # A first cell that begins with # would make its row a comment.
    first = ("note",) if any(item.startswith("#") for item in items) else ()
    lines: list[Line] = [(*first, key, *columns, *remarks)]
    for item, note in zip(items, notes, strict=True):
        section = said.get(item, {})
        cells = [setting_cell(column, section[column]) if column in section else "" for column in columns]
        lines.append((*("" for _ in first), item, *cells, *(note.get(column, "") for column in remarks)))
    return lines


def _settings(job: JobTables, settings: Mapping[str, Any]) -> list[Line]:
    """Rows of key and value."""
    rows = list(_flat(settings, ()))
    notes = [job.written.remarks.get(("settings", ".".join(parts)), {}) for parts, _ in rows]
    remarks = list(dict.fromkeys(column for note in notes for column in note))
    lines: list[Line] = [("key", "value", *remarks)]
    for (parts, value), note in zip(rows, notes, strict=True):
        lines.append((dotted_key(parts), _setting(value), *(note.get(column, "") for column in remarks)))
    return lines


def _other_remarks(job: JobTables, settings: Mapping[str, Any]) -> Iterable[str]:
    """Remarks on settings that no longer stand in the sheet settings: planes, sensors, tables."""
    here = {".".join(parts) for parts, _ in _flat(settings, ())}
    for (sheet, key), note in job.written.remarks.items():
        if sheet == "settings" and key not in here:
            yield f"{key}: {'; '.join(show(cell) for cell in note.values())}"


def _flat(settings: Mapping[str, Any], above: tuple[str, ...]) -> Iterable[tuple[tuple[str, ...], Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping) and (above or key != "speed_weights"):
            yield from _flat(value, (*above, key))
        else:
            yield (*above, key), value


def dotted_key(parts: Sequence[str]) -> str:
    """A dotted key; where a part could be misread, parts stand in quotes, as in a job file."""
    if all(part and part == part.strip() and not re.search(r"[.\"'\\#]", part) for part in parts):
        return ".".join(parts)
    return ".".join(part if _BARE.fullmatch(part) else json.dumps(part, ensure_ascii=False) for part in parts)


def setting_cell(column: str, value: Any) -> Cell:  # noqa: ANN401
    """A value about a plane or sensor; one pair of angles may stand without a list around it."""
    alone = FORBIDDEN.accepts(column) and isinstance(value, list) and not isinstance(value[0], list)
    return _setting([value] if alone else value)


def _setting(value: Any) -> Cell:  # noqa: ANN401  whatever a job file holds
    """A value of a job file as one cell."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float, str)):
        return value
    if isinstance(value, Mapping):
        return "; ".join(f"{name}: {_text(entry)}" for name, entry in value.items())
    if not isinstance(value, list):
        return str(value)
    if any(isinstance(entry, list) for entry in value):
        return "; ".join(_pair(entry) for entry in value)
    if len(value) == 1 and not isinstance(value[0], bool):
        return value[0] if isinstance(value[0], (int, float, str)) else str(value[0])
    return "; ".join(_text(entry) for entry in value)


def _pair(pair: Sequence[float]) -> str:
    return " to ".join(_plain(end) for end in pair)


def _text(entry: object) -> str:
    return repr(entry) if isinstance(entry, (int, float)) else str(entry)


def _plain(number: float) -> str:
    """A number without an exponent."""
    return format(Decimal(repr(number)), "f")
