"""Studies: probabilities against closed forms, balancing by runs, starts of calibrations, files."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
import pytest
from repetitions import FULL
from scipy.stats import binomtest
from studies.drawn import SCATTER, STUDY, TWO, write

import fem
from rotorid import read_rotor
from rotorid.files.input_problems import InputError
from rotorid.study import StudyOptions, study
from rotorid.study.study_file import UNDETERMINED, UNSTABLE, read_study

pytest.importorskip("pyarrow.parquet", reason="without the extra rotorid[fleet]")


def run(file, **options):
    with ThreadPoolExecutor(2) as pool:
        return study(file, StudyOptions(**options), executor=pool)


def test_the_probability_is_that_of_rayleigh(tmp_path):
    """One node, one sensor: P(|W u| < limit) = 1 - exp(-(limit / (|W| rms))²)."""
    outcome = run(write(tmp_path), samples=5000)
    rotor = read_rotor(tmp_path / "rotor.csv")
    W = abs(fem.influence(rotor, [3], [3], [3000 * np.pi / 30]).W.item())
    exact = 1 - np.exp(-((10e-6 / (W * 500e-6)) ** 2))
    document = outcome.to_dict()
    assert 0.2 < exact < 0.8
    assert document["probability"] == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / 5000))
    assert document["samples"] == 5000
    met = document["rows"][0]["met"]
    expected = binomtest(met, 5000).proportion_ci(0.95, "exact")
    assert document["interval"] == pytest.approx([expected.low, expected.high], rel=1e-9)
    assert (outcome.result["ratio_0"] <= 1).sum() == met


def test_places_sizes_and_limits_are_as_their_units_say(tmp_path):
    job = read_study(write(tmp_path, TWO.replace("limit_um_pp", "angle_deg = 90\nlimit_um_pp")))
    assert job.nodes == (2, 4)
    assert job.unbalance * np.sqrt(2) == pytest.approx([360e-6, 500e-6])
    assert job.sensors["probe"] == fem.Sensor(3, 90.0)
    omega = 3000 * np.pi / 30
    assert job.gains[0] == pytest.approx([1 / 10e-6, 1j * omega / (1.2e-3 * np.sqrt(2))])


def test_without_errors_one_correction_is_enough(tmp_path):
    outcome = run(write(tmp_path, TWO), results=tmp_path / "kept.parquet")
    table = pd.read_parquet(tmp_path / "kept.parquet")
    shot = table[table.ratio_0 > 1]
    assert 5 < len(shot) < 60
    assert (shot.ratio_1 < 1e-6).all()
    assert (shot.runs_needed == 4).all()
    assert outcome.to_frame()["met"].tolist() == [60 - len(shot), 60, 60, 60]
    assert outcome.to_frame()["runs"].tolist() == [1, 4, 5, 6]


def test_counts_are_those_of_the_table_and_later_corrections_help(tmp_path):
    text = TWO.replace("limit_um_pp = 20", "limit_um_pp = 2") + SCATTER.replace("= 2\n", "= 3\n")
    n = 150 if FULL else 80
    outcome = run(write(tmp_path, text), samples=n, results=tmp_path / "kept.parquet")
    table = pd.read_parquet(tmp_path / "kept.parquet")
    assert table["sample"].tolist() == list(range(n))
    counts = [(table.runs_needed <= runs).sum() for runs in (1, 4, 5, 6)]
    assert counts[0] < counts[1] < counts[2] <= counts[3] < n
    for name, warned in (("silent", False), ("warned", True)):
        own = table[table.warned == warned]
        held = {"held": (own.held == True).sum(), "corrections": len(own)}  # noqa: E712 - pandas
        assert outcome.to_dict()["coverage"][name] == held
    assert outcome.to_dict()["not_balanced"] == {UNDETERMINED: table.why.notna().sum()}
    assert 0 < table.why.notna().sum() < n / 2
    assert outcome.to_frame()["met"].tolist() == counts


def test_an_unstable_rotor_is_told(tmp_path):
    (tmp_path / "rotor.toml").write_text(
        'shaft = "shaft.csv"\n[[bearing]]\nnode = 1\nstiffness_N_per_m = 1e7\ndamping_N_s_per_m = 2000\n'
        "[[bearing]]\nnode = 5\nstiffness_N_per_m = 1e7\ndamping_N_s_per_m = 2000\n"
        "[[seal]]\nnode = 3\nkxy_N_per_m = 9e5\nkyx_N_per_m = -9e5\n"
    )
    (tmp_path / "shaft.csv").write_text(
        "element,length_m,diameter_m,mass_kg\n1,0.2,0.04,0\n2,0.2,0.04,5\n3,0.2,0.04,0\n4,0.2,0.04,0\n"
    )
    text = STUDY.replace("rotor.csv", "rotor.toml")
    file = write(tmp_path, text)
    with pytest.raises(ValueError, match="unstable at the speeds of the study"):
        run(file)
    stable = (tmp_path / "rotor.toml").read_text().replace("9e5", "4e4")
    (tmp_path / "rotor.toml").write_text(stable)
    outcome = run(write(tmp_path, text + '[scatter]\n"seal.kxy" = 300\n'), samples=100)
    reasons = outcome.to_dict()["not_balanced"]
    assert list(reasons) == [UNSTABLE]
    assert 0 < reasons[UNSTABLE] < 100
    assert outcome.to_frame()["met"][0] <= 100 - reasons[UNSTABLE]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("speeds_rpm = [3000]\n", "", "key speeds_rpm"),
        ("node = 3\nlimit", "node = 9\nlimit", "key sensors.probe.node"),
        ("[unbalance.3]", "[unbalance.middle]", "key unbalance"),
        ("rms_g_mm = 500", "median_g_mm = 500", "key unbalance.3.median_g_mm"),
        ("[planes.middle]\nnode = 3\n", "corrections = 2\n", "key planes"),
        ("rotor.csv", "roter.csv", "roter.csv"),
        (
            "= 500\n",
            '= 500\n[scatter]\n"bearing.kxx" = 10\n"bearing[1].kxx" = 10\n',
            "another parameter has this number, too",
        ),
        ("= 500\n", '= 500\n[scatter]\n"bearing[3].stiffness" = 9\n', "the bearing '3' is not known"),
        ("= 500\n", "= 500\n[readings]\nrun_percent = -2\n", "key readings.run_percent"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_its_key(tmp_path, old, new, words):
    assert old in STUDY
    with pytest.raises(InputError) as told:
        read_study(write(tmp_path, STUDY.replace(old, new)))
    assert words in str(told.value)
    assert len(told.value.problems) <= 5
