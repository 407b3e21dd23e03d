"""The net finds what it is there for: changes of a key, length, word, status, place, and of numbers."""

import copy
import subprocess

import pytest

from golden.cases import CASES, COMMANDS, EXERCISES, REFUSED, STORED
from golden.comparing import compare
from golden.document import LONG, arrays, rounded, thinned
from golden.parent import apart, by_key, python_of
from golden.running import HERE, masked, run
from golden.storing import FOLDER, REFUSALS, place, storable
from golden.tolerances import SPREAD, TOLERANCES, Tolerance
from rotorid.samples import sample_data

DOCUMENT = {
    "method": "least-squares",
    "rank": 2,
    "stable": True,
    "corrections": [{"plane": "left", "mass": 12.5}, {"plane": "right", "mass": 3e-9}],
    "mode_shapes": [[1.0, 2.0], [0.5, None]],
    "speeds": [float(k) for k in range(60)],
    "warnings": ["the model leaves 3 % of the variance"],
    "verdict": "the differences are explained by the errors",
    "check": {},
}


def changed(*path, to):
    document = copy.deepcopy(DOCUMENT)
    item = document
    for key in path[:-1]:
        item = item[key]
    item[path[-1]] = to
    return document


def differences(document, tolerances=()):
    """Of the whole arrays, which must be those of the thinned ones."""
    old, new = arrays(DOCUMENT), arrays(document)
    whole = compare("case", old, new, tolerances)
    short = [{key: rounded(thinned(values)) for key, values in each.items()} for each in (old, new)]
    assert [each.key for each in compare("case", *short, tolerances)] == [each.key for each in whole]
    return [each.key for each in whole]


def test_an_array_has_all_values_of_a_key():
    found = arrays(DOCUMENT)
    assert found["corrections#"] == [2]
    assert found["corrections[].mass"] == [12.5, 3e-9]
    assert found["mode_shapes[]#"] == [2, 2]
    assert found["mode_shapes[][]"] == [1.0, 2.0, 0.5, None]
    assert found["verdict"] == ["…"]
    assert found["warnings"] == "…"
    assert found["check{}"] == [0]


def test_a_renamed_key_is_found():
    document = {("methods" if key == "method" else key): value for key, value in DOCUMENT.items()}
    assert differences(document) == ["method", "methods"]


@pytest.mark.parametrize(
    ("path", "to", "key"),
    [
        (("method",), "minmax", "method"),
        (("rank",), 3, "rank"),
        (("stable",), 1, "stable"),
        (("mode_shapes", 1, 1), 0.0, "mode_shapes[][]"),
        (("corrections", 0, "mass"), None, "corrections[].mass"),
        (("corrections", 0, "mass"), 12.5 * (1 + 1e-5), "corrections[].mass"),
        (("corrections", 1, "mass"), 12.5e-5, "corrections[].mass"),
        (("corrections", 0, "mass"), float("nan"), "corrections[].mass"),
        (("corrections",), [DOCUMENT["corrections"][k] for k in (1, 0)], "corrections[].mass"),
        (("speeds", 29), 29.001, "speeds[]"),
        (("speeds", 29), None, "speeds[]"),
        (("speeds",), [*map(float, range(28)), 29.0, 28.0, *map(float, range(30, 60))], "speeds[]"),
        (("check",), {"probe": 1.0}, "check{}"),
    ],
)
def test_a_change_is_found(path, to, key):
    assert key in differences(changed(*path, to=to))


@pytest.mark.parametrize(
    ("path", "to"),
    [
        (("corrections", 0, "mass"), 12.5 * (1 + 1e-7)),
        (("corrections", 1, "mass"), 1e-6),
        (("speeds", 29), 29.0 + 1e-6),
        (("warnings",), []),
        (("verdict",), "the errors do not explain the differences"),
    ],
)
def test_rounding_and_sentences_are_no_difference(path, to):
    """A small number counts with the largest of its array."""
    assert differences(changed(*path, to=to)) == []


def test_short_arrays_are_stored_whole():
    assert thinned(DOCUMENT["speeds"][:LONG]) == DOCUMENT["speeds"][:LONG]
    assert thinned(["left"] * 40) == {"count": 40, "all": "left"}


def test_a_named_tolerance_holds_for_its_case_and_key_only():
    document = changed("corrections", 0, "mass", to=12.5 * (1 + 1e-4))
    assert differences(document, (Tolerance("cas*", "corrections*mass", "a reason", relative=1e-3),)) == []
    assert differences(document, (Tolerance("other", "*", "a reason", relative=1e-3),))
    assert differences(document, (Tolerance("*", "*.angle", "a reason", absolute=1.0),))


