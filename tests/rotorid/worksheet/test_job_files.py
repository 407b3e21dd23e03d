"""JobFiles: an edit changes its row alone, nothing of another program is lost, every step can be undone."""

import codecs
import os
import shutil
import time
import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rotorid.files import disk
from rotorid.files.columns import read_grid
from rotorid.files.input_problems import InputError, Problems
from rotorid.files.job import read_job
from rotorid.worksheet.job_files import JobFiles
from rotorid.worksheet.job_text import Conflict

pytest.importorskip("tomlkit", reason="without the extra rotorid[worksheet]")

TURBO = Path(__file__).resolve().parents[3] / "sample_data" / "turbo_job"
FILES = ("checked.toml", "runs.csv", "weights.csv", "check.csv", "check_weights.csv")
HEADER = ["run", "speed_rpm", "sensor", "amplitude_um_pp", "phase_deg"]
MARKS = {"utf-8": b"", "utf-8-sig": codecs.BOM_UTF8, "utf-16-le": codecs.BOM_UTF16_LE, "cp1251": b""}
pytestmark = pytest.mark.filterwarnings("ignore:.*not UTF-8")


@pytest.fixture
def turbo(tmp_path):
    for name in FILES:
        shutil.copy(TURBO / name, tmp_path / name)
    return tmp_path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def tables_of(job):
    """Header and rows of each table, as it is shown."""
    return {key: (list(one.header), rows(job, key)) for key, one in job.now.tables.items()}


def rows(job, table="runs"):
    return [{"id": one.id, "cells": [*one.cells.values()]} for one in job.now.tables[table].rows()]


def cell(job, place=0, column="phase_deg", new="90", table="runs"):
    row = rows(job, table)[place]
    old = row["cells"][job.now.tables[table].header.index(column)]
    return {"cell": f"{table}|{row['id']}|{column}", "old": old, "new": new}


def plain_job(folder, text, encoding="utf-8"):
    (folder / "job.toml").write_text('runs = "runs.csv"\n', encoding="utf-8")
    (folder / "runs.csv").write_bytes(MARKS[encoding] + text.encode(encoding.removesuffix("-sig")))
    return JobFiles(folder)


@st.composite
def tables(draw):
    """Encoding, end of lines, and lines of a file with two rows below a comment."""
    encoding, end = draw(st.sampled_from(sorted(MARKS))), draw(st.sampled_from(["\n", "\r\n"]))
    separator = draw(st.sampled_from([",", ";", "\t"]))
    sign = "." if separator == "," else draw(st.sampled_from([".", ","]))
    names = st.sampled_from(['"trial; 1, a"', "baseline", '"a ""b"""', "7", "пуск"])
    size = st.floats(0, 500).map(lambda x: f"{x:.2f}".replace(".", sign))
    row = st.tuples(names, st.integers(100, 999).map(str), names, size, st.integers(0, 359).map(str))
    lines = ["# пуск машины", *(separator.join(line) for line in (HEADER, draw(row), draw(row)))]
    return encoding, end, [*lines, *draw(st.sampled_from([[""], ["# end", ""], []]))]


@given(
    parts=tables(),
    typed=st.sampled_from(["12.5", "12,5", "-3,25", "88", "probe", "=1+1", 'a "b', "x;y", "#2", "é"]),
    column=st.integers(0, 4),
)
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_an_edit_changes_its_row_alone(tmp_path, parts, typed, column):
    encoding, end, lines = parts
    job = plain_job(tmp_path, end.join(lines), encoding)
    before = (tmp_path / "runs.csv").read_bytes()
    held = [row["cells"] for row in rows(job)]
    assert not job.now.tables["runs"].read_only
    job.apply([cell(job, 0, HEADER[column], typed)])
    held[0][column] = rows(job)[0]["cells"][column]
    if typed[-1].isdigit() and typed[0] not in "#=":
        assert float(held[0][column].replace(",", ".")) == float(typed.replace(",", "."))
    else:
        assert held[0][column].strip() == typed
    assert [row["cells"] for row in rows(job)] == held
    after = (tmp_path / "runs.csv").read_bytes().decode("utf-8-sig").split(end)
    assert [*after[:2], *after[3:]] == [*lines[:2], *lines[3:]]
    grid = read_grid(tmp_path / "runs.csv", "runs", Problems(), may_be_empty=True)
    assert [[getattr(c, "text", c) for c in row] for row in zip(*grid.columns, strict=True)] == held
    assert [row["cells"] for row in rows(JobFiles(tmp_path))] == held
    if (tmp_path / "runs.csv").read_bytes() != before:
        job.undo()
    assert (tmp_path / "runs.csv").read_bytes() == before


