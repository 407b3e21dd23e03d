"""Jobs whose answers cannot be meant: the first line says so, and what to do instead."""

import re
from pathlib import Path

from cases import each_of

JOBS = Path(__file__).parents[2] / "data/unmeant"
STATED = ("--amplitude-error", "2", "--phase-error", "2")


def balance(cli, name, *options):
    return cli("balance", JOBS / name / "runs.csv", JOBS / name / "weights.csv", *options)


@each_of(
    "name, says, instead",
    [
        (
            "weak_trial",
            "the weight in plane 'I' is 458 g ± ",
            "repeat the trial run of plane 'I' with at least 2",
        ),
        ("tiny_trial", "the weight in plane 'P2' is 6.738 g ± ", "of plane 'P2' with at least 3."),
        ("one_digit", "the readings have one digit (steps of 0.10 µm pp", "that shows more digits"),
        ("alike_planes", "planes 'P1' and 'P2' act alike", "plane 'P2' alone (--planes P2; "),
    ],
)
@each_of("method", ["least-squares", "weighted"])
def test_the_first_line_says_that_the_weights_cannot_be_meant(cli, method, name, says, instead):
    ran = balance(cli, name, "--method", method)
    assert ran.code == 0
    first, *rest = re.split(r"\n(?=Instead|Or)", ran.out.split("\n\n")[0])
    first, rest = " ".join(first.split()), " ".join(" ".join(rest).split())
    assert first.startswith("Do not mount these weights: ")
    assert says in first
    assert rest.startswith("Instead: ")
    assert instead in rest


@each_of("name", ["weak_trial", "tiny_trial", "one_digit", "alike_planes"])
def test_intervals_of_the_size_of_the_answer(cli, name):
    found = balance(cli, name, "--json").json
    assert next(iter(found)) == "judgement"
    assert found["judgement"]["word"] == "do not mount"
    assert found["judgement"]["rms_expected"] > 0.8 * found["judgement"]["rms_before"]
    largest = max(found["corrections"], key=lambda row: row["mass"])
    assert 2 * largest["mass_std"] > 0.9 * largest["mass"]
    # what the judgement covers is not said again
    assert not [w for w in found["warnings"] if "rise" in w or "alike" in w or "optimistic" in w]


def test_planes_that_act_alike_with_stated_errors_are_refused_with_what_to_do(cli):
    ran = balance(cli, "alike_planes", *STATED)
    assert ran.code == 2
    lines = ran.err.splitlines()
    assert "planes 'P1' and 'P2' act alike at every sensor and speed" in lines[0]
    assert lines[1].startswith(
        "Instead: plane 'P2' alone (--planes P2; 1.778 g) would leave rms 13.5 µm pp, at most"
    )
    assert lines[2].startswith("Or: --ridge 0.3 would leave rms 13.3 µm pp, at most")
    assert lines[3].startswith("Or: add a sensor or a speed")


@each_of(
    "name, runs, differ",
    [
        ("contradiction", "'base' and 'base again'", "50 %"),
        ("forgotten_weight", "'base' and 'trial 2'", "97 %"),
    ],
)
def test_runs_that_disagree_are_named_before_what_follows(cli, name, runs, differ):
    for options in ((), STATED):
        ran = balance(cli, name, *options)
        assert ran.code == 2
        cause, follows, *rest = ran.err.splitlines()
        assert f"runs {runs} have the same weights mounted but differ by" in cause
        assert (differ in cause) == (not options)
        assert cause.endswith("is a row missing in the weights table?")
        assert follows.startswith("so the trial weight in plane 'P1'")
        assert follows.endswith("mend the table, or measure these runs again until they agree")
        assert not rest


def test_with_stated_errors_the_size_of_a_larger_trial_weight_is_said(cli):
    ran = balance(cli, "weak_trial", *STATED)
    assert ran.code == 2
    assert "repeat the run with a larger trial weight, at least 2" in ran.err


def test_the_sheet_begins_with_the_judgement(cli, tmp_path):
    assert balance(cli, "alike_planes", "--report", tmp_path / "sheet.html").code == 0
    page = (tmp_path / "sheet.html").read_text()
    assert 0 < page.index("Do not mount these weights") < page.index('id="warnings"')


def test_best_planes_leave_out_the_one_that_fights(cli):
    row = balance(cli, "alike_planes", "--best-planes", "1", "--json").json["best_planes"]["rows"][0]
    assert row["rms_expected"] > row["rms_after"]
    assert "expected" in balance(cli, "alike_planes", "--best-planes", "1", "--table").out
