"""`rotorid validate` from the command line."""

import csv
import json

import pytest

from rotorid.validation import PROVIDERS, formula_50

KEYS = {"source", "quantity", "printed", "computed", "difference", "tolerance", "status", "note"} | {
    "could_fail", "kind", "follows"
}  # fmt: skip


@pytest.fixture
def some(monkeypatch):
    """Two groups only: quick."""
    chosen = {name: PROVIDERS[name] for name in ("rotor", "masses")}
    monkeypatch.setattr("rotorid.validation.PROVIDERS", chosen)


def test_json_has_every_row_and_none_differs(cli, tmp_path):
    table = tmp_path / "numbers.csv"
    outcome = cli("validate", "--json", "--output", table)
    assert outcome.code == 0, outcome.err
    document = outcome.json
    assert set(document) >= {"rows", "groups", "counts", "provenance"}
    rows = document["rows"]
    assert all(set(r) >= KEYS for r in rows)
    assert {r["status"] for r in rows} == {"agrees", "erratum", "consequence", "given"}
    assert all(r["note"] for r in rows if r["status"] in {"erratum", "consequence"})
    assert all(r["follows"] for r in rows if r["status"] == "consequence")
    assert {r["status"] for r in rows if not r["could_fail"]} == {"given"}
    assert document["counts"]["differs"] == 0
    assert document["counts"]["numbers"] == len(rows) >= 75 + 20 + 25 + 300 + 6 + 15
    assert document["provenance"]["inputs"]
    with table.open(encoding="utf-8", newline="") as file:
        written = list(csv.DictReader(file))
    assert [r["quantity"] for r in written] == [r["quantity"] for r in rows]
    assert [float(r["computed"]) for r in written] == [r["computed"] for r in rows]


def test_text_begins_with_the_counts(cli, some):
    outcome = cli("validate")
    assert outcome.code == 0, outcome.err
    lines = outcome.out.strip().splitlines()
    assert lines[1].endswith(" consequences, 0 differ; 3 given, not counted.")
    table, every = (cli("validate", option).out for option in ("--table", "--all"))
    for text in (table, every):
        assert text.splitlines()[:2] == lines[:2]
        assert "\nMisprints, and what follows from them:\n" in text
        assert "\nTolerances other than half a unit of the last printed digit:\n" in text
    assert "mode 3, node 24" not in table
    assert "mode 3, node 24" in every


def test_numbers_that_differ_end_with_status_1_and_are_named(cli, some, monkeypatch, tmp_path):
    right = formula_50.equivalent_masses
    monkeypatch.setattr(
        "rotorid.validation.formula_50.equivalent_masses", lambda a, *more: right(a * 1.01, *more)
    )
    table = tmp_path / "numbers.csv"
    outcome = cli("validate", "--output", table)
    assert outcome.code == 1
    assert outcome.err == ""
    assert "Differ:" in outcome.out
    assert "m1, kg: printed 95.879, computed" in outcome.out
    assert "differs" in table.read_text(encoding="utf-8")
    document = json.loads(cli("validate", "--json").out)
    assert document["counts"]["differs"] >= 8


def test_help_says_what_the_status_means(cli):
    text = " ".join(cli("validate", "--help").out.split())
    assert "Exit status 0 if no number differs and no group fails, else 1." in text


@pytest.mark.parametrize(
    ("args", "message"),
    [(("--output", "numbers.txt"), ".csv, .xlsx"), (("--output", "nowhere/numbers.csv"), "does not exist")],
)
def test_bad_options_end_with_one_message(cli, args, message):
    outcome = cli("validate", *args)
    assert outcome.code == 2
    assert message in outcome.err
    assert outcome.out == ""


def test_a_printed_table_is_not_overwritten(cli, some):
    from rotorid.validation.row import tables

    path = tables()[0]
    before = path.read_bytes()
    outcome = cli("validate", "--output", path)
    assert outcome.code == 2
    assert "must not be overwritten" in outcome.err
    assert path.read_bytes() == before
