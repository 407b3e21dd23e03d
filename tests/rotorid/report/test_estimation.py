"""Sheets of fit and identify: the document's numbers, the model's file, what is not determined."""

import html
import json

import numpy as np
import pytest
from documents import check_hygiene
from sheets import COMMANDS, ESTIMATES, disagreements, make, read_sheet, rows_of

from rotorid.base.answer import LINES
from rotorid.harmonic import Experiments, harmonic_model
from rotorid.report.document import NOTHING
from rotorid.report.number_tables import every_warning
from rotorid.samples import sample_data
from rotorid.timedomain import Record, ode_model
from rotorid.workflows.fit import FitOptions, fit
from rotorid.workflows.identify import IdentifyOptions, identify

FIT, IDENTIFY = sample_data() / "fit", sample_data() / "identify"
PARAMETERS = "Parameters, in the units of the model"


def words_of(sheet):
    """The visible text, blanks as one."""
    return " ".join(html.unescape(sheet.text.split("<script")[0]).split())


def numbers(cells):
    return [np.nan if cell in (NOTHING, "") else float(cell.replace("−", "-")) for cell in cells]


@pytest.mark.parametrize("name", ESTIMATES)
def test_the_sheet_holds_the_printed_document_and_shows_its_numbers(name):
    made = make(name)
    sheet = read_sheet(made.html)
    assert sheet.document == made.document
    assert disagreements(sheet.shown, sheet.document) == []
    told = sheet.document["parameters"]
    assert {f"parameters.{key}.value" for key in told} <= sheet.keys
    intervals = {f"parameters.{key}.ci95.{k}" for key, one in told.items() if one["ci95"] for k in range(2)}
    assert {key for key in sheet.keys if ".ci95." in key} == intervals


@pytest.mark.parametrize("name", ESTIMATES)
def test_nothing_from_outside_and_ids_once(name):
    sheet = read_sheet(make(name).html)
    assert not [r for r in sheet.references if not r.startswith(("#", "data:"))]
    assert sheet.text.replace('xmlns="http://www.w3.org/2000/svg"', "").count("http") == 0
    assert len(sheet.ids) == len(set(sheet.ids))
    assert [tag for tag, *_ in sheet.order].count("script") == 1
    assert [tag for tag, *_ in sheet.order].count("svg") == 1


def test_a_fit_says_its_data_and_each_signal():
    sheet = read_sheet(make("fit from record").html)
    text = words_of(sheet)
    assert "record.csv: 251 times, 0 to 50 s" in text
    assert "estimated from the residuals of each output, and used as weights" in text
    assert "All 9 parameters are determined" in text
    table = rows_of(sheet, "Each signal")
    assert [row[0] for row in table] == ["y1", "v1", "y2", "v2", "y3", "v3"]
    series = sheet.document["series"]
    expected = [[one["samples"], one["rms"], one["residual_rms"]] for one in series]
    np.testing.assert_allclose([numbers(row[1:]) for row in table], expected, rtol=1e-3)
    # against the record itself: the model fits to five digits
    record = np.loadtxt(FIT / "three_masses" / "record.csv", delimiter=",", skiprows=1)[:, 1:]
    np.testing.assert_allclose([one["rms"] for one in series], np.sqrt((record**2).mean(axis=0)), rtol=1e-12)


def test_intervals_of_the_sheet_are_those_of_the_document():
    sheet = read_sheet(make("fit from record").html)
    for row, (name, one) in zip(
        rows_of(sheet, PARAMETERS), sheet.document["parameters"].items(), strict=True
    ):
        assert row[0] == name
        value, std, low, high = numbers(row[1:])
        assert [value, low, high] == pytest.approx([one["value"], *one["ci95"]], abs=0.06 * one["std"])
        assert std == pytest.approx(one["std"], rel=0.005)


def test_a_search_that_stopped_shows_no_interval():
    sheet = read_sheet(make("fit stopped").html)
    assert "No estimates: the values are where the search stopped." in words_of(sheet)
    assert [row[2:] for row in rows_of(sheet, PARAMETERS)] == [[NOTHING] * 3] * 3


