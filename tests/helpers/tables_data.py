"""One small job, written in the ways that people and spreadsheets write tables."""

from __future__ import annotations

import datetime
import warnings
from pathlib import Path

import openpyxl
import pytest

from rotorid.files import InputError, TableWarning

RUNS = [
    ["run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"],
    ["initial", 1000, "A", 7.2, 238],
    ["initial", 1000, "B", 13.5, 296],
    ["trial 1", 1000, "A", 4.9, 114],
    ["trial 1", 1000, "B", 9.2, 347],
    ["trial 2", 1000, "A", 4.0, 79],
    ["trial 2", 1000, "B", 12.0, 292],
]
WEIGHTS = [
    ["run", "plane", "mass_g", "angle_deg"],
    ["trial 1", "1", 2.5, 0],
    ["trial 2", "2", 2.5, 0],
]
DATE = datetime.datetime(2024, 5, 1)


def replaced(table, row, column, value):
    """The table with one cell changed; row as a spreadsheet counts, column by name."""
    copy = [list(line) for line in table]
    copy[row - 1][table[0].index(column)] = value
    return copy


def csv_text(table, separator=",", comma=False):
    def cell(value):
        text = value if isinstance(value, str) else repr(value)
        if comma and not isinstance(value, str):
            text = text.replace(".", ",")
        return f'"{text}"' if separator in text or '"' in text else text

    return "".join(separator.join(map(cell, line)) + "\n" for line in table)


def write_csv(path, table):
    path.write_text(csv_text(table), encoding="utf-8")
    return path


def write_book(path, sheets):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, table in sheets.items():
        sheet = book.create_sheet(name)
        for line in table:
            sheet.append(line)
    book.save(path)
    return path


def complaints(function, *arguments, **options):
    """The problems that a reader finds; warnings about encodings do not matter here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TableWarning)
        with pytest.raises(InputError) as caught:
            function(*arguments, **options)
    lines = str(caught.value).splitlines()
    if len(caught.value.problems) <= 3:
        assert lines == [str(problem) for problem in caught.value.problems]
    assert len(lines) <= 21
    return caught.value.problems


def the_only(problems, file, row, column, value, words):
    """Check the one problem in full."""
    assert len(problems) == 1, [str(p) for p in problems]
    problem = problems[0]
    assert Path(problem.file.split(" (sheet")[0]).name == file
    assert (problem.row, problem.column, problem.value) == (row, column, value)
    assert words in problem.expected, problem.expected
    return problem
