"""JobFiles: an edit changes its cell alone, nothing of another program is lost, every step can be undone."""

import codecs
import itertools
import os
import shutil
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rotorid.files import table_writing
from rotorid.files.columns import read_grid
from rotorid.files.problems import InputError, Problems
from rotorid.tables import read_job
from rotorid.worksheet.job_files import Conflict, JobFiles

pytest.importorskip("tomlkit", reason="without the extra rotorid[worksheet]")

TURBO = Path(__file__).resolve().parents[3] / "sample_data" / "turbo_job"
FILES = ("checked.toml", "runs.csv", "weights.csv", "check.csv", "check_weights.csv")
HEADER = ["run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"]
MARKS = {"utf-8": b"", "utf-8-sig": codecs.BOM_UTF8, "utf-16-le": codecs.BOM_UTF16_LE}
MARKS |= {"utf-16-be": codecs.BOM_UTF16_BE, "cp1251": b"", "cp1252": b""}
WORDS = {"cp1252": "Läufer prüfen", "cp1251": "пуск машины"}
pytestmark = pytest.mark.filterwarnings("ignore:.*not UTF-8")


@pytest.fixture
def turbo(tmp_path):
    for name in FILES:
        shutil.copy(TURBO / name, tmp_path / name)
    return tmp_path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def rows(job, table="runs"):
    return job.state()["tables"][table]["rows"]


def cell(job, place=0, column="phase_deg", new="90", table="runs"):
    row = rows(job, table)[place]
    header = job.state()["tables"][table]["header"]
    return {
        "table": table,
        "row": row["id"],
        "column": column,
        "old": row["cells"][header.index(column)],
        "new": new,
    }


def plain_job(folder, text, encoding="utf-8"):
    (folder / "job.toml").write_text('runs = "runs.csv"\n', encoding="utf-8")
    data = text if isinstance(text, bytes) else text.encode(encoding)
    (folder / "runs.csv").write_bytes(data)
    return JobFiles(folder)


@st.composite
def tables(draw):
    """A file as parts that are joined, and which of its cells to change."""
    encoding = draw(st.sampled_from(sorted(MARKS)))
    separator = draw(st.sampled_from([",", ";", "\t"]))
    sign = "." if separator == "," else draw(st.sampled_from([".", ","]))
    padded = draw(st.sampled_from(["{}", " {}", "{} "] if separator != "\t" else ["{}"]))
    names = st.sampled_from(['"trial; 1, a"', "baseline", '"a ""b"""', "#2", "7", WORDS.get(encoding, "Ω µ")])
    size = st.floats(0, 500).map(lambda x: padded.format(f"{x:.2f}".replace(".", sign)))
    whole = st.integers(0, 359).map(str)
    row = st.tuples(names, st.integers(100, 999).map(str), names, size, whole).map(list)
    cells = draw(st.lists(row, min_size=1, max_size=5))
    cells = [line + [""] * draw(st.integers(0, 2)) for line in cells]
    ends = st.sampled_from(draw(st.sampled_from([["\n"], ["\r\n"], ["\n", "\r\n", "\r"]])))
    above = [f"# {WORDS.get(encoding, 'Ω')} of today", *draw(st.sampled_from([[], [""], ["# two"]]))]
    above = ([f"sep={separator}"] if draw(st.booleans()) else []) + above
    below = [draw(st.sampled_from(["# a remark", ""])) for _ in cells]
    last = draw(st.sampled_from(["", "\n"]))
    eols = [draw(ends) for _ in range(len(above) + 1 + 2 * len(cells))]
    place = (draw(st.integers(0, len(cells) - 1)), draw(st.integers(0, 4)))
    return encoding, separator, sign, cells, above, below, last, eols, place


def joined(encoding, separator, cells, above, below, last, eols):
    body = itertools.chain(*zip((separator.join(line) for line in cells), below, strict=True))
    lines = [*above, separator.join(HEADER), *body]
    text = "".join(line + end for line, end in zip(lines, eols, strict=True))
    return MARKS[encoding] + (text.rstrip("\r\n") + last).encode(encoding.removesuffix("-sig"))


