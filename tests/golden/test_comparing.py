"""The net finds what it is there for: every change of a key, an order, a word, a status, and of numbers."""

import copy
import json
import subprocess

import pytest

from golden.cases import CASES, COMMANDS, EXERCISES
from golden.comparing import compare
from golden.running import masked, run
from golden.storing import STORED, parts, read, write
from golden.tolerances import TOLERANCES, Tolerance
from rotorid.samples import sample_data

DOCUMENT = {
    "method": "least-squares",
    "rank": 2,
    "corrections": [{"plane": "left", "mass": 12.5}, {"plane": "right", "mass": 3e-9}],
    "mode_shapes": [[1.0, 2.0], [0.5, None]],
}
TEXT = "plane    g_mm  angle\nleft    419.4  167.7°\nrank 2 of 2, 3.2e-05 left\n"
CSV = "# a remark\nnode,mass_kg\n1,12.25\n2,3.1234567890123\n"


def outcome(document=None, text=TEXT, table=CSV, status=0, error=""):
    return parts(
        {
            "command": "balance job.toml",
            "text": {"status": status, "output": text, "error": error},
            "json": {"status": status, "output": json.dumps(document or DOCUMENT, indent=1), "error": error},
            "copied": "",
            "files": {"w.csv": {"content": table}},
        }
    )


def changed(*path, to):
    document = copy.deepcopy(DOCUMENT)
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = to
    return document


def differences(tolerances=(), **kwargs):
    return compare("case", outcome(), outcome(**kwargs), tolerances)


def test_what_is_equal_is_equal():
    assert differences() == []


def test_a_renamed_key_is_found():
    document = {("methods" if key == "method" else key): value for key, value in DOCUMENT.items()}
    assert "keys" in differences(document=document)[0]


def test_an_exchanged_order_of_keys_is_found():
    assert "keys" in differences(document=dict(reversed(DOCUMENT.items())))[0]


def test_an_exchanged_order_of_rows_is_found():
    assert differences(document=changed("corrections", to=DOCUMENT["corrections"][::-1]))


@pytest.mark.parametrize(
    ("path", "to"),
    [
        (("method",), "minmax"),
        (("rank",), 3),
        (("rank",), 2.0),
        (("rank",), True),
        (("mode_shapes", 1, 1), 0.0),
        (("mode_shapes", 1), [0.5]),
        (("corrections", 0, "mass"), None),
        (("corrections", 0, "mass"), 12.5 * (1 + 1e-8)),
        (("corrections", 1, "mass"), 3e-9 + 12.5e-8),
        (("mode_shapes", 1, 0), 0.5 + 2e-8),
        (("corrections", 0, "mass"), float("nan")),
    ],
)
def test_a_change_in_a_document_is_found(path, to):
    (line,) = differences(document=changed(*path, to=to))
    assert line.startswith("json: .")


@pytest.mark.parametrize(
    ("path", "to"),
    [
        (("corrections", 0, "mass"), 12.5 * (1 + 1e-12)),
        (("corrections", 1, "mass"), 3e-9 + 1e-9),
        (("mode_shapes", 1, 0), 0.5 + 1e-12),
    ],
)
def test_rounding_in_a_document_is_none(path, to):
    """A small number counts with the largest of its array."""
    assert differences(document=changed(*path, to=to)) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("left", "right"),
        ("419.4", "419.6"),
        ("167.7", "168"),
        ("3.2e-05", "3.4e-05"),
        ("3.2e-05", "3.2e-04"),
        ("rank 2", "rank 3"),
        ("\nleft", "\n\nleft"),
        ("plane    g_mm", "plane g_mm"),
        ("2, 3", "2; 3"),
        ("left\n", "left"),
    ],
)
def test_a_change_in_a_text_is_found(old, new):
    assert old in TEXT
    assert differences(text=TEXT.replace(old, new))


@pytest.mark.parametrize(("old", "new"), [("419.4", "419.5"), ("3.2e-05", "3.3e-05"), ("  167.7", " 167.70")])
def test_one_unit_of_the_last_digit_is_rounding(old, new):
    assert differences(text=TEXT.replace(old, new)) == []


