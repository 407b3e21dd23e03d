"""What a newcomer reads after a check run: one decision, the trim with its readings, the same warnings."""

import re

import pytest

from rotorid.samples import sample_data

CHECKED = sample_data() / "turbo_job" / "checked.toml"
BK = sample_data() / "bk_two_plane" / "job.toml"


@pytest.mark.parametrize("job", [CHECKED, sample_data() / "fleet" / "fan-132" / "132-01" / "job.toml"])
def test_refined_or_not_there_is_one_decision_and_the_same_is_warned_of(cli, job):
    warned = []
    for more in ((), ("--refine",)):
        found = cli("balance", job, "--json", *more).json
        one, left = found["judgement"], found["left_to_do"]
        assert (one["word"], one["cause"]) == (left["word"], left["why"])
        assert (one["rms_expected"] is None) == (one["word"] == "done")
        words = " ".join(found["warnings"]).replace("with the check run counted, ", "")
        warned.append(re.sub(r"[.\d]+", "#", words))
    assert warned[0] == warned[1]


def test_every_reading_with_the_trim_is_a_table(cli):
    table = (
        cli("balance", CHECKED, "--table").out.partition("now and with the trim\n")[2].partition("\n\n")[0]
    )
    assert table.count("\n") == 20
    assert "5400  probe 1     0.445  193.0°      0.638  229.8°" in table


def test_words_that_go_with_what_is_printed(cli):
    shown = cli("balance", BK, "--table").out.replace("\n", "").replace("  ", " ")
    assert "2 % are assumed of each of three kinds, 3.5 % in all" in shown
    assert "run to run: 3.5 % (assumed)" in shown
    stated = cli("balance", BK, "--errors", "2,1", "--limit", "5").out
    assert "and the\n  ± are smaller, those of readings alone" in stated
    assert "other limits" not in stated


def test_the_judgement_after_a_check_run_begins_with_what_it_read(cli):
    found = cli("balance", CHECKED, "--json").json
    assert found["judgement"]["rms_before"] == pytest.approx(0.4127, abs=1e-4)
    assert "rms 0.413 →" in found["judgement"]["cause"]


def test_pieces_have_their_own_expectation(cli):
    job = CHECKED.with_name("holes.toml")
    plain, split = (cli("balance", job, *more) for more in ((), ("--split",)))
    assert plain.out.splitlines()[1] == "In holes: --split."
    assert "with all trial weights taken off" in split.out
    assert cli("balance", job, "--split", "--table").out.count("Largest left") == 1
    found = cli("balance", job, "--split", "--json").json
    bound = found["mounting"]["rms_after_95"]
    assert f"below {bound:.2g} in ≥ 95 of 100" in split.out
    assert found["mounting"]["rms_after"] < bound
    assert found["judgement"]["rms_expected"] is None  # that of weights at any angle


def test_limits_that_no_weights_keep_leave_the_check_run_its_verdict(cli):
    job = ("balance", CHECKED, "--json", "--limit")
    found, kept = (cli(*job, limit).json for limit in ("0.5um_pp", "1um_pp"))
    assert (found["verdict"]["verdict"], found["left_to_do"]["word"]) == ("fail", "add nothing yet")
    failed = [row["size"] > 0.5 for row in kept["verdict"]["rows"]]
    assert [row["verdict"] == "fail" for row in found["verdict"]["rows"]] == failed
    assert "without limits of readings: the limits cannot be met" in found["warnings"][-1]
    assert "without limits" not in str(kept["warnings"])
    assert "the limits cannot be met" in cli(*job, "0.5um_pp", "--refine").err
