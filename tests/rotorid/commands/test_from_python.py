"""Commands from Python as from the command line: one document, with options as values in SI or as text."""

import cmath
import math

import pytest
from documents import same

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.commands.fit import FitOptions, fit
from rotorid.commands.identify import IdentifyOptions, identify
from rotorid.commands.split import SplitOptions, split
from rotorid.commands.tolerance import ToleranceOptions, tolerance
from rotorid.commands.trial_weight import TrialWeightOptions, trial_weight
from rotorid.commands.unbalance import UnbalanceOptions, unbalance
from rotorid.files import (
    job_from_files,
    read_harmonic_model,
    read_job,
    read_measurements,
    read_ode_model,
    read_record,
)
from rotorid.samples import sample_data

SAMPLES = sample_data()
TURBO = SAMPLES / "turbo_job/job.toml"
TABLES = [TURBO.with_name("runs.csv"), TURBO.with_name("weights.csv")]
MODEL_JOB = SAMPLES / "model_job/job.toml"
TASK = SAMPLES / "identify/task_5_1/model.toml", SAMPLES / "identify/task_5_1/data.csv"
QUASI = SAMPLES / "fit/quasilinearization/model.toml", SAMPLES / "fit/quasilinearization/record_noisy.csv"
WEIGHT = cmath.rect(0.035, math.radians(120))
RPM, UM_PP = math.pi / 30, 0.5e-6
LOAD = {"load": 500.0, "speed": 3000 * RPM, "radius": 0.2}
USUAL = {"mass": 500.0, "speed": 3000 * RPM, "grade": 2.5}


def weight(**options):
    return split(WEIGHT, SplitOptions(**options))


@pytest.mark.parametrize(
    ("words", "work", "options"),
    [
        (f"balance|{TURBO}", lambda **o: balance(str(TURBO), BalanceOptions(**o)), {}),
        (
            f"balance|{TABLES[0]}|{TABLES[1]}|--angles|against rotation|--errors|2,0|"
            "--speeds|1220rpm|--planes|left,right",
            lambda **o: balance(TABLES, BalanceOptions(**o)),
            {
                "angles": "against rotation",
                "errors": "2,0",
                "speeds": [1220 * RPM],
                "planes": ["left", "right"],
            },
        ),
        (
            f"balance|{TURBO}|--max-mass|left=200g_mm|--limit|probe 1=30|--method|least-squares",
            lambda **o: balance(TURBO, BalanceOptions(**o)),
            {"max_mass": {"left": 2e-4}, "limit": {"probe 1": 30 * UM_PP}, "method": "least-squares"},
        ),
        (
            f"balance|{TURBO.with_name('checked.toml')}|--planes|left,right|--grade|G2.5|--rotor-mass|500kg|--service-speed|3000rpm",
            lambda **o: balance(TURBO.with_name("checked.toml"), BalanceOptions(**o)),
            {"planes": ["left", "right"], "grade": "G2.5", "rotor_mass": 500.0, "service_speed": 3000 * RPM},
        ),
        (
            f"fit|{QUASI[0]}|{QUASI[1]}|--start|theta1=0.8,theta2=-0.8|--sigma|0.02|--method|gauss-newton",
            lambda **o: fit(QUASI[0], QUASI[1:], FitOptions(**o)),
            {"start": {"theta1": 0.8, "theta2": -0.8}, "sigma": 0.02, "method": "gauss-newton"},
        ),
        (
            f"identify|{TASK[0]}|{TASK[1]}|--errors|2,1",
            lambda **o: identify(*TASK, IdentifyOptions(**o)),
            {"errors": (2.0, 1.0)},
        ),
        (
            "split|35g@120|--holes|24|--pieces|10g,20g|--taken|9:10g|--per-hole|2",
            weight,
            {"holes": 24, "pieces": [0.01, 0.02], "taken": {"9": 0.01}, "per_hole": 2},
        ),
        ("split|35g@120|--drill|16mm|--radius|100mm", weight, {"drill": 0.016, "radius": 0.1}),
        (
            "tolerance|--mass|500kg|--speed|3000rpm|--grade|G2.5|--planes|left=100mm,right=600mm|--bearings|0mm,700mm|--centre|320mm",
            lambda **o: tolerance(ToleranceOptions(**o)),
            {**USUAL, "planes": {"left": 0.1, "right": 0.6}, "bearings": (0.0, 0.7), "centre": 0.32},
        ),
        (
            "trial-weight|--load|500N|--speed|3000rpm|--radius|0.2m|--reading-phase|9|--lag|below|--sensor-angle|30|--phase|lag",
            lambda **o: trial_weight(None, TrialWeightOptions(**o)),
            {**LOAD, "reading_phase": 9, "lag": "below", "sensor_angle": 30, "phase": "lag"},
        ),
        (
            f"unbalance|{MODEL_JOB}|--stations|6,12,19",
            lambda **o: unbalance(MODEL_JOB, UnbalanceOptions(**o)),
            {"stations": [6, 12, 19]},
        ),
    ],
)  # fmt: skip
def test_values_give_what_the_command_prints(cli, words, work, options):
    printed = cli(*words.split("|"), "--json")
    assert printed.code == 0, printed.err
    outcome = work(**options)
    same(outcome.document, printed.json)
    mine, theirs = outcome.document["provenance"], printed.json["provenance"]
    assert [entry["sha256"] for entry in mine["inputs"]] == [entry["sha256"] for entry in theirs["inputs"]]
    assert {*mine["options"]} - {"vector"} == {*theirs["options"]} - {"vector"} == {*options}


