"""`rotorid balance`: one workbook with the job and its results, read back; and the form to fill in."""

from __future__ import annotations

import numpy as np
import openpyxl
import pandas as pd
import pytest

from rotorid.samples import sample_data
from rotorid.tables import read_influence, write_influence

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
    results = [
        "results", "results summary", "results residuals", "results add to mounted",
        "results mounted residuals", "results holes", "results influence",
    ]  # fmt: skip
    assert book.sheetnames == ["runs", "weights", "planes", "sensors", "settings", *results]
    assert book.active.title == "results"
    corrections = pd.read_excel(sheet, sheet_name="results", comment="#")
    assert corrections["plane"].tolist() == ["left", "middle", "right"]
    assert corrections["mass"].tolist() == [row["mass"] for row in document["corrections"]]
    assert corrections["angle_deg"].tolist() == [row["angle_deg"] for row in document["corrections"]]
    residuals = pd.read_excel(sheet, sheet_name="results residuals", comment="#")
    for key in ("speed_rpm", "sensor", "before", "before_phase_deg", "after", "after_phase_deg"):
        assert residuals[key].tolist() == [row[key] for row in document["residuals"]]
    mounted = pd.read_excel(sheet, sheet_name="results mounted residuals", comment="#")
    assert mounted["after"].tolist() == [row["after"] for row in document["mounting"]["residuals"]]
    holes = pd.read_excel(sheet, sheet_name="results holes", comment="#")
    assert len(holes) == len(document["mounting"]["holes"])
    summary = dict(book["results summary"].iter_rows(min_row=3, max_col=2, values_only=True))
    assert summary["rms_after"] == document["rms_after"]
    assert summary["provenance.options.split"] == "yes"
    warned = [
        row[0] for row in book["results"].iter_rows(values_only=True) if str(row[0]).startswith("# warn")
    ]
    assert warned == [f"# warning: {text}" for text in document["warnings"]]


def test_the_influence_coefficients_of_the_results_are_a_table(cli, tmp_path):
    sheet, stored = tmp_path / "sheet.xlsx", tmp_path / "influence.csv"
    outcome = cli("balance", TURBO / "job.toml", "--output", sheet, "--save-influence", stored)
    assert outcome.code == 0, outcome.err
    book = openpyxl.load_workbook(sheet)
    for title in book.sheetnames:
        if title != "results influence":
            del book[title]
    book.save(tmp_path / "only.xlsx")
    ours, saved = read_influence(tmp_path / "only.xlsx"), read_influence(stored)
    np.testing.assert_allclose(ours.W, saved.W, rtol=1e-14)  # the deleting program keeps 16 digits
    assert ours.sensors == saved.sensors


def test_stored_coefficients_are_embedded(cli, tmp_path):
    runs, stored = tmp_path / "runs.csv", tmp_path / "influence.csv"
    assert cli("balance", TURBO / "job.toml", "--save-influence", stored).code == 0
    lines = (TURBO / "runs.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    runs.write_text(
        "".join(line for line in lines if line.startswith(("run,", "baseline"))), encoding="utf-8"
    )
    write_influence(stored, read_influence(stored), ["machine 7, summer"])
    sheet = tmp_path / "sheet.xlsx"
    first = cli("balance", runs, "--influence", stored, "--output", sheet, "--json")
    stored.unlink()
    runs.unlink()
    assert answer(cli("balance", sheet, "--json")) == answer(first)
    comments = [row[0] for row in openpyxl.load_workbook(sheet)["influence"].iter_rows(values_only=True)]
    assert "# machine 7, summer" in comments


def test_what_cannot_be_kept_writes_nothing(cli, tmp_path):
    for name in ("runs", "weights"):
        (tmp_path / f"{name}.csv").write_bytes((TURBO / f"{name}.csv").read_bytes())
    job, sheet, picture = tmp_path / "job.toml", tmp_path / "sheet.xlsx", tmp_path / "p.png"
    job.write_text(
        'runs = "runs.csv"\nweights = "weights.csv"\n[planes.left]\nholes = 2\nhole_names = ["A;B", "C"]\n'
    )
    assert cli("balance", job).code == 0
    outcome = cli("balance", job, "--output", sheet, "--plot", picture)
    assert (outcome.code, outcome.out) == (2, "")
    assert "this job cannot be kept in a workbook" in outcome.err
    assert "Traceback" not in outcome.err
    assert not sheet.exists()
    assert not picture.exists()


def test_the_form(cli, tmp_path):
    form = tmp_path / "job.xlsx"
    outcome = cli("balance", "--template", form)
    assert outcome.code == 0, outcome.err
    assert f"written: {form}" in outcome.out
    empty = cli("balance", form)
    assert (empty.code, empty.out) == (2, "")
    assert empty.err.count("\n") == 1
    assert "sheet 'runs'" in empty.err
    assert "none are filled in yet" in empty.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--template", "form.csv"), "the name must end in .xlsx"),
        (("--template", "there.xlsx"), "exists already, and may be filled in"),
        (("--template", "none/form.xlsx"), "does not exist"),
        ((TURBO / "job.toml", "--template", "form.xlsx"), "leave the job away"),
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