def test_numbers_that_may_have_thousands_stay_as_typed_and_are_refused(tmp_path):
    job = plain_job(tmp_path, "run,speed_rpm,sensor,amplitude,phase_deg\na,1200,s,1.5,3\n")
    job.apply([cell(job, 0, "speed_rpm", "1,350")])
    assert rows(job)[0]["cells"][1] == "1,350"
    with pytest.raises(InputError, match="speed_rpm"):
        read_job(tmp_path / "job.toml")


@pytest.mark.parametrize(
    ("text", "cell", "new", "value"),
    [
        ("", "planes|a b|holes", "12", 12),
        ("runs = 'r'\r\n[errors]\r\nfloor = 1\r\n", "phase", "lag", "lag"),
        ("# head\n\n[errors] # stated\n# none\n", "errors|floor", "2", 2),
        ("planes = { a = { holes = 3 } }\n", "planes|a|stock", "1; 1; 1; 1", [1, 1, 1, 1]),
        ("errors.floor = 1 # a remark\n", "errors|phase_deg", "2", 2),
        ("[planes.a]\nholes = 3\n# of b\n[planes.b]\nholes = 4", "planes|c|holes", "5", 5),
        ("# of it\na = 1\n[errors]\nfloor = 1\n", "errors|floor", "", None),
        ("a = 1\n", "planes|left|taken", "3: 10; 7: 2,5", {"3": 10, "7": 2.5}),
        ("a = 1\n", "planes|left|stock", "1", [1]),
    ],
)
def test_a_setting_is_changed_in_files_of_all_forms(tmp_path, text, cell, new, value):
    path, key = tmp_path / "job.toml", cell.split("|")
    path.write_bytes(text.encode())
    job, old = JobFiles(path), tomllib.loads(text.replace("\r\n", "\n"))
    job.apply([{"cell": cell, "new": new}])
    written = path.read_bytes().decode()
    assert [part for part in text.splitlines() if "#" in part and part not in written.splitlines()] == []
    inner = found = tomllib.loads(written.replace("\r\n", "\n"))
    for part in key[:-1]:
        inner = inner.get(part, {})
    assert inner.pop(key[-1], None) == value
    for name in set(old) - {key[0]}:
        assert found[name] == old[name]
    job.undo()
    assert path.read_bytes() == text.encode()


def test_a_setting_that_cannot_be_added_is_refused(tmp_path):
    text = 'check_weights = ["a.csv"]\n[planes.a]\nholes = 3\n[errors]\nfloor = 1\n[planes.b]\nx = 4\n'
    (tmp_path / "job.toml").write_text(text)
    with pytest.raises(ValueError, match="change it in the job file itself"):
        JobFiles(tmp_path / "job.toml").apply([{"cell": "planes|c|holes", "new": "5"}])
    with pytest.raises(ValueError, match="there is one"):
        JobFiles(tmp_path / "job.toml").apply([{"create": "check_weights", "header": HEADER}])
    assert (tmp_path / "job.toml").read_text() == text


def test_steps_over_several_files_go_back_to_the_same_bytes(turbo):
    job = JobFiles(turbo)
    versions, states = [contents(turbo)], [tables_of(job)]
    for k in range(3):
        last = rows(job)[-1]
        job.apply(
            [
                cell(job, k, new=f"{k + 1}.5"),
                {"table": "weights", "cells": {"run": f"w{k}", "plane": "left"}},
                {"delete": f"runs|{last['id']}"},
                {"cell": "planes|left|radius_mm", "old": str(99 + k if k else ""), "new": f"{100 + k}"},
            ]
        )
        versions.append(contents(turbo))
        states.append(tables_of(job))
    for k in (2, 1, 0):
        job.undo()
        assert (contents(turbo), tables_of(job)) == (versions[k], states[k])
    with pytest.raises(ValueError, match="nothing to undo"):
        job.undo()
    assert job.look() == []


