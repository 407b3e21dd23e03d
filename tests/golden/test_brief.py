"""What is printed says each thing once and loses nothing."""

import re

import pytest

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.samples import sample_data

JOBS = {
    "job.toml": {"planes": ("left", "right")},
    "checked.toml": {"limit": ("2",)},
    "holes.toml": {"split": True},
}


@pytest.mark.parametrize("job", JOBS)
def test_nothing_is_lost_and_nothing_printed_twice(job):
    found = balance(sample_data() / "turbo_job" / job, BalanceOptions(**JOBS[job]))
    answer, whole = found.answer, found.answer.whole()
    assert found.summary() == answer.brief(found.lines)
    assert len(answer.tables) >= 2
    for table in answer.tables:
        assert whole.count(table) == 1
        assert table not in found.summary()
    for words in (*answer.warnings, *answer.notes):
        assert " ".join(whole.split()).count(words) == 1
    readings = re.findall(r"^  +\d+  probe \d .*$", whole, re.M)
    each = 2 if found.check else 1  # predicted, and read in the check run
    assert len(readings) == each * len(found.result.speeds) * len(found.result.sensors)
    assert whole.splitlines()[0] == found.summary().splitlines()[0]
