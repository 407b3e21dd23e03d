"""`rotorid fit`: samples and their truth, options, records with gaps and with standard deviations."""

import numpy as np
import pytest
from cases import each_of

from rotorid.files import read_ode_model, read_record
from rotorid.samples import sample_data

FOLDER = sample_data() / "fit"
DECAY = '[states]\nx = "-a*x"\n[initial]\nx = "x0"\n[estimate]\na = 0.5\nx0 = 0.8\n[bounds]\na = [0, 5]\n'
OWN = f'per_record = ["x0"]\n{DECAY}'
TWO = '[states]\nx = "-a*x"\n[initial]\nx = 1\n[outputs]\ny = "x"\nz = "2*x"\n[estimate]\na = 0.5\n'


def files(folder):
    return FOLDER / folder / "model.toml", FOLDER / folder / "record.csv"


def saved(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def decay(x0=1.0):
    t = 0.1 * np.arange(30)
    x = x0 * np.exp(-1.3 * t) + 1e-3 * np.random.default_rng(1).standard_normal(30)
    return "t_s,x\n" + "".join(f"{s:.3f},{v:.6f}\n" for s, v in zip(t, x, strict=True))


def values(document):
    return {name: entry["value"] for name, entry in document["parameters"].items()}


def refused(outcome, *said):
    assert outcome.code == 2
    assert outcome.out == ""
    assert "Traceback" not in outcome.err
    for text in said:
        assert text in outcome.err


def test_a_start_outside_the_bounds(cli, tmp_path):
    model, record = saved(tmp_path, "m.toml", DECAY), saved(tmp_path, "r.csv", decay())
    refused(cli("fit", model, record, "--start", "a=7"), "--start: a = 7 is outside its bounds 0 to 5")


def test_each_record_may_have_its_own_start(cli, tmp_path):
    model = saved(tmp_path, "m.toml", OWN)
    records = [saved(tmp_path, f"{x0}.csv", decay(x0)) for x0 in (1.0, 2.0)]
    found = cli("fit", model, *records, "--start", "x0_2=3,x0=0.9", "--json").json
    assert found["history"][0]["parameters"] == {"a": 0.5, "x0_1": 0.9, "x0_2": 3.0}
    assert values(found) == pytest.approx({"a": 1.3, "x0_1": 1, "x0_2": 2}, rel=5e-3)
    refused(cli("fit", model, *records, "--start", "x0_3=1"), "'x0_3' is no parameter of the model")


def test_the_same_record_twice(cli, tmp_path):
    model, record = saved(tmp_path, "m.toml", DECAY), saved(tmp_path, "r.csv", decay())
    refused(cli("fit", model, record, record), f"{record}: this record is given twice; its samples would")
    link = tmp_path / "link.csv"
    link.symlink_to(record)
    refused(cli("fit", model, record, link), "given twice")
    missing = tmp_path / "no.csv"
    refused(cli("fit", model, missing, missing), "given twice")


def with_std(rows):
    return "t_s,y,z,y_std,z_std\n" + "".join(f"{row}\n" for row in rows)


ROWS = ["0,1,2,0.1,0.2", "1,0.5,1,0.1,0.3", "2,0.26,0.5,0.2,0.2", "3,0.12,0.25,0.1,0.2"]


def test_standard_deviations_beside_the_outputs(cli, tmp_path):
    model = saved(tmp_path, "m.toml", TWO)
    path = saved(tmp_path, "r.csv", with_std(ROWS))
    record = read_record(path, read_ode_model(model))
    np.testing.assert_array_equal(record.sigma["y"], [0.1, 0.1, 0.2, 0.1])
    np.testing.assert_array_equal(record.sigma["z"], [0.2, 0.3, 0.2, 0.2])
    small = cli("fit", model, path, "--json").json["parameters"]["a"]
    tenfold = [
        ",".join([*row.split(",")[:3], *(f"{10 * float(s)}" for s in row.split(",")[3:])]) for row in ROWS
    ]
    large = cli("fit", model, saved(tmp_path, "l.csv", with_std(tenfold)), "--json").json["parameters"]["a"]
    assert large["value"] == pytest.approx(small["value"], rel=1e-6)
    assert large["std"] == pytest.approx(10 * small["std"], rel=1e-5)


@each_of(
    ("old", "new", "said"),
    [
        (ROWS[1], "1,0.5,1,0,0.3", "row 3, column y_std: found '0', expected a standard deviation above 0"),
        (ROWS[1], "1,0.5,1,0.1,-0.3", "row 3, column z_std: found '-0.3'"),
        (ROWS[1], "1,0.5,1,,0.3", "row 3, column y_std: found nothing (a blank), expected a standard"),
        (ROWS[1], "1,0.5,1,nan,0.3", "row 3, column y_std: found 'nan', expected a finite number"),
        ("y_std,z_std", "y_std,note", "column y_std: expected standard deviations of all outputs or none"),
        ("t_s,y,z,", "t_s,y,note,", "column z: expected a column z"),
        ("y_std", "y_sd", "column y_sd: found 'y_sd', expected the column once, not also y"),
        ("y_std,z_std", "y_std,z_sdt", "column z_sdt: found 'z_sdt', expected the column once, not also z"),
        ("y_std", "y_std_mm", "without a unit"),
    ],
)
def test_complaints_about_standard_deviations(cli, tmp_path, old, new, said):
    text = with_std(ROWS)
    assert old in text
    record = saved(tmp_path, "r.csv", text.replace(old, new, 1))
    refused(cli("fit", saved(tmp_path, "m.toml", TWO), record), said)


def test_all_problems_of_a_record_with_standard_deviations_at_once(cli, tmp_path):
    rows = [ROWS[0], "1,much,1,0,0.3", "0.5,1,1,0.1,0", "3,1,1,0.1,little"]
    outcome = cli("fit", saved(tmp_path, "m.toml", TWO), saved(tmp_path, "r.csv", with_std(rows)))
    refused(outcome, "row 3, column y:", "row 4, column t_s", "row 4, column z_std", "row 5, column z_std")
    assert outcome.err.count("z_std") == 2


def test_standard_deviations_where_nothing_was_measured(cli, tmp_path):
    model = saved(tmp_path, "m.toml", TWO)
    rows = [*ROWS, "4,,0.13,,0.2", "5,NaN,0.06,NaN,0.2", "6,,0.03,0,0.2"]
    record = saved(tmp_path, "r.csv", with_std(rows))
    assert cli("fit", model, record, "--allow-missing").code == 0
    bad = saved(tmp_path, "b.csv", with_std([*ROWS, "4,0.06,0.13,NaN,0.2"]))
    refused(cli("fit", model, bad, "--allow-missing"), "wherever y was measured")
    alone = saved(tmp_path, "a.csv", "t_s,z,y_std,z_std\n0,2,1,1\n1,1,1,1\n")
    refused(
        cli("fit", model, alone, "--allow-missing"),
        "column y_std: expected standard deviations of all outputs or none",
    )


def test_standard_deviations_are_stated_once(cli, tmp_path):
    model = saved(tmp_path, "m.toml", TWO)
    record = saved(tmp_path, "r.csv", with_std(ROWS))
    refused(cli("fit", model, record, "--sigma", "0.1"), "column y_std", "together with --sigma")
    bare = saved(tmp_path, "bare.csv", "t_s,y,z\n0,1,2\n1,0.5,1\n2,0.26,0.5\n")
    refused(cli("fit", model, record, bare), f"{bare} has no columns NAME_std, but {record} has")
    refused(cli("fit", model, bare, "--sigma", "y=1"), "the value of z is missing")
    assert cli("fit", model, bare, "--sigma", "y=1, z=2e-3").code == 0


def test_an_output_may_be_called_like_a_standard_deviation(tmp_path):
    model = read_ode_model(saved(tmp_path, "m.toml", TWO.replace('z = "2*x"', 'y_std = "2*x"')))
    record = read_record(saved(tmp_path, "r.csv", "t_s,y,y_std\n0,1,-2\n1,0.5,1\n"), model)
    assert record.sigma is None
    np.testing.assert_array_equal(record.outputs["y_std"], [-2, 1])


@pytest.mark.parametrize(
    ("folder", "truth"),
    [
        ("quasilinearization", {"theta1": 1, "theta2": -1, "theta3": -1}),
        ("three_masses", {"c1": 0.14, "m1": 12, "m2": 28}),
        ("run_down", {"d_x7": 900, "d_x12": 1600, "d_x18": 1300, "m_x12": 196.6167587206449, "blow": 0.05}),
        ("limit_cycle", {"lambda": 3, "x0": 0.1}),
    ],
)
def test_samples_give_the_truth_within_their_intervals(cli, folder, truth):
    outcome = cli("fit", *files(folder), "--json")
    assert outcome.code == 0, outcome.err
    found = outcome.json
    assert found["identifiable"] is True
    assert set(found["parameters"]) == set(truth)
    for name, value in truth.items():
        entry = found["parameters"][name]
        assert abs(entry["value"] - value) < 4 * entry["std"] + 1e-9, name