def test_an_undo_after_a_change_from_outside_is_refused(turbo):
    job = JobFiles(turbo)
    job.apply([cell(job)])
    text = (turbo / "runs.csv").read_text(encoding="utf-8")
    (turbo / "runs.csv").write_text(text.replace("3.36", "3.37"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"runs\.csv was changed by another program"):
        job.undo()
    assert "3.37" in (turbo / "runs.csv").read_text(encoding="utf-8")
    assert (job.look(), job.look(), job.done) == (["runs.csv"], [], [])


def test_rows_are_called_by_what_they_hold_and_new_ones_stand_below_their_run(turbo):
    job = JobFiles(turbo)
    before = [row["id"] for row in rows(job)]
    assert before[:2] == ["baseline|1220|probe 1|1", "baseline|1220|probe 2|1"]
    job.apply(
        [
            {"table": "runs", "cells": {"run": "baseline", "speed_rpm": "7", "sensor": "probe 1"}},
            {"delete": f"runs|{before[1]}"},
        ]
    )
    after = [row["id"] for row in rows(job)]
    assert after == [before[0], *before[2:20], "baseline|7|probe 1|1", *before[20:]]
    assert tables_of(JobFiles(turbo)) == tables_of(job)


def test_two_programs_see_each_other_and_conflict_only_in_one_cell(turbo):
    one, two = JobFiles(turbo), JobFiles(turbo)
    mine, other, same = cell(one), cell(two, 1), cell(two, new="77")
    one.apply([mine])
    two.apply([other])
    assert two.look() == ["runs.csv"]
    assert [row["cells"][-1] for row in rows(two)][:2] == ["90", "90"]
    before = contents(turbo)
    with pytest.raises(Conflict, match=r"phase_deg .* '90' is there now"):
        two.apply([{"cell": "phase", "old": "lead", "new": "lag"}, same])
    assert contents(turbo) == before
    two.apply([{**same, "new": "90"}])


def test_a_change_between_reading_and_replacing_is_not_lost(turbo, monkeypatch):
    job, real, seen = JobFiles(turbo), os.fsync, []

    def fsync(number):
        real(number)
        if not seen:
            seen.append(number)
            text = (turbo / "runs.csv").read_text(encoding="utf-8")
            (turbo / "runs.csv").write_text(text.replace("3.36", "3.37"), encoding="utf-8")

    monkeypatch.setattr(disk.os, "fsync", fsync)
    job.apply([cell(job)])
    assert rows(job)[0]["cells"] == ["baseline", "1220", "probe 1", "3.37", "90"]
    assert "3.37,90" in (turbo / "runs.csv").read_text(encoding="utf-8")
    assert job.look() == ["runs.csv"]


def test_an_empty_folder_becomes_a_job(tmp_path):
    job = JobFiles(tmp_path)
    job.apply([{"create": "runs", "header": HEADER}, {"table": "runs", "cells": {"run": "Ω"}}])
    assert (tmp_path / "job.toml").read_text(encoding="utf-8") == 'runs = "runs.csv"\n'
    assert (tmp_path / "runs.csv").read_text(encoding="utf-8-sig") == f"{','.join(HEADER)}\nΩ,,,,\n"
    assert tables_of(JobFiles(tmp_path)) == tables_of(job)
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
        assert rows(job) == []
        assert "not in the folder" in job.now.tables["runs"].read_only
        with pytest.raises(ValueError, match="not in the folder"):
            job.apply([{"table": "runs", "cells": {"run": "x"}}])
    assert outside.read_bytes() == (turbo / "runs.csv").read_bytes()


def test_a_change_that_leaves_time_and_size_is_seen(turbo):
    job, path = JobFiles(turbo), turbo / "runs.csv"
    assert job.look() == []
    time.sleep(0.05)
    at = path.stat()
    path.write_bytes(path.read_bytes().replace(b"3.36", b"3.37"))
    os.utime(path, ns=(at.st_atime_ns, at.st_mtime_ns))
    assert job.look() == ["runs.csv"]
    assert rows(job)[0]["cells"][3] == "3.37"


@pytest.mark.parametrize("failing", [1, 2])
def test_a_step_that_fails_names_the_file_and_leaves_nothing_behind(tmp_path, monkeypatch, failing):
    """The table of the check run is made, then the job, which names it, cannot be replaced; or the first."""
    job = plain_job(tmp_path, "run,speed_rpm,sensor,amplitude,phase_deg\nbase,1000,A,1,2\n")
    before, real, tried = contents(tmp_path), Path.replace, []

    def replace(self, target):
        tried.append(target.name)
        if len(tried) == failing:
            raise PermissionError(13, "in use")
        return real(self, target)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", replace)
        with pytest.raises(ValueError, match="nothing was changed") as caught:
            job.apply([{"create": "check", "header": HEADER}])
    assert f"{tried[failing - 1]}: expected a file that can be written" in str(caught.value)
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
        job.apply([{"cell": "phase", "old": "lead", "new": "lag"}, cell(job)])
    assert contents(turbo) == before
    (turbo / name).unlink()
    job.apply([cell(job)])


def test_several_jobs_and_none_are_named(turbo):
    shutil.copy(turbo / "checked.toml", turbo / "other.toml")
    with pytest.raises(ValueError, match=r"checked\.toml and other\.toml"):
        JobFiles(turbo)
    assert JobFiles(turbo / "other.toml").job.name == "other.toml"
    for wrong in (turbo / "none" / "job.toml", turbo / "none.xlsx", turbo / "runs.csv"):
        with pytest.raises(ValueError, match=wrong.name):
            JobFiles(wrong)


def test_tables_of_other_forms_are_shown_but_not_edited(tmp_path):
    job = plain_job(tmp_path, "Speed (rpm);Ampl;Phase\n1200;3,5;20\n")
    assert rows(job)[0]["cells"] == ["1200", "3,5", "20"]
    with pytest.raises(ValueError, match="other columns"):
        job.apply([cell(job, 0, "Ampl", "4")])
