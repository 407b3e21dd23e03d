"""`rotorid motion`: what it prints, writes, draws and refuses."""

import dataclasses
import re

import numpy as np
import pandas as pd
import pytest

import fem
from fem import JournalBearing, MuszynskaSeal
from rotorid.commands.motion import MotionOptions, motion
from rotorid.files import read_rotor, write_rotor
from rotorid.samples import sample_data

ROTOR = sample_data() / "motion" / "rotor.toml"


@pytest.fixture
def unbalance(tmp_path):
    path = tmp_path / "unbalance.csv"
    path.write_text("plane,unbalance_g_mm,angle_deg\n12,5000,30\n")
    return path


def test_a_start_in_steady_motion_has_no_transient(unbalance):
    options = {"speed": "4000rpm", "time": 0.4, "unbalance": unbalance, "start": "steady"}
    end = motion(ROTOR, MotionOptions(**options)).result.end
    assert end.periodic
    assert end.period == pytest.approx(60 / 4000)


def test_a_shaft_that_touches_a_seal_in_a_run_up(cli, tmp_path, unbalance):
    # the middle comes to 1.16 mm from the line of bearings near 1400 rpm
    rotor = read_rotor(ROTOR)
    seal = MuszynskaSeal(12, "balance piston", 1e3, 1.0, 0.1, 0.4, 1e-3, 0.5, 0.2)
    path = tmp_path / "rotor.toml"
    write_rotor(path, dataclasses.replace(rotor, forces=[*rotor.forces, seal]))
    told = cli("motion", path, "--run-up", "1000:2000rpm", "--time", "3.3s", "--unbalance", unbalance)
    assert told.code == 2
    where = r"rotorid: the shaft touches the wall of the annular seal 'balance piston' at node 12 after "
    found = re.match(where + r"(.*) s, at (.*) rpm: .* \(--time .* shows it until then\)\n$", told.err)
    time, speed = map(float, found.groups())
    assert 1200 < speed < 1500
    assert speed == pytest.approx(1000 + 1000 * time / 3.3, rel=1e-5)


def test_a_bearing_table_that_ends(cli):
    table = fem.Support(1, np.array([3e7, 4e7])[:, None, None] * np.eye(2), 1e3, speeds=(100.0, 200.0))
    rotor = fem.Rotor(
        length=[0.3, 0.3],
        outer_diameter=0.1,
        supports=[table],
        forces=[JournalBearing(3, "", 0.05, 0.1, 1e-4, 0.02)],
    )
    with pytest.raises(ValueError, match="its table holds"):
        motion(rotor, MotionOptions(run_up=(150.0, 250.0), time=1.0))


def test_the_table_agrees_with_the_document(cli, unbalance, tmp_path):
    given = (
        "motion",
        ROTOR,
        "--run-up",
        "3000:1000rpm",
        "--time",
        "0.5s",
        "--unbalance",
        unbalance,
    )
    document = cli(*given, "--json").json
    told = cli(*given, "--output", tmp_path / "m.csv")
    table = pd.read_csv(tmp_path / "m.csv")
    assert told.out.startswith("From 3000 rpm to 1000 rpm in 0.5000 s")
    np.testing.assert_allclose(table["t_s"], document["time_s"], rtol=1e-12)
    np.testing.assert_allclose(table["speed_rpm"], np.linspace(3000, 1000, len(table)))
    np.testing.assert_allclose(np.radians(table["angle_deg"]), document["angle_rad"], rtol=1e-12)
    for k, axis in enumerate("xy"):
        z = np.array(document["positions_m"]["22"])[:, k]
        np.testing.assert_allclose(table[f"{axis}_22_um"], 1e6 * z, rtol=1e-12)
