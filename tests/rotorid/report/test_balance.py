"""The balancing sheet: its numbers are those of the document, and it can be used without the program."""

import json
import re

import numpy as np
import pytest
from balance_sheets import DATA, hard, on_top, parts_of, sheet_of
from sheets import disagreements

from balancing.plots import residual_figure
from rotorid.report import balance
from rotorid.report.balance_figures import plane_figure

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
    assert len(sheet.shown) > 30
    assert disagreements(sheet.shown, sheet.document) == []


def test_the_document_inside_is_that_of_the_command(made):
    _, sheet, report, _ = made
    inside = dict(sheet.document)
    assert inside.pop("provenance")["program"] == "rotorid"
    assert inside.pop("schema_version") == 1
    inside.pop("sheet")
    assert inside == json.loads(json.dumps(report.to_dict()))


def test_nothing_of_the_result_is_left_out(made):
    _, sheet, report, _ = made
    keys = sheet.keys
    document, result = sheet.document, report.result
    S, C = result.before.shape
    for i, row in enumerate(document["sheet"]["residuals"]):
        assert {f"sheet.residuals.{i}.{k}" for k in ("before", "before_phase_deg", "after")} <= keys
        assert (f"sheet.residuals.{i}.within_95" in keys) == (row["within_95"] is not None)
        assert (row["limit"] is None) or f"sheet.residuals.{i}.limit" in keys
    assert len(document["sheet"]["residuals"]) == S * C
    for i in range(len(result.planes)):
        assert {f"corrections.{i}.mass", f"sheet.corrections.{i}.place_deg"} <= keys
        if result.region_known and report.mounted is None:
            assert f"sheet.corrections.{i}.mass_95" in keys
    part = "left_to_do" if "left_to_do" in document else "mounting"
    for i in range(len(document.get(part, {"holes": []})["holes"])):
        assert {f"{part}.holes.{i}.mass", f"{part}.holes.{i}.angle_deg"} <= keys
    for i in range(len(document.get("verdict", {"rows": []})["rows"])):
        assert {f"verdict.rows.{i}.size", f"verdict.rows.{i}.limit"} <= keys
    for i in range(len(document.get("check", {"readings": []})["readings"])):
        assert {f"check.readings.{i}.predicted", f"check.readings.{i}.achieved"} <= keys


def test_it_refers_to_nothing_outside_and_ids_are_unique(made):
    text, sheet, _, _ = made
    assert text.count("http") == text.count('xmlns="http://www.w3.org/2000/svg"') >= 4
    assert len(sheet.ids) == len(set(sheet.ids))
    assert set(sheet.references) - {"data:,"} <= {f"#{name}" for name in sheet.ids}


def test_a_job_as_its_files_have_it():
    text, sheet, _, _ = sheet_of(DATA / "bk_two_plane" / "job.toml")
    assert "<h1>Balancing sheet: bk_two_plane</h1>" in text
    runs = sheet.document["sheet"]["runs"]
    rows = [line.split(",") for line in (DATA / "bk_two_plane" / "runs.csv").read_text().splitlines()]
    rows = [row for row in rows if not row[0].startswith("#") and row[0] != "run"]
    found = [
        (run["run"], r["speed_rpm"], r["sensor"], v["amplitude"], v["phase_deg"])
        for run in runs
        for r in run["readings"]
        for v in r["values"]
    ]
    assert len(found) == len(rows)
    for (run, speed, sensor, size, phase), row in zip(found, rows, strict=True):
        assert (run, sensor) == (row[0], row[2])
        assert (speed, size, phase) == pytest.approx([float(row[k]) for k in (1, 3, 4)], rel=1e-12)