@given(parts=tables(), typed=st.sampled_from(["12.5", "12,5", "-3,25", "88", "probe", "=1+1", 'a "b', "x;y"]))
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_an_edit_changes_the_bytes_of_its_cell_alone(tmp_path, parts, typed):
    encoding, separator, sign, cells, above, below, last, eols, (line, column) = parts
    job = plain_job(tmp_path, joined(encoding, separator, cells, above, below, last, eols))
    assert not job.state()["tables"]["runs"]["read_only"]
    job.apply([cell(job, line, HEADER[column], typed)])
    old = cells[line][column]
    number = typed.strip("-").replace(",", ".").replace(".", "").isdigit() and column in (1, 3, 4)
    written = typed
    if number:
        file_sign = sign if any(sign in row[3] for row in cells) else written
        written = typed.replace(",", ".").replace(".", file_sign)
    if old != typed:
        bare = written if number or typed[0] not in "=-" else f" {written}"
        quoted = old.startswith('"') or any(sign in written for sign in (separator, '"'))
        if quoted:
            new = '"' + bare.replace('"', '""') + '"'
        else:
            before = old[: len(old) - len(old.lstrip())]
            new = before + (bare.lstrip() if before else bare) + old[len(old.rstrip()) :]
        cells[line][column] = new
    expected = joined(encoding, separator, cells, above, below, last, eols)
    assert (tmp_path / "runs.csv").read_bytes() == expected
    grid = read_grid(tmp_path / "runs.csv", "runs", Problems(), may_be_empty=True)
    assert grid.rows[line][1][column] == written
    assert rows(job)[line]["row"] == grid.rows[line][0]
    job.undo()
    assert rows(job)[line]["cells"][column] != typed or old == typed


def test_numbers_that_may_have_thousands_stay_as_typed_and_are_refused(tmp_path):
    job = plain_job(tmp_path, "run,speed_rpm,sensor,amplitude,phase_deg\na,1200,s,1.5,3\n")
    job.apply([cell(job, 0, "speed_rpm", "1,350")])
    assert rows(job)[0]["cells"][1] == "1,350"
    with pytest.raises(InputError, match="speed_rpm"):
        read_job(tmp_path / "job.toml")


def test_a_character_that_the_encoding_lacks_is_refused(tmp_path):
    job = plain_job(tmp_path, "run,speed_rpm,sensor,amplitude,phase_deg\nпуск,1200,s,1.5,3\n", "cp1251")
    before = contents(tmp_path)
    with pytest.raises(ValueError, match=r"cp1251.*'é'.*UTF-8"):
        job.apply([cell(job, 0, "sensor", "é")])
    assert contents(tmp_path) == before


def test_comments_and_order_of_settings_stay(turbo):
    job = JobFiles(turbo)
    old = (turbo / "checked.toml").read_text(encoding="utf-8").splitlines()
    job.apply(
        [
            {"key": ["phase"], "old": "lead", "new": "lag"},
            {"key": ["view"], "old": None, "new": "driven end"},
            {"key": ["errors", "floor"], "old": None, "new": 0.5},
            {"key": ["planes", "left", "taken"], "old": None, "new": {"3": 10}},
        ]
    )
    new = (turbo / "checked.toml").read_text(encoding="utf-8").splitlines()
    assert [line for line in old if line not in new] == ['phase = "lead"']
    expected = ['phase = "lag"', 'view = "driven end"', "floor = 0.5", "[planes.left]", "taken = {3 = 10}"]
    assert [line for line in new if line and line not in old] == expected
    assert new[new.index('view = "driven end"') - 1] == 'angles = "with rotation"'
    assert [line for line in new if line in old and line] == [line for line in old if line in new and line]


@pytest.mark.parametrize(
    ("text", "key", "new", "added"),
    [
        ("", ["planes", "a b", "holes"], 12, '[planes."a b"]\nholes = 12\n'),
        ("runs = 'r'\r\n[errors]\r\nfloor = 1\r\n", ["phase"], "lag", 'phase = "lag"\r\n'),
        ("[errors] # stated\n# none\n", ["errors", "floor"], 2, "floor = 2\n"),
        ("planes = { a = { holes = 3 } }\n", ["planes", "a", "use"], False, ", use = false"),
        ("errors.floor = 1\n", ["errors", "phase_deg"], 2, "errors.phase_deg = 2\n"),
        (
            "[planes.a]\nholes = 3\n# of b\n[planes.b]\nholes = 4",
            ["planes", "c", "holes"],
            5,
            "\n\n[planes.c]\nholes = 5",
        ),
        (
            "[planes.a]\nholes = 3\n[errors]\nfloor = 1\n[planes.b]\nholes = 4\n",
            ["planes", "c", "holes"],
            5,
            "\n[planes.c]\nholes = 5\n",
        ),
    ],
)
def test_a_setting_is_added_to_files_of_all_forms(tmp_path, text, key, new, added):
    path = tmp_path / "job.toml"
    path.write_bytes(text.encode())
    job = JobFiles(path)
    job.apply([{"key": key, "old": None, "new": new}])
    found = path.read_bytes().decode()
    assert added in found
    assert found.replace(added, "", 1).replace(" ", "") == text.replace(" ", "")
    inner = job.state()["settings"]
    for part in key:
        inner = inner[part]
    assert inner == new
    job.undo()
    assert path.read_bytes() == text.encode()


