"""`rotorid calibrate`: files and options in, numbers or one clear complaint out, and nothing half written."""

from dataclasses import replace

import numpy as np
import pytest
from fem_rotors import rotor23

import fem
from rotorid.samples import sample_data
from rotorid.tables import read_rotor

ROTOR23 = sample_data() / "rotor23.csv"
COMPRESSOR = sample_data() / "compressor" / "rotor.toml"
TRIAL = sample_data() / "calibration" / "trial.toml"
TWO = "bearing[1].stiffness,bearing[2].stiffness"
JOB = """runs = "runs.csv"
weights = "weights.csv"
rotor = "{rotor}"
[errors]
amplitude_percent = 1
[planes.P]
node = 9
radius_mm = 100
[sensors.a]
node = 4
[sensors.b]
node = 20
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def critical(folder, k1=7e7, k2=1.4e8, head="mode,critical_speed_rpm"):
    rotor = fem.Rotor(
        rotor23().length,
        rotor23().outer_diameter,
        discs=rotor23().discs,
        supports=[fem.Support(s.node, k) for s, k in zip(rotor23().supports, (k1, k2), strict=True)],
    )
    speeds = fem.critical_speeds(rotor, 3).frequencies * 30 / np.pi
    path = folder / "critical.csv"
    path.write_text("\n".join([head, *(f"{k},{v:.0f}" for k, v in enumerate(speeds, 1))]) + "\n")
    return path


def test_a_table_of_modes_at_rest(cli, folder):
    """Frequencies and shapes of another stiffness; errors that are not stated are assumed, and said so."""
    supports = [fem.Support(s.node, 9e7) for s in rotor23().supports]
    modes = fem.critical_speeds(replace(rotor23(), supports=supports), 2)
    rows = [
        f"{k + 1},{modes.frequencies[k] / (2 * np.pi):.6f},{node},{-2 * modes.shapes[node - 1, k]:.6f}"
        for k in (0, 1)
        for node in (1, 8, 15, 24)
    ]
    (folder / "modes.csv").write_text("\n".join(["mode,frequency_Hz,node,shape", *rows]) + "\n")
    told = cli("calibrate", ROTOR23, "modes.csv", "--estimate", "bearing.stiffness", "--exact", "--json")
    assert told.code == 0, told.err
    found = told.json["parameters"]["bearing.stiffness"]
    assert found["value"] == pytest.approx(9e7, rel=1e-5)
    assert told.json["degrees_of_freedom"] == 2 + 2 * 4 - 2 - 1
    text = cli("calibrate", ROTOR23, "modes.csv", "--estimate", "bearing.stiffness", "--exact").out
    assert "0.5 % of each frequency is assumed" in text
    assert "5 % of each shape is assumed" in text


def test_the_calibrated_rotor_is_written_with_its_errors(cli, folder):
    told = cli(
        "calibrate", ROTOR23, critical(folder), "--estimate", TWO, "--exact", "--output", "new.toml", "--json"
    )
    assert told.code == 0, told.err
    rotor = read_rotor(folder / "new.toml")
    values = [told.json["parameters"][path]["value"] for path in TWO.split(",")]
    assert [s.stiffness for s in rotor.supports] == pytest.approx(values, rel=1e-9)
    assert rotor.calibration.names == tuple(TWO.split(","))
    stds = [told.json["parameters"][path]["std"] for path in TWO.split(",")]
    assert rotor.calibration.std == pytest.approx(stds, rel=1e-4)
    assert told.json["rotor"] == "new.toml"


def test_the_sample_finds_the_machine_it_was_made_of(cli):
    """Its true numbers stand in make_data.py: each within 3.5 of its deviations."""
    made = {}
    exec(
        (sample_data() / "calibration" / "make_data.py").read_text(encoding="utf-8").split("def main")[0],
        {"__file__": str(TRIAL)},
        made,
    )
    estimate, prior = "bearing[*].*", "bearing[*].*=20%"
    told = cli("calibrate", COMPRESSOR, TRIAL, "--estimate", estimate, "--prior", prior, "--json")
    assert told.code == 0, told.err
    found = told.json["parameters"]
    truth = {path: value for path, value in made["MACHINE"].items() if path in found}
    truth |= {f"probe[{name}].angle": angle for name, angle in made["TURNED"].items()}
    assert len(truth) > 20
    z = {path: (found[path]["value"] - value) / found[path]["std"] for path, value in truth.items()}
    assert max(z.values(), key=abs) == pytest.approx(0, abs=3.5)
    assert np.mean([abs(each) < 1.96 for each in z.values()]) > 0.85


def test_what_is_not_determined_is_null_and_no_rotor_is_written(cli, folder):
    """One critical speed does not tell two stiffnesses."""
    (folder / "one.csv").write_text("mode,critical_speed_rpm\n1,1290\n")
    args = "calibrate", ROTOR23, "one.csv", "--estimate", TWO, "--exact"
    told = cli(*args, "--json")
    assert told.code == 0
    assert [told.json["parameters"][path]["value"] for path in TWO.split(",")] == [None, None]
    assert not told.json["identifiable"]
    refused = cli(*args, "--output", "new.toml", "--plot", "new.png")
    assert refused.code == 2
    assert "new.toml: no rotor file can be written" in refused.err
    assert sorted(path.name for path in folder.iterdir()) == ["one.csv"]
    assert cli(*args, "--output", "new.csv").code == 0  # a table says it in its cells


def job(folder, *, rotor="rotor.csv", runs=("base", "trial"), weights="trial,P,10,0", text=JOB):
    (folder / "rotor.csv").write_bytes(ROTOR23.read_bytes())
    (folder / "job.toml").write_text(text.format(rotor=rotor))
    rows = [
        f"{run},1000,{s},{a},{p}"
        for run, a, p in (("base", 20, 10), ("trial", 25, 40))
        for s in "ab"
        if run in runs
    ]
    (folder / "runs.csv").write_text(
        "\n".join(["run,speed_rpm,sensor,amplitude_um_pp,phase_deg", *rows]) + "\n"
    )
    (folder / "weights.csv").write_text(f"run,plane,mass_g,angle_deg\n{weights}\n")
    return "job.toml"


@pytest.mark.parametrize(
    ("change", "args", "said"),
    [
        (("[planes.P]\nnode = 9\n", "[planes.P]\n"), (), "job.toml: "),
        (("[sensors.b]\nnode = 20\n", ""), (), "[sensors.b]"),
        (('rotor = "{rotor}"\n', ""), (), "rotor"),
        (("radius_mm = 100\n", ""), (), "need the radius of every plane"),
        (("node = 9", "node = 99"), (), "99"),
        (("runs.csv", "none.csv"), (), "none.csv"),
        (("", ""), ("--bow", "1"), "--unbalance-at"),
        (("", ""), ("--bow", "99", "--unbalance-at", "9"), "shapes of a bow, not 99"),
        (("", ""), ("--unbalance-at", ""), "--unbalance-at takes nodes"),
        (("", ""), ("--unbalance-at", "9,9"), "--unbalance-at: one of its nodes stands twice"),
        (("", ""), ("--unbalance-at", "44"), "node 44 does not exist"),
        (("", ""), ("--bow", "-1"), "--bow takes a number from 0"),
        (("", ""), ("job.toml",), "is given twice"),
        (("", ""), ("--prior", "bearing[2].stiffness=5%"), "nothing that is estimated is called"),
        (("", ""), ("--bounds", "bearing[1].stiffness=5:1"), "LOWEST:HIGHEST is needed"),
        (("", ""), ("--bounds", "bearing[1].stiffness=-5:-1"), "must be finite and not negative"),
    ],
)
def test_jobs_and_options_that_cannot_be(cli, folder, change, args, said):
    name = job(folder, text=JOB.replace(*change) if change[0] else JOB)
    before = sorted(path.name for path in folder.iterdir())
    told = cli("calibrate", ROTOR23, name, *args, "--estimate", "bearing[1].stiffness", "--plot", "new.png")
    assert told.code == 2
    assert told.out == ""
    assert said in told.err
    assert told.err.startswith("rotorid: ")
    assert len(told.err.splitlines()) <= 3  # a line for each place
    assert sorted(path.name for path in folder.iterdir()) == before


def test_runs_that_say_nothing_and_another_rotor(cli, folder):
    args = "--estimate", "bearing[1].stiffness"
    told = cli("calibrate", ROTOR23, job(folder, runs=("base",), weights=""), *args)
    assert told.code == 2
    assert "job.toml" in told.err
    same = "\n".join(f"{run},P,10,0" for run in ("base", "trial"))  # and no difference between them
    told = cli("calibrate", ROTOR23, job(folder, weights=same), *args)
    assert told.code == 2
    assert "job.toml: these runs say nothing of the rotor: no weights change" in told.err
    told = cli("calibrate", COMPRESSOR, job(folder), "--estimate", "bearing[1].kxx.scale")
    assert told.code == 2
    assert "job.toml: the job names a rotor of 24 nodes, this one has 25" in told.err
    told = cli("calibrate", ROTOR23, job(folder), *args, "--exact")
    assert told.code == 0, told.err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("mode,critical_speed_rpm\n", "row 1: expected rows below the header"),
        ("mode,speed\n1,5\n", "row 1, column speed"),
        ("critical_speed_rpm\n5\n", "column mode"),
        ("mode,critical_speed_rpm,natural_frequency_Hz\n1,5,6\n", "column natural_frequency_Hz"),
        ("mode,critical_speed_rpm\n0,1290\n", "row 2, column mode: found '0'"),
        ("mode,critical_speed_rpm\n1.5,1290\n", "row 2, column mode: found '1.5'"),
        ("mode,critical_speed_rpm\n1e30,1290\n", "row 2, column mode: found '1e30'"),
        (
            "mode,critical_speed_rpm\n1,1290\n1,5148\n",
            "row 3, column mode: found '1', expected another mode than in row 2",
        ),
        ("mode,critical_speed_rpm\n2,1290\n1,5148\n", "row 2, column critical_speed_rpm: found '1290'"),
        ("mode,critical_speed_rpm\n1,-5\n", "row 2, column critical_speed_rpm: found '-5'"),
        ("mode,critical_speed_rpm\n1,1e300\n", "row 2, column critical_speed_rpm: found '1e300'"),
        ("mode,critical_speed_rpm\n1,abc\n", "row 2, column critical_speed_rpm: found 'abc'"),
        ("mode,critical_speed_rpm,std_percent\n1,1290,0\n", "row 2, column std_percent: found '0'"),
        ("mode,critical_speed_rpm\n99,1290\n", "the model has only 48 critical speeds"),
        ("mode,frequency_Hz,node,shape\n1,21,1,1\n1,21,77,2\n", "row 3, column node: found '77'"),
        ("mode,frequency_Hz,node,shape,frequency_std_percent\n1,21,1,1,0\n", "column frequency_std_percent"),
        ("mode,frequency_Hz,node,shape,shape_std_percent\n1,21,1,1,0\n", "column shape_std_percent"),
    ],
)
def test_tables_that_cannot_be(cli, folder, text, said):
    (folder / "bad.csv").write_text(text)
    told = cli("calibrate", ROTOR23, "bad.csv", "--estimate", "bearing[1].stiffness", "--output", "new.toml")
    assert (told.code, told.out) == (2, "")
    assert said in told.err
    assert [path.name for path in folder.iterdir()] == ["bad.csv"]


def test_critical_speeds_and_an_estimate_that_doubles_them(cli, folder):
    told = cli("calibrate", ROTOR23, critical(folder), "--estimate", "bearing[*].kxx")
    assert told.code == 2
    assert "bearing[1].kxx alone makes supports differ in x and y" in told.err
