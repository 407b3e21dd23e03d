"""The balancing sheet: its numbers are those of the document, and it can be used without the program."""

import re

import numpy as np
import pytest
from balance_sheets import DATA, hard, on_top, sheet_of
from matplotlib.figure import Figure
from sheets import disagreements

from balancing.plots import draw_plane, residual_figure
from rotorid.commands.balance import BalanceOptions, balance

JOBS = {
    "checked": ("turbo_job/checked.toml", {}),
    "on top": ("on top", {"split": True, "refine": True}),
    "holes": ("turbo_job/holes.toml", {"split": True}),
    "left in": ("left_in/job.toml", {}),
    "model": ("model_job/job.toml", {}),
    "hard": ("hard", {}),
}
FOLDERS = {"hard": hard, "on top": on_top}
LONG = ("left in", "holes", "hard", "model")


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=pytest.mark.full if name in LONG else ()) for name in JOBS],
)
def made(request, tmp_path_factory):
    name, options = JOBS[request.param]
    path = FOLDERS[name](tmp_path_factory.mktemp("job")) if name in FOLDERS else DATA / name
    return sheet_of(path, **options)


def test_every_number_shown_is_that_of_the_document(made):
    _, sheet, _, _ = made
    assert len(sheet.shown) >= 10
    assert disagreements(sheet.shown, sheet.document) == []


def test_runs_that_a_trim_rests_on_are_all_there():
    plain, refined = (sheet_of(DATA / "turbo_job" / "checked.toml", refine=more)[0] for more in (False, True))
    rests = [text.partition('id="runs"')[2] for text in (plain, refined)]
    assert ["<strong>check</strong>: 417 g·mm at 172.0°" in text for text in rests] == [False, True]
    assert [text.count(">check</th>") for text in rests] == [0, 1]


def test_nothing_of_the_result_is_left_out(made):
    _, sheet, report, _ = made
    keys, document = sheet.keys, sheet.document
    path, left = "residuals", "after"
    if "check" in document:
        path, left = "check.readings", "achieved"
    rows = document["check"]["readings"] if "check" in document else document["residuals"]
    shown = f"mounting.residuals.{{}}.{left}" if "mounting" in document and path == "residuals" else ""
    for i in range(len(rows)):
        assert {f"{path}.{i}.{k}" for k in ("before", "before_phase_deg")} <= keys
        assert (shown or f"{path}.{{}}.{left}").format(i) in keys
        if report.result.limits is not None and path == "residuals" and document["limits"]["amplitude"][i]:
            assert f"limits.amplitude.{i}" in keys
    part = "left_to_do" if "left_to_do" in document else "mounting"
    if part not in document:
        assert {f"corrections.{i}.mass" for i in range(len(report.result.planes))} <= keys
    for i in range(len(document.get(part, {"holes": []})["holes"])):
        assert {f"{part}.holes.{i}.mass", f"{part}.holes.{i}.plane"} & keys
    for row in document.get("verdict", {"rows": []})["rows"]:
        assert f"{row['kind']} {row['name']}" in made[0]


def cells(text, first):
    """Rows of the table whose headings begin so."""
    for table in text.split("<table")[1:]:
        rows = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in table.split("<tr>")[1:]]
        if rows and rows[0][: len(first)] == list(first):
            return [[re.sub("<[^>]*>", "", cell) for cell in row] for row in rows]
    raise AssertionError(f"no table begins with {first}")


def test_a_job_as_its_files_have_it():
    text, _, _, _ = sheet_of(DATA / "bk_two_plane" / "job.toml")
    assert "<h1>Balancing sheet: bk_two_plane</h1>" in text
    head, *rows = cells(text, ("rpm", "sensor", "initial"))
    found = {
        (run, row[1]): tuple(float(text.rstrip("°")) for text in row[2 + 2 * k : 4 + 2 * k])
        for row in rows
        for k, run in enumerate(head[2::2])
    }
    lines = [line.split(",") for line in (DATA / "bk_two_plane" / "runs.csv").read_text().splitlines()]
    lines = [line for line in lines if not line[0].startswith("#") and line[0] != "run"]
    assert len(found) == len(lines)
    for line in lines:
        assert found[line[0], line[2]] == pytest.approx([float(line[3]), float(line[4])], rel=1e-3, abs=0.05)


def test_the_head_is_that_of_the_job(tmp_path):
    for name in ("runs.csv", "weights.csv"):
        (tmp_path / name).write_text((DATA / "turbo_job" / name).read_text())
    more = (
        'machine = "fan 7"\ndate = 2026-03-17\n[sheet]\nplace = "hall <3>"\nengineer = "A. Rotor"\n'
        'zero = "top"\n'
    )
    (tmp_path / "job.toml").write_text('runs = "runs.csv"\nweights = "weights.csv"\n' + more)
    text, _, report, _ = sheet_of(tmp_path / "job.toml")
    assert "<h1>Balancing sheet: fan 7</h1>" in text
    row = cells(text, ("machine", "place"))[1]
    assert row == ["fan 7", "hall &lt;3&gt;", "2026-03-17", "A. Rotor", ""]
    assert text.index("A. Rotor") < text.index('id="judgement"') < text.index('id="weights"')
    # 0° at the top: the mark stands there, and the wanted weight a quarter of a turn further on
    for zero, turned in ((1.0, 0.0), (1j, 90.0)):
        ax = draw_plane(Figure().add_subplot(), report.result, "left", zero=zero)
        (mark,) = [complex(*line.get_xydata()[0]) for line in ax.lines]
        assert np.degrees(np.angle(mark)) == pytest.approx(turned)
        place = next(complex(*patch.center) for patch in ax.patches if patch.get_facecolor()[0] == 0.2)
        angle = (
            report.result.labels.weight(report.result.weights[0])[1] * report.result.labels.angles_on_paper
        )
        assert (np.degrees(np.angle(place)) - angle - turned) % 360 == pytest.approx(0, abs=1e-6)