def test_steps_over_several_files_go_back_and_forth_to_the_same_bytes(turbo):
    job = JobFiles(turbo)
    versions, states = [contents(turbo)], [job.state()["tables"]]
    for k in range(4):
        last = rows(job)[-1]
        job.apply(
            [
                cell(job, k, new=f"{k + 1}.5"),
                {"table": "weights", "after": None, "cells": {"run": f"w{k}", "plane": "left"}},
                {"table": "runs", "delete": last["id"], "old": last["cells"]},
                {"key": ["planes", "left", "radius_mm"], "old": 99 + k if k else None, "new": 100 + k},
            ]
        )
        versions.append(contents(turbo))
        states.append(job.state()["tables"])
    for k in (3, 2, 1, 0):
        job.undo()
        assert contents(turbo) == versions[k]
        assert job.state()["tables"] == states[k]
    with pytest.raises(ValueError, match="nothing to undo"):
        job.undo()
    for k in (1, 2, 3, 4):
        job.redo()
        assert contents(turbo) == versions[k]
        assert job.state()["tables"] == states[k]
    with pytest.raises(ValueError, match="nothing to redo"):
        job.redo()
    assert job.look() == []


def test_an_undo_after_a_change_from_outside_is_refused(turbo):
    job = JobFiles(turbo)
    job.apply([cell(job)])
    text = (turbo / "runs.csv").read_text(encoding="utf-8")
    (turbo / "runs.csv").write_text(text.replace("3.36", "3.37"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"runs\.csv was changed by another program"):
        job.undo()
    assert "3.37" in (turbo / "runs.csv").read_text(encoding="utf-8")
    assert job.look() == ["runs.csv"]
    assert job.look() == []


def test_ids_stay_when_rows_come_and_go(turbo):
    job = JobFiles(turbo)
    before = {row["id"]: row["cells"] for row in rows(job)}
    third, fifth = rows(job)[2], rows(job)[4]
    (made,) = job.apply([{"table": "runs", "after": third["id"], "cells": {"run": "new"}}])
    job.apply([{"table": "runs", "delete": fifth["id"], "old": fifth["cells"]}])
    assert [row["id"] for row in rows(job)][2:5] == [third["id"], made, rows(job)[4]["id"]]
    lines = (turbo / "runs.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    lines[1] = lines[1].replace(",89", ",91")
    lines[8:9] = ["outside,1,2,3,4\n", "# between\n", lines[8]]
    (turbo / "runs.csv").write_text("".join(lines), encoding="utf-8")
    assert job.look() == ["runs.csv"]
    after = {row["id"]: row["cells"] for row in rows(job)}
    assert set(before) - set(after) == {fifth["id"]}
    assert len(set(after) - set(before)) == 2
    changed = [key for key in after if key in before and after[key] != before[key]]
    assert changed == [rows(job)[0]["id"]]


def test_two_windows_see_each_other_and_conflict_only_in_one_cell(turbo):
    one, two = JobFiles(turbo), JobFiles(turbo)
    mine, other, same = cell(one), cell(two, 1), cell(two, new="77")
    one.apply([mine])
    two.apply([other])
    assert two.look() == ["runs.csv"]
    assert [row["cells"][-1] for row in rows(two)][:2] == ["90", "90"]
    before = contents(turbo)
    with pytest.raises(Conflict, match="phase_deg") as caught:
        two.apply([{"key": ["phase"], "old": "lead", "new": "lag"}, same])
    assert caught.value.now == "90"
    assert contents(turbo) == before
    two.apply([{**same, "new": "90"}])
    with pytest.raises(Conflict) as caught:
        two.apply([{"key": ["phase"], "old": "other", "new": "lag"}])
    assert caught.value.now == "lead"


def test_a_change_between_reading_and_replacing_is_not_lost(turbo, monkeypatch):
    job, real, seen = JobFiles(turbo), os.fsync, []

    def fsync(number):
        real(number)
        if not seen:
            seen.append(number)
            text = (turbo / "runs.csv").read_text(encoding="utf-8")
            (turbo / "runs.csv").write_text(text.replace("3.36", "3.37"), encoding="utf-8")

    monkeypatch.setattr(table_writing.os, "fsync", fsync)
    job.apply([cell(job)])
    assert rows(job)[0]["cells"] == ["baseline", "1220", "probe 1", "3.37", "90"]
    assert "3.37,90" in (turbo / "runs.csv").read_text(encoding="utf-8")
    assert job.look() == ["runs.csv"]


def test_nobody_sees_half_a_file(turbo, monkeypatch):
    job, before, seen = JobFiles(turbo), contents(turbo), []
    real = Path.replace

    def replace(self, target):
        seen.append((contents(turbo)["runs.csv"], self.read_bytes()))
        return real(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    job.apply([cell(job)])
    assert seen == [(before["runs.csv"], (turbo / "runs.csv").read_bytes())]
    assert set(contents(turbo)) == set(before)


def test_an_empty_folder_becomes_a_job(tmp_path):
    job = JobFiles(tmp_path)
    state = job.state()
    assert (state["job"], state["exists"], state["tables"], state["settings"]) == ("job.toml", False, {}, {})
    assert contents(tmp_path) == {}
    job.apply([{"create": "runs", "header": HEADER}, {"table": "runs", "after": None, "cells": {"run": "Ω"}}])
    assert (tmp_path / "job.toml").read_text(encoding="utf-8") == 'runs = "runs.csv"\n'
    assert (tmp_path / "runs.csv").read_text(encoding="utf-8-sig") == f"{','.join(HEADER)}\nΩ,,,,\n"
    assert JobFiles(tmp_path).state()["exists"]
    with pytest.raises(ValueError, match="runs"):
        job.apply([{"create": "runs", "header": HEADER}])
    job.undo()
    assert contents(tmp_path) == {}


def test_files_outside_the_folder_are_neither_read_nor_written(turbo, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside") / "runs.csv"
    shutil.copy(turbo / "runs.csv", outside)
    for name in (outside.as_posix(), f"../{outside.parent.name}/runs.csv", "link.csv"):
        (turbo / "job.toml").write_text(f'runs = "{name}"\n', encoding="utf-8")
        if name == "link.csv":
            (turbo / name).symlink_to(outside)
        job = JobFiles(turbo / "job.toml")
        table = job.state()["tables"]["runs"]
        assert table["rows"] == []
        assert "not in the folder" in table["read_only"]
        with pytest.raises(ValueError, match="not in the folder"):
            job.apply([{"table": "runs", "after": None, "cells": {"run": "x"}}])
    assert outside.read_bytes() == (turbo / "runs.csv").read_bytes()


def test_a_job_file_that_is_broken_meanwhile_is_told_and_its_rows_keep_their_ids(turbo):
    job = JobFiles(turbo)
    ids, good = [row["id"] for row in rows(job)], (turbo / "checked.toml").read_bytes()
    (turbo / "checked.toml").write_bytes(good + b"phase = \n")
    assert job.look() == ["checked.toml"]
    assert "checked.toml cannot be read" in job.state()["read_only"]
    with pytest.raises(ValueError, match="cannot be read"):
        job.apply([{"key": ["view"], "old": None, "new": "driven end"}])
    (turbo / "checked.toml").write_bytes(good)
    assert job.look() == ["checked.toml"]
    assert [row["id"] for row in rows(job)] == ids


@pytest.mark.parametrize(
    "edit", [{}, {"table": "none", "row": "1"}, {"table": "runs"}, {"create": "../x", "header": []}]
)
def test_edits_of_unknown_forms_are_refused(turbo, edit):
    job, before = JobFiles(turbo), contents(turbo)
    with pytest.raises(ValueError, match=r"edit|table"):
        job.apply([edit])
    assert contents(turbo) == before


@pytest.mark.parametrize("last", ["", "\r\n"])
def test_rows_come_and_go_at_the_end_of_a_file_as_it_ends(tmp_path, last):
    text = "run;speed_rpm;sensor;amplitude;phase_deg;;\r\na;1200;s;1,5 ;3\r\n# end"
    job = plain_job(tmp_path, text.removesuffix("\r\n# end") + last)
    (made,) = job.apply([{"table": "runs", "after": None, "cells": {"run": "b", "amplitude": "2.25"}}])
    start = text.removesuffix("# end")
    assert (tmp_path / "runs.csv").read_bytes().decode() == f"{start}b;;;2,25;;;{last}"
    job.apply([cell(job, 0, "amplitude", "2.5")])
    assert (tmp_path / "runs.csv").read_bytes().decode() == f"{start}b;;;2,25;;;{last}".replace(
        "1,5 ", "2,5 "
    )
    job.apply([{"table": "runs", "delete": made}])
    assert (tmp_path / "runs.csv").read_bytes().decode() == start.rstrip().replace("1,5 ", "2,5 ") + last


def test_a_new_row_ends_as_the_one_above(tmp_path):
    job = plain_job(tmp_path, b"run,speed_rpm,sensor,amplitude,phase_deg\na,1,s,1,3\r\nb,1,s,1,3\n")
    job.apply([{"table": "runs", "after": rows(job)[0]["id"], "cells": {"run": "c"}}])
    assert (tmp_path / "runs.csv").read_bytes().splitlines(keepends=True)[2] == b"c,,,,\r\n"
    assert (tmp_path / "runs.csv").read_bytes().splitlines(keepends=True)[1] == b"a,1,s,1,3\r\n"


def test_a_change_that_leaves_time_and_size_is_seen(turbo):
    job, path = JobFiles(turbo), turbo / "runs.csv"
    assert job.look() == []
    found = path.stat()
    path.write_bytes(path.read_bytes().replace(b"3.36", b"3.37"))
    os.utime(path, ns=(found.st_atime_ns, found.st_mtime_ns))
    assert job.look() == ["runs.csv"]
    assert rows(job)[0]["cells"][3] == "3.37"


def test_no_file_is_changed_where_one_cannot_be(turbo, monkeypatch):
    job, before, real, seen = JobFiles(turbo), contents(turbo), Path.replace, []

    def replace(self, target):
        seen.append(target)
        if len(seen) == 2:
            raise PermissionError(13, "in use")
        return real(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(ValueError, match="is open in Excel"):
        job.apply([{"key": ["phase"], "old": "lead", "new": "lag"}, cell(job)])
    assert len(seen) == 3
    assert contents(turbo) == before
    assert job.look() == []


def test_a_step_that_fails_at_its_last_file_leaves_none_of_the_others(tmp_path, monkeypatch):
    """The table of the check run is made, then the job, which names it, cannot be replaced."""
    job = plain_job(tmp_path, "run,speed_rpm,sensor,amplitude,phase_deg\nbase,1000,A,1,2\n")
    before, real = contents(tmp_path), Path.replace

    def replace(self, target):
        if target.name == "job.toml":
            raise PermissionError(13, "in use")
        return real(self, target)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", replace)
        with pytest.raises(ValueError, match=r"^job\.toml is open in Excel"):
            job.apply([{"create": "check", "header": HEADER}])
    assert contents(tmp_path) == before
    assert job.look() == []
    job.apply([{"create": "check", "header": HEADER}])
    assert contents(tmp_path).keys() - before.keys() == {"check.csv"}


@pytest.mark.parametrize("name", ["~$runs.csv", ".~lock.runs.csv#"])
def test_a_file_that_is_open_elsewhere_stays(turbo, name):
    job = JobFiles(turbo)
    (turbo / name).write_text("", encoding="utf-8")
    before = contents(turbo)
    with pytest.raises(ValueError, match=r"runs\.csv is open in .*close it there"):
        job.apply([{"key": ["phase"], "old": "lead", "new": "lag"}, cell(job)])
    assert contents(turbo) == before
    (turbo / name).unlink()
    job.apply([cell(job)])


def test_several_jobs_and_none_are_told(turbo):
    shutil.copy(turbo / "checked.toml", turbo / "other.toml")
    with pytest.raises(ValueError, match=r"checked\.toml and other\.toml"):
        JobFiles(turbo)
    assert JobFiles(turbo / "other.toml").state()["job"] == "other.toml"
    for wrong in (turbo / "none" / "job.toml", turbo / "none.xlsx", turbo / "runs.csv"):
        with pytest.raises(ValueError, match=wrong.name):
            JobFiles(wrong)


def test_tables_of_other_forms_are_shown_but_not_edited(tmp_path):
    job = plain_job(tmp_path, "Speed (rpm);Ampl;Phase\n1200;3,5;20\n")
    table = job.state()["tables"]["runs"]
    assert table["rows"][0]["cells"] == ["1200", "3,5", "20"]
    with pytest.raises(ValueError, match="other columns"):
        job.apply([cell(job, 0, "Ampl", "4")])
