"""Sheets of fit and identify: the document's numbers, the model's file, what is not determined."""

import html

import numpy as np
import pytest
from documents import check_hygiene
from sheets import ESTIMATES, disagreements, make, read_sheet, rows_of

from rotorid.commands.fit import FitOptions, fit
from rotorid.commands.identify import identify
from rotorid.identify.records import Record
from rotorid.report.document import NOTHING
from rotorid.samples import sample_data

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


def test_a_fit_says_its_data_and_each_signal():
    sheet = read_sheet(make("fit from record").html)
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
    assert "Determined: b*(1 - delta) = 4980.61 ± 25." in words_of(singular)
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
    answer, w = (
        identify(IDENTIFY / "task_4_1" / "model.toml", IDENTIFY / "task_4_1" / "data.csv"),
        table[:, 0],
    )
    c, damping = answer.identification.values[0], answer.identification.combinations[0].value
    Z = data[:, 1] + 1j * data[:, 2]
    left = 1 - 10 * 1e-4 * w**2 / (-10 * w**2 + 1j * w * damping + c) / Z
    left *= np.exp(1j * np.angle(Z))
    np.testing.assert_allclose(table[:, 1:], np.stack((left.real, left.imag), 1), atol=1e-5)


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
    check_hygiene(found.figure(), unitless=("",))
