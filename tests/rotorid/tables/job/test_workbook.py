"""Jobs as workbooks: written with all that they say, read back to the same job."""

from __future__ import annotations

import json

import numpy as np
import openpyxl
import pytest
from tables_data import RUNS, WEIGHTS, write_book, write_csv
from workbook_jobs import CHECK, HEAD, PARTS, ROTOR, SAMPLES, SLOW, differences

from balancing import correct, estimate_influence
from rotorid.samples import sample_data
from rotorid.tables import job_from_files, read_job, write_influence
from rotorid.tables.job.job_as_written import JobSource
from rotorid.tables.job.job_data import Overrides
from rotorid.tables.job.workbook_writing import job_workbook_bytes

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
    write_influence(place / "influence.csv", estimate_influence(trials), ["two runs"])
    return place


def there_and_back(job, source, target):
    target.write_bytes(job_workbook_bytes(job, source, target))
    back = read_job(target)
    assert differences(job, back) == ()
    return back


def cells(path, sheet):
    return [list(row) for row in openpyxl.load_workbook(path)[sheet].iter_rows(values_only=True)]


def write_job(folder, text):
    path = folder / "job.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


@pytest.mark.parametrize("sample", SAMPLES)
def test_every_sample_job_comes_back(sample, tmp_path):
    path = DATA / f"{sample}.toml"
    job = read_job(path)
    back = there_and_back(job, JobSource((path,)), tmp_path / "sheet.xlsx")
    assert back.trials.warnings == job.trials.warnings
    assert (job.rotor is None) == (back.rotor is None)
    np.testing.assert_array_equal(back.trials.readings, job.trials.readings)
    np.testing.assert_array_equal(back.trials.weights, job.trials.weights)
    again = there_and_back(job, JobSource((tmp_path / "sheet.xlsx",)), tmp_path / "again.xlsx")
    assert again.trials.labels == job.trials.labels


@pytest.mark.parametrize("part", PARTS)
def test_all_that_a_job_says_comes_back(part, folder, tmp_path):
    path = write_job(folder, PARTS[part])
    job = read_job(path)
    plain = read_job(write_job(folder, ""))
    assert differences(job, plain), "this part of the job must matter"
    write_job(folder, PARTS[part])
    sheet = tmp_path / "sheet.xlsx"
    back = there_and_back(job, JobSource((path,)), sheet)
    assert [text.replace(str(sheet), "") for text in back.trials.warnings] == [
        text.replace(str(folder), "") for text in job.trials.warnings
    ]
    there_and_back(job, JobSource((sheet,)), tmp_path / "again.xlsx")
    found = [correct(estimate_influence(j.trials), limits=j.limits_of(j.trials.planes)) for j in (job, back)]
    np.testing.assert_array_equal(found[0].weights, found[1].weights)


def test_cells_are_as_the_tables_have_them(folder, tmp_path):
    write_csv(folder / "runs.csv", [RUNS[0], *[[f"{r} ", 1000, s, a, p - 360] for r, _, s, a, p in RUNS[1:]]])
    path = write_job(folder, PARTS["limits"])
    there_and_back(read_job(path), JobSource((path,)), tmp_path / "sheet.xlsx")
    assert openpyxl.load_workbook(tmp_path / "sheet.xlsx").sheetnames == [
        "runs",
        "weights",
        "planes",
        "sensors",
        "settings",
    ]
    expected = [RUNS[0], *[[r, 1000, s, a, p - 360] for r, _, s, a, p in RUNS[1:]]]
    assert cells(tmp_path / "sheet.xlsx", "runs") == expected
    assert cells(tmp_path / "sheet.xlsx", "weights") == WEIGHTS
    assert cells(tmp_path / "sheet.xlsx", "planes") == [
        ["plane", "max_mass_oz", "forbidden_deg", "max_mass_g", "use"],
        ["1", 0.7, "-30.5 to 20; 300 to 340", None, None],
        ["2", None, "0.00001 to 7", 3, "no"],
    ]
    assert cells(tmp_path / "sheet.xlsx", "sensors") == [
        ["sensor", "limit", "weight"],
        ["A", "1000: 4.5", 2],
        ["B", 6, None],
    ]
    assert cells(tmp_path / "sheet.xlsx", "settings") == [["key", "value"], ["angles", "against rotation"]]


