"""critical, campbell and response of a rotor file with `[calibration]`: errors wherever values are shown."""

from dataclasses import replace

import numpy as np
import pytest

import fem
from fem.parameter_bands import spread
from rotorid import read_rotor, write_rotor
from rotorid.samples import sample_data
from rotorid.workflows.campbell import CampbellOptions, campbell
from rotorid.workflows.critical import CriticalOptions, critical
from rotorid.workflows.response import ResponseOptions, response

NAMES = ("bearing[1].stiffness", "bearing.stiffness.scale", "material.density")
RPM = np.pi / 30


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    plain = read_rotor(sample_data() / "rotor23.csv")
    supports = [replace(support, damping=2e4) for support in plain.supports]
    cov = np.diag(np.square([2e7, 0.03, 60.0]))
    path = tmp_path_factory.mktemp("calibrated") / "rotor.toml"
    write_rotor(path, replace(plain, supports=supports, calibration=fem.Calibration(NAMES, np.ones(3), cov)))
    return path


def test_critical_speeds_have_their_errors(file):
    found = critical(file, CriticalOptions(number=3))
    rotor = read_rotor(file)
    std = spread(rotor, lambda other: fem.critical_speeds(other, 3).frequencies)
    assert (std > 0).all()
    np.testing.assert_allclose(found.document["critical_speeds_std_rad_s"], std, rtol=1e-9)


def test_whirl_frequencies_have_their_errors(file):
    options = CampbellOptions(speeds="500:5500:1000rpm", number=4)
    found = campbell(file, options)
    speeds = RPM * np.arange(500.0, 5501.0, 1000.0)
    std = spread(read_rotor(file), lambda other: fem.campbell(other, speeds, 4).frequencies)
    np.testing.assert_allclose(found.document["frequencies_std_rad_s"], std.T, rtol=1e-6)
    np.testing.assert_allclose(found.to_frame()["frequency_std_rad_s"], std.ravel(), rtol=1e-6)
    shaded = found.figure().axes[0].collections
    assert len(shaded) == 4
    top = shaded[0].get_paths()[0].vertices[:, 1].max()
    wanted = (found.whirl.frequencies[:, 0] + 1.96 * std[:, 0]).max() / RPM
    assert top == pytest.approx(wanted, rel=1e-4)


def test_amplitudes_have_their_errors(file):
    options = ResponseOptions(speeds="500:3000:50rpm", sensors="2:45,12")
    found = response(file, {12: 1e-3}, options)
    speeds = RPM * np.arange(500.0, 3001.0, 50.0)

    def amplitudes(rotor):
        return np.abs(fem.unbalance_response(rotor, {12: 1e-3}, speeds).readings([(2, 45.0), 12]))

    std = spread(read_rotor(file), amplitudes)
    np.testing.assert_allclose(found.document["amplitude_std_m"], std.T, rtol=1e-4)
    np.testing.assert_allclose(found.to_frame()["amplitude_std_m"], std.ravel(), rtol=1e-4)


def test_without_a_calibration_nothing_is_there():
    plain = sample_data() / "rotor23.csv"
    found = critical(plain)
    assert "critical_speeds_std_rad_s" not in found.document
    assert "±" not in found.answer.found
    assert "frequencies_std_rad_s" not in campbell(plain, CampbellOptions(speeds="50,100")).document
    answer = response(plain, {12: 1e-3}, ResponseOptions(speeds="50,100"))
    assert "amplitude_std_m" not in answer.document


def test_a_band_that_cannot_be_given_is_a_warning(file):
    rotor = read_rotor(file)
    wild = fem.Calibration(("bearing[1].stiffness.scale",), [1.0], [[4.0]])
    found = critical(replace(rotor, calibration=wild))
    assert "critical_speeds_std_rad_s" not in found.document
    assert any("no error bands of the critical speeds: within" in text for text in found.document["warnings"])
