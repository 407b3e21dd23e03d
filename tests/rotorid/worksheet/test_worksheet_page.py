"""The worksheet's page in a real browser, by keyboard alone: whole jobs, two windows, kill -9, axe.

Without Chromium the tests are skipped, and say which packages bring it; where CI=true it must be there.
"""

import shutil
import tomllib
from pathlib import Path

import pytest
from repetitions import FULL
from workbook_jobs import as_workbook
from worksheet.served import command
from worksheet.typed_job import rows, type_job
from worksheet.window import SPACE, Window

from rotorid.samples import sample_data

FINGER = 40  # pixels that a finger needs
SIZES = {1366: 768, 1024: 768, 800: 1280, 390: 844}
EXAMINED = {"new": [*SIZES], "holes.toml": [1366], "checked.toml": [800]}
"""Widths at which axe looks at a page, three seconds at a large one; `make test-full`: at all of them."""
if FULL:
    EXAMINED = {job: [*SIZES] for job in EXAMINED}
CELL = "runs|baseline|1220|probe 1|1|phase_deg"
FIRST = f'[id="{CELL}"]'

# Of what a finger should hit, the smaller side of it or of its label; what is out of sight is left out.
_TARGETS = """
return Array.from(document.querySelectorAll('button, a, input, select, summary')).map(e => {
  const box = (e.type === 'checkbox' || e.type === 'file' ? e.closest('label') : e).getBoundingClientRect();
  const name = `${e.tagName} ${e.id} ${e.textContent.trim().slice(0, 40)}`;
  return [name, Math.min(box.width, box.height), box.right];
}).filter(([, side, right]) => side > 0 && side < arguments[0] && right > 0);
"""
_AXE = """
const done = arguments[0];
axe.run().then(found => done(found.violations), e => done([{impact: 'none', id: String(e), nodes: []}]));
"""


@pytest.fixture
def windows(chromium):
    """Two, that both have the focus."""
    browsers = [chromium(0), chromium(1)]
    for one in browsers:
        one.resize(1366, 768)
    yield [Window(one) for one in browsers]
    for one in browsers:
        one.driver.get("about:blank")  # nobody asks a program that has ended


@pytest.mark.full
@pytest.mark.parametrize("name", ["bk_two_plane", "left_in"] if FULL else ["left_in"])
def test_a_job_typed_by_keyboard_from_an_empty_folder(tmp_path, serve, windows, name):
    folder, sample, window = tmp_path / "new", sample_data() / name, windows[0]
    folder.mkdir()
    served = serve(folder)
    visits = [window.open(served.address)]
    type_job(window, sample, 120)
    window.wait(window.numbers, "an answer")
    for field, text in (("load kg", "25"), ("speed rpm", "3000"), ("radius mm", "120")):
        window.type(f'#trial [name="{field}"]', text)
    window.push("#trial button")
    window.wait(lambda: window.texts("#trial-answer p"), "a trial weight")
    served.settled()
    window.wait(lambda: not window.text("#busy"), "all is computed")

    assert {path.name for path in folder.iterdir()} == {"job.toml", "runs.csv", "weights.csv"}
    settings = tomllib.loads((folder / "job.toml").read_text(encoding="utf-8"))
    planes = {plane: {"radius_mm": 120} for plane in ("1", "2")}
    stated = {"phase": "lead", "angles": "with rotation", "planes": planes}
    assert settings == {"runs": "runs.csv", "weights": "weights.csv", **stated}
    for table in ("runs.csv", "weights.csv"):
        typed, given = ([[*row.values()] for row in rows(place / table)] for place in (folder, sample))
        assert typed == [["baseline", *row[1:]] if row[0] == "initial" else row for row in given]

    shown = window.numbers()
    for k, row in enumerate(command(sample / "job.toml")["corrections"]):
        assert float(shown[f"corrections.{k}.mass"]) == pytest.approx(row["mass"], rel=5e-4)
        assert float(shown[f"corrections.{k}.angle_deg"][:-1]) == pytest.approx(row["angle_deg"], abs=0.0501)

    visits.append(window.browser.heard())
    asked = [url for visit in visits for url in visit.requests if not url.startswith(("data:", "blob:"))]
    assert len(asked) > 50
    assert [url for url in asked if not url.startswith(f"http://127.0.0.1:{served.port}/")] == []
    assert [line for visit in visits for line in visit.console] == []


