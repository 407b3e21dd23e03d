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


def answer(outcome):
    """The document of a result without what names files and dates."""
    assert outcome.code == 0, outcome.err
    return {key: value for key, value in outcome.json.items() if key != "provenance"}


def test_the_sheets_of_results(cli, tmp_path):
    sheet = tmp_path / "sheet.xlsx"
    document = cli("balance", TURBO / "holes.toml", "--split", "--output", sheet, "--json").json
    book = openpyxl.load_workbook(sheet)
    assert book.sheetnames[:2] == ["results", "results summary"]
    assert {"results residuals", "results add to mounted", "results influence"} <= {*book.sheetnames}
    assert book.active.title == "results"
    corrections = pd.read_excel(sheet, sheet_name="results", comment="#")
    assert corrections["plane"].tolist() == ["left", "middle", "right"]
    assert corrections["mass"].tolist() == [row["mass"] for row in document["corrections"]]
    assert corrections["angle_deg"].tolist() == [row["angle_deg"] for row in document["corrections"]]
    residuals = pd.read_excel(sheet, sheet_name="results residuals", comment="#")
    for key in ("speed_rpm", "sensor", "before", "before_phase_deg", "after", "after_phase_deg"):
        assert residuals[key].tolist() == [row[key] for row in document["residuals"]]
    mounted = pd.read_excel(sheet, sheet_name="results mounting residuals", comment="#")
    assert mounted["after"].tolist() == [row["after"] for row in document["mounting"]["residuals"]]
    holes = pd.read_excel(sheet, sheet_name="results mounting holes", comment="#")
    assert len(holes) == len(document["mounting"]["holes"])
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


def test_the_form(cli, tmp_path):
    form = tmp_path / "job.xlsx"
    outcome = cli("balance", "--template", form)
    assert outcome.code == 0, outcome.err
    assert f"written: {form}" in outcome.out
    empty = cli("balance", form)
    assert (empty.code, empty.out) == (2, "")
    assert empty.err.count("\n") == 1
    assert "sheet 'runs'" in empty.err
    assert "rows below the header; there are none" in empty.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--template", "form.csv"), "the name must end in .xlsx"),
        (("--template", "there.xlsx"), "exists already, and may be filled in"),
        (("--template", "none/form.xlsx"), "does not exist"),
        ((TURBO / "job.toml", "--template", "form.xlsx"), "--template, without a job"),
        ((), "give a job"),
    ],
)
def test_forms_that_are_refused(cli, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.xlsx").write_bytes(b"filled in")
    outcome = cli("balance", *arguments)
    assert (outcome.code, outcome.out) == (2, "")
    assert words in outcome.err
    assert [path.name for path in tmp_path.iterdir()] == ["there.xlsx"]
    assert (tmp_path / "there.xlsx").read_bytes() == b"filled in"
