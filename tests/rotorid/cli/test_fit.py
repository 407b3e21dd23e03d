"""`rotorid fit`: documents, tables, pictures, and one message for everything that cannot be fitted."""

import numpy as np
import pytest

from rotorid.samples import sample_data

FOLDER = sample_data() / "fit"
MODEL = '[states]\nx = "-a*x"\n[initial]\nx = 1\n[estimate]\na = 0.5\n'


def files(folder, record="record.csv"):
    return FOLDER / folder / "model.toml", FOLDER / folder / record


def saved(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def decay(t, a=1.3):
    x = np.exp(-a * t) + 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    return "t_s,x\n" + "".join(f"{s:.3f},{v:.6f}\n" for s, v in zip(t, x, strict=True))


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


def test_several_records_share_the_parameters(cli, tmp_path):
    model = saved(tmp_path, "m.toml", MODEL)
    first = saved(tmp_path, "a.csv", decay(np.arange(20) / 10))
    second = saved(tmp_path, "b.csv", decay(np.arange(30) / 20))
    alone = cli("fit", model, first, "--json").json["parameters"]["a"]
    both = cli("fit", model, first, second, "--json", "--plot", tmp_path / "p.svg").json
    assert both["parameters"]["a"]["value"] == pytest.approx(1.3, rel=2e-3)
    assert both["parameters"]["a"]["std"] < alone["std"]
    assert len(both["provenance"]["inputs"]) == 3


def test_missing_samples(cli, tmp_path):
    model = saved(tmp_path, "m.toml", MODEL)
    lines = decay(np.arange(30) / 10).splitlines()
    lines[5], lines[9] = "0.400,", "0.800,NaN"
    record = saved(tmp_path, "r.csv", "\n".join(lines))
    refused = cli("fit", model, record)
    assert refused.code == 2
    assert "--allow-missing" in refused.err
    found = cli("fit", model, record, "--allow-missing", "--json").json
    assert found["parameters"]["a"]["value"] == pytest.approx(1.3, rel=2e-3)


def test_a_combination_is_named(cli, tmp_path):
    model = saved(tmp_path, "m.toml", MODEL.replace("-a*x", "-a*b*x") + "b = 2\n")
    outcome = cli("fit", model, saved(tmp_path, "r.csv", decay(np.arange(20) / 10)), "--json")
    assert outcome.code == 0
    found = outcome.json
    assert found["identifiable"] is False
    assert found["parameters"]["a"]["value"] is None
    assert found["unidentifiable"]


def test_iterations_of_the_texts_are_written_as_tables(cli, tmp_path):
    """Tables 2.2 and 2.3 of [Q]; beta and I(beta) by step of [F]; the default method writes parameters."""
    import openpyxl

    scheme = ("--method", "quasilinearization", "--integrator", "sequential-heun")
    book, table = tmp_path / "q.xlsx", tmp_path / "f.csv"
    found = cli("fit", *files("quasilinearization"), *scheme, "--json", "--output", book).json
    sheets = openpyxl.load_workbook(book)
    assert sheets.sheetnames == ["iterations", "x1 by iteration", "x2 by iteration"]
    rows = [row[1:4] for row in sheets["iterations"].iter_rows(min_row=2, values_only=True)]
    steps = [[*step["parameters"].values()] for step in found["history"]]
    np.testing.assert_allclose(np.array(rows, dtype=float), steps, rtol=1e-14)
    assert sheets["x2 by iteration"].max_row == 32
    for method, head in (
        (("--method", "gauss-newton"), "iteration,c1,m1,m2,I(β)"),
        ((), "parameter,value,std"),
    ):
        cli("fit", *files("three_masses"), *method, "--output", table)
        assert table.read_text(encoding="utf-8-sig").startswith(head)
