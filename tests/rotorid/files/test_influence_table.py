"""Stored influence coefficients and written tables."""

from __future__ import annotations

import math

import numpy as np
import openpyxl
import pandas as pd
import pytest
from tables_data import RUNS, WEIGHTS, complaints, replaced, the_only, write_csv

from balancing import estimate_influence
from rotorid.files import read_influence, read_trials, write_influence, write_table
from rotorid.files.disk import write_files

HEADER = ["speed_rpm", "sensor", "plane", "influence_um_pp_per_g", "phase_deg"]
TABLE = [
    HEADER,
    [1000, "A", "1", 2.0, 90],
    [1000, "A", "2", 1.0, 0],
    [1000, "B", "1", 0.5, 180],
    [1000, "B", "2", 4.0, 270],
]


@pytest.fixture
def stored(tmp_path):
    def read(table=TABLE, **options):
        return read_influence(write_csv(tmp_path / "influence.csv", table), **options)

    return read


def test_meaning(stored):
    influence = stored()
    assert (influence.sensors, influence.planes) == (("A", "B"), ("1", "2"))
    np.testing.assert_allclose(influence.speeds, [1000 * math.pi / 30], rtol=1e-15)
    np.testing.assert_allclose(influence.W, np.array([[[2j, 1], [-0.5, -4j]]]) * 0.5e-6 / 1e-3, rtol=1e-15)
    labels = influence.labels
    assert (labels.vibration_unit, labels.weight_unit, labels.phase) == ("um_pp", "g", "lead")
    assert not influence.has_baseline
    assert not influence.known_errors


def test_phase_convention_of_the_table_wins_over_that_of_the_job(stored, tmp_path):
    plain = stored()
    np.testing.assert_array_equal(stored(phase="lag").W, plain.W.conj())
    np.testing.assert_array_equal(stored(angles="against rotation").W, plain.W)
    path = tmp_path / "lag.csv"
    path.write_text("# phase = lag\n" + (tmp_path / "influence.csv").read_text())
    for phase in (None, "lead", "lag"):
        influence = read_influence(path, phase=phase)
        np.testing.assert_array_equal(influence.W, plain.W.conj())
        assert influence.labels.phase == phase or phase is None


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize("phase", ["lead", "lag"])
@pytest.mark.parametrize("angles", ["with rotation", "against rotation"])
def test_round_trip(tmp_path, suffix, phase, angles):
    files = write_csv(tmp_path / "runs.csv", RUNS), write_csv(tmp_path / "weights.csv", WEIGHTS)
    influence = estimate_influence(read_trials(*files, phase=phase, angles=angles))
    path = tmp_path / f"influence{suffix}"
    write_influence(path, influence)
    again = read_influence(path, angles=angles)
    np.testing.assert_allclose(again.speeds, influence.speeds, rtol=1e-14)
    np.testing.assert_allclose(again.W, influence.W, rtol=1e-14)
    assert (again.sensors, again.planes, again.labels) == (
        influence.sensors,
        influence.planes,
        influence.labels,
    )


def test_no_vibration_unit(stored, tmp_path):
    influence = stored(replaced(TABLE, 1, "influence_um_pp_per_g", "influence_per_oz_in"))
    assert (influence.labels.vibration_unit, influence.labels.weight_unit) == ("", "oz_in")
    write_influence(tmp_path / "again.csv", influence)
    np.testing.assert_allclose(read_influence(tmp_path / "again.csv").W, influence.W, rtol=1e-14)


BAD_COLUMNS = [
    ("influence_um_pp_per_g", "influence", "influence_<vibration unit>_per_<weight unit>"),
    ("influence_um_pp_per_g", "influence_um_g", "influence_<vibration unit>_per_<weight unit>"),
    ("influence_um_pp_per_g", "influence_um_per_gram", "a unit of weight: kg, g"),
    ("influence_um_pp_per_g", "influence_um_pk_per_g", "um_pp (peak to peak)"),
]


