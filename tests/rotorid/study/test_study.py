"""Studies: probabilities against closed forms, balancing by runs, starts of calibrations, files, pictures."""

import json
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor

import jsonschema
import numpy as np
import pandas as pd
import pytest
from repetitions import FULL
from scipy.stats import binomtest
from studies.drawn import SCATTER, STUDY, write

import fem
from balancing import Trials, correct, refine
from rotorid import read_rotor
from rotorid.files.problems import InputError
from rotorid.samples import sample_data
from rotorid.study import UNDETERMINED, StudyOptions, samples, study
from rotorid.study.samples import UNSTABLE
from rotorid.study.study_file import read_study

pq = pytest.importorskip("pyarrow.parquet", reason="without the extra rotorid[fleet]")

TWO = STUDY.replace(
    "[planes.middle]\nnode = 3\n", "corrections = 3\n[planes.left]\nnode = 2\n[planes.right]\nnode = 4\n"
).replace(
    "[unbalance.3]",
    "[sensors.other]\nnode = 2\nlimit_mm_s_rms = 1.2\n[unbalance.2]\nmedian_g_mm = 300\n[unbalance.4]",
)


def run(file, **options):
    with ThreadPoolExecutor(2) as pool:
        return study(file, StudyOptions(**options), executor=pool)


def test_the_probability_is_that_of_rayleigh(tmp_path):
    """One node, one sensor: P(|W u| < limit) = 1 - exp(-(limit / (|W| rms))²)."""
    found = run(write(tmp_path), samples=5000)
    rotor = read_rotor(tmp_path / "rotor.csv")
    W = abs(fem.influence(rotor, [3], [3], [3000 * np.pi / 30]).W.item())
    exact = 1 - np.exp(-((10e-6 / (W * 500e-6)) ** 2))
    document = found.to_dict()
    assert 0.2 < exact < 0.8
    assert document["probability"] == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / 5000))
    assert document["samples"] == 5000
    met = document["rows"][0]["met"]
    expected = binomtest(met, 5000).proportion_ci(0.95, "exact")
    assert document["interval"] == pytest.approx([expected.low, expected.high], rel=1e-9)
    assert (found.result["ratio_0"] <= 1).sum() == met
    median = W * 500e-6 * np.sqrt(np.log(2)) / 10e-6
    assert found.result["ratio_0"].median() == pytest.approx(median, rel=0.05)


def test_the_median_of_rayleigh_and_a_velocity_are_as_their_units_say(tmp_path):
    job = read_study(write(tmp_path, TWO))
    assert job.unbalance[2] * np.sqrt(2 * np.log(2)) == pytest.approx(300e-6)
    assert job.unbalance[4] * np.sqrt(2) == pytest.approx(500e-6)
    turned = read_study(write(tmp_path, STUDY.replace("limit_um_pp", "angle_deg = 90\nlimit_um_pp")))
    assert turned.sensors["probe"] == fem.Sensor(3, 90.0)
    omega = 3000 * np.pi / 30
    assert job.gains[0] == pytest.approx([1 / 10e-6, 1j * omega / (1.2e-3 * np.sqrt(2))])


def test_without_errors_one_correction_is_enough(tmp_path):
    found = run(write(tmp_path, TWO), results=tmp_path / "kept.parquet")
    table = pd.read_parquet(tmp_path / "kept.parquet")
    shot = table[table.ratio_0 > 1]
    assert 5 < len(shot) < 60
    assert (shot.ratio_1 < 1e-6).all()
    assert (shot.runs_needed == 4).all()
    assert (table[table.ratio_0 <= 1].runs_needed == 1).all()
    assert found.to_frame()["met"].tolist() == [60 - len(shot), 60, 60, 60]
    assert found.to_frame()["runs"].tolist() == [1, 4, 5, 6]
    assert found.to_dict()["coverage"]["silent"] == {"held": 0, "corrections": 0}


def test_counts_are_those_of_the_table_and_later_corrections_help(tmp_path):
    text = TWO.replace("limit_um_pp = 20", "limit_um_pp = 2") + SCATTER.replace("= 2\n", "= 3\n")
    n = 150 if FULL else 80
    found = run(write(tmp_path, text), samples=n, results=tmp_path / "kept.parquet")
    table = pd.read_parquet(tmp_path / "kept.parquet")
    assert table["sample"].tolist() == list(range(n))
    counts = [(table.runs_needed <= runs).sum() for runs in (1, 4, 5, 6)]
    assert counts[0] < counts[1] < counts[2] <= counts[3] < n
    for name, warned in (("silent", False), ("warned", True)):
        own = table[table.warned == warned]
        held = {"held": (own.held == True).sum(), "corrections": len(own)}  # noqa: E712 - pandas
        assert found.to_dict()["coverage"][name] == held
    assert found.to_dict()["not_balanced"] == {UNDETERMINED: table.why.notna().sum()}
    assert 0 < table.why.notna().sum() < n / 2
    rows = found.to_dict()["rows"]
    assert [row["probability"] for row in rows] == [count / n for count in counts]
    assert found.to_frame()["met"].tolist() == counts