def test_digits_survive(tmp_path):
    third, tiny = 1 / 3, 1.2345678901234567e-7
    runs = [RUNS[0], *[[r, 1e3 * third, s, a * third, p * third + tiny] for r, _, s, a, p in RUNS[1:]]]
    files = write_csv(tmp_path / "runs.csv", runs), write_csv(tmp_path / "weights.csv", WEIGHTS)
    job = job_from_files(files)
    there_and_back(job, JobSource(files), tmp_path / "sheet.xlsx")
    assert cells(tmp_path / "sheet.xlsx", "runs")[1:] == runs[1:]


def test_remarks_of_a_workbook_come_back(tmp_path):
    sheets = {
        "runs": [[*RUNS[0], "comment"], *[[*row, f"reading {k}"] for k, row in enumerate(RUNS[1:])]],
        "weights": WEIGHTS,
        "planes": [["plane", "note", "max_mass_g"], ["1", "drive end", 20]],
        "sensors": [["sensor", "note"], ["B", "new cable"]],
        "settings": [
            ["# said by the foreman"],
            ["key", "value", "note"],
            ["phase", "lag", "as the book says"],
            ["planes.2.max_mass_g", 15, "the thin one"],
        ],
        "Notes": [["a", 1], [], [None, "b"]],
        "results of June": [["anything", "at", "all"]],
    }
    path = write_book(tmp_path / "job.xlsx", sheets)
    there_and_back(read_job(path), JobSource((path,)), tmp_path / "sheet.xlsx")
    assert cells(tmp_path / "sheet.xlsx", "runs") == sheets["runs"]
    assert cells(tmp_path / "sheet.xlsx", "planes") == [
        ["plane", "max_mass_g", "note"],
        ["2", 15, None],  # the settings come first
        ["1", 20, "drive end"],
    ]
    assert cells(tmp_path / "sheet.xlsx", "sensors") == [["sensor", "note"], ["B", "new cable"], ["A", None]]
    assert cells(tmp_path / "sheet.xlsx", "settings") == [
        ["# said by the foreman", None, None],
        ["# planes.2.max_mass_g: the thin one", None, None],
        *sheets["settings"][1:-1],
    ]
    assert cells(tmp_path / "sheet.xlsx", "Notes") == [["a", 1], [None, None], [None, "b"]]
    assert "results of June" not in openpyxl.load_workbook(tmp_path / "sheet.xlsx").sheetnames


def test_tables_without_a_job_file_and_what_the_caller_says(folder, tmp_path):
    files = (folder / "runs.csv", folder / "weights.csv")
    said = {
        "phase": "lag",
        "angles": "against rotation",
        "amplitude_error_percent": 2.0,
        "phase_error_deg": 0.5,
    }
    back = there_and_back(
        job_from_files(files, **said), JobSource(files, overrides=Overrides(**said)), tmp_path / "a.xlsx"
    )
    assert (back.conventions.labels.phase, back.conventions.labels.angles) == ("lag", "against rotation")
    stored = folder / "influence.csv"
    job = job_from_files(files[:1], influence=stored)
    back = there_and_back(job, JobSource(files[:1], stored), tmp_path / "c.xlsx")
    assert back.conventions.labels.phase == "lag"
    assert openpyxl.load_workbook(tmp_path / "c.xlsx").sheetnames[-1] == "influence"


