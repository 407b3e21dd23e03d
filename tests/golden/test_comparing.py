"""The net finds what it is there for: changes of a key, length, word, status, place, and of numbers."""

import copy
import json
import subprocess

import pytest

from golden.cases import CASES, COMMANDS, REFUSED, STORED
from golden.comparing import compare
from golden.document import arrays, rounded, thinned
from golden.parent import apart
from golden.running import run
from golden.storing import FOLDER, REFUSALS, storable
from golden.tolerances import Tolerance
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


def test_a_named_tolerance_holds_for_its_case_and_key_only():
    document = changed("corrections", 0, "mass", to=12.5 * (1 + 1e-4))
    assert differences(document, (Tolerance("cas*", "corrections*mass", "a reason", relative=1e-3),)) == []
    assert differences(document, (Tolerance("other", "*", "a reason", relative=1e-3),))
    assert differences(document, (Tolerance("*", "*.angle", "a reason", absolute=1.0),))


def test_between_trees_spreads_may_differ_by_15_percent_and_intervals_in_width():
    def one(**numbers):
        return {"case": {"status": 0, "output": json.dumps(numbers), "error": ""}}

    first = one(mass_std=[1.0], mass=1.0, ci95=[99.0, 101.0])
    assert apart(first, one(mass_std=[1.14], mass=1.0, ci95=[98.9, 101.1])) == {}
    worse = one(mass_std=[1.2], mass=1.1, ci95=[99.5, 101.5])
    assert {each.key for each in apart(first, worse)["case"]} == {"mass_std[]", "mass", "ci95[]"}


def test_what_is_stored_of_a_complaint_is_its_place():
    outcome = {"status": 2, "output": "", "error": "rotorid: a.csv, row 4, column run: found 'x'\n"}
    assert storable("case", outcome) == {"exit status": 2, "place": "a.csv, row 4, column run"}


def test_the_product_of_another_tree_is_run_or_none(tmp_path, capfd):
    """An editable installation of this tree must not take the place of the other one."""
    with pytest.raises(subprocess.CalledProcessError):
        run(["version"], tmp_path)
    assert f"is not in {tmp_path}" in capfd.readouterr().err


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
