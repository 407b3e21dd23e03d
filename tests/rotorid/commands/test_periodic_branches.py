"""`rotorid periodic`: document, table, answer, picture, and what it refuses."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from rotorid.samples import sample_data

ROTOR = sample_data() / "motion" / "rotor.toml"
RANGE = ("--speeds", "6200:6600rpm")
DAMPER = """
nodes = [1]
masses_kg = [25]
weight_N = [0]
shaft_stiffness_N_per_m = [[0]]
[[squeeze_film]]
node = 1
length_mm = 10
diameter_mm = 100
clearance_um = 100
viscosity_mPa_s = 5
centring_stiffness_N_per_m = 1e6
[[unbalance]]
node = 1
unbalance_g_mm = 750
angle_deg = 0
"""


@pytest.mark.full
def test_rest_loses_stability_where_the_linear_rotor_does(cli, tmp_path):
    found = cli("periodic", ROTOR, *RANGE, "--json", "--output", tmp_path / "p.csv").json
    (hopf,) = found["bifurcations"]
    assert hopf["bifurcation"] == "Hopf"
    linear = cli("bearings", ROTOR, "--speeds", "6200:6600:100rpm", "--json").json["stability"]
    assert hopf["speed_rad_s"] == pytest.approx(linear["threshold_rad_s"], rel=1e-5)
    assert hopf["whirl_ratio"] == pytest.approx(0.19, abs=0.002)
    (rest,) = found["branches"]
    assert rest["kind"] == "rest"
    stable = np.array(rest["speeds_rad_s"]) < hopf["speed_rad_s"]
    assert rest["stable"] == stable.tolist()
    table = pd.read_csv(tmp_path / "p.csv")
    np.testing.assert_allclose(table["speed_rad_s"], rest["speeds_rad_s"])
    assert table["stable"].tolist() == rest["stable"]
    assert {"amplitude_2_m", "amplitude_22_m", "largest_multiplier"} <= {*table.columns}


def test_no_bifurcation_says_what_was_tried(cli, tmp_path):
    (tmp_path / "damper.toml").write_text(DAMPER)
    found = cli("periodic", tmp_path / "damper.toml", "--speeds", "590:600")
    assert found.code == 0
    assert "No bifurcation." in found.out
    tried = cli("periodic", tmp_path / "damper.toml", "--speeds", "590:600", "--json").json["tried"]
    assert all(speed in tried for speed in ("5634.08", "5681.83", "5729.58"))
    assert tried.rstrip(".") in " ".join(found.out.split())


@pytest.mark.parametrize("speeds", ["590:600", "600:600"])
def test_a_second_stable_motion_beside_is_found_from_large_whirls(cli, tmp_path, speeds):
    """Both are centred circles in the film, 34 and 90 µm."""
    (tmp_path / "damper.toml").write_text(DAMPER)
    found = cli("periodic", tmp_path / "damper.toml", "--speeds", speeds, "--json").json
    assert [branch["kind"] for branch in found["branches"]] == ["synchronous"] * 2
    assert all(all(branch["stable"]) for branch in found["branches"])
    at_600 = [branch["amplitude_m"][0][-1] for branch in found["branches"]]
    # zeros of (e (1 − r²) + 2 B r e² / (1 − e²)²)² + (π / 2 B r e / (1 − e²)^1.5)² − (u r²)², r = 3
    assert at_600 == pytest.approx([34.2944e-6, 90.3404e-6], abs=3e-9)


def test_linear_rotors_are_answered_at_once_and_sharply(cli, tmp_path):
    """A disc on a shaft with 0.1 % of damping: the peak is 1 / (2 ζ) times the eccentricity."""
    text = """
    nodes = [1]
    masses_kg = [10]
    shaft_stiffness_N_per_m = [[0]]
    [[bearing]]
    node = 1
    stiffness_N_per_m = 1e7
    damping_N_s_per_m = 20
    [[unbalance]]
    node = 1
    unbalance_g_mm = 10
    angle_deg = 0
    """
    (tmp_path / "linear.toml").write_text(text)
    found = cli("periodic", tmp_path / "linear.toml", "--speeds", "10:9000", "--json", "--sensors", "1").json
    (branch,) = found["branches"]
    assert all(branch["stable"])
    assert found["bifurcations"] == []
    assert "linear" in found["tried"]
    assert max(branch["amplitude_m"][0]) == pytest.approx(1e-6 / (2 * 1e-3), rel=1e-3)
    assert len(branch["speeds_rad_s"]) < 400