@pytest.mark.parametrize(
    ("old", "new"), [("remark", "word"), ("mass_kg", "mass_g"), ("12.25", "12.2500002"), ("\n2,", "\n3,")]
)
def test_a_change_in_a_table_is_found(old, new):
    assert differences(table=CSV.replace(old, new))


def test_rounding_in_a_table_is_none():
    assert differences(table=CSV.replace("3.1234567890123", "3.12345678903")) == []


def test_an_exit_status_and_an_error_are_found():
    assert "status 2" in differences(status=2)[0]
    assert differences(error="rotorid: Warning: an overflow\n")
    one = compare("case", outcome(error="rotorid: one\n"), outcome(error="rotorid: two\n"))
    assert "is now 'rotorid: two'" in one[0]


def test_a_named_tolerance_holds_for_its_case_and_place_only():
    document = changed("corrections", 0, "mass", to=12.5 * (1 + 1e-7))
    named = Tolerance("cas*", "corrections.mass", "a reason", relative=1e-6)
    assert differences((named,), document=document) == []
    assert differences((Tolerance("other", named.place, "a reason", relative=1e-6),), document=document)
    assert differences((Tolerance("case", "*.angle", "a reason", relative=1e-6),), document=document)
    text = TEXT.replace("419.4", "419.8")
    assert differences((Tolerance("case", "left # #°", "a reason", relative=1e-2),), text=text) == []


def test_every_tolerance_has_its_reason():
    for tolerance in TOLERANCES:
        assert len(tolerance.reason) > 10
        assert tolerance.relative or tolerance.absolute


def test_dates_versions_and_seconds_are_masked():
    assert masked("rotorid 0.1.0, 2026-11-22T09:05:29+00:00") == "rotorid VERSION, DATE"
    assert masked("rotorid: fit, 10 s so far\nrotorid: no\n") == "rotorid: no\n"
    assert masked("rotorid: time: all 0.123 s\n") == "rotorid: time: all SECONDS s\n"


def test_the_product_of_another_tree_is_run_or_none(tmp_path, capfd):
    """An editable installation of this tree must not take the place of the other one."""
    with pytest.raises(subprocess.CalledProcessError):
        run(["version"], tmp_path)
    assert f"is not in {tmp_path}" in capfd.readouterr().err


def test_what_is_written_is_what_is_read(tmp_path):
    given = outcome(error="rotorid: a complaint\n\n")
    found = {
        "command": "balance job.toml",
        "text": {"status": 0, "output": TEXT, "error": "rotorid: a complaint\n\n"},
        "json": {"status": 0, "output": json.dumps(DOCUMENT), "error": "rotorid: a complaint\n\n"},
        "copied": "",
        "files": {"w.csv": {"content": CSV}},
    }
    write("case", found, tmp_path)
    again = read("case", tmp_path)
    assert list(again[0]) == list(given[0])
    assert compare("case", again, given) == []


def test_the_stored_files_are_those_of_the_cases():
    stored = {file.stem for file in STORED.iterdir()}
    assert stored == {name for name, case in CASES.items() if case.stored}


def test_every_command_and_every_sample_has_a_case():
    words = [case.command for case in CASES.values()]
    for command in COMMANDS:
        assert sum(text.startswith(f"{command} ") and "--help" not in text for text in words) >= 2, command
    for path in sample_data().rglob("*.toml"):
        if path.name != "expected.toml" and "fleet" not in path.parts:  # `fleet add` has the whole folder
            assert any(str(path.relative_to(sample_data())) in text for text in words), path
    assert set(EXERCISES) == {path.parent.name for path in (sample_data() / "identify").glob("*/model.toml")}


def test_a_stored_warning_is_one_that_was_meant():
    """Warnings of the libraries below would stand on standard error."""
    for name, case in CASES.items():
        if case.stored:
            assert "Warning" not in read(name)[0].get("error", ""), name
