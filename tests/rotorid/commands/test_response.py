"""response: readings, orbits, forces, peaks, tables of unbalance, errors from a calibration."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from exact_solutions import exactly
from tables_data import write_csv

import fem
from fem.parameters import spread
from rotorid import read_rotor, write_rotor
from rotorid.commands.response import ResponseOptions, response
from rotorid.files import read_unbalance
from rotorid.files.small_model import small_model_files
from rotorid.reduction import small_model
from rotorid.samples import sample_data

RPM = np.pi / 30
OK_SPEEDS = ("--speeds", "100:200:50")


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
    write_rotor(tmp_path / "plain.toml", plain)
    write_csv(tmp_path / "n.csv", [["plane", "mass_g", "radius_mm", "angle_deg"], [2, 2, 50, 0]])
    command = ("--speeds", "60:200:70", "--json")
    by_stations = cli("response", files[0], "--unbalance", files[1], *command).json
    assert by_stations["sensors"] == ["wheel", "probe"]
    by_supports = cli("response", tmp_path / "plain.toml", "--unbalance", tmp_path / "n.csv", *command).json
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


BAD_UNBALANCE = [
    ([["plane", "unbalance_g_mm"], ["4", 1]], "angle_deg"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["wheal", 1, 0]], "did you mean 'wheel'?"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["9", 1, 0]], "the rotor has nodes 1 to 7"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["4", -1, 0]], "a number of 0 or more"),
    ([["plane", "unbalance_g_mm", "angle_deg"], ["4", 1, 400]], "an angle from -360 to 360 degrees"),
    ([["plane", "mass_g", "angle_deg"], ["4", 1, 0]], "either a column unbalance_<unit>, or both"),
    ([["plane", "mass_g", "radius_mm", "unbalance_g_mm", "angle_deg"], ["4", 1, 1, 1, 0]], "either a column"),
    ([["unbalance_g_mm", "angle_deg"], [1, 0]], "a column plane"),
    ([["plane", "node", "unbalance_g_mm", "angle_deg"], ["4", "4", 1, 0]], "a known column"),
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


def test_amplitudes_have_their_errors(calibrated):
    options = ResponseOptions(speeds="500:3000:50rpm", sensors="2:45,12")
    found = response(calibrated, {12: 1e-3}, options)
    speeds = RPM * np.arange(500.0, 3001.0, 50.0)

    def amplitudes(rotor):
        return np.abs(fem.unbalance_response(rotor, {12: 1e-3}, speeds).readings([(2, 45.0), 12]))

    std = spread(read_rotor(calibrated), amplitudes)
    np.testing.assert_allclose(found.document["amplitude_std_m"], std.T, rtol=1e-4)
    np.testing.assert_allclose(found.to_frame()["amplitude_std_m"], std.ravel(), rtol=1e-4)
    assert [*found.tables[-1].headings][:3] == ["sensor", "largest reading, µm peak", "±"]
    for k, row in enumerate(found.document["largest"]):

        def highest(rotor, at=row["speed_rad_s"]):
            return np.abs(fem.unbalance_response(rotor, {12: 1e-3}, at).readings([(2, 45.0), 12])[0])

        assert row["amplitude_std_m"] == pytest.approx(spread(read_rotor(calibrated), highest)[k], rel=1e-4)
        assert found.tables[-1].columns[2].values[k] == pytest.approx(1e6 * row["amplitude_std_m"])


def test_a_small_model_is_answered_as_a_rotor(cli, tmp_path):
    """Two discs on a massless shaft are their own small model: all numbers but the nodes' are the rotor's."""
    rotor = fem.Rotor(
        [0.1] * 10,
        0.06,
        density=0.0,
        discs=[fem.Disc(4, 30.0), fem.Disc(8, 20.0)],
        supports=[
            fem.Support(1, ((2e7, 3e6), (-2e6, 5e7)), ((2e3, 1e2), (50.0, 3e3)), name="A"),
            fem.Support(11, 5e7, 3e3, name="B"),
        ],
    )
    small, whole = tmp_path / "small.toml", tmp_path / "rotor.toml"
    write_rotor(whole, rotor)
    model = small_model(rotor, (4, 8), (30.0, 20.0))
    small.write_bytes(small_model_files(small, model)[small])
    table = write_csv(
        tmp_path / "u.csv", [["plane", "unbalance_g_mm", "angle_deg"], [4, 200, 30], [8, 50, 0]]
    )
    how = (
        "--unbalance",
        table,
        "--speeds",
        "100:6000:50rpm",
        "--sensors",
        "4,8:90,11",
        "--operating",
        "2500:3000rpm",
    )
    mine, theirs = (cli("response", file, *how, "--json").json for file in (small, whole))
    assert set(mine) == set(theirs)
    np.testing.assert_allclose(mine["amplitude_m"], theirs["amplitude_m"], rtol=1e-7)
    turned = np.subtract(mine["phase_deg"], theirs["phase_deg"]) + 180.0
    np.testing.assert_allclose(turned % 360.0, 180.0, atol=1e-5)
    assert mine["vibration_limit"] == pytest.approx(theirs["vibration_limit"], rel=1e-6)
    for force in ("force_x_N", "force_y_N", "largest_N"):
        np.testing.assert_allclose(mine["bearing_forces"][force], theirs["bearing_forces"][force], rtol=1e-5)
    for one, other in zip(mine["peaks"], theirs["peaks"], strict=True):
        for key in ("speed_rad_s", "amplitude", "amplification_factor", "separation_margin_percent"):
            assert one[key] == pytest.approx(other[key], rel=1e-6) if other[key] else one[key] is None, key
    assert len(mine["peaks"]) >= 3
    made = [tmp_path / name for name in ("p.png", "r.html", "t.csv")]
    cli("response", small, *how, "--plot", made[0], "--report", made[1], "--output", made[2])
    assert all(path.stat().st_size > 1000 for path in made)


def test_an_undamped_small_model_has_one_row_for_each_critical_speed(cli, tmp_path):
    """Its peaks are infinite: forward and backward whirl coincide, and all sensors show the same speeds."""
    rotor = read_rotor(sample_data() / "rotor23.csv")
    small = tmp_path / "small.toml"
    small.write_bytes(small_model_files(small, small_model(rotor, (7, 12, 18), (134.0, 197.0, 157.0)))[small])
    table = write_csv(tmp_path / "u.csv", [["plane", "unbalance_g_mm", "angle_deg"], [12, 1000, 0]])
    outcome = cli(
        "response", small, "--unbalance", table, "--speeds", "500:9000:10rpm", "--sensors", "7,12,18"
    )
    assert outcome.out.startswith("2 critical speeds at 851 speeds")
    assert "practically undamped peaks" in outcome.out
    criticals = small_model(rotor, (7, 12, 18), (134.0, 197.0, 157.0)).critical_speeds(50.0, 900.0)
    for speed in criticals:
        assert f"{speed / RPM:.2f}" in outcome.out


def test_unbalance_of_a_small_model(cli, tmp_path):
    rotor = fem.Rotor([0.5, 0.5], 0.05, density=0.0, discs=[fem.Disc(2, 30.0)],
                      supports=[fem.Support(1, 1e7, 2e3), fem.Support(3, 1e7, 2e3)])  # fmt: skip
    small = tmp_path / "small.toml"
    how = ("response", small, "--speeds", "50:150:10", "--unbalance")
    model = small_model(rotor, (2,), (30.0,))
    small.write_bytes(small_model_files(small, model)[small])
    assert "no unbalance is given" in cli(*how, "own").err
    assert "journals of a rotor" in cli(*how, "api").err
    small.write_bytes(small_model_files(small, replace(model, unbalance={2: 1e-4}))[small])
    document = cli(*how, "own", "--json").json
    k, m, w = 1 / (1 / 2e7 + 1 / model.stiffness[0, 0]), 30.0, 100.0
    assert document["sensors"] == [2, 1, 3]
    amplitude = document["amplitude_m"][0][5]
    assert amplitude == pytest.approx(1e-4 * w**2 / abs(k - m * w**2), rel=1e-2)
    assert "--view shape draws a rotor" in cli(*how, "own", "--view", "shape").err


COMPRESSOR = sample_data() / "compressor"
PROBES = (
    "response", COMPRESSOR / "rotor.toml", "--unbalance", COMPRESSOR / "unbalance.csv", "--sensors",
    "probe DE:45,probe NDE:45",
)  # fmt: skip


def test_one_row_for_each_critical_speed_and_the_limit_beside_the_readings(cli):
    command = (*PROBES, "--speeds", "1000:10000:100rpm", "--operating", "5300:6500rpm")
    text, document = cli(*command).out, cli(*command, "--json").json
    assert len(document["peaks"]) == 4
    table = text.split("\n  peak at")[1].split("\n\n")[0]
    assert table.count("probe") == 2
    assert text.startswith("2 critical speeds far enough")
    speeds = np.array(document["speeds_rad_s"]) / RPM
    inside = np.array(document["amplitude_m"])[:, (speeds >= 5299) & (speeds <= 6501)]
    said = re.search(r"readings reach ([\d.]+) µm peak-to-peak; API 617 allows ([\d.]+) µm", text)
    assert float(said[1]) == pytest.approx(2e6 * inside.max(), rel=2e-3)
    assert float(said[2]) == pytest.approx(25.4 * np.sqrt(12000 / 6500), abs=0.05)


def test_what_is_not_known_says_what_to_do(cli):
    text = cli(*PROBES, "--speeds", "2000:6000:500rpm", "--operating", "5800:6500rpm").out
    assert "give speeds from 2000 to 8190 rpm" in " ".join(text.split())


@pytest.mark.parametrize(
    ("given", "times", "planes"),
    [("api", 1, {13: (0, 1)}), ("api:2", 2, {13: (0, 1)}), ("api:0.5@8,-16", 0.5, {8: (0,), 16: (1,)})],
)
def test_the_unbalance_of_the_standard(cli, given, times, planes):
    """4 W/N: 6350 g·mm·rpm/kg, W the static loads of the journals, N the highest operating speed."""
    command = ("response", COMPRESSOR / "rotor.toml", "--unbalance", given, "--speeds", "5000:6000:500rpm")
    text = cli(*command, "--operating", "5300:6500rpm", "--table").out
    rotor = read_rotor(COMPRESSOR / "rotor.toml")
    static = fem.static_deflection(rotor, 5000 * RPM)
    loads = np.hypot(static.reaction_x, static.reaction_y)[:2] / 9.80665
    rows = [line.split() for line in text.split("What is mounted:")[1].split("\n\n")[0].splitlines()[2:]]
    assert [int(row[0]) for row in rows] == list(planes)
    for k, (row, which) in enumerate(zip(rows, planes.values(), strict=True)):
        load = sum(loads[i] for i in which)
        assert float(row[-2]) == pytest.approx(times * 6350 * load / 6500, rel=1e-3)
        assert float(row[-1]) == 180 * k
    assert f"Unbalance after API 617 ({given})" in text


@pytest.mark.parametrize("given", ["api:0", "api:x", "api@nowhere"])
def test_no_unbalance_of_the_standard(cli, given):
    found = cli("response", COMPRESSOR / "rotor.toml", "--unbalance", given, "--speeds", "5000:6000:500rpm")
    assert found.code == 2
    assert ("--unbalance" if ":" in given else "nowhere") in found.err


def test_the_deflected_shape_is_that_of_all_nodes(cli, files, model, tmp_path):
    command = ("response", files[0], "--unbalance", files[1], "--speeds", "60:1000:10", "--sensors", "wheel")
    shape = tmp_path / "shape.png"
    text = cli(*command, "--table", "--view", "shape", "--at", "300", "--plot", shape).out
    rows = [line.split() for line in text.split("Deflected shape at")[1].splitlines()[2:] if line]
    expected = fem.unbalance_response(model, {4: 5e-4, 3: 1e-4j}, [300.0])
    sizes = [float(row[2]) for row in rows[: model.n_nodes]]
    np.testing.assert_allclose(sizes, 1e6 * expected.major[0], rtol=2e-3)
    assert shape.read_bytes().startswith(b"\x89PNG")
