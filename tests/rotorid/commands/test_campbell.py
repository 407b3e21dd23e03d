"""campbell: keys, numbers, errors from a calibration."""

import numpy as np

import fem
from fem.parameters import spread
from rotorid import read_rotor
from rotorid.commands import CampbellOptions, campbell

RPM = np.pi / 30


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


def test_whirl_frequencies_have_their_errors(calibrated):
    options = CampbellOptions(speeds="500:5500:1000rpm", number=4)
    found = campbell(calibrated, options)
    speeds = RPM * np.arange(500.0, 5501.0, 1000.0)
    std = spread(read_rotor(calibrated), lambda other: fem.campbell(other, speeds, 4).frequencies)
    np.testing.assert_allclose(found.document["frequencies_std_rad_s"], std.T, rtol=1e-6)
    np.testing.assert_allclose(found.to_frame()["frequency_std_rad_s"], std.ravel(), rtol=1e-6)


def test_one_speed_has_one_table(cli, files):
    text = cli("campbell", files[0], "--speeds", "300", "--table").out
    assert text.count("Whirl at") == 1
    assert "-0.0000" not in text