@pytest.mark.parametrize(("old", "new", "words"), BAD_COLUMNS)
def test_bad_columns(stored, old, new, words):
    the_only(complaints(stored, replaced(TABLE, 1, old, new)), "influence.csv", 1, new, new, words)


BAD_CELLS = [
    ("influence_um_pp_per_g", -1, "a coefficient of 0 or more"),
    ("phase_deg", 400, "a phase from -360 to 360 degrees"),
    ("speed_rpm", 0, "a speed above 0"),
]


@pytest.mark.parametrize(("column", "value", "words"), BAD_CELLS)
def test_bad_cells(stored, column, value, words):
    the_only(
        complaints(stored, replaced(TABLE, 2, column, value)), "influence.csv", 2, column, str(value), words
    )


def test_gaps_and_repeats(stored):
    words = "a coefficient of sensor 'B' and plane '1' at 1000 rpm"
    the_only(complaints(stored, TABLE[:3] + TABLE[4:]), "influence.csv", None, "plane", None, words)
    the_only(complaints(stored, [*TABLE, TABLE[2]]), "influence.csv", 6, "plane", "2", "(row 3 has the same)")


def test_nothing_that_a_spreadsheet_would_run(tmp_path):
    frame = pd.DataFrame(
        {"name": ["=1+1", "+X", "-Y", "@z", "plain", "two\nlines"], "=bad": [1, 2, 3, 4, 5, 6]}
    )
    write_table(tmp_path / "a.csv", frame)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines == ["name, =bad", " =1+1,1", " +X,2", " -Y,3", " @z,4", "plain,5", "two lines,6"]
    write_table(tmp_path / "a.xlsx", frame)
    sheet = openpyxl.load_workbook(tmp_path / "a.xlsx").active
    assert {cell.data_type for row in sheet.iter_rows(max_col=1) for cell in row} == {"s"}
    assert sheet["A2"].value == "=1+1"


def test_names_with_signs_survive_the_round_trip(stored, tmp_path):
    influence = stored([HEADER, [1000, "+X", "-1", 2.0, 90]])
    for name in ("a.csv", "a.xlsx"):
        write_influence(tmp_path / name, influence)
        assert (read_influence(tmp_path / name).sensors, influence.planes) == (("+X",), ("-1",))


def test_blanks_logical_values_and_letters(tmp_path):
    frame = pd.DataFrame({"a": [1.5, math.nan], "b": [True, False], "c": ["Опора", None]})
    write_table(tmp_path / "a.csv", frame)
    text = (tmp_path / "a.csv").read_bytes().decode("utf-8-sig")
    assert (tmp_path / "a.csv").read_bytes().startswith(b"\xef\xbb\xbf")
    assert text == "a,b,c\n1.5,true,Опора\n,false,\n"
    with pytest.raises(ValueError, match="infinite"):
        write_table(tmp_path / "b.csv", pd.DataFrame({"a": [math.inf]}))
    with pytest.raises(ValueError, match="control characters"):
        write_table(tmp_path / "b.xlsx", pd.DataFrame({"a": ["bell\x07"]}))
    assert not (tmp_path / "b.csv").exists()


def test_what_cannot_be_written(tmp_path):
    frame = pd.DataFrame({"a": [1]})
    problems = complaints(write_table, tmp_path / "a.txt", frame)
    the_only(problems, "a.txt", None, None, None, "a name that ends in .csv or .xlsx")
    problems = complaints(write_table, tmp_path / "none" / "a.csv", frame)
    the_only(problems, "a.csv", None, None, None, "a file that can be written")
    (tmp_path / "b.csv").mkdir()
    problems = complaints(write_table, tmp_path / "b.csv", frame)
    the_only(problems, "b.csv", None, None, None, "a file that can be written")
    assert [path.name for path in tmp_path.iterdir()] == ["b.csv"]


def test_nothing_half_written(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    problems = complaints(write_files, {path: b"after"})
    the_only(problems, "a.csv", None, None, None, "No space left on device")
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]
