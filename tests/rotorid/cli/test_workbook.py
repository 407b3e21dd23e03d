"""`rotorid balance`: one workbook with the job and its results, read back; and the form to fill in."""

from __future__ import annotations

import numpy as np
import openpyxl
import pandas as pd
import pytest

from rotorid.files import read_influence
from rotorid.samples import sample_data

DATA = sample_data()
TURBO = DATA / "turbo_job"


def test_the_sheets_of_results(cli, tmp_path):
    sheet = tmp_path / "sheet.xlsx"
    document = cli("balance", TURBO / "holes.toml", "--split", "--output", sheet, "--json").json
    book = openpyxl.load_workbook(sheet)
    assert book.sheetnames[:2] == ["results", "results summary"]
    assert {"results residuals", "results add to mounted", "results influence"} <= {*book.sheetnames}
    assert book.active.title == "results"
    tables = {
        "": (document["corrections"], ("plane", "mass", "angle_deg")),
        " residuals": (document["residuals"], ("speed_rpm", "sensor", "before", "before_phase_deg", "after")),
        " mounting residuals": (document["mounting"]["residuals"], ("after",)),
        " mounting holes": (document["mounting"]["holes"], ("hole", "mass")),
    }
    for name, (rows, keys) in tables.items():
        frame = pd.read_excel(sheet, sheet_name=f"results{name}", comment="#")
        for key in keys:
            written = frame[key].astype(type(rows[0][key])).tolist()
            for value, row in zip(written, rows, strict=True):
                exact = isinstance(value, str)
                assert value == (row[key] if exact else pytest.approx(row[key], rel=1e-14))
    summary = dict(book["results summary"].iter_rows(min_row=3, max_col=2, values_only=True))
    assert summary["rms_after"] == document["rms_after"]
    assert summary["provenance.options.split"] == "yes"
    warned = [
        row[0] for row in book["results"].iter_rows(values_only=True) if str(row[0]).startswith("# warn")
    ]
    assert warned == [f"# warning: {text}" for text in document["warnings"]]


def test_the_influence_coefficients_of_the_results_are_a_table(cli, tmp_path):
    sheet, stored = tmp_path / "sheet.xlsx", tmp_path / "influence.json"
    for path in (sheet, stored):
        assert cli("balance", TURBO / "job.toml", "--output", path).code == 0
    book = openpyxl.load_workbook(sheet)
    for title in book.sheetnames:
        if title != "results influence":
            del book[title]
    book.save(tmp_path / "only.xlsx")
    ours, saved = read_influence(tmp_path / "only.xlsx"), read_influence(stored)
    np.testing.assert_allclose(ours.W, saved.W, rtol=1e-14)  # the deleting program keeps 16 digits
    assert ours.sensors == saved.sensors
