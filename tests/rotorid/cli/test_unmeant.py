"""Jobs whose answers cannot be meant: the first line says so, and what to do instead."""

import re
from pathlib import Path

from cases import each_of

JOBS = Path(__file__).parents[2] / "data/unmeant"
STATED = ("--errors", "2,2")


def balance(cli, name, *options):
    return cli("balance", JOBS / name / "runs.csv", JOBS / name / "weights.csv", *options)


@each_of(
    "name, says, instead",
    [
        (
            "weak_trial",
            "the weight in plane 'I' is 458 g ± ",
            "repeat the trial run of plane 'I' with at least ",
        ),
        ("tiny_trial", "the weight in plane 'P2' is 6.738 g ± ", "of plane 'P2' with at least "),
        ("one_digit", "the readings have one digit (steps of 0.10 µm pp", "that shows more digits"),
        ("alike_planes", "planes 'P1' and 'P2' act alike", "weights in 'P2' alone would leave about"),
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


@each_of(
    "name, run",
    [
        ("contradiction", "base"),
        ("forgotten_weight", "trial 2"),
    ],
)
def test_runs_that_disagree_are_named_before_what_follows(cli, name, run):
    for options in ((), STATED):
        ran = balance(cli, name, *options)
        assert ran.code == 2
        cause, follows, *rest = ran.err.splitlines()
        assert cause.startswith("rotorid: the runs disagree by ")
        assert f"most of all in run '{run}'" in cause
        assert cause.endswith("(of a check run: check_weights)")
        assert follows.startswith("the trial weight in plane 'P1'")
        assert follows.endswith("mend the table, or measure these runs again until they agree")
        assert not rest


def test_a_trial_weight_that_did_nothing_is_repeated_with_one_that_does(cli, tmp_path):
    """The effect is 0.53 times its error; five times its error asks for 1.5 g · 5 / 0.53 = 14 g."""
    head = "run,speed_rpm,sensor,amplitude_mm_s_rms,phase_deg\n"
    rows = ["0,1480,A,6.50,205", "0,1480,B,6.55,224", "1,1480,A,6.24,205", "1,1480,B,6.30,222"]
    rows += ["2,1480,A,5.11,184", "2,1480,B,1.50,276"]
    (tmp_path / "r.csv").write_text(head + "\n".join(rows) + "\n")
    (tmp_path / "w.csv").write_text("run,plane,mass_g,angle_deg\n1,front,1.5,0\n2,back,25,0\n")
    words = ("--phase", "lag", "--angles", "with rotation")
    text = " ".join(cli("balance", tmp_path / "r.csv", tmp_path / "w.csv", *words).out.split())
    assert "its trial weight (1.5 g) is only 0.53 times its error" in text
    assert "repeat the trial run of plane 'front' with at least 14 g" in text
