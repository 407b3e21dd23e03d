"""`rotorid bearings`: what it prints, writes, draws and refuses."""

import numpy as np
import pandas as pd
import pytest

import fem
from fem import CubicSpring, JournalBearing, SqueezeFilm, Stop
from rotorid.commands.bearings import BearingsOptions, bearings
from rotorid.files import read_rotor, write_rotor
from rotorid.reduction import SmallModel
from rotorid.samples import sample_data

ROTOR = sample_data() / "motion" / "rotor.toml"
SPEEDS = ("--speeds", "1000:9000:1000rpm")
BEARING = {"length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.02}


def shaft(forces):
    return fem.Rotor(length=[0.2] * 4, outer_diameter=0.08, forces=forces)


def test_the_threshold_does_not_depend_on_the_steps(cli):
    coarse, fine = (
        cli("bearings", ROTOR, "--speeds", f"1000:9000:{step}rpm", "--json").json["stability"]
        for step in (4000, 250)
    )
    assert coarse["threshold_rpm"] == pytest.approx(6407.0, abs=0.1)
    assert coarse["whirl_ratio"] == pytest.approx(0.191, abs=5e-4)
    assert coarse["threshold_rad_s"] == pytest.approx(fine["threshold_rad_s"], rel=1e-8)


def test_a_shaft_without_weight_has_its_journals_in_the_middle():
    forces = [JournalBearing(node, "", **BEARING) for node in (1, 5)]
    light = fem.Rotor(length=[0.2] * 4, outer_diameter=0.08, density=0.0, forces=forces)
    found = bearings(light, BearingsOptions(speeds=[100.0]))
    assert found.result.equilibria[0].eccentricity == pytest.approx(0)
    assert found.figure().axes[0].get_title().startswith("no load")


@pytest.mark.parametrize(
    ("forces", "words"),
    [
        ([CubicSpring(1, "", 1e6), CubicSpring(5, "", 1e6)], "the rotor has no [[journal_bearing]]"),
        ([SqueezeFilm(1, "", **BEARING, centring_stiffness=1e5), JournalBearing(5, "", **BEARING)],
         "% of its clearance at the squeeze film at node 1"),
    ],
)  # fmt: skip
def test_what_has_no_equilibrium_is_refused(cli, tmp_path, forces, words):
    write_rotor(tmp_path / "rotor.toml", shaft(forces))
    outcome = cli("bearings", tmp_path / "rotor.toml", *SPEEDS, "--output", tmp_path / "out.toml")
    assert (outcome.code, outcome.out) == (2, "")
    assert words in outcome.err
    assert not (tmp_path / "out.toml").exists()


def test_the_linear_rotor_does_not_overwrite_its_own_shaft(cli, tmp_path):
    """Of a rotor in linear_shaft.csv, --output linear.toml would be written over what is read."""
    write_rotor(tmp_path / "linear.toml", read_rotor(ROTOR))
    (tmp_path / "rotor.toml").write_bytes((tmp_path / "linear.toml").read_bytes())
    (tmp_path / "linear.toml").unlink()
    outcome = cli("bearings", tmp_path / "rotor.toml", *SPEEDS, "--output", tmp_path / "linear.toml")
    assert outcome.code == 2
    assert "linear_shaft.csv: this is an input of the command" in outcome.err


RIGID = """
nodes = [1, 2]
masses_kg = [20, 20]
shaft_stiffness_N_per_m = [[0, 0], [0, 0]]
[[journal_bearing]]
node = 1
length_mm = 30
diameter_mm = 100
clearance_um = 100
viscosity_mPa_s = 20
[[journal_bearing]]
node = 2
length_mm = 30
diameter_mm = 100
clearance_um = 100
viscosity_mPa_s = 20
"""


def test_a_rigid_rotor_in_two_films_is_a_small_model(cli, tmp_path):
    """Each half of it is the short bearing of Routh and Hurwitz: M = m c Ω² / W = 7.18997 at ε = 0.2."""
    (tmp_path / "rigid.toml").write_text(RIGID)
    output = tmp_path / "linear.toml"
    found = cli(
        "bearings", tmp_path / "rigid.toml", "--speeds", "100:1200:20", "--json", "--output", output
    ).json
    lost = found["stability"]["threshold_rad_s"]
    at = pd.DataFrame(found["bearings"]).query("node == 1")
    e = np.interp(lost, at["speed_rad_s"], at["eccentricity"])
    mass = 1e-4 * lost**2 / 9.80665
    assert mass == pytest.approx(np.interp(e, [0.1, 0.2, 0.5], [7.51461, 7.18997, 6.46040]), rel=0.01)
    assert found["stability"]["whirl_ratio"] == pytest.approx(0.51, abs=0.01)
    orbit = cli("motion", output, "--speed", "300", "--time", "0.3", "--displaced", "1=1um", "--json").json
    assert orbit["steady"] is False


def test_a_shaft_that_rests_on_its_stop_is_told(cli, tmp_path):
    """The film's spring lets it drop by 0.2 mm, the ring is 0.15 mm away."""
    film = SqueezeFilm(1, "", **BEARING | {"clearance": 1e-3}, centring_stiffness=1e6)
    ring = Stop(1, "ring", gap=1.5e-4, stiffness=1e7)
    rigid = SmallModel((1,), [20.0], [200.0], np.zeros((1, 1)), forces=[film, ring])
    found = bearings(rigid, BearingsOptions(speeds=[100.0, 200.0]))
    assert "the shaft rests on the stop 'ring' at node 1" in found.warnings
    assert found.result.equilibria[0].position == pytest.approx(
        [-1j * (200 + 1e7 * 1.5e-4) / 1.1e7], rel=1e-6
    )
