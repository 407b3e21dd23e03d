"""The page of any command: the printed document inside, its numbers shown, nothing from outside."""

import pytest
from sheets import COMMANDS, disagreements, make, read_sheet

from rotorid.commands.critical import CriticalOptions, critical
from rotorid.commands.identify import identify
from rotorid.samples import sample_data

MINE = [name for name in COMMANDS if not name.startswith("balance")]


@pytest.mark.parametrize("name", MINE)
def test_the_page_holds_the_printed_document_and_shows_its_numbers(name):
    made = make(name)
    sheet = read_sheet(made.html)
    assert sheet.document == made.document
    assert disagreements(sheet.shown, sheet.document) == []


@pytest.mark.parametrize("name", MINE)
def test_nothing_from_outside_and_ids_once(name):
    sheet = read_sheet(make(name).html)
    assert not [r for r in sheet.references if not r.startswith(("#", "data:"))]
    assert sheet.text.replace('xmlns="http://www.w3.org/2000/svg"', "").count("http") == 0
    assert len(sheet.ids) == len(set(sheet.ids))
    assert [tag for tag, *_ in sheet.order].count("script") == 1


def test_every_critical_speed_is_shown():
    sheet = read_sheet(make("critical table").html)
    count = len(sheet.document["mode_shapes"])
    assert count == 5
    for key in ("critical_speeds_rad_s", "critical_speeds_rpm"):
        assert {f"{key}.{k}" for k in range(count)} <= sheet.keys


def test_sentences_notes_and_pictures_of_the_outcome_stand_on_its_page():
    outcome = critical(sample_data() / "rotor23.csv", CriticalOptions(number=2))
    page = outcome.sheet().decode()
    for text in (*outcome.sentences, *outcome.pictures, *outcome.warnings):
        assert text in page.replace("&#39;", "'")
    assert page.count("<svg") == len(outcome.pictures)


def test_a_result_that_prints_its_own_tables_shows_these():
    folder = sample_data() / "identify" / "task_5_1"
    outcome = identify(folder / "model.toml", folder / "data.csv")
    page = outcome.sheet().decode()
    for block in (*outcome.tables, *outcome.more):
        assert (block() if callable(block) else block).splitlines()[0] in page
