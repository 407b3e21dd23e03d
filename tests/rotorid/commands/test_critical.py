"""critical: directions, mesh, map, operating range, errors from a calibration, what is left out."""

from dataclasses import replace

import numpy as np
import pytest
from tables_data import write_csv

import fem
from fem.parameters import spread
from rotorid import read_rotor
from rotorid.commands.critical import CriticalOptions, critical


@pytest.mark.parametrize(("model", "named"), [("", 1), ("shear = true\nrotary_inertia = true", 0)])
def test_what_a_stubby_shaft_lacks_is_one_warning(cli, tmp_path, model, named):
    columns = ["length_m", "diameter_m", "inner_diameter_m", "support_stiffness_N_per_m"]
    shaft = [[0.06, 0.05, "", 1e8], [0.06, 0.05, 0.02, ""], [0.06, 0.05, "", ""], [0, 0.05, "", 1e8]]
    write_csv(tmp_path / "shaft.csv", [columns, *shaft])
    file = tmp_path / "rotor.toml"
    file.write_text(f'shaft = "shaft.csv"\n[model]\n{model}\n')
    document = cli("critical", file, "-n", 3, "--json").json
    said = [text for text in document["warnings"] if "too high" in text]
    assert len(said) == named


def test_critical_speeds_have_their_errors(calibrated):
    found = critical(calibrated, CriticalOptions(number=3))
    rotor = read_rotor(calibrated)
    std = spread(rotor, lambda other: fem.critical_speeds(other, 3).frequencies)
    assert (std > 0).all()
    np.testing.assert_allclose(found.document["critical_speeds_std_rad_s"], std, rtol=1e-9)


def test_a_band_that_cannot_be_given_is_a_warning(calibrated):
    rotor = read_rotor(calibrated)
    wild = fem.Calibration(("bearing[1].stiffness.scale",), [1.0], [[4.0]])
    found = critical(replace(rotor, calibration=wild))
    assert "critical_speeds_std_rad_s" not in found.document
    assert any("no error bands of the critical speeds: within" in text for text in found.document["warnings"])
