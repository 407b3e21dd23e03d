"""campbell: keys, numbers, errors from a calibration."""

from dataclasses import replace

import numpy as np
import pytest

import fem
from fem.parameters import spread
from rotorid import read_rotor
from rotorid.commands.campbell import CampbellOptions, campbell

RPM = np.pi / 30


def test_whirl_frequencies_have_their_errors(calibrated):
    options = CampbellOptions(speeds="500:5500:1000rpm", number=4)
    found = campbell(calibrated, options)
    speeds = RPM * np.arange(500.0, 5501.0, 1000.0)
    std = spread(read_rotor(calibrated), lambda other: fem.campbell(other, speeds, 4).frequencies)
    np.testing.assert_allclose(found.document["frequencies_std_rad_s"], std.T, rtol=1e-6)
    np.testing.assert_allclose(found.to_frame()["frequency_std_rad_s"], std.ravel(), rtol=1e-6)


def test_the_mesh_is_checked_by_elements_cut_in_two(cli, files, model):
    document = cli("campbell", files[0], "--speeds", "50:550:100", "-n", 4, "--mesh-check", "--json").json
    speeds = np.arange(50.0, 551.0, 100.0)
    coarse, fine = (fem.campbell(rotor, speeds, 4) for rotor in (model, fem.refined(model, 2)))
    change = np.abs(fine.critical_speeds / coarse.critical_speeds - 1).max()
    assert document["mesh_check"]["critical_speeds_change"] == pytest.approx(change, rel=1e-3)
    assert 0 < document["mesh_check"]["frequencies_change"] < 1e-2


@pytest.mark.parametrize(("place", "node"), [("", 4), ("@probe", 2), ("@3", 3)])
def test_cross_coupling_is_borne_up_to_the_limit_of_stability(cli, files, model, place, node):
    command = ("campbell", files[0], "--speeds", "100:500:100", "--operating", "300:400")
    document = cli(*command, "--cross-coupling", f"0:1e7{place}", "--json").json["cross_coupling"]
    assert (document["node"], document["speed_rad_s"]) == (node, 400.0)
    assert len(document["added_N_per_m"]) == len(document["smallest_log_decrement"])

    def smallest(k):
        seal = fem.Support(node, ((0.0, k), (-k, 0.0)), kind="seal")
        rotor = replace(model, supports=[*model.supports, seal])
        return np.nanmin(fem.campbell(rotor, [400.0], 12).log_decrements)

    limit = document["threshold_N_per_m"]
    assert smallest(0.99 * limit) > 0 > smallest(1.01 * limit)
    assert document["smallest_log_decrement"][0] == pytest.approx(smallest(0.0), rel=1e-6)
    told = cli(*command, "--cross-coupling", f"0:1e7{place}").out
    assert f"It bears {limit:.4g} N/m of cross-coupling at node {node}" in told
