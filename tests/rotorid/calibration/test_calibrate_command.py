"""`rotorid calibrate`: files and options in, numbers or one clear complaint out, and nothing half written."""

import numpy as np
import pytest

from rotorid.files import read_rotor
from rotorid.samples import sample_data

ROTOR23 = sample_data() / "rotor23.csv"
COMPRESSOR = sample_data() / "compressor" / "rotor.toml"
TRIAL = sample_data() / "calibration" / "trial.toml"
TWO = "bearing[1].kxx.scale,bearing[2].kxx.scale"
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


def test_the_calibrated_rotor_is_written_with_its_errors(cli, folder):
    told = cli("calibrate", COMPRESSOR, TRIAL, "--estimate", TWO, "--exact", "--output", "new.toml", "--json")
    assert told.code == 0, told.err
    rotor = read_rotor(folder / "new.toml")
    found = told.json["parameters"]
    assert rotor.calibration.names == (*TWO.split(","), *told.json["exact"])
    was = read_rotor(COMPRESSOR)
    for path, support, old in zip(TWO.split(","), rotor.supports, was.supports, strict=False):
        ratio = np.array(support.stiffness)[:, 0, 0] / np.array(old.stiffness)[:, 0, 0]
        assert ratio == pytest.approx(found[path]["value"], rel=1e-9)
    relative = [found[path]["std"] / found[path]["value"] for path in TWO.split(",")]
    assert rotor.calibration.std[:2] == pytest.approx(relative, rel=1e-4)
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
    """Sensors that read x alone do not tell what acts in y alone."""
    text = JOB.replace("node = 4", "node = 4\nangle_deg = 0").replace("node = 20", "node = 20\nangle_deg = 0")
    name = job(folder, text=text)
    args = "calibrate", ROTOR23, name, "--estimate", "bearing[1].kyy,bearing[2].kyy", "--exact"
    told = cli(*args, "--json")
    assert told.code == 0, told.err
    assert [told.json["parameters"][f"bearing[{k}].kyy"]["value"] for k in (1, 2)] == [None, None]
    assert not told.json["identifiable"]
    refused = cli(*args, "--output", "new.toml")
    assert refused.code == 2
    assert "new.toml: no rotor file can be written" in refused.err
    assert not [path for path in folder.iterdir() if path.name.startswith("new")]
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
        (("[sensors.b]\nnode = 20\n", ""), (), "[sensors.b]"),
        (("radius_mm = 100\n", ""), (), "need the radius of every plane"),
        (("", ""), ("runs.csv",), "expected a job"),
        (("", ""), ("job.toml",), "is given twice"),
    ],
)
def test_jobs_and_options_that_cannot_be(cli, folder, change, args, said):
    name = job(folder, text=JOB.replace(*change) if change[0] else JOB)
    before = sorted(path.name for path in folder.iterdir())
    told = cli("calibrate", ROTOR23, name, *args, "--estimate", "bearing[1].stiffness", "--output", "new.csv")
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
