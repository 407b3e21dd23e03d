"""What is printed fits a terminal and begins with the judgement."""

import re

import pytest
from repetitions import FULL

from golden.cases import CASES
from golden.running import run
from rotorid.base.answer import COLUMNS
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.samples import sample_data

FEW = (
    "turbo",
    "checked",
    "split-holes",
    "tolerance-positions",
    "critical-compressor",
    "reduce-everything",
    "identify-task_5_1",
)
"""Cases whose texts are read; `make test-full` reads all that are answers."""
NAMES = [n for n, case in CASES.items() if case.group not in ("usage", "demos", "fleet")] if FULL else FEW
NO_ANSWER = ("schema", "demo")
"""What they print is no answer."""
WIDE = ("fit-quasi-sequential",)
"""Their `--table` has a column an iteration."""
MOST, WITH_PIECES, TALL = 12, 18, 24
"""Lines that are not blank of an answer, of one with pieces, and of equations."""
FORBIDDEN = (
    r"\b1(\.0+)? times as much|with any weights|\(proven|\(and \d+ more of this kind\)"
    r"|would leave \S+ times|\brms [^.;]* \(with"
)
"""What no answer, no sheet and no page says."""
JUDGEMENTS = {
    "balance": r"(Mount|Remove) (these|this|nothing|\d)|Do not mount|Measure again|"
    r"(Pass|Fail|Not decidable) \(|As predicted: |Not as predicted: |Not judged: |written: |"
    r"Determined in part: |Better on the bare rotor: |(Trim|Done|Take off what is mounted|Add nothing yet); ",
    "calibrate": r"The model (explains|does NOT explain) the data |Run \d+ trial weights?: ",
    "modes": r"\d+ modes?: |Not every mode is determined: ",
    "split": r"Mount |Drill |Instead of adding .*(take away opposite:|grind off )|.* from two weights: "
    r"either|.* have the force and the",
    "trial-weight": r"Trial weight in plane ",
    "tolerance": r"G[\d.]+ for .*: permissible residual unbalance [\d.]+ g·mm",
    "simulate": r"(Amplitudes|Natural modes|Record)\b",
    "unbalance": r"The readings determine ",
}
"""How the first line begins."""


@pytest.fixture(scope="module")
def printed():
    """Of every case that has an answer, its text."""
    outcomes = run(NAMES, whole=True)
    texts = {name: found["text"]["output"] for name, found in outcomes.items() if found["status"] == 0}
    return {name: text for name, text in texts.items() if CASES[name].words[0] not in NO_ANSWER}


def complaints(words, output):
    lines = output.rstrip("\n").splitlines()
    most = WITH_PIECES if "--split" in words or " in hole" in output else MOST
    most = TALL if "--show" in words else most
    count = sum(bool(line) and not line.startswith("written: ") for line in lines)
    found = [f"{count} lines"] if count > most and "--table" not in words else []
    found += [f"says {match[0]!r}" for match in re.finditer(FORBIDDEN, " ".join(output.split()))]
    found += [f"{len(line)} columns: {line}" for line in lines if len(line) > COLUMNS]
    found += [f"a token for a unit: {line}" for line in lines if re.search(r"\d (g_mm|um_pp)", line)]
    if not re.match(JUDGEMENTS.get(words[0], ""), lines[0]):
        found.append(f"no judgement: {lines[0]}")
    return found


@pytest.mark.full
def test_an_answer_fits_a_terminal_and_begins_with_the_judgement(printed):
    assert len(printed) >= len(FEW)
    doubts = {name: complaints(CASES[name].words, text) for name, text in printed.items()}
    assert [(name, doubt) for name, doubt in doubts.items() if doubt and name not in WIDE] == []


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("Mount these weights: rms 3 → 1.\n" + 12 * "more\n", "13 lines"),
        ("Mount these weights: rms 3 → 1.\n" + 101 * "x", "101 columns"),
        ("Corrections\nMount these weights.", "no judgement: Corrections"),
        ("Mount these weights: rms 3 → 1 (with any weights 0).", "says "),
        ("Mount these weights: 3 g_mm", "a token for a unit: Mount these weights: 3 g_mm"),
    ],
)
def test_what_does_not_fit_is_found(output, words):
    assert complaints(["balance", "job.toml"], output)[0].startswith(words)
    assert not complaints(["balance", "job.toml"], "Mount these weights: rms 3 → 1.\n" + 11 * "more\n")


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
