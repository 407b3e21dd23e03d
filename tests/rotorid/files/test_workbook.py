"""Jobs as workbooks: the same as files that say the same; with results, what was there stays."""

from __future__ import annotations

import shutil

import numpy as np
import openpyxl
import pytest
from openpyxl.styles import Font
from tables_data import RUNS, WEIGHTS, write_csv
from workbook_jobs import (
    CHECK,
    HEAD,
    PARTS,
    ROTOR,
    SAMPLES,
    SLOW,
    as_workbook,
    differences,
    with_stored_values,
)

from balancing import correct, estimate_influence
from rotorid.files import job_from_files, read_job, write_influence
from rotorid.samples import sample_data

DATA = sample_data()


@pytest.fixture
def folder(tmp_path):
    """A job's folder with every table that a job may name."""
    place = tmp_path / "a job"
    place.mkdir()
    tables = {"runs": RUNS, "weights": WEIGHTS, "check": CHECK, "slow": SLOW}
    for name, table in (tables | {"check_weights": WEIGHTS[:1]}).items():
        write_csv(place / f"{name}.csv", table)
    write_csv(place / "rotor.csv", [["" if cell is None else cell for cell in row] for row in ROTOR])
    trials = job_from_files([place / "runs.csv", place / "weights.csv"], phase="lag").trials
    write_influence(place / "influence.csv", estimate_influence(trials))
    return place


def there_and_back(job, target):
    """The job of a file, read from the workbook that says the same."""
    plain, back = read_job(job), read_job(as_workbook(job, target))
    assert differences(plain, back) == ()
    return plain, back


def cells(path, sheet):
    return [list(row) for row in openpyxl.load_workbook(path)[sheet].iter_rows(values_only=True)]


def write_job(folder, text):
    path = folder / "job.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


@pytest.mark.parametrize("sample", SAMPLES)
def test_every_sample_job_is_the_same_as_a_workbook(sample, tmp_path):
    folder = tmp_path / "samples" / sample.split("/")[0]
    shutil.copytree(DATA / folder.name, folder)
    job, back = there_and_back(DATA / f"{sample}.toml", folder / "sheet.xlsx")
    assert back.trials.warnings == job.trials.warnings


@pytest.mark.parametrize("part", PARTS)
def test_all_that_a_job_says_is_the_same_in_a_workbook(part, folder):
    path = write_job(folder, PARTS[part])
    job, back = there_and_back(path, folder / "sheet.xlsx")
    assert differences(job, read_job(write_job(folder, ""))), "this part of the job must matter"
    found = [correct(estimate_influence(j.trials), limits=j.limits_of(j.trials.planes)) for j in (job, back)]
    np.testing.assert_array_equal(found[0].weights, found[1].weights)


def test_a_workbook_of_the_user_is_kept_and_gets_the_results(folder, cli):
    """Formats, formulas, remarks and sheets of no table stay; older results go."""
    path = as_workbook(write_job(folder, 'phase = "lag"\n'), folder / "job.xlsx")
    book = openpyxl.load_workbook(path)
    book["runs"]["A1"].font = Font(color="FFFF0000")
    book["runs"]["H2"] = "=D2*2"
    book["runs"]["H1"] = "note"
    book.create_sheet("notes")["B3"] = "new cable"
    book.create_sheet("results of June")["A1"] = 1
    book.save(path)
    for name in ("done", "again"):  # once more from its own copy
        with_stored_values(path, [1])
        outcome = cli("balance", path, "--output", folder / f"{name}.xlsx")
        assert outcome.code == 0, outcome.err
        done = openpyxl.load_workbook(folder / f"{name}.xlsx")
        assert [name for name in done.sheetnames if not name.startswith("results")] == [
            name for name in book.sheetnames if not name.startswith("results")
        ]
        assert "results of June" not in done.sheetnames
        assert (done["runs"]["A1"].font.color.rgb, done["runs"]["H2"].value) == ("FFFF0000", "=D2*2")
        assert done["notes"]["B3"].value == "new cable"
        assert cells(folder / f"{name}.xlsx", "weights") == cells(path, "weights")
        assert done.active.title == "results"
        assert done["results"]["A2"].value is not None
        path = folder / f"{name}.xlsx"
