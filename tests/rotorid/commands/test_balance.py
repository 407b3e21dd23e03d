"""`rotorid.commands.balance`: the command line's document, from text and from values in SI."""

import math

import pytest
from documents import same

from rotorid.commands.balance import Balance, BalanceOptions, balance
from rotorid.files import job_from_files, read_job
from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"
TABLES = [TURBO / "runs.csv", TURBO / "weights.csv"]
RPM = math.pi / 30
UM_PP = 0.5e-6


@pytest.mark.parametrize(
    ("files", "words", "options"),
    [
        pytest.param([TURBO / "job.toml"], "", {}, id="job"),
        pytest.param(
            [TURBO / "holes.toml"],
            "--split --method least-squares",
            {"split": True, "method": "least-squares"},
            id="split",
        ),
        pytest.param(
            TABLES,
            "--angles|against rotation|--errors 2,0 --speeds 1220rpm --planes left,right",
            {
                "angles": "against rotation",
                "errors": "2,0",
                "speeds": [1220 * RPM],
                "planes": ["left", "right"],
            },
            id="tables",
        ),
        pytest.param(
            [TURBO / "job.toml"],
            "--max-mass left=200g_mm --limit|probe 1=30|--method least-squares",
            {"max_mass": {"left": 2e-4}, "limit": {"probe 1": 30 * UM_PP}, "method": "least-squares"},
            id="limits",
        ),
        pytest.param(
            [TURBO / "job.toml"],
            "--planes left,right --ridge 0.03 --method least-squares",
            {"planes": ["left", "right"], "ridge": 0.03, "method": "least-squares"},
            id="planes",
        ),
        pytest.param(
            [TURBO / "checked.toml"],
            "--planes left,right --grade G2.5 --rotor-mass 500kg --service-speed 3000rpm",
            {
                "planes": ["left", "right"],
                "grade": "G2.5",
                "rotor_mass": 500.0,
                "service_speed": 3000 * RPM,
            },
            id="grade",
        ),
    ],
)
def test_the_document_is_what_the_command_prints(cli, files, words, options):
    split = [
        part for k, piece in enumerate(words.split("|")) for part in ([piece] if k % 2 else piece.split())
    ]
    printed = cli("balance", *files, *split, "--json")
    assert printed.code == 0, printed.err
    found = balance(files if len(files) > 1 else str(files[0]), BalanceOptions(**options))
    assert isinstance(found, Balance)
    same(found.document, printed.json)
    own, its = printed.json["provenance"], found.document["provenance"]
    assert [entry["sha256"] for entry in own["inputs"]] == [entry["sha256"] for entry in its["inputs"]]
    assert own["options"].keys() == its["options"].keys() == options.keys()


def test_a_job_that_was_read(tmp_path):
    job = read_job(TURBO / "job.toml")
    found = balance(job)
    same(found.document, balance(TURBO / "job.toml").document)
    with pytest.raises(ValueError, match="stated where it is read"):
        balance(job, BalanceOptions(phase="lag"))
    assumed = balance(job_from_files(TABLES)).document  # what it would be otherwise cannot be told
    assert assumed["conventions"]["assumed"] == ["phase"]
    assert assumed["other_readings"] == []
    assert balance(TABLES).document["other_readings"] != []
    with pytest.raises(ValueError, match="files of a job"):
        found.written(tmp_path / "sheet.xlsx")


@pytest.mark.parametrize(
    "options",
    [
        {"ridge": -1.0},
        {"ridge": math.inf},
        {"split": True, "ridge": 0.1},
        {"grade": "G2.5"},
        {"rotor_mass": 5.0},
    ],
)
def test_options_that_cannot_be(options):
    with pytest.raises(ValueError, match="--"):
        balance(TURBO / "job.toml", BalanceOptions(**options))


def test_check_runs_refine_combined_coefficients_too(tmp_path):
    for name in ("runs.csv", "weights.csv", "check.csv", "check_weights.csv"):
        (tmp_path / name).write_bytes((TURBO / name).read_bytes())
    model = sample_data() / "model_job"
    (tmp_path / "rotor.csv").write_bytes((model / "rotor.csv").read_bytes())
    tables = 'weights = "weights.csv"\ncheck = "check.csv"\ncheck_weights = "check_weights.csv"\n'
    (tmp_path / "job.toml").write_text(tables + (model / "job.toml").read_text())
    checked = balance(tmp_path / "job.toml", BalanceOptions(coefficients="combined"))
    refined = balance(tmp_path / "job.toml", BalanceOptions(coefficients="combined", refine=True))
    assert checked.left.word == "trim"
    assert checked.left.trim == pytest.approx(refined.result.to_add, rel=1e-6)
    assert abs(refined.result.weights - checked.result.weights).max() > 1e-6