def test_limits_of_the_command_line_come_back(folder, tmp_path):
    from rotorid.commands.option_quantities import largest_amplitudes, largest_weights, limited

    path = write_job(folder, PARTS["limits"])
    for max_mass, limit in (("2.2g", ["0.3mil_pp"]), ("1=0.07oz,2=3", ["A=7.7", "B=0.012"])):
        job = limited(read_job(path), max_mass, limit)
        most = {"max_weights": largest_weights(job, max_mass), "limits": largest_amplitudes(job, limit)}
        source = JobSource((path,), **most)
        back = there_and_back(job, source, tmp_path / "sheet.xlsx")
        assert differences(read_job(path), back), "the limits of the file are replaced"


def test_a_rotor_is_named_from_where_the_workbook_is(folder, tmp_path):
    path = write_job(folder, PARTS["model"])
    (tmp_path / "x" / "y").mkdir(parents=True)
    sheet = tmp_path / "x" / "y" / "sheet.xlsx"
    there_and_back(read_job(path), JobSource((path,)), sheet)
    assert ["rotor", "../../a job/rotor.csv"] in cells(sheet, "settings")


def test_a_rotor_that_cannot_be_named_is_refused(folder, tmp_path, monkeypatch):
    path = write_job(folder, PARTS["model"])

    def on_another_drive(*_):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr("rotorid.tables.job.workbook_sheets.os.path.relpath", on_another_drive)
    with pytest.raises(ValueError, match="on another drive than the workbook"):
        job_workbook_bytes(read_job(path), JobSource((path,)), tmp_path / "sheet.xlsx")


NOT_KEPT = [
    ("[planes.1]\nholes = 3\nhole_names = ['A;B', 'C', 'D']\n", "planes.1.hole_names"),
    ("[planes.1]\nholes = 2\nhole_names = ['A:', 'C']\ntaken = { 'A:' = 3 }\n", "taken"),
    ('[planes.1]\nholes = 2\nhole_names = ["A\\u00a0B", "C"]\n', "planes.1.hole_names"),
]


@pytest.mark.parametrize(("text", "words"), NOT_KEPT)
def test_what_a_workbook_cannot_say_is_refused(folder, tmp_path, text, words):
    path = write_job(folder, text)
    with pytest.raises(ValueError, match="cannot be kept in a workbook") as caught:
        job_workbook_bytes(read_job(path), JobSource((path,)), tmp_path / "sheet.xlsx")
    assert words in str(caught.value)


def test_names_with_points_quotes_and_signs(tmp_path):
    names = {"A": '3.5" probe', "B": "#2 it's"}
    runs = [RUNS[0], *[[r, s, names[c], a, p] for r, s, c, a, p in RUNS[1:]]]
    weights = [WEIGHTS[0], *[[r, f"#{p}.0", m, a] for r, p, m, a in WEIGHTS[1:]]]
    files = {"runs": runs, "weights": weights}
    for name, table in files.items():
        text = "\n".join(",".join(f'"{str(c).replace(chr(34), chr(34) * 2)}"' for c in row) for row in table)
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
    text = HEAD + "".join(
        f"[slow_roll.{json.dumps(n)}]\namplitude = 0.1\nphase_deg = 3\n"
        f"[sensors.{json.dumps(n)}]\nweight = 2\n"
        for n in names.values()
    )
    (tmp_path / "job.toml").write_text(text + '[planes."#1.0"]\nmax_mass_g = 3\n', encoding="utf-8")
    job = read_job(tmp_path / "job.toml")
    back = there_and_back(job, JobSource((tmp_path / "job.toml",)), tmp_path / "sheet.xlsx")
    assert back.planes == ("#1.0", "#2.0")
    assert back.trials.sensors == ('3.5" probe', "#2 it's")


def test_too_much_for_a_workbook_is_refused(folder, tmp_path, monkeypatch):
    path = write_job(folder, "")
    monkeypatch.setattr("rotorid.tables.reader.excel_pages.MOST_ROWS", 6)
    with pytest.raises(ValueError, match="'runs' would have 7 rows, and a workbook holds 6"):
        job_workbook_bytes(read_job(path), JobSource((path,)), tmp_path / "sheet.xlsx")