def test_removal_slow_roll_radii_and_limits(tmp_path):
    text, sheet, report, job = sheet_of(hard(tmp_path))
    own, document = sheet.document["sheet"], sheet.document
    middle = next(i for i, row in enumerate(document["corrections"]) if row["plane"] == "middle")
    row = document["corrections"][middle]
    assert own["corrections"][middle]["place_deg"] == pytest.approx(row["remove_at_deg"], abs=1e-9)
    assert (row["remove_at_deg"] - row["angle_deg"]) % 360 == pytest.approx(180)
    assert own["corrections"][middle]["mass_at_radius"] == pytest.approx(row["mass"] / 100)
    assert own["corrections"][0]["mass_at_radius"] == pytest.approx(document["corrections"][0]["mass"] / 120)
    assert own["corrections"][2]["mass_at_radius"] is None
    assert '>middle</td><td data-label="do">take away</td>' in text
    assert own["slow_roll"][0]["amplitude"] == pytest.approx(0.3)
    assert own["slow_roll"][0]["phase_deg"] == pytest.approx(35)
    # the file says 3.36 at 89° (lag): what is left has the slow roll taken off
    left = 3.36 * np.exp(1j * np.radians(89)) - 0.3 * np.exp(1j * np.radians(35))
    first = own["runs"][0]["readings"][0]["values"][0]
    assert first["amplitude"] * np.exp(1j * np.radians(first["phase_deg"])) == pytest.approx(left, rel=1e-9)
    assert own["machine"]["planes"][2]["forbidden_deg"] == [[20.0, 60.0]]
    assert own["machine"]["planes"][2]["max_weight"] == pytest.approx(500)
    assert [own["residuals"][k]["limit"] for k in range(4)] == pytest.approx([0.8, None, 60.0, None])
    assert document["verdict"]["verdict"] != "pass"
    assert "seen from the drive end, where the rotor turns clockwise" in text
    assert "phase read" in text
    assert "phase as lag" in text
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
    _, sheet, *_ = sheet_of(DATA / "turbo_job" / "holes.toml", split=True)
    shown = sheet.document["sheet"]["residuals"]
    plain, closer = drawn[0].axes
    assert [bar.get_height() for bar in plain.patches] == pytest.approx([row["before"] for row in shown])
    dots = np.concatenate([line.get_xydata() for line in closer.lines])
    assert dots[np.argsort(dots[:, 0]), 1] == pytest.approx([row["after"] for row in shown])
    band = np.array(closer.collections[0].get_segments())[:, 1, 1]
    assert band == pytest.approx([row["after"] + row["within_95"] for row in shown])


def test_pieces_are_drawn_in_their_holes():
    from matplotlib.patches import Circle

    _, report = parts_of(DATA / "turbo_job" / "holes.toml", split=True)
    for plane in report.result.planes:
        drawn = plane_figure(report.result, plane, mounted=report.mounted)
        full = [
            p for p in drawn.axes[0].patches if isinstance(p, Circle) and p.get_facecolor()[:3] == (0.2,) * 3
        ]
        rows = [row for row in report.mounted.to_dict()["holes"] if row["plane"] == plane]
        angles = sorted(np.degrees(np.angle(complex(*p.center))) % 360 for p in full)
        assert angles == pytest.approx(sorted(row["angle_deg"] for row in rows), abs=1e-6)


@pytest.mark.parametrize(
    ("phase", "angles", "turn"),
    [
        ("lead", "with rotation", "is added to"),
        ("lag", "with rotation", "is taken from"),
        ("lead", "against rotation", "is taken from"),
        ("lag", "against rotation", "is added to"),
    ],
)
def test_how_angles_and_phases_go_together(phase, angles, turn):
    _, report = parts_of(DATA / "turbo_job" / "job.toml", phase=phase, angles=angles)
    assert balance._turn(report.result) == turn


def test_after_a_check_run_nothing_is_mounted_twice():
    text, _, _, _ = sheet_of(DATA / "turbo_job" / "checked.toml")
    words = re.sub(r"\s+", " ", text)
    assert "Check run: predicted and achieved" in words
    assert "not to be mounted now" in words
    assert "Remove every trial weight and every weight of the runs" not in words
    before, _, _, _ = sheet_of(DATA / "turbo_job" / "job.toml")
    assert "Remove every trial weight and every weight of the runs" in re.sub(r"\s+", " ", before)
