"""What a newcomer reads after a check run: one decision, the trim with its readings, the same warnings."""

import re

import pytest

from rotorid.base.answer import kinds
from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job" / "job.toml"
CHECKED = sample_data() / "turbo_job" / "checked.toml"
DONE = sample_data() / "fleet" / "fan-132" / "132-01" / "job.toml"


@pytest.mark.parametrize(("job", "word"), [(CHECKED, "trim"), (DONE, "done")])
@pytest.mark.parametrize("more", [(), ("--refine",)])
def test_the_document_has_one_decision(cli, job, word, more):
    found = cli("balance", job, *more, "--json").json
    assert found["judgement"]["word"] == found["left_to_do"]["word"] == word
    assert found["judgement"]["cause"] == found["left_to_do"]["why"]
    assert (found["judgement"]["rms_expected"] is None) == (word == "done")


def test_every_reading_with_the_trim_is_a_table(cli):
    table = (
        cli("balance", CHECKED, "--table").out.partition("now and with the trim\n")[2].partition("\n\n")[0]
    )
    assert table.count("\n") == 20
    assert "5400  probe 1     0.445  193.0°      0.638  229.8°" in table


@pytest.mark.parametrize("job", [CHECKED, DONE])
def test_refined_or_not_the_same_is_warned_of(cli, job):
    each = []
    for more in ((), ("--refine",)):
        words = kinds(cli("balance", job, *more, "--json").json["warnings"])
        alike = [one.removeprefix("with the check run counted, ") for one in words]
        each.append({re.sub(r"[.\d]+", "#", one) for one in alike})
    assert each[0] == each[1]


def test_notes_say_what_the_errors_between_runs_are(cli):
    """The number assumed beside that printed; what ± are where none are stated."""
    job = sample_data() / "bk_two_plane" / "job.toml"
    shown = " ".join(cli("balance", job, "--table").out.split())
    assert "2 % are assumed of each of three kinds, 3.5 % in all: one more baseline run" in shown
    assert "from run to run: 3.5 % (assumed)" in shown
    (note,) = [note for note in cli("balance", job, "--errors", "2,1", "--json").json["notes"] if "±" in note]
    assert "none are stated, and the ± are smaller, those of readings alone" in note


def test_other_limits_are_announced_where_there_are_some(cli):
    job = sample_data() / "bk_two_plane" / "job.toml"
    few, many = (cli("balance", each, "--limit", "5").out for each in (job, TURBO))
    assert "limits: --table" not in few
    assert "other limits" not in few
    assert "he other limits" in many