@pytest.mark.full
@pytest.mark.parametrize("removed", [False, True])
def test_pieces_are_ticked_and_checked(tmp_path, serve, windows, removed):
    """The pieces of the answer, one of them not mounted, then the check run, as by Kelm."""
    folder, window = Path(shutil.copytree(sample_data() / "turbo_job", tmp_path / "job")), windows[0]
    job = folder / "holes.toml"
    for name in ("check.csv", "check_weights.csv"):  # those of another job
        (folder / name).unlink()
    turned = job.read_text(encoding="utf-8").replace("first_hole_deg = 0", "first_hole_deg = 7.5")
    if removed:
        turned = turned.replace("holes = 12", "remove = true\nholes = 12")
    job.write_text(turned, encoding="utf-8")
    window.open(serve(job).address)
    window.wait(lambda: "hole" in window.text("#check") and not window.text("#busy"), "the tick list")
    holes = command(job, "--split")["mounting"]["holes"]
    ticks = window.texts("#check label")
    assert len(ticks) == len(holes) > 2
    for line, row in zip(ticks, holes, strict=True):
        assert line.strip().startswith(f"{row['plane']}, hole {row['hole']}, ")
        assert ("take away" in line) == removed
        assert f"{row['angle_deg']:g}°" in line
        assert round(row["angle_deg"] % 1, 6) == 0.5
    shown = window.numbers()
    angles = [shown[f"mounting.holes.{k}.angle_deg"] for k in range(len(holes))]
    assert angles == [f"{row['angle_deg']:g}°" for row in holes]
    window.driver.execute_script("document.querySelector('#new-run input').focus()")
    window.push('#check [name="1"]', SPACE)
    window.push("#check form button")
    window.saved()
    window.wait(lambda: window.texts('[id^="check|"]'), "the check run")
    written = rows(folder / "check_weights.csv")
    mounted = [(row["plane"], float(row["unbalance_g_mm"]), float(row["angle_deg"])) for row in written]
    assert mounted == [(h["plane"], h["mass"], h["angle_deg"]) for k, h in enumerate(holes) if k != 1]
    assert {row.get("action") for row in written} == {"remove" if removed else None}
    window.type('[id^="check|"]', "4.1")
    window.leave()
    window.saved()
    assert rows(folder / "check.csv")[0]["amplitude_um_pp"] == "4.1"


@pytest.mark.full
def test_fields_of_a_trial_weight_are_kept(shared, windows):
    window, served = windows[0], shared()
    window.open(served.address)
    window.type('#trial [name="load kg"]', "50")
    window.leave()
    window.open(served.address)
    assert window.text('#trial [name="load kg"]') == "50"


@pytest.mark.full
def test_a_problem_stands_in_words_and_leads_to_its_cell(shared, windows):
    window = windows[0]
    window.open(shared().address)
    window.type(FIRST, "915")
    window.leave()
    words = "1 × phase of baseline: '915' stands here; expected"
    window.wait(lambda: words in "".join(window.texts("#problems li")), "the problem is told")
    window.push("#problems button")
    assert window.texts("[aria-invalid][aria-label*='915']:focus") == ["915"]


@pytest.mark.full
def test_two_who_type_into_one_cell_are_asked(shared, windows):
    window, served = windows[0], shared()
    window.open(served.address)
    window.type(FIRST, "12")
    assert served.type(CELL, "77")[0] == 200
    window.leave()
    window.wait(lambda: window.texts("#conflicts p"), "the question")
    assert "wrote “77” here; you typed “12”" in window.text("#conflicts p")
    window.push("#conflicts [data-mine]")
    window.wait(lambda: not window.texts("#conflicts p"), "it is answered")
    assert served.state()["cells"][CELL] == "12"


@pytest.mark.full
def test_a_workbook_cannot_be_typed_into(tmp_path, serve, windows):
    windows[0].open(
        serve(as_workbook(sample_data() / "turbo_job" / "job.toml", tmp_path / "job.xlsx")).address
    )
    assert len(windows[0].texts("input.cell:disabled")) == len(windows[0].texts("input.cell")) > 100


@pytest.mark.full
def test_a_block_from_excel_is_one_step(shared, windows):
    window, path = windows[0], shared().job.parent / "runs.csv"
    before = path.read_bytes()
    window.open(shared().address)
    window.go(FIRST.replace("probe 1", "probe 2").replace("phase_deg", "amplitude_um_pp"))
    window.paste("µm pp\t°\tµm pp\t°\r\n3,5\t91\t9,5\t93\r\n4,5\t279\t11,25\t277\r\n")
    window.wait(lambda: window.text(FIRST.replace("probe 1", "probe 3")) == "93", "the block is there")
    window.saved()
    cell = FIRST.replace("probe 1", "probe 3").replace("phase_deg", "amplitude_um_pp")
    window.wait(lambda: window.text(cell) == "9.5", "as the file writes it")
    lines = path.read_text().splitlines()
    assert [lines[k] for k in (2, 3, 6, 7)] == [
        "baseline,1220,probe 2,3.5,91",
        "baseline,1220,probe 3,9.5,93",
        "baseline,1360,probe 2,4.5,279",
        "baseline,1360,probe 3,11.25,277",
    ]
    window.push('[data-do="undo"]')
    window.wait(lambda: window.text(cell) == "9.75", "one step takes it back")
    window.saved()
    assert path.read_bytes() == before


@pytest.mark.full
@pytest.mark.parametrize("job", ["new", "holes.toml", "checked.toml"])
def test_nothing_sticks_out_and_axe_finds_nothing_serious(tmp_path, serve, shared, windows, job):
    axe = Path(pytest.importorskip("axe_core_python").__file__).parent / "axe.min.js"
    window = windows[0]
    if job == "new":
        (tmp_path / "new").mkdir()
    served = serve(tmp_path / "new") if job == "new" else shared(job)
    window.open(served.address)
    if job != "new":
        window.wait(lambda: window.numbers() and not window.text("#busy"), "all is computed")
        window.wait(lambda: window.texts("#overview svg"), "the picture")
    window.driver.execute_script(axe.read_text(encoding="utf-8"))
    for width, height in SIZES.items():
        window.browser.resize(width, height)
        assert window.browser.widths() == (width, width), window.browser.too_wide()
        found = window.driver.execute_async_script(_AXE) if width in EXAMINED[job] else []
        serious = [one for one in found if one["impact"] not in ("minor", "moderate")]
        assert [(one["id"], [node["html"][:200] for node in one["nodes"]]) for one in serious] == []
        if width < 1366:
            assert window.driver.execute_script(_TARGETS, FINGER) == []
