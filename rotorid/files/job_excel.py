"""Jobs as workbooks: those that people fill in, and those with results."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rotorid.base.choices import did_you_mean
from rotorid.base.json import cell as as_json
from rotorid.base.tables import Column, Table, Value, excel
from rotorid.base.text import listing
from rotorid.files.cells import BadCell, Cell, Grid, header_place, make_grid, show
from rotorid.files.columns import REMARKS
from rotorid.files.disk import file_content, is_workbook
from rotorid.files.excel_workbook import read_workbook
from rotorid.files.headings import find_header
from rotorid.files.input_problems import InputError, Problems, refusal
from rotorid.files.job_keys import READINGS, TABLES, WEIGHT_TABLES, WrittenJob
from rotorid.files.settings import Place

NAMED = {"planes": "plane", "sensors": "sensor"}
"""Sheets with a row for each plane or sensor, keys being columns: the column of its name."""
RESULTS = "results"
"""Sheets whose names begin so hold what a command has computed: they are not read."""
SHEETS = (*TABLES, *NAMED, "settings", RESULTS)


def job_in_sheets(path: Path, problems: Problems) -> WrittenJob:
    """The job in the sheets of a workbook (`.xlsx`); raises `InputError` where there are no runs."""
    if not is_workbook(path):
        expected = "a job: a .toml file, or an .xlsx workbook with sheets runs and weights"
        raise refusal(path, expected)
    sheets = read_workbook(path, problems)
    job = WrittenJob(path)
    titles = {title.strip().casefold(): title for title in reversed([*sheets]) if sheets[title]}
    for name, title in titles.items() if titles.keys() & {*SHEETS} else ():
        if name not in SHEETS and not name.startswith((RESULTS, *REMARKS)):
            expected = (
                f"a known sheet{did_you_mean(name, SHEETS)}; known are {listing(SHEETS, 'and')}, remarks go "
                "into 'notes' (hidden sheets count too)"
            )
            problems.add(expected, path, None, None, title)
    for name in (name for name in SHEETS[:-1] if name in titles):
        rows = sheets[titles[name]]
        find = (
            partial(find_header, weights=name in WEIGHT_TABLES)
            if name in (*READINGS, *WEIGHT_TABLES)
            else None
        )
        may_be_empty = name in WEIGHT_TABLES or name not in TABLES
        source, place = f"{path} (sheet {titles[name]!r})", header_place(rows, find)
        try:
            grid = make_grid(source, rows, "", problems, place=place, may_be_empty=may_be_empty)
        except InputError as error:
            problems.extend(error.problems)
            continue
        if name in TABLES:
            job.tables[name] = grid
        else:
            _read_rows(grid, name, job, problems)
    if "runs" not in titles:
        shown = listing((repr(title) for title in sheets), "and")
        problems.add(f"a sheet 'runs' with readings; the sheets are {shown}", path)
    if "runs" not in job.tables:
        problems.stop()
    return job


def _read_rows(grid: Grid, sheet: str, job: WrittenJob, problems: Problems) -> None:
    """Rows of a setting each, or of a plane or sensor with settings as columns; a blank cell states nothing.

    A dotted key stands for a table (`errors.phase_deg`).
    """
    named, first = sheet in NAMED, NAMED.get(sheet, "key")
    heads = [name if named else name.casefold() for name in grid.header]
    at = heads.index(first) if first in heads else None
    remarks = ("", first, *(name for name in heads if name.casefold().startswith(REMARKS)))
    columns = {i: name for i, name in enumerate(heads) if name not in remarks}
    if at is None or not (named or [*columns.values()] == ["value"]):
        there = listing(filter(None, grid.header), "and")
        expected = f"a column {first}; the columns are {there}" if named else "the columns key and value"
        problems.add(expected, grid.source, grid.header_row, first)
        return
    for row, *cells in zip(grid.numbers, *grid.columns, strict=True):
        key, place = show(cells[at]), (grid.source, row, grid.header[at])
        parts = [sheet, key] if named else _key_parts(key)
        again = job.where.get(".".join(parts))
        if isinstance(cells[at], BadCell) or not key or again:
            expected = f"each {first} once (row {again[1]} has it too)" if again else f"the name of a {first}"
            problems.add(getattr(cells[at], "expected", expected), *place, key)
            continue
        if named:
            _put(job, parts, {}, place)
        for i, column in columns.items():
            inner, where = ([*parts, column] if named else parts), (grid.source, row, grid.header[i])
            value = _value(inner[-1], cells[i])
            if isinstance(value, BadCell):
                problems.add(value.expected, *where, value.value)
            elif value != "" and not _put(job, inner, value, where):
                expected = f"no parts of {'.'.join(parts[:-1])}, which has a value of its own"
                problems.add(expected, *place, key)


def _value(key: str, cell: Cell) -> Cell | bool:
    """A cell as a job file has it: a logical one as that, a date as its text."""
    if not isinstance(cell, BadCell):
        return cell
    if cell.value in ("TRUE", "FALSE"):
        return cell.value == "TRUE"
    return cell.value.partition(" ")[0] if key == "date" else cell


def _key_parts(key: str) -> list[str]:
    """Parts of a dotted key; as in a job file, one in quotes may hold points itself."""
    parts = re.findall(r'"((?:[^"\\]|\\.)*)"|([^.]+)', key)
    return [re.sub(r"\\(.)", r"\1", quoted) or plain for quoted, plain in parts]


def _put(job: WrittenJob, parts: Sequence[str], value: object, place: Place) -> bool:
    """Store a value under its dotted key; false where a part of the key holds a value already."""
    inner = job.settings
    for depth, part in enumerate(parts[:-1], start=1):
        job.where.setdefault(".".join(parts[:depth]), place)
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            return False
    job.where[".".join(parts)], inner[parts[-1]] = place, value
    return True


def template_bytes() -> bytes:
    """An empty workbook for a balancing job.

    Returns
    -------
    bytes
        Sheets runs, weights, planes, sensors and settings to fill in, with comments on their headers and
        lists of allowed values; a sheet notes with all explanations and an example.
    """
    return Path(__file__).with_name("template.xlsx").read_bytes()


def job_workbook_bytes(files: Sequence[Path], results: Any, provenance: Mapping[str, Any]) -> bytes:  # noqa: ANN401
    """A workbook with the results of a job, for reading; its sheets of results are not read back.

    Parameters
    ----------
    files
        What the job was read from: of a workbook all sheets but those of older results are kept, with their
        formats and formulas, without pictures and charts.
    results
        What `rotorid balance` has found: its `influence`, and `to_dict`, the document of `--json`.
    provenance
        Program version, input files, date and options.

    Raises
    ------
    InputError
        If the workbook of the job cannot be read any more.
    """
    from rotorid.files.influence import influence_table

    document = results.to_dict()
    tables = {"": document["corrections"], "summary": []}
    _collect({**document, "provenance": provenance}, (), tables)
    del tables["corrections"]
    tables["influence"] = influence_table(results.influence).records
    warned = "".join(f"\nwarning: {text}" for text in document.get("warnings", ()))
    book = _job_book(files[0]) if len(files) == 1 and is_workbook(files[0]) else None
    return excel(*(_table(name, rows, "" if name else warned) for name, rows in tables.items()), book=book)


def _job_book(path: Path) -> Any:  # noqa: ANN401  openpyxl has no types
    """The workbook of a job without its results."""
    import openpyxl

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about parts that are not kept
        book = openpyxl.load_workbook(io.BytesIO(file_content(path)))
    for sheet in book.worksheets:
        if sheet.title.strip().casefold().startswith(RESULTS):
            book.remove(sheet)
    return book


def _table(name: str, rows: Sequence[Mapping[str, Any]], more: str) -> Table:
    """Of lists, such as covariances, a sheet has nothing: they are left to `--json`."""
    columns = (
        Column(head, [_cell(row.get(head)) for row in rows])
        for head, value in rows[0].items()
        if not isinstance(value, (list, Mapping))
    )
    note = f"computed from the other sheets; not read back{more}"
    return Table(f"{RESULTS} {name}".strip(), tuple(columns), note)


def _collect(document: Mapping[str, Any], above: tuple[str, ...], tables: dict[str, list[Any]]) -> None:
    """The tables of a document by their names; single values and lists of words go to the summary."""
    for key, value in document.items():
        name, values = (*above, key), value if isinstance(value, list) else [value]
        if isinstance(value, Mapping):
            _collect(value, name, tables)
        elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
            tables[" ".join(name).replace("_", " ")] = value
        else:
            tables["summary"] += [{"result": ".".join(name), "value": v} for v in values if v is not None]


def _cell(value: Any) -> Value:  # noqa: ANN401  what a table or a document holds
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value) if isinstance(value, (list, Mapping)) else as_json(value)