def test_a_trim_is_that_of_refine(tmp_path, monkeypatch):
    """A sample again, its runs given to `balancing.refine` one by one."""
    text = TWO.replace("limit_um_pp = 20", "limit_um_pp = 0.02") + SCATTER
    job = read_study(write(tmp_path, text))
    seen = []
    real = samples.estimate_influence
    monkeypatch.setattr(samples, "estimate_influence", lambda trials: seen.append(trials) or real(trials))
    row = samples.draw_machine(job, samples.nominal(job).W, np.random.default_rng([1, 4]))
    assert row["ratio_3"] is not None
    first, last = seen[0], seen[-1]

    def part(runs):
        names = tuple(last.runs[r] for r in runs)
        shared = {"speeds": last.speeds, "sensors": last.sensors, "planes": last.planes}
        errors = {"errors": last.errors, "run_errors": last.run_errors}
        return Trials(names, readings=last.readings[:, runs], weights=last.weights[runs], **shared, **errors)

    refined = refine(part([0, 1, 2]), part([3, 4]))
    assert first.weights == pytest.approx(last.weights[:3])
    assert correct(refined).weights == pytest.approx(correct(real(last)).weights, rel=1e-9)


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
    found = run(write(tmp_path, text + '[scatter]\n"seal.kxy" = 300\n'), samples=100)
    reasons = found.to_dict()["not_balanced"]
    assert list(reasons) == [UNSTABLE]
    assert 0 < reasons[UNSTABLE] < 100
    assert found.to_frame()["met"][0] <= 100 - reasons[UNSTABLE]


def test_what_the_model_leaves_out_is_told(tmp_path):
    (tmp_path / "rotor.toml").write_text(
        'shaft = "rotor.csv"\n[[disc]]\nnode = 3\nmass_kg = 2\npolar_inertia_kg_m2 = 0.1\n'
        "diametral_inertia_kg_m2 = 0.06\n"
    )
    found = run(write(tmp_path, STUDY.replace("rotor.csv", "rotor.toml")), samples=2)
    known = fem.influence(read_rotor(tmp_path / "rotor.toml"), [3], [3], [100.0]).warnings
    assert known
    assert found.to_dict()["warnings"] == list(known)
    assert found.answer.warnings == known


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('kind = "balance"', 'kind = "balanse"', "'balance'"),
        ("speeds_rpm = [3000]\n", "", "key speeds_rpm"),
        ("[3000]", "[3000, 2000, 3000.0]", "expected each speed once"),
        ("node = 3\nlimit", "node = 9\nlimit", "key sensors.probe.node"),
        ("limit_um_pp = 20\n", "", "the limit of the sensor"),
        ("[unbalance.3]", "[unbalance.middle]", "key unbalance"),
        ("rms_g_mm = 500", "rms_g_mm = -500", "key unbalance.3.rms_g_mm"),
        ("rms_g_mm = 500", "rms_g_mm = 500\nmedian_g_mm = 50", "one key of them"),
        ("samples = 60", "samples = 0", "key samples"),
        ("[planes.middle]\nnode = 3\n", "corrections = 2\n", "key planes"),
        ("rotor.csv", "roter.csv", "roter.csv"),
        ("[planes.middle]", "[planer.middle]", "did you mean"),
        ("= 500\n", '= 500\n[scatter]\n"bearing[9].kxx" = 10\n', "key scatter"),
        (
            "= 500\n",
            '= 500\n[scatter]\n"bearing.kxx" = 10\n"bearing[1].kxx" = 10\n',
            "each number of the rotor once",
        ),
        ("= 500\n", '= 500\n[scatter]\n"probe[probe].angle" = 10\n', "each number of the rotor once"),
        ("= 500\n", '= 500\n[scatter]\n"bearing.cxx" = 10\n', "bearing.cxx is 0, and so is any share of it"),
        ("= 500\n", '= 500\n[scatter]\n"bearing[3].stiffness" = 9\n', "the bearing '3' is not known"),
        ("= 500\n", "= 500\n[readings]\nrun_percent = 200\n", "key readings.run_percent"),
        ("= 500\n", '= 500\n[calibrate]\ndata = ["a.csv"]\n', "key calibrate"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_its_key(tmp_path, old, new, words):
    assert old in STUDY
    with pytest.raises(InputError) as told:
        read_study(write(tmp_path, STUDY.replace(old, new)))
    assert words in str(told.value)
    assert len(told.value.problems) <= 5


def test_the_command(cli, tmp_path):
    file = write(tmp_path, TWO)
    outcome = cli(
        "study", file, "--json", "--results", tmp_path / "kept.parquet", "--plot", tmp_path / "a.png"
    )
    assert outcome.code == 0, outcome.err
    assert {"probability", "interval", "samples"} < set(outcome.json)
    assert json.loads(pq.read_schema(tmp_path / "kept.parquet").metadata[b"study"])["seed"] == 1
    assert (tmp_path / "a.png").stat().st_size > 10_000
    assert cli("study", file, "--samples", "0").code == 2
    refused = cli("study", file, "--seed", "5", "--results", tmp_path / "kept.parquet")
    assert (refused.code, refused.err.count("\n")) == (2, 1)


def test_the_sample_keeps_to_the_schema(cli):
    schema = cli("schema", "study").json
    jsonschema.Draft202012Validator.check_schema(schema)
    text = (sample_data() / "study" / "study.toml").read_text(encoding="utf-8")
    jsonschema.validate(tomllib.loads(text), schema)


def test_without_pyarrow_one_sentence_says_how_to_get_it(cli, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    outcome = cli("study", write(tmp_path))
    assert outcome.code == 2
    assert outcome.err == "rotorid: a study needs pyarrow: pip install pyarrow\n"


def test_the_pictures_have_a_limit_and_units(tmp_path):
    figure = run(write(tmp_path, TWO)).figure()
    (ax,) = figure.axes
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "as built",
        "after the last correction",
        "limit",
    ]
    assert ax.get_ylabel() == "largest reading over its limit"
    assert ax.get_xlabel() == "share of machines below"
    (ax,) = run(write(tmp_path)).figure().axes
    assert len(ax.get_legend().get_texts()) == 2
