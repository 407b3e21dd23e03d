"""Names that are formulas, markup or nonsense: in HTML, CSV and workbooks they are text, or refused."""

import cmath
import csv
import html.parser

import openpyxl
import pytest

from fuzz.judging import answer
from rotorid.tables import InputError, read_trials

NAMES = (
    "=1+1",
    "=cmd|' /C calc'!A0",
    "+1+2",
    "-1+2",
    "@SUM(A1)",
    "\t=1",
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</script><b>",
    "<!--",
    "{{7*7}}",
    "{% raw %}",
    "$x$",
    r"$\frac{1}$",
    "a;b",
    "a,b",
    '3.5" probe',
    "it's",
    "#1",
    "#12 coupling",
    "#N/A",
    "\u202eabc",
    "a\u200bb",
    "%s%n%d",
    "../../x",
    "&lt;b&gt;",
    "&amp;",
    "]]>",
    "nan",
    "1e5",
    "TRUE",
    "NULL",
    "a" * 3000,
    "\x07",
    "[red]x[/red]",
    "ОПОРА №1",
    "_x0041_",
)


def job(folder, sensors, planes):
    """A job with sensors and planes of these names: a trial in each plane, and the initial run."""
    runs = [["run", "speed_rpm", "sensor", "amplitude_um", "phase_deg"]]
    weights = [["run", "plane", "mass_g", "angle_deg"]]
    for number, run in enumerate(["initial", *(f"in {name}" for name in planes)]):
        for place, sensor in enumerate(sensors):
            reading = 10 + place + (5 if place % len(planes) == number - 1 else 0.3) * cmath.exp(1j * number)
            runs.append([run, 3000, sensor, abs(reading), cmath.phase(reading) * 57.29577951308232])
    weights += [[f"in {name}", name, 5, 30] for name in planes]
    for name, table in (("runs", runs), ("weights", weights)):
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, quoting=csv.QUOTE_ALL).writerows(table)
    return ["balance", str(folder / "runs.csv"), str(folder / "weights.csv"), "--method", "least-squares"]


class Page(html.parser.HTMLParser):
    """How often each element with these attributes stands in a page, and what it shows."""

    def __init__(self, text):
        super().__init__()
        self.found, self.shown = {}, ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        key = (tag, *(name for name, _ in attributes))
        self.found[key] = self.found.get(key, 0) + 1

    def handle_data(self, data):
        self.shown += data


PLANES = ("-1+2", "<script>alert(1)</script>", "</script><b>", "a;b", "#1", "#12 coupling")


@pytest.fixture(scope="module")
def accepted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("names")
    good, bad = [], set()
    for name in NAMES:
        _, runs, weights, *_ = job(folder, [name, "Xyz"], [name])
        try:
            read_trials(runs, weights)
        except InputError:
            bad.add(name)
        else:
            good.append(" ".join(name.split()))
    assert {"=1+1", "@SUM(A1)", "#N/A", "a\u200bb", "\x07", "\u202eabc"} <= bad
    assert set(PLANES) <= set(good)
    return good


@pytest.fixture(scope="module")
def files(accepted, tmp_path_factory):
    folder = tmp_path_factory.mktemp("written")
    words = job(folder, accepted, PLANES)
    for kind in ("csv", "xlsx"):
        targets = ["--output", f"{folder}/o.{kind}", "--save-influence", f"{folder}/i.{kind}"]
        done = answer([*words, *targets, *(["--report", f"{folder}/r.html"] if kind == "csv" else [])])
        assert [c["plane"] for c in done.document["corrections"]] == list(PLANES)
        assert [r["sensor"] for r in done.document["residuals"]] == accepted
    return folder


def names(file, accepted):
    return set(PLANES) if file.startswith("o") else {*PLANES, *accepted}


@pytest.mark.full
def test_a_page_shows_names_as_text(accepted, files, tmp_path):
    usual = [f"name {number}" for number in range(len(accepted))]
    done = answer([*job(tmp_path, usual, usual[: len(PLANES)]), "--report", str(tmp_path / "r.html")])
    assert done.document is not None
    page = Page((files / "r.html").read_text(encoding="utf-8"))
    plain = Page((tmp_path / "r.html").read_text(encoding="utf-8"))
    kinds = {key: n for key, n in page.found.items() if key not in plain.found}
    assert kinds == {}  # no element or attribute that a page of usual names has not
    for tag in ("script", "img", "b", "a", "iframe", "style", "svg"):
        count = [sum(n for key, n in p.found.items() if key[0] == tag) for p in (page, plain)]
        assert count[0] == count[1], tag
    assert [name for name in accepted if name not in page.shown] == []


@pytest.mark.parametrize("file", ["o.csv", "i.csv"])
def test_a_table_holds_names_and_no_formulas(accepted, files, file):
    with (files / file).open(newline="", encoding="utf-8-sig") as stream:
        rows = list(csv.reader(line for line in stream if not line.startswith("# ")))
    cells = {cell for row in rows for cell in row}
    assert names(file, accepted) <= {cell.strip() for cell in cells}
    assert len({len(row) for row in rows}) == 1
    for cell in cells:
        if cell[:1] in ("=", "+", "-", "@", "\t", "\r"):
            float(cell)


@pytest.mark.parametrize("file", ["o.xlsx", "i.xlsx"])
def test_a_workbook_holds_names_and_no_formulas(accepted, files, file):
    cells = [cell for row in openpyxl.load_workbook(files / file).active.iter_rows() for cell in row]
    assert names(file, accepted) <= {cell.value for cell in cells}
    assert {cell.data_type for cell in cells if cell.value is not None} <= {"s", "n"}


@pytest.mark.parametrize("file", ["i.csv", "i.xlsx"])
def test_what_was_written_is_read_back(accepted, files, file):
    lines = (files / "runs.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    first = files / "first.csv"
    first.write_text("".join([lines[0], *(x for x in lines if x.startswith('"initial"'))]), encoding="utf-8")
    done = answer(["balance", str(first), "--influence", str(files / file), "--method", "least-squares"])
    assert [c["plane"] for c in done.document["corrections"]] == list(PLANES)
    assert [r["sensor"] for r in done.document["residuals"]] == accepted
