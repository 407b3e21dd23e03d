"""JobFiles on workbooks: cells of a job in sheets that rotorid has made; those of others are only shown."""

import io
import shutil
from pathlib import Path

import openpyxl
import pytest
from typer.testing import CliRunner
from workbook_jobs import as_workbook

from rotorid.cli import app
from rotorid.files.job_excel import template_bytes
from rotorid.tables import read_job
from rotorid.worksheet.job_files import Conflict, JobFiles

pytest.importorskip("tomlkit", reason="without the extra rotorid[worksheet]")

TURBO = Path(__file__).resolve().parents[3] / "sample_data" / "turbo_job"
RUNS = [
    ("first", "3000", "1", "4,5", "12"),
    ("first", "3000", "2", "6.50", "100"),
    ("trial", "3000", "1", "7", "30"),
    ("trial", "3000", "2", "8,25", "-90"),
]
COLUMNS = ("run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg")


@pytest.fixture(scope="module")
def balanced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("balanced")
    job, path = as_workbook(TURBO / "checked.toml", folder / "job.xlsx"), folder / "sheet.xlsx"
    assert CliRunner().invoke(app, ["balance", str(job), "--output", str(path)]).exit_code == 0
    return path


def insert(table, row, columns=COLUMNS):
    return {"table": table, "after": None, "cells": dict(zip(columns, row, strict=True))}


def opened(data):
    return openpyxl.load_workbook(io.BytesIO(data))


def looks(sheet):
    """What a person sees of a sheet beside its values."""
    rules = [
        (r.type, str(r.sqref), r.formula1, r.formula2, r.error) for r in sheet.data_validations.dataValidation
    ]
    widths = {k: (d.width, d.number_format) for k, d in sheet.column_dimensions.items()}
    head = [(c.coordinate, c.font.b, c.comment and c.comment.text) for c in sheet[1]]
    return rules, widths, head, sheet.freeze_panes


def test_a_template_is_filled_in_and_read(tmp_path):
    path = tmp_path / "job.xlsx"
    path.write_bytes(template_bytes())
    before = path.read_bytes()
    job = JobFiles(tmp_path)
    state = job.state()
    assert (state["kind"], state["read_only"], state["tables"]["runs"]["rows"]) == ("workbook", "", [])
    job.apply([insert("runs", row) for row in RUNS])
    job.apply([insert("weights", ("trial", "1", "2,5", "0"), ("run", "plane", "mass_g", "angle_deg"))])
    job.apply(
        [
            {"key": ["phase"], "old": "lead or lag?", "new": "lag"},
            {"key": ["angles"], "old": "which way?", "new": "with rotation"},
            {"key": ["planes", "1", "radius_mm"], "old": None, "new": 120},
            {"key": ["planes", "1", "holes_deg"], "old": None, "new": [0, 90.5]},
            {"key": ["planes", "1", "available_g"], "old": None, "new": [5, 10]},
            {"key": ["sensors", "2", "limit"], "old": None, "new": {"3000": 2}},
            {"key": ["errors", "phase_deg"], "old": None, "new": 1.5},
        ]
    )
    written = read_job(path)
    assert tuple(written.planes) == ("1",)
    assert written.radii["1"] == pytest.approx(0.12)
    assert [row["cells"][3] for row in job.state()["tables"]["runs"]["rows"]] == ["4.5", "6.50", "7", "8.25"]
    book = opened(path.read_bytes())
    assert [book["runs"].cell(2, k).value for k in range(1, 6)] == ["first", 3000, "1", 4.5, 12]
    assert book["planes"]["A2"].value == "1"
    job.apply([{"key": ["errors", "phase_deg"], "old": 1.5, "new": None}])
    for _ in range(4):
        job.undo()
    assert path.read_bytes() == before


def test_results_and_other_sheets_stay(balanced, tmp_path):
    path = tmp_path / "sheet.xlsx"
    shutil.copy(balanced, path)
    before = path.read_bytes()
    job = JobFiles(path)
    first, second, third = job.state()["tables"]["runs"]["rows"][:3]
    edits = [
        {"table": "runs", "row": first["id"], "column": "phase_deg", "old": "89", "new": "90,5"},
        {"table": "runs", "delete": second["id"], "old": second["cells"]},
    ]
    (_, _, made) = job.apply(
        [*edits, {"table": "runs", "after": third["id"], "cells": {"run": "=1", "speed_rpm": "x"}}]
    )
    found, old = opened(path.read_bytes()), opened(before)
    assert found.sheetnames == old.sheetnames
    for sheet in old:
        assert looks(found[sheet.title]) == looks(sheet)
        if sheet.title != "runs":
            assert [[c.value for c in row] for row in found[sheet.title]] == [
                [c.value for c in row] for row in sheet
            ]
    rows = job.state()["tables"]["runs"]["rows"]
    assert [row["id"] for row in rows[:3]] == [first["id"], third["id"], made]
    assert rows[2]["cells"] == ["=1", "x", "", "", ""]
    assert found["runs"]["A4"].data_type == "s"
    assert job.place(f"{path} (sheet 'runs')", 4) == ("runs", made)
    with pytest.raises(Conflict):
        job.apply([{"table": "runs", "row": first["id"], "column": "phase_deg", "old": "89", "new": "91"}])
    job.undo()
    assert path.read_bytes() == before


def test_a_check_run_gets_a_sheet(tmp_path):
    path = tmp_path / "job.xlsx"
    path.write_bytes(template_bytes())
    job = JobFiles(path)
    job.apply([{"create": "check", "header": list(COLUMNS)}, insert("check", ("c", "3000", "1", "2", "5"))])
    assert job.state()["tables"]["check"]["rows"][0]["cells"] == ["c", "3000", "1", "2", "5"]
    assert opened(path.read_bytes())["check"]["B2"].value == 3000


@pytest.mark.parametrize("change", ["creator", "formula", "picture"])
def test_workbooks_that_would_lose_something_are_only_shown(balanced, tmp_path, change):
    path = tmp_path / "sheet.xlsx"
    book = openpyxl.load_workbook(balanced)
    if change == "creator":
        book.properties.creator = "a person"
    elif change == "formula":
        book["planes"]["H9"] = "=1+1"
    else:
        from openpyxl.chart import LineChart

        book["runs"].add_chart(LineChart(), "H2")
    book.save(path)
    before = path.read_bytes()
    job = JobFiles(path)
    assert job.state()["read_only"]
    assert len(job.state()["tables"]["runs"]["rows"]) == 80
    with pytest.raises(ValueError, match="made by rotorid" if change == "creator" else "would be lost"):
        job.apply([{"key": ["phase"], "old": "lead", "new": "lag"}])
    assert path.read_bytes() == before
