"""Commands on rotor models: critical, campbell, response, influence."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from exact_solutions import exactly
from tables_data import write_csv

import fem
from rotorid.tables import read_influence, read_unbalance, write_rotor
from rotorid.workflows.option_values import band, nodes, sensors

MOUNTED = [["plane", "unbalance_g_mm", "angle_deg"], ["wheel", 500, 0], ["3", 100, 90]]


@pytest.fixture
def model():
    """A small anisotropic rotor whose rear bearing is known from 50 to 2000 rad/s."""
    return fem.Rotor(
        [0.15] * 6,
        0.05,
        discs=[fem.Disc(4, 15.0, 0.15, 0.08, "wheel")],
        supports=[
            fem.Support(1, ((2e7, 0.0), (0.0, 4e7)), 2e3, "front"),
            fem.Support(
                7, (((2e7, 1e5), (-1e5, 4e7)), ((3e7, 1e5), (-1e5, 5e7))), 2e3, "rear", speeds=(50.0, 2000.0)
            ),
        ],
        stations={"wheel": 4, "probe": 2},
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


@pytest.fixture
def files(tmp_path, model):
    write_rotor(tmp_path / "rotor.toml", model)
    write_csv(tmp_path / "u.csv", MOUNTED)
    return tmp_path / "rotor.toml", tmp_path / "u.csv"


def test_campbell_gives_the_keys_of_the_interface(cli, files, model):
    document = cli("campbell", files[0], "--speeds", "50:550:50", "-n", 4, "--json").json
    assert set(document) >= {"speeds_rad_s", "frequencies_rad_s", "log_decrements", "direction", "provenance"}
    expected = fem.campbell(model, np.arange(50.0, 551.0, 50.0), 4)
    np.testing.assert_allclose(document["speeds_rad_s"], expected.speeds)
    np.testing.assert_allclose(np.array(document["frequencies_rad_s"]).T, expected.frequencies, rtol=1e-9)
    np.testing.assert_allclose(np.array(document["log_decrements"]).T, expected.log_decrements, rtol=1e-6)
    assert {way for mode in document["direction"] for way in mode} <= {"forward", "backward", "mixed"}
    for critical in document["damped_critical_speeds"]:
        assert 50 < critical["speed_rad_s"] < 550
    assert [i["file"].rpartition("/")[2] for i in document["provenance"]["inputs"]] == [
        "rotor.toml", "rotor_shaft.csv", "rotor_bearing_2.csv"
    ]  # fmt: skip


def test_response_reads_at_angles_and_stations(cli, files, model):
    document = cli(
        "response", files[0], "--unbalance", files[1], "--speeds", "60:1000:10",
        "--sensors", "probe:45,wheel,3:-30", "--operating", "450:550", "--json",
    ).json  # fmt: skip
    assert document["sensors"] == ["probe at 45°", "wheel", "3 at -30°"]
    speeds = np.array(document["speeds_rad_s"])
    expected = fem.unbalance_response(model, {4: 5e-4, 3: 1e-4j}, speeds)
    Z = expected.at(("probe", 45.0))
    np.testing.assert_allclose(document["amplitude_m"][0], np.abs(Z), rtol=1e-9)
    np.testing.assert_allclose(
        np.exp(1j * np.radians(document["phase_deg"][0])), Z / np.abs(Z), rtol=0, atol=1e-9
    )
    assert np.array(document["amplitude_m"]).shape == (3, speeds.size)
    orbits = document["orbits"]
    assert orbits["nodes"] == [2, 4, 3]
    np.testing.assert_allclose(orbits["major_axis_m"][1], expected.major[:, 3], rtol=1e-9)
    np.testing.assert_allclose(orbits["minor_axis_m"][1], np.abs(expected.minor[:, 3]), rtol=1e-6, atol=1e-15)
    assert {way for node in orbits["direction"] for way in node} <= {"forward", "backward", "straight"}
    assert document["bearing_forces"]["nodes"] == [1, 7]
    peak = next(peak for peak in document["peaks"] if peak["sensor"] == "wheel")
    summit = exactly(fem.unbalance_response, model, {4: 5e-4, 3: 1e-4j}, [peak["speed_rad_s"]])
    assert peak["amplitude"] == pytest.approx(abs(summit.at("wheel")[0]), rel=1e-6)
    assert peak["amplitude"] > max(document["amplitude_m"][1])
    assert peak["amplification_factor"] > 1
    assert peak["separation_margin_percent"] >= 0


def test_response_without_sensors_reads_stations_or_supports(cli, files, tmp_path):
    plain = fem.Rotor([0.3] * 3, 0.05, supports=[fem.Support(1, 1e7, 1e3), fem.Support(4, 1e7, 1e3)])
    write_rotor(tmp_path / "plain.csv", plain)
    write_csv(tmp_path / "n.csv", [["node", "mass_g", "radius_mm", "angle_deg"], [2, 2, 50, 0]])
    command = ("--speeds", "60:200:70", "--json")
    by_stations = cli("response", files[0], "--unbalance", files[1], *command).json
    assert by_stations["sensors"] == ["wheel", "probe"]
    by_supports = cli("response", tmp_path / "plain.csv", "--unbalance", tmp_path / "n.csv", *command).json
    assert by_supports["sensors"] == [1, 4]
    expected = fem.unbalance_response(plain, {2: 1e-4}, [60.0])
    assert by_supports["amplitude_m"][0][0] == pytest.approx(abs(expected.at(1)[0]), rel=1e-9)
    assert {way for node in by_supports["orbits"]["direction"] for way in node} == {"forward"}


def test_table_and_orbits_of_a_response_are_those_of_the_model(cli, files, model, tmp_path):
    command = ("response", files[0], "--unbalance", files[1], "--speeds", "60:1000:10", "--sensors",
               "probe:45,wheel")  # fmt: skip
    document = cli(*command, "--json").json
    assert cli(*command, "--output", tmp_path / "t.csv").code == 0
    speeds = np.arange(60.0, 1001.0, 10.0)
    expected = fem.unbalance_response(model, {4: 5e-4, 3: 1e-4j}, speeds)
    Z = np.stack([expected.at(("probe", 45.0)), expected.at("wheel")], axis=1)
    frame = pd.read_csv(tmp_path / "t.csv")
    np.testing.assert_allclose(frame["speed_rad_s"].to_numpy().reshape(-1, 2), np.stack([speeds, speeds], 1))
    assert frame["sensor"].tolist() == ["probe at 45°", "wheel"] * speeds.size
    found = frame["amplitude_m"] * np.exp(1j * np.radians(frame["phase_deg"]))
    np.testing.assert_allclose(found.to_numpy().reshape(-1, 2), Z, rtol=1e-6)
    for row in document["largest"]:
        at = fem.unbalance_response(model, {4: 5e-4, 3: 1e-4j}, [row["speed_rad_s"]])
        where = ("probe", 45.0) if "probe" in row["sensor"] else "wheel"
        assert row["amplitude_m"] == pytest.approx(abs(at.at(where)[0]), rel=1e-6)
    forces = document["bearing_forces"]
    for k, speed in enumerate(forces["largest_at_rad_s"]):
        at = fem.unbalance_response(model, {4: 5e-4, 3: 1e-4j}, [speed]).bearing_forces().largest
        assert forces["largest_N"][k] == pytest.approx(at[0, k], rel=1e-6)


def test_the_map_reaches_two_decades_beyond_what_the_bearings_have(cli, files):
    document = cli("critical", files[0], "-n", 1, "--map", "--json").json["map"]
    stiffness = document["stiffness_N_per_m"]
    assert (stiffness[0], stiffness[-1]) == pytest.approx((2e7 / 100, 5e7 * 100))
    np.testing.assert_allclose(np.diff(np.log(stiffness)), np.log(250 * 100) / (len(stiffness) - 1))


def test_influence_with_angles_feeds_balance(cli, files, model, tmp_path):
    table = tmp_path / "w.csv"
    document = cli(
        "influence", files[0], "--planes", "wheel,3", "--sensors", "probe:45,6", "--speeds", "100,120",
        "--output", table, "--plot", tmp_path / "w.png", "--json",
    ).json  # fmt: skip
    W = fem.influence(model, ["wheel", 3], [("probe", 45.0), 6], [100.0, 120.0]).W
    sizes = np.array([row["influence"] for row in document["rows"]]).reshape(2, 2, 2)
    np.testing.assert_allclose(sizes, np.abs(W), rtol=1e-9)
    stored = read_influence(table)
    assert stored.sensors == ("probe at 45°", "6")
    assert stored.planes == ("wheel", "3")
    assert (tmp_path / "w.png").read_bytes().startswith(b"\x89PNG")
    frame = pd.read_csv(table)
    assert len(frame) == 8
    np.testing.assert_allclose(stored.W, W, rtol=1e-6)


def test_critical_with_directions_mesh_check_and_map(cli, files, tmp_path):
    document = cli("critical", files[0], "-n", 2, "--mesh-check", "--map", "--json").json
    assert len(document["direction"]) == 2
    assert np.abs(document["mesh_check"]["relative_error"]).max() < 1e-3
    curves = np.array(document["map"]["critical_speeds_rad_s"])
    assert curves.shape == (2, len(document["map"]["stiffness_N_per_m"]))
    assert (np.diff(curves[0]) > 0).all()
    outcome = cli(
        "critical", files[0], "-n", 2, "--map", "--plot", tmp_path / "m.png", "--output", tmp_path / "m.csv"
    )
    assert outcome.code == 0, outcome.err
    assert len(pd.read_csv(tmp_path / "m.csv")) == curves.shape[1]


def test_reduce_takes_stations_and_one_speed(cli, files):
    nodes = ("reduce", files[0], "--nodes", "probe,wheel,6")
    by_name = cli(*nodes, "--modes", 2, "--json").json
    assert by_name["nodes"] == [2, 4, 6]
    assert "--speed takes one speed" in cli(*nodes, "--speed", "100,200").err
    at = cli(*nodes, "--speed", "2000", "--json").json
    assert at["rotor_frequencies_rad_s"][0] > by_name["rotor_frequencies_rad_s"][0]


def test_speeds_in_any_order_and_more_than_once(cli, files):
    for command in (
        ("campbell",),
        ("influence", "--planes", "wheel", "--sensors", "probe"),
        ("response", "--unbalance", files[1]),
    ):
        mixed, sorted_ = (
            cli(command[0], files[0], *command[1:], "--speeds", text, "--json").json
            for text in ("300,100,100,200", "100,200,300")
        )
        del mixed["provenance"], sorted_["provenance"]
        assert mixed == sorted_


def test_criticals_in_the_operating_range_are_listed(cli, files):
    first, second = cli("critical", files[0], "-n", 2, "--json").json["critical_speeds_rad_s"]
    band = f"{0.9 * first}:{first + 0.5 * (second - first)}"
    command = ("critical", files[0], "-n", 2, "--operating", band)
    operating = cli(*command, "--json").json["operating"]
    assert operating["range_rad_s"] == pytest.approx([0.9 * first, (first + second) / 2])
    inside, outside = operating["critical_speeds"]
    assert (inside["inside"], inside["separation_percent"]) == (True, 0.0)
    assert outside["inside"] is False
    assert outside["separation_percent"] == pytest.approx(100 * (second / ((first + second) / 2) - 1))
    command = ("campbell", files[0], "--speeds", "50:800:50", "--operating", "50:800")
    document = cli(*command, "--json").json
    assert len(document["operating"]["critical_speeds"]) == len(document["damped_critical_speeds"]) > 0
    assert all(item["inside"] for item in document["operating"]["critical_speeds"])


def test_the_map_says_what_it_leaves_out(cli, tmp_path):
    rotor = fem.Rotor(
        [0.1] * 8,
        0.05,
        supports=[
            fem.Support(1, 5e7, name="front"),
            fem.Support(9, 5e7, name="rear", pedestal=fem.Pedestal(50.0, 2e8)),
            fem.Support(5, -1e4, kind="seal", name="labyrinth"),
        ],
    )
    write_rotor(tmp_path / "r.toml", rotor)
    said = " ".join(cli("critical", tmp_path / "r.toml", "-n", 1, "--map", "--json").json["warnings"])
    assert "'labyrinth' is left out" in said
    assert "'rear'" in said
    assert "pedestal" in said
    assert "front" not in said


OK_SPEEDS = ("--speeds", "100:200:50")
BAD = [
    (("campbell", "R", "--speeds", "100:3000:100"), "'rear' at node 7: its table holds 50 to 2000 rad/s"),
    (("campbell", "R", *OK_SPEEDS, "-n", "0"), "-n"),
    (("campbell", "R", *OK_SPEEDS, "--operating", "9:5"), "--operating '9:5' is not a range"),
    (("reduce", "R", "--nodes", "2,4", "--speed", "20"), "'rear' at node 7: its table holds 50 to 2000"),
    (("response", "R", "--unbalance", "U", "--speeds", "100:2500:100"), "'rear' at node 7"),
    (("response", "R", "--unbalance", "none.csv", *OK_SPEEDS), "none.csv"),
    (("response", "R", "--unbalance", "U", *OK_SPEEDS, "--sensors", "prope"), "no station is called 'prope'"),
    (("response", "R", "--unbalance", "U", *OK_SPEEDS, "--sensors", "probe:400"), "-360 to 360"),
    (("response", "R", "--unbalance", "U", *OK_SPEEDS, "--sensors", "1,,2"), "with commas"),
    (("response", "R", "--unbalance", "U", *OK_SPEEDS, "--at", "300"), "asked for from 100 to 200 rad/s"),
    (("response", "R", "--unbalance", "U", *OK_SPEEDS, "--at", "100,110"), "--at takes one speed"),
    (("response", "R", "--unbalance", "U", *OK_SPEEDS, "--view", "3d"), "--view"),
    (("influence", "R", "--planes", "wheel", "--sensors", "99:45", *OK_SPEEDS), "node 99 does not exist"),
]


@pytest.mark.parametrize(("args", "message"), BAD)
def test_bad_input_ends_with_status_2_and_one_message(cli, files, args, message):
    outcome = cli(*({"R": files[0], "U": files[1]}.get(arg, arg) for arg in args))
    assert outcome.code == 2
    assert message in outcome.err
    assert "Traceback" not in outcome.err
    assert outcome.out == ""


BAD_UNBALANCE = [
    ([["plane", "unbalance_g_mm"], ["4", 1]], "angle_deg"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["wheal", 1, 0]], "did you mean 'wheel'?"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["9", 1, 0]], "a node from 1 to 7 or a station"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["4", 0, 0]], "a number above 0"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["4", 1, 400]], "an angle from -360 to 360 degrees"),
    ([["plane", "mass_g", "angle_deg"], ["4", 1, 0]], "either a column unbalance_<unit>, or both"),
    ([["plane", "mass_g", "radius_mm", "unbalance_g_mm", "angle_deg"], ["4", 1, 1, 1, 0]], "either a column"),
    ([["unbalance_g_mm", "angle_deg"], [1, 0]], "one column plane or node: a node or a station"),
    ([["plane", "node", "unbalance_g_mm", "angle_deg"], ["4", "4", 1, 0]], "plane or node, not both"),
    ([["plane", "unbalance_gmm", "angle_deg"], ["4", 1, 0]], "unbalance_gmm"),
]  # fmt: skip


@pytest.mark.parametrize(("table", "message"), BAD_UNBALANCE)
def test_bad_unbalance_tables(cli, files, table, message):
    write_csv(files[1], table)
    outcome = cli("response", files[0], "--unbalance", files[1], *OK_SPEEDS)
    assert outcome.code == 2
    assert message in outcome.err
    assert len(outcome.err.strip().splitlines()) == 1


def test_unbalance_of_one_node_adds_up(model, tmp_path):
    table = [["plane", "unbalance_oz_in", "angle_deg"], ["wheel", 1, 0], ["4", 1, 180], ["3", 1, -90]]
    mounted = read_unbalance(write_csv(tmp_path / "u.csv", table), model)
    assert mounted[4] == 0
    assert mounted[3] == pytest.approx(-1j * 0.028349523125 * 0.0254, rel=1e-14)


def test_nodes_sensors_and_ranges_of_the_command_line():
    assert nodes("7, impeller 3,12", "--planes") == [7, "impeller 3", 12]
    assert sensors("2:45,probe DE:-30.5,22") == [(2, 45.0), ("probe DE", -30.5), 22]
    with pytest.raises(ValueError, match=r"--sensors: 'abc' is no angle"):
        sensors("disc:abc")
    assert band("60:120rpm") == pytest.approx((2 * np.pi, 4 * np.pi))
    assert band(None) is None


@pytest.mark.parametrize(("model", "named"), [("", 3), ("shear = true\nrotary_inertia = true", 0)])
def test_what_a_stubby_shaft_lacks_is_one_warning(cli, tmp_path, model, named):
    columns = ["length_m", "diameter_m", "inner_diameter_m", "support_stiffness_N_per_m"]
    shaft = [[0.06, 0.05, "", 1e8], [0.06, 0.05, 0.02, ""], [0.06, 0.05, "", ""], [0, 0.05, "", 1e8]]
    write_csv(tmp_path / "shaft.csv", [columns, *shaft])
    file = tmp_path / "rotor.toml"
    file.write_text(f'shaft = "shaft.csv"\n[model]\n{model}\n')
    document = cli("critical", file, "-n", 3, "--json").json
    said = [text for text in document["warnings"] if "too high" in text]
    assert sum(text.count("mode ") for text in said) == named
    assert len(said) == (named > 0)