def test_the_spread_may_differ_by_15_percent_between_trees_only():
    def one(std, mass=1.0):
        return {"case": {"status": 0, "output": f'{{"mass_std": [{std}], "mass": {mass}}}', "error": ""}}

    assert apart(one(1.0), one(1.14)) == {}
    assert by_key(apart(one(1.0), one(1.2)))[0] == "mass_std[]"
    assert by_key(apart(one(1.0), one(1.0, 1.1)))[0] == "mass"
    assert [each.key for each in compare("c", {"mass_std[]": [1.0]}, {"mass_std[]": [1.14]})] == [
        "mass_std[]"
    ]
    assert {each.relative for each in SPREAD} == {0.15}


def test_an_interval_may_be_15_percent_wider_not_elsewhere():
    def one(low, high):
        return {"case": {"status": 0, "output": f'{{"ci95": [{low}, {high}]}}', "error": ""}}

    assert apart(one(99.0, 101.0), one(98.9, 101.1)) == {}
    assert apart(one(99.0, 101.0), one(98.8, 101.2))
    assert apart(one(99.0, 101.0), one(99.5, 101.5))


def test_every_tolerance_has_its_reason():
    for tolerance in (*TOLERANCES, *SPREAD):
        assert len(tolerance.reason) > 10
        assert tolerance.relative or tolerance.absolute


@pytest.mark.parametrize(
    ("error", "where"),
    [
        ("rotorid: a.csv, row 4, column run: found 'x', expected a number\n", "a.csv, row 4, column run"),
        ("rotorid: job.xlsx (sheet 'runs'): expected readings\n", "job.xlsx (sheet 'runs')"),
        ("rotorid: job.toml, key error: found 'a table'\n", "job.toml, key error"),
        ("rotorid: there is no plane 'midle': left or right\n", ""),
    ],
)
def test_the_place_of_a_complaint_is_read(error, where):
    outcome = {"status": 2, "output": "", "error": error}
    assert place(error) == where
    assert storable("case", outcome) == {"exit status": 2, "place": where}


def test_dates_and_seconds_are_masked():
    assert masked("rotorid 0.1.0, 2026-11-22T09:05:29+00:00") == "rotorid 0.1.0, DATE"
    assert masked("rotorid: fit, 10 s so far\nrotorid: no\n") == "rotorid: no\n"


def test_the_product_of_another_tree_is_run_or_none(tmp_path, capfd):
    """An editable installation of this tree must not take the place of the other one."""
    with pytest.raises(subprocess.CalledProcessError):
        run(["version"], tmp_path)
    assert f"is not in {tmp_path}" in capfd.readouterr().err


def test_a_tree_with_other_requirements_gets_an_environment_of_its_own(tmp_path, monkeypatch):
    for name in ("constraints.txt", "pyproject.toml"):
        (tmp_path / name).write_bytes((HERE / name).read_bytes())
    calls = []
    monkeypatch.setattr(subprocess, "run", lambda words, **_: calls.append(words))
    python_of(tmp_path)
    assert calls == []
    (tmp_path / "constraints.txt").write_text("numpy==2.0.0\n", encoding="utf-8")
    assert python_of(tmp_path) == str(tmp_path / ".venv" / "bin" / "python")
    assert calls == [["make", "-s", "-C", str(tmp_path), ".venv/.dev"]]


def test_the_stored_files_are_those_of_the_cases():
    files = {file.stem: file.stat().st_size for file in FOLDER.iterdir()}
    assert set(files) == {*STORED, REFUSALS}
    assert len(STORED) <= 90
    assert len(REFUSED) == len(set(REFUSED)) == 20
    assert sum(files.values()) <= 350_000


def test_every_command_and_every_sample_has_a_case():
    words = [case.command for case in CASES.values()]
    stored = [CASES[name].command for name in STORED]
    for command in COMMANDS:
        cases = sum(text.startswith(f"{command} ") and "--help" not in text for text in words)
        assert cases >= (1 if command == "demo" else 2), command
        assert any(text.startswith(f"{command} ") for text in stored), command
    for path in sample_data().rglob("*.toml"):
        if path.name != "expected.toml" and "fleet" not in path.parts:  # `fleet fit` has the whole folder
            assert any(str(path.relative_to(sample_data())) in text for text in words), path
    assert set(EXERCISES) == {path.parent.name for path in (sample_data() / "identify").glob("*/model.toml")}