def test_removal_slow_roll_radii_and_limits(tmp_path):
    text, sheet, report, job = sheet_of(hard(tmp_path))
    document = sheet.document
    row = next(row for row in document["corrections"] if row["plane"] == "middle")
    assert (row["remove_at_deg"] - row["angle_deg"]) % 360 == pytest.approx(180)
    head, *rows = cells(text, ("plane", "do"))
    at = {name: [line[head.index(name)] for line in rows] for name in ("do", "angle", "g at radius")}
    assert at["do"] == ["add", "take away", "add"]
    assert at["angle"][1] == f"{row['remove_at_deg']:.1f}°"
    assert float(at["g at radius"][1]) == pytest.approx(row["mass"] / 100, rel=1e-3)
    assert float(at["g at radius"][0]) == pytest.approx(document["corrections"][0]["mass"] / 120, rel=1e-3)
    assert at["g at radius"][2] == "–"
    # the file says 3.36 at 89° (lag): what is left has the slow roll taken off
    left = 3.36 * np.exp(1j * np.radians(89)) - 0.3 * np.exp(1j * np.radians(35))
    first = cells(text, ("rpm", "sensor", "baseline"))[1]
    assert float(first[2]) == pytest.approx(abs(left), rel=1e-3)
    assert float(first[3].rstrip("°")) == pytest.approx(np.degrees(np.angle(left)), abs=0.06)
    limits = [line[7] for line in cells(text, ("rpm", "sensor", "before"))[1:5]]
    assert limits == ["0.8000", "–", "60.00", "–"]
    assert document["verdict"]["verdict"] != "pass"
    assert job.key_phasor == -40.0
    assert "stands at 40° from x" in text
    assert report.result.remove == ("middle",)


def test_names_are_neither_formulas_nor_markup(tmp_path):
    for name in ("runs.csv", "weights.csv"):
        text = (
            (DATA / "left_in" / name)
            .read_text()
            .replace("probe 1", "A$_1$ <i>")
            .replace(",2,3.7", ",$<b>$,3.7")
        )
        (tmp_path / name).write_text(text)
    (tmp_path / "job.toml").write_text((DATA / "left_in" / "job.toml").read_text())
    text, sheet, report, _ = sheet_of(tmp_path / "job.toml")
    assert report.result.planes[1] == "$<b>$"
    assert "<b>" not in text[: text.index("<script")]
    assert "$&lt;b&gt;$" in text
    assert "A$_1$ &lt;i&gt;" in text
    assert sheet.document["residuals"][0]["sensor"] == "A$_1$ <i>"
    name = residual_figure(report.result).axes[-1].get_xticklabels()[0]
    assert name.get_text() == "A$_1$ <i>"
    assert not name.get_parse_math()


def test_the_readings_drawn_are_those_of_what_is_mounted(monkeypatch):
    drawn = []

    def draw(*of):
        drawn.append(residual_figure(*of))
        return drawn[0]

    monkeypatch.setattr("balancing.plots.residual_figure", draw)
    _, sheet, report, _ = sheet_of(DATA / "turbo_job" / "holes.toml", split=True)
    shown = [
        one | other
        for one, other in zip(
            sheet.document["residuals"], sheet.document["mounting"]["residuals"], strict=True
        )
    ]
    plain, closer = drawn[0].axes
    assert [bar.get_height() for bar in plain.patches] == pytest.approx([row["before"] for row in shown])
    dots = np.concatenate([line.get_xydata() for line in closer.lines])
    assert dots[np.argsort(dots[:, 0]), 1] == pytest.approx([row["after"] for row in shown])
    band = np.array(closer.collections[0].get_segments())[:, 1, 1]
    assert band == pytest.approx(np.add([row["after"] for row in shown], report.result.within.ravel()))


def test_no_piece_is_to_be_added_where_all_is_done(tmp_path):
    """A sheet with a piece to tick below "Done" would be mounted."""
    job = 'runs = "r.csv"\nweights = "w.csv"\ncheck = "c.csv"\nphase = "lag"\nangles = "against rotation"\n'
    job += "".join(f"[planes.{plane}]\nholes = 16\navailable_g = [5, 10, 20]\n" for plane in ("P1", "P2"))
    head = "run,speed_rpm,sensor,amplitude_mm_s_rms,phase_deg\n"
    rows = ["bare,1480,DE,6.2,120", "bare,1480,NDE,4.1,300", "t1,1480,DE,4.9,95", "t1,1480,NDE,4.4,290"]
    rows += ["t2,1480,DE,5.8,131", "t2,1480,NDE,2.9,330"]
    (tmp_path / "job.toml").write_text(job)
    (tmp_path / "r.csv").write_text(head + "\n".join(rows) + "\n")
    (tmp_path / "w.csv").write_text("run,plane,mass_g,angle_deg\nt1,P1,20,0\nt2,P2,20,90\n")
    (tmp_path / "c.csv").write_text(head + "check,1480,DE,1.0,80\ncheck,1480,NDE,0.8,200\n")
    outcome = balance(tmp_path / "job.toml", BalanceOptions(split=True))
    left = outcome.document["left_to_do"]
    assert (left["word"], left["holes"]) == ("done", [])