def test_a_job_that_was_read(tmp_path):
    job = read_job(TURBO)
    same(balance(job).document, balance(TURBO).document)
    same(trial_weight(job).document, trial_weight(TURBO).document)
    for work, options in ((balance, BalanceOptions), (trial_weight, TrialWeightOptions)):
        with pytest.raises(ValueError, match="stated where it is read"):
            work(job, options(phase="lag"))
    assumed = balance(job_from_files(TABLES)).document  # what it would be otherwise cannot be told
    assert assumed["conventions"]["assumed"] == ["phase"]
    assert assumed["other_readings"] == []
    assert balance(TABLES).document["other_readings"] != []
    with pytest.raises(ValueError, match="files of a job"):
        balance(job).written(tmp_path / "sheet.xlsx")


def test_models_and_data_need_no_files():
    model = read_ode_model(QUASI[0])
    fitted = fit(model, [read_record(QUASI[1], model)], FitOptions(sigma={"y1": 0.02, "y2": 0.03}))
    assert fitted.document["provenance"]["inputs"] == []
    assert fitted.to_dict() == fit(QUASI[0], QUASI[1:], FitOptions(sigma="y1=0.02,y2=0.03")).to_dict()
    file = read_harmonic_model(TASK[0])
    identified = identify(file.model, read_measurements(TASK[1], file))
    assert identified.document["provenance"]["inputs"] == []
    assert identified.to_dict() == identify(*TASK).to_dict()
    for outcome, names in ((fitted, model.parameters), (identified, file.model.parameters)):
        assert outcome.to_frame()["parameter"].tolist() == list(names)
        assert outcome.figure().axes


def test_without_data_there_are_the_equations_alone(cli):
    """[S] 1.1: which K and Y has the model, and what can data determine?"""
    outcome = identify(SAMPLES / "identify/task_4_1/model.toml")
    assert outcome.to_dict() == {"combinations": ["c", "b*(1 - delta)"]}
    for work in (outcome.sheet, outcome.figure, outcome.to_frame):
        with pytest.raises(ValueError, match="give a table of measured amplitudes"):
            work()
    shown = cli("identify", TASK[0], "--show", "equations").out.replace("\u00a0", " ")
    assert "Re eq. 1  Re X·c - ω·Im X·alpha = F + m·ω²·Re X" in shown
    assert "Im eq. 1  Im X·c + ω·Re X·alpha = m·ω²·Im X" in shown


@pytest.mark.parametrize("options", [{"ridge": -1.0}, {"ridge": math.inf}, {"split": True, "ridge": 0.1}])
def test_options_that_cannot_be(options):
    with pytest.raises(ValueError, match="--"):
        balance(TURBO, BalanceOptions(**options))
