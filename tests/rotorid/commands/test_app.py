"""The frame: options read once, exit status, what every command on a rotor shares."""

import numpy as np
import pytest

from rotorid.commands.option_values import band, nodes, sensors


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


def test_reduce_takes_stations_and_one_speed(cli, files):
    nodes = ("reduce", files[0], "--nodes", "probe,wheel,6")
    by_name = cli(*nodes, "--modes", 2, "--json").json
    assert by_name["nodes"] == [2, 4, 6]
    assert "--speed takes one speed" in cli(*nodes, "--speed", "100,200").err
    at = cli(*nodes, "--speed", "2000", "--json").json
    assert at["rotor_frequencies_rad_s"][0] > by_name["rotor_frequencies_rad_s"][0]


def test_nodes_sensors_and_ranges_of_the_command_line():
    assert nodes("7, impeller 3,12", "--planes") == [7, "impeller 3", 12]
    assert sensors("2:45,probe DE:-30.5,22") == [(2, 45.0), ("probe DE", -30.5), 22]
    with pytest.raises(ValueError, match=r"--sensors: 'abc' is no angle"):
        sensors("disc:abc")
    assert band("60:120rpm") == pytest.approx((2 * np.pi, 4 * np.pi))
    assert band(None) is None