def test_what_is_not_determined_is_said_in_words():
    singular = read_sheet(make("identify singular").html)
    assert "Only c and b*(1 - delta) are determined; b and delta by themselves are not." in words_of(singular)
    assert "Determined: b*(1 - delta) = 4978.85 ± 7.2." in words_of(singular)
    rows = {row[0]: row[1:] for row in rows_of(singular, PARAMETERS)}
    assert rows["b"] == rows["delta"] == [*[NOTHING] * 4, "not determined"]
    several = read_sheet(make("identify several").html)
    assert [row[-1] for row in rows_of(several, PARAMETERS)] == ["", "several values", "several values"]
    (_, *zero), (_, *one), (_, *two) = rows_of(several, "All solutions explain the data alike")
    assert zero[0] == zero[1]
    assert one == two[::-1]


def test_readings_with_what_the_model_leaves():
    sheet = read_sheet(make("identify singular").html)
    table = np.array([numbers([row[1], *row[3:]]) for row in rows_of(sheet, "Each reading")])
    data = np.loadtxt(IDENTIFY / "task_4_1" / "data.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2))
    np.testing.assert_allclose(table[:, 0], data[:, 0])
    np.testing.assert_allclose(table[:, 1], np.hypot(data[:, 1], data[:, 2]), rtol=1e-3)
    c, damping, w = 99385.71, 4978.845, table[:, 0]
    model = 10 * 1e-4 * w**2 / np.abs(-10 * w**2 + 1j * w * damping + c)
    np.testing.assert_allclose(table[:, 2], model, rtol=1e-3)


def test_a_design_is_in_the_sheet_with_and_without_data(tmp_path):
    sheet = read_sheet(make("identify design").html)
    assert "Measure at 9, 10, 11 rad/s (3 of 36 candidates)" in words_of(sheet)
    model = tmp_path / "model.toml"
    text = (IDENTIFY / "task_5_1" / "model.toml").read_text(encoding="utf-8")
    model.write_text(text + "\n[start]\nc = 1000.0\nalpha = 10.0\n", encoding="utf-8")
    options = IdentifyOptions(design="5:40:1", amplitude_error=2.0, phase_error=1.0)
    alone = read_sheet(identify(model, None, options).sheet())
    assert "Measure at" in words_of(alone)
    assert "What was found" not in alone.text


def test_many_readings_are_told_as_some_of_them():
    w = np.linspace(5.0, 40.0, 90)
    model = harmonic_model(["(10*p**2 + b*p + c)*X = F"], estimate=["b", "c"])
    x = 1 / (1000 - 10 * w**2 + 10j * w) * (1 + 0.01 * np.cos(7 * w))
    data = Experiments(
        tuple(map(str, range(90))), w, {"X": x, "F": np.ones(90, complex)}, np.zeros(90, dtype=bool)
    )
    sheet = read_sheet(identify(model, data).sheet())
    assert len(rows_of(sheet, "Each reading")) == 40
    assert "40 of 90 readings; --table prints all." in words_of(sheet)
    assert "as its file says" not in sheet.text  # there was none


def test_names_and_files_cannot_break_the_page(tmp_path):
    path = tmp_path / "m.toml"
    text = '[states]\nx = "-a*x"\n[initial]\nx = "record"\n[estimate]\na = 1\n'
    path.write_text(f"# </pre><script>alert(1)</script>\n{text}", encoding="utf-8")
    t = np.linspace(0.0, 3.0, 30)
    noise = 0.01 * np.random.default_rng(0).standard_normal(30)
    record = Record(t, {"x": np.exp(-t) + noise}, name="<b>r</b>")
    found = fit(path, [record], FitOptions(sigma=0.01))
    sheet = read_sheet(found.sheet())
    assert "<script>alert" not in sheet.text
    assert "<b>r" not in sheet.text
    assert "&lt;/pre&gt;&lt;script&gt;alert(1)" in sheet.text
    assert "Errors</dt><dd>stated</dd>" in sheet.text
    assert json.loads(json.dumps(found.document))["stopped_by"] is None
    assert len(found.summary().splitlines()) <= LINES
    check_hygiene(found.figure(), unitless=("",))


def test_a_model_without_a_file_and_a_bound():
    model = ode_model({"x": "-a*x"}, initial={"x": 1.0}, estimate={"a": 1.0}, bounds={"a": (0.5, 1.5)})
    t = np.linspace(0.0, 3.0, 30)
    sheet = read_sheet(fit(model, [Record(t, {"x": np.exp(-2 * t)})]).sheet())
    assert rows_of(sheet, PARAMETERS)[0][-1] == "at its bound"
    assert "as its file says" not in sheet.text
