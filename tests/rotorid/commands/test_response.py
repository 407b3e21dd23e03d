"""response: readings, orbits, forces, peaks, tables of unbalance, errors from a calibration."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from exact_solutions import exactly

import fem
from fem.parameters import spread
from rotorid import read_rotor
from rotorid.commands.response import ResponseOptions, response
from rotorid.files.small_model import small_model_files
from rotorid.reduction import small_model
from rotorid.samples import sample_data

RPM = np.pi / 30


def test_response_reads_at_angles_and_stations(cli, files, model, tmp_path):
    document = cli(
        "response", files[0], "--unbalance", files[1], "--speeds", "60:1000:10",
        "--sensors", "probe:45,wheel,3:-30", "--operating", "450:550", "--json",
        "--output", tmp_path / "t.csv",
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
    table = pd.read_csv(tmp_path / "t.csv")
    for key in ("amplitude_m", "phase_deg"):
        np.testing.assert_allclose(table[key], np.transpose(document[key]).ravel(), rtol=1e-9, atol=1e-9)
    for k, speed in enumerate(document["bearing_forces"]["largest_at_rad_s"]):
        at = fem.unbalance_response(model, {4: 5e-4, 3: 1e-4j}, [speed]).bearing_forces().largest
        assert document["bearing_forces"]["largest_N"][k] == pytest.approx(at[0, k], rel=1e-6)


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
    (words,) = re.findall(r"Unbalance after API 617 \((.*?)\): (.*?), N = 6500 rpm", " ".join(text.split()))
    rows = re.findall(r"([\d.]+) g·mm at node (\d+)", words[1])
    assert [int(node) for _, node in rows] == list(planes)
    for (size, _), which in zip(rows, planes.values(), strict=True):
        load = sum(loads[i] for i in which)
        assert float(size) == pytest.approx(times * 6350 * load / 6500, rel=1e-3)
    assert words[0] == given


def test_the_deflected_shape_is_drawn(cli, files, tmp_path):
    command = ("response", files[0], "--unbalance", files[1], "--speeds", "60:1000:10", "--sensors", "wheel")
    shape = tmp_path / "shape.png"
    cli(*command, "--view", "shape", "--at", "300", "--plot", shape)
    assert shape.read_bytes().startswith(b"\x89PNG")
